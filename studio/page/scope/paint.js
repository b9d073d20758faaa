// The picture of a frame, by any pen.

import { COLUMNS } from './frame.js';
import { marker } from './markers.js';
import { multiples, rounded, roundStep } from './scale.js';

/** Room for the numbers of the scales, in pixels. */
export const LEFT = 80;
export const RIGHT = 8;
const TOP = 8;
/** Room for the times. */
const BOTTOM = 22;
/** Room between two lanes. */
const BETWEEN = 14;
/** Width of a letter, about. */
const LETTER = 7;
/** Width of a step of time, about. */
const STEP = 90;
/** Markers of a curve in a view. */
const MARKERS = 6;

/** @typedef {{ text: string, grid: string, back: string, curves: string[] }} Palette */
/** @typedef {{ at: number, name: string }} Line a line across all lanes */
/** @typedef {{ curve: number, level: number } | undefined} Level */

/**
 * What is to be painted, beside the frame.
 * @typedef {object} Picture
 * @property {number} width
 * @property {number} height
 * @property {import('./frame.js').Curve[]} curves
 * @property {Palette} palette
 * @property {Line[]} lines
 * @property {Level} level of the trigger
 */

/** @param {number} height of the whole plot */
export const lanesHeight = (height) => height - TOP - BOTTOM;

/**
 * Paints a frame.
 * @param {import('./pens.js').Pen} pen
 * @param {import('./frame.js').Frame} frame
 * @param {Picture} picture
 */
export function paint(pen, frame, picture) {
    const { width, height, palette } = picture;
    const wide = width - LEFT - RIGHT;
    const bottom = height - BOTTOM;
    const span = frame.to - frame.from;
    const x = (/** @type {number} */ at) => LEFT + ((at - frame.from) / span) * wide;
    const step = roundStep(span / Math.max(wide / STEP, 1) / 1000);
    for (const second of multiples(frame.from / 1000, frame.to / 1000, step)) {
        const place = x(1000 * second);
        straight(pen, place, TOP, place, bottom, palette.grid);
        pen.text(rounded(second, step), Math.min(place, width - RIGHT - 10), bottom + 12, palette.text, 'middle');
    }
    pen.text('time in s', 4, bottom + 12, palette.text);
    const each = lanesHeight(height) / Math.max(frame.lanes.length, 1);
    frame.lanes.forEach((lane, index) => paintLane(pen, frame, picture, lane, TOP + index * each, each - BETWEEN));
    for (const { at, name } of picture.lines.filter((line) => line.at >= frame.from && line.at <= frame.to)) {
        straight(pen, x(at), TOP, x(at), bottom, palette.text, [6, 3]);
        pen.text(name, x(at) + 4, bottom - 8, palette.text);
    }
}

/**
 * @param {import('./pens.js').Pen} pen
 * @param {import('./frame.js').Frame} frame
 * @param {Picture} picture
 * @param {import('./frame.js').Lane} lane
 * @param {number} top
 * @param {number} high
 */
function paintLane(pen, frame, { width, curves, palette, level }, lane, top, high) {
    const wide = width - LEFT - RIGHT;
    const y = (/** @type {number} */ value) => top + high - ((value - lane.low) / (lane.high - lane.low)) * high;
    for (const value of multiples(lane.low, lane.high, lane.step)) {
        straight(pen, LEFT, y(value), LEFT + wide, y(value), palette.grid);
        pen.text(rounded(value, lane.step), LEFT - 6, y(value), palette.text, 'end');
    }
    pen.within(LEFT, top - 1, wide, high + 2, () => {
        for (const curve of lane.curves) {
            const factor = 10 ** curves[curve].decimals;
            paintCurve(pen, frame, curve, wide, (value) => y(value / factor), palette.curves[curve]);
        }
        if (level && lane.curves.includes(level.curve)) {
            straight(pen, LEFT, y(level.level), LEFT + wide, y(level.level), palette.text, [2, 4]);
        }
    });
    for (const curve of lane.curves) {
        const factor = 10 ** curves[curve].decimals;
        paintMarkers(pen, frame, curve, wide, (value) => y(value / factor), palette, top, high);
    }
    const unit = lane.unit === '' ? 'no unit' : lane.unit;
    // Readable over any curve.
    pen.begin();
    pen.move(LEFT + 2, top + 1);
    pen.line(LEFT + 6 + unit.length * LETTER, top + 1);
    pen.line(LEFT + 6 + unit.length * LETTER, top + 16);
    pen.line(LEFT + 2, top + 16);
    pen.close();
    pen.fill(palette.back);
    pen.text(unit, LEFT + 4, top + 8, palette.text);
}

