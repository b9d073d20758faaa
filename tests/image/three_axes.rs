//! The very flash image of the TMCM-3212: three axes at their pins, each in its own world, on all links; and it answers
//! what the virtual module answers. What becomes of faults in the firmware itself stands in `firmware_faults.rs`.

use super::sisters::{Sister, Task, power_cycle};
use common::image_host::{Host, THREE_AXES, assert_logged};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm_sim::native::Product;

/// 20000 microsteps/s are 20000 * 2^24 / 16 MHz = 20 972 units of a TMC5160, 40000 are 41 943; version 1.05.
const TMCM_3212: Sister = Sister {
    image: THREE_AXES,
    product: Product::Tmcm3212,
    version: 3212 << 16 | 1 << 8 | 5,
    name: b"3212V105",
    speed: (20_000, 20_972),
    stalling: (40_000, 41_943),
    stop_on_stall: 20_000,
    ramp: SECOND,
    controller: "tmc5160",
    set_up_again: true,
    switches: 10 * MILLISECOND,
};

#[test]
fn it_boots_and_answers_on_all_links() {
    TMCM_3212.boots_and_answers_on_all_links();
}

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

#[test]
fn three_axes_do_three_things_at_once() {
    for (tasks, world) in [(MOVE_SEARCH_STALL, WORLD), (SWITCHES_AND_SHORT, NARROW_WORLD)] {
        TMCM_3212.do_tasks_at_once(&tasks, world, 1_500 * MILLISECOND, 128);
    }
}

#[test]
fn each_axis_stops_at_a_stall_of_its_own() {
    TMCM_3212.stops_each_axis_at_its_stall();
}

/// Switches have pins that are no inputs, and inputs have pins that are no switches: what is pressed shows there alone.
#[test]
fn switches_inputs_and_outputs_are_at_their_pins() {
    let mut host = TMCM_3212.host("");
    TMCM_3212.has_each_switch_at_its_pin(&mut host);
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
    let mut host = TMCM_3212.host("");
    host.each("SAP 4, #, 70000");
    for axis in 0..3 {
        host.ok(&format!("SGP {axis}, 2, {}", 700 + axis));
        host.ok(&format!("STGP {axis}, 2"));
    }
    host.ok("132, 0, 0, 6142");
    assert_eq!((host.ask("SGP 5, 2, 7").0, host.ask("STOP").0), (101, 101));
    host.ok("133, 0, 0, 0");
    let stored = |host: &mut Host| [0, 1, 2].map(|number| host.ok(&format!("GGP {number}, 2")));
    assert!(!power_cycle(&mut host, false).iter().any(|line| line.contains("pads")));
    assert_eq!((stored(&mut host), host.each("GAP 4, #")), ([700, 701, 702], vec![51_200; 3]));
    assert_logged(&power_cycle(&mut host, true), &["EEPROM holds a program", "warn: pads connected: factory settings"]);
    assert_eq!(stored(&mut host), [0; 3]);
    power_cycle(&mut host, false);
    assert_eq!(stored(&mut host), [0; 3], "for good");
    host.ok("129, 1, 0, 6142");
    host.run(10 * MILLISECOND);
    assert_eq!(host.ok("GGP 5, 2"), 7);
}

#[test]
fn one_silent_chip_switches_all_drivers_off() {
    TMCM_3212.switches_all_drivers_off(&[(0, true), (2, true), (1, false)]);
}

/// A chip that its supply has reset forgets all. Its motor stands, with its position known, and the move counts as cut
/// short; the others go on. It is set up again, and moves when it is told to.
#[test]
fn a_chip_reset_by_its_supply_is_set_up_again_with_its_motor_at_rest() {
    let mut host = TMCM_3212.host("");
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

/// Not written is what makes a motor move, or places it: the first three.
#[test]
fn image_and_virtual_module_give_the_same_replies() {
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
    TMCM_3212.answers_like_the_virtual_module(|row| row.number > 2, &refused);
}
