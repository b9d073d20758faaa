// A link to a module: one exchange at a time. STOP comes before all else, and requests before samples.

import { Sampler } from './sampler.js';

/** @typedef {import('./types.js').Request} Request */
/** @typedef {import('./types.js').Outcome} Outcome */

/**
 * What a link leads to: a virtual module, or a serial port.
 * @typedef {object} Source
 * @property {number} late how long after the end of its time a reply may come and be taken for another one's, in milliseconds
 * @property {(request: Request, timeout: number) => Promise<Outcome>} exchange
 * @property {(texts: string[]) => import('./types.js').SampleRow} [look] looks at curves without a telegram
 * @property {(texts: string[], hear: (rows: import('./types.js').SampleRow[]) => void) => void} [watch] gives a row for each
 *     millisecond
 * @property {(texts: string[]) => import('./types.js').WorldSeen} [see] looks at curves, and at how time goes
 * @property {boolean} [paused] its time does not go by itself
 * @property {number | null} [left] how much is left of a session that is done again, and not to be disturbed
 * @property {boolean} [runsImage] it is no firmware into whose memory one can look
 * @property {() => import('./types.js').Play} [done] what has been done to a virtual module
 * @property {() => import('./types.js').Contents} [eeprom] what the EEPROM of a virtual module has
 * @property {(line: string) => Promise<string>} control
 * @property {() => Promise<void>} close
 */

