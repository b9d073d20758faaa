// Programs: the user's texts in the editor, and their way into the module.

import { at, button, make, words, write } from '../dom.js';
import { Editor } from '../editor/editor.js';
import { keep, kept } from '../keep.js';
import { Debugger } from './debugger.js';
import { Texts } from './texts.js';

/** Files of programs. */
const ACCEPT = '.tmc,.inc,.txt,text/plain';

/**
 * Whether a text is the world of a virtual module, and no program.
 * @param {string} name
 */
const isWorld = (name) => name.endsWith('.toml');
/** What can be written at a place of a world. */
const NOTHING = { start: 0, end: 0, items: [] };

/** The panel of programs. */
export class Program {
    /** @param {import('../workbench.js').Workbench} bench */
    constructor(bench) {
        this.bench = bench;
        this.texts = new Texts((why) => this.#say(why));
        const before = kept('text shown');
        this.name = this.texts.names.includes(before) ? before : this.texts.names[0];
        this.product = /** @type {HTMLSelectElement} */ (at('product'));
        this.choice = /** @type {HTMLSelectElement} */ (at('texts'));
        this.choice.onchange = () => this.show(this.choice.value);
        /** @param {string} text */
        const sources = (text) => ({
            texts: this.texts.list.map((other) => (other.name === this.name ? { name: this.name, text } : other)),
            main: this.name,
            product: bench.there?.product ?? null,
        });
        this.editor = new Editor(
            at('editor'),
            {
                check: async (text) =>
                    this.#checked(
                        await (isWorld(this.name)
                            ? bench.ask('world_check', { text, product: bench.there?.product ?? this.product.value })
                            : bench.ask('text_check', sources(text))),
                    ),
                complete: async (text, line, column) =>
                    isWorld(this.name) ? NOTHING : bench.ask('text_complete', { ...sources(text), line, column }),
                explain: async (text, line, column) =>
                    isWorld(this.name) ? null : (await bench.ask('text_explain', { ...sources(text), line, column })).found,
            },
            { name: 'Program', announce: bench.announce },
        );
        this.editor.onchange = (text) => this.#changed(text);
        this.editor.onfile = (file, line, column) => {
            this.show(file);
            this.editor.goto(line, column);
        };
        this.debugger = new Debugger(bench, this);
        at('text-tools').append(
            button('New', () => this.#add('program.tmc', '')),
            button('Open file', () => void this.#open()),
            button('Save as file', () => bench.download(this.name, this.editor.text)),
            button('Rename', () => this.#rename()),
            button('Delete', () => void this.#remove()),
        );
        this.verify = make('input', { type: 'checkbox', checked: true });
        this.autostart = make('input', { type: 'checkbox' });
        this.needing = [
            button('Load program', () => void this.#load()),
            button('Run', () => void this.#control('run')),
            button('Stop program', () => void this.#control('stop')),
            button('Program of the module', () => void this.#readBack()),
        ];
        at('program-tools').append(
            this.needing[0],
            make('label', {}, this.verify, ' compare after loading'),
            make('label', {}, this.autostart, ' start after power-up'),
            ...this.needing.slice(1),
        );
        // What a world may have depends on the product as well.
        this.product.addEventListener('change', () => this.editor.check());
        this.gone();
        this.show(this.name);
    }

    module() {
        this.needing.forEach((made) => (made.disabled = false));
        // What a name means depends on the product.
        this.editor.check();
    }

    gone() {
        this.needing.forEach((made) => (made.disabled = true));
        this.debugger.gone();
    }

    /** @param {string} text */
    #say(text) {
        at('program-state').textContent = text;
    }

    /** The program, for the tools. */
    get sources() {
        return { texts: this.texts.list, main: this.name };
    }

    /**
     * Shows a text.
     * @param {string} name
     */
    show(name) {
        this.name = name;
        keep('text shown', name);
        this.#list();
        this.editor.setText(this.texts.text(name));
        this.debugger.shows(name);
    }

    /** Is called when there are other texts. */
    onlist = () => {};

    #list() {
        const { names } = this.texts;
        this.choice.replaceChildren(...names.map((name) => new Option(name, name, false, name === this.name)));
        const worlds = /** @type {HTMLSelectElement} */ (at('surroundings'));
        const { value } = worlds;
        worlds.replaceChildren(new Option('as usual', ''), ...names.filter(isWorld).map((name) => new Option(name, name)));
        worlds.value = names.includes(value) ? value : '';
        this.onlist();
    }

    /** @param {string} text */
    #changed(text) {
        const name = this.texts.change(this.name, text);
        if (name !== this.name) {
            this.name = name;
            keep('text shown', name);
            this.#list();
        }
    }

    /** @param {any} checked */
    #checked(checked) {
        const { used, room, messages } = checked;
        const wrong = messages.some((/** @type {any} */ { severity }) => severity === 'error');
        if (isWorld(this.name)) {
            write(at('memory'), wrong ? 'no world of this product' : 'a world of this product');
            return checked;
        }
        const memory = room === null ? `${used} commands` : `${used} of ${room} commands`;
        write(at('memory'), wrong ? 'does not assemble' : memory);
        return checked;
    }

    /**
     * @param {string} name
     * @param {string} text
     */
    #add(name, text) {
        this.show(this.texts.change(this.texts.free(name), text));
        this.editor.focus();
    }

    async #open() {
        try {
            const file = await this.bench.openFile(ACCEPT);
            if (file) {
                this.#add(file.name, file.text);
            }
        } catch (error) {
            this.#say(words(error));
        }
    }

    #rename() {
        const name = make('input', { type: 'text', value: this.name, 'aria-label': 'New name' });
        const form = make('form', { class: 'row' }, name, make('button', { type: 'submit', text: 'Rename' }));
        form.addEventListener('submit', (event) => {
            event.preventDefault();
            const typed = name.value.trim();
            if (typed !== '' && typed !== this.name) {
                const text = this.editor.text;
                const worlds = /** @type {HTMLSelectElement} */ (at('surroundings'));
                const isChosen = worlds.value === this.name;
                this.texts.remove(this.name);
                this.show(this.texts.change(this.texts.free(typed), text));
                worlds.value = isChosen && isWorld(this.name) ? this.name : worlds.value;
                if (this.name !== typed) {
                    this.#say(`${typed} is there already: this text is ${this.name} now`);
                }
            }
            form.remove();
        });
        at('text-tools').after(form);
        name.select();
    }

    async #remove() {
        if (await this.bench.question(`Delete ${this.name}?`, ['The text is lost, unless it was saved as a file.'], 'Delete')) {
            this.texts.remove(this.name);
            this.show(this.texts.names[0]);
        }
    }

