//! How many turns are left out. Nobody but a clock on the wall sees that, so here it is counted: the times at which a
//! module tells that it acts next.

use common::Bench;
use hal_sim::clock::SECOND;
use tmcm_sim::{Product, VirtualModule};

/// Lets twenty seconds pass, and counts the times at which the module acts.
fn events(bench: &mut Bench) -> usize {
    let (mut events, end) = (0, bench.module.now() + 20 * SECOND);
    loop {
        let next = bench.module.next_event().unwrap();
        if next > end {
            return events;
        }
        bench.module.run_until(next);
        events += 1;
    }
}

/// The most turns that are left out at once are 10 000. So a module that rests acts once within 20 seconds, and one
/// whose motor turns three times or, where a rotation of readings takes longer, twice. Where the position of a TMC5160
/// is seen to leap when it differs by 2^14 microsteps, half of that is left out: 410 ms at 20 000 pps.
#[test]
fn turns_in_which_nothing_happens_are_left_out() {
    for (product, speed, turning) in [
        (Product::Tmcm1140, 650, 3),
        (Product::Tmcm1110, 650, 3),
        (Product::Tmcm3110, 650, 2),
        (Product::Tmcm3212, 20_000, 49),
        (Product::Tmcm6110, 650, 2),
    ] {
        for (command, expected) in [
            ("GAP 1, 0", 1),
            ("MVP ABS, 0, 1000", 1),
            ("ROR 0, %", turning),
            ("ROL 0, %", turning),
            ("MVP ABS, 0, 1000000", turning),
            ("MVP ABS, 0, -1000000", turning),
        ] {
            let mut bench = Bench::of(product);
            bench.ok(&format!("SAP 4, 0, {speed}"));
            bench.ok(&command.replace('%', &speed.to_string()));
            bench.run(5 * SECOND);
            assert_eq!(events(&mut bench), expected, "{product:?}, {command}");
        }
    }
}

/// While a program is busy each turn is polled, and those of its next wait are left out all the same. Of this program's
/// 10 000 rounds of three commands each turn has 128 commands: that takes 235 turns, of which the first may be over
/// with the reply. From the turn on that finds it waiting, for 100 seconds, a rotation of 64 turns and one more are
/// polled, then 10 000 turns are left out.
#[test]
fn turns_behind_a_program_that_was_busy_are_left_out() {
    let mut bench = Bench::new();
    bench.ok("132, 0, 0, 0");
    for line in ["CALC LOAD, 0", "CALC ADD, 1", "COMP 10000", "JC LT, 1", "WAIT TICKS, 0, 10000", "JA 0"] {
        bench.ask(line);
    }
    bench.ok("133, 0, 0, 0");
    bench.run(5 * SECOND);
    bench.ok("129, 0, 0, 0");
    let mut busy = 0;
    while !bench.module.machine().unwrap().waits() {
        let next = bench.module.next_event().unwrap();
        bench.module.run_until(next);
        busy += 1;
    }
    assert!((230..=235).contains(&busy), "{busy}");
    assert_eq!(events(&mut bench), 65 + 1);
}

/// A program that waits does nothing meanwhile, but for its timers. These act at the ends of their periods, four in the
/// time of the test. From each of them on a rotation of 64 turns and two more are polled. A timer that is not enabled
/// does not count, nor one without a period.
#[test]
fn turns_in_which_a_program_waits_are_left_out() {
    for (settings, expected) in
        [(&[][..], 1), (&["SGP 0, 3, 3000"], 1), (&["EI 0", "EI 1"], 1), (&["SGP 2, 3, 6000", "EI 2"], 4 * 66)]
    {
        let mut bench = Bench::new();
        bench.ok("132, 0, 0, 0");
        for line in settings.iter().chain(&["VECT 0, 90", "EI 255", "WAIT TICKS, 0, 6000"]) {
            bench.ask(line);
        }
        bench.configure(&["133, 0, 0, 0", "129, 0, 0, 0"]);
        bench.run(5 * SECOND);
        assert_eq!(events(&mut bench), expected, "{settings:?}");
    }
}
