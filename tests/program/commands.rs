//! Programs and the rest of the module: parameters, ports, coordinates and motion, what is stored, and the host that
//! looks on (manual sections 3.6.5, 3.7 and 8.6).

use common::program::{RUNNING, STOPPED};
use common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm_sim::VirtualModule;

// ---- what loads the accumulator

#[test]
fn commands_that_read_load_the_accumulator() {
    let mut bench = Bench::in_world("[supply]\nvolts = 12.3\ntemperature = -7\nanalog = 1234\n");
    for line in ["SAP 5, 0, 321", "SGP 200, 2, -9", "SGP 39, 3, 2", "SCO 20, 0, -77", "SAP 1, 0, 4444", "SIO 1, 2, 1"] {
        bench.ok(line);
    }
    for (line, value) in [
        ("GAP 5, 0", 321),
        ("GAP 1, 0", 4444),
        ("GAP 8, 0", 1),
        ("GGP 200, 2", -9),
        ("GGP 76, 0", 2),
        ("GGP 39, 3", 2),
        ("GGP 128, 0", RUNNING),
        // Where the program is: this very command.
        ("GGP 130, 0", 2),
        ("GIO 8, 1", 123),
        ("GIO 9, 1", -7),
        ("GIO 0, 1", 1234),
        ("GIO 1, 2", 1),
        ("GCO 20, 0", -77),
        ("RFS STATUS, 0", 0),
    ] {
        bench.download(0, &["CALC LOAD, 55", "CALCX LOAD", line, "AGP 1, 2", "STOP"]);
        bench.run_to_end(0);
        assert_eq!((bench.variable(1), bench.accumulator(), bench.x()), (value, value, 55), "{line}");
    }
}

/// The status of a reference search: not zero as long as it goes on, and ZERO says so, too.
#[test]
fn rfs_status_tells_when_the_search_is_over() {
    let mut bench = Bench::in_world("[stage]\nleft = -20000\n");
    bench.download(
        0,
        &["RFS START, 0", "RFS STATUS, 0", "AGP 1, 2", "RFS STATUS, 0", "JC NZ, 3", "AGP 2, 2", "GGP 132, 0", "STOP"],
    );
    bench.ok("SGP 132, 0, 0");
    bench.run_to_end(0);
    assert_ne!(bench.variable(1), 0);
    assert_eq!((bench.variable(2), bench.ok("RFS STATUS, 0")), (0, 0));
    // 20 000 microsteps at speed 500 take a good deal more than 100 ms.
    assert!(bench.accumulator() > 100);
    // Ended by the program.
    bench.download(0, &["RFS START, 0", "RFS STOP, 0", "RFS STATUS, 0", "STOP"]);
    bench.run_to_end(0);
    assert_eq!(bench.accumulator(), 0);
}

/// A read by the host does not reach the program that runs: neither its registers nor its flags.
#[test]
fn the_host_reads_without_disturbing_the_program() {
    let mut bench = Bench::new();
    // It compares over and over and notes whether anything ever differs: the accumulator, ZERO, EQ and X.
    let program = [
        "CALC LOAD, 0",
        "CALCX LOAD",
        "CALC LOAD, 7",
        "COMP 7",
        "WAIT TICKS, 0, 1",
        "JC NZ, 12",
        "JC NE, 12",
        "CALC SUB, 7",
        "JC NZ, 12",
        "CALCX ADD",
        "JC NZ, 12",
        "JA 2",
        "SGP 1, 2, 1",
        "STOP",
    ];
    bench.download(0, &program);
    bench.start(0);
    for round in 0..200 {
        for line in
            ["GAP 4, 0", "GAP 1, 0", "GGP 66, 0", "GGP 2, 2", "GIO 8, 1", "GCO 1, 0", "RFS STATUS, 0", "GGP 0, 3"]
        {
            bench.ok(line);
        }
        bench.run(round * 10 * MICROSECOND);
    }
    assert_eq!((bench.variable(1), bench.mode()), (0, RUNNING));
}

// ---- what takes the accumulator

#[test]
fn the_accumulator_goes_to_parameters_and_coordinates() {
    let mut bench = Bench::played(&[
        "CALC LOAD, 700",
        "AAP 4, 0",
        "AGP 82, 0",
        "AGP 255, 2",
        "AGP 2, 3",
        "ACO 0, 0",
        "ACO 20, 0",
        "AAP 0, 0",
        "STOP",
    ]);
    bench.run(SECOND);
    let seen = ["GAP 4, 0", "GGP 82, 0", "GGP 255, 2", "GGP 2, 3", "GCO 0, 0", "GCO 20, 0"].map(|line| bench.ok(line));
    assert_eq!(seen, [700; 6]);
    assert_eq!(bench.rotor(), 700, "a target set by AAP is a move");
    // Out of range for the parameter: nothing happens.
    bench.download(0, &["CALC LOAD, 2048", "AAP 4, 0", "CALC LOAD, 65536", "AGP 82, 0", "SGP 9, 2, 1", "STOP"]);
    bench.run_to_end(0);
    assert_eq!((bench.ok("GAP 4, 0"), bench.ok("GGP 82, 0"), bench.variable(9)), (700, 700, 1));
}

