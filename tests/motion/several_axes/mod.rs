//! Modules with several axes, and with several motion controllers: all axes work at the same time, and nothing of one
//! shows in another. The TMCM-6110, and a product with three axes that exists in tests alone, run the module on
//! simulated boards in virtual time. They are told what to do by commands, and seen at their replies and at the world
//! around them.

mod apart;
mod at_once;
mod controllers;
mod faults;
mod groups;
mod line;
mod line_ends;
mod moves;
mod search;
mod storage;
mod switches;
mod traffic;

use common::products::{OnBoard, Three};
use hal_sim::board::{AxisInputs, Board, Chip, SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::control::{AxisState, Line, State};
use hal_sim::world::Outputs;
use hal_sim::world::config::WorldConfig;
use std::ops::Range;
use std::task::Poll;
use tmcm::chip::at25::At25;
use tmcm::device::{ANALOG, Inputs};
use tmcm::module::{Answer, Module, Source, Spec};
use tmcm::motion::Sensors;
use tmcm::param::AxisParameter;
use tmcm::product::{Tmcm3110, Tmcm6110};
use tmcm::store::Keeper;
use tmcm::tmcl::{Command, Opcode, Reply, Status, text};
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

/// Status of a reply: the command was executed.
const OK: u8 = Status::Ok as u8;
/// Status of a reply: the command is not available in this state.
const NOT_AVAILABLE: u8 = Status::NotAvailable as u8;
/// Status of the event of command 138.
const ARRIVED: u8 = Status::PositionReached as u8;
/// SPI clock of the EEPROM: 42 MHz / 16, as on the TMCM-1140.
const AT25_HZ: u32 = 2_625_000;
/// Microsteps per second that one unit of speed is with the default pulse divisor of 3: 16 MHz / (2^3 * 2048 * 32).
const UNIT_OF_SPEED: f64 = 16e6 / 524_288.0;

/// The firmware of a product, whichever it is.
trait AnyProduct {
    fn execute(&mut self, now: Micros, command: Command) -> Answer;
    fn deadline(&self) -> Micros;
    /// True if replies may have become due, which are fetched then, as the owner of a module does.
    fn poll(&mut self, board: &SharedBoard) -> bool;
    fn next_reply(&mut self) -> Option<Reply>;
}

/// The time on a board's clock.
fn time(board: &SharedBoard) -> Micros {
    Micros(board.borrow().now() / MICROSECOND)
}

struct Running<P: OnBoard, const AXES: usize, const N: usize> {
    module: Module<Simulated<(), P, N>, AXES>,
    keeper: Keeper<SimSpi>,
    /// When the EEPROM is looked after next.
    keep: Micros,
}

impl<P: OnBoard, const AXES: usize, const N: usize> Running<P, AXES, N> {
    fn start(board: &SharedBoard) -> Box<dyn AnyProduct> {
        let mut keeper = Keeper::new(At25::new(board.spi(Chip::At25, AT25_HZ)));
        let mut module = Module::new(parts(board), (), 1);
        module.start(time(board), |store| assert!(!keeper.load(store).unreachable));
        Box::new(Self { module, keeper, keep: time(board) })
    }

    fn inputs(board: &Board) -> Inputs<AXES> {
        let seen = board.inputs();
        let mut analog = [0; ANALOG];
        for (channel, port) in board.kind().analog().enumerate() {
            analog[port] = seen.analog[channel];
        }
        let axes = std::array::from_fn(|axis| {
            let seen = board.axis_inputs(axis);
            let external = seen.abn.count as u16;
            let AxisInputs { stall, home, right, encoder, .. } = seen;
            Sensors { stall, home, right, encoder, external, null: [None; 2] }
        });
        let (supply, temperature) = (Some(seen.supply), seen.temperature as i16);
        Inputs { axes, digital: seen.digital as u16, analog, supply, temperature }
    }
}

impl<P: OnBoard, const AXES: usize, const N: usize> AnyProduct for Running<P, AXES, N> {
    fn execute(&mut self, now: Micros, command: Command) -> Answer {
        self.module.execute(now, Source::Usb, command)
    }

    fn deadline(&self) -> Micros {
        self.module.deadline()
    }

    fn poll(&mut self, board: &SharedBoard) -> bool {
        let now = time(board);
        let inputs = Self::inputs(&board.borrow());
        let Some(outputs) = self.module.poll(now, &inputs) else { return false };
        if now >= self.keep {
            self.keep = now.after(Micros::from_millis(1));
            if let Some(written) = self.keeper.poll(now, || self.module.store().next_job()) {
                self.module.stored(written);
            }
        }
        board.borrow_mut().set_outputs(Outputs {
            digital: outputs.digital.into(),
            pull_ups: outputs.pull_ups.into(),
            leds: [outputs.led, outputs.trouble],
        });
        true
    }

    fn next_reply(&mut self) -> Option<Reply> {
        let due = self.module.next_reply().or_else(|| self.module.next_event(|_| true));
        due.and_then(|due| due.reply)
    }
}

/// A module of one of the two products, on its board in its world.
struct Bench {
    spec: &'static Spec,
    board: SharedBoard,
    firmware: Box<dyn AnyProduct>,
    start: fn(&SharedBoard) -> Box<dyn AnyProduct>,
    /// Replies that have come later than their commands, and events.
    late: Vec<Reply>,
}

impl Bench {
    fn of<P: OnBoard, const AXES: usize, const N: usize>(world: &str) -> Self {
        let config = WorldConfig::parse_for(P::BOARD, world).unwrap();
        let board = SharedBoard::new(Board::of_kind(P::BOARD, &config, 1));
        let start = Running::<P, AXES, N>::start;
        let firmware = start(&board);
        let mut bench = Bench { spec: P::SPEC, board, firmware, start, late: Vec::new() };
        // The module knows its inputs after the first turn.
        bench.run(2 * MILLISECOND);
        bench
    }

    /// The product with three axes on one controller.
    fn three(world: &str) -> Self {
        Self::of::<Three, 3, 1>(world)
    }

    /// The product with six axes on two controllers.
    fn six(world: &str) -> Self {
        Self::of::<Tmcm6110, 6, 2>(world)
    }

    /// The TMCM-3110.
    fn tmcm_3110(world: &str) -> Self {
        Self::of::<Tmcm3110, 3, 1>(world)
    }

    /// The products with three and with six axes, one after the other, in a world in which every axis has surroundings
    /// of its own: a table of the world file.
    fn both(axis: impl Fn(u8) -> String) -> impl Iterator<Item = Self> {
        let world = move |axes| (0..axes).map(|number| format!("[[axis]]\n{}\n", axis(number))).collect::<String>();
        [Self::three as fn(&str) -> Self, Self::six].into_iter().zip([3, 6]).map(move |(new, axes)| new(&world(axes)))
    }

    /// Both with bare motors.
    fn bare() -> impl Iterator<Item = Self> {
        Self::both(|_| String::new())
    }

    /// The numbers of the axes.
    fn axes(&self) -> Range<u8> {
        0..self.spec.axes
    }

    /// The numbers of all axes but one.
    fn others(&self, axis: u8) -> impl Iterator<Item = u8> + use<> {
        self.axes().filter(move |other| *other != axis)
    }

    fn now(&self) -> Nanos {
        self.board.borrow().now()
    }

    /// Executes a command and gives status and value of its reply.
    fn ask(&mut self, line: &str) -> (u8, i32) {
        let command = text::parse(line).unwrap_or_else(|error| panic!("{line}: {error:?}"));
        let mut answer = self.firmware.execute(time(&self.board), command);
        let limit = self.now() + SECOND;
        while answer == Poll::Pending {
            assert!(self.now() < limit, "{line}: no reply");
            self.run(MILLISECOND);
            if let Some(place) = self.late.iter().position(|reply| !reply.is_event()) {
                answer = Poll::Ready(Some(self.late.remove(place)));
            }
        }
        match answer {
            Poll::Ready(Some(Reply::Plain { status, value, .. })) => (status as u8, value),
            other => panic!("{line}: {other:?}"),
        }
    }

    /// Executes a command that must succeed and gives the value of its reply.
    fn ok(&mut self, line: &str) -> i32 {
        let (status, value) = self.ask(line);
        assert_eq!(status, OK, "{line}");
        value
    }

    /// Executes a command for each axis; `#` in it stands for the number of the axis.
    fn each(&mut self, line: &str) {
        for axis in self.axes() {
            self.ok(&line.replace('#', &axis.to_string()));
        }
    }

    /// The number of an axis parameter of the product.
    fn number(&self, parameter: AxisParameter) -> u8 {
        self.spec.axis.row(parameter).unwrap().number
    }

    /// The value of an axis parameter.
    fn get(&mut self, number: u8, axis: u8) -> i32 {
        self.ok(&format!("GAP {number}, {axis}"))
    }

    /// The value of an axis parameter of all axes.
    fn all(&mut self, number: u8) -> Vec<i32> {
        self.axes().map(|axis| self.get(number, axis)).collect()
    }

    /// The value of a user variable.
    fn variable(&mut self, number: u8) -> i32 {
        self.ok(&format!("GGP {number}, 2"))
    }

    /// Carries out a command of the control protocol.
    fn control(&mut self, line: &str) {
        let line = Line::parse(line).unwrap();
        line.control.apply(&mut self.board.borrow_mut()).unwrap();
    }

    /// Lets virtual time pass.
    fn run(&mut self, span: Nanos) {
        let end = self.now() + span;
        loop {
            let deadline = self.firmware.deadline().0 * MICROSECOND;
            self.board.borrow_mut().advance_to(deadline.min(end));
            if deadline > end {
                return;
            }
            if self.firmware.poll(&self.board) {
                self.late.extend(std::iter::from_fn(|| self.firmware.next_reply()));
            }
        }
    }

    /// Lets virtual time pass until something is true, which is looked at every millisecond.
    fn run_until(&mut self, limit: Nanos, mut done: impl FnMut(&mut Self) -> bool) {
        let end = self.now() + limit;
        while !done(self) {
            assert!(self.now() < end, "{}: not in time", self.board.borrow().kind().name);
            self.run(MILLISECOND);
        }
    }

    /// Returns the states of all axes, as the world and the chips show them.
    fn states(&self) -> Vec<AxisState> {
        State::of(&self.board.borrow()).axes
    }

    /// Speeds of all ramp generators.
    fn speeds(&self) -> Vec<i32> {
        self.states().iter().map(|state| state.velocity).collect()
    }

    /// Switches the supply off and on again; the EEPROM keeps its contents.
    fn power_cycle(&mut self) {
        self.board.borrow_mut().power_off();
        self.board.borrow_mut().power_on();
        self.firmware = (self.start)(&self.board);
        self.late.clear();
        self.run(2 * MILLISECOND);
    }

    /// The axes that the events of command 138 have told of since the last call, in this order.
    fn arrivals(&mut self) -> Vec<u8> {
        let axis = |reply| match reply {
            Reply::Plain { status, opcode, value } => {
                assert_eq!((status as u8, opcode), (ARRIVED, Opcode::PositionReachedEvent as u8));
                assert_eq!(value.count_ones(), 1, "an event tells of one axis");
                value.trailing_zeros() as u8
            }
            other => panic!("{other:?}"),
        };
        std::mem::take(&mut self.late).into_iter().map(axis).collect()
    }

    /// Downloads and starts a program that counts interrupts: for each of `numbers` its handler adds one to the user
    /// variable of the same number.
    fn count_interrupts(&mut self, numbers: &[u8]) {
        let main = 2 * numbers.len() + 2;
        let handler = |place: usize| main + 4 * place;
        let mut program = Vec::new();
        for (place, number) in numbers.iter().enumerate() {
            program.push(format!("VECT {number}, {}", handler(place)));
            program.push(format!("EI {number}"));
        }
        program.extend(["EI 255".into(), format!("JA {}", main - 1)]);
        for number in numbers {
            program.extend([format!("GGP {number}, 2"), "CALC ADD, 1".into(), format!("AGP {number}, 2")]);
            program.push("RETI".into());
        }
        self.start_program(&program);
        self.run(5 * MILLISECOND);
    }

    /// Downloads a program and starts it.
    fn start_program(&mut self, lines: &[impl AsRef<str>]) {
        self.ok("132, 0, 0, 0");
        for line in lines.iter().map(AsRef::as_ref) {
            assert_eq!(self.ask(line).0, Status::Loaded as u8, "{line}");
        }
        self.ok("133, 0, 0, 0");
        self.ok("129, 1, 0, 0");
    }
}
