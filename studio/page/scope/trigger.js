// The trigger: it fires when a curve goes over a level.

import { seconds } from './scale.js';

/** @typedef {{ curve: string, edge: 'rising' | 'falling', level: number, single: boolean }} Settings an empty `curve` is none */

/** A trigger, and whether it has fired. */
export class Trigger {
    constructor() {
        /** @type {Settings} */
        this.settings = { curve: '', edge: 'rising', level: 0, single: false };
        /** The number of the curve, or -1 if it is none of those there are. */
        this.curve = -1;
        /** When it has fired last.
         * @type {number | undefined} */
        this.fired = undefined;
        /** @type {number | undefined} */
        this.before = undefined;
    }

    /**
     * There are other curves, or other settings: it is armed.
     * @param {{ name: string }[]} curves
     */
    arm(curves) {
        this.curve = this.settings.curve === '' ? -1 : curves.findIndex(({ name }) => name === this.settings.curve);
        this.fired = undefined;
        this.before = undefined;
    }

    /** Whether it fires no more until it is armed again. */
    get done() {
        return this.settings.single && this.fired !== undefined;
    }

    /**
     * Takes the value of a row, and tells whether it fires.
     * @param {number} at
     * @param {number | null} value
     * @param {boolean} may whether it may fire
     */
    take(at, value, may) {
        if (value === null) {
            return false;
        }
        const { before, settings } = this;
        this.before = value;
        if (before === undefined || !may || this.done) {
            return false;
        }
        const { edge, level } = settings;
        const fires = edge === 'rising' ? before < level && value >= level : before > level && value <= level;
        if (fires) {
            this.fired = at;
        }
        return fires;
    }

    /**
     * Its state in words.
     * @param {boolean} paused whether the view is
     */
    words(paused) {
        const { curve } = this.settings;
        if (curve === '') {
            return 'off';
        }
        if (this.curve < 0) {
            return `waits for a curve of the name ${curve}`;
        }
        const fired = this.fired === undefined ? '' : `fired at ${seconds(this.fired)}`;
        if (this.done) {
            return fired;
        }
        const armed = paused ? 'armed, but the view is paused' : 'armed';
        return fired === '' ? armed : `${fired}, ${armed}`;
    }
}
