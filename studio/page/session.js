// A link and the tools at it, each in a worker of its own. What becomes of them is told; nothing is shown here.

import { canSuspend } from './doors.js';
import { Port } from './port.js';
import { worker } from './workers.js';

/** How long a page that goes keeps its workers alive, in milliseconds: time for a few telegrams, and less than browsers allow. */
const LEAVING = 300;
/** How long a reply is waited for, in milliseconds. */
const TIMEOUT = 1000;

/** The link, the tools, and what they are at. */
export class Session {
    /**
     * @param {WebAssembly.Module} module
     * @param {(told: any) => void} tell
     */
    constructor(module, tell) {
        this.module = module;
        this.tell = tell;
        /** @type {Port | undefined} */
        this.link = undefined;
        /** @type {Worker | undefined} */
        this.linkWorker = undefined;
        this.address = 1;
        /** The last thing that is done with the link. */
        this.turn = Promise.resolve();
        /** Numbers of the jobs that a STOP ends, but for those by which a module is identified.
         * @type {Set<number>} */
        this.jobs = new Set();
        /** This page has set something in motion, as far as the link knows. */
        this.moved = false;
        /** Who watches curves, by the number of the watcher.
         * @type {Map<number, { rows: (rows: import('./types.js').SampleRow[]) => void, rate: (rate: number) => void }>} */
        this.watchers = new Map();
        this.lastWatcher = 0;
        this.#startTools();
        this.#startPure();
    }

