//! The frames that wait for the mailboxes of a CAN controller which sends the lowest identifier of its mailboxes first.
//!
//! A frame never waits behind one with a higher identifier. On a busy bus the mailboxes may all hold frames that lose
//! against those of others again and again. Then one of them is called back for a frame with a lower identifier. Frames
//! with the same identifier keep their order. For this only one of them is in a mailbox at a time, because the
//! controller would choose by the number of the mailbox.

use heapless::Vec;

use super::{CanFrame, Frame, Id};

/// Number of mailboxes.
pub const MAILBOXES: usize = 3;
/// Number of frames that can wait for a mailbox.
const WAITING: usize = 16;

/// The next step at the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// The frame is to be put into this mailbox, which is free.
    Send(usize, Frame),
    /// The frame in this mailbox is to be called back, unless it is being sent. In either case the mailbox
    /// [ends](Outbox::ended).
    Abort(usize),
}

/// A frame with its turn among those with the same identifier.
#[derive(Clone, Copy, Debug)]
struct Letter {
    frame: Frame,
    turn: u32,
}

/// A frame in a mailbox.
#[derive(Clone, Copy, Debug)]
struct Posted {
    letter: Letter,
    /// True while the frame is being called back.
    recalled: bool,
    /// Nobody wants it any more: it does not come back.
    dropped: bool,
}

/// Frames on their way out.
#[derive(Debug)]
pub struct Outbox {
    /// The frames that are in no mailbox, in no order.
    waiting: Vec<Letter, WAITING>,
    mailboxes: [Option<Posted>; MAILBOXES],
    /// The turn of the next frame.
    turn: u32,
}

impl Default for Outbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Outbox {
    /// No frames, and free mailboxes.
    pub const fn new() -> Self {
        Outbox { waiting: Vec::new(), mailboxes: [None; MAILBOXES], turn: 0 }
    }

    /// True if another frame can wait, even if all frames in mailboxes come back.
    pub fn has_room(&self) -> bool {
        self.waiting.len().saturating_add(MAILBOXES) < WAITING
    }

    /// True while no frame is on its way.
    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty() && self.mailboxes.iter().all(Option::is_none)
    }

    /// True while frames wait for a mailbox.
    pub fn waits(&self) -> bool {
        !self.waiting.is_empty()
    }

    /// Takes a frame for which nothing has to wait, as a rule: it is to be put into the mailbox that is returned.
    /// `None` if it has to wait, for which it is to be [pushed](Self::push).
    #[inline]
    pub fn post(&mut self, frame: &Frame) -> Option<usize> {
        if self.waits() || self.mailboxes.iter().flatten().any(|posted| posted.letter.frame.id() == frame.id()) {
            return None;
        }
        let (number, mailbox) = self.mailboxes.iter_mut().enumerate().find(|(_, mailbox)| mailbox.is_none())?;
        self.turn = self.turn.wrapping_add(1);
        let letter = Letter { frame: *frame, turn: self.turn };
        *mailbox = Some(Posted { letter, recalled: false, dropped: false });
        Some(number)
    }

    /// Takes a frame, behind those with the same identifier. False if there is no room for it.
    pub fn push(&mut self, frame: &Frame) -> bool {
        self.turn = self.turn.wrapping_add(1);
        self.waiting.push(Letter { frame: *frame, turn: self.turn }).is_ok()
    }

    /// Returns the next step; to be asked for until there is none.
    pub fn step(&mut self) -> Option<Step> {
        let posted = |id: Id| self.mailboxes.iter().flatten().any(|posted| posted.letter.frame.id() == id);
        let ready = self.waiting.iter().enumerate().filter(|(_, letter)| !posted(letter.frame.id()));
        let (first, letter) = ready.min_by_key(|(_, letter)| (rank(&letter.frame), letter.turn))?;
        let letter = *letter;
        if let Some((number, mailbox)) = self.mailboxes.iter_mut().enumerate().find(|(_, mailbox)| mailbox.is_none()) {
            *mailbox = Some(Posted { letter, recalled: false, dropped: false });
            if let (Some(other), Some(place)) = (self.waiting.pop(), self.waiting.get_mut(first)) {
                *place = other;
            }
            return Some(Step::Send(number, letter.frame));
        }
        // One at a time: the mailbox that becomes free is for this frame.
        if self.mailboxes.iter().flatten().any(|posted| posted.recalled) {
            return None;
        }
        let all = self.mailboxes.iter_mut().flatten().enumerate();
        let (number, last) = all.max_by_key(|(_, posted)| rank(&posted.letter.frame))?;
        if rank(&last.letter.frame) <= rank(&letter.frame) {
            return None;
        }
        last.recalled = true;
        Some(Step::Abort(number))
    }

    /// Tells that a mailbox is free again: its frame was sent, or it was called back in time.
    pub fn ended(&mut self, mailbox: usize, sent: bool) {
        let Some(posted) = self.mailboxes.get_mut(mailbox).and_then(Option::take) else { return };
        if !sent && !posted.dropped {
            // There is room for it: see `has_room`.
            let _ = self.waiting.push(posted.letter);
        }
    }

    /// Drops all frames. The mailboxes that hold one are to be called back.
    pub fn clear(&mut self) -> impl Iterator<Item = usize> {
        self.waiting.clear();
        let posted = (0..).zip(&mut self.mailboxes).filter_map(|(number, mailbox)| Some((number, mailbox.as_mut()?)));
        posted.map(|(number, posted)| {
            (posted.recalled, posted.dropped) = (true, true);
            number
        })
    }
}

