// What the user has chosen, as it is kept for the next visit. It may have been edited by hand, so each part is checked by itself.

/** Most favourites, and most letters of a unit's name. */
const MOST = 500;
const LONGEST = 20;
/** A favourite. */
const PLACE = /^(axis|global|interrupt)\/[0-9]{1,3}$/;
/** The banks that can be chosen. */
export const BANKS = ['axis', 'global', 'interrupt', 'all'];
/** The units that can be chosen. */
export const UNITS = ['module', 'physical', 'own'];

/** @typedef {import('../../types.js').OwnUnit} OwnUnit */

/**
 * @typedef {object} Kept
 * @property {string[]} favourites as `axis/4`
 * @property {string} bank one of BANKS
 * @property {string} units one of UNITS
 * @property {Record<string, OwnUnit>} own the user's units, by the axis
 * @property {Record<string, number>} steps full steps per turn, by the axis
 */

/** @param {unknown} unit @returns {unit is OwnUnit} */
export function isUnit(unit) {
    const { name, microsteps } = /** @type {any} */ (unit ?? {});
    const isName = typeof name === 'string' && name.trim() !== '' && name.length <= LONGEST;
    return isName && Number.isFinite(microsteps) && microsteps > 0;
}

/** @param {unknown} steps @returns {steps is number} */
export const isSteps = (steps) => Number.isInteger(steps) && Number(steps) >= 1 && Number(steps) <= 65535;

/**
 * The parts of an object whose names are numbers of axes, and whose values are as they have to be.
 * @template T
 * @param {unknown} parts
 * @param {(value: unknown) => value is T} isOne
 * @param {(value: T) => T} copy
 * @returns {Record<string, T>}
 */
function byAxis(parts, isOne, copy) {
    /** @type {Record<string, T>} */
    const found = {};
    for (const [axis, value] of Object.entries(parts !== null && typeof parts === 'object' ? parts : {})) {
        if (/^[0-9]{1,2}$/.test(axis) && isOne(value)) {
            found[axis] = copy(value);
        }
    }
    return found;
}

/**
 * What is kept, as far as it can be made use of.
 * @param {unknown} state
 * @returns {Kept}
 */
export function checked(state) {
    const { favourites, bank, units, own, steps } = /** @type {any} */ (state !== null && typeof state === 'object' ? state : {});
    const isPlace = (/** @type {unknown} */ place) => typeof place === 'string' && PLACE.test(place);
    return {
        favourites: Array.isArray(favourites) ? [...new Set(favourites.filter(isPlace))].slice(0, MOST) : [],
        bank: BANKS.includes(bank) ? bank : 'axis',
        units: UNITS.includes(units) ? units : 'module',
        own: byAxis(own, isUnit, ({ name, microsteps }) => ({ name, microsteps })),
        steps: byAxis(steps, isSteps, (count) => count),
    };
}
