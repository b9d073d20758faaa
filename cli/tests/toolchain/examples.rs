//! The example programs do what their comments say. Each is assembled, loaded by telegrams as a host does it, and run;
//! what it does is seen in the world.

mod axes;
mod six_points;

use std::path::{Path, PathBuf};
use tmcm_sim::{NativeModule, Product, VirtualModule};

use common::{Bench, INVALID_VALUE};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::State;
use hal_sim::world::config::WorldConfig;
use tmcl_tools::asm::{Assembly, assemble_file, assemble_text};
use tmcl_tools::disasm;
use tmcl_tools::sources::Texts;
use tmcm::tmcl::{Command, Opcode, Status};

/// Microsteps per second at speed 1000 of the module's default settings.
const AT_1000: f64 = 30_517.6;
const TURN: i32 = 51_200;

fn folder() -> PathBuf {
    xtask::workspace().unwrap().join("examples")
}

/// The examples by their names, as if they were files beside each other.
fn sources() -> Texts {
    let files = std::fs::read_dir(folder()).unwrap().map(|entry| entry.unwrap().path());
    let sources = files.filter(|path| path.extension().is_some_and(|ending| ending == "tmc"));
    Texts(sources.map(|path| (path.file_name().unwrap().into(), std::fs::read_to_string(path).unwrap())).collect())
}

fn assembled(name: &str, product: Product) -> Assembly {
    let assembly =
        assemble_file(&sources(), Path::new(name), Some(product)).result.unwrap_or_else(|errors| panic!("{errors}"));
    assert!(assembly.warnings.is_empty(), "{}", assembly.warnings);
    assembly
}

/// The examples for modules with three axes or more.
const SEVERAL_AXES: [&str; 3] = ["homing_axes.tmc", "pick_and_place.tmc", "straight_line.tmc"];

/// A module with an example in its memory.
struct Example {
    bench: Bench,
    started: Nanos,
}

impl Example {
    fn load(name: &str, world: &str) -> Self {
        Self::load_into(Product::Tmcm1140, name, world)
    }

    fn load_into(product: Product, name: &str, world: &str) -> Self {
        let world = WorldConfig::parse_for(product.kind(), world).unwrap();
        let mut bench = Bench { module: NativeModule::of(product, &world, None, 1) };
        bench.ok("132");
        for command in assembled(name, product).commands {
            assert_eq!(bench.send(command).status, Status::Loaded as u8, "{command}");
        }
        bench.ok("133");
        bench.module.trace(true);
        let started = bench.module.now();
        Example { bench, started }
    }

    fn start(name: &str, world: &str) -> Self {
        let mut example = Self::load(name, world);
        example.begin("129");
        example
    }

    /// Starts the program by a command of the host.
    fn begin(&mut self, command: &str) {
        self.started = self.bench.module.now();
        self.bench.ok(command);
    }

    /// Milliseconds since the start.
    fn time(&self) -> u64 {
        (self.bench.module.now() - self.started) / MILLISECOND
    }

    /// Lets time pass until so many milliseconds after the start.
    fn until(&mut self, milliseconds: u64) -> State {
        self.bench.module.run_until(self.started + milliseconds * MILLISECOND);
        self.state()
    }

    fn state(&self) -> State {
        State::of(&self.bench.module.board().borrow())
    }

    /// Waits for something and gives the time of it.
    fn when(&mut self, limit: Nanos, mut wanted: impl FnMut(&State) -> bool) -> u64 {
        self.bench.run_until(limit, |bench| wanted(&State::of(&bench.module.board().borrow())));
        self.time()
    }

    fn ended(&mut self) -> bool {
        self.bench.ok("GGP 128, 0") == 0
    }

    /// Every command has had its effect; gives how many there were.
    fn executed(&mut self) -> usize {
        let steps = self.bench.module.take_steps();
        for step in &steps {
            assert_eq!(step.executed.refused, None, "{}", step.executed.command);
        }
        steps.len()
    }
}

/// `value` is `expected`, or off by a part of it.
fn close(value: impl Into<f64>, expected: f64, part: f64) {
    let value = value.into();
    assert!((value - expected).abs() <= expected.abs() * part, "{value} is not about {expected}");
}

