// The worker of the tools: one job at a time, the others wait.

import { canSuspend, Dead, Doors, Ended } from './doors.js';
import { Host } from './host.js';

/** Why nothing is exchanged. */
const NO_LINK = 'there is no link any more';
/** Time between two reports of how far a job has got, in milliseconds. */
const REPORT = 50;

/**
 * A job: a door, and what is asked there.
 * @typedef {{ id: number, door: string, asked: object }} Job
 */

const page = /** @type {any} */ (self);
/** A link in this worker, where the browser does not suspend WebAssembly. */
const host = canSuspend ? undefined : new Host((told) => page.postMessage({ told }));
/** @type {MessagePort | undefined} */
let link;
/** @type {Doors | undefined} */
let doors;
/** @type {Job[]} */
const jobs = [];
/** @type {Job | undefined} */
let working;
let ended = false;
/** @type {(() => void) | undefined} */
let wake;
let reported = 0;
let last = 0;
/** @type {Map<number, (outcome: import('./types.js').Outcome) => void>} */
const asked = new Map();

/** @param {import('./types.js').Exchange} exchange */
function ask(exchange) {
    report();
    if (host) {
        const source = /** @type {any} */ (host.link)?.source;
        return source ? source.exchangeNow(exchange.request, exchange.timeout) : { lost: NO_LINK };
    }
    if (!link) {
        return { lost: NO_LINK };
    }
    const to = link;
    return new Promise((resolve) => {
        last += 1;
        asked.set(last, resolve);
        to.postMessage({ id: last, asked: { exchange } });
    });
}

/** The link is closed: whoever waits for it waits no more. */
function disconnect() {
    link = undefined;
    asked.forEach((resolve) => resolve({ lost: NO_LINK }));
    asked.clear();
}

/** @param {number} milliseconds */
function wait(milliseconds) {
    if (ended || milliseconds <= 0) {
        return ended;
    }
    if (host) {
        /** @type {any} */ (host.link)?.source.passNow(milliseconds);
        return ended;
    }
    return new Promise((resolve) => {
        const over = () => {
            clearTimeout(timer);
            wake = undefined;
            resolve(ended);
        };
        const timer = setTimeout(over, milliseconds);
        wake = over;
    });
}

/** Tells the page how far the job has got. */
function report() {
    const now = performance.now();
    if (!doors || !working || now - reported < REPORT) {
        return;
    }
    reported = now;
    const progress = doors.ask('progress');
    if (progress.total > 0) {
        page.postMessage({ id: working.id, progress });
    }
}

async function work() {
    if (working || !doors) {
        return;
    }
    for (working = jobs.shift(); working; working = jobs.shift()) {
        const { id, door, asked } = working;
        ended = false;
        page.postMessage({ id, begun: true });
        link?.postMessage({ id: 0, asked: { begin: true } });
        host?.link?.begin();
        try {
            page.postMessage({ id, ok: host ? doors.ask(door, asked) : await doors.wait(door, asked) });
        } catch (error) {
            const words = error instanceof Error ? error.message : String(error);
            if (error instanceof Dead) {
                page.postMessage({ id, dead: words });
                return;
            }
            page.postMessage(error instanceof Ended ? { id, interrupted: words } : { id, error: words });
        }
    }
}

/** @param {MessagePort} port */
function connect(port) {
    link = port;
    port.onmessage = ({ data: { id, ok, error } }) => {
        asked.get(id)?.(error === undefined ? ok : { lost: error });
        asked.delete(id);
    };
}

page.addEventListener('message', async (/** @type {MessageEvent} */ event) => {
    const message = event.data;
    if (message.module) {
        const world = { exchange: ask, pause: wait, within: wait, forget: () => void (ended = false) };
        doors = await Doors.open(message.module, world, canSuspend);
        page.postMessage({ told: { ready: true } });
    } else if (message.port) {
        connect(message.port);
    } else if (message.closed) {
        disconnect();
    } else if (message.end !== undefined) {
        const waiting = jobs.findIndex((job) => job.id === message.end);
        if (waiting >= 0) {
            jobs.splice(waiting, 1);
            page.postMessage({ id: message.end, interrupted: '' });
        } else if (working?.id === message.end) {
            ended = true;
            wake?.();
        }
    } else if (message.link) {
        void host?.answer({ postMessage: (/** @type {any} */ link) => page.postMessage({ link }) }, message.link);
    } else {
        jobs.push(message);
        if (working) {
            page.postMessage({ id: message.id, waits: working.door });
        }
    }
    void work();
});
