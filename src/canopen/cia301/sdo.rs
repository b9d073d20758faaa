//! The SDO server: one transfer at a time, expedited or in segments, and one reply to each request.

use core::task::Poll;

use heapless::Deque;

use super::abort::Abort;
use super::{Access, Description};

/// The data of a frame.
type Data = [u8; 8];

/// Longest object that is read, in bytes.
pub(crate) const LONGEST: usize = 16;
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

/// Index and sub-index, as they stand in a frame.
type Place = [u8; 3];

/// The transfer under way.
#[derive(Clone, Copy, Debug)]
enum Transfer<E> {
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
        entry: E,
        size: u8,
        data: Data,
        length: u8,
        announced: Option<u32>,
        toggle: u8,
    },
    /// The value that was written is being saved; then it is confirmed.
    Saving(Confirmation),
}

/// The demand that a request makes on the node, which answers.
#[derive(Debug)]
pub(crate) enum Asked<E> {
    /// Nothing: the reply, if there is one, waits to be sent.
    Nothing,
    /// Nothing, but the reply had no room, because the ones before have not been taken.
    Overflow,
    /// To read an object, and to [give](Server::give) what it is.
    Read(E, Place),
    /// To write these bytes to an object, and to [tell](Server::tell) what became of it.
    Write(E, Data, Confirmation),
}

/// How a download is confirmed that succeeds, and which object it names if it does not.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Confirmation {
    place: Place,
    /// The toggle bit of the last segment; `None` if the data came in one frame.
    segment: Option<u8>,
}

impl Confirmation {
    const fn reply(self) -> Data {
        let [low, high, sub] = self.place;
        match self.segment {
            Some(toggle) => [SEGMENT_TAKEN | toggle, 0, 0, 0, 0, 0, 0, 0],
            None => [DOWNLOADED, low, high, sub, 0, 0, 0, 0],
        }
    }
}

/// The server's state, and the replies that are still to be sent.
#[derive(Debug)]
pub(crate) struct Server<E> {
    transfer: Transfer<E>,
    replies: Deque<Data, REPLIES>,
}

impl<E> Default for Server<E> {
    fn default() -> Self {
        Server { transfer: Transfer::Idle, replies: Deque::new() }
    }
}

impl<E: Copy> Server<E> {
    /// The next reply to be sent.
    pub(crate) fn next(&mut self) -> Option<Data> {
        self.replies.pop_front()
    }

    /// True when no reply waits to be sent.
    pub(crate) fn is_empty(&self) -> bool {
        self.replies.is_empty()
    }

    /// Takes a request. `find` gives the object with an index and a sub-index, `describe` what there is to know of it.
    /// The former is told the length of what is to be written, if that is in the same frame.
    pub(crate) fn request(
        &mut self,
        frame: &[u8],
        find: impl Fn(u16, u8, Option<u32>) -> Result<E, Abort>,
        describe: impl Fn(E) -> Description,
    ) -> Asked<E> {
        match <Data>::try_from(frame) {
            Ok(request) => self.serve(request, find, describe),
            Err(_) => self.refuse_short(frame),
        }
    }

    /// The object that was to be read is a number of so many bytes, up to four, which go into one frame. Inlined,
    /// because nearly all that is read is one: an upload takes 30 cycles less.
    #[inline(always)]
    pub(crate) fn give_number(&mut self, place: Place, number: u32, size: u8) -> Asked<E> {
        let [low, high, sub] = place;
        let unused = 4_u8.saturating_sub(size);
        let mask = u32::MAX.unbounded_shr(u32::from(unused).saturating_mul(8));
        let [a, b, c, d] = (number & mask).to_le_bytes();
        self.reply([UPLOADED | unused << 2 | EXPEDITED | SIZED, low, high, sub, a, b, c, d])
    }

    /// The object that was to be read is this, which goes into segments, if one frame is not enough.
    #[inline(never)]
    pub(crate) fn give(&mut self, place: Place, value: &[u8]) -> Asked<E> {
        let [low, high, sub] = place;
        let mut data = [0; LONGEST];
        data.iter_mut().zip(value).for_each(|(to, from)| *to = *from);
        let length = value.len().min(LONGEST) as u8;
        if length <= 4 {
            let [a, b, c, d, ..] = data;
            return self.give_number(place, u32::from_le_bytes([a, b, c, d]), length);
        }
        self.transfer = Transfer::Upload { place, data, length, at: 0, toggle: 0 };
        self.reply([UPLOADED | SIZED, low, high, sub, length, 0, 0, 0])
    }

    /// Tells the server what became of an object that was to be written. Pending is one that is being saved:
    /// [`Server::conclude`] follows.
    pub(crate) fn tell(&mut self, confirmation: Confirmation, written: Result<Poll<()>, Abort>) -> Asked<E> {
        match written {
            Ok(Poll::Ready(())) => self.reply(confirmation.reply()),
            Ok(Poll::Pending) => {
                self.transfer = Transfer::Saving(confirmation);
                Asked::Nothing
            }
            Err(abort) => self.reply(refusal(confirmation.place, abort)),
        }
    }

    /// Ends a saving: what was to be saved is durable, or could not be written. The client that waits for it gets its
    /// reply.
    pub(crate) fn conclude(&mut self, result: Result<(), Abort>) {
        if let Transfer::Saving(confirmation) = self.transfer {
            self.transfer = Transfer::Idle;
            // Whoever waits has had no reply since, so there is room.
            self.tell(confirmation, result.map(Poll::Ready));
        }
    }

    fn reply(&mut self, reply: Data) -> Asked<E> {
        if self.replies.push_back(reply).is_ok() { Asked::Nothing } else { Asked::Overflow }
    }

