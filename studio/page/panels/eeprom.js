// What the EEPROMs of virtual modules have: kept by the browser, one for each product, saved and opened as files of `tmcl sim --eeprom`.

import { at, button, make, words, write } from '../dom.js';
import { keep, kept } from '../keep.js';

/** Most bytes of a file: more than the largest EEPROM of a product has. */
const MOST = 1024 * 1024;

/** @param {string} product */
const place = (product) => `eeprom/${product}`;

/** @param {string} hex two digits for each byte */
const bytes = (hex) => Uint8Array.from(hex.match(/../g) ?? [], (pair) => Number.parseInt(pair, 16));

/** @param {Uint8Array} contents */
const hexadecimal = (contents) => Array.from(contents, (byte) => byte.toString(16).padStart(2, '0')).join('');

/** The EEPROMs. */
export class Eeprom {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        this.product = /** @type {HTMLSelectElement} */ (at('product'));
        this.choice = /** @type {HTMLSelectElement} */ (at('eeprom'));
        this.told = make('p', { role: 'status', 'aria-label': 'EEPROM' });
        /** The module of which that was decided last, and the product whose EEPROM is kept as it changes, if it is.
         * @type {import('../types.js').Start | undefined} */
        this.started = undefined;
        /** @type {string | undefined} */
        this.keeps = undefined;
        this.isAsked = false;
        this.isDue = false;
        this.save = button('Save EEPROM', () => void this.#save());
        at('eeprom-tools').append(
            this.save,
            button('Open EEPROM', () => void this.#open()),
            button('Erase EEPROM', () => void this.#erase()),
            this.told,
        );
        /** The user has chosen so, although there is another one. */
        this.wantsFresh = false;
        this.choice.addEventListener('change', () => (this.wantsFresh = this.choice.value === 'fresh'));
        this.product.addEventListener('change', () => this.#offer());
        window.addEventListener('storage', ({ key }) => {
            if (this.keeps !== undefined && key?.endsWith(place(this.keeps))) {
                this.keeps = undefined;
                write(this.told, 'another tab keeps this EEPROM now: what this module stores is not kept any more');
            }
            this.#offer();
        });
        this.#offer();
    }

    /** Offers what is kept of the product that is chosen. */
    #offer() {
        const isKept = this.#kept(this.product.value) !== null;
        this.choice.replaceChildren(
            ...(isKept ? [new Option('as it was left', 'kept')] : []),
            new Option('as it leaves the factory', 'fresh'),
        );
        this.choice.value = isKept && !this.wantsFresh ? 'kept' : 'fresh';
    }

    /** @param {string} product */
    #kept(product) {
        const found = kept(place(product));
        return typeof found === 'string' ? found : null;
    }

    /**
     * What a module of this product is to have.
     * @param {string} product
     */
    wanted(product) {
        return this.choice.value === 'kept' ? this.#kept(product) : null;
    }

    /** @param {import('../workbench.js').There} there */
    module({ product, started, curves }) {
        if (started !== this.started) {
            this.started = started;
            // What somebody keeps is not overwritten by a module that has begun without it, nor by a session.
            const isOwn = started?.eeprom != null || this.#kept(product ?? '') === null;
            this.keeps = started && product !== null && curves === undefined && isOwn ? product : undefined;
            const why = started && !isOwn ? 'what this module stores is not kept: another EEPROM is' : '';
            write(this.told, curves === undefined ? why : 'what this module stores is not kept: it comes from a session');
        }
        if (this.isDue) {
            void this.#keep();
        }
    }

    gone() {
        this.isDue = false;
    }

    /**
     * What the link tells.
     * @param {any} told
     */
    hear(told) {
        if (told.stored !== undefined) {
            this.isDue = true;
            void this.#keep();
        }
    }

    /** Keeps what the EEPROM has, once more if it has changed meanwhile. */
    async #keep() {
        if (this.isAsked) {
            return;
        }
        this.isAsked = true;
        while (this.isDue && this.keeps !== undefined) {
            this.isDue = false;
            const { keeps } = this;
            try {
                /** @type {import('../types.js').Contents} */
                const { eeprom } = await this.bench.session.ask({ eeprom: true });
                if (keeps === this.keeps) {
                    write(this.told, keep(place(keeps), eeprom));
                }
            } catch {
                // The link is just closed: what it had last is kept.
            }
        }
        this.isAsked = false;
        this.#offer();
    }

    async #save() {
        try {
            /** @type {import('../types.js').Contents} */
            const { eeprom } = await this.bench.session.ask({ eeprom: true });
            this.bench.download(`tmcm${this.bench.there?.product ?? ''}.eeprom`, bytes(eeprom), 'application/octet-stream');
        } catch (error) {
            write(this.told, words(error));
        }
    }

    async #open() {
        const product = this.product.value;
        try {
            const file = await this.bench.openBytes('.eeprom,.bin,application/octet-stream', MOST);
            if (!file) {
                return;
            }
            const eeprom = hexadecimal(file.bytes);
            // The size has to be that of the product.
            await this.bench.ask('world_offers', { product, world: null, eeprom });
            const lines = [`What the EEPROM of the virtual TMCM-${product} had, as this browser keeps it, is lost.`];
            if (this.#kept(product) === null || (await this.bench.question(`Open ${file.name}?`, lines, 'Open'))) {
                // One that runs does not overwrite it.
                this.keeps = undefined;
                const why = keep(place(product), eeprom);
                this.wantsFresh = false;
                this.#offer();
                write(this.told, why === '' ? `${file.name}: the next TMCM-${product} that is started has it; what this one stores is not kept` : why);
            }
        } catch (error) {
            write(this.told, words(error));
        }
    }

    async #erase() {
        const product = this.product.value;
        const lines = [`What the EEPROM of the virtual TMCM-${product} had, as this browser keeps it, is lost.`];
        if (await this.bench.question('Erase this EEPROM?', lines, 'Erase')) {
            this.keeps = undefined;
            keep(place(product), null);
            this.#offer();
            write(this.told, `the next TMCM-${product} that is started is as it leaves the factory; what this one stores is not kept`);
        }
    }
}
