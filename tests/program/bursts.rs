//! Commands that need the interpreter alone are executed in bursts. Whatever a program does, it does the same command
//! by command. Random and hand-written programs run in two modules, one of which never executes two commands in a
//! burst. After each piece of a millisecond all that can be seen is the same.

use std::fmt::Debug;
use std::task::Poll;

use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::MILLISECOND;
use hal_sim::world::config::WorldConfig;
use tmcm::device::Inputs;
use tmcm::module::{Executed, Hooks, Module, Source};
use tmcm::tmcl::{Command, Reply, text};
use tmcm::units::Micros;
use tmcm::vm::{Errors, ProgramState, Registers};
use tmcm_sim::native::{Simulated, parts};

use common::program::MEMORY;
use common::random::Random;
use common::random_command;

/// Random programs in all, commands of each, and how many milliseconds each runs.
const PROGRAMS: u32 = 500;
const LENGTH: usize = 40;
const SPAN: u64 = 25;

/// A command that was executed, with registers and flags after it.
type Step = (Executed, Registers, Errors);

/// Records what a program executes, in bursts or without.
#[derive(Debug, Default)]
struct Recorder<const BURSTS: bool>(Vec<Step>);

impl<const BURSTS: bool> Hooks for Recorder<BURSTS> {
    const BURSTS: bool = BURSTS;

    fn executed(&mut self, executed: &Executed, registers: &Registers, errors: Errors) {
        self.0.push((*executed, *registers, errors));
    }
}

/// A module on a board of its own.
struct Runner<const BURSTS: bool> {
    board: SharedBoard,
    module: Module<Simulated<Recorder<BURSTS>>, 1>,
}

impl<const BURSTS: bool> Runner<BURSTS> {
    fn new() -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        let mut module = Module::new(parts(&board), Recorder::default(), 1);
        module.start(Micros(0), |_| {});
        Runner { board, module }
    }

    fn send(&mut self, now: Micros, command: Command) -> Option<Reply> {
        match self.module.execute(now, Source::Usb, command) {
            Poll::Ready(reply) => reply,
            Poll::Pending => {
                self.store();
                self.module.next_reply().and_then(|due| due.reply)
            }
        }
    }

    /// An EEPROM that takes no time.
    fn store(&mut self) {
        while self.module.store().next_job().is_some() {
            self.module.stored(true);
        }
    }

    /// Does the next piece of what is due. False if nothing is.
    fn poll(&mut self, now: Micros, inputs: &Inputs<1>) -> bool {
        let due = self.module.deadline() <= now;
        if due {
            self.module.poll(now, inputs);
            self.store();
        }
        due
    }

    /// Where the program is, and what was executed since the last look.
    fn look(&mut self) -> (u16, Registers, Errors, Vec<Step>) {
        let steps = std::mem::take(&mut self.module.hooks().0);
        let machine = self.module.machine();
        (machine.counter(), machine.registers, machine.errors, steps)
    }

    /// The interpreter and the axis, to the last field.
    fn look_closely(&self) -> String {
        format!("{:?} {:?}", self.module.machine(), self.module.axes())
    }
}

/// The two modules, which are told the same.
struct Pair {
    bursts: Runner<true>,
    single: Runner<false>,
    now: Micros,
    inputs: Inputs<1>,
    /// Steps that were executed in bursts.
    steps: Vec<Step>,
}

/// Asserts that both modules have come to the same.
fn same<T: PartialEq + Debug>(bursts: T, single: T, what: &str) -> T {
    assert!(bursts == single, "{what}, in bursts and without:\n{bursts:?}\n{single:?}");
    bursts
}

impl Pair {
    fn new() -> Self {
        let inputs = Inputs { supply: Some(240), ..Inputs::default() };
        let mut pair = Pair { bursts: Runner::new(), single: Runner::new(), now: Micros(0), inputs, steps: Vec::new() };
        pair.pieces(|_| {});
        pair
    }

    fn send(&mut self, command: Command) -> Option<Reply> {
        let replies = (self.bursts.send(self.now, command), self.single.send(self.now, command));
        same(replies.0, replies.1, "the reply")
    }

    fn line(&mut self, line: &str) {
        self.send(text::parse(line).unwrap());
    }

