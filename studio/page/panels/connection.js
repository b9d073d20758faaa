// The way to a module: a virtual one, or a serial port; what becomes of it; and STOP.

import { canSuspend } from '../doors.js';
import { addLine, at, words } from '../dom.js';
import { allowed, NoPort } from '../serial.js';

/** What to look at where there is no port. */
const NO_PORT =
    'If none is shown: is the module connected, are you in the group that owns the device (often dialout), and is the browser ' +
    'none in a snap or Flatpak, which sees no ports?';
/** Time between two attempts to find out what a module is, in milliseconds. */
const AGAIN = 1000;

/** The connection. */
export class Connection {
    /**
     * @param {import('../workbench.js').Workbench} bench
     * @param {import('./texts.js').Texts} texts among which are worlds of virtual modules
     * @param {import('./eeprom.js').Eeprom} eeprom what a virtual module has in its EEPROM
     */
    constructor(bench, texts, eeprom) {
        this.bench = bench;
        this.session = bench.session;
        /** Number of attempts to open a link; only the last one counts. */
        this.attempts = 0;
        /** A STOP could not be sent, and is sent as soon as the module is there again. */
        this.owed = false;
        /** The port that was chosen last.
         * @type {any} */
        this.chosen = undefined;
        this.isVirtual = false;
        /** What was opened last: what is known of it without asking.
         * @type {{ started?: import('../types.js').Start, runsImage?: boolean, curves?: string[] }} */
        this.opened = {};
        /** A session is done to the module, and nobody has taken over. */
        this.plays = false;
        /** STOP was pressed since a link was asked for. */
        this.isStopped = false;
        /** Takes what there is to say of that: how many milliseconds are left, or how it was ended.
         * @type {(left: number | 'taken over' | 'ended') => void} */
        this.onplay = () => undefined;
        this.texts = texts;
        this.eeprom = eeprom;
        at('start').onclick = () => void this.#start();
        at('connect').onclick = () => void this.#connect(false);
        at('choose').onclick = () => void this.#connect(true);
        at('leave').onclick = () => void this.#leave();
        at('stop').onclick = () => this.stop();
        document.addEventListener('keydown', (event) => event.key === 'Escape' && this.stop());
    }

    /**
     * How a virtual module is started, as it is chosen.
     * @returns {import('../types.js').Start}
     */
    get wanted() {
        const product = /** @type {HTMLSelectElement} */ (at('product')).value;
        const world = /** @type {HTMLSelectElement} */ (at('surroundings')).value;
        return { product, world: world === '' ? null : this.texts.text(world), eeprom: this.eeprom.wanted(product) };
    }

