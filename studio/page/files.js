// Files of the user: opened and saved by the browser. Nothing of them leaves this computer.

import { make } from './dom.js';

/** Most bytes of a file that is opened. */
const MOST = 2 * 1024 * 1024;

/**
 * Offers a text as a file to be saved.
 * @param {string} name
 * @param {string} text
 * @param {string} type
 */
export function download(name, text, type = 'text/plain') {
    const address = URL.createObjectURL(new Blob([text], { type }));
    const link = make('a', { href: address, download: name });
    link.click();
    // The browser has begun to read it by then, or it never will.
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/**
 * Lets the user choose a file, and reads it as text. None, if none is chosen.
 * @param {string} accept
 * @returns {Promise<{ name: string, text: string } | null>}
 */
export function openFile(accept = '') {
    return new Promise((resolve, reject) => {
        const input = make('input', { type: 'file', accept });
        input.addEventListener('cancel', () => resolve(null));
        input.addEventListener('change', () => {
            const [file] = input.files ?? [];
            file ? read(file).then(resolve, reject) : resolve(null);
        });
        input.click();
    });
}

/**
 * @param {File} file
 * @returns {Promise<{ name: string, text: string }>}
 */
async function read(file) {
    if (file.size > MOST) {
        throw new Error(`${file.name} has ${file.size} bytes: files of up to ${MOST} are opened here`);
    }
    const bytes = await file.arrayBuffer();
    try {
        return { name: file.name, text: new TextDecoder('utf-8', { fatal: true }).decode(bytes) };
    } catch {
        throw new Error(`${file.name} is no text in UTF-8`);
    }
}
