// The worker of a link. It goes on whatever becomes of the tools.

import { Host } from './host.js';

const page = /** @type {any} */ (self);
const host = new Host((told) => page.postMessage({ told }));

page.addEventListener('message', (/** @type {MessageEvent} */ event) => {
    const { port, ...message } = event.data;
    if (port) {
        port.onmessage = (/** @type {MessageEvent} */ asked) => void host.answer(port, asked.data);
        return;
    }
    void host.answer(page, message);
});
page.postMessage({ told: { ready: true } });
