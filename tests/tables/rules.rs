//! Parameters with rules of their own: modes, divisors, timers, numbers at random, the silence, and the addresses of
//! the links.

use common::{Bench, INVALID_VALUE, OK, WRONG_TYPE};
use hal_sim::board::{Board, Chip, SharedBoard};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::chip::tmc429::Tmc429;
use tmcm::module::Source;
use tmcm::motion::Axis;
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::param::AxisParameter;
use tmcm::product::TMCM_1140;
use tmcm_sim::Product;

/// Parameter 193: modes 1..8, those that turn right (+64, for 1..4) and with an inverted home switch
/// (+128, for 5..8).
#[test]
fn reference_search_modes() {
    let mut bench = Bench::new();
    for mode in -1..=300 {
        let base = match mode {
            65..=68 => mode - 64,
            133..=136 => mode - 128,
            _ => mode,
        };
        let before = bench.ok("GAP 193, 0");
        let (expected, after) = if (1..=8).contains(&base) { (OK, mode) } else { (INVALID_VALUE, before) };
        assert_eq!(bench.ask(&format!("SAP 193, 0, {mode}")).0, expected, "mode {mode}");
        assert_eq!(bench.ok("GAP 193, 0"), after);
    }
}

/// Parameters 153 and 154: a divisor is taken if positioning has a PMUL/PDIV pair for some acceleration. With A up to
/// 2047, p = A / (128 * 2^(153 - 154)) must reach 128/2^16 (and a little more: it is reduced by 1.2 %). With A from 1
/// it must reach 255/2^3.
#[test]
fn divisors_need_a_braking_parameter() {
    for ramp in 0..=13 {
        for pulse in 0..=13 {
            let p = |a: i32| f64::from(a) / 128.0 / 2_f64.powi(ramp - pulse) * 0.988;
            let possible = p(2047) * 65_536.0 >= 128.0 && p(1) * 8.0 < 256.0;
            let mut bench = Bench::new();
            // By way of the middle, where there is always a pair.
            for (number, value) in [(153, 7), (154, 7), (153, ramp)] {
                bench.ok(&format!("SAP {number}, 0, {value}"));
            }
            let (status, _) = bench.ask(&format!("SAP 154, 0, {pulse}"));
            assert_eq!(status, if possible { OK } else { INVALID_VALUE }, "divisors {ramp} and {pulse}");
            assert_eq!(bench.ok("GAP 154, 0"), if possible { pulse } else { 7 });
            if !possible {
                // The other way round, too.
                for (number, value) in [(153, 7), (154, pulse)] {
                    bench.ok(&format!("SAP {number}, 0, {value}"));
                }
                bench.refused(&format!("SAP 153, 0, {ramp}"), INVALID_VALUE);
                assert_eq!(bench.ok("GAP 153, 0"), 7);
            }
        }
    }
}

/// Parameter 166: 8 is a value of the parameter, though not of the chip's field, which gets 7.
#[test]
fn hysteresis_start_8() {
    let mut bench = Bench::new();
    bench.ok("SAP 166, 0, 8");
    assert_eq!(bench.ok("GAP 166, 0"), 8);
    let chopconf = bench.module.board().borrow().tmc262(0).registers().chopconf;
    assert_eq!(chopconf >> 4 & 7, 7);
    bench.ok("STAP 166, 0");
    bench.power_cycle();
    assert_eq!(bench.ok("GAP 166, 0"), 8);
}

/// Parameters 164, 165, 167 and 179 of the TMCM-1110 are fields of its driver: HDEC, HEND and TOFF of CHOPCONF, and
/// VSENSE of DRVCONF.
#[test]
fn chopper_of_a_tmcm_1110() {
    let mut bench = Bench::of(Product::Tmcm1110);
    let registers = |bench: &Bench| bench.module.board().borrow().tmc262(0).registers();
    let fields = |bench: &Bench| {
        let chopconf = registers(bench).chopconf;
        (chopconf >> 11 & 3, chopconf >> 7 & 15, chopconf & 15, registers(bench).drvconf >> 6 & 1)
    };
    assert_eq!(fields(&bench), (0, 2, 5, 1));
    for line in ["SAP 164, 0, 3", "SAP 165, 0, 15", "SAP 167, 0, 2", "SAP 179, 0, 0"] {
        bench.ok(line);
    }
    assert_eq!(fields(&bench), (3, 15, 2, 0));
}

