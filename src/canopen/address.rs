//! The node ID and the bit rate, without which a node must not be on the bus: what is known of them at the start.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use super::entry::Entry;
use super::object::Object;
use crate::store::{Memory, Store};

/// Node ID and bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address {
    /// The node ID, 1 to 127.
    pub node: u8,
    /// The bit rate in kbit/s.
    pub bit_rate: u16,
}

impl Address {
    /// The address of a node that has never been told any.
    pub const DEFAULT: Self = Address { node: 1, bit_rate: 1000 };

    /// The bit rate in bit/s.
    pub fn bits_per_second(self) -> u32 {
        u32::from(self.bit_rate).saturating_mul(1000)
    }

    /// Two words that keep the address in memory which survives a restart.
    pub fn to_kept(self) -> [u32; 2] {
        let word = u32::from(self.bit_rate) << 8 | u32::from(self.node);
        [word, sum(word)]
    }

    /// The address that two words keep; `None` if their check sum is wrong, as it is after power-on, or there is no
    /// such address: the check sum of 32 ones are 32 ones.
    pub fn from_kept([word, check]: [u32; 2]) -> Option<Self> {
        let [node, low, high, rest] = word.to_le_bytes();
        let valid = sum(word) == check && (1..=127).contains(&node) && rest == 0;
        valid.then_some(Address { node, bit_rate: u16::from_le_bytes([low, high]) })
    }
}

/// The address of a node, as far as it knows it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Identity {
    /// The address in force.
    pub(super) address: Address,
    /// True if the address is known: without it the node is silent.
    pub(super) known: bool,
    /// The address of before a restart.
    pub(super) kept: Option<Address>,
}

impl Identity {
    /// Before the start nothing is known.
    pub(super) const UNKNOWN: Self = Identity { address: Address::DEFAULT, known: false, kept: None };

    /// Takes node ID and bit rate from the store; they are in force until the next start. If they are `lost` there,
    /// those of before a restart are taken.
    pub(super) fn take<M: Memory>(&mut self, store: &Store<M>, lost: bool) {
        self.known = !lost || self.kept.is_some();
        if let Some(address) = self.kept.filter(|_| lost) {
            self.address = address;
            return;
        }
        let stored = |object| {
            let row = Entry::of(object).row();
            let stored = row.slot(0).and_then(|slot| store.get(slot));
            let valid = stored.filter(|value| row.accepts((*value).into()));
            valid.map_or(row.default_number(0, 0), |value| value as u32)
        };
        self.address = Address { node: stored(Object::NodeId) as u8, bit_rate: stored(Object::BitRate) as u16 };
    }
}

fn sum(word: u32) -> u32 {
    Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC).checksum(&word.to_le_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kept_words_are_taken_as_they_were_written() {
        let address = Address { node: 127, bit_rate: 1000 };
        let kept = address.to_kept();
        assert_eq!(Address::from_kept(kept), Some(address));
        for bit in 0..64 {
            let mut flipped = kept;
            flipped[bit / 32] ^= 1 << (bit % 32);
            assert_eq!(Address::from_kept(flipped), None, "bit {bit}");
        }
        for nothing in [[0; 2], [u32::MAX; 2]] {
            assert_eq!(Address::from_kept(nothing), None);
        }
    }
}
