//! Stall, deviation and the driver's alarms: what happens to one axis stops that axis alone.

use super::Bench;
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::param::AxisParameter;

/// Lets all axes turn, and has each in turn met with something. Asserts that this axis stops and the others turn on,
/// that `flag` shows it for this axis alone, and that interrupt `first` + axis tells a program of it. `flag` is an axis
/// parameter and its bits.
fn each_is_met(bench: &mut Bench, speed: i32, met: &str, over: &str, flag: (u8, i32), first: Option<u8>) {
    let interrupts: Vec<u8> = bench.axes().filter_map(|axis| Some(first? + axis)).collect();
    bench.count_interrupts(&interrupts);
    bench.each(&format!("ROR #, {speed}"));
    bench.run(SECOND);
    for axis in bench.axes() {
        assert_eq!(bench.speeds(), vec![speed; usize::from(bench.spec.axes)]);
        bench.control(&met.replace('#', &axis.to_string()));
        bench.run(200 * MILLISECOND);
        let mut expected = vec![speed; usize::from(bench.spec.axes)];
        expected[usize::from(axis)] = 0;
        assert_eq!((bench.speeds(), bench.all(3)), (expected.clone(), expected), "{met}, axis {axis}");
        let (number, bits) = flag;
        for other in bench.axes() {
            let shown = bench.get(number, other) & bits;
            assert_eq!(shown, if other == axis { bits } else { 0 }, "{met}, axis {axis}: flags of {other}");
        }
        for (other, interrupt) in interrupts.iter().enumerate() {
            let times = i32::from(other <= usize::from(axis));
            assert_eq!(bench.variable(*interrupt), times, "{met}, axis {axis}: interrupt {interrupt}");
        }
        bench.control(&over.replace('#', &axis.to_string()));
        let position = bench.get(1, axis);
        // The encoder agrees again, if the product has one.
        if let Some(encoder) = bench.spec.axis.row(AxisParameter::ExternalEncoderPosition) {
            bench.ok(&format!("SAP {}, {axis}, {position}", encoder.number));
        }
        bench.ok(&format!("ROR {axis}, {speed}"));
        bench.run(SECOND);
    }
}

#[test]
fn each_axis_stops_at_a_stall_of_its_own() {
    for mut bench in Bench::bare() {
        bench.each("SAP 174, #, 1");
        bench.each("SAP 181, #, 500");
        each_is_met(&mut bench, 1_000, "load 1 #", "load 0 #", (207, 1), Some(15));
    }
}

/// The speed from which on a stall counts, and the threshold of the measurement, are those of an axis: with all motors
/// stalled, those stop that have been told to.
#[test]
fn each_axis_has_its_own_stall_settings() {
    for mut bench in Bench::bare() {
        bench.each("SAP 174, #, 1");
        bench.each("ROR #, 1000");
        bench.run(SECOND);
        let guarded = |axis: u8| axis % 2 == 1;
        for axis in bench.axes() {
            bench.ok(&format!("SAP 181, {axis}, {}", if guarded(axis) { 500 } else { 1_100 }));
        }
        for axis in bench.axes() {
            bench.control(&format!("load 1 {axis}"));
        }
        bench.run(200 * MILLISECOND);
        let expected: Vec<i32> = bench.axes().map(|axis| if guarded(axis) { 0 } else { 1_000 }).collect();
        assert_eq!(bench.all(3), expected);
    }
}

/// The products with encoders, with an ABN encoder on each axis. 8000 counts are a turn of 51 200 microsteps, so 6.4 *
/// 512 is the prescaler. But three bits of it are functions, so that an encoder counts 255 microsteps where there are
/// 256.
fn encoders() -> impl Iterator<Item = Bench> {
    [Bench::three as fn(&str) -> Bench, Bench::tmcm_3110].into_iter().map(|new| {
        let mut bench = new("abn.lines = 2000");
        let prescaler = bench.number(AxisParameter::ExternalEncoderPrescaler);
        bench.each(&format!("SAP {prescaler}, #, 3264"));
        bench
    })
}

#[test]
fn each_axis_stops_when_its_own_encoder_deviates() {
    for mut bench in encoders() {
        let deviation = bench.number(AxisParameter::MaximumExternalEncoderDeviation);
        bench.each(&format!("SAP {deviation}, #, 1500"));
        each_is_met(&mut bench, 300, "slip -8 #", "load 0 #", (207, 2), Some(21));
    }
}

#[test]
fn each_encoder_counts_the_way_of_its_own_axis() {
    for mut bench in encoders() {
        let encoder = bench.number(AxisParameter::ExternalEncoderPosition);
        for axis in bench.axes() {
            let target = 5_120 * (i32::from(axis) + 1) * if axis.is_multiple_of(2) { 1 } else { -1 };
            let before = bench.all(encoder);
            bench.ok(&format!("MVP ABS, {axis}, {target}"));
            bench.run(3 * SECOND);
            for (other, (now, before)) in bench.all(encoder).into_iter().zip(before).enumerate() {
                let way = if other == usize::from(axis) { target * 255 / 256 } else { 0 };
                assert!((now - before - way).abs() <= 10, "axis {axis} moved, encoder {other}: {}", now - before);
            }
        }
    }
}

#[test]
fn a_short_and_an_over_temperature_stop_one_axis() {
    for (fault, bit) in [("short-a", 8), ("short-b", 16), ("overtemperature", 2)] {
        for mut bench in Bench::bare() {
            let (on, off) = (format!("fault {fault} on #"), format!("fault {fault} off #"));
            each_is_met(&mut bench, 500, &on, &off, (208, bit), None);
        }
    }
}

/// Three axes have stalled. The flag of each is cleared when that flag is read, or that axis moves.
#[test]
fn an_error_flag_stays_until_it_is_read_or_its_own_axis_moves() {
    for mut bench in Bench::bare() {
        bench.each("SAP 174, #, 1");
        bench.each("ROR #, 1000");
        bench.run(SECOND);
        bench.each("SAP 181, #, 500");
        let last = bench.axes().end - 1;
        for axis in [0, 1, last] {
            bench.control(&format!("load 1 {axis}"));
        }
        bench.run(200 * MILLISECOND);
        bench.ok("ROR 1, 300");
        assert_eq!([last, last, 1, 0, 0].map(|axis| bench.get(207, axis)), [1, 0, 0, 1, 0]);
    }
}
