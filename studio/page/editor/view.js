// The lines of a text that are in view, and the margin beside them. There are no more of them than fit.

import { make, write } from '../dom.js';
import { KINDS } from './types.js';

/** The longest line in colour, in code units. A longer one is shown as it is. */
const MOST_COLOURED = 1000;
/** The longest line that is drawn here. With a longer one in view the text area shows its text itself. */
const MOST_DRAWN = 20_000;

/** A part of a line to which a message belongs.
 * @typedef {{ start: number, end: number, severity: 'error' | 'warning' }} Mark */
/** What is shown of a line.
 * @typedef {object} Shown
 * @property {string} text
 * @property {number[] | undefined} tokens
 * @property {Mark[] | undefined} marks
 * @property {boolean} command
 * @property {boolean} breakpoint
 * @property {boolean} current
 */
/** A line in view.
 * @typedef {object} Slot
 * @property {number} line
 * @property {string} shown its text
 * @property {string} colours what else has been drawn of it
 * @property {HTMLElement} text
 * @property {HTMLElement} row
 * @property {HTMLElement} number
 * @property {HTMLButtonElement} button
 */

/**
 * The parts of a line, with their classes.
 * @param {Shown} shown
 * @returns {[string, string][]}
 */
function parts({ text, tokens = [], marks = [] }) {
    const cuts = new Set([0, text.length]);
    tokens.forEach((value, index) => index % 3 < 2 && cuts.add(Math.min(value, text.length)));
    marks.forEach(({ start, end }) => cuts.add(Math.min(start, text.length)).add(Math.min(end, text.length)));
    const places = [...cuts].sort((one, other) => one - other);
    let token = 0;
    return places.slice(0, -1).map((start, index) => {
        while (token < tokens.length && tokens[token + 1] <= start) {
            token += 3;
        }
        const kind = tokens[token] <= start ? [`editor-is-${KINDS[tokens[token + 2]]}`] : [];
        const mark = marks.find((mark) => mark.start <= start && start < mark.end);
        return [text.slice(start, places[index + 1]), [...kind, ...(mark ? [`editor-is-${mark.severity}`] : [])].join(' ')];
    });
}

/**
 * Shows the parts of a line. Elements that are not needed any more are left empty.
 * @param {HTMLElement} element
 * @param {[string, string][]} parts
 */
function draw(element, parts) {
    while (element.childElementCount < parts.length) {
        element.append(document.createElement('span'));
    }
    for (const [index, span] of [...element.children].entries()) {
        const [text, name] = parts[index] ?? ['', ''];
        write(span, text);
        span.className = name;
    }
}

/** The lines in view. */
export class View {
    /** In the order of their lines, which is that of the elements.
     * @type {Slot[]} */
    #slots = [];
    /** The number of them that have a line. */
    #used = 0;

    /**
     * @param {HTMLElement} layer
     * @param {HTMLElement} margin
     */
    constructor(layer, margin) {
        this.layer = layer;
        this.margin = margin;
        this.lineHeight = 1;
    }

    /** Whether a line in view is too long to be drawn. */
    get isTooLong() {
        return this.#slots.slice(0, this.#used).some(({ shown }) => shown.length > MOST_DRAWN);
    }

