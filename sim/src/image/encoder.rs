//! The built-in encoder, which an image cannot read: how it is connected on a module is not known, so the emulated
//! board does not connect it. Its parameters read 0 whatever the motor does, and a control loop over them runs away.

use tmcm::can::Frame;
use tmcm::param::AxisParameter;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::can::{self, Request};
use tmcm::tmcl::{Command, Opcode, Status, ascii};

use super::asked::Answer;
use crate::native::Product;

/// Notices that a host has read what only the built-in encoder would show.
#[derive(Debug)]
pub(super) struct MissingEncoder {
    product: Product,
    /// The last request in a CAN frame; the reply to it does not say which parameter was read.
    request: Option<Request>,
    told: bool,
}

impl MissingEncoder {
    /// The state for a module of this product, of which nothing has been told yet.
    pub(super) fn of(product: Product) -> Self {
        MissingEncoder { product, request: None, told: false }
    }

    /// A frame comes to the module and to the others on its bus.
    pub(super) fn hear_frame(&mut self, frame: &Frame) {
        self.request = can::decode(frame).or(self.request);
    }

    /// The module has sent a frame; gives what is to be told of that.
    pub(super) fn send_frame(&mut self, frame: &Frame) -> Option<String> {
        let Request { id, command, .. } = self.request?;
        let [_, low] = id.as_raw().to_be_bytes();
        let reply = can::decode(frame)?.command.to_bytes();
        (reply[..3] == [low, Status::Ok as u8, command.opcode]).then(|| self.answered(command))?
    }

    /// The module has answered on a byte link; gives what is to be told of that.
    pub(super) fn send_answer(&mut self, Answer { request, reply }: &Answer) -> Option<String> {
        let good = Status::Ok as u8;
        match (<&Telegram>::try_from(&**request), <&Telegram>::try_from(&**reply)) {
            (Ok(request), Ok(reply)) if binary::decode_reply(reply)?.status == good => {
                self.answered(binary::decode_command(request)?)
            }
            // The reply to a line has status and value, without the number of the command: `BA 100 0`.
            _ if reply.split(|byte| *byte == b' ').nth(1)? == good.to_string().as_bytes() => {
                match ascii::Line::parse(request.get(1..)?) {
                    ascii::Line::Command(command) => self.answered(command),
                    _ => None,
                }
            }
            _ => None,
        }
    }

    /// The module has carried out a command of a host. The first time that this is what it cannot do, gives a warning.
    fn answered(&mut self, Command { opcode, kind, .. }: Command) -> Option<String> {
        let parameter = self.product.spec().axis.find(kind).filter(|_| opcode == Opcode::Gap as u8)?;
        let shown = matches!(parameter.function, AxisParameter::EncoderPosition | AxisParameter::AbsoluteResolverValue);
        (shown && !std::mem::replace(&mut self.told, true)).then(|| {
            format!(
                "parameter {kind} was read, which is always 0 here: how the built-in encoder of a module is connected is not \
                 known, so the image has none. A control loop over it runs away. Without --image there is such an encoder"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::binary::{encode_command, encode_plain};

    fn answer(request: &[u8], reply: &[u8]) -> Answer {
        Answer { request: request.to_vec(), reply: reply.to_vec() }
    }

    fn warned(product: Product, answers: &[Answer]) -> usize {
        let mut encoder = MissingEncoder::of(product);
        answers.iter().filter_map(|answer| encoder.send_answer(answer)).count()
    }

    /// GAP of a parameter of axis 0, in a telegram to module 1.
    fn gap(number: u8) -> Telegram {
        encode_command(1, Command::new(Opcode::Gap as u8, number, 0, 0))
    }

    #[test]
    fn whoever_reads_it_is_warned_unless_he_is_refused() {
        let reply = |status| encode_plain(2, 1, status, Opcode::Gap as u8, 0);
        let good = reply(Status::Ok);
        for (number, count) in [(209, 1), (215, 1), (208, 0), (216, 0)] {
            let answer = || answer(&gap(number), &good);
            assert_eq!(warned(Product::Tmcm1140, &[answer(), answer()]), count, "{number}");
        }
        assert_eq!(warned(Product::Tmcm1140, &[answer(&gap(209), &reply(Status::NotAvailable))]), 0);
        let set = encode_command(1, Command::new(Opcode::Sap as u8, 209, 0, 0));
        assert_eq!(warned(Product::Tmcm1140, &[answer(&set, &good)]), 0);
        // The encoder of these has a place of its own.
        assert_eq!(warned(Product::Tmcm3212, &[answer(&gap(209), &good)]), 0);
    }

    #[test]
    fn a_line_reads_it_as_well() {
        let told = |line: &[u8], reply: &[u8]| warned(Product::Tmcm1140, &[answer(line, reply)]);
        assert_eq!(told(b"AGAP 209, 0\r", b"BA 100 0\r"), 1);
        assert_eq!(told(b"AGAP 209, 0\r", b"BA 4 0\r"), 0);
        assert_eq!(told(b"AGAP 208, 0\r", b"BA 100 0\r"), 0);
        assert_eq!(told(b"AGPA 209, 0\r", b"BA 2 0\r"), 0);
        assert_eq!(told(b"", b"BA 100 0\r"), 0);
    }

    #[test]
    fn a_frame_counts_if_the_module_itself_answers_it() {
        let frame = |id: u16, data: [u8; 7]| Frame::standard(id, &data).unwrap();
        let request = |id| frame(id, [6, 215, 0, 0, 0, 0, 0]);
        for (id, reply, count) in [
            (1, [1, 100, 6, 0, 0, 0, 0], 1),
            (0x101, [1, 100, 6, 0, 0, 0, 0], 1),
            (3, [1, 100, 6, 0, 0, 0, 0], 0),
            (1, [1, 6, 6, 0, 0, 0, 0], 0),
            (1, [1, 100, 4, 0, 0, 0, 0], 0),
        ] {
            let mut encoder = MissingEncoder::of(Product::Tmcm1140);
            assert_eq!(encoder.send_frame(&frame(2, reply)), None, "nobody has asked");
            encoder.hear_frame(&request(id));
            let told = [0; 2].map(|_| usize::from(encoder.send_frame(&frame(2, reply)).is_some()));
            assert_eq!(told, [count, 0], "{id}: {reply:?}");
        }
    }
}
