//! Registers, status byte, RAM and datagrams (datasheet chapters 6 and 7).

use super::*;

#[test]
fn version_and_power_on_status() {
    let mut rig = Rig { chip: Tmc429::new(HZ), stage: Stage::default(), now: 0 };
    // All xEQt set, all switches open (6.2.2.2).
    assert_eq!(rig.datagram(VERSION | 1, 0), 0x1542_9101);
    assert_eq!(rig.read(GLOBAL), 0x0F00);
    assert_eq!(rig.read(PMUL_PDIV), 0x8000);
    for register in (0..0x60).step_by(2).filter(|register| register & 0x1F != PMUL_PDIV) {
        assert_eq!(rig.read(register), 0, "register {register:#x}");
    }
    assert_eq!(rig.chip.next_event(), None);
}

#[test]
fn register_masks() {
    // Written with all ones. hold_mode, so that V_TARGET is not computed; the interrupt flags stay 0.
    let axis = [
        (MODE, 0x00_0F03),
        (X_TARGET, 0xFF_FFFF),
        (X_ACTUAL, 0xFF_FFFF),
        (V_MIN, 0x7FF),
        (V_MAX, 0x7FF),
        (V_TARGET, 0xFFF),
        (V_ACTUAL, 0xFFF),
        (A_MAX, 0x7FF),
        (A_ACTUAL, 0),
        (0x10, 0x77_77FF),
        (PMUL_PDIV, 0xFF0F),
        (INTERRUPTS, 0xFF00),
        (DIVIDERS, 0xFF07),
        (TOLERANCE, 0xFFF),
        (LATCHED, 0),
        (USTEP, 0xFF),
    ];
    let mut rig = Rig::new();
    for motor in 0..3 {
        for (register, mask) in axis {
            rig.write(motor << 5 | register, 0xFF_FFFF);
            assert_eq!(rig.read(motor << 5 | register), mask, "register {register:#x} of motor {motor}");
        }
        // The dummy write has armed the latch.
        assert_eq!(rig.read(motor << 5 | MODE), 0x01_0F03);
        rig.write(motor << 5 | MODE, 0);
        assert_eq!(rig.read(motor << 5 | MODE), 0x01_0000);
        rig.write(motor << 5 | PMUL_PDIV, 0);
        assert_eq!(rig.read(motor << 5 | PMUL_PDIV), 0x8000);
        rig.write(motor << 5 | V_MAX, 0);
        rig.write(motor << 5 | V_ACTUAL, 0);
    }
    let common = [
        (0x60, 0),
        (0x62, 0),
        (COVER, 0xFF_FFFF),
        (IF_CONF, 0x1FF),
        (POS_COMP, 0xFF_FFFF),
        (POS_COMP_INT, 0x100),
        (0x6E, 0),
        (VERSION, 0x42_9101),
        (0x74, 0),
        (0x76, 0),
        (0x78, 0),
        (0x7A, 0),
        (GLOBAL, 0x31_FFFF),
    ];
    for (register, mask) in common {
        rig.write(register, 0xFF_FFFF);
        assert_eq!(rig.read(register), mask, "register {register:#x}");
    }
    // COVER_POS reads one higher than written (8.2.2); cw is set by the datagram above.
    rig.write(COVER_POS, 39 << 8 | 7);
    assert_eq!(rig.read(COVER_POS), 0x80_0000 | 40 << 8 | 7);
}

#[test]
fn ram() {
    let mut rig = Rig::new();
    // Power-on contents: positions 0 and 1 of the driver chain, 10 and 11; the sine table (11.4.2, 11.5).
    assert_eq!(rig.read(0x80), 0x0511);
    assert_eq!(rig.read(0x8A), 0x2E0A);
    assert_eq!(rig.read(0xC2), 0x0503);
    // The datasheet's example (6.2.3).
    assert_eq!(rig.datagram(0xFE, 0b10_0011_0010_0001) & 0xFF_FFFF, 0);
    assert_eq!(rig.read(0xFE), 0b10_0011_0010_0001);
    for address in (0x80..=0xFE).step_by(2) {
        rig.write(address, 0xFF_FFFF);
        assert_eq!(rig.read(address), 0x3F3F);
    }
}

#[test]
fn only_32_bits_act() {
    let mut rig = Rig::new();
    rig.write(V_MAX, 0x123);
    assert_eq!(rig.transfer([V_MAX]), [0x15]);
    assert_eq!(rig.transfer([V_MAX, 0, 7]), [0x15, 0, 0]);
    assert_eq!(rig.transfer([V_MAX, 0, 0, 7, 0]), [0x15, 0, 0, 0, 0]);
    assert_eq!(rig.transfer([]), [0_u8; 0]);
    assert_eq!(rig.transfer([V_MAX | 1, 0, 0]), [0x15, 0, 1]);
    assert_eq!(rig.datagram(V_MAX | 1, 0xFF_FFFF), 0x1500_0123);
    assert_eq!(rig.datagram(V_MAX, 0x124), 0x1500_0000);
    // A write acts when nSCS_C rises.
    rig.chip.select(0);
    let _ = [V_MAX, 0, 0, 1].map(|byte| rig.chip.byte(byte));
    assert_eq!(rig.chip.axes[0].read(axis_register::V_MAX), 0x124);
    rig.chip.deselect(0);
    assert_eq!(rig.read(V_MAX), 1);
}
