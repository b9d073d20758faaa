// In which units values are shown, and what these need to be known.

import { make } from '../../dom.js';
import { UNITS, isSteps, isUnit } from './kept.js';

const NAMES = { module: 'Units of the module', physical: 'Turns and mA', own: 'A unit of my own' };

/** The choice of units. */
export class Units {
    /**
     * @param {import('./kept.js').Kept} kept
     * @param {() => void} changed
     */
    constructor(kept, changed) {
        this.kept = kept;
        this.changed = changed;
        this.axis = 0;
        const choices = UNITS.map((unit) => new Option(NAMES[/** @type {'own'} */ (unit)], unit));
        this.choice = make('select', { onchange: () => this.#choose() }, ...choices);
        const number = { type: 'number', onchange: () => this.#take() };
        this.steps = make('input', { ...number, min: '1', max: '65535', step: '1', placeholder: '200' });
        this.microsteps = make('input', { ...number, min: '0', step: 'any', placeholder: '12800' });
        const name = { type: 'text', maxlength: '20', size: '6', placeholder: 'mm', spellcheck: 'false' };
        this.name = make('input', { ...name, onchange: () => this.#take() });
        this.ofSteps = make('label', {}, 'Full steps per turn ', this.steps);
        this.ofName = make('label', {}, 'Name of the unit ', this.name);
        this.ofMicrosteps = make('label', {}, 'Microsteps for one ', this.microsteps);
        const label = make('label', {}, 'Shown in ', this.choice);
        this.element = make('div', { class: 'row' }, label, this.ofSteps, this.ofName, this.ofMicrosteps);
        this.show(0);
    }

    /**
     * Shows what is chosen for an axis.
     * @param {number} axis
     */
    show(axis) {
        this.axis = axis;
        const { units, own, steps } = this.kept;
        this.choice.value = units;
        this.ofSteps.hidden = units !== 'physical';
        this.ofName.hidden = units !== 'own';
        this.ofMicrosteps.hidden = units !== 'own';
        this.steps.value = String(steps[axis] ?? '');
        this.name.value = own[axis]?.name ?? '';
        this.microsteps.value = String(own[axis]?.microsteps ?? '');
    }

    #choose() {
        this.kept.units = this.choice.value;
        this.show(this.axis);
        this.changed();
    }

    #take() {
        const unit = { name: this.name.value.trim(), microsteps: Number(this.microsteps.value) };
        const steps = Number(this.steps.value);
        delete this.kept.own[this.axis];
        delete this.kept.steps[this.axis];
        if (isUnit(unit)) {
            this.kept.own[this.axis] = unit;
        }
        if (isSteps(steps)) {
            this.kept.steps[this.axis] = steps;
        }
        this.changed();
    }

    /** What is missing for the units that are chosen; empty if nothing is. */
    missing() {
        const isMissing = this.kept.units === 'own' && this.kept.own[this.axis] === undefined;
        return isMissing ? `give the unit of axis ${this.axis} a name, and the number of microsteps for one` : '';
    }

    /**
     * The units that are chosen.
     * @returns {import('../../types.js').ParameterUnits}
     */
    units() {
        const { units, own } = this.kept;
        if (units === 'own') {
            const unit = own[this.axis];
            return unit ? { own: unit } : 'module';
        }
        return units === 'physical' ? 'physical' : 'module';
    }
}
