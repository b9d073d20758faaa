//! `tmcl tables` and `tmcl manual`: what other programs, and man, are told.

use std::collections::BTreeSet;
use std::fs;

use serde_json::{Value, json};
use tmcl_tools::eds::Described;
use tmcm_sim::Product;

use crate::harness::run;

fn table(arguments: &[&str]) -> Value {
    let output = run(&[&["tables"], arguments].concat());
    assert!(output.status.success(), "{output:?}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn found<'a>(rows: &'a Value, key: &str, value: impl Into<Value>) -> &'a Value {
    let value = value.into();
    rows.as_array().unwrap().iter().find(|row| row[key] == value).unwrap_or_else(|| panic!("{value}"))
}

#[test]
fn parameters_of_each_product_are_json() {
    for product in Product::ALL {
        let spec = product.spec();
        let all = table(&[&spec.number.to_string()]);
        assert_eq!(all["product"], product.name());
        assert_eq!(all["axes"], spec.axes);
        assert_eq!(all["axis"].as_array().unwrap().len(), spec.axis.rows.len());
        assert_eq!(all["global"].as_array().unwrap().len(), spec.global.rows.len());
        // An interrupt of each axis has a parameter of its own.
        let numbers: Vec<_> = all["interrupts"].as_array().unwrap().iter().map(|row| row["number"].as_u64()).collect();
        assert_eq!(numbers.iter().collect::<BTreeSet<_>>().len(), numbers.len());
        assert!(numbers.len() > 3);
    }
    let usual = table(&[]);
    // Manual V1.42, sections 4.1 and 5.1.
    let speed = json!({"number": 4, "name": "maximum positioning speed", "ranges": [[1, 2047]], "unit": "int",
        "access": "RW", "stored": "on command", "default": 1000});
    let told = found(&usual["axis"], "number", 4);
    for (key, value) in speed.as_object().unwrap() {
        assert_eq!(&told[key], value, "{key}");
    }
    let read = found(&usual["axis"], "number", 8);
    assert_eq!([&read["access"], &read["default"], &read["stored"]], [&json!("R"), &json!(null), &json!(null)]);
    assert_eq!(read["ranges"], json!([]));
    assert_eq!(found(&usual["global"], "number", 66)["stored"], "at once");
}

#[test]
fn objects_are_json() {
    let all = table(&["--objects"]);
    let objects = &all["objects"];
    assert_eq!(objects.as_array().unwrap().len(), Described::all().len());
    let current = found(objects, "index", 0x2097);
    assert_eq!(current["limits"], json!([0, 15]));
    let target = found(objects, "index", 0x607A);
    assert_eq!([&target["access"], &target["pdo_mapping"]], [&json!("rww"), &json!(true)]);
    let first = found(objects, "index", 0x1400);
    assert_eq!([&first["sub_index"], &first["whole"]], [&json!(0), &json!("RPDO1 communication")]);
}

#[test]
fn a_product_that_there_is_not_has_no_table() {
    let output = run(&["tables", "1141"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("6110"));
    assert_eq!(run(&["tables", "1140", "--objects"]).status.code(), Some(2));
}

#[test]
fn every_command_has_a_page_of_the_manual() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    assert!(run(&["manual", path]).status.success());
    let help = String::from_utf8(run(&["--help"]).stdout).unwrap();
    let commands = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // A line that goes on begins further to the right.
    let names = commands.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    let names: Vec<_> = names.filter(|name| *name != "help").collect();
    assert!(names.contains(&"sim") && names.len() > 15, "{names:?}");
    let page = |name: &str| fs::read_to_string(folder.path().join(format!("{name}.1"))).unwrap();
    for name in names {
        assert!(page(&format!("tmcl-{name}")).contains("Examples:"), "{name}");
    }
    assert!(page("tmcl").contains("tmcl\\-sim(1)"));
    assert!(page("tmcl-params-get").contains(".TH TMCL-PARAMS-GET"));
    // A file is no folder.
    let nowhere = folder.path().join("tmcl.1/man1");
    let output = run(&["manual", nowhere.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&output.stderr).contains("cannot make"), "{output:?}");
}
