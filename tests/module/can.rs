//! The CAN bus: identifiers, the length of replies, and modules that do not disturb each other.
//!
//! Module 2 has the identifier that replies have, as everywhere where modules are numbered and nobody changes
//! parameter 70: it hears the replies of the others like requests.

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::world::config::WorldConfig;
use tmcm::can::{CanFrame, ExtendedId, Frame, Id, StandardId};
use tmcm::tmcl::can;
use tmcm::tmcl::text;
use tmcm_sim::fleet::{Fleet, Node};

/// Longest time a test waits.
const PATIENCE: Nanos = 50 * MILLISECOND;

struct Bus(Fleet);

impl Bus {
    fn new(modules: usize) -> Self {
        Bus(Fleet::new(&WorldConfig::default(), &vec![None; modules], 1))
    }

    /// Returns what modules say within a time.
    fn listen(&mut self, span: Nanos) -> Vec<(u16, Vec<u8>)> {
        self.0.run(span);
        let heard = std::iter::from_fn(|| self.0.can()).filter(|heard| matches!(heard.from, Node::Module(_)));
        let number = |id| if let Id::Standard(id) = id { id.as_raw() } else { panic!("{id:?}") };
        heard.map(|heard| (number(heard.frame.id()), heard.frame.data().to_vec())).collect()
    }

    /// Sends a request of so many bytes and gives all that is said then.
    fn exchange(&mut self, id: u16, line: &str, length: usize) -> Vec<(u16, Vec<u8>)> {
        let mut data = can::encode_command(text::parse(line).unwrap());
        data.truncate(length);
        self.0.send_can(1, Frame::standard(id, &data).unwrap());
        self.listen(PATIENCE)
    }

    /// Sends requests without waiting for a reply and gives the modules that answer, by the first byte of what they
    /// say.
    fn at_once(&mut self, requests: &[(u16, &str)]) -> Vec<u8> {
        for (id, line) in requests {
            self.0.send_can(1, Frame::standard(*id, &can::encode_command(text::parse(line).unwrap())).unwrap());
        }
        self.listen(PATIENCE).iter().map(|(_, data)| data[0]).collect()
    }

    /// Sends a request that one module must carry out: identifier of the reply, low byte of its own, and value.
    fn ok(&mut self, id: u16, line: &str) -> (u16, u8, i32) {
        let said = self.exchange(id, line, 8);
        let [(reply, data)] = said.as_slice() else { panic!("{id}: {line}: {said:?}") };
        let [own, status, opcode, a, b, c, d, 0] = *data.as_slice() else { panic!("{line}: {data:?}") };
        assert_eq!((status, opcode), (100, text::parse(line).unwrap().opcode), "{id}: {line}");
        (*reply, own, i32::from_be_bytes([a, b, c, d]))
    }
}

#[test]
fn a_reply_is_as_long_as_its_request() {
    let mut bus = Bus::new(1);
    for line in ["GAP 4, 0", "STAP 4, 0", "SGP 77, 0, 1"] {
        for length in [7, 8] {
            let said = bus.exchange(1, line, length);
            assert_eq!(said.len(), 1, "{line}");
            assert_eq!((said[0].0, said[0].1.len(), said[0].1[1]), (2, length, 100), "{line}");
        }
    }
    for length in 0..7 {
        assert_eq!(bus.exchange(1, "GAP 4, 0", length), []);
    }
}

/// A command that enters the vendor's boot loader is never answered; with other operands it is refused.
#[test]
fn the_boot_loader_entry_is_not_answered() {
    let mut bus = Bus::new(1);
    for length in [7, 8] {
        assert_eq!(bus.exchange(1, "242, 0x81, 0x92, 0xA3B4C5D6", length), []);
        assert_eq!(bus.exchange(1, "242, 0x81, 0x92, 0xA3B4C5D7", length)[0].1[1..3], [4, 242]);
    }
    assert_eq!(bus.ok(1, "GAP 4, 0").2, 1000);
}

