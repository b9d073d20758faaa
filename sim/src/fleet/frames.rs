//! Frames of hosts on the CAN bus that want a reply, and frames of modules that are one.

use std::ops::RangeInclusive;

use tmcm::can::{CanFrame, Frame, Id};
use tmcm::canopen;
use tmcm::tmcl::can;

use crate::native::FirmwareKind;
use crate::wire::answering::{is_event, stays_unanswered};

/// Identifier of SDO requests, without the node ID.
const SDO_REQUEST: u16 = 0x600;
/// Node IDs.
const NODES: RangeInclusive<u16> = 1..=127;
/// First byte of an SDO abort, which nobody answers.
const SDO_ABORT: u8 = 0x80;

/// The reply that a frame of a host asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Wish {
    /// No reply belongs to it.
    Nothing,
    /// The frame is carried out without a reply.
    Silence,
    /// A module may answer it.
    Reply,
}

/// The wish of a frame of a host to modules with this firmware.
pub(super) fn wish(firmware: FirmwareKind, frame: &Frame) -> Wish {
    match firmware {
        FirmwareKind::Tmcl => match can::decode(frame) {
            Some(request) if stays_unanswered(request.command) => Wish::Silence,
            Some(_) => Wish::Reply,
            None => Wish::Nothing,
        },
        FirmwareKind::Canopen => {
            let Id::Standard(id) = frame.id() else { return Wish::Nothing };
            let sdo = NODES.contains(&(id.as_raw() ^ SDO_REQUEST)) && frame.data().first() != Some(&SDO_ABORT);
            if frame.is_remote_frame() || sdo { Wish::Reply } else { Wish::Nothing }
        }
    }
}

/// True for a frame of a module with this firmware that answers a request.
pub(super) fn is_reply(firmware: FirmwareKind, frame: &Frame) -> bool {
    match (firmware, frame.id()) {
        (FirmwareKind::Tmcl, _) => !matches!(frame.data(), [_, status, opcode, ..] if is_event(*status, *opcode)),
        (FirmwareKind::Canopen, Id::Standard(id)) => NODES.contains(&(id.as_raw() ^ canopen::SDO_REPLY)),
        (FirmwareKind::Canopen, Id::Extended(_)) => false,
    }
}

/// Whether a frame of a module with this firmware is the reply to that request.
pub(super) fn answers(firmware: FirmwareKind, request: &Frame, reply: &Frame) -> bool {
    let (Id::Standard(asked), Id::Standard(id)) = (request.id(), reply.id()) else { return false };
    match firmware {
        FirmwareKind::Canopen if request.is_remote_frame() => asked == id,
        FirmwareKind::Canopen if asked.as_raw() ^ SDO_REQUEST != id.as_raw() ^ canopen::SDO_REPLY => false,
        FirmwareKind::Canopen | FirmwareKind::Tmcl => is_reply(firmware, reply),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::can::StandardId;
    use tmcm::tmcl::Command;

    fn frame(id: u16, data: &[u8]) -> Frame {
        Frame::standard(id, data).unwrap()
    }

    #[test]
    fn requests_of_tmcl_want_replies() {
        let wish = |command| wish(FirmwareKind::Tmcl, &frame(1, &can::encode_command(command)));
        assert_eq!(wish(Command::new(6, 1, 0, 0)), Wish::Reply);
        assert_eq!(wish(Command::new(255, 0, 0, 1234)), Wish::Reply);
        assert_eq!(wish(Command::new(137, 0, 0, 1234)), Wish::Silence);
        assert_eq!(super::wish(FirmwareKind::Tmcl, &frame(1, &[1, 2])), Wish::Nothing);
        let request = frame(1, &[6, 1, 0, 0, 0, 0, 0]);
        assert!(answers(FirmwareKind::Tmcl, &request, &frame(2, &[1, 100, 6, 0, 0, 0, 0])));
        assert!(!answers(FirmwareKind::Tmcl, &request, &frame(2, &[1, 128, 138, 0, 0, 0, 1])));
    }

    #[test]
    fn of_canopen_sdos_and_remote_frames_want_replies() {
        let wish = |frame: &Frame| wish(FirmwareKind::Canopen, frame);
        let read = frame(0x605, &[0x40, 0, 0x10, 0, 0, 0, 0, 0]);
        assert_eq!(wish(&read), Wish::Reply);
        assert!(answers(FirmwareKind::Canopen, &read, &frame(0x585, &[0x43, 0, 0x10, 0, 0, 0, 0, 0])));
        assert!(!answers(FirmwareKind::Canopen, &read, &frame(0x586, &[0x43, 0, 0x10, 0, 0, 0, 0, 0])));
        assert!(!answers(FirmwareKind::Canopen, &read, &frame(0x705, &[5])));
        assert_eq!(wish(&frame(0x605, &[0x80, 0, 0x10, 0, 0, 0, 0, 0])), Wish::Nothing);
        for (id, data) in [(0, &[1, 0][..]), (0x80, &[]), (0x205, &[6, 0]), (0x701, &[5])] {
            assert_eq!(wish(&frame(id, data)), Wish::Nothing, "{id:x}");
        }
        let guard = Frame::new_remote(StandardId::new(0x705).unwrap(), 1).unwrap();
        assert_eq!(wish(&guard), Wish::Reply);
        assert!(answers(FirmwareKind::Canopen, &guard, &frame(0x705, &[5])));
    }
}
