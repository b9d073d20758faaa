// Scales: round limits and steps, and numbers as text.

/**
 * The smallest round step (1, 2 or 5 times a power of ten) that is not below another one.
 * @param {number} rough
 */
export function roundStep(rough) {
    const power = 10 ** Math.floor(Math.log10(rough));
    const factor = [1, 2, 5].find((one) => one * power >= rough) ?? 10;
    return factor * power;
}

/**
 * Round limits around values, and the step between the lines of the grid.
 * @param {number} least
 * @param {number} greatest
 * @param {number} count how many steps there may be, about
 * @param {number} grain the smallest difference of two values
 */
export function around(least, greatest, count, grain) {
    const flat = least === greatest ? grain : 0;
    const step = roundStep((greatest - least + 2 * flat) / count);
    return { low: Math.floor((least - flat) / step) * step, high: Math.ceil((greatest + flat) / step) * step, step };
}

/**
 * The multiples of a step between two limits.
 * @param {number} low
 * @param {number} high
 * @param {number} step
 */
export function multiples(low, high, step) {
    const first = Math.ceil(low / step - 1e-6);
    const count = Math.floor(high / step + 1e-6) - first + 1;
    // + 0 makes 0 of -0.
    return Array.from({ length: Math.max(count, 0) }, (_, index) => (first + index) * step + 0);
}

/**
 * A multiple of a step as text.
 * @param {number} value
 * @param {number} step
 */
export const rounded = (value, step) => value.toFixed(Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));

/**
 * A time as text.
 * @param {number} milliseconds
 */
export const seconds = (milliseconds) => `${(milliseconds / 1000).toFixed(3)} s`;

/**
 * A window as text.
 * @param {number} milliseconds
 */
export function span(milliseconds) {
    const whole = milliseconds / 1000;
    return whole >= 60 && whole % 60 === 0 ? `${whole / 60} min` : `${Number(whole.toPrecision(3))} s`;
}

/**
 * A value as text, with the decimals of its curve.
 * @param {number} value as a whole number of the last decimal
 * @param {number} decimals
 */
export const decimal = (value, decimals) => (value / 10 ** decimals).toFixed(decimals);
