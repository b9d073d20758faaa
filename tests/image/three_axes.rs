//! The very flash image of the TMCM-3212: three axes at their pins, each in its own world, on all links; and it answers
//! what the virtual module answers. What becomes of faults in the firmware itself stands in `firmware_faults.rs`.

use crate::common::image_host::{Host, NOT_AVAILABLE, OK, RECOVERY, START, THREE_AXES, assert_logged, three_axes};
use crate::common::{Bench, telegram};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::param::GlobalParameter;
use tmcm::product::TMCM_3212;
use tmcm_sim::image::model;
use tmcm_sim::native::{Model, Product};

/// Status of a reply: there is no such axis.
const INVALID_VALUE: u8 = 4;
/// The reply to command 136, type 1: the product in the upper half, then version 1.05.
const VERSION: i32 = 3212 << 16 | 1 << 8 | 5;

#[test]
fn it_boots_and_answers_on_all_links() {
    assert_eq!(model(three_axes()), Ok(Some(Model::Tmcl(Product::Tmcm3212))));
    let mut host = Host::of(THREE_AXES, "");
    assert_logged(&host.log(), &["info: module runs at address 1"]);
    assert_eq!((host.machine.core_clock(), host.bridges_on()), (168_000_000, true));
    host.plug_usb();
    for ask in [Host::ask, Host::ask_can, Host::ask_usb] {
        assert_eq!(ask(&mut host, "136, 1, 0, 0"), (OK, VERSION));
        for axis in 0..3 {
            assert_eq!(ask(&mut host, &format!("SAP 4, {axis}, {}", 50_000 + axis)).0, OK);
        }
        for axis in 0..3 {
            assert_eq!(ask(&mut host, &format!("GAP 4, {axis}")), (OK, 50_000 + axis));
        }
        assert_eq!(ask(&mut host, "ROR 3, 100").0, INVALID_VALUE);
    }
    assert_eq!(host.said_to(&telegram("136, 0, 0, 0"), 50 * MILLISECOND)[1..], *b"3212V105");
}

/// The task of an axis, what its world does to it meanwhile, where its rotor then stands, and its error flags
/// (parameter 207). The place of the rotor is known to a few microsteps, if at all.
type Task = (&'static [&'static str], Option<&'static str>, Option<i64>, i32);

/// Tasks of three axes: one moves, one searches, one stalls.
const MOVE_SEARCH_STALL: [Task; 3] = [
    (&["SAP 4, 0, 100000", "SAP 5, 0, 200000", "SAP 17, 0, 100000", "MVP ABS, 0, 123456"], None, Some(123_456), 0),
    (&["SAP 193, 1, 7", "RFS START, 1"], None, Some(4_100), 0),
    (&["SAP 174, 2, 1", "SAP 181, 2, 20000", "ROR 2, 40000"], Some("load 1 2"), None, 1),
];
/// Two run into their switches, one of which stops with a ramp, and one loses its driver. The ramp takes v^2 / 2 a =
/// 30000^2 / (2 * 51200) = 8 789 microsteps.
const SWITCHES_AND_SHORT: [Task; 3] = [
    (&["ROR 0, 30000"], None, Some(9_000), 0),
    (&["SAP 26, 1, 1", "ROL 1, 30000"], None, Some(-17_789), 0),
    (&["ROL 2, 30000"], Some("fault short-a on 2"), None, 0),
];

/// The stages of the axes.
const WORLD: &str =
    "[[axis]]\nstage.right = 200000\n[[axis]]\nstage.home = [4000, 4200]\nstage.left = -20000\n[[axis]]\n";
const NARROW_WORLD: &str =
    "[[axis]]\nstage.right = 9000\n[[axis]]\nstage.left = -9000\nstage.left_width = 60000\n[[axis]]\n";

