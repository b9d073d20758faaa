// The line below the text, in which words are explained.

import { Latest } from './latest.js';
import { make, write } from '../dom.js';

/** How long a pointer rests before what is under it is explained, in milliseconds. */
const REST = 500;

/** Explains what stands at a place. */
export class Explainer {
    /** What was explained last.
     * @type {{ line: number, start: number, end: number } | undefined} */
    #known;
    #rest = 0;

    /**
     * @param {import('./types.js').Services['explain']} explain
     * @param {(place: import('./types.js').Place) => void} lead goes to a place
     */
    constructor(explain, lead) {
        this.service = new Latest(explain);
        this.lead = lead;
        this.status = make('p', { class: 'editor-status', role: 'status', 'aria-label': 'Explanation' });
        this.button = make('button', { class: 'editor-lead', type: 'button' });
        this.button.hidden = true;
        this.root = make('div', { class: 'editor-explained' });
        this.root.append(this.status, this.button);
    }

    /** The text is not the same any more. */
    forget() {
        this.service.drop();
        this.leave();
        this.#known = undefined;
        this.say('', null);
    }

    /**
     * A pointer has moved: what is under it is explained when it rests, unless it just has been.
     * @param {() => { text: string, line: number, column: number } | undefined} under
     */
    point(under) {
        this.leave();
        this.#rest = setTimeout(() => {
            const place = under();
            if (!place) {
                return;
            }
            const { text, line, column } = place;
            const known = this.#known;
            if (known?.line !== line || column < known.start || column >= known.end) {
                void this.explain(text, line, column);
            }
        }, REST);
    }

    /** The pointer is gone. */
    leave() {
        clearTimeout(this.#rest);
    }

    /**
     * Explains a place, and gives what was said of it. Null: there is nothing to say; undefined: that is not wanted any more.
     * @param {string} text
     * @param {number} line
     * @param {number} column
     */
    async explain(text, line, column) {
        try {
            const explanation = await this.service.ask(text, line, column);
            if (explanation) {
                const { start, end } = explanation;
                this.#known = { line, start, end };
                this.say(explanation.words, explanation.place);
            }
            return explanation;
        } catch (error) {
            this.say(error instanceof Error ? error.message : String(error), null);
            return undefined;
        }
    }

    /**
     * @param {string} text
     * @param {import('./types.js').Place | null} place
     */
    say(text, place) {
        if (this.status.textContent !== text) {
            write(this.status, text);
        }
        this.button.hidden = !place;
        if (place) {
            this.button.textContent = `Go to ${place.file === null ? '' : `${place.file}, `}line ${place.line + 1}`;
            this.button.onclick = () => this.lead(place);
        }
    }
}
