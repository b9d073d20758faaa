//! The driver: field, current, thresholds, load measurement and what shuts it down.

use super::*;
use crate::chip::load::FULL_LOAD;

/// Fields of DRV_STATUS.
const STEALTH: u32 = 1 << 14;
const FULL_STEPS: u32 = 1 << 15;
const STALL: u32 = 1 << 24;
const STANDSTILL: u32 = 1 << 31;

impl Rig {
    fn scale(&mut self) -> u32 {
        self.read(DRV_STATUS) >> 16 & 0x1F
    }

    /// Turns the motor with a TSTEP of `clocks`; the field has moved by two electrical periods before this returns.
    fn step_every(&mut self, clocks: u32) {
        self.write(AMAX, 0xFFFF);
        self.write(VMAX, (1 << 24) / clocks);
        self.write(RAMPMODE, 1);
        let field = self.stage.field;
        self.until(100 * MICROSECOND, |rig| rig.stage.field > field + 2_560);
    }
}

/// 15.2, the table of step positions: full steps at 128, 384 and so on, half steps at 64, 192, 320.
#[test]
fn examples_of_15_2_positions_of_steps() {
    for (resolution, positions) in [(8, vec![128, 384, 640, 896, 128]), (7, vec![64, 192, 320, 448, 576])] {
        for sign in [1, -1] {
            let mut rig = Rig::with(&[(CHOPCONF, 0xC3 | resolution << 24), (VMAX, 1_000), (AMAX, 0xFFFF)]);
            rig.write(RAMPMODE, if sign > 0 { 1 } else { 2 });
            let mut seen = Vec::new();
            while seen.len() < positions.len() + 1 {
                let steps = rig.stage.turns.len();
                rig.run(100 * MICROSECOND);
                if rig.stage.turns.len() > steps {
                    seen.push(rig.read(MSCNT));
                }
            }
            // The first step goes from 0 to the nearest position and on.
            let width = 1 << resolution;
            let expected = (1..=seen.len() as i32).map(|step| (step * sign * width + width / 2) as u32 & 0x3FF);
            assert!(seen.iter().copied().eq(expected), "{seen:?}");
            assert!(seen.iter().all(|position| resolution == 7 || positions.contains(position)), "{seen:?}");
        }
    }
}

/// 15.2: "The coil current in each position corresponds to the RMS value" and the other values of its table, in percent
/// of the amplitude 248.
#[test]
fn examples_of_15_2_currents_of_the_table() {
    let mut rig = Rig::with(&[(CHOPCONF, 0xC3 | 6 << 24), (VMAX, 10_000), (AMAX, 0xFFFF), (RAMPMODE, 1)]);
    let rows = [
        (64, 38.3, 92.4),
        (128, 70.7, 70.7),
        (192, 92.4, 38.3),
        (320, 92.4, -38.3),
        (384, 70.7, -70.7),
        (448, 38.3, -92.4),
        (576, -38.3, -92.4),
        (640, -70.7, -70.7),
        (704, -92.4, -38.3),
        (832, -92.4, 38.3),
        (896, -70.7, 70.7),
        (960, -38.3, 92.4),
    ];
    for (position, a, b) in rows {
        for (offset, percent) in [(0, a), (256, b)] {
            let value = sine::current(position + offset, &rig.chip.registers);
            assert!((f64::from(value) / 248.0 * 100.0 - percent).abs() < 1.0, "{position}: {value}");
        }
    }
    rig.run(SECOND);
    let (position, currents) = (rig.read(MSCNT), rig.read(MSCURACT));
    assert!(position != 0 && currents != 247 << 16);
}

/// 6.5: "round(248 * sin(2*PI*i/1024 + PI/1024)) - 1" for the reset values of the table, exactly.
#[test]
fn the_table_of_the_reset_values_is_the_sine_of_the_formula() {
    let registers = Registers::new();
    for index in 0..256_i32 {
        let angle = core::f64::consts::PI * (2.0 * f64::from(index) + 1.0) / 1024.0;
        let expected = (248.0 * angle.sin()).round() as i32 - 1;
        assert_eq!(sine::current(index.into(), &registers), expected, "{index}");
        assert_eq!(sine::current((index + 512).into(), &registers), -1 - expected, "{index}");
    }
}

