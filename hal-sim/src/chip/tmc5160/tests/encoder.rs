//! The ABN encoder interface (chapter 20, 6.4).

use super::*;

/// Bits of ENCMODE.
const POL_A: u32 = 1;
const POL_B: u32 = 1 << 1;
const POL_N: u32 = 1 << 2;
const IGNORE_AB: u32 = 1 << 3;
const CLR_CONT: u32 = 1 << 4;
const CLR_ONCE: u32 = 1 << 5;
const POS_EDGE: u32 = 1 << 6;
const NEG_EDGE: u32 = 1 << 7;
const CLR_ENC_X: u32 = 1 << 8;
const LATCH_X_ACT: u32 = 1 << 9;
const DECIMAL: u32 = 1 << 10;

/// A chip with an encoder of 40 counts a turn, which stands at a count.
fn at(count: i64, mode: u32) -> Rig {
    let mut rig = Rig::new();
    rig.stage.counts_per_turn = 40;
    rig.stage.slipped = count;
    rig.chip.plug_encoder(count, rig.stage.tracks(count));
    rig.write(ENCMODE, mode);
    rig
}

impl Rig {
    /// The encoder turns to a count, the motor stands.
    fn turn_encoder(&mut self, count: i64) {
        self.stage.slipped = count;
        self.sense();
    }

    fn encoder(&mut self) -> i32 {
        self.read(X_ENC).cast_signed()
    }
}

/// Checks that X_ENC after each of `counts` edges, in both directions, is `factor` times their number, rounded down.
fn counts_by(constant: u32, decimal: bool, factor: f64) {
    let mut rig = at(0, if decimal { DECIMAL } else { 0 });
    rig.write(ENC_CONST, constant);
    for count in [1, 2, 3, 100, 4_999, 5_000, 0, -1, -2, -3, -10_000] {
        rig.turn_encoder(count);
        let expected = (factor * count as f64 + 1e-6).floor();
        assert_eq!(f64::from(rig.encoder()), expected, "{count} counts of {factor}");
    }
}

/// Page 107: "Encoder factor of 1.0: ENC_CONST = 0x0001.0x0000", which is the reset value.
#[test]
fn example_of_20_factor_1() {
    counts_by(0x0001_0000, false, 1.0);
    let mut rig = at(7, 0);
    rig.turn_encoder(12);
    assert_eq!(rig.encoder(), 5);
}

/// Page 107: "Encoder factor of -1.0: ENC_CONST = 0xFFFF.0x0000".
#[test]
fn example_of_20_factor_minus_1() {
    counts_by(0xFFFF_0000, false, -1.0);
}

/// Page 107: "Decimal mode encoder factor 25.6: 00025.6000 = 0x0019.0x1770".
#[test]
fn example_of_20_decimal_factor_25_6() {
    counts_by(0x0019_1770, true, 25.6);
}

/// Page 108: "Decimal mode encoder factor -25.6: 0xFFE6.4000 = 0xFFE6.0x0FA0".
#[test]
fn example_of_20_decimal_factor_minus_25_6() {
    counts_by(0xFFE6_0FA0, true, -25.6);
}

/// Page 108, table of 20.2: a turn of an encoder of so many counts is 51 200 microsteps, exactly where the table says
/// so. The factors are those of the table.
#[test]
fn examples_of_20_2_a_turn_of_the_encoder_is_one_of_the_motor() {
    for (resolution, constant, decimal, exact) in [
        (200, 256 << 16, false, true),
        (360, 142 << 16 | 14_563, false, false),
        (360, 142 << 16 | 2_222, true, false),
        (500, 102 << 16 | 26_214, false, false),
        (500, 102 << 16 | 4_000, true, true),
        (1_000, 51 << 16 | 2_000, true, true),
        (1_024, 50 << 16, false, true),
        (4_000, 12 << 16 | 8_000, true, true),
        (4_096, 12 << 16 | 32_768, false, true),
        (16_384, 3 << 16 | 8_192, false, true),
    ] {
        for sign in [1, -1] {
            let mut rig = at(0, if decimal { DECIMAL } else { 0 });
            rig.write(ENC_CONST, constant);
            rig.turn_encoder(10 * sign * resolution);
            let apart = i64::from(rig.encoder()) - 512_000 * sign;
            // What is missing is behind the point, and cut off on the way up.
            assert_eq!(apart == 0, exact || sign < 0, "{resolution}: {apart}");
            assert!(apart.abs() <= 1, "{resolution}: {apart}");
        }
    }
}

/// Page 108: "51.2 in decimal mode: ENC_CONST = 51 * 2^16 + 0.2 * 10000".
#[test]
fn example_of_20_2_decimal_factor_51_2() {
    counts_by(51 * 65_536 + 2_000, true, 51.2);
}

/// The counter follows a motor that moves, and wraps around.
#[test]
fn the_counter_follows_the_rotor() {
    let mut rig = Rig::with(&[(AMAX, 5_000), (DMAX, 5_000), (D1, 5_000), (VMAX, 100_000), (ENC_CONST, 50 << 16)]);
    rig.stage.units_per_count = 50;
    rig.write(X_ENC, i32::MAX as u32);
    rig.write(XTARGET, 5_000);
    rig.settle();
    assert_eq!(rig.encoder(), i32::MAX.wrapping_add(5_000));
    rig.write(XTARGET, 0);
    rig.settle();
    assert_eq!(rig.encoder(), i32::MAX);
}

