// The forms for the trigger and for the scales.

import { button, labelled, make, write } from '../dom.js';
import { rightScale } from './kept.js';

/**
 * The form of the trigger.
 * @param {import('./trigger.js').Trigger} trigger
 * @param {() => void} changed the settings are others, or it is to be armed again
 */
export function triggerForm(trigger, changed) {
    const curve = make('select');
    const edge = make('select', {}, new Option('rising', 'rising'), new Option('falling', 'falling'));
    const level = make('input', { type: 'number', step: 'any', required: true });
    const single = make('input', { type: 'checkbox' });
    const state = make('span', { class: 'scope-trigger-state' });
    const element = make(
        'details',
        { class: 'scope-trigger' },
        make('summary', {}, 'Trigger: ', state),
        make(
            'div',
            { class: 'row' },
            labelled('Trigger curve', curve),
            labelled('Edge', edge),
            labelled('Level', level),
            make('label', {}, single, ' Single'),
            button('Arm', changed),
        ),
    );
    element.onchange = () => {
        const { settings } = trigger;
        // A level that is no number is not taken, and is marked as wrong by the browser.
        level.reportValidity();
        const given = level.checkValidity() ? level.valueAsNumber : settings.level;
        const way = edge.value === 'falling' ? 'falling' : 'rising';
        trigger.settings = { curve: curve.value, edge: way, level: given, single: single.checked };
        changed();
    };
    return {
        element,
        /** Shows the settings.
         * @param {string[]} names of the curves */
        fill(names) {
            const { settings } = trigger;
            // One that is not there now may come again.
            const more = settings.curve === '' || names.includes(settings.curve) ? [] : [settings.curve];
            curve.replaceChildren(new Option('off', ''), ...[...names, ...more].map((name) => new Option(name, name)));
            curve.value = settings.curve;
            edge.value = settings.edge;
            level.valueAsNumber = settings.level;
            single.checked = settings.single;
        },
        /** @param {string} words */
        tell: (words) => write(state, words),
    };
}

/**
 * The form of the scales.
 * @param {(scale: { unit: string, low: number, high: number } | string) => void} changed a scale, or the unit of one that is
 *     automatic again
 */
export function scaleForm(changed) {
    const list = make('div');
    const element = make('details', { class: 'scope-scales' }, make('summary', { text: 'Scales' }), list);

    /**
     * @param {string} unit
     * @param {import('./frame.js').Scale | undefined} fixed
     * @param {(unit: string) => import('./frame.js').Scale | undefined} seen
     */
    const line = (unit, fixed, seen) => {
        const automatic = make('input', { type: 'checkbox', checked: fixed === undefined });
        const ends = ['Lowest', 'Highest'].map((name) => {
            return { name, input: make('input', { type: 'number', step: 'any', required: true }) };
        });
        const [low, high] = ends.map(({ input }) => input);
        const set = (/** @type {import('./frame.js').Scale | undefined} */ scale) => {
            ends.forEach(({ input }) => (input.disabled = scale === undefined));
            low.value = scale === undefined ? '' : String(scale.low);
            high.value = scale === undefined ? '' : String(scale.high);
        };
        set(fixed);
        automatic.onchange = () => {
            const scale = automatic.checked ? undefined : (seen(unit) ?? { unit, low: 0, high: 1 });
            set(scale);
            changed(scale ?? unit);
        };
        const limit = () => {
            const scale = { unit, low: low.valueAsNumber, high: high.valueAsNumber };
            high.setCustomValidity(low.checkValidity() && !rightScale(scale) ? 'The highest value must be above the lowest.' : '');
            if (rightScale(scale)) {
                changed(scale);
            } else {
                high.reportValidity();
            }
        };
        low.onchange = limit;
        high.onchange = limit;
        return make(
            'fieldset',
            { class: 'row' },
            make('legend', { text: unit === '' ? 'no unit' : unit }),
            make('label', {}, automatic, ' Automatic'),
            ...ends.map(({ name, input }) => labelled(name, input)),
        );
    };

    return {
        element,
        /**
         * Shows the scales of these units.
         * @param {string[]} units
         * @param {import('./frame.js').Scale[]} fixed
         * @param {(unit: string) => import('./frame.js').Scale | undefined} seen what the scale of a unit is now
         */
        fill(units, fixed, seen) {
            list.replaceChildren(...units.map((unit) => line(unit, fixed.find((scale) => scale.unit === unit), seen)));
        },
    };
}
