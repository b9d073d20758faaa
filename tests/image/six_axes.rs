//! The very flash image of the TMCM-6110: six axes at their pins, each in its own world, on all links; and it answers
//! what the virtual module answers. What becomes of faults in the firmware itself stands in `firmware_faults.rs`.

use super::sisters::{Sister, Task, power_cycle};
use common::image_host::{OK, SIX_AXES, assert_logged, request, six_axes};
use common::telegram;
use hal_sim::clock::MILLISECOND;
use hal_sim::world::config::WorldConfig;
use tmcm::param::Row;
use tmcm_sim::image::{ImageModule, Setup};
use tmcm_sim::native::Product;

/// Version 1.46.
const TMCM_6110: Sister = Sister {
    image: SIX_AXES,
    product: Product::Tmcm6110,
    version: 6110 << 16 | 1 << 8 | 46,
    name: b"6110V146",
    speed: (500, 500),
    stalling: (1_000, 1_000),
    stop_on_stall: 500,
    ramp: 500 * MILLISECOND,
    controller: "tmc429",
    set_up_again: false,
    switches: 2 * MILLISECOND,
};

#[test]
fn it_boots_and_answers_on_all_links() {
    TMCM_6110.boots_and_answers_on_all_links();
}

/// A line of the ASCII interface is read in the handler of its last character, which may come at any moment of a
/// datagram on the motion bus. With six axes turning there are some twelve datagrams a millisecond. A line of 63
/// characters takes that handler longer than a word on the bus.
#[test]
fn a_line_may_end_at_any_moment_of_a_datagram() {
    let mut host = TMCM_6110.host("");
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

/// Tasks of six axes: one moves, one searches, one stalls, two run into switches, one loses its driver.
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

#[test]
fn six_axes_do_six_things_at_once() {
    TMCM_6110.do_tasks_at_once(&TASKS, WORLD, 600 * MILLISECOND, 64);
}

/// Each driver has its own SG_TST.
#[test]
fn each_axis_stops_at_a_stall_of_its_own() {
    TMCM_6110.stops_each_axis_at_its_stall();
}

/// Switches have pins that are no inputs, and inputs have pins that are no switches: what is pressed shows there alone.
#[test]
fn switches_inputs_outputs_and_pull_ups_are_at_their_pins() {
    let mut host = TMCM_6110.host("");
    TMCM_6110.has_each_switch_at_its_pin(&mut host);
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
    let mut host = TMCM_6110.host("");
    for axis in 0..6 {
        host.ok(&format!("SAP 4, {axis}, {}", 700 + axis));
        host.ok(&format!("STAP 4, {axis}"));
    }
    host.ok("132, 0, 0, 2046");
    assert_eq!((host.ask("SGP 1, 2, 7").0, host.ask("STOP").0), (101, 101));
    host.ok("133, 0, 0, 0");
    assert!(!power_cycle(&mut host, false).iter().any(|line| line.contains("pads")));
    assert_eq!(host.each("GAP 4, #"), [700, 701, 702, 703, 704, 705]);
    assert_logged(&power_cycle(&mut host, true), &["EEPROM holds a program", "warn: pads connected: factory settings"]);
    assert_eq!(host.each("GAP 4, #"), [1_000; 6]);
    power_cycle(&mut host, false);
    assert_eq!(host.each("GAP 4, #"), [1_000; 6], "for good");
    host.ok("129, 1, 0, 2046");
    host.run(10 * MILLISECOND);
    assert_eq!(host.ok("GGP 1, 2"), 7);
}

#[test]
fn one_silent_motion_controller_switches_all_drivers_off() {
    TMCM_6110.switches_all_drivers_off(&[(0, true), (3, true), (0, false), (5, false)]);
}

/// Six axes that arrive at once send six events over a link that is busy with other replies, or slow, as well.
#[test]
fn the_events_of_all_axes_find_their_way_over_busy_links() {
    let mut host = TMCM_6110.host("");
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

#[test]
fn image_and_virtual_module_give_the_same_replies() {
    let refused =
        ["ROR 6, 1", "MVP COORD, 6, 1", "SIO 8, 2, 1", "GIO 5, 1", "SGP 79, 0, 4", "SAP 6, 0, 256", "136, 9, 0, 0"];
    TMCM_6110.answers_like_the_virtual_module(Row::stored, &refused);
}