#[test]
fn all_examples_are_disassembled_to_the_same_program() {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".tmc"))
        .collect();
    names.sort();
    let tested = [
        "homing_axes.tmc",
        "jog.tmc",
        "main_loop.tmc",
        "pick_and_place.tmc",
        "routines.tmc",
        "six_point_ramp.tmc",
        "stall_homing.tmc",
        "straight_line.tmc",
        "subroutines.tmc",
        "there_and_back.tmc",
        "timer_interrupt.tmc",
        "to_and_fro.tmc",
    ];
    assert_eq!(names, tested, "an example without a test here");
    for name in names {
        let product = match name.as_str() {
            "six_point_ramp.tmc" => Product::Tmcm3212,
            name if SEVERAL_AXES.contains(&name) => Product::Tmcm3110,
            _ => Product::Tmcm1140,
        };
        let commands = assembled(&name, product).commands;
        let again = assemble_text(&name, &disasm::source(&commands, 0, Some(product)), Some(product)).unwrap();
        assert_eq!(again.commands, commands, "{name}");
    }
}

#[test]
fn to_and_fro() {
    let mut example = Example::start("to_and_fro.tmc", "");
    assert_eq!(example.until(4_990).first.velocity, -1000);
    let left = example.until(5_000).first.position;
    close(left, -5.0 * AT_1000, 0.02);
    assert_eq!(example.until(9_990).first.velocity, 100);
    // From there to 512000 at speed 100.
    let there = example.when(300 * SECOND, |state| state.first.position == 512_000);
    close(there as f64 / 1000.0 - 10.0, f64::from(512_000 - left) / (AT_1000 / 10.0) - 5.0, 0.02);
    let back = example.when(400 * SECOND, |state| state.first.position == -512_000);
    close((back - there) as f64 / 1000.0, 1_024_000.0 / (AT_1000 / 10.0), 0.02);
    example.bench.run(SECOND);
    assert_eq!(example.state().first.velocity, 100, "it all begins again");
    assert_eq!(example.bench.ok("GAP 0, 0"), 512_000);
    assert_eq!(example.executed(), 15);
    assert_eq!(example.bench.lost_steps(), 0);
}

#[test]
fn main_loop() {
    let mut example = Example::start("main_loop.tmc", "");
    example.bench.refused("SAP 4, 0, 50000", INVALID_VALUE);
    let mut fastest = 0;
    for end in [TURN, 0, TURN, 0] {
        example.when(3 * SECOND, |state| {
            fastest = fastest.max(state.first.velocity);
            state.first.position == end
        });
    }
    assert_eq!(fastest, 1600);
    close(f64::from(fastest) * AT_1000 / 1000.0, 48_828.0, 0.001);
    assert!(!example.ended());
    example.executed();
}

/// When a value changes, in milliseconds after the start.
fn changes(example: &mut Example, until: u64, mut look: impl FnMut(&State) -> bool) -> Vec<u64> {
    let mut last = look(&example.state());
    let mut changes = Vec::new();
    for time in example.time() + 1..until {
        let value = look(&example.until(time));
        if value != last {
            changes.push(time);
            last = value;
        }
    }
    changes
}

/// Times are this far apart, to two milliseconds.
fn apart(times: &[u64], expected: u64) {
    assert!(times.len() > 1);
    for pair in times.windows(2) {
        assert!((pair[1] - pair[0]).abs_diff(expected) <= 2, "{times:?}");
    }
}

#[test]
fn timer_interrupt() {
    let program = |look: fn(&State) -> bool| {
        let mut example = Example::start("timer_interrupt.tmc", "");
        let times = changes(&mut example, 6_100, look);
        example.executed();
        times
    };
    let main = program(|state| state.outputs[1]);
    // It was switched on before the first look.
    assert_eq!(main.len(), 12);
    apart(&main, 500);
    let handler = program(|state| state.outputs[0]);
    assert_eq!(handler.len(), 6);
    assert!(handler[0].abs_diff(1_000) <= 2);
    apart(&handler, 1_000);
}

