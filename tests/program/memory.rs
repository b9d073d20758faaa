//! Program memory over time: power cycles, downloads cut short, protection, start by itself, resets (manual sections
//! 5.1 and 8.7).

use common::program::{MEMORY, RUNNING, STOPPED, STORED};
use common::{Bench, EEPROM_LOCKED, INVALID_VALUE, NOT_AVAILABLE, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary, text};
use tmcm_sim::VirtualModule;

/// Notes that it ran, in variable 1, which is in RAM only.
const NOTE: [&str; 4] = ["GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "STOP"];

/// The command that protected or erased memory shows.
const NOTHING: Command = Command::new(0, 0, 0, 0);

fn shows(bench: &mut Bench, lines: &[&str]) -> bool {
    (0..).zip(lines).all(|(address, line)| bench.memory(address) == text::parse(line).unwrap())
}

fn is_empty(bench: &mut Bench) -> bool {
    [0, 1, 2, 3, 8, 9, 100, 101, MEMORY - 1].iter().all(|address| bench.memory(*address) == NOTHING)
}

// ---- power

#[test]
fn a_program_survives_power_cycles() {
    let mut bench = Bench::with_program(&NOTE);
    bench.download(MEMORY - 1, &["SGP 5, 2, 6"]);
    for _ in 0..3 {
        bench.power_cycle();
        assert!(shows(&mut bench, &NOTE));
        assert_eq!(bench.memory(MEMORY - 1), text::parse("SGP 5, 2, 6").unwrap());
        assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 0), "it does not start by itself");
        bench.run_to_end(0);
        assert_eq!(bench.variable(1), 1);
    }
}

#[test]
fn autostart_runs_the_program_after_power_up() {
    let mut bench = Bench::with_program(&NOTE);
    bench.download(50, &["SGP 2, 2, 1", "STOP"]);
    bench.run_to_end(50);
    bench.ok("SGP 77, 0, 1");
    assert_eq!((bench.variable(1), bench.variable(2)), (0, 1), "it is for the next start");
    for _ in 0..3 {
        bench.power_cycle();
        bench.run(10 * MILLISECOND);
        assert_eq!((bench.variable(1), bench.variable(2)), (1, 0), "from address 0, once");
    }
    // The software reset is a start, too.
    bench.ok("255, 0, 0, 1234");
    bench.run(100 * MILLISECOND);
    assert_eq!(bench.variable(1), 1);
    bench.ok("SGP 77, 0, 0");
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, 0));
    // Without a program there is nothing to start.
    let mut bench = Bench::new();
    bench.ok("SGP 77, 0, 1");
    bench.power_cycle();
    bench.run(SECOND);
    assert_eq!(bench.mode(), STOPPED);
}

/// Coordinates and variables that are stored in the EEPROM are there before the program starts.
#[test]
fn autostart_comes_after_what_is_restored() {
    let mut bench =
        Bench::with_program(&["GCO 1, 0", "AGP 200, 2", "GGP 5, 2", "AGP 201, 2", "GAP 4, 0", "AGP 202, 2", "STOP"]);
    for line in
        ["SGP 84, 0, 1", "SCO 1, 0, 11", "SGP 5, 2, 12", "STGP 5, 2", "SAP 4, 0, 13", "STAP 4, 0", "SGP 77, 0, 1"]
    {
        bench.ok(line);
    }
    bench.power_cycle();
    bench.run(10 * MILLISECOND);
    assert_eq!([200, 201, 202].map(|n| bench.variable(n)), [11, 12, 13]);
}

#[test]
fn a_software_reset_ends_the_program_and_keeps_it() {
    let mut bench = Bench::with_program(&["CALC LOAD, 9", "CALCX LOAD", "JA 0"]);
    bench.start(0);
    bench.run(SECOND);
    bench.ok("255, 0, 0, 1234");
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.status().mode, bench.program_counter(), bench.accumulator(), bench.x()), (STOPPED, 0, 0, 0));
    assert_eq!(bench.memory(0), text::parse("CALC LOAD, 9").unwrap());
}

