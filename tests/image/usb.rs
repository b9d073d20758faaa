//! A USB host that sends many requests at once, and does not wait for their replies.

use hal_sim::clock::{MILLISECOND, SECOND};

use common::image_host::{Host, OK, decoded};
use common::telegram;

/// Sends telegrams in one go, and asserts that all are answered with status 100, although the first stores something
/// and takes its time. Events of command 138 may come in between.
fn assert_all_answered(host: &mut Host, lines: &[&str]) {
    let bytes: Vec<u8> = lines.iter().flat_map(|line| telegram(line)).collect();
    host.machine.usb().send(&bytes);
    let heard = host.hear_usb(2 * SECOND);
    let replies: Vec<&[u8]> = heard.chunks(9).filter(|reply| reply[3] != 138).collect();
    assert_eq!(host.machine.counters().starts, 1, "{:?}", host.log());
    assert_eq!(replies.len(), lines.len());
    for (line, reply) in lines.iter().zip(replies) {
        assert_eq!(decoded(line, reply).0, OK, "{line}");
    }
}

/// Erasing a protected program takes more than half a second. The requests behind it wait in the microcontroller and in
/// the host, and the watchdog sees that the link is alive.
#[test]
fn requests_behind_a_long_store_are_answered_in_their_turn() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("132, 0, 0, 0").0, OK);
    for _ in 0..1_000 {
        host.ask_usb("ROR 0, 77");
    }
    assert_eq!(host.ask_usb("133").0, OK);
    assert_eq!(host.ask_usb("SGP 81, 0, 1").0, OK);
    let lines = [&["SGP 81, 0, 0"][..], &["GAP 4, 0"; 12]].concat();
    assert_all_answered(&mut host, &lines);
}

/// Events of a program's moves do not take the place of a late reply.
#[test]
fn events_do_not_displace_the_reply_to_a_store() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("132, 0, 0, 0").0, OK);
    for line in ["MVP REL, 0, 1", "WAIT POS, 0, 0", "JA 0"] {
        host.ask_usb(line);
    }
    for line in ["133", "SAP 154, 0, 2", "SAP 153, 0, 2", "138 1, 0, 1", "129, 1, 0, 0"] {
        assert_eq!(host.ask_usb(line).0, OK, "{line}");
    }
    host.hear_usb(100 * MILLISECOND);
    for value in 5..8 {
        let set = format!("SGP 0, 2, {value}");
        let lines = [&[set.as_str(), "STGP 0, 2"][..], &["GAP 4, 0"; 8]].concat();
        assert_all_answered(&mut host, &lines);
    }
}
