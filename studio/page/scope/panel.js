// The scope: curves over time. Where the rows come from it does not ask.

import { csv } from './csv.js';
import { Cursors, NAMES } from './cursors.js';
import { write } from '../dom.js';
import { scaleForm, triggerForm } from './forms.js';
import { COLUMNS, Frame } from './frame.js';
import { listen } from './gestures.js';
import { wrong } from './kept.js';
import { Legend } from './legend.js';
import { LEFT, lanesHeight, paint, RIGHT } from './paint.js';
import { canvasPen } from './pens.js';
import { svg } from './picture.js';
import { CURVES, Rings } from './rings.js';
import { Trigger } from './trigger.js';
import { View } from './view.js';
import { Widgets } from './widgets.js';

/** @typedef {import('./frame.js').Curve} Curve */
/** @typedef {import('./kept.js').Kept} Kept */
/** @typedef {{ at: number, values: (number | null)[] }} Row */

/**
 * What a scope asks of the page.
 * @typedef {object} Hooks
 * @property {(name: string, text: string, type: string) => void} download
 * @property {(text: string) => void} announce
 * @property {() => void} [changed] what `state` gives is something else now
 */

/** The least height of the plot, and of the part for one unit, in pixels. */
const HEIGHT = 280;
const LANE = 90;
/** What may change how the plot looks. */
const LOOKS = ['(prefers-color-scheme: dark)', '(forced-colors: active)'];

/**
 * Which curves go on: all that are first now and were there before, in their order.
 * @param {Curve[]} before
 * @param {Curve[]} now
 */
function goingOn(before, now) {
    const same = (/** @type {Curve} */ one, /** @type {Curve} */ other) =>
        one.name === other.name && one.unit === other.unit && one.decimals === other.decimals;
    const kept = [];
    for (const curve of now) {
        const from = before.findIndex((other) => same(curve, other));
        if (from <= (kept.at(-1) ?? -1)) {
            break;
        }
        kept.push(from);
    }
    return kept;
}

