//! The built-in and the external encoder: counting, prescalers, function bits, deviation supervision, and the
//! reversed shaft (manual sections 6.2 and 6.3, parameters 209 to 218, global parameter 90).

use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

/// An ABN encoder of 2 000 lines on a 200-step motor: 8 000 counts a turn, 6.4 microsteps each. So a prescaler of 6.4 *
/// 512 = 3277 (3276.8) makes it count microsteps. The index is where the rotor starts.
const ABN: &str = "[abn]\nlines = 2000\n";

fn go(bench: &mut Bench, target: i32) {
    bench.ok(&format!("MVP ABS, 0, {target}"));
    bench.run_until(20 * SECOND, |b| b.ok("GAP 8, 0") == 1);
    bench.run(5 * MILLISECOND);
}

fn assert_near(what: &str, got: i32, expected: i32, tolerance: i32) {
    assert!((got - expected).abs() <= tolerance, "{what}: {got} in place of {expected}");
}

/// 1024 counts a turn of 51 200 microsteps: 50 microsteps a count, and the default prescaler is 50 * 512.
#[test]
fn the_built_in_encoder_follows_the_motor() {
    let mut bench = Bench::new();
    for target in [30_000, 123_456, -80_000, 0] {
        go(&mut bench, target);
        assert_near("encoder", bench.ok("GAP 209, 0"), target, 50);
        assert_near("resolver", bench.ok("GAP 215, 0"), target.rem_euclid(51_200) / 50, 1);
    }
    // Half the prescaler counts half as fast from where the counter stands.
    bench.configure(&["SAP 210, 0, 12800", "SAP 209, 0, 1000000"]);
    go(&mut bench, 50_000);
    assert_near("encoder at half the prescaler", bench.ok("GAP 209, 0"), 1_025_000, 50);
}

/// GIO 11, 0: within four counts of the absolute zero point, 200 microsteps either way.
#[test]
fn near_the_absolute_zero_point() {
    let mut bench = Bench::new();
    for (target, near) in
        [(0, 1), (150, 1), (225, 1), (275, 0), (300, 0), (25_600, 0), (50_900, 0), (51_050, 1), (51_200, 1)]
    {
        go(&mut bench, target);
        assert_eq!(bench.ok("GIO 11, 0"), near, "at {target}");
    }
}

#[test]
fn the_external_encoder_counts_microsteps() {
    let mut bench = Bench::in_world(ABN);
    bench.configure(&["SAP 217, 0, 3264"]);
    // 3264 / 512 = 6.375 per count, 8 000 counts a turn; bits 2 to 4 are not prescaler.
    for turns in [1, -2] {
        go(&mut bench, turns * 51_200);
        assert_near("external encoder", bench.ok("GAP 216, 0"), turns * 51_000, 10);
    }
    // A thousand full-speed turns of the 16-bit counter: 8 million counts.
    bench.configure(&["SAP 4, 0, 2047", "SAP 216, 0, 0"]);
    let start = bench.ok("GAP 1, 0");
    bench.ok("MVP REL, 0, 5120000");
    bench.run_until(200 * SECOND, |b| b.ok("GAP 8, 0") == 1);
    assert_near("a hundred turns", bench.ok("GAP 216, 0"), 5_100_000, 10);
    assert_eq!(bench.ok("GAP 1, 0") - start, 5_120_000);
}

/// Bits of parameter 217: 4 zeroes at the next N event, with 8 at every one; 16 says which edge. The N track
/// is high for the one count at each turn's start: rising it is passed at count 0, falling at 1 (upwards).
#[test]
fn the_external_encoder_is_zeroed_by_its_null_track() {
    for (bits, zero_at, again) in [(4 + 16, 51_200, false), (4 + 8 + 16, 51_200, true), (4, 51_206, false)] {
        let mut bench = Bench::in_world(ABN);
        bench.configure(&["MVP ABS, 0, 20000"]);
        bench.run(2 * SECOND);
        bench.configure(&[&format!("SAP 217, 0, {}", 3264 + bits), "SAP 216, 0, 500000"]);
        go(&mut bench, 45_000);
        assert_near("before", bench.ok("GAP 216, 0"), 500_000 + 25_000 * 255 / 256, 14);
        go(&mut bench, 80_000);
        // 6.375 microsteps a count in place of 6.4.
        let factor = |steps: i32| steps * 255 / 256;
        assert_near("after", bench.ok("GAP 216, 0"), factor(80_000 - zero_at), 14);
        go(&mut bench, 130_000);
        let expected = if again { factor(130_000 - 2 * zero_at) } else { factor(130_000 - zero_at) };
        assert_near("a turn later", bench.ok("GAP 216, 0"), expected, 14);
        assert_eq!(bench.ok("GAP 217, 0"), 3264 + bits);
    }
}

