//! Accumulator, X register, arithmetic flags and error flags in programs (manual section 3.7).

use common::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};

// ---- calculating

/// Operation by operation, each with the accumulator before and after.
#[test]
fn calc_calculates_with_the_accumulator() {
    for (before, operation, after) in [
        (7, "CALC ADD, 5", 12),
        (i32::MAX, "CALC ADD, 1", i32::MIN),
        (7, "CALC SUB, 9", -2),
        (i32::MIN, "CALC SUB, 1", i32::MAX),
        (-7, "CALC MUL, -5000", 35_000),
        (0x10000, "CALC MUL, 65537", 0x10000),
        (-7, "CALC DIV, 2", -3),
        (7, "CALC DIV, 0", 0),
        (i32::MIN, "CALC DIV, -1", i32::MIN),
        (-7, "CALC MOD, 3", -1),
        (7, "CALC MOD, 0", 7),
        (i32::MIN, "CALC MOD, -1", 0),
        (0b1100, "CALC AND, 10", 0b1000),
        (0b1100, "CALC OR, 10", 0b1110),
        (0b1100, "CALC XOR, 10", 0b0110),
        (5, "CALC NOT, 99", !5),
        (5, "CALC LOAD, -99", -99),
    ] {
        let mut bench = Bench::played(&[&format!("CALC LOAD, {before}"), operation, "AGP 1, 2", "STOP"]);
        assert_eq!((bench.accumulator(), bench.variable(1), bench.x()), (after, after, 0), "{before}: {operation}");
    }
}

/// Accumulator and X before and after.
#[test]
fn calcx_calculates_with_both_registers() {
    for (before, operation, after) in [
        ((20, 6), "CALCX ADD", (26, 6)),
        ((20, 6), "CALCX SUB", (14, 6)),
        ((20, -6), "CALCX MUL", (-120, -6)),
        ((20, 6), "CALCX DIV", (3, 6)),
        ((20, 0), "CALCX DIV", (0, 0)),
        ((i32::MIN, -1), "CALCX DIV", (i32::MIN, -1)),
        ((20, 6), "CALCX MOD", (2, 6)),
        ((20, 0), "CALCX MOD", (20, 0)),
        ((0b1100, 0b1010), "CALCX AND", (0b1000, 0b1010)),
        ((0b1100, 0b1010), "CALCX OR", (0b1110, 0b1010)),
        ((0b1100, 0b1010), "CALCX XOR", (0b0110, 0b1010)),
        ((20, 6), "CALCX NOT", (20, !6)),
        ((20, 6), "CALCX LOAD", (20, 20)),
        ((20, 6), "CALCX SWAP", (6, 20)),
    ] {
        let load = [format!("CALC LOAD, {}", before.1), format!("CALC LOAD, {}", before.0)];
        let mut bench = Bench::played(&[&load[0], "CALCX LOAD", &load[1], operation, "STOP"]);
        assert_eq!((bench.accumulator(), bench.x()), after, "{before:?}: {operation}");
    }
}

#[test]
fn operations_that_do_not_exist_change_nothing() {
    for line in ["19, 10, 0, 5", "19, 255, 0, 5", "33, 11, 0, 0", "33, 255, 0, 0"] {
        let mut bench = Bench::played(&["CALC LOAD, 3", "CALCX LOAD", "CALC LOAD, 4", line, "SGP 1, 2, 1", "STOP"]);
        assert_eq!((bench.accumulator(), bench.x(), bench.variable(1)), (4, 3, 1), "{line}");
    }
}

// ---- conditions

/// Whether a program jumps on a condition after these commands.
fn jumps(bench: &mut Bench, before: &[&str], condition: &str) -> bool {
    let target = before.len() + 3;
    let jump = format!("JC {condition}, {target}");
    let mut program = before.to_vec();
    program.extend([&jump, "SGP 9, 2, 1", "STOP", "SGP 9, 2, 2", "STOP"]);
    bench.download(0, &program);
    bench.ok("SGP 9, 2, 0");
    bench.run_to_end(0);
    let way = bench.variable(9);
    assert!([1, 2].contains(&way), "JC {condition}: it went nowhere");
    way == 2
}

const CONDITIONS: [&str; 8] = ["ZE", "NZ", "EQ", "NE", "GT", "GE", "LT", "LE"];

/// Every condition of a comparison, true and false: compared values and the conditions that hold.
#[test]
fn conditions_after_comp() {
    let mut bench = Bench::new();
    let less: &[&str] = &["NZ", "NE", "LT", "LE"];
    let equal: &[&str] = &["ZE", "EQ", "GE", "LE"];
    let greater: &[&str] = &["NZ", "NE", "GT", "GE"];
    for (accumulator, operand, expected) in [
        (4, 5, less),
        (5, 5, equal),
        (6, 5, greater),
        (-1, 1, less),
        (1, -1, greater),
        (0, 0, equal),
        // The difference does not fit 32 bits.
        (i32::MIN, i32::MAX, less),
        (i32::MAX, i32::MIN, greater),
        (i32::MIN, i32::MIN, equal),
        (i32::MIN, 0, less),
        (0, i32::MIN, greater),
    ] {
        let before = [format!("CALC LOAD, {accumulator}"), format!("COMP {operand}")];
        for condition in CONDITIONS {
            let taken = jumps(&mut bench, &before.each_ref().map(String::as_str), condition);
            assert_eq!(taken, expected.contains(&condition), "{accumulator}, COMP {operand}, JC {condition}");
        }
        assert_eq!(bench.accumulator(), accumulator, "COMP leaves the accumulator");
    }
}

