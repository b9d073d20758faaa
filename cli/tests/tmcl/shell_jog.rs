//! `jog` of `tmcl shell`: motors move while a key is held, and stop in time when it is not.

use std::time::{Duration, Instant};

use rustix::process::Signal;

use super::harness::{PATIENCE, Sim};
use super::pty::Terminal;

pub(crate) const LINKS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
pub(crate) const RIGHT: &str = "\x1b[C";
const LEFT: &str = "\x1b[D";
/// Time between two repetitions of a held key.
pub(crate) const REPEAT: Duration = Duration::from_millis(30);
/// Longest time of the module until a motor stands, in microseconds.
const MOST: u64 = 300_000;
/// How often something is tried that a busy computer may delay.
const TRIES: usize = 5;

/// A module, and a shell that talks to it.
pub(crate) struct Bench {
    pub(crate) sim: Sim,
    pub(crate) shell: Terminal,
}

impl Bench {
    pub(crate) fn start(options: &[&str]) -> Self {
        Self::start_with(options, 80)
    }

    pub(crate) fn start_with(options: &[&str], columns: u16) -> Self {
        let sim = Sim::start(&[&LINKS[..], options].concat());
        let mut shell = Terminal::start_with(&["shell", &format!("tcp:{}", sim.told("tcp"))], columns);
        shell.expect("(tmcl) ");
        Bench { sim, shell }
    }

    /// A bench whose shell waits for arrow keys.
    pub(crate) fn jogging(options: &[&str], line: &str) -> Self {
        let mut bench = Self::start(options);
        bench.jog(line);
        bench
    }

    pub(crate) fn jog(&mut self, line: &str) {
        self.shell.line(line);
        self.shell.expect("any other key ends the jog");
        // Keys are taken one by one from here on.
        self.shell.expect("position ");
    }

    /// Time of the module in us, and the velocity of an axis in the unit of its chip.
    fn look(&self, axis: usize) -> (u64, i64) {
        let state = self.sim.control(&["state"]);
        (state["time_us"].as_u64().unwrap(), state["axes"][axis]["velocity"].as_i64().unwrap())
    }

    /// Holds a key until the axis has had this velocity for so long without a break, as the module counts time. A busy
    /// computer may delay a repetition, so that the motor slows down and this begins anew; a jog that stutters by
    /// itself never gets there.
    fn hold(&mut self, key: &str, axis: usize, velocity: i64, time: u64) {
        // A computer that is busy all the time has a quiet moment now and then.
        let end = Instant::now() + 10 * PATIENCE;
        let mut since = None;
        loop {
            self.shell.keys(key);
            std::thread::sleep(REPEAT);
            let (now, seen) = self.look(axis);
            if seen != velocity {
                since = None;
            } else if now - *since.get_or_insert(now) >= time {
                return;
            }
            assert!(Instant::now() < end, "the motor stutters: the axis has {seen} in place of {velocity}");
        }
    }

    /// Waits until the axis stands, and gives the time of the module then.
    fn rest(&self, axis: usize) -> u64 {
        let end = Instant::now() + PATIENCE;
        loop {
            let (now, velocity) = self.look(axis);
            if velocity == 0 {
                return now;
            }
            assert!(Instant::now() < end, "it goes on");
        }
    }

    /// Types the key once more, lets something happen, and gives the time of the module until the axis stands.
    fn stops_after(&mut self, key: &str, axis: usize, happens: impl FnOnce(&mut Terminal)) -> u64 {
        let (before, _) = self.look(axis);
        self.shell.keys(key);
        happens(&mut self.shell);
        self.rest(axis) - before
    }

    /// Asks the module, from elsewhere.
    pub(crate) fn ok(&self, line: &str) -> i32 {
        self.sim.tcp().ok(line)
    }
}

/// Tries until the time is short enough. A computer that is busy delays keys, and with them the stop; a jog that is not
/// built to stop in time never does.
fn in_time(mut attempt: impl FnMut() -> u64) {
    let mut times = Vec::new();
    while times.last().is_none_or(|time| *time > MOST) {
        assert!(times.len() < TRIES, "stopped after {times:?} us");
        times.push(attempt());
    }
}

