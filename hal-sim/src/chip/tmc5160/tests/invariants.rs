//! Invariants, which hold whatever happens: time in pieces, next events, any contents.

use super::*;

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// A motor with switches, encoder and load, with good and bad parameters, and registers rewritten in motion; time goes
/// on in pieces that `cut` chooses. Gives the turns of the field and what the registers read at the end.
fn scenario(seed: u64, mut cut: impl FnMut(&mut Rig, Nanos)) -> (Vec<(Nanos, i64)>, Vec<u32>) {
    let mut random = Random(seed);
    let mut rig = Rig::with(&[(COOLCONF, 13 << 16 | 1), (ENC_DEVIATION, 5_000), (TCOOLTHRS, 3_000)]);
    rig.stage.left = Some(-20_000);
    rig.stage.right = Some(20_000);
    rig.stage.units_per_count = 64;
    rig.stage.counts_per_turn = 40;
    for _ in 0..60 {
        for _ in 0..random.below(5) {
            let (register, limit) = [
                (XTARGET, 60_000),
                (RAMPMODE, 4),
                (VMAX, 300_000),
                (AMAX, 20_000),
                (DMAX, 20_000),
                (A1, 20_000),
                (D1, 20_000),
                (V1, 100_000),
                (VSTART, 3_000),
                (VSTOP, 3_000),
                (TZEROWAIT, 300),
                (SW_MODE, 1 << 12),
                (ENCMODE, 1 << 11),
                (XACTUAL, 60_000),
                (RAMP_STAT, 1 << 14),
                (GCONF, 32),
            ][random.below(16) as usize];
            let data = random.below(limit) as u32;
            let signed = matches!(register, XTARGET | XACTUAL);
            rig.write(register, if signed { data.wrapping_sub(30_000) } else { data });
        }
        rig.stage.load = random.below(70_000) as LoadRatio;
        let span = random.below(50_000_000);
        cut(&mut rig, span);
    }
    let seen = seen(&mut rig);
    (std::mem::take(&mut rig.stage.turns), seen)
}

/// Reads what can be seen of the chip, now.
fn seen(rig: &mut Rig) -> Vec<u32> {
    let registers = [
        XACTUAL, VACTUAL, XTARGET, RAMP_STAT, XLATCH, X_ENC, ENC_STATUS, ENC_LATCH, MSCNT, MSCURACT, DRV_STATUS, GSTAT,
    ];
    registers.map(|register| rig.chip.read(register)).to_vec()
}

/// The same turns; shows the first difference only.
fn assert_same(seed: u64, one: &[(Nanos, i64)], other: &[(Nanos, i64)]) {
    let difference = one.iter().zip(other).enumerate().find(|(_, (a, b))| a != b);
    assert_eq!((one.len(), difference), (other.len(), None), "seed {seed}");
}

#[test]
fn pieces_of_time_do_not_matter() {
    let mut steps = 0;
    for seed in 0..20 {
        let whole = scenario(seed, Rig::run);
        let mut random = Random(seed + 1000);
        let cut = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while rig.now < end {
                let limit = if random.below(2) == 0 { 3_000 } else { 3_000_000 };
                let piece = (1 + random.below(limit)).min(end - rig.now);
                rig.run(piece);
            }
        });
        assert_same(seed, &whole.0, &cut.0);
        assert_eq!(whole.1, cut.1, "seed {seed}");
        steps += whole.0.len();
    }
    assert!(steps > 100_000, "{steps}");
}

/// Where the motor need not be told of each step, the chip tells it of a few, and is in the same state at any time.
#[test]
fn steps_that_nobody_is_told_of_do_not_matter() {
    let (mut told, mut skipped) = (0, 0);
    for seed in 0..20 {
        let states = |skips| {
            let mut states = Vec::new();
            let (turns, last) = scenario(seed, |rig, span| {
                rig.stage.skips = skips;
                for _ in 0..10 {
                    rig.run(span / 10);
                    states.push((seen(rig), rig.stage.field, rig.stage.current, rig.chip.read(TSTEP)));
                }
            });
            (turns.len(), states, last)
        };
        let (one, other) = (states(false), states(true));
        assert_eq!((one.1, one.2), (other.1, other.2), "seed {seed}");
        told += one.0;
        skipped += other.0;
    }
    assert!(skipped < told * 2 / 3, "{skipped} of {told}");
}

/// Rewriting a register with its own contents makes the ramp generator look anew, so that no step is passed over as
/// free of consequences.
#[test]
fn looking_at_each_tick_is_the_same() {
    for seed in 0..6 {
        let jumping = scenario(seed, Rig::run);
        let looking = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while rig.now < end {
                rig.run(TICK.min(end - rig.now));
                let clock = rig.chip.present();
                rig.chip.ramp.set(&rig.chip.registers, false, clock);
                rig.chip.reschedule();
            }
        });
        assert_same(seed, &jumping.0, &looking.0);
    }
}

