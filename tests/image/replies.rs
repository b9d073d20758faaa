//! Replies of the very flash image that come late, or not at all, or under settings that have just changed; and what
//! is none of the module's business.

use common::image_host::{Host, LOADED, OK, START, decoded, request};
use common::telegram;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::CanFrame;

/// A link on which a host asks for something.
type Ask = fn(&mut Host, &str) -> (u8, i32);
/// A link on which somebody types.
type Type = fn(&mut Host, &str) -> String;

/// Longer than the EEPROM takes for a page.
const STORED: Nanos = 30 * MILLISECOND;

/// Types this, and returns what comes back over USB.
fn type_usb(host: &mut Host, text: &str) -> String {
    host.machine.usb().send(text.as_bytes());
    host.hear_usb(STORED).escape_ascii().to_string()
}

/// The same over RS485, where whoever types waits for the echo of each character.
fn type_rs485(host: &mut Host, text: &str) -> String {
    let heard: Vec<u8> = text.bytes().flat_map(|byte| host.said_to(&[byte], 5 * MILLISECOND)).collect();
    [heard, host.said_to(&[], STORED)].concat().escape_ascii().to_string()
}

// ---- CAN ----

/// A module whose own identifier is that of replies hears what others are asked, and knows their replies by that.
#[test]
fn a_reply_to_another_module_is_not_executed_where_replies_have_the_own_identifier() {
    let mut host = Host::new("");
    host.ok("SGP 71, 0, 5");
    host.ok("SGP 70, 0, 5");
    host.ok("SGP 100, 2, 7");
    // What module 9 answers to ROL 0, 0 is, as a request, SGP 100, 2, 0.
    let reply = CanFrame { data: [9, 100, 2, 0, 0, 0, 0, 0], ..request(5, "ROL 0, 0") };
    host.machine.can().send(request(9, "ROL 0, 0"));
    host.machine.can().send(reply);
    host.run(20 * MILLISECOND);
    assert_eq!(host.machine.can().take_sent(), []);
    assert_eq!(host.ok("GGP 100, 2"), 7);
    // Nobody has been asked: this one is a request.
    host.machine.can().send(reply);
    host.run(20 * MILLISECOND);
    let [(_, answer)] = host.machine.can().take_sent()[..] else { panic!("one reply") };
    assert_eq!((answer.id, answer.data, host.ok("GGP 100, 2")), (5, [5, 100, 9, 0, 0, 0, 0, 0], 0));
}

/// While a program takes its full fuel and the motor turns, a request over CAN is answered between two slices. The
/// frames of request and reply take 111 us each, and at most 66 us pass between them.
#[test]
fn requests_over_can_are_answered_between_the_slices_of_a_program() {
    let mut host = Host::new("");
    host.ok("132, 0, 0, 0");
    for line in ["CALC ADD, 1", "GAP 1, 0", "JA 0"] {
        assert_eq!(host.ask(line).0, LOADED);
    }
    for line in ["133, 0, 0, 0", "ROR 0, 1000", "129, 0, 0, 0"] {
        host.ok(line);
    }
    let mut longest = 0;
    for n in 0..100 {
        host.run(10 * MILLISECOND + n * 37 * MICROSECOND);
        let begin = host.machine.now();
        host.machine.can().send(request(1, "GAP 5, 0"));
        host.run(2 * MILLISECOND);
        let [(end, _)] = host.machine.can().take_sent()[..] else { panic!("one reply") };
        longest = longest.max(end - begin);
    }
    assert!(longest <= (2 * 111 + 66) * MICROSECOND, "{longest} ns");
}

