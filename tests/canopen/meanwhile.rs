//! Events that come while something else is under way: neither is lost.

use crate::driving::{
    ENABLE, FAULT, FAULT_RESET, HM, OPERATION_ENABLED, PV, SHUTDOWN, START, SWITCH_ON, SWITCH_ON_DISABLED,
};
use crate::rig::Rig;
use tmcm::canopen::{BusState, Nmt};

/// Leads a node to FAULT by a supply that is too low for a while, and to the state of network management in which its
/// master had it.
fn fault(rig: &mut Rig) {
    rig.control("supply 7");
    rig.wait(60);
    rig.control("supply 24");
    rig.wait(20);
    assert_eq!(rig.emergencies(), [(0xFF00, [0, 0])]);
    rig.command(1);
    rig.frames();
    assert_eq!(rig.drive_state(), FAULT);
}

/// A second fault is told, and the state stays FAULT. The status changes no more. The reaction of 1029h does not come
/// again, because the master has taken it back with its start of the node.
#[test]
fn a_second_fault_in_fault() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x60FF, 0, 500);
    rig.set(0x1029, 2, 0);
    rig.wait(100);
    rig.frames();
    fault(&mut rig);
    rig.control("fault overtemperature on");
    rig.wait(60);
    let frames = rig.frames();
    let told: Vec<_> = frames.iter().filter(|(id, _)| *id == 0x81).map(|(_, data)| [data[0], data[1]]).collect();
    // The warning of the driver and its overtemperature have the same code.
    assert_eq!(told, [[0x10, 0x43]; 2]);
    let states: Vec<_> = frames.iter().filter(|(id, _)| *id == 0x181).map(|(_, data)| data[0] & 0x6F).collect();
    assert!(states.iter().all(|state| u32::from(*state) == FAULT), "{states:02X?}");
    assert_eq!((rig.drive_state(), rig.node.state()), (FAULT, Nmt::Operational));
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), FAULT, "the second cause is there");
    rig.control("fault overtemperature off");
    rig.wait(60);
    rig.word(0);
    rig.word(FAULT_RESET);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// A fault is not reset by a frame that was on its way when the controller went off the bus.
#[test]
fn a_fault_reset_while_off_the_bus() {
    let mut rig = Rig::enabled(PV);
    rig.set(0x1029, 1, 1);
    rig.set(0x1029, 2, 1);
    fault(&mut rig);
    let now = rig.now();
    rig.node.bus(now, BusState::Off);
    rig.wait(2);
    rig.send(0x201, &[FAULT_RESET as u8, 0]);
    rig.wait(2);
    let now = rig.now();
    rig.node.bus(now, BusState::Active);
    rig.wait(2);
    assert_eq!((rig.drive_state(), rig.emergencies()), (FAULT, vec![(0x8140, [0, 255])]));
    rig.send(0x201, &[0, 0]);
    rig.send(0x201, &[FAULT_RESET as u8, 0]);
    rig.wait(2);
    assert_eq!(rig.drive_state(), SWITCH_ON_DISABLED);
}

/// A reset of communication ends the transfer that was under way, as a reset of the node does.
#[test]
fn a_reset_of_communication_in_a_transfer() {
    let mut rig = Rig::new();
    rig.request([0x40, 0x08, 0x10, 0, 0, 0, 0, 0]);
    rig.command(0x82);
    rig.wait(50);
    // The abort: toggle or command, of a transfer that there is not.
    assert_eq!(rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x80, 0, 0, 0, 1, 0, 4, 5]);
    let announced = [0x21, 0x23, 0x10, 1, 7, 0, 0, 0];
    rig.request(announced);
    rig.command(0x82);
    rig.wait(50);
    assert_eq!(rig.request([0x00, 1, 2, 3, 4, 5, 6, 7]), [0x80, 0, 0, 0, 1, 0, 4, 5]);
}

/// TMCL mode that begins while the delays of the brake run, 200Ah and 2002h.2: they run anew, the brake is released at
/// their end, and the motor moves.
#[test]
fn tmcl_mode_while_the_delays_of_the_brake_run() {
    let brake = |rig: &Rig| rig.board.borrow().world().outputs().is_on(0);
    // Within the first delay, within the second one.
    for (after, released) in [(20, false), (65, true)] {
        let mut rig = Rig::operational();
        for (index, sub, value) in [(0x200C, 2, 255), (0x200A, 0, 50), (0x2002, 2, 30)] {
            rig.set(index, sub, value);
        }
        for word in [SHUTDOWN, SWITCH_ON, ENABLE] {
            rig.word(word);
        }
        rig.wait(after);
        assert_eq!((brake(&rig), rig.is_energised()), (released, true), "after {after} ms");
        assert_eq!(rig.sign(0x2700, 0, b"make"), Ok(()));
        assert_eq!((rig.drive_state(), rig.is_energised()), (SWITCH_ON_DISABLED, true));
        rig.wait(100);
        assert!(brake(&rig), "after {after} ms");
        // ROR 0, 500 by the executor: 1023h.1, and 1 for success in its status.
        let reply = rig.request([0x21, 0x23, 0x10, 1, 7, 0, 0, 0]);
        assert_eq!(reply[0], 0x60);
        rig.request([0x01, 1, 0, 0, 0, 0, 0x01, 0xF4]);
        assert_eq!(rig.read(0x1023, 2), 1);
        rig.wait(300);
        assert!(rig.rotor() > 500 && rig.is_energised(), "{}", rig.rotor());
    }
}

/// Another mode while the motor homes: it stops along the ramp of the homing, and what the new mode asks for begins
/// only when it stands.
#[test]
fn another_mode_in_a_homing() {
    let mut rig = Rig::operational();
    for (index, sub, value) in [(0x2005, 0, 0), (0x6098, 0, 17), (0x6099, 1, 1000), (0x609A, 0, 1500), (0x60FF, 0, 700)]
    {
        rig.set(index, sub, value);
    }
    rig.set(0x6060, 0, HM);
    rig.enable();
    rig.word(START);
    rig.wait(100);
    let before = rig.speed();
    assert_eq!(before, -1000);
    rig.set(0x6060, 0, PV);
    let mut speeds = vec![before];
    while *speeds.last().unwrap() != 700 {
        rig.wait(1);
        speeds.push(rig.speed());
        assert!(speeds.len() < 1000, "{speeds:?}");
    }
    // 1500 changes the speed by 22.9 in a millisecond: no step is larger, and there is none in the other direction.
    assert!(speeds.windows(2).all(|pair| (0..=40).contains(&(pair[1] - pair[0]))), "{speeds:?}");
    assert!(speeds.contains(&0));
    assert_eq!(rig.drive_state(), OPERATION_ENABLED);
}
