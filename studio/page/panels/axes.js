// Each axis in words.

import { make, words } from '../dom.js';
import { Reading, read } from './read.js';

/** @typedef {import('../types.js').StatusLine} StatusLine */

/** What stands before a statement: a shape, and but for what is as it should be a word.
 * @type {Record<import('../types.js').StatusSeverity, [string, string]>} */
const SEVERITIES = {
    fine: ['\u2713', ''],
    note: ['\u2022', 'Note: '],
    warning: ['\u25b3', 'Warning: '],
    error: ['\u2715', 'Error: '],
};

/**
 * A list of statements.
 * @param {HTMLElement} list
 * @param {StatusLine[]} lines
 */
function show(list, lines) {
    const items = lines.map(({ severity, words }) => {
        const [mark, word] = SEVERITIES[severity];
        const shape = make('span', { class: 'status-mark', 'aria-hidden': 'true' }, mark);
        const what = word === '' ? [] : [make('strong', {}, word)];
        return make('li', { class: `status-${severity}` }, shape, make('span', {}, ...what, words));
    });
    list.replaceChildren(...items);
}

/** What makes an error another one: its words without the numbers, which change all the time.
 * @param {StatusLine} line */
const same = ({ words }) => words.replace(/[0-9]+/g, '0');

/** An axis on the page. */
class AxisWords {
    /**
     * @param {import('../types.js').StatusAxis} told
     * @param {import('./read.js').Services} services
     */
    constructor({ axis, requests, latches }, services) {
        this.axis = axis;
        this.count = requests.length;
        this.services = services;
        const name = `Axis ${axis}`;
        this.list = make('ul', { class: 'status-lines', 'aria-label': `${name} in words` });
        this.latched = make('ul', { class: 'status-lines', 'aria-label': `What has stopped axis ${axis}` });
        this.section = make('div', { class: 'status-axis', role: 'group', 'aria-label': name }, make('h3', {}, name), this.list);
        this.drawn = '';
        /** Its errors, as they were told last.
         * @type {Set<string>} */
        this.errors = new Set();
        if (latches) {
            const button = make('button', { type: 'button' }, `What has stopped axis ${axis}?`);
            const aside = make('span', { class: 'status-aside' }, 'reading clears it');
            button.onclick = () => void this.#read(button);
            this.section.append(make('div', { class: 'row' }, button, aside), this.latched);
        }
    }

    /**
     * Draws statements, and gives the errors that were not among those before.
     * @param {StatusLine[]} lines
     */
    draw(lines) {
        const drawn = JSON.stringify(lines);
        if (drawn === this.drawn) {
            return [];
        }
        this.drawn = drawn;
        show(this.list, lines);
        const errors = lines.filter(({ severity }) => severity === 'error');
        const before = this.errors;
        this.errors = new Set(errors.map(same));
        return errors.filter((line) => !before.has(same(line)));
    }

    /** @param {HTMLButtonElement} button */
    async #read(button) {
        const { axis, services } = this;
        // Another press would find nothing: the first one has cleared it.
        if (button.getAttribute('aria-busy') === 'true') {
            return;
        }
        button.setAttribute('aria-busy', 'true');
        try {
            /** @type {import('../types.js').StatusLines} */
            const { lines } = await services.job(`What has stopped axis ${axis}`, 'status_errors', { axis });
            show(this.latched, lines);
            services.announce(lines.map(({ words }) => `Axis ${axis}: ${words}`).join('. '));
        } catch (error) {
            show(this.latched, [{ severity: 'warning', words: `it could not be read: ${words(error)}` }]);
            services.announce(`Axis ${axis}: ${words(error)}`);
        }
        button.removeAttribute('aria-busy');
    }
}

/** All axes of the module. */
export class AxesPanel {
    /**
     * @param {HTMLElement} root
     * @param {import('./read.js').Services} services
     */
    constructor(root, services) {
        this.root = root;
        this.services = services;
        this.root.classList.add('status-axes');
        this.reading = new Reading(services);
        this.gone();
    }

    /**
     * A module is there, perhaps the same as before.
     * @param {import('./read.js').There} there
     */
    async module(there) {
        this.gone();
        const { services } = this;
        const { product } = there;
        const told = await this.reading.begin(there, (why) => this.root.replaceChildren(make('p', {}, why)));
        if (!told) {
            return;
        }
        const axes = told.axes.map((axis) => new AxisWords(axis, services));
        this.root.replaceChildren(...axes.map(({ section }) => section));
        const ask = (/** @type {AxisWords} */ { axis, count }, /** @type {number} */ from, /** @type {(number | null)[]} */ values) =>
            services.ask('status_words', { product, axis, values: values.slice(from, from + count) });
        this.reading.end = read(
            this.root,
            services,
            told.axes.flatMap(({ requests }) => requests),
            (values) => {
                let from = 0;
                const asked = axes.map((axis) => {
                    const answer = ask(axis, from, values);
                    from += axis.count;
                    return answer;
                });
                return Promise.all(asked);
            },
            (all) => this.#draw(axes, all),
        );
    }

    /** The module is there no more. */
    gone() {
        this.reading.stop();
        this.root.replaceChildren(make('p', {}, 'no module'));
    }

    /**
     * Draws all axes. An error that several have at once, as with a supply that is too low, is announced once.
     * @param {AxisWords[]} axes
     * @param {import('../types.js').StatusLines[]} all
     */
    #draw(axes, all) {
        /** @type {Map<string, number[]>} */
        const found = new Map();
        axes.forEach((axis, at) => {
            axis.draw(all[at].lines).forEach(({ words }) => found.set(words, [...(found.get(words) ?? []), axis.axis]));
        });
        const texts = [...found].map(([words, numbers]) => `Axis ${numbers.join(', ')}: ${words}`);
        if (texts.length > 0) {
            this.services.announce(texts.join('. '));
        }
    }
}
