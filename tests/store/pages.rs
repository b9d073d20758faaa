//! The pages of the EEPROM, for tests that spoil them.

use crc::{CRC_32_ISO_HDLC, Crc};

/// Bytes of a page.
pub(crate) const PAGE: usize = 64;
/// Pages of the part.
pub(crate) const PAGES: usize = 256;
/// Number of the first page of settings: 16 pages, each of them twice.
pub(crate) const FIRST_OF_SETTINGS: usize = 224;
/// Where the settings begin.
pub(crate) const SETTINGS: usize = FIRST_OF_SETTINGS * PAGE;

/// The check sum that makes a page of settings valid, whatever is in it: the name of the layout counts in it.
pub(crate) fn seal(page: &mut [u8]) {
    let (body, sum) = page.split_last_chunk_mut::<4>().unwrap();
    let crc = Crc::<u32>::new(&CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(b"tmcm settings 2");
    digest.update(body);
    *sum = digest.finalize().to_be_bytes();
}