#[test]
fn shaft_turns_the_field_around_and_leaves_the_position() {
    let mut rig = Rig::with(&[(GCONF, 1 << 4), (VMAX, 10_000), (AMAX, 0xFFFF), (RAMPMODE, 1)]);
    rig.run(SECOND);
    assert!(rig.position() > 9_000);
    assert_eq!(rig.stage.field, -i64::from(rig.position()));
}

/// 1.5 and 6.2: stst comes 2^20 clocks after the last step (65.54 ms). TPOWERDOWN * 2^18 clocks later (16.384 ms each)
/// the current begins to fall by one in IHOLDDELAY * 2^18 clocks. Page 75: "When using IRUN=31 and IHOLD=16, 15 current
/// steps are required. An IHOLDDELAY setting of 4 thus results in a power down time of 4*15*2^18 clock cycles."
#[test]
fn example_of_9_the_current_falls_to_hold_in_4_times_15_times_2_18_clocks() {
    let mut rig = Rig::with(&[(IHOLD_IRUN, 4 << 16 | 31 << 8 | 16), (TPOWERDOWN, 10)]);
    assert_eq!((rig.scale(), rig.read(DRV_STATUS) & STANDSTILL), (16, STANDSTILL), "at rest since the reset");
    rig.write(AMAX, 0xFFFF);
    rig.write(DMAX, 0xFFFF);
    rig.write(VMAX, 50_000);
    rig.write(XTARGET, 10);
    rig.settle();
    assert_eq!((rig.scale(), rig.stage.current), (31, 32));
    let last = rig.stage.turns.last().unwrap().0;
    let clocks = |number: Nanos| number * SECOND / u64::from(HZ);
    let mut at = |time: Nanos| {
        rig.run(last + time - rig.now);
        (rig.read(DRV_STATUS) & STANDSTILL != 0, rig.scale())
    };
    assert_eq!(at(clocks(1 << 20) - MILLISECOND), (false, 31));
    assert_eq!(at(clocks(1 << 20) + MILLISECOND), (true, 31));
    let down = clocks((1 << 20) + (10 << 18));
    assert_eq!(at(down + clocks(4 << 18) - MILLISECOND), (true, 31));
    assert_eq!(at(down + clocks(4 << 18) + MILLISECOND), (true, 30));
    assert_eq!(at(down + clocks((4 * 14) << 18) + MILLISECOND), (true, 17));
    assert_eq!(at(down + clocks((4 * 15) << 18) - MILLISECOND), (true, 17));
    assert_eq!(at(down + clocks((4 * 15) << 18) + MILLISECOND), (true, 16));
    rig.run(SECOND);
    assert_eq!((rig.scale(), rig.stage.current, rig.chip.next_event()), (16, 17, None));
    // A step brings the current back at once.
    rig.write(XTARGET, 12);
    rig.settle();
    assert_eq!(rig.stage.current, 32);
    // Instant power down, and standstill after 2^18 clocks.
    rig.write(IHOLD_IRUN, 31 << 8 | 16);
    rig.write(TPOWERDOWN, 0);
    rig.write(GCONF, 2);
    rig.run(clocks(1 << 18) + MILLISECOND);
    assert_eq!((rig.read(DRV_STATUS) & STANDSTILL, rig.scale()), (STANDSTILL, 16));
}

/// Chapter 9: IRMS is proportional to GLOBALSCALER/256 * (CS+1)/32; 0 is full scale.
#[test]
fn the_current_is_scaled_globally() {
    for (global, irun, current) in [(0, 31, 32), (128, 31, 16), (256, 31, 32), (128, 15, 8), (32, 31, 4), (255, 31, 32)]
    {
        let mut rig = Rig::with(&[(IHOLD_IRUN, irun << 8 | irun), (GLOBALSCALER, global)]);
        assert_eq!((rig.chip.current(), rig.scale()), (current, irun), "{global}");
        rig.chip.set_disable_pin(true);
        assert_eq!(rig.chip.current(), 0);
        rig.chip.set_disable_pin(false);
        rig.chip.set_open(Bridge::A, true);
        assert_eq!((rig.chip.current(), rig.chip.torque_current()), (current, 0));
        rig.write(CHOPCONF, 0x1000_00C0);
        assert_eq!(rig.chip.current(), 0, "TOFF = 0 switches the driver off");
    }
}

