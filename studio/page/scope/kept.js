// What is kept for the next visit. It may have been edited by hand, so that it is believed in nothing.

import { fits } from './view.js';

/**
 * What is kept.
 * @typedef {object} Kept
 * @property {number} window in milliseconds
 * @property {import('./frame.js').Scale[]} scales
 * @property {import('./trigger.js').Settings} trigger
 * @property {string[]} hidden names of curves
 */

/** Most entries of a list. */
const MOST = 100;
/** Longest name. */
const LONGEST = 200;

/** @param {unknown} value */
const isName = (value) => typeof value === 'string' && value.length <= LONGEST;

/**
 * Whether something is an object with these keys and no others, whose values are right.
 * @param {any} value
 * @param {Record<string, (value: any) => boolean>} keys
 */
function has(value, keys) {
    const names = Object.keys(keys);
    return (
        typeof value === 'object' &&
        value !== null &&
        Object.keys(value).length === names.length &&
        names.every((name) => Object.hasOwn(value, name) && keys[name](value[name]))
    );
}

/**
 * Whether something is a list without two entries of one name.
 * @param {any} value
 * @param {(entry: any) => boolean} right
 * @param {(entry: any) => string} name
 */
const isList = (value, right, name) =>
    Array.isArray(value) && value.length <= MOST && value.every(right) && new Set(value.map(name)).size === value.length;

/** @param {any} value */
const isScale = (value) =>
    has(value, { unit: isName, low: Number.isFinite, high: Number.isFinite }) &&
    value.low < value.high &&
    Number.isFinite(value.high - value.low);

/** @type {Record<keyof Kept, (value: any) => boolean>} */
const KEYS = {
    window: (value) => typeof value === 'number' && fits(value),
    scales: (value) => isList(value, isScale, ({ unit }) => unit),
    trigger: (value) =>
        has(value, {
            curve: isName,
            edge: (edge) => edge === 'rising' || edge === 'falling',
            level: Number.isFinite,
            single: (single) => typeof single === 'boolean',
        }),
    hidden: (value) => isList(value, isName, (name) => name),
};

/** A scale that can be drawn.
 * @param {import('./frame.js').Scale} scale */
export const rightScale = (scale) => isScale(scale);

/**
 * What is wrong with something that was kept, in words, or nothing.
 * @param {any} state
 * @returns {string}
 */
export function wrong(state) {
    if (has(state, KEYS)) {
        return '';
    }
    const names = /** @type {(keyof Kept)[]} */ (Object.keys(KEYS));
    const first =
        typeof state === 'object' && state !== null
            ? names.find((name) => !Object.hasOwn(state, name) || !KEYS[name](state[name]))
            : undefined;
    return `what was kept of the scope is not right${first === undefined ? '' : ` (${first})`}, and is not used`;
}
