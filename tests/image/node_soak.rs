//! Endurance of the CANopen image: the motor goes to and fro by PDOs on a bus that is busy for four fifths of the time.
//!
//! A minute of virtual time, or with `SOAK=1` an hour. In each cycle of about 5 ms the master sends four PDOs, the SYNC
//! and an SDO request, and other nodes talk to each other before and behind. Nothing of it may be lost, and the
//! firmware runs on without a restart.

use std::env;

use common::node_host::{ENABLE, NodeHost, PV};
use common::random::Random;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// Half of the most by which a cycle is longer or shorter than [`CYCLE`], in microseconds: so the SYNC meets the turn
/// of each millisecond at all distances.
const JITTER: Nanos = 500;
const CYCLE: Nanos = 5 * MILLISECOND;
/// Of 100 bits the bus carries so many, within a few.
const LOAD: Nanos = 80;
/// Bits of what the node sends in a cycle: PDOs of 2, 3, 6 and 6 bytes, and an SDO reply.
const ANSWERS: Nanos = 4 * 47 + 8 * (2 + 3 + 6 + 6) + 47 + 64;
/// Cycles between two turns of the motor, in which it reaches its velocity.
const LEG: u64 = 100;
/// Period of the heartbeat, in milliseconds.
const HEARTBEAT: u32 = 100;
/// Objects that are asked for, with their values, if they do not change.
const OBJECTS: [(u16, Option<u32>); 5] =
    [(0x1000, Some(0x0004_0192)), (0x1001, Some(0)), (0x6041, None), (0x6064, None), (0x6060, Some(PV))];

/// Counts of what has happened.
#[derive(Debug, Default)]
struct Tally {
    cycles: u64,
    bits: Nanos,
    heartbeats: u64,
    turns: u64,
    least: i32,
    most: i32,
}

fn bits(length: usize) -> Nanos {
    47 + 8 * length as Nanos
}

fn number(bytes: &[u8]) -> i32 {
    i32::from_le_bytes(bytes.try_into().unwrap())
}

/// A frame from one of other nodes to another; it may look much like one for the node.
fn noise(random: &mut Random) -> (u32, Vec<u8>) {
    let node = 2 + random.below(126) as u32;
    let kind = random.pick(&[0x180, 0x200, 0x300, 0x400, 0x500, 0x580, 0x600, 0x580, 0x600, 0x700]);
    let length = match kind {
        0x700 => 1,
        0x580 | 0x600 => 8,
        _ => 1 + random.below(8) as usize,
    };
    (kind + node, (0..length).map(|_| random.below(256) as u8).collect())
}

