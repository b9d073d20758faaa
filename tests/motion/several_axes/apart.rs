//! Nothing of one axis shows in another: whatever is written to one, all that can be read of the others stays.

use super::{Bench, OK};
use hal_sim::board::Chip;
use hal_sim::chip::tmc262::Registers;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::param::Row;

/// All that can be read of an axis, and what its chips and its surroundings show.
#[derive(Debug, PartialEq)]
struct Seen {
    parameters: Vec<(u8, i32)>,
    state: hal_sim::control::AxisState,
    driver: Registers,
    coordinates: Vec<i32>,
    search: i32,
}

fn look(bench: &mut Bench, axis: u8) -> Seen {
    let numbers: Vec<u8> = bench.spec.axis.rows.iter().map(|parameter| parameter.row.number).collect();
    let mut driver = bench.board.borrow().tmc262(axis.into()).registers();
    // What the driver is to answer next, RDSEL, rotates.
    driver.drvconf &= !0x30;
    Seen {
        parameters: numbers.into_iter().map(|number| (number, bench.get(number, axis))).collect(),
        state: bench.states().swap_remove(axis.into()),
        driver,
        coordinates: (0..=20).map(|number| bench.ok(&format!("GCO {number}, {axis}"))).collect(),
        search: bench.ok(&format!("RFS STATUS, {axis}")),
    }
}

/// Values to write to a parameter: its default, both ends of each of its ranges, and neighbours; those of positions lie
/// near enough to be reached.
fn values(row: &Row) -> Vec<i32> {
    let ends = row.ranges.iter().flat_map(|(low, high)| [*low, *high]);
    let mut values: Vec<i32> = ends.chain([row.default, row.default + 1, row.default - 1, 77]).collect();
    values.retain(|value| row.accepts(*value) && value.unsigned_abs() < 100_000);
    values.dedup();
    values
}

/// All axes stand, each with settings of its own.
fn settled(bench: &mut Bench) {
    for axis in bench.axes() {
        let n = i32::from(axis);
        for (number, value) in [(4, 700 + n), (5, 500 + n), (130, 2 + n), (174, 5 + n), (194, 400 + n), (195, 90 + n)] {
            bench.ok(&format!("SAP {number}, {axis}, {value}"));
        }
        bench.ok(&format!("SCO 1, {axis}, {}", 10 * n));
        bench.ok(&format!("MVP ABS, {axis}, {}", 500 + 100 * n));
    }
    bench.run(4 * SECOND);
}

#[test]
fn whatever_is_written_to_one_axis_the_others_show_nothing_of_it() {
    for mut bench in Bench::bare() {
        settled(&mut bench);
        let rows: Vec<&Row> = bench.spec.axis.rows.iter().map(|parameter| &parameter.row).collect();
        for axis in bench.axes() {
            let others: Vec<u8> = bench.others(axis).collect();
            let before: Vec<Seen> = others.iter().map(|other| look(&mut bench, *other)).collect();
            let mut written = 0;
            for row in rows.iter().filter(|row| row.writable()) {
                let start = bench.get(row.number, axis);
                for value in values(row).into_iter().chain([start]) {
                    let line = format!("SAP {}, {axis}, {value}", row.number);
                    // A divisor may have no ramp with the other one.
                    let (status, _) = bench.ask(&line);
                    assert!(status == OK || matches!(row.number, 153 | 154), "{line}: {status}");
                    assert!(status != OK || bench.get(row.number, axis) == value || row.number < 4, "{line}");
                    written += i32::from(status == OK);
                    bench.run(3 * MILLISECOND);
                    for (other, before) in others.iter().zip(&before) {
                        assert_eq!(&look(&mut bench, *other), before, "axis {other} after {line}");
                    }
                }
            }
            assert!(written > 60, "{written}");
            for line in ["SCO 1, #, 77", "STAP 4, #", "RSAP 4, #", "RFS START, #", "RFS STOP, #", "ROL #, 5", "MST #"] {
                bench.ok(&line.replace('#', &axis.to_string()));
                bench.run(3 * MILLISECOND);
                for (other, before) in others.iter().zip(&before) {
                    assert_eq!(&look(&mut bench, *other), before, "axis {other} after {line} for {axis}");
                }
            }
            bench.run(4 * SECOND);
        }
    }
}

/// Settings of one axis cost no datagram of another controller or driver.
#[test]
fn what_is_written_to_one_axis_goes_to_its_own_chips() {
    for mut bench in Bench::bare() {
        settled(&mut bench);
        for axis in bench.axes() {
            for (line, own) in [("SAP 4, #, 333", true), ("SAP 174, #, 33", false), ("SAP 165, #, 9", false)] {
                bench.board.borrow_mut().take_datagrams();
                bench.ok(&line.replace('#', &axis.to_string()));
                let sent = bench.board.borrow_mut().take_datagrams();
                let (controller, motor) = (usize::from(axis / 3), axis % 3);
                let chip = if own { Chip::Tmc429(controller) } else { Chip::Tmc262(axis.into()) };
                assert!(!sent.is_empty() && sent.iter().all(|datagram| datagram.chip == chip), "{line}: {sent:?}");
                // Bits 6 and 5 of the first byte are the motor.
                assert!(!own || sent.iter().all(|datagram| datagram.bytes[0] >> 5 & 3 == motor), "{line}: {sent:?}");
            }
        }
    }
}

/// A program that names an axis that does not exist goes on, and nothing moves.
#[test]
fn a_program_goes_on_where_an_axis_does_not_exist() {
    for mut bench in Bench::bare() {
        settled(&mut bench);
        let before: Vec<Seen> = bench.axes().map(|axis| look(&mut bench, axis)).collect();
        for axis in [bench.axes().end, 7, 100, 255] {
            let commands = [
                "ROR #, 300",
                "ROL #, 300",
                "MST #",
                "MVP ABS, #, 7",
                "MVP REL, #, 7",
                "SAP 4, #, 9",
                "STAP 4, #",
                "RFS START, #",
                "ACO 1, #",
                "AAP 0, #",
                "WAIT POS, #, 0",
                "WAIT REFSW, #, 0",
                "WAIT LIMSW, #, 0",
                "WAIT RFS, #, 0",
            ];
            let number = |line: &str| line.replace('#', &axis.to_string());
            let mut program: Vec<String> = commands.into_iter().map(number).collect();
            program.extend([format!("SGP 5, 2, {axis}"), "STOP".into()]);
            bench.start_program(&program);
            bench.run(50 * MILLISECOND);
            assert_eq!((bench.variable(5), bench.ok("GGP 128, 0")), (axis.into(), 0), "axis {axis}");
        }
        let after: Vec<Seen> = bench.axes().map(|axis| look(&mut bench, axis)).collect();
        assert_eq!(after, before);
    }
}

/// An axis number beyond the last one is refused and does nothing.
#[test]
fn an_axis_that_does_not_exist_is_refused() {
    for mut bench in Bench::bare() {
        settled(&mut bench);
        let before: Vec<Seen> = bench.axes().map(|axis| look(&mut bench, axis)).collect();
        for axis in [bench.axes().end, 7, 100, 254, 255] {
            for line in ["ROR #, 100", "MST #", "SAP 4, #, 1", "GAP 1, #", "STAP 4, #", "RFS START, #", "MVP ABS, #, 9"]
            {
                let line = line.replace('#', &axis.to_string());
                assert_eq!(bench.ask(&line).0, 4, "{line}");
            }
        }
        bench.run(10 * MILLISECOND);
        let after: Vec<Seen> = bench.axes().map(|axis| look(&mut bench, axis)).collect();
        assert_eq!(after, before);
    }
}
