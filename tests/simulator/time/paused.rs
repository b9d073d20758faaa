//! How much time requests take while nothing else lets time pass.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::control::Line;

use super::rig::{HOST, Paused, replies, telegram};

/// Longest time for which the firmware is busy with something else before it takes a request.
const ATTENTION: Nanos = 100 * MICROSECOND;

#[test]
fn a_request_on_usb_takes_a_millisecond() {
    let mut paused = Paused::new();
    for line in ["GAP 1, 0", "ROR 0, 100", "MST 0", "GAP 250, 0", "0, 0, 0, 0"] {
        assert_eq!(paused.exchange(line).1, MILLISECOND, "{line}");
    }
    assert_eq!(paused.fleet.answered(), 5);
    assert_eq!(paused.serve(), 0);
}

#[test]
fn requests_sent_together_are_all_answered() {
    let mut paused = Paused::new();
    paused
        .fleet
        .hear_usb(HOST, &[telegram(1, "GAP 4, 0"), telegram(1, "SAP 4, 0, 9"), telegram(1, "GAP 4, 0")].concat());
    // The second asks a chip, which takes some time before the third.
    let took = paused.serve();
    assert!((MILLISECOND..MILLISECOND + ATTENTION).contains(&took), "{took}");
    let bytes: Vec<u8> = paused.sent().into_iter().flat_map(|sent| sent.bytes).collect();
    assert_eq!(replies(&bytes).iter().map(|reply| reply.value).collect::<Vec<_>>(), [1000, 9, 9]);
    assert_eq!(paused.fleet.answered(), 3);
}

#[test]
fn a_telegram_that_has_come_in_part_takes_no_time() {
    let mut paused = Paused::new();
    let (head, tail) = (&telegram(1, "GAP 4, 0")[..5], &telegram(1, "GAP 4, 0")[5..]);
    paused.fleet.hear_usb(HOST, head);
    assert_eq!(paused.serve(), 0);
    paused.fleet.hear_usb(HOST, tail);
    assert_eq!((paused.serve(), paused.sent().len()), (MILLISECOND, 1));
    // After a silence the head is no part of a telegram any more.
    paused.fleet.hear_usb(HOST, head);
    paused.fleet.silence_usb(HOST);
    assert_eq!(paused.ok("GAP 4, 0"), 1000);
}

#[test]
fn the_reply_to_a_store_comes_when_it_is_stored() {
    let mut paused = Paused::new();
    paused.ok("SAP 4, 0, 321");
    let (bytes, took) = paused.exchange("STAP 4, 0");
    assert_eq!(replies(&bytes)[0].status, 100);
    assert!((4 * MILLISECOND..50 * MILLISECOND).contains(&took), "{took}");
    paused.control("power off");
    paused.control("power on");
    assert_eq!(paused.ok("GAP 4, 0"), 321);
}

#[test]
fn commands_without_a_reply_take_the_time_until_they_are_taken() {
    let mut paused = Paused::new();
    paused.ok("SGP 255, 0, 1");
    for line in ["ROR 0, 100", "MST 0", "137, 0, 0, 1234"] {
        let (bytes, took) = paused.exchange(line);
        assert!(bytes.is_empty() && took < ATTENTION, "{line}: {took}");
    }
    // The module starts anew, which counts as an answer.
    assert_eq!(paused.fleet.answered(), 2);
}

#[test]
fn an_event_moves_no_time() {
    Paused::new().event_moves_no_time();
}

#[test]
fn commands_are_carried_out_at_their_time() {
    let mut paused = Paused::new();
    paused.at(4 * MILLISECOND, "press left");
    paused.at(2 * MILLISECOND, "supply 12.5");
    paused.at(2 * MILLISECOND, "supply 13");
    paused.fleet.run(2 * MILLISECOND - 1);
    assert_eq!(paused.control("state").unwrap().supply, 24.0);
    // During a request as well.
    let (_, took) = paused.exchange("GAP 1, 0");
    assert_eq!(paused.control("state").unwrap().supply, 13.0);
    paused.fleet.run(2 * MILLISECOND - took);
    assert!(!paused.control("state").unwrap().first.switches.left);
    paused.fleet.run(1);
    assert!(paused.control("state").unwrap().first.switches.left);
    paused.at(0, "release left");
    assert!(!paused.control("state").unwrap().first.switches.left);
}

#[test]
fn what_cannot_be_carried_out_is_refused_when_it_is_noted() {
    let mut paused = Paused::new();
    for (line, why) in [
        ("module 2 power off", "no module 2: there is 1 module"),
        ("press left 1", "axis"),
        ("fault tmc5160 on", "no such chip"),
        ("state", "changes nothing"),
    ] {
        let error = paused.fleet.at(MILLISECOND, Line::parse(line).unwrap()).unwrap_err();
        assert!(error.contains(why), "{line}: {error}");
    }
}

/// A protected program is erased page by page, while the reply waits.
#[test]
fn the_eeprom_is_waited_for_without_limit() {
    let mut paused = Paused::new();
    paused.exchange("132, 0, 0, 0");
    for _ in 0..2000 {
        paused.exchange("SGP 1, 2, 7");
    }
    paused.exchange("133, 0, 0, 0");
    paused.ok("SGP 81, 0, 1");
    let (bytes, took) = paused.exchange("SGP 81, 0, 0");
    assert_eq!(replies(&bytes)[0].status, 100);
    assert!(took > SECOND, "{took}");
}

#[test]
fn a_request_without_a_reply_is_given_up() {
    let mut paused = Paused::new();
    paused.ok("SAP 4, 0, 321");
    paused.fleet.hear_usb(HOST, &telegram(1, "STAP 4, 0"));
    // Replies that a fault keeps back are waited for, but not for ever.
    paused.control("fault reply-delay 3 s");
    let begun = paused.fleet.now();
    let took = paused.serve();
    assert!(paused.sent().is_empty());
    assert!((SECOND..SECOND + 50 * MILLISECOND).contains(&took), "{took}");
    assert_eq!(paused.serve(), 0);
    // With the next request time passes for that one, too.
    paused.control("fault reply-delay 0 s");
    paused.fleet.run(3 * SECOND);
    assert_eq!((paused.sent().len(), paused.fleet.now() > begun + 3 * SECOND), (1, true));
    assert_eq!(paused.ok("GAP 4, 0"), 321);
}
