//! A module's settings: one by one, in tables, in files, and the differences between them.

mod assignment;
mod diff;
mod file;
mod list;
mod place;
mod restore;
mod save;

pub use assignment::{Assignment, hint, storable, write};
pub use diff::differences;
pub use file::{Setting, Settings};
pub use list::list;
pub use place::{Where, parse, product_for};
pub use restore::{Restored, Wanted, check, restore};
pub use save::{Saved, all, save, values};
