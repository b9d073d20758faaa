//! The tools with a TMCM-3212: speeds in pps or in units of its chip, nothing of an axis stored, a longer program
//! memory.

use super::harness::{Sim, complaint, run, type_into};

/// A virtual module, and its link.
fn module() -> (Sim, String) {
    module_with(&[])
}

/// The same, with more options.
fn module_with(options: &[&str]) -> (Sim, String) {
    let links = ["--product", "3212", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
    let sim = Sim::start(&[&links[..], options].concat());
    let link = format!("tcp:{}", sim.told("tcp"));
    (sim, link)
}

/// The output of `tmcl send` for these commands; they need not all be carried out.
fn sent(link: &str, lines: &[&str]) -> Vec<String> {
    let output = run(&[&["send", link], lines].concat());
    assert_eq!(complaint(&output), "", "{lines:?}");
    String::from_utf8(output.stdout).unwrap().lines().map(String::from).collect()
}

#[test]
fn values_are_in_pps_or_in_units_of_the_chip() {
    let (_sim, link) = module();
    let lines =
        ["136, 0", "GAP 4, 2", "SAP 15, 1, 30000", "SAP 255, 1, 0", "SAP 15, 1, 30000", "GAP 15, 0", "ROL 1, 70"];
    assert_eq!(
        sent(&link, &lines),
        [
            "136, 0, 0, 0: 3212V105",
            "GAP 4, 2: 51200 pps (maximum positioning speed), status 100 ok",
            "SAP 15, 1, 30000: 30000 pps2 (acceleration A1), status 100 ok",
            "SAP 255, 1, 0: 0 (unit mode), status 100 ok",
            "SAP 15, 1, 30000: 30000 chip (acceleration A1), status 100 ok",
            "GAP 15, 0: 51200 pps2 (acceleration A1), status 100 ok",
            "ROL 1, 70: 70 chip, status 100 ok",
        ]
    );
    let lines =
        ["GAP 21, 0", "GAP 31, 0", "GAP 202, 0", "STAP 4, 0", "RSAP 4, 0", "139, 0, 0, 0", "GAP 153, 0", "GAP 0, 3"];
    assert_eq!(
        sent(&link, &lines),
        [
            "GAP 21, 0: 0 x32 us (ramp wait time), status 100 ok",
            "GAP 31, 0: 7 x16.384 ms (power down ramp), status 100 ok",
            "GAP 202, 0: 200 full steps/turn (motor full step resolution), status 100 ok",
            "STAP 4, 0: status 2 unknown command",
            "RSAP 4, 0: status 2 unknown command",
            "139, 0, 0, 0: status 2 unknown command",
            "GAP 153, 0: status 3 unknown type, or read-only",
            "GAP 0, 3: status 4 value, motor or bank out of range: there is no axis 3; the last of this module is 2",
        ]
    );
}

/// ROR and ROL turn as fast as the module can where they ask for more; parameters do not take that.
#[test]
fn speeds_end_at_the_same_limit() {
    let (_sim, link) = module();
    let said = sent(&link, &["ROR 0, 8000000", "GAP 2, 0", "MST 0", "SAP 4, 0, 7999775", "SAP 5, 0, 7629279"]);
    assert_eq!(said[1], "GAP 2, 0: 7999774 pps (target speed), status 100 ok");
    assert_eq!(said[0], "ROR 0, 8000000: 8000000 pps, status 100 ok");
    assert!(said[3..].iter().all(|line| line.ends_with("status 4 value, motor or bank out of range")), "{said:?}");
}

#[test]
fn the_monitor_has_the_unit_of_the_speeds() {
    let (sim, link) = module();
    let mut host = sim.tcp();
    host.ok("ROR 1, 40000");
    host.until("GAP 3, 1", 40_000);
    let shown = |link: &str| {
        let output = run(&["monitor", link, "--axis", "0,1", "--count", "1"]);
        assert!(output.status.success(), "{}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let said = shown(&link);
    assert!(said.starts_with("axis 0  position           0  speed        0 pps  load "), "{said}");
    assert!(said.contains("  speed    40000 pps  load ") && said.contains("switches -"), "{said}");
    // The number stays, and means another speed: 40000 * 16e6 / 2^24 = 38147 pps.
    host.ok("SAP 255, 0, 0");
    host.ok("SAP 255, 1, 0");
    host.until("GAP 3, 1", 40_000);
    assert!(shown(&link).contains("  speed    40000 chip  load "));
}

#[test]
fn the_debugger_has_the_unit_of_the_speeds() {
    let (sim, link) = module();
    let path = sim.path("turn.tmc");
    std::fs::write(&path, "ROR 2, 3000\nWAIT TICKS, 0, 50\nDone: STOP\n").unwrap();
    let output = type_into(&["debug", &link, path.to_str().unwrap()], "b Done\nc\naxes\nquit\n");
    assert!(output.status.success(), "{}", complaint(&output));
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("\naxis 0: position 0, speed 0 pps\n") && said.contains(", speed 3000 pps\n"), "{said}");
    assert!(said.ends_with("\nmotor 2 turns with speed 3000 pps; MST 2 stops it\n"), "{said}");
}

/// The settings of the axes are nowhere but in the file.
#[test]
fn settings_of_axes_are_kept_in_a_file() {
    let (sim, link) = module();
    let file = sim.path("axes.tmcl");
    let file = file.to_str().unwrap();
    let params = |action: &str, options: &[&str]| {
        let output = run(&[&["params", &link, action, file], options].concat());
        assert!(output.status.success(), "{}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    };
    let ours = [("SAP 15, 2, 30000", "GAP 15, 2"), ("SAP 255, 1, 0", "GAP 255, 1"), ("SAP 213, 0, 7", "GAP 213, 0")];
    let stored = [("SCO 20, 2, -7", "GCO 20, 2"), ("SGP 55, 2, 99", "GGP 55, 2")];
    let defaults = [51_200, 1, 0];
    for (line, _) in ours.iter().chain(&stored) {
        sim.tcp().ok(line);
    }
    params("save", &[]);
    let saved = std::fs::read_to_string(file).unwrap();
    assert!(saved.starts_with("// Settings of a module 3212V105, saved by tmcl params\n"), "{saved}");
    for (line, _) in ours.iter().chain(&stored) {
        assert!(saved.lines().any(|saved| saved.split(" // ").next() == Some(line)), "{line} is not in {saved}");
    }
    // What the module measures, and where its motors are, is no setting.
    for live in ["SAP 0,", "SAP 1,", "SAP 2,", "SAP 209,"] {
        assert!(!saved.contains(live), "{live}");
    }
    let said = params("restore", &["--store"]);
    assert!(
        said.contains(", stored but for those of the axes, which this module forgets when it is switched off"),
        "{said}"
    );
    sim.control(&["power off", "power on"]);
    let mut host = sim.tcp();
    host.ok("GCO 0, 255");
    assert_eq!(ours.map(|(_, line)| host.ok(line)), defaults);
    assert_eq!(stored.map(|(_, line)| host.ok(line)), [-7, 99]);
    drop(host);
    let said = params("restore", &[]);
    assert!(said.starts_with("settings restored: 3, the same already: "), "{said}");
    assert_eq!(ours.map(|(_, line)| sim.tcp().ok(line)), [30_000, 0, 7]);
}

/// Program memory holds 6144 commands: as many can be loaded, and not one more.
#[test]
fn the_program_memory_is_longer() {
    // Its time goes as fast as it is asked.
    let (sim, link) = module_with(&["--paused"]);
    let path = sim.path("long.tmc");
    let load = |commands: usize| {
        let source = format!("{}MST 2\n#nostop\n", "CALC ADD, 1\n".repeat(commands - 1));
        std::fs::write(&path, source).unwrap();
        run(&["load", &link, path.to_str().unwrap(), "--verify"])
    };
    let loaded = load(6144);
    assert!(loaded.status.success(), "{}", complaint(&loaded));
    let said = String::from_utf8(loaded.stdout).unwrap();
    assert!(said.contains("loaded to addresses 0 to 6143"), "{said}");
    assert_eq!(sent(&link, &["134, 0, 0, 6143"]), ["134, 0, 0, 6143: MST 2"]);
    let refused = load(6145);
    assert_eq!(refused.status.code(), Some(1));
    assert!(complaint(&refused).contains("6144"), "{}", complaint(&refused));
}

#[test]
fn inputs_are_digital_and_analog_at_once() {
    let (sim, link) = module();
    sim.control(&["analog 2 4095", "input 0 1"]);
    // The converter has 12 bits, the value 16. Input 0 is high, and so is 2, of which the level is the highest there
    // is.
    sim.tcp().until("GIO 2, 1", 65_535);
    sim.tcp().until("GIO 0, 0", 1);
    let lines = ["GIO 3, 1", "GIO 8, 1", "SIO 3, 2, 1", "GIO 3, 2", "SIO 0, 0, 1", "GIO 10, 0"];
    let said = sent(&link, &lines);
    assert_eq!(
        said[..5],
        [
            "GIO 3, 1: 0, status 100 ok",
            "GIO 8, 1: 24.0 V (supply), status 100 ok",
            "SIO 3, 2, 1: 1, status 100 ok",
            "GIO 3, 2: 1, status 100 ok",
            "SIO 0, 0, 1: status 3 unknown type, or read-only",
        ]
    );
    assert!(said[5].starts_with("GIO 10, 0: "), "{said:?}");
}
