// Two pens for the same picture: one for a canvas, one that writes SVG.

/** Height of letters, in pixels. */
const LETTERS = 12;
/** Most lines of a path on a canvas: one of several thousand that cross each other takes many times as long as its parts do. */
const PIECE = 64;

/**
 * What draws. Coordinates are in CSS pixels. A path begins with `begin`, and is drawn by `stroke` or `fill`.
 * @typedef {object} Pen
 * @property {() => void} begin
 * @property {(x: number, y: number) => void} move
 * @property {(x: number, y: number) => void} line
 * @property {(x: number, y: number, radius: number) => void} circle
 * @property {() => void} close
 * @property {(colour: string, width: number, dash?: number[]) => void} stroke
 * @property {(colour: string) => void} fill
 * @property {(words: string, x: number, y: number, colour: string, align?: 'start' | 'middle' | 'end') => void} text
 * @property {(x: number, y: number, width: number, height: number, draw: () => void) => void} within what is in a rectangle
 */

/**
 * A pen for a canvas.
 * @param {CanvasRenderingContext2D} context
 * @param {number} width
 * @param {number} height
 * @param {number} ratio pixels of the device for one of CSS
 * @param {string} back
 * @returns {Pen}
 */
export function canvasPen(context, width, height, ratio, back) {
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = back;
    context.fillRect(0, 0, width, height);
    context.font = `${LETTERS}px system-ui, sans-serif`;
    context.textBaseline = 'middle';
    context.lineJoin = 'bevel';
    let pieces = [new Path2D()];
    let lines = 0;
    const last = () => pieces[pieces.length - 1];
    return {
        begin: () => {
            pieces = [new Path2D()];
            lines = 0;
        },
        move: (x, y) => last().moveTo(x, y),
        line: (x, y) => {
            last().lineTo(x, y);
            lines += 1;
            if (lines % PIECE === 0) {
                pieces.push(new Path2D());
                last().moveTo(x, y);
            }
        },
        circle: (x, y, radius) => {
            last().moveTo(x + radius, y);
            last().arc(x, y, radius, 0, 2 * Math.PI);
        },
        close: () => last().closePath(),
        stroke: (colour, lineWidth, dash = []) => {
            context.strokeStyle = colour;
            context.lineWidth = lineWidth;
            context.setLineDash(dash);
            pieces.forEach((piece) => context.stroke(piece));
        },
        fill: (colour) => {
            context.fillStyle = colour;
            pieces.forEach((piece) => context.fill(piece));
        },
        text: (words, x, y, colour, align = 'start') => {
            context.fillStyle = colour;
            context.textAlign = align === 'middle' ? 'center' : align;
            context.fillText(words, x, y);
        },
        within: (x, y, w, h, draw) => {
            context.save();
            context.beginPath();
            context.rect(x, y, w, h);
            context.clip();
            draw();
            context.restore();
        },
    };
}

/**
 * Text for XML. It has no place for most control characters, nor for halves of a character.
 * @param {string} text
 */
function escaped(text) {
    const allowed = text.replace(/[^\t\n\r\u{20}-\u{d7ff}\u{e000}-\u{fffd}\u{10000}-\u{10ffff}]/gu, '\ufffd');
    return allowed.replace(/[&<>"]/g, (character) => `&#${character.charCodeAt(0)};`);
}

/** @param {number} value */
const short = (value) => String(Math.round(value * 100) / 100);

/**
 * A pen that writes SVG, and gives the text of it in the end.
 * @param {number} width
 * @param {number} height
 * @param {string} back
 * @param {string} title
 * @returns {Pen & { end: () => string }}
 */
export function svgPen(width, height, back, title) {
    const parts = [
        `<svg xmlns="http://www.w3.org/2000/svg" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}" ` +
            `font-family="sans-serif" font-size="${LETTERS}">`,
        `<title>${escaped(title)}</title>`,
        `<rect width="${width}" height="${height}" fill="${escaped(back)}"/>`,
    ];
    /** @type {string[]} */
    let path = [];
    const joined = () => path.join('');
    return {
        begin: () => (path = []),
        move: (x, y) => path.push(`M${short(x)} ${short(y)}`),
        line: (x, y) => path.push(`L${short(x)} ${short(y)}`),
        circle: (x, y, radius) => {
            const r = short(radius);
            const half = (/** @type {number} */ to) => `A${r} ${r} 0 0 1 ${short(to)} ${short(y)}`;
            path.push(`M${short(x + radius)} ${short(y)}${half(x - radius)}${half(x + radius)}`);
        },
        close: () => path.push('Z'),
        stroke: (colour, lineWidth, dash = []) => {
            const dashed = dash.length > 0 ? ` stroke-dasharray="${dash.join(' ')}"` : '';
            const stroke = `stroke="${escaped(colour)}" stroke-width="${lineWidth}" stroke-linejoin="round"${dashed}`;
            parts.push(`<path d="${joined()}" fill="none" ${stroke}/>`);
        },
        fill: (colour) => parts.push(`<path d="${joined()}" fill="${escaped(colour)}"/>`),
        text: (words, x, y, colour, align = 'start') => {
            // The middle of the letters, as on a canvas, for readers that do not know dominant-baseline.
            const place = `x="${short(x)}" y="${short(y + LETTERS / 3)}" text-anchor="${align}"`;
            parts.push(`<text ${place} fill="${escaped(colour)}">${escaped(words)}</text>`);
        },
        within: (x, y, w, h, draw) => {
            const [left, top, wide, high] = [x, y, w, h].map(short);
            // What is in an svg of its own does not show outside of that.
            const box = `x="${left}" y="${top}" width="${wide}" height="${high}" viewBox="${left} ${top} ${wide} ${high}"`;
            parts.push(`<svg ${box} overflow="hidden">`);
            draw();
            parts.push('</svg>');
        },
        end: () => [...parts, '</svg>\n'].join('\n'),
    };
}
