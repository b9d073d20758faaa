//! The objects of the CANopen firmware as a file for masters and their tools (EDS and DCF, CiA 306).

mod file;
mod object;

pub use file::text;
pub use object::{Described, is_command};
