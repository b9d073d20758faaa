// The page: what is pressed, and what is shown. Text never becomes HTML.

import { canSuspend } from './doors.js';
import { allowed, NoPort } from './serial.js';
import { Session } from './session.js';

/** What to look at where there is no port. */
const NO_PORT =
    'If none is shown: is the module connected, are you in the group that owns the device (often dialout), and is the browser ' +
    'none in a snap or Flatpak, which sees no ports?';
/** Most lines that a list keeps. */
const MOST_LINES = 500;

/**
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
const at = (id) => /** @type {T} */ (document.getElementById(id));

const stop = /** @type {HTMLButtonElement} */ (at('stop'));
const line = /** @type {HTMLInputElement} */ (at('line'));
const around = /** @type {HTMLInputElement} */ (at('around'));
/** Buttons that need a module. */
const needing = ['send', 'settings', 'load'].map((id) => /** @type {HTMLButtonElement} */ (at(id)));
/** @type {Session} */
let session;
/** @type {string[]} */
const history = [];
let older = 0;
/** @type {HTMLElement[]} */
let cells = [];
/** Number of attempts to open a link; only the last one counts. */
let attempts = 0;
/** The port that was chosen last.
 * @type {any} */
let chosen;
/** A STOP could not be sent, and is sent as soon as the module is there again. */
let owed = false;

/**
 * Adds a line to a list.
 * @param {string} list
 * @param {string} text
 * @param {boolean} wrong
 */
function add(list, text, wrong = false) {
    const item = document.createElement('li');
    item.textContent = text;
    item.classList.toggle('wrong', wrong);
    const whole = at(list);
    whole.append(item);
    while (whole.childElementCount > MOST_LINES) {
        whole.firstElementChild?.remove();
    }
    whole.scrollTop = whole.scrollHeight;
}

/** @param {unknown} error */
const words = (error) => (error instanceof Error ? error.message : String(error));

/** @param {boolean} there */
function enable(there) {
    needing.forEach((button) => (button.disabled = !there));
}

/**
 * Opens a link and asks what is there.
 * @param {any} wanted
 */
async function open(wanted) {
    const typed = ['rate', 'address'].map((id) => /** @type {HTMLInputElement} */ (at(id)));
    const wrong = typed.find((input) => !input.checkValidity());
    if (wrong) {
        at('state').textContent = `${wrong.labels?.[0]?.textContent}: ${wrong.validationMessage}`;
        wrong.focus();
        return;
    }
    // What becomes of an earlier attempt does not count any more.
    attempts += 1;
    const attempt = attempts;
    enable(false);
    owed = false;
    leaveDanger();
    at('state').textContent = 'opening';
    at('world').hidden = wanted.virtual === undefined;
    const address = Number(/** @type {HTMLInputElement} */ (at('address')).value);
    try {
        await session.open(wanted, wanted.virtual === undefined ? address : 1);
        /** @type {HTMLButtonElement} */ (at('leave')).disabled = false;
        await identify();
    } catch (error) {
        if (attempt === attempts) {
            at('state').textContent = words(error);
            at('module').textContent = 'no module';
        }
    }
}

/** Asks what the module is, before anything else. */
async function identify() {
    const attempt = attempts;
    const module = await session.identify();
    if (attempt !== attempts) {
        return;
    }
    at('module').textContent = module.product === null ? `${module.name}, which is not known here` : module.name;
    at('state').textContent = 'connected';
    enable(true);
    session.ask({ sample: true }).catch(() => undefined);
}

/** Asks again and again what the module is: one that has just been switched on takes its time. */
async function identifyAgain() {
    for (const attempt = attempts; attempt === attempts && session.link; ) {
        try {
            await identify();
            break;
        } catch (error) {
            if (attempt !== attempts) {
                return;
            }
            at('state').textContent = `${words(error)}; asking again each second`;
            await new Promise((resolve) => setTimeout(resolve, 1000));
        }
    }
    if (owed) {
        press();
    }
}

/** A STOP that was not answered is not forgotten with its link. */
function leaveDanger() {
    if (at('danger').textContent !== '') {
        at('danger').textContent = 'STOP was not answered, and the link is closed: the motor may turn.';
    }
}

/**
 * What the workers tell.
 * @param {any} told
 */
function hear(told) {
    if (told.stopped !== undefined) {
        owed = told.owed ?? false;
        at('danger').textContent = told.stopped
            ? ''
            : 'STOP is not answered, and is sent again: the motor may turn. Switch its power off if it must not.';
    } else if (told.columns) {
        show(told.columns);
    } else if (told.rows) {
        const { values } = told.rows.at(-1);
        values.forEach((/** @type {number | null} */ value, /** @type {number} */ index) => {
            if (cells[index]) {
                cells[index].textContent = value === null ? '-' : String(value);
            }
        });
    } else if (told.lost !== undefined) {
        enable(false);
        at('state').textContent = `the link is lost: ${told.lost}; trying again each second`;
    } else if (told.retry !== undefined) {
        at('state').textContent = `the link is lost: ${told.retry}; trying again each second`;
    } else if (told.again) {
        void identifyAgain();
    } else if (told.line !== undefined) {
        add('answers', told.line);
    } else if (told.message !== undefined) {
        add('answers', told.message, true);
    } else if (told.dead !== undefined) {
        add('replies', `the tools have ended, and are started anew: ${told.dead}`, true);
        if (session.link) {
            identify().catch((error) => (at('state').textContent = words(error)));
        }
    }
}

