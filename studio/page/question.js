// Questions that have to be answered before something is lost.

import { at, button, make } from './dom.js';

/**
 * Asks the user. True if what was asked about is to be done.
 * @param {string} title
 * @param {string[]} lines what is lost or changed
 * @param {string} confirm the words of the button that does it
 * @returns {Promise<boolean>}
 */
export function question(title, lines, confirm) {
    return new Promise((resolve) => {
        const heading = make('h2', { text: title, id: 'question-title' });
        const dialog = make('dialog', { 'aria-labelledby': 'question-title' }, heading, ...lines.map((text) => make('p', { text })));
        const done = () => dialog.close('done');
        const cancel = button('Cancel', () => dialog.close(''));
        // The rest of the page cannot be reached meanwhile, but STOP has to be. What was asked about is not done after it.
        const stop = button('STOP', () => (dialog.close(''), at('stop').click()), { class: 'stop' });
        dialog.append(make('div', { class: 'row' }, cancel, button(confirm, done), stop));
        dialog.addEventListener('close', () => {
            dialog.remove();
            resolve(dialog.returnValue === 'done');
        });
        at('dialogs').append(dialog);
        dialog.showModal();
        cancel.focus();
    });
}
