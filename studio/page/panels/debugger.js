// The debugger: the program in the module, step by step. Its lines are those of `tmcl debug`.

import { addLine, at, button, make, words } from '../dom.js';

/** @typedef {import('../types.js').Debugged} Debugged */
/** @typedef {import('../types.js').NamedValue} NamedValue */

/** Least time between two looks at a program that runs, in milliseconds. */
const LOOK = 500;
/** How many times as long as a look took the link is left to others. */
const RESTS = 9;

/** The panel of the debugger. */
export class Debugger {
    /**
     * @param {import('../workbench.js').Workbench} bench
     * @param {import('./program.js').Program} program
     */
    constructor(bench, program) {
        this.bench = bench;
        this.program = program;
        /** The name of the text that is debugged. */
        this.name = '';
        /** @type {Debugged | undefined} */
        this.last = undefined;
        /** Breakpoints that are wanted before there is a program.
         * @type {Map<string, Set<number>>} */
        this.wanted = new Map();
        /** The breakpoints that are listed. */
        this.listed = '';
        /** @type {number | undefined} */
        this.job = undefined;
        /** The next look at a program that runs.
         * @type {ReturnType<typeof setTimeout> | undefined} */
        this.next = undefined;
        const steps = [
            ['Step', 'step', 'F11'],
            ['Next', 'next', 'F10'],
            ['Continue', 'continue', 'F8'],
            ['Back to the beginning', 'reset', ''],
        ];
        this.needing = steps.map(([name, line, key]) =>
            button(name, () => void this.act(line), key === '' ? {} : { 'aria-keyshortcuts': key, title: key }),
        );
        this.halt = button('Halt', () => void this.#halt());
        this.attach = button('Attach', () => void this.#attach(), {
            title: 'Debugs the program that is in the module already, if it is that of the text',
        });
        at('debug-tools').append(...this.needing, this.halt, this.attach);
        document.addEventListener('keydown', (event) => {
            const found = steps.find(([, , key]) => key !== '' && key === event.key);
            if (found && this.name !== '') {
                event.preventDefault();
                void this.act(found[1]);
            }
        });
        at('debug-line').onsubmit = (event) => {
            event.preventDefault();
            const typed = /** @type {HTMLInputElement} */ (at('debug-typed'));
            void this.act(typed.value.trim());
            typed.value = '';
        };
        program.editor.onbreakpoint = (line, on) => void this.#breakpoint(line, on);
        program.editor.onbreakpointsmoved = (lines) => this.wanted.set(program.name, new Set(lines));
        this.gone();
    }

