//! Modules with several axes have much in common, which tests of their images see in the same way here. The TMCM-6110
//! has six axes at two motion controllers, the TMCM-3212 three axes with a controller each.

use common::image_host::{self, Host, NOT_AVAILABLE, OK, RECOVERY, START, assert_logged};
use common::{Bench, INVALID_VALUE, telegram};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::param::{GlobalParameter, Row};
use tmcm_sim::image::model;
use tmcm_sim::native::{Model, Product};

/// A module with several axes, and what differs between it and the others.
pub(crate) struct Sister {
    pub(crate) image: image_host::Product,
    pub(crate) product: Product,
    /// The reply to command 136, type 1: the product in the upper half, then the version.
    pub(crate) version: i32,
    /// The reply to command 136, type 0, after the host's address.
    pub(crate) name: &'static [u8; 8],
    /// A speed, in the units of ROR, and what it is in those of the motion controller.
    pub(crate) speed: (i32, i32),
    /// A speed for stops at stalls, and the same in the motion controller's units.
    pub(crate) stalling: (i32, i32),
    /// The speed above which a motor stops at a stall (181).
    pub(crate) stop_on_stall: i32,
    /// Time until a motor turns at these speeds.
    pub(crate) ramp: Nanos,
    /// How the control protocol names the motion controllers.
    pub(crate) controller: &'static str,
    /// True if a controller tells that it was reset, so that it is set up when it answers again.
    pub(crate) set_up_again: bool,
    /// Time until the state of a switch can be read.
    pub(crate) switches: Nanos,
}

/// The task of an axis, what its world does to it meanwhile, where its rotor then stands, and its error flags
/// (parameter 207). The place of the rotor is known to a few microsteps, if at all.
pub(crate) type Task = (&'static [&'static str], Option<&'static str>, Option<i64>, i32);

impl Sister {
    fn axes(&self) -> i32 {
        self.product.spec().axes.into()
    }

    /// The module in a world, started.
    pub(crate) fn host(&self, world: &str) -> Host {
        Host::of(self.image, world)
    }

    /// The image starts, and answers on all links, each axis by its own number.
    pub(crate) fn boots_and_answers_on_all_links(&self) {
        assert_eq!(model((self.image.image)()), Ok(Some(Model::Tmcl(self.product))));
        let mut host = self.host("");
        assert_logged(&host.log(), &["info: module runs at address 1"]);
        assert_eq!((host.machine.core_clock(), host.bridges_on()), (168_000_000, true));
        host.plug_usb();
        for ask in [Host::ask, Host::ask_can, Host::ask_usb] {
            assert_eq!(ask(&mut host, "136, 1, 0, 0"), (OK, self.version));
            let speed = |axis| self.speed.0 + axis;
            for axis in 0..self.axes() {
                assert_eq!(ask(&mut host, &format!("SAP 4, {axis}, {}", speed(axis))).0, OK);
            }
            for axis in 0..self.axes() {
                assert_eq!(ask(&mut host, &format!("GAP 4, {axis}")), (OK, speed(axis)));
            }
            assert_eq!(ask(&mut host, &format!("ROR {}, 100", self.axes())).0, INVALID_VALUE);
        }
        assert_eq!(host.said_to(&telegram("136, 0, 0, 0"), 50 * MILLISECOND)[1..], *self.name);
    }

    /// All axes have tasks at the same time, and each rotor is where its own world says, up to `apart` microsteps. What
    /// their worlds do to them happens after `begun`. The virtual module does and shows the same.
    pub(crate) fn do_tasks_at_once(&self, tasks: &[Task], world: &str, begun: Nanos, apart: i64) {
        let (mut image, mut core) = (self.host(world), Bench::of_in_world(self.product, world));
        for line in tasks.iter().flat_map(|(lines, ..)| *lines) {
            assert_eq!(image.ok(line), core.ok(line), "{line}");
        }
        image.run(begun);
        core.run(begun);
        for line in tasks.iter().filter_map(|(_, met, ..)| *met) {
            image.control(line);
            core.control(line);
        }
        image.run(4 * SECOND);
        core.run(4 * SECOND);
        let rotors = image.rotors();
        for (axis, (lines, _, place, errors)) in tasks.iter().enumerate() {
            if let Some(place) = place {
                assert!((rotors[axis] - place).abs() <= apart, "{lines:?}: at {}, not at {place}", rotors[axis]);
            }
            assert_eq!(image.ok(&format!("GAP 3, {axis}")), 0, "{lines:?}");
            assert_eq!(image.ok(&format!("GAP 207, {axis}")), *errors, "{lines:?}");
        }
        image.assert_rest();
        for axis in 0..self.axes() {
            for parameter in [3, 8, 9, 10, 11, 208] {
                let line = format!("GAP {parameter}, {axis}");
                assert_eq!(image.ask(&line), core.ask(&line), "{line}");
            }
        }
    }

