// Jobs of the tools, each with a line of its own: it waits, goes on, and can be ended.

import { button, make, words } from '../dom.js';

/** Most lines of jobs that are over. */
const MOST = 50;

/** The list of jobs. */
export class Jobs {
    /**
     * @param {HTMLElement} list
     * @param {import('../session.js').Session} session
     */
    constructor(list, session) {
        this.list = list;
        this.session = session;
    }

    /**
     * Gives the tools a job.
     * @param {string} name
     * @param {string} door
     * @param {object} asked
     * @returns {Promise<any>} what it gives
     */
    async run(name, door, asked) {
        const text = make('span', { text: name });
        const { id, answer } = this.session.job(door, asked, (told) => {
            if (told.waits) {
                text.textContent = `${name}: waits until the job before it is over`;
            } else if (told.begun) {
                text.textContent = `${name}: under way`;
            } else if (told.progress) {
                text.textContent = `${name}: ${told.progress.done} of ${told.progress.total}`;
            }
        });
        const end = button('End', () => this.session.end(id), { 'aria-label': `End: ${name}` });
        const item = make('li', {}, text, ' ', end);
        this.list.append(item);
        while (this.list.childElementCount > MOST) {
            this.list.firstElementChild?.remove();
        }
        try {
            const given = await answer;
            text.textContent = `${name}: done`;
            return given;
        } catch (error) {
            // Where it has several lines, whoever asked for the job shows them.
            text.textContent = `${name}: ${words(error).split('\n', 1)[0]}`;
            item.classList.add('wrong');
            throw error;
        } finally {
            end.remove();
        }
    }
}