/// Whatever loads the accumulator sets ZERO; the result of the last comparison stays.
#[test]
fn zero_follows_what_is_loaded_and_the_rest_the_comparison() {
    let mut bench = Bench::in_world("[supply]\nanalog = 77\n");
    bench.ok("SGP 1, 2, -5");
    for (line, zero) in [
        ("CALC LOAD, 0", true),
        ("CALC LOAD, 1", false),
        ("CALC ADD, -3", true),
        ("CALC SUB, 4", false),
        ("CALC MUL, 0", true),
        ("CALC DIV, 0", true),
        ("CALC DIV, 3", false),
        ("CALC MOD, 3", true),
        ("CALC AND, 4", true),
        ("CALC OR, 0", false),
        ("CALC XOR, 3", true),
        ("CALC NOT, 0", false),
        ("CALCX ADD", false),
        ("CALCX SUB", true),
        ("CALCX MUL", false),
        ("CALCX DIV", false),
        ("CALCX MOD", true),
        ("CALCX AND", false),
        ("CALCX OR", false),
        ("CALCX XOR", true),
        ("CALCX SWAP", false),
        ("GAP 1, 0", true),
        ("GAP 4, 0", false),
        ("GGP 2, 2", true),
        ("GGP 1, 2", false),
        ("GGP 66, 0", false),
        ("GGP 0, 3", true),
        ("GIO 1, 2", true),
        ("GIO 0, 1", false),
        ("GCO 1, 0", true),
        ("GCO 2, 0", false),
        ("RFS STATUS, 0", true),
    ] {
        // X is 3, the accumulator is 3 and has been found greater than 2.
        let before = ["SCO 2, 0, 9", "CALC LOAD, 3", "CALCX LOAD", "COMP 2", line];
        assert_eq!(jumps(&mut bench, &before, "ZE"), zero, "{line}: ZE");
        assert_eq!(jumps(&mut bench, &before, "NZ"), !zero, "{line}: NZ");
        for (condition, holds) in
            [("EQ", false), ("NE", true), ("GT", true), ("GE", true), ("LT", false), ("LE", false)]
        {
            assert_eq!(jumps(&mut bench, &before, condition), holds, "{line}: {condition}");
        }
    }
}

/// A swapped zero is a zero, too.
#[test]
fn a_swap_loads_the_accumulator() {
    let mut bench = Bench::new();
    assert!(jumps(&mut bench, &["CALC LOAD, 0", "CALCX LOAD", "CALC LOAD, 5", "CALCX SWAP"], "ZE"));
}

/// Commands that do not load the accumulator leave ZERO as it was, and the other flags.
#[test]
fn other_commands_leave_the_flags() {
    let mut bench = Bench::new();
    for line in [
        "SAP 4, 0, 1000",
        "SGP 1, 2, 0",
        "SIO 0, 2, 0",
        "SCO 1, 0, 0",
        "MST 0",
        "AGP 3, 2",
        "ACO 3, 0",
        "CALCX LOAD",
        "CALCX NOT",
        "CLE ALL",
        "EI 5",
        "DI 5",
        "VECT 0, 100",
        "WAIT TICKS, 0, 1",
        "RSGP 2, 2",
        "RSAP 4, 0",
        // These fail, and change nothing at all.
        "GAP 255, 0",
        "GAP 1, 1",
        "GGP 64, 0",
        "GIO 5, 0",
        "GCO 21, 0",
        "19, 10, 0, 0",
        "99, 0, 0, 0",
    ] {
        for (operand, zero) in [(2, false), (3, true)] {
            let compare = format!("COMP {operand}");
            let before = ["CALC LOAD, 3", &compare, line];
            assert_eq!(jumps(&mut bench, &before, "ZE"), zero, "{line}");
            assert_eq!(jumps(&mut bench, &before, "GT"), !zero, "{line}");
            assert_eq!(bench.accumulator(), 3, "{line}");
        }
    }
}

#[test]
fn conditions_that_do_not_exist_are_not_met() {
    let mut bench = Bench::played(&["CALC LOAD, 1", "21, 13, 0, 5", "21, 255, 0, 5", "SGP 1, 2, 1", "STOP", "STOP"]);
    assert_eq!((bench.variable(1), bench.accumulator()), (1, 1));
}

// ---- error flags

