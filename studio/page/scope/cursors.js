// Two cursors, each at the time of a row, and a table of the values there.

import { make, write } from '../dom.js';
import { decimal, seconds } from './scale.js';

export const NAMES = ['A', 'B'];
/** Where a cursor goes that is switched on, as a part of the view. */
const PLACES = [1 / 3, 2 / 3];
/** What is shown where a row has no value. */
const MISSING = '–';

/** The cursors, with a handle of each, which is a slider for keys and readers. */
export class Cursors {
    /**
     * @param {import('./rings.js').Rings} rings
     * @param {import('./view.js').View} view
     * @param {() => void} changed
     */
    constructor(rings, view, changed) {
        this.rings = rings;
        this.view = view;
        this.changed = changed;
        /** @type {(number | undefined)[]} */
        this.times = [undefined, undefined];
        /** @type {import('./frame.js').Curve[]} */
        this.curves = [];
        /** Pixel columns of the plot, which are the steps of the arrow keys. */
        this.columns = 1;
        this.handles = NAMES.map((name, index) => this.#handle(name, index));
        const heads = ['Curve', ...NAMES.map((name) => `Cursor ${name}`), 'B - A'];
        this.body = make('tbody');
        this.table = make(
            'table',
            { class: 'scope-values' },
            make('caption', { text: 'Values at the cursors' }),
            make('thead', {}, make('tr', {}, ...heads.map((text) => make('th', { scope: 'col', text })))),
            this.body,
        );
        this.begin([]);
    }

    /**
     * @param {string} name
     * @param {number} index
     */
    #handle(name, index) {
        const handle = make('div', { class: 'scope-cursor', tabindex: '0', hidden: true }, make('span', { text: name }));
        handle.setAttribute('role', 'slider');
        handle.setAttribute('aria-label', `Cursor ${name}`);
        handle.onkeydown = (event) => this.#key(event, index);
        return handle;
    }

    /**
     * @param {KeyboardEvent} event
     * @param {number} index
     */
    #key(event, index) {
        const { from, to, window } = this.view;
        const time = this.times[index];
        if (time === undefined || event.ctrlKey || event.altKey || event.metaKey) {
            return;
        }
        // From its edge if it is not seen.
        const here = Math.min(Math.max(time, from), to);
        const step = event.shiftKey ? 0 : window / this.columns;
        /** @type {Record<string, () => void>} */
        const keys = {
            ArrowLeft: () => this.#step(index, here - step, -1),
            ArrowDown: () => this.#step(index, here - step, -1),
            ArrowRight: () => this.#step(index, here + step, 1),
            ArrowUp: () => this.#step(index, here + step, 1),
            PageDown: () => this.#step(index, here - window / 10, -1),
            PageUp: () => this.#step(index, here + window / 10, 1),
            Home: () => this.move(index, from),
            End: () => this.move(index, to),
            Delete: () => this.toggle(index),
        };
        if (Object.hasOwn(keys, event.key)) {
            keys[event.key]();
            event.preventDefault();
            // The plot has a meaning for these keys, too.
            event.stopPropagation();
        }
    }

    /**
     * Goes to the row nearest to a time, and at least to the next one.
     * @param {number} index
     * @param {number} time
     * @param {-1 | 1} direction
     */
    #step(index, time, direction) {
        const { rings } = this;
        const before = rings.nearest(this.times[index] ?? time);
        let row = rings.nearest(time);
        if (row === undefined || before === undefined) {
            return;
        }
        if ((row - before) * direction <= 0) {
            row = direction > 0 ? rings.rowAfter(rings.time(before)) : rings.rowAt(rings.time(before)) - 1;
        }
        if (row >= rings.first && row < rings.next) {
            this.move(index, rings.time(row));
        }
    }

    /**
     * Puts a cursor to the row nearest to a time.
     * @param {number} index
     * @param {number} time
     */
    move(index, time) {
        const row = this.rings.nearest(time);
        this.times[index] = row === undefined ? undefined : this.rings.time(row);
        this.#fill();
        this.changed();
    }

    /**
     * Switches a cursor on or off.
     * @param {number} index
     */
    toggle(index) {
        if (this.times[index] === undefined) {
            this.move(index, this.view.from + PLACES[index] * this.view.window);
        } else {
            this.times[index] = undefined;
            this.#fill();
            this.changed();
        }
    }

    /**
     * Puts the first cursor that is not there, or the nearer one.
     * @param {number} time
     */
    put(time) {
        const free = this.times.indexOf(undefined);
        const [a, b] = this.times.map((one) => Math.abs((one ?? 0) - time));
        this.move(free >= 0 ? free : a <= b ? 0 : 1, time);
    }

    /**
     * There are other curves.
     * @param {import('./frame.js').Curve[]} curves
     * @param {boolean} goOn whether the cursors stay where they are
     */
    begin(curves, goOn = false) {
        this.curves = curves;
        if (!goOn) {
            this.times.fill(undefined);
        }
        const heads = ['Time', ...curves.map(({ name, unit }) => (unit === '' ? name : `${name} (${unit})`))];
        const rows = heads.map((text) => {
            return make('tr', {}, make('th', { scope: 'row', text }), make('td'), make('td'), make('td'));
        });
        this.body.replaceChildren(...rows);
    }

    #fill() {
        const { rings } = this;
        const rows = this.times.map((time) => (time === undefined ? undefined : rings.nearest(time)));
        const [a, b] = this.times;
        const apart = a === undefined || b === undefined ? undefined : b - a;
        this.#line(0, [a, b, apart].map((time) => (time === undefined ? '' : seconds(time))));
        this.curves.forEach(({ decimals }, curve) => {
            const values = rows.map((row) => (row === undefined ? undefined : rings.value(curve, row)));
            const texts = values.map((value, index) =>
                rows[index] === undefined ? '' : value === undefined ? MISSING : decimal(value, decimals),
            );
            const [first, second] = values;
            texts.push(first === undefined || second === undefined ? '' : decimal(second - first, decimals));
            this.#line(curve + 1, texts);
        });
    }

    /**
     * @param {number} row
     * @param {string[]} texts
     */
    #line(row, texts) {
        texts.forEach((text, index) => write(this.body.rows[row].cells[index + 1], text));
    }

    /**
     * Puts the handles to their places; one that is not seen waits at its edge.
     * @param {number} left where the plot begins, in pixels
     * @param {number} wide
     */
    place(left, wide) {
        const { from, to, window, oldest, newest, mode } = this.view;
        this.handles.forEach((handle, index) => {
            const time = this.times[index];
            if (handle.hidden !== (time === undefined)) {
                handle.hidden = time === undefined;
            }
            if (time === undefined) {
                return;
            }
            const seen = Math.min(Math.max(time, from), to);
            handle.style.left = `${left + ((seen - from) / window) * wide}px`;
            handle.classList.toggle('scope-outside', seen !== time);
            handle.setAttribute('aria-valuenow', String(Math.round(time)));
            handle.setAttribute('aria-valuetext', seconds(time));
            // Limits that go on with the rows would be told again and again.
            if (mode !== 'live' || !handle.hasAttribute('aria-valuemax')) {
                handle.setAttribute('aria-valuemin', String(Math.floor(Math.min(oldest, time))));
                handle.setAttribute('aria-valuemax', String(Math.ceil(newest)));
            }
        });
    }
}
