//! A straight line of three axes on the flash images of the TMCM-6110 and of the TMCM-3212, whose turns take their
//! time. The rotors keep to it as those of the virtual modules do.

use common::image_host::{Host, Product, SIX_AXES, THREE_AXES};
use hal_sim::clock::{MILLISECOND, Nanos};

/// At speed 1000 the other two would need speeds of 246.5 and 18.5.
const WAYS: [i64; 3] = [50_000, -12_325, 925];

#[test]
fn three_axes_keep_to_a_straight_line_and_arrive_together() {
    keep_to_a_straight_line(SIX_AXES, 10.0);
    // A tenth of a percent of the longest way.
    keep_to_a_straight_line(THREE_AXES, 50.0);
}

/// The rotors are never further than `most` microsteps from the line.
fn keep_to_a_straight_line(product: Product, most: f64) {
    let mut host = Host::of(product, "");
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
    assert!(off < most && last.iter().all(|time| time.abs_diff(last[0]) <= 10), "{off} microsteps, {last:?} ms");
}
