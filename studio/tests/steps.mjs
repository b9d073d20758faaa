// In Node, which does not suspend WebAssembly: the page's own modules, with a virtual module in the same thread.

import { readFile } from 'node:fs/promises';
import { pathToFileURL } from 'node:url';

const folder = pathToFileURL(process.argv[2] + '/');
const { Doors, NOBODY, canSuspend } = await import(new URL('doors.js', folder));
const { VirtualSource } = await import(new URL('virtual.js', folder));

if (canSuspend) {
    throw new Error('this Node suspends WebAssembly, so that this would show nothing');
}
const module = await WebAssembly.compile(await readFile(new URL('tmcl_studio.wasm', folder)));
const source = new VirtualSource(await Doors.open(module, NOBODY, false), { virtual: { product: '1140', world: null, eeprom: null } }, () => {});
const world = {
    exchange: ({ request, timeout }) => source.exchangeNow(request, timeout),
    pause: (milliseconds) => (source.passNow(milliseconds), false),
    within: (milliseconds) => (source.passNow(milliseconds), false),
    forget: () => {},
};
const tools = await Doors.open(module, world, false);
tools.ask('tools_connect', { address: 1, timeout: 1000 });
console.log(tools.ask('tools_identify').name);
const load = (text) => {
    const program = { texts: [{ name: 'page.tmc', text }], main: 'page.tmc' };
    return tools.ask('program_load', { program, verify: true, run: false, autostart: false }).text;
};
console.log(load('CALC LOAD, 5\nCALC MUL, 3\nAGP 0, 2\nSTOP'));
for (const line of ['step', 'step', 'print acc', 'step', 'send GGP 0, 2']) {
    console.log(tools.ask('program_debug', { line }).text);
}
try {
    load('ROR 0, Sped');
} catch (error) {
    console.log(error.message);
}
await source.close();