/// Carries out one cycle: sends all that has to be sent in it, and checks what the node answers. The velocity is that
/// at which the motor is to turn; it has to do so already if `attained`.
fn cycle(rig: &mut NodeHost, random: &mut Random, velocity: i32, attained: bool, tally: &mut Tally) {
    let span = CYCLE - JITTER * MICROSECOND + random.below(2 * JITTER) * MICROSECOND;
    let budget = span / MICROSECOND * LOAD / 100;
    let mut used = ANSWERS;
    let mut send = |rig: &mut NodeHost, id: u32, data: &[u8]| {
        rig.send(id, data);
        used += bits(data.len());
        used
    };
    let word = ENABLE as u8;
    let [a, b, c, d] = velocity.to_le_bytes();
    let (object, value) = random.pick(&OBJECTS);
    let [low, high] = object.to_le_bytes();
    // What others have to say comes behind and, in half of the bus's time, before.
    let before = random.below(budget / 2);
    loop {
        let (id, data) = noise(random);
        if send(rig, id, &data) >= before {
            break;
        }
    }
    send(rig, 0x201, &[word, 0]);
    send(rig, 0x301, &[word, 0, PV as u8]);
    send(rig, 0x401, &[word, 0, 0, 0, 0, 0]);
    send(rig, 0x501, &[word, 0, a, b, c, d]);
    send(rig, 0x80, &[]);
    send(rig, 0x601, &[0x40, low, high, 0, 0, 0, 0, 0]);
    loop {
        let (id, data) = noise(random);
        if send(rig, id, &data) >= budget {
            break;
        }
    }
    tally.bits += used;
    rig.run(span);

    let mut frames = rig.frames();
    tally.heartbeats += frames.iter().filter(|frame| **frame == (0x701, vec![5])).count() as u64;
    frames.retain(|(id, _)| *id != 0x701);
    let ids: Vec<u32> = frames.iter().map(|(id, _)| *id).collect();
    let at = tally.cycles;
    assert_eq!(ids, [0x181, 0x281, 0x381, 0x481, 0x581], "cycle {at}: {frames:02X?}, {:?}", rig.host.log());
    for (id, data) in &frames[..4] {
        assert_eq!(data[0] & 0x6F, 0x27, "cycle {at}, {id:X}h: operation enabled: {frames:02X?}");
    }
    assert_eq!(frames[1].1[2], PV as u8);
    let position = number(&frames[2].1[2..]);
    (tally.least, tally.most) = (tally.least.min(position), tally.most.max(position));
    if attained {
        assert_eq!(number(&frames[3].1[2..]), velocity, "cycle {at}");
    }
    let reply = &frames[4].1;
    assert_eq!((reply[0] & 0xF3, &reply[1..4]), (0x43, &[low, high, 0][..]), "cycle {at}: {reply:02X?}");
    if let Some(value) = value {
        assert_eq!(number(&reply[4..]), value as i32, "cycle {at}: {object:04X}h");
    }
    tally.cycles += 1;
}

#[test]
fn nothing_is_lost_on_a_busy_bus_while_the_motor_goes_to_and_fro() {
    let hours = env::var("SOAK").ok().map(|text| text.parse::<u64>().expect("SOAK is not a number of hours"));
    let span = hours.map_or(60 * SECOND, |hours| hours * 3_600 * SECOND);
    let mut rig = NodeHost::new("");
    rig.set(0x1017, 0, HEARTBEAT);
    for pdo in 0..4 {
        rig.set(0x1400 + pdo, 2, 1);
        rig.set(0x1800 + pdo, 2, 1);
    }
    rig.enable(PV);
    rig.command(1);
    rig.run(10 * MILLISECOND);
    rig.frames();
    rig.host.log();

    let mut random = Random(1);
    let mut tally = Tally::default();
    let (begin, starts) = (rig.host.machine.now(), rig.host.machine.counters().starts);
    let mut velocity = 0;
    while rig.host.machine.now() < begin + span {
        let place = tally.cycles % LEG;
        if place == 0 {
            let speed = 200 + random.below(800) as i32;
            velocity = if velocity > 0 { -speed } else { speed };
            tally.turns += 1;
        }
        cycle(&mut rig, &mut random, velocity, place > LEG / 2, &mut tally);
        if tally.cycles.is_multiple_of(60 * LEG) {
            println!("{} s: {tally:?}", (rig.host.machine.now() - begin) / SECOND);
        }
    }
    let passed = rig.host.machine.now() - begin;
    println!("{tally:?}");
    assert_eq!((rig.host.machine.counters().starts, rig.host.log()), (starts, vec![]));
    let load = tally.bits * MICROSECOND * 100 / passed;
    assert!((LOAD - 1..LOAD + 5).contains(&load), "the bus is busy for {load} % of the time");
    let beats = passed / MILLISECOND / Nanos::from(HEARTBEAT);
    assert!(tally.heartbeats.abs_diff(beats) <= 1 + passed / SECOND / 100, "{} of {beats}", tally.heartbeats);
    assert!(tally.turns >= passed / SECOND && tally.most - tally.least > 5_000, "{tally:?}");
    assert_eq!(rig.emergencies(), []);
}
