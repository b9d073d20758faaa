//! All registers of a chip that parameters make, as whole words. After each setting those that it is for are as the
//! TMC5160 datasheet has it (chapters 5, 6 and 12), and all others are what they were.

use super::bench;
use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

const GCONF: u8 = 0x00;
const IHOLD_IRUN: u8 = 0x10;
const TPOWERDOWN: u8 = 0x11;
const TPWMTHRS: u8 = 0x13;
const TCOOLTHRS: u8 = 0x14;
const THIGH: u8 = 0x15;
const VSTART: u8 = 0x23;
const A1: u8 = 0x24;
const V1: u8 = 0x25;
const AMAX: u8 = 0x26;
const VMAX: u8 = 0x27;
const DMAX: u8 = 0x28;
const D1: u8 = 0x2A;
const VSTOP: u8 = 0x2B;
const TZEROWAIT: u8 = 0x2C;
const VDCMIN: u8 = 0x33;
const SW_MODE: u8 = 0x34;
const ENCMODE: u8 = 0x38;
const ENC_CONST: u8 = 0x3A;
const ENC_DEVIATION: u8 = 0x3D;
const CHOPCONF: u8 = 0x6C;
const COOLCONF: u8 = 0x6D;
const DCCTRL: u8 = 0x6E;
const PWMCONF: u8 = 0x70;

/// The registers that the defaults of the parameters make. Of speeds and accelerations in pps the units of registers
/// are 2^24 / 16e6 and 2^41 / 16e6^2: 51 200 are 53 687.09 and 439.80. VSTART is at least 1.
const DEFAULTS: [(u8, u32); 24] = [
    // multistep_filt.
    (GCONF, 0x8),
    // 7 << 16 | 128 / 8 << 8 | 8 / 8.
    (IHOLD_IRUN, 0x7_1001),
    // 2 s are 122.07 times 2^18 clocks.
    (TPOWERDOWN, 122),
    (TPWMTHRS, 0),
    (TCOOLTHRS, 0),
    (THIGH, 0),
    (VSTART, 1),
    (A1, 440),
    (V1, 0),
    (AMAX, 440),
    (VMAX, 53_687),
    (DMAX, 440),
    (D1, 440),
    (VSTOP, 5),
    (TZEROWAIT, 0),
    (VDCMIN, 0),
    // Both switches stop the motor, both latch where they close, and the encoder is latched as well.
    (SW_MODE, 0x2A3),
    (ENCMODE, 0),
    (ENC_CONST, 0),
    (ENC_DEVIATION, 0),
    // tpfd 4, tbl 2, hend 2, hstrt 3, toff 5.
    (CHOPCONF, 0x41_0135),
    // sfilt, sgt 5.
    (COOLCONF, 0x105_0000),
    (DCCTRL, 0),
    // pwm_lim 12, pwm_reg 4, pwm_autograd and pwm_autoscale, pwm_freq 1, pwm_ofs 200.
    (PWMCONF, 0xC40D_00C8),
];

/// After these settings of axis 1, of a motor that stands, its registers are the defaults but for these.
fn expect(settings: &[(u8, i32)], changed: &[(u8, u32)]) {
    let mut bench = bench();
    bench.run(5 * SECOND);
    for (number, value) in settings {
        bench.ok(&format!("SAP {number}, 1, {value}"));
    }
    // What waits for the next poll is in the registers then, too.
    bench.run(20 * MILLISECOND);
    let registers = |bench: &Bench, axis| {
        DEFAULTS.map(|(address, _)| (address, bench.module.board().borrow().tmc5160(axis).register(address)))
    };
    let expected = DEFAULTS.map(|row| *changed.iter().find(|(address, _)| *address == row.0).unwrap_or(&row));
    let differing: Vec<_> = registers(&bench, 1).into_iter().zip(expected).filter(|(is, shall)| is != shall).collect();
    assert!(differing.is_empty(), "{settings:?}: register {differing:x?}");
    assert_eq!([registers(&bench, 0), registers(&bench, 2)], [DEFAULTS; 2], "{settings:?} are for axis 1 alone");
}

#[test]
fn the_defaults_of_the_parameters_are_in_the_registers() {
    expect(&[], &[]);
}

/// Currents are in 1/32, less one.
#[test]
fn currents_are_in_their_fields() {
    expect(&[(6, 255)], &[(IHOLD_IRUN, 0x7_1F01)]);
    expect(&[(6, 7), (7, 255)], &[(IHOLD_IRUN, 0x7_001F)]);
    expect(&[(31, 15)], &[(IHOLD_IRUN, 0xF_1001)]);
    expect(&[(31, 0)], &[(IHOLD_IRUN, 0x1001)]);
    // 16.384 ms each, to the nearest: 80 ms are 4.88, 90 ms 5.49 and 100 ms 6.10.
    for (delay, units) in [(0, 0), (1, 1), (8, 5), (9, 5), (10, 6), (417, 255)] {
        expect(&[(214, delay)], &[(TPOWERDOWN, units)]);
    }
}

