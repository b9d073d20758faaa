//! A settings page as it lies in the EEPROM, with the highest byte of each number first:
//!
//! ```text
//! byte   0       2      3       4          8               4 + 4 n  8 + 4 n
//!        +-------+------+-------+----------+-----+-----------+--------+
//!        | epoch | seq. | page  | value of | ... | value of  | CRC-32 |
//!        |       | no.  | number| slot 0   |     | slot n-1  |        |
//!        +-------+------+-------+----------+-----+-----------+--------+
//! ```
//!
//! The slots are those of this page, counted from its first one; a page of 64 bytes has n = 14 of them. The CRC is that
//! of Ethernet (CRC-32/ISO-HDLC), over the tag of the layout, which is not in the page, and all bytes before the CRC. A
//! page whose bytes are all FFh is erased.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use heapless::Vec;

use super::memory::LONGEST_PAGE;

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// The bytes of a page of the EEPROM.
pub type Page = Vec<u8, LONGEST_PAGE>;

/// A page to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Job {
    /// Address of the page's first byte in the EEPROM.
    pub address: u16,
    /// The bytes to be written: a whole page; none at all asks whether the EEPROM answers.
    pub page: Page,
}

/// True when epoch `a` came after epoch `b`. Epochs wrap, so `a` is later when it is less than half the range ahead.
pub(super) fn newer(a: u16, b: u16) -> bool {
    a != b && a.wrapping_sub(b) < 0x8000
}

/// True when sequence number `a` came after `b`. The numbers wrap, so `a` is later when it is less than half the range
/// ahead.
pub(super) fn follows(a: u8, b: u8) -> bool {
    a != b && a.wrapping_sub(b) < 0x80
}

/// The bytes of settings page `number` with these values.
pub(super) fn encode(tag: &[u8], number: usize, epoch: u16, sequence: u8, values: &[i32]) -> Page {
    let [high, low] = epoch.to_be_bytes();
    let head = [high, low, sequence, number as u8];
    let body = head.into_iter().chain(values.iter().flat_map(|value| value.to_be_bytes()));
    let mut page: Page = body.take(LONGEST_PAGE).collect();
    let sum = checksum(tag, &page);
    // The check sum fits: `fits` lets no page be longer than LONGEST_PAGE.
    let _ = page.extend_from_slice(&sum);
    page
}

/// Epoch and sequence number as any layout has them in a page; `None` if the page is erased.
pub(super) fn head(page: &[u8]) -> Option<(u16, u8)> {
    let &[high, low, sequence] = page.first_chunk()?;
    page.iter().any(|byte| *byte != 0xFF).then(|| (u16::from_be_bytes([high, low]), sequence))
}

/// Copies the values out of a page and returns its epoch and sequence number. `None` if the check sum is wrong or the
/// page has another number.
pub(super) fn decode(tag: &[u8], number: usize, page: &[u8], values: &mut [i32]) -> Option<(u16, u8)> {
    let (body, sum) = page.split_last_chunk()?;
    let &[high, low, sequence, found] = body.first_chunk()?;
    if usize::from(found) != number || *sum != checksum(tag, body) {
        return None;
    }
    take_values(page, values);
    Some((u16::from_be_bytes([high, low]), sequence))
}

/// Copies the values out of a page whose check sum is known to be right.
pub(super) fn take_values(page: &[u8], values: &mut [i32]) {
    let (words, _) = page.as_chunks();
    for (value, bytes) in values.iter_mut().zip(words.iter().skip(1)) {
        *value = i32::from_be_bytes(*bytes);
    }
}

fn checksum(tag: &[u8], body: &[u8]) -> [u8; 4] {
    let mut digest = CRC.digest();
    digest.update(tag);
    digest.update(body);
    digest.finalize().to_be_bytes()
}
