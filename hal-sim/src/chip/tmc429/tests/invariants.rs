//! Invariants, which hold whatever happens: time in pieces, next events, any contents.

use super::*;

struct Random(u64);

impl Random {
    fn below(&mut self, limit: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % limit
    }
}

/// Three motors in different modes with bad and good parameters, registers rewritten in motion; time goes
/// on in pieces that `cut` chooses.
fn scenario(seed: u64, mut cut: impl FnMut(&mut Rig, Nanos)) -> (Vec<(Nanos, usize, bool)>, String) {
    let mut random = Random(seed);
    let mut rig = Rig::new();
    rig.stage.left = Some((-30_000, -3000));
    rig.stage.right = Some((3000, 30_000));
    for _ in 0..60 {
        for motor in 0..3 {
            let base = motor << 5;
            for register in [
                X_TARGET, V_MAX, V_TARGET, A_MAX, PMUL_PDIV, DIVIDERS, MODE, V_ACTUAL, V_MIN, INTERRUPTS, LATCHED,
                TOLERANCE,
            ] {
                if random.below(4) != 0 {
                    continue;
                }
                let data = match register {
                    X_TARGET => random.below(20_000) as u32,
                    DIVIDERS => (random.below(6) << 12 | random.below(9) << 8) as u32,
                    V_MIN => random.below(60) as u32,
                    _ => random.below(1 << 24) as u32,
                };
                rig.write(base | register, data);
            }
        }
        match random.below(6) {
            0 => rig.write(POS_COMP, random.below(20_000) as u32),
            1 => rig.write(POS_COMP_INT, 0x101),
            2 => rig.write(IF_CONF, STEP_DIR | (random.below(4) << 6) as u32),
            3 => rig.write(GLOBAL, (random.below(16) << 8) as u32),
            _ => {}
        }
        let span = random.below(50_000_000);
        cut(&mut rig, span);
    }
    (
        std::mem::take(&mut rig.stage.steps),
        format!(
            "{:?} {:?} {:?}",
            rig.chip.global,
            rig.chip.pulses,
            rig.chip.axes.map(|mut axis| {
                axis.sync(rig.chip.clock.tick_at(rig.now));
                axis
            })
        ),
    )
}

/// The same steps; shows the first difference only.
fn assert_same(seed: u64, one: &[(Nanos, usize, bool)], other: &[(Nanos, usize, bool)]) {
    let difference = one.iter().zip(other).enumerate().find(|(_, (a, b))| a != b);
    assert_eq!((one.len(), difference), (other.len(), None), "seed {seed}");
}

#[test]
fn pieces_of_time_do_not_matter() {
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
        assert!(whole.0.len() > 1000);
    }
}

/// Steps that are made at once leave the chip as if they had been made one by one, and those that are told come at the
/// same times. So it is also when time goes on in pieces.
#[test]
fn steps_may_be_made_at_once() {
    let (mut all, mut untold) = (0, 0);
    for seed in 0..40 {
        let single = scenario(seed, Rig::run);
        let mut random = Random(seed + 2000);
        let many = scenario(seed, |rig, span| {
            rig.stage.skips = true;
            let end = rig.now + span;
            while rig.now < end {
                let piece = (1 + random.below(10_000_000)).min(end - rig.now);
                rig.run(piece);
            }
        });
        all += many.0.len();
        untold += many.0.iter().filter(|(at, ..)| *at == UNTOLD).count();
        for motor in 0..3 {
            let of = |steps: &[(Nanos, usize, bool)]| -> Vec<_> {
                steps.iter().copied().filter(|step| step.1 == motor).collect()
            };
            let (single, mut many) = (of(&single.0), of(&many.0));
            for (at, single) in many.iter_mut().map(|step| &mut step.0).zip(&single) {
                *at = if *at == UNTOLD { single.0 } else { *at };
            }
            assert_same(seed, &single, &many);
        }
        assert_eq!(single.1, many.1, "seed {seed}");
    }
    assert!(untold > all / 10, "{untold} of {all} steps");
}

