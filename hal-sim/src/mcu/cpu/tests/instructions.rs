//! Each kind of instruction, in many encodings, with random registers, flags and states of an IT block.

use std::collections::BTreeMap;

use rsemu::cpu::arm::v7m::isa::{Insn, decode, is_32bit};
use rsemu::cpu::arm::v7m::{Regs, xpsr};

use super::super::memory::{FLASH, SRAM, SRAM_SIZE};
use super::oracle::Pair;
use super::*;

/// Encodings of each mnemonic, and cases of each encoding.
const ENCODINGS: usize = 60;
const CASES: u32 = 6;
/// Random encodings that are looked at.
const SEARCHED: u32 = 3_000_000;
/// Bytes between two of them in flash memory.
const PITCH: usize = 8;
/// Where they begin, after the vectors.
const FIRST: usize = 0x400;
/// Where handlers begin.
const HANDLER: u32 = FLASH + 0x201;

/// Encodings by mnemonic, shorter ones and longer ones apart. Those of floating point are left out, of which the
/// executor has none.
fn corpus(random: &mut Random) -> BTreeMap<(String, bool), Vec<[u16; 2]>> {
    let mut corpus: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for number in 0..SEARCHED {
        let second = word(random) as u16;
        // All short ones first, then long ones for the most part.
        let first = if number < 1 << 16 { number as u16 } else { 0xE000 | word(random) as u16 };
        let insn = decode(first, second);
        if matches!(insn, Insn::Fp(_) | Insn::Coproc { .. } | Insn::It { .. }) {
            continue;
        }
        let mnemonic = insn.to_string().split(' ').next().unwrap_or_default().to_owned();
        let found = corpus.entry((mnemonic, is_32bit(first))).or_default();
        if found.len() < ENCODINGS {
            found.push([first, second]);
        }
    }
    corpus
}

/// A value that may be an address, or test the edges of arithmetic.
fn value(random: &mut Random) -> u32 {
    let ram = SRAM + SRAM_SIZE as u32 / 2 + random.below(0x4000);
    let own = [0xE000_E100, 0xE000_E200, 0xE000_E400, 0xE000_ED04, 0xE000_E010, 0xE000_1000, 0xE000_ED14, 0xE000_ED20];
    match random.below(12) {
        0..=3 => ram & !3,
        4 => ram,
        5 => PERIPHERALS + (random.below(SIZE as u32) & !3),
        6 => FLASH + random.below(0x8000),
        7 => pick(random, &[0, 1, 2, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF, 0x7FFF, 0x8000, 0xFFFF_8000]),
        8 => pick(random, &own),
        9 => random.below(300),
        _ => word(random),
    }
}

fn registers(random: &mut Random, pc: u32, in_block: bool) -> Regs {
    let mut regs = Regs::new();
    regs.r = std::array::from_fn(|_| value(random));
    regs.r[15] = pc;
    regs.msp = SRAM + 0x1_8000 + 4 * random.below(0x800);
    regs.psp = SRAM + 0x1_C000 + 4 * random.below(0x800);
    let block = if in_block { 1 + random.below(0xFF) } else { 0 };
    let flags = word(random) & (xpsr::FLAGS | xpsr::GE) | xpsr::T;
    regs.xpsr = flags | (block >> 2) << 10 | (block & 3) << 25;
    regs.primask = random.below(4) == 0;
    regs.basepri = if random.below(4) == 0 { (random.below(16) << 4) as u8 } else { 0 };
    regs.control = random.below(4);
    regs
}

#[test]
fn every_kind_of_instruction_does_what_it_does_in_the_library() {
    let random = &mut Random::new(1);
    let corpus = corpus(random);
    let kinds: Vec<_> = corpus.keys().map(|(mnemonic, _)| mnemonic.as_str()).collect();
    for wanted in ["SMULTB", "SMLABT", "SMMULR", "UMAAL", "SXTAB", "SSAT", "USAT16", "UADD8", "SEL", "PKHBT", "QDADD"] {
        assert!(kinds.contains(&wanted), "{wanted} in {kinds:?}");
    }
    assert!(kinds.len() > 280, "{}", kinds.len());

    let mut flash = vec![0; FLASH_SIZE];
    let mut put = |at: usize, bytes: &[u8]| flash[at..at + bytes.len()].copy_from_slice(bytes);
    for vector in 0..112 {
        put(4 * vector, &HANDLER.to_le_bytes());
    }
    put(0, &(SRAM + 0x1_8000).to_le_bytes());
    let mut places = Vec::new();
    for ((mnemonic, _), encodings) in &corpus {
        for [first, second] in encodings {
            let at = FIRST + PITCH * places.len();
            put(at, &[first.to_le_bytes(), second.to_le_bytes()].concat());
            places.push((
                FLASH + at as u32,
                format!("{mnemonic}: {first:04x} {second:04x} ({})", decode(*first, *second)),
            ));
        }
    }
    let mut pair = Pair::new(flash);
    let noise: Vec<u8> = (0..SRAM_SIZE).map(|_| random.below(256) as u8).collect();
    pair.fill(&noise);
    let (mut done, mut left) = (0, 0);
    for (pc, what) in &places {
        for case in 0..CASES {
            pair.reset();
            let traps = random.below(0x20) & 0x18;
            pair.change(|sys| sys.ccr |= traps);
            pair.set(registers(random, *pc, case % 3 == 2));
            match pair.step(what) {
                Some(()) => done += 1,
                None => {
                    left += 1;
                    pair.level();
                }
            }
        }
        pair.compare_memory(what);
    }
    assert!(left * 10 < done, "{left} of {done} accessed what only one of the two has");
}
