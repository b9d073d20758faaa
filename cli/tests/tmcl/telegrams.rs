//! `--log-telegrams`: what goes over the links, from the modules' side and from the host's.

use std::fs;
use std::io::Read;
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::process::Signal;

use super::harness::{PATIENCE, Sim, complaint, request, run, type_into};
use super::image;

/// The lines of a log without their times, each of which has to be a number with six digits that is not below the one
/// before it.
fn lines(path: &Path) -> Vec<String> {
    let log = fs::read_to_string(path).unwrap();
    let mut last = 0.0;
    let behind_the_time = |line: &str| {
        let (time, rest) = line.trim_start().split_once("  ").unwrap();
        assert_eq!(time.split_once('.').unwrap().1.len(), 6, "{line}");
        let time: f64 = time.parse().unwrap();
        assert!(time >= last, "{log}");
        last = time;
        rest.trim_end().to_owned()
    };
    log.lines().map(behind_the_time).collect()
}

/// Waits until a log has a text in it.
fn wait_for(path: &Path, text: &str) {
    let end = Instant::now() + PATIENCE;
    while !fs::read_to_string(path).unwrap().contains(text) {
        assert!(Instant::now() < end, "{text} is not in\n{}", fs::read_to_string(path).unwrap());
    }
}

/// The texts of the lines of a log, each behind its direction.
fn said(path: &Path) -> Vec<String> {
    let behind = |line: &String| format!("{} {}", &line[9..10], line[41..].trim_start());
    lines(path).iter().map(behind).collect()
}

#[test]
fn a_simulator_logs_what_the_clients_of_all_links_say() {
    let links = ["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"];
    let sim = Sim::start(&[&links[..], &["--log-telegrams", "{}/log"]].concat());
    let log = sim.path("log");
    assert_eq!(sim.serial().ok("GAP 6, 0"), 128);
    let mut host = sim.tcp();
    host.write(&request("GAP 6, 0")[..4]);
    // Time passes until the rest of the telegram is not awaited any more.
    wait_for(&log, "torn");
    assert_eq!(host.ok("SGP 9, 2, 7"), 7);
    let mut wrong = request("GAP 6, 0");
    wrong[8] += 1;
    host.write(&wrong);
    assert_eq!(host.read()[2], 1);
    for link in [sim.told("rs485").to_owned(), format!("slcan:tcp:{}", sim.told("slcan-tcp"))] {
        assert!(run(&["send", &link, "GAP 6, 0", "--product", "1140"]).status.success(), "{link}");
    }
    let (_, folder) = sim.end(Signal::TERM);
    assert_eq!(
        lines(&folder.path().join("log")),
        [
            "usb 0    >  01 06 06 00 00 00 00 00 0D   to 1: GAP 6, 0",
            "usb 0    <  02 01 64 06 00 00 00 80 ED   from 1: 128 1/255 (maximum current), status 100 ok",
            "usb 3    >  01 06 06 00                  torn: 4 of 9 bytes",
            "usb 3    >  01 09 09 02 00 00 00 07 1C   to 1: SGP 9, 2, 7",
            "usb 3    <  02 01 64 09 00 00 00 07 77   from 1: 7, status 100 ok",
            "usb 3    >  01 06 06 00 00 00 00 00 0E   wrong checksum: to 1: GAP 6, 0",
            "usb 3    <  02 01 01 00 00 00 00 00 04   from 1: status 1 wrong checksum",
            "rs485    >  01 06 06 00 00 00 00 00 0D   to 1: GAP 6, 0",
            "rs485    <  02 01 64 06 00 00 00 80 ED   from 1: 128 1/255 (maximum current), status 100 ok",
            "can 4    >  001 06 06 00 00 00 00 00 00  to 1: GAP 6, 0",
            "can      <  002 01 64 06 00 00 00 80 00  from 1: 128 1/255 (maximum current), status 100 ok",
        ]
    );
}

