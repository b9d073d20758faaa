//! Three modules on one RS485 bus: who answers, when, and that nobody takes a reply to another for a request.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::text;
use tmcm_sim::Product;
use tmcm_sim::fleet::Fleet;

/// Longest time a test waits for a reply.
const PATIENCE: Nanos = 400 * MILLISECOND;
/// Nine bytes of ten bits at 9600 bit/s.
const TELEGRAM: Nanos = 9 * (10 * SECOND / 9600);
/// The firmware's share: next to nothing, but the chips are asked.
const EXECUTION: Nanos = 200 * MICROSECOND;

struct Bus(Fleet);

fn request(address: u8, line: &str) -> Telegram {
    binary::encode_command(address, text::parse(line).unwrap())
}

impl Bus {
    fn new() -> Self {
        Bus(Fleet::new(&WorldConfig::default(), &[None; 3], 1))
    }

    /// Sends bytes and gives all that comes back, and when the last of it came.
    fn exchange(&mut self, bytes: &[u8]) -> (Vec<u8>, Nanos) {
        let start = self.0.now();
        self.0.send_rs485(bytes);
        let (mut all, mut last) = (Vec::new(), start);
        while self.0.now() < start + PATIENCE {
            let next = self.0.next_event().unwrap();
            self.0.run_until(next.min(start + PATIENCE));
            let heard = self.0.rs485();
            if !heard.is_empty() {
                all.extend(heard);
                last = self.0.now();
            }
        }
        (all, last - start)
    }

    fn ask(&mut self, address: u8, line: &str) -> Option<Received> {
        let (reply, _) = self.exchange(&request(address, line));
        (!reply.is_empty()).then(|| binary::decode_reply(&reply.try_into().expect("one telegram")).unwrap())
    }

    /// Asks one module, which must be the one that answers, and gives the value.
    fn ok(&mut self, address: u8, line: &str) -> i32 {
        let reply = self.ask(address, line).unwrap_or_else(|| panic!("{address}: {line}: no reply"));
        assert_eq!((reply.host, reply.module, reply.status), (2, address, 100), "{line}");
        reply.value
    }
}

#[test]
fn each_answers_for_itself() {
    let mut bus = Bus::new();
    for address in 1..=3 {
        bus.ok(address, &format!("SAP 4, 0, {}", 1100 + i32::from(address)));
        bus.ok(address, &format!("SGP {address}, 2, {address}"));
        bus.ok(address, &format!("STGP {address}, 2"));
    }
    for address in [3, 1, 2, 1, 3, 2] {
        assert_eq!(bus.ok(address, "GAP 4, 0"), 1100 + i32::from(address));
        for variable in 1..=3 {
            let expected = if variable == address { variable.into() } else { 0 };
            assert_eq!(bus.ok(address, &format!("GGP {variable}, 2")), expected);
        }
        assert_eq!(bus.ok(address, "GGP 66, 0"), i32::from(address));
    }
    assert_eq!(bus.ask(4, "GAP 4, 0"), None);
    assert_eq!(bus.ask(0, "GAP 4, 0"), None);
}

#[test]
fn a_module_with_the_address_of_the_host_knows_replies_to_others() {
    let mut bus = Bus::new();
    for asked in [1, 3] {
        // As requests these replies would be errors, garbage and, with command 3 or a stored command, motion.
        assert_eq!(bus.exchange(&request(asked, "136, 0")).0, b"\x021140V142");
        assert_eq!(bus.ask(asked, "0, 0, 0, 0").unwrap().status, 2);
        assert_eq!(bus.ask(asked, "GAP 250, 0").unwrap().status, 3);
        let mut torn = request(asked, "GAP 4, 0");
        torn[8] ^= 1;
        assert_eq!(bus.exchange(&torn).0, binary::encode_reply(2, asked, &tmcm::tmcl::Reply::WRONG_CHECKSUM));
        assert_eq!(bus.ok(2, "GAP 3, 0"), 0);
    }
    // Nobody answers for a module that is not there, and the next request is one.
    assert_eq!(bus.ask(9, "GAP 4, 0"), None);
    assert_eq!(bus.ok(2, "ROR 0, 100"), 100);
}

