//! A request goes out over a device, and its reply comes in, or not in time.

use std::time::{Duration, Instant};

use tmcl_tools::wire::framing::{Framing, Slcan};
use tmcl_tools::wire::{LinkError, Tap};
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::Telegram;

use crate::device::Device;
use crate::signal::Wait;

/// After a signal a reply is waited for no longer than this: a module that works has answered by then, and what talks
/// to it ends as it should.
const GRACE: Duration = Duration::from_millis(500);
/// Time between two looks for a signal.
const LOOK: Duration = Duration::from_millis(50);
/// Most reads of what has come before a request, so that somebody who never stops talking is no end of it.
const STALE_READS: usize = 256;
/// Most bytes that are read at once.
const CHUNK: usize = 256;
/// Longest wait for the answer to each line that opens an adapter's channel; some adapters do not answer.
const ANSWER: Duration = Duration::from_millis(300);

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

    /// Reads what comes from a device: the number of bytes, or `None` if nothing comes in time. However much comes, a
    /// signal is noticed, and the time ends.
    fn read(&mut self, device: &mut Device, bytes: &mut [u8]) -> Result<Option<usize>, LinkError> {
        while !self.is_over() {
            let now = Instant::now();
            if let (None, Some(signal)) = (self.grace, self.wait.signal()) {
                self.grace = Some((now + GRACE, signal));
            }
            match device.read_by(bytes, self.until.min(now + LOOK))? {
                Some(0) => return Err(LinkError::Closed),
                Some(count) => return Ok(Some(count)),
                None => {}
            }
            match self.grace {
                Some((end, signal)) if now >= end => return Err(LinkError::Interrupted { signal }),
                _ => {}
            }
        }
        Ok(None)
    }
}

/// Throws away what has come to a device: late replies to earlier requests.
pub(super) fn drop_stale(device: &mut Device, framing: &mut dyn Framing, tap: &mut dyn Tap) {
    let mut stale = [0; CHUNK];
    for _ in 0..STALE_READS {
        match device.read_by(&mut stale, Instant::now()) {
            Ok(Some(count)) if count > 0 => framing.late(stale.get(..count).unwrap_or_default(), tap),
            _ => return,
        }
    }
}

/// Sends a request over a device, and reads the reply, or gives up after `timeout`.
pub(super) fn converse(
    device: &mut Device,
    framing: &mut dyn Framing,
    (address, command): (u16, Command),
    timeout: Duration,
    tap: &mut dyn Tap,
) -> Result<Telegram, LinkError> {
    let request = framing.ask(address, command, tap)?;
    device.send(&request)?;
    let mut patience = Patience::begin(timeout);
    loop {
        let mut bytes = [0; CHUNK];
        let room = framing.room().min(CHUNK);
        let Some(count) = patience.read(device, bytes.get_mut(..room).unwrap_or_default())? else {
            return Err(framing.give_up());
        };
        if let Some(reply) = framing.take(bytes.get(..count).unwrap_or_default(), tap) {
            return reply;
        }
    }
}

/// Opens the channel of an adapter on a device.
pub(super) fn open_channel(device: &mut Device, adapter: &mut Slcan) -> Result<(), LinkError> {
    for line in Slcan::OPEN {
        device.send(line.as_bytes())?;
        let mut patience = Patience::begin(ANSWER);
        let mut bytes = [0; CHUNK];
        while let Some(count) = patience.read(device, &mut bytes)? {
            if adapter.answered(bytes.get(..count).unwrap_or_default()) {
                break;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::io::{BufRead, BufReader, Write};
    use std::net::{TcpListener, TcpStream};

    use tmcl_tools::wire::Nobody;
    use tmcl_tools::wire::framing::Serial;
    use tmcm::tmcl::{Reply, Status, binary};

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

    /// Both ends of a connection.
    fn connected() -> (TcpStream, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
        (near, listener.accept().unwrap().0)
    }

    /// A reply that came too late is thrown away in front of the next request, and those who listen hear it.
    #[test]
    fn a_late_reply_is_heard_and_thrown_away() {
        let (mut tap, mut serial) = (Notes::default(), Serial::default());
        let (host, mut module) = connected();
        let mut host = Device::Tcp(host);
        let reply = |value| binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: 6, value });
        let command = Command::new(6, 1, 0, 0);
        let request = binary::encode_command(1, command);
        let asked = converse(&mut host, &mut serial, (1, command), Duration::ZERO, &mut tap);
        assert!(matches!(asked, Err(LinkError::NoReply { bytes: 0 })), "{asked:?}");
        module.write_all(&reply(1)).unwrap();
        drop_stale(&mut host, &mut serial, &mut tap);
        module.write_all(&reply(2)).unwrap();
        let asked = converse(&mut host, &mut serial, (1, command), Duration::from_secs(60), &mut tap);
        assert_eq!(asked.unwrap(), reply(2));
        let said = [('>', request), ('<', reply(1)), ('>', request), ('<', reply(2))];
        assert_eq!(tap.0, said.map(|(direction, bytes)| (direction, bytes.to_vec())));
    }

    /// An adapter that answers line by line, with frames before some answers, and then a request.
    #[test]
    fn an_adapter_is_opened_line_by_line() {
        let (host, adapter) = connected();
        let mut host = Device::Tcp(host);
        let answers = ["\r", "t0028036406000000AA00\r\x07", "\r", "\r", "z\rt00280364060000007B00\r"];
        let adapter = std::thread::spawn(move || {
            let mut lines = BufReader::new(adapter.try_clone().unwrap()).split(b'\r');
            let mut answer = |answer: &str| {
                let line = lines.next().unwrap().unwrap();
                (&adapter).write_all(answer.as_bytes()).unwrap();
                String::from_utf8(line).unwrap()
            };
            answers.map(&mut answer)
        });
        let mut slcan = Slcan::default();
        open_channel(&mut host, &mut slcan).unwrap();
        let command = Command::new(6, 1, 0, 0);
        let reply = converse(&mut host, &mut slcan, (3, command), Duration::from_secs(60), &mut Nobody).unwrap();
        assert_eq!(binary::decode_reply(&reply).unwrap().value, 0x7B);
        assert_eq!(adapter.join().unwrap(), ["", "C", "S8", "O", "t00380601000000000000"]);
    }
}
