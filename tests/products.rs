//! Tests of what a module stores, refuses and finds again, with products that have other numbers of axes, parameters
//! and EEPROMs than the TMCM-1140.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "common/products.rs"]
mod definitions;

use definitions::{OnBoard, THREE_AXIS, Three};
use hal_sim::board::{Board, SharedBoard};
use hal_sim::world::config::WorldConfig;
use std::task::Poll;
use tmcm::module::{Module, Source};
use tmcm::param::{COORDINATES, Parameter, STORED_USER_VARIABLES};
use tmcm::product::{Tmcm3110, Tmcm3212, Tmcm6110};
use tmcm::tmcl::{Opcode, Reply, Status, text};
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

/// A module of a product, and its EEPROM, whose writes take no time.
struct Rig<P: OnBoard, const AXES: usize, const N: usize> {
    module: Module<Simulated<(), P, N>, AXES>,
    eeprom: Vec<u8>,
}

type OfThree = Rig<Three, 3, 1>;
type OfSix = Rig<Tmcm6110, 6, 2>;

impl<P: OnBoard, const AXES: usize, const N: usize> Rig<P, AXES, N> {
    fn on(eeprom: Vec<u8>) -> Self {
        let board = SharedBoard::new(Board::of_kind(P::BOARD, &WorldConfig::default(), 1));
        let mut module = Module::new(parts(&board), (), 1);
        module.start(Micros(0), |store| {
            let read = |address: u16, page: &mut [u8]| {
                page.copy_from_slice(&eeprom[address.into()..][..page.len()]);
                Ok::<(), ()>(())
            };
            store.load(read).unwrap();
        });
        Rig { module, eeprom }
    }

    fn new() -> Self {
        Self::on(vec![0xFF; P::SIZE])
    }

    /// The module after a power cycle, with the same EEPROM.
    fn power_cycle(self) -> Self {
        Self::on(self.eeprom)
    }

    /// Executes a command and lets all page writes end; gives status and value.
    fn send(&mut self, line: &str) -> (u8, i32) {
        let mut outcome = self.module.execute(Micros(0), Source::Usb, text::parse(line).unwrap());
        while let Some(job) = self.module.store().next_job() {
            self.eeprom[job.address.into()..][..job.page.len()].copy_from_slice(&job.page);
            self.module.stored(true);
        }
        if outcome == Poll::Pending {
            outcome = Poll::Ready(self.module.next_reply().unwrap().reply);
        }
        match outcome {
            Poll::Ready(Some(Reply::Plain { status, value, .. })) => (status as u8, value),
            other => panic!("{line}: {other:?}"),
        }
    }

    fn ok(&mut self, line: &str) -> i32 {
        let (status, value) = self.send(line);
        assert_eq!(status, Status::Ok as u8, "{line}");
        value
    }
}

/// An accepted value of a parameter that is different for each axis, as far as the parameter's range allows.
fn another<F>(parameter: &Parameter<F>, axis: u8) -> i32 {
    let row = &parameter.row;
    let offset = i32::from(axis) + 1;
    let values = [row.default.wrapping_add(offset), row.default.wrapping_sub(offset), row.default ^ 1];
    values.into_iter().find(|value| row.accepts(*value)).unwrap()
}

/// Changes and stores every value that can be stored, and asserts that each is the same after a power cycle, so that
/// no two values share a slot.
fn everything_survives<P: OnBoard, const AXES: usize, const N: usize>() {
    let mut rig = Rig::<P, AXES, N>::new();
    let spec = P::SPEC;
    let mut expected = Vec::new();
    let axes = 0..spec.axes;
    for parameter in spec.global.rows.iter().filter(|parameter| parameter.row.stored()) {
        // Changing the serial address does no harm, because USB ignores it. Code protection gets the value 1, which
        // protects the program from being read but not from being changed.
        let (number, value) = (parameter.row.number, another(parameter, 0));
        rig.ok(&format!("SGP {number}, 0, {value}"));
        expected.push((format!("GGP {number}, 0"), value));
    }
    rig.ok("SGP 84, 0, 1");
    expected.retain(|(line, _)| line != "GGP 84, 0" && line != "GGP 85, 0");
    if spec.global.find(85).is_some() {
        rig.ok("SGP 85, 0, 0");
    }
    for axis in axes.clone() {
        for parameter in spec.axis.rows.iter().filter(|parameter| parameter.row.stored()) {
            let (number, value) = (parameter.row.number, another(parameter, axis));
            rig.ok(&format!("SAP {number}, {axis}, {value}"));
            rig.ok(&format!("STAP {number}, {axis}"));
            expected.push((format!("GAP {number}, {axis}"), value));
        }
        for number in 1..COORDINATES as i32 {
            let value = i32::from(axis) * 100_000 + number;
            rig.ok(&format!("SCO {number}, {axis}, {value}"));
            expected.push((format!("GCO {number}, {axis}"), value));
        }
    }
    if !spec.lacks.contains(&Opcode::Stgp) {
        for number in 0..STORED_USER_VARIABLES {
            rig.ok(&format!("SGP {number}, 2, {}", 7_000 + number));
            rig.ok(&format!("STGP {number}, 2"));
            expected.push((format!("GGP {number}, 2"), 7_000 + i32::try_from(number).unwrap()));
        }
    }
    let mut rig = rig.power_cycle();
    for (line, value) in expected {
        assert_eq!(rig.ok(&line), value, "{line}");
    }
}

#[test]
fn everything_that_can_be_stored_survives_on_three_axes() {
    everything_survives::<Three, 3, 1>();
}

