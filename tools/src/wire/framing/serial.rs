//! Telegrams of nine bytes, without anything between them.

use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, TELEGRAM, Telegram};
use tmcm_sim::wire::Answer;

use super::Framing;
use crate::wire::{LinkError, Tap};

/// The framing of a serial link: USB, RS485, TCP.
#[derive(Clone, Debug, Default)]
pub struct Serial {
    /// A reply is taken whatever module it is from.
    takes_any: bool,
    /// The module that was asked, and what.
    asked: Option<(u8, Command)>,
    /// The part of a reply that has come.
    reply: Vec<u8>,
    /// Modules that were not asked, and have replied.
    answered: Vec<u8>,
    /// Numbers of commands whose replies did not come in time, and may come late.
    owed: Vec<u8>,
}

impl Serial {
    /// The request as a telegram. What has come in part before belongs to none.
    ///
    /// # Errors
    /// The address is above 255.
    pub fn telegram(&mut self, address: u16, command: Command) -> Result<Telegram, LinkError> {
        let address = u8::try_from(address).map_err(|_| LinkError::Address)?;
        self.asked = Some((address, command));
        self.reply.clear();
        self.answered.clear();
        Ok(binary::encode_command(address, command))
    }

    /// The address of another module from which this reply is; `None` for one to take. Replies of a form of their own,
    /// and bytes that are no reply, carry no address.
    fn other(&self, reply: &Telegram) -> Option<u8> {
        let (address, command) = self.asked.filter(|_| !self.takes_any)?;
        match Answer::read(command, reply) {
            Answer::Plain(reply) if reply.module != address => Some(reply.module),
            _ => None,
        }
    }

    /// Whether this is the late reply to a request that was given up. One that has the number of the command that is
    /// asked now cannot be told from the reply to that.
    fn is_late(&self, reply: &Telegram) -> bool {
        let is_strange = self.asked.is_some_and(|(_, command)| Answer::read(command, reply) == Answer::Strange);
        is_strange && binary::decode_reply(reply).is_some_and(|reply| self.owed.contains(&reply.opcode))
    }
}

impl Framing for Serial {
    fn ask(&mut self, address: u16, command: Command, tap: &mut dyn Tap) -> Result<Vec<u8>, LinkError> {
        let telegram = self.telegram(address, command)?;
        tap.out(&telegram);
        Ok(telegram.into())
    }

    fn room(&self) -> usize {
        TELEGRAM - self.reply.len()
    }

    fn take(&mut self, bytes: &[u8], tap: &mut dyn Tap) -> Option<Result<Telegram, LinkError>> {
        tap.back(bytes);
        self.reply.extend(bytes);
        let reply = *self.reply.first_chunk::<TELEGRAM>()?;
        self.reply.clear();
        if self.is_late(&reply) {
            return None;
        }
        match self.other(&reply) {
            None => {
                // A module replies in the order in which it is asked.
                self.owed.clear();
                return Some(Ok(reply));
            }
            Some(other) if self.answered.contains(&other) => {}
            Some(other) => self.answered.push(other),
        }
        None
    }

    fn late(&mut self, bytes: &[u8], tap: &mut dyn Tap) {
        tap.back(bytes);
    }

    fn give_up(&mut self) -> LinkError {
        if let Some((_, command)) = self.asked.filter(|(_, command)| !self.owed.contains(&command.opcode)) {
            self.owed.push(command.opcode);
        }
        match self.asked {
            Some((asked, _)) if !self.answered.is_empty() => {
                LinkError::Others { asked, answered: std::mem::take(&mut self.answered) }
            }
            _ => LinkError::NoReply { bytes: self.reply.len() },
        }
    }

    fn take_any(&mut self) {
        self.takes_any = true;
    }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Reply, Status};

    use super::*;
    use crate::wire::Nobody;

    const GAP: Command = Command::new(6, 1, 0, 0);

    fn reply(module: u8, value: i32) -> Telegram {
        binary::encode_reply(2, module, &Reply::Plain { status: Status::Ok, opcode: 6, value })
    }

    /// Bytes that come one by one make a reply with the ninth; until then it is told how many are missing.
    #[test]
    fn a_reply_may_come_in_pieces() {
        let mut serial = Serial::default();
        let request = serial.ask(1, GAP, &mut Nobody).unwrap();
        assert_eq!(request, binary::encode_command(1, GAP));
        let reply = reply(1, 5);
        for (count, byte) in reply.iter().take(8).enumerate() {
            assert_eq!(serial.room(), TELEGRAM - count);
            assert!(serial.take(&[*byte], &mut Nobody).is_none());
        }
        assert!(matches!(serial.give_up(), LinkError::NoReply { bytes: 8 }));
        assert_eq!(serial.take(&reply[8..], &mut Nobody).unwrap().unwrap(), reply);
    }

    /// Replies of modules that were not asked are passed over, and told once each when the module asked says nothing.
    #[test]
    fn replies_of_others_are_passed_over() {
        let mut serial = Serial::default();
        serial.ask(1, GAP, &mut Nobody).unwrap();
        for other in [3, 4, 3] {
            assert!(serial.take(&reply(other, 5), &mut Nobody).is_none());
        }
        assert_eq!(serial.take(&reply(1, 7), &mut Nobody).unwrap().unwrap(), reply(1, 7));
        let LinkError::Others { asked: 1, answered } = serial.give_up() else { panic!() };
        assert_eq!(answered, [3, 4]);
        serial.take_any();
        serial.ask(1, GAP, &mut Nobody).unwrap();
        assert_eq!(serial.take(&reply(3, 5), &mut Nobody).unwrap().unwrap(), reply(3, 5));
    }

    /// Replies to GAP and MST that were given up come late: they are not those to ROR, which comes behind them.
    #[test]
    fn late_replies_to_other_commands_are_passed_over() {
        let mut serial = Serial::default();
        for opcode in [6, 3] {
            serial.ask(1, Command::new(opcode, 0, 0, 0), &mut Nobody).unwrap();
            serial.give_up();
        }
        serial.ask(1, Command::new(1, 0, 0, 500), &mut Nobody).unwrap();
        let reply = |opcode| binary::encode_reply(2, 1, &Reply::Plain { status: Status::Ok, opcode, value: 0 });
        assert!(serial.take(&reply(6), &mut Nobody).is_none() && serial.take(&reply(3), &mut Nobody).is_none());
        assert_eq!(serial.take(&reply(1), &mut Nobody).unwrap().unwrap(), reply(1));
        // Nothing is late any more.
        serial.ask(1, Command::new(1, 0, 0, 500), &mut Nobody).unwrap();
        assert_eq!(serial.take(&reply(6), &mut Nobody).unwrap().unwrap(), reply(6));
    }

    /// Half a reply to an earlier request is no part of the next one's.
    #[test]
    fn a_request_begins_anew() {
        let mut serial = Serial::default();
        serial.ask(1, GAP, &mut Nobody).unwrap();
        assert!(serial.take(&[2, 1, 100], &mut Nobody).is_none());
        serial.ask(1, GAP, &mut Nobody).unwrap();
        assert_eq!(serial.room(), TELEGRAM);
        assert!(matches!(serial.ask(256, GAP, &mut Nobody), Err(LinkError::Address)));
    }
}