/// All at the same time; and each rotor is where its own world says. The virtual module does and shows the same.
#[test]
fn three_axes_do_three_things_at_once() {
    for (tasks, world) in [(MOVE_SEARCH_STALL, WORLD), (SWITCHES_AND_SHORT, NARROW_WORLD)] {
        let (mut image, mut core) = (Host::of(THREE_AXES, world), Bench::of_in_world(Product::Tmcm3212, world));
        for line in tasks.iter().flat_map(|(lines, ..)| *lines) {
            assert_eq!(image.ok(line), core.ok(line), "{line}");
        }
        image.run(1_500 * MILLISECOND);
        core.run(1_500 * MILLISECOND);
        for line in tasks.iter().filter_map(|(_, met, ..)| *met) {
            image.control(line);
            core.control(line);
        }
        image.run(4 * SECOND);
        core.run(4 * SECOND);
        let rotors = image.rotors();
        for (axis, (lines, _, place, errors)) in tasks.into_iter().enumerate() {
            if let Some(place) = place {
                assert!((rotors[axis] - place).abs() <= 128, "{lines:?}: at {}, not at {place}", rotors[axis]);
            }
            assert_eq!(image.ok(&format!("GAP 3, {axis}")), 0, "{lines:?}");
            assert_eq!(image.ok(&format!("GAP 207, {axis}")), errors, "{lines:?}");
        }
        image.assert_rest();
        for axis in 0..3 {
            for parameter in [3, 8, 9, 10, 11, 208] {
                let line = format!("GAP {parameter}, {axis}");
                assert_eq!(image.ask(&line), core.ask(&line), "{line}");
            }
        }
    }
}

/// With all motors turning, the one stops that is stalled.
#[test]
fn each_axis_stops_at_a_stall_of_its_own() {
    let mut host = Host::of(THREE_AXES, "");
    for line in ["SAP 174, #, 1", "SAP 181, #, 20000", "ROR #, 40000"] {
        host.each(line);
    }
    host.run(SECOND);
    let mut turning = [true; 3];
    for axis in 0..3 {
        assert_eq!(host.speeds().iter().map(|speed| *speed != 0).collect::<Vec<_>>(), turning);
        host.control(&format!("load 1 {axis}"));
        host.run(200 * MILLISECOND);
        turning[axis] = false;
    }
    assert_eq!(host.speeds(), [0; 3]);
    assert_eq!(host.each("GAP 207, #"), [1; 3]);
}

/// Switches have pins that are no inputs, and inputs have pins that are no switches: what is pressed shows there alone.
#[test]
fn switches_inputs_and_outputs_are_at_their_pins() {
    let mut host = Host::of(THREE_AXES, "");
    for axis in 0..3 {
        for (switch, parameter) in [("home", 9), ("right", 10), ("left", 11)] {
            host.control(&format!("press {switch} {axis}"));
            host.run(10 * MILLISECOND);
            for number in [9, 10, 11] {
                let pressed = (0..3).map(|other| i32::from(number == parameter && other == axis)).collect::<Vec<_>>();
                assert_eq!(host.each(&format!("GAP {number}, #")), pressed, "{switch} switch of axis {axis}");
            }
            assert_eq!(host.ok("GIO 255, 0"), 0);
            host.control(&format!("release {switch} {axis}"));
        }
    }
    for input in [0, 1, 2, 3, 10] {
        host.control(&format!("input {input} 1"));
        host.run(2 * MILLISECOND);
        let levels = [0, 1, 2, 3, 10].map(|number| host.ok(&format!("GIO {number}, 0")));
        assert_eq!(levels, [0, 1, 2, 3, 10].map(|number| i32::from(number == input)));
        host.control(&format!("input {input} 0"));
    }
    // The 12 bits of the converter as 16: the uppermost four are repeated below.
    for (input, reading, shown) in [(0, 0x4D2, 0x4D24), (1, 0xFFF, 0xFFFF), (2, 0x800, 0x8008), (3, 0x001, 0x0010)] {
        host.control(&format!("analog {input} {reading}"));
        host.run(20 * MILLISECOND);
        assert_eq!(host.ok(&format!("GIO {input}, 1")), shown);
    }
    for supply in [12.3, 48.0] {
        host.control(&format!("supply {supply}"));
        host.run(20 * MILLISECOND);
        let (read, is) = (host.ok("GIO 8, 1"), (supply * 10.0) as i32);
        assert!((is - 1..=is + 1).contains(&read), "{read} at {supply} V");
    }
    for port in 0..4 {
        host.ok(&format!("SIO {port}, 2, 1"));
        host.run(2 * MILLISECOND);
        assert_eq!(host.machine.board().world().outputs().digital, (2 << port) - 1);
    }
}

