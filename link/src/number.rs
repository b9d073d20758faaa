//! The numbers of signals that ask a program to end. Exit codes have them on all systems.

/// The number of SIGHUP, which tells that the terminal is gone; on Windows the end of the console or of the session
/// stands for it.
pub const HANGUP: u8 = 1;
/// The number of SIGINT, which is Ctrl-C.
pub const INTERRUPT: u8 = 2;
/// The number of SIGTERM; on Windows Ctrl-Break, which programs can send to others, and the end of the system stand for
/// it.
pub const TERMINATE: u8 = 15;
