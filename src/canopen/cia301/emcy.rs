//! Emergency messages on their way: the queue, with its inhibit time (1015h).

use heapless::Deque;

use crate::units::Micros;

/// Number of messages that wait for the inhibit time; what comes when they are as many shows in the error register
/// alone.
const QUEUE: usize = 8;

/// The messages that are still to be sent.
#[derive(Debug, Default)]
pub(crate) struct Messages {
    /// Their data, oldest first.
    queue: Deque<[u8; 8], QUEUE>,
    /// So many of them, the oldest ones, are sent although the node is stopped: they tell why it has stopped itself.
    farewell: usize,
    /// When the last message was sent.
    sent: Option<Micros>,
}

impl Messages {
    /// Puts a message into the queue. CiA 301 lets the newest be lost when there are too many.
    pub(crate) fn push(&mut self, message: [u8; 8]) {
        let _ = self.queue.push_back(message);
    }

    /// The node stops itself; the messages that wait are still sent.
    pub(crate) fn say_farewell(&mut self) {
        self.farewell = self.queue.len();
    }

    /// True if a message waits that the node sends, stopped or not.
    pub(crate) fn wait(&self, is_stopped: bool) -> bool {
        !self.queue.is_empty() && (self.farewell > 0 || !is_stopped)
    }

    /// Takes the next message, which is being sent at `now`; `None` also within the inhibit time after the one before.
    pub(crate) fn take(&mut self, now: Micros, inhibit: Micros) -> Option<[u8; 8]> {
        if self.sent.is_some_and(|sent| now.since(sent) < inhibit) {
            return None;
        }
        let message = self.queue.pop_front()?;
        self.farewell = self.farewell.saturating_sub(1);
        self.sent = Some(now);
        Some(message)
    }

    /// Drops the messages that wait.
    pub(crate) fn drop_all(&mut self) {
        self.queue.clear();
        self.farewell = 0;
    }
}
