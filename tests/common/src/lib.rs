//! The bench: a virtual module in virtual time, tested by telegrams and by the state of its world.

// A bench has a module that works, which is more than a default.
#![allow(clippy::new_without_default)]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod axis;
pub mod bombardment;
pub mod image;
pub mod image_host;
pub mod loose;
pub mod node_host;
pub mod pages;
pub mod pair;
pub mod products;
pub mod program;
pub mod random;
pub mod random_command;
pub mod row;
pub mod table;
pub mod tmcm1110;
pub mod tmcm3212;

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::Line;
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{Command, text};
use tmcm_sim::client::Sent;
use tmcm_sim::{NativeModule, Product, VirtualModule};

/// Longest time that a test waits for a reply, in virtual time.
const PATIENCE: Nanos = 2_000 * MILLISECOND;

/// Status of a reply: the command was executed.
pub const OK: u8 = 100;
/// Status of a reply: the checksum was wrong.
pub const WRONG_CHECKSUM: u8 = 1;
/// Status of a reply: the command number is unknown.
pub const INVALID_COMMAND: u8 = 2;
/// Status of a reply: the type is unknown, or the parameter is read-only.
pub const WRONG_TYPE: u8 = 3;
/// Status of a reply: the value, motor or bank is out of range.
pub const INVALID_VALUE: u8 = 4;
/// Status of a reply: the EEPROM cannot be written.
pub const EEPROM_LOCKED: u8 = 5;
/// Status of a reply: the command is not available in this mode or state.
pub const NOT_AVAILABLE: u8 = 6;

/// Number of random inputs that a test takes: `usual`, or the value of the environment variable RANDOM_INPUTS, as in
/// `RANDOM_INPUTS=1000000 cargo test --test module -- bad_input ascii`.
pub fn random_inputs(usual: u64) -> u64 {
    std::env::var("RANDOM_INPUTS").map_or(usual, |text| text.parse().expect("RANDOM_INPUTS is not a number"))
}

/// The telegram of a command, in mnemonic form, to module 1.
pub fn telegram(line: &str) -> Telegram {
    binary::encode_command(1, text::parse(line).unwrap())
}

/// A module of firmware in virtual time, with a host at each of its links.
pub struct Bench {
    /// The module, with the board and the world that it is in.
    pub module: NativeModule,
}

impl Bench {
    /// A TMCM-1140 in the default world, with a fresh EEPROM.
    pub fn new() -> Self {
        Self::in_world("")
    }

    /// A module of any product in the default world, with a fresh EEPROM.
    pub fn of(product: Product) -> Self {
        Self::of_in_world(product, "")
    }

    /// A TMCM-1140 in the world that the text describes.
    pub fn in_world(toml: &str) -> Self {
        Self::of_in_world(Product::Tmcm1140, toml)
    }

    /// A module of any product in the world that the text describes.
    pub fn of_in_world(product: Product, toml: &str) -> Self {
        let config = WorldConfig::parse_for(product.kind(), toml).unwrap();
        Bench { module: NativeModule::of(product, &config, None, 1) }
    }

    /// A TMCM-1140 in the default world whose EEPROM has these contents.
    pub fn with_eeprom(contents: &[u8]) -> Self {
        Bench { module: NativeModule::new(&WorldConfig::default(), Some(contents), 1) }
    }

    /// A TMCM-1140 whose EEPROM has these contents, and which does the same at random as any other with this seed; it
    /// has started.
    pub fn resumed(eeprom: &[u8], seed: u32) -> Self {
        Self::resumed_as(Product::Tmcm1140, eeprom, seed)
    }

    /// The same with any product.
    pub fn resumed_as(product: Product, eeprom: &[u8], seed: u32) -> Self {
        let mut bench = Bench { module: NativeModule::of(product, &WorldConfig::default(), Some(eeprom), seed) };
        bench.run(MILLISECOND);
        bench
    }

    /// Tells which product the module is.
    pub fn product(&self) -> Product {
        self.module.model().product()
    }

    /// Sends a telegram over a link and waits for the reply; `None` if no reply comes.
    pub fn exchange(&mut self, source: Source, telegram: Telegram) -> Option<Sent> {
        self.module.exchange(source, telegram, PATIENCE)
    }