/// Parameter 5: every acceleration reads back as written, also where the chip gets another.
#[test]
fn acceleration_reads_back_what_was_written() {
    let mut bench = Bench::new();
    for value in 1..=2047 {
        bench.ok(&format!("SAP 5, 0, {value}"));
        assert_eq!(bench.ok("GAP 5, 0"), value);
    }
}

/// Bank 3, 0..2: periods above 2^31 ms are written and read as the same 32 bits.
#[test]
fn timer_periods_are_unsigned() {
    let mut bench = Bench::new();
    for timer in 0..=2 {
        for period in [0_u32, 1, 0x7FFF_FFFF, 0x8000_0000, 4_000_000_000, u32::MAX] {
            assert_eq!(bench.ok(&format!("SGP {timer}, 3, {period}")).cast_unsigned(), period);
            assert_eq!(bench.ok(&format!("GGP {timer}, 3")).cast_unsigned(), period);
        }
    }
}

/// Parameter 132 counts milliseconds from the start, or from what was written; 31 bits of them.
#[test]
fn tick_timer() {
    let mut bench = Bench::new();
    let before = bench.ok("GGP 132, 0");
    bench.run(500 * MILLISECOND);
    let passed = bench.ok("GGP 132, 0") - before;
    assert!((500..=502).contains(&passed), "{passed} ms");
    bench.ok("SGP 132, 0, 1000000");
    bench.run(100 * MILLISECOND);
    assert!((1_000_100..=1_000_102).contains(&bench.ok("GGP 132, 0")));
    bench.ok("SGP 132, 0, 2147483647");
    bench.run(100 * MILLISECOND);
    assert!((99..=101).contains(&bench.ok("GGP 132, 0")));
    bench.ok("SGP 132, 0, 0");
    assert!((0..=2).contains(&bench.ok("GGP 132, 0")));
    bench.run(100 * MILLISECOND);
    bench.power_cycle();
    assert!((0..=3).contains(&bench.ok("GGP 132, 0")));
}

/// Parameter 133: numbers of 31 bits; the same seed gives the same ones.
#[test]
fn random_number() {
    let mut bench = Bench::new();
    let mut series = |seed: Option<i32>| {
        if let Some(seed) = seed {
            bench.ok(&format!("SGP 133, 0, {seed}"));
        }
        (0..64).map(|_| bench.ok("GGP 133, 0")).collect::<Vec<_>>()
    };
    let runs = [None, None, Some(0), Some(77), Some(1234), Some(5)].map(&mut series);
    assert_eq!(series(Some(1234)), runs[4]);
    for (n, run) in runs.iter().enumerate() {
        assert!(run.iter().all(|number| *number >= 0));
        assert!(!runs[..n].contains(run), "run {n} repeats another");
        let (mut ones, mut zeros) = (0, i32::MAX);
        for number in run {
            ones |= number;
            zeros &= number;
        }
        assert_eq!((ones, zeros), (i32::MAX, 0), "a bit that never changes");
        let distinct: std::collections::HashSet<_> = run.iter().collect();
        assert_eq!(distinct.len(), run.len());
    }
}

/// Parameter 255 silences everything but GAP, GGP and GIO - errors, too.
#[test]
fn suppress_reply() {
    let mut bench = Bench::new();
    bench.ok("SGP 255, 0, 1");
    for source in [Source::Usb, Source::Rs485] {
        for line in ["SAP 4, 0, 500", "SAP 4, 0, 0", "SGP 77, 0, 1", "STAP 4, 0", "GCO 1, 0", "17, 0, 0, 0", "136, 1"] {
            assert_eq!(bench.ask_over(source, 1, line), None, "{line}");
        }
        for (line, status, value) in
            [("GAP 4, 0", OK, 500), ("GGP 77, 0", OK, 1), ("GIO 0, 2", OK, 0), ("GAP 14, 0", WRONG_TYPE, 0)]
        {
            let reply = bench.ask_over(source, 1, line).expect("reading is always answered");
            assert_eq!((reply.status, reply.value), (status, value), "{line}");
        }
    }
    assert_eq!(bench.ok("GGP 255, 0"), 1);
    // What was not answered was carried out all the same, and the silence itself is not stored.
    bench.power_cycle();
    assert_eq!((bench.ok("GGP 255, 0"), bench.ok("GGP 77, 0"), bench.ok("GAP 4, 0")), (0, 1, 500));
    bench.ok("SGP 255, 0, 1");
    assert_eq!(bench.ask_over(Source::Usb, 1, "SGP 255, 0, 0"), None);
    bench.ok("MST 0");
}

