// The elements of the panel: buttons, what is told in words, and the plot.

import { NAMES } from './cursors.js';
import { button, labelled, make, press, write } from '../dom.js';
import { STEP, ZOOM } from './gestures.js';
import { seconds, span } from './scale.js';
import { WINDOWS } from './view.js';

const MODES = { live: 'live', paused: 'paused', held: 'put by the trigger' };
const HELP =
    'Arrow keys move the view, + and - zoom, space pauses, Home goes to the first rows, End to the newest ones. Click to put a ' +
    'cursor, which the arrow keys move when it has the focus. Drag to move; the wheel zooms when the plot has the focus.';

/**
 * What the buttons do.
 * @typedef {object} Presses
 * @property {(window: number) => void} resize
 * @property {() => void} pause
 * @property {() => void} live
 * @property {(by: number) => void} pan
 * @property {(factor: number) => void} zoom
 * @property {(cursor: number) => void} cursor
 * @property {(all: boolean) => void} csv
 * @property {() => void} svg
 */

/** @param {Node[]} children */
const row = (...children) => make('div', { class: 'row' }, ...children);

/** The elements. */
export class Widgets {
    /**
     * @param {HTMLElement} root
     * @param {Presses} presses
     * @param {HTMLElement[]} handles of the cursors
     * @param {HTMLElement[]} parts that stand below the plot
     */
    constructor(root, presses, handles, parts) {
        this.window = make('select', {}, ...WINDOWS.map((one) => new Option(span(one), String(one))));
        this.window.onchange = () => presses.resize(Number(this.window.value));
        this.zoomed = new Option();
        this.pause = button('Pause', presses.pause);
        this.live = button('Live', presses.live);
        this.cursors = NAMES.map((name, index) => button(`Cursor ${name}`, () => presses.cursor(index)));
        this.seen = make('span', { class: 'scope-seen' });
        this.rate = make('span', { class: 'scope-rate' });
        this.lost = make('span', { class: 'scope-lost wrong' });
        this.message = make('p', { class: 'scope-message wrong', role: 'status' });
        this.message.setAttribute('aria-label', 'Scope');
        this.canvas = make('canvas');
        this.canvas.setAttribute('aria-hidden', 'true');
        const help = make('p', { id: 'scope-help', class: 'scope-help', text: HELP });
        this.plot = make('div', { class: 'scope-plot', tabindex: '0', role: 'application' }, this.canvas, ...handles);
        this.plot.setAttribute('aria-label', 'Plot');
        this.plot.setAttribute('aria-describedby', help.id);
        const title = make('h2', { id: 'scope-title', text: 'Scope' });
        root.setAttribute('aria-labelledby', title.id);
        root.classList.add('scope');
        root.append(
            title,
            row(
                labelled('Window', this.window),
                this.pause,
                this.live,
                button('Earlier', () => presses.pan(-STEP)),
                button('Later', () => presses.pan(STEP)),
                button('Zoom in', () => presses.zoom(1 / ZOOM)),
                button('Zoom out', () => presses.zoom(ZOOM)),
                ...this.cursors,
            ),
            row(this.seen, this.rate, this.lost),
            this.message,
            this.plot,
            help,
            ...parts,
            row(
                button('CSV of the view', () => presses.csv(false)),
                button('CSV of all rows', () => presses.csv(true)),
                button('SVG of the view', presses.svg),
            ),
        );
    }

    /**
     * Shows what is seen.
     * @param {import('./view.js').View} view
     * @param {boolean} gone whether it is no longer in memory
     * @param {boolean[]} cursors which of them are there
     */
    show(view, gone, cursors) {
        const lacks = gone ? ', which is no longer in memory' : '';
        write(this.seen, `Seen: ${seconds(view.from)} to ${seconds(view.to)}, ${MODES[view.mode]}${lacks}`);
        press(this.pause, view.mode === 'paused');
        press(this.live, view.mode === 'live');
        this.cursors.forEach((one, index) => press(one, cursors[index]));
        const value = String(view.window);
        if (this.window.value !== value) {
            this.zoomed.remove();
            if (!WINDOWS.includes(view.window)) {
                this.zoomed.value = value;
                this.zoomed.text = span(view.window);
                this.window.append(this.zoomed);
            }
            this.window.value = value;
        }
    }
}
