//! Causes that stop the motor from outside: heartbeats, a low supply, a driver that has shut down.

use common::loose::{BROKEN, LooseBench};
use common::table::GLOBAL;
use common::{Bench, NOT_AVAILABLE, OK, telegram};
use embedded_hal::spi::SpiDevice;
use hal_sim::board::{Board, Chip, SharedBoard};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use std::task::Poll;
use tmcm::can::{CanFrame, Frame};
use tmcm::module::Source;
use tmcm::tmcl::can::encode_command;
use tmcm::tmcl::{Reply, Status, binary, text};
use tmcm::vm::ErrorFlag;
use tmcm_sim::VirtualModule;

/// Global parameter 68: the motor runs as long as commands come, over RS485 or USB, and stops along its ramp
/// when none has come for that long.
#[test]
fn the_serial_heartbeat() {
    let mut bench = Bench::new();
    bench.configure(&["SGP 68, 0, 200", "ROR 0, 500"]);
    for source in [Source::Usb, Source::Rs485].into_iter().cycle().take(10) {
        bench.run(190 * MILLISECOND);
        assert!(bench.exchange(source, telegram("GAP 1, 0")).is_some());
        assert_eq!(bench.speed(), 500);
    }
    bench.run(195 * MILLISECOND);
    assert_eq!(bench.speed(), 500);
    // 500 at acceleration 1000: 33 ms.
    bench.run(50 * MILLISECOND);
    assert_eq!(bench.speed(), 0);
    // The next command is heard; nothing starts by itself.
    assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GAP 207, 0")), (0, 0));
    // Telegrams for somebody else, or broken ones, are no sign of life.
    bench.configure(&["ROR 0, 500"]);
    for _ in 0..20 {
        bench.run(15 * MILLISECOND);
        bench.module.receive(Source::Rs485, binary::encode_command(77, text::parse("GAP 1, 0").unwrap()));
    }
    assert_eq!(bench.speed(), 0);
    bench.configure(&["SGP 68, 0, 0", "ROR 0, 500"]);
    bench.run(5 * SECOND);
    assert_eq!(bench.speed(), 500);
}

/// A command over CAN, which is carried out.
fn can(bench: &mut Bench, line: &str) {
    assert_eq!(over_can(bench, line), OK, "{line}");
}

/// The status of a command over CAN.
fn over_can(bench: &mut Bench, line: &str) -> u8 {
    let data = encode_command(text::parse(line).unwrap());
    bench.module.receive_frame(Frame::standard(1, &data).unwrap());
    let mut reply = None;
    bench.run_until(50 * MILLISECOND, |bench| {
        reply = bench.module.frame();
        reply.is_some()
    });
    reply.unwrap().data()[1]
}

/// Parameter 82 is the same for CAN; one heartbeat does not keep up the other.
#[test]
fn the_can_heartbeat() {
    type Link = fn(&mut Bench, &str);
    for (parameter, source, other) in [(82, can as Link, serial as Link), (68, serial, can)] {
        let mut bench = Bench::new();
        // Time counts from here on, however long nobody has said anything.
        bench.run(SECOND);
        other(&mut bench, "ROR 0, 500");
        other(&mut bench, &format!("SGP {parameter}, 0, 200"));
        bench.run(190 * MILLISECOND);
        assert_eq!(bench.speed(), 500, "{parameter}");
        for _ in 0..10 {
            source(&mut bench, "GAP 1, 0");
            bench.run(190 * MILLISECOND);
            assert_eq!(bench.speed(), 500, "{parameter}");
        }
        other(&mut bench, "GAP 1, 0");
        bench.run(15 * MILLISECOND);
        // It stops along the ramp.
        assert!((1..500).contains(&bench.speed()), "{parameter}: {}", bench.speed());
        bench.run(50 * MILLISECOND);
        assert_eq!(bench.speed(), 0, "{parameter}");
    }
}

fn serial(bench: &mut Bench, line: &str) {
    bench.ok(line);
}

