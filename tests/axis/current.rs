//! When the motor current changes.

use crate::common::Bench;
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
