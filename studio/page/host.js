// Who has a link, and answers the ports to it: a worker of its own, or the tools' worker where the browser does not suspend
// WebAssembly.

import { Doors, NOBODY } from './doors.js';
import { Link } from './link.js';
import { SerialSource } from './serial.js';
import { VirtualSource } from './virtual.js';

/** How long the reply to a request of the page is waited for, in milliseconds. */
const SEND_TIMEOUT = 1000;
/** Time between two attempts to open a link that was lost, in milliseconds. */
const AGAIN = 1000;

/** A link and its ports. */
export class Host {
    /** @param {(told: any) => void} tell tells the page */
    constructor(tell) {
        this.tell = tell;
        /** @type {Link | undefined} */
        this.link = undefined;
        /** @type {any} */
        this.wanted = undefined;
        /** @type {WebAssembly.Module | undefined} */
        this.module = undefined;
        this.address = 1;
    }

    /** A STOP could not be sent, because the link is lost. The page asks for it again when the module is identified anew. */
    #owe() {
        this.tell({ stopped: false, owed: true });
    }

    /**
     * Does what a message of the page asks for.
     * @param {any} asked
     * @returns {Promise<any>}
     */
    async hear(asked) {
        if (asked.open) {
            return this.open(asked.module, asked.open, asked.address);
        }
        if (asked.leave) {
            this.wanted = undefined;
            await this.link?.leave();
            this.link = undefined;
            return {};
        }
        const link = this.link;
        if (!link) {
            if (asked.stop && this.wanted !== undefined) {
                this.#owe();
                return {};
            }
            throw new Error('the link is not open');
        }
        if (asked.exchange) {
            return link.request(asked.exchange);
        }
        if (asked.begin) {
            link.begin();
            return {};
        }
        if (asked.axes) {
            link.axes = asked.axes;
        }
        if (asked.stop) {
            void link.stop();
        } else if (asked.watch) {
            link.sampler.watch(asked.watch);
        } else if (asked.unwatch !== undefined) {
            link.sampler.unwatch(asked.unwatch);
        } else if (asked.send) {
            return link.request({ request: asked.send, timeout: SEND_TIMEOUT });
        } else if (asked.log) {
            return { text: link.takeLog() };
        } else if (asked.see) {
            return link.see(asked.see);
        } else if (asked.done) {
            return link.done();
        } else if (asked.eeprom) {
            return link.eeprom();
        } else if (asked.control !== undefined) {
            return link.control(asked.control);
        }
        return {};
    }

    /**
     * Opens a link.
     * @param {WebAssembly.Module} module
     * @param {any} wanted
     * @param {number} address
     */
    async open(module, wanted, address) {
        this.address = address;
        this.module = module;
        this.wanted = wanted;
        this.link = await this.#make(module, wanted, new Map());
        return {};
    }

    /**
     * @param {WebAssembly.Module} module
     * @param {any} wanted
     * @param {Map<string, import('./types.js').Request>} moved
     */
    async #make(module, wanted, moved) {
        const doors = await Doors.open(module, NOBODY, false);
        /** @param {any} told */
        const hear = (told) => {
            this.tell(told);
            if (told.lost !== undefined) {
                void this.#lose();
            }
        };
        const source =
            wanted.serial === undefined
                ? new VirtualSource(doors, wanted, hear)
                : await SerialSource.open(doors, wanted.serial, hear);
        return new Link(source, doors, this.tell, this.address, moved);
    }

    /** Tries again each second until the link is there. */
    async #lose() {
        const wanted = this.wanted;
        if (wanted?.play) {
            // A session is not done again by itself.
            this.wanted = undefined;
        }
        const lost = this.link;
        this.link = undefined;
        if (lost) {
            lost.open = false;
            if (lost.stopping) {
                this.#owe();
            }
            await lost.source.close();
        }
        const moved = lost?.moved ?? new Map();
        const isWanted = () => this.wanted !== undefined && this.wanted === wanted;
        while (isWanted() && !this.link) {
            await new Promise((resolve) => setTimeout(resolve, AGAIN));
            if (!isWanted()) {
                return;
            }
            try {
                const link = await this.#make(/** @type {WebAssembly.Module} */ (this.module), wanted, moved);
                if (!isWanted()) {
                    await link.leave();
                    return;
                }
                this.link = link;
                this.tell({ opened: true });
            } catch (error) {
                this.tell({ retry: error instanceof Error ? error.message : String(error) });
            }
        }
    }

    /**
     * Answers a port.
     * @param {MessagePort | { postMessage: (message: any) => void }} port
     * @param {{ id: number, asked: any }} message
     */
    async answer(port, { id, asked }) {
        try {
            port.postMessage({ id, ok: await this.hear(asked) });
        } catch (error) {
            port.postMessage({ id, error: error instanceof Error ? error.message : String(error) });
        }
    }
}