/// Runs `before`, lets `event` happen while it waits, and gives the error flags then seen by JC: ETO, EAL, EDV, EPO.
fn error_flags(world: &str, before: &[&str], event: impl Fn(&mut Bench), after: &str) -> [bool; 4] {
    ["ETO", "EAL", "EDV", "EPO"].map(|condition| {
        let mut bench = Bench::in_world(world);
        let mut program = before.to_vec();
        program.extend(["WAIT TICKS, 0, 200", after]);
        let target = program.len() + 3;
        let jump = format!("JC {condition}, {target}");
        program.extend([&jump, "SGP 9, 2, 1", "STOP", "SGP 9, 2, 2", "STOP"]);
        bench.download(0, &program);
        bench.start(0);
        bench.run(SECOND);
        event(&mut bench);
        bench.await_end();
        bench.variable(9) == 2
    })
}

/// A driver alarm is an external alarm.
#[test]
fn eal_after_over_temperature_or_a_short() {
    for fault in ["overtemperature", "short-a", "short-b"] {
        let happens = |bench: &mut Bench| {
            bench.control(&format!("fault {fault} on"));
            bench.run(100 * MILLISECOND);
            bench.control(&format!("fault {fault} off"));
            bench.run(100 * MILLISECOND);
        };
        let spin: &[&str] = &["ROR 0, 500"];
        assert_eq!(error_flags("", spin, happens, "CALC ADD, 0"), [false, true, false, false], "{fault}");
        for (clear, stays) in [("CLE ALL", false), ("CLE EAL", false), ("CLE ETO", true), ("CLE EDV", true)] {
            assert_eq!(error_flags("", spin, happens, clear), [false, stays, false, false], "{fault}, {clear}");
        }
    }
    assert_eq!(error_flags("", &["ROR 0, 500"], |_| {}, "CALC ADD, 0"), [false; 4]);
}

/// Parameter 212 notices a slip of eight full steps, 2 048 microsteps.
#[test]
fn edv_after_a_deviation() {
    let supervised: &[&str] = &["SAP 212, 0, 1000", "ROR 0, 300"];
    let slip = |bench: &mut Bench| bench.control("slip -8");
    for (after, set) in
        [("CALC ADD, 0", true), ("CLE ALL", false), ("CLE EDV", false), ("CLE EAL", true), ("CLE EPO", true)]
    {
        assert_eq!(error_flags("", supervised, slip, after), [false, false, set, false], "{after}");
    }
    let unsupervised: &[&str] = &["ROR 0, 300"];
    assert_eq!(error_flags("", unsupervised, slip, "CALC ADD, 0"), [false; 4]);
}

/// A positioning that a stop switch or a stall has ended before its target.
#[test]
fn epo_when_a_positioning_ends_early() {
    let stage = "[stage]\nright = 20000\n";
    for (after, set) in
        [("CALC ADD, 0", true), ("CLE ALL", false), ("CLE EPO", false), ("CLE EDV", true), ("CLE ESD", true)]
    {
        let flags = error_flags(stage, &["SAP 12, 0, 0", "MVP ABS, 0, 30000"], |_| {}, after);
        assert_eq!(flags, [false, false, false, set], "{after}");
    }
    let stall = |bench: &mut Bench| bench.control("load 1");
    let long: &[&str] = &["SAP 174, 0, 1", "SAP 181, 0, 500", "MVP ABS, 0, 10000000"];
    assert_eq!(error_flags("", long, stall, "CALC ADD, 0"), [false, false, false, true]);
    // Neither an arrival nor a rotation against the switch is an error of position.
    assert_eq!(error_flags(stage, &["SAP 12, 0, 0", "MVP ABS, 0, 10000"], |_| {}, "CALC ADD, 0"), [false; 4]);
    assert_eq!(error_flags(stage, &["SAP 12, 0, 0", "ROR 0, 500"], |_| {}, "CALC ADD, 0"), [false; 4]);
    // A new target on the way, or a stop by command.
    assert_eq!(error_flags("", &["MVP ABS, 0, 900000", "MST 0"], |_| {}, "CALC ADD, 0"), [false; 4]);
}

/// Error flags stay over the end of a program and its next start; command 131 clears them.
#[test]
fn error_flags_stay_until_cleared() {
    let mut bench = Bench::new();
    bench.download(0, &["WAIT RFS, 0, 0", "WAIT REFSW, 0, 1", "STOP"]);
    bench.run_to_end(0);
    assert!(jumps(&mut bench, &[], "ETO"));
    assert!(jumps(&mut bench, &[], "ETO"));
    bench.ok("131");
    assert!(!jumps(&mut bench, &[], "ETO"));
    // CLE also works from the host.
    bench.download(0, &["WAIT REFSW, 0, 1", "STOP"]);
    bench.run_to_end(0);
    bench.ok("CLE EPO");
    assert!(jumps(&mut bench, &[], "ETO"));
    bench.ok("CLE ETO");
    assert!(!jumps(&mut bench, &[], "ETO"));
}
