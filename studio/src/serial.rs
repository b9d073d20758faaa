//! The framing of a serial port.

use tmcl_tools::wire::Nobody;
use tmcl_tools::wire::framing::{Framing, Serial};

use crate::types::{Bytes, Nothing, Outcome, Request, Taken};

/// Telegrams of nine bytes on the stream of a serial port.
#[derive(Debug, Default)]
pub struct SerialPort {
    framing: Serial,
}

impl SerialPort {
    /// The bytes of a request.
    ///
    /// # Errors
    /// There is no such address.
    pub fn ask(&mut self, asked: Request) -> Result<Bytes, String> {
        let bytes = self.framing.ask(asked.address, asked.command(), &mut Nobody);
        bytes.map(|bytes| Bytes { bytes }).map_err(|error| error.to_string())
    }

    /// Takes bytes that have come since the request.
    pub fn take(&mut self, came: &Bytes) -> Taken {
        let mut rest = came.bytes.as_slice();
        // Bytes behind the reply belong to no request, and are dropped.
        while let Some((now, later)) = rest.split_at_checked(self.framing.room().min(rest.len()))
            && !now.is_empty()
        {
            if let Some(reply) = self.framing.take(now, &mut Nobody) {
                return Taken { outcome: Some(reply.into()) };
            }
            rest = later;
        }
        Taken { outcome: None }
    }

    /// How a request ends for which no reply has come in time.
    pub fn give_up(&mut self, Nothing {}: Nothing) -> Outcome {
        Err(self.framing.give_up()).into()
    }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Command, Reply, Status, binary};

    use super::*;

    /// Half a reply, then the rest with more behind it than a reply has.
    #[test]
    fn a_reply_is_cut_out_of_what_comes() {
        let mut port = SerialPort::default();
        let request = Request::new(1, Command::new(6, 1, 0, 0));
        assert_eq!(port.ask(request).unwrap().bytes, binary::encode_command(1, request.command()));
        let reply = binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: 6, value: -5 });
        assert_eq!(port.take(&Bytes { bytes: reply[..4].into() }), Taken { outcome: None });
        let rest = [&reply[4..], &reply[..3]].concat();
        assert_eq!(port.take(&Bytes { bytes: rest }).outcome, Some(Outcome::Reply(reply.into())));
        port.ask(request).unwrap();
        assert_eq!(port.take(&Bytes { bytes: reply[..8].into() }), Taken { outcome: None });
        assert_eq!(port.give_up(Nothing {}), Outcome::NoReply(8));
        assert!(port.ask(Request { address: 256, ..request }).unwrap_err().contains("255"));
    }
}
