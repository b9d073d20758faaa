//! Long steps of virtual time: who is served meanwhile, what has to wait for their end, and who interrupts them.

use std::time::Duration;

use serde_json::{Value, json};

use super::harness::{Controller, Sim, request};
use super::time::PAUSED;

/// The microseconds of an hour.
const HOUR: u64 = 3_600_000_000;

/// Modules in paused time whose programs never wait. An hour, the longest step, takes one of them some eight seconds,
/// and all of them a minute or more: nobody is done with it while a test goes on.
pub(crate) fn tireless() -> Sim {
    let sim = Sim::start(&[&PAUSED[..], &["--modules", "8"]].concat());
    let mut port = Controller::new(&sim);
    for module in 1..=8 {
        for line in ["132, 0, 0, 0", "JA 0", "133, 0, 0, 0", "129, 1, 0, 0"] {
            port.ok(&format!("module {module} send {line}"));
        }
    }
    sim
}

/// Has a step of an hour begin.
pub(crate) fn begin_an_hour(sim: &Sim) -> Controller {
    let [mut stepper, mut port] = [Controller::new(sim), Controller::new(sim)];
    let begun = port.time();
    stepper.tell("step 1 h");
    while port.time() == begun {}
    stepper
}

#[test]
fn others_are_served_during_a_step_but_time_is_in_use() {
    let sim = tireless();
    let mut host = sim.serial();
    let stepper = begin_an_hour(&sim);
    let mut port = Controller::new(&sim);
    for line in ["step 1 s", "run-until rotor > 0 max 1 s", "restart", "pause", "pause 10 ms", "resume"] {
        assert_eq!(port.refused(line), "busy: a 'step' is under way; write this again when that is answered", "{line}");
    }
    port.ok("press left");
    assert_eq!(port.ok("state")["switches"]["left"], true);
    port.ok("at 1 ms release left");
    while port.ok("state")["switches"]["left"] == true {}
    // What arrives on a link is taken when the step has ended.
    host.write(&request("GAP 4, 0"));
    let asked = port.time();
    while port.time() < asked + 100_000 {}
    assert!(!host.has_news(Duration::ZERO));
    drop(stepper);
}

#[test]
fn requests_that_come_during_a_step_are_answered_after_it() {
    let sim = Sim::start(&PAUSED);
    let (mut host, mut port, mut other) = (sim.serial(), Controller::new(&sim), Controller::new(&sim));
    let begun = port.time();
    // The lines of a connection wait for each other.
    port.tell("step 20 s\npress left\nstep 1 ms\nstate");
    while other.time() == begun {}
    host.write(&request("GAP 4, 0"));
    let answers: Vec<Value> = (0..4).map(|_| port.answer().unwrap()).collect();
    assert_eq!(answers[0]["time_us"], begun + 20_000_000);
    assert_eq!((&answers[3]["switches"]["left"], &answers[1]), (&true.into(), &json!({ "ok": true })));
    assert_eq!(host.read()[2], 100, "the status of the reply");
}

#[test]
fn a_step_can_be_interrupted() {
    let sim = tireless();
    let (mut port, mut other) = (Controller::new(&sim), Controller::new(&sim));
    other.ok("interrupt");
    for line in ["step 1 h", "run-until rotor = 1 max 1 h"] {
        let begun = other.time();
        port.tell(line);
        while other.time() == begun {}
        other.ok("interrupt");
        let ended = port.answer().unwrap()["time_us"].as_u64().unwrap();
        assert!(ended < begun + HOUR, "{line}");
        assert!(other.ok("step 1 ms")["time_us"].as_u64().unwrap() == ended + 1_000);
    }
}

/// The lines come at once, as those of a client that does not wait for the answer to `interrupt`.
#[test]
fn what_follows_an_interrupt_comes_after_the_step() {
    let sim = tireless();
    let (mut port, mut other) = (Controller::new(&sim), Controller::new(&sim));
    port.ok("send ROR 0, 1000");
    for line in ["step 1 ms", "run-until rotor > 0 max 1 s", "pause 10 ms", "send GAP 1, 0", "restart"] {
        let begun = other.time();
        port.tell("step 1 h");
        while other.time() == begun {}
        other.tell(&format!("interrupt\n{line}"));
        let ended = other.answer().unwrap()["time_us"].as_u64().unwrap();
        assert!(ended < begun + HOUR, "{ended}");
        let next = other.answer().unwrap();
        assert_eq!(next["ok"], true, "{line}: {next}");
        assert_eq!(port.answer().unwrap()["time_us"], ended, "{line}");
    }
}
