use super::types::{ParametersStore, ParametersToWrite};
use super::*;
use crate::tools::tests::tools;

fn axis(number: u8, axis: u8) -> ParameterPlace {
    ParameterPlace { bank: ParameterBank::Axis, number, axis }
}

fn global(number: u8) -> ParameterPlace {
    ParameterPlace { bank: ParameterBank::Global, number, axis: 0 }
}

fn to(place: ParameterPlace, value: i32) -> ParameterSetting {
    ParameterSetting { place, value }
}

fn of(product: &str) -> Option<String> {
    Some(product.into())
}

#[test]
fn the_tables_say_what_a_page_has_to_know() {
    let ParameterTables { axes, rows } = tables(&ParametersOf { product: of("6110") });
    let find = |bank, number| rows.iter().find(|row| row.bank == bank && row.number == number).unwrap();
    assert_eq!(axes, 6);
    let speed = find(ParameterBank::Axis, 4);
    assert_eq!((speed.unit.as_str(), speed.takes.as_str(), speed.stored), ("int", "0..2047", ParameterStored::Command));
    assert!(speed.writable && speed.kept && !speed.clears);
    assert!(find(ParameterBank::Axis, 207).clears && !find(ParameterBank::Axis, 1).kept);
    let address = find(ParameterBank::Global, 66);
    assert_eq!(
        (address.stored, address.ranges.clone()),
        (ParameterStored::Automatic, vec![ParameterRange { low: 1, high: 255 }])
    );
    assert_eq!(find(ParameterBank::Interrupt, 2).name, "timer 2 period");
    assert_eq!(tables(&ParametersOf { product: None }).axes, 6);
}

#[test]
fn parameters_are_written_in_spite_of_refusals() {
    let mut tools = tools("1140");
    let write = ParametersWrite { to: vec![to(axis(4, 0), 5000), to(axis(6, 0), 77), to(axis(4, 1), 5)], store: false };
    let mut seen = Vec::new();
    let ParametersTold { told } =
        tools.write_parameters(&write, &mut |told| seen.push((told.done, told.total))).unwrap();
    assert!(told[0].why.contains("status 4") && told[0].value.is_none(), "{told:?}");
    assert_eq!((told[1].value, told[1].why.as_str()), (Some(77), ""));
    assert!(!told[2].why.is_empty());
    assert_eq!((seen.first(), seen.last()), (Some(&(0, 3)), Some(&(3, 3))));
    let meant = ParametersMeant { of: vec![axis(6, 0), axis(99, 0), global(66)] };
    let ParametersTold { told } = tools.read_parameters(&meant, &mut |_| {}).unwrap();
    assert_eq!(told.iter().map(|told| told.value).collect::<Vec<_>>(), [Some(77), None, Some(1)]);
    assert!(told[1].why.contains("status 3"), "{told:?}");
}

/// A value that is stored comes back by RSAP, and one that is only written does not.
#[test]
fn parameters_are_stored() {
    let mut tools = tools("1140");
    let write = |tools: &mut Tools, value, store| {
        let write = ParametersWrite { to: vec![to(axis(6, 0), value)], store };
        tools.write_parameters(&write, &mut |_| {}).unwrap()
    };
    let restored = |tools: &mut Tools| {
        tools.send(&crate::types::Line { line: "RSAP 6, 0".into() }).unwrap();
        tools.read_parameters(&ParametersMeant { of: vec![axis(6, 0)] }, &mut |_| {}).unwrap().told[0].value
    };
    write(&mut tools, 70, true);
    write(&mut tools, 71, false);
    assert_eq!(restored(&mut tools), Some(70));
    write(&mut tools, 72, false);
    let meant = ParametersMeant { of: vec![axis(6, 0), axis(6, 3)] };
    let ParametersTold { told } = tools.store_parameters(&meant, &mut |_| {}).unwrap();
    assert!(told[0].why.is_empty() && !told[1].why.is_empty(), "{told:?}");
    write(&mut tools, 73, false);
    assert_eq!(restored(&mut tools), Some(72));
}

#[test]
fn what_storing_takes_is_told_before() {
    let store = |product: &str, axes, of: Option<Vec<ParameterPlace>>| {
        words::writes(&ParametersStore { product: self::of(product), axes, of })
    };
    let all = store("6110", 6, None);
    let per_axis = store("6110", 1, None).writes;
    assert_eq!((all.writes, all.of.len()), (6 * per_axis, 6 * per_axis));
    assert!(per_axis > 30 && all.lines[1].starts_with(&format!("That takes {} writes to the EEPROM.", all.writes)));
    let unknown = words::writes(&ParametersStore { product: None, axes: 1, of: None });
    assert_eq!(unknown.writes, store("1140", 1, None).writes);
    let changed = store("1140", 1, Some(vec![axis(6, 0), axis(1, 0), global(66)]));
    assert_eq!((changed.writes, changed.of), (1, vec![axis(6, 0)]));
    assert!(changed.lines[0].contains("maximum current") && changed.lines[1].contains("wears"));
    let none = store("3212", 3, None);
    assert_eq!(none.writes, 0);
    assert!(none.lines[0].contains("keep them in a file"));
    assert_eq!(store("1140", 1, Some(vec![axis(1, 0)])).lines, ["This parameter cannot be stored."]);
}

