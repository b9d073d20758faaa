//! Answers to what an editor of sources asks of the assembler: colours, mistakes with their places, what can be written
//! at a place, and what stands there. A page, a language server and a debug adapter ask the same.
//!
//! Lines and columns count from 0 here, and columns are units of UTF-16, in which editors count.
//!
//! * [`tokens`] - the parts of each line, for colours
//! * [`examine`](examine()) - mistakes, and which lines have commands and labels
//! * [`complete`](complete()), [`complete_command`] - what can be written at a place
//! * [`explain`](explain()) - what stands at a place, and where it is defined
//!
//! All but the mistakes is told of sources that cannot be assembled as well, and without assembling them: `line` cuts
//! their lines, `survey` collects their names, `slot` says what a place is for, and `built_in` knows the names of a
//! product.

mod built_in;
mod columns;
mod complete;
mod examine;
mod explain;
mod line;
mod slot;
mod survey;
mod tokens;

#[cfg(test)]
mod tests;

pub use complete::{Completion, Item, complete, complete_command};
pub use examine::{Examined, Label, Mistake, examine};
pub use explain::{Definition, Explanation, explain};
pub use tokens::{Piece, PieceKind, tokens};