/// 7.7: with IHOLD = 0 and a freewheeling option the motor is free at rest, in stealthChop only.
#[test]
fn freewheeling_takes_stealth_chop_and_a_hold_current_of_0() {
    for (freewheel, gconf, ihold, current) in [(0, 4, 0, 1), (1, 4, 0, 0), (2, 4, 0, 0), (1, 0, 0, 1), (1, 4, 1, 2)] {
        let mut rig = Rig::with(&[(IHOLD_IRUN, 31 << 8 | ihold), (TPOWERDOWN, 2), (GCONF, gconf)]);
        rig.write(PWMCONF, 0xC40C_001E | freewheel << 20);
        rig.write(AMAX, 0xFFFF);
        rig.write(DMAX, 0xFFFF);
        rig.write(VMAX, 50_000);
        rig.write(XTARGET, 10);
        rig.settle();
        assert_eq!(rig.stage.current, 32);
        rig.run(SECOND);
        assert_eq!(rig.stage.current, current, "{freewheel} {gconf} {ihold}");
    }
}

/// 6.2, TSTEP: 2^24 / V for 1/256 of a full step, whatever the resolution; 2^20 - 1 at rest.
#[test]
fn the_time_of_a_step_is_measured() {
    for (velocity, resolution) in [(100_000, 0), (1_000, 0), (40_000, 1), (10_000, 4), (400, 8)] {
        let mut rig =
            Rig::with(&[(CHOPCONF, 0xC3 | resolution << 24), (AMAX, 0xFFFF), (VMAX, velocity), (RAMPMODE, 1)]);
        assert_eq!(rig.read(TSTEP), 0xF_FFFF);
        rig.run(SECOND);
        let expected = f64::from(1 << 24) / f64::from(velocity) / f64::from(1 << resolution);
        assert!((f64::from(rig.read(TSTEP)) - expected).abs() <= 1.0);
        rig.write(VMAX, 0);
        rig.run(SECOND);
        assert_eq!(rig.read(TSTEP), 0xF_FFFF);
    }
}

/// The modes in which the driver runs with these TSTEPs, one after the other: stealthChop, full steps.
fn modes(registers: &[(u8, u32)], steps: &[u32]) -> Vec<(bool, bool)> {
    let mut rig = Rig::with(registers);
    steps
        .iter()
        .map(|&clocks| {
            rig.step_every(clocks);
            let status = rig.read(DRV_STATUS);
            (status & STEALTH != 0, status & FULL_STEPS != 0)
        })
        .collect()
}

/// 6.2 and chapter 10: the upper velocity of each threshold has a hysteresis of 1/16, or 1/32.
#[test]
fn thresholds_have_their_hysteresis() {
    let stealth = |gconf: u32, threshold, steps: &[u32]| -> Vec<bool> {
        modes(&[(GCONF, 4 | gconf), (threshold, 1_600)], steps).into_iter().map(|(stealth, _)| stealth).collect()
    };
    // 1600 * 15/16 - 1 = 1499, 1600 * 31/32 - 1 = 1549.
    for threshold in [TPWMTHRS, TCOOLTHRS, THIGH] {
        assert_eq!(
            stealth(0, threshold, &[3_000, 1_520, 1_480, 1_520, 1_580, 1_620]),
            [true, true, false, false, false, true]
        );
        assert_eq!(stealth(1 << 14, threshold, &[3_000, 1_560, 1_540, 1_560, 1_620]), [true, true, false, false, true]);
    }
    assert_eq!(modes(&[(GCONF, 4)], &[3_000, 100]), [(true, false); 2], "thresholds of 0 are never passed");
    assert_eq!(modes(&[(TPWMTHRS, 1_600)], &[3_000, 100]), [(false, false); 2], "en_pwm_mode is not set");
}

