//! Three modules on one RS485 bus: who answers, when, and that nobody takes a reply to another for a request.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcl_cli::fleet::Fleet;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::text;

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
        bus.0.modules_mut()[2].set_power(on);
        bus.0.run(10 * MILLISECOND);
    }
    assert_eq!(bus.ok(3, "GGP 71, 0"), 3);
    assert_eq!(bus.ask(3, "137, 0, 0, 1234"), None);
    assert_eq!(bus.ask(3, "GAP 4, 0"), None);
}
