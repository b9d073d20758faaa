// The last rows of all curves, in rings that are allocated once. Beside the values stand the least and the greatest one of each
// block of 4, 8, 16 ... rows, so that a pixel column with any number of rows is drawn with a look at four values at most.

/** Most curves. */
export const CURVES = 12;
/** Most rows: ten minutes at 1000 a second. */
export const ROWS = 600_000;

// The arithmetic, in bytes:
//   values         12 * 600 000 * 4                          28 800 000
//   blocks         12 * 2 * 4 * (600 000 / 2 + some 30)      28 803 000  (600 000 / 4 + 600 000 / 8 + ... is half of 600 000)
//   times          600 000 * 8                                4 800 000
//   missing        600 000 * 2                                1 200 000  (a bit for each curve)
//   frame.js       2048 * (12 * 2 * 4 + 8)                      213 000
//                                                            63 816 000  of 64 000 000

/** The smallest blocks have 2 ** FIRST rows; fewer are looked at one by one. */
const FIRST = 2;
/** The largest ones have more rows than the rings. */
const LAST = 20;
const LEAST = -0x8000_0000;
const GREATEST = 0x7fff_ffff;

/** Rows have numbers from 0 on, of which the rings have those from `first` to before `next`. */
export class Rings {
    constructor() {
        /** How many rows there are before the blocks of a level in the blocks of a curve, and how many blocks it has.
         * @type {{ size: number, start: number, count: number }[]} */
        this.levels = [];
        let start = 0;
        for (let level = FIRST; level <= LAST; level += 1) {
            const size = 2 ** level;
            // One more, because rows of a block that is about to be overwritten may still be seen.
            const count = Math.ceil(ROWS / size) + 1;
            this.levels.push({ size, start, count });
            start += count;
        }
        this.blocks = start;
        this.values = new Int32Array(CURVES * ROWS);
        this.least = new Int32Array(CURVES * this.blocks);
        this.greatest = new Int32Array(CURVES * this.blocks);
        this.times = new Float64Array(ROWS);
        this.missing = new Uint16Array(ROWS);
        /** How many values have been looked at so far. */
        this.looked = 0;
        /** How often the rings have begun anew: what is in the midst of reading them sees by it that they are others. */
        this.begun = 0;
        this.next = 0;
        /** @type {number[]} */
        this.factors = [];
    }

    /** The size of all buffers. */
    get bytes() {
        const all = [this.values, this.least, this.greatest, this.times, this.missing];
        return all.reduce((sum, { byteLength }) => sum + byteLength, 0);
    }

    /** The first row that is still there. */
    get first() {
        return Math.max(0, this.next - ROWS);
    }

    /** The time of the first row, or 0 if there is none. */
    get oldest() {
        return this.next > 0 ? this.time(this.first) : 0;
    }

    /** The time of the last row, or 0 if there is none. */
    get newest() {
        return this.next > 0 ? this.time(this.next - 1) : 0;
    }

    /**
     * Begins anew.
     * @param {number[]} decimals of each curve
     */
    begin(decimals) {
        this.begun += 1;
        this.next = 0;
        this.factors = decimals.map((count) => 10 ** count);
    }

    /**
     * Goes on with the rows of some curves, and with further curves that have no values yet.
     * @param {number[]} kept the numbers of those that go on, in their order; they have the numbers from 0 on then
     * @param {number[]} decimals of all curves from now on
     */
    keep(kept, decimals) {
        this.begun += 1;
        kept.forEach((from, to) => {
            if (from !== to) {
                this.values.copyWithin(to * ROWS, from * ROWS, (from + 1) * ROWS);
                this.least.copyWithin(to * this.blocks, from * this.blocks, (from + 1) * this.blocks);
                this.greatest.copyWithin(to * this.blocks, from * this.blocks, (from + 1) * this.blocks);
            }
        });
        const [fresh, end] = [kept.length * this.blocks, decimals.length * this.blocks];
        this.least.fill(GREATEST, fresh, end);
        this.greatest.fill(LEAST, fresh, end);
        const none = (1 << decimals.length) - (1 << kept.length);
        for (let slot = 0; slot < Math.min(this.next, ROWS); slot += 1) {
            const before = this.missing[slot];
            this.missing[slot] = kept.reduce((bits, from, to) => bits | (((before >> from) & 1) << to), none);
        }
        this.factors = decimals.map((count) => 10 ** count);
    }