/// 6.5.2, 17.3: full steps above THIGH or VDCMIN with vhighfs; stealthChop disables dcStep.
#[test]
fn full_steps_begin_at_thigh_or_vdcmin() {
    const VHIGHFS: (u8, u32) = (CHOPCONF, 0x1004_00C3);
    assert_eq!(modes(&[VHIGHFS, (THIGH, 1_600)], &[3_000, 1_000]), [(false, false), (false, true)]);
    assert_eq!(modes(&[(THIGH, 1_600)], &[3_000, 1_000]), [(false, false); 2]);
    // VDCMIN of 10 000 is a TSTEP of 1677; below 256 it is off.
    assert_eq!(modes(&[VHIGHFS, (VDCMIN, 10_000)], &[3_000, 1_000]), [(false, false), (false, true)]);
    assert_eq!(modes(&[VHIGHFS, (VDCMIN, 255)], &[3_000, 1_000]), [(false, false); 2]);
    assert_eq!(modes(&[VHIGHFS, (VDCMIN, 10_000), (GCONF, 4)], &[1_000]), [(true, false)]);
}

/// With the model's motor the reading is 512 (1 - load) + 64 (SGT - 13), updated with each full step or, with sfilt,
/// with each fourth.
#[test]
fn stall_guard_measures_the_load() {
    let reading = |sgt: i32, load: f64| {
        let mut rig = Rig::with(&[(COOLCONF, (sgt & 0x7F) as u32), (TCOOLTHRS, 0)]);
        rig.write(COOLCONF, ((sgt & 0x7F) as u32) << 16);
        rig.stage.load = (load * f64::from(FULL_LOAD)) as LoadRatio;
        rig.step_every(1_000);
        let status = rig.read(DRV_STATUS);
        (status & 0x3FF, status & STALL != 0)
    };
    assert_eq!(reading(10, 0.0), (320, false));
    assert_eq!(reading(10, 0.5), (64, false));
    assert_eq!(reading(13, 1.0), (0, true));
    assert_eq!(reading(63, 0.0), (1023, false));
    assert_eq!(reading(-1, 0.0), (0, true), "SGT is signed");
    let mut rig = Rig::with(&[(COOLCONF, 13 << 16 | 1 << 24)]);
    rig.step_every(1_000);
    assert_eq!(rig.read(DRV_STATUS) & 0x3FF, 512);
    rig.stage.load = FULL_LOAD / 2;
    let field = rig.stage.field;
    // Of the four full steps whose mean is the next reading, some had no load; after eight all had it.
    rig.until(10 * MICROSECOND, |rig| rig.stage.field > field + 8 * 256);
    assert_eq!(rig.read(DRV_STATUS) & 0x3FF, 256);
    // Not in stealthChop.
    rig.write(GCONF, 4);
    assert_eq!(rig.read(DRV_STATUS) & (0x3FF | STALL | STEALTH), STEALTH);
}

/// 14.2: between TCOOLTHRS and THIGH coolStep moves the current between IRUN and its half or quarter.
#[test]
fn cool_step_acts_between_its_thresholds() {
    // SGT 13, SEMIN 4 (below 128: up), SEMAX 1 (from 192: down), SEDN 3 (each reading), SEUP 0 (one up).
    let word = 13 << 16 | 3 << 13 | 1 << 8 | 4;
    let mut rig = Rig::with(&[(COOLCONF, word), (TCOOLTHRS, 2_000), (THIGH, 500), (IHOLD_IRUN, 0x1F1F)]);
    rig.step_every(3_000);
    assert_eq!(rig.scale(), 31, "too slow");
    rig.step_every(1_000);
    rig.run(SECOND);
    assert_eq!(rig.scale(), 15, "half of 31");
    rig.write(COOLCONF, word | 1 << 15);
    rig.run(SECOND);
    assert_eq!((rig.scale(), rig.stage.current), (7, 8));
    rig.stage.load = FULL_LOAD * 9 / 10;
    rig.run(SECOND);
    assert_eq!(rig.scale(), 31);
    rig.stage.load = FULL_LOAD * 7 / 10;
    rig.run(SECOND);
    assert_eq!(rig.scale(), 31, "between the thresholds it stays");
    rig.stage.load = 0;
    rig.step_every(400);
    rig.run(SECOND);
    assert_eq!(rig.scale(), 31, "too fast");
    rig.step_every(1_000);
    rig.run(SECOND);
    assert_eq!(rig.scale(), 7);
    rig.write(COOLCONF, 13 << 16);
    assert_eq!(rig.scale(), 31, "off");
}

