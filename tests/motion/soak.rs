//! Soak: random moves, rotations, reference searches, programs, faults and power cuts, one after another, across the
//! points where a counter of milliseconds changes its sign or wraps. Each of them has to do with one axis; on a product
//! with several, the others may be on their way meanwhile. After each of them rotor, chip and firmware agree on where
//! each motor is, the tick timer on how late it is, and the EEPROM has what was acknowledged.
//!
//! `cargo test --test motion soak` takes seconds; `SOAK=3 cargo test --release --test motion soak` goes on for three
//! hours. Each life of a module is that of a seed, which is printed: `SEED=17 cargo test --test motion soak` lives that
//! life again.

mod events;

use std::collections::BTreeMap;
use std::time::{Duration, Instant, UNIX_EPOCH};

use common::Bench;
use common::random::Random;
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::units::Micros;
use tmcm_sim::{NativeModule, Product, VirtualModule};

/// Lives of axes of each product in a usual run.
const LIVES: u64 = 48;
/// Number of events in one life.
const EVENTS: usize = 40;

/// Where the switches are; the motor may pass them.
const LEFT: i64 = -150_000;
const RIGHT: i64 = 150_000;
const HOME: i64 = 21_000;
const WORLD: &str = "[motor]\nfriction = 0.1\n[stage]\nleft = -150000\nright = 150000\nhome = [20000, 22000]\nhard_left = -900000\n\
     hard_right = 900000\n";

/// In milliseconds: a signed and an unsigned 32-bit number end there. The third is where one of microseconds does.
const EDGES: [u64; 4] = [1 << 31, 1 << 32, (1 << 32) / 1000, 0];

/// Settings that are made after each start. Speeds and accelerations are nearly the same on all products.
const SETTINGS: [&str; 4] = ["6, #, 255", "4, #, 2047", "154, #, 2", "5, #, 1500"];
const SETTINGS_3212: [&str; 7] =
    ["6, #, 255", "4, #, 124940", "5, #, 1400000", "17, #, 1400000", "18, #, 1400000", "12, #, 1", "13, #, 1"];
/// A unit of speed in pps with the pulse divisor 2: 16 MHz / (2^2 * 2048 * 32).
const PPS: u64 = 61;

/// Bits of the tick timer.
const BITS_31: u64 = (1 << 31) - 1;

/// A module in its life.
struct Life {
    bench: Bench,
    random: Random,
    /// When the firmware was started, and how far the edge was then.
    started: Nanos,
    edge: Nanos,
    /// True if the module has gone across the edge.
    crossed: bool,
    /// The axis that something happens to.
    axis: usize,
    /// Rotor minus position of each axis, while no step is lost.
    origins: Vec<i64>,
    /// When the tick timer was zero: after this time, or so long before it.
    ticks: (Nanos, u64),
    /// User variables as acknowledged; the second value is one whose acknowledgement was cut off.
    stored: BTreeMap<u64, (i32, Option<i32>)>,
}

impl Life {
    fn new(product: Product, seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let config = WorldConfig::parse_for(product.kind(), WORLD).unwrap();
        let edge = random.pick(&EDGES);
        // Within the first ten seconds the edge is there.
        let ahead = random.below(10_000).min(edge);
        let clock = (edge - ahead) * 1000;
        println!("{}, seed {seed}: the clock starts at {clock} us", product.name());
        let module = NativeModule::with_clock(product, &config, None, seed as u32, Micros(clock));
        let bench = Bench { module };
        let (started, edge, stored) = (bench.module.now(), ahead * MILLISECOND, BTreeMap::new());
        let origins = vec![0; product.spec().axes.into()];
        let ticks = (started, 0);
        let mut life = Life { bench, random, started, edge, crossed: false, axis: 0, origins, ticks, stored };
        life.bench.run(MILLISECOND);
        life.settings();
        life
    }

    /// Lives, and says whether it has gone across its edge.
    fn live(mut self) -> bool {
        for _ in 0..EVENTS {
            self.others_move();
            match self.random.below(20) {
                0..=5 => self.moves(),
                6 | 7 => self.rotates(),
                8 | 9 => self.searches(),
                10 | 11 => self.waits_in_a_program(),
                12 => self.counts_in_a_program(),
                13 => self.stores(),
                14 => self.is_renumbered(),
                15 => self.is_disturbed(),
                16 => self.stalls(),
                17 => self.is_locked(),
                18 => self.loses_power(),
                _ => self.is_restarted(),
            }
            self.check();
        }
        self.crossed
    }

    fn axes(&self) -> std::ops::Range<usize> {
        0..self.origins.len()
    }

    /// The next event is that of some axis. Of the others some are sent somewhere; or three axes, this one perhaps
    /// among them, are on a straight line.
    fn others_move(&mut self) {
        self.axis = self.random.below(self.origins.len() as u64) as usize;
        if self.origins.len() > 1 && self.random.one_in(3) {
            let lines = [0b111, 0b10_1010, 0b11_1000, 0b10_0101];
            let line = if self.origins.len() == 3 { lines[0] } else { self.random.pick(&lines) };
            for axis in self.axes() {
                let target = self.place() + self.origin() - self.origins[axis];
                self.bench.ok(&format!("SCO 1, {axis}, {target}"));
            }
            self.bench.ok(&format!("MVP COORD, {}, 1", 0x40 | line));
            return;
        }
        for other in self.axes() {
            if other != self.axis && self.random.one_in(2) {
                let target = self.place() + self.origin() - self.origins[other];
                self.bench.ok(&format!("MVP ABS, {other}, {target}"));
            }
        }
    }

