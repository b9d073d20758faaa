//! When the motor current changes.

use common::Bench;
use hal_sim::clock::SECOND;

/// The poll, counted from the first in which the motor stands, in which `done` is true first.
fn first_poll(bench: &mut Bench, done: impl Fn(&Bench) -> bool) -> usize {
    // A move to where it stands: full current, and with the next poll it stands again.
    bench.tell("MVP ABS, 0, 0");
    assert!(!done(bench));
    (0..10_000)
        .find(|_| {
            bench.poll(1);
            done(bench)
        })
        .expect("never")
}

/// Parameters 214 and 204 count hundredths of a second: ten polls each, from the first in which the motor stands.
#[test]
fn power_down_and_freewheeling_come_in_their_poll() {
    for delay in [1, 2, 10, 200] {
        let mut bench = Bench::new();
        bench.ok(&format!("SAP 214, 0, {delay}"));
        bench.run(3 * SECOND);
        for phase in 0..5 {
            bench.poll(phase);
            assert_eq!(first_poll(&mut bench, |bench| bench.current() == 2), 10 * delay, "214, phase {phase}");
        }
        bench.ok(&format!("SAP 204, 0, {delay}"));
        bench.ok("SAP 214, 0, 65535");
        for phase in 0..5 {
            bench.poll(phase);
            assert_eq!(first_poll(&mut bench, |bench| bench.current() == 0), 10 * delay, "204, phase {phase}");
        }
    }
}

/// Whether the driver may change the current by itself: coolStep's lower threshold is not 0.
fn cool_step(bench: &Bench) -> bool {
    bench.module.board().borrow().tmc262(0).registers().smarten & 0xF != 0
}

/// A motor that turns at the speed of parameter 182 has the run current, 21/32, and coolStep. One slower by the
/// smallest step there is has the slow run current, 7/32, and no coolStep. This holds whichever way it turns, in
/// velocity mode and on a move, and when the parameter changes as well.
#[test]
fn at_the_threshold_speed_the_run_current_flows_and_below_it_the_slow_one() {
    for line in ["ROR 0, 300", "ROL 0, 300", "MVP ABS, 0, 90000000", "MVP ABS, 0, -90000000"] {
        let mut bench = Bench::new();
        for setting in ["SAP 6, 0, 160", "SAP 183, 0, 48", "SAP 172, 0, 2", "SAP 168, 0, 0", "SAP 4, 0, 300", line] {
            bench.ok(setting);
        }
        bench.run(SECOND / 2);
        for (threshold, current, cool) in [(299, 21, true), (300, 21, true), (301, 7, false), (300, 21, true)] {
            bench.ok(&format!("SAP 182, 0, {threshold}"));
            bench.poll(10);
            assert_eq!((bench.scale(), cool_step(&bench)), (current, cool), "{line}, parameter 182 at {threshold}");
        }
        // With no slow run current the run current flows, below the threshold as well.
        for setting in ["SAP 182, 0, 301", "SAP 183, 0, 0"] {
            bench.ok(setting);
        }
        bench.poll(10);
        assert_eq!((bench.scale(), cool_step(&bench)), (21, false), "{line}, parameter 183 at 0");
    }
}

/// The boost current flows up to the very speed, and then it is that speed which decides, also where the ramp ends at
/// the speed of parameter 182.
#[test]
fn where_a_ramp_ends_at_the_threshold_speed_the_run_current_follows_the_boost() {
    for (speed, current) in [(299, 7), (300, 21), (-299, 7), (-300, 21)] {
        let mut bench = Bench::new();
        for setting in ["SAP 6, 0, 160", "SAP 183, 0, 48", "SAP 200, 0, 80", "SAP 182, 0, 300", "SAP 5, 0, 100"] {
            bench.ok(setting);
        }
        bench.tell(&format!("ROR 0, {speed}"));
        let chip = |bench: &Bench| bench.module.board().borrow().tmc429(0).velocity(0);
        while chip(&bench) != speed {
            assert_eq!(bench.scale(), 11, "at {} on the way to {speed}", chip(&bench));
            bench.poll(1);
        }
        bench.poll(10);
        assert_eq!(bench.scale(), current, "at {speed}");
    }
}
