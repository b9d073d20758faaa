//! Random sessions: hosts that set parameters, move and stop motors and wait, in worlds with switches, loads, faults
//! and encoders.

use common::pair::{Pair, span};
use common::random::Random;
use hal_sim::clock::SECOND;
use tmcm::module::Source;
use tmcm::tmcl::{Command, text};
use tmcm_sim::Product;

/// Worlds for any product.
const WORLDS: [&str; 5] = [
    "",
    "[stage]\nleft = -60000\nright = 60000\nhome = [-300, 500]",
    "[stage]\nleft = -9000\nleft_width = 800\nright = 20000\nright_width = 500\nhysteresis = 20\nnormally_closed = [\"left\"]",
    "[stage]\nhard_left = -30000\nhard_right = 90000\n[motor]\nfriction = 0.2\nstall_guard_noise = 20",
    "[motor]\nfriction = 0.1\ninertia = 0.05",
];

/// A command of a host; values of speed and acceleration are small numbers of the TMC429, or of pulses a second.
fn command(random: &mut Random, product: Product) -> Command {
    let axis = random.below(product.spec().axes.into());
    let speed =
        random.pick(&[1, 20]) * if product == Product::Tmcm3212 { random.below(4_000) } else { random.below(110) };
    let way = random.below(400_000) as i64 - 200_000;
    let line = match random.below(24) {
        0..=3 => format!("ROR {axis}, {speed}"),
        4 | 5 => format!("ROL {axis}, {speed}"),
        6 | 7 => format!("MST {axis}"),
        8 | 9 => format!("MVP ABS, {axis}, {way}"),
        10 => format!("MVP REL, {axis}, {}", way * 1000),
        11 => format!("SAP 4, {axis}, {speed}"),
        12 => format!("SAP 5, {axis}, {}", 10 + speed),
        13 => format!("SAP {}, {axis}, {}", random.pick(&[6, 7, 183, 200]), random.below(256)),
        14 => format!("SAP {}, {axis}, {}", random.pick(&[204, 214]), random.below(300)),
        15 => format!("SAP 140, {axis}, {}", random.below(9)),
        16 => format!("SAP {}, {axis}, {}", random.pick(&[12, 13, 149, 150, 172, 173, 212]), random.below(2)),
        17 => format!("SAP {}, {axis}, {}", random.pick(&[181, 182, 174]), random.below(60)),
        18 => format!("RFS {}, {axis}", random.pick(&["START", "START", "STOP", "STATUS"])),
        19 => format!("SGP {}, 0, {}", random.pick(&[68, 82]), random.pick(&[0, 0, 0, 200, 3000])),
        20 => format!("SGP {}, 0, {}", random.pick(&[79, 90]), random.below(2)),
        21 => format!("STAP {}, {axis}", random.pick(&[4, 5, 6, 140])),
        22 => format!("SIO {}, 2, {}", random.below(2), random.below(2)),
        _ => format!("GAP {}, {axis}", random.pick(&[1, 3, 8, 10, 11, 135, 180, 206, 207, 208, 209])),
    };
    text::parse(&line).unwrap()
}

/// Returns a random disturbance by the world.
fn disturbance(random: &mut Random, product: Product) -> String {
    let axis = random.below(product.spec().axes.into());
    let on = random.pick(&["on", "off", "off"]);
    match random.below(16) {
        0 | 1 => format!("press {} {axis}", random.pick(&["left", "right", "home"])),
        2..=5 => format!("release {} {axis}", random.pick(&["left", "right", "home"])),
        6..=8 => format!("load 0.{} {axis}", random.below(10)),
        9 => format!("slip {} {axis}", random.below(9)),
        10 => format!("supply {}", random.pick(&[24, 24, 24, 7])),
        11 => format!("temperature {}", random.pick(&[25, 25, 25, 110, 155])),
        12 if product.kind().magnetic_encoders => format!("fault encoder {on} {axis}"),
        12 => format!("fault {} {on} {axis}", random.pick(&["short-a", "open-b", "overtemperature"])),
        13 => format!("fault {} {on}", random.pick(&["eeprom", "spi", "spi-low"])),
        14 if product == Product::Tmcm3212 => format!("fault {} {on} {axis}", random.pick(&["tmc5160", "chip-supply"])),
        14 => format!("fault {} {on} {axis}", random.pick(&["tmc429", "tmc262"])),
        _ => format!("power {on}"),
    }
}

/// So many seconds of sessions in all worlds.
fn sessions(product: Product, seconds: u64) {
    for (seed, world) in (1..).zip(WORLDS) {
        let mut random = Random(0x5E55_1011 + seed);
        let mut pair = Pair::new(product, world, seed as u32);
        let mut parts = 0;
        while pair.now() < seconds * SECOND {
            match random.below(12) {
                0..=7 => {
                    let source = random.pick(&[Source::Usb, Source::Rs485]);
                    pair.send(source, command(&mut random, product));
                }
                8 => pair.control(&disturbance(&mut random, product)),
                9 if random.one_in(4) => pair.record(span(&mut random)),
                9 => pair.listen(),
                _ => {}
            }
            pair.run(span(&mut random));
            parts += 1;
        }
        assert!(parts > seconds);
        pair.end();
    }
}

#[test]
fn of_a_tmcm_1140() {
    sessions(Product::Tmcm1140, 300);
}

#[test]
fn of_a_tmcm_1110() {
    sessions(Product::Tmcm1110, 100);
}

#[test]
fn of_a_tmcm_3110() {
    sessions(Product::Tmcm3110, 100);
}

#[test]
fn of_a_tmcm_6110() {
    sessions(Product::Tmcm6110, 60);
}

#[test]
fn of_a_tmcm_3212() {
    sessions(Product::Tmcm3212, 150);
}