#[test]
fn everything_that_can_be_stored_survives_on_six_axes() {
    everything_survives::<Tmcm6110, 6, 2>();
}

#[test]
fn everything_that_can_be_stored_survives_on_a_tmcm_3110() {
    everything_survives::<Tmcm3110, 3, 1>();
}

/// There is no axis parameter among it.
#[test]
fn everything_that_can_be_stored_survives_on_a_tmcm_3212() {
    everything_survives::<Tmcm3212, 3, 3>();
}

/// A fresh module has the defaults of its product's table, on every axis, before and after a factory reset.
#[test]
fn defaults_are_those_of_the_product() {
    let mut rig = OfThree::new();
    let defaults = |rig: &mut OfThree| {
        for axis in 0..3 {
            for parameter in THREE_AXIS.rows.iter().filter(|parameter| parameter.row.stored()) {
                let row = &parameter.row;
                assert_eq!(rig.ok(&format!("GAP {}, {axis}", row.number)), row.default, "{} {axis}", row.name);
            }
        }
    };
    defaults(&mut rig);
    rig.ok("SAP 4, 2, 77");
    rig.ok("STAP 4, 2");
    let mut rig = rig.power_cycle();
    assert_eq!(rig.ok("GAP 4, 2"), 77);
    tmcm::module::factory_reset(rig.module.store());
    // Storing one setting writes all pages that the reset has changed.
    rig.ok("SGP 66, 0, 9");
    let mut rig = rig.power_cycle();
    defaults(&mut rig);
}

#[test]
fn commands_and_parameters_that_a_product_lacks_are_refused() {
    let mut rig = OfThree::new();
    let wrong_type = Status::WrongType as u8;
    for line in
        ["GAP 6, 0", "SAP 7, 0, 1", "GAP 200, 2", "STAP 6, 1", "RSAP 6, 1", "GGP 79, 0", "SGP 67, 0, 1", "GIO 2, 0"]
    {
        assert_eq!(rig.send(line).0, wrong_type, "{line}");
    }
    for line in ["STGP 1, 2", "139, 0, 0, 0"] {
        assert_eq!(rig.send(line).0, Status::InvalidCommand as u8, "{line}");
    }
    for line in ["GAP 4, 3", "SAP 4, 3, 1", "STAP 4, 3", "MST 3", "SCO 1, 3, 1"] {
        assert_eq!(rig.send(line).0, Status::InvalidValue as u8, "{line}");
    }
}

/// Parameter 204 is the maximum current of one product and the freewheeling time of another.
#[test]
fn a_number_means_what_the_product_says() {
    let (mut three, mut six, mut sister) = (OfThree::new(), OfSix::new(), Rig::<Tmcm3110, 3, 1>::new());
    assert_eq!((three.ok("GAP 204, 1"), six.ok("GAP 204, 1")), (100, 0));
    assert_eq!((three.send("SAP 204, 1, 256").0, six.send("SAP 204, 1, 256").0), (Status::InvalidValue as u8, 100));
    assert_eq!((three.send("SAP 210, 0, 256").0, sister.send("SAP 210, 0, 256").0), (Status::InvalidValue as u8, 100));
    assert_eq!(six.send("SAP 210, 0, 256").0, Status::WrongType as u8);
}

/// Each axis has two interrupts for its stop switches, each input has one; their numbers follow from the number of the
/// first axis or input.
#[test]
fn interrupts_are_as_many_as_axes_and_inputs() {
    let (mut three, mut six) = (OfThree::new(), OfSix::new());
    let exist = |numbers: &[i32], last: i32| (0..=last).map(|number| numbers.contains(&number)).collect::<Vec<_>>();
    let found = |enable: &mut dyn FnMut(i32) -> u8| {
        (0..=64).map(|number| enable(number) == Status::Ok as u8).collect::<Vec<_>>()
    };
    let of_three = [0, 1, 2, 3, 4, 5, 15, 16, 17, 21, 22, 23, 27, 28, 29, 30, 31, 32, 39, 40];
    assert_eq!(found(&mut |number| three.send(&format!("EI {number}")).0), exist(&of_three, 64));
    let of_six: Vec<i32> = (0..9).chain(15..47).collect();
    assert_eq!(found(&mut |number| six.send(&format!("EI {number}")).0), exist(&of_six, 64));
    for number in (27..=38).chain(39..=46) {
        let value = number % 4;
        assert_eq!(six.ok(&format!("SGP {number}, 3, {value}")), value);
    }
    for number in (27..=38).chain(39..=46) {
        assert_eq!(six.ok(&format!("GGP {number}, 3")), number % 4, "{number}");
    }
    assert_eq!(three.send("GGP 33, 3").0, Status::WrongType as u8);
}

/// Program memory of another size than that of the TMCM-1140: addresses behind its end are refused.
#[test]
fn program_memory_has_the_size_of_the_product() {
    let (mut three, mut six) = (OfThree::new(), OfSix::new());
    assert_eq!((three.send("132, 0, 0, 6143").0, six.send("132, 0, 0, 2048").0), (100, Status::InvalidValue as u8));
    assert_eq!(three.send("ROR 0, 1").0, Status::Loaded as u8);
    assert_eq!(three.send("ROR 0, 2").0, Status::InvalidValue as u8);
    three.ok("133, 0, 0, 0");
    let mut three = three.power_cycle();
    assert_eq!(three.send("132, 0, 0, 6144").0, Status::InvalidValue as u8);
    let outcome = three.module.execute(Micros(0), Source::Usb, text::parse("134, 0, 0, 6143").unwrap());
    assert_eq!(outcome, Poll::Ready(Some(Reply::Memory(text::parse("ROR 0, 1").unwrap()))));
}
