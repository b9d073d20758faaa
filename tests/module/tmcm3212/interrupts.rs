//! Interrupts of each axis and input (table 12 of the manual), as a program counts them.

use super::{bench, in_world};
use common::{Bench, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};

/// The numbers of table 12, but for the timers and 255.
const NUMBERS: [u8; 19] = [3, 4, 5, 15, 16, 17, 21, 22, 23, 27, 28, 29, 30, 31, 32, 39, 40, 41, 42];

/// Starts a program that adds one to the user variable of an interrupt's number with each of them.
fn count(bench: &mut Bench) {
    let main = 2 * NUMBERS.len() + 2;
    let mut program = Vec::new();
    for (place, number) in NUMBERS.iter().enumerate() {
        program.extend([format!("VECT {number}, {}", main + 4 * place), format!("EI {number}")]);
    }
    program.extend(["EI 255".into(), format!("JA {}", main - 1)]);
    for number in NUMBERS {
        program.extend([format!("GGP {number}, 2"), "CALC ADD, 1".into(), format!("AGP {number}, 2"), "RETI".into()]);
    }
    let lines: Vec<&str> = program.iter().map(String::as_str).collect();
    bench.download(0, &lines);
    for number in (27..=32).chain(39..=42) {
        bench.ok(&format!("SGP {number}, 3, 3"));
    }
    bench.start(0);
    bench.run(5 * MILLISECOND);
}

/// The interrupts that have been counted, with how often.
fn counted(bench: &mut Bench) -> Vec<(u8, i32)> {
    NUMBERS.map(|number| (number, bench.variable(number))).into_iter().filter(|(_, times)| *times > 0).collect()
}

#[test]
fn there_are_those_of_table_12() {
    let mut bench = bench();
    for number in 0..=u8::MAX {
        let exists = number < 3 || NUMBERS.contains(&number);
        let expected = |exists: bool| if exists { OK } else { WRONG_TYPE };
        assert_eq!(bench.ask(&format!("EI {number}")).0, expected(exists || number == 255), "EI {number}");
        assert_eq!(bench.ask(&format!("DI {number}")).0, expected(exists || number == 255), "DI {number}");
        assert_eq!(bench.ask(&format!("VECT {number}, 6143")).0, expected(exists), "VECT {number}");
        let setting = number < 3 || (27..=32).contains(&number) || (39..=42).contains(&number);
        assert_eq!(bench.ask(&format!("SGP {number}, 3, 1")).0, expected(setting), "SGP {number}, 3");
    }
}

#[test]
fn each_axis_tells_its_own_arrival() {
    let mut bench = bench();
    count(&mut bench);
    for (axis, expected) in [(0, vec![(3, 1)]), (2, vec![(3, 1), (5, 1)]), (1, vec![(3, 1), (4, 1), (5, 1)])] {
        bench.ok(&format!("MVP ABS, {axis}, 2000"));
        bench.run(SECOND);
        assert_eq!(counted(&mut bench), expected);
    }
}

#[test]
fn each_switch_and_each_input_has_its_own() {
    let mut bench = bench();
    count(&mut bench);
    let mut expected = Vec::new();
    for (axis, side, number) in
        [(0, "left", 27), (0, "right", 28), (1, "left", 29), (1, "right", 30), (2, "left", 31), (2, "right", 32)]
    {
        for act in ["press", "release"] {
            bench.control(&format!("{act} {side} {axis}"));
            bench.run(20 * MILLISECOND);
        }
        expected.push((number, 2));
        assert_eq!(counted(&mut bench), expected, "{side} {axis}");
    }
    for input in 0..4 {
        let before = bench.ok(&format!("GIO {input}, 0"));
        bench.control(&format!("input {input} {}", 1 - before));
        bench.run(5 * MILLISECOND);
        expected.push((39 + input, 1));
        assert_eq!(counted(&mut bench), expected, "input {input}");
    }
    // The ENABLE input has no interrupt.
    for level in [0, 1, 0] {
        bench.control(&format!("input 10 {level}"));
        bench.run(5 * MILLISECOND);
    }
    assert_eq!(counted(&mut bench), expected);
}

/// With a threshold of 13 the modelled motor has a load value of 0 exactly when it stalls.
#[test]
fn each_axis_tells_its_own_stall() {
    let mut bench = bench();
    for axis in 0..3 {
        bench.configure(&[&format!("SAP 181, {axis}, 20000"), &format!("SAP 174, {axis}, 5")]);
    }
    count(&mut bench);
    for axis in 0..3 {
        bench.ok(&format!("ROR {axis}, 51200"));
    }
    bench.run(3 * SECOND);
    assert_eq!(counted(&mut bench), []);
    for (axis, expected) in [(1, vec![(16, 1)]), (0, vec![(15, 1), (16, 1)]), (2, vec![(15, 1), (16, 1), (17, 1)])] {
        bench.control(&format!("load 1 {axis}"));
        bench.run(SECOND);
        assert_eq!(counted(&mut bench), expected, "axis {axis}");
        assert_eq!((bench.ok(&format!("GAP 3, {axis}")), bench.ok(&format!("GAP 207, {axis}"))), (0, 1));
    }
}

/// An encoder of 3200 counts a turn on each axis; a blow of 20 full steps is 5120 microsteps.
#[test]
fn each_axis_tells_the_deviation_of_its_own_encoder() {
    let mut bench = in_world(|_| "[axis.abn]\nlines = 800\n".into());
    for axis in 0..3 {
        bench.configure(&[&format!("SAP 210, {axis}, 3200"), &format!("SAP 212, {axis}, 2000")]);
    }
    count(&mut bench);
    for axis in 0..3 {
        bench.ok(&format!("ROR {axis}, 25600"));
    }
    bench.run(2 * SECOND);
    assert_eq!(counted(&mut bench), []);
    bench.control("slip 20 1");
    bench.run(SECOND);
    assert_eq!(counted(&mut bench), [(22, 1)]);
    assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 3, {axis}"))), [25_600, 0, 25_600]);
    assert_eq!([0, 1, 2].map(|axis| bench.ok(&format!("GAP 207, {axis}"))), [0, 2, 0]);
}

/// A blow back, and the encoder is again where the motor is. The next motion is not ended by what is over, and the next
/// blow is told as the first was.
#[test]
fn a_deviation_that_ends_ends_nothing_more() {
    let mut bench = in_world(|_| "[axis.abn]\nlines = 800\n".into());
    bench.configure(&["SAP 210, 2, 3200", "SAP 212, 2, 2000"]);
    count(&mut bench);
    let turn = |bench: &mut Bench| {
        bench.ok("ROR 2, 25600");
        bench.run(2 * SECOND);
        (counted(bench), bench.ok("GAP 3, 2"))
    };
    assert_eq!(turn(&mut bench), (vec![], 25_600));
    bench.control("slip 20 2");
    bench.run(SECOND);
    assert_eq!((counted(&mut bench), bench.ok("GAP 3, 2"), bench.ok("GAP 207, 2")), (vec![(23, 1)], 0, 2));
    bench.control("slip -20 2");
    bench.run(SECOND);
    assert_eq!(turn(&mut bench), (vec![(23, 1)], 25_600));
    bench.control("slip 20 2");
    bench.run(SECOND);
    assert_eq!((counted(&mut bench), bench.ok("GAP 3, 2"), bench.ok("GAP 207, 2")), (vec![(23, 2)], 0, 2));
}
