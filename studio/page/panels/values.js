// Where each axis is, and how fast: always shown, and never announced.

import { make, write } from '../dom.js';

/** The table of positions and speeds. */
export class Values {
    /**
     * @param {HTMLElement} body of a table
     * @param {import('../workbench.js').Workbench} bench
     */
    constructor(body, bench) {
        this.body = body;
        this.bench = bench;
        this.end = () => {};
    }

    /** @param {import('../workbench.js').There} there */
    async module({ address, product, isVirtual }) {
        this.end();
        /** @type {import('../types.js').Offers} */
        const { curves } = await this.bench.ask('scope_axes', { address, product, is_virtual: isVirtual, texts: [] });
        const cells = curves.map(() => make('td'));
        const rows = curves.map(({ name, unit }, index) => {
            const text = unit === '' ? name : `${name} (${unit})`;
            return make('tr', {}, make('th', { scope: 'row', text }), cells[index]);
        });
        this.body.replaceChildren(...rows);
        this.end = this.bench.session.watch(curves, false, (rows) => {
            rows.at(-1)?.values.forEach((value, index) => {
                const text = value === null ? '-' : String(value);
                if (cells[index].textContent !== text) {
                    write(cells[index], text);
                }
            });
        });
    }

    /** @param {import('../workbench.js').There} there */
    looks(there) {
        return this.module(there);
    }

    gone() {
        this.end();
    }
}