/// A stored parameter 217 that asks for the next N event has it zero the encoder after a power cycle and after a
/// restart as well. The N track is passed at 51 200; a count is 6.375 microsteps in place of 6.4.
#[test]
fn a_stored_null_setting_waits_for_its_event_after_each_start() {
    for restart in [false, true] {
        let mut bench = Bench::in_world(ABN);
        bench.configure(&["SAP 217, 0, 3284", "STAP 217, 0"]);
        if restart {
            bench.ok("255, 0, 0, 1234");
            bench.run(2 * SECOND);
        } else {
            bench.power_cycle();
        }
        go(&mut bench, 20_000);
        bench.ok("SAP 216, 0, 500000");
        go(&mut bench, 80_000);
        assert_near("after the event", bench.ok("GAP 216, 0"), (80_000 - 51_200) * 255 / 256, 14);
    }
}

/// Global parameter 90: the motor turns the other way, and both encoders count along with the position.
#[test]
fn the_reversed_shaft() {
    for world in ["", ABN] {
        let mut bench = Bench::in_world(world);
        bench.configure(&["SGP 90, 0, 1", "SAP 217, 0, 3264", "SAP 212, 0, 2000"]);
        go(&mut bench, 40_000);
        assert_eq!(bench.rotor(), -40_000);
        assert_near("built-in", bench.ok("GAP 209, 0"), 40_000, 50);
        if !world.is_empty() {
            assert_near("external", bench.ok("GAP 216, 0"), 40_000 * 510 / 512, 14);
        }
        assert_eq!(bench.ok("GAP 207, 0"), 0);
        bench.power_cycle();
        go(&mut bench, -10_000);
        assert_near("after a power cycle", bench.ok("GAP 209, 0"), -10_000, 50);
    }
}

/// A reference search makes both encoders zero where it makes the position zero, because deviations count from there.
/// The external encoder needs the pins of the switches, so the search by them finds one that stands at a number of its
/// own.
#[test]
fn a_reference_search_zeroes_both_encoders() {
    let mut bench = Bench::in_world("[motor]\nstart = 10000\n[stage]\nleft = -30000\nright = 200000\n");
    bench.configure(&["SAP 193, 0, 1", "SAP 194, 0, 500", "SAP 195, 0, 100"]);
    go(&mut bench, 7_000);
    bench.configure(&["SAP 216, 0, 123456", "SAP 209, 0, -98765", "RFS START, 0"]);
    bench.run_until(60 * SECOND, |bench| bench.ok("RFS STATUS, 0") == 0);
    assert_eq!((bench.ok("GAP 1, 0"), bench.ok("GAP 216, 0")), (0, 0));
    assert_near("built-in", bench.ok("GAP 209, 0"), 0, 50);
    go(&mut bench, 20_000);
    assert_near("built-in", bench.ok("GAP 209, 0"), 20_000, 50);
}

/// Zeroing is exact at full speed, ten counts of the built-in encoder and 78 of the external one between two polls,
/// whichever way the shaft counts.
#[test]
fn zeroing_is_exact_at_speed() {
    for reverse in [0, 1] {
        let mut bench = Bench::in_world(ABN);
        bench.configure(&[&format!("SGP 90, 0, {reverse}"), "SAP 154, 0, 0", "SAP 4, 0, 2047"]);
        bench.configure(&["SAP 210, 0, 25604", "SAP 217, 0, 3292"]);
        for target in [123_456, -234_567, 345_678] {
            go(&mut bench, target);
            assert_eq!(bench.lost_steps(), 0);
            // 1024 counts a turn.
            let angle = bench.ok("GAP 215, 0") * if reverse == 0 { 50 } else { -50 };
            assert_eq!(bench.ok("GAP 209, 0").rem_euclid(51_200), angle.rem_euclid(51_200), "to {target}");
            // From the track's edge, which is within a count of each turn's start: 6.375 microsteps where 6.4 were.
            let turn =
                if bench.ok("GAP 216, 0") < 0 { target.rem_euclid(51_200) - 51_200 } else { target.rem_euclid(51_200) };
            assert_near("external", bench.ok("GAP 216, 0"), turn * 255 / 256, 14);
        }
    }
}

/// Each N event clears the position of the external encoder, also while a program is busy. Between the polls that look
/// at the inputs its slices must not use up what the encoder has noted. A lost event would show as a second turn.
#[test]
fn no_null_event_is_lost_while_a_program_is_busy() {
    const TURN: i32 = 51_200;
    let mut bench = Bench::in_world(ABN);
    bench.ok("132, 0, 0, 0");
    for line in ["GAP 1, 0", "JA 0"] {
        assert_eq!(bench.ask(line).0, 101);
    }
    bench.ok("133");
    bench.ok("129, 1, 0, 0");
    // Prescaler of 2000 lines; bits 2 and 3: clear at each N event.
    bench.ok("SAP 217, 0, 3276");
    bench.ok("SAP 154, 0, 0");
    bench.ok("SAP 5, 0, 2047");
    bench.ok("ROR 0, 300");
    bench.run(SECOND);
    let mut turns = 0;
    let mut before = bench.ok("GAP 216, 0");
    for _ in 0..10_000 {
        bench.run(MILLISECOND);
        let position = bench.ok("GAP 216, 0");
        assert!(position < TURN * 11 / 10, "{position} after {turns} turns");
        turns += i32::from(position < before);
        before = position;
    }
    assert!(turns > 25, "{turns}");
}
