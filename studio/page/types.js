// The types of what goes through the doors of the Rust (studio/src/types.rs): a test compares them.

/** @typedef {{ address: number, opcode: number, kind: number, motor: number, value: number }} Request */
/** @typedef {{ request: Request, timeout: number }} Exchange */
/** @typedef {{ reply: number[] } | { no_reply: number } | { others: { asked: number, answered: number[] } } | 'address' | { lost: string } | 'interrupted'} Outcome */
/** @typedef {{ product: string }} Start */
/** @typedef {{ line: string }} Line */
/** @typedef {{ ticket: number }} Ticket */
/** @typedef {{ replies: Finished[], lines: string[], messages: string[], nap: number }} Turn */
/** @typedef {{ ticket: number, outcome: Outcome }} Finished */
/** @typedef {{ bytes: number[] }} Bytes */
/** @typedef {{ outcome: Outcome | null }} Taken */
/** @typedef {{ address: number, product: string | null }} Axes */
/** @typedef {{ request: Request, product: string | null }} Moved */
/** @typedef {{ stops: Request[], download: Download }} Noted */
/** @typedef {'same' | 'over' | { begun: { end: Request, clear: Request[] } }} Download */
/** @typedef {{ requests: Request[] }} Requests */
/** @typedef {{ columns: Column[] }} Columns */
/** @typedef {{ name: string, unit: string, request: Request }} Column */
/** @typedef {{ request: Request, outcome: Outcome }} Read */
/** @typedef {{ value: number | null }} Value */
/** @typedef {{ values: (number | null)[] }} Values */
/** @typedef {{ address: number, timeout: number }} Reach */
/** @typedef {{ name: string, product: string | null }} Module */
/** @typedef {{ products: string[] }} Products */
/** @typedef {{ text: string, done: boolean }} Text */
/** @typedef {{ name: string, text: string, debug: string[] }} Program */
/** @typedef {{ what: string, done: number, total: number }} Progress */
/** @typedef {{ ok: any } | { error: string } | { interrupted: string }} Answer */

export {};
