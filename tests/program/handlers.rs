//! A module with three handlers that count what calls them: interrupts 39 to 41, raised by hand at the inputs 0 to 2.

use common::Bench;
use hal_sim::clock::MILLISECOND;

/// Where the handlers of interrupts 39, 40 and 41 are.
pub(crate) const HANDLERS: [i32; 3] = [100, 120, 140];

/// A module whose inputs raise interrupts with every rising edge; handler n counts in variable n. It is all set by
/// the host; only the program is missing.
pub(crate) fn prepared() -> Bench {
    let mut bench = Bench::new();
    for (input, address) in HANDLERS.into_iter().enumerate() {
        let [read, write] = [format!("GGP {input}, 2"), format!("AGP {input}, 2")];
        bench.download(address, &[&read, "CALC ADD, 1", &write, "RETI"]);
    }
    set_up(&mut bench);
    bench
}

pub(crate) fn set_up(bench: &mut Bench) {
    for (input, address) in HANDLERS.into_iter().enumerate() {
        let interrupt = 39 + input;
        bench.ok(&format!("SGP {interrupt}, 3, 1"));
        bench.ok(&format!("VECT {interrupt}, {address}"));
        bench.ok(&format!("EI {interrupt}"));
    }
    bench.ok("EI 255");
}

/// Starts a program that does nothing else.
pub(crate) fn idling(bench: &mut Bench) {
    bench.download(0, &["JA 0"]);
    bench.start(0);
    bench.run(5 * MILLISECOND);
}

/// A rising edge at each of these inputs, all at the same time.
pub(crate) fn raise(bench: &mut Bench, inputs: &[usize]) {
    for level in [0, 1] {
        for input in inputs {
            bench.control(&format!("input {input} {level}"));
        }
        bench.run(5 * MILLISECOND);
    }
}

pub(crate) fn counts(bench: &mut Bench) -> [i32; 3] {
    [0, 1, 2].map(|n| bench.variable(n))
}
