//! Bytes of a host, collected until they form a whole telegram or line. This is done on their way to a module that runs
//! its image, and in the log of what goes over the wires.
//!
//! A host's telegram may arrive in pieces, and a host's silences are measured in real time. Virtual time has another
//! pace, so the firmware, which gives up an unfinished telegram after 5 ms, would see other silences than the host
//! made. That is why a module that runs its image gets whole telegrams, whole lines, and unfinished ones only after a
//! silence of the host. A fleet sees by the same means what its hosts ask.

use tmcm::tmcl::ascii;
use tmcm::tmcl::binary::TELEGRAM;

/// Bytes from a host that are not a whole telegram or line yet.
#[derive(Debug, Default)]
pub(crate) struct Pieces {
    held: Vec<u8>,
    /// True if the module was given a line last. In binary mode the module takes the line for the beginning of a
    /// telegram, which the next silence must end.
    line: bool,
}

impl Pieces {
    /// Takes bytes; returns the telegrams and lines that are whole.
    pub(crate) fn push(&mut self, bytes: &[u8]) -> Vec<Vec<u8>> {
        self.held.extend(bytes);
        let mut portions = Vec::new();
        loop {
            let end = self.held.iter().position(|byte| is_end(*byte));
            // A line consists of characters that can be typed; a telegram has at least one other byte, its command
            // number.
            let typed = self.held.iter().take(end.unwrap_or(ascii::LINE)).all(|byte| is_typed(*byte));
            let whole = match end {
                Some(end) if typed => end + 1,
                None if typed => ascii::LINE,
                _ => TELEGRAM,
            };
            if self.held.len() < whole {
                return portions;
            }
            self.line = typed;
            portions.push(self.held.drain(..whole).collect());
        }
    }

    /// The bytes that are not whole yet.
    pub(crate) fn held(&self) -> &[u8] {
        &self.held
    }

    /// Takes a silence of the host; returns the remaining bytes if a telegram may be unfinished. The module must see a
    /// silence after them.
    pub(crate) fn silence(&mut self) -> Option<Vec<u8>> {
        let unfinished = !self.held.is_empty() || std::mem::take(&mut self.line);
        unfinished.then(|| std::mem::take(&mut self.held))
    }
}

/// True for a character that ends a line.
pub(crate) fn is_end(byte: u8) -> bool {
    matches!(byte, b'\r' | b'\n')
}

/// True for the bytes of a line with its end; what is whole and no line is a telegram, or the first part of a line that
/// is too long.
pub(crate) fn is_line(whole: &[u8]) -> bool {
    whole.split_last().is_some_and(|(last, typed)| is_end(*last) && typed.iter().all(|byte| is_typed(*byte)))
}

/// True for a character that can be typed in ASCII mode.
pub(crate) fn is_typed(byte: u8) -> bool {
    byte.is_ascii_graphic() || matches!(byte, b' ' | b'\x08')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_and_lines_are_whole() {
        let mut pieces = Pieces::default();
        let none: [Vec<u8>; 0] = [];
        assert_eq!(pieces.push(&[1, 2, 3, 4]), none);
        assert_eq!(pieces.push(&[5, 6, 7, 8, 9, 1, 2, 3]), [[1, 2, 3, 4, 5, 6, 7, 8, 9]]);
        assert_eq!(pieces.silence().as_deref(), Some(&[1, 2, 3][..]));
        assert_eq!(pieces.silence(), None);
        assert_eq!(pieces.push(b"AMVP ABS, 0, 1"), none);
        assert_eq!(pieces.push(b"0\rAMST\rA"), [&b"AMVP ABS, 0, 10\r"[..], b"AMST\r"]);
        assert_eq!(pieces.silence().as_deref(), Some(&b"A"[..]));
    }

    #[test]
    fn a_telegram_may_have_the_end_of_a_line_in_it() {
        let mut pieces = Pieces::default();
        assert_eq!(pieces.push(&[1, 2, b'\r', 4, 5, 6, 7, 8, 9, 1]), [[1, 2, b'\r', 4, 5, 6, 7, 8, 9]]);
        assert_eq!(pieces.push(&[b'\n', 3, 4, 5, 6, 7, 8, b'\r']), [[1, b'\n', 3, 4, 5, 6, 7, 8, b'\r']]);
        assert_eq!(pieces.silence(), None);
    }

    #[test]
    fn a_silence_after_a_line_is_passed_on() {
        let mut pieces = Pieces::default();
        assert_eq!(pieces.push(b"BIN\r"), [b"BIN\r"]);
        assert_eq!(pieces.silence().as_deref(), Some(&b""[..]));
        assert_eq!(pieces.silence(), None);
    }
}
