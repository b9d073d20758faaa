//! A page of settings as it lies in the EEPROM: epoch, sequence number, page number, 14 values, CRC.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};

use crate::chip::at25::{PAGE, SIZE};

/// Bytes of the settings area, at the end of the EEPROM; what lies before holds the program.
pub const SETTINGS: u16 = 2048;
/// Pages of settings; each takes two pages of the part.
pub const PAGES: usize = SETTINGS as usize / PAGE / 2;
/// Values in a page: 64 bytes less four of head and four of CRC.
pub(super) const VALUES: usize = (PAGE - 8) / 4;

/// A page of the part.
pub(super) type Image = [u8; PAGE];
/// The values of a page.
pub(super) type Values = [i32; VALUES];

/// Version of the layout. It goes into the CRC, so that a page of another layout is foreign.
const LAYOUT: &[u8] = b"tmcm settings 2";

const CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// One page to be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Job {
    /// Where: a multiple of 64.
    pub address: u16,
    /// What.
    pub page: [u8; PAGE],
}

/// A page read back whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decoded {
    pub(super) epoch: u16,
    pub(super) sequence: u8,
    pub(super) values: Values,
}

/// Address of a page's first or second copy.
pub(super) fn address(page: usize, second: bool) -> u16 {
    let copy = page.saturating_mul(2).saturating_add(second.into());
    (SIZE - SETTINGS).saturating_add(copy.saturating_mul(PAGE) as u16)
}

/// True when epoch `a` came after `b`; they wrap.
pub(super) fn newer(a: u16, b: u16) -> bool {
    a != b && a.wrapping_sub(b) < 0x8000
}

/// True when sequence number `a` came after `b`; they wrap.
pub(super) fn follows(a: u8, b: u8) -> bool {
    a != b && a.wrapping_sub(b) < 0x80
}

pub(super) fn encode(page: usize, epoch: u16, sequence: u8, values: &Values) -> Image {
    let mut image: Image = [0; _];
    let [high, low] = epoch.to_be_bytes();
    let head = [high, low, sequence, page as u8];
    let bytes = head.into_iter().chain(values.iter().flat_map(|value| value.to_be_bytes()));
    for (place, byte) in image.iter_mut().zip(bytes) {
        *place = byte;
    }
    let sum = checksum(&image);
    if let Some(place) = image.last_chunk_mut() {
        *place = sum;
    }
    image
}

pub(super) fn decode(page: usize, image: &Image) -> Option<Decoded> {
    let (&[high, low, sequence, number], rest) = image.split_first_chunk()?;
    if usize::from(number) != page || *image.last_chunk()? != checksum(image) {
        return None;
    }
    let mut values = Values::default();
    for (value, bytes) in values.iter_mut().zip(rest.as_chunks().0) {
        *value = i32::from_be_bytes(*bytes);
    }
    Some(Decoded { epoch: u16::from_be_bytes([high, low]), sequence, values })
}

fn checksum(image: &Image) -> [u8; 4] {
    let mut digest = CRC.digest();
    digest.update(LAYOUT);
    digest.update(image.split_last_chunk::<4>().map_or(&[], |(body, _)| body));
    digest.finalize().to_be_bytes()
}
