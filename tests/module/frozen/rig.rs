//! The virtual module of a dialogue: carries out steps and returns answers. Of the frozen tests only this file uses the
//! project's code.

use std::fmt::Write as _;

use crc::{CRC_32_ISO_HDLC, Crc, Digest};
use hal_sim::board::{Chip, Datagram};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::{AxisState, Line, State};
use hal_sim::world::config::WorldConfig;
use tmcm::can::{CanFrame, Frame, Id};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary, can, text};
use tmcm_sim::client::Client;
use tmcm_sim::{NativeModule, VirtualModule};

/// Size of the EEPROM in bytes.
pub(super) const EEPROM_SIZE: usize = 16_384;

/// Shortest time between two requests. A reply within this time does not change when the next request is sent, so that
/// slightly faster or slower replies do not change the dialogue.
const SLOT: Nanos = 5 * MILLISECOND;
/// Longest wait for a reply, in virtual time.
const PATIENCE: Nanos = 100 * MILLISECOND;
/// Number of the command that reads program memory; its reply has no status.
const READ_MEMORY: u8 = 134;

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Check sums over the datagrams of a dialogue.
pub(super) struct Sums {
    all: Digest<'static, u32>,
    /// Check sum of the datagrams that write to the motion controller, and of those to the driver that differ from the
    /// previous one.
    writes: Digest<'static, u32>,
    counts: [u64; 2],
    to_driver: Vec<u8>,
    /// The datagrams as text, if FROZEN_DATAGRAMS asks for them.
    text: Option<String>,
}

impl Sums {
    pub(super) fn new() -> Self {
        let text = std::env::var_os("FROZEN_DATAGRAMS").map(|_| String::new());
        Sums { all: CRC.digest(), writes: CRC.digest(), counts: [0; 2], to_driver: Vec::new(), text }
    }

    pub(super) fn add(&mut self, Datagram { chip, bytes }: &Datagram) {
        let number = u8::from(!matches!(chip, Chip::Tmc429(_)));
        let datagram = [&[number, bytes.len() as u8], bytes.as_slice()].concat();
        self.all.update(&datagram);
        self.counts[0] += 1;
        let writes = match chip {
            // Bit 0 of the first byte is 1 for a read and 0 for a write.
            Chip::Tmc429(_) => bytes.first().is_some_and(|first| first & 1 == 0),
            _ => std::mem::replace(&mut self.to_driver, bytes.clone()) != *bytes,
        };
        if writes {
            self.writes.update(&datagram);
            self.counts[1] += 1;
        }
        if let Some(text) = &mut self.text {
            writeln!(text, "{chip:?} {}", hex(bytes)).unwrap();
        }
    }

    pub(super) fn line(self, eeprom: &[u8]) -> String {
        let [all, writes] = self.counts;
        format!(
            "{all} datagrams {:08X}, {writes} of them write {:08X}; EEPROM {:08X}",
            self.all.finalize(),
            self.writes.finalize(),
            CRC.checksum(eeprom)
        )
    }

    /// Writes the datagrams to a file, if FROZEN_DATAGRAMS asks for them.
    pub(super) fn write(&self, file: &str, dialogue: &str) {
        if let (Some(directory), Some(text)) = (std::env::var_os("FROZEN_DATAGRAMS"), &self.text) {
            let name = format!("{file} {dialogue}").replace(|c: char| !c.is_ascii_alphanumeric(), "_");
            std::fs::write(std::path::Path::new(&directory).join(name), text).unwrap();
        }
    }
}

/// The form of a request, by which its answer is read.
#[derive(Clone, Copy)]
enum Asked {
    Nothing,
    Bytes(Source),
    Text(Source),
    Command(Source, Command),
    Frame,
}

/// A module and its hosts.
pub(super) struct Rig {
    module: NativeModule,
}

