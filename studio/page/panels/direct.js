// Direct mode: a line, its reply, what could be typed, and what has gone over the link.

import { addLine, at, button, make, scrollToEnd, words } from '../dom.js';
import { keep, kept } from '../keep.js';

/** Most lines that are kept for the next visit. */
const MOST_KEPT = 200;
/** Most proposals that are shown. */
const MOST_PROPOSALS = 12;
/** Most lines of the log. */
const MOST_LOGGED = 5000;
/** Time between two looks at what has gone over the link, in milliseconds. */
const LOOK = 250;

/** The panel of direct mode. */
export class Direct {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        this.line = /** @type {HTMLInputElement} */ (at('line'));
        this.send = /** @type {HTMLButtonElement} */ (at('send'));
        const before = kept('history');
        /** @type {string[]} */
        this.history = Array.isArray(before) ? before.filter((line) => typeof line === 'string').slice(-MOST_KEPT) : [];
        this.older = 0;
        /** @type {string[]} */
        this.logged = [];
        this.following = false;
        at('direct').onsubmit = (event) => {
            event.preventDefault();
            void this.#send();
        };
        this.line.onkeydown = (event) => this.#key(event);
        this.line.oninput = () => void this.#propose();
        at('log').addEventListener('toggle', () => void this.#follow());
        at('log-tools').append(
            button('Save', () => bench.download('telegrams.log', this.logged.map((line) => `${line}\n`).join(''))),
            button('Clear', () => this.#show(this.logged.splice(0).slice(0, 0))),
        );
    }

    module() {
        this.send.disabled = false;
        void this.#follow();
    }

    gone() {
        this.send.disabled = true;
    }

    async #send() {
        const typed = this.line.value.trim();
        if (typed === '' || this.send.disabled) {
            return;
        }
        const { there } = this.bench;
        /** @type {import('../types.js').ParameterWords} */
        const { lines } = await this.bench.ask('parameters_typed', { line: typed, product: there?.product ?? null });
        const isMeant = lines.length === 0 || (await this.bench.question(`Send ${typed}?`, lines, 'Send'));
        // What was meant for one module is not sent to another.
        if (!isMeant || there !== this.bench.there) {
            return;
        }
        this.history.push(typed);
        keep('history', this.history.slice(-MOST_KEPT));
        this.older = 0;
        this.line.value = '';
        at('proposals').replaceChildren();
        try {
            /** @type {import('../types.js').Text} */
            const { text, done } = await this.bench.quick('tools_send', { line: typed });
            addLine(at('replies'), text, !done);
        } catch (error) {
            const why = words(error);
            addLine(at('replies'), why.startsWith(`${typed}:`) ? why : `${typed}: ${why}`, true);
        }
    }

    /** @param {KeyboardEvent} event */
    #key(event) {
        const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
        if (step) {
            this.older = Math.min(Math.max(this.older + step, 0), this.history.length);
            this.line.value = this.older === 0 ? '' : (this.history.at(-this.older) ?? '');
            event.preventDefault();
        }
    }

    /** Shows what could stand where the cursor is. */
    async #propose() {
        const line = this.line.value;
        const column = this.line.selectionStart ?? line.length;
        const product = this.bench.there?.product ?? null;
        const { start, end, items } = await this.bench.ask('line_complete', { line, column, product });
        if (line !== this.line.value) {
            return;
        }
        /** @param {{ text: string, note: string }} item */
        const proposal = ({ text, note }) =>
            button(text, () => {
                this.line.setRangeText(text, start, end, 'end');
                at('proposals').replaceChildren();
                this.line.focus();
            }, { title: note, 'aria-label': note === '' ? text : `${text}, ${note}` });
        const shown = line === '' ? [] : items.slice(0, MOST_PROPOSALS);
        at('proposals').replaceChildren(...shown.map(proposal));
    }

    /** Shows what goes over the link, as long as somebody looks. */
    async #follow() {
        if (!(/** @type {HTMLDetailsElement} */ (at('log')).open) || !this.bench.there || this.following) {
            return;
        }
        this.following = true;
        while (/** @type {HTMLDetailsElement} */ (at('log')).open && this.bench.there) {
            try {
                const { text } = await this.bench.session.ask({ log: true });
                this.#show(text.split('\n').filter((/** @type {string} */ line) => line !== ''));
            } catch {
                // The link is just closed.
            }
            await new Promise((resolve) => setTimeout(resolve, LOOK));
        }
        this.following = false;
    }

    /** @param {string[]} lines */
    #show(lines) {
        this.logged.push(...lines);
        this.logged.splice(0, this.logged.length - MOST_LOGGED);
        const body = at('telegrams');
        if (this.logged.length === 0) {
            body.replaceChildren();
        }
        body.append(...lines.map((text) => make('li', { text })));
        while (body.childElementCount > this.logged.length) {
            body.firstElementChild?.remove();
        }
        if (lines.length > 0) {
            scrollToEnd(body);
        }
    }
}
