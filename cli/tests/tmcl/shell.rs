//! `tmcl shell`: commands that are typed and their answers, watching, and modules that are not there.

use std::net::TcpListener;

use rustix::process::Signal;

use super::harness::{complaint, run, type_into};
use super::shell_jog::Bench;

#[test]
fn lines_are_completed_and_answered_in_words() {
    let mut bench = Bench::start(&["--product", "3110"]);
    bench.shell.keys("SAP APMaxC\t, Motor2, 2*50\r");
    bench.shell.expect("SAP 6, 2, 100: 100 1/255 (maximum current), status 100 ok");
    bench.shell.line("SAP 4, 0, 5000");
    bench.shell.expect("SAP 4, 0, 5000: status 4 value, motor or bank out of range");
    bench.shell.line("jog 9");
    bench.shell.expect("axis 9: the module has axes 0 to 2");
    bench.shell.line("GAP APMaxCurent, 0");
    bench.shell.expect("did you mean 'APMaxCurrent'?");
    bench.shell.line("help");
    bench.shell.expect("jog [AXIS] [SPEED]");
    // The up arrow brings back what was typed before.
    bench.shell.expect("(tmcl) ");
    bench.shell.keys("\x1b[A\x1b[A\x1b[A\x1b[A\x1b[A\r");
    bench.shell.expect("SAP 6, 2, 100: 100 1/255 (maximum current), status 100 ok");
    assert_eq!(bench.ok("GAP 6, 2"), 100);
    bench.shell.expect("(tmcl) ");
    bench.shell.keys("\x04");
    assert_eq!(bench.shell.end().0.code(), Some(0));
    assert!(bench.shell.is_as_before());
}

#[test]
fn parameters_are_watched_until_a_key() {
    let mut bench = Bench::start_with(&[], 40);
    bench.shell.line("watch APActualPosition APTargetPosition APActualSpeed");
    // A line never gets longer than the terminal is wide.
    let shown = bench.shell.expect("APActualPosition=0 APTargetPosition=...");
    assert!(!shown.contains("APActualSpeed="), "{shown}");
    bench.shell.keys("q");
    bench.shell.expect("(tmcl) ");
    bench.shell.line("watch 1 8");
    bench.shell.expect("1=0 8=1");
    bench.ok("MVP ABS, 0, 5000");
    bench.shell.expect("1=5000 8=1");
    bench.shell.keys("\x03");
    bench.shell.expect("(tmcl) ");
    bench.shell.line("watch 250");
    bench.shell.expect("GAP 250, 0: status 3");
    bench.shell.expect("(tmcl) ");
    bench.shell.line("watch 1");
    bench.shell.expect("1=5000");
    bench.shell.signal(Signal::TERM);
    assert_eq!(bench.shell.end().0.code(), Some(143));
    assert!(bench.shell.is_as_before());
}

#[test]
fn without_a_terminal_lines_are_read_and_a_jog_is_refused() {
    let output = type_into(
        &["shell", "sim"],
        "// of axis 0\nSAP 4, 0, 3*500\n\n  // what it was\nGAP 4, 0 // now\nwatch 4 1\nhelp\nquit\nGAP 5, 0\n",
    );
    assert_eq!(output.status.code(), Some(0), "{}", complaint(&output));
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let lines: Vec<&str> = said.lines().collect();
    assert_eq!(
        lines[..2],
        [
            "SAP 4, 0, 1500: 1500 int (maximum positioning speed), status 100 ok",
            "GAP 4, 0: 1500 int (maximum positioning speed), status 100 ok"
        ]
    );
    assert_eq!(lines[2], "4=1500 1=0");
    assert!(!said.contains("GAP 5") && !said.contains("(tmcl)"), "{said}");
    for (text, expected) in [
        ("jog\n", "tmcl: jog needs a terminal, because the motor moves only while a key is held there"),
        ("dance\n", "tmcl: unknown command 'dance'; help shows what can be typed"),
        ("watch 250\n", "tmcl: GAP 250, 0: status 3"),
    ] {
        let output = type_into(&["shell", "sim"], &format!("{text}GAP 1, 0"));
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(complaint(&output).starts_with(expected), "{}", complaint(&output));
        // What follows is done all the same.
        assert!(String::from_utf8_lossy(&output.stdout).contains("GAP 1, 0: 0 microsteps"), "{text}");
    }
}

#[test]
fn a_module_that_is_not_there_is_told_at_once() {
    let silent = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = silent.local_addr().unwrap().to_string();
    let link = format!("tcp:{address}");
    for (arguments, code, expected) in [
        (&["shell", &link, "--timeout", "200"][..], 1, "no reply; check power"),
        (&["shell", "tcp:127.0.0.1:1"], 1, "cannot connect to 127.0.0.1:1"),
        (&["shell", "/dev/null"], 1, "/dev/null"),
        (&["shell", "tcp:localhost"], 2, "give a host and a port"),
        (&["shell"], 2, "<LINK>"),
        (&["shell", "sim", "--product", "9999"], 2, "none of 1140"),
    ] {
        let output = run(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}");
        assert!(complaint(&output).contains(expected), "{arguments:?}: {}", complaint(&output));
    }
}
