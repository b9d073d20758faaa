//! The very flash image, unmodified, on the emulated microcontroller: it boots, talks over RS485, moves the motor,
//! keeps what is stored, runs a program and restarts.

#![allow(clippy::unwrap_used, clippy::panic)]

#[path = "common/image.rs"]
mod build;

use std::sync::OnceLock;

use hal_sim::board::Board;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::{Character, Machine};
use hal_sim::world::config::WorldConfig;

const BAUD: u32 = 9_600;
/// Core cycles a microsecond.
const CYCLES_PER_MICROSECOND: u64 = 168;
/// Status codes of replies.
const OK: u8 = 100;
const LOADED: u8 = 101;

fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let (output, path) = build::image().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        std::fs::read(path).unwrap()
    })
}

/// A host on the RS485 bus.
struct Host {
    machine: Machine,
}

impl Host {
    fn new(world: &str) -> Self {
        let board = Board::new(&WorldConfig::parse(world).unwrap(), 0);
        let mut host = Host { machine: Machine::new(image(), board).unwrap() };
        host.run(100 * MILLISECOND);
        host
    }

    fn run(&mut self, span: Nanos) {
        self.machine.run(span).unwrap_or_else(|stop| panic!("{stop}\n{:?}", self.machine.take_log()));
    }

    /// Sends a request and waits for the reply: when the last bit of the request has ended, and the reply.
    fn exchange(&mut self, [command, kind, motor]: [u8; 3], value: i32) -> (Nanos, Vec<Character>) {
        let [a, b, c, d] = value.to_be_bytes();
        let mut telegram = [1, command, kind, motor, a, b, c, d, 0];
        telegram[8] = telegram.iter().fold(0, |sum, byte| sum + u32::from(*byte)) as u8;
        let end = self.machine.send(self.machine.now(), &telegram, BAUD);
        let mut reply = Vec::new();
        while reply.len() < 9 {
            assert!(self.machine.now() < end + 2 * SECOND, "no reply to {telegram:?}: {:?}", self.machine.take_log());
            self.run(MILLISECOND);
            reply.extend(self.machine.take_sent());
        }
        (end, reply)
    }

