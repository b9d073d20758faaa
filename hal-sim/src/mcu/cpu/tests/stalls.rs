//! Waits for the flash memory: counted always, and lasting where that is asked for.

use super::super::memory::SRAM;
use super::*;

/// Runs a loop three times: cycles and stalls of each round. Its four instructions lie in two lines, and it loads a
/// literal from a third one.
fn rounds(wait_states: u32, on: bool, take_time: bool) -> [[Cycles; 2]; 3] {
    let mut flash = vec![0; FLASH_SIZE];
    flash[..8].copy_from_slice(&[SRAM + 0x1000, FLASH + 0x4D].map(u32::to_le_bytes).concat());
    // 0x4C: LDR R0, [PC, #32]; NOP; NOP; B back.
    let code = [0x4808, 0xBF00, 0xBF00, 0xE7FB].map(u16::to_le_bytes).concat();
    flash[0x4C..0x54].copy_from_slice(&code);
    let (mut cpu, mut bus) = (Cpu::new(flash), Peripherals::new());
    cpu.set_up_flash(Setup { wait_states, instruction_cache: on, data_cache: on, ..Setup::default() });
    cpu.set_stalls(take_time);
    cpu.step(&mut bus, 0);
    let mut now = 0;
    [0; 3].map(|_| {
        let before = [now, cpu.stalls()];
        for _ in 0..4 {
            now += cpu.step(&mut bus, now);
        }
        assert_eq!(cpu.pc(), FLASH + 0x4C);
        [now - before[0], cpu.stalls() - before[1]]
    })
}

#[test]
fn stalls_are_counted_and_take_time_where_that_is_asked_for() {
    // LDR takes 2, each NOP 1, the branch 3.
    assert_eq!(rounds(0, false, true), [[7, 0]; 3]);
    assert_eq!(rounds(5, false, false), [[7, 15]; 3]);
    assert_eq!(rounds(5, false, true), [[22, 15]; 3]);
    assert_eq!(rounds(5, true, true), [[22, 15], [7, 0], [7, 0]]);
}
