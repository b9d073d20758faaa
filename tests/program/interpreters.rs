//! The firmware's interpreter against a second one that was written from the manual alone. Random programs are stepped
//! through both, and after each command registers, flags and program counter are the same.

#[allow(dead_code, unreachable_pub)]
mod reference;

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::task::Poll;

use common::random::Random;
use hal_sim::board::{Board, SharedBoard};
use hal_sim::world::config::WorldConfig;
use reference::{Machine, World};
use tmcm::device::Inputs;
use tmcm::module::{Module, Source};
use tmcm::tmcl::{Command, Reply, Status};
use tmcm::units::Micros;
use tmcm::vm::{ErrorFlag, ProgramState};
use tmcm_sim::native::{Simulated, parts};

/// Programs in all.
const PROGRAMS: u32 = 100_000;
/// Commands of each, and how many steps it is given.
const LENGTH: u64 = 24;
const STEPS: u32 = 60;

const RETI: u8 = 38;

/// The rest of a module, which the reference has not got itself: three axis parameters, and no reference search.
struct Rest(BTreeMap<u8, i32>);

impl Rest {
    fn set(&mut self, number: u8, value: i32) {
        let limit = if number == 4 { 1..=2047 } else { 0..=255 };
        if let Some(place) = self.0.get_mut(&number).filter(|_| limit.contains(&value)) {
            *place = value;
        }
    }
}

impl World for Rest {
    fn command(&mut self, bytes: [u8; 7], accumulator: i32) -> Option<i32> {
        let Command { opcode, kind, value, .. } = Command::from_bytes(bytes);
        match (opcode, kind) {
            (5, _) => self.set(kind, value),
            (34, _) => self.set(kind, accumulator),
            (6, _) => return self.0.get(&kind).copied(),
            // At rest at position zero: GAP 1 would say so.
            (13, 2) | (32, _) => return Some(0),
            _ => {}
        }
        None
    }
}

/// The firmware's module, on a board where nothing moves, and the reference beside it.
struct Pair {
    module: Module<Simulated<()>, 1>,
    now: Micros,
    inputs: Inputs<1>,
    reference: Machine,
    rest: Rest,
}

