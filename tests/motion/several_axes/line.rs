//! MVP COORD on a straight line: the rotors keep to it, whatever the axes' ways, speeds and accelerations are, and
//! arrive at once. What ends a line stands in `line_ends.rs`.

use super::Bench;
use common::random::Random;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// The ways of the acceptance test, in microsteps.
const WAYS: [[i32; 3]; 2] = [[512_000, 189_440, 18_944], [500_000, 123_457, 9_999]];

/// Observations of a line.
#[derive(Debug)]
pub(super) struct Seen {
    /// The largest distance of a rotor from the line, in microsteps.
    off: f64,
    /// The times of the first and of the last arrival.
    arrivals: [Nanos; 2],
    /// The largest speeds.
    fastest: Vec<i32>,
}

impl Bench {
    pub(crate) fn rotor(&self, axis: u8) -> i64 {
        self.board.borrow().world().axis(axis.into()).motor().rotor()
    }

    /// Speed and position of a ramp generator.
    pub(super) fn ramp(&self, axis: u8) -> (i32, i32) {
        let board = self.board.borrow();
        let chip = board.tmc429(usize::from(axis / 3));
        (chip.velocity((axis % 3).into()), chip.position((axis % 3).into()))
    }

    /// The motor field of a line of axes.
    fn line(axes: &[u8]) -> u8 {
        axes.iter().fold(0x40, |bits, axis| bits | 1 << axis)
    }

    /// Makes coordinate 1 of axes the places that are so far from where they are, and sends them there on a line.
    pub(super) fn draw(&mut self, axes: &[u8], ways: &[i32]) {
        for (axis, way) in axes.iter().zip(ways) {
            let place = self.get(1, *axis).wrapping_add(*way);
            self.ok(&format!("SCO 1, {axis}, {place}"));
        }
        self.ok(&format!("MVP COORD, {}, 1", Bench::line(axes)));
    }

    /// Draws a line and watches the rotors.
    fn watch(&mut self, axes: &[u8], ways: &[i32]) -> Seen {
        let from: Vec<i64> = axes.iter().map(|axis| self.rotor(*axis)).collect();
        let start: Vec<i32> = axes.iter().map(|axis| self.ramp(*axis).1).collect();
        self.draw(axes, ways);
        let longest = (0..axes.len()).max_by_key(|n| ways[*n].unsigned_abs()).unwrap();
        let mut seen = Seen { off: 0.0, arrivals: [0; 2], fastest: vec![0; axes.len()] };
        let mut there = vec![0; axes.len()];
        let limit = self.now() + 600 * SECOND;
        while there.contains(&0) {
            assert!(self.now() < limit, "{ways:?}: not in time: {seen:?}");
            self.run(200 * MICROSECOND);
            let come = |n: usize| (self.rotor(axes[n]) - from[n]) as f64;
            let share = come(longest) / f64::from(ways[longest]);
            for n in 0..axes.len() {
                seen.off = seen.off.max((come(n) - share * f64::from(ways[n])).abs());
                let (speed, position) = self.ramp(axes[n]);
                seen.fastest[n] = seen.fastest[n].max(speed.abs());
                let is_there = (position.wrapping_sub(start[n]).wrapping_sub(ways[n])) << 8 == 0;
                match (is_there, there[n]) {
                    (true, 0) if ways[n] != 0 => there[n] = self.now(),
                    (true, 0) => there[n] = Nanos::MAX,
                    (false, 1..) => there[n] = 0,
                    _ => {}
                }
            }
        }
        let times = || there.iter().copied().filter(|time| *time != Nanos::MAX);
        seen.arrivals = [times().min().unwrap(), times().max().unwrap()];
        for (n, axis) in axes.iter().enumerate() {
            self.run(5 * MILLISECOND);
            assert_eq!((self.get(8, *axis), self.rotor(*axis) - from[n]), (1, ways[n].into()), "axis {axis}");
        }
        seen
    }

