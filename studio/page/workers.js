// How workers are made: all of them here.

/**
 * Makes a worker of a script of this page. A worker that is loaded from an address does not obey a policy that stands in the
 * page; one that is made of a text does, and its only line fetches the script.
 * @param {string} script its name, beside this file
 */
export function worker(script) {
    const address = new URL(script, import.meta.url).href;
    const text = new Blob([`import ${JSON.stringify(address)};`], { type: 'text/javascript' });
    const made = URL.createObjectURL(text);
    const started = new Worker(made, { type: 'module' });
    // The address is needed until the worker has fetched the text, which it has when it says something.
    started.addEventListener('message', () => URL.revokeObjectURL(made), { once: true });
    return started;
}
