// The worker of doors that need no module: texts, tables, words. It never waits for a link.

import { Dead, Doors, NOBODY } from './doors.js';

const page = /** @type {any} */ (self);
/** @type {Promise<Doors> | undefined} */
let doors;

page.addEventListener('message', async (/** @type {MessageEvent} */ { data }) => {
    if (data.module) {
        doors = Doors.open(data.module, NOBODY, false);
        return;
    }
    const { id, door, asked } = data;
    try {
        page.postMessage({ id, ok: (await doors)?.ask(door, asked) });
    } catch (error) {
        const words = error instanceof Error ? error.message : String(error);
        page.postMessage(error instanceof Dead ? { id, dead: words } : { id, error: words });
    }
});
page.postMessage({ told: { ready: true } });
