//! Two motion controllers: a silent one stops everything, as do supply and host; polarity and direction are those of a
//! controller's own axes. And the inputs and outputs of a product that has more of them than the TMCM-1140.

use super::{Bench, NOT_AVAILABLE, OK};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::control::State;

/// All axes turn, and a program runs.
fn turning(bench: &mut Bench) {
    bench.count_interrupts(&[3]);
    for axis in bench.axes() {
        bench.ok(&format!("ROR {axis}, {}", 300 + 100 * i32::from(axis)));
    }
    bench.run(SECOND);
    assert!(bench.speeds().into_iter().eq(bench.axes().map(|axis| 300 + 100 * i32::from(axis))));
    assert_eq!(bench.ok("GGP 128, 0"), 1);
}

/// Asserts that no motor is driven, that none can be started, and that the error LED is lit.
fn given_up(bench: &mut Bench) {
    assert!(bench.states().iter().all(|state| !state.bridges_on), "the drivers are off");
    for axis in bench.axes() {
        for line in ["ROR #, 100", "MVP ABS, #, 100", "RFS START, #", "SAP 0, #, 100"] {
            let line = line.replace('#', &axis.to_string());
            assert_eq!(bench.ask(&line).0, NOT_AVAILABLE, "{line}");
        }
    }
    assert!(State::of(&bench.board.borrow()).leds[1], "the error LED is lit");
    assert_eq!((bench.ok("GGP 128, 0"), bench.ask("129, 0").0), (0, NOT_AVAILABLE), "the program stands");
}

#[test]
fn one_silent_controller_stops_all_axes() {
    for silent in [0, 4] {
        for mut bench in Bench::bare().filter(|bench| silent < bench.spec.axes) {
            turning(&mut bench);
            bench.control(&format!("fault tmc429 on {silent}"));
            bench.run(6 * MILLISECOND);
            given_up(&mut bench);
            let hears = |axis: u8| axis / 3 != silent / 3;
            for (axis, speed) in bench.axes().zip(bench.speeds()) {
                assert_eq!(speed == 0, hears(axis), "axis {axis}, controller of {silent} silent: {speed}");
            }
            // When it is back it hears that it has to stop; the drivers stay off until the next start.
            bench.control(&format!("fault tmc429 off {silent}"));
            bench.run(20 * MILLISECOND);
            assert!(bench.speeds().iter().all(|speed| *speed == 0));
            given_up(&mut bench);
            bench.power_cycle();
            assert!(bench.states().iter().all(|state| state.bridges_on));
            turning(&mut bench);
        }
    }
}

#[test]
fn at_rest_a_silent_controller_is_found_as_well() {
    for silent in [0, 4] {
        for mut bench in Bench::bare().filter(|bench| silent < bench.spec.axes) {
            bench.run(4 * SECOND);
            bench.control(&format!("fault tmc429 on {silent}"));
            bench.run(20 * MILLISECOND);
            given_up(&mut bench);
        }
    }
}

#[test]
fn with_a_controller_that_is_silent_from_the_start_nothing_moves() {
    for silent in [0, 4] {
        for mut bench in Bench::bare().filter(|bench| silent < bench.spec.axes) {
            bench.control(&format!("fault tmc429 on {silent}"));
            bench.power_cycle();
            given_up(&mut bench);
            assert_eq!(bench.ok("GGP 66, 0"), 1, "the module answers all the same");
            bench.control(&format!("fault tmc429 off {silent}"));
            bench.power_cycle();
            turning(&mut bench);
        }
    }
}

/// A controller is given up when it has been silent in three turns; the first turn without an answer is noticed in the
/// next. So each may be silent for three milliseconds, also while the other one begins to be, or together with it: the
/// turns are counted for each controller.
#[test]
fn a_short_silence_of_each_controller_stops_nothing() {
    let mut bench = Bench::six("");
    turning(&mut bench);
    for (silent, back) in [(0, 3), (3, 0), (0, 3), (3, 0), (0, 3)] {
        bench.control(&format!("fault tmc429 on {silent}"));
        bench.run(MILLISECOND);
        bench.control(&format!("fault tmc429 off {back}"));
        bench.run(MILLISECOND);
    }
    bench.run(MILLISECOND);
    bench.control("fault tmc429 off 0");
    bench.run(5 * MILLISECOND);
    for state in ["on", "off"] {
        bench.control(&format!("fault tmc429 {state} 0"));
        bench.control(&format!("fault tmc429 {state} 3"));
        bench.run(3 * MILLISECOND);
    }
    bench.run(10 * MILLISECOND);
    assert!(bench.states().iter().all(|state| state.bridges_on && state.velocity != 0));
    assert_eq!(bench.ask("ROR 5, 500").0, OK);
}

