// Sessions behind the `#` of an address, which no server sees: JSON, compressed by the browser, in the letters of addresses.

import { words } from './dom.js';

/** Most characters of a session in a link: what mail and forums leave whole. */
export const MOST = 8000;
/** Most bytes of a session. What a link says of itself is not believed, and no more than that is unpacked. */
export const LONGEST = 8_000_000;
/** What stands before a session. */
const NAME = '#session=';

/**
 * Whether a session stands behind an address.
 * @param {string} hash
 */
export const isLink = (hash) => hash.startsWith(NAME);

/**
 * What stands behind the address of the page.
 * @param {string} text of a session
 */
export async function pack(text) {
    const packed = new Blob([text]).stream().pipeThrough(new CompressionStream('deflate-raw'));
    const bytes = new Uint8Array(await new Response(packed).arrayBuffer());
    const letters = Array.from(bytes, (byte) => String.fromCharCode(byte)).join('');
    return NAME + btoa(letters).replaceAll('+', '-').replaceAll('/', '_').replaceAll('=', '');
}

/** @param {string} letters in base 64 */
function decode(letters) {
    try {
        return atob(letters);
    } catch (error) {
        throw new Error(`this link was cut off or changed: ${words(error)}`);
    }
}

/**
 * The text of the session that stands behind an address.
 * @param {string} hash
 */
export async function unpack(hash) {
    const letters = hash.slice(NAME.length);
    if (!/^[\w-]*$/.test(letters)) {
        throw new Error('this link has letters that no link of a session has: was it copied whole?');
    }
    const bytes = Uint8Array.from(decode(letters.replaceAll('-', '+').replaceAll('_', '/')), (letter) => letter.charCodeAt(0));
    const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw')).getReader();
    const decoder = new TextDecoder('utf-8', { fatal: true });
    let text = '';
    let length = 0;
    try {
        for (let part = await reader.read(); !part.done && length <= LONGEST; part = await reader.read()) {
            length += part.value.length;
            text += decoder.decode(part.value, { stream: true });
        }
        text += length <= LONGEST ? decoder.decode() : '';
    } catch (error) {
        throw new Error(`this link was cut off or changed: ${words(error)}`);
    }
    if (length > LONGEST) {
        reader.cancel().catch(() => undefined);
        throw new Error(`this link has more than ${LONGEST} bytes when it is unpacked, which no session has`);
    }
    return text;
}