/// Nobody answers for module 9, and module 2 does not mistake its own requests for that.
#[test]
fn a_module_with_the_address_of_the_host_knows_its_requests() {
    let mut torn = request(9, "GAP 4, 0");
    torn[8] ^= 1;
    for before in [request(9, "ROL 0, 100"), request(9, "GAP 4, 0"), request(9, "0, 0, 0, 0"), torn] {
        for line in ["GAP 1, 0", "GAP 2, 0", "GAP 6, 0", "GIO 1, 1", "GGP 1, 2", "SGP 1, 2, 5", "GGP 100, 2", "MST 0"] {
            let mut bus = Bus::new();
            bus.0.send_rs485(&before);
            bus.0.run(10 * MILLISECOND);
            assert!(bus.ask(2, line).is_some(), "{line}");
        }
    }
}

/// Requests for axes 4 and 5, and for several axes at once, look like refusals of MVP, SAP and what nobody knows.
#[test]
fn a_module_with_the_address_of_the_host_knows_requests_for_each_of_its_axes() {
    let mut bus = Bus(Fleet::of(Product::Tmcm6110, &WorldConfig::default(), &[None; 2], 1));
    for axis in 0..6 {
        for number in 1..=6 {
            bus.ok(2, &format!("GAP {number}, {axis}"));
        }
        bus.ok(2, &format!("SCO 1, {axis}, 77"));
        for line in ["SAP 1, #, 0", "SAP 4, #, 900", "STAP 4, #", "RSAP 5, #", "MVP REL, #, 0", "MVP COORD, #, 1"] {
            bus.ok(2, &line.replace('#', &axis.to_string()));
        }
        for line in ["GCO 1, #", "RFS STATUS, #", "RFS STOP, #", "SAP 3, #, 1", "ROR #, 0"] {
            assert!(bus.ask(2, &line.replace('#', &axis.to_string())).is_some(), "{line}, axis {axis}");
        }
    }
    for motors in [0x47, 0x7F, 0x87, 0xBF, 0xC1, 255] {
        assert!(bus.ask(2, &format!("MVP COORD, {motors}, 1")).is_some(), "{motors}");
    }
}

/// And the other way round: nobody takes such a reply for a request, so that nothing moves and nobody answers it.
#[test]
fn a_module_with_the_address_of_the_host_and_six_axes_knows_replies_to_others() {
    let mut bus = Bus(Fleet::of(Product::Tmcm6110, &WorldConfig::default(), &[None; 5], 1));
    for asked in [1, 3, 4, 5] {
        for (line, status) in [
            ("MVP ABS, 4, 300", 100),
            ("MVP REL, 5, -200", 100),
            ("SAP 4, 5, 700", 100),
            ("MVP ABS, 6, 300", 4),
            ("MVP REL, 7, 300", 4),
            ("MVP 3, 0, 300", 3),
            ("SAP 4, 5, 5000", 4),
            ("SAP 3, 5, 5", 3),
            ("SAP 250, 0, 5", 3),
            ("SAP 0, 250, 5", 4),
            ("STAP 1, 1", 3),
            ("0, 0, 0, 0", 2),
            ("72, 0, 0, 1", 2),
            ("127, 0, 0, 9", 2),
            ("191, 0, 0, 9", 2),
            ("254, 0, 0, 9", 2),
        ] {
            assert_eq!(bus.ask(asked, line).map(|reply| reply.status), Some(status), "{asked}: {line}");
        }
        for axis in 0..6 {
            assert_eq!((bus.ok(2, &format!("GAP 3, {axis}")), bus.ok(2, &format!("GAP 1, {axis}"))), (0, 0));
            assert_eq!((bus.ok(2, &format!("GAP 4, {axis}")), bus.ok(2, &format!("GAP 0, {axis}"))), (1000, 0));
        }
        // Their own requests have not made the module expect anything.
        bus.ok(2, &format!("SAP 4, 5, {}", 800 + i32::from(asked)));
        bus.ok(2, "SAP 4, 5, 1000");
    }
}

#[test]
fn only_the_one_addressed_tells_of_a_wrong_checksum() {
    let mut bus = Bus::new();
    for address in 1..=3 {
        let mut torn = request(address, "ROR 0, 500");
        torn[8] ^= 0x10;
        assert_eq!(bus.exchange(&torn).0, binary::encode_reply(2, address, &tmcm::tmcl::Reply::WRONG_CHECKSUM));
    }
    let mut torn = request(7, "ROR 0, 500");
    torn[8] ^= 0x10;
    assert!(bus.exchange(&torn).0.is_empty());
    (1..=3).for_each(|address| assert_eq!(bus.ok(address, "GAP 2, 0"), 0));
}

