//! Events in a life: moves, searches, programs, faults, and cuts of the power.

use super::{HOME, LEFT, Life, RIGHT};
use common::program::TICK;
use common::{Bench, NOT_AVAILABLE};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{binary, text};
use tmcm::vm::ErrorFlag;
use tmcm_sim::VirtualModule;

impl Life {
    pub(super) fn moves(&mut self) {
        // Soft stop; and the exponential approach, which the TMCM-3212 has not: 26 is its soft stop.
        let [soft_stop, mode] = if self.is_3212() { [26, 26] } else { [149, 138] };
        for (parameter, values) in [(12, &[0, 1][..]), (13, &[0, 1]), (soft_stop, &[0, 1]), (mode, &[0, 0, 1])] {
            let value = self.random.pick(values);
            self.ok(&format!("SAP {parameter}, #, {value}"));
        }
        let speed = 500 + self.random.below(1548);
        let speed = self.speed(speed);
        self.ok(&format!("SAP 4, #, {speed}"));
        let mut target = self.place();
        for _ in 0..self.random.below(3) {
            self.ok(&format!("MVP ABS, #, {target}"));
            let span = self.random.below(1_500) * MILLISECOND;
            self.bench.run(span);
            target = self.place();
        }
        // What has become of the others is told by no flag any more.
        self.bench.ok("131, 0, 0, 0");
        self.ok(&format!("MVP ABS, #, {target}"));
        let reached = format!("GAP 8, {}", self.axis);
        let arrives = |bench: &mut Bench| bench.ok(&reached) == 1;
        let held = |bench: &Bench| bench.module.machine().unwrap().errors.raised(ErrorFlag::Position);
        self.bench.run_until(120 * SECOND, |bench| arrives(bench) || held(bench));
        self.stand();
        if held(&self.bench) {
            let (left, right) = (self.ok("GAP 11, #"), self.ok("GAP 10, #"));
            assert!(left + right == 1, "a move ends before {target} though no switch holds it");
        } else {
            assert_eq!((i64::from(self.ok("GAP 1, #")), self.ok("GAP 3, #")), (target, 0));
        }
        for line in ["SAP 12, #, 1", "SAP 13, #, 1", &format!("SAP {mode}, #, 0")] {
            self.ok(line);
        }
        self.ok("MST #");
    }

    pub(super) fn rotates(&mut self) {
        let away = self.rotor() > 0;
        let speed = 1 + self.random.below(2047);
        let speed = self.speed(speed);
        self.ok(&format!("{} #, {speed}", if away { "ROL" } else { "ROR" }));
        let span = self.random.below(1_200) * MILLISECOND;
        self.bench.run(span);
        let line = self.random.pick(&["MST #", "ROR #, 0", "SAP 2, #, 0", "MVP REL, #, 500"]);
        self.ok(line);
        self.bench.run(5 * MILLISECOND);
    }

    pub(super) fn searches(&mut self) {
        let (mode, place) = self.random.pick(&[(1, LEFT), (65, RIGHT), (2, LEFT), (66, RIGHT), (5, HOME), (6, HOME)]);
        let [fast, coarse, fine] = [2047, 1500, 100].map(|units| self.speed(units));
        let start = [
            format!("SAP 4, #, {fast}"),
            format!("SAP 193, #, {mode}"),
            format!("SAP 194, #, {coarse}"),
            format!("SAP 195, #, {fine}"),
            "RFS START, #".into(),
        ];
        for line in start {
            self.ok(&line);
        }
        if self.random.one_in(4) {
            let span = self.random.below(4_000) * MILLISECOND;
            self.bench.run(span);
            let line = self.random.pick(&["RFS STOP, #", "MST #", "MVP REL, #, 1000"]);
            self.ok(line);
            self.bench.run(5 * MILLISECOND);
            self.stand();
            self.origins[self.axis] = self.rotor() - i64::from(self.ok("GAP 1, #"));
            return;
        }
        self.until(120 * SECOND, "RFS STATUS, #", 0);
        assert_eq!(self.ok("GAP 1, #"), 0, "mode {mode}");
        let origin = self.rotor();
        self.origins[self.axis] = origin;
        assert!((origin - place).abs() <= 8, "mode {mode}: {origin} in place of {place}");
    }

    /// A program that waits so many ticks, moves, and waits for the position.
    pub(super) fn waits_in_a_program(&mut self) {
        self.leaves_its_line();
        let (ticks, way) = (1 + self.random.below(300), 1 + self.random.below(60_000) as i32);
        let way = if self.rotor() > 0 { -way } else { way };
        let (axis, ticks_wait) = (self.axis, format!("WAIT TICKS, 0, {ticks}"));
        let lines = [&ticks_wait, &format!("MVP REL, {axis}, {way}"), &format!("WAIT POS, {axis}, 0"), "STOP"];
        self.bench.download(0, &lines);
        let start = self.ok("GAP 1, #");
        self.bench.start(0);
        // The reply has come after a millisecond or two.
        self.bench.run(ticks * TICK - 5 * MILLISECOND);
        assert_eq!(self.known(), start, "it does not wait");
        self.bench.run(15 * MILLISECOND);
        assert_ne!(self.known(), start, "it waits on");
        self.bench.await_end();
        assert_eq!((self.ok("GAP 8, #"), self.ok("GAP 1, #")), (1, start + way));
    }

