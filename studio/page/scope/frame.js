// What is seen in one frame: for each pixel column the least and the greatest value of each curve, and the scale of each unit.

import { CURVES } from './rings.js';
import { around, roundStep } from './scale.js';

/** Most pixel columns; a wider plot has columns of more than one pixel. */
export const COLUMNS = 2048;
/** Height of a step of a scale, in pixels, about. */
const STEP = 30;

/** @typedef {{ name: string, unit: string, decimals: number, note: string }} Curve */
/** @typedef {{ unit: string, low: number, high: number }} Scale a scale that does not depend on the values */
/** @typedef {{ unit: string, curves: number[], low: number, high: number, step: number }} Lane the part of the plot for a unit */
/** @typedef {{ at: number, value: number } | undefined} Neighbour a value beyond the edge, to which the line goes */

/** A frame, whose buffers are used again for the next one. */
export class Frame {
    constructor() {
        /** The first row of each column, and the one after the last. */
        this.edges = new Float64Array(COLUMNS + 1);
        this.least = new Int32Array(CURVES * COLUMNS);
        this.greatest = new Int32Array(CURVES * COLUMNS);
        this.columns = 0;
        this.from = 0;
        this.to = 0;
        /** @type {Neighbour[]} */
        this.before = [];
        /** @type {Neighbour[]} */
        this.after = [];
        /** @type {Lane[]} */
        this.lanes = [];
    }

    /** The size of all buffers. */
    get bytes() {
        return this.edges.byteLength + this.least.byteLength + this.greatest.byteLength;
    }

    /**
     * Looks at the rows of a span of time.
     * @param {import('./rings.js').Rings} rings
     * @param {{ from: number, to: number }} span
     * @param {number} columns
     * @param {number[]} shown the numbers of the curves
     */
    look(rings, { from, to }, columns, shown) {
        Object.assign(this, { from, to, columns });
        let row = rings.rowAt(from);
        for (let column = 0; column < columns; column += 1) {
            row = rings.rowAt(from + (column * (to - from)) / columns, row);
            this.edges[column] = row;
        }
        // A row at the very end belongs to the last column.
        row = rings.rowAfter(to, row);
        this.edges[columns] = row;
        this.before = [];
        this.after = [];
        const sparse = row - this.edges[0] < columns;
        for (const curve of shown) {
            rings.extremes(curve, this.edges, columns, this.least, this.greatest, curve * COLUMNS);
            if (sparse) {
                this.before[curve] = neighbour(rings, curve, this.edges[0] - 1);
                this.after[curve] = neighbour(rings, curve, row);
            }
        }
    }

    /**
     * Finds the scales: one of each unit.
     * @param {Curve[]} curves
     * @param {number[]} shown
     * @param {Scale[]} fixed
     * @param {number} height of all lanes together
     */
    scale(curves, shown, fixed, height) {
        const units = [...new Set(shown.map((curve) => curves[curve].unit))];
        const steps = Math.max(2, height / Math.max(units.length, 1) / STEP);
        this.lanes = units.map((unit) => {
            const members = shown.filter((curve) => curves[curve].unit === unit);
            const known = fixed.find((scale) => scale.unit === unit);
            if (known) {
                return { ...known, curves: members, step: roundStep((known.high - known.low) / steps) };
            }
            let least = Infinity;
            let greatest = -Infinity;
            let grain = Infinity;
            for (const curve of members) {
                const factor = 10 ** curves[curve].decimals;
                grain = Math.min(grain, 1 / factor);
                const end = curve * COLUMNS + this.columns;
                for (let at = curve * COLUMNS; at < end; at += 1) {
                    if (this.least[at] <= this.greatest[at]) {
                        least = Math.min(least, this.least[at] / factor);
                        greatest = Math.max(greatest, this.greatest[at] / factor);
                    }
                }
            }
            const limits = least <= greatest ? around(least, greatest, steps, grain) : { low: 0, high: 1, step: 0.5 };
            return { unit, curves: members, ...limits };
        });
    }
}

/**
 * A row beyond the edge.
 * @param {import('./rings.js').Rings} rings
 * @param {number} curve
 * @param {number} row
 * @returns {Neighbour}
 */
function neighbour(rings, curve, row) {
    if (row < rings.first || row >= rings.next) {
        return undefined;
    }
    const value = rings.value(curve, row);
    return value === undefined ? undefined : { at: rings.time(row), value };
}
