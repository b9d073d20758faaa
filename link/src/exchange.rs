//! A request goes out over a device in non-blocking mode, and its reply comes in, or not in time.

use std::io::{ErrorKind, Read, Write};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

use tmcl_tools::wire::{LinkError, Tap};
use tmcm::tmcl::binary::{TELEGRAM, Telegram};

use super::{Question, lost};
use crate::poll::readable;
use crate::signal::Wait;

/// After a signal a reply is waited for no longer than this: a module that works has answered by then, and what talks to it
/// ends as it should.
const GRACE: Duration = Duration::from_millis(500);
/// Time between two looks for a signal.
const LOOK: Duration = Duration::from_millis(50);
/// Most reads of what has come before a request, so that somebody who never stops talking is no end of it.
pub(super) const STALE_READS: usize = 256;

/// The wait for a reply, which a time-out ends, or soon after it has come a signal.
#[derive(Debug)]
pub(super) struct Patience {
    until: Instant,
    wait: Wait,
    /// When the wait ends because of a signal, and its number.
    grace: Option<(Instant, u8)>,
}

impl Patience {
    /// The wait begins.
    pub(super) fn begin(timeout: Duration) -> Self {
        Patience { until: Instant::now() + timeout, wait: Wait::begin(), grace: None }
    }

    /// True if the time is over.
    pub(super) fn is_over(&self) -> bool {
        Instant::now() >= self.until
    }

    /// Waits until a descriptor can be read. False if it cannot be read in time.
    pub(super) fn readable(&mut self, fd: &impl AsFd) -> Result<bool, LinkError> {
        loop {
            let now = Instant::now();
            if let (None, Some(signal)) = (self.grace, self.wait.signal()) {
                self.grace = Some((now + GRACE, signal));
            }
            if readable(fd, self.until.min(now + LOOK)).map_err(lost)? {
                return Ok(true);
            }
            match self.grace {
                Some((end, signal)) if now >= end => return Err(LinkError::Interrupted { signal }),
                _ if self.is_over() => return Ok(false),
                _ => {}
            }
        }
    }
}

/// Throws away what has come to a device that is in non-blocking mode: late replies to earlier requests.
pub(super) fn drop_stale(device: &mut impl Read, tap: &mut dyn Tap) {
    let mut stale = [0; 256];
    for _ in 0..STALE_READS {
        match device.read(&mut stale) {
            Ok(count) if count > 0 => tap.back(stale.get(..count).unwrap_or_default()),
            _ => return,
        }
    }
}

/// Writes a request to a device that is in non-blocking mode. That does not block, because a telegram fits its buffer.
fn write_request(device: &mut impl Write, request: &Telegram, tap: &mut dyn Tap) -> Result<(), LinkError> {
    tap.out(request);
    device.write_all(request).map_err(lost)
}

/// Asks a question over a device that is in non-blocking mode, and reads the reply, or gives up after `timeout`. Replies of
/// modules that were not asked are passed over.
pub(super) fn converse(
    device: &mut (impl Read + Write + AsFd),
    question: &Question,
    timeout: Duration,
    tap: &mut dyn Tap,
) -> Result<Telegram, LinkError> {
    write_request(device, &question.telegram(), tap)?;
    let mut patience = Patience::begin(timeout);
    let (asked, mut answered) = (question.address, Vec::new());
    loop {
        // Somebody who never stops talking does not keep this from ending.
        let reply = if patience.is_over() {
            Err(LinkError::NoReply { bytes: 0 })
        } else {
            read_reply(device, &mut patience, tap)
        };
        match reply {
            Ok(reply) => match question.other(&reply) {
                None => return Ok(reply),
                Some(other) if answered.contains(&other) => {}
                Some(other) => answered.push(other),
            },
            Err(LinkError::NoReply { .. }) if !answered.is_empty() => {
                return Err(LinkError::Others { asked, answered });
            }
            Err(error) => return Err(error),
        }
    }
}

/// Reads the nine bytes of a reply from a device that is in non-blocking mode.
fn read_reply(
    device: &mut (impl Read + AsFd),
    patience: &mut Patience,
    tap: &mut dyn Tap,
) -> Result<Telegram, LinkError> {
    let mut reply: Telegram = [0; TELEGRAM];
    let mut bytes = 0;
    while let Some(rest) = reply.get_mut(bytes..).filter(|rest| !rest.is_empty()) {
        if !patience.readable(device)? {
            return Err(LinkError::NoReply { bytes });
        }
        match device.read(rest) {
            Ok(0) => return Err(LinkError::Closed),
            Err(error) if error.kind() == ErrorKind::ConnectionReset => return Err(LinkError::Closed),
            Ok(count) => {
                tap.back(rest.get(..count).unwrap_or_default());
                bytes += count;
            }
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted) => {}
            Err(error) => return Err(lost(error)),
        }
    }
    Ok(reply)
}

#[cfg(test)]
mod tests {
    use std::os::unix::net::UnixStream;

    use tmcm::tmcl::{Command, Reply, Status, binary};

    use super::*;

    /// Notes the bytes and their directions.
    #[derive(Default)]
    struct Notes(Vec<(char, Vec<u8>)>);

    impl Tap for Notes {
        fn out(&mut self, bytes: &[u8]) {
            self.0.push(('>', bytes.into()));
        }

        fn back(&mut self, bytes: &[u8]) {
            self.0.push(('<', bytes.into()));
        }
    }

    /// What came too late is thrown away in front of the next request, and those who listen hear it.
    #[test]
    fn a_late_reply_is_heard_and_thrown_away() {
        let mut tap = Notes::default();
        let (mut host, mut module) = UnixStream::pair().unwrap();
        host.set_nonblocking(true).unwrap();
        let reply = |value| binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: 6, value });
        let request = binary::encode_command(1, Command::new(6, 1, 0, 0));
        write_request(&mut host, &request, &mut tap).unwrap();
        module.write_all(&reply(1)).unwrap();
        drop_stale(&mut host, &mut tap);
        write_request(&mut host, &request, &mut tap).unwrap();
        module.write_all(&reply(2)).unwrap();
        assert_eq!(read_reply(&mut host, &mut Patience::begin(Duration::from_secs(60)), &mut tap).unwrap(), reply(2));
        let said = [('>', request), ('<', reply(1)), ('>', request), ('<', reply(2))];
        assert_eq!(tap.0, said.map(|(direction, bytes)| (direction, bytes.to_vec())));
    }
}
