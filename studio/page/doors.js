// An instance of the Rust, and its doors: JSON in, JSON out.

/** @typedef {import('./types.js').Answer} Answer */

/** Whether the browser can suspend WebAssembly while the page waits (JavaScript Promise Integration). */
export const canSuspend = 'Suspending' in WebAssembly && 'promising' in WebAssembly;

/** Something that the Rust has refused, in words for the user. */
export class Refusal extends Error {}

/** The user has asked to end. */
export class Ended extends Error {}

/** The instance has ended with a mistake of its own, and has to be started anew. */
export class Dead extends Error {}

/**
 * What the Rust calls: those of Wire and Stop, and no other. Where the browser can suspend WebAssembly they may give promises.
 * @typedef {object} World
 * @property {(asked: import('./types.js').Exchange) => any} exchange sends a request, and gives its outcome
 * @property {(milliseconds: number) => any} pause lets time pass; true if it has been asked to end
 * @property {(milliseconds: number) => any} within waits, or until it has been asked to end; then true
 * @property {() => void} forget what has been asked so far does not count any more
 */

/** For an instance that calls nobody.
 * @type {World} */
export const NOBODY = {
    exchange: () => ({ lost: 'nobody is there' }),
    pause: () => false,
    within: () => false,
    forget: () => {},
};

const encoder = new TextEncoder();
const decoder = new TextDecoder();

/** An instance of the Rust. */
export class Doors {
    /** @param {WebAssembly.Instance} instance */
    constructor(instance) {
        /** @type {any} */
        this.exports = instance.exports;
        /** @type {Map<string, (length: number) => Promise<number>>} */
        this.promising = new Map();
    }

    /**
     * Makes an instance.
     * @param {WebAssembly.Module} module
     * @param {World} world
     * @param {boolean} suspends whether what the world gives may be promises
     */
    static async open(module, world, suspends) {
        /** @type {Doors | undefined} */
        let doors;
        /** @param {number} at @param {number} length */
        const bytes = (at, length) => new Uint8Array(/** @type {Doors} */ (doors).exports.memory.buffer, at, length);
        /** @param {any} outcome @param {number} at @param {number} room */
        const put = (outcome, at, room) => {
            const answer = encoder.encode(JSON.stringify(outcome)).subarray(0, room);
            bytes(at, answer.length).set(answer);
            return answer.length;
        };
        /** @param {number} asked @param {number} length */
        const read = (asked, length) => JSON.parse(decoder.decode(bytes(asked, length).slice()));
        const wrapped = suspends
            ? {
                  /** @param {number} asked @param {number} length @param {number} at @param {number} room */
                  exchange: async (asked, length, at, room) => put(await world.exchange(read(asked, length)), at, room),
                  /** @param {number} time */
                  pause: async (time) => Number(await world.pause(time)),
                  /** @param {number} time */
                  within: async (time) => Number(await world.within(time)),
              }
            : {
                  /** @param {number} asked @param {number} length @param {number} at @param {number} room */
                  exchange: (asked, length, at, room) => put(world.exchange(read(asked, length)), at, room),
                  /** @param {number} time */
                  pause: (time) => Number(world.pause(time)),
                  /** @param {number} time */
                  within: (time) => Number(world.within(time)),
              };
        const Suspending = /** @type {any} */ (WebAssembly).Suspending;
        /** @param {any} called */
        const may = (called) => (suspends ? new Suspending(called) : called);
        const instance = await WebAssembly.instantiate(module, {
            wire: { exchange: may(wrapped.exchange), pause: may(wrapped.pause), time: () => performance.now() },
            stop: { within: may(wrapped.within), forget: () => world.forget() },
        });
        doors = new Doors(instance);
        return doors;
    }

    /**
     * Asks at a door that calls nobody, or whose world gives no promises.
     * @param {string} door
     * @param {object} asked
     * @returns {any}
     */
    ask(door, asked = {}) {
        const length = this.#write(asked);
        try {
            return this.#answer(this.exports[door](length));
        } catch (error) {
            throw this.#cause(error);
        }
    }

    /**
     * Asks at a door that waits for promises of its world. One at a time.
     * @param {string} door
     * @param {object} asked
     * @returns {Promise<any>}
     */
    async wait(door, asked = {}) {
        let entered = this.promising.get(door);
        if (!entered) {
            entered = /** @type {any} */ (WebAssembly).promising(this.exports[door]);
            this.promising.set(door, /** @type {any} */ (entered));
        }
        const length = this.#write(asked);
        try {
            return this.#answer(await /** @type {any} */ (entered)(length));
        } catch (error) {
            throw this.#cause(error);
        }
    }

    /**
     * Gives a file to a door that takes one.
     * @param {string} door
     * @param {Uint8Array} bytes
     * @returns {any}
     */
    give(door, bytes) {
        try {
            return this.#answer(this.exports[door](this.#put(bytes)));
        } catch (error) {
            throw this.#cause(error);
        }
    }

    /** @param {object} asked */
    #write(asked) {
        return this.#put(encoder.encode(JSON.stringify(asked)));
    }

    /** @param {Uint8Array} bytes */
    #put(bytes) {
        const at = this.exports.room(bytes.length);
        new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
        return bytes.length;
    }

    /** @param {number} length */
    #text(length) {
        return decoder.decode(new Uint8Array(this.exports.memory.buffer, this.exports.answer(), length).slice());
    }

    /** @param {number} length */
    #answer(length) {
        /** @type {any} */
        const answer = JSON.parse(this.#text(length));
        if ('ok' in answer) {
            return answer.ok;
        }
        throw 'error' in answer ? new Refusal(answer.error) : new Ended(answer.interrupted);
    }

    /** @param {unknown} error */
    #cause(error) {
        if (!(error instanceof WebAssembly.RuntimeError)) {
            return error;
        }
        const words = this.#text(this.exports.panicked());
        return new Dead(words || error.message);
    }
}