/// As long as the link is silent nothing moves for long, whoever starts it and however often.
#[test]
fn a_lost_heartbeat_stops_every_move() {
    let mut bench = Bench::new();
    // A program that starts the motor again and again.
    for line in ["132, 0, 0, 0", "ROR 0, 500", "WAIT TICKS, 0, 1", "JA 0", "133"] {
        assert!(bench.ask(line).0 >= OK, "{line}");
    }
    bench.configure(&["SGP 68, 0, 200"]);
    bench.run(300 * MILLISECOND);
    for line in ["ROR 0, 500", "MVP REL, 0, 100000", "RFS START, 0", "SAP 0, 0, 77777", "SAP 138, 0, 2"] {
        assert_eq!(over_can(&mut bench, line), NOT_AVAILABLE, "{line}");
        bench.run(100 * MILLISECOND);
        assert_eq!(bench.speed(), 0, "{line}");
    }
    can(&mut bench, "129");
    for _ in 0..50 {
        bench.run(10 * MILLISECOND);
        assert!(bench.speed() < 100, "{}", bench.speed());
    }
    can(&mut bench, "128");
    // What does not move is left as it is, in ramp mode.
    bench.configure(&["SGP 68, 0, 1000", "MVP REL, 0, 100"]);
    bench.run(1300 * MILLISECOND);
    // There parameter 2 has no effect, so there is nothing to refuse.
    assert_eq!((over_can(&mut bench, "ROR 0, 500"), over_can(&mut bench, "SAP 2, 0, 500")), (NOT_AVAILABLE, OK));
    assert_eq!((bench.ok("GAP 138, 0"), bench.ok("GAP 8, 0")), (0, 1));
    // A new limit begins anew, the same one written again as well.
    bench.run(300 * MILLISECOND);
    for limit in [200, 200, 150] {
        can(&mut bench, &format!("SGP 68, 0, {limit}"));
        can(&mut bench, "ROR 0, 500");
        bench.run(90 * MILLISECOND);
        assert_eq!(bench.speed(), 500);
        bench.run(200 * MILLISECOND);
        assert_eq!(bench.speed(), 0);
    }
}

/// Below 8.5 V the motor stops and is locked, above 9.5 V it is released; in between nothing changes.
#[test]
fn a_low_supply_locks_the_motor() {
    let mut bench = Bench::new();
    bench.ok("ROR 0, 500");
    bench.run(SECOND);
    for volts in ["20", "10", "9.0", "8.6", "8.5"] {
        bench.control(&format!("supply {volts}"));
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.speed(), 500, "{volts}");
    }
    for volts in ["8.4", "5", "8.6", "9.5"] {
        bench.control(&format!("supply {volts}"));
        bench.run(2 * MILLISECOND);
        assert_eq!(bench.speed(), 0, "{volts}");
        for line in [
            "ROR 0, 500",
            "ROL 0, 1",
            "MVP ABS, 0, 100",
            "MVP REL, 0, 1",
            "MVP COORD, 0, 1",
            "SAP 0, 0, 7",
            "SAP 2, 0, 7",
            "SAP 138, 0, 0",
            "RFS START, 0",
        ] {
            assert_eq!(bench.ask(line).0, NOT_AVAILABLE, "{line} at {volts} V");
        }
        for line in ["MST 0", "GAP 1, 0", "SAP 4, 0, 900", "RFS STOP, 0", "RFS STATUS, 0", "GIO 8, 1"] {
            assert_eq!(bench.ask(line).0, OK, "{line} at {volts} V");
        }
    }
    bench.control("supply 9.6");
    bench.run(2 * MILLISECOND);
    assert_eq!(bench.speed(), 0);
    bench.ok("ROR 0, 500");
    bench.run(SECOND);
    assert_eq!(bench.speed(), 500);
}

