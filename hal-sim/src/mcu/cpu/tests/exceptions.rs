//! Programs with interrupts at random times: entered, left, nested, one right after the other, masked, slept for.

use rsemu::cpu::arm::v7m::Regs;

use super::super::memory::{FLASH, SRAM};
use super::oracle::Pair;
use super::*;

/// Steps of a run.
const STEPS: u32 = 60_000;
/// How many interrupts there are.
const INTERRUPTS: u32 = 82;

/// The program: arithmetic, masks, an IT block, calls of the supervisor, sleep, marked accesses, and round again.
const MAIN: &[u16] = &[
    0x3001, 0xB672, 0x3101, 0xB662, // ADDS R0, #1; CPSID I; ADDS R1, #1; CPSIE I
    0x2807, 0xBF07, 0x3201, 0x3301, 0x3401, 0x3501, // CMP R0, #7; ITTEE EQ; ADDs to R2, R3, R4, R5
    0xDF05, 0x2660, 0xF386, 0x8811, 0x3701, // SVC #5; MOVS R6, #0x60; MSR BASEPRI, R6; ADDS R7, #1
    0x2600, 0xF386, 0x8811, // MOVS R6, #0; MSR BASEPRI, R6
    0xE858, 0x6F00, 0xE848, 0x6A00, 0xE848, 0x6A00, // LDREX R6, [R8]; STREX R10, R6, [R8] twice
    0xB671, 0x3101, 0xB661, // CPSID F; ADDS R1, #1; CPSIE F
    0xBF30, 0xB672, 0xBF30, 0xB662, // WFI; CPSID I; WFI; CPSIE I
    0xBF40, 0xBF20, 0xBF20, // SEV; WFE; WFE
    0x2A09, 0xBFB8, 0x2A05, 0xDE00, // CMP R2, #9; IT LT; CMPLT R2, #5; UDF
    0xE7D7, // B to the start
];
/// Handlers: BX LR; one that saves registers and calls the supervisor; one that pends PendSV, whose control register is
/// in R9; and one for faults, that goes on after the instruction.
const RETURNS: &[u16] = &[0x4770];
const CALLS: &[u16] = &[0xB510, 0x3401, 0xDF01, 0xBD10]; // PUSH {R4, LR}; ADDS R4, #1; SVC #1; POP {R4, PC}
const PENDS: &[u16] = &[0xF04F, 0x5380, 0xF8C9, 0x3000, 0x3001, 0x4770]; // MOV R3, #1 << 28; STR R3, [R9]; ADDS R0, #1; BX LR
// TST LR, #4; ITE EQ; MRSEQ R1, MSP; MRSNE R1, PSP; LDR R0, [R1, #24]; ADDS R0, #2; STR R0, [R1, #24]; BX LR
const MENDS: &[u16] = &[0xF01E, 0x0F04, 0xBF0C, 0xF3EF, 0x8108, 0xF3EF, 0x8109, 0x6988, 0x3002, 0x6188, 0x4770];

/// A flash memory with these handlers, as often as they are there, and what is done in a fault.
fn flash(handlers: &[&[u16]], fault: &[u16]) -> Vec<u8> {
    let mut flash = vec![0; FLASH_SIZE];
    let mut end = 0x800;
    let mut place = |code: &[u16]| {
        let at = end;
        for half in code {
            flash[end..end + 2].copy_from_slice(&half.to_le_bytes());
            end += 2;
        }
        end = end.next_multiple_of(16);
        (FLASH + at as u32) | 1
    };
    let mut vectors = vec![SRAM + 0x8000, place(MAIN)];
    vectors.extend((2..16 + INTERRUPTS).map(|number| match number {
        3 => place(fault),
        2 | 11 | 14 | 15 => place(RETURNS),
        _ => place(handlers[number as usize % handlers.len()]),
    }));
    for (cells, vector) in flash.chunks_exact_mut(4).zip(vectors) {
        cells.copy_from_slice(&vector.to_le_bytes());
    }
    flash
}

fn start(pair: &mut Pair, process: bool) {
    pair.reset();
    let mut regs =
        Regs { control: 2 * u32::from(process), msp: SRAM + 0x8000, psp: SRAM + 0x4004, ..pair.library.regs() };
    regs.r[8] = SRAM + 0x100;
    regs.r[9] = 0xE000_ED04;
    pair.set(regs);
}

