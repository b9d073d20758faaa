// The curves of the scope: which ones, and where their rows come from.

import { at, button, make, words } from '../dom.js';
import { keep, kept } from '../keep.js';
import { ScopePanel } from '../scope/panel.js';

/** Most curves at once. */
const MOST = 12;

/** The scope with its curves. */
export class Curves {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        const changed = () => keep('scope', this.scope.state());
        this.scope = new ScopePanel(at('scope'), { download: bench.download, announce: bench.announce, changed });
        const before = kept('scope');
        if (before !== null) {
            this.scope.restore(before);
        }
        /** @type {import('../types.js').Curve[]} */
        this.offers = [];
        /** @type {string[]} */
        this.texts = [];
        /** The curves of a session that is done again.
         * @type {string[] | undefined} */
        this.played = undefined;
        this.end = () => {};
        this.choice = make('input', { type: 'text', list: 'curve-names', 'aria-label': 'Curve', placeholder: 'a curve' });
        this.names = make('datalist', { id: 'curve-names' });
        this.add = button('Add curve', () => void this.#add());
        this.shown = make('ul', { class: 'chips', 'aria-label': 'Curves' });
        this.state = make('p', { role: 'status', 'aria-label': 'Curve' });
        at('curves').append(make('div', { class: 'row' }, this.choice, this.names, this.add), this.shown, this.state);
        this.choice.addEventListener('keydown', (event) => event.key === 'Enter' && void this.#add());
        this.gone();
    }

    /** @param {string[]} texts */
    #wanted(texts) {
        const { address = 1, product = null, isVirtual = false } = this.bench.there ?? {};
        return { address, product, is_virtual: isVirtual, texts };
    }

    /** @param {import('../workbench.js').There} there */
    async module(there) {
        const isTakenOver = there.curves !== undefined && this.played === there.curves;
        await this.#offer(there.curves, isTakenOver);
        this.played = undefined;
    }

    /** @param {import('../workbench.js').There} there */
    async looks({ curves }) {
        this.played = curves;
        await this.#offer(curves, false);
        this.add.disabled = true;
    }

    /**
     * Offers what there is, and shows these curves, or those that are kept.
     * @param {string[] | undefined} wanted
     * @param {boolean} goesOn whether the rows of the same module go on
     */
    async #offer(wanted, goesOn) {
        /** @type {import('../types.js').Offers} */
        const { curves, usual } = await this.bench.ask('scope_offers', this.#wanted([]));
        this.offers = curves;
        this.names.replaceChildren(...curves.map(({ text, name, group }) => new Option(`${group}: ${name}`, text)));
        const before = wanted ?? this.#kept()[this.#product];
        const has = (/** @type {unknown} */ text) => curves.some((curve) => curve.text === text);
        const texts = Array.isArray(before) ? before.filter(has).slice(0, MOST) : [];
        this.add.disabled = false;
        if (!goesOn) {
            // Rows of another module, or of another time, do not go on.
            this.scope.columns([]);
        }
        await this.#show(texts.length > 0 ? texts : usual, wanted === undefined);
    }

    /** The product whose curves these are. */
    get #product() {
        return this.bench.there?.product ?? 'unknown';
    }

    /** The curves that are kept, by the product.
     * @returns {Record<string, unknown>} */
    #kept() {
        const before = kept('curves');
        return typeof before === 'object' && before !== null && !Array.isArray(before) ? before : {};
    }

    gone() {
        this.end();
        this.end = () => {};
        this.add.disabled = true;
    }

    async #add() {
        const typed = this.choice.value.trim();
        if (typed === '' || this.add.disabled) {
            return;
        }
        const named = this.offers.find((offer) => [offer.name, offer.text, `${offer.group}: ${offer.name}`].includes(typed));
        const text = named?.text ?? typed;
        if (this.texts.includes(text) || (await this.#show([...this.texts, text]))) {
            this.choice.value = '';
        }
    }

    /**
     * Shows these curves from now on. False if one of them does not exist.
     * @param {string[]} texts
     * @param {boolean} isKept whether they are kept for the next visit: those of a session are not
     */
    async #show(texts, isKept = true) {
        const { bench } = this;
        try {
            /** @type {import('../types.js').Offers} */
            const { curves } = await bench.ask('scope_curves', this.#wanted(texts));
            this.texts = texts;
            if (isKept) {
                keep('curves', { ...this.#kept(), [this.#product]: texts });
            }
            this.end();
            this.scope.columns(curves);
            this.end = bench.session.watch(
                curves,
                true,
                (rows) => this.scope.rows(rows),
                (rate) => this.scope.rate(`${Math.round(rate)} rows a second`),
            );
            const chip = (/** @type {import('../types.js').Curve} */ { name, text, note }) => {
                const others = texts.filter((other) => other !== text);
                const remove = button('Remove', () => void this.#show(others), { 'aria-label': `Remove: ${name}` });
                return make('li', {}, name, note === '' ? '' : ` (${note})`, ' ', remove);
            };
            this.shown.replaceChildren(...curves.map(chip));
            this.state.textContent = '';
            return true;
        } catch (error) {
            this.state.textContent = words(error);
            return false;
        }
    }
}
