//! The very flash image of the TMCM-6110: six axes at their pins, each in its own world, on all links; and it answers
//! what the virtual module answers. What becomes of faults in the firmware itself stands in `firmware_faults.rs`.

use crate::common::image_host::{Host, NOT_AVAILABLE, OK, RECOVERY, SIX_AXES, START, assert_logged, request, six_axes};
use crate::common::{Bench, telegram};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::param::GlobalParameter;
use tmcm::product::TMCM_6110;
use tmcm_sim::image::{ImageModule, Setup, model};
use tmcm_sim::native::{Model, Product};

/// Status of a reply: there is no such axis.
const INVALID_VALUE: u8 = 4;
/// The reply to command 136, type 1: the product in the upper half, then version 1.46.
const VERSION: i32 = 6110 << 16 | 1 << 8 | 46;

#[test]
fn it_boots_and_answers_on_all_links() {
    assert_eq!(model(six_axes()), Ok(Some(Model::Tmcl(Product::Tmcm6110))));
    let mut host = Host::of(SIX_AXES, "");
    assert_logged(&host.log(), &["info: module runs at address 1"]);
    assert_eq!((host.machine.core_clock(), host.bridges_on()), (168_000_000, true));
    host.plug_usb();
    for ask in [Host::ask, Host::ask_can, Host::ask_usb] {
        assert_eq!(ask(&mut host, "136, 1, 0, 0"), (OK, VERSION));
        for axis in 0..6 {
            assert_eq!(ask(&mut host, &format!("SAP 4, {axis}, {}", 500 + axis)).0, OK);
        }
        for axis in 0..6 {
            assert_eq!(ask(&mut host, &format!("GAP 4, {axis}")), (OK, 500 + axis));
        }
        assert_eq!(ask(&mut host, "ROR 6, 100").0, INVALID_VALUE);
    }
    assert_eq!(host.said_to(&telegram("136, 0, 0, 0"), 50 * MILLISECOND)[1..], *b"6110V146");
}

/// A line of the ASCII interface is read in the handler of its last character, which may come at any moment of a
/// datagram on the motion bus. With six axes turning there are some twelve datagrams a millisecond. A line of 63
/// characters takes that handler longer than a word on the bus.
#[test]
fn a_line_may_end_at_any_moment_of_a_datagram() {
    let mut host = Host::of(SIX_AXES, "");
    for axis in 0..6 {
        host.ok(&format!("ROR {axis}, 500"));
    }
    // The echo comes after CR, so that nobody has to wait for that of each character.
    host.ok("SGP 67, 0, 16");
    host.ok("139, 0, 0, 0");
    let line = format!("ASAP 4, 0, {:051}\r", 1_000);
    for n in 0..12 {
        host.run(n * 43_100 % MILLISECOND);
        let heard = host.said_to(line.as_bytes(), 170 * MILLISECOND);
        assert_eq!(
            heard.escape_ascii().to_string(),
            format!("{line}BA 100 1000\r").escape_default().to_string(),
            "line {n}"
        );
    }
}

#[test]
fn a_product_whose_microcontroller_is_not_known_has_no_image() {
    let module = ImageModule::of(Product::Tmcm3110, six_axes(), &WorldConfig::default(), None, 1, Setup::default());
    let told = module.err().map(|stop| stop.to_string());
    assert_eq!(told.as_deref(), Some("the image cannot be used: no microcontroller is known for the TMCM-3110"));
}

/// The task of an axis, what its world does to it meanwhile, where its rotor then stands, and its error flags
/// (parameter 207). The place of the rotor is known to a few microsteps, if at all.
type Task = (&'static [&'static str], Option<&'static str>, Option<i64>, i32);
const TASKS: [Task; 6] = [
    (&["SAP 4, 0, 1500", "MVP ABS, 0, 23456"], None, Some(23_456), 0),
    (&["SAP 193, 1, 7", "RFS START, 1"], None, Some(4_100), 0),
    (&["SAP 174, 2, 1", "SAP 181, 2, 500", "ROR 2, 1000"], Some("load 1 2"), None, 1),
    (&["SAP 12, 3, 0", "ROR 3, 700"], None, Some(9_000), 0),
    (&["SAP 13, 4, 0", "MVP REL, 4, -45000"], None, Some(-9_000), 0),
    (&["ROL 5, 300"], Some("fault short-a on 5"), None, 0),
];

