//! A module's settings: one by one, in tables, in files, and the differences between them.

mod assignment;
mod diff;
mod each;
mod entry;
mod file;
mod lasting;
mod list;
mod place;
mod restore;
mod save;
mod shown;

pub use assignment::{Assignment, Unstored, hint, storable, unstored, write};
pub use diff::differences;
pub use each::{Each, read_each, store_each, write_each};
pub use entry::Entry;
pub use file::{Setting, Settings, VARIABLES};
pub use lasting::{Lasting, stores_itself};
pub use list::{list, range};
pub use place::{INTERRUPTS, Where, parse, product_for};
pub use restore::{Restored, Wanted, check, check_number, restore};
pub use save::{Saved, all, save, values};
pub use shown::{Shown, Units};
