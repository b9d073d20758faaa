// The services of the editor in its tests. Words in capitals are commands, `bad` is a mistake, `odd` is worth a warning, and #
// begins a comment. With `held` the answers of `check` wait until a test lets them go.
import { Editor } from './editor/editor.js';
import { KINDS } from './editor/types.js';

const kind = (name) => KINDS.indexOf(name);
const told = (window.told = { announced: [], changes: 0, breakpoints: [], moved: [], files: [], escapes: 0 });
window.held = null;
window.asked = [];

function check(text) {
    const lines = [], messages = [], commands = [];
    const say = (message) => messages.push(message);
    text.split('\n').forEach((line, index) => {
        const tokens = [];
        for (const { 0: word, index: start } of line.matchAll(/#.*|\p{L}+|\d+|[^\s]/gu)) {
            const name = word[0] === '#' ? 'comment' : /^\d/.test(word) ? 'number' : /^[A-Z]+$/.test(word) ? 'mnemonic'
                : word === 'bad' ? 'wrong' : /^\p{L}/u.test(word) ? 'name' : 'symbol';
            tokens.push(start, start + word.length, kind(name));
            if (name === 'mnemonic') {
                commands.push(index);
            }
            const at = { file: null, line: index, start, end: start + word.length };
            if (word === 'bad') {
                say({ ...at, severity: 'error', words: "unknown name 'bad'", advice: { instead: 'good' } });
            } else if (word === 'odd') {
                say({ ...at, severity: 'warning', words: 'an odd <b>name</b>', advice: { words: 'use an even one' } });
            } else if (word === 'far') {
                say({ ...at, file: 'far.inc', line: 7, start: 3, severity: 'error', words: 'wrong there', advice: null });
            }
        }
        lines.push(tokens);
    });
    return { lines, messages, commands };
}

const services = {
    check(text) {
        window.asked.push(text.length < 1000 ? text : text.length);
        if (text === 'fail') {
            return Promise.reject(new Error('the tools have ended'));
        }
        return window.held ? new Promise((go) => window.held.push(() => go(check(text)))) : Promise.resolve(check(text));
    },
    async complete(text, line, column) {
        const before = /\p{L}*$/u.exec(text.split('\n')[line].slice(0, column))[0];
        const items = ['MOVE', 'MOVEALL', 'STOP', 'MOTOR'].filter((name) => before !== '' && name.startsWith(before));
        return { start: column - before.length, end: column, items: items.map((text) => ({ text, note: `about ${text}` })) };
    },
    async explain(text, line, column) {
        for (const { 0: word, index: start } of text.split('\n')[line].matchAll(/\p{L}+/gu)) {
            if (start <= column && column <= start + word.length) {
                const places = { here: { file: null, line: 2, column: 1 }, far: { file: 'far.inc', line: 4, column: 5 } };
                return { start, end: start + word.length, words: `${word} is a <i>word</i>`, place: places[word] ?? null };
            }
        }
        return null;
    },
};
const root = document.getElementById('root');
const editor = new Editor(root, services, { name: 'Program', announce: (text) => told.announced.push(text) });
editor.onchange = () => (told.changes += 1);
editor.onbreakpoint = (line, on) => told.breakpoints.push([line, on]);
editor.onbreakpointsmoved = (lines) => told.moved.push(lines);
editor.onfile = (...place) => told.files.push(place);
document.addEventListener('keydown', ({ key }) => (told.escapes += key === 'Escape' ? 1 : 0));
window.editor = editor;