#[test]
fn a_held_key_moves_the_motor_and_a_released_one_stops_it() {
    let mut bench = Bench::jogging(&[], "jog");
    in_time(|| {
        // The speed of positioning is 1000, as from the factory, from which a stop takes 66 ms.
        bench.hold(RIGHT, 0, 1000, 2_000_000);
        bench.stops_after(RIGHT, 0, |_| {})
    });
    // The jog goes on, the other way as well.
    in_time(|| {
        bench.hold(LEFT, 0, -1000, 300_000);
        bench.stops_after(LEFT, 0, |_| {})
    });
    bench.shell.keys("q");
    bench.shell.expect("axis 0 is stopped");
    bench.shell.expect("(tmcl) ");
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
    bench.shell.line("quit");
    let (status, _) = bench.shell.end();
    assert_eq!(status.code(), Some(0));
    assert!(bench.shell.is_as_before());
}

#[test]
fn a_killed_program_stops_the_motor() {
    use std::os::unix::process::ExitStatusExt;
    for (signal, code) in [(Signal::TERM, Some(143)), (Signal::HUP, Some(129)), (Signal::KILL, None)] {
        in_time(|| {
            let mut bench = Bench::jogging(&[], "jog 0 800");
            bench.hold(RIGHT, 0, 800, 500_000);
            let time = bench.stops_after(RIGHT, 0, |shell| shell.signal(signal));
            let (status, _) = bench.shell.end();
            assert_eq!(status.code(), code, "{signal:?}");
            if code.is_some() {
                assert!(bench.shell.is_as_before(), "{signal:?}");
                assert_eq!(bench.ok("GAP 4, 0"), 1000, "{signal:?}");
            } else {
                assert_eq!(status.signal(), Some(9));
            }
            time
        });
    }
}

#[test]
fn a_closed_terminal_stops_the_motor() {
    in_time(|| {
        let mut bench = Bench::jogging(&[], "jog 0 800");
        bench.hold(LEFT, 0, -800, 500_000);
        let time = bench.stops_after(LEFT, 0, Terminal::hang_up);
        let (status, _) = bench.shell.end();
        assert_eq!(status.code(), Some(129));
        assert_eq!(bench.ok("GAP 4, 0"), 1000);
        time
    });
}

#[test]
fn any_other_key_stops_at_once() {
    let mut bench = Bench::jogging(&[], "jog");
    // From 1000 at 1000: 65 ms, if it begins at once (manual section 6.1).
    in_time(|| {
        bench.hold(RIGHT, 0, 1000, 100_000);
        bench.stops_after(" ", 0, |_| {})
    });
    bench.hold(RIGHT, 0, 1000, 100_000);
    // Up is no key of a jog.
    bench.shell.keys("\x1b[A");
    bench.shell.expect("axis 0 is stopped");
    assert!(bench.rest(0) > 0);
    // Ctrl-C ends the jog, and not the shell.
    bench.shell.expect("(tmcl) ");
    bench.jog("jog");
    bench.hold(RIGHT, 0, 1000, 100_000);
    bench.shell.keys("\x03");
    bench.shell.expect("axis 0 is stopped");
    bench.shell.expect("(tmcl) ");
    bench.shell.line("GAP 4, 0");
    bench.shell.expect("GAP 4, 0: 1000 int (maximum positioning speed), status 100 ok");
    // So does Escape, which may be the beginning of another key.
    bench.shell.expect("(tmcl) ");
    bench.jog("jog");
    bench.shell.keys("\x1b");
    bench.shell.expect("axis 0 is stopped");
}

#[test]
fn another_key_changes_the_direction() {
    let mut bench = Bench::jogging(&[], "jog");
    bench.hold(RIGHT, 0, 1000, 200_000);
    let before = bench.sim.control(&["state"])["position"].as_i64().unwrap();
    bench.hold(LEFT, 0, -1000, 500_000);
    let state = bench.sim.control(&["state"]);
    assert!(state["position"].as_i64().unwrap() < before);
    assert_eq!(state["lost_steps"], 0);
    bench.rest(0);
}