/// A module that runs on USB power alone has no driver supply; once that comes the driver is set up.
#[test]
fn the_driver_is_set_up_when_its_supply_comes() {
    let mut bench = Bench::in_world("[supply]\nvolts = 0\n");
    bench.run(SECOND);
    assert_eq!(bench.ask("ROR 0, 500").0, NOT_AVAILABLE);
    bench.configure(&["SAP 140, 0, 6"]);
    bench.control("supply 24");
    bench.run(3 * MILLISECOND);
    let registers = bench.module.board().borrow().tmc262(0).registers();
    assert_eq!((registers.chopconf, registers.drvctrl), (0x9_0135, 2));
}

/// Over-temperature (bit 1) and shorts (bits 3 and 4 of parameter 208) stop the motor and stay readable until
/// the next motion command, which gives the driver another chance.
#[test]
fn a_driver_that_shuts_down_stops_the_motor() {
    for (fault, flag) in [("overtemperature", 2), ("short-a", 8), ("short-b", 16)] {
        let mut bench = Bench::new();
        bench.ok("MVP ABS, 0, 1000000");
        bench.run(SECOND);
        bench.control(&format!("fault {fault} on"));
        bench.run(10 * MILLISECOND);
        assert_eq!(bench.speed(), 0, "{fault}");
        assert_eq!(bench.ok("GAP 208, 0") & flag, flag, "{fault}");
        // As long as it is there the motor does not get far.
        bench.ok("ROR 0, 500");
        bench.run(20 * MILLISECOND);
        assert_eq!(bench.speed(), 0, "{fault}");
        bench.control(&format!("fault {fault} off"));
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 208, 0") & flag, flag, "{fault}: gone, but still readable");
        let start = bench.ok("GAP 1, 0");
        bench.ok("MVP REL, 0, 51200");
        bench.run(3 * SECOND);
        assert_eq!((bench.ok("GAP 1, 0") - start, bench.ok("GAP 208, 0") & flag), (51_200, 0), "{fault}");
        assert!(bench.module.board().borrow().tmc262(0).bridges_on(), "{fault}");
    }
}

/// A stop that does not get through to the motion controller is repeated until it does, whatever it was for, even if
/// that is over by then. It is told of at once.
#[test]
fn a_stop_that_is_not_heard_is_repeated() {
    for (set_up, cause, over, flag) in [
        ("GAP 1, 0", "supply 8.4", "supply 9.0", Some(ErrorFlag::Shutdown)),
        ("GAP 1, 0", "fault short-a on", "fault short-a off", Some(ErrorFlag::Alarm)),
        ("SAP 212, 0, 1000", "slip -20", "slip 20", Some(ErrorFlag::Deviation)),
        ("SGP 68, 0, 300", "supply 24", "supply 24", None),
    ] {
        let mut bench = LooseBench::new();
        bench.ok(set_up);
        bench.ok("ROR 0, 300");
        bench.run(250);
        for flag in [ErrorFlag::Alarm, ErrorFlag::Deviation, ErrorFlag::Position, ErrorFlag::Shutdown] {
            assert!(!bench.raised(flag), "{cause}");
        }
        bench.fails.set(BROKEN);
        bench.control(cause);
        bench.run(100);
        assert_eq!(bench.speed(), 300, "{cause}: nothing can be written");
        assert!(flag.is_none_or(|flag| bench.raised(flag)), "{cause}");
        bench.control(over);
        bench.run(5);
        bench.fails.set(0);
        bench.run(2);
        assert_eq!(bench.speed(), 0, "{cause}");
    }
}

/// A motion controller that has not answered in three polls is given up; less is a disturbance.
#[test]
fn a_motion_controller_is_given_up_after_three_polls_without_an_answer() {
    let mut bench = LooseBench::new();
    bench.ok("ROR 0, 300");
    bench.run(250);
    let bridges_on = |bench: &LooseBench| bench.board.borrow().tmc262(0).bridges_on();
    for _ in 0..10 {
        // What the third poll hears is what was said after the second one.
        bench.control("fault tmc429 on");
        bench.run(2);
        bench.control("fault tmc429 off");
        bench.run(10);
        assert!((bench.speed(), bridges_on(&bench), bench.raised(ErrorFlag::Alarm)) == (300, true, false));
    }
    bench.control("fault tmc429 on");
    bench.run(3);
    assert!(bridges_on(&bench));
    bench.run(1);
    assert!(!bridges_on(&bench) && bench.raised(ErrorFlag::Alarm));
}