/// The stages of the axes: home of axis 1, right switch of axis 3, left switch of axis 4, and where axis 4 starts.
const WORLD: &str = "[[axis]]\n[[axis]]\nstage.home = [4000, 4200]\nstage.left = -20000\n[[axis]]\n[[axis]]\n\
    stage.right = 9000\n[[axis]]\nmotor.start = -77\nstage.left = -9000\n[[axis]]\n";

/// Six axes have their tasks at the same time: one moves, one searches, one stalls, two run into switches, one loses
/// its driver. Each rotor is where its own world says. The virtual module does and shows the same.
#[test]
fn six_axes_do_six_things_at_once() {
    let (mut image, mut core) = (Host::of(SIX_AXES, WORLD), Bench::of_in_world(Product::Tmcm6110, WORLD));
    for line in TASKS.iter().flat_map(|(lines, ..)| *lines) {
        assert_eq!(image.ok(line), core.ok(line), "{line}");
    }
    image.run(600 * MILLISECOND);
    core.run(600 * MILLISECOND);
    for line in TASKS.iter().filter_map(|(_, met, ..)| *met) {
        image.control(line);
        core.control(line);
    }
    image.run(4 * SECOND);
    core.run(4 * SECOND);
    let rotors = image.rotors();
    for (axis, (_, _, place, errors)) in TASKS.into_iter().enumerate() {
        if let Some(place) = place {
            assert!((rotors[axis] - place).abs() <= 64, "axis {axis} is at {}, not at {place}", rotors[axis]);
        }
        assert_eq!((image.ok(&format!("GAP 3, {axis}")), image.ok(&format!("GAP 207, {axis}"))), (0, errors), "{axis}");
    }
    image.assert_rest();
    for axis in 0..6 {
        for parameter in [3, 8, 9, 10, 11, 208] {
            let line = format!("GAP {parameter}, {axis}");
            assert_eq!(image.ask(&line), core.ask(&line), "{line}");
        }
    }
}

/// Each driver has its own SG_TST: with all motors turning, the one stops that is stalled.
#[test]
fn each_axis_stops_at_a_stall_of_its_own() {
    let mut host = Host::of(SIX_AXES, "");
    for line in ["SAP 174, #, 1", "SAP 181, #, 500", "ROR #, 1000"] {
        host.each(line);
    }
    host.run(500 * MILLISECOND);
    let mut expected = [1_000; 6];
    for axis in 0..6 {
        assert_eq!(host.speeds(), expected);
        host.control(&format!("load 1 {axis}"));
        host.run(200 * MILLISECOND);
        expected[axis] = 0;
    }
    assert_eq!(host.speeds(), expected);
    assert_eq!(host.each("GAP 207, #"), [1; 6]);
}

/// Switches have pins that are no inputs, and inputs have pins that are no switches: what is pressed shows there alone.
#[test]
fn switches_inputs_outputs_and_pull_ups_are_at_their_pins() {
    let mut host = Host::of(SIX_AXES, "");
    for axis in 0..6 {
        for (switch, parameter) in [("home", 9), ("right", 10), ("left", 11)] {
            host.control(&format!("press {switch} {axis}"));
            host.run(2 * MILLISECOND);
            for number in [9, 10, 11] {
                let pressed = (0..6).map(|other| i32::from(number == parameter && other == axis)).collect::<Vec<_>>();
                assert_eq!(host.each(&format!("GAP {number}, #")), pressed, "{switch} switch of axis {axis}");
            }
            assert_eq!(host.ok("GIO 255, 0"), 0);
            host.control(&format!("release {switch} {axis}"));
        }
    }
    for input in 0..8 {
        host.control(&format!("input {input} 1"));
        host.run(2 * MILLISECOND);
        assert_eq!(host.ok("GIO 255, 0"), 1 << input);
        host.control(&format!("input {input} 0"));
    }
    for (input, reading) in [(0, 1_234), (4, 777)] {
        host.control(&format!("analog {input} {reading}"));
    }
    host.control("supply 12.3");
    host.run(20 * MILLISECOND);
    let supply = host.ok("GIO 8, 1");
    assert_eq!((host.ok("GIO 0, 1"), host.ok("GIO 4, 1")), (1_234, 777));
    assert!((122..=124).contains(&supply), "{supply}");
    for port in 0..8 {
        host.ok(&format!("SIO {port}, 2, 1"));
        host.run(2 * MILLISECOND);
        assert_eq!(host.machine.board().world().outputs().digital, (2 << port) - 1);
    }
    for groups in [0b01, 0b10, 0b00, 0b11] {
        host.ok(&format!("SIO 0, 0, {groups}"));
        host.run(2 * MILLISECOND);
        assert_eq!(host.machine.board().world().outputs().pull_ups, groups as u32);
    }
}