/// The counts at which an N event is seen on the way from -50 to 50 and back. The null track is high for each count
/// that is a multiple of 40.
fn events(mode: u32) -> Vec<i64> {
    let mut rig = at(-50, mode | CLR_CONT);
    let mut seen = Vec::new();
    for count in (-49..=50).chain((-50..50).rev()) {
        rig.turn_encoder(count);
        if rig.read(ENC_STATUS) & 1 != 0 {
            seen.push(count);
            rig.write(ENC_STATUS, 1);
            assert_eq!(rig.read(ENC_STATUS), 0);
        }
    }
    seen
}

/// 6.4.1: level, active going, inactive going, both edges, with and without A and B.
#[test]
fn n_events_come_as_the_mode_says() {
    let high = POL_N | IGNORE_AB;
    assert_eq!(events(high), [-40, 0, 40, 40, 0, -40]);
    assert_eq!(events(high | POS_EDGE), [-40, 0, 40, 40, 0, -40]);
    assert_eq!(events(high | NEG_EDGE), [-39, 1, 41, 39, -1, -41]);
    assert_eq!(events(high | POS_EDGE | NEG_EDGE), [-40, -39, 0, 1, 40, 41, 40, 39, 0, -1, -40, -41]);
    // Low active: what was the end of the pulse is its beginning.
    assert_eq!(events(IGNORE_AB | POS_EDGE), [-39, 1, 41, 39, -1, -41]);
    // A and B are low where N is high: with another polarity required there is no event.
    assert_eq!(events(POL_N), [-40, 0, 40, 40, 0, -40]);
    for polarity in [POL_A, POL_B, POL_A | POL_B] {
        assert!(events(POL_N | polarity).is_empty());
    }
}

/// 20, "N signal": latch only, latch and clear, always or once, with XACTUAL.
#[test]
fn n_events_latch_and_clear() {
    let edge = POL_N | POS_EDGE | IGNORE_AB;
    let mut rig = at(30, edge | CLR_CONT);
    rig.turn_encoder(90);
    assert_eq!((rig.encoder(), rig.read(ENC_LATCH)), (60, 50), "latched at 80");
    let mut rig = at(30, edge | CLR_CONT | CLR_ENC_X);
    rig.turn_encoder(90);
    assert_eq!((rig.encoder(), rig.read(ENC_LATCH)), (10, 40), "cleared at 40 and 80");
    let mut rig = at(30, edge | CLR_ONCE | CLR_ENC_X);
    rig.turn_encoder(90);
    assert_eq!((rig.encoder(), rig.read(ENC_LATCH)), (50, 10), "cleared at 40 only");
    assert_eq!(rig.read(ENCMODE), edge | CLR_ENC_X, "clr_once is over");
    // The third switch of 12.4: the null track latches XACTUAL.
    let mut rig = at(30, edge | CLR_CONT | LATCH_X_ACT);
    rig.write(RAMPMODE, 3);
    rig.write(XACTUAL, 777);
    rig.turn_encoder(60);
    assert_eq!((rig.read(XLATCH), rig.read(ENC_STATUS)), (777, 1));
    assert!(rig.chip.interrupt_pin());
    // Without clr_cont and clr_once nothing is an event.
    let mut rig = at(30, edge);
    rig.turn_encoder(90);
    assert_eq!((rig.encoder(), rig.read(ENC_LATCH), rig.read(ENC_STATUS)), (60, 0, 0));
}

/// 6.4: the warning comes beyond ENC_DEVIATION, cannot be cleared while it persists, and 0 disables it.
#[test]
fn a_deviation_is_warned_of() {
    let mut rig = at(0, 0);
    rig.write(ENC_DEVIATION, 100);
    for (count, warned) in [(100, 0), (-100, 0), (-101, 2), (0, 2)] {
        rig.turn_encoder(count);
        assert_eq!(rig.read(ENC_STATUS), warned, "{count}");
    }
    assert!(rig.chip.interrupt_pin());
    rig.write(ENC_STATUS, 2);
    assert_eq!(rig.read(ENC_STATUS), 0);
    rig.turn_encoder(200);
    rig.write(ENC_STATUS, 2);
    assert_eq!(rig.read(ENC_STATUS), 2, "it persists");
    rig.write(ENC_DEVIATION, 0);
    rig.write(ENC_STATUS, 2);
    assert_eq!(rig.read(ENC_STATUS), 0);
    // A motor that moves without its encoder.
    let mut rig = Rig::with(&[(AMAX, 5_000), (VMAX, 50_000), (RAMPMODE, 1), (ENC_DEVIATION, 1_000)]);
    rig.until(MICROSECOND, |rig| rig.chip.position() == 1_000);
    assert!(!rig.chip.interrupt_pin());
    rig.until(MICROSECOND, |rig| rig.chip.position() == 1_001);
    assert!(rig.chip.interrupt_pin());
}
