//! Network management: states, commands, boot-up, what each state serves, and heartbeats.

use crate::rig::Rig;
use hal_sim::clock::MILLISECOND;
use tmcm::can::{CanFrame, ExtendedId, Frame};
use tmcm::canopen::{Nmt, Overflow};

/// Commands of the master.
const START: u8 = 0x01;
const STOP: u8 = 0x02;
const ENTER_PRE_OPERATIONAL: u8 = 0x80;
const RESET_NODE: u8 = 0x81;
const RESET_COMMUNICATION: u8 = 0x82;

/// A read of 1000h, expedited.
const READ: [u8; 8] = [0x40, 0x00, 0x10, 0, 0, 0, 0, 0];

#[test]
fn boot_up_is_the_first_frame_and_comes_once() {
    let mut rig = Rig::new();
    rig.wait(100);
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
    assert_eq!(rig.node.state(), Nmt::PreOperational);
    rig.power_cycle();
    rig.wait(100);
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
}

/// Whatever has become due before the boot-up message is taken.
#[test]
fn nothing_goes_before_the_boot_up() {
    let mut rig = Rig::new();
    rig.wait(5);
    rig.frames();
    let now = rig.now();
    for (id, data) in [(0, &[RESET_COMMUNICATION, 1][..]), (0x601, &READ), (0, &[START, 1])] {
        rig.node.receive(now, &Frame::standard(id, data).unwrap());
    }
    rig.node.lost(now, Overflow::Receive);
    rig.send_remote(0x701, 1);
    let ids: Vec<_> = rig.frames().iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0x701, 0x81, 0x181, 0x281, 0x581]);
}

/// Each command leads from each state to its own, for the node and for all nodes; those to others do nothing.
#[test]
fn commands_lead_from_each_state() {
    let commands = [(START, Nmt::Operational), (STOP, Nmt::Stopped), (ENTER_PRE_OPERATIONAL, Nmt::PreOperational)];
    let mut rig = Rig::new();
    for (from, before) in commands {
        for (to, after) in commands {
            for node in [0, 1] {
                rig.send(0, &[from, 1]);
                assert_eq!(rig.node.state(), before);
                rig.send(0, &[to, 2]);
                rig.send(0, &[to, 127]);
                assert_eq!(rig.node.state(), before);
                rig.send(0, &[to, node]);
                assert_eq!(rig.node.state(), after);
            }
        }
    }
    // What is no command.
    for data in [
        &[][..],
        &[STOP],
        &[STOP, 1, 0],
        &[STOP, 0, 0, 0, 0, 0, 0, 0],
        &[3, 1],
        &[0, 0],
        &[0x7F, 1],
        &[0x83, 1],
        &[0xFF, 0],
    ] {
        rig.send(0, &[START, 0]);
        rig.send(0, data);
        assert_eq!(rig.node.state(), Nmt::Operational, "{data:02X?}");
    }
    rig.send_remote(0, 2);
    let extended = Frame::new(ExtendedId::new(0).unwrap(), &[STOP, 1]).unwrap();
    rig.give(&extended);
    assert_eq!(rig.node.state(), Nmt::Operational);
}

#[test]
fn each_state_serves_what_it_may() {
    let mut rig = Rig::new();
    for (command, sdo, pdo) in [(START, true, true), (STOP, false, false), (ENTER_PRE_OPERATIONAL, true, false)] {
        rig.command(command);
        rig.wait(5);
        rig.frames();
        rig.send(0x601, &READ);
        rig.send(0x80, &[]);
        rig.wait(5);
        let frames = rig.frames();
        assert_eq!(frames.iter().any(|(id, _)| *id == 0x581), sdo, "{command:02X}h");
        assert_eq!(frames.iter().any(|(id, _)| *id == 0x381), pdo, "{command:02X}h");
        rig.send(0x201, &[0x0F + command, 0]);
        rig.command(ENTER_PRE_OPERATIONAL);
        assert_eq!(rig.read(0x6040, 0) == u32::from(0x0F + command), pdo, "{command:02X}h");
    }
}