/// The rank of a frame on the bus, which lets the frame with the lower rank pass. The first bits of a long identifier
/// are compared with a short one.
fn rank(frame: &Frame) -> u32 {
    match frame.id() {
        Id::Standard(id) => u32::from(id.as_raw()) << 19,
        Id::Extended(id) => id.as_raw() << 1 | 1,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(id: u16, byte: u8) -> Frame {
        Frame::standard(id, &[byte]).unwrap()
    }

    /// An outbox with these frames, each of whose steps has been taken.
    fn outbox(ids: &[u16]) -> (Outbox, Vec<Step, 16>) {
        let mut outbox = Outbox::new();
        let mut steps = Vec::new();
        for id in ids {
            assert!(outbox.push(&frame(*id, 0)));
            steps.extend(std::iter::from_fn(|| outbox.step()));
        }
        (outbox, steps)
    }

    #[test]
    fn frames_go_into_free_mailboxes_and_then_wait_lowest_first() {
        let (mut outbox, steps) = outbox(&[5, 7, 6, 9, 8]);
        assert_eq!(steps, [Step::Send(0, frame(5, 0)), Step::Send(1, frame(7, 0)), Step::Send(2, frame(6, 0))]);
        assert!(outbox.waits());
        outbox.ended(0, true);
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(8, 0))));
        outbox.ended(1, true);
        assert_eq!(outbox.step(), Some(Step::Send(1, frame(9, 0))));
        assert_eq!((outbox.step(), outbox.waits(), outbox.is_empty()), (None, false, false));
        (0..MAILBOXES).for_each(|mailbox| outbox.ended(mailbox, true));
        assert!(outbox.is_empty());
    }

    #[test]
    fn a_low_identifier_calls_the_highest_back_which_comes_after_it() {
        let (mut outbox, steps) = outbox(&[0x701, 0x581, 0x481, 0x81]);
        assert_eq!(steps[3..], [Step::Abort(0)]);
        // Until it is back nothing else is called back, though it be lower still.
        assert!(outbox.push(&frame(0x80, 0)));
        assert_eq!(outbox.step(), None);
        outbox.ended(0, false);
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(0x80, 0))));
        assert_eq!(outbox.step(), Some(Step::Abort(1)));
        // This one was on the bus already.
        outbox.ended(1, true);
        assert_eq!(outbox.step(), Some(Step::Send(1, frame(0x81, 0))));
        assert_eq!(outbox.step(), None);
        (0..MAILBOXES).for_each(|mailbox| outbox.ended(mailbox, true));
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(0x701, 0))));
    }

    #[test]
    fn frames_with_the_same_identifier_keep_their_order() {
        let mut outbox = Outbox::new();
        for byte in 1..=3 {
            assert!(outbox.push(&frame(0x81, byte)));
        }
        assert!(outbox.push(&frame(0x90, 0)));
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(0x81, 1))));
        assert_eq!(outbox.step(), Some(Step::Send(1, frame(0x90, 0))));
        assert_eq!(outbox.step(), None);
        for id in [0x70, 0x60] {
            assert!(outbox.push(&frame(id, 0)));
        }
        assert_eq!(outbox.step(), Some(Step::Send(2, frame(0x60, 0))));
        assert_eq!(outbox.step(), Some(Step::Abort(1)));
        outbox.ended(1, false);
        assert_eq!(outbox.step(), Some(Step::Send(1, frame(0x70, 0))));
        // Called back, the first of them is the first again.
        assert!(outbox.push(&frame(0x50, 0)));
        assert_eq!(outbox.step(), Some(Step::Abort(0)));
        outbox.ended(0, false);
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(0x50, 0))));
        for byte in 1..=3 {
            outbox.ended(1, true);
            assert_eq!(outbox.step(), Some(Step::Send(1, frame(0x81, byte))));
        }
    }

    #[test]
    fn a_frame_goes_at_once_unless_another_is_before_it_or_no_mailbox_is_free() {
        let mut outbox = Outbox::new();
        assert_eq!((outbox.post(&frame(5, 1)), outbox.post(&frame(5, 2))), (Some(0), None));
        assert_eq!((outbox.post(&frame(4, 0)), outbox.post(&frame(6, 0))), (Some(1), Some(2)));
        assert_eq!(outbox.post(&frame(3, 0)), None);
        outbox.ended(1, true);
        assert!(outbox.push(&frame(5, 2)));
        assert_eq!((outbox.post(&frame(3, 0)), outbox.step()), (None, None));
        // Called back, it is the first with its identifier again.
        outbox.ended(0, false);
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(5, 1))));
    }

    #[test]
    fn what_is_dropped_does_not_come_back() {
        let (mut outbox, _) = outbox(&[5, 6, 7, 8]);
        outbox.ended(1, true);
        assert_eq!(outbox.clear().collect::<Vec<_, 3>>(), [0, 2]);
        assert!(outbox.push(&frame(1, 0)));
        assert_eq!(outbox.step(), Some(Step::Send(1, frame(1, 0))));
        assert!(outbox.push(&frame(2, 0)));
        assert_eq!(outbox.step(), None);
        outbox.ended(0, false);
        outbox.ended(2, true);
        assert_eq!(outbox.step(), Some(Step::Send(0, frame(2, 0))));
        assert_eq!((outbox.step(), outbox.waits()), (None, false));
    }

    #[test]
    fn there_is_room_for_all_that_come_back() {
        let mut outbox = Outbox::new();
        let mut id = 0x7FF;
        while outbox.has_room() {
            assert!(outbox.push(&frame(id, 0)));
            while let Some(Step::Send(..)) = outbox.step() {}
            id -= 1;
        }
        assert!(outbox.waits());
        let before = outbox.waiting.len();
        (0..MAILBOXES).for_each(|mailbox| outbox.ended(mailbox, false));
        assert_eq!(outbox.waiting.len(), before + MAILBOXES);
    }
}
