// Rows as CSV (RFC 4180).

import { decimal } from './scale.js';

/** Rows in a portion: between two of them the page does something else, such as STOP. */
const PORTION = 20_000;

/** @param {string} text */
const quoted = (text) => (/[",\r\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);

/**
 * The text: the names with their units, then a line for each row. A missing value is empty. Rows that are overwritten meanwhile
 * are left out. Nothing is given if the rings begin anew meanwhile.
 * @param {import('./rings.js').Rings} rings
 * @param {import('./frame.js').Curve[]} curves
 * @param {number} from the first row
 * @param {number} to the row after the last
 */
export async function csv(rings, curves, from, to) {
    const { begun } = rings;
    const names = curves.map(({ name, unit }) => (unit === '' ? name : `${name} (${unit})`));
    const parts = [`${['time (ms)', ...names].map(quoted).join(',')}\r\n`];
    for (let start = from; start < to; start += PORTION) {
        const lines = [];
        for (let row = Math.max(start, rings.first); row < Math.min(start + PORTION, to); row += 1) {
            const fields = [String(Math.round(rings.time(row) * 1000) / 1000)];
            curves.forEach(({ decimals }, curve) => {
                const value = rings.value(curve, row);
                fields.push(value === undefined ? '' : decimal(value, decimals));
            });
            lines.push(`${fields.join(',')}\r\n`);
        }
        parts.push(lines.join(''));
        await new Promise((resolve) => setTimeout(resolve));
        if (rings.begun !== begun) {
            return undefined;
        }
    }
    return parts.join('');
}
