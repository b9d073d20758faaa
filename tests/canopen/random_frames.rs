//! Random frames of all kinds: the node goes on, answers each SDO request once, and an abort never; and its turn comes
//! each millisecond under a flood.

use crate::rig::{Rig, expedited};
use common::random::Random;
use hal_sim::clock::MICROSECOND;
use tmcm::can::{CanFrame, ExtendedId, Frame, StandardId};
use tmcm::canopen::Nmt;

/// Number of random frames that a test takes, which RANDOM_INPUTS in the environment changes.
fn count(usual: u64) -> u64 {
    std::env::var("RANDOM_INPUTS").map_or(usual, |text| text.parse().expect("RANDOM_INPUTS is not a number"))
}

/// Identifiers that mean something, and others.
const IDS: [u16; 16] =
    [0, 0x80, 0x81, 0x181, 0x201, 0x301, 0x401, 0x501, 0x601, 0x601, 0x601, 0x601, 0x581, 0x701, 0x77F, 0x7FF];
/// Indices that stand in requests.
const INDICES: [u16; 22] = [
    0x1000, 0x1005, 0x1008, 0x1010, 0x1014, 0x1016, 0x1017, 0x1023, 0x1029, 0x1400, 0x1403, 0x1600, 0x1801, 0x1A02,
    0x2003, 0x6083, 0x210B, 0x2700, 0x2701, 0x6040, 0x6060, 0x607A,
];

fn frame(random: &mut Random) -> Frame {
    let mut data = random.next().to_le_bytes();
    let id = if random.one_in(8) { random.below(0x800) as u16 } else { random.pick(&IDS) };
    let length = if random.one_in(4) { random.below(9) as usize } else { 8 };
    if id == 0x601 && !random.one_in(8) {
        data[0] =
            random.pick(&[0x40, 0x60, 0x70, 0x23, 0x2B, 0x2F, 0x22, 0x20, 0x21, 0x01, 0x11, 0x00, 0x07, 0x80, 0xA0]);
        if data[0] >= 0x20 {
            [data[1], data[2]] = random.pick(&INDICES).to_le_bytes();
            data[3] = random.below(6) as u8;
            if random.one_in(8) {
                data[0] = 0x23;
                [data[1], data[2]] = random.pick(&[0x1010_u16, 0x1011, 0x2706]).to_le_bytes();
                let signature: &[u8; 4] = random.pick(&[b"save", b"load", b"make"]);
                data[4..].copy_from_slice(signature);
            }
        }
    }
    if id == 0 {
        data[1] = random.pick(&[0, 1, 2]);
        data[0] = random.pick(&[1, 1, 1, 2, 0x80, 0x82, 3]);
    }
    if random.one_in(16) {
        return Frame::new_remote(StandardId::new(id).unwrap(), length).unwrap();
    }
    if random.one_in(16) {
        return Frame::new(ExtendedId::new(id.into()).unwrap(), &data[..length]).unwrap();
    }
    Frame::standard(id, &data[..length]).unwrap()
}

#[test]
fn each_request_gets_one_reply() {
    requests(Rig::new(), count(1_000_000));
}

#[test]
fn each_request_in_tmcl_mode_gets_one_reply() {
    let mut rig = Rig::new();
    assert_eq!(rig.sign(0x2700, 0, b"make"), Ok(()));
    requests(rig, count(1_000_000) / 10);
}

fn requests(mut rig: Rig, frames: u64) {
    let mut random = Random(0xCA_1301);
    // Whether the client waits for something to be saved.
    let mut owed = false;
    let (mut asked, mut saved) = (0, 0);
    for _ in 0..frames {
        let frame = frame(&mut random);
        let is = |id| Frame::standard(id, frame.data()) == Some(frame);
        let command = frame.data().first().copied().unwrap_or_default();
        let to_server = is(0x601) && rig.node.state() != Nmt::Stopped;
        let abort = command >> 5 == 4 && !frame.data().is_empty();
        rig.give(&frame);
        let replies = rig.of(0x581).len();
        assert!(replies <= usize::from(to_server && !abort), "{frame:02X?}");
        if to_server && !abort {
            asked += 1;
            if replies == 0 {
                assert!(
                    !owed && [*b"save", *b"load"].contains(&frame.bytes()[4..].try_into().unwrap()),
                    "{frame:02X?}"
                );
                owed = true;
            }
        }
        let reset = is(0) && frame.dlc() >= 2 && command == 0x82 && frame.data()[1] < 2;
        // Nobody waits any more.
        owed &= !(to_server && abort || reset || rig.node.state() == Nmt::Stopped);
        if random.one_in(10) {
            let span = if owed && random.one_in(4) { 50_000 } else { 1 + random.below(400) };
            rig.run(span * MICROSECOND);
            let replies = rig.of(0x581).len();
            assert!(replies <= usize::from(owed));
            owed &= replies == 0;
            saved += replies;
        }
    }
    assert!(asked > frames / 8 && saved as u64 > frames / 10_000, "{asked} {saved}");
    // It goes on.
    rig.wait(1_000);
    rig.send(0, &[0x82, 0]);
    rig.wait(2);
    rig.frames();
    assert_eq!(rig.read(0x1000, 0), 0x0004_0192);
    assert_eq!(rig.starts, 1);
}

/// A frame each 47 us: the turn of each millisecond comes, and so does the heartbeat.
#[test]
fn a_flood_at_full_bus_load() {
    let mut rig = Rig::operational();
    rig.set(0x1017, 0, 1);
    rig.set(0x1800, 2, 1);
    rig.frames();
    let mut random = Random(0xF100D);
    let mut turns = 0;
    for n in 0..20_000_u64 {
        match random.below(4) {
            0 => rig.send(0x601, &[0x40, 0x64, 0x60, 0, 0, 0, 0, 0]),
            1 => rig.send(0x401, &[0, 0, n as u8, 0, 0, 0]),
            2 => rig.send(0x80, &[]),
            _ => rig.send(0x601, &expedited(0x607A, 0, &[n as u8; 4])),
        }
        rig.run(47 * MICROSECOND);
        turns += rig.of(0x701).len();
    }
    let expected = 20_000 * 47 / 1000;
    assert!((expected - 2..=expected + 2).contains(&turns), "{turns}");
}