/// Somebody else's byte is still arriving when a host begins: its bytes follow that one, as they do on a wire.
#[test]
fn a_request_right_behind_the_byte_of_another_is_answered() {
    let mut host = Host::new("");
    let others = telegram("GGP 66, 0").map(|byte| byte ^ 0x80);
    let end = host.machine.rs485().send(&others, host.baud);
    // In the middle of the last byte, which takes 1042 us.
    host.machine.run_until(end - 500 * MICROSECOND).unwrap();
    host.machine.rs485().send(&telegram("GGP 66, 0"), host.baud);
    host.run(30 * MILLISECOND);
    let reply: Vec<u8> = host.machine.rs485().take_sent().iter().map(|character| character.value).collect();
    assert_eq!(decoded("GGP 66, 0", &reply), (OK, 1));
}

// ---- Settings ----

/// Addresses and echo, set over one link, are in force on the others with the next character.
#[test]
fn settings_of_the_links_are_in_force_on_all_of_them_at_once() {
    let mut host = Host::new("");
    host.plug_usb();
    let typists: [Type; 2] = [type_usb, type_rs485];
    for ask in [Host::ask_usb as Ask, Host::ask] {
        assert_eq!(ask(&mut host, "139, 0, 0, 0"), (OK, 0));
    }
    for (lines, typed, heard) in [
        (&[][..], "AGAP 4, 0\r", "AGAP 4, 0\\rBA 100 1000\\r"),
        (&["SGP 66, 0, 3", "SGP 76, 0, 5"], "CGAP 4, 0\r", "CGAP 4, 0\\rEC 100 1000\\r"),
        (&[], "AGAP 4, 0\r", ""),
        (&["SGP 67, 0, 32"], "CGAP 4, 0\r", "EC 100 1000\\r"),
        (&["SGP 67, 0, 16", "SGP 87, 0, 1"], "AGIX\x08O 1, 0\r", "AGIO 1, 0\\rEC 100 0\\r"),
        (&["SGP 67, 0, 0"], "CGIX\x08O 1, 0\r", "CGIX\\x08 \\x08O 1, 0\\rEC 100 0\\r"),
    ] {
        for line in lines {
            assert_eq!(host.ask_can(line).0, OK, "{line}");
        }
        for (n, typist) in typists.into_iter().enumerate() {
            assert_eq!(typist(&mut host, typed), heard, "after {lines:?}, over link {n}");
        }
    }
}

/// Parameter 75 is for replies: what is typed after one is echoed at once.
#[test]
fn the_telegram_pause_does_not_hold_up_the_echo_that_follows_a_reply() {
    let mut host = Host::new("");
    host.ok("SGP 75, 0, 100");
    host.ok("139, 0, 0, 0");
    for _ in 0..2 {
        for byte in *b"AGAP 4, 0" {
            assert_eq!(host.said_to(&[byte], 5 * MILLISECOND), [byte]);
        }
        assert_eq!(host.said_to(b"\r", 300 * MILLISECOND), b"\rBA 100 1000\r");
    }
}

// ---- Replies that come late ----

/// STAP waits for the EEPROM; what is asked behind it, without waiting, is answered behind it.
#[test]
fn what_is_asked_behind_a_late_reply_is_answered_behind_it() {
    let mut host = Host::new("");
    host.plug_usb();
    for value in [1_234, 777] {
        assert_eq!(host.ask_usb(&format!("SAP 4, 0, {value}")).0, OK);
        let lines = ["STAP 4, 0", "GAP 4, 0", "GAP 5, 0"];
        host.machine.usb().send(&lines.map(telegram).concat());
        let heard = host.hear_usb(2 * STORED);
        let replies: Vec<_> = heard.chunks(9).zip(lines).map(|(reply, line)| decoded(line, reply)).collect();
        assert_eq!(replies, [(OK, 0), (OK, value), (OK, 1_000)]);
    }
    for value in [1_234, 777] {
        assert_eq!(host.ask_can(&format!("SAP 4, 0, {value}")).0, OK);
        let lines = ["STAP 4, 0", "GAP 4, 0", "GAP 5, 0"];
        for line in lines {
            host.machine.can().send(request(1, line));
        }
        host.run(2 * STORED);
        let replies: Vec<_> =
            host.machine.can().take_sent().iter().map(|(_, frame)| frame.data[..7].to_vec()).collect();
        let [high, low] = (value as u16).to_be_bytes();
        assert_eq!(replies, [[1, OK, 7, 0, 0, 0, 0], [1, OK, 6, 0, 0, high, low], [1, OK, 6, 0, 0, 0x03, 0xE8]]);
    }
}

