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

/** The ranks of what is sent. */
const STOP = 0;
const REQUEST = 1;
const SAMPLE = 2;
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
     * @param {number} address of the module
     * @param {Map<string, Request>} moved what stops what this page has set in motion, by its text
     */
    constructor(source, doors, tell, address, moved) {
        this.source = source;
        this.doors = doors;
        this.tell = tell;
        /** Jobs by their rank: STOP, requests, samples. One that is dropped does not get its turn.
         * @type {{ run: () => Promise<void>, drop: () => void }[][]} */
        this.jobs = [[], [], []];
        this.busy = false;
        this.open = true;
        /** @type {import('./types.js').Axes} */
        this.axes = { address, product: null };
        this.moved = moved;
        /** The module stores commands, and does not carry them out. */
        this.downloading = false;
        /** What the tools were at when STOP was pressed is not carried on: until they begin with something else. */
        this.refuses = false;
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
            await job.run();
        }
        this.busy = false;
    }

    /**
     * A request in its turn. `begin` is called before it is sent.
     * @param {number} rank
     * @param {Request} request
     * @param {number} timeout
     * @param {() => void} begin
     * @returns {Promise<Outcome>}
     */
    #exchange(rank, request, timeout, begin = () => undefined) {
        return new Promise((resolve) => {
            const run = async () => {
                if (rank === SAMPLE && this.downloading) {
                    // It would be stored in between the commands of the program.
                    resolve('interrupted');
                    return;
                }
                try {
                    begin();
                    resolve(this.open ? await this.source.exchange(request, timeout) : { lost: 'the link is closed' });
                } catch (error) {
                    resolve({ lost: error instanceof Error ? error.message : String(error) });
                }
            };
            this.jobs[rank].push({ run, drop: () => resolve('interrupted') });
            void this.#work();
        });
    }

    /**
     * A request of the tools.
     * @param {import('./types.js').Exchange} asked
     * @returns {Promise<Outcome>}
     */
    async request({ request, timeout }) {
        return this.refuses ? 'interrupted' : this.#exchange(REQUEST, request, timeout, () => this.#note(request));
    }

    /** The tools begin with something new. */
    begin() {
        this.refuses = false;
    }

    /**
     * Notes what has to be known of a request that is going to be sent.
     * @param {Request} request
     */
    #note(request) {
        /** @type {import('./types.js').Noted} */
        const { stops, download } = this.doors.ask('stop_noted', { request, product: this.axes.product });
        this.downloading = download ?? this.downloading;
        for (const stop of stops) {
            this.moved.set(JSON.stringify(stop), stop);
            this.tell({ moved: true });
        }
    }

    /** Stops all motors, again and again until that is answered; and once more if it is pressed meanwhile. */
    async stop() {
        this.pressed = true;
        // What waits is not done after this.
        this.refuses = true;
        this.jobs[REQUEST].splice(0).forEach((job) => job.drop());
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
                if (this.downloading) {
                    left = [...this.moved.values(), ...left];
                }
            }
            const again = [];
            for (const request of left) {
                const outcome = await this.#exchange(STOP, request, STOP_TIMEOUT);
                const { requests } = this.doors.ask('stop_left', { request, outcome });
                if (requests.length > 0) {
                    again.push(...requests);
                    this.tell({ stopped: false });
                }
            }
            left = again;
            this.tell({ stopped: left.length === 0 });
            if (left.length > 0 && !this.pressed) {
                await this.#sleep(AGAIN);
            }
        }
        this.stopping = false;
        if (left.length === 0) {
            this.downloading = false;
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
            if (this.downloading) {
                await sleep(ROW);
                continue;
            }
            const at = performance.now();
            const values = this.source.look?.(columns) ?? (await this.#values(columns));
            if (columns === this.columns) {
                this.rows.push({ at, values });
            }
            if (performance.now() - told >= PORTION && this.rows.length > 0) {
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
            const outcome = await this.#exchange(SAMPLE, request, SAMPLE_TIMEOUT);
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
        this.refuses = true;
        this.jobs[REQUEST].splice(0).forEach((job) => job.drop());
        for (const request of this.moved.values()) {
            await this.#exchange(STOP, request, STOP_TIMEOUT);
        }
        this.open = false;
        await this.source.close();
    }
}
