//! PDOs in operation: what a received one does, what makes one be sent, and in which order frames leave.

use crate::rig::{Rig, expedited};
use hal_sim::clock::MILLISECOND;

/// The SYNC.
fn sync(rig: &mut Rig) {
    rig.send(0x80, &[]);
}

/// Changes the transmission type of a PDO that may be valid.
fn set_type(rig: &mut Rig, index: u16, kind: u8) {
    assert_eq!(rig.download(index, 2, &[kind]), Ok(()));
}

/// An RPDO with a statusword-like change: the mode of operation, which TPDO2 carries by 6061h.
fn change_mode(rig: &mut Rig, mode: u8) {
    rig.send(0x301, &[0, 0, mode]);
}

#[test]
fn the_default_pdos_that_are_received() {
    let mut rig = Rig::operational();
    rig.send(0x201, &[0x34, 0x12]);
    assert_eq!(rig.read(0x6040, 0), 0x1234);
    rig.send(0x301, &[0x35, 0x12, 3]);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x6060, 0)), (0x1235, 3));
    rig.send(0x401, &[0x36, 0x12, 0xFF, 0xFF, 0xFF, 0x7F]);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x607A, 0)), (0x1236, 0x7FFF_FFFF));
    rig.send(0x501, &[0x37, 0x12, 0xFE, 0xFF, 0xFF, 0xFF]);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x60FF, 0)), (0x1237, 0xFFFF_FFFE));
    // An identifier next to those of heartbeats.
    rig.set(0x1400, 1, 0x8000_0201);
    rig.set(0x1400, 1, 0x700);
    rig.send(0x700, &[0x38, 0x12]);
    assert_eq!(rig.read(0x6040, 0), 0x1238);
    rig.send(0x201, &[0x39, 0x12]);
    assert_eq!(rig.read(0x6040, 0), 0x1238);
    rig.set(0x1400, 1, 0x8000_0201);
    rig.set(0x1400, 1, 0x201);
    // Remote frames, and PDOs that are off, do nothing.
    rig.set(0x1400, 1, 0x8000_0201);
    rig.send(0x201, &[1, 0]);
    rig.send_remote(0x301, 3);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x6060, 0)), (0x1238, 3));
    assert!(rig.of(0x81).is_empty());
}

/// A PDO of another length has no effect but an emergency.
#[test]
fn short_and_long_pdos() {
    let mut rig = Rig::operational();
    for (length, code) in (0..9).map(|length| (length, if length < 6 { [0x10, 0x82] } else { [0x20, 0x82] })) {
        rig.send(0x401, &[1; 8][..length]);
        let emergency = [code[0], code[1], 0x11, 0, 255, 0, 0, 0];
        let expected = if length == 6 { vec![] } else { vec![emergency] };
        assert_eq!(rig.of(0x81), expected, "{length}");
        let value = if length >= 6 { 0x0101_0101 } else { 0 };
        assert_eq!(rig.read(0x607A, 0), value, "{length}");
    }
    // One that maps nothing is not looked at.
    rig.set(0x1402, 1, 0x8000_0401);
    rig.set(0x1602, 0, 0);
    rig.set(0x1402, 1, 0x401);
    rig.send(0x401, &[1; 3]);
    assert!(rig.of(0x81).is_empty());
}

/// Values that are refused change nothing; the others of the PDO act, the controlword too.
#[test]
fn refused_values() {
    let mut rig = Rig::operational();
    rig.send(0x301, &[0x34, 0x12, 4]);
    assert_eq!(rig.of(0x81), [[0x20, 0x63, 0x21, 0, 255, 0, 0, 0]]);
    assert_eq!((rig.read(0x6040, 0), rig.read(0x6060, 0)), (0x1234, 0));
    assert_eq!(rig.read(0x1001, 0), 0x21);
}

/// Transmission types up to F0h act at the next SYNC, with the data that came last; the others at once.
#[test]
fn synchronous_reception() {
    for kind in [0, 1, 2, 0xF0, 0xFE, 0xFF] {
        let mut rig = Rig::operational();
        set_type(&mut rig, 0x1401, kind);
        change_mode(&mut rig, 1);
        change_mode(&mut rig, 3);
        assert_eq!(rig.read(0x6060, 0), if kind > 0xF0 { 3 } else { 0 }, "{kind:02X}h");
        sync(&mut rig);
        rig.wait(1);
        assert_eq!(rig.read(0x6060, 0), 3, "{kind:02X}h");
        // Once.
        rig.set(0x6060, 0, 6);
        sync(&mut rig);
        rig.wait(1);
        assert_eq!(rig.read(0x6060, 0), 6);
        // What came before the node left operation is forgotten.
        if kind <= 0xF0 {
            change_mode(&mut rig, 1);
            rig.command(0x80);
            rig.command(1);
            sync(&mut rig);
            rig.wait(1);
            assert_eq!(rig.read(0x6060, 0), 6);
        }
    }
    for kind in [0xF1, 0xFD] {
        let mut rig = Rig::new();
        assert_eq!(rig.download(0x1400, 2, &[kind]), Err(0x0609_0030));
        assert_eq!(rig.download(0x1800, 2, &[kind]), Err(0x0609_0030));
    }
}

