// The list of messages: each leads to its place, and what is advised is done by a button.

import { make } from '../dom.js';

/** The longest list. What a text has more is said with a number. */
const MOST_SHOWN = 200;

/** @typedef {import('./model.js').Placed} Placed */

/**
 * @param {number} count
 * @param {string} one
 */
const counted = (count, one) => `${count} ${one}${count === 1 ? '' : 's'}`;

/**
 * How many messages there are, in words.
 * @param {Placed[]} placed
 */
export function summary(placed) {
    const errors = placed.filter(({ message }) => message.severity === 'error').length;
    const warnings = placed.length - errors;
    const parts = [...(errors ? [counted(errors, 'error')] : []), ...(warnings ? [counted(warnings, 'warning')] : [])];
    return parts.join(', ') || 'no errors';
}

/**
 * Shows messages.
 * @param {HTMLElement} list
 * @param {Placed[]} placed
 * @param {(placed: Placed) => void} lead
 * @param {(placed: Placed, instead: string) => void} replace
 */
export function show(list, placed, lead, replace) {
    const items = placed.slice(0, MOST_SHOWN).map((one) => {
        const { file, line, severity, words, advice } = one.message;
        const item = make('li', { class: `editor-message editor-message-${severity}` });
        const place = make('button', { class: 'editor-place', type: 'button' });
        place.textContent = `${file === null ? '' : `${file}, `}line ${line + 1}: ${severity}: ${words}`;
        place.onclick = () => lead(one);
        item.append(place);
        if (advice && 'instead' in advice && file === null) {
            const { instead } = advice;
            const use = make('button', { class: 'editor-use', type: 'button' });
            use.textContent = `Use '${instead}'`;
            use.onclick = () => replace(one, instead);
            item.append(use);
        } else if (advice && 'words' in advice) {
            const text = make('span', { class: 'editor-advice' });
            text.textContent = advice.words;
            item.append(text);
        }
        return item;
    });
    if (placed.length > MOST_SHOWN) {
        const rest = make('li', { class: 'editor-message' });
        rest.textContent = `and ${placed.length - MOST_SHOWN} more`;
        items.push(rest);
    }
    list.replaceChildren(...items);
}
