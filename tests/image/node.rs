//! The flash image of the CANopen firmware on the emulated microcontroller: boot-up, SDO, PDOs and SYNC, the drive,
//! node ID and bit rate, and what is at the other pins.

use common::image_host::{Host, NOT_AVAILABLE, OK, START};
use common::node_host::{ENABLE, GO, NodeHost, PP};
use common::telegram;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::canopen::{Entry, Object};
use tmcm::product::Tmcm1140Canopen;
use tmcm::store::{Memory, Need, Store};

#[test]
fn boots_up_and_answers() {
    let mut rig = NodeHost::new("");
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
    let log = rig.host.log();
    assert!(log.iter().any(|line| line == "info: CANopen node 1 at 1000 kbit/s"), "{log:?}");
    assert!(log.iter().any(|line| line == "info: CAN at 1000000 bit/s"), "{log:?}");
    assert_eq!((rig.read(0x1000, 0), rig.read(0x2707, 0), rig.read(0x2708, 0)), (0x0004_0192, 1000, 1));
    assert_eq!(rig.write(0x1000, 0, 0), Err(0x0601_0002));
    assert_eq!(rig.status() & 0x4F, 0x40, "switch on disabled");
    assert!(!rig.host.bridges_on());
    // Its RS485 port is off.
    assert!(rig.host.said_to(&telegram("GAP 1, 0"), 50 * MILLISECOND).is_empty());
    println!("stack: {} bytes, {:?}", rig.host.machine.stack_used(), rig.host.machine.counters());
}

/// The heartbeat every 20 ms, and the answers to a master that guards the node instead.
#[test]
fn tells_that_it_lives() {
    let mut rig = NodeHost::new("");
    rig.set(0x1017, 0, 20);
    rig.command(1);
    rig.run(2 * MILLISECOND);
    rig.frames();
    rig.run(200 * MILLISECOND);
    let beats: Vec<_> = rig.timed().into_iter().filter(|(_, id, _)| *id == 0x701).collect();
    assert_eq!(beats.len(), 10);
    assert!(beats.iter().all(|(_, _, data)| *data == [5]), "{beats:?}");
    let late = beats.windows(2).map(|pair| (pair[1].0 - pair[0].0).abs_diff(20 * MILLISECOND)).max().unwrap();
    // It is looked at each millisecond.
    assert!(late < 1_100 * MICROSECOND, "{late}");
    rig.set(0x1017, 0, 0);
    rig.frames();
    for state in [0x05, 0x85, 0x05] {
        // That to another node is not for this one, nor is a data frame.
        rig.send_remote(0x702);
        rig.send(0x701, &[0]);
        rig.send_remote(0x701);
        rig.run(MILLISECOND);
        assert_eq!(rig.frames(), [(0x701, vec![state])]);
    }
}

/// TPDO1 with each SYNC, and RPDO1 that acts with the next one.
#[test]
fn pdos_go_and_act_with_sync() {
    let mut rig = NodeHost::new("");
    rig.set(0x1800, 2, 1);
    rig.command(1);
    rig.run(MILLISECOND);
    rig.set(0x1400, 1, 0xC000_0201);
    rig.set(0x1400, 2, 0);
    // It is heard there as soon as the node has said so, and nowhere else.
    rig.set(0x1400, 1, 0x4000_0211);
    rig.send(0x211, &[6, 0]);
    rig.send(0x201, &[7, 0]);
    rig.frames();
    rig.run(10 * MILLISECOND);
    assert_eq!((rig.of(0x181), rig.read(0x6040, 0)), (vec![], 0));
    rig.send(0x80, &[]);
    rig.run(10 * MILLISECOND);
    assert_eq!(rig.of(0x181), [[0x50, 0x02]], "the state when the SYNC came");
    rig.send(0x80, &[]);
    rig.run(MILLISECOND);
    assert_eq!((rig.of(0x181), rig.read(0x6040, 0)), (vec![vec![0x31, 0x02]], 6));
}

#[test]
fn a_move_in_profile_position_mode_moves_the_motor() {
    let mut rig = NodeHost::new("");
    rig.enable(PP);
    rig.set(0x607A, 0, 25_600);
    rig.set(0x6040, 0, GO);
    rig.run(3 * SECOND);
    assert_eq!((rig.host.rotor(), rig.read(0x6064, 0), rig.status() & 0x400), (25_600, 25_600, 0x400));
    rig.set(0x6040, 0, ENABLE);
    rig.set(0x607A, 0, (-1_000_i32) as u32);
    rig.set(0x6040, 0, GO);
    rig.run(3 * SECOND);
    assert_eq!(rig.host.rotor(), -1_000);
}

#[test]
fn usb_tells_the_version_and_nothing_else() {
    let mut rig = NodeHost::new("");
    rig.host.plug_usb();
    assert_eq!(rig.host.ask_usb("136, 1, 0, 0"), (OK, 0x0474_0314));
    assert_eq!(rig.host.ask_usb("GAP 1, 0").0, NOT_AVAILABLE);
    assert_eq!(rig.host.ask_usb("ROR 0, 500").0, NOT_AVAILABLE);
    rig.run(100 * MILLISECOND);
    assert_eq!(rig.host.rotor(), 0);
}

