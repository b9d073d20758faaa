//! Values that a host watches in virtual time, and those that it has time run until: `watch` and `run-until`.

use serde_json::json;

use super::harness::{Controller, Sim};
use super::time::{PAUSED, nap};

#[test]
fn a_condition_is_looked_at_each_millisecond_and_not_for_longer_than_it_may_take() {
    let sim = Sim::start(&PAUSED);
    let (mut host, mut port) = (sim.serial(), Controller::new(&sim));
    let begun = port.time();
    assert_eq!(
        port.ok("run-until rotor = 0 max 1 s"),
        json!({ "ok": true, "met": true, "time_us": begun }),
        "it holds already"
    );
    assert_eq!(
        port.ok("run-until rotor > 0 max 7.5 ms"),
        json!({ "ok": true, "met": false, "time_us": begun + 7_500 })
    );
    host.ok("ROR 0, 500");
    let begun = port.time();
    let met = port.ok("run-until rotor >= 5000 max 10 s");
    let state = port.ok("state");
    assert_eq!((&met["met"], &met["time_us"]), (&true.into(), &state["time_us"]));
    assert!(state["rotor"].as_i64().unwrap() >= 5_000);
    assert_eq!((state["time_us"].as_u64().unwrap() - begun) % 1_000, 0);
    assert_eq!(port.ok("run-until position between 10000 and 1000000 max 10 s")["met"], true);
    assert_eq!(port.ok("at 20 ms press home")["time_us"].as_u64(), Some(port.time() + 20_000));
    let pressed = port.ok("run-until switches.home = 1 max 1 s")["time_us"].as_u64().unwrap();
    assert!(port.ok("state")["switches"]["home"] == true && pressed == port.time());
}

#[test]
fn parameters_that_cost_no_datagram_are_values_too() {
    let sim = Sim::start(&PAUSED);
    let (mut host, mut port) = (sim.serial(), Controller::new(&sim));
    let mut watcher = Controller::new(&sim);
    let begun = watcher.ok("watch 1 s GGP 5, 2 rotor GAP 4, 0")["time_us"].as_u64().unwrap();
    host.ok("SGP 132, 0, 0");
    // The clock of the module counts milliseconds.
    let met = port.ok("run-until GGP 132, 0 >= 700 max 10 s");
    assert_eq!(met["met"], true);
    host.ok("SGP 5, 2, 77");
    host.ok("SAP 4, 0, 1234");
    let passed = met["time_us"].as_u64().unwrap() - begun;
    assert!((700_000..710_000).contains(&passed), "{passed} us");
    port.ok("step 1 s");
    let line = watcher.answer().unwrap();
    assert_eq!(line, json!({ "time_us": begun + 1_000_000, "GGP 5, 2": 77, "rotor": 0, "GAP 4, 0": 1234 }));
    for line in ["run-until GAP 1, 0 = 0 max 1 s", "watch 1 s GAP 1, 0"] {
        let why = port.refused(line);
        assert!(why.contains("would cost the module a datagram to a chip: use 'position' of the world"), "{why}");
    }
    assert!(port.refused("watch 1 s MVP ABS, 0, 5").contains("only GAP, GGP, GIO"));
    assert!(port.refused("watch 1 s GAP 4, 1").contains("does not read this"));
}

#[test]
fn a_watch_tells_at_exact_multiples_of_its_interval() {
    let sim = Sim::start(&["--control", "127.0.0.1:0", "--tcp", "127.0.0.1:0", "--speed", "20", "--modules", "2"]);
    let (mut host, mut port) = (sim.tcp(), Controller::new(&sim));
    host.ok("ROR 0, 500");
    let begun = port.ok("watch 7.5 ms rotor velocity")["time_us"].as_u64().unwrap();
    let mut rotor = i64::MIN;
    for number in 1..=40 {
        let line = port.answer().unwrap();
        assert_eq!(line["time_us"], begun + 7_500 * number);
        let now = line["rotor"].as_i64().unwrap();
        assert!(now > rotor, "{line}");
        rotor = now;
    }
    // Another watch takes its place, and lines of the first that are on their way come before the answer.
    port.tell("module 2 watch 1 s rotor supply");
    let answered = std::iter::from_fn(|| port.answer()).find(|line| line.get("ok").is_some()).unwrap();
    let line = port.answer().unwrap();
    let due = answered["time_us"].as_u64().unwrap() + 1_000_000;
    assert_eq!(line, json!({ "time_us": due, "rotor": 0, "supply": 24 }));
    port.tell("unwatch");
    while port.answer().unwrap().get("ok").is_none() {}
    port.ok("state");
}

#[test]
fn who_does_not_read_what_it_watches_holds_up_nobody_and_is_told_what_is_missing() {
    const LINES: u64 = 200_000;
    let sim = Sim::start(&PAUSED);
    let (mut watcher, mut port) = (Controller::new(&sim), Controller::new(&sim));
    let all =
        "rotor field lost_steps position velocity current stall_guard load encoder abn inputs.0 inputs.1 analog supply";
    let begun = watcher.ok(&format!("watch 100 us {all}"))["time_us"].as_u64().unwrap();
    port.ok("step 20 s");
    // Its lines are still taken, and answered in their turn.
    watcher.tell("unwatch");
    let (mut told, mut missed, mut last) = (0, 0, begun);
    loop {
        let line = watcher.answer().unwrap();
        if line.get("ok").is_some() {
            break;
        }
        let gap = line.get("missed").map_or(0, |missed| missed.as_u64().unwrap());
        let time = line["time_us"].as_u64().unwrap();
        assert_eq!(time, last + 100 * (gap + 1));
        (told, missed, last) = (told + 1, missed + gap, time);
    }
    assert!(
        told > 0 && told + missed < LINES,
        "it has read nothing, so lines are missing at the end: {told} + {missed}"
    );
    watcher.ok(&format!("watch 100 us {all}"));
    port.ok("step 10 ms");
    let first = watcher.answer().unwrap();
    assert_eq!((first["time_us"].as_u64(), first.get("missed")), (Some(begun + 20_000_100), None));
}

#[test]
fn a_step_loses_no_line_of_a_watch_that_is_read_and_waits_for_no_other() {
    let sim = Sim::start(&PAUSED);
    let (mut port, mut reader, mut idle) = (Controller::new(&sim), Controller::new(&sim), Controller::new(&sim));
    idle.ok("watch 100 us rotor velocity position");
    let begun = reader.ok("watch 100 us rotor velocity position")["time_us"].as_u64().unwrap();
    let reads = std::thread::spawn(move || {
        for line in 1..=200_000 {
            let told = reader.answer().unwrap();
            assert_eq!((&told["time_us"], told["missed"].is_null()), (&json!(begun + 100 * line), true));
            if line % 50_000 == 0 {
                nap();
            }
        }
    });
    port.ok("step 20 s");
    reads.join().unwrap();
    // The one that has read nothing meanwhile is told how much it has missed.
    let mut lines = 1;
    while idle.answer().unwrap()["missed"].is_null() {
        lines += 1;
        assert!(lines < 200_000);
        if lines % 1000 == 0 {
            port.ok("step 100 us");
        }
    }
}
