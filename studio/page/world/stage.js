// A motor and its stage, drawn to scale: the rotor with a hand, and the way with its ends and switches.

import { attribute } from '../dom.js';

/** @typedef {import('../types.js').WorldStage} WorldStage */

const SPACE = 'http://www.w3.org/2000/svg';
/** The drawing, in its own units: the rotor's centre and radius; the way from left to right, and its height. */
const ROTOR = { x: 40, y: 40, radius: 32 };
const WAY = { left: 96, right: 392, y: 40 };
/** How many turns a way is long whose end nothing is known of, beyond what is. */
const BEYOND = 1;

/**
 * Makes an element of a drawing.
 * @param {string} tag
 * @param {Record<string, string | number>} attributes
 * @param {(Node | string)[]} children
 */
function draw(tag, attributes, ...children) {
    const made = document.createElementNS(SPACE, tag);
    Object.entries(attributes).forEach(([name, value]) => made.setAttribute(name, String(value)));
    made.append(...children);
    return made;
}

/** The drawing of an axis. */
export class Stage {
    /**
     * @param {WorldStage} stage
     * @param {string} name
     */
    constructor(stage, name) {
        this.stage = stage;
        /** @type {[number, number]} */
        this.span = this.#span(0);
        const { x, y, radius } = ROTOR;
        this.hand = draw('line', { x1: x, y1: y, x2: x, y2: y - radius + 4, class: 'world-hand' });
        this.carriage = draw('rect', { x: -5, y: WAY.y - 14, width: 10, height: 28, class: 'world-carriage' });
        this.way = draw('g', {});
        this.element = draw(
            'svg',
            { viewBox: '0 0 400 80', role: 'img', 'aria-label': name, class: 'world-stage' },
            draw('circle', { cx: x, cy: y, r: radius, class: 'world-rotor' }),
            this.hand,
            this.way,
            this.carriage,
        );
        this.#drawWay();
        this.show(0, []);
    }

    /**
     * From where to where the way is drawn: between its ends, or as far as switches and the rotor are.
     * @param {number} rotor
     * @returns {[number, number]}
     */
    #span(rotor) {
        const { circle, lowest, highest, zones, turn } = this.stage;
        if (circle !== null) {
            return [0, circle];
        }
        const known = [rotor, ...zones.flatMap(({ from, to }) => [from, to])].filter((at) => at !== null);
        return [lowest ?? Math.min(...known) - BEYOND * turn, highest ?? Math.max(...known) + BEYOND * turn];
    }

    /** @param {number} at a position */
    #x(at) {
        const [low, high] = this.span;
        const share = Math.min(1, Math.max(0, (at - low) / (high - low)));
        return WAY.left + share * (WAY.right - WAY.left);
    }

    #drawWay() {
        const { zones, lowest, highest } = this.stage;
        const [low, high] = this.span;
        const { y } = WAY;
        const line = draw('line', { x1: WAY.left, x2: WAY.right, y1: y, y2: y, class: 'world-way' });
        /** @type {{ name: string, part: Element }[]} */
        this.zones = zones.map(({ name, from, to }) => {
            const [left, right] = [this.#x(from ?? low), this.#x(to ?? high)];
            const width = Math.max(3, right - left);
            return { name, part: draw('rect', { x: left, y: y + 16, width, height: 8, class: 'world-zone' }) };
        });
        const names = this.zones.map(({ name, part }) => {
            const middle = Number(part.getAttribute('x')) + Number(part.getAttribute('width')) / 2;
            return draw('text', { x: middle, y: y + 36, class: 'world-name' }, name);
        });
        const ends = [lowest, highest].flatMap((at) => {
            const x = this.#x(at ?? 0);
            return at === null ? [] : [draw('line', { x1: x, x2: x, y1: y - 20, y2: y + 14, class: 'world-end' })];
        });
        this.way.replaceChildren(line, ...this.zones.map(({ part }) => part), ...names, ...ends);
    }

    /**
     * Shows where the rotor is, and which switches are closed.
     * @param {number} rotor
     * @param {string[]} closed the names of their switches
     */
    show(rotor, closed) {
        const { turn, circle } = this.stage;
        const [low, high] = this.span;
        if (circle === null && (rotor < low || rotor > high)) {
            this.span = this.#span(rotor);
            this.#drawWay();
        }
        const angle = ((rotor % turn) / turn) * 360;
        attribute(this.hand, 'transform', `rotate(${angle.toFixed(1)} ${ROTOR.x} ${ROTOR.y})`);
        const at = circle === null ? rotor : ((rotor % circle) + circle) % circle;
        attribute(this.carriage, 'transform', `translate(${this.#x(at).toFixed(1)} 0)`);
        this.zones?.forEach(({ name, part }) => part.classList.toggle('world-closed', closed.includes(name)));
    }
}
