//! The times of arrivals do not depend on how the owner of a fleet slices time.

use std::fmt::Write as _;

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::control::State;
use tmcm::can::CanFrame;
use tmcm_sim::{FirmwareKind, VirtualModule};

use super::rig::{ADAPTER, HOST, Paused, sdo_read, sdo_write, telegram, tmcl_frame};

/// How time is let pass.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Slices {
    /// In one piece.
    Whole,
    /// In pieces of equal length.
    Equal(Nanos),
    /// In pieces of random length up to this, from a seed.
    Random(Nanos, u64),
    /// From event to event.
    Events,
}

impl Slices {
    /// All the ways that are compared.
    pub(crate) const ALL: [Slices; 5] = [
        Slices::Equal(MILLISECOND),
        Slices::Equal(137 * MICROSECOND + 1),
        Slices::Random(3 * MILLISECOND, 1),
        Slices::Random(150 * MICROSECOND, 2),
        Slices::Events,
    ];

    /// The next time to stop at, on the way to `to`.
    fn next<M: VirtualModule>(&mut self, paused: &Paused<M>, to: Nanos) -> Nanos {
        let now = paused.fleet.now();
        let next = match self {
            Slices::Whole => to,
            Slices::Equal(length) => now + *length,
            Slices::Random(longest, seed) => {
                *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                now + 1 + (*seed >> 33) % *longest
            }
            Slices::Events => paused.fleet.next_event().unwrap_or(to).max(now + 1),
        };
        next.min(to)
    }
}

/// A fleet with a record of all that comes from it.
pub(crate) struct Recorded<M> {
    paused: Paused<M>,
    slices: Slices,
    record: String,
}

impl<M: VirtualModule> Recorded<M> {
    pub(crate) fn new(paused: Paused<M>, slices: Slices) -> Self {
        Recorded { paused, slices, record: String::new() }
    }

    /// Takes what has come.
    fn take(&mut self) {
        for sent in self.paused.sent() {
            let _ = writeln!(self.record, "{} usb {:?}", sent.at, sent.bytes);
        }
        for byte in self.paused.fleet.rs485() {
            let _ = writeln!(self.record, "rs485 {byte}");
        }
        while let Some(heard) = self.paused.fleet.can() {
            let _ =
                writeln!(self.record, "{} {:?} {:?} {:?}", heard.at, heard.from, heard.frame.id(), heard.frame.data());
        }
    }

    /// Lets time pass.
    pub(crate) fn run(&mut self, span: Nanos) {
        let end = self.paused.fleet.now() + span;
        while self.paused.fleet.now() < end {
            let to = self.slices.next(&self.paused, end);
            self.paused.fleet.run_until(to);
            self.take();
        }
    }

    /// Serves all that is outstanding.
    pub(crate) fn serve(&mut self) {
        loop {
            let far = self.paused.fleet.now() + 10_000 * MILLISECOND;
            let latest = self.slices.next(&self.paused, far);
            if !self.paused.fleet.serve(latest) {
                break;
            }
            self.take();
        }
        let _ = writeln!(self.record, "{} served, {} answered", self.paused.fleet.now(), self.paused.fleet.answered());
    }

    pub(crate) fn usb(&mut self, line: &str) {
        self.paused.fleet.hear_usb(HOST, &telegram(1, line));
        self.serve();
    }

    pub(crate) fn rs485(&mut self, address: u8, line: &str) {
        self.paused.fleet.send_rs485(&telegram(address, line));
        self.serve();
    }

    pub(crate) fn can(&mut self, frame: tmcm::can::Frame) {
        self.paused.fleet.send_can(ADAPTER, frame);
        self.serve();
    }

    pub(crate) fn at(&mut self, delay: Nanos, line: &str) {
        self.paused.at(delay, line);
    }

    /// All that has come, and what the modules are like at the end.
    pub(crate) fn end(mut self) -> String {
        self.take();
        for module in self.paused.fleet.modules_mut() {
            let board = module.board_mut();
            let _ = writeln!(self.record, "{:?}", State::of(&board));
            let digest = board
                .at25()
                .contents()
                .iter()
                .fold(0_u64, |digest, byte| digest.wrapping_mul(1_099_511_628_211) ^ u64::from(*byte));
            let _ = writeln!(self.record, "EEPROM {digest:x}");
        }
        self.record
    }
}

