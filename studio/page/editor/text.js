// The lines of a text, and where they go when it is edited.

/** A text with its lines. */
export class Lines {
    /** @param {string} text */
    constructor(text) {
        this.text = text;
        /** Where each line starts. */
        this.starts = [0];
        for (let end = text.indexOf('\n'); end !== -1; end = text.indexOf('\n', end + 1)) {
            this.starts.push(end + 1);
        }
    }

    get count() {
        return this.starts.length;
    }

    /**
     * The end of a line, without what ends it.
     * @param {number} line
     */
    end(line) {
        return line + 1 < this.count ? this.starts[line + 1] - 1 : this.text.length;
    }

    /** @param {number} line */
    line(line) {
        return this.text.slice(this.starts[line], this.end(line));
    }

    /**
     * The line of an offset.
     * @param {number} offset
     */
    at(offset) {
        let low = 0;
        let high = this.count - 1;
        while (low < high) {
            const middle = (low + high + 1) >> 1;
            if (this.starts[middle] <= offset) {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        return low;
    }

    /**
     * The offset of a place, or of the next one that there is.
     * @param {number} line
     * @param {number} column
     */
    offset(line, column) {
        const known = Math.min(Math.max(line, 0), this.count - 1);
        return Math.min(this.starts[known] + Math.max(column, 0), this.end(known));
    }
}

/** How one text became another one: by something else in the place of one part of it. */
export class Change {
    /**
     * @param {Lines} before
     * @param {Lines} after
     * @param {number} caret the end of the new part, which tells a new line from equal ones around it, if it is that
     */
    constructor(before, after, caret) {
        this.before = before;
        this.after = after;
        const [old, text] = [before.text, after.text];
        const most = Math.min(old.length, text.length);
        let tail = text.length - caret;
        if (!old.endsWith(text.slice(caret))) {
            tail = 0;
            while (tail < most && old.charCodeAt(old.length - 1 - tail) === text.charCodeAt(text.length - 1 - tail)) {
                tail += 1;
            }
        }
        let start = 0;
        while (start < most - tail && old.charCodeAt(start) === text.charCodeAt(start)) {
            start += 1;
        }
        this.start = start;
        this.end = old.length - tail;
        this.newEnd = text.length - tail;
        /** The first line that is not as before, and how many are in the place of how many. */
        this.first = before.at(start);
        this.removed = before.at(this.end) - this.first + 1;
        this.added = after.at(this.newEnd) - this.first + 1;
    }

    /**
     * Where an offset is now; null if what stood there is gone.
     * @param {number} offset
     */
    offset(offset) {
        if (offset < this.start) {
            return offset;
        }
        return offset >= this.end ? offset + this.newEnd - this.end : null;
    }

    /**
     * Where a line is now, which is where its first word is; null if it is gone.
     * @param {number} line
     */
    line(line) {
        if (line < this.first) {
            return line;
        }
        if (line >= this.first + this.removed) {
            return line + this.added - this.removed;
        }
        const indent = /** @type {RegExpExecArray} */ (/^\s*/.exec(this.before.line(line)))[0].length;
        const offset = this.offset(this.before.starts[line] + indent);
        if (offset === null) {
            return this.added === this.removed ? line : null;
        }
        return this.after.at(offset);
    }

    /**
     * What is known of each line, with nothing known of the lines that are not as before.
     * @template T
     * @param {(T | undefined)[]} known
     * @returns {(T | undefined)[]}
     */
    lines(known) {
        const added = new Array(this.added).fill(undefined);
        return known.slice(0, this.first).concat(added, known.slice(this.first + this.removed));
    }
}