    /**
     * Shows some lines.
     * @param {number} first
     * @param {number} count
     * @param {(line: number) => Shown} show
     */
    render(first, count, show) {
        while (this.#slots.length < count) {
            this.#add();
        }
        this.#turn(first);
        this.#used = count;
        this.#slots.forEach((slot, index) => {
            slot.text.hidden = slot.row.hidden = index >= count;
            if (index < count) {
                this.#draw(slot, first + index, show(first + index));
            }
        });
    }

    /**
     * Moves what is shown to its place.
     * @param {number} left
     * @param {number} top
     */
    move(left, top) {
        this.layer.style.transform = `translate(${left}px, ${top}px)`;
        this.margin.style.transform = `translateY(${top}px)`;
    }

    #add() {
        const text = make('div', { class: 'editor-line' });
        const row = make('div', { class: 'editor-row' });
        const number = make('span', { class: 'editor-count' });
        const button = make('button', { class: 'editor-break', type: 'button' });
        row.append(number, button);
        this.layer.append(text);
        this.margin.append(row);
        this.#slots.push({ line: -1, shown: '', colours: '', text, row, number, button });
    }

    /**
     * Lines that stay in view keep their elements, and with these the focus.
     * @param {number} first
     */
    #turn(first) {
        const by = first - (this.#slots[0]?.line ?? first);
        if (Math.abs(by) >= this.#slots.length) {
            return;
        }
        for (let step = 0; step < by; step += 1) {
            const slot = /** @type {Slot} */ (this.#slots.shift());
            this.#slots.push(slot);
            this.layer.append(slot.text);
            this.margin.append(slot.row);
        }
        for (let step = 0; step < -by; step += 1) {
            const slot = /** @type {Slot} */ (this.#slots.pop());
            this.#slots.unshift(slot);
            this.layer.prepend(slot.text);
            this.margin.prepend(slot.row);
        }
    }

    /**
     * @param {Slot} slot
     * @param {number} line
     * @param {Shown} shown
     */
    #draw(slot, line, shown) {
        const { text, row, number, button } = slot;
        const isColoured = shown.text.length <= MOST_COLOURED;
        const colours = isColoured ? JSON.stringify([shown.tokens, shown.marks]) : '';
        if (slot.shown !== shown.text || slot.colours !== colours) {
            const isDrawn = shown.text.length <= MOST_DRAWN;
            draw(text, isColoured ? parts(shown) : [[isDrawn ? shown.text : '', '']]);
        }
        if (slot.line !== line) {
            write(number, String(line + 1));
            write(button, String(line + 1));
            button.setAttribute('aria-label', `Breakpoint at line ${line + 1}`);
            button.dataset.line = String(line);
        }
        text.classList.toggle('editor-current', shown.current);
        row.classList.toggle('editor-current', shown.current);
        const severity = shown.marks?.some((mark) => mark.severity === 'error') ? 'error' : shown.marks && 'warning';
        row.classList.toggle('editor-has-error', severity === 'error');
        row.classList.toggle('editor-has-warning', severity === 'warning');
        const canBreak = shown.command || shown.breakpoint;
        button.hidden = !canBreak;
        number.hidden = canBreak;
        button.setAttribute('aria-pressed', String(shown.breakpoint));
        if (shown.current) {
            button.setAttribute('aria-current', 'step');
        } else {
            button.removeAttribute('aria-current');
        }
        slot.line = line;
        slot.shown = shown.text;
        slot.colours = colours;
    }

    /**
     * Gives the focus to the button of a line, and tells whether there is one in view.
     * @param {number} line
     */
    focus(line) {
        const button = this.#slot(line)?.button;
        button?.focus({ preventScroll: true });
        return button !== undefined && !button.hidden;
    }

    /** The line whose button has the focus. */
    get focused() {
        return this.#slots.slice(0, this.#used).find(({ button }) => button === document.activeElement)?.line;
    }

    /** One of the buttons is reached by Tab, the others from there by arrow keys. */
    leaveOneStop() {
        const there = this.#slots.slice(0, this.#used).filter(({ button }) => !button.hidden);
        const stop = there.find(({ button }) => button === document.activeElement) ?? there[0];
        there.forEach((slot) => (slot.button.tabIndex = slot === stop ? 0 : -1));
    }

    /** @param {number} line */
    #slot(line) {
        return this.#slots.slice(0, this.#used).find((slot) => slot.line === line);
    }

    /**
     * Where a column of a line in view begins, from the left of the window.
     * @param {number} line
     * @param {number} column
     */
    left(line, column) {
        const element = this.#slot(line)?.text;
        if (!element) {
            return undefined;
        }
        const nodes = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
        let rest = column;
        for (let node = nodes.nextNode(); node; node = nodes.nextNode()) {
            const { length } = /** @type {Text} */ (node);
            if (rest <= length) {
                const range = document.createRange();
                range.setStart(node, rest);
                return range.getBoundingClientRect().left;
            }
            rest -= length;
        }
        return element.getBoundingClientRect().left;
    }

    /**
     * The column of a line in view that is there; undefined if the line is not.
     * @param {number} line
     * @param {number} x from the left of the window
     */
    column(line, x) {
        const slot = this.#slot(line);
        const length = slot?.shown.length ?? 0;
        const left = (/** @type {number} */ column) => this.left(line, column) ?? Infinity;
        if (length === 0 || x < left(0) || x >= left(length)) {
            return undefined;
        }
        let low = 0;
        let high = length - 1;
        while (low < high) {
            const middle = (low + high + 1) >> 1;
            if (left(middle) <= x) {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        return low;
    }
}