    /// Draws a line and asserts that it is straight, within half a percent of the longest way or within three
    /// microsteps; and that the axes arrive within so many milliseconds.
    pub(super) fn straight(&mut self, axes: &[u8], ways: &[i32], spread: Nanos) -> Seen {
        let seen = self.watch(axes, ways);
        let longest = ways.iter().map(|way| way.unsigned_abs()).max().unwrap();
        let allowed = (f64::from(longest) * 0.005).max(3.0);
        assert!(seen.off <= allowed, "{ways:?}: {seen:?}");
        let [first, last] = seen.arrivals;
        assert!(last - first <= spread * MILLISECOND, "{ways:?}: {} ms apart", (last - first) / MILLISECOND);
        seen
    }

    /// Sets parameters 4 and 5 of all axes.
    pub(crate) fn pace(&mut self, speed: i32, acceleration: i32) {
        self.each(&format!("SAP 4, #, {speed}"));
        self.each(&format!("SAP 5, #, {acceleration}"));
    }
}

#[test]
fn three_axes_keep_to_a_straight_line_and_arrive_together() {
    for ways in WAYS {
        for speed in [1_000, 2_047, 500] {
            let mut bench = Bench::six("");
            bench.each(&format!("SAP 4, #, {speed}"));
            let seen = bench.straight(&[0, 1, 2], &ways, 10);
            // The longest way is gone at its own speed.
            assert_eq!(seen.fastest[0], speed);
            // Half a percent would be 2560 microsteps. It is much less.
            assert!(seen.off < 20.0, "{seen:?}");
        }
    }
}

/// With small accelerations, with large ones, with both motion controllers, and in both directions.
#[test]
fn lines_are_straight_at_other_accelerations_too() {
    for acceleration in [2_047, 500, 100, 50] {
        let mut bench = Bench::six("");
        bench.pace(2_047, acceleration);
        for [a, b, c] in WAYS {
            bench.straight(&[4, 2, 0], &[-a / 4, b / 4, -c / 4], 10);
            bench.straight(&[1, 3, 5], &[c / 4, a / 4, a / 4 - 1], 10);
        }
    }
}

/// Speeds and accelerations differ from axis to axis: none is exceeded, and the line takes about as long as the axis
/// that alone would take longest.
#[test]
fn no_axis_exceeds_its_own_speed_and_the_slowest_one_leads() {
    for (ways, speeds, leader) in [
        ([300_000, 100_000, 50_000], [2_000, 400, 1_000], 1),
        ([300_000, 100_000, 3_000], [2_000, 2_000, 10], 2),
        ([300_000, 299_000, 50_000], [1_000, 900, 100], 2),
        ([10_000, 20_000, -30_000], [700, 700, 700], 2),
    ] {
        let mut bench = Bench::six("");
        for (axis, speed) in (0..).zip(speeds) {
            bench.ok(&format!("SAP 4, {axis}, {speed}"));
        }
        let from = bench.now();
        let seen = bench.straight(&[0, 1, 2], &ways, 10);
        let took = bench.now() - from;
        assert!(seen.fastest.iter().zip(speeds).all(|(fastest, speed)| *fastest <= speed), "{seen:?}");
        assert_eq!(seen.fastest[leader], speeds[leader]);
        // There, alone, it takes as long.
        let from = bench.now();
        bench.ok(&format!("MVP REL, {leader}, {}", -ways[leader]));
        bench.run_until(600 * SECOND, |bench| bench.get(8, leader as u8) == 1);
        let alone = bench.now() - from;
        assert!(took.abs_diff(alone) < 100 * MILLISECOND, "{} and {} ms", took / MILLISECOND, alone / MILLISECOND);
    }
}

/// An axis that accelerates slowly slows the others down.
#[test]
fn no_axis_exceeds_its_own_acceleration() {
    let mut bench = Bench::six("");
    bench.ok("SAP 5, 1, 50");
    for axis in [0, 1] {
        bench.ok(&format!("SAP 4, {axis}, 2000"));
    }
    bench.draw(&[0, 1], &[400_000, 200_000]);
    // 50 at divisors 7 and 3 is 763 units of speed in a second, and the other one has twice of that.
    bench.run(SECOND / 2);
    let speeds = bench.speeds();
    assert!((755..=770).contains(&speeds[0]) && (376..=386).contains(&speeds[1]), "{speeds:?}");
}

