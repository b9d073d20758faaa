//! `tmcl scan`: who is there.

use super::harness::{Sim, complaint, run};

const VERSION: &str = "TMCM-1140, firmware version 1.42 (1140V142)";

/// Scans and gives the lines it prints. Nobody is missed, however busy the computer.
fn scan(arguments: &[&str]) -> Vec<String> {
    let output = run(&[&["scan"], arguments, &["--timeout", "1000"]].concat());
    assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
    String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect()
}

#[test]
fn every_module_of_a_bus_is_found_once() {
    let sim = Sim::start(&["--modules", "3", "--rs485", "{}/bus", "--slcan", "{}/can"]);
    // The second address of module 2 is another way to it.
    let bus = sim.told("rs485");
    assert!(run(&["send", bus, "--address", "2", "SGP 87, 0, 5"]).status.success());
    let mut expected: Vec<String> = (1..=3).map(|n| format!("address {n} at 9600 baud: {VERSION}")).collect();
    expected.push(format!("address 5 at 9600 baud: {VERSION}, the secondary address of module 2"));
    assert_eq!(scan(&[bus, "--addresses", "1-5"]), expected);
    assert_eq!(scan(&[bus, "--addresses", "3", "--baud", "115200"]), [expected[2].replace("9600", "115200")]);
    let can = format!("slcan:{}", sim.told("slcan"));
    let expected: Vec<String> = (1..=3).map(|n| format!("identifier {n}: {VERSION}")).collect();
    assert_eq!(scan(&[&can, "--addresses", "1-5"]), expected);
    // Identifiers are wider than addresses.
    assert!(run(&["send", &can, "--address", "3", "SGP 71, 0, 1794"]).status.success());
    assert_eq!(scan(&[&can, "--addresses", "1793-1795"]), [format!("identifier 1794: {VERSION}")]);
    let output = run(&["send", &can, "--address", "1794", "GGP 71, 0"]);
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "GGP 71, 0: 1794 (CAN ID), status 100 ok\n");
    let output = run(&["send", bus, "--address", "256", "GAP 1, 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("addresses go up to 255 on this link"), "{}", complaint(&output));
}

#[test]
fn a_module_alone_on_its_link_is_found_once() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/port"]);
    sim.tcp().ok("SGP 66, 0, 7");
    let expected = [format!("one module, whatever the address: address 7: {VERSION}")];
    assert_eq!(scan(&[&format!("tcp:{}", sim.told("tcp"))]), expected);
    assert_eq!(scan(&[sim.told("serial")]), expected);
}

#[test]
fn nobody_there_is_a_failure() {
    let sim = Sim::start(&["--rs485", "{}/bus"]);
    let output = run(&["scan", sim.told("rs485"), "--addresses", "2-4", "--baud", "9600"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(output.stdout.is_empty());
    assert!(complaint(&output).contains("no module answers"), "{}", complaint(&output));
}
