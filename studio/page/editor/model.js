// What is known of a text: the words of its lines, commands, breakpoints and messages, all of which go with it when it is edited.

import { Change, Lines } from './text.js';

/** A message with its place; one whose place has been edited since is not fresh any more, nor is one of another file.
 * @typedef {{ message: import('./types.js').Message, from: number, to: number, isFresh: boolean }} Placed */

/**
 * Where lines are after an edit, without those that are gone.
 * @param {Set<number>} lines
 * @param {Change} change
 */
function moved(lines, change) {
    /** @type {Set<number>} */
    const now = new Set();
    for (const line of lines) {
        const place = change.line(line);
        if (place !== null) {
            now.add(place);
        }
    }
    return now;
}

/** A text and what is known of it. */
export class Model {
    lines = new Lines('');
    /** Of each line its words; not of one that has been edited since.
     * @type {(number[] | undefined)[]} */
    tokens = [undefined];
    /** @type {Set<number>} */
    commands = new Set();
    /** @type {Set<number>} */
    breakpoints = new Set();
    /** The line at which the debugger stands.
     * @type {number | null} */
    current = null;
    /** @type {Placed[]} */
    placed = [];
    /** @type {Map<number, import('./view.js').Mark[]>} */
    marks = new Map();

    /**
     * Begins with another text, of which nothing is known.
     * @param {string} text
     */
    begin(text) {
        this.lines = new Lines(text);
        this.tokens = new Array(this.lines.count).fill(undefined);
        this.commands.clear();
        this.breakpoints.clear();
        this.current = null;
        this.#place([]);
    }

    /** @param {import('./types.js').Checked} checked */
    take({ lines, messages, commands }) {
        this.tokens = Array.from({ length: this.lines.count }, (_, line) => lines[line]);
        this.commands = new Set(commands);
        this.#place(messages);
    }

    /** @param {import('./types.js').Message[]} messages */
    #place(messages) {
        this.placed = messages.map((message) => {
            const [from, to] = [message.start, message.end].map((column) => this.lines.offset(message.line, column));
            return { message, from, to, isFresh: message.file === null };
        });
        this.#mark();
    }

    /** Marks the parts of lines to which messages belong. */
    #mark() {
        this.marks = new Map();
        for (const { message, from, to } of this.placed.filter(({ isFresh }) => isFresh)) {
            const line = this.lines.at(from);
            const begin = this.lines.starts[line];
            // A place without a width is shown at the letter after it, or before it at the end of the line.
            const start = Math.min(from - begin, Math.max(this.lines.end(line) - begin - 1, 0));
            const mark = { start, end: Math.max(to - begin, start + 1), severity: message.severity };
            const marks = this.marks.get(line);
            if (marks) {
                marks.push(mark);
            } else {
                this.marks.set(line, [mark]);
            }
        }
    }

    /**
     * Goes with an edit, and tells what it was.
     * @param {string} text what the text is now
     * @param {number} caret the end of what is new
     */
    edit(text, caret) {
        const lines = new Lines(text);
        const change = new Change(this.lines, lines, caret);
        this.lines = lines;
        this.tokens = change.lines(this.tokens);
        this.commands = moved(this.commands, change);
        this.breakpoints = moved(this.breakpoints, change);
        this.current = this.current === null ? null : change.line(this.current);
        for (const placed of this.placed.filter(({ message }) => message.file === null)) {
            const isTouched = change.start <= placed.to && placed.from <= change.end;
            placed.isFresh &&= !isTouched;
            placed.from = change.offset(placed.from) ?? change.start;
            placed.to = change.offset(placed.to) ?? change.start;
        }
        this.#mark();
        return change;
    }

    /**
     * What is shown of a line.
     * @param {number} line
     * @returns {import('./view.js').Shown}
     */
    shown(line) {
        return {
            text: this.lines.line(line),
            tokens: this.tokens[line],
            marks: this.marks.get(line),
            command: this.commands.has(line),
            breakpoint: this.breakpoints.has(line),
            current: this.current === line,
        };
    }

    /**
     * The next line with a command or a breakpoint, if there is one.
     * @param {number} from
     * @param {number} step 1 or -1
     */
    next(from, step) {
        const there = [...this.commands, ...this.breakpoints].filter((line) => (line - from) * step > 0);
        /** @type {number | undefined} */
        let next;
        for (const line of there) {
            next = next === undefined || (next - line) * step > 0 ? line : next;
        }
        return next;
    }
}
