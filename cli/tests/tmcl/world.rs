//! `tmcl world` and docs/control.md: the control port for hands and scripts.

use std::collections::BTreeSet;
use std::fs;
use std::io::{Read, Write};
use std::net::TcpListener;

use hal_sim::control::USAGE;
use hal_sim::fault::Fault;
use serde_json::Value;
use tmcm_sim::protocol;

use super::harness::{Sim, complaint, run};

const LINKS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];

/// Runs `tmcl world` and gives its exit code, and what it says on standard output and standard error.
fn world(arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = run(&[&["world"], arguments].concat());
    (output.status.code(), String::from_utf8_lossy(&output.stdout).into_owned(), complaint(&output))
}

/// With --text a state has what all axes have in common, and then a column for each axis, by the names of --value.
#[test]
fn a_state_can_be_read_by_people() {
    let sim = Sim::start(&[&LINKS[..], &["--product", "3110"]].concat());
    let port = sim.told("control");
    let (code, said, complaint) = world(&[port, "--text", "press left 2", "state"]);
    assert_eq!((code, complaint.as_str()), (Some(0), ""), "{said}");
    let rows: Vec<Vec<&str>> = said.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[0], ["done"]);
    for row in [
        &["supply", "24.0"][..],
        &["can", "on"],
        &["pull_up_groups", "on"],
        &["axis", "0", "1", "2"],
        &["switches.left", "off", "off", "on"],
        &["velocity", "0", "0", "0"],
    ] {
        assert!(rows.iter().any(|found| found == row), "{row:?} is not among\n{said}");
    }
    let names: BTreeSet<&str> = rows[1..].iter().map(|row| row[0]).collect();
    assert_eq!(names.len(), rows.len() - 1, "each name once:\n{said}");
    for name in names.into_iter().filter(|name| *name != "axis") {
        assert_eq!(world(&[port, "state", "--value", name]).0, Some(0), "{name}");
    }
    let (code, said, complaint) = world(&[port, "press up", "--text"]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    assert_eq!(complaint, "tmcl: press up: unknown switch 'up'; there are: left, right, home\n");
}

#[test]
fn answers_are_printed_and_refusals_end_with_1() {
    let sim = Sim::start(&LINKS);
    let port = sim.told("control");
    assert_eq!(
        world(&[port, "press left", "supply 12.5"]),
        (Some(0), "{\"ok\":true}\n{\"ok\":true}\n".into(), "".into())
    );
    let (code, said, _) = world(&[port]);
    let state: Value = serde_json::from_str(&said).unwrap();
    assert_eq!((code, &state["switches"]["left"], &state["supply"]), (Some(0), &true.into(), &12.5.into()));
    // What follows a refusal is carried out all the same.
    let (code, said, complaint) = world(&[port, "press up", "supply 24"]);
    assert_eq!((code, complaint.as_str()), (Some(1), ""));
    assert_eq!(said, "{\"ok\":false,\"error\":\"unknown switch 'up'; there are: left, right, home\"}\n{\"ok\":true}\n");
    assert_eq!(sim.control(&["state"])["supply"], 24.0);
}