    /// Carries out a command, in which `#` is the axis, and gives its value.
    fn ok(&mut self, line: &str) -> i32 {
        self.bench.ok(&line.replace('#', &self.axis.to_string()))
    }

    /// Lets time pass until a command, in which `#` is the axis, gives a value.
    fn until(&mut self, limit: Nanos, line: &str, value: i32) {
        let line = line.replace('#', &self.axis.to_string());
        self.bench.run_until(limit, |bench| bench.ok(&line) == value);
    }

    /// Makes the settings that follow each start.
    fn settings(&mut self) {
        for axis in self.axes() {
            let settings = if self.is_3212() { &SETTINGS_3212[..] } else { &SETTINGS };
            for setting in settings {
                self.bench.ok(&format!("SAP {}", setting.replace('#', &axis.to_string())));
            }
        }
    }

    fn is_3212(&self) -> bool {
        self.bench.product() == Product::Tmcm3212
    }

    /// A speed in units of a TMC429 as the product has it.
    fn speed(&self, units: u64) -> u64 {
        if self.is_3212() { units * PPS } else { units }
    }

    fn rotor(&self) -> i64 {
        self.bench.module.board().borrow().world().axis(self.axis).motor().rotor()
    }

    fn origin(&self) -> i64 {
        self.origins[self.axis]
    }

    /// Where the firmware knows the axis to be.
    fn known(&self) -> i32 {
        self.bench.module.position(self.axis).unwrap().0
    }

    /// The position of an axis as its ramp generator has it.
    fn counter(bench: &Bench, axis: usize) -> i32 {
        let board = bench.module.board().borrow();
        if bench.product() == Product::Tmcm3212 {
            board.tmc5160(axis).position()
        } else {
            board.tmc429(axis / 3).position(axis % 3)
        }
    }

    /// Rotors, chips and firmware are at the same places, and the tick timer tells the time.
    fn check(&mut self) {
        for axis in self.axes() {
            self.axis = axis;
            self.stand();
            let position = self.ok("GAP 1, #");
            let counter = Self::counter(&self.bench, axis);
            assert_eq!((self.known(), counter), (position, position), "firmware and chip, axis {axis}");
            assert_eq!(self.rotor(), self.origin() + i64::from(position), "rotor {axis}");
        }
        let (since, shown) = self.ticks;
        let expected = (shown + (self.bench.module.now() - since) / MILLISECOND) & BITS_31;
        let timer = u64::from(self.bench.ok("GGP 132, 0").cast_unsigned());
        let late = timer.wrapping_sub(expected) & BITS_31;
        assert!(late <= 3 || late >= BITS_31 - 2, "the tick timer shows {timer}, not {expected}");
        self.crossed |= self.bench.module.now() > self.started + self.edge;
        if self.random.one_in(8) {
            // 31 bits wrap soon.
            let shown = BITS_31 - self.random.below(20_000);
            self.bench.ok(&format!("SGP 132, 0, {shown}"));
            self.ticks = (self.bench.module.now(), shown);
        }
    }

    /// The motor comes to a stand, if it does not yet: it has not moved for a while.
    fn stand(&mut self) {
        let (axis, mut before) = (self.axis, None);
        self.bench.run_until(60 * SECOND, |bench| {
            bench.run(20 * MILLISECOND);
            let chip = Some(Self::counter(bench, axis));
            let stands = before == chip;
            before = chip;
            stands
        });
    }

    /// The axis stands, if it was on a line with others; they go on.
    fn leaves_its_line(&mut self) {
        self.ok("MST #");
        self.stand();
    }

    /// A place on the stage or near it, as a position.
    fn place(&mut self) -> i64 {
        let place = self.random.below(400_000) as i64 - 200_000;
        place - self.origin()
    }

    fn begins_again(&mut self) {
        self.settings();
        let (now, timer) = (self.bench.module.now(), self.bench.ok("GGP 132, 0"));
        assert!((0..400).contains(&timer), "{timer} ms after the start");
        self.ticks = (now, timer as u64);
        self.started = now;
        for axis in self.axes() {
            self.axis = axis;
            assert_eq!(self.ok("GAP 1, #"), 0);
            if self.is_3212() {
                self.fetch_rotor();
            }
            self.origins[axis] = self.rotor();
        }
    }
}

#[test]
fn modules_live() {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("not a number"));
    let one = |product, seed| Life::new(product, seed).live();
    match (number("SEED"), number("SOAK")) {
        (Some(seed), _) => {
            for product in Product::ALL {
                println!("across its edge: {}", one(product, seed));
            }
        }
        (None, None) => {
            for product in Product::ALL {
                let lives = LIVES / u64::from(product.spec().axes);
                let crossed = (1..=lives).filter(|seed| one(product, *seed)).count();
                assert!(crossed > lives as usize / 2, "only {crossed} have gone across their edge");
            }
        }
        (None, Some(hours)) => {
            let end = Instant::now() + Duration::from_secs(3600 * hours);
            // Other lives than the last time.
            let first = UNIX_EPOCH.elapsed().unwrap().as_secs() << 20;
            for seed in (first..).take_while(|_| Instant::now() < end) {
                for product in Product::ALL {
                    one(product, seed);
                }
            }
        }
    }
}