/// Compares the records of several ways to slice time with that of time in one piece; gives the record.
pub(crate) fn compared(others: &[Slices], run: impl Fn(Slices) -> String) -> String {
    let expected = run(Slices::Whole);
    for slices in others.iter().copied() {
        let record = run(slices);
        let differs = expected.lines().zip(record.lines()).find(|(left, right)| left != right);
        assert!(record == expected, "{slices:?}: {differs:?}");
    }
    expected
}

/// Traffic of modules with the TMCL firmware on all links, of which some is served and some comes meanwhile, with
/// events of the world.
pub(crate) fn tmcl_traffic<M: VirtualModule>(recorded: &mut Recorded<M>, others: &[u8]) {
    recorded.usb("SAP 4, 0, 500");
    recorded.usb("138, 0, 0, 1");
    recorded.usb("MVP REL, 0, 3000");
    recorded.at(3 * MILLISECOND + 7, "load 0.2");
    recorded.at(21 * MILLISECOND + 1, "press left");
    recorded.at(61 * MILLISECOND + 500, "release left");
    for address in others {
        recorded.rs485(*address, "ROR 0, 300");
        recorded.can(tmcl_frame((*address).into(), "GAP 1, 0"));
    }
    recorded.run(13 * MILLISECOND + 333);
    recorded.usb("GAP 1, 0");
    recorded.paused.fleet.hear_usb(HOST, &[telegram(1, "GAP 1, 0"), telegram(1, "GAP 3, 0")].concat());
    recorded.paused.fleet.send_rs485(&telegram(1, "GAP 1, 0"));
    recorded.run(5 * MILLISECOND);
    recorded.usb("SGP 5, 2, 77");
    recorded.usb("STGP 5, 2");
    for address in others {
        recorded.rs485(*address, "GAP 1, 0");
        recorded.rs485(99, "GAP 1, 0");
    }
    recorded.at(2 * MILLISECOND + 300 * MICROSECOND, "power off");
    recorded.at(9 * MILLISECOND, "power on");
    recorded.usb("SGP 6, 2, 78");
    recorded.usb("STGP 6, 2");
    recorded.run(30 * MILLISECOND);
    recorded.usb("GGP 6, 2");
    recorded.run(20 * MILLISECOND + 1);
}

#[test]
fn of_modules_with_tmcl() {
    let record = compared(&Slices::ALL, |slices| {
        let mut recorded = Recorded::new(Paused::of(FirmwareKind::Tmcl, 3), slices);
        tmcl_traffic(&mut recorded, &[1, 3]);
        recorded.end()
    });
    // It has been a run with content.
    assert!(record.matches("usb").count() > 8 && record.matches("rs485").count() >= 45, "{record}");
    assert!(record.contains("Module(2)"), "{record}");
}

/// Traffic of CANopen nodes: heartbeats, PDOs and SDOs.
pub(crate) fn canopen_traffic<M: VirtualModule>(recorded: &mut Recorded<M>, nodes: u16) {
    recorded.run(10 * MILLISECOND);
    for node in 1..=nodes {
        recorded.can(sdo_write(node, 0x1017, 0, &[2, 0]));
    }
    recorded.can(tmcm::can::Frame::standard(0, &[1, 0]).unwrap());
    recorded.run(7 * MILLISECOND + 99);
    for index in [0x6041, 0x6064, 0x1000, 0x5FFF] {
        recorded.can(sdo_read(1, index, 0));
        recorded.run(MILLISECOND / 3);
    }
    recorded.at(4 * MILLISECOND + 3, "can passive");
    recorded.at(8 * MILLISECOND + 3, "can on");
    recorded.can(sdo_read(nodes + 5, 0x1000, 0));
    recorded.can(sdo_write(1, 0x6083, 0, &[1, 2, 0, 0]));
    recorded.can(sdo_write(1, 0x1010, 1, b"save"));
    recorded.run(30 * MILLISECOND);
}

#[test]
fn of_canopen_nodes() {
    let record = compared(&Slices::ALL, |slices| {
        let mut recorded = Recorded::new(Paused::of(FirmwareKind::Canopen, 2), slices);
        canopen_traffic(&mut recorded, 2);
        recorded.end()
    });
    assert!(record.matches("Module(1)").count() > 10, "{record}");
}