/// From a speed where stopping takes longer than 90 ms nothing would stop within 300. An acceleration of 100 is 46566
/// pps2 (manual section 6.1.2), so in 90 ms the speed changes by 4191 pps, which is 137 units of 30.5 pps.
#[test]
fn the_speed_is_limited_such_that_it_stops_in_time() {
    let mut bench = Bench::start(&[]);
    bench.ok("SAP 5, 0, 100");
    bench.shell.line("jog 0 2000");
    bench.shell.expect("axis 0 at 137 int (not 2000 int, from which it would not stop in time)");
    bench.shell.expect("position ");
    in_time(|| {
        bench.hold(RIGHT, 0, 137, 300_000);
        bench.stops_after(RIGHT, 0, |_| {})
    });
    bench.shell.keys("q");
    bench.shell.expect("is stopped");
    bench.shell.expect("(tmcl) ");
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
}

/// A TMCM-3212 has its speeds in pps: 40000 at 640000 pps2 takes 62.5 ms to stop.
#[test]
fn axes_of_every_kind_are_moved() {
    let mut bench = Bench::start(&["--product", "3212"]);
    for line in ["SAP 5, 2, 640000", "SAP 17, 2, 640000"] {
        bench.ok(line);
    }
    bench.jog("jog Motor2 40000");
    // 40000 pps in the chip's unit: 40000 * 2^24 / 16e6 = 41943.04.
    in_time(|| {
        bench.hold(RIGHT, 2, 41943, 500_000);
        bench.stops_after(RIGHT, 2, |_| {})
    });
    bench.shell.keys("x");
    bench.shell.expect("axis 2 is stopped");
    assert_eq!(bench.ok("GAP 4, 2"), 51200);
}

/// At 9600 baud a request and its reply take 19 ms, and a key three of them: less than the time for which a key keeps
/// the motor moving. Time goes by these requests alone, so that what a busy computer takes for them counts for nothing;
/// then by steps.
#[test]
fn a_slow_bus_is_fast_enough() {
    const STEP: u64 = 5_000;
    let sim = Sim::start(&[&LINKS[..], &["--rs485", "{}/bus", "--paused"]].concat());
    let shell = Terminal::start_with(&["shell", sim.told("rs485"), "--timeout", "60000"], 40);
    let mut bench = Bench { sim, shell };
    bench.shell.expect("(tmcl) ");
    bench.jog("jog 0 500");
    bench.hold(RIGHT, 0, 500, 500_000);
    bench.shell.keys(RIGHT);
    let (before, _) = bench.look(0);
    while bench.look(0).1 != 0 {
        let now = bench.sim.control(&[&format!("step {STEP} us")])["time_us"].as_u64().unwrap();
        assert!(now - before <= MOST + STEP, "it goes on for {} us", now - before);
    }
    bench.shell.keys("q");
    let shown = bench.shell.expect("axis 0 is stopped");
    let lines = shown.split(['\r', '\n']).filter(|line| line.starts_with("position "));
    assert!(lines.clone().count() > 10 && lines.clone().all(|line| line.trim_end_matches("\x1b[K").len() < 40));
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
}

#[test]
fn a_virtual_module_of_its_own_is_moved() {
    let mut shell = Terminal::start(&["shell", "sim"]);
    shell.expect("(tmcl) ");
    shell.line("jog");
    shell.expect("position ");
    let end = Instant::now() + PATIENCE;
    let mut shown = String::new();
    while !shown.contains("speed 1000 int") {
        shell.keys(RIGHT);
        shown = shell.expect(" int");
        assert!(Instant::now() < end, "{shown}");
    }
    shell.keys("q");
    shell.expect("axis 0 is stopped");
    shell.line("quit");
    assert_eq!(shell.end().0.code(), Some(0));
    assert!(shell.is_as_before());
}

/// A motor that somebody else has set in motion does not go on turning with no key held.
#[test]
fn a_motor_that_turns_is_stopped_when_a_jog_begins() {
    let mut bench = Bench::start(&[]);
    bench.ok("ROR 0, 800");
    bench.sim.tcp().until("GAP 3, 0", 800);
    bench.jog("jog 0 500");
    bench.rest(0);
    bench.hold(RIGHT, 0, 500, 100_000);
    bench.shell.keys("q");
    bench.shell.expect("axis 0 is stopped");
}
