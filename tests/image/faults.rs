//! Faults around and inside the microcontroller, with the very flash image. Whatever goes wrong, no motor runs on
//! without a firmware that watches it, and the firmware says what has happened.

use common::image_host::{EEPROM_LOCKED, Host, NOT_AVAILABLE, OK, RECOVERY, START, assert_logged, decoded, request};
use common::telegram;
use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use hal_sim::fault::Fault;
use hal_sim::mcu::CanBus;

// ---- Chips that do not answer ----

#[test]
fn without_its_eeprom_the_module_runs_and_stores_nothing() {
    let mut host = Host::just_on("");
    host.fault(Fault::Eeprom, true);
    host.run(START);
    assert_logged(&host.log(), &["warn: EEPROM does not answer: defaults apply, nothing can be stored"]);
    assert_eq!(host.ask("STAP 4, 0"), (EEPROM_LOCKED, 0));
    // What it answers from then on is not believed: nobody has seen what is in there.
    host.fault(Fault::Eeprom, false);
    assert_eq!(host.ask("STGP 0, 2"), (EEPROM_LOCKED, 0));
    host.ok("MVP ABS, 0, 1000");
    host.run(SECOND);
    assert_eq!(host.rotor(), 1_000);
}

#[test]
fn an_eeprom_that_falls_silent_during_a_store_is_told_and_what_was_stored_stays() {
    let mut host = Host::new("");
    host.ok("SAP 4, 0, 1234");
    host.ok("STAP 4, 0");
    host.ok("SAP 4, 0, 777");
    host.ok("ROR 0, 500");
    host.log();
    // It falls silent when the first datagram for it begins.
    host.machine.rs485().send(&telegram("STAP 4, 0"), host.baud);
    let before = host.machine.board().datagrams(Chip::At25);
    host.wait(10 * MICROSECOND, SECOND, |host| host.machine.board().datagrams(Chip::At25) > before);
    host.fault(Fault::Eeprom, true);
    host.run(100 * MILLISECOND);
    let reply: Vec<u8> = host.machine.rs485().take_sent().iter().map(|character| character.value).collect();
    assert_eq!(decoded("STAP 4, 0", &reply), (EEPROM_LOCKED, 0));
    assert_logged(&host.log(), &["warn: EEPROM: no answer, or a page that could not be written"]);
    // All else goes on.
    assert_eq!((host.ok("GAP 3, 0"), host.speed()), (500, 500));
    host.fault(Fault::Eeprom, false);
    host.machine.set_power(false);
    host.run(SECOND);
    host.machine.set_power(true);
    host.run(START);
    assert_eq!(host.ok("GAP 4, 0"), 1_234);
}

/// A motion controller that is missing, or a bus that reads all ones: the driver stays off, the module answers, and
/// what it cannot do it does not promise.
#[test]
fn without_a_motion_controller_the_driver_stays_off_and_the_module_answers() {
    for fault in [Fault::Spi, Fault::SpiLow, Fault::Tmc429] {
        let mut host = Host::just_on("");
        host.fault(fault, true);
        host.run(START);
        assert!(!host.bridges_on());
        assert_eq!(host.ok("GGP 66, 0"), 1);
        assert_eq!(host.ask("ROR 0, 500").0, NOT_AVAILABLE, "{fault:?}");
        host.run(200 * MILLISECOND);
        assert!(!host.bridges_on() && host.rotor() == 0, "{fault:?}");
    }
}

/// A driver that does not answer while the motor runs: it is stopped, and, repaired, goes on when it is told to.
#[test]
fn a_driver_that_does_not_answer_stops_the_motor() {
    let mut host = Host::moving();
    host.fault(Fault::Tmc262, true);
    let took = host.wait(MILLISECOND, SECOND, |host| host.speed() == 0);
    assert!(took <= 50 * MILLISECOND, "{took}");
    assert_eq!(host.ok("GGP 66, 0"), 1);
    host.assert_rest();
    host.fault(Fault::Tmc262, false);
    host.ok("ROR 0, 500");
    host.run(200 * MILLISECOND);
    assert_eq!(host.speed(), 500);
}

