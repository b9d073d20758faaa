// Questions to a worker and their answers: each has a number.

/** Somebody who is asked by messages. */
export class Port {
    /**
     * @param {{ postMessage: (message: any) => void }} end
     * @param {(told: any) => void} tell takes what is told without being asked
     */
    constructor(end, tell) {
        this.end = end;
        this.tell = tell;
        this.last = 0;
        /** @type {Map<number, { resolve: (value: any) => void, reject: (error: Error) => void, hear?: (told: any) => void }>} */
        this.asked = new Map();
    }

    /**
     * Asks, and gives the number of the question with its answer.
     * @param {object} message
     * @param {((told: any) => void) | undefined} hear takes what is told of it meanwhile
     * @returns {{ id: number, answer: Promise<any> }}
     */
    ask(message, hear = undefined) {
        this.last += 1;
        const id = this.last;
        const answer = new Promise((resolve, reject) => this.asked.set(id, { resolve, reject, hear }));
        this.end.postMessage({ id, ...message });
        return { id, answer };
    }

    /** @param {any} data a message */
    take({ id, told, ...rest }) {
        if (told !== undefined) {
            this.tell(told);
            return;
        }
        const asked = this.asked.get(id);
        if (!asked) {
            return;
        }
        if ('ok' in rest) {
            this.asked.delete(id);
            asked.resolve(rest.ok);
        } else if ('error' in rest || 'interrupted' in rest || 'dead' in rest) {
            this.asked.delete(id);
            asked.reject(new Error(rest.error ?? rest.dead ?? (rest.interrupted || 'ended')));
            if ('dead' in rest) {
                this.tell({ dead: rest.dead });
            }
        } else {
            asked.hear?.(rest);
        }
    }

    /**
     * Nobody answers any more.
     * @param {string} why
     */
    endAll(why) {
        this.asked.forEach(({ reject }) => reject(new Error(why)));
        this.asked.clear();
    }
}
