//! A straight line of three axes on the flash image of the TMCM-6110, whose turns take their time: the rotors keep to it as
//! those of the virtual module do.

use crate::common::image_host::{Host, SIX_AXES};
use hal_sim::clock::{MILLISECOND, Nanos};

/// At speed 1000 the other two would need speeds of 246.5 and 18.5.
const WAYS: [i64; 3] = [50_000, -12_325, 925];

#[test]
fn three_axes_keep_to_a_straight_line_and_arrive_together() {
    let mut host = Host::of(SIX_AXES, "");
    for (axis, way) in WAYS.iter().enumerate() {
        host.ok(&format!("SCO 1, {axis}, {way}"));
    }
    host.ok("MVP COORD, $47, 1");
    let (mut off, mut last): (f64, [Nanos; 3]) = (0.0, [0; 3]);
    for time in 0..2_000 {
        host.run(MILLISECOND);
        let rotors = host.rotors();
        let share = rotors[0] as f64 / WAYS[0] as f64;
        for axis in 0..3 {
            off = off.max((rotors[axis] as f64 - share * WAYS[axis] as f64).abs());
            if rotors[axis] != WAYS[axis] {
                last[axis] = time;
            }
        }
    }
    assert_eq!(host.rotors()[..3], WAYS);
    // Half a percent of the longest way would be 250 microsteps.
    assert!(off < 10.0 && last.iter().all(|time| time.abs_diff(last[0]) <= 10), "{off} microsteps, {last:?} ms");
}
