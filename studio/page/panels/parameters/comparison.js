// A file of parameters beside what the module has: what is ticked is written.

import { button, make } from '../../dom.js';

/** @typedef {import('../../types.js').ParameterLine} ParameterLine */
/** @typedef {import('../../types.js').ParameterTold} ParameterTold */

/** A line that differs. */
export class Line {
    /**
     * @param {ParameterLine} line
     * @param {ParameterTold | undefined} here undefined if the module was not asked
     */
    constructor(line, here) {
        this.line = line;
        const why = line.why !== '' ? line.why : (here?.why ?? '');
        this.tick = make('input', { type: 'checkbox', 'aria-label': `Write ${line.name}` });
        this.tick.checked = why === '' && !line.interface;
        this.here = make('td', { text: String(here?.value ?? '-') });
        this.told = make('td', { class: 'parameter-told wrong', text: why });
        const name = make('th', { scope: 'row', text: line.name });
        const there = make('td', { text: String(line.value) });
        this.element = make('tr', {}, make('td', {}, this.tick), name, this.here, there, this.told);
    }

    /**
     * What has become of it.
     * @param {string} why empty if it is written
     * @param {number | null} value what the module has now
     */
    is(why, value) {
        this.told.textContent = why === '' ? 'written' : why;
        this.told.classList.toggle('wrong', why !== '');
        this.here.textContent = String(value ?? '-');
        this.tick.checked = why !== '';
    }
}

/** The comparison. */
export class Comparison {
    /**
     * @param {string} name of the file
     * @param {ParameterLine[]} lines
     * @param {ParameterTold[]} told what the module has of those that it was asked for, in their order
     * @param {(lines: Line[], store: boolean) => Promise<void>} write
     * @param {() => void} close
     */
    constructor(name, lines, told, write, close) {
        const here = told.values();
        const all = lines.map((line) => new Line(line, line.why === '' ? here.next().value : undefined));
        const differ = all.filter(({ line, here }) => here.textContent !== String(line.value));
        const same = all.length - differ.length;
        const text = `${differ.length} of ${all.length} settings of ${name} differ from the module's, ${same} are the same.`;
        const heading = make('h3', { text: 'Import', tabindex: '-1' });
        this.heading = heading;
        const store = make('input', { type: 'checkbox' });
        const writes = button('Write ticked', async () => {
            const ticked = differ.filter(({ tick }) => tick.checked);
            writes.disabled = true;
            try {
                await write(ticked, store.checked);
            } finally {
                writes.disabled = false;
            }
        });
        const tickAll = (/** @type {boolean} */ checked) => differ.forEach((line) => (line.tick.checked = checked));
        const tools = [
            writes,
            make('label', {}, store, ' Store in the EEPROM, too'),
            button('Tick all', () => tickAll(true)),
            button('Tick none', () => tickAll(false)),
        ];
        const headings = ['Write', 'Parameter', 'Here', 'File', 'Told'].map((words) => make('th', { scope: 'col', text: words }));
        const table = make(
            'table',
            { 'aria-label': `Differences to ${name}` },
            make('thead', {}, make('tr', {}, ...headings)),
            make('tbody', {}, ...differ.map(({ element }) => element)),
        );
        const scrolls = make('div', { class: 'parameter-scrolls' }, table);
        const seen = differ.length === 0 ? [] : [make('div', { class: 'row' }, ...tools), scrolls];
        const closes = button(differ.length === 0 ? 'Close' : 'Close the import', close);
        this.element = make('div', { role: 'group', 'aria-label': 'Import' }, heading, make('p', { text }), ...seen, closes);
    }
}
