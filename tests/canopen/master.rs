//! Losing the master: by its heartbeat, by its guarding, and by the bus.

use crate::rig::Rig;
use tmcm::can::{CanFrame, Frame, StandardId};
use tmcm::canopen::{BusState, Nmt};
use tmcm::device::Inputs;

/// The emergency of a lost master.
const LOST: [u8; 8] = [0x30, 0x81, 0x11, 0, 255, 0, 0, 0];

/// A way of watching the master: how it is set up, and what the master does each 20 ms.
type Watching = (fn(&mut Rig), fn(&mut Rig));

const WATCHINGS: [Watching; 2] = [
    (|rig| rig.set(0x1016, 1, 0x007F_0032), |rig| rig.send(0x77F, &[5])),
    (
        |rig| {
            rig.set(0x100C, 0, 25);
            rig.set(0x100D, 0, 2);
        },
        |rig| rig.send_remote(0x701, 1),
    ),
];

/// A node that has heard its master for a while.
fn watched((set_up, act): Watching) -> Rig {
    let mut rig = Rig::operational();
    set_up(&mut rig);
    rig.wait(500);
    assert_eq!((rig.of(0x81).len(), rig.node.state()), (0, Nmt::Operational), "the watch begins with the first sign");
    for _ in 0..20 {
        act(&mut rig);
        rig.wait(20);
    }
    assert_eq!((rig.of(0x81).len(), rig.node.state()), (0, Nmt::Operational));
    rig
}

#[test]
fn a_master_that_falls_silent() {
    for way in WATCHINGS {
        for (behaviour, state) in [(0, Nmt::Stopped), (1, Nmt::Operational), (2, Nmt::Stopped)] {
            let mut rig = watched(way);
            rig.set(0x1029, 1, behaviour);
            (way.1)(&mut rig);
            rig.frames();
            rig.wait(48);
            assert!(rig.of(0x81).is_empty());
            rig.wait(4);
            assert_eq!(rig.of(0x81), [LOST]);
            assert_eq!(rig.node.state(), state);
            // Told once; it begins anew with the next sign of the master.
            rig.wait(500);
            assert!(rig.of(0x81).is_empty());
            rig.command(0x80);
            assert_eq!(rig.read(0x1001, 0), 0x11);
            rig.command(1);
            (way.1)(&mut rig);
            rig.wait(100);
            assert_eq!(rig.of(0x81), [LOST]);
            assert_eq!(rig.node.state(), state);
            // A reset of communication forgets the error.
            rig.command(0x82);
            rig.wait(2);
            assert_eq!(rig.read(0x1001, 0), 0);
            assert!(rig.of(0x81).is_empty());
        }
    }
}

/// The NMT state changes in operation alone.
#[test]
fn a_master_that_falls_silent_before_operation() {
    for way in WATCHINGS {
        let mut rig = watched(way);
        rig.command(0x80);
        rig.wait(100);
        assert_eq!((rig.of(0x81), rig.node.state()), (vec![LOST.to_vec()], Nmt::PreOperational));
    }
    // None is told in the stopped state.
    let mut rig = watched(WATCHINGS[0]);
    rig.command(2);
    rig.wait(100);
    assert_eq!((rig.frames().len(), rig.node.state()), (0, Nmt::Stopped));
    rig.command(0x80);
    assert_eq!(rig.read(0x1001, 0), 0x11);
}

/// Heartbeats of others, and what is no heartbeat, are not those of the master; a time or a node of 0 switches the
/// watch off.
#[test]
fn heartbeats_of_others() {
    let mut rig = watched(WATCHINGS[0]);
    for _ in 0..5 {
        rig.send(0x77E, &[5]);
        rig.send(0x780, &[5]);
        rig.send_remote(0x77F, 1);
        rig.wait(10);
    }
    rig.wait(5);
    assert_eq!(rig.of(0x81), [LOST]);
    for off in [0, 0x007F_0000, 0x0000_0032, 0x0080_0032] {
        let mut rig = Rig::operational();
        rig.set(0x1016, 1, off);
        for id in 0x700..0x77F {
            rig.send(id, &[5]);
        }
        rig.wait(200);
        assert!(rig.of(0x81).is_empty(), "{off:08X}h");
    }
    rig.command(0x80);
    assert_eq!(rig.write(0x1016, 1, 0x017F_0032), Err(0x0609_0030));
    // A boot-up message of the master is no heartbeat: it does not begin the watch, and does not feed it.
    let mut rig = Rig::operational();
    rig.set(0x1016, 1, 0x007F_0032);
    rig.send(0x77F, &[0]);
    rig.wait(200);
    assert!(rig.of(0x81).is_empty());
    rig.send(0x77F, &[127]);
    rig.wait(40);
    rig.send(0x77F, &[0]);
    rig.wait(20);
    assert_eq!(rig.of(0x81), [LOST]);
    // A change of the time waits for the next heartbeat.
    let mut rig = watched(WATCHINGS[0]);
    rig.set(0x1016, 1, 0x007F_0005);
    rig.wait(100);
    assert!(rig.of(0x81).is_empty());
}