#[test]
fn exceptions_come_and_go_as_in_the_library() {
    let flash = flash(&[RETURNS, CALLS, PENDS, RETURNS, CALLS], MENDS);
    let mut seen = [0_u32; 16 + INTERRUPTS as usize];
    for seed in 0..6 {
        let random = &mut Random::new(seed);
        let mut pair = Pair::new(flash.clone());
        start(&mut pair, seed % 2 == 1);
        let priorities: Vec<u8> = (0..16 + INTERRUPTS).map(|_| (random.below(16) << 4) as u8).collect();
        pair.change(|sys| {
            sys.enable = [!0; 8];
            // The supervisor can be called from all handlers, however priorities are grouped.
            for (to, &priority) in sys.priority.iter_mut().zip(&priorities) {
                *to = priority.max(0x40);
            }
            sys.priority[11] = 0;
            sys.prigroup = 3 + (seed % 3) as u8;
            sys.demcr = 1 << 24;
            sys.dwt_ctrl |= 1;
            (sys.syst_csr, sys.syst_rvr) = (if seed < 3 { 7 } else { 0 }, 700);
        });
        pair.cpu.core.plan_tick();
        let mut lines = [0; LINES];
        for step in 0..STEPS {
            if random.below(12) == 0 {
                let line = random.below(INTERRUPTS);
                lines[line as usize / 32] ^= 1 << (line % 32);
                pair.cpu.set_interrupts(lines);
                pair.library.set_irq(line as u16, lines[line as usize / 32] >> (line % 32) & 1 != 0);
            }
            if random.below(40) == 0 {
                // All lines go, so that the program goes on.
                for line in 0..INTERRUPTS {
                    pair.library.set_irq(line as u16, false);
                }
                lines = [0; LINES];
                pair.cpu.set_interrupts(lines);
            }
            match random.below(300) {
                0 => pair.change(|sys| sys.set_pending(Exception::NMI, true)),
                1 => pair.change(|sys| sys.set_pending(Exception::PEND_SV, true)),
                _ => {}
            }
            pair.step(&format!("step {step} of run {seed}")).unwrap();
            seen[usize::from(pair.cpu.core.entered)] += 1;
        }
        pair.compare_memory("exceptions");
    }
    for exception in [2, 3, 11, 14, 15, 16, 17, 18, 97] {
        assert!(seen[exception] > 20, "exception {exception}: {} times", seen[exception]);
    }
}

#[test]
fn a_fault_in_the_handler_of_a_fault_locks_up_as_in_the_library() {
    let mut pair = Pair::new(flash(&[RETURNS], &[0xDE00]));
    start(&mut pair, false);
    pair.change(|sys| sys.priority[11] = 0);
    let mut steps = 0;
    while !pair.cpu.is_locked_up() {
        pair.step(&format!("step {steps}")).unwrap();
        // What it sleeps for.
        pair.change(|sys| sys.set_pending(Exception::PEND_SV, steps % 9 == 0));
        steps += 1;
        assert!(steps < 1_000);
    }
    pair.step("locked up").unwrap();
    assert_eq!(pair.cpu.pc(), 0xFFFF_FFFE);
}

#[test]
fn an_it_block_goes_on_after_an_exception_within_it() {
    let mut flash = vec![0; FLASH_SIZE];
    let mut words = |at: usize, words: &[u32]| {
        for (place, word) in flash[at..].chunks_exact_mut(4).zip(words) {
            place.copy_from_slice(&word.to_le_bytes());
        }
    };
    // Stack and reset vector; PendSV.
    words(0, &[SRAM + 0x1000, FLASH + 0x41]);
    words(14 * 4, &[FLASH + 0x51]);
    // MOVS R0, #0; CMP R0, #1; ITT EQ; ADDEQ R1, #1 twice; B .
    words(0x40, &[0x2801_2000, 0x3101_BF04, 0xE7FE_3101]);
    // BX LR
    words(0x50, &[0x4770]);
    let (mut cpu, mut bus) = (Cpu::new(flash), Peripherals::new());
    while cpu.pc() != FLASH + 0x46 {
        cpu.step(&mut bus, 0);
    }
    cpu.core.registers.set(1, 0);
    cpu.core.sys.set_pending(Exception::PEND_SV, true);
    cpu.core.attention = true;
    let mut handled = false;
    while cpu.pc() != FLASH + 0x4A {
        cpu.step(&mut bus, 0);
        handled |= cpu.pc() == FLASH + 0x50;
    }
    assert!(handled);
    assert_eq!(cpu.core.registers.get(1), 0, "0 is not 1: neither is executed");
}

#[test]
fn what_is_not_modelled_ends_the_run() {
    let refusal = |code: &[u16]| {
        let mut flash = flash(&[RETURNS], MENDS);
        for (place, half) in flash[0x800..].chunks_exact_mut(2).zip(code) {
            place.copy_from_slice(&half.to_le_bytes());
        }
        let (mut cpu, mut bus) = (Cpu::new(flash), Peripherals::new());
        cpu.step(&mut bus, 0);
        cpu.core.registers.set(8, 0xE000_ED88);
        cpu.core.registers.set(9, 0xE000_ED94);
        cpu.core.registers.set(0, 0xF << 20 | 1);
        cpu.run(&mut bus, 0, 100);
        cpu.refused()
    };
    // STR R0, [R8]: the unit is switched on; VADD.F32 S0, S0, S0.
    let switched_on = refusal(&[0xF8C8, 0x0000, 0xEE30, 0x0A00]);
    assert_eq!(switched_on, Some((FLASH + 0x804, "floating point is not modelled")));
    // Without, it is a fault as in the chip.
    assert_eq!(refusal(&[0xBF00, 0xEE30, 0x0A00, 0xE7FE]), None);
    // STR R0, [R9].
    let protected = refusal(&[0xF8C9, 0x0000]);
    assert_eq!(protected, Some((FLASH + 0x800, "the memory protection unit is not modelled")));
}
