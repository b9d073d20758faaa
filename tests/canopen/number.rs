//! A node that does not know its number: it says nothing, whatever is on the bus, until somebody tells it that it may
//! be node 1, or its EEPROM answers. A restart keeps the number.

use crate::driving::{FAULT, FAULT_RESET, SWITCH_ON_DISABLED};
use crate::lost_settings::{SAVED, flipped, saved};
use crate::rig::Rig;
use hal_sim::board::{self, Board, SharedBoard};
use hal_sim::clock::MILLISECOND;
use hal_sim::fault::Fault;
use hal_sim::world::config::WorldConfig;
use tmcm::canopen::Address;
use tmcm::module::Source;
use tmcm::tmcl::binary::Addressed;
use tmcm::tmcl::{Command, Reply, Status};
use tmcm_sim::{NativeModule, VirtualModule};

const SILENT: [u8; 8] = [0x30, 0x55, 0x81, 0, 255, 0, 0, 0];
const NINE: Address = Address { node: 9, bit_rate: 500 };

/// A board with this EEPROM, which answers or does not.
fn board(eeprom: &[u8], answers: bool) -> SharedBoard {
    let mut board = Board::of_kind(&board::TMCM_1140, &WorldConfig::default(), 1);
    board.at25_mut().load(eeprom);
    board.set_fault(Fault::Eeprom, 0, !answers);
    SharedBoard::new(board)
}

