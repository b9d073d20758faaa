// Mouse, touch and keys on the plot.

/** How far a pointer goes, in pixels, before it drags and does not click. */
const CLICK = 4;
/** A step of the keys and buttons, as a part of the view. */
export const STEP = 0.1;
/** How much longer the window becomes with a step of zooming out. */
export const ZOOM = 1.25;

/**
 * What is done. Places and distances are parts of the view: 0 is its left edge, 1 its right one.
 * @typedef {object} Actions
 * @property {(by: number) => void} pan
 * @property {(factor: number, place?: number) => void} zoom
 * @property {(place: number) => void} click
 * @property {(cursor: number, place: number) => void} drag
 * @property {() => void} pause
 * @property {() => void} live
 * @property {() => void} begin goes to the first rows
 */

/**
 * Listens to a plot.
 * @param {HTMLElement} plot
 * @param {HTMLElement[]} handles of the cursors
 * @param {() => { left: number, wide: number }} size where the view is in the plot, in pixels
 * @param {Actions} actions
 */
export function listen(plot, handles, size, actions) {
    /** Where the pointers are that are down. @type {Map<number, number>} */
    const pointers = new Map();
    let dragged = false;
    let cursor = -1;
    const place = (/** @type {number} */ x) => (x - plot.getBoundingClientRect().left - size().left) / size().wide;
    /** The middle of the pointers, and how far they are from each other. */
    const spread = () => {
        const all = [...pointers.values()];
        const [least, most] = [Math.min(...all), Math.max(...all)];
        return { middle: (least + most) / 2, wide: Math.max(most - least, 1) };
    };

    plot.addEventListener('pointerdown', (event) => {
        if (event.button !== 0 || pointers.size === 2) {
            return;
        }
        plot.setPointerCapture(event.pointerId);
        dragged = pointers.size > 0;
        pointers.set(event.pointerId, event.clientX);
        const target = /** @type {Node} */ (event.target);
        cursor = dragged ? -1 : handles.findIndex((handle) => handle.contains(target));
    });
    plot.addEventListener('pointermove', (event) => {
        const before = pointers.get(event.pointerId);
        if (before === undefined || (!dragged && Math.abs(event.clientX - before) < CLICK)) {
            return;
        }
        dragged = true;
        const old = spread();
        pointers.set(event.pointerId, event.clientX);
        if (cursor >= 0) {
            actions.drag(cursor, place(event.clientX));
            return;
        }
        const now = spread();
        if (pointers.size === 2) {
            actions.zoom(old.wide / now.wide, place(old.middle));
        }
        actions.pan((old.middle - now.middle) / size().wide);
    });
    /** @param {PointerEvent} event */
    const up = (event) => {
        const there = pointers.delete(event.pointerId);
        if (there && !dragged && cursor < 0 && event.type === 'pointerup') {
            actions.click(place(event.clientX));
        }
    };
    plot.addEventListener('pointerup', up);
    plot.addEventListener('pointercancel', up);

    plot.addEventListener(
        'wheel',
        (event) => {
            // Who only scrolls the page over it does not change the plot.
            if (!event.ctrlKey && !plot.contains(document.activeElement)) {
                return;
            }
            event.preventDefault();
            const sideways = event.shiftKey ? event.deltaY || event.deltaX : event.deltaX;
            if (event.shiftKey || Math.abs(event.deltaX) > Math.abs(event.deltaY)) {
                actions.pan(Math.sign(sideways) * STEP);
            } else if (event.deltaY !== 0) {
                actions.zoom(event.deltaY > 0 ? ZOOM : 1 / ZOOM, place(event.clientX));
            }
        },
        { passive: false },
    );

    plot.addEventListener('keydown', (event) => {
        /** @type {Record<string, () => void>} */
        const keys = {
            ArrowLeft: () => actions.pan(event.shiftKey ? -1 : -STEP),
            ArrowRight: () => actions.pan(event.shiftKey ? 1 : STEP),
            '+': () => actions.zoom(1 / ZOOM),
            '=': () => actions.zoom(1 / ZOOM),
            '-': () => actions.zoom(ZOOM),
            ' ': actions.pause,
            Home: actions.begin,
            End: actions.live,
        };
        if (Object.hasOwn(keys, event.key) && !event.ctrlKey && !event.altKey && !event.metaKey) {
            keys[event.key]();
            event.preventDefault();
        }
    });
}
