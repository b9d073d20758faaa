//! A frame of the CAN bus: data or remote, with an identifier of 11 or 29 bits. It implements the traits of
//! [`embedded_can`], so that drivers, virtual buses and TMCL exchange the same type.

pub mod outbox;

pub use embedded_can::{ExtendedId, Frame as CanFrame, Id, StandardId};

/// Largest number of data bytes in a frame.
const MOST: usize = 8;

/// A data frame, or a remote frame, which has a length but no data.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    id: Id,
    remote: bool,
    length: u8,
    /// The data; bytes behind the length are 0, so that two frames with the same data compare as equal.
    bytes: [u8; MOST],
}

impl Frame {
    /// A data frame with an identifier of 11 bits; `None` if `id` is larger than 0x7FF or `data` longer than 8 bytes.
    pub fn standard(id: u16, data: &[u8]) -> Option<Self> {
        CanFrame::new(StandardId::new(id)?, data)
    }

    /// A frame from the registers of a CAN controller: bytes behind `length` are ignored, and a length above 8 counts
    /// as 8.
    #[inline(always)]
    pub fn received(id: Id, remote: bool, length: u8, bytes: [u8; MOST]) -> Self {
        if length >= MOST as u8 && !remote {
            return Frame { id, remote, length: MOST as u8, bytes };
        }
        let length = length.min(MOST as u8);
        let data = if remote { 0 } else { length };
        let unused = u64::MAX.checked_shl(u32::from(data).saturating_mul(8)).unwrap_or_default();
        Frame { id, remote, length, bytes: (u64::from_le_bytes(bytes) & !unused).to_le_bytes() }
    }

    /// The data bytes, followed by zeros.
    pub const fn bytes(&self) -> [u8; MOST] {
        self.bytes
    }
}

impl CanFrame for Frame {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        let mut bytes = [0; MOST];
        bytes.get_mut(..data.len())?.copy_from_slice(data);
        Some(Frame { id: id.into(), remote: false, length: data.len() as u8, bytes })
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        (dlc <= MOST).then(|| Frame { id: id.into(), remote: true, length: dlc as u8, bytes: [0; MOST] })
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.length.into()
    }

    fn data(&self) -> &[u8] {
        let length = if self.remote { 0 } else { self.dlc() };
        self.bytes.get(..length).unwrap_or_default()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_remote_frame_has_a_length_but_no_data() {
        let frame = Frame::new_remote(StandardId::ZERO, 8).unwrap();
        assert_eq!((frame.is_data_frame(), frame.dlc(), frame.data()), (false, 8, &[][..]));
        assert_eq!(Frame::new_remote(StandardId::ZERO, 9), None);
    }

    #[test]
    fn a_data_frame_has_eight_bytes_at_most() {
        let frame = Frame::new(ExtendedId::MAX, &[1, 2, 3]).unwrap();
        assert_eq!((frame.is_extended(), frame.id(), frame.data()), (true, ExtendedId::MAX.into(), &[1, 2, 3][..]));
        assert_eq!(Frame::standard(1, &[0; 9]), None);
        assert_eq!(Frame::standard(0x800, &[]), None);
    }
}
