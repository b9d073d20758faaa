//! A host that talks to the module on its links, and times it.

use std::error::Error;

use hal_sim::board::Board;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::{CanFrame, LogLine, Machine, Step};
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::{Command, Status, can, text};
use tmcm_sim::image;

/// Anything that ends a measurement.
pub(crate) type Failure = Box<dyn Error + Send + Sync>;

/// Core cycles of a microsecond.
pub(crate) const CYCLES_PER_MICROSECOND: u64 = 168;

/// How long a host waits for a reply.
const PATIENCE: Nanos = 2 * SECOND;
/// How often it looks whether it is there.
const LOOK: Nanos = 250 * MICROSECOND;
/// How long it takes to ask again: longer than the module's transceiver takes to leave the bus after a reply.
const REACTION: Nanos = 10 * MICROSECOND;
/// Time for the firmware to start.
pub(crate) const START: Nanos = 200 * MILLISECOND;
/// Time for the USB host to enumerate the module and open the port.
const ENUMERATION: Nanos = SECOND;

/// The rates of RS485: the factory default, and those that values 7 and 8 of global parameter 65 stand for.
pub(crate) const SLOW: u32 = 9_600;
pub(crate) const FAST: u32 = 115_200;
pub(crate) const FASTER: u32 = 230_400;

/// The module's identifier on CAN, the duration of a bit, and the bits of a frame besides its data.
const CAN_ID: u32 = 1;
const CAN_BIT: Nanos = MICROSECOND;
const CAN_BITS: Nanos = 47;

/// A link of the module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Link {
    Rs485,
    Can,
    Usb,
}

/// A request and its reply. The module has the last bit of a request
/// - on RS485 in the middle of its stop bit, where its receiver samples it,
/// - on CAN at the end of the frame,
/// - on USB when its endpoint has taken the packet;
///
/// the first bit of a reply goes out with the start bit, with the start of the frame, and when the packet is ready for
/// the host to fetch.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Exchange {
    /// The core cycle of the last bit in.
    pub(crate) asked: u64,
    /// The core cycle at which that bit is over.
    pub(crate) over: u64,
    /// The core cycle of the first bit out.
    pub(crate) answered: u64,
    /// The reply.
    pub(crate) reply: Received,
}

impl Exchange {
    /// Core cycles from the last bit in to the first bit out.
    pub(crate) fn cycles(&self) -> u64 {
        self.answered - self.asked
    }

    /// Core cycles from the end of the last bit in to the first bit out.
    pub(crate) fn turnaround(&self) -> u64 {
        self.answered.saturating_sub(self.over)
    }

    /// Whether a step of the core lies between the last bit in and the first bit out.
    pub(crate) fn has(&self, step: &Step) -> bool {
        (self.asked..self.answered).contains(&step.at)
    }
}

/// A command in its written form.
pub(crate) fn command(line: &str) -> Result<Command, Failure> {
    text::parse(line).map_err(|error| error.to_string().into())
}

/// A module and the hosts at its links.
pub(crate) struct Host {
    pub(crate) machine: Machine,
    baud: u32,
}

impl Host {
    /// Switches on a module with the image `elf`, of whatever product that is, in the world that the text describes.
    pub(crate) fn in_world(elf: &[u8], world: &str) -> Result<Self, Failure> {
        let kind = image::model(elf)?.unwrap_or_default().product().kind();
        let board = Board::of_kind(kind, &WorldConfig::parse_for(kind, world)?, 0);
        let mut host = Self { machine: Machine::new(elf, board)?, baud: SLOW };
        host.run(START)?;
        Ok(host)
    }

    /// Switches on a module with the image `elf`.
    pub(crate) fn start(elf: &[u8]) -> Result<Self, Failure> {
        Self::in_world(elf, "")
    }

    /// As [`start`](Self::start), with RS485 at `baud`.
    pub(crate) fn start_at(elf: &[u8], baud: u32) -> Result<Self, Failure> {
        let mut host = Self::start(elf)?;
        host.set_baud(baud)?;
        Ok(host)
    }

