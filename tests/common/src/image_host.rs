//! The flash image on the emulated microcontroller, with a host on each of its links, in virtual time.

use std::sync::OnceLock;

use crate::{image as build, telegram};
use hal_sim::board::{Board, BoardKind, TMCM_1140, TMCM_3212, TMCM_6110};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::{AxisState, Line, State};
use hal_sim::fault::Fault;
use hal_sim::mcu::{CanFrame, Character, Machine};
use hal_sim::world::config::WorldConfig;
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSymbol};
use tmcm::tmcl::{binary, can, text};

/// Factory default of the RS485 bit rate, in bit/s.
pub const BAUD: u32 = 9_600;
/// Core cycles per microsecond.
pub const CYCLES_PER_MICROSECOND: u64 = 168;
/// Longest time that a host waits for a reply.
const PATIENCE: Nanos = 2 * SECOND;
/// Time from power-on after which the module answers for certain.
pub const START: Nanos = 200 * MILLISECOND;

/// The watchdog takes 250 ms on its clock of nominally 32 kHz; with the last round before, and the time to start
/// anew, all is well after this.
pub const RECOVERY: Nanos = 600 * MILLISECOND;

/// `b .`: an instruction that goes on for ever.
pub const HANG: [u8; 2] = 0xE7FE_u16.to_le_bytes();
/// `udf #0`: there is no such instruction.
pub const UNDEFINED: [u8; 2] = 0xDE00_u16.to_le_bytes();

/// Status of a reply: the command was executed.
pub const OK: u8 = 100;
/// Status of a reply: the command was stored in program memory.
pub const LOADED: u8 = 101;
/// Status of a reply: the command number is unknown.
pub const INVALID_COMMAND: u8 = 2;
/// Status of a reply: the EEPROM cannot be written.
pub const EEPROM_LOCKED: u8 = 5;
/// Status of a reply: the command is not available in this mode or state.
pub const NOT_AVAILABLE: u8 = 6;

/// The bytes of the image, which is built at the first call.
pub fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| std::fs::read(build::image()).unwrap())
}

/// The bytes of the image of the TMCM-6110, which is built at the first call.
pub fn six_axes() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| std::fs::read(build::six_axes()).unwrap())
}

/// The bytes of the image of the TMCM-3212, which is built at the first call.
pub fn three_axes() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| std::fs::read(build::three_axes()).unwrap())
}

/// A product with an image.
#[derive(Clone, Copy, Debug)]
pub struct Product {
    /// The parts of which its board consists.
    pub board: &'static BoardKind,
    /// The bytes of its image, which is built at the first call.
    pub image: fn() -> &'static [u8],
    /// The speed that its motion controllers have for a motor that turns at 500 (ROR): 500 pps are 524.3 units of a
    /// TMC5160.
    pub turning: i32,
}

/// The TMCM-1140 and its image.
pub const ONE_AXIS: Product = Product { board: &TMCM_1140, image, turning: 500 };
/// The TMCM-6110 and its image.
pub const SIX_AXES: Product = Product { board: &TMCM_6110, image: six_axes, turning: 500 };
/// The TMCM-3212 and its image.
pub const THREE_AXES: Product = Product { board: &TMCM_3212, image: three_axes, turning: 524 };
/// All of them.
pub const PRODUCTS: [Product; 3] = [ONE_AXIS, SIX_AXES, THREE_AXES];

/// Address of an image's only symbol with exactly this name.
pub fn symbol_in(image: &[u8], name: &str) -> u32 {
    let elf = ElfFile32::<Endianness>::parse(image).unwrap();
    elf.symbols().find(|symbol| symbol.name() == Ok(name)).unwrap_or_else(|| panic!("no {name}")).address() as u32
}

/// Address of the code of a function; that of its symbol says that it is Thumb code.
pub fn code(symbol: u32) -> u32 {
    symbol & !1
}

/// Asserts that the log says all this, in this order, whatever else.
#[track_caller]
pub fn assert_logged(log: &[String], expected: &[&str]) {
    let mut rest = log.iter();
    for text in expected {
        assert!(rest.any(|line| line.contains(text)), "'{text}' is not in the log: {log:#?}");
    }
}

/// A module that runs an image, and the hosts on its links.
pub struct Host {
    /// The microcontroller with all that is around it.
    pub machine: Machine,
    /// The image.
    elf: &'static [u8],
    /// Bit rate of the host on RS485, in bit/s.
    pub baud: u32,
}

impl Host {
    /// A TMCM-1140 that has started, with a fresh EEPROM, in the world that the text describes.
    pub fn new(world: &str) -> Self {
        Self::of(ONE_AXIS, world)
    }

    /// A TMCM-1140 that was switched on a moment ago, with a fresh EEPROM, in the world that the text describes.
    pub fn just_on(world: &str) -> Self {
        Self::just_on_of(ONE_AXIS, world)
    }

