// Elements of the page. Text never becomes HTML.

/**
 * Finds an element that the page has.
 * @template {HTMLElement} [T=HTMLElement]
 * @param {string} id
 * @returns {T}
 */
export const at = (id) => /** @type {T} */ (document.getElementById(id));

/**
 * Makes an element.
 * @template {keyof HTMLElementTagNameMap} T
 * @param {T} tag
 * @param {Record<string, string | boolean | EventListener>} attributes names of attributes; `text`, and `onclick` and its like
 * @param {(Node | string)[]} children
 * @returns {HTMLElementTagNameMap[T]}
 */
export function make(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
        if (typeof value === 'function') {
            made.addEventListener(name.slice(2), value);
        } else if (name === 'text') {
            made.textContent = String(value);
        } else if (typeof value === 'boolean') {
            made.toggleAttribute(name, value);
        } else {
            made.setAttribute(name, value);
        }
    }
    made.append(...children);
    return made;
}

/**
 * A button.
 * @param {string} text
 * @param {() => void} press
 * @param {Record<string, string | boolean>} attributes
 */
export const button = (text, press, attributes = {}) => make('button', { type: 'button', text, onclick: press, ...attributes });

/**
 * Puts words before a control, as its name.
 * @param {string} text
 * @param {HTMLElement} control
 */
export const labelled = (text, control) => make('label', {}, `${text} `, control);

/**
 * Sets an attribute; one that has this value already is left alone, so that the browser has nothing to look at anew.
 * @param {Element} element
 * @param {string} name
 * @param {string} value
 */
export function attribute(element, name, value) {
    if (element.getAttribute(name) !== value) {
        element.setAttribute(name, value);
    }
}

/**
 * Shows that a button is pressed, or that it is not.
 * @param {Element} element
 * @param {boolean} pressed
 */
export const press = (element, pressed) => attribute(element, 'aria-pressed', String(pressed));

/**
 * Shows the end of a list, in the box that has it.
 * @param {HTMLElement} list
 */
export function scrollToEnd(list) {
    const box = list.parentElement;
    if (box) {
        box.scrollTop = box.scrollHeight;
    }
}

/** @param {unknown} error */
export const words = (error) => (error instanceof Error ? error.message : String(error));

/**
 * Adds a line to a list that keeps no more than so many.
 * @param {HTMLElement} list
 * @param {string} text
 * @param {boolean} wrong
 * @param {number} most
 */
export function addLine(list, text, wrong = false, most = 500) {
    list.append(make('li', { text, class: wrong ? 'wrong' : '' }));
    while (list.childElementCount > most) {
        list.firstElementChild?.remove();
    }
    scrollToEnd(list);
}

/**
 * Writes into an element that has nothing but text; what has not changed is not painted anew. Nothing is ever removed here:
 * while somebody types, Chromium takes what is removed anywhere in the page for the end of what one undo undoes.
 * @param {Element} element
 * @param {string} text
 */
export function write(element, text) {
    const { firstChild } = element;
    if (!firstChild) {
        element.append(text);
    } else if (firstChild.nodeValue !== text) {
        firstChild.nodeValue = text;
    }
}