/// Asserts that a node without a number answers none of the frames that a master may send.
fn assert_silent(rig: &mut Rig) {
    for node in [0, 1, 9, 127] {
        for command in [1, 2, 0x80, 0x81, 0x82] {
            rig.send(0, &[command, node]);
        }
        rig.send(0x600 + u16::from(node), &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        rig.send_remote(0x700 + u16::from(node), 1);
    }
    rig.send(0x80, &[]);
    rig.send(0x201, &[6, 0]);
    rig.wait(300);
    assert_eq!((rig.frames(), rig.node.address(), rig.starts), (vec![], None, 1));
    // LED1 is off, and LED2 on.
    assert_eq!(leds(rig), [false, true]);
    assert!(!rig.is_energised());
}

fn leds(rig: &Rig) -> [bool; 2] {
    rig.board.borrow().world().outputs().leds
}

/// Serves a command over USB.
pub(crate) fn usb(rig: &mut Rig, opcode: u8, value: i32) -> Reply {
    let telegram = Addressed { address: 1, command: Command::new(opcode, 0, 0, value), intact: true };
    let now = rig.now();
    rig.node.serve_usb(now, &telegram)
}

fn status(reply: Reply) -> Status {
    match reply {
        Reply::Plain { status, .. } => status,
        _ => Status::Ok,
    }
}

/// An EEPROM that does not answer, and one in which neither copy of the page with the number is right, bit by bit.
#[test]
fn a_node_without_a_number_says_nothing() {
    let eeprom = saved();
    let silent = Rig::on(&board(&eeprom, false), false);
    let flipped = (0..512).step_by(7).map(|bit| Rig::with_eeprom(&flipped(&eeprom, 0, bit, &[0, 1]), 1));
    for mut rig in [silent].into_iter().chain(flipped) {
        assert_silent(&mut rig);
        assert!(matches!(usb(&mut rig, 136, 0), Reply::Version(_)));
        assert_eq!(status(usb(&mut rig, 1, 0)), Status::NotAvailable);
        assert_eq!(status(usb(&mut rig, 137, 1233)), Status::NotAvailable);
        assert_silent(&mut rig);
    }
}

/// A blank EEPROM, one of the TMCL firmware, and another one that this node cannot read are those of node 1.
#[test]
fn other_contents_are_those_of_node_1() {
    let mut module = NativeModule::new(&WorldConfig::default(), None, 1);
    let telegram = tmcm::tmcl::binary::encode_command(1, tmcm::tmcl::text::parse("137, 0, 0, 1234").unwrap());
    module.receive(Source::Usb, telegram);
    module.run_until(500 * MILLISECOND);
    let of_tmcl = module.board_mut().at25().contents().to_vec();
    let noise: Vec<u8> = (0..16_384_u32).map(|n| (n.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let mut both = saved();
    // Pages of this node, of which the TMCL firmware has taken the first over.
    both[16_384 - 2_048..][..128].copy_from_slice(&of_tmcl[16_384 - 2_048..][..128]);
    assert_ne!(of_tmcl, [0xFF; 16_384]);
    for eeprom in [vec![0xFF; 16_384], of_tmcl, noise, both] {
        let mut rig = Rig::with_eeprom(&eeprom, 1);
        rig.wait(3);
        assert_eq!(rig.node.address(), Some(Address::DEFAULT));
        assert_eq!((rig.drive_state(), rig.frames()[0].clone()), (SWITCH_ON_DISABLED, (0x701, vec![0])));
        assert_eq!(rig.read(0x2003, 0), 128);
    }
}

/// 137 with 1234 over USB starts node 1 at 1 Mbit/s, with defaults, without a fault. Where the EEPROM can be written
/// they are stored.
#[test]
fn it_is_told_that_it_may_be_node_1() {
    let eeprom = saved();
    for (mut rig, stored) in [
        (Rig::on(&board(&eeprom, false), false), false),
        (Rig::with_eeprom(&flipped(&eeprom, 0, 99, &[0, 1]), 1), true),
    ] {
        rig.wait(100);
        assert_eq!(status(usb(&mut rig, 137, 1234)), Status::Ok);
        rig.wait(150);
        assert_eq!(rig.frames(), [(0x701, vec![0])]);
        assert_eq!((rig.node.address(), leds(&rig)[1]), (Some(Address::DEFAULT), false));
        assert_eq!((rig.drive_state(), rig.read(0x2003, 0), rig.read(0x603F, 0)), (SWITCH_ON_DISABLED, 128, 0));
        rig.enable();
        // It has a number now.
        assert_eq!(status(usb(&mut rig, 137, 1234)), Status::NotAvailable);
        rig.control("fault eeprom off");
        rig.power_cycle();
        let expected = if stored { Address::DEFAULT } else { NINE };
        assert_eq!((rig.node.address(), rig.report.worn), (Some(expected), false));
    }
}

/// The EEPROM is asked again each second. When it answers the node starts as after power-on.
#[test]
fn an_eeprom_that_answers_again() {
    let mut rig = Rig::on(&board(&saved(), false), false);
    rig.wait(2_500);
    assert_eq!((rig.starts, rig.frames()), (1, vec![]));
    rig.control("fault eeprom off");
    rig.wait(1_100);
    let frames = rig.frames();
    assert_eq!((rig.starts, rig.node.address(), frames.first()), (2, Some(NINE), Some(&(0x709, vec![0]))));
    for (index, sub, value) in SAVED {
        assert_eq!(rig.read(index, sub), value, "{index:04X}h:{sub}");
    }
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// A restart whose EEPROM has gone silent: the number is kept, the settings are unknown, and that is told. A master
/// that downloads all objects gets on, and one that resets faults does not. Without the supply the number is gone.
#[test]
fn a_restart_keeps_the_number() {
    let mut rig = Rig::on(&board(&saved(), true), false);
    rig.wait(5);
    rig.frames();
    rig.control("fault eeprom on");
    rig.send(0, &[0x81, 9]);
    rig.wait(20);
    assert_eq!((rig.starts, rig.node.address()), (2, Some(NINE)));
    assert_eq!(rig.frames(), [(0x709, vec![0]), (0x89, SILENT.to_vec())]);
    rig.word(FAULT_RESET);
    rig.word(0);
    assert_eq!((rig.drive_state(), rig.read(0x603F, 0), rig.read(0x1001, 0)), (FAULT, 0x5530, 0x81));
    assert_eq!(rig.sign(0x1010, 1, b"save"), Err(0x0606_0000));
    assert_eq!(rig.drive_state(), FAULT);
    rig.power_cycle();
    rig.wait(100);
    assert_eq!((rig.node.address(), rig.frames()), (None, vec![]));
}

/// An EEPROM that is busy at power-on, as after a write that a restart has cut off. Up to 20 ms are waited for, and
/// what takes longer is asked for again.
#[test]
fn an_eeprom_that_is_busy_at_power_on() {
    for (busy, starts) in [(5, 1), (15, 1), (200, 2), (2_000, 2)] {
        let shared = board(&saved(), true);
        shared.borrow_mut().at25_mut().keep_busy(busy * MILLISECOND);
        let mut rig = Rig::on(&shared, false);
        let mut silence = 0;
        while rig.node.address().is_none() {
            assert_eq!(rig.frames(), []);
            rig.wait(10);
            silence += 10;
            assert!(silence <= busy + 1_020, "busy for {busy} ms");
        }
        rig.wait(2);
        assert_eq!((rig.starts, rig.node.address(), rig.frames()), (starts, Some(NINE), vec![(0x709, vec![0])]));
    }
}

/// An EEPROM that falls silent at any byte while it is read at the start, for good or for a while: its bytes read as
/// erased ones then. The node has its own number, or none, and never another one.
#[test]
fn an_eeprom_that_falls_silent_while_it_is_read() {
    let eeprom = saved();
    let mut seen = [0, 0];
    for lasts in [1, 10, 100, 1_000, u64::MAX] {
        for byte in (0..2_000).step_by(3) {
            let shared = board(&eeprom, true);
            shared.borrow_mut().at25_mut().fall_silent(byte, lasts);
            let mut rig = Rig::on(&shared, false);
            rig.wait(3);
            let address = rig.node.address();
            assert!(address.is_none_or(|address| address == NINE), "silent from {byte}, for {lasts}: {address:?}");
            seen[usize::from(address.is_some())] += 1;
            assert!(rig.frames().iter().all(|(id, _)| id & 0x7F == 9), "silent from {byte}, for {lasts}");
        }
    }
    assert!(seen.iter().all(|times| *times > 100), "{seen:?}");
}

/// Two nodes of one number on a bus, which a master cannot tell apart. Each answers, and neither takes the other's
/// boot-up, replies, PDOs, heartbeats and emergencies for something that is meant for it.
#[test]
fn two_nodes_of_one_number() {
    let mut nodes = [Rig::operational(), Rig::operational()];
    for rig in &mut nodes {
        rig.set(0x1016, 1, 0x0001_0064);
        rig.set(0x1017, 0, 20);
        rig.set(0x2005, 0, 3);
        rig.enable();
        rig.frames();
    }
    for round in 0..50 {
        for (from, to) in [(0, 1), (1, 0)] {
            if round % 5 == 0 {
                nodes[from].send(0x601, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
                nodes[from].send(0x80, &[]);
                nodes[from].send(0x201, &[0x0F]);
            }
            for (id, data) in nodes[from].frames() {
                nodes[to].send(id, &data);
            }
            nodes[from].wait(10);
        }
    }
    for rig in &mut nodes {
        rig.frames();
        assert_eq!(
            (rig.node.address(), rig.drive_state()),
            (Some(Address::DEFAULT), crate::driving::OPERATION_ENABLED)
        );
    }
}
