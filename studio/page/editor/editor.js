// An editor for programs: a text area, and behind it the lines in view in colour. Undo, input methods, find and what programs that
// read the screen see are the browser's own. What the words mean its services know, and not the editor.

import { make } from '../dom.js';
import { Completion } from './completion.js';
import { Explainer } from './explainer.js';
import { Latest } from './latest.js';
import { show, summary } from './messages.js';
import { Model } from './model.js';
import { View } from './view.js';

/** The pause in typing after which a text is checked, in milliseconds. */
const PAUSE = 300;
/** What continues a word, so that it may be completed. Whether there is something to complete the service says. */
const WORD = /^[\p{L}\p{N}_]$/u;
const KEYS = 'F9: breakpoint. Ctrl+Space: complete. Ctrl+I: explain. F12: go to where it is defined.';

let editors = 0;

/** @param {unknown} error */
const words = (error) => (error instanceof Error ? error.message : String(error));

/** A text that is edited, with its breakpoints and messages. */
export class Editor {
    /** The text has been edited.
     * @type {(text: string) => void} */
    onchange = () => undefined;
    /** Somebody has set or removed a breakpoint.
     * @type {(line: number, on: boolean) => void} */
    onbreakpoint = () => undefined;
    /** Lines with breakpoints have moved, or are gone, by an edit.
     * @type {(lines: number[]) => void} */
    onbreakpointsmoved = () => undefined;
    /** Somebody wants to see a place in another file.
     * @type {(file: string, line: number, column: number) => void} */
    onfile = () => undefined;

    #model = new Model();
    #summary = summary([]);
    /** What a chosen completion takes the place of, and where the caret was.
     * @type {{ from: number, to: number, caret: number }} */
    #completed = { from: 0, to: 0, caret: 0 };
    #padding = 0;
    #frame = 0;
    #pause = 0;
    /** The text is not as it was checked last. */
    #isEdited = true;