    async #load() {
        const { bench, sources } = this;
        this.debugger.gone();
        try {
            const { lost } = await bench.job('Look at the program in the module', 'program_in_the_way', sources);
            const autostart = this.autostart.checked;
            const stored = 'The module stores by itself that it starts this program after power-up (global parameter 77).';
            const lines = [lost === null ? '' : `This is lost: ${lost}.`, autostart ? stored : ''].filter((line) => line !== '');
            if (lines.length > 0 && !(await bench.question('Load this program?', lines, 'Load'))) {
                return;
            }
            const load = { program: sources, verify: this.verify.checked, run: false, autostart };
            const { text } = await bench.job('Load program', 'program_load', load);
            this.#say(text);
            await this.debugger.loaded(this.name);
        } catch (error) {
            this.#say(words(error));
        }
    }

    /** @param {'run' | 'stop'} what */
    async #control(what) {
        try {
            await this.bench.quick('program_control', { what });
            this.#say(what === 'run' ? 'the program was started' : 'the program was stopped');
            await this.debugger.look();
        } catch (error) {
            this.#say(words(error));
        }
    }

    async #readBack() {
        try {
            const { text } = await this.bench.job('Read the program', 'program_read', {});
            this.#add('module.tmc', text);
        } catch (error) {
            this.#say(words(error));
        }
    }
}