/// Ways of any length, also none at all and a single microstep; all pulse divisors; and across the end of the 32 bits.
#[test]
fn random_lines_are_straight() {
    let mut random = Random(0x1234_5678_9ABC);
    for round in 0..60 {
        let mut bench = Bench::six("");
        let (speed, acceleration) = (random.pick(&[2_047, 1_000, 300, 47]), random.pick(&[2_047, 1_000, 200, 50]));
        bench.pace(speed, acceleration);
        let reach = random.pick(&[20, 400, 3_000, 30_000]);
        let mut way = || match random.below(8) {
            0 => 0,
            1 => 1,
            2 => -1,
            3 => 2,
            _ => random.below(2 * reach + 1) as i32 - reach as i32,
        };
        let ways = [way(), way(), way()];
        if ways == [0; 3] {
            continue;
        }
        if round % 4 == 0 {
            for (axis, place) in [(0, i32::MAX), (1, i32::MIN), (2, i32::MAX - 10)] {
                bench.ok(&format!("SAP 1, {axis}, {place}"));
            }
        }
        bench.straight(&[0, 1, 2], &ways, 10);
    }
}

/// A unit of speed is 244 microsteps a second there: the corrections are of that unit, too. The way is longer than the
/// counter of the motion controller, so it goes by waypoints.
#[test]
fn a_line_is_straight_at_every_pulse_divisor() {
    for (divisor, ways, off) in
        [(0, [9_000_000, 3_333_333, 77_777], 20.0), (1, [800_000, -799_000, 3], 20.0), (6, [9_000, 5_000, 70], 2.0)]
    {
        let mut bench = Bench::six("");
        bench.each(&format!("SAP 154, #, {divisor}"));
        bench.each("SAP 4, #, 2047");
        let seen = bench.watch(&[0, 1, 2], &ways);
        assert!(seen.off <= off && seen.arrivals[1] - seen.arrivals[0] <= 10 * MILLISECOND, "{ways:?}: {seen:?}");
    }
}

/// Parameters 4 and 5 act on the way, as in any move: the line stays straight, whichever axis gets them.
#[test]
fn speeds_that_are_changed_on_the_way_keep_the_line() {
    let mut bench = Bench::six("");
    bench.draw(&[0, 1, 2], &[300_000, 100_000, 30_000]);
    let mut off: f64 = 0.0;
    for (change, fastest) in [
        ("SAP 4, 0, 600", 600),
        ("SAP 4, 1, 100", 300),
        ("SAP 5, 2, 20", 300),
        ("SAP 4, 1, 500", 600),
        ("SAP 4, 0, 2000", 1_500),
        ("SAP 4, 2, 0", 0),
        ("SAP 4, 2, 1000", 1_500),
    ] {
        bench.ok(change);
        for _ in 0..1_000 {
            bench.run(MILLISECOND);
            let share = bench.rotor(0) as f64 / 300_000.0;
            for (axis, way) in [(1, 100_000.0), (2, 30_000.0)] {
                off = off.max((bench.rotor(axis) as f64 - share * way).abs());
            }
        }
        // Nearly as fast as the slowest of the three allows.
        let speed = bench.ramp(0).0;
        assert!((fastest - 2..=fastest).contains(&speed), "{change}: {speed}");
    }
    assert!(off < 300.0, "{off}");
    bench.run_until(20 * SECOND, |bench| bench.all(8)[..3] == [1; 3]);
}

/// An axis that is the last one of its line, or whose others have nothing to go, has its parameters for itself.
#[test]
fn speeds_of_an_axis_that_is_left_alone_on_its_line_act() {
    for (ways, command) in [([200_000, 100_000, 50_000], "MST #"), ([200_000, 0, 0], "GAP 1, #")] {
        let mut bench = Bench::six("");
        bench.draw(&[0, 1, 2], &ways);
        bench.run(SECOND);
        bench.ok(&command.replace('#', "1"));
        bench.ok(&command.replace('#', "2"));
        bench.run(SECOND);
        bench.ok("SAP 4, 0, 700");
        bench.run(SECOND);
        assert_eq!(bench.ramp(0).0, 700, "{ways:?}");
    }
}

