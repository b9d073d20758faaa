// The page: its parts are put together here.

import { at, button, make, words, write } from './dom.js';
import { download, openFile } from './files.js';
import { everythingAsFile, forgetEverything, keepEverything, readEverything, refusal } from './keep.js';
import { Connection } from './panels/connection.js';
import { Curves } from './panels/curves.js';
import { Direct } from './panels/direct.js';
import { Eeprom } from './panels/eeprom.js';
import { FlashImage } from './panels/image.js';
import { Jobs } from './panels/jobs.js';
import { AxesPanel } from './panels/axes.js';
import { InputsPanel } from './panels/inputs.js';
import { Parameters } from './panels/settings.js';
import { Program } from './panels/program.js';
import { Sessions } from './panels/sessions.js';
import { Values } from './panels/values.js';
import { World } from './panels/world.js';
import { question } from './question.js';
import { Session } from './session.js';
import { Workbench } from './workbench.js';

/** @param {string} text something that is to be read aloud */
const announce = (text) => write(at('announced'), text);

/** Where the page is narrow, one part of it is shown at a time; where it is wide, the same buttons lead keyboards to the parts. Gives
 * what leads to a part. */
function tabs() {
    const parts = [...document.querySelectorAll('[data-tab]')].map((part) => /** @type {HTMLElement} */ (part));
    const names = [...new Set(parts.map(({ dataset }) => dataset.tab ?? ''))];
    const buttons = names.map((name) => button(name, () => (show(name), lead(name))));
    /** @param {string} name */
    function show(name) {
        parts.forEach((part) => part.classList.toggle('away', part.dataset.tab !== name));
        buttons.forEach((made) => made.setAttribute('aria-pressed', String(made.textContent === name)));
    }
    /** @param {string} name */
    function lead(name) {
        const heading = parts.find(({ dataset }) => dataset.tab === name)?.querySelector('h2');
        if (heading && matchMedia('(min-width: 1100px)').matches) {
            heading.tabIndex = -1;
            heading.focus();
        }
    }
    at('tabs').append(...buttons);
    show(names[0]);
    return (/** @type {string} */ name) => {
        show(name);
        lead(name);
    };
}

/** What the browser keeps: as a file, and away with it. */
function keeping() {
    const forget = async () => {
        const lines = ['All texts, favourites, units, curves and lines that this browser keeps for this page are lost, and the page is loaded anew.'];
        if (await question('Forget everything?', lines, 'Forget')) {
            forgetEverything();
            location.reload();
        }
    };
    const save = () => download('studio.json', everythingAsFile(), 'application/json');
    const open = async () => {
        try {
            const file = await openFile('.json,application/json');
            const found = file && readEverything(file.name, file.text);
            const lines = [
                'Favourites, units, curves, and the lines of direct mode are replaced by those of the file.',
                'Texts are added: one whose name is there already gets another name. The page is loaded anew.',
            ];
            if (found && (await question(`Open ${file.name}?`, lines, 'Open'))) {
                keepEverything(found);
                location.reload();
            }
        } catch (error) {
            write(told, words(error));
        }
    };
    const told = make('p', { role: 'status', 'aria-label': 'What is kept', class: 'wrong' });
    at('keeping').append(
        button('Everything as a file', save),
        button('Open everything', () => void open()),
        button('Forget everything', () => void forget()),
        told,
    );
    if (refusal !== '') {
        at('keeping').prepend(make('p', { class: 'wrong', text: `This browser keeps nothing for the next visit: ${refusal}` }));
    }
}

async function begin() {
    if (window.top !== window.self) {
        document.querySelectorAll('main > *, nav, #keeping').forEach((part) => part.id !== 'framed' && part.remove());
        at('framed').hidden = false;
        /** @type {HTMLButtonElement} */ (at('stop')).disabled = true;
        return;
    }
    const module = await WebAssembly.compileStreaming(fetch('tmcl_studio.wasm'));
    /** @type {{ hear: (told: any) => void }[]} */
    const hearing = [];
    const session = new Session(module, (told) => hearing.forEach((panel) => panel.hear(told)));
    const bench = new Workbench(session, new Jobs(at('jobs'), session), announce);
    const product = /** @type {HTMLSelectElement} */ (at('product'));
    /** @type {import('./types.js').Products} */
    const { products } = await bench.ask('products', {});
    product.append(...products.map((name) => new Option(`TMCM-${name}`, name)));
    const world = new World(bench);
    const program = new Program(bench);
    const eeprom = new Eeprom(bench);
    const connection = new Connection(bench, program.texts, eeprom);
    const image = new FlashImage(bench, connection);
    const curves = new Curves(bench);
    const sessions = new Sessions(bench, program, connection, curves);
    bench.panels.push(
        new Direct(bench),
        new Values(at('values'), bench),
        curves,
        new Parameters(bench),
        new InputsPanel(at('inputs'), bench),
        new AxesPanel(at('axes'), bench),
        program,
        program.debugger,
        world,
        eeprom,
        image,
        sessions,
    );
    hearing.push(connection, world, eeprom, image);
    bench.reveal = tabs();
    keeping();
    window.addEventListener('pagehide', () => session.vanish());
    // A page that comes back as it was has no link any more.
    window.addEventListener('pageshow', (event) => event.persisted && location.reload());
    at('state').textContent = 'ready';
    await sessions.openLink(location.hash);
}

begin().catch((error) => (at('state').textContent = `this page could not start: ${words(error)}`));
