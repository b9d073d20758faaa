//! How many turns are left out. Nobody but a clock on the wall sees that, so here it is counted: the times at which a module
//! tells that it acts next.

use crate::common::Bench;
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

/// The most turns that are left out at once are 10 000. So a module that rests acts once within 20 seconds, and one whose motor
/// turns three times or, where a rotation of readings takes longer, twice. Where the position of a TMC5160 is seen to leap
/// when it differs by 2^14 microsteps, half of that is left out: 410 ms at 20 000 pps.
#[test]
fn turns_in_which_nothing_happens_are_left_out() {
    for (product, speed, turning) in [
        (Product::Tmcm1140, 650, 3),
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

/// A program that waits does nothing meanwhile, but for its timers: these act at the ends of their periods, four in the time of
/// the test, and from each of them on a rotation of 64 turns and two more are polled. A timer that is not enabled does not
/// count, nor one without a period.
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