    /// Sets RS485 to `baud`, which takes effect with the next start.
    pub(crate) fn set_baud(&mut self, baud: u32) -> Result<(), Failure> {
        let number = match baud {
            SLOW => return Ok(()),
            FAST => 7,
            _ => 8,
        };
        self.tell(Link::Rs485, &format!("SGP 65, 0, {number}"))?;
        self.machine.set_power(false);
        self.machine.set_power(true);
        self.baud = baud;
        self.run(START)
    }

    /// Connects a USB host and lets it open the port.
    pub(crate) fn plug_usb(&mut self) -> Result<(), Failure> {
        self.machine.usb().plug(true);
        self.run(ENUMERATION)?;
        let usb = self.machine.usb();
        let device = usb.device();
        let why = device.failed.unwrap_or("no device shows itself");
        if device.open { Ok(()) } else { Err(format!("the image offers no serial port on USB: {why}").into()) }
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, span: Nanos) -> Result<(), Failure> {
        Ok(self.machine.run(span)?)
    }

    /// Lets time pass and shows each step of the core.
    pub(crate) fn watch(&mut self, span: Nanos, observer: &mut dyn FnMut(Step)) -> Result<(), Failure> {
        Ok(self.machine.observe_until(self.machine.now() + span, observer)?)
    }

    /// Sends a command whose reply nobody waits for.
    pub(crate) fn send(&mut self, link: Link, command: Command) {
        let telegram = binary::encode_command(1, command);
        match link {
            Link::Rs485 => _ = self.machine.rs485().send(&telegram, self.baud),
            Link::Can => self.machine.can().send(frame(command)),
            Link::Usb => self.machine.usb().send(&telegram),
        }
    }

    /// Sends a command and waits for the reply.
    pub(crate) fn exchange(&mut self, link: Link, command: Command) -> Result<Exchange, Failure> {
        self.talk(link, command, &mut |machine, to| machine.run_until(to))
    }

    /// As [`exchange`](Self::exchange), and shows each step of the core.
    pub(crate) fn observe(
        &mut self,
        link: Link,
        command: Command,
        observer: &mut dyn FnMut(Step),
    ) -> Result<Exchange, Failure> {
        self.talk(link, command, &mut |machine, to| machine.observe_until(to, observer))
    }

    fn talk(
        &mut self,
        link: Link,
        command: Command,
        run: &mut dyn FnMut(&mut Machine, Nanos) -> Result<(), hal_sim::mcu::Stop>,
    ) -> Result<Exchange, Failure> {
        // What is left of replies that nobody has waited for.
        self.machine.rs485().take_sent();
        self.machine.can().take_sent();
        self.machine.usb().take();
        self.machine.run(REACTION)?;
        let begin = self.machine.now();
        let size = binary::TELEGRAM;
        // Ten bits a byte, less half a bit.
        let asked_rs485 = begin + (20 * size as Nanos - 1) * SECOND / Nanos::from(2 * self.baud);
        let over_rs485 = begin + 10 * size as Nanos * SECOND / Nanos::from(self.baud);
        self.send(link, command);
        if link == Link::Rs485 {
            self.machine.run_until(asked_rs485)?;
        }
        let (mut characters, mut frames, mut bytes) = (Vec::new(), Vec::new(), Vec::new());
        let (asked, answered, reply) = loop {
            let now = self.machine.now();
            if now > begin + PATIENCE {
                return Err(self.silence(command).into());
            }
            run(&mut self.machine, now + LOOK)?;
            match link {
                Link::Rs485 => {
                    characters.extend(self.machine.rs485().take_sent());
                    if let (Some(first), true) = (characters.first(), characters.len() >= size) {
                        let bytes: Vec<u8> = characters.iter().map(|character| character.value).collect();
                        break (asked_rs485, first.start, decode(&bytes));
                    }
                }
                Link::Can => {
                    frames.extend(self.machine.can().take_sent());
                    if let Some((end, reply)) = frames.first() {
                        let asked = begin + duration(&frame(command));
                        break (asked, end - duration(reply), decode_frame(reply));
                    }
                }
                Link::Usb => {
                    bytes.extend(self.machine.usb().take().into_iter().flat_map(|(_, packet)| packet));
                    if bytes.len() >= size {
                        let times = self.machine.usb().times();
                        break (times.taken, times.ready, decode(&bytes));
                    }
                }
            }
        };
        let reply = reply.ok_or_else(|| format!("{command}: the reply cannot be read"))?;
        let (now, cycles) = (self.machine.now(), self.machine.counters().cycles);
        let cycle = |at: Nanos| cycles - (now - at) * CYCLES_PER_MICROSECOND / 1_000;
        let over = if link == Link::Rs485 { over_rs485 } else { asked };
        Ok(Exchange { asked: cycle(asked), over: cycle(over), answered: cycle(answered), reply })
    }