/// However much is read of the motion controller in between, a bus that reads zeros is noticed.
#[test]
fn a_motion_bus_that_reads_zeros_is_noticed_while_a_program_and_a_host_read() {
    let mut bench = Bench::new();
    for line in ["132, 0, 0, 0", "GAP 1, 0", "GAP 3, 0", "JA 0", "133, 0, 0, 0", "129, 0, 0, 0", "ROR 0, 300"] {
        assert!(matches!(bench.ask(line).0, OK | 101), "{line}");
    }
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.speed(), bench.ok("GGP 128, 0")), (300, 1));
    bench.control("fault spi-low on");
    for _ in 0..70 {
        bench.ask("GAP 1, 0");
        bench.run(MILLISECOND);
    }
    assert!(!bench.module.board().borrow().tmc262(0).bridges_on());
    assert_eq!((bench.ok("GGP 128, 0"), bench.ask("GAP 1, 0").0), (0, NOT_AVAILABLE));
}

/// A motion controller that is silent while the supply is too low may have lost its own: it is not given up for that.
/// One that was given up before is tried once more when the supply is back.
#[test]
fn a_controller_that_was_given_up_is_tried_again_when_the_supply_comes_back() {
    let mut bench = Bench::new();
    bench.control("supply 8");
    bench.control("fault tmc429 on");
    bench.run(100 * MILLISECOND);
    bench.control("fault tmc429 off");
    bench.control("supply 24");
    bench.run(10 * MILLISECOND);
    assert_eq!((bench.ask("ROR 0, 300").0, bench.current() > 0), (OK, true));

    bench.control("fault tmc429 on");
    bench.run(100 * MILLISECOND);
    bench.control("fault tmc429 off");
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.ask("ROR 0, 300").0, bench.current() > 0), (NOT_AVAILABLE, false));
    for volts in [8, 24] {
        bench.control(&format!("supply {volts}"));
        bench.run(10 * MILLISECOND);
    }
    assert_eq!((bench.ask("ROR 0, 300").0, bench.current() > 0), (OK, true));
    bench.run(SECOND);
    assert_eq!(bench.speed(), 300);
}

/// A controller that was given up inverts, when it is set up again, what it inverted before.
#[test]
fn a_controller_that_comes_back_inverts_what_it_did() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("SGP 79, 0, 1").0, OK);
    bench.run(10 * MILLISECOND);
    let switches = [10, 11].map(|number| bench.ask(&format!("GAP {number}, 0")).1);
    bench.control("fault tmc429 on");
    bench.run(100 * MILLISECOND);
    bench.control("fault tmc429 off");
    for volts in [8, 24] {
        bench.control(&format!("supply {volts}"));
        bench.run(10 * MILLISECOND);
    }
    assert_eq!(bench.ask("ROR 0, 0").0, OK, "it is in use again");
    assert_eq!([10, 11].map(|number| bench.ask(&format!("GAP {number}, 0")).1), switches);
}