#[test]
fn a_tick_at_a_time_is_the_same() {
    // Looking at the inputs forces each tick to be executed, so none is skipped as quiet.
    for seed in 0..5 {
        let jumping = scenario(seed, Rig::run);
        let ticking = scenario(seed, |rig, span| {
            let end = rig.now + span;
            while rig.now < end {
                let tick = rig.chip.clock.tick_at(rig.now);
                for axis in &mut rig.chip.axes {
                    axis.inputs_changed(tick);
                }
                rig.chip.reschedule();
                let step = (rig.chip.clock.time_of(tick + 1) - rig.now).min(end - rig.now);
                rig.run(step);
            }
        });
        assert_same(seed, &jumping.0, &ticking.0);
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
                let seen = |rig: &mut Rig| {
                    [X_ACTUAL, V_ACTUAL, V_TARGET, INTERRUPTS, MODE, LATCHED].map(|register| rig.read(register))
                };
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

/// Switches that open and close with the steps.
struct Erratic(u8);

impl StepDir for Erratic {
    fn step(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool) -> u8 {
        self.0 = self.0.wrapping_add(1);
        self.0 / 4
    }

    fn free_steps(&self, _motor: usize, _dir_pin: bool) -> u32 {
        0
    }

    fn skip(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool, _steps: u32) {}
}

#[test]
fn any_contents_are_survived() {
    // Overflow checks are on in tests.
    let mut random = Random(7);
    for hz in [1, 4_000_000, 11_059_200, 16_000_000, 32_000_000] {
        let mut rig = Rig { chip: Tmc429::new(hz), stage: Stage::default(), now: 0 };
        let mut load = Erratic(0);
        for _ in 0..4000 {
            rig.write(random.below(128) as u8 * 2, random.below(1 << 24) as u32);
            if random.below(4) == 0 {
                rig.chip.set_reference_pins(random.below(64) as u8);
            }
            assert!(rig.chip.next_event().is_none_or(|next| next > rig.now));
            let scale = random.below(24);
            rig.now += random.below(1 << scale);
            rig.chip.advance(rig.now, &mut load);
            rig.read(random.below(128) as u8 * 2);
        }
    }
}

/// Counts only.
#[derive(Default)]
struct Counter(u64);

impl StepDir for Counter {
    fn step(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool) -> u8 {
        self.0 += 1;
        0
    }

    fn free_steps(&self, _motor: usize, _dir_pin: bool) -> u32 {
        u32::MAX
    }

    fn skip(&mut self, _at: Nanos, _motor: usize, _dir_pin: bool, steps: u32) {
        self.0 += u64::from(steps);
    }
}

/// Through a long stretch at one go the chip makes the steps of the datasheet's formulas (8.1.13).
#[test]
fn long_stretches_have_the_steps_of_the_formulas() {
    let steps_in = |rig: &mut Rig, seconds: Nanos| {
        let mut load = Counter::default();
        rig.now += seconds * SECOND;
        rig.chip.advance(rig.now, &mut load);
        i64::try_from(load.0).unwrap()
    };
    let near = |steps: i64, expected: i64, tolerance: i64| {
        assert!((steps - expected).abs() <= tolerance, "{steps} steps, not {expected}");
    };
    // 499 755.859 Hz for a minute; 512 us of ramp cost half of the steps that they would have had.
    let mut rig = Rig::with(VELOCITY, 0, 0, 2047);
    rig.write(V_TARGET, 2047);
    near(steps_in(&mut rig, 60), 29_985_352 - 128, 2);
    // 62 469.482 Hz for two minutes; the ramp is 2047 * 256 / 1000 ramp ticks of 256 us, 134.2 ms.
    let mut rig = Rig::with(RAMP, 3, 7, 1000);
    rig.write(PMUL_PDIV, 247 << 8 | 6);
    rig.write(X_TARGET, 8_000_000);
    near(steps_in(&mut rig, 120), 7_496_338 - 4_190, 15);
    // A ramp of 16e6^2 / 2^(13 + 13 + 29) = 0.007 105 43 pps/s for 5000 s. What the pulse generator does not see of the
    // velocity, half a unit on average, is 5000 s * 0.0149 Hz.
    let mut rig = Rig::with(VELOCITY, 13, 13, 1);
    rig.write(V_TARGET, 2047);
    near(steps_in(&mut rig, 5_000), 88_818 - 75, 2);
    // 5000 s are 1192.09 units of 4.194 s.
    assert_eq!(rig.chip.velocity(0), 1192);
    assert_eq!(steps_in(&mut Rig::new(), 1_000_000), 0);
}
