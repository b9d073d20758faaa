//! Emergency messages: their codes and bytes against the list, COB-ID, inhibit time, and the error register.

use crate::driving::PV;
use crate::rig::Rig;
use hal_sim::clock::MICROSECOND;
use tmcm::canopen::{BusState, Emergency, Overflow};

/// The list: code, two bytes of the manufacturer's field, bits of the error register.
const LIST: [(u16, [u8; 2], &[u8]); 30] = [
    (0x0000, [0, 0], &[]),
    (0x1000, [1, 0], &[0]),
    (0x1000, [2, 0], &[0]),
    (0x2310, [0, 0], &[0, 1]),
    (0x2311, [0, 0], &[0, 1]),
    (0x2312, [0, 0], &[0, 1]),
    (0x3230, [0, 0], &[0, 5]),
    (0x4310, [1, 0], &[0, 3]),
    (0x4310, [2, 0], &[0, 3]),
    (0x5000, [0, 255], &[0, 7]),
    (0x5441, [0, 255], &[0, 5]),
    (0x5530, [0, 255], &[0, 7]),
    (0x6310, [0, 255], &[0, 5]),
    (0x6310, [1, 255], &[0, 5]),
    (0x6320, [0, 255], &[0, 5]),
    (0x8100, [0, 255], &[0, 4]),
    (0x8110, [1, 255], &[0, 4]),
    (0x8110, [2, 255], &[0, 4]),
    (0x8110, [3, 255], &[0, 4]),
    (0x8120, [0, 255], &[0, 4]),
    (0x8130, [0, 255], &[0, 4]),
    (0x8140, [0, 255], &[0, 4]),
    (0x8210, [0, 255], &[0, 4]),
    (0x8220, [0, 255], &[0, 4]),
    (0x8611, [0, 0], &[0, 5]),
    (0xFF00, [0, 0], &[0, 2]),
    (0xFF01, [1, 0], &[0, 7]),
    (0xFF01, [2, 0], &[0, 7]),
    (0xFF01, [3, 0], &[0, 7]),
    (0xFF01, [4, 0], &[0, 7]),
];

#[test]
fn codes_and_bytes_are_those_of_the_list() {
    assert_eq!(Emergency::ALL.len(), LIST.len());
    for (emergency, (code, bytes, bits)) in Emergency::ALL.iter().zip(LIST) {
        let register = bits.iter().fold(0, |all, bit| all | 1 << bit);
        let (found, field, set, meaning) = emergency.data();
        assert_eq!((found, field, set), (code, bytes, register), "{meaning}");
    }
}

#[test]
fn lost_frames_are_told() {
    let mut rig = Rig::operational();
    for (place, byte) in [(Overflow::Controller, 1), (Overflow::Transmit, 2), (Overflow::Receive, 3)] {
        let now = rig.now();
        rig.node.lost(now, place);
        rig.wait(1);
        assert_eq!(rig.of(0x81), [[0x10, 0x81, 0x11, byte, 255, 0, 0, 0]]);
    }
}

/// Errors of several kinds add up in the register, which is in each message.
#[test]
fn the_register_keeps_all_errors() {
    let mut rig = Rig::operational();
    rig.send(0x201, &[0]);
    rig.send(0x301, &[0, 0, 4]);
    rig.send(0x201, &[0]);
    let messages: Vec<_> = rig.of(0x81).iter().map(|data| data[2]).collect();
    assert_eq!((messages, rig.read(0x1001, 0)), (vec![0x11, 0x31, 0x31], 0x31));
    rig.command(0x82);
    assert_eq!(rig.read(0x1001, 0), 0);
}

#[test]
fn the_cob_id_of_emergencies() {
    let mut rig = Rig::operational();
    rig.set(0x1014, 0, 0x8000_0081);
    rig.send(0x201, &[0]);
    rig.wait(5);
    assert!(rig.of(0x81).is_empty());
    assert_eq!(rig.read(0x1001, 0), 0x11);
    rig.set(0x1014, 0, 0x8000_00F5);
    rig.set(0x1014, 0, 0xF5);
    rig.frames();
    rig.send(0x201, &[0]);
    rig.wait(5);
    assert_eq!(rig.frames(), [(0xF5, vec![0x10, 0x82, 0x11, 0, 255, 0, 0, 0])]);
}

