//! The SDO server: one transfer at a time, expedited or in segments, and one reply to each request.

use core::task::Poll;

use heapless::Deque;

use super::Node;
use super::abort::Abort;
use super::object::{Entry, Object};
use super::read::Value;
use super::row::{Access, Type};
use super::store::Tmcm1140;
use crate::device::Board;

/// The data of a frame.
type Data = [u8; 8];

/// Longest object that is read, in bytes.
const LONGEST: usize = 16;
/// Number of replies that can wait to be sent.
const REPLIES: usize = 4;
/// Data bytes of a segment.
const SEGMENT: usize = 7;

/// Bit of a segment that changes with each.
const TOGGLE: u8 = 1 << 4;
/// Reply to a download, or to a segment of it.
const DOWNLOADED: u8 = 3 << 5;
const SEGMENT_TAKEN: u8 = 1 << 5;
/// Reply to an upload.
const UPLOADED: u8 = 2 << 5;
/// An upload or a download: the data are in the frame itself.
const EXPEDITED: u8 = 1 << 1;
/// An upload or a download: the length of the data is in the frame.
const SIZED: u8 = 1;
/// A segment is the last one.
const LAST: u8 = 1;
/// A transfer ends without success.
const ABORT: u8 = 4 << 5;

/// The transfer under way.
#[derive(Clone, Copy, Debug)]
enum Transfer {
    Idle,
    /// The client takes segments.
    Upload {
        place: Place,
        data: [u8; LONGEST],
        length: u8,
        at: u8,
        toggle: u8,
    },
    /// The client brings segments.
    Download {
        place: Place,
        entry: Entry,
        data: Data,
        length: u8,
        announced: Option<u32>,
        toggle: u8,
    },
    /// What was written is being saved; then it is confirmed with this reply.
    Saving {
        place: Place,
        reply: Data,
    },
}

/// Index and sub-index, as they stand in a frame.
type Place = [u8; 3];

/// The server's state, and the replies that are still to be sent.
#[derive(Debug)]
pub(super) struct Server {
    transfer: Transfer,
    replies: Deque<Data, REPLIES>,
}

impl Default for Server {
    fn default() -> Self {
        Server { transfer: Transfer::Idle, replies: Deque::new() }
    }
}

impl Server {
    /// The next reply to be sent.
    pub(super) fn next(&mut self) -> Option<Data> {
        self.replies.pop_front()
    }

    /// True when no reply waits to be sent.
    pub(super) fn is_empty(&self) -> bool {
        self.replies.is_empty()
    }

    /// What was to be saved is durable, or could not be written: the client that waits for it gets its reply.
    pub(super) fn conclude(&mut self, result: Result<(), Abort>) {
        if let Transfer::Saving { place, reply } = self.transfer {
            self.transfer = Transfer::Idle;
            // Whoever waits has had no reply since, so there is room.
            let _ = self.replies.push_back(result.map_or_else(|abort| refusal(place, abort), |()| reply));
        }
    }
}

/// The reply that ends a transfer.
fn refusal([low, high, sub]: Place, abort: Abort) -> Data {
    let [a, b, c, d] = abort.code().to_le_bytes();
    [ABORT, low, high, sub, a, b, c, d]
}