    /// With all motors turning, the one stops that is stalled.
    pub(crate) fn stops_each_axis_at_its_stall(&self) {
        let mut host = self.host("");
        let (speed, units) = self.stalling;
        for line in ["SAP 174, #, 1".into(), format!("SAP 181, #, {}", self.stop_on_stall), format!("ROR #, {speed}")] {
            host.each(&line);
        }
        host.run(self.ramp);
        let axes = self.product.spec().axes.into();
        let mut expected = vec![units; axes];
        for axis in 0..axes {
            assert_eq!(host.speeds(), expected);
            host.control(&format!("load 1 {axis}"));
            host.run(200 * MILLISECOND);
            expected[axis] = 0;
        }
        assert_eq!(host.speeds(), expected);
        assert_eq!(host.each("GAP 207, #"), vec![1; axes]);
    }

    /// Switches have pins that are no inputs: one that is pressed shows in its parameter of its axis alone.
    pub(crate) fn has_each_switch_at_its_pin(&self, host: &mut Host) {
        for axis in 0..self.axes() {
            for (switch, parameter) in [("home", 9), ("right", 10), ("left", 11)] {
                host.control(&format!("press {switch} {axis}"));
                host.run(self.switches);
                for number in [9, 10, 11] {
                    let shown = |other| i32::from(number == parameter && other == axis);
                    let pressed = (0..self.axes()).map(shown).collect::<Vec<_>>();
                    assert_eq!(host.each(&format!("GAP {number}, #")), pressed, "{switch} switch of axis {axis}");
                }
                assert_eq!(host.ok("GIO 255, 0"), 0);
                host.control(&format!("release {switch} {axis}"));
            }
        }
    }

    /// A motion controller that does not answer, from the start on or while all motors turn, and all drivers are off
    /// until the next start. The module answers, and moves nothing. But a controller that is set up again when it was
    /// reset is so after its power-on as well.
    pub(crate) fn switches_all_drivers_off(&self, silent: &[(u8, bool)]) {
        let trouble = |host: &mut Host| host.machine.board().world().outputs().leds[1];
        let (speed, units) = self.speed;
        let turn = format!("ROR #, {speed}");
        for (axis, from_the_start) in silent {
            let mut host = Host::just_on_of(self.image, "");
            if *from_the_start {
                host.control(&format!("fault {} on {axis}", self.controller));
            }
            host.run(START);
            if !from_the_start {
                host.each(&turn);
                host.run(self.ramp);
                assert_eq!((host.speed(), host.bridges_on()), (units, true));
                host.control(&format!("fault {} on {axis}", self.controller));
                let took = host.wait(MILLISECOND / 10, SECOND, |host| !host.bridges_on());
                assert!(took <= 6 * MILLISECOND, "{took}");
            }
            assert_eq!(host.ok("GGP 66, 0"), 1);
            assert_eq!((host.bridges_on(), trouble(&mut host)), (false, true), "axis {axis}");
            for other in 0..self.axes() {
                assert_eq!(host.ask(&format!("ROR {other}, 500")).0, NOT_AVAILABLE);
            }
            host.control(&format!("fault {} off {axis}", self.controller));
            host.run(SECOND);
            host.assert_rest();
            assert_eq!(host.bridges_on(), self.set_up_again && *from_the_start, "axis {axis}");
            if !host.bridges_on() {
                host.ok("255, 0, 0, 1234");
                host.run(RECOVERY);
            }
            host.each(&turn);
            host.run(self.ramp);
            assert_eq!((host.speed(), host.bridges_on(), trouble(&mut host)), (units, true, false), "axis {axis}");
        }
    }

    /// The image and the virtual module answer the same. All that can be read of the module and of each axis is read,
    /// the clock and random numbers left out. That is done before and after all `written` parameters of the axes get
    /// other values, which differ from axis to axis as far as their ranges allow. What is `refused` is asked as well.
    pub(crate) fn answers_like_the_virtual_module(&self, written: impl Fn(&Row) -> bool, refused: &[&str]) {
        let (mut image, mut core) = (self.host(""), Bench::of(self.product));
        image.plug_usb();
        let spec = self.product.spec();
        let global = spec.global.rows.iter().filter(|parameter| {
            !matches!(parameter.function, GlobalParameter::TickTimer | GlobalParameter::RandomNumber)
        });
        let mut reads: Vec<String> = global.map(|parameter| format!("GGP {}, 0", parameter.row.number)).collect();
        let rows = || spec.axis.rows.iter().map(|parameter| &parameter.row);
        reads.extend(rows().flat_map(|row| (0..=self.axes()).map(move |axis| format!("GAP {}, {axis}", row.number))));
        let writes = rows().filter(|row| row.writable() && written(row)).flat_map(|row| {
            (0..self.axes()).filter_map(move |axis| {
                let values = [row.default + axis + 1, row.default - axis - 1, row.default ^ 1];
                let value = values.into_iter().find(|value| row.accepts(*value))?;
                Some(format!("SAP {}, {axis}, {value}", row.number))
            })
        });
        let refused = refused.iter().map(ToString::to_string).collect();
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
}

/// Switches the supply off and on again, with the two pads connected meanwhile or not; gives what the module logs.
pub(crate) fn power_cycle(host: &mut Host, connected: bool) -> Vec<String> {
    host.machine.set_power(false);
    host.machine.wiring().connect_pads(connected);
    host.run(10 * MILLISECOND);
    host.machine.set_power(true);
    host.run(2 * START);
    host.log()
}
