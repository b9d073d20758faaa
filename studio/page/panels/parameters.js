// The parameters of a module: shown, written, stored, and compared with files.

import { button, make, words } from '../dom.js';
import { Files } from './parameters/files.js';
import { Finder } from './parameters/finder.js';
import { checked } from './parameters/kept.js';
import { Known, key } from './parameters/known.js';
import { Row } from './parameters/row.js';
import { Units } from './parameters/units.js';

/** @typedef {import('../types.js').ParameterPlace} ParameterPlace */
/** @typedef {import('../types.js').ParameterTold} ParameterTold */

/**
 * What the panel needs of the page.
 * @typedef {object} Services
 * @property {(door: string, asked: object) => Promise<any>} ask asks at a door that needs no module
 * @property {(name: string, door: string, asked: object) => Promise<any>} job gives the tools a job at the module
 * @property {(title: string, lines: string[], confirm: string) => Promise<boolean>} question
 * @property {(name: string, text: string, type: string) => void} download
 * @property {(accept: string) => Promise<{ name: string, text: string } | null>} openFile
 * @property {(text: string) => void} announce has something read aloud
 * @property {() => void} [changed] what `state` gives is something else now
 */

const HEADINGS = ['Favourite', 'Parameter', 'Value', 'Unit', 'Takes', 'Default', 'State', 'Actions'];

/** The panel. */
export class ParametersPanel {
    /**
     * @param {HTMLElement} root
     * @param {Services} services
     * @param {{ name?: string }} options the beginning of the name of an exported file
     */
    constructor(root, services, options = {}) {
        this.services = services;
        this.kept = checked(null);
        /** Counts the modules and axes, so that what was asked for one is not shown for another. */
        this.turn = 0;
        /** @type {{ product: string | null, axes: number } | undefined} */
        this.there = undefined;
        this.axis = 0;
        /** @type {Row[]} */
        this.rows = [];
        this.known = new Known();
        this.finder = new Finder(() => {
            this.#filter();
            this.services.changed?.();
        });
        this.buttons = [
            button('Read all', () => void this.#do(() => this.#readAll())),
            button('Store all changed', () => void this.#do(() => this.#store('Store all changed', this.#changedPlaces()))),
            button('Store all', () => void this.#do(() => this.#store('Store all', null))),
            button('Export', () => void this.#do(() => this.files.export())),
            button('Import', () => void this.#do(() => this.files.import())),
        ];
        this.said = make('p', { role: 'status', 'aria-label': 'State of the parameters', class: 'parameter-said' });
        this.shown = make('p', { role: 'status', 'aria-label': 'Parameters shown', class: 'parameter-said' });
        this.body = make('tbody', { role: 'rowgroup' });
        const headings = HEADINGS.map((text) => make('th', { role: 'columnheader', scope: 'col', text }));
        const head = make('thead', { role: 'rowgroup' }, make('tr', { role: 'row' }, ...headings));
        this.table = make('table', { role: 'table', 'aria-label': 'Parameters', class: 'parameter-table' }, head, this.body);
        this.imports = make('div');
        this.unitsPlace = make('div');
        this.files = new Files(this.#around(), options.name ?? 'settings');
        root.classList.add('parameters');
        const tools = make('div', { class: 'row' }, ...this.buttons);
        root.replaceChildren(tools, this.said, this.imports, this.finder.element, this.unitsPlace, this.shown, this.table);
        this.#take(this.kept);
        this.gone();
    }

    /**
     * What files have to do with.
     * @returns {import('./parameters/files.js').Around}
     */
    #around() {
        return {
            services: this.services,
            there: () => {
                const { turn, there } = this;
                return there && { ...there, still: () => turn === this.turn };
            },
            learn: ({ told }) => {
                this.known.learn(told);
                return this.#refresh();
            },
            say: (text, isWrong) => this.#say(text, isWrong),
            carryOut: (carryOut) => this.#do(carryOut),
            show: (shown) => {
                this.imports.replaceChildren(...(shown ? [shown] : []));
                if (!shown) {
                    this.buttons.at(-1)?.focus();
                }
            },
        };
    }

    /** @param {import('./parameters/kept.js').Kept} kept */
    #take(kept) {
        this.kept = kept;
        this.finder.take(kept);
        this.units = new Units(kept, () => {
            this.services.changed?.();
            void this.#do(() => this.#refresh());
        });
        this.units.show(this.axis);
        this.unitsPlace.replaceChildren(this.units.element);
        this.rows.forEach((row) => row.mark(kept.favourites.includes(row.id)));
    }

    /** What is to be kept for the next visit. */
    state() {
        return structuredClone(this.kept);
    }

    /**
     * Goes on with what was kept, as far as it can be made use of.
     * @param {unknown} state
     */
    restore(state) {
        this.#take(checked(state));
        this.#filter();
        void this.#do(() => this.#refresh());
    }

    /**
     * A module is there; or another axis is wanted of the same one.
     * @param {string | null} product null for one that is not known
     * @param {number} axis
     */
    async module(product, axis) {
        const isSame = this.there !== undefined && this.there.product === product && this.axis !== axis;
        this.turn += 1;
        const turn = this.turn;
        this.axis = axis;
        this.units?.show(axis);
        await this.#do(async () => {
            if (!isSame) {
                this.#forget();
                /** @type {import('../types.js').ParameterTables} */
                const { axes, rows } = await this.services.ask('parameters', { product });
                if (turn !== this.turn) {
                    return;
                }
                this.there = { product, axes };
                this.#build(rows);
            }
            this.rows.forEach((row) => row.reset());
            this.buttons.forEach((made) => (made.disabled = false));
            await this.#refresh();
            await this.#readAll(true);
        });
    }

    /** The module is there no more. */
    gone() {
        this.turn += 1;
        this.#forget();
        this.buttons.forEach((made) => (made.disabled = true));
        this.#say('no module');
    }

    #forget() {
        this.there = undefined;
        this.known.forget();
        this.rows = [];
        this.body.replaceChildren();
        this.imports.replaceChildren();
        this.shown.textContent = '';
    }

    /** @param {string} text */
    #say(text, isWrong = false) {
        this.said.textContent = text;
        this.said.classList.toggle('wrong', isWrong);
    }

