// Files of the user: opened and saved by the browser. Nothing of them leaves this computer.

import { make } from './dom.js';

/** Most bytes of a text that is opened. */
const MOST = 2 * 1024 * 1024;

/**
 * Offers a text or bytes as a file to be saved.
 * @param {string} name
 * @param {BlobPart} contents
 * @param {string} type
 */
export function download(name, contents, type = 'text/plain') {
    const address = URL.createObjectURL(new Blob([contents], { type }));
    const link = make('a', { href: address, download: name });
    link.click();
    // The browser has begun to read it by then, or it never will.
    setTimeout(() => URL.revokeObjectURL(address), 60_000);
}

/**
 * Lets the user choose a file, and reads it. None, if none is chosen.
 * @param {string} accept
 * @param {number} most bytes that it may have
 * @returns {Promise<{ name: string, bytes: Uint8Array<ArrayBuffer> } | null>}
 */
export function openBytes(accept, most) {
    return new Promise((resolve, reject) => {
        const input = make('input', { type: 'file', accept });
        input.addEventListener('cancel', () => resolve(null));
        input.addEventListener('change', () => {
            const [file] = input.files ?? [];
            file ? read(file, most).then(resolve, reject) : resolve(null);
        });
        input.click();
    });
}

/**
 * Lets the user choose a file, and reads it as text. None, if none is chosen.
 * @param {string} accept
 * @param {number} most bytes that it may have
 * @returns {Promise<{ name: string, text: string } | null>}
 */
export async function openFile(accept = '', most = MOST) {
    const file = await openBytes(accept, most);
    try {
        return file && { name: file.name, text: new TextDecoder('utf-8', { fatal: true }).decode(file.bytes) };
    } catch {
        throw new Error(`${file?.name} is no text in UTF-8`);
    }
}

/**
 * @param {File} file
 * @param {number} most
 */
async function read(file, most) {
    if (file.size > most) {
        throw new Error(`${file.name} has ${file.size} bytes: files of up to ${most} are opened here`);
    }
    return { name: file.name, bytes: new Uint8Array(await file.arrayBuffer()) };
}
