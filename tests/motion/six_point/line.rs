//! MVP COORD on a straight line with ramps of six points. All that a ramp has is in the ratio of the ways, and no axis
//! exceeds what is its own.

use super::bench;
use common::Bench;
use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm_sim::VirtualModule;

const WAYS: [[i32; 3]; 3] = [[512_000, 189_440, 18_944], [500_000, -123_457, 9_999], [-30_000, 30_000, 7]];

fn rotors(bench: &Bench) -> [i64; 3] {
    let board = bench.module.board().borrow();
    [0, 1, 2].map(|axis| board.world().axis(axis).motor().rotor())
}

/// Sends the three axes over their ways on a line. Returns how far a rotor was from the line at most, in microsteps,
/// and the time between the first and the last arrival. The third value is the largest speed of each axis, in pps.
fn draw(bench: &mut Bench, ways: [i32; 3]) -> (f64, Nanos, [f64; 3]) {
    let from = rotors(bench);
    for (axis, way) in ways.iter().enumerate() {
        let place = bench.ok(&format!("GAP 1, {axis}")) + way;
        bench.ok(&format!("SCO 1, {axis}, {place}"));
    }
    bench.ok("MVP COORD, 71, 1");
    let longest = (0..3).max_by_key(|n| ways[*n].unsigned_abs()).unwrap();
    let (mut off, mut there, mut fastest) = (0.0_f64, [0; 3], [0.0_f64; 3]);
    let limit = bench.module.now() + 60 * SECOND;
    let mut before = from;
    while there.contains(&0) {
        assert!(bench.module.now() < limit, "{ways:?}: not in time");
        bench.run(500 * MICROSECOND);
        let now = rotors(bench);
        let come: [f64; 3] = std::array::from_fn(|n| (now[n] - from[n]) as f64);
        let share = come[longest] / f64::from(ways[longest]);
        for n in 0..3 {
            off = off.max((come[n] - share * f64::from(ways[n])).abs());
            fastest[n] = fastest[n].max(now[n].abs_diff(before[n]) as f64 / 500e-6);
            if come[n] == f64::from(ways[n]) && there[n] == 0 {
                there[n] = bench.module.now();
            }
        }
        before = now;
    }
    bench.run(50 * MILLISECOND);
    for (n, way) in ways.iter().enumerate() {
        assert_eq!((rotors(bench)[n] - from[n], bench.ok(&format!("GAP 8, {n}"))), (i64::from(*way), 1), "axis {n}");
    }
    (off, there.iter().max().unwrap() - there.iter().min().unwrap(), fastest)
}

/// Draws a line and asserts that it is straight, within half a percent of the longest way or within three microsteps;
/// and that the axes arrive within so many milliseconds.
fn straight(bench: &mut Bench, ways: [i32; 3], allowed: Nanos) -> [f64; 3] {
    let (off, spread, fastest) = draw(bench, ways);
    let longest = ways.iter().map(|way| way.unsigned_abs()).max().unwrap();
    println!("{ways:?}: {off:.1} microsteps off the line, arrivals within {} us", spread / MICROSECOND);
    assert!(off <= (f64::from(longest) * 0.005).max(3.0), "{ways:?}: {off}");
    assert!(spread <= allowed * MILLISECOND, "{ways:?}: {} us apart", spread / MICROSECOND);
    fastest
}

#[test]
fn axes_with_trapezoidal_ramps_keep_to_a_line() {
    for ways in WAYS {
        let mut bench = bench();
        straight(&mut bench, ways, 10);
        straight(&mut bench, ways.map(|way| -way), 10);
    }
}

#[test]
fn axes_with_ramps_of_six_points_keep_to_a_line() {
    for ways in WAYS {
        let mut bench = bench();
        for axis in 0..3 {
            for (number, value) in [
                (19, 1_000),
                (15, 400_000),
                (16, 30_000),
                (5, 150_000),
                (4, 90_000),
                (17, 200_000),
                (18, 500_000),
                (20, 2_000),
            ] {
                bench.ok(&format!("SAP {number}, {axis}, {value}"));
            }
        }
        straight(&mut bench, ways, 10);
    }
}