/// A driver that does not answer leaves the other axes their work.
#[test]
fn a_silent_driver_is_nothing_to_the_other_axes() {
    for mut bench in Bench::bare() {
        turning(&mut bench);
        bench.control("fault tmc262 on 1");
        bench.run(SECOND);
        for axis in bench.others(1) {
            bench.ok(&format!("MVP ABS, {axis}, 5000"));
        }
        bench.run(5 * SECOND);
        assert!(bench.others(1).all(|axis| bench.get(1, axis) == 5_000));
    }
}

#[test]
fn a_missed_heartbeat_stops_all_axes() {
    for mut bench in Bench::bare() {
        turning(&mut bench);
        bench.ok("138, 1, 0, 255");
        bench.ok("MVP ABS, 1, 1000000");
        bench.ok("SGP 68, 0, 200");
        bench.run(190 * MILLISECOND);
        assert!(bench.speeds().iter().all(|speed| *speed != 0));
        bench.run(500 * MILLISECOND);
        assert!(bench.speeds().iter().all(|speed| *speed == 0), "{:?}", bench.speeds());
        assert!(bench.states().iter().all(|state| state.bridges_on));
        // The same with one axis on the way, whichever.
        for axis in bench.axes() {
            bench.ok(&format!("ROR {axis}, 500"));
            bench.run(150 * MILLISECOND);
            assert_eq!(bench.speeds()[usize::from(axis)], 500);
            bench.run(200 * MILLISECOND);
            assert_eq!(bench.speeds()[usize::from(axis)], 0);
        }
        bench.ok("SGP 68, 0, 0");
        turning(&mut bench);
        assert!(bench.arrivals().is_empty(), "no move has arrived");
    }
}

#[test]
fn a_lost_supply_stops_all_axes_and_all_drivers_are_set_up_anew_when_it_is_back() {
    for mut bench in Bench::bare() {
        bench.each("SAP 174, #, 12");
        turning(&mut bench);
        let axes = usize::from(bench.spec.axes);
        let registers = |bench: &Bench| {
            let board = bench.board.borrow();
            let words = |axis| {
                let registers = board.tmc262(axis).registers();
                [registers.chopconf, registers.smarten, registers.sgcsconf & !0x1F]
            };
            (0..axes).map(words).collect::<Vec<_>>()
        };
        let before = registers(&bench);
        bench.control("supply 4");
        bench.run(3 * MILLISECOND);
        assert_eq!(bench.speeds(), vec![0; axes]);
        for axis in bench.axes() {
            assert_eq!(bench.ask(&format!("ROR {axis}, 100")).0, NOT_AVAILABLE);
        }
        bench.control("supply 24");
        bench.run(10 * MILLISECOND);
        assert_eq!(registers(&bench), before);
        assert_eq!(bench.speeds(), vec![0; axes], "nothing starts by itself");
        turning(&mut bench);
    }
}

/// Global parameter 79: bit 0 inverts the stop switches of axes 0 to 2, bit 1 those of axes 3 to 5.
#[test]
fn the_polarity_of_the_switches_is_that_of_a_controller() {
    let mut bench = Bench::six("");
    bench.each("SAP 12, #, 0");
    bench.each("SAP 13, #, 0");
    for bits in [1, 2, 3, 0, 2] {
        bench.ok(&format!("SGP 79, 0, {bits}"));
        let closed = |axis: u8| bits >> (axis / 3) & 1;
        for axis in bench.axes() {
            assert_eq!([bench.get(10, axis), bench.get(11, axis)], [closed(axis); 2], "{bits}, axis {axis}");
        }
        // Those whose switches are closed now do not turn.
        bench.each("ROR #, 400");
        bench.run(SECOND / 2);
        let expected: Vec<i32> = bench.axes().map(|axis| 400 * (1 - closed(axis))).collect();
        assert_eq!(bench.speeds(), expected, "{bits}");
        bench.each("MST #");
        bench.run(SECOND / 2);
    }
    bench.power_cycle();
    assert_eq!(bench.ok("GGP 79, 0"), 2);
    assert_eq!((bench.all(10), bench.all(11)), (vec![0, 0, 0, 1, 1, 1], vec![0, 0, 0, 1, 1, 1]));
}

