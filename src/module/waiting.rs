//! Commands that wait for the store: each is answered once what it stored would survive a power cut, or when the EEPROM
//! has failed.

use heapless::{Deque, Vec};

use super::origin::{Due, Origin, Source};
use crate::executor::Undo;
use crate::store::{Memory, Need, Store};
use crate::tmcl::{Command, Reply, Status};
use crate::vm::Machine;

/// Number of links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Number of commands that can wait for the store: one per link, that of the program, and that of an interrupt handler
/// in it.
const COMMANDS: usize = LINKS + 2;

/// The one who waits for a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Waiter {
    /// A host, for the reply.
    Link(Origin),
    /// The program, to go on.
    Program,
    /// The link of the host that waited has been cut.
    Nobody,
}

impl Waiter {
    /// True for a host on this link.
    fn is_on(self, source: Source) -> bool {
        matches!(self, Waiter::Link(from) if from.source == source)
    }
}

/// A command that waits for the store.
#[derive(Clone, Copy, Debug)]
pub(super) struct WaitingCommand {
    pub(super) from: Waiter,
    pub(super) command: Command,
    /// The part of the EEPROM that has to be up to date.
    pub(super) need: Need,
    /// The value of the reply if all goes well.
    pub(super) value: i32,
    /// The change to take back if writing the EEPROM fails.
    pub(super) undo: Option<Undo>,
    /// Global parameter 255 suppresses the reply.
    pub(super) suppressed: bool,
}

/// The commands that wait, and their replies when these have become due.
#[derive(Debug, Default)]
pub(super) struct Waiting {
    commands: Vec<WaitingCommand, COMMANDS>,
    /// Replies that are due, oldest first: one per link.
    replies: Deque<Due, LINKS>,
}

impl Waiting {
    /// True while no command waits. Replies may be due all the same.
    pub(super) fn is_empty(&self) -> bool {
        self.commands.is_empty()
    }

    /// True while a link gets a reply that has not been fetched yet.
    pub(super) fn owes_replies(&self) -> bool {
        !self.replies.is_empty() || self.commands.iter().any(|waiting| matches!(waiting.from, Waiter::Link(_)))
    }

    /// True while a command of this link waits.
    #[inline(always)]
    pub(super) fn is_for(&self, source: Source) -> bool {
        !self.commands.is_empty() && self.has_of(source)
    }

    /// A function of its own, marked as cold: it is asked for each link before each request, and seldom something
    /// waits.
    #[cold]
    #[inline(never)]
    fn has_of(&self, source: Source) -> bool {
        self.commands.iter().any(|waiting| waiting.from.is_on(source))
    }

    /// Lets a command wait; false if there is no room for it.
    pub(super) fn push(&mut self, command: WaitingCommand) -> bool {
        self.commands.push(command).is_ok()
    }

    /// The next of the replies that have become due, oldest first.
    pub(super) fn next_reply(&mut self) -> Option<Due> {
        self.replies.pop_front()
    }

    /// Forgets the host at the other end of a link: nobody gets the replies.
    pub(super) fn forget(&mut self, source: Source) {
        for waiting in self.commands.iter_mut().filter(|waiting| waiting.from.is_on(source)) {
            waiting.from = Waiter::Nobody;
        }
        for _ in 0..self.replies.len() {
            if let Some(reply) = self.replies.pop_front().filter(|due| due.to.source != source) {
                // The queue has room: the entry has just been taken out of it.
                let _ = self.replies.push_back(reply);
            }
        }
    }

    /// Forgets the stores that the program was waiting for when it was stopped or reset.
    pub(super) fn forget_stores(&mut self, machine: &Machine) {
        let all = self.commands.iter().filter(|waiting| waiting.from == Waiter::Program).count();
        let mut stale = all.saturating_sub(machine.stores());
        self.commands.retain(|waiting| {
            let keep = waiting.from != Waiter::Program || stale == 0;
            stale = stale.saturating_sub(usize::from(!keep));
            keep
        });
    }

    /// Answers the commands whose part of the EEPROM is up to date; the program goes on behind its own.
    pub(super) fn settle<M: Memory>(&mut self, store: &Store<M>, machine: &mut Machine) {
        if self.commands.is_empty() {
            return;
        }
        for need in [Need::Settings, Need::Program] {
            if store.settled(need) {
                self.release(Status::Ok, Some(need), machine);
            }
        }
    }

    /// The changes that the waiting commands have to take back if settings cannot be written, the last command first.
    pub(super) fn undos(&self) -> impl Iterator<Item = Undo> {
        self.commands.iter().rev().filter_map(|waiting| waiting.undo)
    }

    /// Answers commands with status 5, because a part of the EEPROM cannot be written. The state of the program is
    /// among the settings: if they cannot be written, it is not stored either.
    pub(super) fn fail(&mut self, failed: Need, machine: &mut Machine) {
        let need = if failed == Need::Settings { None } else { Some(failed) };
        self.release(Status::EepromLocked, need, machine);
    }

    /// Answers the waiting commands that need this part of the EEPROM, or all of them. Never inlined: it is long, and
    /// seldom something waits.
    #[inline(never)]
    fn release(&mut self, status: Status, need: Option<Need>, machine: &mut Machine) {
        let Waiting { commands, replies } = self;
        commands.retain(|waiting| {
            if need.is_some_and(|need| waiting.need != need) {
                return true;
            }
            let WaitingCommand { from, command, value, suppressed, .. } = *waiting;
            let value = if status == Status::Ok { value } else { command.value };
            match from {
                Waiter::Program => machine.stored(),
                Waiter::Nobody => {}
                Waiter::Link(to) => {
                    let reply = Reply::Plain { status, opcode: command.opcode, value };
                    // A link has at most one command that waits, so the queue has room.
                    let _ = replies.push_back(Due { to, reply: (!suppressed).then_some(reply) });
                }
            }
            false
        });
    }
}
