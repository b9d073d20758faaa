//! Stored values: settings and coordinates of each axis are there again after the power was off, and the chips of the
//! axis have them.

use super::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::param::{COORDINATES, Row};
use tmcm::tmcl::Opcode;

/// Values that a parameter takes, its default first.
fn values(row: &Row) -> Vec<i32> {
    let near = (0..=8).map(|offset| row.default.wrapping_add(offset));
    let below = (1..=8).map(|offset| row.default.wrapping_sub(offset));
    near.chain(below).filter(|value| row.accepts(*value)).collect()
}

/// Stores all settings of all axes and compares them after a power cycle. In three rounds any two axes have different
/// values of each parameter at least once, also where that has two values only.
#[test]
fn all_settings_of_all_axes_are_there_after_the_power_was_off() {
    for mut bench in Bench::bare() {
        let rows = || bench.spec.axis.rows.iter().map(|parameter| &parameter.row);
        let stored: Vec<&Row> = rows().filter(|row| row.stored()).collect();
        for round in 0..3 {
            let value = |row: &Row, axis: u8| {
                let values = values(row);
                values[(usize::from(axis >> round) + 1) % values.len()]
            };
            for axis in bench.axes() {
                for row in &stored {
                    bench.ok(&format!("SAP {}, {axis}, {}", row.number, value(row, axis)));
                }
            }
            for axis in bench.axes() {
                for row in &stored {
                    bench.ok(&format!("STAP {}, {axis}", row.number));
                }
            }
            bench.power_cycle();
            for axis in bench.axes() {
                for row in &stored {
                    assert_eq!(bench.get(row.number, axis), value(row, axis), "{} of axis {axis}", row.name);
                }
            }
        }
    }
}

/// The chips of an axis work with what that axis has stored: seen at the driver, and at the speed of the motor.
#[test]
fn the_chips_of_an_axis_have_its_stored_settings() {
    for mut bench in Bench::bare() {
        let current = if bench.spec.axis.find(6).is_some() { 6 } else { 204 };
        for axis in bench.axes() {
            let n = i32::from(axis);
            let settings =
                [(4, 400 + 100 * n), (174, 10 + n), (167, 3 + n), (165, 5 + n), (140, 8 - n), (current, 80 + 16 * n)];
            for (number, value) in settings {
                bench.ok(&format!("SAP {number}, {axis}, {value}"));
                bench.ok(&format!("STAP {number}, {axis}"));
            }
        }
        bench.power_cycle();
        bench.each("MVP ABS, #, 1000000");
        bench.run(SECOND);
        for (axis, state) in bench.axes().zip(bench.states()) {
            let n = u32::from(axis);
            assert_eq!(state.velocity, 400 + 100 * i32::from(axis));
            let registers = bench.board.borrow().tmc262(axis.into()).registers();
            // Off time in bits 3..0, microsteps in bits 3..0 where 0 is 256, threshold in bits 14..8 and current in
            // 4..0.
            assert_eq!((registers.chopconf & 0xF, registers.drvctrl & 0xF), (3 + n, n), "axis {axis}");
            assert_eq!(
                (registers.sgcsconf >> 8 & 0x7F, registers.sgcsconf & 0x1F),
                (10 + n, 10 + 2 * n),
                "axis {axis}"
            );
        }
    }
}

#[test]
fn all_coordinates_of_all_axes_are_there_after_the_power_was_off() {
    for mut bench in Bench::bare() {
        let place = |axis: u8, number: usize| i32::from(axis) * 1_000_000 - 500_000 + number as i32;
        bench.ok("SGP 84, 0, 1");
        for axis in bench.axes() {
            for number in 0..COORDINATES {
                bench.ok(&format!("SCO {number}, {axis}, {}", place(axis, number)));
            }
        }
        bench.power_cycle();
        for axis in bench.axes() {
            assert_eq!(bench.ok(&format!("GCO 0, {axis}")), 0, "coordinate 0 is not stored");
            for number in 1..COORDINATES {
                assert_eq!(bench.ok(&format!("GCO {number}, {axis}")), place(axis, number));
            }
        }
        // All axes go to their own place of the same number at once.
        for axis in bench.axes() {
            bench.ok(&format!("SCO 3, {axis}, {}", 2_000 + 700 * i32::from(axis)));
        }
        assert_eq!(bench.ok("MVP COORD, 255, 3"), 2_000);
        bench.run(2 * SECOND);
        assert!(bench.all(1).into_iter().eq(bench.axes().map(|axis| 2_000 + 700 * i32::from(axis))));
        // CCO takes the place where its axis is.
        bench.each("CCO 9, #");
        assert!(bench.axes().all(|axis| bench.ok(&format!("GCO 9, {axis}")) == 2_000 + 700 * i32::from(axis)));
    }
}

/// SCO and GCO with motor 255 store and restore the coordinates of all axes, those in RAM only until then.
#[test]
fn coordinates_are_stored_and_restored_for_all_axes_at_once() {
    for mut bench in Bench::bare() {
        for axis in bench.axes() {
            bench.ok(&format!("SCO 5, {axis}, {}", 100 + i32::from(axis)));
        }
        bench.ok("SCO 5, 255, 0");
        bench.each("SCO 5, #, 7");
        bench.power_cycle();
        assert!(bench.axes().all(|axis| bench.ok(&format!("GCO 5, {axis}")) == 0));
        bench.ok("GCO 5, 255");
        assert!(bench.axes().all(|axis| bench.ok(&format!("GCO 5, {axis}")) == 100 + i32::from(axis)));
    }
}

/// RSAP gives one axis its stored value back, and settings can be stored while all axes turn.
#[test]
fn an_axis_has_its_stored_value_back() {
    for mut bench in Bench::bare() {
        bench.each("ROR #, 300");
        for axis in bench.axes() {
            bench.ok(&format!("SAP 4, {axis}, {}", 100 + i32::from(axis)));
            bench.ok(&format!("STAP 4, {axis}"));
        }
        bench.each("SAP 4, #, 50");
        let mut expected = vec![50; usize::from(bench.spec.axes)];
        for axis in bench.axes() {
            bench.ok(&format!("RSAP 4, {axis}"));
            expected[usize::from(axis)] = 100 + i32::from(axis);
            assert_eq!(bench.all(4), expected);
        }
        bench.run(100 * MILLISECOND);
        assert_eq!(bench.speeds(), vec![300; expected.len()]);
    }
}

/// Global parameters that concern the motion controllers, user variables and a program are kept by the EEPROM of each
/// product, too.
#[test]
fn variables_and_program_are_there_after_the_power_was_off() {
    for mut bench in Bench::bare() {
        let stores = !bench.spec.lacks.contains(&Opcode::Stgp);
        bench.ok("SGP 10, 2, 4711");
        if stores {
            bench.ok("STGP 10, 2");
        }
        let last = i32::from(bench.spec.commands) - 1;
        bench.ok(&format!("132, 0, 0, {last}"));
        bench.ask("SGP 11, 2, 99");
        bench.ok("133, 0, 0, 0");
        bench.power_cycle();
        assert_eq!(bench.variable(10), if stores { 4_711 } else { 0 });
        bench.ok(&format!("129, 1, 0, {last}"));
        bench.run(5 * MILLISECOND);
        assert_eq!((bench.variable(11), bench.ok("GGP 128, 0")), (99, 0));
    }
}
