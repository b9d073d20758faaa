//! Faults of the replies of a module on their way to the hosts. No board knows them: they are for the owner of the
//! links.

use super::number_within;
use super::time::leading_span;
use crate::clock::Nanos;

/// A fault of the replies of a module, whatever link they go over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReplyFault {
    /// `fault reply-delay TIME`: each reply comes so many nanoseconds later; 0 ends that.
    Delay(Nanos),
    /// `fault reply-drop N`: so many replies from now on are lost.
    Drop(u32),
    /// `fault reply-corrupt N`: so many replies from now on have a wrong checksum.
    Corrupt(u32),
}

/// Most replies that are lost or corrupted.
const MOST: u32 = 1_000_000;

impl ReplyFault {
    /// The faults, as they are written behind `fault`: their names, and what follows these.
    pub const USAGE: [(&str, &str); 3] = [("reply-delay", "TIME"), ("reply-drop", "N"), ("reply-corrupt", "N")];

    /// Reads what stands behind `fault`; `None` if that is another fault.
    pub(super) fn parse(words: &[&str]) -> Option<Result<Self, String>> {
        let [name, rest @ ..] = words else { return None };
        let (_, value) = Self::USAGE.iter().find(|(known, _)| known == name)?;
        let count = |word: &str| number_within("number of replies", word, 0, MOST);
        Some(match (*name, rest) {
            ("reply-delay", ["0"]) => Ok(ReplyFault::Delay(0)),
            ("reply-delay", [_] | [_, _]) => leading_span(rest).and_then(|(delay, rest)| match rest {
                [] => Ok(ReplyFault::Delay(delay)),
                _ => Err(format!("usage: fault {name} {value}")),
            }),
            ("reply-drop", [word]) => count(word).map(ReplyFault::Drop),
            ("reply-corrupt", [word]) => count(word).map(ReplyFault::Corrupt),
            _ => Err(format!("usage: fault {name} {value}")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clock::MILLISECOND;

    #[test]
    fn what_stands_behind_fault() {
        let read = |line: &str| ReplyFault::parse(&line.split_whitespace().collect::<Vec<_>>());
        assert_eq!(read("reply-delay 20 ms"), Some(Ok(ReplyFault::Delay(20 * MILLISECOND))));
        assert_eq!(read("reply-delay 20ms"), Some(Ok(ReplyFault::Delay(20 * MILLISECOND))));
        assert_eq!(read("reply-delay 0"), Some(Ok(ReplyFault::Delay(0))));
        assert_eq!(read("reply-drop 3"), Some(Ok(ReplyFault::Drop(3))));
        assert_eq!(read("reply-corrupt 0"), Some(Ok(ReplyFault::Corrupt(0))));
        assert_eq!(read("eeprom on"), None);
        let wrong = |line: &str| read(line).unwrap().unwrap_err();
        assert!(wrong("reply-delay 20").contains("no unit"));
        assert_eq!(wrong("reply-delay 20 ms more"), "usage: fault reply-delay TIME");
        assert_eq!(wrong("reply-delay 20ms more"), "usage: fault reply-delay TIME");
        assert_eq!(wrong("reply-drop"), "usage: fault reply-drop N");
        assert_eq!(wrong("reply-drop on"), "number of replies 'on' is not a number within 0 to 1000000");
    }
}
