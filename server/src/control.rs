//! A connection to the control port: one line of text in, one line of JSON out, and lines of a watch in between.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::time::{Duration, Instant};

use hal_sim::clock::Nanos;
use rustix::event::PollFlags;
use rustix::fd::BorrowedFd;
use tmcl_tools::desk::{ControllerId, Outcome, Told, Watch, Watcher, answer};
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;

use crate::stream::{Input, Stream};
use crate::tcp::{Guest, MOST_CONNECTIONS};

/// Longest line; nothing of the protocol comes near it.
const LONGEST_LINE: usize = 4096;
/// Lines of a client that are carried out in a turn of the simulator: those of all clients together hold up nobody.
const LINES: usize = 4;
/// Most bytes that wait for a client for which a line of its watch is added. It is less than what waits at most, so
/// that there is room for the answer to a line.
const MOST_WAITING: usize = 32 * 1024;
/// A step waits for a client that watches as long as it reads so many bytes in so much time by the clock. A client that
/// reads nothing gets some, too, because the system finds room for them.
const PATIENCE: Duration = Duration::from_secs(1);
const LEAST_READ: u64 = 256 * 1024;

/// A connection to the control port.
#[derive(Debug)]
pub struct Controller {
    /// Number of the connection.
    pub id: ControllerId,
    /// Lines in, answers out.
    stream: Stream<TcpStream>,
    /// Bytes that have come and that nobody has looked at.
    unread: VecDeque<u8>,
    line: Vec<u8>,
    /// When the last line came, or the connection.
    heard: Instant,
    /// The answer to a line comes later; further lines wait until it has come.
    owed: bool,
    /// The watch, whose lines are told as time passes.
    watch: Option<Watch>,
    /// When it was looked last how much the client reads, and how much was written by then.
    looked: (Instant, u64),
}

impl Controller {
    /// A new connection.
    pub fn new(id: ControllerId, stream: Stream<TcpStream>) -> Self {
        let (unread, line) = (VecDeque::new(), Vec::new());
        let now = Instant::now();
        Controller { id, stream, unread, line, heard: now, owed: false, watch: None, looked: (now, 0) }
    }

    /// Takes what has arrived and answers some lines, each with what `execute` makes of it. While answers wait for a
    /// client that does not read them, no more of its lines are taken.
    pub fn receive(&mut self, mut execute: impl FnMut(ControllerId, &str) -> Result<Outcome, String>) {
        if self.wants_more() {
            let mut buffer = [0; LONGEST_LINE];
            match self.stream.read(&mut buffer) {
                Input::Bytes(count) => self.unread.extend(buffer.iter().take(count)),
                // A last line may come without its end.
                Input::Ended if !self.line.is_empty() => self.unread.push_back(b'\n'),
                Input::Ended | Input::Held | Input::Nothing => {}
            }
        }
        let mut lines = 0;
        while lines < LINES
            && self.has_unread()
            && let Some(byte) = self.unread.pop_front()
        {
            if byte == b'\n' {
                self.take_line(&mut execute);
                lines += 1;
            } else if self.line.len() <= LONGEST_LINE {
                self.line.push(byte);
            }
        }
    }

    fn take_line(&mut self, execute: impl FnOnce(ControllerId, &str) -> Result<Outcome, String>) {
        self.heard = Instant::now();
        let line = std::mem::take(&mut self.line);
        let text = String::from_utf8_lossy(&line);
        // One character more than that is kept of a longer one.
        let too_long = line.len() > LONGEST_LINE;
        let outcome = if too_long {
            Err(format!("a line has {LONGEST_LINE} characters at most"))
        } else {
            execute(self.id, &text)
        };
        self.owed = matches!(outcome, Ok(Outcome::Later));
        match outcome {
            Ok(Outcome::Later) => {}
            Ok(Outcome::Done(told)) => self.answer(Ok(told)),
            Ok(Outcome::Watch(watch)) => {
                self.answer(Ok(Some(Told::time(watch.begun()))));
                self.watch = Some(watch);
            }
            Ok(Outcome::Unwatch) => {
                self.watch = None;
                self.answer(Ok(None));
            }
            Err(error) => self.answer(Err(error)),
        }
    }

    /// Answers the line whose turn it is.
    pub fn answer(&mut self, result: Result<Option<Told>, String>) {
        self.owed = false;
        self.write(&answer(result));
    }

    fn write(&mut self, line: &str) {
        self.stream.write(format!("{line}\n").as_bytes());
    }

    /// Ends the watch, if there is one, for a reason that the client is told.
    pub fn end_watch(&mut self, why: &'static str) {
        if self.watch.take().is_some() {
            self.write(&Watch::ended(why));
        }
    }

    /// Writes what waits. True once there is nothing more to be done.
    pub fn finish(&mut self) -> bool {
        self.stream.flush();
        // A client that sends nothing more may still wait for an answer, or read what it watches.
        let is_served = self.unread.is_empty() && !self.owed && self.watch.is_none();
        self.stream.broken() || self.stream.ended() && self.stream.drained() && is_served
    }

    /// The descriptor and events to wait for, as [`Stream::interest`] has them.
    pub fn interest(&self) -> Option<(BorrowedFd<'_>, PollFlags)> {
        self.stream.interest(!self.wants_more())
    }

    /// Something that has come waits for the next turn, and for nothing else.
    pub fn has_unread(&self) -> bool {
        !self.unread.is_empty() && !self.owed && !self.stream.is_full()
    }

    fn wants_more(&self) -> bool {
        self.unread.is_empty() && !self.owed && !self.stream.is_full()
    }
}

impl Watcher for Controller {
    /// When the next line of the watch is due.
    fn watch_due(&self) -> Option<Nanos> {
        self.watch.as_ref().map(Watch::due)
    }

    /// Writes the lines of the watch that are due. Those for which the client has left no room are lost, but counted.
    /// The room behind them is that of an answer.
    fn tell(&mut self, fleet: &mut Fleet<impl VirtualModule>) {
        let Some(watch) = &mut self.watch else { return };
        while watch.due() <= fleet.now() {
            if self.stream.waiting() < MOST_WAITING {
                let line = watch.take(fleet);
                self.stream.write(format!("{line}\n").as_bytes());
            } else {
                watch.miss();
            }
        }
    }

    /// True if the next line of the watch would be lost, because the client, which goes on reading, has not read those
    /// before.
    fn is_behind(&mut self) -> bool {
        let has_room = self.stream.waiting() < MOST_WAITING || self.stream.broken();
        let Some(watch) = self.watch.as_mut().filter(|watch| watch.is_awaited() && !has_room) else { return false };
        let (since, written) = self.looked;
        if since.elapsed() >= PATIENCE {
            self.looked = (Instant::now(), self.stream.written());
            // A look that is older is one at another time of waiting.
            if since.elapsed() < 2 * PATIENCE && self.stream.written() - written < LEAST_READ {
                watch.forgo();
            }
        }
        watch.is_awaited()
    }
}

impl Guest for Controller {
    fn idle_since(&self) -> Option<Instant> {
        // Who watches says nothing, and is there all the same, unless it has closed its side.
        let is_served = !self.owed && (self.watch.is_none() || self.stream.ended());
        (self.unread.is_empty() && self.stream.drained() && is_served).then_some(self.heard)
    }

    fn dismiss(mut self) {
        let why = format!("closed: there are {MOST_CONNECTIONS} connections, and no more at one time");
        self.stream.write((answer(Err(why)) + "\n").as_bytes());
    }
}