#[test]
fn primary_secondary_and_host_address() {
    let mut bus = Bus::new();
    bus.ok(3, "SGP 87, 0, 30");
    bus.ok(1, "SGP 87, 0, 10");
    // The reply to a request to the secondary address carries the primary one.
    for (address, module) in [(30, 3), (3, 3), (10, 1), (1, 1)] {
        assert_eq!(bus.ask(address, "GAP 4, 0").unwrap().module, module);
    }
    bus.ok(3, "SGP 87, 0, 0");
    assert_eq!(bus.ask(30, "GAP 4, 0"), None);
    // Settings count from the reply on.
    let reply = bus.ask(3, "SGP 76, 0, 77").unwrap();
    assert_eq!((reply.host, reply.module), (2, 3));
    assert_eq!(bus.ask(3, "GAP 4, 0").unwrap().host, 77);
    let reply = bus.ask(3, "SGP 66, 0, 200").unwrap();
    assert_eq!((reply.host, reply.module, reply.value), (77, 3, 200));
    assert_eq!(bus.ask(3, "GAP 4, 0"), None);
    assert_eq!(bus.ask(200, "GAP 4, 0").unwrap().module, 200);
}

#[test]
fn a_reply_takes_its_time_on_the_wire() {
    let mut bus = Bus::new();
    let (reply, took) = bus.exchange(&request(2, "GAP 4, 0"));
    assert_eq!(reply.len(), 9);
    assert!((TELEGRAM..TELEGRAM + EXECUTION).contains(&took), "{took}");
    bus.ok(2, "SGP 65, 0, 7");
    assert!(bus.exchange(&request(2, "GAP 4, 0")).1 >= TELEGRAM, "a new bit rate counts after a restart");
    bus.ok(2, "255, 0, 0, 1234");
    bus.0.run(200 * MILLISECOND);
    let (reply, took) = bus.exchange(&request(2, "GAP 4, 0"));
    assert_eq!(reply.len(), 9, "{reply:?}");
    let fast = 9 * (10 * SECOND / 115_200);
    assert!((fast..fast + EXECUTION).contains(&took), "{took}");
}

#[test]
fn the_telegram_pause_is_kept_before_the_reply() {
    let mut bus = Bus::new();
    bus.ok(3, "SGP 75, 0, 40");
    let took = bus.exchange(&request(3, "GAP 4, 0")).1;
    let expected = 40 * MILLISECOND + TELEGRAM;
    assert!((expected..expected + EXECUTION).contains(&took), "{took}");
    let took = bus.exchange(&request(1, "GAP 4, 0")).1;
    assert!(took < 40 * MILLISECOND, "{took}");
}

/// In its pause a module hears what goes on, and the pause begins anew.
#[test]
fn the_telegram_pause_comes_after_the_last_byte() {
    let mut bus = Bus::new();
    bus.ok(3, "SGP 75, 0, 40");
    bus.0.send_rs485(&request(3, "GAP 4, 0"));
    bus.0.run(20 * MILLISECOND);
    let (heard, took) = bus.exchange(&request(9, "GAP 4, 0"));
    assert_eq!(heard.len(), 9);
    assert!((40 * MILLISECOND + TELEGRAM..40 * MILLISECOND + TELEGRAM + EXECUTION).contains(&took), "{took}");
    bus.0.send_rs485(&request(3, "GAP 4, 0"));
    bus.0.run(20 * MILLISECOND);
    assert_eq!(bus.exchange(&request(3, "GAP 5, 0")).0.len(), 18, "it has heard the second request, too");
}

#[test]
fn who_sends_hears_nothing() {
    let mut bus = Bus::new();
    bus.0.send_rs485(&request(3, "GAP 4, 0"));
    bus.0.run(TELEGRAM / 2);
    assert_eq!(bus.exchange(&request(3, "GAP 4, 0")).0.len(), 9, "one reply");
}

#[test]
fn one_reply_comes_behind_the_other() {
    let mut bus = Bus::new();
    let (both, took) = bus.exchange(&[request(3, "GAP 4, 0"), request(3, "GGP 66, 0")].concat());
    let replies: Vec<Received> =
        both.as_chunks().0.iter().map(|reply| binary::decode_reply(reply).expect("mixed up")).collect();
    assert_eq!(replies.iter().map(|reply| (reply.opcode, reply.value)).collect::<Vec<_>>(), [(6, 1000), (10, 3)]);
    assert!((2 * TELEGRAM..2 * TELEGRAM + EXECUTION).contains(&took), "{took}");
}

