// A shape for each curve, so that colour alone does not tell curves apart.

const R = 4.5;

/** @param {[number, number][]} corners */
const polygon = (corners) => (/** @type {import('./pens.js').Pen} */ pen, /** @type {number} */ x, /** @type {number} */ y) => {
    corners.forEach(([dx, dy], index) => (index === 0 ? pen.move(x + R * dx, y + R * dy) : pen.line(x + R * dx, y + R * dy)));
    pen.close();
};

/** @param {[number, number, number, number][]} strokes */
const strokes = (strokes) => (/** @type {import('./pens.js').Pen} */ pen, /** @type {number} */ x, /** @type {number} */ y) => {
    strokes.forEach(([x1, y1, x2, y2]) => {
        pen.move(x + R * x1, y + R * y1);
        pen.line(x + R * x2, y + R * y2);
    });
};

/** The first ones: filled.
 * @type {((pen: import('./pens.js').Pen, x: number, y: number) => void)[]} */
const AREAS = [
    (pen, x, y) => pen.circle(x, y, R),
    polygon([[-0.9, -0.9], [0.9, -0.9], [0.9, 0.9], [-0.9, 0.9]]),
    polygon([[0, -1.1], [1.1, 0.9], [-1.1, 0.9]]),
    polygon([[0, -1.3], [1, 0], [0, 1.3], [-1, 0]]),
    polygon([[0, 1.1], [1.1, -0.9], [-1.1, -0.9]]),
];
/** The last two, after the areas and the same ones once more, but empty. */
const LINES = [strokes([[-1, -1, 1, 1], [-1, 1, 1, -1]]), strokes([[-1.2, 0, 1.2, 0], [0, -1.2, 0, 1.2]])];

/**
 * Draws the marker of a curve.
 * @param {import('./pens.js').Pen} pen
 * @param {number} curve
 * @param {number} x
 * @param {number} y
 * @param {string} colour
 * @param {string} back
 */
export function marker(pen, curve, x, y, colour, back) {
    pen.begin();
    if (curve >= 2 * AREAS.length) {
        LINES[(curve - 2 * AREAS.length) % LINES.length](pen, x, y);
        pen.stroke(colour, 2.5);
        return;
    }
    AREAS[curve % AREAS.length](pen, x, y);
    pen.fill(curve < AREAS.length ? colour : back);
    pen.stroke(colour, 1.5);
}