/// A motion controller that does not answer any more, or a bus that reads all ones or all zeros. Nobody knows what the
/// controller does, so the driver is switched off, until the next start. The module answers and invents no values.
#[test]
fn a_motion_controller_that_does_not_answer_any_more_ends_in_a_driver_that_is_off() {
    for (fault, limit) in [(Fault::Spi, 6), (Fault::Tmc429, 6), (Fault::SpiLow, 70)] {
        let mut host = Host::moving();
        host.fault(fault, true);
        let took = host.wait(MICROSECOND, SECOND, |host| !host.bridges_on());
        println!("{fault:?}: driver off after {} us", took / MICROSECOND);
        assert!(took <= limit * MILLISECOND, "{fault:?}");
        assert_eq!(host.ok("GGP 66, 0"), 1, "{fault:?}");
        assert!(host.machine.board().world().outputs().leds[1]);
        let told = "error: motion controller does not answer: motor drivers off";
        assert_eq!(host.log(), [told], "{fault:?}");
        assert_eq!((host.ask("GAP 1, 0").0, host.ask("ROR 0, 500").0), (NOT_AVAILABLE, NOT_AVAILABLE), "{fault:?}");
        // What it has missed it hears as soon as it can.
        host.fault(fault, false);
        host.run(10 * MILLISECOND);
        host.assert_rest();
        assert_eq!((host.ask("MVP ABS, 0, 100").0, host.bridges_on()), (NOT_AVAILABLE, false), "{fault:?}");
        host.ok("255, 0, 0, 1234");
        host.run(RECOVERY);
        host.ok("ROR 0, 500");
        host.run(200 * MILLISECOND);
        assert_eq!((host.speed(), host.bridges_on()), (500, true), "{fault:?}");
        assert!(!host.machine.board().world().outputs().leds[1]);
    }
}

// ---- Links ----

#[test]
fn a_can_bus_that_is_shorted_for_a_while_is_left_and_joined_again() {
    let mut host = Host::moving();
    assert_eq!(host.ask_can("GAP 4, 0"), (OK, 1_000));
    host.machine.can().send(request(1, "GAP 5, 0"));
    // The request has arrived; the reply meets shorted wires.
    host.run(120 * MICROSECOND);
    host.machine.can().set_bus(CanBus { shorted: true, ..CanBus::default() });
    host.run(100 * MILLISECOND);
    assert_eq!(host.machine.can().take_sent(), []);
    assert_eq!((host.ok("GAP 3, 0"), host.speed()), (500, 500), "the other links do not notice");
    host.machine.can().set_bus(CanBus::default());
    host.run(20 * MILLISECOND);
    host.machine.can().take_sent();
    assert_eq!(host.ask_can("GAP 6, 0").0, OK);
    assert_eq!(host.ask_can("MST 0").0, OK);
    host.run(100 * MILLISECOND);
    host.assert_rest();
}

#[test]
fn a_usb_cable_pulled_in_the_middle_of_a_telegram_leaves_nothing_behind() {
    let mut host = Host::moving();
    host.plug_usb();
    assert_eq!(host.ask_usb("GAP 4, 0"), (OK, 1_000));
    for sent in 1..9 {
        host.machine.usb().send(&telegram("GAP 4, 0")[..sent]);
        host.run(5 * MILLISECOND);
        host.machine.usb().plug(false);
        host.run(20 * MILLISECOND);
        assert_eq!(host.ok("GAP 3, 0"), 500, "the other links do not notice");
        host.plug_usb();
        assert_eq!(host.ask_usb("GAP 5, 0"), (OK, 1_000), "after {sent} bytes");
    }
    // With a reply on its way.
    host.machine.usb().send(&telegram("GAP 4, 0"));
    host.machine.usb().plug(false);
    host.run(20 * MILLISECOND);
    host.plug_usb();
    assert_eq!(host.ask_usb("GAP 6, 0"), (OK, 128));
    assert_logged(&host.log(), &["info: USB: host connected", "info: USB: host gone", "info: USB: host connected"]);
    assert_eq!(host.machine.counters().starts, 1);
}

