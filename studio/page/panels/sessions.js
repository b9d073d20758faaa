// Sessions: what was done to a virtual module, saved as a file or a link, and done again. One that is opened does nothing but show
// itself until somebody runs it.

import { at, button, labelled, make, words, write } from '../dom.js';
import { MOST, pack, unpack } from '../session-link.js';

/** @typedef {import('../types.js').Session} Session */
/** @typedef {import('../types.js').SessionRead} SessionRead */

/** Most bytes of a file. */
const LONGEST = 8_000_000;
/** Most lines of what is done that are shown. */
const MOST_SHOWN = 500;

/** By which page a session is made: its version, and a number of its files. */
function maker() {
    const [version = '', hash = ''] = document.querySelector('meta[name="page"]')?.getAttribute('content')?.split(' ') ?? [];
    return { version, hash };
}

/** A name that files of all systems can have.
 * @param {string} title */
const fileName = (title) => title.replaceAll(/[^\w.-]+/g, '-').replaceAll(/^[-.]+|-+$/g, '').slice(0, 60) || 'session';

/** The panel. */
export class Sessions {
    /**
     * @param {import('../workbench.js').Workbench} bench
     * @param {import('./program.js').Program} program whose texts a session may have
     * @param {import('./connection.js').Connection} connection
     */
    constructor(bench, program, connection) {
        this.bench = bench;
        this.program = program;
        this.connection = connection;
        /** Counts what was opened: only the last one is shown. */
        this.turn = 0;
        this.title = make('input', { type: 'text', maxlength: '100', size: '24' });
        this.saving = [
            button('Save session', () => void this.#save()),
            button('Copy link', () => void this.#copy()),
            button('As a scenario', () => void this.#scenario(() => this.#session())),
        ];
        this.choice = make('fieldset', { class: 'row' }, make('legend', { text: 'Texts of the session' }));
        this.told = make('p', { role: 'status', 'aria-label': 'Session' });
        this.shown = make('div');
        const open = button('Open session', () => void this.#open());
        at('session').append(
            make('div', { class: 'row' }, labelled('Title', this.title), ...this.saving, open),
            this.choice,
            this.told,
            this.shown,
        );
        /** The texts that are wanted. @type {Map<string, HTMLInputElement>} */
        this.wanted = new Map();
        connection.onplay = (left) => this.#play(left);
        program.onlist = () => this.#list();
        this.gone();
        this.#list();
        window.addEventListener('hashchange', () => void this.openLink(location.hash));
    }

    /** @param {import('../workbench.js').There} there */
    module({ isVirtual, runsImage }) {
        this.saving.forEach((made) => (made.disabled = !isVirtual || runsImage === true));
    }

    gone() {
        this.saving.forEach((made) => (made.disabled = true));
    }

    /** Offers the texts that there are; the one that is shown is wanted. */
    #list() {
        const before = this.wanted;
        const { texts, name: now } = this.program;
        this.wanted = new Map(
            texts.names.map((name) => {
                const box = make('input', { type: 'checkbox' });
                box.checked = before.get(name)?.checked ?? name === now;
                return [name, box];
            }),
        );
        const boxes = [...this.wanted].map(([name, box]) => make('label', {}, box, ` ${name}`));
        this.choice.replaceChildren(make('legend', { text: 'Texts of the session' }), ...boxes);
    }

    /** What has been done to the module that is there, as a session.
     * @returns {Promise<Session>} */
    async #session() {
        /** @type {import('../types.js').Play} */
        const { start, done, until } = await this.bench.session.ask({ done: true });
        const texts = this.program.texts.list.filter(({ name }) => this.wanted.get(name)?.checked);
        const curves = this.curves();
        return { session: 1, title: this.title.value.trim(), made: maker(), start, texts, curves, done, until };
    }

    /** The curves that are shown.
     * @type {() => string[]} */
    curves = () => [];

    async #save() {
        try {
            const session = await this.#session();
            this.bench.download(`${fileName(session.title)}.json`, `${JSON.stringify(session, null, 1)}\n`, 'application/json');
            write(this.told, 'saved');
        } catch (error) {
            write(this.told, words(error));
        }
    }

    async #copy() {
        try {
            const link = await pack(JSON.stringify(await this.#session()));
            if (link.length > MOST) {
                throw new Error(`as a link it has ${link.length} characters, and ${MOST} are the most: save it as a file`);
            }
            await navigator.clipboard.writeText(location.href.replace(/#.*/, '') + link);
            write(this.told, `copied: a link of ${link.length} characters behind the address`);
        } catch (error) {
            write(this.told, words(error));
        }
    }

    /** @param {() => Session | Promise<Session>} give */
    async #scenario(give) {
        try {
            const session = await give();
            write(this.told, 'the session is done once more for its values');
            /** @type {import('../types.js').SessionText} */
            const { text } = await this.bench.ask('session_scenario', session);
            this.bench.download(`${fileName(session.title)}.txt`, text);
            write(this.told, 'saved as a scenario: `tmcl test` runs it');
        } catch (error) {
            write(this.told, words(error));
        }
    }

    async #open() {
        try {
            const file = await this.bench.openFile('.json,application/json', LONGEST);
            if (file) {
                await this.#read(file.name, () => file.text);
            }
        } catch (error) {
            write(this.told, words(error));
        }
    }

    /**
     * Shows the session behind an address, if there is one.
     * @param {string} hash
     */
    openLink(hash) {
        return this.#read('the link', () => unpack(hash));
    }

    /**
     * Reads a session, and shows it or what is wrong with it.
     * @param {string} name where it comes from
     * @param {() => string | null | Promise<string | null>} give
     */
    async #read(name, give) {
        this.turn += 1;
        const { turn } = this;
        try {
            const text = await give();
            /** @type {SessionRead | null} */
            const read = text === null ? null : await this.bench.ask('session_read', { text });
            if (read && turn === this.turn) {
                this.#show(read);
                write(this.told, `${name}: opened; nothing is done until it is run`);
                at('title-session').scrollIntoView();
            }
        } catch (error) {
            if (turn === this.turn) {
                this.shown.replaceChildren();
                write(this.told, `${name}: ${words(error)}`);
            }
        }
    }

    /** @param {SessionRead} read */
    #show(read) {
        const { session, name, lines, readings, length } = read;
        const { version, hash } = maker();
        const { made, start, texts, curves } = session;
        const isOther = made !== null && (made.version !== version || made.hash !== hash);
        const other = isOther
            ? `It was made by another version of this page (${made.version}, ${made.hash}; this is ${version}, ${hash}): its numbers may be others here.`
            : '';
        const whole = (/** @type {string} */ title, /** @type {string} */ text) =>
            make('details', {}, make('summary', { text: title }), make('pre', { text, tabindex: '0' }));
        const more = lines.length > MOST_SHOWN ? [make('li', { text: `and ${lines.length - MOST_SHOWN} more` })] : [];
        const eeprom = start.eeprom === null ? 'as it leaves the factory' : 'with what it has stored';
        this.take = button('Take over', () => void this.connection.takeOver(), { disabled: true });
        this.shown.replaceChildren(
            make(
                'article',
                { 'aria-labelledby': 'opened-session' },
                make('h3', { id: 'opened-session', text: session.title === '' ? 'A session' : session.title }),
                make('p', { text: `A virtual ${name}, ${eeprom}: ${length} s, in which ${lines.length} things are done, and ${readings} readings.` }),
                make('p', { class: 'wrong', text: other }),
                make(
                    'div',
                    { class: 'row' },
                    button('Run session', () => void this.#run(read)),
                    this.take,
                    button('Add its texts', () => this.#add(read), { disabled: texts.length === 0 }),
                    button('Its scenario', () => void this.#scenario(() => session)),
                    button('Close', () => this.shown.replaceChildren()),
                ),
                make('details', { open: true }, make('summary', { text: 'What is done' }), make('ol', { class: 'session-lines', tabindex: '0' }, ...lines.slice(0, MOST_SHOWN).map((text) => make('li', { text })), ...more)),
                make('p', { text: `Curves: ${curves.length === 0 ? 'the usual ones' : curves.join('; ')}` }),
                ...(start.world === null ? [] : [whole('Its world', start.world)]),
                ...texts.map((text) => whole(text.name, text.text)),
            ),
        );
    }

    /** @param {SessionRead} read */
    async #run(read) {
        try {
            write(this.told, 'it is run');
            await this.connection.play(read);
        } catch (error) {
            write(this.told, words(error));
        }
    }

    /** @param {number | null} left how much is left, in milliseconds; null if it is over */
    #play(left) {
        if (this.take) {
            this.take.disabled = left === null;
        }
        const ended = 'it has ended, and time stands still: "Take over" goes on from here';
        write(this.told, left === null ? 'it was taken over' : left === 0 ? ended : `${(left / 1000).toFixed(1)} s are left`);
    }

    /**
     * Adds the texts of a session to those of the user, none of which is overwritten.
     * @param {SessionRead} read
     */
    #add({ session }) {
        const { texts } = this.program;
        const names = session.texts.map(({ name, text }) => {
            const isSame = texts.names.includes(name) && texts.text(name) === text;
            return isSame ? name : texts.change(texts.free(name), text);
        });
        this.program.show(names[0] ?? this.program.name);
        write(this.told, `added: ${names.join(', ')}`);
    }
}
