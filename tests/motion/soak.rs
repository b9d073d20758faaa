//! Soak: random moves, rotations, reference searches, programs, faults and power cuts, one after another, across the
//! points where a counter of milliseconds changes its sign or wraps. After each of them rotor, chip and firmware agree on
//! where the motor is, the tick timer on how late it is, and the EEPROM has what was acknowledged.
//!
//! `cargo test --test motion soak` takes seconds; `SOAK=3 cargo test --release --test motion soak` goes on for three hours. Each life of
//! a module is that of a seed, which is printed: `SEED=17 cargo test --test motion soak` lives that life again.

use std::collections::BTreeMap;
use std::time::{Duration, Instant, UNIX_EPOCH};

use crate::common::program::TICK;
use crate::common::random::Random;
use crate::common::{Bench, NOT_AVAILABLE};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::{binary, text};
use tmcm::units::Micros;
use tmcm::vm::ErrorFlag;
use tmcm_sim::{NativeModule, Product, VirtualModule};

/// Lives in a usual run.
const LIVES: u64 = 48;
/// What happens in one.
const EVENTS: usize = 40;

/// Where the switches are; the motor may pass them.
const LEFT: i64 = -150_000;
const RIGHT: i64 = 150_000;
const HOME: i64 = 21_000;
const WORLD: &str = "[motor]\nfriction = 0.1\n[stage]\nleft = -150000\nright = 150000\nhome = [20000, 22000]\nhard_left = -900000\n\
     hard_right = 900000\n";

/// In milliseconds: a signed and an unsigned 32-bit number end there. The third is where one of microseconds does.
const EDGES: [u64; 4] = [1 << 31, 1 << 32, (1 << 32) / 1000, 0];

/// Bits of the tick timer.
const BITS_31: u64 = (1 << 31) - 1;

/// One module in its life.
struct Life {
    bench: Bench,
    random: Random,
    /// When the firmware was started, and how far the edge was then.
    started: Nanos,
    edge: Nanos,
    /// It has gone across the edge.
    crossed: bool,
    /// Rotor minus position while no step is lost.
    origin: i64,
    /// When the tick timer was zero: after this time, or so long before it.
    ticks: (Nanos, u64),
    /// User variables as acknowledged; the second value is one whose acknowledgement was cut off.
    stored: BTreeMap<u64, (i32, Option<i32>)>,
}

impl Life {
    fn new(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        let config = WorldConfig::parse(WORLD).unwrap();
        let edge = random.pick(&EDGES);
        // Within the first ten seconds the edge is there.
        let ahead = random.below(10_000).min(edge);
        let clock = (edge - ahead) * 1000;
        println!("seed {seed}: the clock starts at {clock} us");
        let module = NativeModule::with_clock(Product::Tmcm1140, &config, None, seed as u32, Micros(clock));
        let bench = Bench { module };
        let (started, edge, stored) = (bench.module.now(), ahead * MILLISECOND, BTreeMap::new());
        let mut life = Life { bench, random, started, edge, crossed: false, origin: 0, ticks: (started, 0), stored };
        life.bench.run(MILLISECOND);
        life.settings();
        life
    }