// ---- settings of the links

/// Module and host address under which a command over RS485 is answered, if it is.
fn rs485(bench: &mut Bench, address: u8, line: &str) -> Option<(u8, u8)> {
    bench.ask_over(Source::Rs485, address, line).map(|reply| (reply.host, reply.module))
}

/// Parameters 66 and 76 act after the reply to the command that sets them, which is still under the old
/// addresses.
#[test]
fn addresses_change_after_the_reply() {
    let mut bench = Bench::new();
    assert_eq!(rs485(&mut bench, 1, "SGP 66, 0, 7"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 1, "GAP 1, 0"), None);
    assert_eq!(rs485(&mut bench, 7, "GAP 1, 0"), Some((2, 7)));
    assert_eq!(rs485(&mut bench, 7, "SGP 76, 0, 99"), Some((2, 7)));
    assert_eq!(rs485(&mut bench, 7, "GAP 1, 0"), Some((99, 7)));
    // Set once more to what it is already: nothing to store, and the same addresses.
    assert_eq!(rs485(&mut bench, 7, "SGP 66, 0, 7"), Some((99, 7)));
    bench.power_cycle();
    assert_eq!((rs485(&mut bench, 1, "GAP 1, 0"), rs485(&mut bench, 7, "GAP 1, 0")), (None, Some((99, 7))));
}

/// Parameter 87: a second address on the bus; 0 is none, and answers to no one.
#[test]
fn secondary_address() {
    let mut bench = Bench::new();
    assert_eq!(rs485(&mut bench, 0, "GAP 1, 0"), None);
    assert_eq!(rs485(&mut bench, 1, "SGP 87, 0, 200"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 200, "GAP 1, 0"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 1, "GAP 1, 0"), Some((2, 1)));
    for other in [0, 2, 199, 201, 255] {
        assert_eq!(rs485(&mut bench, other, "SAP 4, 0, 3"), None);
    }
    assert_eq!(bench.ok("GAP 4, 0"), 1000);
    assert_eq!(rs485(&mut bench, 200, "SGP 87, 0, 0"), Some((2, 1)));
    assert_eq!(rs485(&mut bench, 200, "GAP 1, 0"), None);
}

/// USB is point to point: any address is taken, the module answers with its own.
#[test]
fn usb_takes_any_address() {
    let mut bench = Bench::new();
    bench.ok("SGP 66, 0, 5");
    for address in 0..=u8::MAX {
        let reply = bench.ask_over(Source::Usb, address, "GAP 4, 0").unwrap();
        assert_eq!((reply.host, reply.module, reply.value), (2, 5, 1000), "address {address}");
    }
}

/// An event that nobody waits for comes under the new host address, too.
#[test]
fn a_later_event_goes_to_the_new_host_address() {
    let mut bench = Bench::new();
    for line in ["138, 0, 0, 1", "MVP ABS, 0, 20000", "SGP 76, 0, 50"] {
        bench.ok(line);
    }
    let events = bench.listen(3 * SECOND);
    assert_eq!(events.iter().map(|event| (event.host, event.status)).collect::<Vec<_>>(), [(50, 128)]);
}

/// An axis takes from the store what may stand there, and nothing else.
#[test]
fn stored_values_out_of_range_are_not_taken() {
    let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
    let mut chip = Tmc429::new(board.spi(Chip::Tmc429(0), 1_000_000));
    let [hardware] = Tmc429Tmc262::axes([board.spi(Chip::Tmc262(0), 1_000_000)]);
    let mut axis = Axis::new(hardware, TMCM_1140.axis);
    for (parameter, value, expected) in [
        (AxisParameter::MaximumSpeed, 500, 500),
        (AxisParameter::MaximumSpeed, 0, 500),
        (AxisParameter::MaximumSpeed, 2048, 500),
        (AxisParameter::ReferenceSearchMode, 9, 1),
        (AxisParameter::EndSwitchDistance, 5, 0),
    ] {
        let row = TMCM_1140.axis.rows.iter().find(|row| row.function == parameter).unwrap();
        axis.preset(row, value);
        assert_eq!(axis.on(&mut chip).read(parameter), Ok(expected), "{parameter:?} {value}");
    }
}