/// Thresholds are clocks in 1/256 of a full step. At 10 000 pps they are 16e6 / 10 000 = 1600, and with 16 microsteps
/// in a full step a sixteenth of that. They have 20 bits. The motor passes TCOOLTHRS when its period is less than 15/16
/// of it, less 1: 1709 is the least threshold that a period of 1600 passes, as 1601.19. VDCMIN is a speed of the ramp
/// generator, of which the chip keeps no bits below 2^8.
#[test]
fn thresholds_are_clocks_in_a_microstep() {
    const LONGEST: u32 = 0xF_FFFF;
    // The coarsest microsteps are in CHOPCONF as well: mres 4.
    let sixteen = (CHOPCONF, 0x441_0135);
    for (number, register) in [(186, TPWMTHRS), (22, THIGH)] {
        expect(&[(number, 10_000)], &[(register, 1_600)]);
        expect(&[(number, 10_000), (140, 4)], &[(register, 100), sixteen]);
        expect(&[(number, 1)], &[(register, LONGEST)]);
    }
    expect(&[(181, 10_000)], &[(TCOOLTHRS, 1_709)]);
    expect(&[(181, 10_000), (140, 4)], &[(TCOOLTHRS, 109), sixteen]);
    expect(&[(181, 1)], &[(TCOOLTHRS, LONGEST)]);
    expect(&[(181, 16)], &[(TCOOLTHRS, LONGEST)]);
    // 16e6 / 17 = 941 176, and 16/15 of that are 1 003 921.
    expect(&[(181, 17)], &[(TCOOLTHRS, 1_003_924)]);
    // coolStep works from 0 on; a motor that stands is not as fast as any other speed.
    expect(&[(172, 4)], &[(TCOOLTHRS, LONGEST), (COOLCONF, 0x105_0004)]);
    expect(&[(172, 4), (182, 5_000)], &[(TCOOLTHRS, 3_416)]);
    expect(&[(172, 4), (182, 5_000), (181, 10_000)], &[(TCOOLTHRS, 3_416)]);
    expect(&[(172, 4), (182, 10_000), (181, 5_000)], &[(TCOOLTHRS, 3_416)]);
    expect(&[(182, 5_000), (181, 10_000)], &[(TCOOLTHRS, 1_709)]);
    expect(&[(23, 10_000)], &[(VDCMIN, 10_486 & !0xFF)]);
}

#[test]
fn fields_of_the_driver_are_those_of_the_parameters() {
    expect(&[(251, 1)], &[(GCONF, 0x18)]);
    expect(&[(167, 15), (166, 0), (165, 15), (162, 0)], &[(CHOPCONF, 0x40_078F)]);
    expect(&[(164, 1)], &[(CHOPCONF, 0x41_1135)]);
    expect(&[(28, 1), (27, 1)], &[(CHOPCONF, 0x4D_0135)]);
    expect(&[(177, 1)], &[(CHOPCONF, 0xC041_0135)]);
    expect(&[(140, 0)], &[(CHOPCONF, 0x841_0135)]);
    // chm, tfd in two places, offset.
    expect(&[(163, 1)], &[(CHOPCONF, 0x41_41A5)]);
    expect(&[(163, 1), (165, 13), (166, 8)], &[(CHOPCONF, 0x41_4C55)]);
    expect(&[(172, 15), (171, 3), (170, 15), (169, 3), (168, 1)], &[(COOLCONF, 0x105_EF6F), (TCOOLTHRS, 0xF_FFFF)]);
    expect(&[(174, -64), (173, 0)], &[(COOLCONF, 0x40_0000)]);
    expect(&[(174, -1)], &[(COOLCONF, 0x17F_0000)]);
    expect(&[(32, 1_023)], &[(DCCTRL, 1_023)]);
    expect(&[(33, 255)], &[(DCCTRL, 0xFF_0000)]);
    expect(&[(188, 255), (187, 15)], &[(PWMCONF, 0xC40D_0FFF)]);
    expect(&[(188, 0), (191, 3)], &[(PWMCONF, 0xC40F_0000)]);
    expect(&[(192, 0), (204, 3)], &[(PWMCONF, 0xC431_00C8)]);
    // stealthChop needs a threshold and a gradient.
    let gradient = (PWMCONF, 0xC40D_01C8);
    expect(&[(186, 10_000), (187, 1)], &[(GCONF, 0xC), (TPWMTHRS, 1_600), gradient]);
    expect(&[(187, 1)], &[gradient]);
}

#[test]
fn switches_do_what_the_parameters_say() {
    for (number, word) in [(12, 0x2A1), (13, 0x2A2), (14, 0x2B3), (24, 0x2AB), (25, 0x2A7), (26, 0xAA3)] {
        expect(&[(number, 1)], &[(SW_MODE, word)]);
    }
}