/// A stopped node forgets the transfer that was under way.
#[test]
fn stopping_ends_a_transfer() {
    let mut rig = Rig::new();
    rig.request([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    rig.command(STOP);
    rig.command(ENTER_PRE_OPERATIONAL);
    assert_eq!(rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x80, 0, 0, 0, 1, 0, 4, 5]);
}

/// A reset of communication brings back what was saved, or the defaults, of the objects below 2000h, and leaves the
/// others; a reset of the node starts the firmware anew.
#[test]
fn resets() {
    let mut rig = Rig::new();
    rig.set(0x100C, 0, 50);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    for (reset, kept) in [(RESET_COMMUNICATION, 77), (RESET_NODE, 128)] {
        rig.set(0x100C, 0, 60);
        rig.set(0x1800, 5, 10);
        rig.set(0x2003, 0, 77);
        assert_eq!(rig.download(0x2701, 0, b"make"), Ok(()));
        rig.command(START);
        rig.frames();
        let starts = rig.starts;
        rig.send(0, &[reset, 0]);
        rig.wait(50);
        assert_eq!(rig.frames(), [(0x701, vec![0])], "{reset:02X}h");
        assert_eq!(rig.node.state(), Nmt::PreOperational);
        let read = [(0x100C, 0), (0x1800, 5), (0x2003, 0), (0x2701, 0)].map(|(index, sub)| rig.read(index, sub));
        assert_eq!(read, [50, 0, kept, 0], "{reset:02X}h");
        assert_eq!(rig.starts - starts, u32::from(reset == RESET_NODE));
    }
}

/// Requests that come after a reset of the node are not served any more.
#[test]
fn nothing_is_served_between_a_reset_and_the_start() {
    let mut rig = Rig::new();
    rig.wait(5);
    rig.frames();
    rig.command(RESET_NODE);
    rig.send(0x601, &READ);
    rig.send(0, &[START, 0]);
    rig.wait(20);
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
}

/// The first heartbeat comes with the next turn, and then one each period, with the state in it.
#[test]
fn heartbeats() {
    let mut rig = Rig::new();
    rig.wait(5);
    rig.frames();
    rig.set(0x1017, 0, 20);
    rig.frames();
    for (command, state) in [(ENTER_PRE_OPERATIONAL, 0x7F), (START, 5), (STOP, 4)] {
        rig.command(command);
        rig.of(0x701);
        rig.wait(200);
        assert_eq!(rig.of(0x701), vec![vec![state]; 10], "{command:02X}h");
    }
    rig.command(ENTER_PRE_OPERATIONAL);
    rig.set(0x1017, 0, 0);
    rig.of(0x701);
    rig.wait(200);
    assert!(rig.of(0x701).is_empty());
    rig.set(0x1017, 0, 1);
    rig.frames();
    rig.run(50 * MILLISECOND);
    assert_eq!(rig.of(0x701).len(), 50);
}

/// A heartbeat that is saved begins after the boot-up, which counts as the first.
#[test]
fn a_saved_heartbeat_begins_with_the_boot_up() {
    let mut rig = Rig::new();
    rig.set(0x1017, 0, 30);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    rig.power_cycle();
    rig.wait(20);
    assert_eq!(rig.of(0x701), [[0]]);
    rig.wait(20);
    assert_eq!(rig.of(0x701), [[0x7F]]);
    rig.command(RESET_COMMUNICATION);
    rig.wait(29);
    assert_eq!(rig.of(0x701), [[0]]);
    rig.wait(2);
    assert_eq!(rig.of(0x701), [[0x7F]]);
}

/// The frames that the node wants are those it serves.
#[test]
fn filters() {
    let ids = |rig: &mut Rig| {
        let filters = rig.node.filters()?;
        Some(filters.iter().map(|filter| (filter.id, filter.remote)).collect::<Vec<_>>())
    };
    let mut rig = Rig::new();
    let fixed = [(0, false), (0x80, false), (0x601, false)];
    let pdos = [0x201, 0x301, 0x401, 0x501].map(|id| (id, false));
    let guarding = [(0x701, true)];
    assert_eq!(ids(&mut rig), Some([&fixed[..], &pdos, &guarding].concat()));
    assert_eq!(ids(&mut rig), None);
    rig.set(0x1016, 1, 0x0005_0064);
    assert_eq!(ids(&mut rig), Some([&fixed[..], &pdos, &[(0x705, false)], &guarding].concat()));
    rig.set(0x1005, 0, 0x90);
    let fixed = [(0, false), (0x90, false), (0x601, false)];
    assert_eq!(ids(&mut rig), Some([&fixed[..], &pdos, &[(0x705, false)], &guarding].concat()));
    rig.set(0x1401, 1, 0x8000_0301);
    let pdos = [0x201, 0x401, 0x501].map(|id| (id, false));
    assert_eq!(ids(&mut rig), Some([&fixed[..], &pdos, &[(0x705, false)], &guarding].concat()));
    rig.set(0x1017, 0, 5);
    assert_eq!(ids(&mut rig), None);
}