    /// Status and value of the reply to a request.
    fn ask(&mut self, request: [u8; 3], value: i32) -> (u8, i32) {
        let (_, reply) = self.exchange(request, value);
        assert!(reply.iter().all(|character| character.driven), "the transceiver sends from start to end");
        let bytes: Vec<u8> = reply.iter().map(|character| character.value).collect();
        let [host, module, status, command, a, b, c, d, checksum] = bytes[..] else { panic!("{bytes:?}") };
        assert_eq!((host, module, command), (2, 1, request[0]));
        assert_eq!(checksum, bytes[..8].iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
        (status, i32::from_be_bytes([a, b, c, d]))
    }

    /// As [`ask`](Self::ask), where nothing can go wrong.
    fn tell(&mut self, request: [u8; 3], value: i32) -> i32 {
        let (status, value) = self.ask(request, value);
        assert_eq!(status, OK, "{request:?}");
        value
    }

    fn rotor(&mut self) -> i64 {
        self.machine.board().world().motor().rotor()
    }
}

#[test]
fn boots_and_answers() {
    let mut host = Host::new("");
    assert_eq!(host.machine.core_clock(), 168_000_000);
    let log = host.machine.take_log();
    assert!(log.iter().any(|line| line.level == "info" && line.text == "module runs at address 1"), "{log:?}");
    assert!(host.machine.board().world().outputs().pull_ups);
    // GAP 4: the default speed, GGP 66: the address, and a command that there is none of.
    assert_eq!(host.tell([6, 4, 0], 0), 1_000);
    assert_eq!(host.tell([10, 66, 0], 0), 1);
    assert_eq!(host.ask([99, 0, 0], 0).0, 2);
    println!("stack: {} bytes, {:?}", host.machine.stack_used(), host.machine.counters());
}

#[test]
fn a_move_moves_the_motor() {
    let mut host = Host::new("");
    host.tell([5, 4, 0], 2_000);
    assert_eq!(host.tell([6, 4, 0], 0), 2_000);
    host.tell([4, 0, 0], 25_600);
    let start = host.machine.now();
    while host.tell([6, 8, 0], 0) == 0 {
        assert!(host.machine.now() < start + 5 * SECOND, "the motor does not arrive");
    }
    assert_eq!((host.rotor(), host.tell([6, 1, 0], 0)), (25_600, 25_600));
    host.tell([4, 1, 0], -1_000);
    host.run(2 * SECOND);
    assert_eq!(host.rotor(), 24_600);
}

#[test]
fn a_stop_switch_stops_the_motor() {
    let mut host = Host::new("[stage]\nright = 20000");
    // The right switch stops the motor.
    host.tell([5, 12, 0], 0);
    host.tell([1, 0, 0], 500);
    host.run(4 * SECOND);
    let rotor = host.rotor();
    assert!((20_000..20_100).contains(&rotor), "{rotor}");
    // GIO 2 in bank 0, the same pin.
    assert_eq!(host.tell([15, 2, 0], 0), 1);
}

#[test]
fn what_is_stored_survives_switching_off() {
    let mut host = Host::new("");
    host.tell([5, 4, 0], 1_234);
    host.tell([7, 4, 0], 0);
    host.tell([5, 5, 0], 77);
    host.machine.set_power(false);
    host.run(SECOND);
    let off = host.machine.now();
    host.machine.set_power(true);
    assert_eq!(host.machine.now(), off);
    host.run(200 * MILLISECOND);
    assert_eq!(host.tell([6, 4, 0], 0), 1_234);
    assert_ne!(host.tell([6, 5, 0], 0), 77);
    assert_eq!(host.machine.counters().starts, 2);
}

#[test]
fn a_program_is_loaded_and_runs() {
    let mut host = Host::new("");
    host.tell([132, 0, 0], 0);
    // SGP 20, 2, 1234; SIO 0, 2, 1; STOP.
    for (instruction, value) in [([9, 20, 2], 1_234), ([14, 0, 2], 1), ([28, 0, 0], 0)] {
        assert_eq!(host.ask(instruction, value).0, LOADED);
    }
    host.tell([133, 0, 0], 0);
    host.tell([129, 0, 0], 0);
    host.run(100 * MILLISECOND);
    assert_eq!(host.tell([10, 20, 2], 0), 1_234);
    assert!(host.machine.board().world().outputs().out[0]);
}

#[test]
fn a_reset_by_command_starts_anew_and_stops_the_motor() {
    let mut host = Host::new("");
    host.tell([1, 0, 0], 500);
    host.run(500 * MILLISECOND);
    host.tell([255, 0, 0], 1_234);
    host.run(200 * MILLISECOND);
    assert_eq!(host.machine.counters().starts, 2);
    let rotor = host.rotor();
    assert_ne!(rotor, 0);
    assert_eq!(host.tell([6, 3, 0], 0), 0);
    host.run(500 * MILLISECOND);
    assert_eq!(host.rotor(), rotor);
}

#[test]
fn the_same_run_again_is_the_same() {
    let run = || {
        let mut host = Host::new("");
        host.tell([1, 0, 0], 300);
        host.run(300 * MILLISECOND);
        let reply = host.exchange([6, 1, 0], 0);
        (reply, host.machine.counters(), host.rotor())
    };
    assert_eq!(run(), run());
}

/// How long the image takes from the last byte of a request to the first of the reply, and how busy it is. The
/// bounds are loose: this is to look at (`cargo test --test image_boot soon -- --nocapture`).
#[test]
fn replies_come_soon() {
    let mut host = Host::new("");
    let bit = SECOND / Nanos::from(BAUD);
    let requests = [
        ("GAP 5", [6, 5, 0], 0),
        ("GGP 66", [10, 66, 0], 0),
        ("unknown", [99, 0, 0], 0),
        ("GAP 1", [6, 1, 0], 0),
        ("SAP 4", [5, 4, 0], 1_000),
        ("MVP ABS", [4, 0, 0], 100),
        ("ROR", [1, 0, 0], 200),
        ("MST", [3, 0, 0], 0),
    ];
    for (name, request, value) in requests {
        let mut cycles: Vec<u64> = (0..21)
            .map(|n| {
                host.run(n * 137_000);
                let (end, reply) = host.exchange(request, value + n as i32);
                // The last byte is there in the middle of its stop bit.
                (reply[0].start - (end - bit / 2)) * CYCLES_PER_MICROSECOND / 1_000
            })
            .collect();
        cycles.sort_unstable();
        println!("{name}: {} cycles, {} to {}", cycles[10], cycles[0], cycles[20]);
        assert!(cycles[10] < 20_000);
    }
    for (name, request) in [("standing", [3, 0, 0]), ("moving", [1, 0, 0])] {
        host.tell(request, 500);
        let before = host.machine.counters();
        host.run(SECOND);
        let after = host.machine.counters();
        let awake = 1.0 - (after.asleep - before.asleep) as f64 / (after.cycles - before.cycles) as f64;
        println!("{name}: awake {:.1} %, {} instructions", awake * 100.0, after.instructions - before.instructions);
        assert!(awake < 0.5);
    }
    println!("stack: {} bytes", host.machine.stack_used());
}