#[test]
fn special_replies_leave_out_the_host_address() {
    let mut bus = Bus::new(1);
    assert_eq!(bus.exchange(1, "136, 0", 8), [(2, b"1140V142".to_vec())]);
    assert_eq!(bus.exchange(1, "136, 0", 7), [(2, b"1140V14".to_vec())]);
    assert_eq!(bus.ok(1, "136, 1"), (2, 1, 0x0474_012A));
}

#[test]
fn identifiers_change_after_the_reply() {
    let mut bus = Bus::new(1);
    assert_eq!(bus.exchange(0, "GAP 4, 0", 8), [], "a second identifier of 0 is none");
    assert_eq!(bus.ok(1, "SGP 83, 0, 0x300").0, 2);
    assert_eq!(bus.ok(0x300, "GAP 4, 0"), (2, 1, 1000), "the reply carries the first identifier");
    assert_eq!(bus.ok(1, "SGP 70, 0, 0x7FF").0, 2);
    assert_eq!(bus.ok(1, "SGP 71, 0, 0x456"), (0x7FF, 1, 0x456));
    assert_eq!(bus.exchange(1, "GAP 4, 0", 8), []);
    assert_eq!(bus.ok(0x456, "GAP 4, 0"), (0x7FF, 0x56, 1000));
    assert_eq!(bus.ok(0x300, "SGP 83, 0, 0"), (0x7FF, 0x56, 0));
    assert_eq!(bus.exchange(0x300, "GAP 4, 0", 8), []);
}

#[test]
fn the_event_is_as_long_as_the_request_for_it() {
    for length in [7, 8] {
        let mut bus = Bus::new(1);
        assert_eq!(bus.exchange(1, "138, 0, 0, 1", length).len(), 1);
        bus.ok(1, "MVP ABS, 0, 20000");
        let mut said = bus.listen(10_000 * MILLISECOND);
        let (id, data) = said.pop().expect("no event");
        assert!(said.is_empty());
        assert_eq!((id, &data[..7], data.len()), (2, &[1, 128, 138, 0, 0, 0, 1][..], length));
    }
}

#[test]
fn three_modules_answer_for_themselves() {
    let mut bus = Bus::new(3);
    for id in 1..=3 {
        bus.ok(id, &format!("SAP 4, 0, {}", 1100 + id));
    }
    for id in [3, 1, 2, 1, 3, 2] {
        assert_eq!(bus.ok(id, "GAP 4, 0"), (2, id as u8, 1100 + i32::from(id)));
        // To module 2, whose identifier replies have, this is the most different from a request.
        assert_eq!(bus.exchange(id, "136, 0", 8), [(2, b"1140V142".to_vec())]);
        assert_eq!(bus.exchange(id, "0, 0, 0, 0", 8), [(2, vec![id as u8, 2, 0, 0, 0, 0, 0, 0])]);
    }
    assert_eq!(bus.exchange(4, "GAP 4, 0", 8), []);
}

#[test]
fn replies_to_requests_that_are_open_at_once_are_known() {
    const OTHERS: [u16; 8] = [1, 3, 4, 5, 6, 7, 8, 9];
    let mut bus = Bus::new(9);
    bus.ok(2, "SGP 100, 2, 7");
    for line in ["GAP 4, 0", "ROL 0, 100", "ROR 0, 0", "MST 0", "0, 0, 0, 0", "17, 1, 2, 3", "GAP 250, 0", "128", "134"]
    {
        let said = bus.at_once(&OTHERS.map(|id| (id, line)));
        // A command out of program memory has no address.
        assert!(said == [1, 3, 4, 5, 6, 7, 8, 9] || line == "134" && said == [0; 8], "{line}: {said:?}");
    }
    // Two versions at a time are eight characters each; a reply that comes late comes after those of others.
    assert_eq!(bus.at_once(&[(8, "136, 0"), (9, "136, 0"), (2, "GAP 4, 0")]), [b'1', b'1', 2]);
    assert_eq!(bus.at_once(&[(9, "SGP 77, 0, 1"), (8, "GAP 4, 0"), (8, "MST 0"), (3, "ROL 0, 0")]), [8, 8, 3, 9]);
    assert_eq!(bus.ok(2, "GGP 100, 2").2, 7, "as a request, the reply to ROL of module 9 would have set it");
}

