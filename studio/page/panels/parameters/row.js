// A parameter in the table.

import { button, make } from '../../dom.js';

/** @typedef {import('../../types.js').ParameterRow} ParameterRow */
/** @typedef {import('../../types.js').ParameterText} ParameterText */

/**
 * What a row asks for.
 * @typedef {object} Hears
 * @property {(row: Row) => void} favourite it is to be one, or none any more
 * @property {(row: Row, text: string) => void} typed a value was typed
 * @property {(row: Row) => void} store
 * @property {(row: Row) => void} read
 */

/**
 * A cell, whose role it keeps where the table is laid out as a list.
 * @param {string} name a class
 * @param {string} label what stands above it in a table
 * @param {(Node | string)[]} children
 */
const cell = (name, label, ...children) =>
    make('td', { role: 'cell', class: `parameter-${name}`, 'data-label': label }, ...children);

/** What is said of a value that was typed and left. */
const UNWRITTEN = 'not written: Enter writes it, Esc takes it back';

/** A row. */
export class Row {
    /**
     * @param {ParameterRow} row
     * @param {Hears} hears
     */
    constructor(row, hears) {
        this.row = row;
        this.hears = hears;
        this.id = `${row.bank}/${row.number}`;
        const { name } = row;
        /** What is shown, if nothing is being typed. */
        this.shown = '';
        this.isFavourite = false;
        this.why = make('span', { class: 'wrong', id: `parameter-why-${row.bank}-${row.number}` });
        this.state = make('span', {});
        this.unit = cell('unit', '');
        this.takes = cell('takes', row.writable ? 'takes' : '');
        this.default = cell('default', 'default');
        this.star = button('\u2606', () => hears.favourite(this), { 'aria-label': `Favourite: ${name}`, 'aria-pressed': 'false' });
        this.input = row.writable ? this.#input() : undefined;
        this.output = make('span', {});
        const number = make('span', { class: 'parameter-number', text: String(row.number) });
        const named = { scope: 'row', role: 'rowheader', class: 'parameter-name' };
        const head = make('th', named, number, ' ', make('span', { text: name }));
        const actions = cell('actions', '');
        if (row.clears) {
            actions.append(button('Read and clear', () => hears.read(this), { 'aria-label': `Read and clear: ${name}` }));
        }
        if (row.stored === 'command') {
            actions.append(button('Store', () => hears.store(this), { 'aria-label': `Store: ${name}` }));
        }
        if (row.note !== '') {
            actions.append(...this.#note());
        }
        this.element = make(
            'tr',
            { role: 'row' },
            cell('star', '', this.star),
            head,
            cell('value', '', this.input ?? this.output),
            this.unit,
            this.takes,
            this.default,
            cell('state', '', this.state, ' ', this.why),
            actions,
        );
    }

    #input() {
        const attributes = { type: 'text', spellcheck: 'false', autocapitalize: 'off', autocomplete: 'off' };
        const named = { 'aria-label': this.row.name, 'aria-describedby': this.why.id };
        const input = make('input', { ...attributes, ...named });
        // A value may move a motor: leaving the field writes nothing.
        input.addEventListener('blur', () => {
            if (input.value !== this.shown && this.why.textContent === '') {
                this.why.textContent = UNWRITTEN;
            }
        });
        input.addEventListener('keydown', (event) => {
            if (event.key === 'Enter' && input.value !== this.shown) {
                event.preventDefault();
                this.refuse('');
                this.hears.typed(this, input.value);
            } else if (event.key === 'Escape' && input.value !== this.shown) {
                // It takes back what was typed, and is no STOP.
                event.stopPropagation();
                this.reset();
            }
        });
        return input;
    }

    #note() {
        const { bank, number, name, note } = this.row;
        const id = `parameter-note-${bank}-${number}`;
        const text = make('p', { class: 'parameter-note', id, text: note, hidden: true });
        const attributes = { 'aria-label': `Note: ${name}`, 'aria-expanded': 'false', 'aria-controls': id };
        const shows = button(
            'Note',
            () => {
                text.hidden = !text.hidden;
                shows.setAttribute('aria-expanded', String(!text.hidden));
            },
            attributes,
        );
        return [shows, text];
    }

    /** @param {boolean} isFavourite */
    mark(isFavourite) {
        this.isFavourite = isFavourite;
        this.star.setAttribute('aria-pressed', String(isFavourite));
        this.star.textContent = isFavourite ? '\u2605' : '\u2606';
    }

    /**
     * Shows a value.
     * @param {ParameterText | undefined} value undefined if it is not known
     * @param {ParameterText} normal the default
     * @param {string} opened what it was when it was read first; empty if it is still so
     * @param {boolean} differs from the default
     * @param {boolean} isOther whether the unit is another one than the module's
     */
    show(value, normal, opened, differs, isOther) {
        const isTyped = this.input !== undefined && this.input.value !== this.shown;
        this.shown = value?.text ?? '';
        this.output.textContent = value?.text ?? '-';
        this.unit.textContent = normal.unit;
        this.takes.textContent = isOther ? `${this.row.takes} ${this.row.unit}` : this.row.takes;
        this.default.textContent = normal.text;
        const said = [differs ? 'differs from default' : '', opened === '' ? '' : `changed, was ${opened}`];
        this.state.textContent = said.filter((words) => words !== '').join('; ');
        this.element.classList.toggle('differs', differs);
        this.element.classList.toggle('changed', opened !== '');
        if (this.input && !isTyped) {
            this.input.value = this.shown;
        }
    }

    /** What was typed is taken back, and why it was not taken. */
    reset() {
        if (this.input) {
            this.input.value = this.shown;
        }
        this.refuse('');
    }

    /** @param {string} why words of a refusal; empty for none */
    refuse(why) {
        this.why.textContent = why;
        this.input?.setAttribute('aria-invalid', String(why !== ''));
    }
}
