//! The keys of a jog: arrows, and anything else.

use tmcl_tools::shell::Key;

/// Begins the bytes of a key that is no character.
const ESCAPE: u8 = 0x1B;

/// Makes keys of bytes, also where those of a key come in pieces.
#[derive(Clone, Debug, Default)]
pub(super) struct Reader {
    /// The beginning of a key.
    begun: Vec<u8>,
}

impl Reader {
    /// The keys that are complete with these bytes.
    pub(super) fn take(&mut self, bytes: &[u8]) -> Vec<Key> {
        let mut keys = Vec::new();
        for byte in bytes {
            self.begun.push(*byte);
            // As terminals send them: ESC [ or ESC O, digits and semicolons for what is held as well, and a letter.
            let key = match self.begun.as_slice() {
                [ESCAPE] | [ESCAPE, b'[' | b'O'] => continue,
                [ESCAPE, b'[', .., b'0'..=b'9' | b';'] => continue,
                [ESCAPE, b'[' | b'O', b'C'] => Key::Right,
                [ESCAPE, b'[' | b'O', b'D'] => Key::Left,
                b" " => Key::Stop,
                _ => Key::Other,
            };
            self.begun.clear();
            keys.push(key);
        }
        keys
    }

    /// True in the middle of a key.
    pub(super) fn has_begun(&self) -> bool {
        !self.begun.is_empty()
    }
}

/// The key that counts of several that came together: the first that is no arrow counts, because it stops; else the
/// last arrow.
pub(super) fn sum(keys: &[Key]) -> Option<Key> {
    let stop = keys.iter().find(|key| matches!(key, Key::Stop | Key::Other));
    stop.or(keys.last()).copied()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrows_are_told_from_other_keys() {
        let keys = |text: &str| Reader::default().take(text.as_bytes());
        assert_eq!(keys("\x1b[C\x1b[D\x1bOC\x1bOD"), [Key::Right, Key::Left, Key::Right, Key::Left]);
        assert_eq!(keys(" q\r"), [Key::Stop, Key::Other, Key::Other]);
        // Up, Shift and the right arrow, Delete, Alt and x.
        assert_eq!(keys("\x1b[A\x1b[1;2C\x1b[3~\x1bx"), [Key::Other; 4]);
    }

    #[test]
    fn a_key_may_come_in_pieces() {
        let mut reader = Reader::default();
        for piece in ["\x1b", "["] {
            assert!(reader.take(piece.as_bytes()).is_empty() && reader.has_begun());
        }
        assert_eq!(reader.take(b"C"), [Key::Right]);
        assert!(!reader.has_begun());
    }

    #[test]
    fn a_stop_counts_before_arrows() {
        assert_eq!(sum(&[Key::Right, Key::Left]), Some(Key::Left));
        assert_eq!(sum(&[Key::Right, Key::Stop, Key::Right]), Some(Key::Stop));
        assert_eq!(sum(&[Key::Left, Key::Other, Key::Stop]), Some(Key::Other));
        assert_eq!(sum(&[]), None);
    }
}