    /**
     * @param {HTMLElement} root an empty element
     * @param {import('./types.js').Services} services
     * @param {{ name: string, announce: (text: string) => void }} options the name of the text area, and what says a text aloud.
     *     While somebody types, it had better remove no nodes, as setting `textContent` does: see `write`
     */
    constructor(root, services, { name, announce }) {
        this.root = root;
        this.announce = announce;
        this.checks = new Latest(services.check);
        this.completions = new Latest(services.complete);
        this.explainer = new Explainer(services.explain, (place) => this.#lead(place));
        editors += 1;
        const keys = make('p', { class: 'editor-keys', id: `editor-keys-${editors}` });
        keys.textContent = KEYS;
        this.area = make('textarea', { class: 'editor-text',
            'aria-label': name,
            'aria-autocomplete': 'list',
            'aria-haspopup': 'listbox',
            'aria-describedby': keys.id,
            autocapitalize: 'off',
            autocomplete: 'off',
            autocorrect: 'off',
            dir: 'ltr',
            spellcheck: 'false',
            wrap: 'off',
        });
        this.completion = new Completion(this.area, (text) => this.#pick(text));
        // What stands in the layer is found in the text area, and nowhere else.
        const layer = make('div', { class: 'editor-layer', 'aria-hidden': 'true', dir: 'ltr' });
        layer.inert = true;
        const lines = make('div', { class: 'editor-lines' });
        layer.append(lines);
        this.margin = make('div', { class: 'editor-margin', role: 'group', 'aria-label': 'Breakpoints' });
        const rows = make('div', { class: 'editor-rows' });
        this.margin.append(rows);
        this.view = new View(lines, rows);
        const middle = make('div', { class: 'editor-middle' });
        middle.append(layer, this.area, this.completion.list);
        const box = make('div', { class: 'editor-box' });
        box.append(this.margin, middle);
        this.messages = make('ul', { class: 'editor-messages', 'aria-label': 'Messages' });
        root.classList.add('editor');
        root.append(box, this.explainer.root, keys, this.messages);
        this.#listen();
        new ResizeObserver(() => this.#measure()).observe(this.area);
        this.#measure();
    }

    #listen() {
        const { area, margin, explainer } = this;
        area.addEventListener('input', (event) => this.#edited(/** @type {InputEvent} */ (event)));
        area.addEventListener('scroll', () => this.#render());
        area.addEventListener('keydown', (event) => this.#press(event));
        area.addEventListener('blur', () => this.completion.close());
        area.addEventListener('selectionchange', () => area.selectionEnd !== this.#completed.caret && this.completion.close());
        area.addEventListener('pointermove', ({ pointerType, clientX, clientY }) => {
            if (pointerType === 'mouse') {
                explainer.point(() => this.#under(clientX, clientY));
            }
        });
        area.addEventListener('pointerleave', () => explainer.leave());
        // A finger does not rest over a word, but taps it.
        area.addEventListener('click', (event) => {
            if (/** @type {PointerEvent} */ (event).pointerType === 'touch') {
                void this.#explain();
            }
        });
        margin.addEventListener('click', (event) => {
            const { line } = /** @type {HTMLElement} */ (event.target).dataset;
            if (line !== undefined) {
                this.#toggle(Number(line));
            }
        });
        margin.addEventListener('keydown', (event) => this.#pressMargin(event));
        const wheel = (/** @type {WheelEvent} */ event) => {
            area.scrollTop += event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : this.view.lineHeight);
        };
        margin.addEventListener('wheel', wheel, { passive: true });
    }

    /** The text, whose lines end with a line feed. */
    get text() {
        return this.#model.lines.text;
    }

    /**
     * Another text, without breakpoints. There is no undo to the one before.
     * @param {string} text
     */
    setText(text) {
        this.area.value = text;
        this.#forget();
        this.#model.begin(this.area.value);
        this.#showMessages();
        this.area.setSelectionRange(0, 0);
        this.area.scrollTo(0, 0);
        this.#render();
        void this.check();
    }

    /** The lines with breakpoints, in their order. */
    get breakpointLines() {
        return [...this.#model.breakpoints].sort((one, other) => one - other);
    }

    /**
     * Sets the breakpoints.
     * @param {number[]} lines
     */
    breakpoints(lines) {
        this.#model.breakpoints = new Set(lines);
        this.#render();
    }

    /**
     * Shows the line at which the debugger stands.
     * @param {number | null} line
     */
    current(line) {
        this.#model.current = line;
        if (line === null) {
            this.#render();
        } else {
            this.#reveal(line, 0);
        }
    }

    focus() {
        this.area.focus();
    }

    /**
     * Leads to a place.
     * @param {number} line
     * @param {number} column
     */
    goto(line, column) {
        const offset = this.#model.lines.offset(line, column);
        this.#select(offset, offset);
    }

    /** Checks the text now: after an edit that is done by itself, but what else it depends on may have changed. */
    async check() {
        clearTimeout(this.#pause);
        try {
            const checked = await this.checks.ask(this.text);
            if (!checked) {
                return;
            }
            this.#model.take(checked);
            this.#isEdited = false;
            this.#showMessages();
            const told = summary(this.#model.placed);
            if (told !== this.#summary) {
                this.#summary = told;
                this.announce(told);
            }
            this.#render();
        } catch (error) {
            this.explainer.say(words(error), null);
        }
    }

    #showMessages() {
        const hadFocus = this.messages.contains(document.activeElement);
        show(
            this.messages,
            this.#model.placed,
            ({ message: { file, line, start }, from, to }) => {
                if (file === null) {
                    this.#select(from, to);
                } else {
                    this.onfile(file, line, start);
                }
            },
            ({ from, to, isFresh }, instead) => isFresh && this.#replace(from, to, instead),
        );
        if (hadFocus) {
            this.area.focus();
        }
    }

    /** @param {InputEvent | undefined} event */
    #edited(event = undefined) {
        const { value, selectionEnd } = this.area;
        if (value === this.text) {
            return;
        }
        this.#forget();
        this.#isEdited = true;
        const before = this.breakpointLines;
        const change = this.#model.edit(value, selectionEnd);
        this.#frame ||= requestAnimationFrame(() => this.#render());
        this.#pause = setTimeout(() => void this.check(), PAUSE);
        if (event?.inputType === 'insertText' && !event.isComposing && WORD.test(event.data ?? '')) {
            // Until others come, those in an open list take the place of what is longer now.
            const { from, to } = this.#completed;
            this.#completed = { from, to: change.offset(to) ?? selectionEnd, caret: selectionEnd };
            void this.#complete(this.completion.isChosen);
        } else {
            this.completion.close();
        }
        this.onchange(value);
        const after = this.breakpointLines;
        if (String(after) !== String(before)) {
            this.onbreakpointsmoved(after);
        }
    }

    /** What has been asked about the text before an edit is not wanted any more. */
    #forget() {
        clearTimeout(this.#pause);
        this.checks.drop();
        this.completions.drop();
        this.explainer.forget();
    }

    /**
     * Writes something as if it were typed, so that it is undone as that.
     * @param {number} from
     * @param {number} to
     * @param {string} text
     */
    #replace(from, to, text) {
        this.#select(from, to);
        if (!document.execCommand('insertText', false, text)) {
            this.area.setRangeText(text, from, to, 'end');
            this.#edited();
        }
        // Such a text may be a single letter, which has asked for what completes it.
        this.completions.drop();
        this.completion.close();
    }

    /**
     * @param {number} from
     * @param {number} to
     */
    #select(from, to) {
        const { lines } = this.#model;
        this.area.focus({ preventScroll: true });
        this.area.setSelectionRange(from, to);
        const line = lines.at(from);
        this.#reveal(line, from - lines.starts[line]);
    }

    /**
     * Scrolls to a place, if it is not in view.
     * @param {number} line
     * @param {number} column
     */
    #reveal(line, column) {
        const { area, view } = this;
        const top = this.#padding + line * view.lineHeight;
        if (top < area.scrollTop || top + view.lineHeight > area.scrollTop + area.clientHeight) {
            area.scrollTop = top - (area.clientHeight - view.lineHeight) / 2;
        }
        this.#render();
        const left = this.#left(line, column);
        if (left < 0 || left > area.clientWidth - view.lineHeight) {
            area.scrollLeft += left - area.clientWidth / 2;
            this.#render();
        }
        area.scrollIntoView({ block: 'nearest', behavior: 'instant' });
    }

    /**
     * Where a place in view is, from the left of the text area.
     * @param {number} line
     * @param {number} column
     */
    #left(line, column) {
        const edge = this.area.getBoundingClientRect().left;
        return (this.view.left(line, column) ?? edge) - edge;
    }

    #measure() {
        const { lineHeight, paddingTop } = getComputedStyle(this.area);
        this.view.lineHeight = parseFloat(lineHeight) || 1;
        this.#padding = parseFloat(paddingTop) || 0;
        this.#render();
    }

    #render() {
        cancelAnimationFrame(this.#frame);
        this.#frame = 0;
        const { area, view, margin } = this;
        const { scrollTop, scrollLeft, clientHeight } = area;
        const { count } = this.#model.lines;
        const lineAt = (/** @type {number} */ y) => {
            const line = Math.floor((y - this.#padding) / view.lineHeight);
            return Math.min(Math.max(line, 0), count - 1);
        };
        const first = lineAt(scrollTop);
        const { focused } = view;
        view.render(first, lineAt(scrollTop + clientHeight) - first + 1, (line) => this.#model.shown(line));
        view.move(this.#padding - scrollLeft, this.#padding + first * view.lineHeight - scrollTop);
        margin.style.width = `${Math.max(String(count).length, 3) + 3}ch`;
        this.root.classList.toggle('editor-plain', view.isTooLong);
        if (focused !== undefined && !view.focus(focused)) {
            area.focus({ preventScroll: true });
        }
        view.leaveOneStop();
    }

    #caret() {
        const { lines } = this.#model;
        const offset = this.area.selectionEnd;
        const line = lines.at(offset);
        return { line, column: offset - lines.starts[line] };
    }

    /**
     * What is at a point of the window.
     * @param {number} x
     * @param {number} y
     */
    #under(x, y) {
        const top = this.area.getBoundingClientRect().top + this.#padding - this.area.scrollTop;
        const line = Math.floor((y - top) / this.view.lineHeight);
        const column = this.view.column(line, x);
        return column === undefined ? undefined : { text: this.text, line, column };
    }

    /** @param {KeyboardEvent} event */
    #press(event) {
        const { key, ctrlKey, altKey, shiftKey, metaKey, isComposing } = event;
        if (isComposing || altKey || shiftKey || metaKey) {
            return;
        }
        /** @type {Record<string, () => unknown>} */
        const withCtrl = { ' ': () => this.#complete(true), i: () => this.#explain() };
        /** @type {Record<string, () => unknown>} */
        const alone = { F9: () => this.#toggleAtCaret(), F12: () => this.#define() };
        const done = ctrlKey ? withCtrl[key] : alone[key];
        if (done) {
            event.preventDefault();
            void done();
        } else if (!ctrlKey && this.completion.press(key)) {
            event.preventDefault();
        }
    }

    /** @param {KeyboardEvent} event */
    #pressMargin(event) {
        const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
        if (step === undefined) {
            return;
        }
        event.preventDefault();
        const from = Number(/** @type {HTMLElement} */ (event.target).dataset.line);
        const next = this.#model.next(from, step);
        if (next !== undefined) {
            this.#reveal(next, 0);
            this.view.focus(next);
            this.view.leaveOneStop();
        }
    }

    async #toggleAtCaret() {
        const { line } = this.#caret();
        const { text } = this;
        if (this.#isEdited) {
            // Which lines have commands is not known before that.
            await this.check();
        }
        const { commands, breakpoints } = this.#model;
        if (text !== this.text || (!commands.has(line) && !breakpoints.has(line))) {
            this.explainer.say(`Line ${line + 1} has no command`, null);
            return;
        }
        this.#toggle(line);
        this.announce(`Breakpoint at line ${line + 1} ${breakpoints.has(line) ? 'set' : 'removed'}`);
    }

    /** @param {number} line */
    #toggle(line) {
        const { breakpoints } = this.#model;
        const on = !breakpoints.delete(line);
        if (on) {
            breakpoints.add(line);
        }
        this.#render();
        this.onbreakpoint(line, on);
    }

    /** @param {boolean} choose whether somebody has asked for it */
    async #complete(choose) {
        const { area } = this;
        const caret = area.selectionEnd;
        const { line, column } = this.#caret();
        try {
            const answer = await this.completions.ask(this.text, line, column);
            if (!answer || area.selectionEnd !== caret || document.activeElement !== area) {
                return;
            }
            const { items } = answer;
            const begin = this.#model.lines.starts[line];
            const [from, to] = [begin + answer.start, begin + answer.end];
            const isThere = items.length === 1 && items[0].text === this.text.slice(from, to);
            if (items.length === 0 || (!choose && (from === to || isThere))) {
                this.completion.close();
                if (choose) {
                    this.announce('no completions');
                }
                return;
            }
            this.#completed = { from, to, caret };
            this.completion.open(items, choose);
            this.#render();
            const top = this.#padding + line * this.view.lineHeight - area.scrollTop;
            this.completion.place(this.#left(line, answer.start), top, this.view.lineHeight);
            this.announce(items.length === 1 ? '1 completion' : `${items.length} completions`);
        } catch (error) {
            this.explainer.say(words(error), null);
        }
    }

    /** @param {string} text what is chosen of the list */
    #pick(text) {
        const { from, to } = this.#completed;
        const typed = this.text.slice(from, to);
        // What is typed stays, so that it is there when the rest is undone.
        if (text.startsWith(typed)) {
            this.#replace(to, to, text.slice(typed.length));
        } else {
            this.#replace(from, to, text);
        }
    }

    /** Explains what is at the caret. */
    async #explain() {
        const { line, column } = this.#caret();
        const explanation = await this.explainer.explain(this.text, line, column);
        if (explanation === null) {
            this.explainer.say('There is nothing to explain here', null);
        }
        return explanation;
    }

    /** Goes where it is defined what is at the caret. */
    async #define() {
        const place = (await this.#explain())?.place;
        if (place) {
            this.#lead(place);
        }
    }

    /** @param {import('./types.js').Place} place */
    #lead({ file, line, column }) {
        if (file === null) {
            this.goto(line, column);
        } else {
            this.onfile(file, line, column);
        }
    }
}