    /**
     * Does something; if that fails, it is told.
     * @param {() => Promise<void> | void} carryOut
     */
    async #do(carryOut) {
        const { turn } = this;
        try {
            await carryOut();
        } catch (error) {
            if (turn === this.turn) {
                this.#say(words(error), true);
            }
        }
    }

    /** @param {import('../types.js').ParameterRow[]} rows */
    #build(rows) {
        const hears = {
            favourite: (/** @type {Row} */ row) => this.#favour(row),
            typed: (/** @type {Row} */ row, /** @type {string} */ text) => void this.#at(row, () => this.#typed(row, text)),
            store: (/** @type {Row} */ row) => void this.#at(row, () => this.#store(`Store ${row.row.name}`, [this.#place(row)])),
            read: (/** @type {Row} */ row) => void this.#at(row, () => this.#read(`Read ${row.row.name}`, [this.#place(row)])),
        };
        this.rows = rows.map((row) => new Row(row, hears));
        this.rows.forEach((row) => row.mark(this.kept.favourites.includes(row.id)));
        this.body.replaceChildren(...this.rows.map(({ element }) => element));
    }

    /**
     * Does something of a row; if that fails, it is told there.
     * @param {Row} row
     * @param {() => Promise<void>} carryOut
     */
    async #at(row, carryOut) {
        const { turn } = this;
        try {
            await carryOut();
        } catch (error) {
            if (turn === this.turn) {
                this.#refused(row, words(error));
            }
        }
    }

    /** @param {Row} row @param {string} why */
    #refused(row, why) {
        row.refuse(why);
        if (why !== '') {
            this.services.announce(`${row.row.name}: ${why}`);
        }
    }

    /** @param {Row} row */
    #favour(row) {
        const others = this.kept.favourites.filter((id) => id !== row.id);
        this.kept.favourites = row.isFavourite ? others : [...others, row.id];
        row.mark(!row.isFavourite);
        this.services.changed?.();
        this.#filter();
    }

    /**
     * Where the parameter of a row is, of the axis that is shown.
     * @param {Row} row
     * @returns {ParameterPlace}
     */
    #place({ row: { bank, number } }) {
        return { bank, number, axis: bank === 'axis' ? this.axis : 0 };
    }

    #filter() {
        const count = this.finder.show(this.rows);
        this.shown.textContent = this.rows.length === 0 ? '' : `${count} of ${this.rows.length} parameters`;
    }

    /**
     * How values are shown.
     * @returns {import('../types.js').ParameterView}
     */
    #view() {
        const units = this.units?.units() ?? 'module';
        const { there, known, kept, axis } = this;
        return { product: there?.product ?? null, known: known.ofAxis(axis), steps: kept.steps[axis] ?? null, units };
    }

    /** Shows all values that are known. */
    async #refresh() {
        if (!this.there) {
            return;
        }
        const { turn, rows } = this;
        const view = this.#view();
        const settings = rows.flatMap((row) => {
            const place = this.#place(row);
            const value = this.known.value(place) ?? row.row.default;
            return [row.row.default, value, this.known.first(place) ?? value].map((value) => ({ place, value }));
        });
        const missing = this.units?.missing() ?? '';
        if (missing !== '') {
            this.#say(missing, true);
        }
        /** @type {import('../types.js').ParameterTexts} */
        const { texts } = await this.services.ask('parameters_units', { view, settings });
        if (turn !== this.turn) {
            return;
        }
        rows.forEach((row, index) => {
            const [normal, value, opened] = texts.slice(3 * index, 3 * index + 3);
            const [now, first] = [this.known.value(this.#place(row)), this.known.first(this.#place(row))];
            const isChanged = now !== first && row.row.kept;
            const differs = now !== undefined && now !== row.row.default && row.row.kept;
            const isOther = normal.unit !== row.row.unit;
            row.show(now === undefined ? undefined : value, normal, isChanged ? opened.text : '', differs, isOther);
        });
        this.#filter();
    }

    /**
     * Reads parameters, and shows them.
     * @param {string} name
     * @param {ParameterPlace[]} of
     */
    async #read(name, of) {
        const { turn } = this;
        /** @type {import('../types.js').ParametersTold} */
        const { told } = await this.services.job(name, 'parameters_read', { of });
        if (turn !== this.turn) {
            return;
        }
        this.known.learn(told);
        this.#tell(told);
        await this.#refresh();
    }

    /**
     * Shows refusals at their rows.
     * @param {ParameterTold[]} told
     */
    #tell(told) {
        const refusals = new Map(told.map(({ place, why }) => [key(place), why]));
        for (const row of this.rows) {
            const why = refusals.get(key(this.#place(row)));
            if (why !== undefined) {
                row.refuse(why);
            }
        }
    }

    /** @param {boolean} onlyUnknown whether what has been read already is left out */
    async #readAll(onlyUnknown = false) {
        const { turn } = this;
        const left = this.rows.filter(({ row }) => row.clears);
        const of = this.rows.filter(({ row }) => !row.clears).map((row) => this.#place(row));
        const wanted = onlyUnknown ? of.filter((place) => this.known.value(place) === undefined) : of;
        this.#say('reading');
        await this.#read('Read all', wanted);
        if (turn === this.turn) {
            const names = left.map(({ row }) => row.name).join(', ');
            this.#say(names === '' ? 'read' : `read, but not what is cleared by that: ${names}`);
        }
    }

    /**
     * Writes what was typed.
     * @param {Row} row
     * @param {string} text
     */
    async #typed(row, text) {
        const { turn } = this;
        const { services, there } = this;
        const place = this.#place(row);
        /** @type {import('../types.js').Value} */
        const { value } = await services.ask('parameters_number', { view: this.#view(), place, text });
        if (turn !== this.turn || value === null || !there) {
            return;
        }
        if (value === this.known.value(place)) {
            row.reset();
            return;
        }
        const to = [{ place, value }];
        /** @type {import('../types.js').ParameterWords} */
        const { lines } = await services.ask('parameters_automatic', { product: there.product, to });
        if (lines.length > 0 && !(await services.question(`Write ${row.row.name}?`, lines, 'Write'))) {
            row.reset();
            return;
        }
        if (turn !== this.turn) {
            return;
        }
        /** @type {import('../types.js').ParametersTold} */
        const { told } = await services.job(`Write ${row.row.name}`, 'parameters_write', { to, store: false });
        if (turn !== this.turn) {
            return;
        }
        const [{ why }] = told;
        this.#refused(row, why);
        if (why === '') {
            this.known.learn(told);
            // What has been typed is what is shown, though perhaps written in another way.
            row.shown = row.input?.value ?? '';
            await this.#refresh();
        }
    }

    /** Where the parameters are that have changed since they were read first, of all axes. */
    #changedPlaces() {
        const kept = new Set(this.rows.filter(({ row }) => row.kept).map(({ id }) => id));
        return this.known.changed().filter(({ bank, number }) => kept.has(`${bank}/${number}`));
    }

    /**
     * Stores parameters, after a question.
     * @param {string} name
     * @param {ParameterPlace[] | null} wanted null for all
     */
    async #store(name, wanted) {
        const { turn, there, services } = this;
        if (!there) {
            return;
        }
        /** @type {import('../types.js').ParameterWrites} */
        const { of, writes, lines } = await services.ask('parameters_writes', { ...there, of: wanted });
        if (writes === 0) {
            throw new Error(wanted?.length === 0 ? 'nothing has changed since it was read first' : lines.join(' '));
        }
        if (!(await services.question(`${name}?`, lines, 'Store')) || turn !== this.turn) {
            return;
        }
        /** @type {import('../types.js').ParametersTold} */
        const { told } = await services.job(name, 'parameters_store', { of });
        if (turn === this.turn) {
            this.#tell(told);
            const refused = told.filter(({ why }) => why !== '');
            const why = refused.length === 0 ? '' : `: ${refused[0].why}`;
            this.#say(`stored: ${told.length - refused.length}, refused: ${refused.length}${why}`, why !== '');
        }
    }
}
