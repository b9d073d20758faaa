//! `tmcl sim --eeprom`: what is stored outlives the process.

use rustix::process::Signal;

use super::harness::{Sim, complaint, names, run};

const OPTIONS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--eeprom", "{}/module.bin"];

#[test]
fn settings_survive_the_process_and_its_violent_end() {
    let mut folder = tempfile::tempdir().unwrap();
    for (value, signal) in [(1100, Signal::TERM), (1200, Signal::KILL), (1300, Signal::INT)] {
        let sim = Sim::start_in(folder, &OPTIONS);
        let mut host = sim.tcp();
        host.ok(&format!("SAP 4, 0, {value}"));
        host.ok("STAP 4, 0");
        folder = sim.end(signal).1;
        assert_eq!(names(folder.path()), ["module.bin"]);
        assert_eq!(std::fs::metadata(folder.path().join("module.bin")).unwrap().len(), 16_384);
        let sim = Sim::start_in(folder, &OPTIONS);
        assert_eq!(sim.tcp().ok("GAP 4, 0"), value);
        folder = sim.end(Signal::TERM).1;
    }
}

#[test]
fn a_file_of_another_kind_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("thesis.txt");
    std::fs::write(&path, "irreplaceable").unwrap();
    let output = run(&["sim", "--eeprom", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("has 13 bytes, an EEPROM has 16384"), "{}", complaint(&output));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "irreplaceable");
}

#[test]
fn a_file_that_cannot_be_made_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("missing/module.bin");
    let output = run(&["sim", "--eeprom", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("--eeprom: cannot write"), "{}", complaint(&output));
}
