//! Programs on the bench: downloaded, run, stepped and inspected by telegrams.

use crate::{Bench, OK};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary, text};
use tmcm_sim::VirtualModule;

/// Status of a reply during a download: the command was stored in program memory.
pub const STORED: u8 = 101;

/// Size of program memory in commands.
pub const MEMORY: i32 = 2048;
/// Largest number of return addresses on the stack.
pub const STACK: usize = 8;
/// Length of a tick of the command WAIT.
pub const TICK: Nanos = 10 * MILLISECOND;

/// State of the program, as command 135 and global parameter 128 number it: stopped.
pub const STOPPED: i32 = 0;
/// State of the program: running.
pub const RUNNING: i32 = 1;
/// State of the program: executed step by step.
pub const STEPPING: i32 = 2;
/// State of the program: reset.
pub const RESET: i32 = 3;

/// Longest time that a program may take to its end, in virtual time.
const PATIENCE: Nanos = 20 * SECOND;

/// The value of the reply to command 135, types 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// The state of the program.
    pub mode: i32,
    /// True if the program waits (WAIT).
    pub waiting: bool,
    /// The memory pointer (type 0) or the program counter (type 1).
    pub pointer: i32,
}

impl Status {
    fn from_value(value: i32) -> Self {
        let [mode, waiting, high, low] = value.to_be_bytes();
        assert!(waiting <= 1, "the wait flag is 0 or 1, not {waiting}");
        Status { mode: mode.into(), waiting: waiting == 1, pointer: u16::from_be_bytes([high, low]).into() }
    }
}

/// The command that a line says in mnemonic form.
pub fn command(line: &str) -> Command {
    text::parse(line).unwrap()
}

impl Bench {
    /// A fresh module with this program downloaded to address 0.
    pub fn with_program(lines: &[&str]) -> Self {
        let mut bench = Bench::new();
        bench.download(0, lines);
        bench
    }

    /// A fresh module on which this program has run to its end.
    pub fn played(lines: &[&str]) -> Self {
        let mut bench = Self::with_program(lines);
        bench.run_to_end(0);
        bench
    }

    /// Downloads commands to an address of program memory: 132, the commands, 133.
    pub fn download(&mut self, address: i32, lines: &[&str]) {
        self.ok(&format!("132, 0, 0, {address}"));
        for line in lines {
            assert_eq!(self.ask(line).0, STORED, "{line}");
        }
        self.ok("133");
    }

    /// Starts the program at an address.
    pub fn start(&mut self, address: i32) {
        self.ok(&format!("129, 1, 0, {address}"));
    }

    /// Starts the program at an address and waits for its end.
    pub fn run_to_end(&mut self, address: i32) {
        self.start(address);
        self.await_end();
    }

    /// Waits until no program runs.
    pub fn await_end(&mut self) {
        self.run_until(PATIENCE, |bench| bench.mode() != RUNNING);
    }

    /// Starts the program at an address without letting virtual time pass: the command goes over RS485, whose replies
    /// come at once.
    pub fn set_off(&mut self, address: i32) {
        self.module.receive(Source::Rs485, binary::encode_command(1, Command::new(129, 1, 0, address)));
        let sent = self.module.sent().expect("129 is answered at once");
        assert_eq!(binary::decode_reply(&sent.telegram().unwrap()).unwrap().status, OK);
    }

    /// Command 135, type 0: mode, wait flag and memory pointer.
    pub fn memory_status(&mut self) -> Status {
        Status::from_value(self.ok("135, 0"))
    }

    /// Command 135, type 1: mode, wait flag and program counter.
    pub fn status(&mut self) -> Status {
        Status::from_value(self.ok("135, 1"))
    }

    /// The state of the program.
    pub fn mode(&mut self) -> i32 {
        self.status().mode
    }

    /// The program counter: command 135, type 1.
    pub fn program_counter(&mut self) -> i32 {
        self.status().pointer
    }

    /// The accumulator: command 135, type 2.
    pub fn accumulator(&mut self) -> i32 {
        self.ok("135, 2")
    }

    /// The X register: command 135, type 3.
    pub fn x(&mut self) -> i32 {
        self.ok("135, 3")
    }

    /// The value of a user variable.
    pub fn variable(&mut self, number: u8) -> i32 {
        self.ok(&format!("GGP {number}, 2"))
    }

    /// The command at an address of program memory, read by command 134, whose reply has no status.
    pub fn memory(&mut self, address: i32) -> Command {
        let request = binary::encode_command(1, Command::new(134, 0, 0, address));
        let sent = self.exchange(Source::Usb, request).expect("134 is answered");
        let [_, opcode, kind, motor, a, b, c, d, _] = sent.telegram().unwrap();
        Command::new(opcode, kind, motor, i32::from_be_bytes([a, b, c, d]))
    }

    /// The commands from an address of program memory on.
    pub fn listing(&mut self, from: i32, count: i32) -> Vec<Command> {
        (from..from + count).map(|address| self.memory(address)).collect()
    }

    /// The levels of the two general purpose outputs in the world.
    pub fn outputs(&self) -> [bool; 2] {
        let outputs = self.module.board().borrow().world().outputs();
        [0, 1].map(|number| outputs.is_on(number))
    }

    /// Lets virtual time pass and gives the times at which an output changed.
    pub fn edges(&mut self, output: usize, span: Nanos) -> Vec<Nanos> {
        let end = self.module.now() + span;
        let mut edges = Vec::new();
        let mut level = self.outputs()[output];
        while self.module.now() < end {
            let next = self.module.next_event().unwrap_or(end).min(end);
            self.module.run_until(next);
            let _ = self.module.sent();
            if self.outputs()[output] != level {
                level = !level;
                edges.push(self.module.now());
            }
        }
        edges
    }

    /// Sends a command that must succeed over RS485, which is not the link of the download.
    pub fn ok_beside(&mut self, line: &str) -> i32 {
        let reply = self.ask_over(Source::Rs485, 1, line).expect("a reply");
        assert_eq!(reply.status, OK, "{line}");
        reply.value
    }

    /// Sends a command over RS485, which is not the link of the download, and gives the status.
    pub fn ask_beside(&mut self, line: &str) -> u8 {
        self.post(Source::Rs485, line);
        loop {
            let next = self.module.next_event().expect("a reply");
            self.module.run_until(next);
            if let Some(sent) = self.module.sent()
                && sent.source == Source::Rs485
            {
                return binary::decode_reply(&sent.telegram().unwrap()).unwrap().status;
            }
        }
    }
}

/// The spans between successive times.
pub fn spans(moments: &[Nanos]) -> Vec<Nanos> {
    moments.windows(2).map(|pair| pair[1] - pair[0]).collect()
}
