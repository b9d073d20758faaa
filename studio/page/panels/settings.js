// The parameters' panel, with what it needs of the workbench.

import { at } from '../dom.js';
import { keep, kept } from '../keep.js';
import { ParametersPanel } from './parameters.js';

/** The parameters, and the axis whose they are. */
export class Parameters {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        this.axis = /** @type {HTMLSelectElement} */ (at('axis'));
        const { ask, job, question, download, openFile, announce } = bench;
        const changed = () => keep('parameters', this.panel.state());
        const services = { ask: ask.bind(bench), job: job.bind(bench), question, download, openFile, announce, changed };
        this.panel = new ParametersPanel(at('parameters'), services, {});
        const before = kept('parameters');
        if (before !== null) {
            this.panel.restore(before);
        }
        this.axis.onchange = () => this.panel.module(bench.there?.product ?? null, Number(this.axis.value));
    }

    /** @param {import('../workbench.js').There} there */
    async module({ product }) {
        /** @type {any} */
        const { axes } = await this.bench.ask('parameters', { product });
        const before = this.axis.value;
        const numbers = Array.from({ length: axes }, (_, axis) => String(axis));
        this.axis.replaceChildren(...numbers.map((text) => new Option(text, text)));
        this.axis.value = numbers.includes(before) ? before : '0';
        this.panel.module(product, Number(this.axis.value));
    }

    gone() {
        this.panel.gone();
    }
}
