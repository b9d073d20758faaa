// What the panels of inputs and axes share: values that are read again and again, and elements to show them.

import { words } from '../dom.js';

/**
 * What a panel asks of the page.
 * @typedef {object} Services
 * @property {(door: string, asked: object) => Promise<any>} ask asks at a door that needs no module
 * @property {(requests: import('../types.js').Request[], hear: (values: (number | null)[]) => void) => () => void} sample
 *     reads requests again and again, until the function is called that this gives
 * @property {(name: string, door: string, asked: object) => Promise<any>} job gives the tools a job at the module
 * @property {(request: import('../types.js').Request) => Promise<number | null>} send
 *     sends a request, and gives the value of its reply; null if it was not carried out
 * @property {(text: string) => void} announce tells a screen reader
 */

/**
 * A module that has told what it is.
 * @typedef {object} There
 * @property {string | null} product null for one that is not known
 * @property {number} address
 */

/**
 * Does something as long as an element is shown: where the page is narrow, only one of its parts is.
 * @param {Element} element
 * @param {() => () => void} begin gives what ends it
 * @returns {() => void} ends it for good
 */
function whileShown(element, begin) {
    /** @type {(() => void) | undefined} */
    let end;
    const look = () => {
        const shown = element.checkVisibility();
        if (shown && !end) {
            end = begin();
        } else if (!shown) {
            end?.();
            end = undefined;
        }
    };
    // What is not shown has no size.
    const observer = new ResizeObserver(look);
    observer.observe(element);
    look();
    return () => {
        observer.disconnect();
        end?.();
    };
}

/**
 * Reads requests again and again as long as an element is shown, has the values put into words, and draws these. While the
 * words are made, only the latest values wait.
 * @template T
 * @param {Element} element
 * @param {Services} services
 * @param {import('../types.js').Request[]} requests
 * @param {(values: (number | null)[]) => Promise<T>} tell makes words of values
 * @param {(words: T) => void} draw
 * @returns {() => void} ends it: nothing is drawn any more
 */
export function read(element, services, requests, tell, draw) {
    if (requests.length === 0) {
        return () => {};
    }
    let ended = false;
    let busy = false;
    /** @type {(number | null)[] | undefined} */
    let latest;
    const turn = async () => {
        busy = true;
        while (latest && !ended) {
            const values = latest;
            latest = undefined;
            try {
                const words = await tell(values);
                if (!ended) {
                    draw(words);
                }
            } catch {
                // The tables are being loaded anew: the next values are told again.
            }
        }
        busy = false;
    };
    const hear = (/** @type {(number | null)[]} */ values) => {
        if (values.length === requests.length) {
            latest = values;
            if (!busy) {
                void turn();
            }
        }
    };
    const end = whileShown(element, () => services.sample(requests, hear));
    return () => {
        ended = true;
        end();
    };
}

/** What a panel reads of the module that is there, as long as it is. */
export class Reading {
    /** @param {Services} services */
    constructor(services) {
        this.services = services;
        /** Counts the modules, so that what was asked of one is not shown of another. */
        this.turn = 0;
        this.end = () => {};
    }

    /**
     * Asks what there is to be read. Undefined if that is not known, or not wanted any more.
     * @param {There} there
     * @param {(why: string) => void} fail takes why it is not known
     * @returns {Promise<import('../types.js').StatusRequests | undefined>}
     */
    async begin({ product, address }, fail) {
        const { turn } = this;
        try {
            const told = await this.services.ask('status_requests', { address, product });
            return turn === this.turn ? told : undefined;
        } catch (error) {
            if (turn === this.turn) {
                fail(words(error));
            }
            return undefined;
        }
    }

    /** The module is there no more. */
    stop() {
        this.turn += 1;
        this.end();
        this.end = () => {};
    }
}
