// The legend: a button for each curve, by which it is hidden or shown, with its colour and its marker.

import { make, press } from '../dom.js';
import { marker } from './markers.js';
import { canvasPen } from './pens.js';

const WIDE = 30;
const HIGH = 16;

/** The legend, whose samples also tell what the colours are: only the style sheet knows. */
export class Legend {
    /** @param {(curve: number) => void} toggle */
    constructor(toggle) {
        this.toggle = toggle;
        this.element = make('ul', { class: 'scope-legend' });
        this.element.setAttribute('aria-label', 'Curves');
        /** @type {{ button: HTMLButtonElement, sample: HTMLCanvasElement }[]} */
        this.entries = [];
    }

    /**
     * Begins anew with other curves.
     * @param {import('./frame.js').Curve[]} curves
     */
    begin(curves) {
        this.entries = curves.map(({ name, unit }, curve) => {
            const sample = make('canvas', { class: `scope-sample scope-curve-${curve + 1}` });
            sample.setAttribute('aria-hidden', 'true');
            const words = make('span', { text: unit === '' ? name : `${name} (${unit})` });
            return { sample, button: make('button', { type: 'button', onclick: () => this.toggle(curve) }, sample, words) };
        });
        const items = this.entries.map(({ button }, curve) => {
            const { note } = curves[curve];
            return make('li', {}, button, ...(note === '' ? [] : [make('span', { class: 'scope-note', text: note })]));
        });
        this.element.replaceChildren(...items);
    }

    /**
     * Shows which curves are seen.
     * @param {boolean[]} shown
     */
    show(shown) {
        this.entries.forEach(({ button }, curve) => press(button, shown[curve]));
    }

    /** The colours of the curves. */
    colours() {
        return this.entries.map(({ sample }) => getComputedStyle(sample).color);
    }

    /**
     * Draws the samples anew.
     * @param {import('./paint.js').Palette} palette
     * @param {number} ratio
     */
    draw(palette, ratio) {
        this.entries.forEach(({ sample }, curve) => {
            sample.width = Math.round(WIDE * ratio);
            sample.height = Math.round(HIGH * ratio);
            const context = sample.getContext('2d');
            if (context) {
                entry(canvasPen(context, WIDE, HIGH, ratio, palette.back), curve, 0, HIGH / 2, palette);
            }
        });
    }
}

/**
 * Draws a piece of a curve with its marker.
 * @param {import('./pens.js').Pen} pen
 * @param {number} curve
 * @param {number} x
 * @param {number} y
 * @param {import('./paint.js').Palette} palette
 */
export function entry(pen, curve, x, y, palette) {
    pen.begin();
    pen.move(x + 1, y);
    pen.line(x + WIDE - 1, y);
    pen.stroke(palette.curves[curve], 1.5);
    marker(pen, curve, x + WIDE / 2, y, palette.curves[curve], palette.back);
}
