//! Virtual time that a host controls over the control port: it stands still, steps, has a speed, and begins anew.

use std::hash::{BuildHasher, Hasher, RandomState};
use std::io::{Read, Write};
use std::os::fd::AsFd;
use std::time::Duration;

use serde_json::{Value, json};

use super::harness::{Controller, Host, Sim, request};

pub(crate) const PAUSED: [&str; 5] = ["--paused", "--control", "127.0.0.1:0", "--serial", "{}/usb"];

/// A host does something else for a while, never as long as before.
pub(crate) fn nap() {
    let random = RandomState::new().build_hasher().finish();
    std::thread::sleep(Duration::from_micros(random % 8_000));
}

/// Asks until the value is there, with naps between, and gives the number of questions.
fn polls<T: Read + Write + AsFd>(host: &mut Host<T>, line: &str, value: i32) -> usize {
    let mut count = 1;
    while host.ok(line) != value {
        assert!(count < 10_000, "{line} is not {value}");
        count += 1;
        nap();
    }
    count
}

#[test]
fn paused_time_passes_by_steps_alone() {
    let sim = Sim::start(&PAUSED);
    let mut port = Controller::new(&sim);
    let start = port.ok("state");
    assert_eq!(start["time"], "paused");
    std::thread::sleep(Duration::from_millis(50));
    let begun = port.time();
    assert_eq!(start["time_us"], begun);
    assert_eq!(port.ok("step 20 ms"), json!({ "ok": true, "time_us": begun + 20_000 }));
    assert_eq!(port.ok("step 500us")["time_us"], begun + 20_500);
    assert_eq!(port.ok("step 0 s")["time_us"], begun + 20_500);
    assert_eq!(port.ok("step 1 min")["time_us"], begun + 60_020_500);
    assert_eq!(port.time(), begun + 60_020_500);
}

#[test]
fn what_the_clock_goes_during_a_pause_is_not_made_up_for() {
    let sim = Sim::start(&["--control", "127.0.0.1:0", "--tcp", "127.0.0.1:0"]);
    let mut port = Controller::new(&sim);
    assert_eq!(port.ok("state")["time"], "running");
    let paused = port.ok("pause")["time_us"].as_u64().unwrap();
    std::thread::sleep(Duration::from_millis(300));
    // Both are carried out in one turn, so that no time passes between them.
    port.tell("resume\npause");
    assert_eq!(port.answer().unwrap()["time_us"], paused);
    let again = port.answer().unwrap()["time_us"].as_u64().unwrap();
    assert!(again - paused < 300_000, "{} us", again - paused);
    port.ok("resume");
    while port.time() < again + 20_000 {}
    assert_eq!(port.ok("state")["time"], "running");
}

#[test]
fn four_runs_end_at_the_same_microsecond_with_the_same_numbers() {
    let run = || {
        let sim = Sim::start(&[&PAUSED[..], &["--tcp", "127.0.0.1:0"]].concat());
        let (mut serial, mut tcp, mut port) = (sim.serial(), sim.tcp(), Controller::new(&sim));
        let mut told: Vec<Value> = Vec::new();
        serial.ok("SAP 4, 0, 1200");
        serial.ok("MVP ABS, 0, 60000");
        nap();
        told.push(port.ok("at 35 ms load 0.4"));
        told.push(port.ok("run-until position > 5000 max 2 s"));
        nap();
        told.push(tcp.ok("GAP 1, 0").into());
        told.push(port.ok("step 12.5 ms"));
        told.push(serial.ok("GAP 3, 0").into());
        port.ok("press left");
        nap();
        told.push(tcp.ok("GAP 11, 0").into());
        port.ok("release left");
        told.push(tcp.ok("STAP 4, 0").into());
        told.push(port.ok("at 3 ms power off"));
        told.push(port.ok("at 9 ms power on"));
        told.push(port.ok("step 1 s"));
        nap();
        told.push(serial.ok("GAP 4, 0").into());
        serial.ok("ROR 0, 700");
        told.push(port.ok("run-until rotor >= 20000 max 1 min"));
        serial.ok("MST 0");
        told.push(port.ok("run-until velocity = 0 max 1 s"));
        nap();
        let mut state = port.ok("state");
        // How fast the computer was.
        state.as_object_mut().unwrap().remove("speed_factor");
        told.push(state);
        told
    };
    let runs: Vec<Vec<Value>> = (0..4).map(|_| run()).collect();
    assert!(runs[0].iter().any(|told| told["met"] == true));
    for other in &runs[1..] {
        assert_eq!(&runs[0], other);
    }
}