#[test]
fn every_command_that_talks_to_a_module_logs_from_the_hosts_side() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--serial", "{}/usb", "--slcan-tcp", "127.0.0.1:0"]);
    let (tcp, slcan) = (format!("tcp:{}", sim.told("tcp")), format!("slcan:tcp:{}", sim.told("slcan-tcp")));
    let log = sim.path("log");
    let path = log.to_str().unwrap();
    let logged = |arguments: &[&str]| {
        let output = run(&[arguments, &["--log-telegrams", path]].concat());
        assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
        lines(&log)
    };
    let gap = |link: &str| {
        [
            format!("{link:<8} >  01 06 06 00 00 00 00 00 0D   to 1: GAP 6, 0"),
            format!("{link:<8} <  02 01 64 06 00 00 00 80 ED   from 1: 128 1/255 (maximum current), status 100 ok"),
        ]
    };
    // The file of the command before is gone.
    assert_eq!(logged(&["send", &tcp, "--product", "1140", "GAP 6, 0"]), gap("tcp"));
    assert_eq!(logged(&["send", sim.told("serial"), "--product", "1140", "GAP 6, 0"]), gap("serial"));
    assert_eq!(logged(&["send", "sim", "--product", "1140", "GAP 6, 0"]), gap("sim"));
    assert_eq!(
        logged(&["send", &slcan, "--product", "1140", "GAP 6, 0"]),
        [
            "can      >  001 06 06 00 00 00 00 00 00  to 1: GAP 6, 0",
            "can      <  002 01 64 06 00 00 00 80 00  from 1: 128 1/255 (maximum current), status 100 ok"
        ]
    );
    let got = logged(&["params", &tcp, "get", "APMaxCurrent"]);
    assert!(got[0].ends_with("to 1: 136, 1, 0, 0 (what module is this)") && got[2..] == gap("tcp"), "{got:?}");
    let watched = logged(&["monitor", &tcp, "--csv", "--params", "6", "--count", "2", "--interval", "0"]);
    assert!(watched.ends_with(&[gap("tcp"), gap("tcp")].concat()), "{watched:?}");
    let found = logged(&["scan", &tcp]);
    // It asks for an address that nobody has first.
    assert!(found[0].ends_with("to 0: 135, 0, 0, 0 (state of program)"), "{found:?}");
    assert_eq!(found.last().unwrap(), "tcp      <  02 31 31 34 30 56 31 34 32   version 1140V142");
    // Both links are in the file, and told apart.
    let compared = logged(&["params", "diff", &tcp, &tcp]);
    let of = |link: &str| compared.iter().filter(|line| line.starts_with(&format!("{link:<9}"))).count();
    assert!(of("tcp") > 100 && of("tcp 2") > 100 && compared.len() == of("tcp") + of("tcp 2"), "{compared:?}");
}

#[test]
fn the_debugger_logs_and_what_is_on_standard_output_can_be_the_log() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let (log, program) = (sim.path("log"), sim.path("turn.tmc"));
    fs::write(&program, "MVP REL, 0, 100\nSTOP\n").unwrap();
    let link = format!("tcp:{}", sim.told("tcp"));
    let arguments = ["debug", &link, program.to_str().unwrap(), "--log-telegrams", log.to_str().unwrap()];
    let output = type_into(&arguments, "step\n");
    assert!(output.status.success(), "{}", complaint(&output));
    let said = said(&log);
    for line in [
        "> to 1: 132, 0, 0, 0 (begin download)",
        "< from 1: 100 microsteps (target), status 101 loaded into program memory",
        "> to 1: 130, 0, 0, 0 (step program)",
    ] {
        assert!(said.iter().any(|known| known == line), "{line} is not in\n{}", said.join("\n"));
    }
    let output = run(&["send", "sim", "--value", "--log-telegrams", "-", "GGP 66, 0"]);
    let shown = String::from_utf8(output.stdout).unwrap();
    assert!(shown.ends_with("from 1: 1 (serial address), status 100 ok\n1\n"), "{shown}");
}

