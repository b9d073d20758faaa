// Inputs and outputs: what is read of them, and switches for what can be switched.

import { attribute, make, words, write } from '../dom.js';
import { Reading, read } from './read.js';

/** @typedef {import('../types.js').StatusPort} StatusPort */
/** @typedef {import('../types.js').StatusReading} StatusReading */

/** The groups, in the order in which they are shown.
 * @type {[import('../types.js').StatusKind, string][]} */
const GROUPS = [
    ['measured', 'Module'],
    ['digital', 'Digital inputs'],
    ['analog', 'Analog inputs'],
    ['switch', 'Limit and home switches'],
    ['output', 'Outputs'],
    ['pull_ups', 'Pull-up resistors'],
];
/** What stands before what is on, off, or neither: shapes, so that nobody needs to see colours. */
const MARKS = { on: '\u25cf', off: '\u25cb', none: '' };
/** What stands where there is no value. */
const NOTHING = '-';

/** The inputs and outputs of the module. */
export class InputsPanel {
    /**
     * @param {HTMLElement} root
     * @param {import('./read.js').Services} services
     */
    constructor(root, services) {
        this.root = root;
        this.services = services;
        this.root.classList.add('status-inputs');
        this.body = make('div');
        // Told here, and announced: what is shown of an output is what was read back.
        this.message = make('p', { class: 'status-message' });
        this.root.append(this.body, this.message);
        this.reading = new Reading(services);
        this.gone();
    }

    /**
     * A module is there, perhaps the same as before.
     * @param {import('./read.js').There} there
     */
    async module(there) {
        this.gone();
        const { services } = this;
        const { product } = there;
        const told = await this.reading.begin(there, (why) => (this.message.textContent = why));
        if (!told) {
            return;
        }
        /** @type {((reading: StatusReading) => void)[]} */
        const shown = [];
        /** @type {import('../types.js').Request[]} */
        const requests = [];
        const rows = new Map(GROUPS.map(([kind]) => [kind, /** @type {HTMLElement[]} */ ([])]));
        told.inputs.forEach((port) => {
            const { row, show } = this.#row(port);
            rows.get(port.kind)?.push(row);
            if (port.request) {
                requests.push(port.request);
                shown.push(show);
            }
        });
        const tables = GROUPS.flatMap(([kind, name]) => {
            const group = rows.get(kind) ?? [];
            return group.length === 0 ? [] : [make('table', {}, make('caption', {}, name), make('tbody', {}, ...group))];
        });
        const note = told.note === null ? [] : [make('p', {}, told.note)];
        this.body.replaceChildren(...note, ...tables);
        this.reading.end = read(
            this.root,
            services,
            requests,
            (values) => services.ask('status_readings', { product, requests, values }),
            ({ readings }) => readings.forEach((/** @type {StatusReading} */ reading, /** @type {number} */ at) => shown[at]?.(reading)),
        );
    }

    /** The module is there no more. */
    gone() {
        this.reading.stop();
        this.message.textContent = '';
        this.body.replaceChildren(make('p', {}, 'no module'));
    }

    /**
     * A row of a table, and what shows a reading in it.
     * @param {StatusPort} port
     * @returns {{ row: HTMLElement, show: (reading: StatusReading) => void }}
     */
    #row(port) {
        const { name, set, request } = port;
        const head = make('th', { scope: 'row' }, name);
        const cell = make('td');
        const row = make('tr', {}, head, cell);
        if (set && !request) {
            const either = /** @type {['on', 'off']} */ (['on', 'off']).map((what) => {
                const button = make('button', { type: 'button', 'aria-label': `${name}: ${what}` }, what);
                button.onclick = () => void this.#switch(name, set[what], button);
                return button;
            });
            cell.append(...either, make('span', { class: 'status-aside' }, 'cannot be read back'));
            return { row, show: () => undefined };
        }
        const mark = make('span', { class: 'status-mark', 'aria-hidden': 'true' });
        const text = make('span', {}, NOTHING);
        const reading = (/** @type {StatusReading} */ told) => {
            write(mark, MARKS[told.on === null ? 'none' : told.on ? 'on' : 'off']);
            write(text, told.text === '' ? NOTHING : told.text);
        };
        if (!set) {
            cell.append(mark, text);
            return { row, show: reading };
        }
        const button = make('button', { type: 'button', role: 'switch', 'aria-checked': 'false', 'aria-label': name }, mark, text);
        // What has not been read is not switched; but a button that has the focus keeps it.
        button.setAttribute('aria-disabled', 'true');
        button.onclick = () => {
            const is = button.getAttribute('aria-checked') === 'true';
            if (button.getAttribute('aria-disabled') === 'false') {
                void this.#switch(name, is ? set.off : set.on, button);
            }
        };
        cell.append(button);
        const show = (/** @type {StatusReading} */ told) => {
            reading(told);
            attribute(button, 'aria-checked', String(told.on === true));
            attribute(button, 'aria-disabled', String(told.on === null));
        };
        return { row, show };
    }

    /**
     * Switches something. What has become of it is seen when it is read back.
     * @param {string} name
     * @param {import('../types.js').Request} request
     * @param {HTMLElement} button
     */
    async #switch(name, request, button) {
        // One at a time: who presses twice before the reply has come does not mean it.
        if (button.getAttribute('aria-busy') === 'true') {
            return;
        }
        const { turn } = this.reading;
        button.setAttribute('aria-busy', 'true');
        this.message.textContent = '';
        try {
            if ((await this.services.send(request)) === null) {
                throw new Error('the module has not carried it out');
            }
        } catch (error) {
            if (turn === this.reading.turn) {
                this.message.textContent = `${name}: ${words(error)}`;
                this.services.announce(this.message.textContent);
            }
        }
        button.removeAttribute('aria-busy');
    }
}