/// Within the inhibit time messages wait, oldest first; eight of them at most.
#[test]
fn the_inhibit_time_of_emergencies() {
    let mut rig = Rig::operational();
    rig.set(0x1015, 0, 100);
    for n in 0..12 {
        rig.send(0x201, if n % 2 == 0 { &[0] } else { &[0, 0, 0] });
    }
    let mut counts = Vec::new();
    for _ in 0..12 {
        counts.extend(rig.of(0x81).iter().map(|data| data[0]));
        rig.run(10_000 * MICROSECOND);
    }
    assert_eq!(counts, [0x10, 0x20, 0x10, 0x20, 0x10, 0x20, 0x10, 0x20, 0x10]);
    // Those that wait are dropped when emergencies are switched off.
    rig.send(0x201, &[0]);
    rig.send(0x201, &[0]);
    rig.set(0x1014, 0, 0x8000_0081);
    rig.frames();
    // And they do not come back when emergencies are switched on again within the inhibit time.
    rig.set(0x1014, 0, 0x81);
    rig.wait(100);
    assert!(rig.of(0x81).is_empty());
}

/// The boot-up message comes before the emergencies, and those before PDOs and replies.
#[test]
fn emergencies_go_first() {
    let mut rig = Rig::operational();
    let now = rig.now();
    rig.node.lost(now, Overflow::Controller);
    rig.send(0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    let ids: Vec<_> = rig.frames().iter().map(|(id, _)| *id).collect();
    assert_eq!(ids, [0x81, 0x581]);
}

/// A PDO that carries the error code goes out when that changes, whatever has changed it.
#[test]
fn the_error_code_in_a_pdo_is_sent_when_it_changes() {
    let mut rig = Rig::operational();
    rig.set(0x1800, 1, 0xC000_0181);
    rig.set(0x1A00, 0, 0);
    rig.set(0x1A00, 1, 0x603F_0010);
    rig.set(0x1A00, 0, 1);
    rig.set(0x1800, 1, 0x4000_0181);
    rig.wait(50);
    rig.frames();
    for (state, code) in [(BusState::Passive, 0x8120_u16), (BusState::Active, 0)] {
        let now = rig.now();
        rig.node.bus(now, state);
        rig.wait(3);
        assert_eq!(rig.of(0x181), [code.to_le_bytes()], "{state:?}");
    }
    let now = rig.now();
    rig.node.lost(now, Overflow::Receive);
    rig.wait(3);
    assert_eq!(rig.of(0x181), [0x8110_u16.to_le_bytes()]);
    rig.send(0x201, &[0]);
    rig.wait(3);
    assert_eq!(rig.of(0x181), [0x8210_u16.to_le_bytes()]);
}

/// An open coil that has been told is over when the motor moves without it: of a motor that stands nothing is known.
#[test]
fn an_open_coil_lasts_while_the_motor_stands() {
    let mut rig = Rig::enabled(PV);
    rig.control("fault open-a on");
    for _ in 0..3 {
        rig.set(0x60FF, 0, 500);
        rig.wait(300);
        rig.set(0x60FF, 0, 0);
        rig.wait(500);
    }
    assert_eq!(rig.of(0x81).len(), 1, "told once");
    assert_eq!((rig.read(0x1001, 0), rig.read(0x603F, 0)), (1, 0x1000));
    rig.control("fault open-a off");
    rig.wait(100);
    assert_eq!(rig.of(0x81).len(), 0);
    rig.set(0x60FF, 0, 500);
    rig.wait(100);
    assert_eq!(rig.of(0x81), [[0; 8]]);
    assert_eq!(rig.read(0x603F, 0), 0);
}