/// Global settings, coordinates and the program survive, settings of axes do not. The two pads, connected while the
/// module is switched on, bring the settings of the factory back, and leave the program.
#[test]
fn what_is_stored_survives_until_the_pads_are_connected() {
    let mut host = Host::of(THREE_AXES, "");
    let cycle = |host: &mut Host, connected: bool| {
        host.machine.set_power(false);
        host.machine.wiring().connect_pads(connected);
        host.run(10 * MILLISECOND);
        host.machine.set_power(true);
        host.run(2 * START);
        host.log()
    };
    host.each("SAP 4, #, 70000");
    for axis in 0..3 {
        host.ok(&format!("SGP {axis}, 2, {}", 700 + axis));
        host.ok(&format!("STGP {axis}, 2"));
    }
    host.ok("132, 0, 0, 6142");
    assert_eq!((host.ask("SGP 5, 2, 7").0, host.ask("STOP").0), (101, 101));
    host.ok("133, 0, 0, 0");
    let stored = |host: &mut Host| [0, 1, 2].map(|number| host.ok(&format!("GGP {number}, 2")));
    assert!(!cycle(&mut host, false).iter().any(|line| line.contains("pads")));
    assert_eq!((stored(&mut host), host.each("GAP 4, #")), ([700, 701, 702], vec![51_200; 3]));
    assert_logged(&cycle(&mut host, true), &["EEPROM holds a program", "warn: pads connected: factory settings"]);
    assert_eq!(stored(&mut host), [0; 3]);
    cycle(&mut host, false);
    assert_eq!(stored(&mut host), [0; 3], "for good");
    host.ok("129, 1, 0, 6142");
    host.run(10 * MILLISECOND);
    assert_eq!(host.ok("GGP 5, 2"), 7);
}

/// A chip that does not answer, from the start on or while all motors turn, and all drivers are off. The module
/// answers, and moves nothing until the next start. But a chip that answers again and tells that it was reset is set up
/// at once, as the one that did not answer from its power-on.
#[test]
fn one_silent_chip_switches_all_drivers_off() {
    for (axis, from_the_start) in [(0, true), (2, true), (1, false)] {
        let mut host = Host::just_on_of(THREE_AXES, "");
        if from_the_start {
            host.control(&format!("fault tmc5160 on {axis}"));
        }
        host.run(START);
        if !from_the_start {
            host.each("ROR #, 20000");
            host.run(SECOND);
            assert!(host.speed() > 0 && host.bridges_on());
            host.control(&format!("fault tmc5160 on {axis}"));
            let took = host.wait(MILLISECOND / 10, SECOND, |host| !host.bridges_on());
            assert!(took <= 6 * MILLISECOND, "{took}");
        }
        assert_eq!(host.ok("GGP 66, 0"), 1);
        assert_eq!((host.bridges_on(), host.machine.board().world().outputs().leds[1]), (false, true), "axis {axis}");
        for other in 0..3 {
            assert_eq!(host.ask(&format!("ROR {other}, 500")).0, NOT_AVAILABLE);
        }
        host.control(&format!("fault tmc5160 off {axis}"));
        host.run(SECOND);
        host.assert_rest();
        assert_eq!(host.bridges_on(), from_the_start, "axis {axis}");
        if !from_the_start {
            host.ok("255, 0, 0, 1234");
            host.run(RECOVERY);
        }
        host.each("ROR #, 20000");
        host.run(SECOND);
        let trouble = host.machine.board().world().outputs().leds[1];
        assert_eq!((host.speed() > 0, host.bridges_on(), trouble), (true, true, false), "axis {axis}");
    }
}

