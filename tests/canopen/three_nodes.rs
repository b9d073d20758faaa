//! Three nodes on one bus of 1 Mbit/s, each with four PDOs in both directions, and a master that sends SYNC every 2.5
//! ms.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::world::config::WorldConfig;
use tmcm::can::{CanFrame, Frame, Id};
use tmcm_sim::FirmwareKind;
use tmcm_sim::fleet::{Fleet, Heard, Node};

use crate::driving::PV;

const NODES: u16 = 3;
const PERIOD: Nanos = 2_500 * MICROSECOND;
/// Cycles of a leg, in whose first half the motors reach their velocity.
const LEG: u16 = 200;
/// Least of the bus's time that is used, in percent.
const LOAD: Nanos = 85;

struct Master {
    fleet: Fleet,
}

impl Master {
    fn send(&mut self, id: u16, data: &[u8]) {
        self.fleet.send_can(0, Frame::standard(id, data).unwrap());
    }

    /// Writes an object of a node by SDO.
    fn write(&mut self, node: u16, index: u16, sub: u8, value: &[u8]) {
        let [low, high] = index.to_le_bytes();
        let mut request = [0x23 | (4 - value.len() as u8) << 2, low, high, sub, 0, 0, 0, 0];
        request[4..4 + value.len()].copy_from_slice(value);
        self.send(0x600 + node, &request);
        self.fleet.run(2 * MILLISECOND);
        let heard = self.heard();
        let replies = heard.iter().filter(|heard| id(heard) == 0x580 + node);
        let replies: Vec<u8> = replies.map(|heard| heard.frame.data()[0]).collect();
        assert_eq!(replies, [0x60], "{index:04X}h.{sub} of node {node}");
    }

    fn heard(&mut self) -> Vec<Heard> {
        std::iter::from_fn(|| self.fleet.can()).collect()
    }
}

fn id(heard: &Heard) -> u16 {
    let Id::Standard(id) = heard.frame.id() else { panic!("{heard:?}") };
    id.as_raw()
}

/// The velocity of a node: each has its own, and another one in the second leg.
fn velocity(node: u16, cycle: u16) -> i32 {
    i32::from(100 * node + 50 * (cycle / LEG))
}

#[test]
fn three_nodes_answer_each_sync_of_2_5_milliseconds() {
    let eeproms = [None; NODES as usize];
    let fleet = Fleet::of(FirmwareKind::Canopen, &WorldConfig::default(), &eeproms, 1);
    let mut master = Master { fleet };
    for node in 1..=NODES {
        for pdo in 0..4 {
            master.write(node, 0x1400 + pdo, 2, &[1]);
            master.write(node, 0x1800 + pdo, 2, &[1]);
        }
        master.write(node, 0x6060, 0, &[PV as u8]);
        for word in [6, 7, 0xF] {
            master.write(node, 0x6040, 0, &[word, 0]);
        }
    }
    master.send(0, &[1, 0]);
    master.fleet.run(10 * MILLISECOND);
    master.heard();

    let begin = master.fleet.now();
    let mut bits = 0;
    for cycle in 0..2 * LEG {
        master.send(0x80, &[]);
        for node in 1..=NODES {
            let [a, b, c, d] = velocity(node, cycle).to_le_bytes();
            master.send(0x200 + node, &[0xF, 0]);
            master.send(0x300 + node, &[0xF, 0, PV as u8]);
            master.send(0x400 + node, &[0xF, 0, 0, 0, 0, 0]);
            master.send(0x500 + node, &[0xF, 0, a, b, c, d]);
        }
        // What is left of the cycle has room for one SDO.
        let asked = 1 + cycle % NODES;
        master.send(0x600 + asked, &[0x40, 0x41, 0x60, 0, 0, 0, 0, 0]);
        master.fleet.run(PERIOD);

        let heard = master.heard();
        bits += heard.iter().map(|heard| 47 + 8 * heard.frame.data().len() as Nanos).sum::<Nanos>();
        let mut answers: Vec<(u16, Node)> = heard
            .iter()
            .filter(|heard| matches!(heard.from, Node::Module(_)))
            .map(|heard| (id(heard), heard.from))
            .collect();
        answers.sort_by_key(|(id, _)| *id);
        let pdos = [0x180, 0x280, 0x380, 0x480].into_iter().flat_map(|pdo| (1..=NODES).map(move |node| (pdo, node)));
        let expected: Vec<(u16, Node)> = pdos
            .chain([(0x580, asked)])
            .map(|(kind, node)| (kind + node, Node::Module(usize::from(node) - 1)))
            .collect();
        assert_eq!(answers, expected, "cycle {cycle}");
        for node in 1..=NODES {
            let answer = heard.iter().find(|heard| id(heard) == 0x480 + node).unwrap();
            let speed = i32::from_le_bytes(answer.frame.data()[2..].try_into().unwrap());
            assert!(speed == velocity(node, cycle) || cycle % LEG < LEG / 2, "cycle {cycle}, node {node}: {speed}");
        }
    }
    let used = bits * MICROSECOND * 100 / (master.fleet.now() - begin);
    assert!((LOAD..100).contains(&used), "{used} %");
}
