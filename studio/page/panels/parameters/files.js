// Parameters as files of `tmcl params`.

import { Comparison } from './comparison.js';

/** @typedef {import('../../types.js').ParametersTold} ParametersTold */
/** @typedef {import('./comparison.js').Line} Line */

/** @typedef {{ product: string | null, axes: number, still: () => boolean }} There the module, and whether it is still that one */

/**
 * What files have to do with.
 * @typedef {object} Around
 * @property {import('../parameters.js').Services} services
 * @property {() => (There | undefined)} there
 * @property {(told: ParametersTold) => Promise<void>} learn takes values that the module has told
 * @property {(text: string, isWrong: boolean) => void} say
 * @property {(carryOut: () => Promise<void>) => Promise<void>} carryOut tells what fails
 * @property {(shown: HTMLElement | undefined) => void} show shows a comparison, or none
 */

/** Files. */
export class Files {
    /**
     * @param {Around} around
     * @param {string} name the beginning of the name of an exported file
     */
    constructor(around, name) {
        this.around = around;
        this.name = name;
    }

    /** Offers all settings of the module as a file. */
    async export() {
        const { services, there } = this.around;
        const product = there()?.product ?? null;
        /** @type {import('../../types.js').Text} */
        const { text } = await services.job('Export', 'tools_settings', {});
        services.download(`${this.name}${product === null ? '' : `-${product}`}.tmcl`, text, 'text/plain');
    }

    /** Opens a file, and shows in what it differs from the module. */
    async import() {
        const { around } = this;
        const { services } = around;
        const there = around.there();
        const file = await services.openFile('.tmcl,text/plain');
        if (!file || !there?.still()) {
            return;
        }
        around.show(undefined);
        const { name, text } = file;
        /** @type {import('../../types.js').ParameterLines} */
        const { from, lines } = await services.ask('parameters_file', { name, text, product: there.product });
        const of = lines.filter(({ why }) => why === '').map(({ place }) => place);
        /** @type {ParametersTold} */
        const told = await services.job(`Compare ${name}`, 'parameters_read', { of });
        if (!there.still()) {
            return;
        }
        await around.learn(told);
        /** @type {(ticked: Line[], store: boolean) => Promise<void>} */
        const write = (ticked, store) => around.carryOut(() => this.#restore(name, from, ticked, store));
        const comparison = new Comparison(name, lines, told.told, write, () => around.show(undefined));
        around.show(comparison.element);
        comparison.heading.focus();
        around.say('', false);
    }

    /**
     * Writes the ticked lines of a file.
     * @param {string} name
     * @param {number | null} from
     * @param {Line[]} ticked
     * @param {boolean} store
     */
    async #restore(name, from, ticked, store) {
        const { around } = this;
        const { services } = around;
        const there = around.there();
        if (!there || ticked.length === 0) {
            throw new Error('no line is ticked');
        }
        const { product, axes, still } = there;
        const to = ticked.map(({ line: { place, value } }) => ({ place, value }));
        const of = to.map(({ place }) => place);
        /** @type {import('../../types.js').ParameterWords} */
        const automatic = await services.ask('parameters_automatic', { product, to });
        /** @type {import('../../types.js').ParameterWrites} */
        const stored = await services.ask('parameters_writes', { product, axes, of });
        const lines = [...automatic.lines, ...(store ? stored.lines : [])];
        const isMeant = lines.length === 0 || (await services.question(`Write ${to.length} lines of ${name}?`, lines, 'Write'));
        if (!isMeant || !still()) {
            return;
        }
        /** @type {ParametersTold} */
        const { told } = await services.job(`Write ${name}`, 'parameters_restore', { name, from, to, store });
        /** @type {ParametersTold} */
        const now = await services.job(`Compare ${name}`, 'parameters_read', { of });
        if (!still()) {
            return;
        }
        await around.learn(now);
        ticked.forEach((line, index) => line.is(told[index].why, now.told[index].value));
        const refused = told.filter(({ why }) => why !== '').length;
        around.say(`written: ${told.length - refused}, refused: ${refused}`, refused > 0);
    }
}