#[test]
fn cco_captures_the_position_of_a_moving_motor() {
    let mut bench = Bench::with_program(&["CALC LOAD, 8", "ROR 0, 1000", "WAIT TICKS, 0, 50", "CCO 3, 0", "STOP"]);
    bench.run_to_end(0);
    let captured = bench.ok("GCO 3, 0");
    assert!(captured > 0 && i64::from(captured) <= bench.rotor());
    bench.download(0, &["MVP COORD, 0, 3", "WAIT POS, 0, 0", "STOP"]);
    bench.run_to_end(0);
    assert_eq!(bench.rotor(), i64::from(captured));
}

#[test]
fn outputs_by_bit_by_vector_and_by_accumulator() {
    for (lines, expected) in [
        (["SIO 0, 2, 1", "CALC LOAD, 0"], [true, false]),
        (["SIO 1, 2, 1", "SIO 0, 2, 0"], [false, true]),
        (["SIO 255, 2, 3", "SIO 1, 2, 0"], [true, false]),
        (["CALC LOAD, 2", "SIO 255, 2, -1"], [false, true]),
        (["CALC LOAD, -1", "SIO 255, 2, -1"], [true, true]),
        (["SIO 255, 2, 3", "SIO 255, 2, -1"], [false, false]),
        // The accumulator is for all outputs together only.
        (["CALC LOAD, 1", "SIO 0, 2, -1"], [false, false]),
    ] {
        let mut bench = Bench::played(&[lines[0], lines[1], "STOP"]);
        bench.run(2 * MILLISECOND);
        assert_eq!(bench.outputs(), expected, "{lines:?}");
    }
    let mut bench = Bench::played(&["SIO 0, 0, 0", "STOP"]);
    bench.run(2 * MILLISECOND);
    assert_eq!(bench.module.board().borrow().world().outputs().pull_ups, 0);
}

/// The accumulator is one, for the host's commands and for the program.
#[test]
fn the_host_calculates_with_the_registers_of_the_program() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "AGP 1, 2", "CALCX ADD", "STOP"]);
    for line in ["CALC LOAD, 30", "CALCX LOAD", "CALC LOAD, 41"] {
        bench.ok(line);
    }
    bench.run_to_end(0);
    assert_eq!((bench.variable(1), bench.accumulator(), bench.x()), (42, 72, 30));
}

/// Program and host talk through user variables.
#[test]
fn the_host_changes_what_the_program_polls() {
    let mut bench = Bench::with_program(&["GGP 0, 2", "COMP 5", "JC NE, 0", "SGP 1, 2, 77", "STOP"]);
    bench.start(0);
    bench.run(SECOND);
    assert_eq!((bench.mode(), bench.variable(1)), (RUNNING, 0));
    bench.ok("SGP 0, 2, 5");
    bench.run(2 * MILLISECOND);
    assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 77));
}

// ---- motion

#[test]
fn motion_commands_move_the_motor() {
    let mut bench = Bench::new();
    for (lines, rotor) in [
        (["MVP ABS, 0, 5000", "WAIT POS, 0, 0"], 5000),
        (["MVP REL, 0, -700", "WAIT POS, 0, 0"], 4300),
        (["SCO 2, 0, 1111", "MVP COORD, 0, 2"], 1111),
        (["SAP 0, 0, -3", "WAIT POS, 0, 0"], -3),
    ] {
        bench.download(0, &[lines[0], lines[1], "WAIT POS, 0, 0", "STOP"]);
        bench.run_to_end(0);
        assert_eq!(bench.rotor(), rotor, "{lines:?}");
    }
    for (line, speed) in [("ROR 0, 400", 400), ("ROL 0, 300", -300), ("SAP 2, 0, 200", 200), ("MST 0", 0)] {
        bench.download(0, &[line, "STOP"]);
        bench.run_to_end(0);
        bench.run(SECOND);
        assert_eq!(bench.speed(), speed, "{line}");
    }
}

// ---- commands that store

/// Commands that store, and how to see after a restart that they have: before, command, question, new value.
const STORING: [(&str, &str, &str, i32); 6] = [
    ("SAP 4, 0, 1234", "STAP 4, 0", "GAP 4, 0", 1234),
    ("SGP 5, 2, -9", "STGP 5, 2", "GGP 5, 2", -9),
    ("SGP 84, 0, 0", "SGP 68, 0, 60000", "GGP 68, 0", 60_000),
    ("SGP 84, 0, 1", "SCO 3, 0, 7", "GCO 3, 0", 7),
    ("SGP 84, 0, 1", "CCO 4, 0", "GCO 4, 0", 600),
    ("SGP 84, 0, 1", "ACO 5, 0", "GCO 5, 0", 50),
];