/// A PDO that a SYNC has released acts in the next poll, which is due at once; data that come after the SYNC wait for
/// the next one.
#[test]
fn released_pdos_act_in_the_poll_after_the_sync() {
    let mut rig = Rig::operational();
    set_type(&mut rig, 0x1401, 1);
    rig.wait(1);
    change_mode(&mut rig, 1);
    assert!(rig.node.deadline() > rig.now());
    sync(&mut rig);
    assert!(rig.node.deadline() <= rig.now());
    change_mode(&mut rig, 3);
    rig.run(MILLISECOND / 10);
    assert_eq!(rig.read(0x6060, 0), 1);
    sync(&mut rig);
    rig.run(MILLISECOND / 10);
    assert_eq!(rig.read(0x6060, 0), 3);
}

#[test]
fn each_asynchronous_pdo_is_sent_on_entering_operation() {
    let mut rig = Rig::new();
    rig.wait(5);
    rig.frames();
    for _ in 0..3 {
        rig.command(1);
        rig.wait(100);
        assert_eq!(rig.frames(), [(0x181, vec![0x50, 2]), (0x281, vec![0x50, 2, 0])]);
        rig.command(1);
        rig.wait(10);
        assert!(rig.frames().is_empty());
        rig.command(0x80);
    }
    // All four, also those without a change, and those of type 0 with the SYNC.
    set_type(&mut rig, 0x1802, 0xFE);
    set_type(&mut rig, 0x1803, 0);
    rig.frames();
    rig.command(1);
    rig.wait(10);
    assert_eq!(rig.frames().iter().map(|(id, _)| *id).collect::<Vec<_>>(), [0x181, 0x281, 0x381]);
    sync(&mut rig);
    sync(&mut rig);
    assert_eq!(rig.frames(), [(0x481, vec![0x50, 2, 0, 0, 0, 0])]);
}

/// The PDO that a frame has caused leaves before the reply to a later one.
#[test]
fn a_change_leaves_before_the_next_reply() {
    let mut rig = Rig::operational();
    change_mode(&mut rig, 6);
    rig.send(0x601, &[0x40, 0x61, 0x60, 0, 0, 0, 0, 0]);
    rig.send(0x601, &expedited(0x6060, 0, &[1]));
    rig.send(0x601, &[0x40, 0x61, 0x60, 0, 0, 0, 0, 0]);
    let frames = rig.frames();
    let read = |mode| (0x581, vec![0x4F, 0x61, 0x60, 0, mode, 0, 0, 0]);
    // In homing mode bit 10 of the statusword is set, because no homing is under way; so TPDO1 goes out as well.
    let word = |mode| if mode == 6 { 6 } else { 2 };
    let first = |mode| (0x181, vec![0x50, word(mode)]);
    let sent = |mode| (0x281, vec![0x50, word(mode), mode]);
    let written = (0x581, vec![0x60, 0x60, 0x60, 0, 0, 0, 0, 0]);
    assert_eq!(frames, [first(6), sent(6), read(6), first(1), sent(1), written, read(1)]);
    // What does not change causes nothing.
    change_mode(&mut rig, 1);
    rig.wait(10);
    assert!(rig.frames().is_empty());
}

#[test]
fn cyclic_pdos_come_with_each_nth_sync() {
    for n in [1, 2, 5, 0xF0] {
        let mut rig = Rig::operational();
        set_type(&mut rig, 0x1802, n);
        let mut counts = Vec::new();
        for _ in 0..3 * u32::from(n) {
            sync(&mut rig);
            counts.push(rig.of(0x381).len());
        }
        let expected: Vec<_> = (1..=3 * u32::from(n)).map(|k| usize::from(k % u32::from(n) == 0)).collect();
        assert_eq!(counts, expected, "type {n}");
    }
    // Another COB-ID, a SYNC with a counter; not the old one, and no remote frame.
    let mut rig = Rig::operational();
    rig.set(0x1005, 0, 0x99);
    rig.send(0x80, &[]);
    rig.send_remote(0x99, 0);
    assert!(rig.of(0x381).is_empty());
    rig.send(0x99, &[7]);
    assert_eq!(rig.of(0x381).len(), 1);
}