/// A follower that is slower than its part of the line makes the leader slower.
#[test]
fn no_axis_exceeds_its_own_speed() {
    let mut bench = bench();
    bench.configure(&["SAP 4, 0, 80000", "SAP 4, 1, 20000", "SAP 4, 2, 80000"]);
    let fastest = straight(&mut bench, [512_000, 500_000, 100_000], 10);
    // In half a millisecond a speed shows to one microstep, which is 2000 pps.
    assert!(fastest[1] <= 22_000.0, "{fastest:?}");
    let mut bench = super::bench();
    bench.configure(&["SAP 4, 0, 20000", "SAP 5, 1, 5000", "SAP 17, 1, 5000"]);
    // At 5000 pps per second the last microstep takes sqrt(2 / 5000) = 20 ms, and so may that of another axis.
    straight(&mut bench, [300_000, 250_000, 10_000], 40);
}

/// Speeds in different units cannot be compared (status 6).
#[test]
fn axes_with_different_units_are_refused() {
    let mut bench = bench();
    bench.configure(&["SCO 1, 0, 1000", "SCO 1, 1, 1000", "SAP 255, 1, 0"]);
    bench.refused("MVP COORD, 67, 1", common::NOT_AVAILABLE);
    assert_eq!(rotors(&bench), [0; 3]);
}

/// A press that stops an axis for 3 ms breaks its line, which stays broken when the switch opens.
#[test]
fn a_line_that_a_short_press_has_broken_stays_broken() {
    for (axis, side) in [(0, "right"), (1, "left"), (2, "right")] {
        for (phase, span) in (0..4).map(|phase| (phase, 3)).chain([(0, 25), (0, 500)]) {
            let mut bench = bench();
            for (axis, way) in [500_000, -123_457, 60_000].into_iter().enumerate() {
                bench.configure(&[&format!("SAP 12, {axis}, 0"), &format!("SAP 13, {axis}, 0")]);
                bench.ok(&format!("SCO 1, {axis}, {way}"));
            }
            bench.ok("MVP COORD, 71, 1");
            bench.run(3 * SECOND + phase * 250 * MICROSECOND);
            assert!(bench.ok("GAP 3, 0") > 0);
            bench.control(&format!("press {side} {axis}"));
            bench.run(span * MILLISECOND);
            bench.control(&format!("release {side} {axis}"));
            bench.run(20 * SECOND);
            let what = format!("axis {axis}, phase {phase}, {span} ms");
            for (number, target) in [500_000, -123_457, 60_000].into_iter().enumerate() {
                assert_eq!(bench.ok(&format!("GAP 3, {number}")), 0, "{what}");
                assert_ne!(bench.ok(&format!("GAP 1, {number}")), target, "{what}: axis {number}");
            }
            assert_eq!(bench.ok(&format!("GAP 0, {axis}")), bench.ok(&format!("GAP 1, {axis}")), "{what}");
        }
    }
}

/// A follower that lags far makes up for it at a speed that is larger by what makes up for 256 microsteps in 16.4 ms,
/// and no more. That is 15 616 pps, less up to 260 for what a follower may be off and for the time between two
/// readings. One that is far ahead is slower by as much. The line is one to one at 50 000 pps. With 200 000 pps per
/// second the motor that stands needs a quarter of a second for that and lags 6 250 microsteps then. The one that comes
/// down from 100 000 pps is ahead by twice as much.
#[test]
fn a_follower_that_is_far_off_is_corrected_as_one_that_is_256_microsteps_off() {
    for (speeds, expected) in
        [([50_000, 0], [0..=1_000, 65_350..=65_616]), ([0, 100_000], [34_384..=34_650, 99_000..=100_000])]
    {
        let mut bench = bench();
        for (axis, (own, speed)) in [50_000, 200_000].into_iter().zip(speeds).enumerate() {
            for (number, value) in [(4, own), (5, 200_000), (17, 200_000)] {
                bench.ok(&format!("SAP {number}, {axis}, {value}"));
            }
            bench.ok(&format!("ROR {axis}, {speed}"));
        }
        bench.run(SECOND);
        for axis in [0, 1] {
            let place = bench.ok(&format!("GAP 1, {axis}"));
            bench.ok(&format!("SCO 1, {axis}, {}", place + 400_000));
        }
        bench.ok("MVP COORD, 67, 1");
        let (mut slowest, mut fastest) = (i32::MAX, 0);
        for _ in 0..1_000 {
            bench.run(MILLISECOND);
            let speed = bench.ok("GAP 3, 1");
            (slowest, fastest) = (slowest.min(speed), fastest.max(speed));
        }
        let [low, high] = &expected;
        assert!(low.contains(&slowest) && high.contains(&fastest), "{speeds:?}: {slowest} to {fastest}");
    }
}