    /// A program whose timer interrupt counts.
    pub(super) fn counts_in_a_program(&mut self) {
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

    pub(super) fn stores(&mut self) {
        let (variable, value) = (self.random.below(56), self.random.next() as i32);
        self.bench.ok(&format!("SGP {variable}, 2, {value}"));
        self.bench.ok(&format!("STGP {variable}, 2"));
        self.stored.insert(variable, (value, None));
    }

    pub(super) fn is_renumbered(&mut self) {
        self.leaves_its_line();
        let position = self.random.next() as i32 / 2;
        self.ok(&format!("SAP 1, #, {position}"));
        self.origins[self.axis] = self.rotor() - i64::from(position);
        let way = self.random.below(20_000) as i64 - 10_000;
        self.ok(&format!("MVP REL, #, {way}"));
        self.until(60 * SECOND, "GAP 8, #", 1);
        assert_eq!(i64::from(self.ok("GAP 1, #")), i64::from(position) + way);
        self.ok("SAP 1, #, 0");
        self.origins[self.axis] = self.rotor();
    }

    /// Two polls without a motion controller, or a driver that has had enough: the one goes unnoticed, the other stops
    /// the motor.
    pub(super) fn is_disturbed(&mut self) {
        let fault = self.random.pick(&["controller", "spi", "spi-low", "short-a", "short-b", "overtemperature"]);
        let fault = match fault {
            "controller" if self.is_3212() => "tmc5160",
            "controller" => "tmc429",
            other => other,
        };
        let target = self.place();
        self.ok(&format!("MVP ABS, #, {target}"));
        let span = self.random.below(300) * MILLISECOND;
        self.bench.run(span);
        // The bus is that of all chips.
        let whose = if fault.starts_with("spi") { String::new() } else { format!(" {}", self.axis) };
        self.bench.control(&format!("fault {fault} on{whose}"));
        self.bench.run(2 * MILLISECOND);
        self.bench.control(&format!("fault {fault} off{whose}"));
        self.bench.run(20 * MILLISECOND);
        self.ok("MST #");
        self.stand();
        self.rebase();
    }

    /// The rotor has lost steps, or was let go: multiples of four full steps.
    fn rebase(&mut self) {
        let position = i64::from(self.ok("GAP 1, #"));
        if self.is_3212() {
            self.fetch_rotor();
        } else {
            // With the bridges on the rotor is where the field is.
            self.ok("MVP REL, #, 0");
            self.bench.run(200 * MILLISECOND);
        }
        let (before, origin) = (self.origin(), self.rotor() - position);
        assert_eq!((origin - before) % 1024, 0, "axis {}: {before} before, {origin} now", self.axis);
        self.origins[self.axis] = origin;
    }

    /// The rotor comes to where the field is. A TMC5160 gives the run current with a step only, and the standby current
    /// is less than the friction.
    pub(super) fn fetch_rotor(&mut self) {
        for way in [1, -1] {
            self.ok(&format!("MVP REL, #, {way}"));
            self.bench.run(200 * MILLISECOND);
        }
    }

    pub(super) fn stalls(&mut self) {
        let target = self.place();
        self.ok(&format!("MVP ABS, #, {target}"));
        let span = self.random.below(400) * MILLISECOND;
        self.bench.run(span);
        self.bench.control(&format!("load 1 {}", self.axis));
        let span = self.random.below(400) * MILLISECOND;
        self.bench.run(span);
        self.bench.control(&format!("load 0 {}", self.axis));
        self.ok("MST #");
        self.stand();
        self.rebase();
    }

    pub(super) fn is_locked(&mut self) {
        let target = self.place();
        self.ok(&format!("MVP ABS, #, {target}"));
        let span = self.random.below(300) * MILLISECOND;
        self.bench.run(span);
        self.bench.control("supply 8");
        self.bench.run(10 * MILLISECOND);
        self.bench.refused(&format!("ROR {}, 100", self.axis), NOT_AVAILABLE);
        self.bench.control("supply 24");
        self.bench.run(10 * MILLISECOND);
        for axis in self.axes() {
            self.axis = axis;
            self.rebase();
        }
    }

    /// Power is cut, now and then while something moves or is being stored: what was acknowledged is there, and what
    /// was not is there or is what it was.
    pub(super) fn loses_power(&mut self) {
        if self.random.one_in(2) {
            let speed = self.speed(300);
            self.ok(&format!("ROR #, {speed}"));
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

    pub(super) fn is_restarted(&mut self) {
        self.bench.ok("255, 0, 0, 1234");
        self.bench.run(300 * MILLISECOND);
        self.begins_again();
    }
}
