//! An EEPROM, two firmwares: each leaves the settings of the other alone until it saves something, and program memory
//! belongs to TMCL.

use crate::rig::Rig;
use hal_sim::clock::MILLISECOND;
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::{binary, text};
use tmcm_sim::{NativeModule, VirtualModule};

/// First byte of the settings; the program lies before.
const SETTINGS: usize = 14_336;

/// A module with the TMCL firmware and this EEPROM.
fn tmcl(eeprom: Option<&[u8]>) -> NativeModule {
    let mut module = NativeModule::new(&WorldConfig::default(), eeprom, 1);
    module.run(2 * MILLISECOND);
    module
}

/// Status and value of the reply to a command over USB.
fn ask(module: &mut NativeModule, line: &str) -> (u8, i32) {
    let telegram = binary::encode_command(1, text::parse(line).unwrap());
    let sent = module.exchange(Source::Usb, telegram, 2_000 * MILLISECOND).unwrap();
    let reply = binary::decode_reply(&sent.telegram().unwrap()).unwrap();
    (reply.status, reply.value)
}

fn contents(module: &NativeModule) -> Vec<u8> {
    module.board().borrow().at25().contents().to_vec()
}

/// A module with a program, and settings other than the defaults in many pages.
fn used_tmcl() -> Vec<u8> {
    let mut module = tmcl(None);
    for line in [
        "SAP 4, 0, 1234",
        "STAP 4, 0",
        "SGP 69, 0, 6",
        "SGP 71, 0, 44",
        "SGP 3, 2, 5",
        "STGP 3, 2",
        "SGP 0, 2, 9",
        "STGP 0, 2",
    ] {
        assert_eq!(ask(&mut module, line).0, 100, "{line}");
    }
    assert_eq!(ask(&mut module, "132, 0, 0, 0").0, 100);
    for line in ["ROR 0, 100", "WAIT TICKS, 0, 10", "STOP"] {
        assert_eq!(ask(&mut module, line).0, 101, "{line}");
    }
    assert_eq!(ask(&mut module, "133, 0, 0, 0").0, 100);
    module.run(500 * MILLISECOND);
    contents(&module)
}

/// A node that has saved all.
fn used_node() -> Vec<u8> {
    let mut rig = Rig::new();
    for (index, sub, value) in [(0x2705, 0, 7), (0x2704, 0, 125), (0x2003, 0, 200), (0x1017, 0, 500), (0x609A, 0, 77)] {
        rig.set(index, sub, value);
    }
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    rig.eeprom()
}

#[test]
fn a_node_finds_the_settings_of_tmcl() {
    let eeprom = used_tmcl();
    let mut rig = Rig::with_eeprom(&eeprom, 1);
    // Its settings count as defaults, and are left alone, also by a node that runs and is written to.
    assert!(rig.report.foreign > 3 && rig.report.valid == 0, "{:?}", rig.report);
    assert_eq!((rig.node.node_id(), rig.node.bit_rate(), rig.read(0x2003, 0)), (1, 1000, 128));
    rig.set(0x2003, 0, 150);
    // Restoring defaults that are in force is nothing to be written.
    for sub in [1, 2, 4] {
        assert_eq!(rig.sign(0x1011, sub, b"load"), Ok(()));
    }
    rig.command(0x82);
    rig.wait(1000);
    assert!(rig.eeprom() == eeprom);
    let mut back = tmcl(Some(&eeprom));
    assert_eq!((ask(&mut back, "GAP 4, 0"), ask(&mut back, "GGP 3, 2")), ((100, 1234), (100, 5)));
    // The first save takes the settings over, and leaves the program where it is.
    assert_eq!(rig.sign(0x1010, 4, b"save"), Ok(()));
    let saved = rig.eeprom();
    assert!(saved[..SETTINGS] == eeprom[..SETTINGS] && saved[SETTINGS..] != eeprom[SETTINGS..]);
    // The second copies are written behind the confirmation.
    rig.wait(100);
    rig.power_cycle();
    assert!(rig.report.foreign == 0 && rig.report.valid == 18 && !rig.report.worn, "{:?}", rig.report);
    assert_eq!((rig.node.node_id(), rig.read(0x2003, 0)), (1, 150));
    // To TMCL they are gone, and with them the mark that its program is whole: it counts as none.
    let mut back = tmcl(Some(&saved));
    assert!(!back.take_log().is_empty());
    assert_eq!(
        (ask(&mut back, "GAP 4, 0"), ask(&mut back, "GGP 3, 2"), ask(&mut back, "GGP 71, 0")),
        ((100, 1000), (100, 0), (100, 1))
    );
    assert_eq!(ask(&mut back, "129, 0, 0, 0").0, 100);
    back.run(100 * MILLISECOND);
    assert_eq!(back.board().borrow().tmc429(0).velocity(0), 0);
}

#[test]
fn tmcl_finds_the_settings_of_a_node() {
    let eeprom = used_node();
    let mut module = tmcl(Some(&eeprom));
    assert!(!module.take_log().is_empty());
    assert_eq!((ask(&mut module, "GAP 6, 0"), ask(&mut module, "GGP 71, 0")), ((100, 128), (100, 1)));
    module.run(1000 * MILLISECOND);
    assert!(contents(&module) == eeprom);
    let mut rig = Rig::with_eeprom(&contents(&module), 1);
    assert_eq!((rig.node.node_id(), rig.node.bit_rate(), rig.read(0x2003, 0)), (7, 125, 200));
    assert_eq!((rig.read(0x1017, 0), rig.read(0x609A, 0)), (500, 77));
    // The first storing command takes the settings over.
    assert_eq!(ask(&mut module, "SGP 76, 0, 9").0, 100);
    let mut rig = Rig::with_eeprom(&contents(&module), 1);
    assert_eq!((rig.node.node_id(), rig.node.bit_rate(), rig.read(0x2003, 0)), (1, 1000, 128));
    assert!(rig.report.foreign > 0);
    let mut module = tmcl(Some(&contents(&module)));
    assert_eq!(ask(&mut module, "GGP 76, 0"), (100, 9));
}

/// The supply fails at every byte of the save that takes the area over: what the node finds is its own, old or new.
#[test]
fn a_power_cut_while_the_settings_are_taken_over() {
    let eeprom = used_tmcl();
    let begin = |rig: &mut Rig| {
        rig.set(0x2003, 0, 150);
        rig.set(0x2705, 0, 3);
    };
    let bytes = |rig: &Rig| rig.board.borrow().eeprom_bytes();
    let mut rig = Rig::with_eeprom(&eeprom, 1);
    begin(&mut rig);
    let first = bytes(&rig);
    assert_eq!(rig.sign(0x1010, 1, b"save"), Ok(()));
    for byte in (first..bytes(&rig)).step_by(7) {
        let mut rig = Rig::with_eeprom(&eeprom, 1);
        begin(&mut rig);
        rig.board.borrow_mut().cut_power_at_byte(byte + 1);
        let confirmed = rig.post(crate::rig::expedited(0x1010, 1, b"save")).is_some();
        assert!(!confirmed);
        let mut rig = Rig::with_eeprom(&rig.eeprom(), 1);
        assert!([1, 3].contains(&rig.node.node_id()) && [128, 150].contains(&rig.read(0x2003, 0)));
        assert!(rig.eeprom()[..SETTINGS] == eeprom[..SETTINGS]);
    }
}
