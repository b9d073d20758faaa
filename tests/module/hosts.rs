//! Hosts that go: what they have asked for is done, and whoever comes next hears nothing of it.

use common::{Bench, OK, telegram};
use hal_sim::clock::MILLISECOND;
use tmcm::module::Source;
use tmcm::tmcl::binary;
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Client;

/// Sends a command as one of those who share a link.
fn post(bench: &mut Bench, source: Source, client: Client, line: &str) {
    bench.module.hear(source, client, &telegram(line));
}

/// Returns what is said within a time: to whom, status, number of the command, value.
fn said(bench: &mut Bench, milliseconds: u64) -> Vec<(Source, Client, u8, u8, i32)> {
    bench.run(milliseconds * MILLISECOND);
    std::iter::from_fn(|| bench.module.sent())
        .map(|sent| {
            let reply = binary::decode_reply(&sent.telegram().unwrap()).unwrap();
            (sent.source, sent.client, reply.status, reply.opcode, reply.value)
        })
        .collect()
}

/// The client that does not share a link.
const ALONE: Client = Client(0);
const MVP: &str = "MVP REL, 0, 20000";

fn replug(bench: &mut Bench) {
    bench.module.plug_usb(false);
    bench.run(10 * MILLISECOND);
    bench.module.plug_usb(true);
    bench.run(10 * MILLISECOND);
}

/// The host on USB that has asked for the event of command 138 is gone: the next one does not get it, whenever the move
/// began. A host on RS485 still gets its own.
#[test]
fn the_next_host_on_usb_gets_no_event() {
    for once in [1, 0] {
        for moves_before in [false, true] {
            let mut bench = Bench::new();
            bench.ok(&format!("138, {}, 0, 1", 1 - once));
            if moves_before {
                bench.ok_beside(MVP);
            }
            replug(&mut bench);
            bench.ok("GAP 4, 0");
            if !moves_before {
                bench.ok_beside(MVP);
            }
            assert_eq!(said(&mut bench, 3000), []);
            bench.ok(MVP);
            assert_eq!(said(&mut bench, 3000), [], "nor for a move of its own");
            bench.ok_beside(&format!("138, {}, 0, 1", 1 - once));
            replug(&mut bench);
            bench.ok(MVP);
            assert_eq!(said(&mut bench, 3000), [(Source::Rs485, ALONE, 128, 138, 1)]);
        }
    }
}

/// The reply to a command that stores goes to nobody when its host has gone meanwhile. It is stored all the same.
#[test]
fn the_next_host_on_usb_gets_no_late_reply() {
    let mut bench = Bench::new();
    post(&mut bench, Source::Usb, ALONE, "SGP 68, 0, 60000");
    post(&mut bench, Source::Rs485, ALONE, "SGP 75, 0, 1");
    bench.run(2 * MILLISECOND);
    bench.module.plug_usb(false);
    bench.module.plug_usb(true);
    // Nor does the next one have to wait until it is stored.
    post(&mut bench, Source::Usb, ALONE, "GAP 4, 0");
    assert_eq!(said(&mut bench, 1), [(Source::Usb, ALONE, OK, 6, 1000)]);
    assert!(bench.module.board().borrow().at25().is_writing());
    assert_eq!(said(&mut bench, 100), [(Source::Rs485, ALONE, OK, 9, 1)]);
    assert_eq!(Bench::with_eeprom(&bench.eeprom()).ok("GGP 68, 0"), 60_000);
    // A reply that waits for its frame goes with the cable, and so does a telegram that waits for the one before.
    for line in ["SGP 68, 0, 50000", "SGP 68, 0, 40000"] {
        post(&mut bench, Source::Usb, ALONE, line);
    }
    replug(&mut bench);
    post(&mut bench, Source::Usb, ALONE, "GAP 4, 0");
    bench.module.plug_usb(false);
    bench.module.plug_usb(true);
    assert_eq!(said(&mut bench, 100), []);
    assert_eq!(bench.ok("GGP 68, 0"), 50_000);
}

/// Nor does the next one find ASCII mode, half a telegram or half a line.
#[test]
fn the_next_host_on_usb_finds_the_link_as_at_the_start() {
    for left in [&[1, 6, 4][..], &[1, 139, 0, 0, 0, 0, 0, 0, 140], b"\x01\x8B\0\0\0\0\0\0\x8CAGAP"] {
        let mut bench = Bench::new();
        bench.module.hear(Source::Usb, ALONE, left);
        bench.run(10 * MILLISECOND);
        replug(&mut bench);
        while bench.module.sent().is_some() {}
        assert_eq!(bench.ok("GAP 4, 0"), 1000, "{left:?}");
    }
}

/// Where several share the link, as the connections to a TCP port do, the event goes to the one who has asked last.
/// When that one is gone it goes to nobody, and nobody has to be waited for either.
#[test]
fn an_event_goes_to_who_has_asked_last_or_to_nobody() {
    let [one, two, three] = [1, 2, 3].map(Client);
    let event = |client| (Source::Usb, client, 128, 138, 1);
    let moved = |client| (Source::Usb, client, OK, 4);
    for (gone, expected) in [(one, vec![event(two)]), (two, vec![]), (three, vec![event(two)])] {
        let mut bench = Bench::new();
        for client in [one, two] {
            post(&mut bench, Source::Usb, client, "138, 1, 0, 1");
        }
        assert_eq!(said(&mut bench, 10).len(), 2);
        assert!(bench.module.is_busy());
        for _ in 0..2 {
            bench.module.forget(gone);
            assert_eq!(bench.module.is_busy(), !expected.is_empty(), "{gone:?}");
            post(&mut bench, Source::Usb, three, MVP);
            let mut heard = said(&mut bench, 3000);
            let (source, client, status, opcode, _) = heard.remove(0);
            assert_eq!((source, client, status, opcode), moved(three), "{gone:?}");
            assert_eq!(heard, expected, "{gone:?}");
        }
        // A new host with the number of the old one asked for nothing.
        post(&mut bench, Source::Usb, gone, "GAP 4, 0");
        post(&mut bench, Source::Usb, gone, MVP);
        assert_eq!(said(&mut bench, 3000).len(), 2 + expected.len(), "{gone:?}");
    }
}