/// Type 0 is sent with the next SYNC after a change.
#[test]
fn acyclic_synchronous_pdos() {
    let mut rig = Rig::operational();
    set_type(&mut rig, 0x1801, 0);
    sync(&mut rig);
    assert_eq!(rig.of(0x281).len(), 1);
    sync(&mut rig);
    change_mode(&mut rig, 1);
    rig.wait(5);
    assert!(rig.of(0x281).is_empty());
    sync(&mut rig);
    assert_eq!(rig.of(0x281), [[0x50, 2, 1]]);
    sync(&mut rig);
    assert!(rig.of(0x281).is_empty());
}

#[test]
fn the_event_timer_sends_again_and_again() {
    for kind in [0xFE, 0xFF, 1] {
        let mut rig = Rig::operational();
        set_type(&mut rig, 0x1800, kind);
        rig.wait(3);
        rig.set(0x1800, 5, 25);
        rig.frames();
        rig.wait(1000);
        let sent = rig.of(0x181);
        if kind == 1 {
            assert!(sent.is_empty());
            continue;
        }
        assert!((39..=41).contains(&sent.len()) && sent.iter().all(|data| *data == [0x50, 2]), "{}", sent.len());
        rig.command(0x80);
        rig.wait(100);
        assert!(rig.of(0x181).is_empty());
        rig.command(1);
        rig.set(0x1800, 5, 0);
        rig.frames();
        rig.wait(100);
        assert!(rig.of(0x181).is_empty());
    }
}

/// Within the inhibit time a PDO is not sent again; after it, once with the last change.
#[test]
fn the_inhibit_time_holds_changes_back() {
    let mut rig = Rig::operational();
    rig.set(0x1801, 3, 20);
    rig.wait(30);
    rig.frames();
    change_mode(&mut rig, 1);
    assert_eq!(rig.of(0x281), [[0x50, 2, 1]]);
    rig.wait(5);
    change_mode(&mut rig, 2);
    change_mode(&mut rig, 3);
    rig.wait(10);
    assert!(rig.of(0x281).is_empty());
    rig.wait(6);
    assert_eq!(rig.of(0x281), [[0x50, 2, 3]]);
    rig.wait(100);
    assert!(rig.of(0x281).is_empty());
    // The event timer keeps it, too.
    rig.set(0x1801, 5, 5);
    rig.frames();
    rig.wait(200);
    assert!((9..=11).contains(&rig.of(0x281).len()));
}

/// Readings trigger one PDO in a turn at most, however often frames come in between.
#[test]
fn readings_trigger_once_in_a_turn() {
    let mut rig = Rig::operational();
    rig.set(0x1802, 1, 0x8000_0381);
    rig.set(0x1A02, 0, 0);
    rig.set(0x1A02, 1, 0x270E_0120);
    rig.set(0x1A02, 2, 0x2702_0020);
    rig.set(0x1A02, 0, 2);
    set_type(&mut rig, 0x1802, 0xFF);
    rig.set(0x1802, 1, 0x381);
    rig.wait(5);
    rig.frames();
    for n in 0_u16..20 {
        rig.control(&format!("analog 0 {}", 100 + n));
        rig.control(&format!("input 1 {}", n % 2));
        for _ in 0..10 {
            rig.send(0x601, &[0x40, 0x02, 0x27, 0, 0, 0, 0, 0]);
        }
        rig.wait(1);
        for _ in 0..10 {
            rig.send(0x601, &[0x40, 0x02, 0x27, 0, 0, 0, 0, 0]);
        }
        let [low, high] = (100 + n).to_le_bytes();
        assert_eq!(rig.of(0x381), [[low, high, 0, 0, 0, 0, (n as u8 % 2) << 1, 0]], "{n}");
    }
}

/// A change of the statusword is told in the turn in which it comes, also if nothing else changes then. Here it is bit
/// 10, when the motor has been in its window for 6068h, and when the target is another.
#[test]
fn a_change_of_the_statusword_is_told_in_its_turn() {
    for time in 20..30 {
        let mut rig = Rig::enabled(1);
        rig.set(0x6067, 0, 100);
        rig.set(0x6068, 0, time);
        let mut changes = 0;
        for target in [2_000, -2_000] {
            rig.go(target);
            rig.of(0x181);
            let mut before = rig.status();
            for turn in 0..600 {
                rig.wait(1);
                let sent = rig.of(0x181);
                let status = rig.status();
                let told: Vec<u8> = status.to_le_bytes()[..2].to_vec();
                assert_eq!(
                    sent.last() == Some(&told),
                    status != before,
                    "turn {turn}: {before:X}h, {status:X}h, {sent:X?}"
                );
                changes += i32::from(status != before);
                before = status;
            }
        }
        assert!(changes >= 4, "{changes}");
    }
}
