//! Values that survive power-off, and when: settings through telegrams, the EEPROM's contents at the time of the reply,
//! power cuts in between.

use common::table::{AXIS, GLOBAL, INTERRUPT};
use common::{Bench, INVALID_VALUE, OK, WRONG_TYPE, telegram};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm_sim::VirtualModule;

const STAP: u8 = 7;
const RSAP: u8 = 8;
const STGP: u8 = 11;
const RSGP: u8 = 12;

#[test]
fn axis_parameters_are_stored_on_command() {
    let mut bench = Bench::new();
    for row in AXIS.stored() {
        AXIS.set(&mut bench, row, row.another());
    }
    // In RAM only, they are gone with the power.
    bench.power_cycle();
    for row in AXIS.stored() {
        assert_eq!(Some(AXIS.value(&mut bench, row)), row.default(), "{}", row.name);
        AXIS.set(&mut bench, row, row.another());
    }
    for row in AXIS.stored() {
        bench.ok(&format!("STAP {}, 0", row.number));
    }
    bench.power_cycle();
    for row in AXIS.stored() {
        assert_eq!(AXIS.value(&mut bench, row), row.another(), "{}", row.name);
    }
}

#[test]
fn rsap_brings_back_what_was_stored() {
    for row in AXIS.stored() {
        let mut bench = Bench::new();
        let default = row.default().unwrap();
        for stored in [default, row.another()] {
            AXIS.set(&mut bench, row, stored);
            bench.ok(&format!("STAP {}, 0", row.number));
            AXIS.set(&mut bench, row, if stored == default { row.another() } else { default });
            bench.ok(&format!("RSAP {}, 0", row.number));
            assert_eq!(AXIS.value(&mut bench, row), stored, "{}", row.name);
        }
        // Storing one has left the others alone.
        bench.power_cycle();
        for other in AXIS.stored().filter(|other| other.number != row.number) {
            assert_eq!(Some(AXIS.value(&mut bench, other)), other.default(), "{} after {}", other.name, row.name);
        }
    }
}

/// A stored parameter works from the start: here the current and the switch polarity.
#[test]
fn restored_parameters_are_in_force() {
    let mut bench = Bench::new();
    for line in ["SAP 6, 0, 248", "STAP 6, 0", "SAP 214, 0, 65535", "STAP 214, 0", "SGP 79, 0, 1", "SGP 90, 0, 1"] {
        bench.ok(line);
    }
    bench.power_cycle();
    bench.run(10 * MILLISECOND);
    assert_eq!((bench.ok("GAP 180, 0"), bench.ok("GAP 11, 0")), (31, 1));
    bench.ok("MVP ABS, 0, 500");
    bench.run(1000 * MILLISECOND);
    assert_eq!(bench.rotor(), -500);
}

#[test]
fn live_values_and_unknown_numbers_cannot_be_stored() {
    let mut bench = Bench::new();
    let before = bench.eeprom();
    for number in (0..=u8::MAX).filter(|number| !AXIS.row(*number).is_some_and(|row| row.is_stored())) {
        for opcode in [STAP, RSAP] {
            let reply = bench.send(Command::new(opcode, number, 0, 0));
            assert_eq!(reply.status, WRONG_TYPE, "command {opcode}, parameter {number}");
        }
    }
    assert!(bench.eeprom() == before);
}

/// Bank 0 stores with SGP, bank 3 not at all; STGP and RSGP are for the first 56 user variables.
#[test]
fn stgp_and_rsgp_are_for_user_variables_up_to_55() {
    let mut bench = Bench::new();
    for number in 0..=u8::MAX {
        bench.ok(&format!("SGP {number}, 2, {}", -1 - i32::from(number)));
        for opcode in [STGP, RSGP] {
            let reply = bench.send(Command::new(opcode, number, 2, 7));
            let expected = if number < 56 { OK } else { WRONG_TYPE };
            assert_eq!((reply.status, reply.value), (expected, 7), "command {opcode}, variable {number}");
            for bank in [0, 3] {
                let reply = bench.send(Command::new(opcode, number, bank, 0));
                assert_eq!(reply.status, WRONG_TYPE, "command {opcode}, number {number}, bank {bank}");
            }
        }
    }
    for number in 0..56 {
        bench.ok(&format!("SGP {number}, 2, 5"));
        bench.ok(&format!("RSGP {number}, 2"));
        assert_eq!(bench.ok(&format!("GGP {number}, 2")), -1 - number);
    }
    bench.power_cycle();
    for number in 0..=255 {
        let expected = if number < 56 { -1 - number } else { 0 };
        assert_eq!(bench.ok(&format!("GGP {number}, 2")), expected, "variable {number}");
    }
}

