//! Faults on the bus, around and inside the microcontroller, with the flash image of the CANopen firmware. Whatever
//! goes wrong, no motor runs on without a firmware that watches it, and the master is told.

use common::image_host::{HANG, START, assert_logged, code, symbol_in};
use common::node_host::{ENABLE, NodeHost, PV, image};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use hal_sim::fault::Fault;
use hal_sim::mcu::CanBus;
use hal_sim::world::pin::Pin;

/// Bits of the statusword that tell the state, and two states.
const STATE: u32 = 0x4F;
const FAULT: u32 = 0x08;
const SWITCH_ON_DISABLED: u32 = 0x40;

/// Has the drive leave FAULT and turn the motor again.
fn turns_again(rig: &mut NodeHost) {
    rig.set(0x6040, 0, 0);
    rig.enable(PV);
    rig.set(0x60FF, 0, 500);
    rig.run(300 * MILLISECOND);
    assert_eq!((rig.host.speed(), rig.host.bridges_on()), (500, true));
}

// ---- The bus ----

#[test]
fn bus_off_stops_the_motor_at_once_and_is_told_when_it_is_over() {
    let mut rig = NodeHost::moving();
    // A request has arrived; the reply meets shorted wires, and is not sent later.
    rig.send(0x601, &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
    rig.run(130 * MICROSECOND);
    rig.host.machine.can().set_bus(CanBus { shorted: true, ..CanBus::default() });
    // The controller makes 32 attempts of 21 us.
    let took = rig.host.wait(100 * MICROSECOND, SECOND, |host| host.speed() < 500);
    assert!(took < 4 * MILLISECOND, "{took}");
    let took = rig.host.wait(MILLISECOND, SECOND, |host| host.speed() == 0 && !host.bridges_on());
    assert!(took < 100 * MILLISECOND, "{took}");
    // It joins the bus again and again, and is thrown off it with its first frame.
    rig.run(500 * MILLISECOND);
    rig.host.assert_rest();
    assert_eq!(rig.frames(), []);
    rig.host.machine.can().set_bus(CanBus::default());
    rig.run(10 * MILLISECOND);
    let said = rig.frames();
    let told = vec![0x40, 0x81, 0x11, 0, 255, 0, 0, 0];
    assert!(said.contains(&(0x81, told)) && !said.iter().any(|(id, _)| *id == 0x581), "{said:X?}");
    assert_eq!((rig.status() & STATE, rig.host.machine.counters().starts), (FAULT, 1));
    turns_again(&mut rig);
}

/// Alone on the bus the controller becomes error passive; that is told as soon as somebody hears it, and the motor goes
/// on.
#[test]
fn error_passive_is_told_before_all_else_that_waits() {
    let mut rig = NodeHost::moving();
    rig.host.machine.can().set_bus(CanBus { inhabited: false, ..CanBus::default() });
    rig.run(200 * MILLISECOND);
    assert_eq!((rig.frames(), rig.host.speed()), (vec![], 500));
    rig.host.machine.can().set_bus(CanBus::default());
    rig.run(5 * MILLISECOND);
    let said = rig.frames();
    let place = said.iter().position(|(id, data)| *id == 0x81 && data[..2] == [0x20, 0x81]);
    // A heartbeat may be on the bus already.
    assert!(place.is_some_and(|place| place <= 1), "{said:X?}");
    rig.run(50 * MILLISECOND);
    assert_eq!(rig.host.speed(), 500);
    rig.run(0);
    assert_eq!(rig.emergencies(), []);
}

/// A node whose four TPDOs go with each SYNC, in operational state.
fn synchronous() -> NodeHost {
    let mut rig = NodeHost::new("");
    for nth in 0..4 {
        let id = 0x4000_0181 + 0x100 * u32::from(nth);
        rig.set(0x1800 + nth, 1, 1 << 31 | id);
        rig.set(0x1800 + nth, 2, 1);
        rig.set(0x1800 + nth, 1, id);
    }
    rig.set(0x1400, 1, 0xC000_0201);
    rig.set(0x1400, 2, 0);
    rig.set(0x1400, 1, 0x4000_0201);
    rig.command(1);
    rig.run(2 * MILLISECOND);
    rig.frames();
    rig
}

/// Has the master send frames, one after the other, while the owner of the node is busy with something else.
fn while_busy(rig: &mut NodeHost, frames: &[(u32, &[u8])]) {
    let place = code(symbol_in(image(), "TIM3"));
    let before = rig.host.machine.cpu_mut().program(place, &HANG).unwrap();
    rig.host.wait(MICROSECOND, 2 * MILLISECOND, |host| host.machine.cpu().pc() == place);
    frames.iter().for_each(|(id, data)| rig.send(*id, data));
    rig.run(MILLISECOND);
    rig.host.machine.cpu_mut().program(place, &before).unwrap();
    rig.run(2 * MILLISECOND);
}

/// The controller has three mailboxes; the fourth PDO gets the first one that is free.
#[test]
fn four_pdos_follow_a_sync_without_a_gap() {
    let mut rig = synchronous();
    rig.send(0x80, &[]);
    rig.run(MILLISECOND);
    let said = rig.timed();
    assert_eq!(said.iter().map(|(_, id, _)| *id).collect::<Vec<_>>(), [0x181, 0x281, 0x381, 0x481]);
    for pair in said.windows(2) {
        let wire = (47 + 8 * pair[1].2.len() as u64) * MICROSECOND;
        let gap = pair[1].0 - pair[0].0 - wire;
        assert!(gap <= 3 * MICROSECOND, "{gap}");
    }
}

/// A receive queue holds three frames.
#[test]
fn frames_that_find_no_room_are_told_and_push_no_sync_out() {
    let mut rig = synchronous();
    while_busy(&mut rig, &[(0x201, &[6, 0]), (0x80, &[]), (0x201, &[6, 0]), (0x201, &[6, 0])]);
    let said = rig.timed().iter().map(|(_, id, _)| *id).collect::<Vec<_>>();
    assert_eq!(said, [0x181, 0x281, 0x381, 0x481]);
    while_busy(&mut rig, &[(0x80, &[]), (0x201, &[6, 0]), (0x201, &[6, 0]), (0x201, &[6, 0]), (0x201, &[6, 0])]);
    let said = rig.frames();
    assert!(said.contains(&(0x81, vec![0x10, 0x81, 0x11, 1, 255, 0, 0, 0])), "{said:X?}");
    assert_eq!(said.iter().filter(|(id, _)| *id == 0x181).count(), 1);
    assert_eq!((rig.read(0x1001, 0), rig.host.machine.counters().starts), (0x11, 1));
}

/// Frames that come while the node is busy act in the order in which they came, though SYNC has a queue of its own.
#[test]
fn a_pdo_acts_with_the_sync_after_it() {
    let mut rig = synchronous();
    while_busy(&mut rig, &[(0x201, &[6, 0]), (0x80, &[])]);
    assert_eq!(rig.read(0x6040, 0), 6);
    while_busy(&mut rig, &[(0x80, &[]), (0x201, &[7, 0])]);
    assert_eq!(rig.read(0x6040, 0), 6);
    rig.send(0x80, &[]);
    rig.run(2 * MILLISECOND);
    assert_eq!(rig.read(0x6040, 0), 7);
}

/// All mailboxes hold PDOs that lose against the traffic of others; an emergency message, which would win, does not
/// wait behind them.
#[test]
fn an_emergency_message_does_not_wait_behind_pdos() {
    let mut rig = synchronous();
    rig.send(0x80, &[]);
    (0..100).for_each(|_| rig.send(0x100, &[0; 8]));
    let start = rig.host.machine.now();
    rig.host.machine.board().change_world(|world| world.set_supply(8.0));
    rig.run(20 * MILLISECOND);
    let said = rig.timed();
    assert_eq!(said.iter().map(|(_, id, _)| *id).collect::<Vec<_>>(), [0x81, 0x181, 0x281, 0x381, 0x481]);
    assert_eq!(said[0].2[..2], [0x00, 0xFF], "under-voltage");
    // A frame of others takes 111 us.
    let (told, rest) = (said[0].0 - start, said[1].0 - start);
    assert!(told < 8 * MILLISECOND && rest > 100 * 111 * MICROSECOND, "{told}, {rest}");
}

/// Whatever else waits, and with a lower identifier.
#[test]
fn the_boot_up_message_is_the_first() {
    let mut rig = NodeHost::just_on("", None);
    rig.host.machine.can().set_bus(CanBus { inhabited: false, ..CanBus::default() });
    rig.run(START);
    rig.host.machine.can().set_bus(CanBus::default());
    rig.run(5 * MILLISECOND);
    let said = rig.frames();
    assert_eq!(said.iter().map(|(id, _)| *id).collect::<Vec<_>>(), [0x701, 0x81, 0x81], "{said:X?}");
    assert_eq!(said[1..].iter().map(|(_, data)| data[1]).collect::<Vec<_>>(), [0x81, 0], "error passive, and its end");
}

/// Emergency messages all have the same identifier. The third one gets the mailbox of a heartbeat, the lowest in
/// number, which the controller would empty before the others.
#[test]
fn emergency_messages_keep_their_order() {
    let mut rig = NodeHost::moving();
    rig.host.machine.can().set_bus(CanBus { inhabited: false, ..CanBus::default() });
    rig.run(50 * MILLISECOND);
    rig.host.machine.board().change_world(|world| world.axis_mut(0).press(Pin::Right, true));
    rig.run(20 * MILLISECOND);
    rig.host.machine.board().change_world(|world| world.set_supply(8.0));
    rig.run(20 * MILLISECOND);
    rig.host.machine.can().set_bus(CanBus::default());
    rig.run(5 * MILLISECOND);
    let codes: Vec<_> = rig.emergencies().into_iter().map(|(code, ..)| code).collect();
    // The last one tells that the node is error passive no more.
    assert_eq!(codes, [0x8120, 0xFF01, 0xFF00, 0]);
}

/// 300 frames, one behind the other, to a node whose motor turns: each is read before the queue is full.
#[test]
fn a_burst_of_frames_loses_none() {
    let mut rig = NodeHost::moving();
    rig.command(1);
    rig.run(2 * MILLISECOND);
    rig.frames();
    for n in 0..100 {
        rig.send(0x401, &[15, 0, n, 0, 0, 0]);
        rig.send(0x80, &[]);
        rig.send(0x301, &[15, 0, 3]);
    }
    rig.run(40 * MILLISECOND);
    let said = rig.frames();
    assert!(!said.iter().any(|(id, _)| *id == 0x81), "{said:X?}");
    assert_eq!((rig.host.machine.waiting().can, rig.read(0x607A, 0), rig.host.speed()), (0, 99, 500));
}

// ---- Restarts ----

/// NMT reset node with a turning motor: it is stopped first, before the node boots up.
#[test]
fn a_reset_by_the_master_stops_the_motor() {
    let mut rig = NodeHost::moving();
    rig.host.machine.wiring().fit_enable_pull_up(false);
    rig.command(0x81);
    rig.host.reset_within(5 * MILLISECOND);
    let off = rig.host.wait(MICROSECOND, SECOND, |host| !host.bridges_on());
    let stop = rig.host.wait(MICROSECOND, SECOND, |host| host.speed() == 0);
    assert!(off <= 10 * MICROSECOND && stop <= 10 * MILLISECOND, "{off} {stop}");
    rig.run(0);
    assert!(!rig.frames().contains(&(0x701, vec![0])));
    rig.run(START);
    assert!(rig.frames().contains(&(0x701, vec![0])));
    rig.host.assert_rest();
    assert_eq!((rig.status() & STATE, rig.host.bridges_on()), (SWITCH_ON_DISABLED, false));
    assert_logged(&rig.host.log(), &["info: restart", "info: restarted by command", "info: CANopen node 1"]);
}

#[test]
fn the_watchdog_restarts_a_node_whose_owner_hangs() {
    let mut rig = NodeHost::moving();
    let place = code(symbol_in(image(), "TIM3"));
    let before = rig.host.machine.cpu_mut().program(place, &HANG).unwrap();
    rig.host.reset_within(301 * MILLISECOND);
    rig.host.machine.cpu_mut().program(place, &before).unwrap();
    rig.run(START);
    assert!(rig.frames().contains(&(0x701, vec![0])));
    rig.host.assert_rest();
    assert!(!rig.host.bridges_on() && rig.host.machine.board().world().outputs().leds[1]);
    assert_logged(&rig.host.log(), &["error: restarted by the watchdog: something hung"]);
    turns_again(&mut rig);
    rig.reset(1, 1_000_000);
    assert!(!rig.host.machine.board().world().outputs().leds[1]);
}

/// Nothing is known of the motor without the crystal, which is the clock of its controller as well.
#[test]
fn a_crystal_that_stops_switches_the_driver_off_and_one_that_does_not_start_leaves_it_off() {
    let mut rig = NodeHost::moving();
    rig.host.machine.set_crystal(false);
    rig.run(10 * MICROSECOND);
    assert!(!rig.host.bridges_on());
    for _ in 0..2 {
        rig.host.reset_within(SECOND);
        rig.run(10 * MILLISECOND);
        assert!(!rig.host.bridges_on() && rig.host.machine.board().world().outputs().leds[1]);
    }
    rig.host.machine.set_crystal(true);
    rig.host.reset_within(SECOND);
    rig.frames();
    rig.run(START);
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
    assert_logged(&rig.host.log(), &["error: restarted after the crystal had stopped"]);
    turns_again(&mut rig);
}

// ---- Chips and supply ----

/// A motion controller that is missing, or a bus that reads all ones or zeros: the bridges stay off, and the master is
/// told.
#[test]
fn without_a_motion_controller_the_driver_stays_off_and_the_node_is_in_fault() {
    for fault in [Fault::Spi, Fault::SpiLow, Fault::Tmc429] {
        let mut rig = NodeHost::just_on("", None);
        rig.host.fault(fault, true);
        rig.run(START);
        let said = rig.frames();
        assert_eq!(said[0], (0x701, vec![0]));
        assert!(said[1].0 == 0x81 && said[1].1[..2] == [0x00, 0x50], "{fault:?}: {said:X?}");
        assert_eq!(rig.status() & STATE, FAULT, "{fault:?}");
        for word in [0x80, 6, 7, ENABLE] {
            rig.set(0x6040, 0, word);
        }
        assert_eq!((rig.status() & STATE, rig.host.bridges_on()), (FAULT, false), "{fault:?}");
    }
}

/// A motion controller that falls silent while the motor turns: the bridges go off, until the next start.
#[test]
fn a_motion_controller_that_does_not_answer_any_more_ends_in_fault_with_the_driver_off() {
    for (fault, limit) in [(Fault::Spi, 6), (Fault::Tmc429, 6), (Fault::SpiLow, 70)] {
        let mut rig = NodeHost::moving();
        rig.host.fault(fault, true);
        let took = rig.host.wait(MICROSECOND, SECOND, |host| !host.bridges_on());
        assert!(took <= limit * MILLISECOND, "{fault:?}: {took}");
        rig.run(10 * MILLISECOND);
        assert!(rig.emergencies().iter().any(|(code, ..)| *code == 0x5000), "{fault:?}");
        assert_eq!(rig.status() & STATE, FAULT);
        assert!(rig.host.machine.board().world().outputs().leds[1]);
        rig.host.fault(fault, false);
        rig.run(10 * MILLISECOND);
        rig.host.assert_rest();
        rig.set(0x6040, 0, 0x80);
        assert_eq!((rig.status() & STATE, rig.host.bridges_on()), (FAULT, false), "{fault:?}");
        rig.reset(1, 1_000_000);
        turns_again(&mut rig);
    }
}

/// A driver that does not answer reads as one that has shut down.
#[test]
fn a_driver_that_does_not_answer_ends_in_fault() {
    let mut rig = NodeHost::moving();
    rig.host.fault(Fault::Tmc262, true);
    let took = rig.host.wait(MILLISECOND, SECOND, |host| host.speed() == 0);
    assert!(took <= 150 * MILLISECOND, "{took}");
    rig.run(50 * MILLISECOND);
    assert_eq!((rig.status() & STATE, rig.host.bridges_on()), (FAULT, false));
    assert!(!rig.emergencies().is_empty());
    rig.host.fault(Fault::Tmc262, false);
    rig.run(100 * MILLISECOND);
    rig.host.assert_rest();
    turns_again(&mut rig);
}

#[test]
fn without_its_supply_the_drive_is_in_fault() {
    let mut rig = NodeHost::moving();
    rig.host.machine.board().change_world(|world| world.set_supply(8.0));
    let took = rig.host.wait(100 * MICROSECOND, SECOND, |host| !host.bridges_on());
    // Two readings, 2 ms apart, looked at each millisecond, and a millisecond for the drive.
    assert!(took <= 8 * MILLISECOND, "{took}");
    rig.run(10 * MILLISECOND);
    assert!(rig.emergencies().iter().any(|(code, ..)| *code == 0xFF00));
    assert_eq!(rig.status() & STATE, FAULT);
    rig.host.assert_rest();
    rig.host.machine.board().change_world(|world| world.set_supply(24.0));
    rig.run(20 * MILLISECOND);
    rig.host.assert_rest();
    turns_again(&mut rig);
}

/// The supply goes away for moments at any time: while it starts, while it turns, while it saves.
#[test]
fn power_cuts_at_any_time_leave_a_node_that_boots_up_and_stands() {
    let mut rig = NodeHost::just_on("", None);
    for after in [1, 2_100, 2_400, 12_000, 25_000] {
        rig.run(after * MICROSECOND);
        rig.host.machine.set_power(false);
        rig.run(MILLISECOND);
        assert!(!rig.host.bridges_on());
        rig.host.machine.set_power(true);
    }
    rig.run(START);
    rig.set(0x2003, 0, 99);
    turns_again(&mut rig);
    rig.send(0x601, &[0x23, 0x10, 0x10, 1, b's', b'a', b'v', b'e']);
    rig.run(3 * MILLISECOND);
    assert!(rig.host.machine.board().at25().is_writing());
    rig.power_cycle();
    assert_eq!(rig.frames().last(), Some(&(0x701, vec![0])));
    rig.host.assert_rest();
    assert_eq!((rig.read(0x2003, 0), rig.status() & STATE), (128, SWITCH_ON_DISABLED));
}
