//! Random programs and texts: a program is the same after disassembling and assembling, and no text makes the assembler
//! panic.

use super::*;
use crate::disasm;

/// A generator of random numbers (xorshift64*) with a fixed seed, so that each run is the same.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 16
    }

    fn below(&mut self, below: usize) -> usize {
        (self.next() % below as u64) as usize
    }

    fn pick<'a, T: ?Sized>(&mut self, from: &[&'a T]) -> &'a T {
        from[self.below(from.len())]
    }
}

/// Number of random inputs: `usual`, or the value of the environment variable RANDOM_INPUTS.
fn random_inputs() -> u64 {
    std::env::var("RANDOM_INPUTS").map_or(20_000, |text| text.parse().expect("RANDOM_INPUTS is not a number"))
}

fn check_round_trip(program: &[Command]) {
    let source = disasm::source(program, 0, Some(Product::Tmcm1140));
    let again = assemble_text("again.tmc", &source, Some(Product::Tmcm1140))
        .unwrap_or_else(|errors| panic!("{errors}\n{source}"));
    assert_eq!(again.commands, program, "{source}");
    assert_eq!(binary::decode(&binary::encode(program), Some(Product::Tmcm1140)).as_deref(), Ok(program));
}

#[test]
fn every_command_number_and_type_survives() {
    for opcode in 0..=u8::MAX {
        let program: Vec<Command> = (0..=u8::MAX).map(|kind| Command::new(opcode, kind, 0, 0)).collect();
        check_round_trip(&program);
        let program: Vec<Command> = (0..=u8::MAX).map(|kind| Command::new(opcode, kind, kind / 3, -7)).collect();
        check_round_trip(&program);
    }
    check_round_trip(&[]);
    check_round_trip(&[Command::new(28, 0, 0, 0); 2048]);
    check_round_trip(&[Command::new(22, 0, 0, 2047); 2048]);
}

#[test]
fn random_programs_survive() {
    let mut random = Random(1);
    for _ in 0..random_inputs() / 10 {
        let length = random.below(40);
        let program = (0..length).map(|_| {
            let value = match random.below(4) {
                0 => random.next() as i32,
                1 => [i32::MIN, i32::MAX, -1, 2048][random.below(4)],
                _ => random.below(50) as i32,
            };
            // Half of the commands have known numbers and small fields.
            let small = random.below(2) == 0;
            let mut field = |few: usize| random.below(if small { few } else { 256 }) as u8;
            Command::new(field(40), field(12), field(2), value)
        });
        check_round_trip(&program.collect::<Vec<_>>());
    }
}

const PIECES: &[&str] = &[
    "MVP",
    "SAP",
    "JA",
    "STOP",
    "WAIT",
    "CSUB",
    "28",
    "ABS",
    "TICKS",
    "Loop",
    "Speed",
    "L",
    "é",
    "APMaxAcceleration",
    "0",
    "1",
    "255",
    "4294967295",
    "$FF",
    "0x",
    "%101",
    "99999999999",
    ",",
    ",",
    ",",
    ":",
    "=",
    "+",
    "-",
    "*",
    "/",
    "(",
    ")",
    "//",
    "/*",
    "*/",
    "#include",
    "#nostop",
    "TMCLParam.tmc",
    "\"",
    "<",
    "\n",
    "\n",
    "\n",
    "\r\n",
    "\t",
    "\0",
    "\u{1b}",
    "ß",
    "İ",
    "#",
    ";",
    "_",
];

const GOOD: &str = "\
#include TMCLParam.tmc
Speed = 2 * (500 - $A) // about 1000
Loop: SAP APMaxPositioningSpeed, Motor0, Speed
    MVP ABS, 0, -51200 /* there
    and back */
    WAIT POS, 0, 0
    JC ETO, Loop
    JA Loop
    6, 1, 0, 0
";

/// Asserts that a text either assembles to a program that survives disassembling, or has errors whose locations exist.
fn check_any(text: &str) {
    // What editors ask takes longer than to assemble so short a text.
    if text.len().is_multiple_of(4) {
        editors::agree(text);
    }
    match assemble_text("any.tmc", text, Some(Product::Tmcm1140)) {
        Ok(assembly) => {
            check_round_trip(&assembly.commands);
            let rows = listing(&assembly).lines().count();
            assert!(rows >= text.lines().count(), "{text:?}");
        }
        Err(errors) => {
            assert!(errors.errors() > 0 && !errors.to_string().is_empty(), "{text:?}");
            for location in errors.0.iter().filter_map(|error| error.location.as_ref()) {
                let Location { line, column, text: shown, .. } = location;
                assert_eq!(text.strip_prefix('\u{feff}').unwrap_or(text).lines().nth(line - 1), Some(shown.as_str()));
                assert!(*column <= shown.chars().count() + 1, "{location:?}");
            }
        }
    }
}

#[test]
fn random_text_does_no_harm() {
    let mut random = Random(2);
    for _ in 0..random_inputs() {
        let length = random.below(40);
        let spaced = random.below(2) == 0;
        let pieces: Vec<&str> = (0..length).map(|_| random.pick(PIECES)).collect();
        check_any(&pieces.join(if spaced { " " } else { "" }));
    }
}

#[test]
fn good_programs_with_random_changes_do_no_harm() {
    let mut random = Random(3);
    for _ in 0..random_inputs() {
        let mut text: Vec<char> = GOOD.chars().collect();
        for _ in 0..=random.below(4) {
            if text.is_empty() {
                break;
            }
            let at = random.below(text.len());
            match random.below(4) {
                0 => drop(text.remove(at)),
                1 => text.insert(at, (random.below(96) + 32) as u8 as char),
                2 => drop(text.splice(at..at, random.pick(PIECES).chars())),
                _ => text.truncate(at + 1),
            }
        }
        check_any(&text.into_iter().collect::<String>());
    }
}

#[test]
fn random_bytes_are_no_program_or_survive() {
    let mut random = Random(4);
    for _ in 0..random_inputs() {
        let mut bytes: Vec<u8> = (0..random.below(33)).map(|_| random.next() as u8).collect();
        if random.below(2) == 0 {
            for record in bytes.chunks_exact_mut(8) {
                record[7] = record[..7].iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte));
            }
        }
        match binary::decode(&bytes, Some(Product::Tmcm1140)) {
            Ok(commands) => assert_eq!(binary::encode(&commands), bytes),
            Err(message) => assert!(message.starts_with("command "), "{message}"),
        }
    }
}
