//! The example for a ramp generator with six points. Times and ways are those of v = v0 + at and s = (v0 + v) t / 2
//! with the numbers of the program.

use super::{Example, close};
use hal_sim::clock::SECOND;
use tmcm_sim::Product;

const FAR: i32 = 204_800;
/// The ramp goes from 2000 to 32 000 pps at 60 000 pps2, and from there to 104 000 pps at 240 000 pps2. This takes 0.5
/// s and 0.3 s for 8500 and 20 400 microsteps, at both ends.
const RAMP_SECONDS: f64 = 0.8;
const RAMP: f64 = 28_900.0;
/// The rest of the way at 104 000 pps.
const FULL: f64 = 104_000.0;

/// The position of an axis.
fn position(example: &Example, axis: usize) -> i32 {
    example.state().axes[axis].position
}

/// When an axis is at its target, in seconds after the start.
fn arrival(example: &mut Example, axis: usize, target: i32) -> f64 {
    example.when(10 * SECOND, |state| state.axes[axis].position == target) as f64 / 1000.0
}

#[test]
fn six_point_ramp() {
    let mut example = Example::load_into(Product::Tmcm3212, "six_point_ramp.tmc", "");
    example.begin("129");
    // At the knee, 0.5 s from the start, and at full speed.
    example.until(500);
    close(position(&example, 0), 8_500.0, 0.02);
    example.until(800);
    close(position(&example, 0), RAMP, 0.01);
    let quick = arrival(&mut example, 0, FAR);
    close(quick, 2.0 * RAMP_SECONDS + (f64::from(FAR) - 2.0 * RAMP) / FULL, 0.005);
    // The other one needs 104 000 / 60 000 s at both ends, and 90 133 microsteps for each.
    let gentle = arrival(&mut example, 1, FAR);
    close(gentle, 2.0 * FULL / 60_000.0 + (f64::from(FAR) - FULL * FULL / 60_000.0) / FULL, 0.005);
    close(gentle - quick, 0.7, 0.03);

    // The way home is left after a second: at full speed for 0.2 s. It ends where the motor has come to a stop.
    let turned = f64::from(FAR) - 2.0 * RAMP - 0.2 * FULL;
    let lowest = {
        let mut lowest = FAR;
        let begun = example.when(SECOND, |state| state.axes[0].position < FAR) as f64 / 1000.0;
        close(begun, gentle + 0.3, 0.01);
        let back = example.when(10 * SECOND, |state| {
            lowest = lowest.min(state.axes[0].position);
            state.axes[0].position == FAR
        });
        // Away, half a second of rest, and back again.
        close(back as f64 / 1000.0 - begun, 1.0 + RAMP_SECONDS + 0.5 + 2.0 * RAMP_SECONDS + 0.2, 0.01);
        lowest
    };
    close(lowest, turned, 0.01);
    assert_eq!(position(&example, 1), FAR);
    example.bench.run(SECOND);
    assert!(example.ended());
    assert_eq!((example.executed(), example.bench.lost_steps()), (22, 0));
}