    /** The worker of doors that need no module. */
    #startPure() {
        const made = worker('pure-worker.js');
        const port = new Port(made, (told) => {
            if (told.dead !== undefined) {
                made.terminate();
                port.endAll(told.dead);
                this.#startPure();
            }
        });
        made.onmessage = ({ data }) => port.take(data);
        made.onerror = (event) => port.tell({ dead: event.message ?? 'the tables could not be loaded' });
        made.postMessage({ module: this.module });
        this.pure = port;
    }

    /**
     * Asks at a door that needs no module.
     * @param {string} door
     * @param {object} asked
     */
    look(door, asked = {}) {
        return /** @type {Port} */ (this.pure).ask({ door, asked }).answer;
    }

    /**
     * Watches curves of the module until the function is called that this gives.
     * @param {import('./types.js').Curve[]} curves
     * @param {boolean} every whether each row that can be had is wanted
     * @param {(rows: import('./types.js').SampleRow[]) => void} rows
     * @param {(rate: number) => void} rate takes how many rows a second there are
     */
    watch(curves, every, rows, rate = () => undefined) {
        this.lastWatcher += 1;
        const id = this.lastWatcher;
        this.watchers.set(id, { rows, rate });
        this.ask({ watch: { id, curves, every } }).catch(() => undefined);
        return () => {
            this.watchers.delete(id);
            this.ask({ unwatch: id }).catch(() => undefined);
        };
    }

    #startTools() {
        const made = worker('tools-worker.js');
        this.toolsWorker = made;
        this.tools = new Port(made, (told) => this.#hear(told));
        made.onmessage = ({ data }) => {
            // Where the browser does not suspend WebAssembly, the tools' worker has the link as well.
            const port = data.link === undefined ? this.tools : this.link;
            port?.take(data.link ?? data);
        };
        made.onerror = (event) => this.#hear({ dead: event.message ?? 'the tools could not be loaded' });
        made.postMessage({ module: this.module });
    }

    /** @param {any} told */
    #hear(told) {
        if (told.dead !== undefined) {
            // The link and STOP do not notice.
            this.toolsWorker?.terminate();
            this.tools?.endAll('the tools have ended');
            this.#startTools();
            this.#join();
        }
        if (told.lost !== undefined) {
            this.#endJobs();
        }
        if (told.moved !== undefined) {
            this.moved = told.moved;
            return;
        }
        if (told.watcher !== undefined) {
            const watcher = this.watchers.get(told.watcher);
            told.rows ? watcher?.rows(told.rows) : watcher?.rate(told.rate);
            return;
        }
        if (told.opened) {
            this.tell({ again: true });
        }
        this.tell(told);
    }

    /** What was meant for one module is not done at another. */
    #endJobs() {
        this.jobs.forEach((id) => this.end(id));
        this.jobs.clear();
    }

    /** Gives the tools a port to the link. */
    #join() {
        if (this.linkWorker && canSuspend) {
            const { port1, port2 } = new MessageChannel();
            this.linkWorker.postMessage({ port: port1 }, [port1]);
            this.toolsWorker?.postMessage({ port: port2 }, [port2]);
        }
    }

    /**
     * Does something with the link when all that was begun before has ended.
     * @param {() => Promise<void>} job
     */
    #inTurn(job) {
        const done = this.turn.then(job);
        this.turn = done.catch(() => undefined);
        return done;
    }

    /**
     * Opens a link, in the place of the one before.
     * @param {object} wanted a virtual module or a serial port
     * @param {number} address
     * @param {() => void} begun is called when nothing more is heard of the link before, and nothing yet of this one
     * @param {WebAssembly.Module} module the program that has the link
     */
    open(wanted, address, begun = () => undefined, module = this.module) {
        return this.#inTurn(() => this.#open(wanted, address, begun, module));
    }

    /** Stops what this page has set in motion, and closes the link. */
    leave() {
        return this.#inTurn(() => this.#leave());
    }

    /**
     * @param {object} wanted
     * @param {number} address
     * @param {() => void} begun
     * @param {WebAssembly.Module} module
     */
    async #open(wanted, address, begun, module) {
        this.#endJobs();
        this.watchers.clear();
        await this.#leave();
        this.address = address;
        if (canSuspend) {
            const made = worker('link-worker.js');
            this.linkWorker = made;
            const link = new Port(made, (told) => this.link === link && this.#hear(told));
            this.link = link;
            made.onmessage = ({ data }) => link.take(data);
            made.onerror = (event) => this.#hear({ lost: event.message ?? 'the link could not be loaded' });
        } else {
            const post = (/** @type {any} */ message) => this.toolsWorker?.postMessage({ link: message });
            this.link = new Port({ postMessage: post }, (told) => this.#hear(told));
        }
        this.#join();
        this.moved = false;
        begun();
        await this.link.ask({ asked: { open: wanted, module, address } }).answer;
    }

    /**
     * Asks the link.
     * @param {object} asked
     */
    ask(asked) {
        return this.link ? this.link.ask({ asked }).answer : Promise.reject(new Error('there is no link'));
    }

    /** Asks the module what it is. */
    async identify() {
        await this.#ask('tools_connect', { address: this.address, timeout: TIMEOUT }).answer;
        /** @type {import('./types.js').Module} */
        const module = await this.#ask('tools_identify', {}).answer;
        await this.ask({ axes: { address: this.address, product: module.product } });
        return module;
    }

    /**
     * Gives the tools a job.
     * @param {string} door
     * @param {object} asked
     * @param {((told: any) => void) | undefined} hear
     */
    job(door, asked, hear = undefined) {
        const job = this.#ask(door, asked, hear);
        this.jobs.add(job.id);
        return job;
    }

    /**
     * @param {string} door
     * @param {object} asked
     * @param {((told: any) => void) | undefined} hear
     */
    #ask(door, asked, hear = undefined) {
        return /** @type {Port} */ (this.tools).ask({ door, asked }, hear);
    }

    /**
     * Asks a job to end.
     * @param {number} id
     */
    end(id) {
        this.toolsWorker?.postMessage({ end: id });
    }

    /** STOP: all axes, and the program. What waits is not done after it. */
    stop() {
        this.#endJobs();
        return this.ask({ stop: true });
    }

    async #leave() {
        if (!this.link) {
            return;
        }
        const { linkWorker, link } = this;
        await link.ask({ asked: { leave: true } }).answer.catch(() => undefined);
        link.endAll('the link is closed');
        this.toolsWorker?.postMessage({ closed: true });
        linkWorker?.terminate();
        this.link = undefined;
        this.linkWorker = undefined;
    }

    /**
     * The page goes, and with it the workers. Nothing can be waited for here but by keeping this thread from ending, while that of
     * the link goes on: so long that what this page has set in motion is stopped.
     */
    vanish() {
        this.link?.end.postMessage({ id: 0, asked: { leave: true } });
        const until = performance.now() + (this.moved ? LEAVING : 0);
        while (performance.now() < until);
    }
}
