//! The errors of the operating system in words for people.

use std::io::{self, ErrorKind};

/// The meaning of an error of the operating system, for somebody who does not know the system's names and numbers. An
/// error that this program has made itself says what it says.
pub fn words(error: impl Into<io::Error>) -> String {
    of(&error.into())
}

/// The same, of an error that is still needed.
pub fn of(error: &io::Error) -> String {
    let Some(number) = error.raw_os_error() else { return error.to_string() };
    let known = match error.kind() {
        ErrorKind::NotFound => "there is no such file or folder",
        ErrorKind::PermissionDenied => "that is not permitted to this user",
        ErrorKind::IsADirectory => "it is a folder",
        ErrorKind::NotADirectory => "a part of its path is no folder",
        ErrorKind::AlreadyExists => "it exists already",
        ErrorKind::ReadOnlyFilesystem => "nothing can be written there, it is read-only",
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => "no room is left",
        ErrorKind::FileTooLarge => "the file would be larger than is permitted",
        ErrorKind::AddrInUse => "it is in use already",
        ErrorKind::AddrNotAvailable => "this computer has no such address",
        ErrorKind::ConnectionRefused => "nothing there takes connections",
        ErrorKind::ConnectionReset | ErrorKind::ConnectionAborted | ErrorKind::BrokenPipe => "the other side is gone",
        ErrorKind::HostUnreachable | ErrorKind::NetworkUnreachable | ErrorKind::NetworkDown => "no way leads there",
        ErrorKind::WouldBlock | ErrorKind::TimedOut => "nothing has come in time",
        _ => return system(error, number),
    };
    known.into()
}

/// The system's own words, without its number.
fn system(error: &io::Error, number: i32) -> String {
    let text = error.to_string();
    text.strip_suffix(&format!(" (os error {number})")).unwrap_or(&text).to_owned()
}

#[cfg(test)]
mod tests {
    use rustix::io::Errno;

    use super::*;

    #[test]
    fn no_error_is_a_number() {
        for number in 1..=133 {
            let words = of(&io::Error::from_raw_os_error(number));
            assert!(!words.is_empty() && !words.contains("os error"), "{words}");
        }
        assert_eq!(words(Errno::AGAIN), "nothing has come in time");
        assert_eq!(words(Errno::NOENT), "there is no such file or folder");
        assert_eq!(words(Errno::NODEV), "No such device");
        assert_eq!(words(io::Error::new(ErrorKind::NotFound, "there is no such host")), "there is no such host");
    }
}
