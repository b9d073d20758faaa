//! `tmcl params`: settings into a file and back.

use std::path::Path;

use super::harness::{Sim, complaint, names, run, type_into};
use super::pty::Terminal;

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

/// Runs `tmcl params` and gives its exit code, and what it says on standard output and standard error.
fn say(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = run(&[&["params"], arguments].concat());
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), complaint(&output))
}

#[test]
fn single_settings_are_read_and_written_by_name_and_by_number() {
    let sim = Sim::start(&["--product", "3110", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let mut host = sim.tcp();
    let (code, said, _) = say(&[&link, "set", "APMaxPositioningSpeed=3*500", "6=$40", "--axis", "2", "--store"]);
    assert_eq!(code, Some(0));
    assert_eq!(said, "SAP 4, 2, 1500 // maximum positioning speed\nSAP 6, 2, 64 // maximum current\n");
    assert_eq!((host.ok("GAP 4, 2"), host.ok("GAP 4, 0")), (1500, 1000));
    assert_eq!(say(&[&link, "set", "5=100"]).0, Some(0));
    sim.control(&["power off", "power on"]);
    assert_eq!((sim.tcp().ok("GAP 4, 2"), sim.tcp().ok("GAP 6, 2")), (1500, 64));
    let (code, said, complaint) = say(&[&link, "get", "APMaxPositioningSpeed", "6", "--axis", "2", "--value"]);
    assert_eq!((code, said.as_str(), complaint.as_str()), (Some(0), "1500\n64\n", ""));
    assert_eq!(say(&[&link, "get", "GPSerialAddress"]).1, "SGP 66, 0, 1 // serial address\n");
    assert_eq!(say(&[&link, "set", "7=-5", "--bank", "2"]).1, "SGP 7, 2, -5\n");
    assert_eq!(say(&[&link, "get", "7", "TI_INPUT0", "--bank", "2"]).0, Some(2), "that is one of bank 3");
    assert_eq!(say(&[&link, "get", "TI_INPUT0"]).1, "SGP 39, 3, 0\n");
}

#[test]
fn what_cannot_be_written_is_said_and_nothing_else_is() {
    let sim = Sim::start(&["--product", "3212", "--tcp", "127.0.0.1:0"]);
    let link = &format!("tcp:{}", sim.told("tcp"));
    let old = sim.tcp().ok("GAP 6, 0");
    for (arguments, code, expected) in [
        (&["set", "6=64", "APMaxCurent=5"][..], 2, "unknown name 'APMaxCurent'; did you mean 'APMaxCurrent'?"),
        (&["set", "6=64", "4="], 2, "for example APMaxCurrent=100 or 6=100"),
        (&["set", "6=64/0"], 2, "'64/0': division by zero"),
        (&["set", "6=64", "--store"], 1, "maximum current: this module does not store parameters of its axes"),
        (&["set", "6=64", "--axis", "0", "--bank", "0"], 2, "cannot be used with"),
        (
            &["set", "6=256"],
            1,
            "SAP 6, 0, 256: status 4 value, motor or bank out of range; maximum current takes 0..255",
        ),
        (&["set", "6=64", "--axis", "3"], 1, "axis 3: the module has axes 0 to 2"),
        (&["set", "60=1", "--bank", "2", "--store"], 1, "only user variables 0 to 55 can be stored"),
        (&["set", "TI_INPUT0=1", "--store"], 1, "parameters of bank 3 cannot be stored"),
        (&["get", "250"], 1, "GAP 250, 0: status 3"),
        (&["list", "--axis", "3"], 1, "axis 3: the module has axes 0 to 2"),
        (&["list", "--bank", "2"], 1, "get --bank 2 NUMBER"),
        (&["list", "gremlins"], 1, "no parameter has all these words"),
    ] {
        let (told, said, complaint) = say(&[&[link.as_str()], arguments].concat());
        assert_eq!((told, said.as_str()), (Some(code), ""), "{arguments:?}: {complaint}");
        assert!(complaint.contains(expected), "{arguments:?}: {complaint}");
    }
    assert_eq!((sim.tcp().ok("GAP 6, 0"), sim.tcp().ok("GGP 60, 2")), (old, 0));
    let (code, _, complaint) = say(&["get", "6"]);
    assert!(code == Some(2) && complaint.contains("tmcl params LINK list"), "{complaint}");
}

/// Ranges and defaults are those of the manual: section 4.1 for parameter 4, 5.1 for parameter 65, 5.4 for interrupts.
#[test]
fn the_list_has_values_units_ranges_and_defaults() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = &format!("tcp:{}", sim.told("tcp"));
    sim.tcp().ok("SAP 4, 0, 1500");
    let (code, said, _) = say(&[link, "list"]);
    assert_eq!(code, Some(0));
    let lines: Vec<String> = said.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect();
    for line in [
        "Axis 0",
        "value unit takes default name",
        "4 1500* int 1..2047 1000 maximum positioning speed",
        "1 0 microsteps any 0 actual position",
        "3 0 int read only 0 actual speed",
        "Global parameters, bank 0",
        "66 1 1..255 1 serial address",
        "Interrupts, bank 3",
        "39 0 0..3 0 input 0 transition",
    ] {
        assert!(lines.iter().any(|shown| shown == line), "{line} is not in\n{said}");
    }
    let (code, said, _) = say(&[link, "list", "Maximum", "current", "--axis", "0"]);
    assert_eq!((code, said.lines().count()), (Some(0), 3), "{said}");
}

#[test]
fn settings_are_compared() {
    let sim = Sim::start(&["--product", "1140,3110", "--tcp", "127.0.0.1:0", "--rs485", "{}/bus"]);
    let link = &format!("tcp:{}", sim.told("tcp"));
    let file = sim.path("axis.tmcl");
    let file = file.to_str().unwrap();
    assert_eq!(say(&[link, "save", file]).0, Some(0));
    assert_eq!(say(&["diff", file, link]), (Some(0), "".into(), "tmcl: reading 139 settings\n".into()));
    assert_eq!(say(&["diff", link, link]).0, Some(0));
    sim.tcp().ok("SAP 4, 0, 1500");
    sim.tcp().ok("SCO 20, 0, 7");
    let changed = format!(
        "--- {file}\n+++ {link}\n-SAP 4, 0, 1000 // maximum positioning speed\n+SAP 4, 0, 1500 // maximum positioning speed\n\
         -SCO 20, 0, 0\n+SCO 20, 0, 7\n"
    );
    assert_eq!(say(&["diff", file, link]).1, changed);
    assert_eq!(say(&["diff", file, link]).0, Some(1));
    // Of a module only what the file has is compared.
    let few = sim.path("few.tmcl");
    let few = few.to_str().unwrap();
    std::fs::write(few, "SAP 4, 0, 1500\n").unwrap();
    assert_eq!(say(&["diff", link, few]).0, Some(0));
    let (_, said, _) = say(&["diff", few, file]);
    assert!(said.contains("\n+SAP 5, 0, ") && said.contains("-SAP 4, 0, 1500 ") && !said.contains("-SAP 5"), "{said}");
    // A comparison goes with options of the link, and with standard input.
    let piped = type_into(&["params", "diff", "-", sim.told("rs485"), "--address", "1"], "SAP 4, 0, 1\n");
    assert_eq!(piped.status.code(), Some(1));
    let said = String::from_utf8_lossy(&piped.stdout);
    assert!(said.contains("-SAP 4, 0, 1 // maximum positioning speed\n+SAP 4, 0, 1500"), "{said}");
    for (arguments, code, expected) in [
        (&["diff", file, sim.told("rs485"), "--address", "2", "--timeout", "10000"][..], 1, "is of a TMCM-1140, and"),
        (&["diff", file, "none.tmcl"], 2, "there is no such file"),
        (&["diff", "nofile", file], 2, "there is no such file, and it is no LINK"),
        (&["diff", "/dev/nobody", file], 1, "Is the module connected?"),
        (&["diff", file], 2, "<B>"),
        (&[link, "diff", file, file], 2, "tmcl params diff A B"),
    ] {
        let (told, said, complaint) = say(arguments);
        assert!(told == Some(code) && said.is_empty() && complaint.contains(expected), "{arguments:?}: {complaint}");
    }
}

/// Manual section 3.7.24: coordinates 1 to 20 can be stored, number 0 is in RAM only.
#[test]
fn coordinates_of_all_axes_are_saved_and_standard_output_takes_them() {
    for (product, axes) in [("1140", 1), ("1110", 1), ("3110", 3), ("3212", 3), ("6110", 6)] {
        let (code, said, complaint) = say(&["sim", "--product", product, "save", "-"]);
        assert_eq!(code, Some(0), "{complaint}");
        let coordinates: Vec<&str> = said.lines().filter(|line| line.starts_with("SCO ")).collect();
        let expected: Vec<String> =
            (0..axes).flat_map(|axis| (1..=20).map(move |number| format!("SCO {number}, {axis}, 0"))).collect();
        assert_eq!(coordinates, expected, "{product}");
        let settings = said.lines().filter(|line| line.starts_with('S')).count();
        assert!(complaint.ends_with(&format!("tmcl: {settings} settings\n")), "{complaint}");
        // What is printed can be read again.
        let again = type_into(&["params", "sim", "--product", product, "restore", "-"], &said);
        assert_eq!(again.status.code(), Some(0), "{}", super::harness::complaint(&again));
    }
}

/// On a bus on which each reply takes a fifth of a second.
#[test]
fn what_is_interrupted_is_told_and_nothing_is_lost() {
    let sim = Sim::start(&["--rs485", "{}/bus", "--tcp", "127.0.0.1:0", "--speed", "0.05"]);
    let (bus, file) = (sim.told("rs485"), sim.path("axis.tmcl"));
    let name = file.to_str().unwrap();
    let old = "SAP 4, 0, 1500\nSAP 5, 0, 500\n".repeat(70);
    std::fs::write(&file, &old).unwrap();
    let before = names(sim.folder.path());
    for (arguments, begins, told) in [
        (&["save", name][..], "reading 139 settings", ""),
        (&["list"], "", ""),
        (
            &["restore", name],
            "restoring 140 settings",
            " of 140 settings are as in the file; restore it again for the rest",
        ),
        (&["diff", name, bus], "reading 140 settings", ""),
    ] {
        let link: &[&str] = if arguments[0] == "diff" { &[] } else { &[bus] };
        let options = ["--timeout", "20000"];
        let mut terminal = Terminal::start_with(&[&["params"], link, arguments, &options].concat(), 40);
        if begins.is_empty() {
            std::thread::sleep(std::time::Duration::from_millis(500));
        } else {
            terminal.expect(begins);
            terminal.expect("  1 %");
        }
        terminal.keys("\x03");
        let (status, said) = terminal.end();
        // `list` may not have begun.
        assert!(status.code() == Some(130) || arguments == ["list"], "{arguments:?}: {status} {said}");
        assert!(said.contains(told), "{arguments:?}: {said}");
        assert!(terminal.is_as_before());
        assert_eq!(names(sim.folder.path()), before, "{arguments:?}");
        assert_eq!(std::fs::read_to_string(&file).unwrap(), old);
    }
}

#[test]
fn files_that_are_none_are_told() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(path("binary.tmcl"), [0xFF, 0, 1]).unwrap();
    std::fs::write(path("empty.tmcl"), "").unwrap();
    for (arguments, code, expected) in [
        (&["sim", "restore", &path("none.tmcl")][..], 1, "cannot read "),
        (&["sim", "restore", &path("")], 1, "cannot read "),
        (&["sim", "restore", &path("binary.tmcl")], 1, "binary.tmcl is no text (UTF-8)"),
        (&["sim", "save", &path("none/axis.tmcl")], 1, "cannot write "),
        (&["sim", "save", &path("")], 1, "cannot write "),
        (&["sim", "save", "/dev/full"], 1, "cannot write /dev/full"),
        (&["diff", "-", "-"], 2, "standard input can be one of the two, and not both"),
        (&["sim", "get", "300"], 2, "300 is no parameter; their numbers are 0 to 255"),
        (&["sim", "set", "4"], 2, "for example APMaxCurrent=100"),
        (&["sim", "get", "4", "--axis", "x"], 2, "invalid value 'x'"),
        (&["tcp:localhost", "list"], 2, "give a host and a port"),
        (&["/dev/null", "list"], 1, "/dev/null"),
    ] {
        let (told, said, complaint) = say(arguments);
        assert!(told == Some(code) && said.is_empty(), "{arguments:?}: {told:?} {said} {complaint}");
        assert!(complaint.contains(expected), "{arguments:?}: {complaint}");
    }
    // A file without a setting has nothing that is different.
    assert_eq!(say(&["diff", &path("empty.tmcl"), "sim"]).0, Some(0));
    assert_eq!(say(&["sim", "restore", &path("empty.tmcl")]).0, Some(0));
}