/// While the leader speeds up, each millisecond brings its follower another speed limit, by one datagram besides the
/// two of the poll. Nothing is told the leader, nor a follower whose limit stays: that of one microstep is 0 until its
/// time has come.
#[test]
fn a_correction_is_one_datagram_to_the_follower_that_needs_it() {
    const WRITE: u8 = 0x80;
    let mut bench = bench();
    for (axis, way) in [500_000, 250_000, 1].into_iter().enumerate() {
        bench.ok(&format!("SCO 1, {axis}, {way}"));
    }
    bench.ok("MVP COORD, 71, 1");
    bench.run(100 * MILLISECOND);
    bench.module.board().borrow_mut().take_datagrams();
    bench.run(500 * MILLISECOND);
    let datagrams = bench.module.board().borrow_mut().take_datagrams();
    let written = |axis: usize| -> Vec<u8> {
        let of_axis = datagrams.iter().filter(|datagram| datagram.chip == Chip::Tmc5160(axis));
        of_axis.map(|datagram| datagram.bytes[0]).filter(|address| address & WRITE != 0).collect()
    };
    assert!(written(0).is_empty() && written(2).is_empty(), "{:x?}, {:x?}", written(0), written(2));
    // VMAX. All but a few times the limit differs from the one before.
    let limits = written(1);
    assert!(limits.iter().all(|address| *address == WRITE | 0x27) && limits.len() > 480, "{limits:x?}");
}

/// VSTART, A1, V1, AMAX, DMAX, D1 and VSTOP, by the numbers of their parameters, with their registers.
const RAMP: [(u8, u8); 7] = [(19, 0x23), (15, 0x24), (16, 0x25), (5, 0x26), (17, 0x28), (18, 0x2A), (20, 0x2B)];

/// On a line a follower of half of the way has half of all that the ramp of its leader has. Where that is more than
/// what is its own, the leader has so much less. With the next move of its own each has its own ramp. In registers,
/// with 2^24 / 16e6 and 2^41 / 16e6^2: 30 000 pps are 31 457, and 400 000 pps/s are 3 436.
#[test]
fn all_that_a_ramp_has_is_in_the_ratio_of_the_ways() {
    let own = [1_000, 400_000, 30_000, 150_000, 200_000, 500_000, 2_000];
    let leader = [1_049, 3_436, 31_457, 1_288, 1_718, 4_295, 2_097];
    let follower = [524, 1_718, 15_729, 644, 859, 2_147, 1_049];
    let with = |all: [u32; 7], at: usize, value: u32| {
        let mut all = all;
        all[at] = value;
        all
    };
    // What the follower has less of, and what both have then.
    let mut cases = vec![(0, own[0], leader, follower)];
    for (at, less, of_leader, of_follower) in [
        (0, 100, 210, 105),
        (1, 100_000, 1_718, 859),
        (2, 10_000, 20_972, 10_486),
        (3, 50_000, 859, 429),
        (4, 50_000, 859, 429),
        (5, 100_000, 1_718, 859),
        (6, 900, 1_887, 944),
    ] {
        cases.push((at, less, with(leader, at, of_leader), with(follower, at, of_follower)));
    }
    for (at, less, leader_has, follower_has) in cases {
        let mut bench = bench();
        for ((number, _), value) in RAMP.into_iter().zip(own) {
            bench
                .configure(&[0, 1].map(|axis| format!("SAP {number}, {axis}, {value}")).each_ref().map(String::as_str));
        }
        bench.ok(&format!("SAP {}, 1, {less}", RAMP[at].0));
        bench.configure(&["SCO 1, 0, 500000", "SCO 1, 1, 250000", "MVP COORD, 67, 1"]);
        let registers = |bench: &Bench, axis: usize| {
            RAMP.map(|(_, register)| bench.module.board().borrow().tmc5160(axis).register(register))
        };
        assert_eq!([registers(&bench, 0), registers(&bench, 1)], [leader_has, follower_has], "{:?}: {less}", RAMP[at]);
        bench.configure(&["MVP ABS, 0, 0", "MVP ABS, 1, 0"]);
        assert_eq!(registers(&bench, 0), leader, "the leader alone");
    }
}