    /// A TMCM-1140 that has started, with these contents of its EEPROM.
    pub fn with_eeprom(contents: &[u8]) -> Self {
        let mut board = Board::new(&WorldConfig::default(), 0);
        board.at25_mut().load(contents);
        let mut host = Self::on(board, image());
        host.run(START);
        host
    }

    /// A TMCM-1140 whose motor is on its way, at 500, and whose log has been read.
    pub fn moving() -> Self {
        Self::moving_of(ONE_AXIS)
    }

    /// A module of a product that has started, with a fresh EEPROM, in the world that the text describes.
    pub fn of(product: Product, world: &str) -> Self {
        let mut host = Self::just_on_of(product, world);
        host.run(START);
        host
    }

    /// A module of a product that was switched on a moment ago, with a fresh EEPROM, in the world that the text
    /// describes.
    pub fn just_on_of(product: Product, world: &str) -> Self {
        let world = WorldConfig::parse_for(product.board, world).unwrap();
        Self::on(Board::of_kind(product.board, &world, 0), (product.image)())
    }

    /// A module of a product whose motors are all on their way, at 500, and whose log has been read.
    pub fn moving_of(product: Product) -> Self {
        let mut host = Self::of(product, "");
        host.each("ROR #, 500");
        host.run(200 * MILLISECOND);
        assert_eq!(host.speed(), product.turning);
        host.log();
        host
    }

    /// A module that was switched on a moment ago, on this board with this image.
    pub fn on(board: Board, elf: &'static [u8]) -> Self {
        Host { machine: Machine::new(elf, board).unwrap(), elf, baud: BAUD }
    }

    /// Addresses of the image's symbols whose names contain all these words.
    pub fn symbols(&self, words: &[&str]) -> Vec<u32> {
        let elf = ElfFile32::<Endianness>::parse(self.elf).unwrap();
        let named = |name: &str| words.iter().all(|word| name.contains(word));
        elf.symbols().filter(|symbol| symbol.name().is_ok_and(named)).map(|symbol| symbol.address() as u32).collect()
    }

    /// Address of the image's only symbol with exactly this name.
    pub fn symbol(&self, name: &str) -> u32 {
        symbol_in(self.elf, name)
    }

    /// The axes, by their numbers.
    pub fn axes(&mut self) -> std::ops::Range<usize> {
        0..self.machine.board().kind().axes()
    }

    /// Lets virtual time pass.
    pub fn run(&mut self, span: Nanos) {
        self.machine.run(span).unwrap_or_else(|stop| panic!("{stop}\n{:?}", self.machine.log().take()));
    }

    /// Lets virtual time pass until the microcontroller is reset; panics if no reset comes before `limit`.
    pub fn reset_within(&mut self, limit: Nanos) {
        assert!(self.machine.run_to_reset(self.machine.now() + limit).unwrap(), "no reset: {:?}", self.log());
    }

    /// Lets virtual time pass until `done` is true, which is checked every `step`; returns the time that has passed.
    /// Panics after `limit`.
    pub fn wait(&mut self, step: Nanos, limit: Nanos, mut done: impl FnMut(&mut Self) -> bool) -> Nanos {
        let start = self.machine.now();
        while !done(self) {
            assert!(self.machine.now() < start + limit, "not in time: {:?}", self.machine.log().take());
            self.run(step);
        }
        self.machine.now() - start
    }

    /// Sends a request over RS485 and waits for the reply; returns the time at which the request ended, and the reply.
    pub fn exchange(&mut self, line: &str) -> (Nanos, Vec<Character>) {
        let telegram = telegram(line);
        let end = self.machine.rs485().send(&telegram, self.baud);
        let mut reply = Vec::new();
        while reply.len() < telegram.len() {
            assert!(self.machine.now() < end + PATIENCE, "no reply to {line}: {:?}", self.machine.log().take());
            self.run(MILLISECOND);
            reply.extend(self.machine.rs485().take_sent());
        }
        (end, reply)
    }

    /// Sends a request over RS485 and gives status and value of the reply.
    pub fn ask(&mut self, line: &str) -> (u8, i32) {
        let (_, reply) = self.exchange(line);
        assert!(reply.iter().all(|character| character.driven), "the transceiver sends from start to end");
        let bytes: Vec<u8> = reply.iter().map(|character| character.value).collect();
        decoded(line, &bytes)
    }

    /// Sends a request over RS485 that must succeed and gives the value.
    pub fn ok(&mut self, line: &str) -> i32 {
        let (status, value) = self.ask(line);
        assert_eq!(status, OK, "{line}");
        value
    }

    /// Sends a request for each axis, whose number stands for the #; all must succeed. Gives the values.
    pub fn each(&mut self, line: &str) -> Vec<i32> {
        self.axes().map(|axis| self.ok(&line.replace('#', &axis.to_string()))).collect()
    }

    /// Sends bytes over RS485 and gives those that come back within a time.
    pub fn said_to(&mut self, bytes: &[u8], span: Nanos) -> Vec<u8> {
        let now = self.machine.now();
        let end = self.machine.rs485().send_at(now, bytes, self.baud).max(now);
        self.machine.run_until(end + span).unwrap();
        self.machine.rs485().take_sent().iter().map(|character| character.value).collect()
    }