/// A host that knows nothing of paused time: it starts a motion and asks and sleeps until it is over.
#[test]
fn the_number_of_its_requests_takes_an_unmodified_host_to_its_goal() {
    let run = |sim: &Sim| {
        let mut host = sim.serial();
        host.ok("MVP ABS, 0, 25600");
        let count = polls(&mut host, "GAP 8, 0", 1);
        (count, host.ok("GAP 1, 0"), Controller::new(sim).time())
    };
    let starts = || {
        let by_command = Sim::start(&PAUSED);
        assert_eq!(Controller::new(&by_command).ok("pause 10 ms")["ok"], true);
        [by_command, Sim::start(&[&["--paused=10ms"], &PAUSED[1..]].concat())]
    };
    let runs: Vec<_> = (0..2).flat_map(|_| starts().map(|sim| run(&sim))).collect();
    let (count, position, time) = runs[0];
    assert!(runs.iter().all(|run| *run == runs[0]), "{runs:?}");
    assert_eq!(position, 25_600);
    // Each reply is followed by 10 ms, and the last ones are those to MVP and GAP 1.
    let passed = 10_000 * (count as u64 + 2);
    assert!((passed..passed + 2_000 * (count as u64 + 2)).contains(&time), "{count} requests, {time} us");
}

#[test]
fn what_is_wrong_is_said_with_what_to_write() {
    let sim = Sim::start(&PAUSED);
    let mut port = Controller::new(&sim);
    let before = port.ok("state");
    for (line, expected) in [
        ("step -1 s", "time '-1 s' is negative; write how much time is to pass, such as '20 ms'"),
        ("step 2 h", "time '2 h' is too long; an hour, '1 h', is the longest"),
        ("run-until rotor > 0", "'max' is missing: write how long to wait at most, as in: run-until rotor > 0 max 5 s"),
        ("run-until roter > 0 max 1 s", "unknown value 'roter'; did you mean 'rotor'?"),
        ("watch 10 ms velocty", "unknown value 'velocty'; did you mean 'velocity'?"),
        ("rezume", "unknown command 'rezume'; did you mean 'resume'?"),
        ("Step 20 MS", "the commands here are written in small letters; did you mean 'step 20 ms'?"),
        ("at 5 ms press left 1", "no axis 1: the TMCM-1140 has one, axis 0"),
        (
            "at 5 ms resume",
            "'resume' cannot be put off; 'at' takes a command for the world, as in: at 2.5 ms power off",
        ),
    ] {
        assert_eq!(port.refused(line), expected, "{line}");
    }
    let after = port.ok("state");
    assert_eq!((&before["time_us"], &before["switches"]), (&after["time_us"], &after["switches"]));
    port.ok("resume");
    assert_eq!(port.refused("step 1 s"), "time goes by the clock, so there is no 'step': write 'pause' before it");
}

/// The power fails during the step, and what waits in the port of a module that has power again at its end is not lost.
#[test]
fn what_is_put_off_happens_at_its_time() {
    let sim = Sim::start(&PAUSED);
    let (mut host, mut port) = (sim.serial(), Controller::new(&sim));
    host.ok("SAP 4, 0, 1234");
    let mut watcher = Controller::new(&sim);
    let begun = watcher.ok("watch 1 ms power switches.left")["time_us"].as_u64().unwrap();
    port.ok("at 5 ms power off");
    port.ok("at 2.5 ms press left");
    port.ok("at 8 ms power on");
    assert_eq!(port.ok("step 10 ms")["time_us"], begun + 10_000);
    let lines: Vec<Value> = (0..10).map(|_| watcher.answer().unwrap()).collect();
    for (number, line) in (1..).zip(&lines) {
        let power = i32::from(!(5..8).contains(&number));
        let left = i32::from(number >= 3);
        assert_eq!(*line, json!({ "time_us": begun + 1_000 * number, "power": power, "switches.left": left }));
    }
    // The module has started anew. A request that comes while it starts may be lost, so time passes before.
    port.ok("step 1 s");
    assert_eq!(host.ok("GAP 4, 0"), 1000);
    // While a request is served, time passes as well.
    let now = port.time();
    port.ok("at 300 us press right");
    host.ok("GAP 4, 0");
    let state = port.ok("state");
    assert!(state["time_us"].as_u64().unwrap() >= now + 300 && state["switches"]["right"] == true);
}

