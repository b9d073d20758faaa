//! Time on the flash image: how evenly it looks at the motor, how long a move takes, and how much it sleeps.

use common::image_host::{Host, OK, request};
use common::telegram;
use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use hal_sim::mcu::Act;

/// Times between the readings of a moving motor, in microseconds, over a span. A reading begins with the first datagram
/// to a motion chip after a pause of a tenth of a millisecond.
fn reading_periods(host: &mut Host, span: Nanos) -> Vec<u64> {
    const STEP: Nanos = 2 * MICROSECOND;
    let end = host.machine.now() + span;
    let count = |host: &mut Host| {
        let board = host.machine.board();
        board.datagrams(Chip::Tmc429(0)) + board.datagrams(Chip::Tmc262(0))
    };
    let (mut before, mut last, mut readings) = (count(host), host.machine.now(), Vec::new());
    while host.machine.now() < end {
        host.run(STEP);
        let (now, datagrams) = (host.machine.now(), count(host));
        if datagrams != before {
            if now - last > MILLISECOND / 10 {
                readings.push(now);
            }
            (before, last) = (datagrams, now);
        }
    }
    readings.windows(2).map(|pair| (pair[1] - pair[0]) / MICROSECOND).collect()
}

/// The motor is looked at twice in each millisecond, whatever the links and a stored setting want in between.
#[test]
fn readings_come_each_half_millisecond() {
    let mut host = Host::new("");
    host.plug_usb();
    host.ok("ROR 0, 500");
    host.run(50 * MILLISECOND);
    let quiet = reading_periods(&mut host, 100 * MILLISECOND);
    // None of these asks the motion controller.
    for n in 0..4 {
        let at = host.machine.now() + n * 23 * MILLISECOND;
        host.machine.rs485().send_at(at, &telegram("GAP 5, 0"), host.baud);
    }
    for _ in 0..200 {
        host.machine.can().send(request(1, "GAP 4, 0"));
    }
    host.machine.usb().send(&[telegram("STAP 4, 0"), telegram("GAP 5, 0"), telegram("GGP 66, 0")].concat());
    let busy = reading_periods(&mut host, 100 * MILLISECOND);
    for (name, periods, spread) in [("quiet", quiet, 50), ("busy", busy, 200)] {
        let (shortest, longest) = (*periods.iter().min().unwrap(), *periods.iter().max().unwrap());
        println!("{name}: readings {shortest} to {longest} us apart");
        assert!(periods.len() >= 196, "{name}: {}", periods.len());
        assert!(500 - spread <= shortest && longest <= 500 + spread, "{name}: {shortest} to {longest} us");
    }
}

/// The emulator passes over waiting: it must not pass over its end. A word of 16 bits on the motion bus takes 2 048
/// cycles.
#[test]
fn a_wait_for_the_motion_bus_ends_with_the_word() {
    let mut host = Host::new("");
    assert_eq!(host.ask_can("ROR 0, 1000").0, OK);
    host.run(500 * MILLISECOND);
    let (mut waits, mut longest) = (0, 0);
    let end = host.machine.now() + 100 * MILLISECOND;
    let mut watch = |step: hal_sim::mcu::Step| {
        if step.clocked || step.chip.is_some() {
            waits += u64::from(matches!(step.act, Act::Wait { .. }));
            longest = longest.max(step.cycles);
        }
    };
    host.machine.observe_until(end, &mut watch).unwrap();
    assert!(waits > 300 && longest <= 2_048, "{waits} waits, the longest of {longest} cycles");
}

/// Clock of the motion controller.
const CLOCK: f64 = 16e6;

/// A move takes the time of the datasheet's formulas, here with the default divisors 3 and 7. They are v = f V /
/// (2^PULSE_DIV * 2048 * 32) and a = f^2 A / 2^(PULSE_DIV + RAMP_DIV + 29).
#[test]
fn a_move_takes_the_time_of_the_formula() {
    let mut host = Host::new("");
    for (speed, acceleration, distance) in [(1_000, 1_000, 20_000_i32), (2_000, 300, -30_000)] {
        host.ok(&format!("SAP 4, 0, {speed}"));
        host.ok(&format!("SAP 5, 0, {acceleration}"));
        let v = CLOCK * f64::from(speed) / (8.0 * 65_536.0);
        let a = CLOCK * CLOCK * f64::from(acceleration) / 2_f64.powi(3 + 7 + 29);
        let ideal = f64::from(distance.abs()) / v + v / a;
        let now = host.machine.now();
        host.machine.board().change_world(|world| world.axis_mut(0).start_trace(0, now));
        host.ok(&format!("MVP REL, 0, {distance}"));
        host.run(((1.1 * ideal + 0.1) * SECOND as f64) as Nanos);
        let trace = host.machine.board().change_world(|world| world.axis_mut(0).take_trace()).unwrap();
        let samples = trace.samples();
        let begun = samples.iter().find(|sample| sample.rotor != samples[0].rotor).unwrap().at;
        let took = (samples.last().unwrap().at - begun) as f64 / SECOND as f64;
        println!("{distance} microsteps: {took:.4} s, by the formula {ideal:.4} s");
        assert_eq!(samples.last().unwrap().rotor - samples[0].rotor, i64::from(distance));
        // The first step comes sqrt(2 / a) after the start; the braking is up to 3 % weaker than the acceleration.
        assert!((took / ideal - 1.0).abs() < 0.03, "{took} s in place of {ideal} s");
        assert_eq!(host.ok("GAP 8, 0"), 1);
    }
}

/// At rest the core sleeps but for the polls.
#[test]
fn the_core_sleeps_at_rest() {
    let mut host = Host::new("");
    host.plug_usb();
    assert_eq!(host.ask_usb("GAP 4, 0").0, OK);
    host.run(SECOND);
    let before = host.machine.counters();
    host.run(SECOND);
    let after = host.machine.counters();
    let awake = 1.0 - (after.asleep - before.asleep) as f64 / (after.cycles - before.cycles) as f64;
    println!("awake {:.1} %", 100.0 * awake);
    assert!(awake < 0.12, "{awake}");
}