    /// A request has eight bytes. A shorter one is refused; an abort stays an abort.
    fn refuse_short(&mut self, frame: &[u8]) -> Asked<E> {
        let mut bytes = frame.iter().copied();
        let mut next = || bytes.next().unwrap_or_default();
        let (command, place) = (next(), [next(), next(), next()]);
        let saving = matches!(self.transfer, Transfer::Saving(_));
        if !saving || command & 0xE0 == ABORT {
            self.transfer = Transfer::Idle;
        }
        if command & 0xE0 == ABORT { Asked::Nothing } else { self.reply(refusal(place, Abort::Command)) }
    }

    fn serve(
        &mut self,
        request: Data,
        find: impl Fn(u16, u8, Option<u32>) -> Result<E, Abort>,
        describe: impl Fn(E) -> Description,
    ) -> Asked<E> {
        let [command, low, high, sub, ..] = request;
        let place = [low, high, sub];
        let specifier = command >> 5;
        if command & 0xE0 == ABORT {
            self.transfer = Transfer::Idle;
            return Asked::Nothing;
        }
        if let Transfer::Saving(_) = self.transfer {
            return self.reply(refusal(place, Abort::State));
        }
        let transfer = core::mem::replace(&mut self.transfer, Transfer::Idle);
        let step = match (specifier, transfer) {
            (0, Transfer::Download { place, .. }) | (3, Transfer::Upload { place, .. }) => {
                let [command, segment @ ..] = request;
                let step = if specifier == 0 {
                    self.take_segment(transfer, command, segment)
                } else {
                    self.give_segment(transfer, command)
                };
                step.map_err(|abort| (place, abort))
            }
            (1, _) => self.begin_download(place, request, find, describe).map_err(|abort| (place, abort)),
            (2, _) => {
                let found = find(u16::from_le_bytes([low, high]), sub, None);
                found.map(|entry| Asked::Read(entry, place)).map_err(|abort| (place, abort))
            }
            // A segment of no transfer carries data where others have an index.
            (0 | 3, _) => Err(([0; 3], Abort::Command)),
            _ => Err((place, Abort::Command)),
        };
        step.unwrap_or_else(|(place, abort)| self.reply(refusal(place, abort)))
    }

    fn give_segment(&mut self, transfer: Transfer<E>, command: u8) -> Result<Asked<E>, Abort> {
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
            self.transfer = Transfer::Upload { place, data, length, at, toggle: toggle ^ TOGGLE };
        }
        Ok(self.reply(reply))
    }

    fn begin_download(
        &mut self,
        place: Place,
        request: Data,
        find: impl Fn(u16, u8, Option<u32>) -> Result<E, Abort>,
        describe: impl Fn(E) -> Description,
    ) -> Result<Asked<E>, Abort> {
        let [command, low, high, sub, number @ ..] = request;
        let number = u32::from_le_bytes(number);
        let (expedited, sized) = (command & EXPEDITED != 0, command & SIZED != 0);
        let announced = match (expedited, sized) {
            (true, true) => Some(4_u32.saturating_sub(u32::from(command >> 2 & 0b11))),
            (false, true) => Some(number),
            (_, false) => None,
        };
        let entry = find(u16::from_le_bytes([low, high]), sub, announced.filter(|_| expedited))?;
        let Description { size, access, .. } = describe(entry);
        if access == Access::Ro {
            return Err(Abort::ReadOnly);
        }
        match announced {
            Some(length) if length > size.into() => return Err(Abort::TooLong),
            Some(length) if length < size.into() => return Err(Abort::TooShort),
            None if expedited && size > 4 => return Err(Abort::TooShort),
            _ => {}
        }
        let confirmation = Confirmation { place, segment: None };
        if expedited {
            let [a, b, c, d] = number.to_le_bytes();
            return Ok(Asked::Write(entry, [a, b, c, d, 0, 0, 0, 0], confirmation));
        }
        let (data, length, toggle) = ([0; 8], 0, 0);
        self.transfer = Transfer::Download { place, entry, size, data, length, announced, toggle };
        Ok(self.reply(confirmation.reply()))
    }

    fn take_segment(&mut self, transfer: Transfer<E>, command: u8, segment: [u8; SEGMENT]) -> Result<Asked<E>, Abort> {
        let Transfer::Download { place, entry, size, mut data, length, announced, toggle } = transfer else {
            return Err(Abort::Command);
        };
        if command & TOGGLE != toggle {
            return Err(Abort::Toggle);
        }
        let count = SEGMENT.saturating_sub((command >> 1 & 0b111).into());
        let end = usize::from(length).saturating_add(count);
        if end > size.into() {
            return Err(Abort::TooLong);
        }
        for (to, from) in data.iter_mut().skip(length.into()).zip(segment.iter().take(count)) {
            *to = *from;
        }
        let confirmation = Confirmation { place, segment: Some(toggle) };
        if command & LAST == 0 {
            let (length, toggle) = (end as u8, toggle ^ TOGGLE);
            self.transfer = Transfer::Download { place, entry, size, data, length, announced, toggle };
            return Ok(self.reply(confirmation.reply()));
        }
        if end < size.into() {
            return Err(if announced.is_some() { Abort::Length } else { Abort::TooShort });
        }
        Ok(Asked::Write(entry, data, confirmation))
    }
}

/// The reply that ends a transfer.
fn refusal([low, high, sub]: Place, abort: Abort) -> Data {
    let [a, b, c, d] = abort.code().to_le_bytes();
    [ABORT, low, high, sub, a, b, c, d]
}