#[test]
fn a_restart_is_a_new_simulator() {
    let sim = Sim::start(&[&PAUSED[..], &["--tcp", "127.0.0.1:0", "--eeprom", "{}/eeprom", "--modules", "2"]].concat());
    let (mut serial, mut tcp, mut port) = (sim.serial(), sim.tcp(), Controller::new(&sim));
    let fresh = port.ok("state");
    let mut watcher = Controller::new(&sim);
    watcher.ok("watch 10 ms rotor");
    serial.ok("SAP 4, 0, 1500");
    serial.ok("STAP 4, 0");
    serial.ok("SAP 4, 0, 1600");
    serial.ok("ROR 0, 500");
    for line in ["load 0.5", "slip 4", "press home", "fault spi on", "fault spi off", "module 2 power off", "step 1 s"]
    {
        port.ok(line);
    }
    port.ok("at 1 s power off");
    // A request that is pending when it comes is never answered.
    tcp.write(&request("GAP 4, 0")[..5]);
    let restarted = port.ok("restart");
    let state = port.ok("state");
    assert_eq!((&state["time_us"], &state["time"]), (&restarted["time_us"], &"paused".into()));
    assert_eq!(state["axes"], fresh["axes"]);
    assert_eq!(port.ok("module 2 state")["power"], true);
    port.ok("step 2 s");
    assert_eq!(port.ok("state")["power"], true, "what was put off is forgotten");
    assert_eq!((serial.ok("GAP 4, 0"), tcp.ok("GAP 4, 0")), (1500, 1500));
    // The file goes on to keep what is stored.
    serial.ok("SAP 4, 0, 1700");
    serial.ok("STAP 4, 0");
    let lines: Vec<Value> =
        std::iter::from_fn(|| watcher.answer().filter(|line| line.get("ended").is_none())).collect();
    assert!(lines.len() >= 100, "{} lines", lines.len());
    watcher.ok("state");
    assert_eq!(port.ok("restart")["time_us"], restarted["time_us"]);
    assert_eq!(serial.ok("GAP 4, 0"), 1700);
    let (_, folder) = sim.end(rustix::process::Signal::TERM);
    let sim = Sim::start_in(folder, &["--eeprom", "{}/eeprom", "--tcp", "127.0.0.1:0"]);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1700);
}

#[test]
fn after_a_restart_the_cable_is_in_again() {
    let sim = Sim::start(&PAUSED);
    let mut port = Controller::new(&sim);
    for pulled in ["usb off", "usb off --hangup"] {
        port.ok("fault reply-drop 9");
        port.ok(pulled);
        port.ok("restart");
        assert_eq!(sim.serial().ok("GAP 4, 0"), 1000, "{pulled}");
    }
}

#[test]
fn a_restart_goes_on_by_the_clock_if_time_did() {
    let sim = Sim::start(&["--control", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--speed", "100"]);
    let (mut host, mut port) = (sim.tcp(), Controller::new(&sim));
    host.ok("ROR 0, 500");
    while port.time() < 1_000_000 {}
    let restarted = port.ok("restart")["time_us"].as_u64().unwrap();
    assert!(restarted < 1_000_000, "{restarted}");
    host.until("GAP 3, 0", 0);
    let state = port.ok("state");
    assert_eq!(
        (&state["time"], &state["speed_wanted"], &state["rotor"]),
        (&"running".into(), &100.0.into(), &0.into())
    );
    while port.time() < restarted + 100_000 {}
}

#[test]
fn time_goes_as_fast_as_it_is_told() {
    let sim = Sim::start(&["--control", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--speed", "max"]);
    let mut port = Controller::new(&sim);
    let state = port.ok("state");
    assert_eq!((&state["speed_wanted"], &state["time"]), (&Value::Null, &"running".into()));
    // More than could pass by the clock while this test runs.
    while port.time() < 100_000_000 {}
    port.ok("speed 0.001");
    assert_eq!(port.ok("state")["speed_wanted"], 0.001);
    let slow = port.time();
    std::thread::sleep(Duration::from_millis(100));
    assert!(port.time() < slow + 1_000_000, "it still goes fast");
    port.ok("speed max");
    while port.time() < slow + 10_000_000 {}
    assert!(port.refused("speed 2000").contains("from 0.001 to 1000"));
}
