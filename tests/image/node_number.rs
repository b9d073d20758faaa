//! The number of a node, and its settings, in the flash image. Nothing goes out while the number is unknown. Bits that
//! flip and supplies that fail leave all or nothing, and what is lost is told.

use common::image_host::{START, assert_logged};
use common::node_host::{NodeHost, PV};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use hal_sim::fault::Fault;

/// Where the settings begin in the EEPROM: nine pages in use, each twice, side by side.
const SETTINGS: usize = 16_384 - 2 * 16 * PAGE;
const PAGE: usize = 64;

/// Objects of several pages with values that are not their defaults, those of before, and those of a save that is cut.
const OBJECTS: [(u16, u8, u32, u32); 5] =
    [(0x2705, 0, 9, 8), (0x1017, 0, 0, 0), (0x2003, 0, 40, 41), (0x20A4, 0, 77, 78), (0x6099, 1, 321, 322)];

/// Numbers drawn from a seed.
struct Draw(u64);

impl Draw {
    fn below(&mut self, limit: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % limit
    }
}

/// The contents of an EEPROM in which node 9 has saved its objects.
fn saved() -> Vec<u8> {
    let mut rig = NodeHost::new("");
    for (index, sub, value, _) in OBJECTS {
        rig.set(index, sub, value);
    }
    rig.download(0x1010, 1, b"save").unwrap();
    rig.run(100 * MILLISECOND);
    rig.host.machine.board().at25().contents().to_vec()
}

/// A node that starts with this EEPROM, which answers or does not.
fn started(eeprom: &[u8], answers: bool) -> NodeHost {
    let mut rig = NodeHost::just_on("", Some(eeprom));
    rig.host.fault(Fault::Eeprom, !answers);
    rig.run(START);
    rig
}

/// Nothing goes out, whatever comes in, and nothing is acknowledged; LED1 is off, and LED2 on.
fn assert_silent(rig: &mut NodeHost) {
    for node in [1, 9] {
        for command in [1, 0x81, 0x82] {
            rig.send(0, &[command, node]);
        }
        rig.send(0x600 + u32::from(node), &[0x40, 0x00, 0x10, 0, 0, 0, 0, 0]);
        rig.send_remote(0x700 + u32::from(node));
    }
    rig.run(50 * MILLISECOND);
    assert_eq!(rig.frames(), []);
    assert!(!rig.host.machine.can().hears());
    assert_eq!(rig.host.machine.board().world().outputs().leds, [false, true]);
    assert!(!rig.host.bridges_on());
}

#[test]
fn without_its_eeprom_the_node_is_silent_until_it_is_told_a_number() {
    let mut rig = started(&saved(), false);
    assert_silent(&mut rig);
    assert_logged(
        &rig.host.log(),
        &[
            "warn: EEPROM does not answer: defaults apply, nothing can be stored",
            "error: CANopen: the node ID is unknown; 137 over USB starts node 1 with defaults",
        ],
    );
    rig.host.plug_usb();
    assert_eq!(rig.host.ask_usb("136, 1, 0, 0"), (100, 0x0474_0314));
    assert_eq!(rig.host.ask_usb("137, 0, 0, 1").0, 6);
    assert_silent(&mut rig);
    assert_eq!(rig.host.ask_usb("137, 0, 0, 1234").0, 100);
    rig.run(10 * MILLISECOND);
    assert_eq!(rig.frames(), [(0x701, vec![0])]);
    assert!(rig.host.machine.can().hears() && !rig.host.machine.board().world().outputs().leds[1]);
    assert_eq!((rig.read(0x2708, 0), rig.read(0x603F, 0)), (1, 0));
    assert_eq!(rig.download(0x1010, 1, b"save"), Err(0x0606_0000));
    rig.enable(PV);
}

/// The EEPROM answers again, within a second the node starts as after power-on. One that is busy for longer than the
/// start waits is asked again, too.
#[test]
fn an_eeprom_that_answers_again() {
    let eeprom = saved();
    let mut rig = started(&eeprom, false);
    rig.run(SECOND);
    assert_silent(&mut rig);
    rig.host.fault(Fault::Eeprom, false);
    rig.run(1_100 * MILLISECOND);
    assert_eq!(rig.frames(), [(0x709, vec![0])]);
    rig.node = 9;
    assert_eq!((rig.read(0x2708, 0), rig.read(0x2003, 0), rig.read(0x603F, 0)), (9, 40, 0));
    for (busy, most) in [(5, 100), (200, 1_200), (2_000, 3_200)] {
        let mut rig = NodeHost::just_on("", Some(&eeprom));
        let now = rig.host.machine.now();
        rig.host.machine.board().at25_mut().keep_busy(now + busy * MILLISECOND);
        rig.run(busy * MILLISECOND);
        assert_eq!(rig.frames(), [], "busy for {busy} ms");
        rig.run(most * MILLISECOND - busy * MILLISECOND);
        assert_eq!(rig.frames(), [(0x709, vec![0])], "busy for {busy} ms");
    }
}