#[test]
fn next_event_is_never_late() {
    for seed in 0..10 {
        let whole = scenario(seed, Rig::run);
        let watched = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while let Some(next) = rig.chip.next_event().filter(|next| *next <= end) {
                assert!(next > rig.now);
                let before = seen(rig);
                rig.run(next - 1 - rig.now);
                assert_eq!(before, seen(rig), "seed {seed}");
                rig.run(1);
            }
            rig.run(end - rig.now);
        });
        assert_same(seed, &whole.0, &watched.0);
    }
}

/// Overflow checks are on in tests.
#[test]
fn any_contents_are_survived() {
    let mut random = Random(7);
    for hz in [None, Some(8_000_000), Some(16_000_000), Some(17_999_999)] {
        let mut rig = Rig::new();
        rig.chip.set_external_clock(hz);
        rig.stage.units_per_count = 3;
        rig.stage.counts_per_turn = 400;
        for _ in 0..3_000 {
            rig.chip.write(random.below(128) as u8, (random.below(1 << 32)) as u32 >> random.below(32));
            if random.below(4) == 0 {
                rig.stage.slipped += random.below(200) as i64 - 100;
                rig.stage.left = (random.below(2) == 0).then_some(rig.stage.field);
                rig.stage.right = (random.below(2) == 0).then_some(rig.stage.field);
                rig.sense();
            }
            rig.stage.turns.clear();
            rig.stage.load = random.below(100_000) as LoadRatio;
            assert!(rig.chip.next_event().is_none_or(|next| next > rig.now));
            let scale = random.below(24);
            rig.run(random.below(1 << scale));
            rig.chip.read(random.below(128) as u8);
        }
    }
}

/// A chip at rest has nothing to do, and one that cruises is looked at for its steps only.
#[test]
fn rest_costs_nothing() {
    let mut rig = Rig::with(&[(AMAX, 5_000), (DMAX, 5_000), (D1, 5_000), (VMAX, 100_000), (XTARGET, 50_000)]);
    rig.settle();
    rig.run(SECOND);
    assert_eq!(rig.chip.next_event(), None);
    // A motor that a switch, a stall or VMAX = 0 holds waits for no time.
    rig.write(VMAX, 0);
    rig.write(XTARGET, 0);
    assert_eq!(rig.chip.next_event(), None);
    rig.write(VMAX, 1_000);
    rig.run(SECOND);
    // 953.67 Hz, so steps are 1.048576 ms apart, give or take a clock of 62.5 ns.
    let next = rig.chip.next_event().unwrap();
    rig.run(next - rig.now);
    let after = rig.chip.next_event().unwrap();
    assert!((1_048_562..=1_048_626).contains(&(after - next)));
}

/// Any ramp with VSTOP >= VSTART, as 12.2.1 has it, takes the motor to its target without a step back. Near the target
/// the motor is no faster than a motor that brakes from there to VSTOP. That is v^2 = VSTOP^2 + 2 d s, and what a tick
/// more makes of it.
#[test]
fn any_ramp_arrives_without_overshoot() {
    let mut random = Random(3);
    for _ in 0..400 {
        let mut below = |limit: u64| random.below(limit) as u32;
        let vstop = 1 + below(20_000);
        let [a1, amax, dmax, d1] = [0; 4].map(|_: u32| 100 + below(65_000) / (1 + below(100)));
        let ramp = [
            (VSTOP, vstop),
            (VSTART, below(u64::from(vstop))),
            (V1, below(200_000) / (1 + below(10)) * below(2)),
            (VMAX, 1_000 + below(2_000_000) / (1 + below(50))),
            (A1, a1),
            (AMAX, amax),
            (DMAX, dmax),
            (D1, d1),
        ];
        let way = 1 + below(20_000) / (1 + below(100));
        let mut rig = Rig::with(&ramp);
        rig.write(XTARGET, way.wrapping_neg());
        rig.settle();
        assert_eq!((rig.position(), rig.stage.turns.len()), (-way.cast_signed(), way as usize), "{ramp:?}");
        let (slowest, vstop) = (hertz_per_second(dmax.max(d1)), hertz(vstop));
        let end = rig.stage.turns.len() - 1;
        for steps in [1, 2, 5, 20, 100, 1_000].into_iter().filter(|steps| *steps <= end) {
            let took = (rig.stage.turns[end].0 - rig.stage.turns[end - steps].0) as f64 / 1e9;
            let top = (vstop * vstop + 2.0 * slowest * steps as f64).sqrt() + slowest * 64e-6;
            // Steps come at whole clocks of 62.5 ns.
            assert!(steps as f64 / (took + 125e-9) <= top, "{steps} steps in {took} s, {ramp:?}");
        }
    }
}