    /// Loads a program and runs it from its first command.
    fn start(&mut self, at: usize, program: &[Command]) {
        self.line("131, 0, 0, 0");
        self.line(&format!("132, 0, 0, {at}"));
        for command in program {
            self.send(*command);
        }
        self.line("133");
        self.line(&format!("129, 1, 0, {at}"));
    }

    /// The pieces of a millisecond; `between` comes before each.
    fn pieces(&mut self, mut between: impl FnMut(&mut Self)) {
        loop {
            between(self);
            let due = (self.bursts.poll(self.now, &self.inputs), self.single.poll(self.now, &self.inputs));
            let seen = (self.bursts.look(), self.single.look());
            let (.., steps) = same(seen.0, seen.1, "what a piece has done");
            self.steps.extend(steps);
            if !same(due.0, due.1, "something is due") {
                return;
            }
        }
    }

    /// The next millisecond.
    fn millisecond(&mut self, between: impl FnMut(&mut Self)) {
        self.now = self.now.after(Micros::from_millis(1));
        for board in [&self.bursts.board, &self.single.board] {
            let next = board.borrow().now() + MILLISECOND;
            board.borrow_mut().advance_to(next);
        }
        self.pieces(between);
        same(self.bursts.look_closely(), self.single.look_closely(), "a millisecond");
    }

    /// Returns the steps that a program of these lines executes in so many milliseconds.
    fn run(&mut self, at: usize, lines: &[&str], milliseconds: u64) -> Vec<Step> {
        let program: Vec<Command> = lines.iter().map(|line| text::parse(line).unwrap()).collect();
        self.start(at, &program);
        self.steps.clear();
        (0..milliseconds).for_each(|_| self.millisecond(|_| {}));
        std::mem::take(&mut self.steps)
    }
}

/// Returns a line that a host may send while a program runs.
fn host(random: &mut Random) -> String {
    match random.below(12) {
        0 => "128".into(),
        1 | 2 => "129".into(),
        3 | 4 => "130".into(),
        5 => format!("SGP {}, 2, {}", random.below(4), random.below(9)),
        6 => format!("CALC LOAD, {}", random.below(9)),
        7 => "CALCX SWAP".into(),
        8 => format!("EI {}", random.pick(&[0, 1, 39, 255])),
        9 => format!("DI {}", random.pick(&[0, 1, 39, 255])),
        10 => "135, 1, 0, 0".into(),
        _ => format!("GGP {}, 2", random.below(4)),
    }
}

/// The beginning of a program with interrupts.
fn handlers(random: &mut Random) -> Vec<Command> {
    let mut lines = vec![format!("SGP 0, 3, {}", 1 + random.below(4)), "SGP 39, 3, 3".into()];
    for number in [0, 39] {
        lines.push(format!("VECT {number}, {}", random.below(LENGTH as u64)));
        lines.push(format!("EI {number}"));
    }
    lines.push("EI 255".into());
    lines.iter().map(|line| text::parse(line).unwrap()).collect()
}

#[test]
fn random_programs_do_the_same_in_bursts_and_without() {
    let mut random = Random(0xB0257);
    let mut pair = Pair::new();
    let (mut handled, mut refused, mut most) = (0, 0, 0);
    for number in 0..PROGRAMS {
        // Every other one begins with a handler for a timer and an input, and some lie where program memory ends.
        let mut program = if number.is_multiple_of(2) { handlers(&mut random) } else { vec![] };
        program.resize_with(LENGTH, || random_command::command(&mut random));
        let at = if number.is_multiple_of(8) { MEMORY as usize - LENGTH } else { 0 };
        pair.start(at, &program);
        for _ in 0..SPAN {
            if random.one_in(3) {
                pair.inputs.digital ^= 1 << random.below(4);
            }
            let disturbed = random.one_in(4);
            pair.millisecond(|pair| {
                if disturbed && random.one_in(4) {
                    pair.line(&host(&mut random));
                }
            });
            most = most.max(pair.steps.len());
            for (executed, ..) in pair.steps.drain(..) {
                handled += u32::from(executed.handler);
                refused += u32::from(executed.refused.is_some());
            }
        }
    }
    println!("{handled} commands in handlers, {refused} refused");
    assert!(handled > 10_000 && refused > 1_000 && most >= 128, "{handled} {refused} {most}");
}

