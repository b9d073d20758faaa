// The user's texts, which the browser keeps. Another tab may have the same ones: what it has written is not overwritten.

import { forgetText, freeName, keepText, keptText, keptTexts } from '../keep.js';

/** The text that is there at first. */
const FIRST = { name: 'program.tmc', text: 'Loop: MVP REL, 0, 51200\nWAIT POS, 0, 0\nJA Loop\n' };

/** The texts. */
export class Texts {
    /** @param {(why: string) => void} tell takes what the user has to know */
    constructor(tell) {
        this.tell = tell;
        /** @type {Map<string, { text: string, version: number }>} */
        this.all = new Map();
        keptTexts().forEach((name) => this.#take(name));
        if (this.all.size === 0) {
            this.all.set(FIRST.name, { text: FIRST.text, version: 0 });
        }
    }

    /** @param {string} name */
    #take(name) {
        const found = keptText(name);
        if (found) {
            this.all.set(name, found);
        }
    }

    /** The names, in their order. */
    get names() {
        return [...this.all.keys()].sort();
    }

    /** @param {string} name */
    text(name) {
        return this.all.get(name)?.text ?? '';
    }

    /** All texts, for the assembler. */
    get list() {
        return [...this.all].map(([name, { text }]) => ({ name, text }));
    }

    /**
     * A name that no text has, like this one.
     * @param {string} name
     */
    free(name) {
        return freeName(name, (other) => this.all.has(other) || keptText(other) !== null);
    }

    /**
     * Changes a text, or makes it. Gives the name under which it is kept: another one, if another tab has changed it meanwhile.
     * @param {string} name
     * @param {string} text
     * @returns {string}
     */
    change(name, text) {
        const known = this.all.get(name);
        if (known?.text === text && known.version > 0) {
            return name;
        }
        const done = keepText(name, text, known?.version ?? 0);
        if (done === 'changed') {
            const other = this.free(name);
            this.tell(`${name} was changed in another tab: this one's is ${other} from now on`);
            this.#take(name);
            return this.change(other, text);
        }
        this.all.set(name, { text, version: done.version });
        if (done.why !== '') {
            this.tell(done.why);
        }
        return name;
    }

    /** @param {string} name */
    remove(name) {
        this.all.delete(name);
        forgetText(name);
        if (this.all.size === 0) {
            this.all.set(FIRST.name, { text: FIRST.text, version: 0 });
        }
    }
}
