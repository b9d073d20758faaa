// A flash image in place of the firmware's core: it runs on the emulated microcontroller, and its log is shown. What does that is
// loaded when an image is opened.

import { addLine, at, button, make, words, write } from '../dom.js';
import { Doors, NOBODY } from '../doors.js';

/** Most bytes of an image, with all its debug information. */
const MOST = 256 * 1024 * 1024;

/** The panel. */
export class FlashImage {
    /**
     * @param {import('../workbench.js').Workbench} bench
     * @param {import('./connection.js').Connection} connection
     */
    constructor(bench, connection) {
        this.bench = bench;
        this.connection = connection;
        this.told = make('p', { role: 'status', 'aria-label': 'Flash image' });
        this.log = make('ol', {});
        this.box = make('div', { class: 'log', role: 'log', 'aria-live': 'off', 'aria-label': 'Log of the image', tabindex: '0', hidden: true }, this.log);
        at('image').append(make('div', { class: 'row' }, button('Open flash image', () => void this.#open())), this.told, this.box);
    }

    /**
     * What the link tells.
     * @param {any} told
     */
    hear(told) {
        if (told.log !== undefined) {
            addLine(this.log, told.log);
        } else if (told.halted !== undefined) {
            write(this.told, `it has stopped: ${told.halted}`);
        }
    }

    /** @param {import('../workbench.js').There} there */
    module({ runsImage }) {
        this.box.hidden = runsImage !== true;
        if (!runsImage) {
            write(this.told, '');
        }
    }

    async #open() {
        try {
            const file = await this.bench.openBytes('', MOST);
            if (!file) {
                return;
            }
            write(this.told, `${file.name} is being read`);
            const program = await WebAssembly.compileStreaming(fetch('tmcl_studio_image.wasm'));
            const doors = await Doors.open(program, NOBODY, false);
            /** @type {import('../types.js').Image} */
            const { product } = doors.give('image_take', file.bytes);
            const choice = /** @type {HTMLSelectElement} */ (at('product'));
            if (product !== null && product !== choice.value) {
                // What is kept for another product is not for this one.
                choice.value = product;
                choice.dispatchEvent(new Event('change'));
            }
            this.log.replaceChildren();
            this.box.hidden = false;
            write(this.told, `${file.name} is started`);
            await this.connection.open({ virtual: this.connection.wanted, image: file.bytes }, undefined, program);
            if (this.bench.there?.runsImage) {
                write(this.told, `${file.name} runs on the emulated microcontroller of a TMCM-${choice.value}; its virtual time says how fast`);
            }
        } catch (error) {
            write(this.told, words(error));
        }
    }
}