/// Axes that move go on from where they are. The line is not straight until they have come to it, but they arrive at
/// once.
#[test]
fn axes_that_move_come_to_the_line_and_arrive_together() {
    for speeds in [[500, 0, 0], [0, -500, 0], [900, 900, -900]] {
        let mut bench = Bench::six("");
        for (axis, speed) in (0..).zip(speeds) {
            bench.ok(&format!("ROR {axis}, {speed}"));
            bench.ok(&format!("SCO 3, {axis}, {}", 300_000 / (axis + 1)));
        }
        bench.run(SECOND / 2);
        bench.ok("138, 1, 0, 255");
        bench.ok("MVP COORD, $47, 3");
        bench.run_until(20 * SECOND, |bench| !bench.late.is_empty());
        bench.run(10 * MILLISECOND);
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert_eq!(arrivals, [0, 1, 2], "{speeds:?}");
    }
}

/// How far off the line to their targets axes are that move when they are sent there. Until half of the way that is
/// three times what the fastest needs to come to a stand, 840 microsteps from a speed of 900. The reason is that the
/// fastest brakes first, then goes back, and the others wait for it. From there on they keep to the line within 20
/// microsteps.
#[test]
fn axes_that_move_come_to_the_line_in_half_of_the_way() {
    for speeds in [[500, 0, 0], [0, -500, 0], [900, 900, -900], [-900, 700, 900], [-300, -300, -300]] {
        let mut bench = Bench::six("");
        for (axis, speed) in (0..).zip(speeds) {
            bench.ok(&format!("ROR {axis}, {speed}"));
        }
        bench.run(SECOND / 2);
        let start = [0, 1, 2].map(|axis| bench.ramp(axis).1);
        let targets = [300_000, -150_000, 100_000];
        for (axis, target) in (0..).zip(targets) {
            bench.ok(&format!("SCO 3, {axis}, {target}"));
        }
        let ways = [0, 1, 2].map(|n| f64::from(targets[n] - start[n]));
        let longest = (0..3).max_by_key(|n| ways[*n].abs() as i64).unwrap();
        bench.ok("MVP COORD, $47, 3");
        let (mut early, mut late): (f64, f64) = (0.0, 0.0);
        for _ in 0..20_000 {
            bench.run(MILLISECOND);
            let rest = [0, 1, 2].map(|n| f64::from(targets[n] - bench.ramp(n as u8).1));
            let share = rest[longest] / ways[longest];
            for n in 0..3 {
                let off = (rest[n] - share * ways[n]).abs();
                let seen = if share < 0.5 { &mut late } else { &mut early };
                *seen = seen.max(off);
            }
        }
        let fastest = speeds.map(|speed: i32| f64::from(speed.abs())).into_iter().fold(0.0, f64::max);
        assert!(early <= 3.0 * 840.0 * (fastest / 900.0).powi(2), "{speeds:?}: {early} off the line");
        assert!(late <= 20.0, "{speeds:?}: {late} off the line");
    }
}

/// An axis that turns so near to its target that it must come back runs past it no further than its own acceleration
/// demands. This is so although its share of the line's acceleration is tiny.
#[test]
fn an_axis_that_moves_brakes_with_its_own_acceleration() {
    let mut bench = Bench::six("");
    for axis in [0, 1] {
        bench.ok(&format!("ROR {axis}, 900"));
    }
    bench.run(SECOND / 2);
    let place = bench.get(1, 1);
    bench.ok("SCO 3, 0, 300000");
    bench.ok(&format!("SCO 3, 1, {}", place + 200));
    bench.ok("MVP COORD, $43, 3");
    for _ in 0..2_000 {
        bench.run(MILLISECOND);
        // From 900 it brakes within 840 microsteps.
        assert!(bench.ramp(1).1 < place + 1_000, "{} for {place}", bench.ramp(1).1);
    }
}

/// Each arrival is told once, to the host and to a program; and a program waits for it.
#[test]
fn the_arrivals_of_a_line_are_told_once() {
    let mut bench = Bench::six("");
    bench.count_interrupts(&[3, 4, 5, 6]);
    bench.ok("138, 1, 0, 255");
    for _ in 0..2 {
        bench.draw(&[0, 1, 2], &[20_000, 9_000, 0]);
        bench.run(2 * SECOND);
        let mut arrivals = bench.arrivals();
        arrivals.sort_unstable();
        assert_eq!(arrivals, [0, 1, 2]);
    }
    assert_eq!([3, 4, 5, 6].map(|number| bench.variable(number)), [2, 2, 0, 0]);
    bench.ok("SCO 1, 0, 0");
    bench.ok("SCO 1, 1, 0");
    bench.ok("132, 0, 0, 0");
    for line in ["MVP COORD, $43, 1", "WAIT POS, 1, 0", "GAP 1, 0", "AGP 100, 2", "STOP"] {
        bench.ask(line);
    }
    bench.ok("133, 0, 0, 0");
    bench.ok("129, 1, 0, 0");
    bench.run_until(9 * SECOND, |bench| bench.ok("GGP 128, 0") == 0);
    assert!(bench.variable(100).abs() < 20, "{}", bench.variable(100));
}

