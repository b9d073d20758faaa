// What the panels share: the module that is there, and what can be asked of it.

import { download, openBytes, openFile } from './files.js';
import { question } from './question.js';

/**
 * A module that has told what it is.
 * @typedef {object} There
 * @property {string} name
 * @property {string | null} product null for one that is not known
 * @property {number} address
 * @property {boolean} isVirtual
 * @property {import('./types.js').Start} [started] how it was started, if it is a virtual one
 * @property {boolean} [runsImage] it runs a flash image in place of the firmware's core
 * @property {string[]} [curves] the curves of the session that is or was done again to it
 */

/**
 * A part of the page.
 * @typedef {object} Panel
 * @property {(there: There) => void} [module] a module is there, perhaps the same as before
 * @property {(there: There) => Promise<void>} [looks] a module is there to which a session is done: it is only looked at, and nothing
 *     is sent to it
 * @property {() => void} [gone] it is there no more
 * @property {() => void} [stopped] a STOP has been sent
 */

/** The workbench. */
export class Workbench {
    /**
     * @param {import('./session.js').Session} session
     * @param {import('./panels/jobs.js').Jobs} jobs
     * @param {(text: string) => void} announce
     */
    constructor(session, jobs, announce) {
        this.session = session;
        this.jobs = jobs;
        this.announce = announce;
        /** @type {There | undefined} */
        this.there = undefined;
        /** @type {Panel[]} */
        this.panels = [];
        this.download = download;
        this.openFile = openFile;
        this.openBytes = openBytes;
        this.question = question;
        /** Leads to a part of the page.
         * @type {(part: string) => void} */
        this.reveal = () => undefined;
    }

    /**
     * Something else is there, or nothing.
     * @param {There | undefined} there
     */
    is(there) {
        this.there = there;
        this.panels.forEach((panel) => (there ? panel.module?.(there) : panel.gone?.()));
    }

    /**
     * A module is there to which a session is done.
     * @param {There} there
     */
    async looks(there) {
        this.there = there;
        await Promise.all(this.panels.map((panel) => panel.looks?.(there)));
    }

    /**
     * Asks at a door that needs no module.
     * @param {string} door
     * @param {object} asked
     */
    ask(door, asked) {
        return this.session.look(door, asked);
    }

    /**
     * Gives the tools a job at the module, which is shown.
     * @param {string} name
     * @param {string} door
     * @param {object} asked
     */
    job(name, door, asked) {
        return this.jobs.run(name, door, asked);
    }

    /**
     * Gives the tools a job at the module that is too short to be shown.
     * @param {string} door
     * @param {object} asked
     */
    quick(door, asked) {
        return this.session.job(door, asked).answer;
    }

    /**
     * Sends a request to the module.
     * @param {import('./types.js').Request} request
     */
    async send(request) {
        const outcome = await this.session.ask({ send: request });
        const { value } = await this.ask('scope_value', { request, outcome });
        return value;
    }

    /**
     * Reads requests again and again, until the function is called that this gives.
     * @param {import('./types.js').Request[]} requests
     * @param {(values: (number | null)[]) => void} hear takes the latest values
     */
    sample(requests, hear) {
        let ended = false;
        let end = () => {};
        const { product = null, isVirtual = false } = this.there ?? {};
        this.ask('scope_requests', { product, is_virtual: isVirtual, requests }).then(
            ({ curves }) => {
                if (!ended) {
                    end = this.session.watch(curves, false, (rows) => hear(rows.at(-1)?.values ?? []));
                }
            },
            () => undefined,
        );
        return () => {
            ended = true;
            end();
        };
    }
}