impl Pair {
    fn new() -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        let mut module = Module::new(parts(&board), (), 1);
        module.start(Micros(0), |_| {});
        // What the axis parameters are to begin with.
        let rest = Rest([(4, 1000), (6, 128), (7, 8)].into());
        let mut pair = Pair { module, now: Micros(0), inputs: Inputs::default(), reference: Machine::new(&[]), rest };
        pair.millisecond();
        for (number, value) in pair.rest.0.clone() {
            assert_eq!(pair.send(Command::new(6, number, 0, 0)), Some(value));
        }
        pair
    }

    /// A command in direct mode: the value of its reply if it was executed.
    fn send(&mut self, command: Command) -> Option<i32> {
        match self.module.execute(self.now, Source::Usb, command) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok | Status::Loaded, value, .. })) => Some(value),
            Poll::Pending => {
                self.store();
                Some(0)
            }
            _ => None,
        }
    }

    /// An EEPROM that takes no time.
    fn store(&mut self) {
        while self.module.store().next_job().is_some() {
            self.module.stored(true);
        }
        while self.module.next_reply().is_some() {}
    }

    fn millisecond(&mut self) {
        self.now = self.now.after(Micros::from_millis(1));
        self.poll();
    }

    /// Has the module do all that is due.
    fn poll(&mut self) {
        while self.module.deadline() <= self.now {
            self.module.poll(self.now, &self.inputs);
            self.store();
        }
    }

    /// Loads a program at the start of the memory; what was behind it stays. Both begin at its first command, with
    /// the variables and coordinates they have.
    fn load(&mut self, program: &[Command]) {
        self.send(Command::new(131, 0, 0, 0)).unwrap();
        self.send(Command::new(132, 0, 0, 0)).unwrap();
        for command in program {
            self.send(*command).unwrap();
        }
        self.send(Command::new(133, 0, 0, 0)).unwrap();
        // Command 131 does not touch bank 3.
        let old = std::mem::replace(&mut self.reference, Machine::new(&[]));
        self.reference.memory = old.memory;
        for (place, command) in self.reference.memory.iter_mut().zip(program) {
            *place = command.to_bytes();
        }
        self.reference.variables = old.variables;
        self.reference.stored = old.stored;
        self.reference.coordinates = old.coordinates;
        self.reference.stored_coordinates = old.stored_coordinates;
        self.reference.outputs = old.outputs;
        self.reference.interrupt_settings = old.interrupt_settings;
    }

    fn step_module(&mut self) {
        self.send(Command::new(130, 0, 0, 0)).unwrap();
        self.poll();
        self.millisecond();
    }

    /// Executes one command in both, in which a WAIT takes its time. False when it waits too long.
    fn step(&mut self) -> bool {
        let handled = self.module.machine().handles();
        self.step_module();
        // The way into a handler is a step of its own.
        if !handled && self.module.machine().handles() {
            self.step_module();
        }
        if self.ends_wait() {
            return true;
        }
        self.reference.step(&mut self.rest);
        let Some(wait) = self.reference.waiting else { return true };
        // After RETI the WAIT it leads back to is the next step.
        if self.reference.executed == Some(RETI) || self.ends_wait() {
            return true;
        }
        // A handler may begin in a WAIT that has just begun or gone on.
        self.reference.step(&mut self.rest);
        if self.reference.waiting.is_none() || self.reference.executed == Some(RETI) {
            return true;
        }
        // For ever, or what comes to the same.
        if wait.ticks == 0 || wait.ticks > 5 {
            return false;
        }
        for _ in 0..wait.ticks * 10 {
            self.millisecond();
        }
        self.reference.finish_wait(true);
        true
    }

    /// Ends a WAIT whose condition is met; that comes before any handler.
    fn ends_wait(&mut self) -> bool {
        let met = self.reference.waiting.is_some_and(|wait| match wait.condition {
            0 => false,
            // IN3 is the home switch.
            2 => self.inputs.axes[0].home,
            // Nothing is at the chip's stop switches.
            3 => false,
            _ => true,
        });
        if met {
            self.reference.finish_wait(false);
        }
        met
    }

    /// An input changes; the reference is told if bank 3 asks for this edge.
    fn toggle(&mut self, input: u8) {
        self.inputs.digital ^= 1 << input;
        // IN3 is the home switch.
        self.inputs.axes[0].home = self.inputs.digital & 1 << 3 != 0;
        let wanted = if self.inputs.digital & 1 << input != 0 { 1 } else { 2 };
        let setting = self.reference.interrupt_settings[&(39 + input)];
        self.millisecond();
        if setting & wanted != 0 {
            self.reference.interrupt(39 + input);
        }
    }

    fn compare(&self, what: &dyn Fn() -> String) {
        let (ours, theirs) = (self.module.machine(), &self.reference);
        let registers = ours.registers;
        let compared = [Ordering::Equal, Ordering::Greater, Ordering::Less].map(|o| registers.compared == Some(o));
        let errors =
            [ErrorFlag::Timeout, ErrorFlag::Alarm, ErrorFlag::Deviation, ErrorFlag::Position, ErrorFlag::Shutdown];
        assert_eq!(
            (ours.counter(), registers.accumulator, registers.x, registers.zero, compared),
            (
                theirs.program_counter,
                theirs.accumulator,
                theirs.x,
                theirs.zero,
                [theirs.equal, theirs.greater, theirs.less]
            ),
            "{}",
            what()
        );
        assert_eq!(
            errors.map(|flag| ours.errors.raised(flag)),
            [theirs.timeout, theirs.alarm, theirs.deviation, theirs.position, theirs.shutdown],
            "{}",
            what()
        );
        assert_eq!(ours.state() == ProgramState::Step, theirs.running, "{}", what());
    }
}