#[test]
fn a_log_that_cannot_be_written_is_told_before_anything_is_sent() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("none/log");
    let path = path.to_str().unwrap();
    for arguments in [&["send", "sim", "MST 0"][..], &["sim", "--tcp", "127.0.0.1:0"]] {
        let output = run(&[arguments, &["--log-telegrams", path]].concat());
        assert_eq!(output.status.code(), Some(1));
        let told = complaint(&output);
        assert!(told.starts_with(&format!("tmcl: --log-telegrams: cannot write {path}: ")), "{told}");
        assert!(output.stdout.is_empty());
    }
    let full = run(&["send", "sim", "MST 0", "--log-telegrams", "/dev/full"]);
    assert_eq!(full.status.code(), Some(1));
    assert!(
        complaint(&full).starts_with("tmcl: MST 0: --log-telegrams: cannot write /dev/full: "),
        "{}",
        complaint(&full)
    );
}

#[test]
fn what_did_not_come_in_time_is_in_the_log() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--log-telegrams", "{}/log"]);
    let (link, log) = (format!("tcp:{}", sim.told("tcp")), sim.path("host"));
    let send = || {
        run(&["send", &link, "--timeout", "300", "--value", "--log-telegrams", log.to_str().unwrap(), "GGP 66, 0"]);
        said(&log)
    };
    sim.control(&["fault reply-drop 1"]);
    assert_eq!(send(), ["> to 1: GGP 66, 0", "< no reply"]);
    sim.control(&["fault reply-corrupt 1"]);
    assert_eq!(send(), ["> to 1: GGP 66, 0", "< wrong checksum"]);
    assert_eq!(send()[1], "< from 1: 1, status 100 ok");
    let (_, folder) = sim.end(Signal::TERM);
    assert_eq!(
        said(&folder.path().join("log")),
        [
            "> to 1: GGP 66, 0",
            "< lost: from 1: 1 (serial address), status 100 ok",
            "> to 1: GGP 66, 0",
            "< wrong checksum",
            "> to 1: GGP 66, 0",
            "< from 1: 1 (serial address), status 100 ok",
        ]
    );
}

/// The log of what a host says to a paused module, at times of its own.
fn paused(arguments: &[&str], sleeps: &[u64]) -> String {
    let links = ["--paused", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--log-telegrams", "{}/log"];
    let sim = Sim::start(&[&links[..], arguments].concat());
    sim.control(&["pause 10 ms", "fault reply-delay 3 ms"]);
    let mut host = sim.tcp();
    host.ok("MVP ABS, 0, 51200");
    for sleep in sleeps {
        std::thread::sleep(Duration::from_millis(*sleep));
        host.ok("GAP 1, 0");
    }
    sim.control(&["fault reply-drop 1"]);
    host.write(&request("GAP 1, 0"));
    wait_for(&sim.path("log"), "lost: ");
    sim.control(&["at 10 ms usb off --hangup", "step 20 ms"]);
    assert!(host.has_news(PATIENCE) && !host.0.read(&mut [0; 9]).is_ok_and(|count| count > 0));
    sim.control(&["usb on"]);
    assert_eq!(sim.tcp().ok("GAP 6, 0"), 128);
    let (_, folder) = sim.end(Signal::TERM);
    fs::read_to_string(folder.path().join("log")).unwrap()
}

#[test]
fn equal_runs_of_a_paused_module_have_the_same_log_to_the_byte() {
    let image = ["--image", image::image()];
    for arguments in [&[][..], &image] {
        let log = paused(arguments, &[0; 5]);
        assert_eq!(log, paused(arguments, &[7, 0, 23, 2, 31]));
        assert_eq!(log.lines().count(), 2 * 8, "{log}");
    }
}