/// With parameter 255 a store is not answered, and does not keep the link waiting for that. This holds for a telegram
/// behind it, for the change to ASCII mode, and for a line.
#[test]
fn a_late_reply_that_is_suppressed_does_not_block_the_link() {
    type Say = fn(&mut Host, &[u8]) -> Vec<u8>;
    let usb: Say = |host, bytes| {
        host.machine.usb().send(bytes);
        host.hear_usb(STORED)
    };
    let rs485: Say = |host, bytes| host.said_to(bytes, STORED);
    let links: [(Ask, Say, Type); 2] = [(Host::ask_usb, usb, type_usb), (Host::ask, rs485, type_rs485)];
    for (ask, say, typist) in links {
        let mut host = Host::new("");
        host.plug_usb();
        assert_eq!(ask(&mut host, "SGP 255, 0, 1").0, OK);
        for line in ["SAP 4, 0, 1234", "STAP 4, 0"] {
            assert!(say(&mut host, &telegram(line)).is_empty(), "{line}");
        }
        assert_eq!(ask(&mut host, "GAP 4, 0"), (OK, 1_234));
        assert!(say(&mut host, &telegram("139, 0, 0, 0")).is_empty());
        assert_eq!(typist(&mut host, "AGAP 4, 0\r"), "AGAP 4, 0\\rBA 100 1234\\r");
        for line in ["ASAP 4, 0, 777\r", "ASTAP 4, 0\r"] {
            assert_eq!(typist(&mut host, line), line.escape_default().to_string());
        }
        assert_eq!(typist(&mut host, "AGAP 4, 0\r"), "AGAP 4, 0\\rBA 100 777\\r");
        // The value has been stored.
        host.machine.set_power(false);
        host.run(MILLISECOND);
        host.machine.set_power(true);
        host.run(START);
        assert_eq!(host.ok("GAP 4, 0"), 777);
    }
}

/// A cable is pulled while one reply lies in the port, another waits for that, and a third one waits behind it: the
/// next connection gets none of them.
#[test]
fn replies_of_one_usb_connection_do_not_come_on_the_next() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("SAP 4, 0, 1234").0, OK);
    host.machine.usb().set_reading(false);
    host.machine.usb().send(&["GAP 5, 0", "STAP 4, 0", "GAP 4, 0"].map(telegram).concat());
    host.run(STORED);
    host.machine.usb().plug(false);
    host.run(20 * MILLISECOND);
    host.plug_usb();
    assert!(host.hear_usb(100 * MILLISECOND).is_empty());
    assert_eq!(host.ask_usb("GAP 4, 0"), (OK, 1_234));
}

/// A reply that is not there yet when the cable is pulled is for nobody: not for who asks on the next connection.
#[test]
fn a_reply_that_becomes_due_after_its_usb_connection_does_not_come_on_the_next() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("132, 0, 0, 0"), (OK, 0));
    // A program that takes longer to be erased than a host to find the port again.
    for _ in 0..400 {
        assert_eq!(host.ask_usb("SIO 0, 2, 1").0, LOADED);
    }
    assert_eq!((host.ask_usb("133").0, host.ask_usb("SGP 81, 0, 1").0), (OK, OK));
    host.machine.usb().send(&telegram("SGP 81, 0, 0"));
    host.run(10 * MILLISECOND);
    host.machine.usb().plug(false);
    host.run(10 * MILLISECOND);
    host.plug_usb();
    assert!(host.machine.usb().take().is_empty());
    assert_eq!(host.ask_usb("GAP 4, 0"), (OK, 1_000));
    assert!(host.hear_usb(SECOND).is_empty());
}