/// The confirmation of a download.
const fn confirmation([low, high, sub]: Place) -> Data {
    [DOWNLOADED, low, high, sub, 0, 0, 0, 0]
}

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Takes a request. False if its reply has no room, because the ones before have not been taken.
    pub(super) fn request(&mut self, frame: &[u8]) -> bool {
        let reply = match <Data>::try_from(frame) {
            Ok(request) => self.serve(request),
            Err(_) => self.refuse_short(frame),
        };
        reply.is_none_or(|reply| self.server.replies.push_back(reply).is_ok())
    }

    /// A request has eight bytes. A shorter one is refused; an abort stays an abort.
    fn refuse_short(&mut self, frame: &[u8]) -> Option<Data> {
        let mut bytes = frame.iter().copied();
        let mut next = || bytes.next().unwrap_or_default();
        let (command, place) = (next(), [next(), next(), next()]);
        let saving = matches!(self.server.transfer, Transfer::Saving { .. });
        if !saving || command & 0xE0 == ABORT {
            self.server.transfer = Transfer::Idle;
        }
        (command & 0xE0 != ABORT).then(|| refusal(place, Abort::Command))
    }

    fn serve(&mut self, request: Data) -> Option<Data> {
        let [command, low, high, sub, ..] = request;
        let place = [low, high, sub];
        let specifier = command >> 5;
        if command & 0xE0 == ABORT {
            self.server.transfer = Transfer::Idle;
            return None;
        }
        if let Transfer::Saving { .. } = self.server.transfer {
            return Some(refusal(place, Abort::State));
        }
        let transfer = core::mem::replace(&mut self.server.transfer, Transfer::Idle);
        let reply = match (specifier, transfer) {
            (0, Transfer::Download { place, .. }) | (3, Transfer::Upload { place, .. }) => {
                let [command, segment @ ..] = request;
                let reply = if specifier == 0 {
                    self.take_segment(transfer, command, segment)
                } else {
                    self.give_segment(transfer, command)
                };
                reply.map_err(|abort| (place, abort))
            }
            (1, _) => self.begin_download(place, request).map_err(|abort| (place, abort)),
            (2, _) => self.begin_upload(place).map_err(|abort| (place, abort)),
            // A segment of no transfer carries data where others have an index.
            (0 | 3, _) => Err(([0; 3], Abort::Command)),
            _ => Err((place, Abort::Command)),
        };
        match reply {
            Ok(reply) => reply,
            Err((place, abort)) => Some(refusal(place, abort)),
        }
    }

    fn begin_upload(&mut self, place: Place) -> Result<Option<Data>, Abort> {
        let [low, high, sub] = place;
        let entry = Entry::find(u16::from_le_bytes([low, high]), sub)?;
        let mut data = [0; LONGEST];
        let mut fill = |bytes: &[u8]| {
            data.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
            bytes.len()
        };
        let length = match self.read(entry) {
            Value::Number(number) => {
                fill(&number.to_le_bytes());
                entry.row().data.size()
            }
            Value::Long(number) => fill(&number.to_le_bytes()),
            Value::Text(text) => fill(text.as_bytes()),
            Value::Octets(octets) => fill(&octets),
        };
        let length = length.min(LONGEST) as u8;
        if let Some(unused @ 0..=3) = 4_u8.checked_sub(length) {
            let [a, b, c, d, ..] = data;
            let mask = u32::MAX.unbounded_shr(u32::from(unused).saturating_mul(8));
            let [a, b, c, d] = (u32::from_le_bytes([a, b, c, d]) & mask).to_le_bytes();
            return Ok(Some([UPLOADED | unused << 2 | EXPEDITED | SIZED, low, high, sub, a, b, c, d]));
        }
        self.server.transfer = Transfer::Upload { place, data, length, at: 0, toggle: 0 };
        Ok(Some([UPLOADED | SIZED, low, high, sub, length, 0, 0, 0]))
    }

    fn give_segment(&mut self, transfer: Transfer, command: u8) -> Result<Option<Data>, Abort> {
        let Transfer::Upload { place, data, length, at, toggle } = transfer else { return Err(Abort::Command) };
        if command & TOGGLE != toggle {
            return Err(Abort::Toggle);
        }
        let mut reply = [0; 8];
        let [head, segment @ ..] = &mut reply;
        let rest = data.iter().take(length.into()).skip(at.into());
        segment.iter_mut().zip(rest).for_each(|(to, from)| *to = *from);
        let count = length.saturating_sub(at).min(SEGMENT as u8);
        let at = at.saturating_add(count);
        let last = at >= length;
        *head = toggle | (SEGMENT as u8).saturating_sub(count) << 1 | if last { LAST } else { 0 };
        if !last {
            self.server.transfer = Transfer::Upload { place, data, length, at, toggle: toggle ^ TOGGLE };
        }
        Ok(Some(reply))
    }

    fn begin_download(&mut self, place: Place, request: Data) -> Result<Option<Data>, Abort> {
        let [command, low, high, sub, number @ ..] = request;
        let mut entry = Entry::find(u16::from_le_bytes([low, high]), sub)?;
        let number = u32::from_le_bytes(number);
        let (expedited, sized) = (command & EXPEDITED != 0, command & SIZED != 0);
        let announced = match (expedited, sized) {
            (true, true) => Some(4_u32.saturating_sub(u32::from(command >> 2 & 0b11))),
            (false, true) => Some(number),
            (_, false) => None,
        };
        // The manual's table has this object at sub-index 0, its text at sub-index 1.
        if entry.object == Object::StoreCount && expedited && announced == Some(4) {
            entry = Entry::of(Object::StoreCommunication);
        }
        if entry.row().access == Access::Ro {
            return Err(Abort::ReadOnly);
        }
        let size = entry.row().data.size();
        match announced.map(|length| usize::try_from(length).unwrap_or(usize::MAX)) {
            Some(length) if length > size => return Err(Abort::TooLong),
            Some(length) if length < size => return Err(Abort::TooShort),
            None if expedited && size > 4 => return Err(Abort::TooShort),
            _ => {}
        }
        let reply = confirmation(place);
        if expedited {
            return self.finish_download(place, entry, number, reply);
        }
        let (data, length, toggle) = ([0; 8], 0, 0);
        self.server.transfer = Transfer::Download { place, entry, data, length, announced, toggle };
        Ok(Some(reply))
    }

    fn take_segment(&mut self, transfer: Transfer, command: u8, segment: [u8; SEGMENT]) -> Result<Option<Data>, Abort> {
        let Transfer::Download { place, entry, mut data, length, announced, toggle } = transfer else {
            return Err(Abort::Command);
        };
        if command & TOGGLE != toggle {
            return Err(Abort::Toggle);
        }
        let count = SEGMENT.saturating_sub((command >> 1 & 0b111).into());
        let size = entry.row().data.size();
        let end = usize::from(length).saturating_add(count);
        if end > size {
            return Err(Abort::TooLong);
        }
        for (to, from) in data.iter_mut().skip(length.into()).zip(segment.iter().take(count)) {
            *to = *from;
        }
        let reply = [SEGMENT_TAKEN | toggle, 0, 0, 0, 0, 0, 0, 0];
        if command & LAST == 0 {
            let (length, toggle) = (end as u8, toggle ^ TOGGLE);
            self.server.transfer = Transfer::Download { place, entry, data, length, announced, toggle };
            return Ok(Some(reply));
        }
        if end < size {
            return Err(if announced.is_some() { Abort::Length } else { Abort::TooShort });
        }
        if entry.object == Object::OsCommand {
            let [command @ .., _] = data;
            return self.execute(command).map(|()| Some(reply));
        }
        let [a, b, c, d, ..] = data;
        self.finish_download(place, entry, u32::from_le_bytes([a, b, c, d]), reply)
    }

    /// Writes the object. The reply comes at once, or when what is saved is durable.
    fn finish_download(&mut self, place: Place, entry: Entry, bytes: u32, reply: Data) -> Result<Option<Data>, Abort> {
        let data: Type = entry.row().data;
        match self.write(entry, data.extend(bytes))? {
            Poll::Ready(()) => Ok(Some(reply)),
            Poll::Pending => {
                self.server.transfer = Transfer::Saving { place, reply };
                Ok(None)
            }
        }
    }
}