/// The settings of all axes and the program survive; the two pads, connected while the module is switched on, bring the
/// settings of the factory back, and leave the program.
#[test]
fn what_is_stored_survives_until_the_pads_are_connected() {
    let mut host = Host::of(SIX_AXES, "");
    let cycle = |host: &mut Host, connected: bool| {
        host.machine.set_power(false);
        host.machine.wiring().connect_pads(connected);
        host.run(10 * MILLISECOND);
        host.machine.set_power(true);
        host.run(2 * START);
        host.log()
    };
    for axis in 0..6 {
        host.ok(&format!("SAP 4, {axis}, {}", 700 + axis));
        host.ok(&format!("STAP 4, {axis}"));
    }
    host.ok("132, 0, 0, 2046");
    assert_eq!((host.ask("SGP 1, 2, 7").0, host.ask("STOP").0), (101, 101));
    host.ok("133, 0, 0, 0");
    assert!(!cycle(&mut host, false).iter().any(|line| line.contains("pads")));
    assert_eq!(host.each("GAP 4, #"), [700, 701, 702, 703, 704, 705]);
    assert_logged(&cycle(&mut host, true), &["EEPROM holds a program", "warn: pads connected: factory settings"]);
    assert_eq!(host.each("GAP 4, #"), [1_000; 6]);
    cycle(&mut host, false);
    assert_eq!(host.each("GAP 4, #"), [1_000; 6], "for good");
    host.ok("129, 1, 0, 2046");
    host.run(10 * MILLISECOND);
    assert_eq!(host.ok("GGP 1, 2"), 7);
}

/// Either motion controller that does not answer, from the start on or while all motors turn, and all drivers are off
/// until the next start. The module answers, and moves nothing.
#[test]
fn one_silent_motion_controller_switches_all_drivers_off() {
    for (axis, from_the_start) in [(0, true), (3, true), (0, false), (5, false)] {
        let mut host = Host::just_on_of(SIX_AXES, "");
        if from_the_start {
            host.control(&format!("fault tmc429 on {axis}"));
        }
        host.run(START);
        if !from_the_start {
            host.each("ROR #, 500");
            host.run(200 * MILLISECOND);
            assert_eq!((host.speed(), host.bridges_on()), (500, true));
            host.control(&format!("fault tmc429 on {axis}"));
            let took = host.wait(MILLISECOND / 10, SECOND, |host| !host.bridges_on());
            assert!(took <= 6 * MILLISECOND, "{took}");
        }
        assert_eq!(host.ok("GGP 66, 0"), 1);
        assert_eq!((host.bridges_on(), host.machine.board().world().outputs().leds[1]), (false, true), "axis {axis}");
        for other in 0..6 {
            assert_eq!(host.ask(&format!("ROR {other}, 500")).0, NOT_AVAILABLE);
        }
        host.control(&format!("fault tmc429 off {axis}"));
        host.run(20 * MILLISECOND);
        host.assert_rest();
        assert!(!host.bridges_on());
        host.ok("255, 0, 0, 1234");
        host.run(RECOVERY);
        host.each("ROR #, 500");
        host.run(200 * MILLISECOND);
        assert_eq!(
            (host.speed(), host.bridges_on(), host.machine.board().world().outputs().leds[1]),
            (500, true, false)
        );
    }
}

