// The world of a virtual module, by lines of the control port.

import { addLine, at, words } from '../dom.js';

/** The panel. */
export class World {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        at('control').onsubmit = (event) => {
            event.preventDefault();
            void this.#carryOut();
        };
    }

    /** @param {import('../workbench.js').There} there */
    module({ isVirtual }) {
        at('world').hidden = !isVirtual;
    }

    /** @param {any} told */
    hear(told) {
        if (told.line !== undefined) {
            addLine(at('answers'), told.line);
        } else if (told.message !== undefined) {
            addLine(at('answers'), told.message, true);
        }
    }

    async #carryOut() {
        const around = /** @type {HTMLInputElement} */ (at('around'));
        const typed = around.value.trim();
        around.value = '';
        try {
            addLine(at('answers'), await this.bench.session.ask({ control: typed }));
        } catch (error) {
            addLine(at('answers'), `${typed}: ${words(error)}`, true);
        }
    }
}
