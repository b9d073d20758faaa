// What is seen, as a file of its own.

import { entry } from './legend.js';
import { paint } from './paint.js';
import { svgPen } from './pens.js';

/** Height of a line of the legend. */
const LINE = 18;

/**
 * The picture of a frame as SVG, with a legend below.
 * @param {import('./frame.js').Frame} frame
 * @param {import('./paint.js').Picture} picture
 * @param {number[]} shown
 */
export function svg(frame, picture, shown) {
    const { width, height, curves, palette } = picture;
    const pen = svgPen(width, height + shown.length * LINE + 6, palette.back, 'Scope');
    paint(pen, frame, picture);
    shown.forEach((curve, index) => {
        const y = height + (index + 0.5) * LINE;
        const { name, unit } = curves[curve];
        entry(pen, curve, 8, y, palette);
        pen.text(unit === '' ? name : `${name} (${unit})`, 46, y, palette.text);
    });
    return pen.end();
}