#[test]
fn subroutines() {
    let mut example = Example::start("subroutines.tmc", "");
    let rests =
        changes(&mut example, 4_000, |state| state.first.velocity == 0 && [0, 10_000].contains(&state.first.position));
    // Away from zero at once, then a rest of half a second at each end.
    for rest in rests.chunks_exact(2) {
        assert!((rest[1] - rest[0]).abs_diff(500) <= 4, "{rests:?}");
    }
    assert_eq!(rests.len() / 2, 4, "{rests:?}");
    let text = assembled("subroutines.tmc", Product::Tmcm1140).symbols.value("SubW");
    assert_eq!(text, Some(5));
    example.executed();
}

/// The host starts the routines one after the other.
#[test]
fn routines() {
    let symbols = assembled("routines.tmc", Product::Tmcm1140).symbols;
    assert_eq!(["Func1", "Func2", "Func3"].map(|name| symbols.value(name)), [Some(0), Some(1), Some(2)]);
    let mut example = Example::load("routines.tmc", "");
    example.begin("129, 1, 0, 0");
    example.when(SECOND, |state| state.first.position == 1000);
    example.when(SECOND, |state| state.first.position == 0 && state.first.velocity == 0);
    example.bench.run(5 * MILLISECOND);
    assert!(example.ended());

    example.begin("129, 1, 0, 1");
    assert_eq!(example.until(900).first.velocity, -500);
    example.until(1_200);
    assert_eq!(example.state().first.velocity, 0);
    close(example.state().first.position, -0.5 * AT_1000, 0.05);
    assert!(example.ended());

    let before = example.state().first.position;
    example.begin("129, 1, 0, 2");
    assert_eq!(example.until(6_900).first.velocity, 1000);
    assert!(!example.ended());
    example.until(7_200);
    assert_eq!(example.state().first.velocity, 0);
    close(example.state().first.position - before, 7.0 * AT_1000, 0.02);
    assert!(example.ended());
    assert_eq!(example.executed(), 6 + 5 + 5);
}

#[test]
fn there_and_back() {
    let mut example = Example::start("there_and_back.tmc", "");
    for (arrivals, end) in [TURN, -TURN, TURN, -TURN].into_iter().enumerate() {
        assert_eq!(example.bench.ok("GGP 0, 2"), arrivals as i32);
        example.when(3 * SECOND, |state| state.first.position == end);
        // The handler has its turn.
        example.bench.run(5 * MILLISECOND);
    }
    example.begin("GGP 0, 2");
    apart(&changes(&mut example, 2_000, |state| state.outputs[0]), 250);
    example.executed();
}

/// The host asks for speeds, and falls silent.
#[test]
fn jog() {
    let mut example = Example::start("jog.tmc", "");
    example.bench.run(100 * MILLISECOND);
    let mut ask = |speed: i32, expected: i32| {
        let command = |number, value| Command::new(Opcode::Sgp as u8, number, 2, value);
        for _ in 0..5 {
            example.bench.send(command(0, speed));
            example.bench.send(command(1, 50));
            example.bench.run(300 * MILLISECOND);
        }
        assert_eq!(example.state().first.velocity, expected);
    };
    ask(300, 300);
    ask(-400, -400);
    // Within limits.
    ask(2047, 1000);
    ask(-9999, -1000);
    // Then nothing comes, for 300 ms now.
    example.begin("GGP 0, 2");
    assert_eq!(example.until(150).first.velocity, -1000);
    assert_eq!(example.until(500).first.velocity, 0);
    let position = example.state().first.position;
    assert_eq!(example.bench.ok("GGP 2, 2"), position);
    example.executed();
}

#[test]
fn stall_homing() {
    let world = std::fs::read_to_string(folder().join("stall_homing.toml")).unwrap();
    let mut example = Example::start("stall_homing.tmc", &world);
    example.when(10 * SECOND, |state| state.outputs[0]);
    let (hard_end, few) = (-102_400, 4 * 256);
    assert!((example.bench.rotor() - hard_end).abs() <= few, "{}", example.bench.rotor());
    example.when(10 * SECOND, |state| state.first.position == TURN);
    example.bench.run(5 * MILLISECOND);
    assert!(example.ended());
    assert!((example.bench.rotor() - hard_end - i64::from(TURN)).abs() <= few, "{}", example.bench.rotor());
    example.executed();
}
