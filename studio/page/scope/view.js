// Which span of time is seen: the newest one, one that stands still, or one that a trigger has put.

/** The windows that can be chosen, in milliseconds; zooming gives any between the first and the last. */
export const WINDOWS = [1, 2, 5, 10, 20, 30, 60, 120, 300, 600].map((seconds) => 1000 * seconds);
const LEAST = WINDOWS[0];
const MOST = WINDOWS[WINDOWS.length - 1];
/** Where in the view the moment stands at which a trigger has fired. */
const FRACTION = 0.25;
/** How much of a view is left of the rows when it is panned away from them. */
const LEFT = 0.1;
/** The steps in which a view goes on where things are not to move, in milliseconds. */
const STEP = 250;

/** @param {number} window */
export const fits = (window) => window >= LEAST && window <= MOST;

/** The view: it follows the rows (`live`), stands still (`paused`), or stands where a trigger has put it last (`held`). */
export class View {
    constructor() {
        this.window = 10_000;
        this.to = 0;
        /** @type {'live' | 'paused' | 'held'} */
        this.mode = 'live';
        this.oldest = 0;
        this.newest = 0;
        /** Whether it goes on in steps. */
        this.stepped = false;
    }

    get from() {
        return this.to - this.window;
    }

    /** Rows have come, or there are none any more.
     * @param {number} oldest
     * @param {number} newest
     */
    follow(oldest, newest) {
        this.oldest = oldest;
        this.newest = newest;
        if (this.mode === 'live') {
            this.to = this.stepped ? Math.ceil(newest / STEP) * STEP : newest;
        }
    }

    live() {
        this.mode = 'live';
        this.follow(this.oldest, this.newest);
    }

    pause() {
        this.mode = 'paused';
    }

    /** A trigger has fired.
     * @param {number} at
     */
    hold(at) {
        this.mode = 'held';
        this.to = at + (1 - FRACTION) * this.window;
    }

    /**
     * Shows a shorter or a longer window. While the rows are followed, or a trigger has put the view, that stays as it is.
     * @param {number} window
     * @param {number} anchor which place stays where it is, from 0 (left) to 1 (right)
     */
    resize(window, anchor = 0.5) {
        const place = { live: 1, held: FRACTION, paused: anchor }[this.mode];
        const wanted = Math.min(Math.max(window, LEAST), MOST);
        this.to += (1 - place) * (wanted - this.window);
        this.window = wanted;
        this.follow(this.oldest, this.newest);
    }

    /**
     * Moves the view, which does not go on by itself then. Some rows stay in it.
     * @param {number} by in milliseconds
     */
    pan(by) {
        this.mode = 'paused';
        const least = this.oldest + LEFT * this.window;
        const most = this.newest + (1 - LEFT) * this.window;
        this.to = Math.min(Math.max(this.to + by, least), most);
    }
}
