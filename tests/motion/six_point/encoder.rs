//! The ABN encoder of an axis, which the chip counts (parameters 199, 201, 209, 210 and 212).

use common::Bench;
use hal_sim::clock::SECOND;
use tmcm_sim::Product;

/// An encoder of 1000 lines, 4000 counts in a turn of 51 200 microsteps.
fn bench() -> Bench {
    let mut bench = Bench::of_in_world(Product::Tmcm3212, "[abn]\nlines = 1000\n");
    bench.configure(&["SAP 210, 0, 4000", "SAP 5, 0, 500000", "SAP 17, 0, 500000"]);
    bench
}

#[test]
fn the_encoder_follows_the_motor() {
    let mut bench = bench();
    for target in [51_200, -20_000] {
        bench.ok(&format!("MVP ABS, 0, {target}"));
        bench.run(5 * SECOND);
        // A count is 12.8 microsteps.
        let seen = bench.ok("GAP 209, 0");
        assert!((seen - target).abs() <= 13, "{seen} at {target}");
    }
    bench.ok("SAP 209, 0, 777");
    assert_eq!(bench.ok("GAP 209, 0"), 777);
}

/// With a reversed shaft (251) motor and encoder count the other way, so they agree.
#[test]
fn the_encoder_turns_round_with_the_shaft() {
    let mut bench = bench();
    bench.configure(&["SAP 251, 0, 1", "MVP ABS, 0, 51200"]);
    bench.run(5 * SECOND);
    assert!((bench.rotor() + 51_200).abs() <= 1, "{}", bench.rotor());
    let seen = bench.ok("GAP 209, 0");
    assert!((seen - 51_200).abs() <= 13, "{seen}");
}

/// A rotor that is held deviates: the motor stops, and bit 1 of parameter 207 tells why. When the encoder has been told
/// where the motor is, a motion command moves it again.
#[test]
fn a_deviation_stops_the_motor() {
    let mut bench = bench();
    bench.configure(&["SAP 212, 0, 1000", "ROR 0, 20000"]);
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 20_000);
    bench.control("load 1");
    bench.run(SECOND);
    assert_eq!(["GAP 3, 0", "GAP 207, 0"].map(|line| bench.ok(line)), [0, 2]);
    bench.control("load 0");
    let position = bench.ok("GAP 1, 0");
    bench.ok(&format!("SAP 209, 0, {position}"));
    bench.ok("ROL 0, 20000");
    bench.run(SECOND);
    assert_eq!(["GAP 3, 0", "GAP 207, 0"].map(|line| bench.ok(line)), [-20_000, 0]);
}

/// A reading of the deviation that is older than what ends it does not stop the next motion.
#[test]
fn a_deviation_ends_with_its_cause() {
    for (phase, ends) in (0..40).flat_map(|phase| [(phase, "SAP 212, 0, 0"), (phase, "SAP 209, 0, #")]) {
        let mut bench = bench();
        bench.configure(&["SAP 212, 0, 1000", "ROR 0, 20000"]);
        bench.run(SECOND);
        bench.control("load 1");
        bench.run(SECOND + phase * 500_000);
        bench.control("load 0");
        let position = bench.ok("GAP 1, 0");
        bench.ok(&ends.replace('#', &position.to_string()));
        bench.ok("ROL 0, 20000");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), -20_000, "{ends}, {phase}");
    }
}

/// The chip has 16 bits before the point, with the sign: more is limited.
#[test]
fn an_encoder_of_few_counts_does_not_count_backwards() {
    for settings in [["SAP 210, 0, 1", "SAP 202, 0, 200"], ["SAP 202, 0, 65535", "SAP 210, 0, 300"]] {
        let mut bench = Bench::of_in_world(Product::Tmcm3212, "[abn]\nlines = 1\n");
        bench.configure(&settings);
        bench.ok("MVP ABS, 0, 51200");
        bench.run(5 * SECOND);
        // Four counts of 32 767.99998 microsteps.
        let seen = bench.ok("GAP 209, 0");
        assert!((131_000..=131_072).contains(&seen), "{settings:?}: {seen}");
    }
}

/// MVP REL from the encoder's position (parameter 127).
#[test]
fn a_relative_move_may_count_from_the_encoder() {
    let mut bench = bench();
    bench.configure(&["SAP 209, 0, 5000", "SAP 127, 0, 2"]);
    assert_eq!(bench.ok("MVP REL, 0, 1000"), 6_000);
    bench.run(5 * SECOND);
    assert_eq!(bench.ok("GAP 1, 0"), 6_000);
}
