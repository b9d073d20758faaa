//! Bytes of a host, kept until the module can be given them at once.
//!
//! A host's telegram may come in pieces, and its silences are those of the wall's clock. Virtual time goes at a pace of
//! its own: the firmware, which gives up an unfinished telegram after 5 ms, would see other silences than the host
//! made. So it gets whole telegrams, whole lines, and what a silence has ended.

use tmcm::tmcl::binary::TELEGRAM;

/// What has come from a host and is not whole.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    held: Vec<u8>,
    /// How many bytes of a telegram the module has been given without the others.
    begun: usize,
}

impl Pieces {
    /// Takes bytes; gives those that the module may have now.
    pub(super) fn push(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.held.extend(bytes);
        let telegrams = (self.begun + self.held.len()) / TELEGRAM * TELEGRAM;
        let line = self.held.iter().rposition(|byte| matches!(byte, b'\r' | b'\n'));
        let whole = telegrams.saturating_sub(self.begun).max(line.map_or(0, |end| end + 1));
        self.begun = (self.begun + whole) % TELEGRAM;
        self.held.drain(..whole).collect()
    }

    /// The host is silent; gives what is left, if anything is unfinished. The module has to see a silence behind that.
    pub(super) fn silence(&mut self) -> Option<Vec<u8>> {
        let unfinished = !self.held.is_empty() || self.begun != 0;
        self.begun = 0;
        unfinished.then(|| std::mem::take(&mut self.held))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn telegrams_and_lines_are_whole() {
        let mut pieces = Pieces::default();
        assert_eq!(pieces.push(b"1234"), b"");
        assert_eq!(pieces.push(b"56789123"), b"123456789");
        assert_eq!(pieces.silence().as_deref(), Some(&b"123"[..]));
        assert_eq!(pieces.silence(), None);
        assert_eq!(pieces.push(b"AMST\rA"), b"AMST\r");
        assert_eq!(pieces.silence().as_deref(), Some(&b"A"[..]));
    }

    #[test]
    fn a_telegram_may_have_the_end_of_a_line_in_it() {
        let mut pieces = Pieces::default();
        assert_eq!(pieces.push(b"12\r4"), b"12\r");
        assert_eq!(pieces.push(b"56789"), b"456789");
        assert_eq!(pieces.silence(), None);
        assert_eq!(pieces.push(b"12\r"), b"12\r");
        assert_eq!(pieces.silence().as_deref(), Some(&b""[..]));
    }
}
