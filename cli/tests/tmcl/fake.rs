//! A module made for tests that has program memory and little else, and faults that real ones seldom show.
//!
//! It knows what a host asks of a program (manual section 3.7.38) and a handful of commands: CALC ADD and LOAD, JA,
//! WAIT and STOP; all others do nothing.

use std::collections::HashMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard};

use tmcm::product::TMCM_1140;
use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Command, Opcode, Reply, Status, text};

/// Commands its memory holds.
const SIZE: usize = 64;
/// The axis parameter with the actual position.
pub(crate) const POSITION: u8 = 1;
/// How often it has to be asked before a WAIT is over.
const WAIT: u32 = 3;

/// The state of the module.
#[derive(Default)]
pub(crate) struct State {
    pub(crate) memory: Vec<Command>,
    /// Global parameter 77.
    pub(crate) autostart: i32,
    /// Global parameter 81.
    pub(crate) protection: i32,
    /// An address that does not hold what it is given.
    pub(crate) broken: Option<usize>,
    /// An address at which it is restarted during a download.
    pub(crate) restarts: Option<usize>,
    /// An address during a download from which on it answers nothing.
    pub(crate) dies: Option<usize>,
    /// True if the module has died.
    pub(crate) dead: bool,
    /// 0 stop, 1 run, 2 step, 3 reset.
    pub(crate) mode: u8,
    pub(crate) counter: usize,
    pub(crate) accumulator: i32,
    pub(crate) download: Option<usize>,
    pub(crate) waiting: u32,
    /// The module's kind, by the reply to command 136, type 1; 0 is a TMCM-1140.
    pub(crate) version: i32,
    /// True if the module does not answer command 136.
    pub(crate) mute: bool,
    /// Number of its axes; 0 is one.
    pub(crate) axes: u8,
    /// How often its motor still moves: it is at its target at once. After that it never moves.
    pub(crate) jumps: usize,
    /// Axis parameters by their number; those that are not here are 0.
    pub(crate) parameters: HashMap<u8, i32>,
    /// The deeds of the module on commands, in place of the usual.
    pub(crate) instead: Option<Instead>,
    /// Everything that it has been asked.
    pub(crate) asked: Vec<Command>,
}

/// A function for the deed of a module on a command, in place of the usual, if anything.
pub(crate) type Instead = Box<dyn FnMut(Command) -> Option<Deed> + Send>;

/// Something that a module does in place of the usual.
pub(crate) enum Deed {
    /// The module refuses the command.
    Refusal,
    /// The module does not answer.
    Silence,
    /// The module answers with this value.
    Value(i32),
}

impl State {
    fn answer(&mut self, command: Command) -> Option<Reply> {
        self.asked.push(command);
        let opcode = Opcode::from_number(command.opcode);
        match self.instead.as_mut().and_then(|instead| instead(command)) {
            Some(Deed::Refusal) => return Some(Reply::echo(Status::InvalidValue, command)),
            Some(Deed::Silence) => return None,
            Some(Deed::Value(value)) => {
                return Some(Reply::Plain { status: Status::Ok, opcode: command.opcode, value });
            }
            None => {}
        }
        self.dead |= self.dies.is_some() && self.download == self.dies;
        match self.download {
            _ if self.dead => None,
            Some(address) if command.opcode < Opcode::StopApplication as u8 => Some(self.store(address, command)),
            _ if self.mute && opcode == Some(Opcode::FirmwareVersion) => None,
            _ => Some(self.execute(opcode, command)),
        }
    }

    /// How often it has been asked what it is.
    pub(crate) fn identified(&self) -> usize {
        self.asked.iter().filter(|command| command.opcode == Opcode::FirmwareVersion as u8).count()
    }

    fn store(&mut self, address: usize, command: Command) -> Reply {
        if self.restarts == Some(address) {
            self.download = None;
            return Reply::echo(Status::Ok, command);
        }
        let Some(place) = self.memory.get_mut(address) else { return Reply::echo(Status::InvalidValue, command) };
        *place = if self.broken == Some(address) { Command::default() } else { command };
        self.download = Some(address + 1);
        Reply::echo(Status::Loaded, command)
    }

