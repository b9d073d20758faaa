//! How much faster than real time the virtual module runs, and the flash image on the emulated microcontroller:
//! `cargo bench --bench virtual_time`; with `-- short` behind it in a sixtieth of the time, to see that it runs.

use std::error::Error;
use std::time::Instant;

use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::{Command, Opcode, binary};
use tmcm_sim::image::Setup;
use tmcm_sim::native::Product;
use tmcm_sim::{Client, Fleet, ImageModule, NativeModule, VirtualModule};

/// Virtual time of each row, in seconds: of the virtual module, and of the flash image. In a short run it is less.
const HOUR: u64 = 3600;
const IMAGE: u64 = 4;
/// How much shorter a short run is.
const SHORTER: u64 = 60;

/// Commands around a program: what comes in between is stored.
const LOAD: Command = Command::new(Opcode::EnterDownload as u8, 0, 0, 0);
const LOADED: Command = Command::new(Opcode::ExitDownload as u8, 0, 0, 0);
const RUN: Command = Command::new(Opcode::RunApplication as u8, 0, 0, 0);

/// ROR 1000 at pulse divisor 3, 30 518 microsteps/s.
const ROR: Command = Command::new(Opcode::Ror as u8, 0, 0, 1000);

/// The work of the module, and the commands that make it do so.
const ROWS: &[(&str, &[Command])] = &[
    ("at rest", &[]),
    ("ROR 1000 at pulse divisor 3 (30 518 microsteps/s)", &[ROR]),
    (
        "MVP over 2^31 - 1 microsteps at 61 005/s",
        &[Command::new(Opcode::Sap as u8, 4, 0, 1999), Command::new(Opcode::Mvp as u8, 0, 0, i32::MAX)],
    ),
    (
        "ROR 1000, and a program that never waits",
        &[
            LOAD,
            Command::new(Opcode::Calc as u8, 0, 0, 1),
            Command::new(Opcode::Calcx as u8, 9, 0, 0),
            Command::new(Opcode::Comp as u8, 0, 0, 1000),
            Command::new(Opcode::Jc as u8, 6, 0, 0),
            Command::new(Opcode::Calc as u8, 9, 0, 0),
            Command::new(Opcode::Ja as u8, 0, 0, 0),
            LOADED,
            ROR,
            RUN,
        ],
    ),
    (
        "ROR 1000, and a program that reads the speed",
        &[LOAD, Command::new(Opcode::Gap as u8, 3, 0, 0), Command::new(Opcode::Ja as u8, 0, 0, 0), LOADED, ROR, RUN],
    ),
];

/// The rows that the flash image is measured with.
const IMAGE_ROWS: [usize; 3] = [0, 3, 4];

fn main() -> Result<(), Box<dyn Error>> {
    let is_short = std::env::args().any(|argument| argument == "short");
    native(if is_short { HOUR / SHORTER } else { HOUR });
    fleet();
    image(if is_short { 1 } else { IMAGE })
}

/// The same speeds as those of the rows, by their values there, for a product whose speeds are in pps.
const SPEEDS: [(i32, i32); 2] = [(1000, 30_518), (1999, 61_005)];

/// Rows of the firmware's core, compiled for the host: of the TMCM-1140, and of its sisters with all of their axes.
fn native(hour: u64) {
    println!("{:<52} {:>10} {:>10} {:>8} {:>10}", "the motor of a TMCM-1140", "virtual", "host", "ratio", "all polls");
    for (name, commands) in ROWS {
        time(name, Product::Tmcm1140, hour, commands);
    }
    for product in [Product::Tmcm6110, Product::Tmcm3212] {
        println!(
            "{:<52} {:>10} {:>10} {:>8}",
            format!("all motors of a {}", product.name()),
            "virtual",
            "host",
            "ratio"
        );
        for (name, commands) in ROWS {
            let commands: Vec<_> = commands.iter().flat_map(|command| of_all(product, command)).collect();
            time(name, product, hour / 10, &commands);
        }
    }
}

/// Virtual time of the rows of a fleet, in seconds.
const MINUTE: u64 = 60;