impl Rig {
    pub(super) fn new(world: &str, eeprom: Option<&[u8]>) -> Self {
        let config = WorldConfig::parse(world).unwrap_or_else(|error| panic!("{world}: {error}"));
        let mut board = NativeModule::new(&config, None, 1);
        // The module is started a second time, so that the datagrams of its start are counted, too.
        board.set_power(false);
        board.board().borrow_mut().take_datagrams();
        if let Some(contents) = eeprom {
            board.board().borrow_mut().at25_mut().load(contents);
        }
        board.set_power(true);
        Rig { module: board }
    }

    /// The contents of the EEPROM.
    pub(super) fn eeprom(&self) -> Vec<u8> {
        self.module.board().borrow().at25().contents().to_vec()
    }

    /// The datagrams on the motion bus since the last call.
    pub(super) fn take_datagrams(&mut self) -> Vec<Datagram> {
        self.module.board().borrow_mut().take_datagrams()
    }

    /// Carries a step out and returns its answer; `None` for a step without an answer. The error is a message.
    pub(super) fn step(&mut self, step: &str) -> Result<Option<String>, String> {
        let (word, rest) = step.split_once(' ').unwrap_or((step, ""));
        let asked = match word {
            "wait" => {
                self.module.run(span(rest)?);
                Asked::Nothing
            }
            "control" => {
                Line::parse(rest)?.control.apply(&mut self.module.board().borrow_mut())?;
                Asked::Nothing
            }
            "power" => {
                if rest != "on" {
                    self.module.set_power(false);
                    self.module.run(10 * MILLISECOND);
                }
                if rest != "off" {
                    self.module.set_power(true);
                    self.module.run(MILLISECOND);
                }
                Asked::Nothing
            }
            "usb" => {
                self.module.plug_usb(rest == "on");
                Asked::Nothing
            }
            "silence" => {
                self.module.silence(link(rest)?, Client::default());
                Asked::Nothing
            }
            "look" => return Ok(Some(self.look())),
            "type" => {
                let (name, line) = rest.split_once(' ').ok_or("type LINK TEXT")?;
                let line = line.replace("\\r", "\r").replace("\\n", "\n").replace("\\b", "\x08");
                self.module.hear(link(name)?, Client::default(), line.as_bytes());
                Asked::Text(link(name)?)
            }
            "bytes" => {
                let (name, bytes) = rest.split_once(' ').ok_or("bytes LINK BYTES")?;
                self.module.hear(link(name)?, Client::default(), &from_hex(bytes)?);
                Asked::Bytes(link(name)?)
            }
            "frame" => {
                let (id, bytes) = rest.split_once(' ').unwrap_or((rest, ""));
                self.frame(id.parse().map_err(|_| "frame ID BYTES")?, &from_hex(bytes)?);
                Asked::Frame
            }
            "CAN" => {
                let (head, line) = rest.split_once(": ").ok_or("CAN ID LENGTH: COMMAND")?;
                let (id, length) = head.split_once(' ').ok_or("CAN ID LENGTH: COMMAND")?;
                let data = can::encode_command(command(line)?);
                let length: usize = length.parse().map_err(|_| "CAN ID LENGTH: COMMAND")?;
                self.frame(id.parse().map_err(|_| "CAN ID LENGTH: COMMAND")?, &data[..length]);
                Asked::Frame
            }
            "USB" | "RS485" => {
                let (address, line) = rest.split_once(": ").ok_or("LINK ADDRESS: COMMAND")?;
                self.telegram(link(word)?, address.parse().map_err(|_| "LINK ADDRESS: COMMAND")?, line)?
            }
            _ => self.telegram(Source::Usb, 1, step)?,
        };
        Ok(self.answer(asked))
    }

    fn telegram(&mut self, source: Source, address: u8, line: &str) -> Result<Asked, String> {
        let command = command(line)?;
        self.module.hear(source, Client::default(), &binary::encode_command(address, command));
        Ok(Asked::Command(source, command))
    }

    fn frame(&mut self, id: u16, bytes: &[u8]) {
        self.module.receive_frame(Frame::standard(id, bytes).expect("a frame has eight bytes at most"));
    }