/// A restart by the master, and one by the watchdog, with an EEPROM that has gone silent: the number is kept. Without
/// the supply it is not.
#[test]
fn a_restart_keeps_the_number() {
    let mut rig = started(&saved(), true);
    assert_eq!(rig.frames(), [(0x709, vec![0])]);
    rig.node = 9;
    rig.host.fault(Fault::Eeprom, true);
    rig.command(0x81);
    rig.run(2 * START);
    assert_eq!(rig.frames(), [(0x709, vec![0]), (0x89, vec![0x30, 0x55, 0x81, 0, 255, 0, 0, 0])]);
    assert_eq!((rig.read(0x2708, 0), rig.read(0x603F, 0), rig.read(0x2003, 0)), (9, 0x5530, 128));
    rig.host.machine.set_crystal(false);
    rig.host.reset_within(SECOND);
    rig.host.machine.set_crystal(true);
    rig.frames();
    rig.run(SECOND);
    assert_eq!(rig.frames().first(), Some(&(0x709, vec![0])));
    rig.host.machine.set_power(false);
    rig.run(10 * MILLISECOND);
    rig.host.machine.set_power(true);
    rig.frames();
    rig.run(START);
    assert_silent(&mut rig);
}

/// The pads that bring back the factory settings say as well that the node may be node 1. This is so with an EEPROM
/// that is silent, and with one whose page with the number is bad.
#[test]
fn the_pads_tell_a_number() {
    let mut flipped = saved();
    for copy in 0..2 {
        flipped[SETTINGS + copy * PAGE + 20] ^= 1;
    }
    for (eeprom, answers) in [(saved(), false), (flipped, true)] {
        let mut rig = NodeHost::just_on("", Some(&eeprom));
        rig.host.fault(Fault::Eeprom, !answers);
        rig.host.machine.set_power(false);
        rig.host.machine.wiring().connect_pads(true);
        rig.host.machine.set_power(true);
        rig.run(START);
        assert_eq!(rig.frames(), [(0x701, vec![0])], "answers: {answers}");
        assert_eq!(
            (rig.read(0x2003, 0), rig.read(0x603F, 0), rig.status() & 0x6F),
            (128, 0, 0x40),
            "answers: {answers}"
        );
    }
}

/// The emergency that a node has sent at its start: its first five bytes.
fn told(rig: &mut NodeHost) -> Vec<Vec<u8>> {
    rig.of(0x89).into_iter().map(|data| data[..5].to_vec()).collect()
}

/// Fifty bits of one copy: told, and written again, and nothing is lost. Fifty of both copies: FAULT, or no number.
#[test]
fn bits_that_flip() {
    let eeprom = saved();
    let mut draw = Draw(35);
    for case in 0..100 {
        let (page, copy, bit) = (draw.below(9), draw.below(2), draw.below(8 * PAGE));
        let copies = if case % 2 == 0 { copy..copy + 1 } else { 0..2 };
        let mut flipped = eeprom.clone();
        for copy in copies {
            flipped[SETTINGS + (2 * page + copy) * PAGE + bit / 8] ^= 1 << (bit % 8);
        }
        let mut rig = started(&flipped, true);
        let place = format!("page {page}, bit {bit}, case {case}");
        if case % 2 == 1 && page == 0 {
            assert_silent(&mut rig);
            continue;
        }
        rig.node = 9;
        let one = case % 2 == 0;
        assert_eq!(told(&mut rig), [vec![0x10, 0x63, 0x21, u8::from(one), 255]], "{place}");
        assert_eq!(rig.status() & 0x6F, if one { 0x40 } else { 0x08 }, "{place}");
        if one {
            for (index, sub, value, _) in OBJECTS {
                assert_eq!(rig.read(index, sub), value, "{place}: {index:04X}h");
            }
            rig.run(20 * MILLISECOND);
            assert_eq!(rig.host.machine.board().at25().contents(), eeprom, "{place}");
        }
    }
}

/// The supply fails at a hundred moments of a save, of what is written behind it, and of a restore. All values are old,
/// or all are new, and there is no fault.
#[test]
fn supplies_that_fail() {
    let eeprom = saved();
    let mut seen = [0, 0, 0];
    for case in 0..100_u64 {
        let restores = case % 4 == 3;
        let mut rig = started(&eeprom, true);
        rig.node = 9;
        for (index, sub, _, value) in OBJECTS.into_iter().filter(|_| !restores) {
            rig.set(index, sub, value);
        }
        let request = if restores { (0x1011, b"load") } else { (0x1010, b"save") };
        let [low, high] = u16::to_le_bytes(request.0);
        let [a, b, c, d] = *request.1;
        rig.send(0x609, &[0x23, low, high, 1, a, b, c, d]);
        // All takes about 110 ms.
        rig.run(case * 1_200 * MICROSECOND);
        rig.host.machine.set_power(false);
        rig.run(10 * MILLISECOND);
        let left = rig.host.machine.board().at25().contents().to_vec();
        let mut rig = started(&left, true);
        let boot = rig.frames()[0].0;
        rig.node = (boot - 0x700) as u8;
        let found = OBJECTS.map(|(index, sub, ..)| rig.read(index, sub));
        let defaults = [1, 0, 128, 0, 500];
        let outcomes = [OBJECTS.map(|it| it.2), OBJECTS.map(|it| it.3), defaults];
        let which = outcomes.iter().position(|outcome| *outcome == found);
        seen[which.unwrap_or_else(|| panic!("case {case}: {found:?}"))] += 1;
        assert_eq!(rig.status() & 0x6F, 0x40, "case {case}");
    }
    assert!(seen.iter().all(|times| *times > 5), "{seen:?}");
}