    /** Starts a virtual module, if it can be so: else what is there stays. */
    async #start() {
        const virtual = this.wanted;
        this.#say('starting');
        try {
            await this.bench.ask('world_offers', virtual);
        } catch (error) {
            this.#say(`not started: ${words(error)}`);
            return;
        }
        await this.open({ virtual });
    }

    /** A session that is done ends. */
    #endPlay() {
        if (this.plays) {
            this.plays = false;
            this.onplay('ended');
        }
    }

    /**
     * Does a session to a virtual module.
     * @param {import('../types.js').SessionRead} read
     */
    play({ name, session: { start, done, until, curves } }) {
        if (this.session.link && !this.isVirtual) {
            throw new Error('a real module is connected: disconnect it before a session is run, which takes its place');
        }
        return this.open({ play: { start, done, until } }, { name, curves });
    }

    /** @param {string} text */
    #say(text) {
        at('state').textContent = text;
    }

    /** Whether rate and address are numbers of a link; if not, it is told. */
    #fits() {
        const typed = ['rate', 'address'].map((id) => /** @type {HTMLInputElement} */ (at(id)));
        const wrong = typed.find((input) => !input.checkValidity());
        if (wrong) {
            this.#say(`${wrong.labels?.[0]?.textContent}: ${wrong.validationMessage}`);
            wrong.focus();
        }
        return !wrong;
    }

    /**
     * Opens a link and asks what is there; but a session is shown as it is done.
     * @param {any} wanted
     * @param {{ name: string, curves: string[] }} [session] what is known of a session
     * @param {WebAssembly.Module} [program] that runs a flash image
     */
    async open(wanted, session, program) {
        if (wanted.serial && !this.#fits()) {
            return;
        }
        this.#endPlay();
        // What becomes of an earlier attempt does not count any more.
        this.attempts += 1;
        const attempt = this.attempts;
        this.bench.is(undefined);
        this.owed = false;
        this.isStopped = false;
        this.#leaveDanger();
        this.#say('opening');
        this.isVirtual = wanted.serial === undefined;
        this.opened = {
            started: wanted.play?.start ?? wanted.virtual,
            runsImage: wanted.image !== undefined,
            curves: session?.curves,
        };
        // Not before: it is not the new session to which something else was done at the link before.
        const begun = () => {
            this.plays = session !== undefined && attempt === this.attempts;
        };
        const address = Number(/** @type {HTMLInputElement} */ (at('address')).value);
        try {
            await this.session.open(wanted, this.isVirtual ? 1 : address, begun, program);
            /** @type {HTMLButtonElement} */ (at('leave')).disabled = false;
            if (session && this.isStopped) {
                // It reached the link before: nothing of the session is done after it.
                await this.takeOver();
                await this.session.ask({ control: 'resume' });
            } else if (session) {
                await this.#show(session, attempt);
            } else {
                await this.#identify();
            }
        } catch (error) {
            if (attempt === this.attempts) {
                this.#say(words(error));
                at('module').textContent = 'no module';
            }
        }
    }

    /**
     * Shows a session from its beginning on.
     * @param {{ name: string, curves: string[] }} session
     * @param {number} attempt
     */
    async #show({ name, curves }, attempt) {
        const { started } = this.opened;
        await this.bench.looks({ name, product: started?.product ?? null, address: 1, isVirtual: true, started, curves });
        // STOP may have taken it over meanwhile.
        if (attempt === this.attempts && this.plays) {
            at('module').textContent = `${name}, to which a session is done`;
            this.#say('shown');
            await this.session.ask({ control: 'resume' });
        }
    }

    /** Goes on from where a session is: from now on the module is as any other. */
    async takeOver() {
        this.plays = false;
        this.onplay('taken over');
        await this.#identifyAgain();
    }

    /** Asks what the module is, before anything else. */
    async #identify() {
        const attempt = this.attempts;
        const { name, product } = await this.session.identify();
        if (attempt !== this.attempts) {
            return;
        }
        at('module').textContent = product === null ? `${name}, which is not known here` : name;
        this.#say('connected');
        this.bench.is({ name, product, address: this.session.address, isVirtual: this.isVirtual, ...this.opened });
    }

    /** Asks again and again what the module is: one that has just been switched on takes its time. */
    async #identifyAgain() {
        for (const attempt = this.attempts; attempt === this.attempts && this.session.link; ) {
            try {
                await this.#identify();
                break;
            } catch (error) {
                if (attempt !== this.attempts) {
                    return;
                }
                this.#say(`${words(error)}; asking again each second`);
                await new Promise((resolve) => setTimeout(resolve, AGAIN));
            }
        }
        if (this.owed) {
            this.stop();
        }
    }

    /** A STOP that was not answered is not forgotten with its link. */
    #leaveDanger() {
        if (this.isVirtual) {
            at('danger').textContent = '';
        } else if (at('danger').textContent !== '') {
            at('danger').textContent = 'STOP was not answered, and the link is closed: the motor may turn.';
        }
    }

    /**
     * What the link tells.
     * @param {any} told
     */
    hear(told) {
        if (told.stopped !== undefined) {
            this.owed = told.owed ?? false;
            this.bench.announce(told.stopped ? 'stopped' : '');
            this.bench.panels.forEach((panel) => panel.stopped?.());
            at('danger').textContent = told.stopped
                ? ''
                : 'STOP is not answered, and is sent again: the motor may turn. Switch its power off if it must not.';
        } else if (told.lost !== undefined) {
            this.bench.is(undefined);
            this.#say(`the link is lost: ${told.lost}; trying again each second`);
        } else if (told.retry !== undefined) {
            this.#say(`the link is lost: ${told.retry}; trying again each second`);
        } else if (told.left !== undefined) {
            this.#play(told.left);
        } else if (told.powered === false) {
            this.#say('the module has no power');
        } else if (told.halted !== undefined) {
            // Whoever waits for a reply of it is not told, because none comes.
            this.attempts += 1;
            this.bench.is(undefined);
            at('module').textContent = 'no module';
            this.#say(`the module cannot go on: ${told.halted}`);
        } else if (told.again) {
            if (this.plays) {
                this.#say('shown');
            } else {
                void this.#identifyAgain();
            }
        } else if (told.dead !== undefined) {
            addLine(at('replies'), `the tools have ended, and are started anew: ${told.dead}`, true);
            if (this.session.link) {
                this.#identify().catch((error) => this.#say(words(error)));
            }
        }
    }

    /** @param {number | null} left how much is left of a session, in milliseconds; null if somebody has done something else */
    #play(left) {
        if (left === null && this.plays) {
            void this.takeOver();
        } else if (this.plays && left !== null) {
            this.onplay(left);
        }
    }

    /**
     * Connects a serial port: the one that was chosen last or allowed before, or one that is chosen now.
     * @param {boolean} choose whether to ask in any case
     */
    async #connect(choose) {
        const serial = /** @type {any} */ (navigator).serial;
        if (!serial || !canSuspend) {
            this.#say(
                'this browser does not let pages use serial ports: Chrome and Edge (from 137 on) and Firefox (from 153 on) do, on a ' +
                    'computer. Virtual modules work here',
            );
            return;
        }
        if (!this.#fits()) {
            return;
        }
        const baudRate = Number(/** @type {HTMLInputElement} */ (at('rate')).value);
        try {
            let ports = await allowed();
            let known = choose ? undefined : (ports.find(({ port }) => port === this.chosen) ?? ports[0]);
            if (!known) {
                this.#say(`choose a port. ${NO_PORT}`);
                this.chosen = await serial.requestPort();
                ports = await allowed();
                known = ports.find(({ port }) => port === this.chosen);
            }
            if (!known) {
                throw new NoPort('it is gone already');
            }
            const { kind, number } = known;
            await this.open({ serial: { baudRate, place: { kind, number } } });
        } catch (error) {
            this.#say(`no port was chosen (${words(error)}). ${NO_PORT}`);
        }
    }

    async #leave() {
        this.attempts += 1;
        this.#endPlay();
        this.bench.is(undefined);
        this.#leaveDanger();
        await this.session.leave();
        /** @type {HTMLButtonElement} */ (at('leave')).disabled = true;
        this.#say('disconnected');
        at('module').textContent = 'no module';
    }

    /** Stops all motors and the program. */
    stop() {
        this.isStopped = true;
        this.session.stop().catch(() => addLine(at('replies'), 'STOP: there is no link', true));
    }
}