/** The panel of the scope. */
export class ScopePanel {
    /**
     * @param {HTMLElement} root an empty section
     * @param {Hooks} hooks
     */
    constructor(root, hooks) {
        this.hooks = hooks;
        this.rings = new Rings();
        this.frame = new Frame();
        this.view = new View();
        this.trigger = new Trigger();
        this.cursors = new Cursors(this.rings, this.view, () => this.#change());
        this.legend = new Legend((curve) => this.#toggle(curve));
        /** @type {Curve[]} */
        this.curves = [];
        /** Names of the curves that are not shown.
         * @type {Set<string>} */
        this.hidden = new Set();
        /** @type {import('./frame.js').Scale[]} */
        this.scales = [];
        /** What is wrong with what was kept, which is told as long as there is nothing else to tell. */
        this.complaint = '';
        this.missed = 0;
        this.writing = false;
        this.asked = false;
        this.frames = 0;
        this.looked = 0;
        /** @type {import('./paint.js').Palette | undefined} */
        this.palette = undefined;
        this.triggerForm = triggerForm(this.trigger, () => this.#arm());
        this.scaleForm = scaleForm((scale) => this.#scale(scale));
        const presses = {
            resize: (/** @type {number} */ window) => this.#resize(window),
            pause: () => this.#pause(),
            live: () => this.#live(),
            pan: (/** @type {number} */ by) => this.#pan(by),
            zoom: (/** @type {number} */ factor) => this.#zoom(factor),
            cursor: (/** @type {number} */ cursor) => this.cursors.toggle(cursor),
            csv: (/** @type {boolean} */ all) => void this.#csv(all),
            svg: () => this.#svg(),
        };
        const parts = [this.legend.element, this.triggerForm.element, this.scaleForm.element, this.cursors.table];
        this.widgets = new Widgets(root, presses, this.cursors.handles, parts);
        this.plot = this.widgets.plot;
        this.#watch();
        this.columns([]);
    }

    #watch() {
        listen(this.plot, this.cursors.handles, () => ({ left: LEFT, wide: this.#wide() }), {
            pan: (by) => this.#pan(by),
            zoom: (factor, place) => this.#zoom(factor, place),
            click: (place) => this.cursors.put(this.#time(place)),
            drag: (cursor, place) => this.cursors.move(cursor, this.#time(place)),
            pause: () => (this.view.mode === 'paused' ? this.#live() : this.#pause()),
            live: () => this.#live(),
            begin: () => this.#pan(-Infinity),
        });
        new ResizeObserver(() => this.#change()).observe(this.plot);
        // The pixels of the device may be others, too.
        window.addEventListener('resize', () => this.#relook());
        LOOKS.forEach((query) => matchMedia(query).addEventListener('change', () => this.#relook()));
        const still = matchMedia('(prefers-reduced-motion: reduce)');
        const step = () => {
            this.view.stepped = still.matches;
            this.view.follow(this.rings.oldest, this.rings.newest);
            this.#change();
        };
        still.addEventListener('change', step);
        step();
    }

    /**
     * Begins anew with these curves.
     * @param {Curve[]} list
     */
    columns(list) {
        const before = this.curves;
        this.curves = list.slice(0, CURVES);
        this.#say(list.length > CURVES ? `only the first ${CURVES} of ${list.length} curves are shown` : '');
        const kept = goingOn(before, this.curves);
        if (this.rings.next > 0 && kept.length > 0) {
            this.rings.keep(kept, this.curves.map(({ decimals }) => decimals));
            this.cursors.begin(this.curves, true);
            this.trigger.arm(this.curves);
            this.legend.begin(this.curves);
            this.#relook();
            this.#settle();
            return;
        }
        this.#begin();
    }

    /** The curves begin without a row. */
    #begin() {
        this.rings.begin(this.curves.map(({ decimals }) => decimals));
        this.missed = 0;
        write(this.widgets.lost, '');
        this.view.oldest = 0;
        this.view.newest = 0;
        this.view.live();
        this.trigger.arm(this.curves);
        this.cursors.begin(this.curves);
        this.legend.begin(this.curves);
        this.#relook();
        this.#settle();
    }

    /**
     * Takes rows.
     * @param {Row[]} list
     */
    rows(list) {
        const { rings, view } = this;
        let news = view.mode === 'live';
        for (const { at, values } of list) {
            if (rings.next > 0 && at < rings.newest) {
                this.#begin();
                this.#say('the time of the module has begun anew, and so have the curves');
            }
            rings.push(at, values);
            this.#trigger(at, values);
            news ||= at <= view.to;
        }
        // What a view that stands still shows may just have been overwritten.
        news ||= rings.first > 0 && rings.oldest > view.from;
        view.follow(rings.oldest, rings.newest);
        if (news) {
            this.#change();
        }
    }

    /**
     * Shows how many rows come.
     * @param {string} words
     */
    rate(words) {
        write(this.widgets.rate, words);
    }

    /**
     * Tells of rows that are missing, in addition to those it has told of before.
     * @param {number} count
     */
    lost(count) {
        this.missed += count;
        write(this.widgets.lost, this.missed === 0 ? '' : `${this.missed} ${this.missed === 1 ? 'row is' : 'rows are'} missing`);
    }

    /**
     * What is to be kept.
     * @returns {Kept}
     */
    state() {
        return structuredClone({
            window: this.view.window,
            scales: this.scales,
            trigger: this.trigger.settings,
            hidden: [...this.hidden],
        });
    }

    /**
     * Takes what was kept, if it is right, and else tells what is wrong with it.
     * @param {unknown} state
     */
    restore(state) {
        const what = wrong(state);
        this.complaint = what;
        this.#say('');
        if (what !== '') {
            return what;
        }
        const kept = structuredClone(/** @type {Kept} */ (state));
        this.view.resize(kept.window);
        this.scales = kept.scales;
        this.trigger.settings = kept.trigger;
        this.trigger.arm(this.curves);
        this.hidden = new Set(kept.hidden);
        this.#settle();
        return '';
    }

    /** What is counted: values looked at for the last frame, its columns and curves; frames so far; bytes of buffers. */
    figures() {
        const { looked, frames, frame, rings } = this;
        return { looked, columns: frame.columns, curves: this.#shown().length, frames, bytes: rings.bytes + frame.bytes };
    }

    /** Curves, scales or settings are others. */
    #settle() {
        this.legend.show(this.curves.map(({ name }) => !this.hidden.has(name)));
        this.triggerForm.fill(this.curves.map(({ name }) => name));
        const units = [...new Set(this.curves.map(({ unit }) => unit))];
        this.scaleForm.fill(units, this.scales, (unit) => {
            const lane = this.frame.lanes.find((one) => one.unit === unit);
            return lane && { unit, low: lane.low, high: lane.high };
        });
        this.#change();
    }

    /** What is kept is something else. */
    #keep() {
        this.#change();
        this.hooks.changed?.();
    }

    /** @param {string} words */
    #say(words) {
        write(this.widgets.message, words === '' ? this.complaint : words);
    }

    /** The numbers of the curves that are seen. */
    #shown() {
        return this.curves.flatMap(({ name }, curve) => (this.hidden.has(name) ? [] : [curve]));
    }

    #wide() {
        return Math.max(this.plot.clientWidth - LEFT - RIGHT, 1);
    }

    /** @param {number} place */
    #time(place) {
        return this.view.from + place * this.view.window;
    }

    /** @param {number} curve */
    #toggle(curve) {
        const { name } = this.curves[curve];
        if (!this.hidden.delete(name)) {
            this.hidden.add(name);
        }
        this.legend.show(this.curves.map((one) => !this.hidden.has(one.name)));
        this.#keep();
    }

    /** @param {import('./frame.js').Scale | string} scale */
    #scale(scale) {
        const unit = typeof scale === 'string' ? scale : scale.unit;
        this.scales = this.scales.filter((one) => one.unit !== unit).concat(typeof scale === 'string' ? [] : [scale]);
        this.#keep();
    }

    #arm() {
        this.trigger.arm(this.curves);
        this.view.live();
        this.#keep();
    }

    /**
     * @param {number} at
     * @param {(number | null)[]} values
     */
    #trigger(at, values) {
        const { trigger, view } = this;
        if (trigger.curve < 0) {
            return;
        }
        // A view that the trigger has put is filled before the next one; one that the user has stopped stays.
        const may = view.mode === 'live' || (view.mode === 'held' && at > view.to);
        if (trigger.take(at, values[trigger.curve] ?? null, may)) {
            view.hold(at);
            if (trigger.settings.single) {
                view.pause();
                this.hooks.announce(`Trigger: ${trigger.words(true)}`);
            }
            this.#change();
        }
    }

    #pause() {
        this.view.pause();
        this.#change();
    }