    /** @param {boolean} there */
    #enable(there) {
        [...this.needing, this.halt].forEach((made) => (made.disabled = !there));
        /** @type {HTMLButtonElement} */ (at('debug-do')).disabled = !there;
        this.attach.disabled = this.bench.there === undefined;
    }

    module() {
        this.#enable(this.name !== '');
    }

    gone() {
        clearTimeout(this.next);
        this.name = '';
        this.last = undefined;
        this.#enable(false);
        this.program.editor.current(null);
        at('debug-state').textContent = '';
    }

    /**
     * A program has been loaded.
     * @param {string} name of its text
     */
    async loaded(name) {
        this.name = name;
        this.#enable(true);
        for (const [file, lines] of this.wanted) {
            for (const line of lines) {
                await this.act(`break ${this.#place(file, line)}`);
            }
        }
        await this.act('list');
    }

    async #attach() {
        try {
            const debugged = await this.bench.job('Compare the program', 'program_attach', this.program.sources);
            this.name = this.program.name;
            this.#enable(true);
            this.#show(debugged);
        } catch (error) {
            addLine(at('debugged'), `the module has another program than this text: ${words(error)}`, true);
        }
    }

    /**
     * Carries a line out.
     * @param {string} line
     */
    async act(line) {
        addLine(at('debugged'), `(tmcl) ${line}`);
        at('debug-state').textContent = `under way: ${line}`;
        try {
            const { id, answer } = this.bench.session.job('program_debug', { line });
            this.job = id;
            this.#show(await answer);
        } catch (error) {
            addLine(at('debugged'), words(error), true);
            this.#say();
            this.job = undefined;
            // STOP, which has ended the line, has stopped the program as well.
            void this.look();
            return false;
        }
        this.job = undefined;
        return true;
    }

    /** Looks what has become of the program: something else than the debugger may have run or stopped it. */
    async look() {
        clearTimeout(this.next);
        const { name } = this;
        if (name === '' || this.job !== undefined) {
            return;
        }
        const begun = performance.now();
        try {
            const debugged = await this.bench.quick('program_see', {});
            if (name === this.name && this.job === undefined) {
                this.#show(debugged, performance.now() - begun);
            }
        } catch {
            // The link is lost, and that is told elsewhere.
        }
    }

    /** All motors and the program have been stopped. */
    stopped() {
        void this.look();
    }

    /** Shows what the program does. */
    #say(wasRunning = false) {
        const { last } = this;
        const where = last?.next ? ` at line ${last.next.line + 1}` : '';
        const halted = last?.ended ? `the program has ended${where}: a step begins it anew` : `halted${where}`;
        const stopped = 'the program has ended, or was stopped';
        at('debug-state').textContent = !last ? '' : last.running ? 'the program runs' : wasRunning ? stopped : halted;
    }

    /** Halts the program: the step that is under way, or one that runs freely. */
    async #halt() {
        if (this.job !== undefined) {
            this.bench.session.end(this.job);
        } else {
            await this.act('stop');
        }
    }

    /**
     * @param {Debugged} debugged
     * @param {number} took how long it took to look, in milliseconds
     */
    #show(debugged, took = 0) {
        const { text, running, next, registers, variables, watched, breakpoints } = debugged;
        const wasRunning = this.last?.running ?? false;
        if (text !== '') {
            addLine(at('debugged'), text);
        }
        this.#table('registers', registers, this.last?.registers);
        this.#table('variables', variables, this.last?.variables);
        this.#table('watched', watched, this.last?.watched);
        this.last = debugged;
        // What is done by a line of the debugger is told by that.
        this.#say(wasRunning && text === '');
        clearTimeout(this.next);
        if (running) {
            this.next = setTimeout(() => void this.look(), Math.max(LOOK, RESTS * took));
        }
        this.#breakpoints(breakpoints);
        this.wanted = new Map();
        for (const { place } of breakpoints) {
            if (place) {
                const file = place.file ?? this.name;
                this.wanted.set(file, (this.wanted.get(file) ?? new Set()).add(place.line));
            }
        }
        if (next && (next.file ?? this.name) !== this.program.name && this.program.texts.names.includes(next.file ?? '')) {
            this.program.show(next.file ?? this.name);
        } else {
            this.shows(this.program.name);
        }
    }

    /**
     * Lists the breakpoints, unless they are those that are listed: somebody may be typing a condition.
     * @param {import('../types.js').Breakpoint[]} breakpoints
     */
    #breakpoints(breakpoints) {
        const listed = JSON.stringify([this.name, breakpoints]);
        if (listed === this.listed) {
            return;
        }
        this.listed = listed;
        const own = breakpoints.map(({ address, condition, place }) => {
            const where = place ? `${place.file ?? this.name}, line ${place.line + 1}` : `address ${address}`;
            const when = make('input', { type: 'text', value: condition, placeholder: 'acc > 5', 'aria-label': `Condition at ${where}` });
            when.onchange = async () => {
                const done = await this.act(`break ${address}${when.value.trim() === '' ? '' : ` if ${when.value}`}`);
                when.setAttribute('aria-invalid', String(!done));
            };
            const remove = button('Remove', () => void this.act(`delete ${address}`), { 'aria-label': `Remove: ${where}` });
            return make('li', { class: 'row' }, `${where} if `, when, remove);
        });
        at('breakpoints').replaceChildren(...own);
    }

    /**
     * Another text is shown in the editor.
     * @param {string} name
     */
    shows(name) {
        const { editor } = this.program;
        editor.breakpoints([...(this.wanted.get(name) ?? [])]);
        const next = this.name === '' ? null : this.last?.next;
        editor.current(next && (next.file ?? this.name) === name ? next.line : null);
    }

    /**
     * @param {string} id of the body of a table
     * @param {NamedValue[]} values
     * @param {NamedValue[] | undefined} before
     */
    #table(id, values, before) {
        const rows = values.map(({ name, value }) => {
            const earlier = before?.find((other) => other.name === name)?.value;
            const changed = earlier !== undefined && earlier !== value;
            const text = changed ? `${value} (before ${earlier})` : value;
            return make('tr', { class: changed ? 'changed' : '' }, make('th', { scope: 'row', text: name }), make('td', { text }));
        });
        at(id).replaceChildren(...rows);
    }

    /**
     * @param {string} file
     * @param {number} line
     */
    #place(file, line) {
        return file === this.name ? `:${line + 1}` : `${file}:${line + 1}`;
    }

    /**
     * A breakpoint has been set or removed in the margin.
     * @param {number} line
     * @param {boolean} on
     */
    async #breakpoint(line, on) {
        const file = this.program.name;
        const lines = this.wanted.get(file) ?? new Set();
        on ? lines.add(line) : lines.delete(line);
        this.wanted.set(file, lines);
        if (this.name !== '') {
            await this.act(`${on ? 'break' : 'delete'} ${this.#place(file, line)}`);
        }
    }
}
