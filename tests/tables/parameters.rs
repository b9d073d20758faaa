//! Parameters through telegrams: what every row of the tables promises.

use common::table::{Table, tables};
use common::{Bench, INVALID_COMMAND, INVALID_VALUE, OK, WRONG_TYPE};
use hal_sim::clock::SECOND;
use tmcm::param::{Interrupt, Row};
use tmcm::tmcl::Command;
use tmcm_sim::Product;

/// True for a parameter whose value is not simply what was written. One is the target speed, which counts in velocity
/// mode alone. The others, in bank 0, are tick timer, random number, the lock of the EEPROM, and the parameter that
/// silences the reply to its own test. Each has a test of its own.
fn is_peculiar(table: &Table, number: u8) -> bool {
    if table.is_global() { [73, 132, 133, 255].contains(&number) } else { number == 2 }
}

#[test]
fn the_firmware_has_the_rows_of_the_manual() {
    fn check(expected: &Table, got: &[(u8, String, &Row)]) {
        assert_eq!(
            got.iter().map(|(number, ..)| *number).collect::<Vec<_>>(),
            expected.rows.iter().map(|row| row.number).collect::<Vec<_>>()
        );
        for (expected, (_, name, got)) in expected.rows.iter().zip(got) {
            assert_eq!(name, expected.name);
            assert_eq!(got.ranges, expected.ranges, "{}", got.name);
            assert_eq!(got.writable(), expected.is_writable(), "{}", got.name);
            assert_eq!(got.stored(), expected.is_stored(), "{}", got.name);
            assert!(expected.default().is_none_or(|default| got.default == default), "{}", got.name);
        }
    }
    let named = |row: &'static Row| (row.number, row.name.to_string(), row);
    for product in Product::ALL {
        let (spec, tables) = (product.spec(), tables(product));
        let [axes @ .., global, interrupt] = tables.as_slice() else { panic!("there are tables") };
        assert_eq!(axes.len(), usize::from(spec.axes));
        check(&axes[0], &spec.axis.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>());
        check(global, &spec.global.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>());
        let interrupts = (0..=u8::MAX).filter_map(|number| {
            let (numbered, index) = Interrupt::find(number, spec.axes, spec.inputs)?;
            Some((number, numbered.parameter_name(index)?.to_string(), numbered.row.as_ref()?))
        });
        check(interrupt, &interrupts.collect::<Vec<_>>());
    }
}

#[test]
fn a_fresh_module_has_the_defaults() {
    for product in Product::ALL {
        let mut bench = Bench::of(product);
        for table in tables(product) {
            for row in table.rows {
                let value = table.value(&mut bench, row);
                assert!(row.accepts(value), "{} is {value}", row.name);
                if let Some(default) = row.default().filter(|_| !is_peculiar(&table, row.number)) {
                    assert_eq!(value, default, "{}", row.name);
                }
            }
        }
        // The full scale of the sense resistors is fixed, where the driver has one.
        assert_eq!(bench.ok("GAP 179, 0"), i32::from(product != Product::Tmcm3212));
    }
}

#[test]
fn limits_are_accepted_and_read_back() {
    for product in Product::ALL {
        for table in tables(product) {
            for row in table.rows.iter().filter(|row| row.is_writable() && !is_peculiar(&table, row.number)) {
                let mut bench = Bench::of(product);
                for value in row.limits().chain(row.default()) {
                    table.set(&mut bench, row, value);
                    assert_eq!(table.value(&mut bench, row), value, "{}", row.name);
                }
            }
        }
    }
}

#[test]
fn beyond_the_limits_nothing_changes() {
    for product in Product::ALL {
        let tables = tables(product);
        for table in &tables {
            for row in table.rows.iter().filter(|row| row.is_writable()) {
                let mut bench = Bench::of(product);
                if row.is_setting() {
                    table.set(&mut bench, row, row.another());
                }
                let settings = |bench: &mut Bench| tables.iter().map(|t| t.settings(bench)).collect::<Vec<_>>();
                let before = (table.value(&mut bench, row), settings(&mut bench), bench.eeprom());
                for value in row.beyond() {
                    let status = table.write(&mut bench, row.number, value);
                    assert_eq!(status, INVALID_VALUE, "{} = {value}", row.name);
                }
                let after = (table.value(&mut bench, row), settings(&mut bench), bench.eeprom());
                if !is_peculiar(table, row.number) {
                    assert_eq!(after.0, before.0, "{}", row.name);
                }
                assert!(after.1 == before.1 && after.2 == before.2, "{} changed something else", row.name);
            }
        }
    }
}

/// A value that is written to one axis is read from no other.
#[test]
fn each_axis_has_its_own_values() {
    for product in Product::ALL {
        let mut bench = Bench::of(product);
        let tables = tables(product);
        let axes = &tables[..tables.len() - 2];
        for row in axes[0].rows.iter().filter(|row| row.is_setting()) {
            for (axis, table) in axes.iter().enumerate() {
                let expected = |other: usize| if other <= axis { row.another() } else { row.default().unwrap() };
                table.set(&mut bench, row, row.another());
                for (other, table) in axes.iter().enumerate() {
                    assert_eq!(table.value(&mut bench, row), expected(other), "{} of axis {other}", row.name);
                }
            }
        }
    }
}

