//! Datagrams (chapter 4), and what registers are and read.

use super::*;

/// Page 24, the example of 4.1.1: two reads of XACTUAL and two writes of VMAX.
#[test]
fn example_of_4_1_1_reads_come_with_the_next_datagram_and_writes_are_mirrored() {
    let mut rig = Rig::new();
    rig.write(XACTUAL, 0x0012_3456);
    rig.datagram(GCONF, 0);
    let data = |rig: &mut Rig, bytes| {
        let [_, a, b, c, d] = rig.transfer(bytes);
        [a, b, c, d]
    };
    assert_ne!(data(&mut rig, [0x21, 0, 0, 0, 0]), [0, 0x12, 0x34, 0x56]);
    assert_eq!(data(&mut rig, [0x21, 0, 0, 0, 0]), [0, 0x12, 0x34, 0x56]);
    assert_eq!(data(&mut rig, [0xA7, 0x00, 0xAB, 0xCD, 0xEF]), [0, 0x12, 0x34, 0x56]);
    assert_eq!(data(&mut rig, [0xA7, 0x00, 0x12, 0x34, 0x56]), [0x00, 0xAB, 0xCD, 0xEF]);
    // The register has 23 bits, the mirror all of what was written.
    assert_eq!(rig.chip.register(VMAX), 0x12_3456);
    assert_eq!(data(&mut rig, [0x21, 0, 0, 0, 0]), [0x00, 0x12, 0x34, 0x56]);
}

/// Page 24: "write access to the register with the address 0x22: 0x80 + 0x22 = 0xA2". VACTUAL does not take it.
#[test]
fn example_of_4_1_1_the_address_of_a_write_has_bit_7() {
    assert_eq!(VACTUAL | WRITE, 0xA2);
    let mut rig = Rig::new();
    rig.write(VACTUAL, 5);
    assert_eq!(rig.read(VACTUAL), 0);
}

/// 4.2: fewer than 40 clocks are no command, of more the last 40 are, and what is pushed through comes out.
#[test]
fn datagrams_of_other_lengths_are_ignored_or_cut() {
    let mut rig = Rig::new();
    rig.write(XTARGET, 0);
    rig.transfer([0xAD, 0, 0, 1]);
    assert_eq!(rig.chip.register(XTARGET), 0);
    let answer = rig.transfer([0x11, 0x22, 0xA4, 0, 0, 0x12, 0x34]);
    assert_eq!((rig.chip.register(A1), answer[5..].to_vec()), (0x1234, vec![0x11, 0x22]));
    // A datagram that was too short leaves the answer to the one before it as it was.
    rig.datagram(IOIN, 0);
    rig.transfer([0x21, 0]);
    assert_eq!(rig.datagram(GCONF, 0).1 >> 24, 0x30);
}

/// 4.1.2: the status bits, each by itself.
#[test]
fn the_status_byte_is_latched_at_the_end_of_the_access_before() {
    let mut rig = Rig { chip: Tmc5160::new(RESPONSE, 0), stage: Stage::default(), now: 0 };
    rig.chip.set_external_clock(Some(HZ));
    // Reset flag, standstill, velocity and position reached.
    assert_eq!(rig.status(), 0b0011_1001);
    rig.write(GSTAT, 1);
    assert_eq!(rig.status(), 0b0011_1000);
    rig.write(XTARGET, 1_000_000);
    assert_eq!(rig.status(), 0b0001_1000, "VMAX is 0 and so is VACTUAL");
    rig.write(VMAX, 1_000);
    assert_eq!(rig.status(), 0b0000_1000);
    rig.stage.left = Some(0);
    rig.sense();
    // What happens after an access shows in the one after the next.
    assert_eq!(rig.datagram(GCONF, 0).0, 0b0000_1000);
    assert_eq!(rig.datagram(GCONF, 0).0, 0b0100_1000);
    rig.stage.left = None;
    rig.stage.right = Some(0);
    rig.sense();
    assert_eq!(rig.status(), 0b1000_1000);
}

/// 4.3: 4 MHz with the internal clock, 8 MHz with an external one of 16 MHz; CSN high for two of its periods and 10 ns.
#[test]
fn a_clock_or_a_select_that_is_too_fast_is_refused() {
    for (external, fastest) in [(None, 250), (Some(HZ), 125)] {
        for (bit, taken) in [(fastest, true), (fastest - 1, false)] {
            let mut rig = Rig::new();
            rig.chip.set_external_clock(external);
            rig.run(MICROSECOND);
            rig.chip.select(rig.now);
            rig.run(10);
            for byte in [0xA4, 0, 0, 0, 7] {
                rig.run(8 * bit);
                rig.chip.byte(byte);
            }
            rig.run(10);
            rig.chip.deselect(rig.now);
            assert_eq!(rig.chip.register(A1) == 7, taken, "{bit} ns");
            assert_eq!(rig.chip.refused(), (!taken).then_some(Refusal::Clock), "{bit} ns");
        }
    }
    for (high, taken) in [(135, true), (134, false)] {
        let mut rig = Rig::new();
        assert_eq!(rig.chip.select_high(), 135);
        rig.datagram(GCONF, 0);
        rig.run(high);
        rig.chip.select(rig.now);
        for byte in [0xA4, 0, 0, 0, 7] {
            rig.run(1_600);
            rig.chip.byte(byte);
        }
        rig.run(100);
        rig.chip.deselect(rig.now);
        assert_eq!(rig.chip.register(A1) == 7, taken, "{high} ns");
        assert_eq!(rig.chip.refused(), (!taken).then_some(Refusal::Select), "{high} ns");
    }
}