/** The ranks of what is sent: that which tidies up behind a STOP is not to be cut in two by requests. */
const STOP = 0;
const TIDY = 1;
const REQUEST = 2;
const SAMPLE = 3;
/** How long the reply to a STOP is waited for, in milliseconds. */
const STOP_TIMEOUT = 300;
/** How long the reply to a sample is waited for. */
const SAMPLE_TIMEOUT = 1000;
/** Time between two attempts of a STOP that is not answered, in which requests go on. */
const AGAIN = 250;
/** Most characters of the log that wait for the page. */
const MOST_LOGGED = 1_000_000;

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
        /** Jobs by their rank. One that is dropped does not get its turn.
         * @type {{ run: () => Promise<void>, drop: () => void }[][]} */
        this.jobs = [[], [], [], []];
        this.busy = false;
        /** When no reply is late any more. */
        this.settled = 0;
        /** @type {ReturnType<typeof setTimeout> | undefined} */
        this.settling = undefined;
        this.open = true;
        /** @type {import('./types.js').Axes} */
        this.axes = { address, product: null };
        this.moved = moved;
        /** While the module stores commands, and does not carry them out: what ends that, and what leaves nothing of the program.
         * @type {{ end: Request, clear: Request[] } | undefined} */
        this.download = undefined;
        /** What the tools were at when STOP was pressed is not carried on: until they begin with something else. */
        this.refuses = false;
        this.stopping = false;
        this.pressed = false;
        /** @type {(() => void) | undefined} */
        this.wake = undefined;
        this.sampler = new Sampler(this, tell);
        /** What has gone over the link since somebody has taken it. */
        this.logged = '';
    }

    async #work() {
        if (this.busy) {
            return;
        }
        this.busy = true;
        for (let job = this.#next(); job; job = this.#next()) {
            await job.run();
        }
        this.busy = false;
    }

    /** The next job. As long as a late reply may come, which would be taken for that to something else, only STOP has its turn. */
    #next() {
        const late = this.settled - performance.now();
        if (late <= 0 || this.jobs[STOP].length > 0) {
            return this.jobs.find((jobs) => jobs.length > 0)?.shift();
        }
        clearTimeout(this.settling);
        this.settling = setTimeout(() => void this.#work(), late);
        return undefined;
    }

    /**
     * What waits does not get its turn.
     * @param {number} rank
     */
    #drop(rank) {
        this.jobs[rank].splice(0).forEach((job) => job.drop());
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
                if (rank === SAMPLE && this.download) {
                    // It would be stored in between the commands of the program.
                    resolve('interrupted');
                    return;
                }
                try {
                    begin();
                    const begun = performance.now();
                    const outcome = this.open ? await this.source.exchange(request, timeout) : { lost: 'the link is closed' };
                    if (typeof outcome === 'object' && !('reply' in outcome)) {
                        this.settled = performance.now() + this.source.late;
                    }
                    resolve(outcome);
                    this.#log(request, begun, outcome);
                } catch (error) {
                    resolve({ lost: error instanceof Error ? error.message : String(error) });
                }
            };
            this.jobs[rank].push({ run, drop: () => resolve('interrupted') });
            void this.#work();
        });
    }

    /**
     * @param {Request | null} request null for what has come without being asked for
     * @param {number} begun
     * @param {Outcome} outcome
     */
    #log(request, begun, outcome) {
        const exchanged = { product: this.axes.product, is_virtual: this.source.look !== undefined, request, begun, outcome };
        this.logged += this.doors.ask('log_note', { ...exchanged, ended: performance.now() }).text;
        // The page takes it several times a second; where it cannot, the latest is kept.
        if (this.logged.length > MOST_LOGGED) {
            this.logged = this.logged.slice(this.logged.indexOf('\n', MOST_LOGGED / 2) + 1);
        }
    }

    /** What has gone over the link since the last call, in lines. */
    takeLog() {
        const { logged } = this;
        this.logged = '';
        return logged;
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
        if (download !== 'same') {
            this.download = download === 'over' ? undefined : download.begun;
        }
        stops.forEach((stop) => this.moved.set(JSON.stringify(stop), stop));
        if (this.download || stops.length > 0) {
            this.tell({ moved: true });
        }
    }

    /** Stops all motors, again and again until that is answered; and once more if it is pressed meanwhile. */
    async stop() {
        this.pressed = true;
        // What waits is not done after this.
        this.refuses = true;
        this.#drop(REQUEST);
        this.#drop(TIDY);
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
                if (this.download) {
                    left.unshift(this.download.end);
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
            } else if (!this.pressed) {
                await this.#tidy();
            }
        }
        this.stopping = false;
        if (left.length === 0) {
            this.moved.clear();
            this.tell({ moved: false });
        }
    }

    /** Leaves nothing of a program that was broken off, unless STOP is pressed once more: its last request ends download mode. */
    async #tidy() {
        const clear = this.download?.clear ?? [];
        await Promise.all(
            clear.map((request) => this.#exchange(TIDY, request, STOP_TIMEOUT, () => this.#note(request))),
        );
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

    /**
     * The value that a request reads, behind all others; null if there is none.
     * @param {Request} request
     * @returns {Promise<number | null>}
     */
    async sample(request) {
        const outcome = await this.#exchange(SAMPLE, request, SAMPLE_TIMEOUT);
        return this.doors.ask('scope_value', { request, outcome }).value;
    }

    /**
     * Values of the world of a virtual module, and how its time goes.
     * @param {string[]} texts
     */
    see(texts) {
        return this.#virtual('see')(texts);
    }

    /** What a virtual module was when it began, and what has been done to it since. */
    done() {
        return this.#virtual('done')();
    }

    /** What the EEPROM of a virtual module has. */
    eeprom() {
        return this.#virtual('eeprom')();
    }

    /**
     * Something that only a virtual module does.
     * @param {'see' | 'done' | 'eeprom'} name
     * @returns {any}
     */
    #virtual(name) {
        const { source } = this;
        const found = source[name];
        if (!found) {
            throw new Error('this is for virtual modules only');
        }
        return found.bind(source);
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
        this.sampler.end();
        this.refuses = true;
        this.#drop(REQUEST);
        const stops = [...this.moved.values()];
        for (const request of this.download ? [this.download.end, ...stops] : stops) {
            await this.#exchange(STOP, request, STOP_TIMEOUT);
        }
        await this.#tidy();
        this.open = false;
        await this.source.close();
    }
}