/// The type is looked at before the value: one far out of range makes no difference.
#[test]
fn read_only_parameters_refuse_any_value() {
    for product in Product::ALL {
        let mut bench = Bench::of(product);
        for table in tables(product) {
            for row in table.rows.iter().filter(|row| !row.is_writable()) {
                let before = table.value(&mut bench, row);
                for value in [0, 1, i32::MIN, i32::MAX] {
                    assert_eq!(table.write(&mut bench, row.number, value), WRONG_TYPE, "{} = {value}", row.name);
                }
                if !is_peculiar(&table, row.number) {
                    assert_eq!(table.value(&mut bench, row), before, "{}", row.name);
                }
            }
        }
    }
}

#[test]
fn numbers_that_do_not_exist() {
    for product in Product::ALL {
        let mut bench = Bench::of(product);
        for table in tables(product) {
            for number in (0..=u8::MAX).filter(|number| table.row(*number).is_none()) {
                assert_eq!(table.read(&mut bench, number), (WRONG_TYPE, 0), "read {number}");
                assert_eq!(table.write(&mut bench, number, 1), WRONG_TYPE, "write {number}");
            }
        }
    }
}

/// An axis that does not exist is status 4, whether the type does or not; unless there is no such command, which is
/// status 2.
#[test]
fn the_axis_is_looked_at_before_the_type() {
    for product in Product::ALL {
        let (mut bench, axes) = (Bench::of(product), product.spec().axes);
        let stores = product != Product::Tmcm3212;
        for number in 0..=u8::MAX {
            for (opcode, name) in [(5, "SAP"), (6, "GAP"), (7, "STAP"), (8, "RSAP"), (34, "AAP")] {
                let expected = if stores || ![7, 8].contains(&opcode) { INVALID_VALUE } else { INVALID_COMMAND };
                let reply = bench.send(Command::new(opcode, number, axes, 0));
                assert_eq!(reply.status, expected, "{name} {number}, {axes}");
            }
        }
        for axis in [axes + 1, 127, 255] {
            assert_eq!(bench.ask(&format!("GAP 1, {axis}")).0, INVALID_VALUE);
        }
    }
}

/// Bank 1 and banks that do not exist are status 4, whatever the number.
#[test]
fn the_bank_is_looked_at_before_the_number() {
    let mut bench = Bench::new();
    for bank in (0..=u8::MAX).filter(|bank| ![0, 2, 3].contains(bank)) {
        for (opcode, name) in [(9, "SGP"), (10, "GGP"), (11, "STGP"), (12, "RSGP"), (35, "AGP")] {
            for number in [0, 66, 200] {
                let reply = bench.send(Command::new(opcode, number, bank, 0));
                assert_eq!(reply.status, INVALID_VALUE, "{name} {number}, {bank}");
            }
        }
    }
}

#[test]
fn user_variables_take_any_value() {
    let mut bench = Bench::new();
    let number = |n: i32| n.wrapping_mul(0x1357_9BDF);
    for n in 0..=255 {
        assert_eq!(bench.ok(&format!("GGP {n}, 2")), 0);
        for value in [i32::MIN, i32::MAX, number(n)] {
            assert_eq!(bench.ok(&format!("SGP {n}, 2, {value}")), value);
            assert_eq!(bench.ok(&format!("GGP {n}, 2")), value);
        }
    }
    for n in 0..=255 {
        assert_eq!(bench.ok(&format!("GGP {n}, 2")), number(n), "variable {n}");
    }
}

/// The accumulator forms write what SAP and SGP write, with the same refusals; their value field means
/// nothing and is echoed.
#[test]
fn aap_and_agp_write_the_accumulator() {
    let mut bench = Bench::new();
    bench.ok("CALC LOAD, 700");
    bench.ok("AAP 4, 0");
    bench.ok("AGP 68, 0");
    bench.ok("AGP 7, 2");
    bench.ok("AGP 1, 3");
    for line in ["GAP 4, 0", "GGP 68, 0", "GGP 7, 2", "GGP 1, 3"] {
        assert_eq!(bench.ok(line), 700, "{line}");
    }
    for line in ["AAP 6, 0", "AGP 77, 0", "AGP 27, 3"] {
        bench.refused(line, INVALID_VALUE);
    }
    for line in ["AAP 3, 0", "AAP 14, 0", "AGP 128, 0", "AGP 64, 0", "AGP 3, 3"] {
        bench.refused(line, WRONG_TYPE);
    }
    bench.ok("AAP 0, 0");
    bench.run_until(SECOND, |b| b.rotor() == 700);
    let reply = bench.send(Command::new(34, 5, 0, -3));
    assert_eq!((reply.status, reply.value, bench.ok("GAP 5, 0")), (OK, -3, 700));
}