/// Arithmetic without end, and a timer. The handler begins with the first command of the millisecond in which the timer
/// is due, and the program goes on behind the command that was the last before.
#[test]
fn an_interrupt_begins_before_the_next_command_of_a_burst() {
    let program = [
        "SGP 0, 3, 3",
        "VECT 0, 8",
        "EI 0",
        "EI 255",
        "CALC ADD, 1",
        "CALCX ADD",
        "COMP 7",
        "JA 4",
        "CALC MUL, 3",
        "GGP 0, 2",
        "CALC ADD, 1",
        "AGP 0, 2",
        "RETI",
    ];
    let steps = Pair::new().run(0, &program, 60);
    let mut entries = 0;
    for pair in steps.windows(2) {
        let [(before, ..), (first, ..)] = pair else { panic!() };
        if first.handler && !before.handler {
            assert_eq!((first.address, before.at < first.at), (8, true), "{first:?}");
            entries += 1;
        }
        if before.handler && !first.handler {
            assert_eq!(before.command, text::parse("RETI").unwrap());
        }
    }
    assert!((18..=20).contains(&entries), "{entries}");
    let main: Vec<u16> =
        steps.iter().map(|(executed, ..)| executed).filter(|executed| !executed.handler).map(|e| e.address).collect();
    let follows = |pair: &[u16]| pair[1] == pair[0] + 1 || pair == [7, 4];
    assert!(main.len() > 6_000 && main.windows(2).all(follows), "nothing is left out or executed twice");
}

/// An interrupt that is let in by a command of the program itself begins right behind it; until then it waits, however
/// much arithmetic there is.
#[test]
fn an_interrupt_that_waits_for_ei_begins_right_behind_it() {
    let program = ["SGP 0, 3, 2", "VECT 0, 20", "EI 0"].into_iter().chain(["CALC ADD, 1"; 10]).chain([
        "COMP 4000",
        "JC LT, 3",
        "EI 255",
        "CALC LOAD, -1",
        "STOP",
        "STOP",
        "STOP",
        "CALCX SWAP",
        "RETI",
    ]);
    let steps = Pair::new().run(0, &program.collect::<Vec<_>>(), 60);
    let at = steps.iter().position(|(executed, ..)| executed.handler).unwrap();
    let around: Vec<u16> = steps[at - 1..].iter().map(|(executed, ..)| executed.address).collect();
    assert_eq!(around, [15, 20, 21, 16, 17]);
    assert!(at > 4_000);
}

/// Commands that end a program, and what a call finds when the stack is full or empty, in the middle of other
/// arithmetic.
#[test]
fn programs_end_and_calls_fail_in_the_middle_of_a_burst() {
    let mut pair = Pair::new();
    for (at, lines, executed) in [
        // To the last address and beyond.
        (MEMORY as usize - 3, &["CALC LOAD, 1", "CALC ADD, 1", "CALC ADD, 1"][..], 3),
        (0, &["CALC LOAD, 5", "JA 2048"], 2),
        (0, &["CALC LOAD, 5", "JA -1"], 2),
        (0, &["COMP 0", "JC EQ, 3000", "JA 0"], 2),
        (0, &["CALC LOAD, 5", "CSUB 70000"], 2),
        // Eight calls within each other, and a ninth that has no effect; the last RSUB has nowhere to go.
        (0, &["CALC ADD, 1", "CSUB 0", "RSUB", "STOP"], 9 + 9 + 9 + 1),
        (0, &["RSUB", "RSUB", "STOP"], 3),
        // Refused, and passed over.
        (0, &["CALC LOAD, 6", "19, 10, 0, 5", "19, 77, 0, 5", "33, 11, 0, 0", "CALC ADD, 1", "STOP"], 6),
    ] {
        let steps = pair.run(at, lines, 3);
        let machine = pair.bursts.module.machine();
        assert_eq!(steps.len(), executed, "{lines:?}: {steps:?}");
        assert_eq!((machine.state(), machine.counter()), (ProgramState::Stop, 0), "{lines:?}");
        let refused = steps.iter().filter(|(executed, ..)| executed.refused.is_some()).count();
        assert_eq!(refused, if lines.contains(&"19, 10, 0, 5") { 3 } else { 0 });
    }
}