/// Another firmware may have left an interrupt of the motion controller pending: that is no silence.
#[test]
fn a_pending_interrupt_of_the_motion_controller_does_not_look_like_silence() {
    let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
    let mut spi = board.spi(Chip::Tmc429(0), 1_000_000);
    // Of motor 0, all interrupts (index 0xB) enabled; the target (index 0) goes away, and is where the motor stands
    // again.
    for datagram in [[0xB << 1, 0, 0xFF, 0], [0, 0, 0, 5], [0, 0, 0, 0]] {
        let mut datagram: [u8; 4] = datagram;
        spi.transfer_in_place(&mut datagram).unwrap();
        let later = board.borrow().now() + MILLISECOND;
        board.borrow_mut().advance_to(later);
    }
    let mut status = [0xB << 1 | 1, 0, 0, 0];
    spi.transfer_in_place(&mut status).unwrap();
    assert!(status[0] & 0x80 != 0, "{status:x?}");
    let mut bench = LooseBench::on(board, 0);
    bench.ok("ROR 0, 300");
    bench.run(250);
    assert_eq!((bench.speed(), bench.board.borrow().tmc262(0).bridges_on()), (300, true));
}

/// A disturbance at the start is not the end, a bus that stays broken is.
#[test]
fn the_motion_controller_is_tried_three_times_at_the_start() {
    for (disturbed, starts) in [(1, true), (20, true), (BROKEN, false)] {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        let mut bench = LooseBench::on(board, disturbed);
        bench.run(2);
        assert_eq!(bench.board.borrow().tmc262(0).bridges_on(), starts, "{disturbed}");
        if starts {
            bench.ok("ROR 0, 300");
            bench.run(250);
            assert_eq!(bench.speed(), 300);
        }
    }
}

/// With a motion controller that was silent at power-on, each global parameter does what it needs no motion controller
/// for. The two that need it are refused and stay as they are.
#[test]
fn global_parameters_with_a_silent_motion_controller() {
    let silent = || {
        let mut bench = Bench::new();
        bench.control("fault tmc429 on");
        bench.power_cycle();
        bench.run(100 * MILLISECOND);
        bench
    };
    for row in GLOBAL.rows.iter().filter(|row| row.is_writable() && !matches!(row.number, 79 | 90 | 255)) {
        let mut bench = silent();
        for value in row.limits() {
            GLOBAL.set(&mut bench, row, value);
        }
    }
    let mut bench = silent();
    for number in [79, 90] {
        for value in [1, 0, 1] {
            bench.refused(&format!("SGP {number}, 0, {value}"), NOT_AVAILABLE);
            assert_eq!(bench.ok(&format!("GGP {number}, 0")), 0);
        }
    }
    // The others take effect.
    bench.ok("SGP 132, 0, 1000000");
    assert!((1_000_000..1_000_010).contains(&bench.ok("GGP 132, 0")));
    let mut drawn = || {
        bench.ok("SGP 133, 0, 5");
        bench.ok("GGP 133, 0")
    };
    assert_eq!(drawn(), drawn());
    // When the motion controller is back after a restart, what was refused has left no trace: the switch stops as
    // before.
    bench.control("fault tmc429 off");
    bench.power_cycle();
    bench.run(100 * MILLISECOND);
    bench.control("press left");
    bench.run(5 * MILLISECOND);
    assert_eq!((bench.ok("GAP 11, 0"), bench.ok("GAP 10, 0"), bench.ok("GGP 90, 0")), (1, 0, 0));
}

/// A setting that does not get through to the motion controller is not in force, and not shown either.
#[test]
fn a_setting_that_is_not_heard_is_taken_back() {
    for (set, get) in [("SAP 5, 0, 500", "GAP 5, 0"), ("SGP 79, 0, 1", "GGP 79, 0"), ("SGP 90, 0, 1", "GGP 90, 0")] {
        let mut bench = LooseBench::new();
        bench.run(2);
        let fails = bench.fails.clone();
        let mut ask = |line: &str| {
            let now = bench.now();
            match bench.module.execute(now, Source::Usb, text::parse(line).unwrap()) {
                Poll::Ready(Some(Reply::Plain { status, value, .. })) => (status, value),
                other => panic!("{line}: {other:?}"),
            }
        };
        let (_, before) = ask(get);
        fails.set(BROKEN);
        assert_eq!(ask(set).0, Status::NotAvailable, "{set}");
        assert_eq!(ask(get), (Status::Ok, before), "{set}");
    }
}