/// Global parameter 90: bit 0 reverses motors and encoders of axes 0 to 2, bit 1 those of axes 3 to 5.
#[test]
fn the_direction_of_the_motors_is_that_of_a_controller() {
    let mut bench = Bench::six("");
    for bits in [1, 2, 3, 0, 1] {
        bench.ok(&format!("SGP 90, 0, {bits}"));
        let before = bench.states();
        bench.each("MVP REL, #, 10000");
        bench.run(2 * SECOND);
        for (axis, (before, after)) in bench.axes().zip(before.iter().zip(bench.states())) {
            let way = if bits >> (axis / 3) & 1 == 1 { -10_000 } else { 10_000 };
            assert_eq!((after.rotor - before.rotor, after.position - before.position), (way, 10_000), "{bits}, {axis}");
        }
    }
    bench.power_cycle();
    bench.each("MVP ABS, #, 5000");
    let before = bench.states();
    bench.run(2 * SECOND);
    let ways = bench.states().into_iter().zip(before).map(|(after, before)| (after.rotor - before.rotor).signum());
    assert!(ways.eq([-1, -1, -1, 1, 1, 1]));
}

/// If one of the controllers does not hear of it, polarity and direction stay as they were for both.
#[test]
fn a_polarity_that_one_controller_does_not_hear_is_refused() {
    for silent in [0, 3] {
        let mut bench = Bench::six("");
        for number in [79, 90] {
            bench.control(&format!("fault tmc429 on {silent}"));
            assert_eq!(bench.ask(&format!("SGP {number}, 0, 3")).0, NOT_AVAILABLE);
            bench.control(&format!("fault tmc429 off {silent}"));
            assert_eq!(bench.ok(&format!("GGP {number}, 0")), 0);
        }
        bench.run(5 * MILLISECOND);
        assert_eq!((bench.all(10), bench.all(11)), (vec![0; 6], vec![0; 6]));
        bench.each("MVP ABS, #, 1000");
        bench.run(SECOND);
        assert!(bench.states().iter().all(|state| state.rotor == 1_000));
    }
}

/// The home switch of each axis is where parameter 9 of that axis says, whatever global parameter 79.
#[test]
fn each_axis_has_its_own_home_switch() {
    for mut bench in Bench::bare() {
        for axis in bench.axes() {
            bench.control(&format!("press home {axis}"));
            bench.run(2 * MILLISECOND);
            let expected: Vec<i32> = bench.axes().map(|other| i32::from(other == axis)).collect();
            assert_eq!(bench.all(9), expected);
            bench.control(&format!("release home {axis}"));
        }
    }
}

#[test]
fn a_product_has_as_many_inputs_and_outputs_as_it_says() {
    let mut bench = Bench::six("");
    assert_eq!(State::of(&bench.board.borrow()).pull_up_groups, [true, true], "at the start");
    for groups in [0, 1, 2, 3] {
        bench.ok(&format!("SIO 0, 0, {groups}"));
        bench.run(2 * MILLISECOND);
        assert_eq!(State::of(&bench.board.borrow()).pull_up_groups, [groups & 1 == 1, groups & 2 == 2]);
    }
    for number in 0..8 {
        bench.ok(&format!("SIO {number}, 2, 1"));
        bench.control(&format!("input {number} 1"));
        bench.run(2 * MILLISECOND);
        let outputs = State::of(&bench.board.borrow()).outputs;
        assert!(outputs.iter().enumerate().all(|(other, on)| *on == (other == number)), "{outputs:?}");
        assert_eq!((bench.ok(&format!("GIO {number}, 0")), bench.ok("GIO 255, 0")), (1, 1 << number));
        assert_eq!(bench.ok(&format!("GIO {number}, 2")), 1);
        bench.ok(&format!("SIO {number}, 2, 0"));
        bench.control(&format!("input {number} 0"));
    }
    bench.control("analog 0 1234");
    bench.control("analog 4 567");
    bench.run(2 * MILLISECOND);
    assert_eq!((bench.ok("GIO 0, 1"), bench.ok("GIO 4, 1")), (1_234, 567));
    for port in [1, 2, 3, 5] {
        assert_eq!(bench.ask(&format!("GIO {port}, 1")).0, 3, "analog input {port}");
    }
    // Each input has an interrupt.
    bench.control("analog 4 0");
    let interrupts: Vec<u8> = (39..47).collect();
    for number in &interrupts {
        bench.ok(&format!("SGP {number}, 3, 1"));
    }
    bench.count_interrupts(&interrupts);
    for number in 0..8 {
        bench.control(&format!("input {number} 1"));
        bench.run(5 * MILLISECOND);
        let counted: Vec<i32> = interrupts.iter().map(|interrupt| bench.variable(*interrupt)).collect();
        assert!(counted.iter().enumerate().all(|(other, count)| *count == i32::from(other <= number)), "{counted:?}");
    }
}