/// A module in ASCII mode among others in binary mode: what it says is no part of their telegrams.
#[test]
fn text_on_the_bus_is_over_with_a_silence() {
    for told in [false, true] {
        let mut bus = Bus::new();
        bus.ok(1, "SGP 67, 0, 32");
        bus.ok(1, "139");
        if told {
            bus.0.await_silences();
        }
        for line in [&b"\rAMST\r"[..], b"\rAGAP 4, 0\r", b"\rAGGP 76, 0\r", b"\rAGGP 5, 2\r"] {
            for address in [2, 3] {
                assert!(bus.exchange(line).0.starts_with(b"BA 100 "));
                assert_eq!(bus.exchange(&request(address, "GAP 4, 0")).0.len(), 9, "told: {told}");
                if told {
                    bus.0.silence_rs485();
                }
            }
        }
    }
}

/// Module 2 has the host's letter. Replies and echoes of the others are nothing to it. Its own lines are echoed as a
/// whole, since the first character does not say yet that they are no replies.
#[test]
fn nobody_echoes_replies_of_others() {
    let mut bus = Bus::new();
    for address in 1..=3 {
        bus.0.send_rs485(&request(address, "139"));
        bus.0.run(PATIENCE);
    }
    bus.0.rs485();
    let mut type_in = |text: &[u8]| String::from_utf8(bus.exchange(text).0).unwrap();
    for _ in 0..2 {
        assert_eq!(type_in(b"\rAGAP 4, 0\r"), "AGAP 4, 0\rBA 100 1000\r");
        assert_eq!(type_in(b"CFOO\r"), "CFOO\rBC 2 0\r");
        assert_eq!(type_in(b"B"), "");
        assert_eq!(type_in(b"GAP 5, 0\x080\r"), "BGAP 5, 0\rBB 100 1000\r");
    }
}

/// A reset comes after its reply, even at this speed and after a pause; what is asked in between is lost.
#[test]
fn a_reset_waits() {
    let mut bus = Bus::new();
    bus.ok(3, "SAP 4, 0, 700");
    bus.ok(3, "SGP 75, 0, 40");
    bus.0.send_rs485(&request(3, "255, 0, 0, 1234"));
    bus.0.run(60 * MILLISECOND);
    assert_eq!(bus.0.rs485().len(), 9);
    bus.0.send_rs485(&request(3, "GAP 4, 0"));
    bus.0.run(20 * MILLISECOND);
    bus.0.send_rs485(&request(3, "SGP 68, 0, 5"));
    bus.0.run(PATIENCE);
    assert!(bus.0.rs485().is_empty());
    assert_eq!((bus.ok(3, "GGP 68, 0"), bus.ok(3, "GAP 4, 0"), bus.ok(3, "GGP 75, 0")), (0, 1000, 40), "restarted");
}

#[test]
fn without_power_nothing_more_is_sent() {
    let mut bus = Bus::new();
    for pause in [0, 100] {
        bus.ok(3, &format!("SGP 75, 0, {pause}"));
        bus.0.send_rs485(&request(3, "GAP 4, 0"));
        bus.0.run(TELEGRAM / 2);
        assert_eq!(bus.0.rs485().len(), if pause == 0 { 4 } else { 0 });
        bus.0.set_power(2, false);
        bus.0.set_power(2, true);
        bus.0.run(PATIENCE);
        assert!(bus.0.rs485().is_empty(), "pause {pause}");
        assert_eq!(bus.ok(3, "GAP 4, 0"), 1000);
    }
}

#[test]
fn a_silence_gives_up_what_is_unfinished() {
    let mut bus = Bus::new();
    let telegram = request(3, "GAP 4, 0");
    for cut in 1..telegram.len() {
        let (head, tail) = telegram.split_at(cut);
        bus.0.send_rs485(head);
        bus.0.run(5 * MILLISECOND);
        assert_eq!(bus.exchange(tail).0.len(), 9, "a pause of 5 ms after {cut} bytes");
        bus.0.send_rs485(head);
        bus.0.run(5 * MILLISECOND + MICROSECOND);
        assert_eq!(bus.exchange(&telegram).0.len(), 9, "{cut} stray bytes and a silence");
    }
}

#[test]
fn addresses_survive_a_power_cut_but_not_a_factory_reset() {
    let mut bus = Bus::new();
    for on in [false, true] {
        bus.0.set_power(2, on);
        bus.0.run(10 * MILLISECOND);
    }
    assert_eq!(bus.ok(3, "GGP 71, 0"), 3);
    assert_eq!(bus.ask(3, "137, 0, 0, 1234"), None);
    assert_eq!(bus.ask(3, "GAP 4, 0"), None);
}
