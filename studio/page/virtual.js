// A virtual module as what a link leads to: one that runs the firmware's core, or a flash image, or to which is done what was done to
// another one. Its time goes by the clock.

/** @typedef {import('./types.js').Request} Request */
/** @typedef {import('./types.js').Outcome} Outcome */

/**
 * Which virtual module is wanted: one of these.
 * @typedef {object} Wanted
 * @property {import('./types.js').Start} [virtual] how it is started
 * @property {Uint8Array} [image] the flash image that it runs in place of the core
 * @property {import('./types.js').Play} [play] a session that is done again
 */

/** Time between two words about how much of a session is left, in milliseconds. */
const TELL = 100;

/** A virtual module. */
export class VirtualSource {
    /**
     * @param {import('./doors.js').Doors} doors
     * @param {Wanted} wanted
     * @param {(told: any) => void} tell
     */
    constructor(doors, { virtual, image, play }, tell) {
        this.doors = doors;
        this.tell = tell;
        /** Each reply has the number of its request. */
        this.late = 0;
        /** Takes the rows that are watched.
         * @type {(rows: import('./types.js').SampleRow[]) => void} */
        this.rows = () => undefined;
        this.paused = false;
        this.powered = true;
        this.starts = 0;
        this.stored = 0;
        /** It runs a flash image, into whose memory nobody looks. */
        this.runsImage = image !== undefined;
        /** How much is left of a session that is done again, in milliseconds; null if there is none.
         * @type {number | null} */
        this.left = null;
        this.toldLeft = 0;
        /** Why it cannot go on.
         * @type {string | null} */
        this.halted = null;
        /** @type {Map<number, (outcome: Outcome) => void>} */
        this.asked = new Map();
        /** Lines of the control port that are not answered yet, by their numbers.
         * @type {Map<number, (line: string) => void>} */
        this.lines = new Map();
        this.open = true;
        /** @type {ReturnType<typeof setTimeout> | undefined} */
        this.timer = undefined;
        if (play) {
            doors.ask('virtual_play', play);
        } else if (image) {
            doors.give('image_take', image);
            doors.ask('virtual_start_image', virtual);
        } else {
            doors.ask('virtual_start', virtual);
        }
        this.#turn();
    }

    #turn() {
        clearTimeout(this.timer);
        if (!this.open) {
            return;
        }
        try {
            const nap = this.#pass();
            this.timer = setTimeout(() => this.#turn(), this.asked.size + this.lines.size > 0 ? 0 : nap);
        } catch (error) {
            this.open = false;
            this.asked.forEach((resolve) => resolve({ lost: 'the virtual module has ended' }));
            this.tell({ lost: `the virtual module has ended: ${error instanceof Error ? error.message : error}` });
        }
    }

    /** Lets time pass up to the present, and hands out what has come of it. */
    #pass() {
        /** @type {import('./types.js').Turn} */
        const turn = this.doors.ask('virtual_turn');
        for (const { ticket, outcome } of turn.replies) {
            this.asked.get(ticket)?.(outcome);
            this.asked.delete(ticket);
        }
        for (const { ticket, line } of turn.lines) {
            const waits = ticket === null ? undefined : this.lines.get(ticket);
            waits ? waits(line) : this.tell({ line });
            this.lines.delete(ticket ?? 0);
        }
        this.paused = turn.paused;
        if ((turn.powered && !this.powered) || turn.starts !== this.starts) {
            // It knows nothing any more of what was not stored.
            this.tell({ opened: true });
        }
        if (!turn.powered && this.powered) {
            this.tell({ powered: false });
        }
        this.powered = turn.powered;
        this.starts = turn.starts;
        this.#tellNews(turn);
        if (turn.rows.length > 0) {
            this.rows(turn.rows);
        }
        turn.messages.forEach((text) => this.tell(this.runsImage ? { log: text } : { message: text }));
        return turn.nap;
    }

    /**
     * Tells what has changed.
     * @param {import('./types.js').Turn} turn
     */
    #tellNews({ stored, left, stopped }) {
        if (stored !== this.stored) {
            this.stored = stored;
            this.tell({ stored });
        }
        const isDue = left !== null && left > 0 ? performance.now() - this.toldLeft >= TELL : left !== this.left;
        if (isDue) {
            this.toldLeft = performance.now();
            this.tell({ left });
        }
        this.left = left;
        if (stopped !== null && this.halted === null) {
            this.halted = stopped;
            this.tell({ halted: stopped });
        }
    }

    /**
     * @param {Request} request
     * @param {number} timeout
     * @returns {Promise<Outcome>}
     */
    exchange(request, timeout) {
        return new Promise((resolve) => {
            if (!this.open) {
                resolve({ lost: 'the virtual module has ended' });
                return;
            }
            const { ticket } = this.doors.ask('virtual_ask', request);
            const timer = setTimeout(() => {
                this.asked.delete(ticket);
                resolve({ no_reply: 0 });
            }, timeout);
            this.asked.set(ticket, (outcome) => {
                clearTimeout(timer);
                resolve(outcome);
            });
            this.#turn();
        });
    }

    /**
     * Values of curves, which are looked at without letting time pass.
     * @param {string[]} texts
     * @returns {import('./types.js').SampleRow}
     */
    look(texts) {
        return this.doors.ask('virtual_look', { texts });
    }

    /**
     * Values of curves, looked at without letting time pass, and how it goes.
     * @param {string[]} texts
     * @returns {import('./types.js').WorldSeen}
     */
    see(texts) {
        return this.doors.ask('virtual_see', { texts });
    }

    /**
     * A row of curves for each millisecond from now on.
     * @param {string[]} texts
     * @param {(rows: import('./types.js').SampleRow[]) => void} hear
     */
    watch(texts, hear) {
        this.rows = hear;
        this.doors.ask('virtual_watch', { texts });
    }

    /**
     * A request without a promise, for a browser that does not suspend WebAssembly.
     * @param {Request} request
     * @param {number} timeout
     * @returns {Outcome}
     */
    exchangeNow(request, timeout) {
        /** @type {Outcome | undefined} */
        let ended;
        const { ticket } = this.doors.ask('virtual_ask', request);
        this.asked.set(ticket, (outcome) => (ended = outcome));
        const until = performance.now() + timeout;
        while (ended === undefined && performance.now() < until) {
            this.#pass();
        }
        this.asked.delete(ticket);
        return ended ?? { no_reply: 0 };
    }

    /**
     * Lets time pass without a promise.
     * @param {number} milliseconds
     */
    passNow(milliseconds) {
        const until = performance.now() + milliseconds;
        while (performance.now() < until) {
            this.#pass();
        }
    }

    /**
     * @param {string} line
     * @returns {Promise<string>}
     */
    control(line) {
        return new Promise((resolve) => {
            const { ticket } = this.doors.ask('virtual_control', { line });
            this.lines.set(ticket, resolve);
            this.#turn();
        });
    }

    /** What it was when it began, and what has been done to it since.
     * @returns {import('./types.js').Play} */
    done() {
        return this.doors.ask('virtual_done');
    }

    /** What its EEPROM has.
     * @returns {import('./types.js').Contents} */
    eeprom() {
        return this.doors.ask('virtual_eeprom');
    }

    async close() {
        this.open = false;
        clearTimeout(this.timer);
    }
}
