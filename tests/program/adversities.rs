//! Programs when several things happen at once: protection, resets, failing stores, heartbeats, handlers that leave
//! things behind.

use common::program::STORED;
use common::{Bench, EEPROM_LOCKED, NOT_AVAILABLE, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};

/// Returns what command 134 shows of the first command; nothing while the module does not answer.
fn shown(bench: &mut Bench) -> Option<Command> {
    bench.module.receive(Source::Rs485, binary::encode_command(1, Command::new(134, 0, 0, 0)));
    for _ in 0..10 {
        bench.run(100 * MICROSECOND);
        while let Some(sent) = bench.module.sent() {
            if sent.source == Source::Rs485 {
                return Some(Command::from_bytes(*sent.bytes[1..].first_chunk().unwrap()));
            }
        }
    }
    None
}

/// A factory reset takes the protection off. Whatever is sent meanwhile, the program is not seen.
#[test]
fn a_protected_program_is_not_seen_after_a_factory_reset() {
    for delay in 0..14 {
        let mut bench = Bench::with_program(&["SGP 1, 2, 77", "STOP"]);
        bench.ok("SGP 81, 0, 1");
        bench.ok("132, 0, 0, 2000");
        bench.post(Source::Usb, "137, 0, 0, 1234");
        bench.run(delay * MILLISECOND);
        bench.post(Source::Usb, "133");
        for _ in 0..200 {
            bench.run(500 * MICROSECOND);
            assert!(shown(&mut bench).is_none_or(|command| command == Command::default()), "133 after {delay} ms");
        }
        while bench.module.sent().is_some() {}
        assert_eq!(bench.ok("GGP 81, 0"), 0, "133 after {delay} ms");
        assert_eq!(shown(&mut bench), Some(Command::default()), "133 after {delay} ms");
    }
}

/// The same while another host stores without pause, and with an EEPROM that fails.
#[test]
fn a_protected_program_is_not_seen_while_the_reset_waits() {
    for fault in ["off", "on"] {
        let mut bench = Bench::with_program(&["SGP 1, 2, 77", "STOP"]);
        bench.ok("SGP 81, 0, 3");
        bench.control(&format!("fault eeprom {fault}"));
        bench.post(Source::Usb, "137, 0, 0, 1234");
        for n in 0..200 {
            bench.post(Source::Usb, &format!("SGP 68, 0, {}", 60_000 + n));
            bench.run(500 * MICROSECOND);
            assert!(shown(&mut bench).is_none_or(|command| command == Command::default()), "fault {fault}, {n}");
        }
    }
}

/// A program that stores again and again does not keep a reset waiting.
#[test]
fn a_reset_comes_whatever_is_stored() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "AGP 0, 2", "STGP 0, 2", "JA 0"]);
    bench.ok("129, 1");
    bench.run(SECOND);
    bench.ok("255, 0, 0, 1234");
    bench.run(SECOND);
    assert_eq!((bench.ok("GGP 128, 0"), bench.ok("GGP 130, 0")), (0, 0));
}

/// A missed heartbeat stops motors for good: a program that starts them again and again cannot.
#[test]
fn no_program_moves_a_motor_while_the_host_is_silent() {
    for program in
        [&["ROR 0, 1000", "JA 0"][..], &["MVP REL, 0, 100000", "JA 0"], &["SAP 138, 0, 2", "SAP 2, 0, 1000", "JA 0"]]
    {
        let mut bench = Bench::with_program(program);
        bench.ok("SGP 68, 0, 100");
        bench.ok("129, 1");
        bench.run(3 * SECOND);
        let at = bench.rotor();
        bench.run(SECOND);
        assert_eq!(bench.rotor(), at, "{program:?}");
        // The host is back, and so is the motor.
        bench.ok("GGP 128, 0");
        bench.run(50 * MILLISECOND);
        assert_ne!(bench.rotor(), at, "{program:?}");
    }
}

/// Nobody is told that a program is stored which is not; another download writes what could not be written.
#[test]
fn a_download_that_fails_at_its_end() {
    let mut bench = Bench::new();
    bench.ok("132");
    assert_eq!(bench.ask("SGP 1, 2, 5").0, STORED);
    bench.control("fault eeprom on");
    bench.refused("133", EEPROM_LOCKED);
    bench.refused("129", NOT_AVAILABLE);
    bench.control("fault eeprom off");
    bench.refused("133", NOT_AVAILABLE);
    bench.ok("132");
    bench.ok("133");
    bench.power_cycle();
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 5);
    // A download that a restart has ended is not ended by 133.
    bench.ok("132");
    bench.power_cycle();
    bench.refused("133", NOT_AVAILABLE);
}

/// With a damaged program in it the EEPROM says "whole"; a 132 that could not be recorded begins no download.
#[test]
fn a_download_over_a_damaged_program() {
    let mut eeprom = Bench::with_program(&["SGP 1, 2, 5", "STOP"]).eeprom();
    eeprom[100] ^= 1;
    let mut bench = Bench::with_eeprom(&eeprom);
    bench.refused("129", NOT_AVAILABLE);
    bench.control("fault eeprom on");
    bench.refused("132", EEPROM_LOCKED);
    assert_eq!(bench.ask("SGP 1, 2, 9").0, OK, "it is executed, not stored");
    bench.control("fault eeprom off");
    for moment in 0..40 {
        let mut bench = Bench::with_eeprom(&eeprom);
        bench.ok("132");
        assert_eq!(bench.ask("SGP 1, 2, 6").0, STORED);
        bench.post(Source::Usb, "133");
        bench.run(moment * MILLISECOND);
        bench.control("fault eeprom on");
        bench.run(SECOND);
        let reply = binary::decode_reply(&bench.module.sent().unwrap().telegram().unwrap()).unwrap();
        let runs = bench.ask("129, 1").0;
        assert_eq!(reply.status == OK, runs == OK, "133: {}, 129: {runs}, fault after {moment} ms", reply.status);
    }
}

/// Stores of a program that was started anew in the middle of them take no room from the links.
#[test]
fn forgotten_stores_of_a_program_take_no_room() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "AGP 0, 2", "STGP 0, 2", "JA 0"]);
    for _ in 0..8 {
        assert_eq!(bench.ask_over(Source::Rs485, 1, "129, 1, 0, 0").unwrap().status, OK);
        bench.run(600 * MICROSECOND);
    }
    assert_eq!(bench.ask_over(Source::Rs485, 1, "STGP 3, 2").unwrap().status, OK);
}

/// A handler that ends within a subroutine leaves nothing on the program's stack.
#[test]
fn a_handler_that_ends_within_a_subroutine() {
    let mut bench = Bench::with_program(&[
        "VECT 0, 10",
        "SGP 0, 3, 5",
        "EI 0",
        "EI 255", // 0
        "CSUB 8",
        "JA 4",
        "STOP",
        "STOP", // 4
        "WAIT TICKS, 0, 1",
        "RSUB", // 8
        "CSUB 12",
        "SGP 9, 2, 1",
        "RETI", // 10: the handler; at 11 nobody comes
    ]);
    bench.ok("129, 1");
    bench.run(2 * SECOND);
    assert_eq!((bench.ok("GGP 128, 0"), bench.variable(9)), (1, 0));
}
