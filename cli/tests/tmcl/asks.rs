//! Commands to the firmware that come to the control port: `send`.

use serde_json::{Value, json};

use super::harness::{Controller, Sim};
use super::time_steps::{begin_an_hour, tireless};
use common::image as build;

const PAUSED: [&str; 3] = ["--paused", "--control", "127.0.0.1:0"];

#[test]
fn a_command_is_answered_with_its_reply_and_costs_a_request_on_usb() {
    let sim = Sim::start(&PAUSED);
    let mut port = Controller::new(&sim);
    let begun = port.time();
    let moved = json!({ "ok": true, "command": "MVP ABS, 0, 51200", "status": 100, "meaning": "ok", "value": 51200,
                        "unit": "microsteps", "name": "target" });
    assert_eq!(port.ok("send MVP ABS, 0, 51200"), moved);
    assert_eq!(port.time(), begun + 1_000);
    // A name is looked up; a number is answered with a number; a string is a text.
    let named = port.ok("send GAP APMaxCurrent, Motor0");
    assert_eq!((&named["value"], &named["name"]), (&json!(128), &json!("maximum current")));
    let plain = json!({ "ok": true, "command": "GAP 6, 0", "status": 100, "meaning": "ok", "value": 128 });
    assert_eq!(port.ok("send 6, 6"), plain);
    assert_eq!(port.ok("module 1 send 136, 0")["text"], "1140V142");
    // A command that the module refuses has been sent all the same.
    let refused = port.ok("send SAP 6, 0, 300");
    assert_eq!((&refused["status"], &refused["value"]), (&json!(4), &Value::Null));
    assert_eq!(port.time(), begun + 5_000);
    // What is no command costs nothing.
    assert!(port.refused("send").starts_with("usage: send COMMAND"));
    assert!(port.refused("send GAP 300, 0").contains("300 is out of range"));
    assert!(port.refused("send GAP APMaxCurent, 0").contains("did you mean 'APMaxCurrent'?"));
    assert!(port.refused("module 2 send GAP 1, 0").contains("there is 1 module"));
    assert!(port.refused("at 1 ms send GAP 1, 0").contains("cannot be put off"));
    assert!(port.refused("GAP 1, 0").contains("write: send GAP 1, 0"));
    assert_eq!(port.time(), begun + 5_000);
    // Time that is to pass after each reply passes after this one.
    port.ok("pause 10 ms");
    port.ok("send GAP 1, 0");
    assert_eq!(port.time(), begun + 16_000);
}

#[test]
fn every_module_can_be_asked_and_other_hosts_are_not_disturbed() {
    let sim = Sim::start(&[&PAUSED[..], &["--modules", "3", "--tcp", "127.0.0.1:0"]].concat());
    let (mut port, mut host) = (Controller::new(&sim), sim.tcp());
    for number in 1..=3 {
        assert_eq!(port.ok(&format!("module {number} send GGP 66, 0"))["value"], number);
        port.ok(&format!("module {number} send SGP {number}, 2, {}", 10 * number));
    }
    host.ok("SAP 6, 0, 77");
    assert_eq!(port.ok("send GAP 6, 0")["value"], 77);
    assert_eq!(port.ok("module 2 send GAP 6, 0")["value"], 128);
    assert_eq!((host.ok("GGP 1, 2"), &port.ok("module 3 send GGP 3, 2")["value"]), (10, &json!(30)));
    // The event of command 138 is for nobody, and in nobody's way.
    port.ok("send 138, 0, 0, 1");
    port.ok("send MVP REL, 0, 100");
    port.ok("step 1 s");
    assert_eq!((host.ok("GAP 1, 0"), &port.ok("send GAP 1, 0")["value"]), (100, &json!(100)));
}