#[test]
fn bank_0_is_stored_at_once_and_the_rest_never() {
    for row in GLOBAL.stored() {
        let mut bench = Bench::new();
        // Parameter 67 without its bit 0: that would be a start in ASCII mode.
        let value = if row.number == 67 { 16 } else { row.another() };
        GLOBAL.set(&mut bench, row, value);
        bench.power_cycle();
        assert_eq!(GLOBAL.value(&mut bench, row), value, "{}", row.name);
    }
    let mut bench = Bench::new();
    for row in INTERRUPT.rows {
        INTERRUPT.set(&mut bench, row, row.another());
    }
    bench.power_cycle();
    for row in INTERRUPT.rows {
        assert_eq!(Some(INTERRUPT.value(&mut bench, row)), row.default(), "{}", row.name);
    }
}

/// Parameter 81 by itself: without a program there is nothing to protect, but the bits are kept.
#[test]
fn code_protection_is_kept() {
    let mut bench = Bench::new();
    for bits in [1, 2, 3, 0] {
        bench.ok(&format!("SGP 81, 0, {bits}"));
        bench.power_cycle();
        assert_eq!(bench.ok("GGP 81, 0"), bits);
    }
}

fn coordinates(bench: &mut Bench) -> Vec<i32> {
    (0..=20).map(|n| bench.ok(&format!("GCO {n}, 0"))).collect()
}

/// Parameter 84 off: coordinates are in RAM, and in the EEPROM when told so by the 255 forms.
#[test]
fn coordinates_are_stored_on_command() {
    let mut bench = Bench::new();
    for n in 0..=20 {
        bench.ok(&format!("SCO {n}, 0, {}", 100 + n));
    }
    let fresh = bench.eeprom();
    assert!(fresh.iter().all(|byte| *byte == 0xFF), "nothing has been stored yet");
    // One of them, then the others; number 0 means all but itself.
    bench.ok("SCO 7, 255, 0");
    bench.power_cycle();
    assert_eq!(coordinates(&mut bench), [0; 21]);
    bench.ok("GCO 7, 255");
    bench.ok("GCO 8, 255");
    let mut only_7 = [0; 21];
    only_7[7] = 107;
    assert_eq!(coordinates(&mut bench), only_7);
    for n in 0..=20 {
        bench.ok(&format!("SCO {n}, 0, {}", 200 + n));
    }
    bench.ok("SCO 0, 255, 0");
    bench.power_cycle();
    bench.ok("SCO 0, 0, 5");
    bench.ok("SCO 1, 0, 5");
    bench.ok("GCO 0, 255");
    let expected: Vec<i32> = (0..=20).map(|n| if n == 0 { 5 } else { 200 + n }).collect();
    assert_eq!(coordinates(&mut bench), expected);
    bench.refused("SCO 21, 255, 0", INVALID_VALUE);
    bench.refused("GCO 21, 255", INVALID_VALUE);
}

/// Parameter 84 on: every way to set a coordinate stores it, but for number 0, and all are back at the start.
#[test]
fn coordinates_are_stored_always() {
    let mut bench = Bench::new();
    for line in ["SGP 84, 0, 1", "CALC LOAD, 33", "SAP 1, 0, 22", "SCO 0, 0, 9", "SCO 1, 0, 11", "CCO 2, 0", "ACO 3, 0"]
    {
        bench.ok(line);
    }
    bench.power_cycle();
    let mut expected = [0; 21];
    expected[1..=3].copy_from_slice(&[11, 22, 33]);
    assert_eq!(coordinates(&mut bench), expected);
}

// ---- when a reply may be sent

/// A command that stores: what leads up to it, the command, and how to see whether it has been stored after
/// a restart: old and new value.
struct Storing {
    before: &'static [&'static str],
    command: &'static str,
    look: &'static [&'static str],
    old: i32,
    new: i32,
}

