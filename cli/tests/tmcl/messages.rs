//! Messages of the program when it is used wrongly.

use super::harness::{Sim, complaint, run};

/// Runs the program, which must end with this exit code and say all of this.
fn fails(arguments: &[&str], code: i32, said: &[&str]) {
    let output = run(arguments);
    let complaint = complaint(&output);
    assert_eq!(output.status.code(), Some(code), "{arguments:?}: {complaint}");
    for part in said {
        assert!(complaint.contains(part), "{arguments:?}: '{part}' is not in: {complaint}");
    }
    assert!(output.stdout.is_empty(), "{arguments:?}");
}

#[test]
fn usage_errors_end_with_2_and_say_what_to_write() {
    fails(&["sim", "--speed", "0"], 2, &["'0'", "0.001 to 1000"]);
    fails(&["sim", "--speed", "fast"], 2, &["'fast'", "0.001 to 1000"]);
    fails(&["sim", "--tcp", "4140"], 2, &["127.0.0.1:4140"]);
    fails(&["sim", "--control", "127.0.0.1:99999"], 2, &["127.0.0.1:4140"]);
    fails(&["sim", "port"], 2, &["unexpected argument 'port'"]);
    fails(&["frobnicate"], 2, &["unrecognized subcommand"]);
    fails(&[], 2, &["Usage"]);
    fails(&["send", "sim"], 2, &["<COMMAND>"]);
    fails(&["send", "sim", "GOTO 1"], 2, &["unknown command 'GOTO'"]);
    fails(&["send", "sim", "SAP 4, 0"], 2, &["missing <value>", "usage: SAP"]);
    fails(&["send", "tcp:localhost", "GAP 1, 0"], 2, &["tcp:127.0.0.1:4140"]);
}

#[test]
fn a_port_in_use_is_told() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    fails(&["sim", "--tcp", sim.told("tcp")], 1, &["--tcp", "another program uses that port"]);
    fails(&["sim", "--control", sim.told("tcp")], 1, &["--control", "another program uses that port"]);
}

#[test]
fn files_of_the_user_are_never_replaced_by_a_link() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    std::fs::write(at("file"), "mine").unwrap();
    std::os::unix::fs::symlink(at("file"), at("link")).unwrap();
    for name in ["file", "link", ""] {
        fails(&["sim", "--serial", &at(name)], 1, &["--serial", "is left alone"]);
    }
    assert_eq!(std::fs::read_to_string(at("link")).unwrap(), "mine");
    fails(&["sim", "--serial", &at("missing/port")], 1, &["Its directory has to exist"]);
}

#[test]
fn a_bad_world_is_told_with_its_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.toml");
    let file = path.to_str().unwrap();
    fails(&["sim", "--world", file], 1, &["--world: cannot read", "world.toml"]);
    std::fs::write(&path, "seed = 1\n[motor]\nsteps = 200\n").unwrap();
    fails(&["sim", "--world", file], 1, &["world.toml", "line 3", "steps_per_turn"]);
    std::fs::write(&path, "[motor]\nload = 2.0\n").unwrap();
    fails(&["sim", "--world", file], 1, &["world.toml", "motor.load"]);
    std::fs::write(&path, "[[axis]]\nmotor.load = 0.5\n[[axis]]\n").unwrap();
    fails(
        &["sim", "--world", file],
        1,
        &["world.toml: line 3: this is [[axis]] number 2, and the TMCM-1140 has one axis"],
    );
    std::fs::write(&path, "[[axis]]\nmotor.mass = 0.5\n").unwrap();
    fails(&["sim", "--world", file], 1, &["world.toml", "line 2", "mass"]);
}

/// Nobody would live to see the end of reading them.
#[test]
fn files_that_are_far_too_large_are_not_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("huge.tmc");
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    for huge in [path.to_str().unwrap(), "/dev/zero"] {
        fails(&["sim", "--world", huge], 1, &["--world: cannot read", "it is larger than 1048576 bytes"]);
        fails(&["params", "sim", "restore", huge], 1, &["it is larger than 1048576 bytes"]);
        fails(&["asm", huge], 1, &["it is larger than 1048576 bytes"]);
        fails(&["disasm", huge], 1, &["it is larger than 1048576 bytes"]);
    }
    fails(&["sim", "--image", path.to_str().unwrap()], 1, &["it is larger than 268435456 bytes"]);
}

#[test]
fn links_that_cannot_be_opened_are_told() {
    fails(&["send", "/dev/there-is-no-such-port", "GAP 1, 0"], 1, &["cannot open", "tmcl sim --serial"]);
    fails(&["send", "/dev/null", "GAP 1, 0"], 1, &["/dev/null is not a serial device"]);
    // Port 1 is nobody's.
    fails(&["send", "tcp:127.0.0.1:1", "GAP 1, 0"], 1, &["cannot connect", "tmcl sim --tcp"]);
}

#[test]
fn help_is_there() {
    for command in ["sim", "send", "asm", "disasm", "params", "monitor", "scan", "load", "debug", "calc", "eds"] {
        let output = run(&[command, "--help"]);
        assert!(output.status.success());
        assert!(String::from_utf8_lossy(&output.stdout).contains(&format!("Usage: tmcl {command}")));
    }
    let output = run(&["--help"]);
    assert!(output.status.success());
    assert!(String::from_utf8_lossy(&output.stdout).contains("Usage: tmcl"));
}