/// Messages that nobody fetches do not stop the firmware, though a debug probe had asked it to wait for that.
#[test]
fn a_debug_probe_that_is_pulled_off_does_not_stop_the_firmware() {
    let mut host = Host::moving();
    host.machine.log().pull_probe();
    // Two messages each time, of 5 bytes and more; the buffer has 1024.
    for _ in 0..120 {
        host.machine.usb().plug(true);
        host.run(400 * MILLISECOND);
        assert!(host.machine.usb().device().open);
        host.machine.usb().plug(false);
        host.run(10 * MILLISECOND);
    }
    assert_eq!((host.ok("GAP 3, 0"), host.speed(), host.machine.counters().starts), (500, 500, 1));
}

/// A reset that is asked for comes, though a program on a USB host does not read the replies that are there for it.
#[test]
fn a_usb_host_that_does_not_read_does_not_keep_the_module_from_its_reset() {
    let mut host = Host::moving();
    host.plug_usb();
    host.machine.usb().set_reading(false);
    host.machine.usb().send(&[telegram("GAP 4, 0"); 4].concat());
    host.run(20 * MILLISECOND);
    assert_eq!((host.ok("GAP 3, 0"), host.ok("255, 0, 0, 1234")), (500, 1_234), "the other links do not notice");
    host.run(SECOND);
    assert_eq!(host.machine.counters().starts, 2);
    host.assert_rest();
}

#[test]
fn a_break_or_noise_on_rs485_ends_a_telegram_and_the_next_one_is_answered() {
    let mut host = Host::new("");
    let whole = telegram("GAP 4, 0");
    let answer = host.said_to(&whole, 50 * MILLISECOND);
    assert_eq!(answer.len(), 9);
    // Breaks of a character, of two and a bit, and of ten milliseconds; and a character of sixteenths of a bit, with
    // a spike at the middle of bit 4.
    let spiked = (0xF_u128 << 108 | 0xFFF << 60) ^ 1 << 65;
    let disturbances = [(0, 11, host.baud), (0, 21, host.baud), (0, 100, host.baud), (spiked, 120, 12 * host.baud)];
    for (levels, bits, baud) in disturbances {
        for sent in [0, 1, 4, 8] {
            let now = host.machine.now();
            host.machine.rs485().send_at(now, &whole[..sent], host.baud);
            let end = host.machine.rs485().send_levels(now, levels, bits, baud);
            // A bit of silence, and the next one follows.
            let next = host.machine.rs485().send_at(end + SECOND / 9_600, &whole, host.baud);
            host.machine.run_until(next + 50 * MILLISECOND).unwrap();
            let said: Vec<u8> = host.machine.rs485().take_sent().iter().map(|character| character.value).collect();
            assert_eq!(said, answer, "{bits} levels {levels:x} after {sent} bytes");
        }
    }
}

// ---- Supply ----

/// Manual section 12.1, firmware 1.35: below 8.5 V the motor is stopped and locked, above 9.5 V released.
#[test]
fn a_supply_dip_stops_and_locks_the_motor_until_the_supply_is_back() {
    let mut host = Host::moving();
    let supply = |host: &mut Host, volts: f64| host.machine.board().change_world(|world| world.set_supply(volts));
    // What the converter makes of 8.5 V is within 0.1 V of it.
    for volts in [12.0, 8.7] {
        supply(&mut host, volts);
        host.run(20 * MILLISECOND);
        assert_eq!(host.speed(), 500, "{volts} V");
    }
    supply(&mut host, 8.3);
    let took = host.wait(100 * MICROSECOND, SECOND, |host| host.speed() == 0);
    println!("stops {} us after the dip", took / MICROSECOND);
    // Two readings, 2 ms apart, looked at each millisecond.
    assert!(took <= 6 * MILLISECOND, "{took}");
    host.assert_rest();
    assert_eq!(host.ask("ROR 0, 500").0, NOT_AVAILABLE);
    supply(&mut host, 9.3);
    host.run(20 * MILLISECOND);
    assert_eq!(host.ask("ROR 0, 500").0, NOT_AVAILABLE);
    // So low that the driver forgets its registers, as the microcontroller lives on USB.
    supply(&mut host, 0.0);
    host.run(20 * MILLISECOND);
    supply(&mut host, 24.0);
    host.run(20 * MILLISECOND);
    host.assert_rest();
    let start = host.rotor();
    host.ok("MVP REL, 0, 5120");
    host.run(SECOND);
    assert_eq!((host.rotor() - start, host.bridges_on(), host.machine.counters().starts), (5_120, true, 1));
}