/// Table A: what can be read back, how wide registers are, and what they have at power-on.
#[test]
fn registers_have_their_reset_values_and_widths() {
    let mut rig = Rig { chip: Tmc5160::new(RESPONSE, 0), stage: Stage::default(), now: 0 };
    rig.chip.set_external_clock(Some(HZ));
    // Addresses that are read, with their contents upon reset.
    let readable = [
        (GCONF, 8),
        (GSTAT, 1),
        (IOIN, 0x3000_0010),
        (OTP_READ, 0x10),
        (FACTORY_CONF, 0x10),
        (TSTEP, 0xF_FFFF),
        // Position and velocity reached, rest, event_pos_reached.
        (RAMP_STAT, 0x780),
        (MSCURACT, 247 << 16),
        (CHOPCONF, 0x1041_0150),
        (DRV_STATUS, 1 << 31),
        (PWM_AUTO, 30),
    ];
    for address in 0..0x80 {
        let expected = readable.iter().find(|(readable, _)| *readable == address).map_or(0, |(_, value)| *value);
        assert_eq!(rig.read(address), expected, "{address:#x}");
    }
    let kept = [
        (SHORT_CONF, 0x1_0606),
        (DRV_CONF, 0x8_0400),
        (TPOWERDOWN, 10),
        (VSTOP, 1),
        (ENC_CONST, 0x1_0000),
        (0x60, 0xAAAA_B554),
        (0x61, 0x4A95_54AA),
        (0x62, 0x2449_2929),
        (0x63, 0x1010_4222),
        (0x64, 0xFBFF_FFFF),
        (0x65, 0xB5BB_777D),
        (0x66, 0x4929_5556),
        (0x67, 0x0040_4222),
        (MSLUTSEL, 0xFFFF_8056),
        (MSLUTSTART, 0x00F7_0000),
        (PWMCONF, 0xC40C_001E),
    ];
    assert!(kept.iter().all(|&(address, value)| rig.chip.register(address) == value));
    let widths = [
        (GCONF, 18),
        (GLOBALSCALER, 8),
        (TPWMTHRS, 20),
        (TCOOLTHRS, 20),
        (THIGH, 20),
        (RAMPMODE, 2),
        (VSTART, 18),
        (A1, 16),
        (V1, 20),
        (AMAX, 16),
        (VMAX, 23),
        (DMAX, 16),
        (D1, 16),
        (VSTOP, 18),
        (TZEROWAIT, 16),
        (XTARGET, 32),
        (SW_MODE, 12),
        (ENCMODE, 11),
        (ENC_CONST, 32),
        (ENC_DEVIATION, 20),
        (COOLCONF, 25),
    ];
    for (address, bits) in widths {
        let mut rig = Rig::new();
        rig.write(address, u32::MAX);
        assert_eq!(rig.chip.register(address), (((1_u64 << bits) - 1) as u32), "{address:#x}");
    }
    // VDCMIN: only bits 22..8 are used.
    rig.write(VDCMIN, u32::MAX);
    assert_eq!(rig.chip.register(VDCMIN), 0x7F_FF00);
}

/// 23.1: the datagrams of the initialisation examples.
#[test]
fn examples_of_23_1_set_the_registers_that_they_name() {
    let mut rig = Rig::new();
    for bytes in [
        [0xEC, 0x00, 0x01, 0x00, 0xC3],
        [0x90, 0x00, 0x06, 0x1F, 0x0A],
        [0x91, 0x00, 0x00, 0x00, 0x0A],
        [0x80, 0x00, 0x00, 0x00, 0x04],
        [0x93, 0x00, 0x00, 0x01, 0xF4],
    ] {
        rig.transfer(bytes);
    }
    assert_eq!((rig.chip.register(CHOPCONF), rig.chip.register(TPWMTHRS)), (0x1_00C3, 500));
    assert_eq!((rig.read(GCONF), rig.read(DRV_STATUS) >> 14 & 1), (4, 1), "stealthChop");
    for bytes in [
        [0xA4, 0x00, 0x00, 0x03, 0xE8],
        [0xA5, 0x00, 0x00, 0xC3, 0x50],
        [0xA6, 0x00, 0x00, 0x01, 0xF4],
        [0xA7, 0x00, 0x03, 0x0D, 0x40],
        [0xA8, 0x00, 0x00, 0x02, 0xBC],
        [0xAA, 0x00, 0x00, 0x05, 0x78],
        [0xAB, 0x00, 0x00, 0x00, 0x0A],
        [0xA0, 0x00, 0x00, 0x00, 0x00],
        [0xAD, 0xFF, 0xFF, 0x38, 0x00],
    ] {
        rig.transfer(bytes);
    }
    rig.settle();
    assert_eq!(rig.read(XACTUAL).cast_signed(), -51_200);
    assert_eq!(rig.stage.field, -51_200);
}
