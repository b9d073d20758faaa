//! How fast the interpreter is on the host when nothing holds it back: `cargo bench --bench interpreter`.
//!
//! Measured are the command fetch, the decoder and the commands themselves. In the first row a bare `vm::Machine`
//! executes branches out of a `Store`. In the others it is the module that executes, by `Module::poll`. Each time its
//! program has spent what it may, the time of the next poll is a millisecond later. The chips are not there, and each
//! 128 units include one turn of everything else.

use std::convert::Infallible;
use std::time::{Duration, Instant};

use embedded_hal::digital::{self, OutputPin};
use embedded_hal::spi::{self, Operation, SpiDevice};
use tmcm::chip::tmc429::Tmc429;
use tmcm::device::{Circuit, Controller, Inputs, Parts};
use tmcm::module::{Executed, Hooks, Module, Platform, Source};
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::param::USER_VARIABLES;
use tmcm::product::{TMCM_1140, Tmcm1140};
use tmcm::store::Store;
use tmcm::tmcl::{Command, Opcode};
use tmcm::units::Micros;
use tmcm::vm::{Errors, Machine, Registers};

/// How long each row takes.
const SPAN: Duration = Duration::from_secs(2);
/// Commands, or milliseconds, between two looks at the clock.
const BATCH: u32 = 10_000;

const fn command(opcode: Opcode, kind: u8, value: i32) -> Command {
    Command::new(opcode as u8, kind, 0, value)
}

const BRANCHES: &[Command] = &[
    command(Opcode::Comp, 0, 5),
    command(Opcode::Jc, 2, 0),
    command(Opcode::Csub, 0, 4),
    command(Opcode::Ja, 0, 0),
    command(Opcode::Comp, 0, -5),
    command(Opcode::Rsub, 0, 0),
];

const ARITHMETIC: &[Command] = &[
    command(Opcode::Calc, 9, 1000),
    command(Opcode::Calc, 1, 1),
    command(Opcode::Calcx, 9, 0),
    command(Opcode::Calcx, 2, 0),
    command(Opcode::Calcx, 10, 0),
    command(Opcode::Comp, 0, 0),
    command(Opcode::Jc, 3, 1),
    command(Opcode::Ja, 0, 0),
];

/// Bank 2 has the user variables.
const VARIABLES: &[Command] = &[
    Command::new(Opcode::Ggp as u8, 3, 2, 0),
    command(Opcode::Calc, 0, 1),
    Command::new(Opcode::Agp as u8, 3, 2, 0),
    command(Opcode::Ja, 0, 0),
];

fn main() {
    println!("{:<60} {:>16} {:>10}", "commands", "per second", "each");
    show("COMP, JC, JA, CSUB, RSUB: machine and store alone", machine(BRANCHES));
    show("the same, by Module::poll", module(BRANCHES));
    show("CALC, CALCX, COMP, JC, JA, by Module::poll", module(ARITHMETIC));
    show("GGP, CALC, AGP, JA, by Module::poll", module(VARIABLES));
}

fn show(name: &str, (commands, took): (u64, Duration)) {
    let seconds = took.as_secs_f64();
    let (rate, each) = (commands as f64 / seconds, seconds * 1e9 / commands as f64);
    println!("{name:<60} {rate:>16.0} {each:>7.1} ns");
}

/// A machine that executes out of a store.
fn machine(program: &[Command]) -> (u64, Duration) {
    let (mut machine, mut store) = (Machine::new(TMCM_1140.commands), Store::<Tmcm1140>::new());
    store.begin_download(0);
    for command in program {
        assert!(store.download(&command.to_bytes()));
    }
    store.end_download();
    machine.run();
    let mut commands = 0;
    let start = Instant::now();
    while start.elapsed() < SPAN {
        let (bytes, _) = store.program().as_chunks();
        assert_eq!(machine.burst(bytes, &mut [0; USER_VARIABLES], BATCH, |_, _, _, _| {}), BATCH);
        commands += u64::from(BATCH);
    }
    assert!(machine.runs());
    (commands, start.elapsed())
}

/// Counts commands.
#[derive(Debug, Default)]
struct Counter(u64);

impl Hooks for Counter {
    fn executed(&mut self, _: &Executed, _: &Registers, _: Errors) {
        self.0 += 1;
    }
}

/// The request for the type and version of the TMC429, and its answer (its datasheet, section 7.3). A module without a
/// TMC429 runs no programs.
const VERSION: u8 = 3 << 5 | 9 << 1 | 1;
const TMC429: [u8; 4] = [0, 0x42, 0x91, 0x01];

/// A bus and a pin at which nothing is that takes time.
#[derive(Debug)]
struct Nothing;

impl spi::ErrorType for Nothing {
    type Error = Infallible;
}

impl SpiDevice for Nothing {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), Infallible> {
        if let [Operation::TransferInPlace(datagram)] = operations
            && datagram.first() == Some(&VERSION)
        {
            datagram.copy_from_slice(&TMC429);
        }
        Ok(())
    }
}

impl digital::ErrorType for Nothing {
    type Error = Infallible;
}

impl OutputPin for Nothing {
    fn set_low(&mut self) -> Result<(), Infallible> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl Circuit for Nothing {
    type Product = Tmcm1140;
    type Hardware = Tmc429Tmc262<Nothing, Nothing>;
    type Controllers = [Controller<Self::Hardware>; 1];
    type Enable = Nothing;
    type Store = Box<Store<Tmcm1140>>;
}

impl Platform for Nothing {
    type Hooks = Counter;
}

/// A module that executes a program as fast as time can be told to go on.
fn module(program: &[Command]) -> (u64, Duration) {
    let (store, hooks) = (Box::new(Store::new()), Counter::default());
    let controllers = [Controller::new(Tmc429::new(Nothing))];
    let parts = Parts { controllers, axes: Tmc429Tmc262::axes([Nothing]), enable: Nothing, store };
    let mut module: Module<Nothing, 1> = Module::new(parts, hooks, 1);
    module.start(Micros(0), |_| {});
    let around = [command(Opcode::EnterDownload, 0, 0), command(Opcode::ExitDownload, 0, 0)];
    for command in [&around[..1], program, &around[1..], &[command(Opcode::RunApplication, 0, 0)]].concat() {
        let _ = module.execute(Micros(0), Source::Usb, command);
        // An EEPROM that takes no time.
        while module.store().next_job().is_some() {
            module.stored(true);
        }
    }
    let inputs = Inputs { supply: Some(240), ..Inputs::default() };
    let mut now = Micros(0);
    let start = Instant::now();
    while start.elapsed() < SPAN {
        for _ in 0..BATCH {
            // All pieces of the millisecond.
            while module.deadline() <= now {
                module.poll(now, &inputs);
            }
            now = module.deadline();
        }
    }
    let took = start.elapsed();
    assert!(module.machine().runs());
    (module.hooks().0, took)
}
