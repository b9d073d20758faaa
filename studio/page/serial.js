// A serial port as what a link leads to (Web Serial).

/** @typedef {import('./types.js').Request} Request */
/** @typedef {import('./types.js').Outcome} Outcome */

/** How late a reply may come after its time is over, in milliseconds: a module may be told to wait for 255 before it replies, and two
 * telegrams last 19 at 9600 bit/s. */
const LATE = 300;

/** A port that cannot be used, in words for the user. */
export class NoPort extends Error {}

/**
 * Which port it is, for another worker, to which no port can be sent: the numbers that USB has for its kind, and how many of
 * the same kind come before it.
 * @typedef {{ kind: string, number: number }} Place
 */

/**
 * The ports that this page may use, each with its place.
 * @returns {Promise<(Place & { port: any })[]>}
 */
export async function allowed() {
    /** @type {Map<string, number>} */
    const counts = new Map();
    const ports = await /** @type {any} */ (navigator).serial.getPorts();
    return ports.map((/** @type {any} */ port) => {
        const { usbVendorId, usbProductId } = port.getInfo();
        const kind = `${usbVendorId ?? ''}:${usbProductId ?? ''}`;
        const number = counts.get(kind) ?? 0;
        counts.set(kind, number + 1);
        return { kind, number, port };
    });
}

/** An open port. It belongs to one tab. */
export class SerialSource {
    /**
     * @param {import('./doors.js').Doors} doors
     * @param {any} port
     * @param {() => void} free gives the port to other tabs
     * @param {(told: any) => void} tell
     */
    constructor(doors, port, free, tell) {
        this.doors = doors;
        this.port = port;
        this.free = free;
        this.tell = tell;
        this.late = LATE;
        /** Who waits for a reply.
         * @type {((outcome: Outcome) => void) | undefined} */
        this.waits = undefined;
        /** @type {string | undefined} */
        this.lost = undefined;
        this.reader = port.readable.getReader();
        this.writer = port.writable.getWriter();
        void this.#read();
    }

    /**
     * Opens a port that was allowed before.
     * @param {import('./doors.js').Doors} doors
     * @param {{ baudRate: number, place: Place }} wanted
     * @param {(told: any) => void} tell
     */
    static async open(doors, { baudRate, place }, tell) {
        const alike = (await allowed()).filter((other) => other.kind === place.kind);
        // One that was unplugged may come back with another number.
        const found = alike[place.number] ?? alike.at(-1);
        if (!found) {
            throw new NoPort('the port is gone: is the module connected?');
        }
        const { port, ...there } = found;
        const free = await claim(`serial port ${there.kind} ${there.number}`);
        try {
            await port.open({ baudRate, bufferSize: 4096 });
        } catch (error) {
            free();
            const why = error instanceof Error ? error.message : String(error);
            throw new NoPort(`the port cannot be opened: ${why}. Does another program use it?`);
        }
        return new SerialSource(doors, port, free, tell);
    }

    async #read() {
        let why = 'the port is closed';
        try {
            for (;;) {
                const { value, done } = await this.reader.read();
                if (done) {
                    break;
                }
                this.#hear(value);
            }
        } catch (error) {
            why = error instanceof Error ? error.message : String(error);
        }
        this.#lose(why);
    }

    /** @param {Uint8Array} bytes */
    #hear(bytes) {
        // What comes while nobody waits is a late reply to an earlier request.
        if (this.waits) {
            /** @type {import('./types.js').Taken} */
            const { outcome } = this.doors.ask('serial_take', { bytes: [...bytes] });
            if (outcome !== null) {
                this.#end(outcome);
            }
        }
    }

    /** @param {Outcome} outcome */
    #end(outcome) {
        const waits = this.waits;
        this.waits = undefined;
        waits?.(outcome);
    }

    /** @param {string} why */
    #lose(why) {
        if (this.lost === undefined) {
            this.lost = why;
            this.#end({ lost: why });
            this.tell({ lost: why });
        }
    }

    /**
     * @param {Request} request
     * @param {number} timeout
     * @returns {Promise<Outcome>}
     */
    async exchange(request, timeout) {
        if (this.lost !== undefined) {
            return { lost: this.lost };
        }
        if (request.address > 255) {
            return 'address';
        }
        /** @type {import('./types.js').Bytes} */
        const { bytes } = this.doors.ask('serial_ask', request);
        /** @type {Promise<Outcome>} */
        const ended = new Promise((resolve) => (this.waits = resolve));
        const timer = setTimeout(() => this.waits && this.#end(this.doors.ask('serial_give_up')), timeout);
        try {
            await this.writer.write(new Uint8Array(bytes));
        } catch (error) {
            this.#lose(error instanceof Error ? error.message : String(error));
        }
        const outcome = await ended;
        clearTimeout(timer);
        return outcome;
    }

    /**
     * @param {string} _line
     * @returns {Promise<string>}
     */
    async control(_line) {
        throw new NoPort('a real module has no control port; its world is touched by hand');
    }

    async close() {
        this.lost ??= 'the port is closed';
        const steps = [
            () => this.reader.cancel(),
            () => this.reader.releaseLock(),
            () => this.writer.abort(),
            () => this.writer.releaseLock(),
            () => this.port.close(),
        ];
        for (const step of steps) {
            try {
                await step();
            } catch {
                // A port that is gone is closed already; one that has told an error is not.
            }
        }
        this.free();
    }
}

/**
 * Claims something for this tab, and gives what frees it.
 * @param {string} name
 * @returns {Promise<() => void>}
 */
function claim(name) {
    return new Promise((resolve, reject) => {
        void navigator.locks.request(name, { ifAvailable: true }, (lock) => {
            if (!lock) {
                reject(new NoPort('another tab of this page uses the port: close it there'));
                return undefined;
            }
            return new Promise((free) => resolve(() => free(undefined)));
        });
    });
}
