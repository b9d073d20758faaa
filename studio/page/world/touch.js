// What can be touched in the world of a virtual module: each control gives a line of the control port.

import { attribute, button, make, write } from '../dom.js';

/** @typedef {import('../types.js').WorldTouchable} WorldTouchable */

/**
 * A control.
 * @typedef {object} Control
 * @property {HTMLElement} element
 * @property {(value: number | null) => void} show shows how it is; null for what nothing tells
 */

/**
 * Makes the control of something that can be touched.
 * @param {WorldTouchable} touchable
 * @param {(line: string) => void} carryOut
 * @returns {Control}
 */
export function control({ axis, name, how, shown }, carryOut) {
    const label = axis === null ? name : `${name}, axis ${axis}`;
    if ('switch' in how) {
        return shown === null ? pair(name, label, how.switch, carryOut) : toggle(name, label, how.switch, carryOut);
    }
    return 'number' in how ? number(name, label, how.number, carryOut) : choice(name, label, how.choice, carryOut);
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldSwitch} lines
 * @param {(line: string) => void} carryOut
 */
function toggle(name, label, { on, off }, carryOut) {
    const press = () => carryOut(made.getAttribute('aria-checked') === 'true' ? off : on);
    const made = button(name, press, { role: 'switch', 'aria-label': label, 'aria-checked': 'false' });
    return { element: made, show: (/** @type {number | null} */ value) => attribute(made, 'aria-checked', String(value === 1)) };
}

/**
 * Two buttons, for what nothing tells whether it is on.
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldSwitch} lines
 * @param {(line: string) => void} carryOut
 */
function pair(name, label, { on, off }, carryOut) {
    const of = (/** @type {string} */ text, /** @type {string} */ line) =>
        button(text, () => carryOut(line), { 'aria-label': `${label}: ${text}` });
    const element = make('span', { class: 'world-number', role: 'group', 'aria-label': label }, `${name} `, of('on', on), of('off', off));
    return { element, show: () => undefined };
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldNumber} of
 * @param {(line: string) => void} carryOut
 */
function number(name, label, { before, behind, least, greatest, step, unit, once }, carryOut) {
    const range = `${least} to ${greatest}${unit === '' ? '' : ` ${unit}`}, in steps of ${step}`;
    const attributes = { type: 'text', inputmode: 'decimal', size: '6', title: range };
    const input = make('input', { ...attributes, 'aria-label': label, value: once ? '1' : '' });
    const now = make('span', { class: 'world-now' });
    const go = make('button', { type: 'submit', text: 'Set', 'aria-label': `Set: ${label}` });
    // What does not fit is refused by the world itself, in its own words.
    const form = make('form', { class: 'world-number', novalidate: true }, `${name} `, now, ' ', input, ` ${unit} `, go);
    form.addEventListener('submit', (event) => {
        event.preventDefault();
        const typed = input.value.trim();
        // A number that is missing, or two, would make the axis behind it something else.
        input.setCustomValidity(/^\S+$/.test(typed) ? '' : `one number, ${range}`);
        if (input.reportValidity()) {
            carryOut(`${before}${typed}${behind}`);
        }
    });
    input.addEventListener('input', () => input.setCustomValidity(''));
    const show = (/** @type {number | null} */ value) => write(now, value === null ? '' : String(Math.round(value * 1000) / 1000));
    return { element: form, show };
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldState[]} states
 * @param {(line: string) => void} carryOut
 */
function choice(name, label, states, carryOut) {
    const select = make('select', { 'aria-label': label }, ...states.map((state, at) => new Option(state.name, String(at))));
    select.onchange = () => carryOut(states[Number(select.value)].line);
    const show = (/** @type {number | null} */ value) => {
        if (value !== null && document.activeElement !== select) {
            select.value = String(value);
        }
    };
    return { element: make('label', {}, `${name} `, select), show };
}
