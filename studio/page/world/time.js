// The time of a virtual module: held, stepped, hurried, and let go until something is the case.

import { button, make, press, write } from '../dom.js';

/** How much slower than it is to time goes before that is told. */
const SLOW = 0.95;
/** How far time is behind the clock before that is told, in milliseconds. */
const BEHIND = 500;

/** The controls of time. */
export class Time {
    /** @param {(line: string) => void} carryOut */
    constructor(carryOut) {
        this.paused = false;
        this.pause = button('Pause time', () => carryOut(this.paused ? 'resume' : 'pause'), { 'aria-pressed': 'false' });
        this.step = make('input', { type: 'text', value: '20 ms', size: '6', 'aria-label': 'Length of a step' });
        this.speed = make('input', { type: 'text', value: '1', size: '4', 'aria-label': 'Speed of time' });
        this.condition = make('input', { type: 'text', value: 'velocity = 0', size: '18', 'aria-label': 'Condition' });
        this.longest = make('input', { type: 'text', value: '10 s', size: '5', 'aria-label': 'Longest time' });
        this.now = make('p', { role: 'status', 'aria-live': 'off', 'aria-label': 'Virtual time' });
        const actions = [
            [this.step, button('Step time', () => carryOut(`step ${this.step.value.trim()}`))],
            [this.speed, button('Set speed', () => carryOut(`speed ${this.speed.value.trim()}`))],
        ];
        const until = () => carryOut(`run-until ${this.condition.value.trim()} max ${this.longest.value.trim()}`);
        this.element = make(
            'div',
            { class: 'row' },
            this.pause,
            ...actions.flat(),
            this.condition,
            ' at most ',
            this.longest,
            button('Run until', until),
            button('Interrupt', () => carryOut('interrupt')),
            button('Restart', () => carryOut('restart')),
            this.now,
        );
    }

    /** @param {import('../types.js').WorldSeen} seen */
    show({ row, paused, busy, factor, wanted, behind }) {
        this.paused = paused;
        press(this.pause, paused);
        const isSlow = !paused && wanted !== null && factor < SLOW * wanted;
        const how = busy ? 'goes as fast as it can, until what was asked for has come: "Interrupt" ends that' : paused ? 'paused' : isSlow ? `slow: it goes at ${factor} of the clock` : 'goes';
        // A page that is hidden, or a computer that sleeps: nothing of that is made up for.
        const late = paused || behind < BEHIND ? '' : `, ${(behind / 1000).toFixed(1)} s behind the clock`;
        write(this.now, `${(row.at / 1000).toFixed(3)} s, ${how}${late}`);
    }
}