    /// The answer to a request, as text.
    fn answer(&mut self, asked: Asked) -> Option<String> {
        let mut received_text = Vec::new();
        if !matches!(asked, Asked::Nothing) {
            let end = self.module.now() + PATIENCE;
            while received_text.is_empty() && self.module.now() < end {
                self.module.run(SLOT);
                received_text = self.received_text(asked);
            }
        } else {
            received_text = self.received_text(asked);
        }
        match (received_text.is_empty(), asked) {
            (true, Asked::Nothing) => None,
            (true, _) => Some("-".into()),
            (false, _) => Some(received_text.join(" ")),
        }
    }

    /// Everything that the module has sent since the last call, as text.
    fn received_text(&mut self, asked: Asked) -> Vec<String> {
        let mut received_text: Vec<String> = Vec::new();
        let mut typed = Vec::new();
        while let Some(sent) = self.module.sent() {
            if matches!(asked, Asked::Text(source) if source == sent.source) {
                typed.extend(sent.bytes);
            } else {
                received_text.push(shown(asked, sent.source, &sent.bytes));
            }
        }
        if !typed.is_empty() {
            received_text.push(format!("\"{}\"", typed.escape_ascii()));
        }
        while let Some(frame) = self.module.frame() {
            let Id::Standard(id) = frame.id() else { panic!("an identifier of 29 bits") };
            received_text.push(format!("{}#{}", id.as_raw(), hex(frame.data())));
        }
        received_text
    }

    fn look(&self) -> String {
        let State { first: AxisState { rotor, current, bridges_on, .. }, outputs, pull_ups, .. } =
            State::of(&self.module.board().borrow());
        let [bridges, out_0, out_1, pull_ups] = [bridges_on, outputs[0], outputs[1], pull_ups].map(u8::from);
        format!("rotor {rotor}, current {current}, bridges {bridges}, outputs {out_0}{out_1}, pull-ups {pull_ups}")
    }
}

/// The bytes that the module has sent over a byte link, as text.
fn shown(asked: Asked, source: Source, bytes: &[u8]) -> String {
    let (from, command) = match asked {
        Asked::Command(from, command) => (Some(from), Some(command)),
        Asked::Bytes(from) | Asked::Text(from) => (Some(from), None),
        Asked::Nothing | Asked::Frame => (None, None),
    };
    let mut shown = String::new();
    if from != Some(source) {
        write!(shown, "{source:?} ").unwrap();
    }
    let command = command.filter(|_| from == Some(source));
    let whole = bytes.try_into().ok().filter(|_| command.is_none_or(|command| command.opcode != READ_MEMORY));
    let sum = |telegram: &binary::Telegram| binary::checksum(telegram) == telegram[8];
    let Some([host, module, status, opcode, a, b, c, d, _]) = whole.filter(|telegram| sum(telegram)) else {
        return shown + &hex(bytes);
    };
    if (host, module) != (2, 1) {
        write!(shown, "{host}<{module} ").unwrap();
    }
    write!(shown, "{status}").unwrap();
    if command.is_none_or(|command| command.opcode != opcode) {
        write!(shown, ":{opcode}").unwrap();
    }
    let value = i32::from_be_bytes([a, b, c, d]);
    if value == 0 || command.is_none_or(|command| command.value != value) {
        write!(shown, " {value}").unwrap();
    }
    shown
}

fn command(line: &str) -> Result<Command, String> {
    text::parse(line).map_err(|error| error.to_string())
}

fn link(name: &str) -> Result<Source, String> {
    match name {
        "USB" => Ok(Source::Usb),
        "RS485" => Ok(Source::Rs485),
        _ => Err(format!("'{name}' is neither USB nor RS485")),
    }
}

fn span(text: &str) -> Result<Nanos, String> {
    let (number, unit) = text.split_once(' ').ok_or("wait NUMBER UNIT")?;
    let unit = match unit {
        "ms" => MILLISECOND,
        "s" => SECOND,
        _ => return Err("the units are ms and s".into()),
    };
    number.parse::<Nanos>().map(|number| number * unit).map_err(|error| error.to_string())
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02X}")).collect()
}

fn from_hex(text: &str) -> Result<Vec<u8>, String> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).map_err(|error| error.to_string())).collect()
}