    fn execute(&mut self, opcode: Option<Opcode>, command: Command) -> Reply {
        let value = |value| Reply::Plain { status: Status::Ok, opcode: command.opcode, value };
        let Command { kind, motor, value: wanted, .. } = command;
        match (opcode, kind) {
            (Some(Opcode::FirmwareVersion), 1) if self.version == 0 => return value(TMCM_1140.version_number()),
            (Some(Opcode::FirmwareVersion), 1) => return value(self.version),
            (Some(Opcode::Ggp), 81) => return value(self.protection),
            (Some(Opcode::Sgp), 77) => self.autostart = wanted,
            (Some(Opcode::Gap), _) if motor >= self.axes.max(1) => return Reply::echo(Status::InvalidValue, command),
            (Some(Opcode::Gap), _) => return value(self.parameters.get(&kind).copied().unwrap_or_default()),
            (Some(Opcode::Sap), _) => _ = self.parameters.insert(kind, wanted),
            (Some(Opcode::Mvp), _) if self.jumps > 0 => {
                self.jumps -= 1;
                self.parameters.insert(POSITION, wanted);
            }
            (Some(Opcode::StopApplication), _) => self.mode = 0,
            (Some(Opcode::RunApplication), _) => {
                self.mode = 1;
                self.counter = if kind == 1 { wanted as usize } else { self.counter };
            }
            (Some(Opcode::StepApplication), _) => self.step(),
            (Some(Opcode::ResetApplication), _) => {
                (self.mode, self.counter, self.accumulator, self.waiting) = (3, 0, 0, 0);
            }
            (Some(Opcode::EnterDownload), _) if self.protection != 0 => {
                return Reply::echo(Status::EepromLocked, command);
            }
            (Some(Opcode::EnterDownload), _) => self.download = Some(wanted as usize),
            (Some(Opcode::ExitDownload), _) => self.download = None,
            (Some(Opcode::ReadMemory), _) => return Reply::Memory(self.memory[wanted as usize]),
            (Some(Opcode::ApplicationStatus), 2) => return value(self.accumulator),
            (Some(Opcode::ApplicationStatus), 3) => return value(0),
            (Some(Opcode::ApplicationStatus), _) => {
                let waiting = u8::from(self.waiting > 0);
                self.waiting = self.waiting.saturating_sub(1);
                let [high, low] = (self.counter as u16).to_be_bytes();
                return value(i32::from_be_bytes([self.mode, waiting, high, low]));
            }
            _ => {}
        }
        Reply::echo(Status::Ok, command)
    }

    fn step(&mut self) {
        let command = self.memory[self.counter];
        self.mode = 2;
        self.counter += 1;
        match (Opcode::from_number(command.opcode), command.kind) {
            (Some(Opcode::Calc), 0) => self.accumulator += command.value,
            (Some(Opcode::Calc), 9) => self.accumulator = command.value,
            (Some(Opcode::Ja), _) => self.counter = command.value as usize,
            (Some(Opcode::Wait), _) => self.waiting = WAIT,
            (Some(Opcode::Stop) | None, _) => {
                self.mode = 0;
                self.counter = 0;
            }
            _ => {}
        }
    }
}

/// A fake module that listens until the test is over.
pub(crate) struct Fake {
    state: Arc<Mutex<State>>,
    /// How `tmcl` reaches it.
    pub(crate) link: String,
}

impl Fake {
    pub(crate) fn start(state: State) -> Self {
        let state = State { memory: vec![Command::default(); SIZE], ..state };
        let state = Arc::new(Mutex::new(state));
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let link = format!("tcp:{}", listener.local_addr().unwrap());
        let served = Arc::clone(&state);
        std::thread::spawn(move || listener.incoming().for_each(|stream| serve(stream.unwrap(), &served)));
        Fake { state, link }
    }

    pub(crate) fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap()
    }
}

fn serve(mut stream: TcpStream, state: &Mutex<State>) {
    let mut request = [0; TELEGRAM];
    while stream.read_exact(&mut request).is_ok() {
        let reply = state.lock().unwrap().answer(binary::decode_command(&request).unwrap());
        if let Some(reply) = reply {
            stream.write_all(&binary::encode_reply(2, 1, &reply)).unwrap();
        }
    }
}

/// The binary form of a program.
pub(crate) fn program(lines: &[&str]) -> Vec<u8> {
    let records = lines.iter().map(|line| {
        let bytes = text::parse(line).unwrap().to_bytes();
        let sum = bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
        bytes.into_iter().chain([sum])
    });
    records.flatten().collect()
}