    /// Tells in words that there is no reply, and what the module has logged.
    fn silence(&mut self, command: Command) -> String {
        let mut text = format!("{command}: no reply within {} s; ", PATIENCE / SECOND);
        let log = self.machine.log().take();
        text += if log.is_empty() { "the module has logged nothing" } else { "the module's log:" };
        for LogLine { timestamp, level, text: line } in log {
            text += &format!("\n    {timestamp} {level}: {line}");
        }
        text
    }

    /// The value of a reply that must tell success.
    pub(crate) fn tell(&mut self, link: Link, line: &str) -> Result<i32, Failure> {
        let Received { status, value, .. } = self.exchange(link, command(line)?)?.reply;
        if status == Status::Ok as u8 { Ok(value) } else { Err(refusal(line, status).into()) }
    }

    /// A line for each axis, whose number stands for the #; itself, if it has none.
    pub(crate) fn lines(&mut self, line: &str) -> Vec<String> {
        let axes = if line.contains('#') { self.machine.board().kind().axes() } else { 1 };
        (0..axes).map(|axis| line.replace('#', &axis.to_string())).collect()
    }

    /// Tells each axis, whose number stands for the #.
    pub(crate) fn tell_each(&mut self, link: Link, line: &str) -> Result<(), Failure> {
        self.lines(line).iter().try_for_each(|line| self.tell(link, line).map(drop))
    }

    /// Loads a program, and has it run.
    pub(crate) fn run_program(&mut self, link: Link, program: &[&str]) -> Result<(), Failure> {
        self.load(link, &program.iter().map(|&line| line.into()).collect::<Vec<String>>())?;
        self.tell(link, "129, 0, 0, 0")?;
        Ok(())
    }

    /// Loads a program.
    pub(crate) fn load(&mut self, link: Link, program: &[String]) -> Result<(), Failure> {
        self.tell(link, "132, 0, 0, 0")?;
        for line in program {
            let status = self.exchange(link, command(line)?)?.reply.status;
            if status != Status::Loaded as u8 {
                return Err(format!("cannot be part of a program: {}", refusal(line, status)).into());
            }
        }
        self.tell(link, "133, 0, 0, 0")?;
        Ok(())
    }
}

/// A status that was not hoped for, in words.
fn refusal(line: &str, status: u8) -> String {
    let meaning = Status::from_number(status).map_or("a status this program does not know", Status::meaning);
    format!("{line}: status {status} {meaning}")
}

fn frame(command: Command) -> CanFrame {
    let mut data = [0; 8];
    for (to, byte) in data.iter_mut().zip(can::encode_command(command)) {
        *to = byte;
    }
    CanFrame { id: CAN_ID, extended: false, remote: false, length: 8, data }
}

/// How long a frame is on the bus.
pub(crate) fn duration(frame: &CanFrame) -> Nanos {
    (CAN_BITS + 8 * Nanos::from(frame.length)) * CAN_BIT
}

fn decode(bytes: &[u8]) -> Option<Received> {
    binary::decode_reply(bytes.first_chunk()?)
}

fn decode_frame(frame: &CanFrame) -> Option<Received> {
    let [module, status, opcode, a, b, c, d, _] = frame.data;
    let value = i32::from_be_bytes([a, b, c, d]);
    (frame.length >= 7).then_some(Received { host: 0, module, status, opcode, value })
}