/// Two lines of three axes at once: each millisecond has no more than one datagram more than six plain moves.
#[test]
fn two_lines_at_once_are_both_straight_and_need_few_datagrams() {
    let mut bench = Bench::six("");
    bench.run(4 * SECOND);
    let ways = [60_000, 22_201, 2_220, -1_111, 40_000, 39_000];
    let from: Vec<i64> = bench.axes().map(|axis| bench.rotor(axis)).collect();
    bench.draw(&[0, 1, 2], &ways[..3]);
    bench.draw(&[3, 4, 5], &ways[3..]);
    bench.run(2 * MILLISECOND);
    let (mut off, mut most): (f64, usize) = (0.0, 0);
    for _ in 0..3_000 {
        bench.board.borrow_mut().take_datagrams();
        bench.run(MILLISECOND);
        most = most.max(bench.board.borrow_mut().take_datagrams().len());
        let come = |axis: usize| (bench.rotor(axis as u8) - from[axis]) as f64;
        for (leader, axes) in [(0, 0..3), (4, 3..6)] {
            let share = come(leader) / f64::from(ways[leader]);
            off = axes.fold(off, |off, axis| off.max((come(axis) - share * f64::from(ways[axis])).abs()));
        }
    }
    assert_eq!(bench.all(1), ways);
    assert!(off < 20.0 && most <= 9, "{off} microsteps, {most} datagrams");
}

/// The speed limits of followers waver. Their currents do not: that of a speed that changes (parameter 200) flows on
/// the ramps alone.
#[test]
fn the_currents_of_the_motors_on_a_line_do_not_waver() {
    let mut bench = Bench::six("");
    bench.each("SAP 200, #, 255");
    bench.draw(&[0, 1, 2], &[60_000, 22_201, 2_220]);
    bench.run(SECOND / 2);
    for _ in 0..1_000 {
        bench.run(MILLISECOND);
        let currents: Vec<u32> = bench.states()[..3].iter().map(|state| state.current).collect();
        assert_eq!(currents, [17; 3]);
    }
}

/// A follower that lags far makes up for it at a speed that is larger by what makes up for 256 microsteps in 16.4 ms,
/// and no more. That is 512 units at the pulse divisor of 3, less what a follower may be off. One that is far ahead is
/// slower by as much. One to one at a speed of 1000, the motor that stands lags 1000 microsteps when it has that speed.
/// The one that comes down from 2047 is 2100 ahead when the other one has it.
#[test]
fn a_follower_that_is_far_off_is_corrected_as_one_that_is_256_microsteps_off() {
    for (speeds, expected) in [([1_000, 0], [0..=20, 1_505..=1_512]), ([0, 2_047], [488..=495, 2_030..=2_047])] {
        let mut bench = Bench::six("");
        for (axis, (own, speed)) in (0..).zip([1_000, 2_047].into_iter().zip(speeds)) {
            bench.ok(&format!("SAP 4, {axis}, {own}"));
            bench.ok(&format!("ROR {axis}, {speed}"));
        }
        bench.run(SECOND);
        for axis in [0, 1] {
            let place = bench.get(1, axis);
            bench.ok(&format!("SCO 3, {axis}, {}", place + 400_000));
        }
        bench.ok("MVP COORD, $43, 3");
        let (mut slowest, mut fastest) = (i32::MAX, 0);
        for _ in 0..2_000 {
            bench.run(MILLISECOND);
            let speed = bench.ramp(1).0;
            (slowest, fastest) = (slowest.min(speed), fastest.max(speed));
        }
        let [low, high] = &expected;
        assert!(low.contains(&slowest) && high.contains(&fastest), "{speeds:?}: {slowest} to {fastest}");
        assert_eq!(bench.ramp(1).0, bench.ramp(0).0);
    }
}
