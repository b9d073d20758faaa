// A link to a module: one exchange at a time. STOP comes before requests, and requests before samples.

/** @typedef {import('./types.js').Request} Request */
/** @typedef {import('./types.js').Outcome} Outcome */

/**
 * What a link leads to: a virtual module, or a serial port.
 * @typedef {object} Source
 * @property {(request: Request, timeout: number) => Promise<Outcome>} exchange
 * @property {(columns: import('./types.js').Column[]) => (number | null)[]} [look] looks at values without a telegram
 * @property {(line: string) => Promise<string>} control
 * @property {() => Promise<void>} close
 */

/** How long the reply to a STOP is waited for, in milliseconds. */
const STOP_TIMEOUT = 300;
/** How long the reply to a sample is waited for. */
const SAMPLE_TIMEOUT = 1000;
/** Time between two attempts of a STOP that is not answered, in which requests go on. */
const AGAIN = 250;
/** Time between two rows of samples. */
const ROW = 20;
/** Time between two portions of rows for the page. */
const PORTION = 100;

/** @param {number} milliseconds */
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** A link, its queue, and who is told of it. */
export class Link {
    /**
     * @param {Source} source
     * @param {import('./doors.js').Doors} doors
     * @param {(told: any) => void} tell
     */
    constructor(source, doors, tell) {
        this.source = source;
        this.doors = doors;
        this.tell = tell;
        /** Jobs by their rank: STOP, requests, samples.
         * @type {(() => Promise<void>)[][]} */
        this.jobs = [[], [], []];
        this.busy = false;
        this.open = true;
        /** @type {import('./types.js').Axes} */
        this.axes = { address: 1, product: null };
        /** What stops what this page has set in motion, by its text.
         * @type {Map<string, Request>} */
        this.moved = new Map();
        /** @type {import('./types.js').Column[]} */
        this.columns = [];
        /** @type {{ at: number, values: (number | null)[] }[]} */
        this.rows = [];
        this.sampling = false;
        this.stopping = false;
        this.pressed = false;
        /** @type {(() => void) | undefined} */
        this.wake = undefined;
    }

    /**
     * @param {number} rank
     * @param {() => Promise<void>} job
     */
    #add(rank, job) {
        this.jobs[rank].push(job);
        void this.#work();
    }

    async #work() {
        if (this.busy) {
            return;
        }
        this.busy = true;
        for (;;) {
            const job = this.jobs.find((jobs) => jobs.length > 0)?.shift();
            if (!job) {
                break;
            }
            await job();
        }
        this.busy = false;
    }

    /**
     * A request in its turn.
     * @param {number} rank
     * @param {Request} request
     * @param {number} timeout
     * @returns {Promise<Outcome>}
     */
    #exchange(rank, request, timeout) {
        return new Promise((resolve) => {
            this.#add(rank, async () => {
                resolve(this.open ? await this.source.exchange(request, timeout) : { lost: 'the link is closed' });
            });
        });
    }

    /**
     * A request of the tools.
     * @param {import('./types.js').Exchange} asked
     */
    request({ request, timeout }) {
        const { product } = this.axes;
        const { requests } = this.doors.ask('stop_after', { request, product });
        for (const stop of requests) {
            this.moved.set(JSON.stringify(stop), stop);
            this.tell({ moved: true });
        }
        return this.#exchange(1, request, timeout);
    }

    /** Stops all motors, again and again until that is answered; and once more if it is pressed meanwhile. */
    async stop() {
        this.pressed = true;
        this.wake?.();
        if (this.stopping) {
            return;
        }
        this.stopping = true;
        /** @type {Request[]} */
        let left = [];
        while (this.open && (this.pressed || left.length > 0)) {
            if (this.pressed) {
                this.pressed = false;
                left = this.doors.ask('stop_requests', this.axes).requests;
            }
            const unanswered = [];
            for (const request of left) {
                const outcome = await this.#exchange(0, request, STOP_TIMEOUT);
                if (typeof outcome !== 'object' || !('reply' in outcome)) {
                    unanswered.push(request);
                }
            }
            left = unanswered;
            this.tell({ stopped: left.length === 0 });
            if (left.length > 0 && !this.pressed) {
                await this.#sleep(AGAIN);
            }
        }
        this.stopping = false;
        if (left.length === 0) {
            this.moved.clear();
            this.tell({ moved: false });
        }
    }

    /**
     * Sleeps, or until a STOP is pressed.
     * @param {number} milliseconds
     */
    async #sleep(milliseconds) {
        const woken = new Promise((resolve) => (this.wake = () => resolve(undefined)));
        await Promise.race([sleep(milliseconds), woken]);
        this.wake = undefined;
    }

    /** Reads the values of the module's axes again and again from now on. */
    async sample() {
        this.columns = this.doors.ask('sample_columns', this.axes).columns;
        this.tell({ columns: this.columns });
        if (this.sampling) {
            return;
        }
        this.sampling = true;
        let told = performance.now();
        while (this.open && this.columns.length > 0) {
            const columns = this.columns;
            const at = performance.now();
            const values = this.source.look?.(columns) ?? (await this.#values(columns));
            if (columns === this.columns) {
                this.rows.push({ at, values });
            }
            if (performance.now() - told >= PORTION) {
                told = performance.now();
                this.tell({ rows: this.rows });
                this.rows = [];
            }
            await sleep(ROW);
        }
        this.sampling = false;
    }

    /**
     * The values of columns, one telegram each.
     * @param {import('./types.js').Column[]} columns
     */
    async #values(columns) {
        const values = [];
        for (const { request } of columns) {
            const outcome = await this.#exchange(2, request, SAMPLE_TIMEOUT);
            values.push(this.doors.ask('sample_value', { request, outcome }).value);
        }
        return values;
    }

    /** No more samples. */
    rest() {
        this.columns = [];
    }

    /**
     * A line of the control port.
     * @param {string} line
     */
    control(line) {
        return this.source.control(line);
    }

    /** Stops what this page has set in motion, and closes the link. */
    async leave() {
        this.rest();
        for (const request of this.moved.values()) {
            await this.#exchange(0, request, STOP_TIMEOUT);
        }
        this.open = false;
        await this.source.close();
    }
}