/// Registers of speeds end at 2^18 - 1, 2^20 - 1 and 2^23 - 512; those of accelerations at 65 535, and they are not 0.
/// The stop velocity is not 0, nor is it below the start velocity.
#[test]
fn ramps_are_in_the_units_of_the_registers() {
    expect(&[(4, 7_999_774)], &[(VMAX, 8_388_096)]);
    expect(&[(4, 7_999_774), (19, 249_999)], &[(VMAX, 8_388_096), (VSTART, 262_143), (VSTOP, 262_143)]);
    expect(&[(20, 249_999)], &[(VSTOP, 262_143)]);
    expect(&[(19, 1_000), (20, 500)], &[(VSTART, 1_049), (VSTOP, 1_049)]);
    expect(&[(19, 1_000), (20, 1_500)], &[(VSTART, 1_049), (VSTOP, 1_573)]);
    expect(&[(20, 0)], &[(VSTOP, 1)]);
    expect(&[(4, 0), (20, 0)], &[(VMAX, 0), (VSTART, 0), (VSTOP, 1)]);
    expect(&[(4, 100), (19, 1_000)], &[(VMAX, 105), (VSTART, 105), (VSTOP, 105)]);
    expect(&[(16, 30_000)], &[(V1, 31_457)]);
    expect(&[(16, 1_000_000)], &[(V1, 1_048_575)]);
    for (number, register) in [(5, AMAX), (15, A1), (17, DMAX), (18, D1)] {
        for (acceleration, word) in [(0, 1), (1, 1), (175, 2), (1_000_000, 8_590), (7_629_278, 65_535)] {
            expect(&[(number, acceleration)], &[(register, word)]);
        }
    }
    expect(&[(21, 65_535)], &[(TZEROWAIT, 65_535)]);
    // In the unit of the registers.
    let all = [(AMAX, 51_200), (A1, 51_200), (DMAX, 51_200), (D1, 51_200), (VMAX, 51_200)];
    expect(&[(255, 0)], &all);
    // 50 000 in the register are 47 683 pps, at which 16e6 / 47 683 = 335 clocks are 1/256 of a full step.
    expect(
        &[(255, 0), (22, 50_000), (23, 50_000)],
        &[all.as_slice(), &[(THIGH, 335), (VDCMIN, 50_000 & !0xFF)]].concat(),
    );
}

/// The microsteps in a count of the encoder, in 1/65 536, or in 1/10 000 where that alone is exact (bit 10 of ENCMODE).
/// For example, 51 200 in a turn of 4 000 counts are 12.8. With the shaft reversed it is the negative; in decimal mode
/// -12.8 is -13 and 2 000.
#[test]
fn the_scale_of_the_encoder_is_exact_where_it_can_be() {
    const DECIMAL: u32 = 0x400;
    for (steps, resolution, counts, mode, scale, negated) in [
        (200, 8, 4_000, DECIMAL, 12 << 16 | 8_000, 0xFFF3_0000 | 2_000),
        // 50 and 12.5 are exact both ways.
        (200, 8, 1_024, 0, 50 << 16, 0xFFCE_0000),
        (200, 8, 4_096, 0, 0xC_8000, 0xFFF3_8000),
        // 17 1/15 is exact in none.
        (200, 8, 3_000, 0, 0x11_1111, 0xFFEE_EEEF),
        // 1/10, and 1.0001.
        (1, 0, 10, DECIMAL, 1_000, 0xFFFF_0000 | 9_000),
        (10_001, 0, 10_000, DECIMAL, 1 << 16 | 1, 0xFFFE_0000 | 9_999),
        // There is no more than 32 767.99998, also where a fraction of 1/10 000 would be exact.
        (65_535, 8, 1, 0, 0x7FFF_FFFF, 0x8000_0001),
        (65_535, 8, 250, 0, 0x7FFF_FFFF, 0x8000_0001),
        (200, 8, 0, 0, 0, 0),
    ] {
        let settings = [(202, steps), (140, resolution), (210, counts), (251, 0)];
        let microsteps = (CHOPCONF, 0x41_0135 | (8 - resolution as u32) << 24);
        let both = [microsteps, (ENCMODE, mode), (ENC_CONST, scale)];
        expect(&settings, &both);
        let reversed = [microsteps, (ENCMODE, mode), (ENC_CONST, negated), (GCONF, 0x18)];
        expect(&[settings.as_slice(), &[(251, 1)]].concat(), &reversed);
    }
    expect(&[(201, 0x155)], &[(ENCMODE, 0x155)]);
    expect(&[(201, 65_535)], &[(ENCMODE, 0x3FF)]);
    expect(&[(212, 65_535)], &[(ENC_DEVIATION, 65_535)]);
}
