// What can be touched in the world of a virtual module: each control gives a line of the control port.

import { button, make, write } from '../dom.js';

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
 * @param {(line: string) => Promise<boolean>} carryOut gives whether it has been done
 * @returns {Control}
 */
export function control({ axis, name, how, shown }, carryOut) {
    const label = axis === null ? name : `${name}, axis ${axis}`;
    if ('switch' in how) {
        return toggle(name, label, how.switch, shown !== null, carryOut);
    }
    return 'number' in how ? number(name, label, how.number, carryOut) : choice(name, label, how.choice, carryOut);
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldSwitch} lines
 * @param {boolean} isShown whether its state comes from the world; else it is the last one that was wanted
 * @param {(line: string) => Promise<boolean>} carryOut
 */
function toggle(name, label, { on, off }, isShown, carryOut) {
    const is = (/** @type {boolean} */ yes) => made.setAttribute('aria-checked', String(yes));
    const made = button(
        name,
        async () => {
            const wanted = made.getAttribute('aria-checked') !== 'true';
            if ((await carryOut(wanted ? on : off)) && !isShown) {
                is(wanted);
            }
        },
        { role: 'switch', 'aria-label': label, 'aria-checked': String(label === 'USB cable') },
    );
    return { element: made, show: (/** @type {number | null} */ value) => isShown && is(value === 1) };
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldNumber} of
 * @param {(line: string) => Promise<boolean>} carryOut
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
        void carryOut(`${before}${input.value}${behind}`);
    });
    const show = (/** @type {number | null} */ value) => write(now, value === null ? '' : String(Math.round(value * 1000) / 1000));
    return { element: form, show };
}

/**
 * @param {string} name
 * @param {string} label
 * @param {import('../types.js').WorldState[]} states
 * @param {(line: string) => Promise<boolean>} carryOut
 */
function choice(name, label, states, carryOut) {
    const select = make('select', { 'aria-label': label }, ...states.map((state, at) => new Option(state.name, String(at))));
    select.onchange = () => void carryOut(states[Number(select.value)].line);
    const show = (/** @type {number | null} */ value) => {
        if (value !== null && document.activeElement !== select) {
            select.value = String(value);
        }
    };
    return { element: make('label', {}, `${name} `, select), show };
}