    /// Sends a command over USB and gives the reply as the host sees it.
    pub fn send(&mut self, command: Command) -> Received {
        let sent = self.exchange(Source::Usb, binary::encode_command(1, command));
        let telegram = sent.unwrap_or_else(|| panic!("no reply to {command}")).telegram().unwrap();
        binary::decode_reply(&telegram).unwrap()
    }

    /// Sends a command in mnemonic form and gives status and value.
    pub fn ask(&mut self, line: &str) -> (u8, i32) {
        let reply = self.send(text::parse(line).unwrap());
        (reply.status, reply.value)
    }

    /// Sends a command that must succeed and gives the value.
    pub fn ok(&mut self, line: &str) -> i32 {
        let (status, value) = self.ask(line);
        assert_eq!(status, OK, "{line}");
        value
    }

    /// Sends commands that must all succeed.
    pub fn configure(&mut self, lines: &[&str]) {
        for line in lines {
            self.ok(line);
        }
    }

    /// Sends a command to module 1 over a link and does not wait for the reply.
    pub fn post(&mut self, source: Source, line: &str) {
        self.module.receive(source, telegram(line));
    }

    /// Sends a command that must be refused with this status, and checks that the reply echoes it.
    pub fn refused(&mut self, line: &str, status: u8) {
        let command = text::parse(line).unwrap();
        let reply = self.send(command);
        assert_eq!((reply.status, reply.opcode, reply.value), (status, command.opcode, command.value), "{line}");
    }

    /// Sends a command to an address over a link and gives the reply; `None` if no reply comes.
    pub fn ask_over(&mut self, source: Source, address: u8, line: &str) -> Option<Received> {
        let telegram = binary::encode_command(address, text::parse(line).unwrap());
        let sent = self.exchange(source, telegram)?;
        assert_eq!(sent.source, source, "{line}: the reply goes where the command came from");
        Some(binary::decode_reply(&sent.telegram().unwrap()).unwrap())
    }

    /// Lets virtual time pass and gives the telegrams that the module sends meanwhile.
    pub fn listen(&mut self, span: Nanos) -> Vec<Received> {
        self.run(span);
        std::iter::from_fn(|| self.module.sent())
            .map(|sent| binary::decode_reply(&sent.telegram().unwrap()).unwrap())
            .collect()
    }

    /// The contents that the EEPROM would have after a power cut at this moment.
    pub fn eeprom(&self) -> Vec<u8> {
        self.module.board().borrow().at25().contents().to_vec()
    }

    /// Number of pages that the EEPROM has written since it was made.
    pub fn page_writes(&self) -> u32 {
        let board = self.module.board().borrow();
        (0..512).map(|page| board.at25().page_writes(page)).sum()
    }

    /// Lets virtual time pass.
    pub fn run(&mut self, span: Nanos) {
        self.module.run(span);
    }

    /// Lets virtual time pass until `done` is true, which is checked every millisecond; panics after `limit`.
    pub fn run_until(&mut self, limit: Nanos, mut done: impl FnMut(&mut Self) -> bool) {
        let end = self.module.now() + limit;
        while !done(self) {
            assert!(self.module.now() < end, "not in time");
            self.run(MILLISECOND);
        }
    }

    /// Carries out a command of the control protocol, as `tmcl sim --control` takes it.
    pub fn control(&mut self, line: &str) {
        let line = Line::parse(line).unwrap();
        line.control.apply(&mut self.module.board().borrow_mut()).unwrap();
    }

    /// Switches the supply off and on again.
    pub fn power_cycle(&mut self) {
        self.module.set_power(false);
        self.run(10 * MILLISECOND);
        self.module.set_power(true);
        self.run(MILLISECOND);
    }

    /// Position of the rotor in 1/256 full steps.
    pub fn rotor(&self) -> i64 {
        self.module.board().borrow().world().axis(0).motor().rotor()
    }

    /// The motor's speed in internal units, read from the model of the motion controller instead of asked for by a
    /// telegram.
    pub fn speed(&self) -> i32 {
        self.module.board().borrow().tmc429(0).velocity(0)
    }

    /// The current in the motor in 1/32 of full scale; 0 with the bridges off.
    pub fn current(&self) -> u32 {
        self.module.board().borrow().tmc262(0).current()
    }

    /// Full steps that the rotor has lost against the field of the windings.
    pub fn lost_steps(&self) -> i64 {
        self.module.board().borrow().world().axis(0).motor().lost_steps()
    }
}
