//! How much faster than real time the virtual module runs: `cargo bench --bench virtual_time`.

use std::time::Instant;

use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcl_cli::virtual_module::VirtualModule;
use tmcm::module::Source;
use tmcm::tmcl::{Command, Opcode, binary};

/// Virtual time of each row, in seconds.
const HOUR: u64 = 3600;

/// What the module does, and the commands that make it do so.
const ROWS: &[(&str, &[Command])] = &[
    ("at rest", &[]),
    ("ROR 1000 at pulse divisor 3 (30 518 microsteps/s)", &[Command::new(Opcode::Ror as u8, 0, 0, 1000)]),
    (
        "MVP over 2^31 - 1 microsteps at 61 005/s",
        &[Command::new(Opcode::Sap as u8, 4, 0, 1999), Command::new(Opcode::Mvp as u8, 0, 0, i32::MAX)],
    ),
];

fn main() {
    println!("{:<52} {:>10} {:>10} {:>8}", "the motor for an hour", "virtual", "host", "ratio");
    for (name, commands) in ROWS {
        let mut module = VirtualModule::new(&WorldConfig::default(), None, 1);
        for command in *commands {
            module.receive(Source::Usb, binary::encode_command(1, *command));
            module.run(MILLISECOND);
        }
        let start = Instant::now();
        module.run(HOUR * SECOND);
        let host = start.elapsed().as_secs_f64();
        println!("{name:<52} {HOUR:>8} s {host:>8.2} s {:>7.0}x", HOUR as f64 / host);
    }
}
