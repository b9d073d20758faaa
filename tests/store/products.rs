//! Tests of what a module stores, refuses and finds again, with products that have other numbers of axes, parameters
//! and EEPROMs than the TMCM-1140.

use common::products::{OnBoard, THREE_AXIS, Three};
use hal_sim::board::{Board, SharedBoard};
use hal_sim::world::config::WorldConfig;
use std::task::Poll;
use tmcm::module::{Module, Source};
use tmcm::param::{COORDINATES, Parameter, Row, STORED_USER_VARIABLES};
use tmcm::product::{Tmcm1110, Tmcm3110, Tmcm3212, Tmcm6110};
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

/// Numbers of the global parameters that have tests of their own: they keep other values from being stored, or from
/// being the same after a power cycle.
const OF_THE_EEPROM: [u8; 2] = [64, 73];

/// Changes and stores every value that can be stored, and asserts that each is the same after a power cycle, so that
/// no two values share a slot.
fn everything_survives<P: OnBoard, const AXES: usize, const N: usize>() {
    let mut rig = Rig::<P, AXES, N>::new();
    let spec = P::SPEC;
    let mut expected = Vec::new();
    let axes = 0..spec.axes;
    let kept = |row: &Row| row.stored() && !OF_THE_EEPROM.contains(&row.number);
    for parameter in spec.global.rows.iter().filter(|parameter| kept(&parameter.row)) {
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

#[test]
fn everything_that_can_be_stored_survives_on_a_tmcm_1110() {
    everything_survives::<Tmcm1110, 1, 1>();
}

/// No axis parameter is among what can be stored.
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

/// The TMCM-1110 lacks what is newer than its manual, ASCII mode, and the axes whose drivers are other boards.
#[test]
fn what_is_newer_than_the_manual_of_a_tmcm_1110_is_refused() {
    let mut rig = Rig::<Tmcm1110, 1, 1>::new();
    let numbers = [14, 150, 200, 201, 207, 213, 215, 216, 217, 218];
    let lines = numbers.iter().map(|number| format!("GAP {number}, 0"));
    let lines = lines.chain([67, 78, 87, 90, 255].iter().map(|number| format!("GGP {number}, 0")));
    let lines = lines.chain([4, 5, 16, 22, 29, 32, 43].iter().map(|number| format!("EI {number}")));
    let others =
        ["SGP 133, 0, 1", "SIO 0, 0, 1", "SIO 5, 2, 1", "GIO 4, 0", "GIO 3, 1", "GIO 8, 1", "GIO 9, 1", "GIO 5, 2"];
    for line in lines.chain(others.map(String::from)) {
        assert_eq!(rig.send(&line).0, Status::WrongType as u8, "{line}");
    }
    for line in
        ["SAP 193, 0, 129", "SAP 167, 0, 1", "SAP 164, 0, 4", "GAP 1, 1", "ROR 1, 1", "MST 2", "MVP COORD, 66, 1"]
    {
        assert_eq!(rig.send(line).0, Status::InvalidValue as u8, "{line}");
    }
    assert_eq!(rig.send("139, 0, 0, 0").0, Status::InvalidCommand as u8);
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

/// An EEPROM that is locked (73) keeps what it has, and is read as ever; direct and by every command that stores. The
/// lock itself survives a power cycle, until the other number opens it.
#[test]
fn a_locked_eeprom_stores_nothing() {
    const LOCKED: u8 = Status::EepromLocked as u8;
    let mut rig = Rig::<Tmcm1110, 1, 1>::new();
    for line in ["SAP 4, 0, 500", "STAP 4, 0", "SGP 5, 2, 50", "STGP 5, 2", "SGP 84, 0, 1", "SCO 3, 0, 300"] {
        rig.ok(line);
    }
    for (line, value) in
        [("SGP 73, 0, 1233", 0), ("SGP 73, 0, 4321", 0), ("SGP 73, 0, 1234", 1), ("SGP 73, 0, 1235", 1)]
    {
        rig.send(line);
        assert_eq!(rig.ok("GGP 73, 0"), value, "{line}");
    }
    for _ in 0..2 {
        rig.ok("SAP 4, 0, 600");
        rig.ok("SGP 5, 2, 60");
        let before = rig.eeprom.clone();
        let stores = [
            "STAP 4, 0",
            "STGP 5, 2",
            "SGP 76, 0, 9",
            "SGP 64, 0, 0",
            "SGP 81, 0, 1",
            "SCO 3, 0, 4",
            "CCO 3, 0",
            "SCO 3, 255, 0",
        ];
        for line in stores {
            assert_eq!(rig.send(line).0, LOCKED, "{line}");
        }
        assert!(rig.eeprom == before, "something was stored");
        assert_eq!(
            (rig.ok("GGP 76, 0"), rig.ok("GGP 64, 0"), rig.ok("GGP 81, 0"), rig.ok("GCO 3, 0")),
            (2, 228, 0, 300)
        );
        for line in ["RSAP 4, 0", "RSGP 5, 2", "GCO 3, 255"] {
            rig.ok(line);
        }
        assert_eq!((rig.ok("GAP 4, 0"), rig.ok("GGP 5, 2"), rig.ok("GCO 3, 0")), (500, 50, 300));
        rig = rig.power_cycle();
        assert_eq!((rig.ok("GGP 73, 0"), rig.ok("GAP 4, 0")), (1, 500));
    }
    rig.ok("SGP 73, 0, 4321");
    rig.ok("SGP 76, 0, 9");
    let mut rig = rig.power_cycle();
    assert_eq!((rig.ok("GGP 73, 0"), rig.ok("GGP 76, 0")), (0, 9));
    // What the parameter reads can be written to it: saved settings can be restored.
    for value in [1, 0] {
        rig.ok(&format!("SGP 73, 0, {value}"));
        assert_eq!(rig.ok("GGP 73, 0"), value);
    }
}

/// Another magic number (64) makes the next start one with factory defaults; until then all settings stay in force.
#[test]
fn another_magic_number_brings_the_factory_defaults_back() {
    let mut rig = Rig::<Tmcm1110, 1, 1>::new();
    for line in ["SAP 4, 0, 500", "STAP 4, 0", "SGP 5, 2, 50", "STGP 5, 2", "SGP 76, 0, 9", "SGP 64, 0, 228"] {
        rig.ok(line);
    }
    let mut rig = rig.power_cycle();
    assert_eq!((rig.ok("GAP 4, 0"), rig.ok("GGP 5, 2"), rig.ok("GGP 76, 0")), (500, 50, 9));
    rig.ok("SGP 64, 0, 229");
    rig.ok("SGP 77, 0, 1");
    assert_eq!((rig.ok("GGP 64, 0"), rig.ok("GGP 76, 0"), rig.ok("GAP 4, 0")), (229, 9, 500));
    for _ in 0..2 {
        rig = rig.power_cycle();
        let found = ["GGP 64, 0", "GAP 4, 0", "GGP 5, 2", "GGP 76, 0", "GGP 77, 0"].map(|line| rig.ok(line));
        assert_eq!(found, [228, 1000, 0, 2, 0]);
    }
    rig.ok("SGP 76, 0, 7");
    assert_eq!(rig.power_cycle().ok("GGP 76, 0"), 7);
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