/// A second identifier that several modules have in common: the replies carry the first.
#[test]
fn replies_to_a_group_are_known() {
    let mut bus = Bus::new(9);
    bus.ok(2, "SGP 100, 2, 7");
    for with_module_2 in [false, true] {
        let group: Vec<u8> = (1..=9).filter(|id| *id != 2 || with_module_2).collect();
        for id in &group {
            bus.ok(u16::from(*id), "SGP 83, 0, 0x50");
        }
        for line in ["ROL 0, 100", "ROR 0, 0", "MST 0", "GAP 4, 0", "17, 1, 2, 3"] {
            let mut said = bus.at_once(&[(0x50, line)]);
            said.sort_unstable();
            assert_eq!(said, group, "{line}");
        }
        assert_eq!(bus.at_once(&[(0x50, "136, 0")]), vec![b'1'; group.len()]);
    }
    assert_eq!(bus.ok(2, "GGP 100, 2").2, 7);
}

#[test]
fn foreign_traffic_does_not_make_a_reply_a_request() {
    let mut bus = Bus::new(3);
    for line in ["SGP 77, 0, 1", "MST 0"] {
        bus.0.send_can(1, Frame::standard(3, &can::encode_command(text::parse(line).unwrap())).unwrap());
        for n in 0..200_u8 {
            bus.0.send_can(1, Frame::standard(0x181 + u16::from(n % 8), &[n, 1, 2, 3, 4, 5, 6, 7]).unwrap());
        }
        assert_eq!(bus.listen(2 * PATIENCE).len(), 1, "{line}");
    }
}

/// A frame that looks like a reply is none if nobody was asked for it, or for another value.
#[test]
fn requests_are_not_taken_for_replies() {
    let mut bus = Bus::new(3);
    // Nobody has identifier 9, nobody answers; 9 is SGP, 2 is ROL and the bank of user variables, too.
    assert_eq!(bus.at_once(&[(9, "ROL 0, 100"), (2, "SGP 1, 2, 77"), (2, "GGP 1, 2")]), [2, 2]);
    assert_eq!(bus.ok(2, "GGP 1, 2").2, 77);
    // Whoever has answered does not do it again.
    bus.ok(3, "ROR 0, 0");
    assert_eq!(bus.at_once(&[(2, "GIO 1, 1"), (2, "GIO 2, 1"), (2, "GIO 2, 1")]), [2, 2, 2]);
    bus.at_once(&[(1, "0, 0, 0, 0"), (5, "0, 0, 0, 0"), (3, "MST 0")]);
    for kind in [1, 3, 4, 5, 6, 100, 101] {
        assert_eq!(bus.at_once(&[(2, &format!("GAP {kind}, 0")), (2, &format!("GGP {kind}, 2"))]), [2, 2], "{kind}");
    }
}

#[test]
fn there_is_no_ascii_mode() {
    let mut bus = Bus::new(1);
    assert_eq!(bus.exchange(1, "139", 8), [(2, vec![1, 6, 139, 0, 0, 0, 0, 0])]);
    assert_eq!(bus.ok(1, "GAP 4, 0").2, 1000);
}

#[test]
fn other_kinds_of_frames_are_nobodys() {
    let mut bus = Bus::new(1);
    let data = can::encode_command(text::parse("GAP 4, 0").unwrap());
    let extended = Frame::new(ExtendedId::new(1).unwrap(), &data).unwrap();
    let remote = Frame::new_remote(StandardId::new(1).unwrap(), 8).unwrap();
    for frame in [extended, remote, Frame::standard(1, &[]).unwrap()] {
        bus.0.send_can(1, frame);
        assert_eq!(bus.listen(PATIENCE), []);
    }
}

#[test]
fn a_host_that_does_not_wait_is_answered_in_turn() {
    let mut bus = Bus::new(1);
    for line in ["SGP 77, 0, 1", "GGP 77, 0", "GAP 4, 0"] {
        bus.0.send_can(1, Frame::standard(1, &can::encode_command(text::parse(line).unwrap())).unwrap());
    }
    let opcodes: Vec<u8> = bus.listen(PATIENCE).iter().map(|(_, data)| data[2]).collect();
    assert_eq!(opcodes, [9, 10, 6]);
}