/// Saved by 2706h, used after the next reset; first the node IDs at the ends, then all bit rates.
#[test]
fn another_node_id_and_bit_rate_are_used_after_a_reset() {
    let mut rig = NodeHost::new("");
    let rates = [20, 50, 100, 125, 250, 500, 800, 1000];
    for (rate, node) in rates.into_iter().zip([127, 1, 2, 3, 4, 5, 6, 7]) {
        rig.set(0x2704, 0, rate);
        rig.set(0x2705, 0, node);
        rig.download(0x2706, 1, b"save").unwrap();
        rig.reset(node as u8, rate * 1_000);
        assert_eq!((rig.read(0x2707, 0), rig.read(0x2708, 0)), (rate, node));
        let made = rig.host.machine.bit_rates().can.unwrap();
        // 13 quanta of 4 clocks of 42 MHz.
        assert_eq!(made, if rate == 800 { 807_692 } else { rate * 1_000 });
        // Its other identifiers follow.
        rig.send_remote(0x700 + node);
        rig.run(20 * MILLISECOND);
        assert_eq!(rig.frames(), [(0x700 + node, vec![0x7F])]);
    }
}

/// Values that cannot be in the EEPROM, or that a later firmware may have left there.
#[test]
fn a_stored_node_id_or_bit_rate_that_is_none_counts_as_its_default() {
    for (node, rate) in [(0, 1000), (128, 1000), (-1, 0), (1, 10), (1, 333), (1, 1001), (1, i32::MAX), (300, -1)] {
        let contents = stored(&[(Object::NodeId, node), (Object::BitRate, rate)]);
        let mut rig = NodeHost::just_on("", Some(&contents));
        rig.run(START);
        assert_eq!(rig.frames(), [(0x701, vec![0])], "{node}, {rate}");
        assert_eq!((rig.read(0x2707, 0), rig.read(0x2708, 0)), (1000, 1));
    }
}

/// Two images, one after the other, on the same module: each has its own settings, until the other one saves.
#[test]
fn one_firmware_flashed_over_the_other_has_its_own_settings() {
    let mut tmcl = Host::new("");
    for line in ["SAP 4, 0, 1234", "STAP 4, 0", "SGP 69, 0, 5"] {
        tmcl.ok(line);
    }
    let eeprom = |host: &mut Host| host.machine.board().at25().contents().to_vec();
    let kept = eeprom(&mut tmcl);
    let mut rig = NodeHost::just_on("", Some(&kept));
    rig.run(START);
    assert_eq!((rig.read(0x2707, 0), rig.read(0x2708, 0)), (1000, 1));
    let log = rig.host.log();
    assert!(log.iter().any(|line| line.contains("settings pages are not this firmware's")), "{log:?}");
    assert_eq!(eeprom(&mut rig.host), kept, "nothing is written");
    rig.set(0x2705, 0, 9);
    rig.download(0x2706, 1, b"save").unwrap();
    let mut again = Host::with_eeprom(&eeprom(&mut rig.host));
    assert_eq!((again.ok("GAP 4, 0"), again.ok("GGP 66, 0"), again.ok("GGP 69, 0")), (1_000, 1, 8));
    let mut again = Host::with_eeprom(&kept);
    assert_eq!((again.ok("GAP 4, 0"), again.ok("GGP 66, 0"), again.ok("GGP 69, 0")), (1_234, 1, 5));
}

/// An EEPROM in which these values are saved.
fn stored(values: &[(Object, i32)]) -> Vec<u8> {
    let mut store = Store::<Tmcm1140Canopen>::new();
    store.forget();
    for (object, value) in values {
        assert!(store.set(Entry::of(*object).row().slot(0).unwrap(), *value));
    }
    let mut contents = vec![0xFF; Tmcm1140Canopen::SIZE];
    while !store.settled(Need::Settings) {
        let job = store.next_job().unwrap();
        contents[usize::from(job.address)..][..job.page.len()].copy_from_slice(&job.page);
        store.finish(true);
    }
    contents
}

/// The two pads, connected while the module is switched on, bring the factory settings back.
#[test]
fn the_pads_bring_back_the_factory_settings() {
    let mut rig = NodeHost::new("");
    rig.set(0x2003, 0, 99);
    rig.download(0x1010, 1, b"save").unwrap();
    rig.set(0x2705, 0, 9);
    rig.download(0x2706, 1, b"save").unwrap();
    rig.reset(9, 1_000_000);
    assert_eq!(rig.read(0x2003, 0), 99);
    rig.host.machine.wiring().connect_pads(true);
    rig.power_cycle();
    rig.run(START);
    let log = rig.host.log();
    assert!(log.iter().any(|line| line == "warn: pads connected: factory settings"), "{log:?}");
    rig.host.machine.wiring().connect_pads(false);
    rig.node = 1;
    assert_eq!(rig.read(0x2003, 0), 128);
    rig.power_cycle();
    assert_eq!((rig.read(0x2003, 0), rig.read(0x2708, 0)), (128, 1), "for good");
}
