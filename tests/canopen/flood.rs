//! A bus that is full of frames for the node: the turn of each millisecond comes all the same.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::world::config::WorldConfig;
use tmcm::can::{CanFrame, ExtendedId, Frame, Id, StandardId};
use tmcm_sim::fleet::{Fleet, Heard, Node};
use tmcm_sim::{FirmwareKind, VirtualModule};

use common::random::Random;

/// The time of the flood.
const SPAN: Nanos = 500 * MILLISECOND;
/// Longest time for which frames of others, one behind the other, may hold up one of the node.
const HELD_UP: Nanos = 400 * MICROSECOND;

fn frame(id: u16, data: &[u8]) -> Frame {
    Frame::standard(id, data).unwrap()
}

/// The identifier of a frame of the node.
fn id(heard: &Heard) -> Option<u16> {
    let Id::Standard(id) = heard.frame.id() else { return None };
    (heard.from == Node::Module(0)).then_some(id.as_raw())
}

/// Index and sub-index in a request or in its reply.
fn address(frame: &Frame) -> Vec<u8> {
    frame.data()[1..4].to_vec()
}

#[test]
fn a_flood_at_full_load_keeps_the_turn_of_each_millisecond() {
    let mut fleet = Fleet::of(FirmwareKind::Canopen, &WorldConfig::default(), &[None], 1);
    // A heartbeat in each turn, and a PDO that acts with SYNC.
    for data in [[0x2B, 0x17, 0x10, 0, 1, 0, 0, 0], [0x2F, 0x02, 0x14, 2, 1, 0, 0, 0]] {
        fleet.send_can(0, frame(0x601, &data));
    }
    fleet.send_can(0, frame(0, &[1, 1]));
    fleet.run(10 * MILLISECOND);
    while fleet.can().is_some() {}
    let mut random = Random(7);
    let (mut asked, mut sent) = (Vec::new(), 0);
    let end = fleet.now() + SPAN;
    let mut heard = Vec::new();
    while fleet.now() < end {
        // The adapter never runs out of frames.
        while fleet.unsent_frames(0) < 20 {
            let next = match random.below(7) {
                0 => frame(0x80, &[]),
                1 => frame(0x201, &[6, 0]),
                2 => frame(0x401, &[6, 0, 1, 0, 0, 0]),
                3 => Frame::new_remote(StandardId::new(0x702).unwrap(), 1).unwrap(),
                4 => frame(0x702, &[5]),
                5 => Frame::new(ExtendedId::new(0x601).unwrap(), &[0x40, 0, 0x10, 0, 0, 0, 0, 0]).unwrap(),
                _ => {
                    let [low, high] = random.pick(&[0x6064_u16, 0x6041, 0x1001, 0x5FFF]).to_le_bytes();
                    asked.push(vec![low, high, 0]);
                    frame(0x601, &[0x40, low, high, 0, 0, 0, 0, 0])
                }
            };
            fleet.send_can(0, next);
            sent += 1;
        }
        fleet.run(MILLISECOND / 2);
        heard.extend(std::iter::from_fn(|| fleet.can()));
    }
    // The bus has been full.
    let bits: u64 = heard
        .iter()
        .map(|heard| if heard.frame.is_extended() { 67 } else { 47 } + 8 * heard.frame.data().len() as u64)
        .sum();
    assert!(bits * MICROSECOND > SPAN - 2 * MILLISECOND, "{bits} us");
    let beats = heard.iter().filter(|heard| id(heard) == Some(0x701));
    let beats: Vec<Nanos> = beats.map(|heard| heard.at).collect();
    assert!(beats.len() as u64 >= SPAN / MILLISECOND - 1, "{} heartbeats, {sent} frames", beats.len());
    let longest = beats.windows(2).map(|two| two[1] - two[0]).max().unwrap();
    assert!(longest < MILLISECOND + HELD_UP, "{longest} ns between two heartbeats");
    // One reply to each request, in their order.
    fleet.run(100 * MILLISECOND);
    heard.extend(std::iter::from_fn(|| fleet.can()));
    let replies = heard.iter().filter(|heard| id(heard) == Some(0x581)).map(|heard| address(&heard.frame));
    assert!(replies.eq(asked), "a request has not one reply");
    assert!(fleet.modules()[0].unread_frames() == 0);
}