/// 22, "Enabling coolStep": SEMIN = 1 and all other 0, TCOOLTHRS above TSTEP; CS_ACTUAL falls without load.
#[test]
fn example_of_22_enabling_cool_step() {
    let mut rig = Rig::with(&[(COOLCONF, 13 << 16)]);
    rig.step_every(1_000);
    let step = rig.read(TSTEP);
    rig.write(THIGH, 500);
    rig.write(TCOOLTHRS, step + step / 8);
    rig.write(COOLCONF, 13 << 16 | 1);
    // SEDN 0 lowers the current once in 32 full steps, which take 256 * 1000 clocks each.
    rig.run(16 * 32 * 16 * MILLISECOND + SECOND);
    assert_eq!(rig.scale(), 15);
}

/// 22, "Setting up dcStep": vhighfs and vhighchm, VDCMIN, DC_TIME, DC_SG and sg_stop. The model has the flags of it.
#[test]
fn example_of_22_setting_up_dc_step() {
    let mut rig = Rig::with(&[(CHOPCONF, 0x100C_00C3), (VDCMIN, 10_000), (DCCTRL, 25), (COOLCONF, 13 << 16)]);
    rig.stage.load = FULL_LOAD;
    rig.write(TCOOLTHRS, 1_600);
    rig.write(SW_MODE, 1 << 10);
    rig.step_every(1_000);
    rig.run(SECOND);
    assert_eq!(rig.read(DRV_STATUS) & (STALL | FULL_STEPS), FULL_STEPS, "DC_SG = 0 sees no stall");
    // 1 + 1/16 of DC_TIME.
    rig.write(DCCTRL, 2 << 16 | 25);
    rig.run(SECOND);
    assert_eq!((rig.chip.velocity(), rig.read(RAMP_STAT) >> 6 & 1), (0, 1));
}

/// 22, "Current setting" and "StealthChop configuration", and 23.1: with TPWM_THRS = 500 the driver leaves stealthChop
/// at about 35 000. This is 2^24 / 500 = 33 554, and 1/16 more with the hysteresis.
#[test]
fn example_of_22_and_23_1_stealth_chop_up_to_a_velocity() {
    let mut rig = Rig::with(&[(IHOLD_IRUN, 6 << 16 | 31 << 8 | 10), (GCONF, 4), (TPWMTHRS, 500), (AMAX, 500)]);
    rig.write(VMAX, 100_000);
    rig.write(RAMPMODE, 1);
    rig.until(TICK, |rig| !rig.chip.driver.stealth(rig.chip.state(rig.chip.present())));
    let velocity = rig.chip.velocity();
    assert!((35_000..37_000).contains(&velocity), "{velocity}");
}

/// 6.5.4: PWM_SCALE_SUM = PWM_OFS * (CS_ACTUAL+1)/32 + PWM_GRAD * 256 / TSTEP, limited to 255 and frozen in
/// spreadCycle.
#[test]
fn the_pwm_amplitude_follows_its_formula() {
    let mut rig = Rig::with(&[(GCONF, 4), (IHOLD_IRUN, 15 << 8 | 15)]);
    // PWM_OFS 60, PWM_GRAD 100, without automatic scaling.
    rig.write(PWMCONF, 100 << 8 | 60);
    assert_eq!((rig.read(PWM_SCALE), rig.read(PWM_AUTO)), (30, 100 << 16 | 60));
    rig.step_every(256);
    let sum = rig.read(PWM_SCALE);
    assert!((129..=130).contains(&sum), "{sum}");
    rig.step_every(64);
    assert_eq!(rig.read(PWM_SCALE), 255);
    rig.write(GCONF, 0);
    rig.write(VMAX, 1_000);
    rig.run(SECOND);
    assert_eq!(rig.read(PWM_SCALE), 255);
}

