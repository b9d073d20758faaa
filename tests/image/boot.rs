//! The very flash image, unmodified, on the emulated microcontroller: it boots, talks over RS485, moves the motor,
//! keeps what is stored, runs a program and restarts.

use common::image_host::{BAUD, CYCLES_PER_MICROSECOND, Host, INVALID_COMMAND, LOADED};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};

#[test]
fn boots_and_answers() {
    let mut host = Host::new("");
    assert_eq!(host.machine.core_clock(), 168_000_000);
    let log = host.machine.log().take();
    assert!(log.iter().any(|line| line.level == "info" && line.text == "module runs at address 1"), "{log:?}");
    assert_eq!(host.machine.board().world().outputs().pull_ups, 1);
    // GAP 4: the default speed, GGP 66: the address, and a command that there is none of.
    assert_eq!(host.ok("GAP 4, 0"), 1_000);
    assert_eq!(host.ok("GGP 66, 0"), 1);
    assert_eq!(host.ask("99, 0, 0, 0").0, INVALID_COMMAND);
    println!("stack: {} bytes, {:?}", host.machine.stack_used(), host.machine.counters());
}

#[test]
fn a_move_moves_the_motor() {
    let mut host = Host::new("");
    host.ok("SAP 4, 0, 2000");
    assert_eq!(host.ok("GAP 4, 0"), 2_000);
    host.ok("MVP ABS, 0, 25600");
    let start = host.machine.now();
    while host.ok("GAP 8, 0") == 0 {
        assert!(host.machine.now() < start + 5 * SECOND, "the motor does not arrive");
    }
    assert_eq!((host.rotor(), host.ok("GAP 1, 0")), (25_600, 25_600));
    host.ok("MVP REL, 0, -1000");
    host.run(2 * SECOND);
    assert_eq!(host.rotor(), 24_600);
}

#[test]
fn a_stop_switch_stops_the_motor() {
    let mut host = Host::new("[stage]\nright = 20000");
    // The right switch stops the motor.
    host.ok("SAP 12, 0, 0");
    host.ok("ROR 0, 500");
    host.run(4 * SECOND);
    let rotor = host.rotor();
    assert!((20_000..20_100).contains(&rotor), "{rotor}");
    // GIO 2 in bank 0, the same pin.
    assert_eq!(host.ok("GIO 2, 0"), 1);
}

#[test]
fn what_is_stored_survives_switching_off() {
    let mut host = Host::new("");
    host.ok("SAP 4, 0, 1234");
    host.ok("STAP 4, 0");
    host.ok("SAP 5, 0, 77");
    host.machine.set_power(false);
    host.run(SECOND);
    let off = host.machine.now();
    host.machine.set_power(true);
    assert_eq!(host.machine.now(), off);
    host.run(200 * MILLISECOND);
    assert_eq!(host.ok("GAP 4, 0"), 1_234);
    assert_ne!(host.ok("GAP 5, 0"), 77);
    assert_eq!(host.machine.counters().starts, 2);
}

#[test]
fn a_program_is_loaded_and_runs() {
    let mut host = Host::new("");
    host.ok("132, 0, 0, 0");
    for line in ["SGP 20, 2, 1234", "SIO 0, 2, 1", "STOP"] {
        assert_eq!(host.ask(line).0, LOADED);
    }
    host.ok("133, 0, 0, 0");
    host.ok("129, 0, 0, 0");
    host.run(100 * MILLISECOND);
    assert_eq!(host.ok("GGP 20, 2"), 1_234);
    assert!(host.machine.board().world().outputs().is_on(0));
}

#[test]
fn a_reset_by_command_starts_anew_and_stops_the_motor() {
    let mut host = Host::new("");
    host.ok("ROR 0, 500");
    host.run(500 * MILLISECOND);
    host.ok("255, 0, 0, 1234");
    host.run(200 * MILLISECOND);
    assert_eq!(host.machine.counters().starts, 2);
    let rotor = host.rotor();
    assert_ne!(rotor, 0);
    assert_eq!(host.ok("GAP 3, 0"), 0);
    host.run(500 * MILLISECOND);
    assert_eq!(host.rotor(), rotor);
}

#[test]
fn the_same_run_again_is_the_same() {
    let run = || {
        let mut host = Host::new("");
        host.ok("ROR 0, 300");
        host.run(300 * MILLISECOND);
        let reply = host.exchange("GAP 1, 0");
        (reply, host.machine.counters(), host.rotor())
    };
    assert_eq!(run(), run());
}

/// How long the image takes from the last byte of a request to the first of the reply, and how busy it is. The
/// bounds are loose: this is to look at (`cargo test --test image soon -- --nocapture`).
#[test]
fn replies_come_soon() {
    let mut host = Host::new("");
    let bit = SECOND / Nanos::from(BAUD);
    let requests = [
        "GAP 5, 0",
        "GGP 66, 0",
        "99, 0, 0, 0",
        "GAP 1, 0",
        "SAP 4, 0, 10##",
        "MVP ABS, 0, 1##",
        "ROR 0, 2##",
        "MST 0",
    ];
    for request in requests {
        let mut cycles: Vec<u64> = (0..21)
            .map(|n| {
                host.run(n * 137_000);
                let (end, reply) = host.exchange(&request.replace("##", &format!("{n:02}")));
                // The last byte is there in the middle of its stop bit.
                (reply[0].start - (end - bit / 2)) * CYCLES_PER_MICROSECOND / 1_000
            })
            .collect();
        cycles.sort_unstable();
        println!("{request}: {} cycles, {} to {}", cycles[10], cycles[0], cycles[20]);
        assert!(cycles[10] < 20_000);
    }
    for (name, request) in [("standing", "MST 0"), ("moving", "ROR 0, 500")] {
        host.ok(request);
        let before = host.machine.counters();
        host.run(SECOND);
        let after = host.machine.counters();
        let awake = 1.0 - (after.asleep - before.asleep) as f64 / (after.cycles - before.cycles) as f64;
        println!("{name}: awake {:.1} %, {} instructions", awake * 100.0, after.instructions - before.instructions);
        assert!(awake < 0.5);
    }
    println!("stack: {} bytes", host.machine.stack_used());
}
