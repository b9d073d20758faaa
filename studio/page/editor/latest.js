// Questions of which only the last one counts.

/**
 * A service that is asked one question at a time. Of those that wait only the last one is asked.
 * @template {any[]} Q
 * @template A
 */
export class Latest {
    /** @type {(...question: Q) => Promise<A>} */
    #service;
    /** @type {Promise<A> | undefined} */
    #asked;
    #last = 0;

    /** @param {(...question: Q) => Promise<A>} service */
    constructor(service) {
        this.#service = service;
    }

    /**
     * Gives the answer, or undefined if another question has come meanwhile, or the answer is not wanted any more.
     * @param {Q} question
     * @returns {Promise<A | undefined>}
     */
    async ask(...question) {
        this.#last += 1;
        const number = this.#last;
        while (this.#asked) {
            await this.#asked.catch(() => undefined);
        }
        if (number !== this.#last) {
            return undefined;
        }
        this.#asked = this.#service(...question);
        try {
            const answer = await this.#asked;
            return number === this.#last ? answer : undefined;
        } catch (error) {
            if (number !== this.#last) {
                return undefined;
            }
            throw error;
        } finally {
            this.#asked = undefined;
        }
    }

    /** Whether an answer is waited for. */
    get isAsked() {
        return this.#asked !== undefined;
    }

    /** What has been asked is not wanted any more. */
    drop() {
        this.#last += 1;
    }
}