/// Six axes that arrive at once send six events over a link that is busy with other replies, or slow, as well.
#[test]
fn the_events_of_all_axes_find_their_way_over_busy_links() {
    let mut host = Host::of(SIX_AXES, "");
    host.each("SCO 1, #, 20");
    host.plug_usb();
    let start = "MVP COORD, 255, 1";
    let six: Vec<(u8, u8, u32)> = (0..6).map(|axis| (128, 138, 1 << axis)).collect();
    let told = |bytes: &[u8]| (bytes[1], bytes[2], u32::from_be_bytes(bytes[3..7].try_into().unwrap()));
    let events = |told: Vec<(u8, u8, u32)>| {
        let mut events: Vec<_> = told.into_iter().filter(|told| told.1 == 138).collect();
        // They start one after the other, so one of them may arrive a millisecond before another.
        events.sort_unstable();
        events
    };
    for _ in 0..2 {
        // An event takes 9.4 ms at 9600 bit/s.
        host.ok("138, 1, 0, 255");
        let said = host.said_to(&telegram(start), 200 * MILLISECOND);
        assert_eq!(events(said.chunks(9).map(|bytes| told(&bytes[1..])).collect()), six);
        host.each("SAP 1, #, 0");

        // Requests wait behind each other for a mailbox.
        assert_eq!(host.ask_can("138, 1, 0, 255").0, OK);
        host.machine.can().send(request(1, start));
        (0..40).for_each(|_| host.machine.can().send(request(1, "GAP 4, 0")));
        host.run(200 * MILLISECOND);
        let said = host.machine.can().take_sent();
        assert_eq!(events(said.iter().map(|(_, frame)| told(&frame.data)).collect()), six);
        host.each("SAP 1, #, 0");

        assert_eq!(host.ask_usb("138, 1, 0, 255").0, OK);
        let lines = [&[start][..], &["GAP 4, 0"; 40]].concat();
        let bytes: Vec<u8> = lines.into_iter().flat_map(telegram).collect();
        host.machine.usb().send(&bytes);
        let said = host.hear_usb(200 * MILLISECOND);
        assert_eq!(said.len(), 9 * 47);
        assert_eq!(events(said.chunks(9).map(|bytes| told(&bytes[1..])).collect()), six);
        host.each("SAP 1, #, 0");
    }
}

/// All that can be read of the module and of each axis, the clock and random numbers left out. It is read before and
/// after all that can be stored has been given another value, which differs from axis to axis as far as its range
/// allows. The test reads what is refused, too.
#[test]
fn image_and_virtual_module_give_the_same_replies() {
    let (mut image, mut core) = (Host::of(SIX_AXES, ""), Bench::of(Product::Tmcm6110));
    image.plug_usb();
    let global =
        TMCM_6110.global.rows.iter().filter(|parameter| {
            !matches!(parameter.function, GlobalParameter::TickTimer | GlobalParameter::RandomNumber)
        });
    let mut reads: Vec<String> = global.map(|parameter| format!("GGP {}, 0", parameter.row.number)).collect();
    let rows = || TMCM_6110.axis.rows.iter().map(|parameter| &parameter.row);
    reads.extend(rows().flat_map(|row| (0..=6).map(move |axis| format!("GAP {}, {axis}", row.number))));
    let writes = rows().filter(|row| row.stored() && row.writable()).flat_map(|row| {
        (0..6).map(move |axis| {
            let values = [row.default + axis + 1, row.default - axis - 1, row.default ^ 1];
            let value = values.into_iter().find(|value| row.accepts(*value)).unwrap();
            format!("SAP {}, {axis}, {value}", row.number)
        })
    });
    let refused =
        ["ROR 6, 1", "MVP COORD, 6, 1", "SIO 8, 2, 1", "GIO 5, 1", "SGP 79, 0, 4", "SAP 6, 0, 256", "136, 9, 0, 0"];
    let refused = refused.map(str::to_owned).to_vec();
    let writes: Vec<String> = writes.collect();
    for lines in [&reads, &refused, &writes, &reads] {
        // Until the motors have their standby current.
        image.run(3 * SECOND);
        core.run(3 * SECOND);
        for line in lines {
            assert_eq!(image.ask_usb(line), core.ask(line), "{line}");
        }
    }
}