#[test]
fn a_value_is_printed_alone() {
    let sim = Sim::start(&LINKS);
    let port = &format!("tcp:{}", sim.told("control"));
    let commands = ["press home", "state", "analog 0 77", "state", "--value", "analog"];
    assert_eq!(world(&[&[port.as_str()], &commands[..]].concat()), (Some(0), "0\n77\n".into(), "".into()));
    assert_eq!(world(&[port, "--value", "can"]).1, "on\n");
    let (code, said, complaint) = world(&[port, "load 3", "state", "--value", "switches.home"]);
    assert_eq!((code, said.as_str()), (Some(1), "true\n"));
    assert_eq!(complaint, "tmcl: load 3: load '3' is not a number within 0 to 1\n");
    let (code, said, complaint) = world(&[port, "--value", "positon"]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    assert_eq!(complaint, "tmcl: --value positon: there is no field 'positon'; did you mean 'position'?\n");
}

#[test]
fn a_port_that_is_none_is_said_with_what_to_do() {
    // Nobody listens at a port that was free a moment ago.
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().to_string();
    let (code, said, why) = world(&[&nobody]);
    assert_eq!((code, said.as_str()), (Some(1), ""));
    assert!(why.contains(&format!("cannot connect to {nobody}")) && why.contains("tmcl sim --control"), "{why}");

    // The port of --tcp answers with telegrams, if it does at all.
    let sim = Sim::start(&LINKS);
    let (code, _, why) = world(&[sim.told("tcp"), "--timeout", "300"]);
    assert_eq!(code, Some(1));
    assert!(why.contains("tmcl sim --control"), "{why}");

    for (answer, expected) in
        [("SSH-2.0\r\n", "is not a control port"), ("", "closed the connection"), ("[1]\n", "not a control")]
    {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap().to_string();
        let other = std::thread::spawn(move || {
            let (mut stream, _) = listener.accept().unwrap();
            let mut line = [0; 6];
            stream.read_exact(&mut line).unwrap();
            assert_eq!(&line, b"state\n");
            stream.write_all(answer.as_bytes()).unwrap();
        });
        let (code, _, why) = world(&[&address]);
        assert!(code == Some(1) && why.contains(expected), "{answer:?}: {why}");
        other.join().unwrap();
    }

    for arguments in [&["4141"][..], &["127.0.0.1:0"], &["127.0.0.1:4141", "press\nleft"], &[]] {
        assert_eq!(world(arguments).0, Some(2), "{arguments:?}");
    }
}

fn page() -> String {
    fs::read_to_string(xtask::workspace().unwrap().join("docs/control.md")).unwrap()
}

/// The first column of the page's table with this head, without quotes, and whether a star stands behind it.
fn column(head: &str) -> Vec<(String, bool)> {
    let page = page();
    let rows = page.lines().skip_while(|line| !line.starts_with(&format!("| {head} |"))).skip(2);
    let cells = rows.map_while(|row| {
        let row = row.replace("\\|", "/");
        let (cell, star) = row.strip_prefix("| `")?.split_once('`')?;
        Some((cell.replace('/', "|"), star.starts_with(" *")))
    });
    cells.collect()
}

#[test]
fn the_page_has_all_commands_and_faults_and_no_others() {
    let names = |head| column(head).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    assert_eq!(names("command"), USAGE.map(|(_, usage)| usage));
    assert_eq!(names("command for time and firmware"), protocol::USAGE.map(|(_, usage, _)| usage));
    assert_eq!(names("fault"), Fault::ALL.map(Fault::name));
    // Those of an axis are told from those of the board.
    for fault in Fault::ALL {
        let row = format!("| `{}` | {} ", fault.name(), if fault.is_of_an_axis() { "an axis" } else { "the board" });
        assert!(page().lines().any(|line| line.starts_with(&row)), "{row}");
    }
    let help = String::from_utf8(run(&["sim", "--help"]).stdout).unwrap();
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let faults = Fault::ALL.map(Fault::name).join(", ");
    assert!(help.contains(&format!("NAME of a fault: {faults}")), "{help}");
    let for_time = protocol::USAGE.map(|(_, usage, _)| format!("`{usage}`")).join(", ");
    assert!(help.contains(&format!("For time and firmware: {for_time}.")), "{help}");
}

/// The names of the fields of a state; those inside of others have the names of these before them.
fn fields(prefix: &str, value: &Value, found: &mut BTreeSet<String>) {
    for (name, value) in value.as_object().into_iter().flatten() {
        let name = format!("{prefix}{name}");
        fields(&format!("{name}."), value, found);
        found.insert(name);
    }
}

#[test]
fn the_page_has_all_fields_of_a_state_and_no_others() {
    let (mut told, mut of_axes) = (BTreeSet::new(), BTreeSet::new());
    for product in ["1140", "1110", "3110", "3212", "6110"] {
        let state = Sim::start(&[&LINKS[..], &["--product", product]].concat()).control(&["state"]);
        fields("", &state, &mut told);
        state["axes"].as_array().unwrap().iter().for_each(|axis| fields("", axis, &mut of_axes));
    }
    assert!(told.remove("ok"));
    let shown = column("field");
    let names = |wanted: fn(&(String, bool)) -> bool| {
        shown.iter().filter(|row| wanted(row)).map(|(name, _)| name.clone()).collect::<BTreeSet<_>>()
    };
    assert_eq!(names(|_| true), told);
    assert_eq!(names(|(_, star)| *star), of_axes);
}
