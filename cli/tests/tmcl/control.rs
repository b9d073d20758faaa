//! The control port of `tmcl sim`, and time.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::{Duration, Instant};

use tmcm::tmcl::binary;

use super::harness::{PATIENCE, Sim, request, run};

const LINKS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];

#[test]
fn the_world_is_changed_and_seen() {
    let sim = Sim::start(&LINKS);
    let mut host = sim.tcp();
    assert_eq!(sim.control(&["press left", "supply 12.5", "analog 0 777"])["ok"], true);
    host.until("GIO 1, 0", 1);
    host.until("GIO 8, 1", 125);
    host.until("GIO 0, 1", 777);
    sim.control(&["release left"]);
    host.until("GIO 1, 0", 0);
    host.ok("SIO 1, 2, 1");
    host.ok("MVP ABS, 0, -3000");
    host.until("GAP 8, 0", 1);
    let state = sim.control(&["module 1 state"]);
    assert_eq!((&state["ok"], &state["power"], &state["position"]), (&true.into(), &true.into(), &(-3000).into()));
    assert_eq!(state["outputs"][1], true);
    // Axis 0 stands among the fields of the module and in the list of the axes.
    assert_eq!((state["axes"].as_array().unwrap().len(), &state["axes"][0]["position"]), (1, &(-3000).into()));
    assert_eq!(sim.control(&["press home 0"])["ok"], true);
    host.until("GIO 3, 0", 1);
    assert!(state["time_us"].as_u64().unwrap() > 0);
    // The name is told by `tmcl sim --help`.
    assert!(state["speed_factor"].is_f64());
    assert!(String::from_utf8_lossy(&run(&["sim", "--help"]).stdout).contains("speed_factor"));
}

#[test]
fn what_is_wrong_is_said() {
    let sim = Sim::start(&LINKS);
    let error = |line: &str| {
        let answer = sim.control(&[line]);
        assert_eq!(answer["ok"], false, "{line}");
        answer["error"].as_str().unwrap().to_owned()
    };
    assert!(error("jump").contains("press, release"));
    assert!(error("").contains("empty line"));
    assert!(error("load 2").contains("0 to 1"));
    assert!(error("module 2 press left").contains("there is 1 module"));
    for line in ["press left 1", "release home 1", "load 0.5 1", "slip 4 1", "fault tmc429 on 1"] {
        assert_eq!(error(line), "no axis 1: the TMCM-1140 has one, axis 0", "{line}");
    }
    assert_eq!(error("input 4 1"), "no input 4: the TMCM-1140 has inputs 0 to 3");
}

#[test]
fn lines_may_come_together_and_the_last_without_an_end() {
    let sim = Sim::start(&LINKS);
    let mut stream = TcpStream::connect(sim.told("control")).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream.write_all(b"press home\r\nrelease home\nstate").unwrap();
    stream.shutdown(Shutdown::Write).unwrap();
    let mut answers = String::new();
    stream.read_to_string(&mut answers).unwrap();
    let answers: Vec<&str> = answers.lines().collect();
    assert_eq!(answers[..2], [r#"{"ok":true}"#; 2]);
    assert!(answers[2].starts_with(r#"{"ok":true,"time_us":"#), "{answers:?}");
}

#[test]
fn a_line_too_long_is_refused_as_a_whole() {
    let sim = Sim::start(&LINKS);
    for rest in [" ", "x"] {
        let answer = sim.control(&["state", &("press left".to_owned() + &rest.repeat(5000))]);
        assert_eq!((&answer["ok"], &answer["error"]), (&false.into(), &"a line has 4096 characters at most".into()));
    }
    assert_eq!(sim.control(&["state"])["switches"]["left"], false);
    assert_eq!(sim.control(&[&("press left".to_owned() + &" ".repeat(4000))])["ok"], true);
}

#[test]
fn without_power_the_module_is_silent_and_with_it_starts_anew() {
    let sim = Sim::start(&LINKS);
    let mut host = sim.tcp();
    host.ok("SAP 4, 0, 1500");
    host.ok("STAP 4, 0");
    host.ok("SAP 4, 0, 1600");
    host.ok("SAP 6, 0, 64");
    assert_eq!(sim.control(&["power off", "state"])["power"], false);
    host.write(&request("GAP 4, 0"));
    assert!(!host.has_news(Duration::from_millis(200)));
    sim.control(&["power on"]);
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GAP 6, 0")), (1500, 128));
}

#[test]
fn with_the_usb_cable_out_nothing_arrives_and_nothing_is_left_of_what_was_begun() {
    let sim = Sim::start(&[&LINKS[..], &["--rs485", "{}/rs485"]].concat());
    let mut host = sim.tcp();
    host.ok("SAP 4, 0, 1500");
    host.write(&request("SAP 4, 0, 1600")[..5]);
    sim.control(&["usb off"]);
    host.write(&request("SAP 4, 0, 1700"));
    assert!(!host.has_news(Duration::from_millis(200)));
    let output = run(&["send", sim.told("rs485"), "--timeout", "60000", "GAP 4, 0"]);
    assert!(String::from_utf8_lossy(&output.stdout).starts_with("GAP 4, 0: 1500 "), "the other links do not notice");
    sim.control(&["usb on"]);
    assert_eq!(host.ok("GAP 4, 0"), 1500);
    assert_eq!(sim.control(&["usb"])["error"], "usage: usb off [--hangup]|on");
}

#[test]
fn a_software_reset_starts_it_anew() {
    let sim = Sim::start(&LINKS);
    let mut host = sim.tcp();
    host.ok("SAP 6, 0, 64");
    host.ok("255, 0, 0, 1234");
    // What it is asked before it has started anew is lost.
    let mut reply = None;
    for _ in 0..100 {
        host.write(&request("GAP 6, 0"));
        if host.has_news(Duration::from_millis(100)) {
            reply = Some(binary::decode_reply(&host.read()).unwrap().value);
            break;
        }
    }
    assert_eq!(reply, Some(128));
}

#[test]
fn time_passes_as_fast_as_it_is_told() {
    let sim = Sim::start(&[&LINKS[..], &["--speed", "20"]].concat());
    let mut host = sim.tcp();
    host.ok("SGP 132, 0, 0");
    let begun = Instant::now();
    while host.ok("GGP 132, 0") < 20_000 {
        assert!(begun.elapsed() < PATIENCE);
    }
    assert_eq!(sim.control(&["state"])["speed_wanted"], 20.0);
}

#[test]
fn a_world_file_sets_the_scene() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("stage.toml"),
        "[stage]\nright = 90000\n[supply]\nvolts = 18.0\n[[axis]]\nstage.right = 5000\n",
    )
    .unwrap();
    let sim = Sim::start_in(folder, &[&LINKS[..], &["--world", "{}/stage.toml"]].concat());
    let mut host = sim.tcp();
    host.until("GIO 8, 1", 180);
    host.ok("SAP 12, 0, 0");
    host.ok("ROR 0, 500");
    host.until("GAP 10, 0", 1);
    host.until("GAP 3, 0", 0);
}
