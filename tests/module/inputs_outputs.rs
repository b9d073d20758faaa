//! SIO and GIO in direct mode: which ports and banks there are, and what they set and show.

use common::{Bench, INVALID_VALUE, OK, WRONG_TYPE};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::Product;

#[test]
fn outputs_one_by_one_and_together() {
    let mut bench = Bench::new();
    // What is sent, and outputs 1 and 0 afterwards.
    for (line, outputs) in [
        ("SIO 0, 2, 1", [true, false]),
        ("SIO 1, 2, 1", [true, true]),
        ("SIO 0, 2, 0", [false, true]),
        ("SIO 255, 2, 1", [true, false]),
        ("SIO 255, 2, 255", [true, true]),
        ("SIO 255, 2, 0", [false, false]),
        ("SIO 255, 2, 2", [false, true]),
        ("SIO 255, 2, 252", [false, false]),
    ] {
        bench.ok(line);
        bench.run(2 * MILLISECOND);
        let out = bench.module.board().borrow().world().outputs();
        assert_eq!([out.is_on(0), out.is_on(1)], outputs, "{line}");
        assert_eq!([bench.ok("GIO 0, 2") != 0, bench.ok("GIO 1, 2") != 0], outputs, "{line}");
    }
    // The accumulator in place of -1: only the bits of outputs count.
    for (accumulator, outputs) in [(1, [true, false]), (-2, [false, true]), (0x7FFF_FFFC, [false, false])] {
        bench.ok(&format!("CALC LOAD, {accumulator}"));
        assert_eq!(bench.ok("SIO 255, 2, -1"), -1);
        assert_eq!([bench.ok("GIO 0, 2") != 0, bench.ok("GIO 1, 2") != 0], outputs, "{accumulator}");
    }
}

#[test]
fn sio_refusals() {
    let mut bench = Bench::new();
    bench.ok("SIO 255, 2, 3");
    for (line, status) in [
        ("SIO 2, 2, 0", WRONG_TYPE),
        ("SIO 254, 2, 0", WRONG_TYPE),
        ("SIO 0, 2, 2", INVALID_VALUE),
        ("SIO 1, 2, -1", INVALID_VALUE),
        ("SIO 255, 2, 256", INVALID_VALUE),
        ("SIO 255, 2, -2", INVALID_VALUE),
        ("SIO 1, 0, 0", WRONG_TYPE),
        ("SIO 0, 0, -1", INVALID_VALUE),
        ("SIO 0, 0, 4", INVALID_VALUE),
        ("SIO 0, 1, 0", INVALID_VALUE),
        ("SIO 0, 3, 0", INVALID_VALUE),
        ("SIO 0, 255, 0", INVALID_VALUE),
    ] {
        bench.refused(line, status);
    }
    assert_eq!((bench.ok("GIO 0, 2"), bench.ok("GIO 1, 2")), (1, 1));
}

#[test]
fn digital_inputs() {
    let mut bench = Bench::new();
    for port in 0..4 {
        bench.control(&format!("input {port} 1"));
        bench.run(2 * MILLISECOND);
        for other in 0..4 {
            assert_eq!(bench.ok(&format!("GIO {other}, 0")), i32::from(other == port));
        }
        assert_eq!(bench.ok("GIO 255, 0"), 1 << port);
        bench.control(&format!("input {port} 0"));
    }
    for port in 0..4 {
        bench.control(&format!("input {port} 1"));
    }
    bench.run(2 * MILLISECOND);
    assert_eq!(bench.ok("GIO 255, 0"), 0b1111);
}

/// Port 11: the built-in encoder is near its absolute zero.
#[test]
fn the_encoder_s_zero_is_an_input() {
    let mut bench = Bench::in_world("[encoder]\noffset = 12800\n");
    for (target, near) in [(0, 0), (12_800, 1), (25_600, 0), (64_000, 1)] {
        bench.ok(&format!("MVP ABS, 0, {target}"));
        bench.run_until(5 * SECOND, |b| b.ok("GAP 8, 0") == 1);
        bench.run(100 * MILLISECOND);
        assert_eq!(bench.ok("GIO 11, 0"), near, "at {target}");
    }
}

#[test]
fn analog_inputs() {
    let mut bench = Bench::new();
    for (control, line, value) in [
        ("analog 0 0", "GIO 0, 1", 0),
        ("analog 0 4095", "GIO 0, 1", 4095),
        ("supply 24", "GIO 8, 1", 240),
        ("supply 9.7", "GIO 8, 1", 97),
        ("temperature 25", "GIO 9, 1", 25),
        ("temperature -12", "GIO 9, 1", -12),
    ] {
        bench.control(control);
        bench.run(2 * MILLISECOND);
        assert_eq!(bench.ok(line), value, "{control}");
    }
}

/// Ports 1 and 2 of bank 1 of the TMCM-1110 are the supply and the 5 V of its logic, behind dividers; OUT2 to OUT4 are
/// its PWMU lines, and digital inputs beside AIN_0 its PWMD lines.
#[test]
fn ports_of_a_tmcm_1110() {
    let mut bench = Bench::of(Product::Tmcm1110);
    for (volts, reading) in [("24", 2707), ("10", 1128), ("30", 3384), ("48", 4095)] {
        bench.control(&format!("supply {volts}"));
        bench.run(2 * MILLISECOND);
        assert_eq!((bench.ok("GIO 1, 1"), bench.ok("GIO 2, 1")), (reading, 3102), "{volts} V");
    }
    for (reading, level) in [(0, 0), (2047, 0), (2048, 1), (4095, 1)] {
        bench.control(&format!("analog 0 {reading}"));
        bench.run(2 * MILLISECOND);
        assert_eq!((bench.ok("GIO 0, 1"), bench.ok("GIO 0, 0")), (reading, level));
    }
    for port in 0..5 {
        bench.ok(&format!("SIO {port}, 2, 1"));
        bench.run(2 * MILLISECOND);
        assert_eq!(bench.ok(&format!("GIO {port}, 2")), 1);
        assert_eq!(bench.module.board().borrow().world().outputs().digital, 1 << port);
        bench.ok(&format!("SIO {port}, 2, 0"));
    }
    for port in 1..4 {
        bench.control(&format!("input {port} 1"));
        bench.run(2 * MILLISECOND);
        // AIN_0 is still high.
        assert_eq!(bench.ok("GIO 255, 0"), 1 | 1 << port);
        bench.control(&format!("input {port} 0"));
    }
}

/// Port 11 is that of the built-in encoder, which the TMCM-1140 alone has.
#[test]
fn without_a_built_in_encoder_there_is_no_port_11() {
    for product in Product::ALL {
        let expected = if product == Product::Tmcm1140 { OK } else { WRONG_TYPE };
        assert_eq!(Bench::of(product).ask("GIO 11, 0").0, expected, "{product:?}");
    }
}

#[test]
fn gio_refusals() {
    let mut bench = Bench::new();
    let ports: [(u8, &[u8]); 3] = [(0, &[0, 1, 2, 3, 11, 255]), (1, &[0, 8, 9]), (2, &[0, 1])];
    for (bank, ports) in ports {
        for port in 0..=u8::MAX {
            let expected = if ports.contains(&port) { OK } else { WRONG_TYPE };
            assert_eq!(bench.ask(&format!("GIO {port}, {bank}")).0, expected, "port {port}, bank {bank}");
        }
    }
    for bank in [3, 4, 255] {
        bench.refused(&format!("GIO 0, {bank}"), INVALID_VALUE);
    }
}
