// What is kept for the next visit, in the browser's storage of this origin. It may have been edited by hand: whoever reads
// something checks it.

import { words } from './dom.js';

/** The beginning of the names of all that is kept. */
const PREFIX = 'tmcl-studio/';
/** The beginning of the names of texts, among all that is kept. */
const TEXT_NAME = 'text/';
/** The same in the browser's storage. */
const TEXT = PREFIX + TEXT_NAME;

/** @typedef {{ version: number, text: string }} KeptText */

/** Why the browser keeps nothing; empty if it does. */
export const refusal = (() => {
    try {
        localStorage.setItem(`${PREFIX}try`, '1');
        localStorage.removeItem(`${PREFIX}try`);
        return '';
    } catch (error) {
        return words(error);
    }
})();

/** What is kept has been exchanged as a whole: until the page is loaded anew nobody writes what was there before. */
let isExchanged = false;

/**
 * What is kept under a name; null if there is nothing, or nothing that can be read.
 * @param {string} name
 * @returns {any}
 */
export function kept(name) {
    try {
        return JSON.parse(localStorage.getItem(PREFIX + name) ?? 'null');
    } catch {
        return null;
    }
}

/**
 * Keeps something under a name. Gives why that cannot be done; empty if it is done.
 * @param {string} name
 * @param {unknown} value
 */
export function keep(name, value) {
    if (isExchanged) {
        return '';
    }
    try {
        localStorage.setItem(PREFIX + name, JSON.stringify(value));
        return '';
    } catch (error) {
        return `the browser does not keep it (${words(error)}): save it as a file`;
    }
}

/**
 * A text that is kept, if it is one.
 * @param {string} name
 * @returns {KeptText | null}
 */
export function keptText(name) {
    const found = kept(TEXT_NAME + name);
    const isText = typeof found?.text === 'string' && Number.isSafeInteger(found.version) && found.version >= 0;
    return isText ? { version: found.version, text: found.text } : null;
}

/** The names of the texts that are kept, in their order. */
export function keptTexts() {
    const names = [];
    for (let index = 0; !refusal && index < localStorage.length; index += 1) {
        const key = localStorage.key(index) ?? '';
        if (key.startsWith(TEXT) && keptText(key.slice(TEXT.length))) {
            names.push(key.slice(TEXT.length));
        }
    }
    return names.sort();
}

/**
 * Keeps a text, unless another tab has kept another version of it since.
 * @param {string} name
 * @param {string} text
 * @param {number} version the version that this tab knows
 * @returns {{ version: number, why: string } | 'changed'}
 */
export function keepText(name, text, version) {
    const there = keptText(name);
    if (there && there.version !== version) {
        return there.text === text ? { version: there.version, why: '' } : 'changed';
    }
    return { version: version + 1, why: keep(TEXT_NAME + name, { version: version + 1, text }) };
}

/** @param {string} name */
export function forgetText(name) {
    try {
        localStorage.removeItem(TEXT + name);
    } catch {
        // Where nothing is kept, nothing is there to be forgotten.
    }
}

/** The version of a file of all that is kept. */
const VERSION = 1;

/** All that is kept, by names. */
function everything() {
    /** @type {Record<string, unknown>} */
    const all = {};
    for (let index = 0; !refusal && index < localStorage.length; index += 1) {
        const key = localStorage.key(index) ?? '';
        if (key.startsWith(PREFIX)) {
            all[key.slice(PREFIX.length)] = kept(key.slice(PREFIX.length));
        }
    }
    return all;
}

/** All that is kept, as a file. */
export const everythingAsFile = () => JSON.stringify({ studio: VERSION, kept: everything() }, null, 1);

/** Forgets all that is kept, until the page is loaded anew. */
export function forgetEverything() {
    Object.keys(everything()).forEach((name) => localStorage.removeItem(PREFIX + name));
    isExchanged = true;
}

/**
 * Reads a file of all that was kept.
 * @param {string} name of the file
 * @param {string} text
 * @returns {Record<string, unknown>} what it has, by names
 */
export function readEverything(name, text) {
    /** @type {any} */
    let file;
    try {
        file = JSON.parse(text);
    } catch (error) {
        throw new Error(`${name} is no file of this page, or is cut off: ${words(error)}`);
    }
    if (!Number.isSafeInteger(file?.studio) || typeof file.kept !== 'object' || file.kept === null || Array.isArray(file.kept)) {
        throw new Error(`${name} is no file of this page: "Everything as a file" makes one`);
    }
    if (file.studio > VERSION) {
        throw new Error(`${name} is of a later version of this page (${file.studio}); this one reads up to ${VERSION}`);
    }
    return file.kept;
}

/**
 * Keeps what a file has, in place of what is kept; but texts that are there stay, and those of the file stand beside them. If
 * there is no room, all stays as it was. The page has to be loaded anew.
 * @param {Record<string, unknown>} wanted
 */
export function keepEverything(wanted) {
    if (refusal !== '') {
        throw new Error(`the browser keeps nothing: ${refusal}`);
    }
    const before = everything();
    /** @type {Record<string, unknown>} */
    const all = { ...before };
    for (const [name, value] of Object.entries(wanted)) {
        const isText = name.startsWith(TEXT_NAME);
        const isThere = isText && name in before && JSON.stringify(before[name]) !== JSON.stringify(value);
        all[isThere ? freeName(name, (other) => other in all) : name] = value;
    }
    try {
        Object.entries(all).forEach(([name, value]) => localStorage.setItem(PREFIX + name, JSON.stringify(value)));
    } catch (error) {
        Object.keys(all).forEach((name) => localStorage.removeItem(PREFIX + name));
        Object.entries(before).forEach(([name, value]) => localStorage.setItem(PREFIX + name, JSON.stringify(value)));
        throw new Error(`the browser has no room for it, and all is as it was: ${words(error)}`);
    }
    isExchanged = true;
}

/**
 * A name like this one that is free.
 * @param {string} name
 * @param {(name: string) => boolean} isTaken
 */
export function freeName(name, isTaken) {
    const dot = name.lastIndexOf('.');
    const [front, end] = dot > 0 ? [name.slice(0, dot), name.slice(dot)] : [name, ''];
    let free = name;
    for (let number = 2; isTaken(free); number += 1) {
        free = `${front}-${number}${end}`;
    }
    return free;
}