#[test]
fn what_the_module_stores_by_itself_is_told_before() {
    let lines =
        |to: &[ParameterSetting]| words::automatic(&ParametersToWrite { product: of("1140"), to: to.to_vec() }).lines;
    assert!(lines(&[to(axis(6, 0), 1), to(global(132), 0)]).is_empty());
    let told = lines(&[to(global(66), 3), to(axis(6, 0), 1)]);
    assert!(told[0].starts_with("serial address: the module stores 3 by itself at once"), "{told:?}");
    assert!(told.len() == 2 && told[1].contains("connected anew"), "{told:?}");
    assert_eq!(lines(&[to(global(79), 1)]).len(), 1);
}

fn parsed(text: &str, product: Option<&str>) -> Result<ParameterLines, String> {
    let product = product.map(String::from);
    file(&ParametersFile { name: "a.tmcl".into(), text: text.into(), product }).map_err(|failure| failure.to_string())
}

#[test]
fn a_file_is_read_as_restore_does() {
    let text = "// Settings of a module 1140V142, saved by tmcl params\nSAP 4, 0, 7\nSAP 6, 0, 300\nSAP 4, 0, 8\nSGP 66, 0, 3\n\
                SGP 3, 2, 9\nSCO 1, 0, 5\nSAP 4, 2, 1\nSAP 99, 0, 1\nSGP 0, 3, 10\n";
    let ParameterLines { from, lines } = parsed(text, Some("1140")).unwrap();
    assert_eq!((from, lines.len()), (Some(1140), 8));
    let line = |place| lines.iter().find(|line| line.place == place).unwrap();
    assert_eq!((line(axis(4, 0)).value, line(axis(4, 0)).name.as_str()), (8, "maximum positioning speed"));
    assert_eq!(line(axis(6, 0)).why, "it takes 0..255");
    assert!(line(global(66)).interface && line(axis(4, 2)).why.contains("no axis 2"));
    assert_eq!(line(axis(99, 0)).why, "a TMCM-1140 has no such parameter");
    let names: Vec<&str> = lines.iter().map(|line| line.name.as_str()).collect();
    assert!(names.contains(&"user variable 3") && names.contains(&"coordinate 1") && names.contains(&"timer 0 period"));

    let other = parsed(text, Some("6110")).unwrap_err();
    assert!(other.starts_with("a.tmcl has the settings of a TMCM-1140, and this module is a TMCM-6110"), "{other}");
    let wrong = parsed("SAP 4, 0, 7\nROR 0, 100\n", None).unwrap_err();
    assert!(wrong.starts_with("a.tmcl:2: ROR 0, 100 is not a setting"), "{wrong}");
    assert!(parsed("\u{0}\u{7f}", None).is_err() && parsed("", None).unwrap().lines.is_empty());
}

/// The acceleration cannot be had before the divisor.
#[test]
fn lines_of_a_file_are_restored_each_with_its_refusal() {
    let mut tools = tools("1140");
    let mut restore = |from, to: &[ParameterSetting]| {
        let restore = ParametersRestore { name: "a.tmcl".into(), from, to: to.to_vec(), store: false };
        tools.restore_parameters(&restore, &mut |_| {}).map_err(|failure| failure.to_string())
    };
    let to = [to(axis(6, 0), 300), to(axis(4, 0), 7), to(global(66), 1)];
    let ParametersTold { told } = restore(Some(1140), &to).unwrap();
    assert!(told[0].why.contains("status 4") && told[1].why.is_empty() && told[2].why.is_empty(), "{told:?}");
    assert!(restore(Some(6110), &to).unwrap_err().contains("of a TMCM-6110"));
    assert!(restore(None, &to).is_ok());
}

#[test]
fn values_are_shown_and_typed_in_three_units() {
    let view = |units| ParameterView { product: of("1140"), known: vec![to(axis(154, 0), 3)], steps: None, units };
    let physical = view(ParameterUnits::Physical);
    let told = texts(&ParametersShow { view: physical.clone(), settings: vec![to(axis(4, 0), 1678)] }).unwrap();
    assert_eq!(told.texts, [ParameterText { text: "1".into(), unit: "turns/s".into() }]);
    let typed = |view, text: &str| number(&ParameterTyped { view, place: axis(4, 0), text: text.into() });
    assert_eq!(typed(physical, "60 rpm").unwrap().value, Some(1678));
    let mm = view(ParameterUnits::Own(OwnUnit { name: "mm".into(), microsteps: 12_800.0 }));
    assert_eq!(typed(mm, "4").unwrap().value, Some(1678));
    let module = view(ParameterUnits::Module);
    assert_eq!(typed(module.clone(), "1678").unwrap().value, Some(1678));
    assert!(typed(module, "2048").unwrap_err().to_string().contains("takes 1..2047"));
    let none = view(ParameterUnits::Own(OwnUnit { name: "mm".into(), microsteps: -1.0 }));
    assert!(typed(none, "4").is_err());
}
