//! Frames between the bus of a fleet and the emulated CAN controller.

use hal_sim::mcu;
use tmcm::can::{CanFrame, ExtendedId, Frame, Id, StandardId};

/// A frame as the emulated CAN controller has it.
pub(super) fn to_bus(frame: &Frame) -> mcu::CanFrame {
    let mut data = [0; 8];
    data.iter_mut().zip(frame.data()).for_each(|(to, byte)| *to = *byte);
    let id = match frame.id() {
        Id::Standard(id) => id.as_raw().into(),
        Id::Extended(id) => id.as_raw(),
    };
    let (extended, remote) = (frame.is_extended(), frame.is_remote_frame());
    mcu::CanFrame { id, extended, remote, length: frame.dlc() as u8, data }
}

/// A frame of the emulated CAN controller; `None` if its identifier or length is impossible.
pub(super) fn from_bus(frame: &mcu::CanFrame) -> Option<Frame> {
    let mcu::CanFrame { id, extended, remote, length, ref data } = *frame;
    let id: Id = if extended { ExtendedId::new(id)?.into() } else { StandardId::new(u16::try_from(id).ok()?)?.into() };
    let length = length.into();
    if remote { Frame::new_remote(id, length) } else { Frame::new(id, data.get(..length)?) }
}
