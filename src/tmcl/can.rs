//! TMCL in CAN frames (manual section 3.1): the identifier takes the place of the address, there is no checksum, and a
//! frame has seven or eight data bytes. A reply has as many data bytes as its request: the manual does not say so, but
//! hosts rely on the number.

use super::{Command, Reply};
use crate::can::{CanFrame, Frame, Id, StandardId};

/// Data bytes of a request or reply.
pub type Data = heapless::Vec<u8, 8>;

/// A request as it came over the CAN bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Request {
    /// Identifier of the frame.
    pub id: StandardId,
    /// Command in the first seven data bytes.
    pub command: Command,
    /// Number of data bytes, 7 or 8.
    pub length: u8,
}

/// The request in a frame. `None` for a remote frame, an identifier of 29 bits, or fewer than seven data bytes.
pub fn decode(frame: &impl CanFrame) -> Option<Request> {
    let (Id::Standard(id), false) = (frame.id(), frame.is_remote_frame()) else { return None };
    let data = frame.data();
    Some(Request { id, command: decode_command(data)?, length: data.len() as u8 })
}

/// The command in the first seven data bytes of a frame; `None` if there are fewer.
pub fn decode_command(data: &[u8]) -> Option<Command> {
    Some(Command::from_bytes(*data.first_chunk()?))
}

/// The eight data bytes of a request; the last byte is 0.
pub fn encode_command(command: Command) -> Data {
    let mut data = Data::new();
    // Seven bytes and one more fit the capacity of eight.
    let _ = data.extend_from_slice(&command.to_bytes());
    let _ = data.push(0);
    data
}

/// The data of a reply of `length` (7 or 8) bytes from the module that receives requests under identifier `id`: low
/// byte of `id`, status, command number, value. A [`Reply::Version`] or [`Reply::Memory`] is sent without the host
/// address that its telegram begins with; the last character of a version needs the eighth byte.
pub fn encode_reply(id: StandardId, length: usize, reply: &Reply) -> Data {
    let mut data = Data::from_array(reply_bytes(id, reply));
    data.truncate(if length == Command::SIZE { 7 } else { 8 });
    data
}

/// The frame of a reply as [`encode_reply`] makes it, with identifier `to`.
#[inline(always)]
pub fn reply_frame(id: StandardId, to: StandardId, length: u8, reply: &Reply) -> Frame {
    Frame::received(Id::Standard(to), false, length, reply_bytes(id, reply))
}

fn reply_bytes(id: StandardId, reply: &Reply) -> [u8; 8] {
    match *reply {
        Reply::Plain { status, opcode, value } => {
            let [a, b, c, d] = value.to_be_bytes();
            let [_, low] = id.as_raw().to_be_bytes();
            [low, status as u8, opcode, a, b, c, d, 0]
        }
        Reply::Version(text) => text,
        Reply::Memory(command) => {
            let [opcode, kind, motor, a, b, c, d] = command.to_bytes();
            [opcode, kind, motor, a, b, c, d, 0]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Status;
    use super::*;

    fn id(number: u16) -> StandardId {
        StandardId::new(number).unwrap()
    }

    #[test]
    fn the_reply_mirrors_the_length_of_the_request() {
        let reply = Reply::Plain { status: Status::Ok, opcode: 6, value: -2 };
        assert_eq!(encode_reply(id(0x701), 7, &reply).as_slice(), [1, 100, 6, 0xFF, 0xFF, 0xFF, 0xFE]);
        assert_eq!(encode_reply(id(0x701), 8, &reply).as_slice(), [1, 100, 6, 0xFF, 0xFF, 0xFF, 0xFE, 0]);
        assert_eq!(encode_reply(id(1), 8, &Reply::Version(*b"1234V142")).as_slice(), b"1234V142");
    }

    #[test]
    fn requests_need_seven_bytes() {
        let command = Command::new(4, 1, 0, -10_000);
        let data = encode_command(command);
        assert_eq!(data.as_slice(), [4, 1, 0, 0xFF, 0xFF, 0xD8, 0xF0, 0]);
        assert_eq!(decode_command(&data), Some(command));
        assert_eq!(decode_command(&data[..7]), Some(command));
        assert_eq!(decode_command(&data[..6]), None);
    }
}