    #live() {
        this.view.live();
        this.#change();
    }

    /** @param {number} by as a part of the view */
    #pan(by) {
        this.view.pan(by * this.view.window);
        this.#change();
    }

    /**
     * @param {number} factor
     * @param {number | undefined} place
     */
    #zoom(factor, place = undefined) {
        this.#resize(this.view.window * factor, place);
    }

    /**
     * @param {number} window
     * @param {number | undefined} place
     */
    #resize(window, place = undefined) {
        this.view.resize(window, place);
        this.#keep();
    }

    /** @param {boolean} all */
    async #csv(all) {
        const { rings, view } = this;
        if (this.writing) {
            return;
        }
        this.writing = true;
        this.#say('');
        const [from, to] = all ? [rings.first, rings.next] : [rings.rowAt(view.from), rings.rowAfter(view.to)];
        const text = await csv(rings, this.curves, from, to);
        this.writing = false;
        if (text === undefined) {
            this.#say('the curves have begun anew, and the CSV was not written');
        } else {
            this.hooks.download('scope.csv', text, 'text/csv');
        }
    }

    #svg() {
        // What waits to be drawn belongs to it.
        this.#draw();
        this.hooks.download('scope.svg', svg(this.frame, this.#picture(), this.#shown()), 'image/svg+xml');
    }

    /** @returns {import('./paint.js').Picture} */
    #picture() {
        const { curves, cursors, trigger, hidden } = this;
        const { settings, fired } = trigger;
        const lines = cursors.times.map((at, index) => ({ at: at ?? NaN, name: NAMES[index] }));
        const off = trigger.curve < 0 || hidden.has(settings.curve);
        const level = off ? undefined : { curve: trigger.curve, level: settings.level };
        return {
            width: this.plot.clientWidth,
            height: this.plot.clientHeight,
            curves,
            palette: (this.palette ??= this.#colours()),
            lines: fired === undefined ? lines : [...lines, { at: fired, name: 'T' }],
            level,
        };
    }

    /** The colours, which the style sheet has. The samples of the legend get them, too. */
    #colours() {
        const { color, borderTopColor, backgroundColor } = getComputedStyle(this.plot);
        const palette = { text: color, grid: borderTopColor, back: backgroundColor, curves: this.legend.colours() };
        this.legend.draw(palette, devicePixelRatio);
        return palette;
    }

    /** Colours or pixels are others. */
    #relook() {
        this.palette = undefined;
        this.#change();
    }

    /** Something is to be drawn. A hidden page is not asked to, and draws it when it is seen. */
    #change() {
        if (!this.asked) {
            this.asked = true;
            requestAnimationFrame(() => this.#draw());
        }
    }

    #draw() {
        this.asked = false;
        const { view, frame, rings, plot } = this;
        const { canvas } = this.widgets;
        const shown = this.#shown();
        const units = new Set(shown.map((curve) => this.curves[curve].unit));
        plot.style.height = `${Math.max(HEIGHT, units.size * LANE)}px`;
        const gone = rings.first > 0 && view.oldest > view.to;
        this.widgets.show(view, gone, this.cursors.times.map((time) => time !== undefined));
        this.triggerForm.tell(this.trigger.words(view.mode === 'paused'));
        const { clientWidth: width, clientHeight: height } = plot;
        if (width <= LEFT + RIGHT) {
            // In a tab that is not shown: it is drawn when it has a size again.
            return;
        }
        const [wide, high] = [width, height].map((length) => Math.round(length * devicePixelRatio));
        if (canvas.width !== wide || canvas.height !== high) {
            canvas.width = wide;
            canvas.height = high;
        }
        const columns = Math.min(COLUMNS, Math.round(this.#wide() * devicePixelRatio));
        const before = rings.looked;
        frame.look(rings, view, columns, shown);
        frame.scale(this.curves, shown, this.scales, lanesHeight(height));
        this.looked = rings.looked - before;
        this.frames += 1;
        this.cursors.columns = columns;
        this.cursors.place(LEFT, this.#wide());
        const context = canvas.getContext('2d');
        if (context) {
            const picture = this.#picture();
            paint(canvasPen(context, width, height, devicePixelRatio, picture.palette.back), frame, picture);
        }
    }
}
