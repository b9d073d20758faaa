// The list of what can stand at the caret. The focus stays in the text area, which tells what is chosen.

import { make, write } from '../dom.js';

let lists = 0;

/** A list at the caret. */
export class Completion {
    /** @type {import('./types.js').Item[]} */
    #items = [];
    /** What is chosen; none is before somebody has asked for one, so that Enter is still Enter. */
    #active = -1;

    /**
     * @param {HTMLTextAreaElement} area
     * @param {(text: string) => void} pick
     */
    constructor(area, pick) {
        this.area = area;
        this.pick = pick;
        lists += 1;
        this.list = make('ul', { class: 'editor-list', id: `editor-list-${lists}`, role: 'listbox', 'aria-label': 'Completions' });
        this.list.hidden = true;
        // The focus is not to leave the text area.
        this.list.onpointerdown = (event) => event.preventDefault();
        this.list.onmousedown = (event) => event.preventDefault();
    }

    get isOpen() {
        return !this.list.hidden;
    }

    /** Whether one of them is chosen. */
    get isChosen() {
        return this.#active !== -1;
    }

    /**
     * Opens the list, or shows others in it.
     * @param {import('./types.js').Item[]} items
     * @param {boolean} choose whether the first one is chosen
     */
    open(items, choose) {
        this.#choose(-1);
        this.#items = items;
        while (this.list.childElementCount < items.length) {
            this.#add();
        }
        for (const [index, option] of [...this.list.children].entries()) {
            const item = items[index];
            /** @type {HTMLElement} */ (option).hidden = !item;
            write(option.children[0], item?.text ?? '');
            write(option.children[1], item?.note ?? '');
        }
        this.list.hidden = false;
        this.list.scrollTop = 0;
        this.area.setAttribute('aria-controls', this.list.id);
        this.#choose(choose ? 0 : -1);
    }

    #add() {
        const index = this.list.childElementCount;
        const option = make('li', { class: 'editor-option', id: `${this.list.id}-${index}`, role: 'option', 'aria-selected': 'false' });
        option.append(make('span', { class: 'editor-option-text' }), ' ', make('span', { class: 'editor-option-note' }));
        option.onclick = () => this.pick(this.#items[index].text);
        this.list.append(option);
    }

    /**
     * Puts it below a place in the text area, or above it in the lower half.
     * @param {number} left
     * @param {number} top
     * @param {number} lineHeight
     */
    place(left, top, lineHeight) {
        const { list, area } = this;
        const isBelow = top < area.clientHeight / 2;
        list.style.left = `${Math.max(Math.min(left, area.clientWidth - list.offsetWidth), 0)}px`;
        list.style.top = isBelow ? `${top + lineHeight}px` : 'auto';
        list.style.bottom = isBelow ? 'auto' : `${area.offsetHeight - top}px`;
    }

    close() {
        this.list.hidden = true;
        this.area.removeAttribute('aria-controls');
        this.#choose(-1);
    }

    /** @param {number} index */
    #choose(index) {
        const { children } = this.list;
        children[this.#active]?.setAttribute('aria-selected', 'false');
        this.#active = index;
        const option = children[index];
        if (option) {
            option.setAttribute('aria-selected', 'true');
            option.scrollIntoView({ block: 'nearest' });
            this.area.setAttribute('aria-activedescendant', option.id);
        } else {
            this.area.removeAttribute('aria-activedescendant');
        }
    }

    /**
     * Takes a key if it is one of an open list.
     * @param {string} key
     */
    press(key) {
        if (!this.isOpen) {
            return false;
        }
        const step = { ArrowDown: 1, ArrowUp: -1 }[key];
        if (step !== undefined) {
            const count = this.#items.length;
            this.#choose(this.#active === -1 && step === -1 ? count - 1 : (this.#active + step + count) % count);
            return true;
        }
        if (key === 'Enter' && this.#active !== -1) {
            this.pick(this.#items[this.#active].text);
            return true;
        }
        if (key === 'Escape' || key === 'Enter') {
            this.close();
        }
        return false;
    }
}