/// Below 8.5 V the program stops, above 9.5 V it starts again from the beginning if it starts by itself at all.
#[test]
fn a_low_supply_stops_the_program() {
    // It counts its starts in variable 0 and its rounds in variable 1.
    let program =
        ["GGP 0, 2", "CALC ADD, 1", "AGP 0, 2", "GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "WAIT TICKS, 0, 1", "JA 3"];
    for autostart in [0, 1] {
        let mut bench = Bench::with_program(&program);
        bench.ok(&format!("SGP 77, 0, {autostart}"));
        bench.start(0);
        bench.run(SECOND);
        for volts in ["8.6", "24"] {
            bench.control(&format!("supply {volts}"));
            bench.run(SECOND);
            assert_eq!((bench.mode(), bench.variable(0)), (RUNNING, 1), "{volts} V");
        }
        for volts in ["8.4", "9.4"] {
            bench.control(&format!("supply {volts}"));
            bench.run(10 * MILLISECOND);
            let rounds = bench.variable(1);
            bench.run(SECOND);
            assert_eq!((bench.mode(), bench.variable(1)), (STOPPED, rounds), "{volts} V");
            for line in ["129, 0", "129, 1", "130"] {
                bench.refused(line, NOT_AVAILABLE);
            }
        }
        bench.control("supply 9.6");
        bench.run(SECOND);
        let starts = 1 + autostart;
        let mode = if autostart == 1 { RUNNING } else { STOPPED };
        assert_eq!((bench.mode(), bench.variable(0)), (mode, starts), "autostart {autostart}");
    }
    // What was not running before is started as well: the module behaves as after power up.
    let mut bench = Bench::with_program(&program);
    bench.ok("SGP 77, 0, 1");
    bench.control("supply 5");
    bench.run(SECOND);
    bench.control("supply 24");
    bench.run(SECOND);
    assert_eq!((bench.mode(), bench.variable(0)), (RUNNING, 1));
}

// ---- downloads cut short

/// From 132 on the program is incomplete, until 133 has been answered: after a restart it refuses to run.
#[test]
fn an_incomplete_program_does_not_run() {
    for lines in [0, 1, 2, 20] {
        let mut bench = Bench::with_program(&NOTE);
        bench.ok("SGP 77, 0, 1");
        bench.ok("132, 0, 0, 100");
        for _ in 0..lines {
            assert_eq!(bench.ask("SGP 2, 2, 2").0, STORED);
        }
        bench.power_cycle();
        bench.run(SECOND);
        assert_eq!((bench.mode(), bench.variable(1), bench.ok("GGP 129, 0")), (STOPPED, 0, 0), "{lines} lines");
        for line in ["129, 0", "129, 1", "129, 1, 0, 100", "130"] {
            bench.refused(line, NOT_AVAILABLE);
        }
        // A complete download makes it whole.
        bench.download(0, &NOTE);
        bench.run_to_end(0);
        assert_eq!(bench.variable(1), 1);
        bench.power_cycle();
        bench.run(10 * MILLISECOND);
        assert_eq!(bench.variable(1), 1);
    }
}

/// Cut at any moment of a download, the module has the old program, the new one, or one that does not run.
#[test]
fn a_power_cut_during_a_download() {
    let mut outcomes = [0; 3];
    for cut in 0..150 {
        let mut bench = Bench::with_program(&["SGP 1, 2, 1", "SGP 2, 2, 1", "STOP"]);
        let end = bench.module.now() + cut * 500 * MICROSECOND;
        for line in ["132", "SGP 1, 2, 2", "SGP 2, 2, 2", "STOP", "133"] {
            bench.post(Source::Usb, line);
        }
        bench.module.run_until(end);
        bench.power_cycle();
        let started = bench.ask("129, 1").0;
        bench.run(10 * MILLISECOND);
        let ran = (bench.variable(1), bench.variable(2));
        let outcome = match (started, ran) {
            (OK, (1, 1)) => 0,
            (OK, (2, 2)) => 1,
            (NOT_AVAILABLE, (0, 0)) => 2,
            other => panic!("cut after {} us: {other:?}", cut * 500),
        };
        outcomes[outcome] += 1;
    }
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

/// A part that does not answer: 132 is refused and nothing has changed; from 133 on it is known that the program
/// is not whole. Once the part is back a download mends it.
#[test]
fn a_download_to_a_part_that_does_not_answer() {
    let mut bench = Bench::with_program(&NOTE);
    bench.control("fault eeprom on");
    assert_eq!(bench.ask("132").0, EEPROM_LOCKED);
    assert_eq!(bench.ok("GGP 129, 0"), 0);
    bench.control("fault eeprom off");
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 1);
    bench.ok("132, 0, 0, 100");
    bench.control("fault eeprom on");
    for _ in 0..30 {
        assert_eq!(bench.ask("SGP 2, 2, 2").0, STORED);
    }
    assert_eq!(bench.ask("133").0, EEPROM_LOCKED);
    assert_eq!(bench.ok("GGP 129, 0"), 0);
    for line in ["129, 0", "129, 1"] {
        bench.refused(line, NOT_AVAILABLE);
    }
    bench.control("fault eeprom off");
    bench.download(0, &NOTE);
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 2);
    bench.power_cycle();
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 1);
}