/// A supply that is not there from the start, as the microcontroller lives on USB: a program that starts by itself
/// waits for it.
#[test]
fn a_program_does_not_start_before_there_is_a_supply() {
    let mut host = Host::new("");
    for line in ["132, 0, 0, 0", "SIO 0, 2, 1", "STOP", "133, 0, 0, 0", "SGP 77, 0, 1"] {
        host.ask(line);
    }
    host.run(100 * MILLISECOND);
    let out = |host: &mut Host| host.machine.board().world().outputs().is_on(0);
    for volts in [0.0, 24.0] {
        host.machine.set_power(false);
        host.run(100 * MILLISECOND);
        host.machine.board().change_world(|world| world.set_supply(volts));
        host.machine.set_power(true);
        host.run(START);
        assert_eq!((out(&mut host), host.ask("ROR 0, 0").0), (volts > 0.0, OK), "{volts} V");
        if volts == 0.0 {
            assert_eq!(host.ask("ROR 0, 100").0, NOT_AVAILABLE);
            host.machine.board().change_world(|world| world.set_supply(24.0));
            host.run(100 * MILLISECOND);
            assert!(out(&mut host));
        }
    }
}

/// A dip that is over at the next look is none: the chopper makes such.
#[test]
fn a_dip_of_microseconds_is_no_loss_of_supply() {
    let mut host = Host::moving();
    for n in 0..500 {
        for (volts, span) in [(7.0, 20 * MICROSECOND), (24.0, (2_900 + n * 37 % 211) * MICROSECOND)] {
            host.machine.board().change_world(|world| world.set_supply(volts));
            host.run(span);
        }
        assert_eq!(host.speed(), 500);
    }
}

/// The supply goes away for moments at any time: while it starts, while it moves, while it stores.
#[test]
fn power_cuts_at_any_time_leave_a_module_that_starts_and_stands() {
    let mut host = Host::just_on("");
    for (nth, after) in [1, 2_100, 2_400, 20_000, 55_000].into_iter().enumerate() {
        host.run(after * MICROSECOND);
        host.machine.set_power(false);
        host.run(MILLISECOND);
        assert!(!host.bridges_on());
        host.machine.set_power(true);
        assert_eq!(host.machine.counters().starts, nth as u64 + 2);
    }
    host.run(START);
    host.ok("SAP 4, 0, 1234");
    host.ok("ROR 0, 500");
    host.machine.rs485().send(&telegram("STAP 4, 0"), host.baud);
    host.run(13 * MILLISECOND);
    assert_eq!((host.speed() > 0, host.machine.board().at25().is_writing()), (true, true));
    host.machine.set_power(false);
    host.run(MILLISECOND);
    host.machine.set_power(true);
    host.run(START);
    host.machine.rs485().take_sent();
    host.assert_rest();
    assert_eq!(host.ok("GAP 4, 0"), 1_000);
    assert_logged(&host.log(), &["info: power on"]);
}

/// The crystal gives the TMC429 its clock and the microcontroller its time: without it nothing is known of the motor.
#[test]
fn a_crystal_that_stops_switches_the_driver_off_and_one_that_does_not_start_leaves_it_off() {
    let mut host = Host::moving();
    host.machine.set_crystal(false);
    host.run(10 * MICROSECOND);
    assert!(!host.bridges_on());
    host.run(MILLISECOND);
    assert_logged(&host.log(), &["error: the crystal has stopped"]);
    // The watchdog tries again and again, with LED2 on, and without touching the motor.
    for starts in 2..5 {
        host.reset_within(SECOND);
        assert_eq!(host.machine.counters().starts, starts);
        host.run(10 * MILLISECOND);
        assert!(!host.bridges_on() && host.machine.board().world().outputs().leds[1]);
    }
    host.machine.set_crystal(true);
    host.reset_within(SECOND);
    host.run(START);
    assert_logged(&host.log(), &["error: restarted after the crystal had stopped"]);
    host.machine.rs485().take_sent();
    host.ok("ROR 0, 500");
    host.run(200 * MILLISECOND);
    assert_eq!((host.speed(), host.bridges_on()), (500, true));
}
