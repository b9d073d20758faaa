//! Parts that differ between operating systems: what can be waited for by [`poll`](crate::poll), signals, who else has
//! a port, and how a file is told from another. There is one maker for Unix and one for Windows, with the same names.
//!
//! On Unix all can be waited for that has a file descriptor. On Windows only sockets can; so for each other source of
//! bytes or events there is a thread, which passes on by a socket what comes.

#[cfg(unix)]
pub mod claim;
#[cfg(unix)]
mod unix;
#[cfg(windows)]
mod windows;

#[cfg(unix)]
pub use unix::*;
#[cfg(windows)]
pub use windows::*;
