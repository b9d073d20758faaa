//! Random commands of TMCL programs: valid, invalid, jumping onto themselves, calling without end, with interrupts on.

use crate::random::Random;
use tmcm::tmcl::{Command, Opcode, text};

/// Number of commands of a program that these are meant for: addresses and jumps are hardly larger.
pub const LENGTH: usize = 40;

/// Any bytes at all, or a command whose fields mean something. 128 and up control the module and cannot be in a
/// program.
pub fn command(random: &mut Random) -> Command {
    let line = |text: String| text::parse(&text).unwrap();
    let (number, address) = (random.below(40), random.below(LENGTH as u64 + 2));
    let value = random.below(4096) as i32 - 2048;
    match random.below(40) {
        0 => Command::new(random.below(128) as u8, random.next() as u8, random.next() as u8, random.next() as i32),
        1 => Command::new(random.below(128) as u8, random.next() as u8, 0, value),
        2 | 3 => line(format!("JA {address}")),
        4..=6 => Command::new(Opcode::Jc as u8, random.below(12) as u8, 0, address as i32),
        7 | 8 => line(format!("CSUB {address}")),
        9 => line("RSUB".into()),
        10 => line("RETI".into()),
        11 => Command::new(Opcode::Wait as u8, random.below(5) as u8, 0, random.below(4) as i32),
        12 => line(format!("VECT {}, {address}", interrupt(random))),
        13 => line(format!("EI {}", interrupt(random))),
        14 => line("EI 255".into()),
        15 => line(format!("SGP {}, 3, {}", random.below(3), 1 + random.below(20))),
        16 => line(format!("SGP {}, 3, {}", random.pick(&[27, 28, 39, 40, 41, 42]), random.below(4))),
        17 => line(format!("ROR 0, {value}")),
        18 => line(format!("MVP REL, 0, {value}")),
        19 => line(format!("MVP ABS, 0, {value}")),
        20 => line("MST 0".into()),
        21 => Command::new(Opcode::Rfs as u8, random.below(3) as u8, 0, 0),
        22 => Command::new(Opcode::Sap as u8, random.pick(&[4, 5, 6, 7, 140, 193, 194]), 0, value),
        23 | 24 => line(format!("GAP {}, 0", random.pick(&[0, 1, 3, 8, 10, 11, 206, 208]))),
        25 => line(format!("SGP {number}, 2, {value}")),
        26 => line(format!("GGP {number}, 2")),
        27 => line(format!("AGP {number}, 2")),
        28 => line(format!("STGP {number}, 2")),
        29 => line(format!("STAP {}, 0", random.pick(&[4, 5, 6]))),
        30 => line(format!("SIO {}, 2, {}", random.below(3), random.below(2))),
        31 => line(format!("GIO {}, {}", random.below(5), random.below(3))),
        32 | 33 => Command::new(Opcode::Calc as u8, random.below(10) as u8, 0, value),
        34 | 35 => Command::new(Opcode::Calcx as u8, random.below(11) as u8, 0, 0),
        36 | 37 => line(format!("COMP {value}")),
        38 => line(format!("SCO {}, 0, {value}", random.below(21))),
        _ => line("CLE ALL".into()),
    }
}

fn interrupt(random: &mut Random) -> u8 {
    random.pick(&[0, 1, 2, 3, 15, 21, 27, 28, 39, 40, 41, 42])
}