const STORING: &[Storing] = &[
    Storing { before: &["SAP 4, 0, 1234"], command: "STAP 4, 0", look: &["GAP 4, 0"], old: 1000, new: 1234 },
    Storing { before: &["SGP 5, 2, -9"], command: "STGP 5, 2", look: &["GGP 5, 2"], old: 0, new: -9 },
    Storing { before: &[], command: "SGP 77, 0, 1", look: &["GGP 77, 0"], old: 0, new: 1 },
    Storing { before: &["CALC LOAD, 65535"], command: "AGP 82, 0", look: &["GGP 82, 0"], old: 0, new: 65_535 },
    Storing {
        before: &["SCO 20, 0, -1"],
        command: "SCO 20, 255, 0",
        look: &["GCO 20, 255", "GCO 20, 0"],
        old: 0,
        new: -1,
    },
    Storing { before: &["SGP 84, 0, 1", "SCO 3, 0, 8"], command: "SCO 3, 0, 7", look: &["GCO 3, 0"], old: 8, new: 7 },
    Storing { before: &["SGP 84, 0, 1", "SAP 1, 0, 600"], command: "CCO 4, 0", look: &["GCO 4, 0"], old: 0, new: 600 },
    Storing { before: &["SGP 84, 0, 1", "CALC LOAD, 50"], command: "ACO 5, 0", look: &["GCO 5, 0"], old: 0, new: 50 },
];

impl Storing {
    fn prepare(&self) -> Bench {
        let mut bench = Bench::new();
        for line in self.before {
            bench.ok(line);
        }
        bench
    }

    fn look(&self, bench: &mut Bench) -> i32 {
        self.look.iter().map(|line| bench.ok(line)).last().unwrap()
    }

    fn start(&self, bench: &mut Bench) {
        bench.post(Source::Usb, self.command);
    }
}

/// The reply says that it is durable: a module with a copy of the EEPROM as it was at that moment has it.
#[test]
fn the_reply_comes_when_it_is_durable() {
    for storing in STORING {
        let mut bench = storing.prepare();
        bench.ok(storing.command);
        assert!(!bench.module.board().borrow().at25().is_writing(), "{}", storing.command);
        let mut copy = Bench::with_eeprom(&bench.eeprom());
        assert_eq!(storing.look(&mut copy), storing.new, "{}", storing.command);
        bench.module.set_power(false);
        bench.module.set_power(true);
        assert_eq!(storing.look(&mut bench), storing.new, "{}", storing.command);
    }
}

/// Wherever the power is cut before the reply, the old value is there or the new one, whole; the old one as
/// long as the part has not finished writing. All else is as it was.
#[test]
fn a_power_cut_before_the_reply_leaves_old_or_new() {
    for storing in STORING {
        let mut seen = [0, 0];
        for tick in 0.. {
            let mut bench = storing.prepare();
            let before = (AXIS.settings(&mut bench), GLOBAL.settings(&mut bench));
            let start = bench.eeprom();
            storing.start(&mut bench);
            bench.run(tick * 100 * MICROSECOND);
            if bench.module.sent().is_some() {
                break;
            }
            assert!(tick < 1000, "{}: no reply", storing.command);
            let written = bench.eeprom() != start;
            bench.module.set_power(false);
            bench.run(MILLISECOND);
            bench.module.set_power(true);
            let value = storing.look(&mut bench);
            seen[usize::from(value == storing.new)] += 1;
            let expected = if written { storing.new } else { storing.old };
            assert_eq!(value, expected, "{}, cut after {} us", storing.command, tick * 100);
            // A command changes one row at most, which has been looked at.
            let mut bench = Bench::with_eeprom(&bench.eeprom());
            let now = (AXIS.settings(&mut bench), GLOBAL.settings(&mut bench));
            let differing = |now: &[i32], then: &[i32]| now.iter().zip(then).filter(|(a, b)| a != b).count();
            assert!(differing(&now.0, &before.0) + differing(&now.1, &before.1) <= 1, "{}", storing.command);
        }
        assert!(seen[0] > 0, "{}: answered at once", storing.command);
    }
}

/// Setting a value and setting it back while the first is still being written: the second reply waits, too.
#[test]
fn a_second_thought_from_another_link_is_durable_as_well() {
    for tick in 0..200 {
        let mut bench = Bench::new();
        bench.post(Source::Usb, "SGP 77, 0, 1");
        bench.run(3 * MILLISECOND);
        bench.post(Source::Rs485, "SGP 77, 0, 0");
        bench.run(tick * 100 * MICROSECOND);
        let replies = std::iter::from_fn(|| bench.module.sent()).filter(|sent| sent.source == Source::Rs485).count();
        bench.module.set_power(false);
        bench.module.set_power(true);
        if replies == 1 {
            assert_eq!(bench.ok("GGP 77, 0"), 0, "cut {} us after", tick * 100);
        }
        assert!(replies == 1 || tick < 150);
    }
}

/// A value that is stored already is not written again, and answered at once.
#[test]
fn an_unchanged_value_costs_no_write() {
    let mut bench = Bench::new();
    bench.ok("SGP 77, 0, 1");
    let before = bench.page_writes();
    for line in ["SGP 77, 0, 1", "STAP 4, 0", "STGP 1, 2", "SCO 0, 255, 0"] {
        bench.ok(line);
    }
    assert_eq!(bench.page_writes(), before);
}