/// A command that both know, or that none knows.
fn command(random: &mut Random) -> Command {
    let value = match random.below(8) {
        0 => random.pick(&[0, 1, -1, i32::MAX, i32::MIN, 255, 256, 2047, 2048]),
        1 => random.next() as i32,
        _ => random.below(12) as i32 - 3,
    };
    let address = match random.below(12) {
        0 => random.pick(&[-1, 2048, 2047, i32::MAX, i32::MIN, 65_536]),
        _ => random.below(LENGTH + 2) as i32,
    };
    let variable = random.pick(&[0, 1, 2, 3, 55, 56, 255]);
    let input = random.pick(&[39, 40, 41, 42]);
    let any = random.below(14) as u8;
    // Motor or bank: mostly what is good.
    let motor = if random.one_in(10) { random.pick(&[1, 2, 3, 255]) } else { 0 };
    let command = |opcode, kind, motor, value| Command::new(opcode, kind, motor, value);
    match random.below(34) {
        0..=3 => command(19, any, motor, value),
        4..=6 => command(33, any, motor, value),
        7..=9 => command(20, any, motor, value),
        10..=13 => command(21, any, motor, address),
        14 => command(22, any, motor, address),
        15 | 16 => command(23, any, motor, address),
        17 | 18 => command(24, any, motor, value),
        19 => command(27, random.below(6) as u8, motor, random.pick(&[0, 1, 2, -1, -2, i32::MIN])),
        20 => command(9, variable, 2, value),
        21 => command(10, variable, random.pick(&[2, 2, 2, 3]), value),
        22 => command(35, variable, 2, value),
        // No timers: the reference has no time.
        23 if random.one_in(2) => command(35, input, 3, value),
        23 => command(random.pick(&[11, 12]), variable, random.pick(&[2, 2, 3]), value),
        24 => command(9, input, 3, random.below(5) as i32),
        25 => command(random.pick(&[25, 25, 25, 26]), random.pick(&[input, 255, 255, any]), motor, value),
        26 => command(37, random.pick(&[input, input, any]), motor, address),
        27 => command(38, any, motor, value),
        28 => command(random.pick(&[30, 31, 39]), random.below(23) as u8, motor, value),
        29 => command(random.pick(&[14, 15]), random.pick(&[0, 1, 2, 255]), 2, value),
        30 => command(random.pick(&[5, 6, 34]), random.pick(&[4, 6, 7]), motor, value),
        31 => command(36, random.below(8) as u8, motor, value),
        32 => command(random.pick(&[13, 32]), 2, motor, value),
        _ => command(random.pick(&[0, 16, 17, 18, 28, 29, 40, 63, 64, 72, 127, 128, 129, 134, 200]), any, motor, value),
    }
}

fn handlers(random: &mut Random) -> Vec<Command> {
    let mut commands = vec![];
    for input in [39, 41] {
        commands.push(Command::new(37, input, 0, random.below(LENGTH) as i32));
        commands.push(Command::new(9, input, 3, 3));
        commands.push(Command::new(25, input, 0, 0));
    }
    commands.push(Command::new(25, 255, 0, 0));
    commands
}

#[test]
fn both_agree_on_random_programs() {
    let mut random = Random(0x1140);
    let mut pair = Pair::new();
    let (mut steps, mut handled, mut waited) = (0_u64, 0_u64, 0_u64);
    for number in 0..PROGRAMS {
        // Every other one begins with a handler for two inputs.
        let mut program = if number.is_multiple_of(2) { vec![] } else { handlers(&mut random) };
        // Commands from 128 on cannot be downloaded.
        let more = LENGTH as usize - program.len();
        program.extend(std::iter::repeat_with(|| command(&mut random)).filter(|c| c.opcode < 128).take(more));
        pair.load(&program);
        for step in 0..STEPS {
            if random.one_in(4) {
                pair.toggle(random.below(4) as u8);
            }
            let at = pair.reference.program_counter;
            let in_handler = pair.reference.saved.is_some();
            let going_on = pair.step();
            steps += 1;
            handled += u64::from(!in_handler && pair.reference.saved.is_some());
            waited += u64::from(pair.reference.memory[usize::from(at)][0] == 27);
            let what = || {
                let listing: Vec<String> = program.iter().map(|c| format!("  {c}")).collect();
                format!("program {number}, step {step} at {at}:\n{}", listing.join("\n"))
            };
            if !going_on {
                break;
            }
            pair.compare(&what);
            if !pair.reference.running {
                break;
            }
        }
        if number.is_multiple_of(100) {
            for variable in 0..=255 {
                let theirs = pair.reference.variables[usize::from(variable)];
                assert_eq!(pair.send(Command::new(10, variable, 2, 0)), Some(theirs), "variable {variable}");
            }
            for coordinate in 0..=20 {
                let theirs = pair.reference.coordinates[usize::from(coordinate)];
                assert_eq!(pair.send(Command::new(31, coordinate, 0, 0)), Some(theirs), "coordinate {coordinate}");
            }
            for output in 0..2 {
                let theirs = pair.reference.outputs[usize::from(output)].into();
                assert_eq!(pair.send(Command::new(15, output, 2, 0)), Some(theirs), "output {output}");
            }
        }
    }
    println!("{PROGRAMS} programs, {steps} steps, {handled} handlers, {waited} WAITs");
    assert!(steps > 10 * u64::from(PROGRAMS) && handled > 1_000 && waited > 1_000);
}
