// Sessions: what was done to a virtual module, saved as a file or a link, and done again. One that is opened does nothing but show
// itself until somebody runs it.

import { at, button, labelled, make, words, write } from '../dom.js';
import { isLink, LONGEST, MOST, pack, unpack } from '../session-link.js';

/** @typedef {import('../types.js').Session} Session */
/** @typedef {import('../types.js').SessionRead} SessionRead */

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
     * @param {import('./curves.js').Curves} curves which a session has as well
     */
    constructor(bench, program, connection, curves) {
        this.bench = bench;
        this.program = program;
        this.connection = connection;
        this.curves = curves;
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
        /** What there is to say of the one that is run. */
        this.progress = make('p', { role: 'status', 'aria-live': 'off', 'aria-label': 'Progress of the session' });
        this.take = button('Take over', () => void this.connection.takeOver(), { disabled: true });
        /** The one that is shown stands behind the address. */
        this.fromLink = false;
        this.shown = make('div');
        const open = button('Open session', () => void this.#open());
        at('session').append(
            make('div', { class: 'row' }, labelled('Title', this.title), ...this.saving, open),
            this.choice,
            this.told,
            make('div', { class: 'row' }, this.take, this.progress),
            this.shown,
        );
        /** The texts that are wanted. @type {Map<string, HTMLInputElement>} */
        this.wanted = new Map();
        /** Those of which the user has said so, or has not. @type {Set<string>} */
        this.chosen = new Set();
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
                box.checked = this.chosen.has(name) ? (before.get(name)?.checked ?? false) : name === now;
                box.addEventListener('change', () => this.chosen.add(name));
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
        const curves = this.curves.texts;
        return { session: 1, title: this.title.value.trim(), made: maker(), start, texts, curves, done, until };
    }

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
                this.fromLink = false;
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
        if (!isLink(hash)) {
            // Back to the address without one.
            if (this.fromLink) {
                this.#close();
            }
            return Promise.resolve();
        }
        this.fromLink = true;
        return this.#read('the link', () => unpack(hash));
    }

    /** Shows no session any more. */
    #close() {
        this.turn += 1;
        this.shown.replaceChildren();
        write(this.told, '');
        if (this.fromLink) {
            this.fromLink = false;
            history.replaceState(null, '', location.pathname + location.search);
        }
    }

    /**
     * Reads a session, and shows it or what is wrong with it.
     * @param {string} name where it comes from
     * @param {() => string | Promise<string>} give
     */
    async #read(name, give) {
        this.turn += 1;
        const { turn } = this;
        try {
            /** @type {SessionRead} */
            const read = await this.bench.ask('session_read', { text: await give() });
            if (turn === this.turn) {
                this.#show(read);
                write(this.told, `${name}: opened; nothing is done until it is run`);
                this.bench.reveal('Session');
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
        const count = (/** @type {number} */ number, /** @type {string} */ what) => `${number} ${what}${number === 1 ? '' : 's'}`;
        this.shown.replaceChildren(
            make(
                'article',
                { 'aria-labelledby': 'opened-session' },
                make('h3', { id: 'opened-session', text: session.title === '' ? 'A session' : session.title }),
                make('p', { text: `A virtual ${name}, ${eeprom}: ${length.toFixed(3)} s, in which there are ${count(lines.length, 'deed')} and ${count(readings, 'reading')}.` }),
                make('p', { class: 'wrong', text: other }),
                make(
                    'div',
                    { class: 'row' },
                    button('Run session', () => void this.#run(read)),
                    button('Add its texts', () => this.#add(read), { disabled: texts.length === 0 }),
                    button('Its scenario', () => void this.#scenario(() => session)),
                    button('Close', () => this.#close()),
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
            write(this.told, '');
            await this.connection.play(read);
        } catch (error) {
            write(this.told, words(error));
        }
    }

    /** @param {number | 'taken over' | 'ended'} left how much is left, in milliseconds, or how it was ended */
    #play(left) {
        this.take.disabled = typeof left !== 'number';
        const texts = {
            'taken over': 'the session was taken over',
            ended: 'the session was ended: something else has its place',
        };
        const over = 'the session has ended: "Take over" goes on from here';
        const now = left === 0 ? over : `${(Number(left) / 1000).toFixed(1)} s of the session are left`;
        write(this.progress, typeof left === 'number' ? now : texts[left]);
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
