//! The log of what goes over a link, as `--log-telegrams` writes it.

use hal_sim::clock::{MILLISECOND, Nanos};
use serde::{Deserialize, Serialize};
use tmcm::tmcl::binary;
use tmcm_sim::Product;
use tmcm_sim::wire::{Place, Transcript};

use crate::stop::known;
use crate::types::{Outcome, Request, Text};

/// An exchange that is over.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Exchanged {
    /// The product of the module, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// Whether the module is a virtual one of the page.
    pub is_virtual: bool,
    /// The request; null for what came without being asked for.
    pub request: Option<Request>,
    /// When, in milliseconds.
    pub begun: f64,
    /// The outcome of the exchange.
    pub outcome: Outcome,
    /// When it was over.
    pub ended: f64,
}

/// The log of a link.
#[derive(Debug)]
pub struct Log {
    product: Option<Product>,
    transcript: Transcript,
}

impl Default for Log {
    fn default() -> Self {
        Log { product: None, transcript: Transcript::of_module(None) }
    }
}

impl Log {
    /// The lines of an exchange.
    pub fn note(&mut self, exchanged: &Exchanged) -> Text {
        let Exchanged { product, is_virtual, request, begun, outcome, ended } = exchanged;
        let product = known(product.as_deref());
        if product != self.product {
            *self = Log { product, transcript: Transcript::of_module(product) };
        }
        let place = Place::alone(if *is_virtual { "virtual" } else { "serial" });
        let (begun, ended) = (nanos(*begun), nanos(*ended));
        let address = request.map(|request| (request, u8::try_from(request.address)));
        if let Some((request, Ok(address))) = address {
            self.transcript.hear(begun, place, &binary::encode_command(address, request.command()));
        }
        match outcome {
            Outcome::Reply(bytes) => self.transcript.answer(ended, place, 0, bytes),
            Outcome::NoReply(_) | Outcome::Others { .. } => self.transcript.give_up(ended, place, 0),
            Outcome::Address | Outcome::Lost(_) | Outcome::Interrupted => {}
        }
        Text { text: self.transcript.take(), done: true }
    }
}

fn nanos(milliseconds: f64) -> Nanos {
    // A clock does not go below zero, and this one not beyond five hundred years.
    (milliseconds.max(0.0) * MILLISECOND as f64) as Nanos
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let exchanged = Exchanged {
        product: Some("1140".into()),
        is_virtual: true,
        request: Some(Request::new(1, tmcm::tmcl::Command::new(6, 1, 0, 0))),
        begun: 1.0,
        outcome: Outcome::NoReply(0),
        ended: 2.0,
    };
    vec![("Exchanged", json!(exchanged)), ("Exchanged", json!(Exchanged { product: None, request: None, ..exchanged }))]
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Command, Reply, Status};

    use super::*;

    #[test]
    fn lines_are_those_of_the_program() {
        let mut log = Log::default();
        let reply = binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode: 6, value: 7 });
        let mut exchanged = Exchanged {
            product: Some("1140".into()),
            is_virtual: false,
            request: Some(Request::new(1, Command::new(6, 1, 0, 0))),
            begun: 1500.5,
            outcome: Outcome::Reply(reply.into()),
            ended: 1502.0,
        };
        let expected = "    1.500500  serial   >  01 06 01 00 00 00 00 00 08   to 1: GAP 1, 0\n    1.502000  serial   <  \
                        02 01 64 06 00 00 00 07 74   from 1: 7 microsteps (actual position), status 100 ok\n";
        let unspaced = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert_eq!(unspaced(&log.note(&exchanged).text), unspaced(expected));
        exchanged.outcome = Outcome::NoReply(0);
        assert!(log.note(&exchanged).text.ends_with("no reply\n"));
        exchanged.outcome = Outcome::Lost("gone".into());
        assert_eq!(log.note(&exchanged).text.lines().count(), 1);
        // A reply that comes late stands alone.
        exchanged = Exchanged { request: None, outcome: Outcome::Reply(reply.into()), ..exchanged };
        assert!(log.note(&exchanged).text.contains("<  02 01 64 06"), "{}", log.note(&exchanged).text);
    }
}
