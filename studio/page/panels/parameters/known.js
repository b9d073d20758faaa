// What is known of the parameters of a module, and what was read first.

/** @typedef {import('../../types.js').ParameterPlace} ParameterPlace */
/** @typedef {import('../../types.js').ParameterSetting} ParameterSetting */

/** @param {ParameterPlace} place */
export const key = ({ bank, axis, number }) => `${bank}/${axis}/${number}`;

/** The values. */
export class Known {
    constructor() {
        /** @type {Map<string, ParameterSetting>} */
        this.values = new Map();
        /** @type {Map<string, number>} */
        this.opened = new Map();
    }

    /** They are those of a module that is there no more. */
    forget() {
        this.values.clear();
        this.opened.clear();
    }

    /**
     * Takes what the module has told.
     * @param {import('../../types.js').ParameterTold[]} told
     */
    learn(told) {
        for (const { place, value } of told) {
            if (value === null) {
                this.values.delete(key(place));
            } else {
                this.values.set(key(place), { place, value });
                this.opened.set(key(place), this.opened.get(key(place)) ?? value);
            }
        }
    }

    /** @param {ParameterPlace} place */
    value(place) {
        return this.values.get(key(place))?.value;
    }

    /** @param {ParameterPlace} place */
    first(place) {
        return this.opened.get(key(place));
    }

    /**
     * The values of an axis.
     * @param {number} axis
     */
    ofAxis(axis) {
        return [...this.values.values()].filter(({ place }) => place.bank === 'axis' && place.axis === axis);
    }

    /** Where the parameters are that are not as they were read first. */
    changed() {
        return [...this.values.values()].filter(({ place, value }) => this.first(place) !== value).map(({ place }) => place);
    }
}
