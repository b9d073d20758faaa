//! A serial port for host software: a pseudo terminal, where the system has them, and a symbolic link to its device.

#[cfg(unix)]
mod unix;
#[cfg(windows)]
mod windows;

#[cfg(unix)]
pub use unix::*;
#[cfg(windows)]
pub use windows::*;
