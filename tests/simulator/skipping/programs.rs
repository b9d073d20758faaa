//! An hour of random programs, each beside the requests of a host and the disturbances of its world, shared out over
//! the products.

use common::pair::{Pair, span};
use common::random::Random;
use common::random_command::{LENGTH, command};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, Opcode, text};
use tmcm_sim::Product;

const MINUTE: u64 = 60;
/// How long each program runs at least, in milliseconds.
const TURN: u64 = 500;
/// Opcodes that a command to a motor may have.
const OF_A_MOTOR: [Opcode; 8] =
    [Opcode::Ror, Opcode::Mvp, Opcode::Mst, Opcode::Rfs, Opcode::Sap, Opcode::Gap, Opcode::Stap, Opcode::Sco];

/// So many seconds of programs.
fn programs(product: Product, seconds: u64) {
    let mut random = Random(0x9806_8A35);
    let mut pair = Pair::new(product, "[stage]\nleft = -20000\nright = 30000\nhome = [-9, 9]", 1);
    let axes = u64::from(product.spec().axes);
    let control = |opcode: Opcode| Command::new(opcode as u8, 0, 0, 0);
    // Replies to storing commands, and that to the end of a download, take page writes.
    let ask = |pair: &mut Pair, command| pair.exchange(command, SECOND).unwrap();
    while pair.now() < seconds * SECOND {
        ask(&mut pair, control(Opcode::ResetApplication));
        ask(&mut pair, control(Opcode::EnterDownload));
        for _ in 0..LENGTH {
            let command = command(&mut random);
            let motor = if OF_A_MOTOR.iter().any(|opcode| *opcode as u8 == command.opcode) {
                random.below(axes) as u8
            } else {
                command.motor
            };
            ask(&mut pair, Command { motor, ..command });
        }
        ask(&mut pair, control(Opcode::ExitDownload));
        ask(&mut pair, control(Opcode::RunApplication));
        // The commands of some programs are compared one by one.
        pair.trace(random.one_in(8));
        let stop = pair.now() + TURN * MILLISECOND;
        while pair.now() < stop {
            pair.run(span(&mut random));
            let read = random.pick(&["GAP 1, 0", "GGP 130, 0", "GIO 0, 0", "135, 1, 0, 0", "GGP 0, 2"]);
            pair.send(random.pick(&[Source::Usb, Source::Rs485]), text::parse(read).unwrap());
            if random.one_in(4) {
                let pin = random.pick(&["left", "right", "home"]);
                pair.control(&format!("{} {pin} {}", random.pick(&["press", "release"]), random.below(axes)));
            }
        }
    }
    pair.end();
}

#[test]
fn of_a_tmcm_1140() {
    programs(Product::Tmcm1140, 25 * MINUTE);
}

#[test]
fn of_a_tmcm_1110() {
    programs(Product::Tmcm1110, 10 * MINUTE);
}

#[test]
fn of_a_tmcm_3110() {
    programs(Product::Tmcm3110, 10 * MINUTE);
}

#[test]
fn of_a_tmcm_6110() {
    programs(Product::Tmcm6110, 10 * MINUTE);
}

#[test]
fn of_a_tmcm_3212() {
    programs(Product::Tmcm3212, 15 * MINUTE);
}