/**
 * @param {import('./pens.js').Pen} pen
 * @param {number} x1
 * @param {number} y1
 * @param {number} x2
 * @param {number} y2
 * @param {string} colour
 * @param {number[]} dash
 */
function straight(pen, x1, y1, x2, y2, colour, dash = []) {
    pen.begin();
    pen.move(x1, y1);
    pen.line(x2, y2);
    pen.stroke(colour, 1, dash);
}

/**
 * @param {import('./pens.js').Pen} pen
 * @param {import('./frame.js').Frame} frame
 * @param {number} curve
 * @param {number} wide
 * @param {(value: number) => number} y
 * @param {string} colour
 */
function paintCurve(pen, frame, curve, wide, y, colour) {
    const { edges, least, greatest, columns, from, to } = frame;
    const beyond = (/** @type {number} */ at) => LEFT + ((at - from) / (to - from)) * wide;
    const offset = curve * COLUMNS;
    /** Where the line has come to, unless it is interrupted. @type {number | undefined} */
    let last;
    pen.begin();
    const before = frame.before[curve];
    if (before) {
        last = y(before.value);
        pen.move(beyond(before.at), last);
    }
    for (let column = 0; column < columns; column += 1) {
        const [low, high] = [least[offset + column], greatest[offset + column]];
        if (low > high) {
            // A column without a row is passed over; one whose values are missing interrupts the line.
            last = edges[column + 1] > edges[column] ? undefined : last;
            continue;
        }
        const x = LEFT + ((column + 0.5) * wide) / columns;
        const [upper, lower] = [y(high), y(low)];
        const down = last === undefined || Math.abs(last - upper) <= Math.abs(last - lower);
        const [first, second] = down ? [upper, lower] : [lower, upper];
        if (last === undefined) {
            // A single value is seen, too.
            pen.move(x - 1, first);
        }
        pen.line(x, first);
        if (second !== first) {
            pen.line(x, second);
        }
        last = second;
    }
    const after = frame.after[curve];
    if (after && last !== undefined) {
        pen.line(beyond(after.at), y(after.value));
    }
    pen.stroke(colour, 1.5);
}

/**
 * Markers stand at round times, so that they go with the curve, and those of two curves beside each other.
 * @param {import('./pens.js').Pen} pen
 * @param {import('./frame.js').Frame} frame
 * @param {number} curve
 * @param {number} wide
 * @param {(value: number) => number} y
 * @param {Palette} palette
 * @param {number} top
 * @param {number} high
 */
function paintMarkers(pen, frame, curve, wide, y, palette, top, high) {
    const { least, greatest, columns, from, to } = frame;
    const step = (to - from) / MARKERS;
    const shift = (curve * step) / palette.curves.length;
    const reach = Math.ceil(columns / MARKERS / 2);
    for (let at = Math.ceil((from - shift) / step) * step + shift; at <= to; at += step) {
        const start = Math.floor(((at - from) / (to - from)) * columns);
        for (let column = start; column < Math.min(start + reach, columns); column += 1) {
            const [low, most] = [least[curve * COLUMNS + column], greatest[curve * COLUMNS + column]];
            const place = y((low + most) / 2);
            if (low <= most) {
                if (place >= top && place <= top + high) {
                    marker(pen, curve, LEFT + ((column + 0.5) * wide) / columns, place, palette.curves[curve], palette.back);
                }
                break;
            }
        }
    }
}
