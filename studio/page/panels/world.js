// The world of a virtual module: its motors and stages drawn, things to touch, its time, and the lines that do all that.

import { addLine, at, button, make, words } from '../dom.js';
import { control } from '../world/touch.js';
import { Stage } from '../world/stage.js';
import { Time } from '../world/time.js';

/** @typedef {import('../types.js').WorldOffers} WorldOffers */
/** @typedef {import('../types.js').WorldSeen} WorldSeen */

/** Time between two looks at the world, in milliseconds; and where nothing is to move. */
const LOOK = 40;
const STILL = 1000;
/** What is drawn of an axis, and what stands in its table: the curve of each, and its name. */
const SHOWN = [
    ['rotor', 'rotor (1/256 full steps)'],
    ['lost_steps', 'lost full steps'],
    ['current', 'current (1/32)'],
    ['load', 'load'],
];
const SWITCHES = ['left', 'right', 'home'];

/** The panel. */
export class World {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        /** Counts the modules, so that what was asked for one is not shown for another. */
        this.turn = 0;
        /** @type {string[]} */
        this.lines = [];
        /** The module whose lines these are.
         * @type {import('../types.js').Start | undefined} */
        this.started = undefined;
        const carryOut = (/** @type {string} */ line) => void this.#carryOut(line);
        this.time = new Time(carryOut);
        at('time').append(this.time.element);
        at('control-tools').append(
            button('Copy lines', () => void this.#copy()),
            button('Save lines', () => bench.download('world.txt', this.lines.map((line) => `${line}\n`).join(''))),
        );
        at('control').onsubmit = (event) => {
            event.preventDefault();
            const around = /** @type {HTMLInputElement} */ (at('around'));
            const typed = around.value.trim();
            around.value = '';
            void this.#carryOut(typed);
        };
    }

    /** @param {import('../workbench.js').There} there */
    async module({ isVirtual, started }) {
        this.gone();
        if (!isVirtual || !started) {
            return;
        }
        at('world').hidden = false;
        if (started !== this.started) {
            this.started = started;
            this.lines = [];
        }
        const { turn } = this;
        /** @type {WorldOffers} */
        const offers = await this.bench.ask('world_offers', started);
        if (turn === this.turn) {
            void this.#follow(this.#show(offers), turn);
        }
    }

    /** @param {import('../workbench.js').There} there */
    looks(there) {
        return this.module(there);
    }

    gone() {
        this.turn += 1;
        at('world').hidden = true;
        at('stage').replaceChildren();
        at('touch').replaceChildren();
    }

    /**
     * What a watch tells, and what the module says of itself.
     * @param {any} told
     */
    hear(told) {
        if (told.line !== undefined) {
            addLine(at('answers'), told.line);
        } else if (told.message !== undefined) {
            addLine(at('answers'), told.message, true);
        }
    }

    /**
     * Shows what there is. Gives the curves that are looked at, and what takes their values.
     * @param {WorldOffers} offers
     */
    #show({ touchables, stages }) {
        /** @type {Map<string, ((value: number | null) => void)[]>} */
        const shown = new Map();
        const watch = (/** @type {string} */ curve, /** @type {(value: number | null) => void} */ show) =>
            shown.set(curve, [...(shown.get(curve) ?? []), show]);
        at('stage').replaceChildren(...stages.map((stage, axis) => this.#axis(stage, axis, watch)));
        const groups = [...new Set(touchables.map(({ axis }) => axis))].map((axis) => {
            const controls = touchables.filter((one) => one.axis === axis).map((one) => {
                const { element, show } = control(one, (line) => void this.#carryOut(line));
                if (one.shown !== null) {
                    watch(one.shown, show);
                }
                return element;
            });
            const summary = make('summary', { text: axis === null ? 'Board' : `Axis ${axis}` });
            return make('details', { open: axis === null || stages.length === 1 }, summary, make('div', { class: 'world-controls' }, ...controls));
        });
        at('touch').replaceChildren(...groups);
        return shown;
    }

    /**
     * An axis drawn, with a table of the same values.
     * @param {import('../types.js').WorldStage} stage
     * @param {number} axis
     * @param {(curve: string, show: (value: number | null) => void) => void} watch
     */
    #axis(stage, axis, watch) {
        const drawing = new Stage(stage, `Rotor and stage of axis ${axis}`);
        /** @type {Set<string>} */
        const closed = new Set();
        let rotor = 0;
        const rows = SHOWN.map(([curve, name]) => {
            const cell = make('td', { text: '-' });
            watch(`${curve} ${axis}`, (value) => {
                const text = value === null ? '-' : String(value);
                if (cell.textContent !== text) {
                    cell.textContent = text;
                }
                if (curve === 'rotor' && value !== null) {
                    rotor = value;
                    drawing.show(rotor, [...closed]);
                }
            });
            return make('tr', {}, make('th', { scope: 'row', text: name }), cell);
        });
        SWITCHES.forEach((name) =>
            watch(`switches.${name} ${axis}`, (value) => {
                value === 1 ? closed.add(name) : closed.delete(name);
                drawing.show(rotor, [...closed]);
            }),
        );
        const caption = make('caption', { text: `Axis ${axis}` });
        return make('figure', { class: 'world-axis' }, drawing.element, make('table', {}, caption, make('tbody', {}, ...rows)));
    }

    /**
     * Looks at the world again and again, as long as it is that of this module.
     * @param {Map<string, ((value: number | null) => void)[]>} shown
     * @param {number} turn
     */
    async #follow(shown, turn) {
        const texts = [...shown.keys()];
        const still = matchMedia('(prefers-reduced-motion: reduce)');
        while (turn === this.turn) {
            if (at('world').checkVisibility()) {
                try {
                    /** @type {WorldSeen} */
                    const seen = await this.bench.session.ask({ see: texts });
                    if (turn === this.turn) {
                        this.time.show(seen);
                        texts.forEach((text, index) => shown.get(text)?.forEach((show) => show(seen.row.values[index])));
                    }
                } catch {
                    // The link is just closed, or opened anew.
                }
            }
            await new Promise((resolve) => setTimeout(resolve, still.matches ? STILL : LOOK));
        }
    }

    /**
     * Carries a line out, and shows it with its answer.
     * @param {string} line
     */
    async #carryOut(line) {
        const shown = make('code', { text: line });
        try {
            const answer = await this.bench.session.ask({ control: line });
            const isDone = JSON.parse(answer).ok === true;
            this.#answer(shown, answer, !isDone);
            if (isDone) {
                this.lines.push(line);
            }
        } catch (error) {
            this.#answer(shown, words(error), true);
        }
    }

    /**
     * @param {HTMLElement} line
     * @param {string} answer
     * @param {boolean} wrong
     */
    #answer(line, answer, wrong) {
        addLine(at('answers'), answer, wrong);
        at('answers').lastElementChild?.prepend(line, '\n');
    }

    /** Puts the lines into the clipboard. */
    async #copy() {
        try {
            await navigator.clipboard.writeText(this.lines.join('\n'));
            this.bench.announce('copied');
        } catch (error) {
            addLine(at('answers'), `the browser does not let pages copy: ${words(error)}`, true);
        }
    }
}