/// Waits for output 0, which a program sets, and gives how long that took; it stops where it sees it.
fn until_output_0(bench: &mut Bench) -> u64 {
    let start = bench.module.now();
    while !bench.outputs()[0] {
        assert!(bench.module.now() < start + SECOND, "the program does not get there");
        let next = bench.module.next_event().unwrap();
        bench.module.run_until(next);
        let _ = bench.module.sent();
    }
    bench.module.now() - start
}

/// The command after one that stores runs when what is stored would survive a power cut, and not sooner.
#[test]
fn a_storing_command_waits_until_it_is_durable() {
    for (before, command, question, value) in STORING {
        let mut bench = Bench::new();
        for line in [before, "SAP 1, 0, 600", "CALC LOAD, 50"] {
            bench.ok(line);
        }
        bench.download(0, &[command, "SIO 0, 2, 1", "STOP"]);
        bench.set_off(0);
        let took = until_output_0(&mut bench);
        // The part writes a page in 5 ms.
        assert!((5 * MILLISECOND..50 * MILLISECOND).contains(&took), "{command}: {took} ns");
        assert!(!bench.module.board().borrow().at25().is_writing(), "{command}");
        let mut copy = Bench::with_eeprom(&bench.eeprom());
        assert_eq!(copy.ok(question), value, "{command}");
        // Once more: it is stored already, and costs nothing.
        bench.run(MILLISECOND);
        bench.ok("SIO 0, 2, 0");
        bench.run(2 * MILLISECOND);
        bench.set_off(0);
        assert!(until_output_0(&mut bench) <= 2 * MILLISECOND, "{command}, again");
    }
}

/// Meanwhile the motor turns evenly, the host is answered, and its commands that store are durable, too.
#[test]
fn storing_holds_up_nobody_else() {
    let mut bench = Bench::with_program(&[
        "CALC ADD, 1",
        "AGP 0, 2",
        "STGP 0, 2",
        "SGP 84, 0, 0",
        "SGP 84, 0, 1",
        "SCO 1, 0, 5",
        "SCO 1, 0, 6",
        "JA 0",
    ]);
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    bench.start(0);
    let mut last = bench.rotor();
    let mut distance = None;
    for round in 0..300 {
        let asked = bench.module.now();
        assert_eq!(bench.ask_over(Source::Rs485, 1, "GGP 66, 0").map(|reply| reply.value), Some(1));
        assert!(bench.module.now() - asked <= MILLISECOND, "round {round}");
        bench.module.run_until(asked + 10 * MILLISECOND);
        let rotor = bench.rotor();
        let expected: i64 = *distance.get_or_insert(rotor - last);
        assert!((rotor - last - expected).abs() <= 1, "round {round}: {} in place of {expected}", rotor - last);
        last = rotor;
    }
    assert!(bench.variable(0) > 20, "{}", bench.variable(0));
    bench.ok("SGP 77, 0, 1");
    assert_eq!(Bench::with_eeprom(&bench.eeprom()).ok("GGP 77, 0"), 1);
    assert_eq!(bench.mode(), RUNNING);
}

/// While it waits for the EEPROM a program can be stopped and sent on.
#[test]
fn a_program_that_stores_can_be_stopped() {
    let mut bench = Bench::with_program(&["SGP 68, 0, 60000", "SIO 0, 2, 1", "STOP"]);
    bench.set_off(0);
    bench.run(2 * MILLISECOND);
    bench.ok("128");
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.mode(), bench.outputs()[0]), (STOPPED, false));
    bench.ok("129, 0");
    bench.await_end();
    bench.run(MILLISECOND);
    assert!(bench.outputs()[0]);
    assert_eq!(Bench::with_eeprom(&bench.eeprom()).ok("GGP 68, 0"), 60_000);
}

/// A part that does not answer: the command fails, and the program goes on.
#[test]
fn a_store_that_fails_does_not_hold_the_program() {
    let mut bench = Bench::with_program(&["SAP 4, 0, 900", "STAP 4, 0", "SGP 1, 2, 1", "STOP"]);
    bench.control("fault eeprom on");
    bench.run_to_end(0);
    assert_eq!((bench.variable(1), bench.ask("GAP 4, 0")), (1, (OK, 900)));
}

// ---- replies

/// A program's commands are answered to nobody.
#[test]
fn a_program_sends_nothing() {
    let mut bench = Bench::with_program(&["GAP 1, 0", "SGP 68, 0, 60000", "SGP 68, 0, 50000", "ROR 1, 1", "JA 0"]);
    bench.start(0);
    assert_eq!(bench.listen(SECOND), []);
}
