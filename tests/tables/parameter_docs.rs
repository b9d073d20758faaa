//! `docs/parameters-*.md`, a page for each product, are made from the parameter tables. This test compares them; with
//! `UPDATE_DOCS=1` in the environment it writes them anew.

use std::fmt::Write;

use tmcm::module::Spec;
use tmcm::param::{Interrupt, Row, STORED_USER_VARIABLES, Storage, USER_VARIABLES, Unit};

use tmcm_sim::Product;

use common::pages::compare;

const HEAD: &str = "\
Generated from the tables in `src/param` - do not edit. After a change there:

    UPDATE_DOCS=1 cargo test --test tables parameter_docs

*Access*: R can be read, RW also written. *Stored*: *yes* by STAP (user variables: STGP) and restored at start-up,
*at once* by the command that sets it, nothing: lost with the power. A value outside the range is answered with
status 4, a write to a parameter that can only be read with status 3, and nothing changes. ";

/// Text on the units of speed and acceleration.
const INTERNAL: &str = "\
Internal units (*int*)
of velocity and acceleration are those of the TMC429.
";
const PPS: &str = "\
Speeds are in
microsteps per second (*pps*), accelerations in pps per second (*pps2*).
";

/// Texts that stand above each table.
const AXIS: &str = "Read by GAP, written by SAP and AAP, stored by STAP, restored by RSAP.";
const AXIS_UNSTORED: &str = "Read by GAP, written by SAP and AAP. None is stored.";
const GLOBAL: &str = "Read by GGP, written by SGP and AGP.";
const INTERRUPT: &str = "Read by GGP, written by SGP and AGP; the timers are unsigned.";

fn range(row: &Row, (low, high): (i32, i32)) -> String {
    match (low, high) {
        (i32::MIN, i32::MAX) if row.unit == Unit::Milliseconds => "0..4294967295".into(),
        (i32::MIN, i32::MAX) => "any".into(),
        (low, high) if high.checked_sub(low) == Some(1) => format!("{low}, {high}"),
        (low, high) => format!("{low}..{high}"),
    }
}

fn line((number, name, row): &Named) -> String {
    let ranges: Vec<_> = row.ranges.iter().map(|limits| range(row, *limits)).collect();
    let stored = match row.storage {
        Storage::Volatile => "",
        Storage::OnCommand(_) => "yes",
        Storage::Automatic(_) => "at once",
    };
    let (access, default) = if row.writable() { ("RW", row.default.to_string()) } else { ("R", String::new()) };
    let cells: [&str; 8] =
        [&number.to_string(), name, &ranges.join(", "), row.unit.symbol(), access, stored, &default, row.note];
    let cells = cells.map(|cell| if cell.is_empty() { "| ".into() } else { format!("| {cell} ") });
    cells.concat() + "|\n"
}

fn table(title: &str, about: &str, rows: &[Named]) -> String {
    let mut text = format!("\n## {title}\n\n{about}\n\n");
    text += "| number | name | range | unit | access | stored | default | note |\n";
    text += "|---:|---|---|---|---|---|---:|---|\n";
    rows.iter().for_each(|row| text += &line(row));
    text
}

/// A row with its number and name.
type Named = (u8, String, &'static Row);

fn named(row: &'static Row) -> Named {
    (row.number, row.name.into(), row)
}

fn interrupts(spec: &Spec) -> Vec<Named> {
    let named = |number| {
        let (numbered, index) = Interrupt::find(number, spec.axes, spec.inputs)?;
        Some((number, numbered.parameter_name(index)?.to_string(), numbered.row.as_ref()?))
    };
    (0..=u8::MAX).filter_map(named).collect()
}

fn render(product: Product) -> String {
    let spec = product.spec();
    let units = if spec.axis.rows.iter().any(|p| p.row.unit == Unit::Internal) { INTERNAL } else { PPS };
    let mut text = format!("# Parameters of the {}\n\n{HEAD}{units}", product.name());
    let axis = if spec.axis.rows.iter().any(|p| p.row.stored()) { AXIS } else { AXIS_UNSTORED };
    text += &table("Axis parameters", axis, &spec.axis.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>());
    text += &table(
        "Global parameters, bank 0",
        GLOBAL,
        &spec.global.rows.iter().map(|p| named(&p.row)).collect::<Vec<_>>(),
    );
    let (all, stored) = (USER_VARIABLES - 1, STORED_USER_VARIABLES - 1);
    write!(
        text,
        "\n## User variables, bank 2\n\n\
         0..{all}, any value, 0 at the start. 0..{stored} can be stored by STGP and are restored by RSGP, and at\n\
         start-up unless global parameter 85 is 1.\n"
    )
    .unwrap();
    text + &table("Interrupt parameters, bank 3", INTERRUPT, &interrupts(spec))
}

#[test]
fn the_pages_are_what_the_tables_say() {
    for product in Product::ALL {
        compare(&format!("parameters-{}.md", product.spec().number), "--test tables parameter_docs", &render(product));
    }
}

/// A pipe or a line break in a note would break the table.
#[test]
fn every_row_has_its_eight_cells() {
    for product in Product::ALL {
        let (text, spec) = (render(product), product.spec());
        let rows: Vec<_> = text.lines().filter(|line| line.starts_with('|')).collect();
        let parameters = spec.axis.rows.len() + spec.global.rows.len() + interrupts(spec).len();
        assert_eq!(rows.len(), parameters + 3 * 2);
        for row in rows {
            assert_eq!(row.matches('|').count(), 9, "{row}");
        }
    }
}