// ---- protection, global parameter 81

/// Bit 0 protects against reading, bit 1 against writing.
#[test]
fn protection_against_reading_and_writing() {
    for bits in 0..4 {
        let mut bench = Bench::with_program(&NOTE);
        bench.ok(&format!("SGP 81, 0, {bits}"));
        for restart in [false, true] {
            if restart {
                bench.power_cycle();
            }
            assert_eq!(is_empty(&mut bench), bits & 1 != 0, "{bits}");
            assert_eq!(shows(&mut bench, &NOTE), bits & 1 == 0, "{bits}");
            bench.run_to_end(0);
            assert_eq!(bench.variable(1), 1, "{bits}: it runs all the same");
            if bits & 2 != 0 {
                bench.refused("132, 0, 0, 100", EEPROM_LOCKED);
                bench.refused("132", EEPROM_LOCKED);
                assert_eq!(bench.ok("GGP 129, 0"), 0);
                bench.ok("SGP 1, 2, 0");
                bench.run_to_end(0);
                assert_eq!(bench.variable(1), 1, "{bits}: the attempt has left no mark");
            } else {
                bench.download(100, &["SGP 3, 2, 3"]);
            }
            // Addresses are checked under protection as well.
            bench.refused(&format!("134, 0, 0, {MEMORY}"), INVALID_VALUE);
        }
    }
}

/// All sixteen transitions: the program is erased where protection against reading is switched off.
#[test]
fn switching_read_protection_off_erases_the_program() {
    for from in 0..4 {
        for to in 0..4 {
            let mut bench = Bench::with_program(&NOTE);
            bench.download(100, &["SGP 3, 2, 3"]);
            bench.ok(&format!("SGP 81, 0, {from}"));
            bench.ok(&format!("SGP 81, 0, {to}"));
            let erased = from & 1 != 0 && to & 1 == 0;
            for restart in [false, true] {
                if restart {
                    bench.power_cycle();
                }
                assert_eq!(bench.ok("GGP 81, 0"), to);
                assert_eq!(is_empty(&mut bench), erased || to & 1 != 0, "{from} to {to}");
                // An empty memory ends at its first command, in whatever way.
                let _ = bench.ask("129, 1");
                bench.run(10 * MILLISECOND);
                assert_eq!(bench.variable(1), i32::from(!erased), "{from} to {to}");
            }
            // Life goes on.
            if to & 2 == 0 {
                bench.download(0, &NOTE);
                bench.ok("SGP 1, 2, 0");
                bench.run_to_end(0);
                assert_eq!(bench.variable(1), 1, "{from} to {to}");
            }
        }
    }
}

/// The bytes themselves are gone from the EEPROM when the reply comes.
#[test]
fn an_erased_program_is_gone() {
    // 2 048 commands of seven bytes; what holds none is the same all over.
    let blank = |bench: &Bench| {
        let eeprom = bench.eeprom();
        let program = &eeprom[..MEMORY as usize * Command::SIZE];
        program.iter().all(|byte| *byte == program[0])
    };
    let mut bench = Bench::with_program(&["SGP 1, 2, 287454020", "STOP"]);
    bench.download(MEMORY - 1, &["SGP 1, 2, 287454020"]);
    bench.ok("SGP 81, 0, 3");
    assert!(!blank(&bench));
    bench.ok("SGP 81, 0, 2");
    assert!(blank(&bench));
}

/// Protection against writing that is switched on during a download holds at once.
#[test]
fn write_protection_stops_a_download() {
    let mut bench = Bench::with_program(&NOTE);
    bench.ok("132, 0, 0, 100");
    assert_eq!(bench.ask("SGP 3, 2, 3").0, STORED);
    bench.ok_beside("SGP 81, 0, 2");
    for _ in 0..2 {
        assert_eq!(bench.ask("SGP 4, 2, 4").0, EEPROM_LOCKED);
    }
    bench.ok("133");
    assert_eq!([100, 101].map(|n| bench.memory(n)), [text::parse("SGP 3, 2, 3").unwrap(), NOTHING]);
    bench.run_to_end(0);
    assert_eq!(bench.variable(1), 1);
}