/// The answers to guarding have the state, and a bit that changes each time; a node with a heartbeat does not answer.
#[test]
fn guarding_is_answered() {
    let mut rig = Rig::new();
    rig.wait(5);
    rig.frames();
    let mut toggle = 0;
    for (command, state) in [(1, 5), (2, 4), (0x80, 0x7F), (0, 0x7F)] {
        rig.command(command);
        rig.frames();
        for length in [0, 1, 8] {
            rig.send_remote(0x701, length);
            assert_eq!(rig.frames(), [(0x701, vec![state | toggle])]);
            toggle ^= 0x80;
        }
    }
    for id in [0x700, 0x702, 0x601, 0x181] {
        rig.send_remote(id, 1);
    }
    rig.send(0x701, &[5]);
    assert!(rig.frames().is_empty());
    // The bit is 0 again after a reset of communication.
    rig.send_remote(0x701, 1);
    rig.command(0x82);
    rig.frames();
    rig.send_remote(0x701, 1);
    assert_eq!(rig.frames(), [(0x701, vec![0x7F])]);
    rig.set(0x1017, 0, 1000);
    rig.wait(5);
    rig.frames();
    rig.send_remote(0x701, 1);
    assert!(rig.frames().is_empty());
}

/// The state of the CAN controller: error passive is told once when it is entered, bus-off when it is over.
#[test]
fn the_bus_fails_and_recovers() {
    let passive = [0x20, 0x81, 0x11, 0, 255, 0, 0, 0];
    let recovered = [0x40, 0x81, 0x11, 0, 255, 0, 0, 0];
    let over = [0, 0, 0, 0, 0, 0, 0, 0];
    let mut rig = Rig::operational();
    rig.set(0x1029, 1, 1);
    let tell = |rig: &mut Rig, state| {
        for _ in 0..3 {
            let now = rig.now();
            rig.node.bus(now, state);
            rig.wait(2);
        }
        rig.of(0x81)
    };
    assert!(tell(&mut rig, BusState::Active).is_empty());
    assert_eq!(tell(&mut rig, BusState::Passive), [passive]);
    assert_eq!(tell(&mut rig, BusState::Active), [over]);
    assert_eq!(tell(&mut rig, BusState::Passive), [passive]);
    assert!(tell(&mut rig, BusState::Off).is_empty());
    assert_eq!(tell(&mut rig, BusState::Passive), [recovered]);
    assert!(tell(&mut rig, BusState::Off).is_empty());
    // The bits of what has recovered stay until a reset.
    assert_eq!(tell(&mut rig, BusState::Active), [recovered, [0, 0, 0x11, 0, 0, 0, 0, 0]]);
    assert_eq!((rig.read(0x1001, 0), rig.node.state()), (0x11, Nmt::Operational));
    rig.command(0x82);
    assert_eq!(rig.read(0x1001, 0), 0);
}

/// A reply that nobody can receive does not keep the node from the reset that it was told to do.
#[test]
fn a_reset_does_not_wait_for_replies_while_the_bus_is_off() {
    for (state, resets) in [(BusState::Off, true), (BusState::Active, false)] {
        let mut rig = Rig::operational();
        let now = rig.now();
        for (id, data) in [(0x601, &[0x40, 0, 0x10, 0, 0, 0, 0, 0][..]), (0, &[0x81, 1])] {
            rig.node.receive(now, &Frame::standard(id, data).unwrap());
        }
        rig.node.bus(now, state);
        let reset = (0..10).any(|_| rig.node.poll(rig.node.deadline(), &Inputs::default()).restart);
        assert_eq!(reset, resets, "{state:?}");
    }
}

/// Of two questions before the answer one is answered, and the toggle bit changes from answer to answer.
#[test]
fn the_toggle_bit_changes_with_each_answer() {
    let mut rig = Rig::operational();
    rig.frames();
    let (now, question) = (rig.now(), Frame::new_remote(StandardId::new(0x701).unwrap(), 1).unwrap());
    rig.node.receive(now, &question);
    rig.send_remote(0x701, 1);
    rig.send_remote(0x701, 1);
    assert_eq!(rig.of(0x701), [[5], [0x85]]);
}