/// 6.5.5 and 11: shorts shut the driver down until it is disabled, if the protection is on.
#[test]
fn shorts_shut_the_driver_down_until_it_is_disabled() {
    for (bridge, short, flag, protection) in [
        (Bridge::A, Short::Ground, 27, 30),
        (Bridge::B, Short::Ground, 28, 30),
        (Bridge::A, Short::Supply, 12, 31),
        (Bridge::B, Short::Supply, 13, 31),
    ] {
        let disable: [fn(&mut Rig); 2] = [
            |rig| {
                rig.write(CHOPCONF, 0x1000_00C0);
                rig.write(CHOPCONF, 0x1000_00C3);
            },
            |rig| {
                rig.chip.set_disable_pin(true);
                rig.chip.set_disable_pin(false);
            },
        ];
        for disable in disable {
            let mut rig = Rig::with(&[]);
            rig.chip.set_short(bridge, short, true);
            rig.chip.set_short(bridge, short, false);
            assert_eq!((rig.chip.bridges_on(), rig.read(DRV_STATUS) >> flag & 1, rig.read(GSTAT)), (false, 1, 2));
            assert_eq!(rig.status() & 2, 2);
            rig.write(GSTAT, 2);
            assert_eq!((rig.read(GSTAT), rig.chip.bridges_on()), (0, false));
            disable(&mut rig);
            assert_eq!((rig.chip.bridges_on(), rig.read(DRV_STATUS) >> flag & 1), (true, 0));
        }
        let mut rig = Rig::with(&[(CHOPCONF, 0x1000_00C3 | 1 << protection)]);
        rig.chip.set_short(bridge, short, true);
        assert_eq!((rig.chip.bridges_on(), rig.read(GSTAT)), (true, 0), "not protected");
    }
}

/// 11.1: the pre-warning at 120 degrees, shutdown at the level of OTSELECT until the pre-warning is over.
#[test]
fn over_temperature_lasts_until_the_warning_is_over() {
    for (select, limit) in [(0, 150), (1, 143), (2, 136), (3, 120)] {
        let mut rig = Rig::with(&[(DRV_CONF, select << 16)]);
        let mut flags = |celsius| {
            rig.chip.set_temperature(celsius);
            let status = rig.read(DRV_STATUS);
            (status >> 26 & 1, status >> 25 & 1, rig.chip.bridges_on(), rig.read(GSTAT))
        };
        assert_eq!(flags(119), (0, 0, true, 0));
        if limit > 120 {
            assert_eq!(flags(limit - 1), (1, 0, true, 0));
        }
        assert_eq!(flags(limit), (1, 1, false, 2));
        assert_eq!(flags(120), (1, 1, false, 2));
        rig.write(GSTAT, 2);
        assert_eq!(rig.read(GSTAT), 2, "it can only be cleared when the temperature is below the limit again");
        rig.chip.set_temperature(119);
        rig.write(GSTAT, 2);
        assert_eq!((rig.chip.bridges_on(), rig.read(GSTAT)), (true, 0));
    }
}

/// 28: below 8 V the charge pump fails, below 4 V the chip is reset.
#[test]
fn low_supplies_disable_and_reset() {
    let mut rig = Rig::with(&[]);
    rig.chip.set_supply(80);
    assert_eq!((rig.chip.bridges_on(), rig.read(GSTAT)), (true, 0));
    rig.chip.set_supply(79);
    assert_eq!((rig.chip.bridges_on(), rig.read(GSTAT)), (false, 4));
    rig.write(GSTAT, 4);
    assert_eq!(rig.read(GSTAT), 4, "it persists");
    rig.chip.set_supply(240);
    rig.write(GSTAT, 4);
    assert_eq!((rig.chip.bridges_on(), rig.read(GSTAT)), (true, 0));
    rig.chip.set_supply(40);
    assert_eq!(rig.read(IOIN) >> 24, 0x30);
    rig.chip.set_supply(39);
    assert_eq!(rig.datagram(IOIN, 0), (0, 0));
    rig.chip.set_supply(240);
    assert_eq!((rig.read(GSTAT), rig.read(CHOPCONF)), (1, 0x1041_0150));
}

/// Without an external clock the chip runs on 12 MHz: three quarters of the speed.
#[test]
fn the_internal_clock_is_slower() {
    let mut rig = Rig::with(&[(AMAX, 0xFFFF), (VMAX, 100_000), (RAMPMODE, 1)]);
    rig.run(SECOND);
    let before = rig.position();
    rig.run(SECOND);
    near(f64::from(rig.position() - before), 95_367.4, 2.0);
    rig.chip.set_external_clock(None);
    let before = rig.position();
    rig.run(SECOND);
    near(f64::from(rig.position() - before), 71_525.6, 2.0);
}