/// Does what `tmcl sim` does: starts a module, and takes a step of paused time, with a motor that turns, in portions of
/// a millisecond.
fn fleet() {
    let start = Instant::now();
    let mut fleet = Fleet::of(Product::Tmcm1140, &WorldConfig::default(), &[None], 1);
    println!("{:<52} {:>21.2} ms", "the start of a module", start.elapsed().as_secs_f64() * 1e3);
    fleet.hear_usb(Client::default(), &binary::encode_command(1, ROR));
    fleet.run(SECOND);
    let start = Instant::now();
    for _ in 0..MINUTE * 1000 {
        fleet.run(MILLISECOND);
    }
    let host = start.elapsed().as_secs_f64();
    println!("{:<52} {MINUTE:>8} s {host:>8.2} s {:>7.0}x", "ROR 1000, steps of 1 ms", MINUTE as f64 / host);
}

/// A command for all axes of a product, if it is about a motor.
fn of_all(product: Product, command: &Command) -> Vec<Command> {
    let moves = [ROR.opcode, Opcode::Sap as u8, Opcode::Mvp as u8].contains(&command.opcode);
    let speed = SPEEDS.into_iter().find(|(value, _)| product == Product::Tmcm3212 && *value == command.value);
    let value = if moves { speed.map_or(command.value, |(_, speed)| speed) } else { command.value };
    let axes = if moves { product.spec().axes } else { 1 };
    (0..axes).map(|motor| Command { motor, value, ..*command }).collect()
}

/// Prints how long the host takes for so many seconds of a product's virtual module, and for a tenth of them with all
/// polls.
fn time(name: &str, product: Product, seconds: u64, commands: &[Command]) {
    let mut module = NativeModule::of(product, &WorldConfig::default(), None, 1);
    prepare(&mut module, Source::Usb, commands);
    let mut pass = |seconds: u64, skips: bool| {
        module.skip(skips);
        let start = Instant::now();
        module.run_until(module.now() + seconds * SECOND);
        start.elapsed().as_secs_f64()
    };
    let (host, polled) = (pass(seconds, true), pass(seconds / 10, false));
    let (ratio, polled) = (seconds as f64 / host, (seconds / 10) as f64 / polled);
    println!("{name:<52} {seconds:>8} s {host:>8.2} s {ratio:>7.0}x {polled:>9.0}x");
    assert_eq!(module.machine().is_some_and(|machine| machine.runs()), commands.contains(&RUN), "{name}");
}

/// Rows of the flash image. An instruction that is skipped, as one in a loop that waits, is none.
fn image(seconds: u64) -> Result<(), Box<dyn Error>> {
    println!("{:<52} {:>10} {:>10} {:>8} {:>16}", "the flash image", "virtual", "host", "ratio", "instructions/s");
    let elf = std::fs::read(common::image::try_built(xtask::TMCL)?.path)?;
    for (name, commands) in IMAGE_ROWS.iter().filter_map(|&row| ROWS.get(row)) {
        let mut module = ImageModule::new(&elf, &WorldConfig::default(), None, 1, Setup::default())?;
        prepare(&mut module, Source::Rs485, commands);
        let done = |module: &mut ImageModule| {
            let counters = module.machine().counters();
            counters.instructions - counters.skipped
        };
        let before = done(&mut module);
        let start = Instant::now();
        module.run_until(module.now() + seconds * SECOND);
        let host = start.elapsed().as_secs_f64();
        assert_eq!(module.stopped(), None, "{name}");
        let speed = (done(&mut module) - before) as f64 / host / 1e6;
        println!("{name:<52} {seconds:>8} s {host:>8.2} s {:>7.2}x {speed:>8.1} million", seconds as f64 / host);
    }
    Ok(())
}

/// Has the module do what these commands say.
fn prepare(module: &mut impl VirtualModule, source: Source, commands: &[Command]) {
    for command in commands {
        module.hear(source, Client::default(), &binary::encode_command(1, *command));
        // Until the reply: the end of a download takes a while.
        while module.is_busy() {
            module.run_until(module.now() + MILLISECOND);
            while module.sent().is_some() {}
        }
    }
}