    /// Plugs the USB cable in and waits until the port is open.
    pub fn plug_usb(&mut self) {
        self.machine.usb().plug(true);
        self.wait(10 * MILLISECOND, 2 * SECOND, |host| host.machine.usb().device().open);
    }

    /// Bytes that come over USB within a time.
    pub fn hear_usb(&mut self, span: Nanos) -> Vec<u8> {
        self.run(span);
        self.machine.usb().take().into_iter().flat_map(|(_, packet)| packet).collect()
    }

    /// Sends a request over USB and gives status and value of the reply.
    pub fn ask_usb(&mut self, line: &str) -> (u8, i32) {
        self.machine.usb().send(&telegram(line));
        let mut reply = Vec::new();
        self.wait(MILLISECOND, PATIENCE, |host| {
            reply.extend(host.machine.usb().take().into_iter().flat_map(|(_, packet)| packet));
            reply.len() >= 9
        });
        decoded(line, &reply)
    }

    /// Sends a request under a CAN identifier and gives the frames that come back within a time.
    pub fn said_on_can(&mut self, id: u32, line: &str, span: Nanos) -> Vec<CanFrame> {
        self.machine.can().send(request(id, line));
        self.run(span);
        self.machine.can().take_sent().into_iter().map(|(_, frame)| frame).collect()
    }

    /// Sends a request over CAN to identifier 1 and gives status and value of the reply.
    pub fn ask_can(&mut self, line: &str) -> (u8, i32) {
        let said = self.said_on_can(1, line, 20 * MILLISECOND);
        let [CanFrame { id: 2, extended: false, remote: false, length: 8, data }] = *said else {
            panic!("{line}: {said:?}, {:?}", self.machine.log().take())
        };
        let [1, status, _, a, b, c, d, 0] = data else { panic!("{line}: {data:?}") };
        (status, i32::from_be_bytes([a, b, c, d]))
    }

    /// Injects or removes a fault of the board.
    pub fn fault(&mut self, fault: Fault, on: bool) {
        self.machine.board().set_fault(fault, 0, on);
    }

    /// Does what a line of the control protocol says.
    pub fn control(&mut self, line: &str) {
        Line::parse(line).unwrap().control.apply(&mut self.machine.board()).unwrap();
    }

    /// Returns the states of the axes, as the world and the chips show them.
    pub fn states(&mut self) -> Vec<AxisState> {
        State::of(&self.machine.board()).axes
    }

    /// Texts of the log since the last call, with their levels.
    pub fn log(&mut self) -> Vec<String> {
        self.machine.log().take().into_iter().map(|line| format!("{}: {}", line.level, line.text)).collect()
    }

    /// Position of the rotor of axis 0 in 1/256 full steps.
    pub fn rotor(&mut self) -> i64 {
        self.rotors()[0]
    }

    /// Positions of all rotors in 1/256 full steps.
    pub fn rotors(&mut self) -> Vec<i64> {
        self.states().iter().map(|axis| axis.rotor).collect()
    }

    /// The speed of all axes in internal units, read from the models of the motion controllers instead of asked for by
    /// telegrams. Panics if it is not the same for all.
    pub fn speed(&mut self) -> i32 {
        let speeds = self.speeds();
        assert!(speeds.iter().all(|speed| *speed == speeds[0]), "{speeds:?}");
        speeds[0]
    }

    /// The speeds of the axes.
    pub fn speeds(&mut self) -> Vec<i32> {
        self.states().iter().map(|axis| axis.velocity).collect()
    }

    /// True if the drivers' bridges are on, so that the motors have current. Panics if some are on and some are not.
    pub fn bridges_on(&mut self) -> bool {
        let on: Vec<bool> = self.states().iter().map(|axis| axis.bridges_on).collect();
        assert!(on.iter().all(|one| *one == on[0]), "{on:?}");
        on[0]
    }

    /// Asserts that all motors stand still. At a speed of 500 internal units a rotor would move by 1 500 microsteps
    /// meanwhile.
    pub fn assert_rest(&mut self) {
        let rotors = self.rotors();
        self.run(100 * MILLISECOND);
        assert_eq!((self.rotors(), self.speed()), (rotors, 0));
    }
}

/// The frame of a request to the module with an identifier.
pub fn request(id: u32, line: &str) -> CanFrame {
    let mut data = [0; 8];
    data.copy_from_slice(&can::encode_command(text::parse(line).unwrap()));
    CanFrame { id, extended: false, remote: false, length: 8, data }
}

/// Status and value of the reply of module 1 to host 2.
pub fn decoded(line: &str, bytes: &[u8]) -> (u8, i32) {
    let reply = binary::decode_reply(bytes.try_into().unwrap_or_else(|_| panic!("{line}: {bytes:?}"))).unwrap();
    assert_eq!((bytes[0], bytes[1], reply.opcode), (2, 1, text::parse(line).unwrap().opcode), "{line}");
    (reply.status, reply.value)
}
