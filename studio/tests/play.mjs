// In Node: does a session to a virtual module as the page's link does, and prints its rows as the page's CSV has them.

import { readFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';

const folder = pathToFileURL(process.argv[2] + '/');
const { Doors, NOBODY } = await import(new URL('doors.js', folder));
const { VirtualSource } = await import(new URL('virtual.js', folder));
const { csv } = await import(new URL('scope/csv.js', folder));
const { Rings } = await import(new URL('scope/rings.js', folder));

const module = await WebAssembly.compile(await readFile(new URL('tmcl_studio.wasm', folder)));
const doors = await Doors.open(module, NOBODY, false);
const { session } = doors.ask('session_read', { text: await readFile(process.argv[3], 'utf8') });
const { start, done, until, curves: texts } = session;
const asked = { address: 1, product: start.product, is_virtual: true, texts };
const { curves } = doors.ask('scope_curves', asked);
const rings = new Rings();
rings.begin(curves.map(({ decimals }) => decimals));
await new Promise((ended) => {
    const source = new VirtualSource(doors, { play: { start, done, until } }, (told) => told.left === 0 && ended());
    source.watch(texts, (rows) => rows.forEach(({ at, values }) => rings.push(at, values)));
    void source.control('speed max').then(() => source.control('resume'));
});
const text = await csv(rings, curves, rings.first, rings.next);
process.stdout.write(text, () => process.exit());