#[test]
fn that_no_reply_comes_is_told_at_once() {
    let sim = Sim::start(&PAUSED);
    let mut port = Controller::new(&sim);
    let mut silent = |before: &str, line: &str, after: &str| {
        port.ok(before);
        let begun = port.time();
        let answer = port.ok(line);
        assert!(answer["status"].is_null(), "{answer}");
        assert!(port.time() - begun <= 1_000, "{before}");
        port.ok(after);
        port.ok("step 100 ms");
        answer["error"].as_str().unwrap_or_default().to_owned()
    };
    for (before, after) in [("power off", "power on"), ("usb off", "usb on"), ("fault reply-drop 1", "state")] {
        assert!(silent(before, "send GAP 1, 0", after).starts_with("no reply; is the module's power on"), "{before}");
    }
    assert!(silent("fault reply-corrupt 1", "send GAP 1, 0", "state").starts_with("reply with a wrong checksum"));
    assert_eq!(silent("state", "send 137, 0, 0, 1234", "state"), "", "as it should be");
    assert_eq!(port.ok("send GAP 1, 0")["status"], 100);
    // A reply that is late is waited for, for a second at most.
    port.ok("fault reply-delay 300 ms");
    let begun = port.time();
    assert_eq!((&port.ok("send GAP 1, 0")["status"], port.time()), (&json!(100), begun + 301_000));
    port.ok("fault reply-delay 2 s");
    assert!(port.ok("send GAP 1, 0")["error"].is_string());
    assert_eq!(port.time(), begun + 1_301_000);
}

/// Number of the questions until one is answered, and the virtual time in milliseconds that they have taken.
fn questions(port: &mut Controller, line: &str) -> (usize, u64) {
    let begun = port.time();
    let count = 1 + (0..10).take_while(|_| port.ok(line)["status"].is_null()).count();
    (count, (port.time() - begun) / 1000)
}

#[test]
fn who_asks_until_the_module_is_back_gets_on() {
    let sim = Sim::start(&[&PAUSED[..], &["--modules", "2", "--tcp", "127.0.0.1:0"]].concat());
    let mut port = Controller::new(&sim);
    // After command 255 the firmware starts anew 100 ms later, which takes 53 ms.
    assert_eq!(port.ok("send 255, 0, 0, 1234")["status"], 100);
    assert!(matches!(questions(&mut port, "send GAP 1, 0"), (2, 150..160)));
    port.ok("send 137, 0, 0, 1234");
    assert!(matches!(questions(&mut port, "send GAP 1, 0"), (2, _)));
    for (off, on) in [("power off", "power on"), ("usb off", "usb on")] {
        port.ok(off);
        port.ok(&format!("at 20 ms {on}"));
        assert!(matches!(questions(&mut port, "send GAP 1, 0"), (2, 20..100)), "{off}");
        // The other module has heard all of it.
        assert_eq!(questions(&mut port, "module 2 send GAP 1, 0"), (1, 1));
    }
    // Without anything to wait for time stands still.
    port.ok("power off");
    assert_eq!(questions(&mut port, "send GAP 1, 0"), (11, 0));
}

#[test]
fn time_may_go_by_the_clock_or_be_somebody_elses() {
    let sim = Sim::start(&["--control", "127.0.0.1:0"]);
    let (mut port, mut other) = (Controller::new(&sim), Controller::new(&sim));
    assert_eq!(port.ok("send GGP 66, 0")["value"], 1);
    port.ok("power off");
    assert!(port.ok("send GGP 66, 0")["error"].is_string());
    port.ok("power on");
    // A restart ends what waits for its reply.
    port.ok("fault reply-delay 900 ms");
    port.ok("speed 0.001");
    port.tell("send GGP 66, 0");
    while other.refused("step 1 s").contains("busy") {}
    other.ok("restart");
    assert!(port.answer().unwrap()["error"].is_string());
    // While somebody lets time pass, nothing is sent.
    let sim = tireless();
    let (mut stepper, mut other) = (begin_an_hour(&sim), Controller::new(&sim));
    assert!(other.refused("send GGP 66, 0").contains("busy: a 'step' is under way"));
    other.ok("interrupt");
    assert_eq!(stepper.answer().unwrap()["ok"], true);
}

#[test]
fn a_module_that_runs_its_image_is_asked_as_well() {
    let image = build::image();
    let image = ["--image", image.to_str().unwrap(), "--modules", "2", "--tcp", "127.0.0.1:0"];
    let sim = Sim::start(&[&PAUSED[..], &image].concat());
    let mut port = Controller::new(&sim);
    assert_eq!(port.ok("send GAP APMaxCurrent, 0")["value"], 128);
    // Module 2 has no host at its USB connector, until one is wanted.
    assert!(port.ok("module 2 send GGP 66, 0")["error"].as_str().unwrap().contains("until 'usb on'"));
    port.ok("module 2 usb on");
    port.ok("step 1 s");
    assert_eq!(port.ok("module 2 send GGP 66, 0")["value"], 2);
    port.ok("power off");
    assert!(port.ok("send GAP 1, 0")["error"].is_string());
}