/// Erasing takes its time. A download that another link would begin meanwhile is refused, so that the reply to SGP
/// is true: the program is gone and parameter 81 has its new value.
#[test]
fn a_download_does_not_cut_an_erasure_short() {
    for delay in 0..60 {
        let mut bench = Bench::with_program(&["SGP 1, 2, 1"; 30]);
        bench.ok("SGP 81, 0, 1");
        bench.module.receive(Source::Usb, binary::encode_command(1, Command::new(9, 81, 0, 0)));
        bench.run(delay * MILLISECOND);
        let reply = bench.ask_beside("132");
        assert!([OK, NOT_AVAILABLE].contains(&reply), "after {delay} ms: {reply}");
        if reply == OK {
            assert_eq!(bench.ask_beside("133"), OK, "after {delay} ms");
        }
        bench.run(SECOND);
        while bench.module.sent().is_some() {}
        assert_eq!(bench.ok("GGP 81, 0"), 0, "after {delay} ms");
        assert!(is_empty(&mut bench), "after {delay} ms");
    }
}

/// Nor is a download cut short by switching the protection off over another link: what the host sends is not
/// suddenly carried out.
#[test]
fn an_erasure_does_not_cut_a_download_short() {
    let mut bench = Bench::with_program(&NOTE);
    bench.ok("SGP 81, 0, 1");
    bench.ok("132");
    assert_eq!(bench.ask("ROR 0, 100").0, STORED);
    assert_eq!(bench.ask_beside("SGP 81, 0, 0"), NOT_AVAILABLE);
    assert_eq!(bench.ask("ROR 0, 200").0, STORED);
    bench.ok("133");
    bench.run(SECOND);
    assert_eq!((bench.speed(), bench.ok("GGP 81, 0")), (0, 1));
    bench.ok("SGP 81, 0, 0");
    assert!(is_empty(&mut bench));
}

/// A program may protect itself, and erase itself: then it ends.
#[test]
fn a_program_erases_itself() {
    let mut bench = Bench::with_program(&["SGP 81, 0, 1", "SGP 1, 2, 1", "SGP 81, 0, 2", "SGP 2, 2, 1", "STOP"]);
    bench.run_to_end(0);
    bench.run(SECOND);
    assert_eq!((bench.variable(1), bench.variable(2), bench.ok("GGP 81, 0")), (1, 0, 2));
    assert!(is_empty(&mut bench));
}

/// A program that runs while it is erased stops.
#[test]
fn erasing_stops_the_program() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "JA 0"]);
    bench.ok("SGP 81, 0, 1");
    bench.start(0);
    bench.run(SECOND);
    assert_eq!(bench.mode(), RUNNING);
    bench.ok("SGP 81, 0, 0");
    assert_ne!(bench.mode(), RUNNING);
}

/// Wherever the power is cut, a protected program is never shown, and never half of one runs.
#[test]
fn a_power_cut_never_shows_a_protected_program() {
    let mut kept = [0, 0];
    for cut in 0..200 {
        let mut bench = Bench::with_program(&["SGP 1, 2, 1"; 100]);
        bench.ok("SGP 81, 0, 1");
        bench.module.receive(Source::Usb, binary::encode_command(1, Command::new(9, 81, 0, 0)));
        bench.run(cut * 10 * MILLISECOND);
        bench.power_cycle();
        // The first look comes at once: the restart may still be busy erasing.
        assert!(is_empty(&mut bench), "cut after {} ms", cut * 10);
        let _ = bench.ask("129, 1");
        bench.run(5 * SECOND);
        assert!(is_empty(&mut bench), "cut after {} ms", cut * 10);
        let ran = bench.variable(1);
        kept[usize::try_from(ran).unwrap()] += 1;
        assert_eq!(ran == 0, bench.ok("GGP 81, 0") == 0, "cut after {} ms", cut * 10);
    }
    assert!(kept[0] > 0 && kept[1] > 0, "{kept:?}");
}

// ---- factory reset

/// Command 137 leaves a program that anybody may read, and erases one that is protected against it.
#[test]
fn a_factory_reset_and_the_program() {
    for bits in 0..4 {
        let mut bench = Bench::with_program(&NOTE);
        bench.ok(&format!("SGP 81, 0, {bits}"));
        bench.ok("SGP 77, 0, 1");
        let reset = binary::encode_command(1, Command::new(137, 0, 0, 1234));
        assert_eq!(bench.exchange(Source::Usb, reset), None);
        bench.run(5 * SECOND);
        for _ in 0..2 {
            assert_eq!((bench.ok("GGP 81, 0"), bench.ok("GGP 77, 0"), bench.variable(1)), (0, 0, 0), "{bits}");
            let kept = bits & 1 == 0;
            assert_eq!((shows(&mut bench, &NOTE), is_empty(&mut bench)), (kept, !kept), "{bits}");
            bench.power_cycle();
        }
    }
}