    /// Lives, and says whether it has gone across its edge.
    fn live(mut self) -> bool {
        for _ in 0..EVENTS {
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

    /// What is set after each start.
    fn settings(&mut self) {
        for line in ["SAP 6, 0, 255", "SAP 4, 0, 2047", "SAP 154, 0, 2", "SAP 5, 0, 1500"] {
            self.bench.ok(line);
        }
    }

    fn rotor(&self) -> i64 {
        self.bench.rotor()
    }

    /// Rotor, chip and firmware are at the same place, and the tick timer tells the time.
    fn check(&mut self) {
        self.stand();
        let position = self.bench.ok("GAP 1, 0");
        let known = self.bench.module.position().unwrap().0;
        let counter = self.bench.module.board().borrow().tmc429(0).position(0);
        assert_eq!((known, counter), (position, position), "firmware and chip");
        assert_eq!(self.rotor(), self.origin + i64::from(position), "the rotor");
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
        let mut before = None;
        self.bench.run_until(60 * SECOND, |bench| {
            bench.run(20 * MILLISECOND);
            let chip = Some(bench.module.board().borrow().tmc429(0).position(0));
            let stands = before == chip;
            before = chip;
            stands
        });
    }

    /// A place on the stage or near it, as a position.
    fn place(&mut self) -> i64 {
        let place = self.random.below(400_000) as i64 - 200_000;
        place - self.origin
    }

    fn moves(&mut self) {
        for (parameter, values) in [(12, &[0, 1][..]), (13, &[0, 1]), (149, &[0, 1]), (138, &[0, 0, 1])] {
            let value = self.random.pick(values);
            self.bench.ok(&format!("SAP {parameter}, 0, {value}"));
        }
        let speed = 500 + self.random.below(1548);
        self.bench.ok(&format!("SAP 4, 0, {speed}"));
        let mut target = self.place();
        for _ in 0..self.random.below(3) {
            self.bench.ok(&format!("MVP ABS, 0, {target}"));
            let span = self.random.below(1_500) * MILLISECOND;
            self.bench.run(span);
            target = self.place();
        }
        // What has become of the others is told by no flag any more.
        self.bench.ok("131, 0, 0, 0");
        self.bench.ok(&format!("MVP ABS, 0, {target}"));
        let arrives = |bench: &mut Bench| bench.ok("GAP 8, 0") == 1;
        let held = |bench: &Bench| bench.module.machine().unwrap().errors.raised(ErrorFlag::Position);
        self.bench.run_until(120 * SECOND, |bench| arrives(bench) || held(bench));
        self.stand();
        if held(&self.bench) {
            let (left, right) = (self.bench.ok("GAP 11, 0"), self.bench.ok("GAP 10, 0"));
            assert!(left + right == 1, "a move ends before {target} though no switch holds it");
        } else {
            assert_eq!((i64::from(self.bench.ok("GAP 1, 0")), self.bench.ok("GAP 3, 0")), (target, 0));
        }
        for line in ["SAP 12, 0, 1", "SAP 13, 0, 1", "SAP 138, 0, 0"] {
            self.bench.ok(line);
        }
        self.bench.ok("MST 0");
    }

    fn rotates(&mut self) {
        let away = self.rotor() > 0;
        let speed = 1 + self.random.below(2047);
        self.bench.ok(&format!("{} 0, {speed}", if away { "ROL" } else { "ROR" }));
        let span = self.random.below(1_200) * MILLISECOND;
        self.bench.run(span);
        let line = self.random.pick(&["MST 0", "ROR 0, 0", "SAP 2, 0, 0", "MVP REL, 0, 500"]);
        self.bench.ok(line);
        self.bench.run(5 * MILLISECOND);
    }

    fn searches(&mut self) {
        let (mode, place) = self.random.pick(&[(1, LEFT), (65, RIGHT), (2, LEFT), (66, RIGHT), (5, HOME), (6, HOME)]);
        let start =
            ["SAP 4, 0, 2047".into(), format!("SAP 193, 0, {mode}"), "SAP 194, 0, 1500".into(), "RFS START, 0".into()];
        for line in start {
            self.bench.ok(&line);
        }
        if self.random.one_in(4) {
            let span = self.random.below(4_000) * MILLISECOND;
            self.bench.run(span);
            let line = self.random.pick(&["RFS STOP, 0", "MST 0", "MVP REL, 0, 1000"]);
            self.bench.ok(line);
            self.bench.run(5 * MILLISECOND);
            self.stand();
            self.origin = self.rotor() - i64::from(self.bench.ok("GAP 1, 0"));
            return;
        }
        self.bench.run_until(120 * SECOND, |bench| bench.ok("RFS STATUS, 0") == 0);
        assert_eq!(self.bench.ok("GAP 1, 0"), 0, "mode {mode}");
        self.origin = self.rotor();
        assert!((self.origin - place).abs() <= 8, "mode {mode}: {} in place of {place}", self.origin);
    }

    /// A program that waits so many ticks, moves, and waits for the position.
    fn waits_in_a_program(&mut self) {
        let (ticks, way) = (1 + self.random.below(300), 1 + self.random.below(60_000) as i32);
        let way = if self.rotor() > 0 { -way } else { way };
        let lines = [&format!("WAIT TICKS, 0, {ticks}"), &format!("MVP REL, 0, {way}"), "WAIT POS, 0, 0", "STOP"];
        self.bench.download(0, &lines);
        let start = self.bench.ok("GAP 1, 0");
        self.bench.start(0);
        // The reply has come after a millisecond or two.
        self.bench.run(ticks * TICK - 5 * MILLISECOND);
        assert_eq!(self.bench.module.position().unwrap().0, start, "it does not wait");
        self.bench.run(15 * MILLISECOND);
        assert_ne!(self.bench.module.position().unwrap().0, start, "it waits on");
        self.bench.await_end();
        assert_eq!((self.bench.ok("GAP 8, 0"), self.bench.ok("GAP 1, 0")), (1, start + way));
    }

    /// A program whose timer interrupt counts.
    fn counts_in_a_program(&mut self) {
        let period = 2 + self.random.below(40);
        self.bench.download(
            0,
            &[
                "VECT 0, 6",
                &format!("SGP 0, 3, {period}"),
                "SGP 201, 2, 0",
                "EI 0",
                "EI 255",
                "JA 5",
                "GGP 201, 2",
                "CALC ADD, 1",
                "AGP 201, 2",
                "RETI",
            ],
        );
        self.bench.start(0);
        let from = self.bench.module.now();
        let span = self.random.below(3_000) * MILLISECOND;
        self.bench.run(span);
        let events = u64::try_from(self.bench.ok("GGP 201, 2")).unwrap();
        let expected = (self.bench.module.now() - from) / (period * MILLISECOND);
        assert!(events.abs_diff(expected) <= 1 + expected / 100, "{events} timer events, not {expected}");
        self.bench.ok("128, 0, 0, 0");
        self.bench.ok("131, 0, 0, 0");
    }

    fn stores(&mut self) {
        let (variable, value) = (self.random.below(56), self.random.next() as i32);
        self.bench.ok(&format!("SGP {variable}, 2, {value}"));
        self.bench.ok(&format!("STGP {variable}, 2"));
        self.stored.insert(variable, (value, None));
    }

    fn is_renumbered(&mut self) {
        let position = self.random.next() as i32 / 2;
        self.bench.ok(&format!("SAP 1, 0, {position}"));
        self.origin = self.rotor() - i64::from(position);
        let way = self.random.below(20_000) as i64 - 10_000;
        self.bench.ok(&format!("MVP REL, 0, {way}"));
        self.bench.run_until(60 * SECOND, |bench| bench.ok("GAP 8, 0") == 1);
        assert_eq!(i64::from(self.bench.ok("GAP 1, 0")), i64::from(position) + way);
        self.bench.ok("SAP 1, 0, 0");
        self.origin = self.rotor();
    }

    /// Two polls without a motion controller, or a driver that has had enough: the one goes unnoticed, the other stops the
    /// motor.
    fn is_disturbed(&mut self) {
        let fault = self.random.pick(&["tmc429", "spi", "spi-low", "short-a", "short-b", "overtemperature"]);
        let target = self.place();
        self.bench.ok(&format!("MVP ABS, 0, {target}"));
        let span = self.random.below(300) * MILLISECOND;
        self.bench.run(span);
        self.bench.control(&format!("fault {fault} on"));
        self.bench.run(2 * MILLISECOND);
        self.bench.control(&format!("fault {fault} off"));
        self.bench.run(20 * MILLISECOND);
        self.bench.ok("MST 0");
        self.stand();
        self.rebase();
    }

    /// The rotor has lost steps, or was let go: multiples of four full steps.
    fn rebase(&mut self) {
        let position = i64::from(self.bench.ok("GAP 1, 0"));
        // With the bridges on the rotor is where the field is.
        self.bench.ok("MVP REL, 0, 0");
        self.bench.run(200 * MILLISECOND);
        let origin = self.rotor() - position;
        assert_eq!((origin - self.origin) % 1024, 0, "{} before, {origin} now", self.origin);
        self.origin = origin;
    }

    fn stalls(&mut self) {
        let target = self.place();
        self.bench.ok(&format!("MVP ABS, 0, {target}"));
        let span = self.random.below(400) * MILLISECOND;
        self.bench.run(span);
        self.bench.control("load 1");
        let span = self.random.below(400) * MILLISECOND;
        self.bench.run(span);
        self.bench.control("load 0");
        self.bench.ok("MST 0");
        self.stand();
        self.rebase();
    }

    fn is_locked(&mut self) {
        let target = self.place();
        self.bench.ok(&format!("MVP ABS, 0, {target}"));
        let span = self.random.below(300) * MILLISECOND;
        self.bench.run(span);
        self.bench.control("supply 8");
        self.bench.run(10 * MILLISECOND);
        self.bench.refused("ROR 0, 100", NOT_AVAILABLE);
        self.bench.control("supply 24");
        self.bench.run(10 * MILLISECOND);
        self.rebase();
    }

    /// Power is cut, now and then while something moves or is being stored: what was acknowledged is there, and what was
    /// not is there or is what it was.
    fn loses_power(&mut self) {
        if self.random.one_in(2) {
            self.bench.ok("ROR 0, 300");
            let span = self.random.below(500) * MILLISECOND;
            self.bench.run(span);
        }
        if self.random.one_in(2) {
            let (variable, value) = (self.random.below(56), self.random.next() as i32);
            self.bench.ok(&format!("SGP {variable}, 2, {value}"));
            let command = text::parse(&format!("STGP {variable}, 2")).unwrap();
            self.bench.module.receive(Source::Usb, binary::encode_command(1, command));
            let span = self.random.below(20_000) * MICROSECOND;
            self.bench.run(span);
            self.stored.entry(variable).or_default().1 = Some(value);
        }
        self.bench.power_cycle();
        self.begins_again();
        for (variable, (value, other)) in &mut self.stored {
            let kept = self.bench.ok(&format!("GGP {variable}, 2"));
            assert!(kept == *value || *other == Some(kept), "variable {variable} is {kept}, not {value} or {other:?}");
            (*value, *other) = (kept, None);
        }
    }

    fn is_restarted(&mut self) {
        self.bench.ok("255, 0, 0, 1234");
        self.bench.run(300 * MILLISECOND);
        self.begins_again();
    }

    fn begins_again(&mut self) {
        self.settings();
        assert_eq!(self.bench.ok("GAP 1, 0"), 0);
        self.origin = self.rotor();
        let (now, timer) = (self.bench.module.now(), self.bench.ok("GGP 132, 0"));
        assert!((0..400).contains(&timer), "{timer} ms after the start");
        self.ticks = (now, timer as u64);
        self.started = now;
    }
}

#[test]
fn modules_live() {
    let number = |name: &str| std::env::var(name).ok().map(|text| text.parse::<u64>().expect("not a number"));
    let one = |seed| Life::new(seed).live();
    match (number("SEED"), number("SOAK")) {
        (Some(seed), _) => println!("across its edge: {}", one(seed)),
        (None, None) => {
            let crossed = (1..=LIVES).filter(|seed| one(*seed)).count();
            assert!(crossed > LIVES as usize / 2, "only {crossed} have gone across their edge");
        }
        (None, Some(hours)) => {
            let end = Instant::now() + Duration::from_secs(3600 * hours);
            // Other lives than the last time.
            let first = UNIX_EPOCH.elapsed().unwrap().as_secs() << 20;
            for seed in (first..).take_while(|_| Instant::now() < end) {
                one(seed);
            }
        }
    }
}
