//! The objects of a CANopen node as scenarios read and write them, by expedited SDO transfers. The scenario names the
//! types, so that it does not depend on what the firmware believes an object to be.

use tmcm::can::{CanFrame, Frame, Id, StandardId};

use super::token::{Token, Tokens, shown};

/// The node ID of a fresh module.
pub(super) const NODE: u8 = 1;
/// Identifiers of the requests and the replies of the first SDO channel, without the node ID.
const REQUEST: u16 = 0x600;
const REPLY: u16 = 0x580;

/// Types of CiA 301: name, size in bytes, whether there is a sign.
const TYPES: [(&str, usize, bool); 6] =
    [("u8", 1, false), ("i8", 1, true), ("u16", 2, false), ("i16", 2, true), ("u32", 4, false), ("i32", 4, true)];

/// An entry of the object dictionary, with the type that the scenario takes it to have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    index: u16,
    sub: u8,
    size: usize,
    signed: bool,
}

/// The answer of a node to a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// The object has been written.
    Written,
    /// The object has been read.
    Value(i64),
    /// The request is refused, with an abort code of CiA 301.
    Aborted(u32),
}

impl Object {
    /// Takes `0x6041:0 u16` from the front of what is left of a line.
    pub(super) fn read(tokens: &mut Tokens) -> Result<Self, String> {
        let usage = || "usage: sdo INDEX:SUB TYPE, as in: sdo 0x6041:0 u16".to_string();
        let index = whole(tokens.next(), u16::MAX.into()).ok_or_else(usage)?;
        let sub = Some(tokens.take(":")).filter(|colon| *colon).and_then(|_| whole(tokens.next(), u8::MAX.into()));
        let sub = sub.ok_or_else(usage)?;
        let name = tokens.next();
        let found = TYPES.iter().find(|(known, ..)| matches!(&name, Some(Token::Word(word)) if word == known));
        let Some((_, size, signed)) = found else {
            let types = TYPES.map(|(name, ..)| name).join(", ");
            return Err(format!(
                "the type of the object is missing before {}; there are: {types}",
                shown(name.as_ref())
            ));
        };
        Ok(Object { index: index as u16, sub: sub as u8, size: *size, signed: *signed })
    }

    /// The request that reads the object.
    pub(super) fn upload(self) -> Frame {
        self.request(0x40, [0; 4])
    }

    /// The request that writes a value; the error says which values there are.
    pub(super) fn download(self, value: f64) -> Result<Frame, String> {
        let bits = 8 * self.size as u32;
        let (low, high) =
            if self.signed { (-(1i64 << (bits - 1)), (1i64 << (bits - 1)) - 1) } else { (0, (1i64 << bits) - 1) };
        if value.fract() != 0.0 || !(low as f64..=high as f64).contains(&value) {
            return Err(format!("{value} is not a whole number within {low} to {high}"));
        }
        let unused = (4 - self.size) as u8;
        Ok(self.request(0x23 | unused << 2, (value as i64 as u32).to_le_bytes()))
    }

    fn request(self, command: u8, [a, b, c, d]: [u8; 4]) -> Frame {
        let [low, high] = self.index.to_le_bytes();
        frame(REQUEST + u16::from(NODE), [command, low, high, self.sub, a, b, c, d])
    }

    /// The answer about the object in a frame of the node; `None` if it is no reply to a request for it.
    pub(super) fn answer(self, frame: &Frame) -> Option<Result<Answer, String>> {
        let [command, low, high, sub, data @ ..] = frame.bytes();
        let is_reply = is(frame, REPLY + u16::from(NODE)) && [low, high] == self.index.to_le_bytes() && sub == self.sub;
        if !is_reply {
            return None;
        }
        Some(match command {
            0x60 => Ok(Answer::Written),
            0x80 => Ok(Answer::Aborted(u32::from_le_bytes(data))),
            0x43 | 0x47 | 0x4B | 0x4F => self.value(usize::from(4 - (command >> 2 & 3)), data),
            _ => Err(format!("the node answers with {command:#04X}, which is no expedited transfer")),
        })
    }

    fn value(self, size: usize, data: [u8; 4]) -> Result<Answer, String> {
        if size != self.size {
            return Err(format!("the object has {size} bytes, not {}; write another type", self.size));
        }
        let unused = 8 * (4 - size) as u32;
        let raised = u32::from_le_bytes(data) << unused;
        let value = if self.signed { i64::from(raised as i32 >> unused) } else { i64::from(raised >> unused) };
        Ok(Answer::Value(value))
    }
}

/// A whole number up to `most`.
fn whole(token: Option<Token>, most: u32) -> Option<u32> {
    match token {
        Some(Token::Number(number)) if number.fract() == 0.0 && number <= f64::from(most) => Some(number as u32),
        _ => None,
    }
}

/// A data frame with an identifier of 11 bits.
fn frame(id: u16, data: [u8; 8]) -> Frame {
    let id = StandardId::new(id).unwrap_or(StandardId::MAX);
    Frame::received(id.into(), false, 8, data)
}

/// Whether a frame has this identifier of 11 bits.
pub(super) fn is(frame: &Frame, id: u16) -> bool {
    matches!(frame.id(), Id::Standard(found) if found.as_raw() == id)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(text: &str) -> Object {
        Object::read(&mut Tokens::of(text).unwrap()).unwrap()
    }

    /// A reply of node 1.
    fn reply(bytes: [u8; 8]) -> Frame {
        frame(0x581, bytes)
    }

    #[test]
    fn requests_are_those_of_cia_301() {
        assert_eq!(object("0x6041:0 u16").upload().bytes(), [0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
        let written = object("0x6060:0 i8").download(-2.0).unwrap().bytes();
        assert_eq!(&written[..5], [0x2F, 0x60, 0x60, 0, 0xFE]);
        assert_eq!(object("0x607A:0 i32").download(-1.0).unwrap().bytes(), [0x23, 0x7A, 0x60, 0, 255, 255, 255, 255]);
        assert!(object("0x6060:0 i8").download(128.0).unwrap_err().contains("within -128 to 127"));
    }

    #[test]
    fn replies_have_signs_and_sizes() {
        let bytes = [0x4B, 0x41, 0x60, 0, 0xFE, 0xFF, 0, 0];
        assert_eq!(object("0x6041:0 i16").answer(&reply(bytes)), Some(Ok(Answer::Value(-2))));
        assert_eq!(object("0x6041:0 u16").answer(&reply(bytes)), Some(Ok(Answer::Value(0xFFFE))));
        assert!(object("0x6041:0 u32").answer(&reply(bytes)).unwrap().unwrap_err().contains("has 2 bytes, not 4"));
        assert_eq!(object("0x6041:1 u16").answer(&reply(bytes)), None);
        let abort = [0x80, 0x41, 0x60, 0, 0, 0, 2, 6];
        assert_eq!(object("0x6041:0 u16").answer(&reply(abort)), Some(Ok(Answer::Aborted(0x0602_0000))));
    }
}