    /**
     * Adds a row. A value that does not fit is taken for a missing one.
     * @param {number} at not before the row before
     * @param {(number | null)[]} values
     */
    push(at, values) {
        const slot = this.next % ROWS;
        this.times[slot] = at;
        let missing = 0;
        for (let curve = 0; curve < this.factors.length; curve += 1) {
            const given = values[curve] ?? NaN;
            const value = Math.round(given * this.factors[curve]);
            const there = value >= LEAST && value <= GREATEST;
            if (there) {
                this.values[curve * ROWS + slot] = value;
            } else {
                missing |= 1 << curve;
            }
            this.#widen(curve, value, there);
        }
        this.missing[slot] = missing;
        this.next += 1;
    }

    /**
     * Widens the blocks in which the next row is.
     * @param {number} curve
     * @param {number} value
     * @param {boolean} there
     */
    #widen(curve, value, there) {
        const row = this.next;
        for (const { size, start, count } of this.levels) {
            const at = curve * this.blocks + start + (Math.floor(row / size) % count);
            if (row % size === 0) {
                // A block without any value has its limits the wrong way round.
                this.least[at] = there ? value : GREATEST;
                this.greatest[at] = there ? value : LEAST;
                continue;
            }
            // A larger block has the rows of this one: if this one need not be widened, that need not either.
            if (!there || (value >= this.least[at] && value <= this.greatest[at])) {
                break;
            }
            this.least[at] = Math.min(this.least[at], value);
            this.greatest[at] = Math.max(this.greatest[at], value);
        }
    }

    /** @param {number} row */
    time(row) {
        return this.times[row % ROWS];
    }

    /**
     * The value of a curve, as a whole number of its last decimal.
     * @param {number} curve
     * @param {number} row
     * @returns {number | undefined}
     */
    value(curve, row) {
        const slot = row % ROWS;
        this.looked += 1;
        return (this.missing[slot] >> curve) & 1 ? undefined : this.values[curve * ROWS + slot];
    }

    /**
     * The first row that is not before a time, or the one after the last.
     * @param {number} time
     * @param {number} low a row from which on it is looked for
     */
    rowAt(time, low = this.first) {
        let high = this.next;
        while (low < high) {
            const middle = Math.floor((low + high) / 2);
            if (this.time(middle) < time) {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        return low;
    }

    /**
     * The first row that is after a time, or the one after the last.
     * @param {number} time
     * @param {number} low a row from which on it is looked for
     */
    rowAfter(time, low = this.first) {
        let row = this.rowAt(time, low);
        for (; row < this.next && this.time(row) === time; row += 1);
        return row;
    }

    /**
     * The row that is nearest to a time, if there is any.
     * @param {number} time
     */
    nearest(time) {
        const after = this.rowAt(time);
        if (after > this.first && (after === this.next || time - this.time(after - 1) <= this.time(after) - time)) {
            return after - 1;
        }
        return after < this.next ? after : undefined;
    }

    /**
     * The least and the greatest value of a curve in each pixel column; where there is none, the greatest is the smaller one.
     *
     * A column with more than four rows takes one or two whole blocks of about its own size. No row is left out: what a column
     * leaves over, the next one takes. So a value may stand one column late, or a few where the rows become fewer.
     * @param {number} curve
     * @param {Float64Array} edges the first row of each column, and the one after the last
     * @param {number} columns
     * @param {Int32Array} least
     * @param {Int32Array} greatest
     * @param {number} offset where the first column goes
     */
    extremes(curve, edges, columns, least, greatest, offset) {
        let row = edges[0];
        for (let column = 0; column < columns; column += 1) {
            const end = edges[column + 1];
            let low = GREATEST;
            let high = LEAST;
            if (end - row <= 4) {
                for (; row < end; row += 1) {
                    const value = this.value(curve, row);
                    if (value !== undefined) {
                        low = Math.min(low, value);
                        high = Math.max(high, value);
                    }
                }
            } else {
                // After the last column nothing is taken over, so that takes the block that is not whole, too.
                const round = column + 1 === columns ? Math.ceil : Math.floor;
                let index = Math.max(31 - Math.clz32(end - edges[column]) - FIRST, 0);
                while (round(end / this.levels[index].size) - Math.floor(row / this.levels[index].size) > 2) {
                    index += 1;
                }
                const { size, start, count: ring } = this.levels[index];
                const until = round(end / size);
                for (let block = Math.floor(row / size); block < until; block += 1) {
                    const at = curve * this.blocks + start + (block % ring);
                    low = Math.min(low, this.least[at]);
                    high = Math.max(high, this.greatest[at]);
                    this.looked += 2;
                }
                row = until * size;
            }
            least[offset + column] = low;
            greatest[offset + column] = high;
        }
    }
}
