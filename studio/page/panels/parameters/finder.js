// Which parameters are shown: by words, bank, and what is particular about them.

import { make } from '../../dom.js';
import { BANKS } from './kept.js';

const NAMES = { axis: 'Axis', global: 'Global', interrupt: 'Interrupts', all: 'All' };

/** What is looked for. */
export class Finder {
    /** @param {() => void} changed something else is looked for */
    constructor(changed) {
        /** @type {import('./kept.js').Kept | undefined} */
        this.kept = undefined;
        const choose = () => {
            if (this.kept) {
                this.kept.bank = this.bank.value;
            }
            changed();
        };
        const banks = BANKS.map((bank) => new Option(NAMES[/** @type {'all'} */ (bank)], bank));
        this.search = make('input', { type: 'search', oninput: changed, spellcheck: 'false', placeholder: 'current' });
        this.bank = make('select', { onchange: choose }, ...banks);
        this.favourites = make('input', { type: 'checkbox', onchange: changed });
        this.differs = make('input', { type: 'checkbox', onchange: changed });
        this.changed = make('input', { type: 'checkbox', onchange: changed });
        this.element = make(
            'div',
            { class: 'row' },
            make('label', {}, 'Search ', this.search),
            make('label', {}, 'Bank ', this.bank),
            make('label', {}, this.favourites, ' Favourites'),
            make('label', {}, this.differs, ' Differs from default'),
            make('label', {}, this.changed, ' Changed'),
        );
    }

    /** @param {import('./kept.js').Kept} kept */
    take(kept) {
        this.kept = kept;
        this.bank.value = kept.bank;
    }

    /**
     * Hides the rows that are not looked for. Gives how many are shown.
     * @param {import('./row.js').Row[]} rows
     */
    show(rows) {
        const wanted = this.search.value.toLowerCase().split(' ').filter((word) => word !== '');
        let count = 0;
        for (const row of rows) {
            const text = `${row.row.number} ${row.row.name}`.toLowerCase();
            const fits =
                (this.bank.value === 'all' || row.row.bank === this.bank.value) &&
                (!this.favourites.checked || row.isFavourite) &&
                (!this.differs.checked || row.element.classList.contains('differs')) &&
                (!this.changed.checked || row.element.classList.contains('changed')) &&
                wanted.every((word) => text.includes(word));
            row.element.hidden = !fits;
            count += Number(fits);
        }
        return count;
    }
}
