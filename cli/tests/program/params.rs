//! `tmcl params`: settings into a file and back.

use std::path::Path;

use super::harness::{Sim, complaint, run};

/// Runs `tmcl params` and gives what it says.
fn params(link: &[&str], action: &str, file: &Path, options: &[&str]) -> (Option<i32>, String) {
    let output = run(&[&["params"], link, &[action, file.to_str().unwrap()], options].concat());
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned() + &complaint(&output))
}

/// A module whose settings go into a file, and come back from there.
struct Journey {
    sim: Sim,
    link: String,
}

impl Journey {
    /// Starts the module, sets what `lines` say, and saves it; gives what was said to that, and the file.
    fn begin(options: &[&str], lines: &[String]) -> (Self, String, String) {
        let sim = Sim::start(&[options, &["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]].concat());
        let link = format!("tcp:{}", sim.told("tcp"));
        let journey = Journey { sim, link };
        for line in lines {
            journey.sim.tcp().ok(line);
        }
        let (said, saved) = journey.saved("axis.tmcl");
        for line in lines {
            assert!(saved.lines().any(|saved| saved.split(" // ").next() == Some(line)), "{line} is not in {saved}");
        }
        (journey, said, saved)
    }

    /// Saves the settings in a file of this name; gives what was said, and the file.
    fn saved(&self, name: &str) -> (String, String) {
        let file = self.sim.path(name);
        let (code, said) = params(&[&self.link], "save", &file, &[]);
        assert_eq!(code, Some(0), "{said}");
        (said, std::fs::read_to_string(&file).unwrap())
    }

    /// Takes the module back to its factory defaults.
    fn forget(&self) {
        let reset = ["send", &self.link, "--timeout", "200", "137, 0, 0, 1234"];
        assert_eq!(run(&reset).status.code(), Some(0));
    }

    /// Restores the settings from the first file, stores them, and switches the module off and on; gives what was said,
    /// and what is saved then.
    fn end(self) -> (String, String) {
        let (code, said) = params(&[&self.link], "restore", &self.sim.path("axis.tmcl"), &["--store"]);
        assert_eq!(code, Some(0), "{said}");
        self.sim.control(&["power off", "power on"]);
        // Coordinates are taken from the EEPROM on request.
        self.sim.tcp().ok("GCO 0, 255");
        (said, self.saved("again.tmcl").1)
    }
}

#[test]
fn settings_come_back_and_stay() {
    let lines = ["SAP 153, 0, 13", "SAP 154, 0, 5", "SAP 4, 0, 1500", "SGP 79, 0, 1", "SGP 55, 2, -7", "SCO 20, 0, 9"];
    let (journey, said, saved) = Journey::begin(&[], &lines.map(String::from));
    assert!(said.contains("139 settings saved"), "{said}");
    assert!(["SAP 0,", "SAP 1,", "SAP 209,", "SGP 132,", "SGP 81,"].iter().all(|live| !saved.contains(live)));

    journey.forget();
    // From here the ramp divisor 13 cannot be reached before the pulse divisor has changed.
    for line in ["SAP 153, 0, 0", "SAP 154, 0, 0"] {
        journey.sim.tcp().ok(line);
    }
    let (said, again) = journey.end();
    assert!(said.contains("settings restored: 6, the same already: 123, all stored"), "{said}");
    assert!(said.contains("settings of the interfaces left as they are: 10;"), "{said}");
    assert_eq!(again, saved);
}

#[test]
fn interfaces_are_restored_on_demand() {
    let sim = Sim::start(&["--modules", "3", "--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"]);
    let bus = sim.told("rs485").to_string();
    let can = format!("slcan:tcp:{}", sim.told("slcan-tcp"));
    let file = sim.path("bus.tmcl");
    std::fs::write(&file, "SGP 66, 0, 9\nSGP 71, 0, 8\nSGP 76, 0, 4 // host\nSAP 4, 0, 1500\n").unwrap();
    let (code, said) = params(&[&bus, "--address", "2"], "restore", &file, &[]);
    assert_eq!(code, Some(0), "{said}");
    assert!(
        said.contains("settings restored: 1, the same already: 0\nsettings of the interfaces left as they are: 3"),
        "{said}"
    );
    let (code, said) = params(&[&bus, "--address", "2"], "restore", &file, &["--interface"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("settings restored: 3, the same already: 1"), "{said}");
    let output = run(&["send", &bus, "--address", "9", "GGP 71, 0", "GGP 76, 0"]);
    assert!(output.status.success(), "{}", complaint(&output));
    // On CAN it is the identifier that must change last.
    let (code, said) = params(&[&can, "--address", "3"], "restore", &file, &["--interface"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("settings restored: 4"), "{said}");
}

#[test]
fn refusals_are_told_one_by_one() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = sim.path("axis.tmcl");
    std::fs::write(&file, "SAP 4, 0, 5000\nSAP 250, 0, 1\nSAP 6, 3, 100\nSAP 6, 0, 100\n").unwrap();
    let (code, said) = params(&[&link], "restore", &file, &["--store"]);
    assert_eq!(code, Some(1));
    assert!(said.contains("settings restored: 1, the same already: 0"), "{said}");
    assert!(said.contains("refused: SAP 4, 0, 5000: status 4 value"), "{said}");
    assert!(said.contains("refused: SAP 250, 0, 1: status 3 unknown"), "{said}");
    assert!(said.contains("refused: SAP 6, 3, 100: status 4"), "{said}");
    assert_eq!(said.matches("refused").count(), 3, "{said}");

    std::fs::write(&file, "SAP 6, 0, 100\nROR 0, 100\n").unwrap();
    let (code, said) = params(&[&link], "restore", &file, &[]);
    assert_eq!(code, Some(1));
    assert!(said.contains("axis.tmcl:2: ROR 0, 100 is not a setting"), "{said}");
}

#[test]
fn nothing_is_restored_while_the_motor_turns() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = sim.path("axis.tmcl");
    std::fs::write(&file, "SAP 4, 0, 1500\n").unwrap();
    let mut host = sim.tcp();
    host.ok("ROR 0, 100");
    host.until("GAP 3, 0", 100);
    let (code, said) = params(&[&link], "restore", &file, &[]);
    assert_eq!(code, Some(1));
    assert!(said.contains("motor 0 turns; stop it first"), "{said}");
    assert_eq!(host.ok("GAP 4, 0"), 1000);
}

/// Settings that differ from axis to axis survive a factory reset in a file.
#[test]
fn settings_of_all_axes_come_back() {
    for (product, axes) in [("3110", 3), ("6110", 6)] {
        let lines: Vec<String> = (0..axes)
            .flat_map(|axis| [format!("SAP 4, {axis}, 150{axis}"), format!("SCO 20, {axis}, -7{axis}")])
            .chain([format!("SGP 79, 0, {}", if axes == 6 { 2 } else { 1 })])
            .collect();
        let (journey, said, saved) = Journey::begin(&["--product", product], &lines);
        assert!(!said.contains("unknown to this module"), "{said}");
        assert!(saved.starts_with(&format!("// Settings of a module {product}V1")), "{saved}");
        journey.forget();
        let (said, again) = journey.end();
        assert!(said.contains(&format!("settings restored: {}, ", lines.len())), "{said}");
        assert_eq!(again, saved);
    }
}

#[test]
fn a_file_of_another_product_is_refused() {
    let sim = Sim::start(&["--product", "6110", "--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let file = sim.path("axis.tmcl");
    let (code, said) = params(&["sim"], "save", &file, &[]);
    assert_eq!(code, Some(0), "{said}");
    let saved = std::fs::read_to_string(&file).unwrap();
    std::fs::write(&file, saved.replace("SAP 4, 0, 1000", "SAP 4, 0, 1234")).unwrap();
    let (code, said) = params(&[&link], "restore", &file, &[]);
    assert_eq!(code, Some(1));
    let expected = "axis.tmcl has the settings of a TMCM-1140, and this module is a TMCM-6110";
    assert!(said.contains(expected) && said.contains("take the line \"// Settings of a module 1140"), "{said}");
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1000);
    // The user knows better, in either of two ways.
    let (code, said) = params(&[&link, "--product", "1140"], "restore", &file, &[]);
    assert!(code == Some(1) && said.contains("refused: SAP 210, 0, "), "{said}");
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1234);
    std::fs::write(&file, "SAP 4, 0, 1235\n").unwrap();
    assert_eq!(params(&[&link], "restore", &file, &[]).0, Some(0));
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1235);
}