/// A chip that its supply has reset forgets all. Its motor stands, with its position known, and the move counts as cut
/// short; the others go on. It is set up again, and moves when it is told to.
#[test]
fn a_chip_reset_by_its_supply_is_set_up_again_with_its_motor_at_rest() {
    let mut host = Host::of(THREE_AXES, "");
    host.each("SAP 6, #, 200");
    host.each("ROR #, 20000");
    host.run(SECOND);
    assert!(host.speed() > 0);
    host.control("fault chip-supply on 1");
    host.run(2 * MILLISECOND);
    host.control("fault chip-supply off 1");
    host.run(100 * MILLISECOND);
    let [first, reset, last] = host.speeds()[..] else { panic!("three axes") };
    assert_eq!((first > 0, reset, last), (true, 0, first));
    assert!(host.bridges_on());
    // A second at 20 000 microsteps a second less the ramp, 20000 - 20000^2 / (2 * 51200), and up to 50 ms for
    // telegrams.
    let position = host.ok("GAP 1, 1");
    assert!((16_094..17_094).contains(&position), "{position}");
    assert_eq!((host.ok("GAP 2, 1"), host.ok("GAP 6, 1")), (0, 200));
    host.each("MST #");
    host.run(2 * SECOND);
    let rotor = host.rotors()[1];
    host.ok("MVP REL, 1, 25600");
    host.run(3 * SECOND);
    assert_eq!((host.ok("GAP 8, 1"), host.ok("GAP 1, 1")), (1, position + 25_600));
    // The new field may have drawn the rotor by up to two full steps.
    let way = host.rotors()[1] - rotor;
    assert!((25_600 - 512..=25_600 + 512).contains(&way), "{way}");
}

/// All that can be read of the module and of each axis, the clock and random numbers left out. It is read before and
/// after all that can be set of the axes has been given another value. This value differs from axis to axis as far as
/// its range allows. The test reads what is refused, too.
#[test]
fn image_and_virtual_module_give_the_same_replies() {
    let (mut image, mut core) = (Host::of(THREE_AXES, ""), Bench::of(Product::Tmcm3212));
    image.plug_usb();
    let global =
        TMCM_3212.global.rows.iter().filter(|parameter| {
            !matches!(parameter.function, GlobalParameter::TickTimer | GlobalParameter::RandomNumber)
        });
    let mut reads: Vec<String> = global.map(|parameter| format!("GGP {}, 0", parameter.row.number)).collect();
    let rows = || TMCM_3212.axis.rows.iter().map(|parameter| &parameter.row);
    reads.extend(rows().flat_map(|row| (0..=3).map(move |axis| format!("GAP {}, {axis}", row.number))));
    // Not what makes a motor move, or places it: the first three.
    let writes = rows().filter(|row| row.writable() && row.number > 2).flat_map(|row| {
        (0..3).filter_map(move |axis| {
            let values = [row.default + axis + 1, row.default - axis - 1, row.default ^ 1];
            let value = values.into_iter().find(|value| row.accepts(*value))?;
            Some(format!("SAP {}, {axis}, {value}", row.number))
        })
    });
    let refused = [
        "ROR 3, 1",
        "MVP COORD, 3, 1",
        "SIO 4, 2, 1",
        "GIO 4, 1",
        "SGP 79, 0, 4",
        "SAP 6, 0, 256",
        "STAP 4, 0",
        "139, 0, 0, 0",
    ];
    let refused = refused.map(str::to_owned).to_vec();
    let writes: Vec<String> = writes.collect();
    assert!(writes.len() > 100, "{writes:?}");
    for lines in [&reads, &refused, &writes, &reads] {
        // Until the motors have their standby current.
        image.run(3 * SECOND);
        core.run(3 * SECOND);
        for line in lines {
            assert_eq!(image.ask_usb(line), core.ask(line), "{line}");
        }
    }
}
