// What the editor asks for, and what it is told. Lines and columns begin with 0, and columns count UTF-16 code units, as those of
// JavaScript's strings do.

/** The kinds of words that have a colour of their own; an answer names them by their places in this list. */
export const KINDS = ['mnemonic', 'name', 'label', 'number', 'symbol', 'directive', 'file', 'comment', 'wrong'];

/** @typedef {{ words: string } | { instead: string }} Advice */
/** A message of the assembler.
 * @typedef {object} Message
 * @property {string | null} file null: the text itself
 * @property {number} line
 * @property {number} start
 * @property {number} end
 * @property {'error' | 'warning'} severity
 * @property {string} words
 * @property {Advice | null} advice
 */
/** Of each line: start, end and kind of its first word, of its second one, and so on; and the lines which have a command.
 * @typedef {{ lines: number[][], messages: Message[], commands: number[] }} Checked */
/** @typedef {{ text: string, note: string }} Item */
/** What can stand from start to end of the line.
 * @typedef {{ start: number, end: number, items: Item[] }} Completions */
/** @typedef {{ file: string | null, line: number, column: number }} Place */
/** What stands from start to end of the line, in words, and where it is defined.
 * @typedef {{ start: number, end: number, words: string, place: Place | null }} Explanation */
/** Who knows the language. An answer may take its time; one to an older question is not looked at.
 * @typedef {object} Services
 * @property {(text: string) => Promise<Checked>} check
 * @property {(text: string, line: number, column: number) => Promise<Completions>} complete
 * @property {(text: string, line: number, column: number) => Promise<Explanation | null>} explain
 */