/// Storing one thing over and over does not wear out one page: its two copies take turns.
#[test]
fn two_copies_take_turns() {
    let mut bench = Bench::new();
    for value in 1..=50 {
        bench.ok(&format!("SGP 68, 0, {value}"));
    }
    assert_eq!(bench.module.board().borrow().at25().most_page_writes(), 25);
    bench.power_cycle();
    assert_eq!(bench.ok("GGP 68, 0"), 50);
}

/// Writing goes on beside everything else: the other link is answered meanwhile.
#[test]
fn a_write_holds_up_nobody_else() {
    let mut bench = Bench::new();
    bench.post(Source::Usb, "SGP 77, 0, 1");
    for _ in 0..4 {
        let asked = bench.module.now();
        assert_eq!(bench.ask_over(Source::Rs485, 1, "GGP 66, 0").map(|reply| reply.value), Some(1));
        assert!(bench.module.now() - asked <= MILLISECOND);
        bench.run(MILLISECOND / 2);
    }
    assert!(bench.module.board().borrow().at25().is_writing(), "the page takes 5 ms");
}

// ---- factory reset

fn factory_reset(bench: &mut Bench) {
    let reset = telegram("137, 0, 0, 1234");
    assert_eq!(bench.exchange(Source::Usb, reset), None, "it is not answered");
}

/// Command 137: no reply, the module restarts by itself, and everything is default - also what had been
/// stored, also after the next power cycle.
#[test]
fn factory_reset_brings_back_all_defaults() {
    let mut bench = Bench::new();
    for row in AXIS.stored() {
        AXIS.set(&mut bench, row, row.another());
        bench.ok(&format!("STAP {}, 0", row.number));
    }
    for row in GLOBAL.stored() {
        GLOBAL.set(&mut bench, row, row.another());
    }
    for row in INTERRUPT.rows {
        INTERRUPT.set(&mut bench, row, row.another());
    }
    for n in 0..=20 {
        bench.ok(&format!("SCO {n}, 0, 1"));
    }
    for n in 0..56 {
        bench.ok(&format!("SGP {n}, 2, 1"));
        bench.ok(&format!("STGP {n}, 2"));
    }
    bench.ok("SIO 1, 2, 1");
    bench.ok("SGP 132, 0, 1000000");
    factory_reset(&mut bench);
    for restart in ["by itself", "by a power cycle"] {
        assert!(bench.ok("GGP 132, 0") < 3000, "restarted {restart}");
        assert_eq!(bench.ok("GIO 1, 2"), 0);
        for table in [AXIS, GLOBAL, INTERRUPT] {
            for row in table.stored().chain(table.rows.iter().filter(|row| row.is_writable())) {
                if ![132, 133].contains(&row.number) {
                    assert_eq!(Some(table.value(&mut bench, row)), row.default(), "{}, {restart}", row.name);
                }
            }
        }
        for n in 0..=20 {
            bench.ok("GCO 0, 255");
            assert_eq!(bench.ok(&format!("GCO {n}, 0")), 0);
        }
        for n in 0..56 {
            bench.ok(&format!("RSGP {n}, 2"));
            assert_eq!(bench.ok(&format!("GGP {n}, 2")), 0);
        }
        bench.power_cycle();
    }
    // And storing goes on as ever.
    bench.ok("SGP 66, 0, 9");
    bench.power_cycle();
    assert_eq!((bench.ok("GGP 66, 0"), bench.ok("GGP 76, 0")), (9, 2));
}

/// Cut short anywhere, a factory reset has happened altogether or not at all.
#[test]
fn a_power_cut_during_a_factory_reset() {
    let mut outcomes = [0, 0];
    for tick in 0..200 {
        let mut bench = Bench::new();
        for line in ["SAP 4, 0, 5", "STAP 4, 0", "SGP 68, 0, 5", "SGP 1, 2, 5", "STGP 1, 2"] {
            bench.ok(line);
        }
        bench.post(Source::Usb, "137, 0, 0, 1234");
        bench.run(tick * 100 * MICROSECOND);
        bench.power_cycle();
        let found = ["GAP 4, 0", "GGP 68, 0", "GGP 1, 2"].map(|line| bench.ok(line));
        let outcome = [[5, 5, 5], [1000, 0, 0]].iter().position(|whole| *whole == found);
        outcomes[outcome.unwrap_or_else(|| panic!("half a reset after {} us: {found:?}", tick * 100))] += 1;
    }
    assert!(outcomes[0] > 0 && outcomes[1] > 0, "{outcomes:?}");
}
