// Values of a module that are read again and again, for those who watch them. Each watcher gets rows of its curves.

/** @typedef {import('./types.js').Curve} Curve */
/** @typedef {import('./types.js').SampleRow} SampleRow */

/** Time between two rows of values that are only shown, in milliseconds. */
const SHOWN = 200;
/** How many times as long as reading them took such values rest, so that the scope has most of a slow link. */
const RESTS = 9;
/** Time between two readings of a virtual module by telegrams: each makes its time pass a little. */
const ASKED = 50;
/** Time between two portions of rows for the page. */
const PORTION = 100;
/** Time over which the rate of rows is taken. */
const RATE = 1000;

/** @param {number} milliseconds */
const sleep = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Somebody who watches curves. */
class Watcher {
    /**
     * @param {number} id
     * @param {Curve[]} curves
     * @param {boolean} every whether each row that can be had is wanted
     */
    constructor(id, curves, every) {
        this.id = id;
        this.curves = curves;
        this.every = every;
        this.open = true;
        /** @type {SampleRow[]} */
        this.rows = [];
        /** Values that only telegrams read, as they were last. */
        /** @type {(number | null)[]} */
        this.held = curves.map(() => null);
        this.counted = 0;
        this.since = performance.now();
    }
}

/** Reads values of a link. */
export class Sampler {
    /**
     * @param {import('./link.js').Link} link
     * @param {(told: any) => void} tell
     */
    constructor(link, tell) {
        this.link = link;
        this.tell = tell;
        /** @type {Map<number, Watcher>} */
        this.watchers = new Map();
    }

    /**
     * Reads curves from now on. Nobody else is watched by the same number any more.
     * @param {{ id: number, curves: Curve[], every: boolean }} wanted
     */
    watch({ id, curves, every }) {
        this.unwatch(id);
        const watcher = new Watcher(id, curves, every);
        this.watchers.set(id, watcher);
        const { source } = this.link;
        if (!source.look) {
            void this.#ask(watcher);
            return;
        }
        if (every) {
            source.watch?.(curves.map(({ text }) => text), (rows) => this.#add(watcher, rows));
        } else {
            void this.#look(watcher);
        }
        void this.#askVirtual(watcher);
    }

    /** @param {number} id */
    unwatch(id) {
        const watcher = this.watchers.get(id);
        if (watcher) {
            watcher.open = false;
            this.watchers.delete(id);
            if (watcher.every) {
                this.link.source.watch?.([], () => undefined);
            }
        }
    }

    /** Nobody watches any more. */
    end() {
        [...this.watchers.keys()].forEach((id) => this.unwatch(id));
    }

    /**
     * Reads all curves by telegrams, one row after the other.
     * @param {Watcher} watcher
     */
    async #ask(watcher) {
        let told = performance.now();
        while (watcher.open && this.link.open) {
            const at = performance.now();
            const values = [];
            for (const { request } of watcher.curves) {
                values.push(request && watcher.open ? await this.link.sample(request) : null);
            }
            if (!this.link.download && watcher.open) {
                watcher.rows.push({ at, values });
            }
            if (performance.now() - told >= PORTION) {
                told = performance.now();
                this.#portion(watcher);
            }
            // A link that takes no time, because nothing can be read now, leaves some to others.
            const took = performance.now() - at;
            await sleep(watcher.every ? Math.max(0, 1 - took) : Math.max(SHOWN, RESTS * took));
        }
    }

    /**
     * Looks at all curves of a virtual module.
     * @param {Watcher} watcher
     */
    async #look(watcher) {
        while (watcher.open && this.link.open) {
            const row = this.link.source.look?.(watcher.curves.map(({ text }) => text));
            if (row) {
                this.#add(watcher, [row]);
            }
            await sleep(SHOWN);
        }
    }

    /**
     * Reads those curves of a virtual module by telegrams that cannot be looked at, while its time goes by itself.
     * @param {Watcher} watcher
     */
    async #askVirtual(watcher) {
        const asked = watcher.curves.flatMap(({ request }, index) =>
            request && !this.#isLookedAt(watcher.curves[index]) ? [{ request, index }] : [],
        );
        while (asked.length > 0 && watcher.open && this.link.open) {
            for (const { request, index } of asked) {
                if (watcher.open && !this.link.source.paused && this.link.source.left == null) {
                    watcher.held[index] = await this.link.sample(request);
                }
            }
            await sleep(watcher.every ? ASKED : SHOWN);
        }
    }

    /**
     * Whether a virtual module shows a curve without a telegram.
     * @param {Curve} curve
     */
    #isLookedAt({ looked_at, in_memory }) {
        return looked_at && !(in_memory && this.link.source.runsImage);
    }

    /**
     * Adds rows that a virtual module has shown.
     * @param {Watcher} watcher
     * @param {SampleRow[]} rows
     */
    #add(watcher, rows) {
        for (const { at, values } of rows) {
            const whole = values.map((value, index) => (this.#isLookedAt(watcher.curves[index]) ? value : watcher.held[index]));
            watcher.rows.push({ at, values: whole });
        }
        this.#portion(watcher);
    }

    /** @param {Watcher} watcher */
    #portion(watcher) {
        const { rows, id } = watcher;
        if (rows.length === 0) {
            return;
        }
        watcher.rows = [];
        watcher.counted += rows.length;
        this.tell({ rows, watcher: id });
        const span = performance.now() - watcher.since;
        if (watcher.every && span >= RATE) {
            this.tell({ rate: (watcher.counted * 1000) / span, watcher: id });
            watcher.counted = 0;
            watcher.since = performance.now();
        }
    }
}