/** @param {import('./types.js').Column[]} columns */
function show(columns) {
    cells = columns.map(({ name, unit }) => {
        const row = document.createElement('tr');
        const head = document.createElement('th');
        head.scope = 'row';
        head.textContent = unit === '' ? name : `${name} (${unit})`;
        const cell = document.createElement('td');
        row.append(head, cell);
        return cell;
    });
    at('values').replaceChildren(...cells.map((cell) => /** @type {Node} */ (cell.parentNode)));
}

/**
 * A job with a line of its own: it waits, goes on, and can be ended.
 * @param {string} name
 * @param {string} door
 * @param {object} asked
 */
async function run(name, door, asked) {
    const item = document.createElement('li');
    const text = document.createElement('span');
    const end = document.createElement('button');
    end.type = 'button';
    end.textContent = 'End';
    end.setAttribute('aria-label', `End: ${name}`);
    text.textContent = name;
    item.append(text, ' ', end);
    at('jobs').append(item);
    const { id, answer } = session.job(door, asked, (told) => {
        if (told.waits) {
            text.textContent = `${name}: waits until the job before it is over`;
        } else if (told.begun) {
            text.textContent = `${name}: under way`;
        } else if (told.progress) {
            text.textContent = `${name}: ${told.progress.done} of ${told.progress.total}`;
        }
    });
    end.onclick = () => session.end(id);
    try {
        /** @type {import('./types.js').Text} */
        const given = await answer;
        at('result').textContent = given.text;
        text.textContent = `${name}: done`;
    } catch (error) {
        text.textContent = `${name}: ${words(error)}`;
        item.classList.add('wrong');
    }
    end.remove();
}

/** @param {SubmitEvent} event */
async function send(event) {
    event.preventDefault();
    const typed = line.value.trim();
    if (typed === '' || needing[0].disabled) {
        return;
    }
    history.push(typed);
    older = 0;
    line.value = '';
    try {
        /** @type {import('./types.js').Text} */
        const { text, done } = await session.job('tools_send', { line: typed }).answer;
        add('replies', text, !done);
    } catch (error) {
        add('replies', `${typed}: ${words(error)}`, true);
    }
}

/** @param {SubmitEvent} event */
async function control(event) {
    event.preventDefault();
    const typed = around.value.trim();
    around.value = '';
    try {
        add('answers', await session.ask({ control: typed }));
    } catch (error) {
        add('answers', `${typed}: ${words(error)}`, true);
    }
}

/**
 * Connects a serial port: the one that was chosen last or allowed before, or one that is chosen now.
 * @param {boolean} choose whether to ask in any case
 */
async function connect(choose) {
    const serial = /** @type {any} */ (navigator).serial;
    if (!serial || !canSuspend) {
        at('state').textContent =
            'this browser does not let pages use serial ports: Chrome and Edge (from 137 on) and Firefox (from 153 on) do, on a ' +
            'computer. Virtual modules work here';
        return;
    }
    const baudRate = Number(/** @type {HTMLInputElement} */ (at('rate')).value);
    try {
        let ports = await allowed();
        let known = choose ? undefined : (ports.find(({ port }) => port === chosen) ?? ports[0]);
        if (!known) {
            at('state').textContent = `choose a port. ${NO_PORT}`;
            chosen = await serial.requestPort();
            ports = await allowed();
            known = ports.find(({ port }) => port === chosen);
        }
        if (!known) {
            throw new NoPort('it is gone already');
        }
        const { kind, number } = known;
        await open({ serial: { baudRate, place: { kind, number } } });
    } catch (error) {
        at('state').textContent = `no port was chosen (${words(error)}). ${NO_PORT}`;
    }
}

function press() {
    stop.blur();
    session.stop().catch(() => add('replies', 'STOP: there is no link', true));
}

async function begin() {
    if (window.top !== window.self) {
        document.querySelectorAll('section').forEach((section) => section.remove());
        at('framed').hidden = false;
        stop.disabled = true;
        return;
    }
    const module = await WebAssembly.compileStreaming(fetch('tmcl_studio.wasm'));
    session = new Session(module, hear);
    const product = /** @type {HTMLSelectElement} */ (at('product'));
    /** @type {import('./types.js').Products} */
    const { products } = await session.job('products', {}).answer;
    product.append(...products.map((name) => new Option(`TMCM-${name}`, name)));
    stop.onclick = press;
    document.addEventListener('keydown', (event) => event.key === 'Escape' && press());
    at('start').onclick = () => void open({ virtual: product.value });
    at('connect').onclick = () => void connect(false);
    at('choose').onclick = () => void connect(true);
    at('leave').onclick = async () => {
        attempts += 1;
        enable(false);
        leaveDanger();
        await session.leave();
        /** @type {HTMLButtonElement} */ (at('leave')).disabled = true;
        at('state').textContent = 'disconnected';
        at('module').textContent = 'no module';
    };
    at('direct').onsubmit = (event) => void send(event);
    at('control').onsubmit = (event) => void control(event);
    at('settings').onclick = () => void run('Read all settings', 'tools_settings', {});
    at('load').onclick = () => {
        const text = /** @type {HTMLTextAreaElement} */ (at('source')).value;
        void run('Load program', 'tools_load', { name: 'program.tmc', text, debug: [] });
    };
    line.onkeydown = (event) => {
        const step = { ArrowUp: 1, ArrowDown: -1 }[event.key];
        if (step) {
            older = Math.min(Math.max(older + step, 0), history.length);
            line.value = older === 0 ? '' : (history.at(-older) ?? '');
            event.preventDefault();
        }
    };
    window.addEventListener('pagehide', () => session.vanish());
    // A page that comes back as it was has no link any more.
    window.addEventListener('pageshow', (event) => event.persisted && location.reload());
    at('state').textContent = 'ready';
}

begin().catch((error) => (at('state').textContent = `this page could not start: ${words(error)}`));
