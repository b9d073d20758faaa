//! Virtual modules of all products to which something happens, and what is said of it.

use std::time::Duration;

use hal_sim::control::Line as World;
use hal_sim::world::config::WorldConfig;
use tmcm_sim::NativeModule;

use super::*;
use crate::asm::{command, names};
use crate::conversation::Conversation;
use crate::product::Product;
use crate::stop::Never;
use crate::wire::VirtualWire;

struct Bench {
    product: Product,
    module: Conversation,
}

impl Bench {
    fn new(product: Product) -> Self {
        let module = NativeModule::of(product, &WorldConfig::default(), None, 1);
        Bench { product, module: Conversation::new(Box::new(VirtualWire::new(module)), 1, None, |_| ()) }
    }

    /// Changes the world by a line of the control port.
    fn world(&mut self, line: &str) {
        let module = self.module.simulated().unwrap();
        World::parse(line).unwrap().control.apply(&mut module.board().borrow_mut()).unwrap();
        self.wait(50);
    }

    fn send(&mut self, line: &str) {
        self.module.request(command(line, Some(self.product), &names(Some(self.product))).unwrap()).unwrap();
    }

    fn wait(&mut self, milliseconds: u64) {
        self.module.pause(Duration::from_millis(milliseconds), &Never);
    }

    /// The lines that there are to say of an axis: all of it has to be readable.
    fn lines(&mut self, axis: u8) -> Vec<Line> {
        let product = Some(self.product);
        let values: Vec<_> =
            requests(product, axis).into_iter().map(|command| Some(self.module.value(command).unwrap())).collect();
        words(product, axis, &values)
    }

    /// Fails unless there is this to say of an axis.
    fn says(&mut self, axis: u8, severity: Severity, words: &str) {
        let lines = self.lines(axis);
        assert!(
            lines.iter().any(|line| line.severity == severity && line.words.contains(words)),
            "{:?}: not '{words}', but {lines:#?}",
            self.product
        );
    }

    /// The value of a port in words, by its name and kind.
    fn reads(&mut self, name: &str, kind: Kind) -> String {
        let ports = ports(Some(self.product));
        let port = ports.iter().find(|port| port.name == name && port.kind == kind).unwrap();
        port.scale.text(self.module.value(port.read.unwrap()).unwrap())
    }
}

fn all() -> impl Iterator<Item = Bench> {
    Product::ALL.into_iter().map(Bench::new)
}

#[test]
fn every_port_can_be_read_and_switched() {
    for mut bench in all() {
        for Port { name, read, switch, scale, .. } in ports(Some(bench.product)) {
            if let Some(read) = read {
                bench.module.value(read).unwrap_or_else(|error| panic!("{:?} {name}: {error}", bench.product));
            }
            let Some(Switch { on, off }) = switch else { continue };
            for (command, text) in [(on, "on"), (off, "off")] {
                bench.module.request(command).unwrap();
                let told = read.map(|read| scale.text(bench.module.value(read).unwrap()));
                assert!(told.is_none_or(|told| told == text), "{name}");
            }
        }
    }
}

#[test]
fn inputs_are_told_in_words() {
    for mut bench in all() {
        let first = if bench.product == Product::Tmcm1110 { "AIN_0" } else { "IN0" };
        bench.world("analog 0 1000");
        let (reading, highest) = bench
            .reads(first, Kind::Analog)
            .split_once(" of ")
            .map(|(value, highest)| (value.parse::<i32>().unwrap(), highest.parse::<i32>().unwrap()))
            .unwrap();
        assert!((reading - 1000 * ((highest + 1) / 4096)).abs() < 16, "{reading} of {highest}");
        bench.world("input 0 1");
        assert_eq!(bench.reads(first, Kind::Digital), "high");
        bench.world("input 0 0");
        assert_eq!(bench.reads(first, Kind::Digital), "low");
        if bench.product != Product::Tmcm1110 {
            bench.world("supply 19.5");
            assert_eq!(bench.reads("supply voltage", Kind::Measured), "19.5 V");
            bench.world("temperature 41");
            assert_eq!(bench.reads("temperature", Kind::Measured), "41 degC");
        }
    }
}

#[test]
fn a_motor_that_moves_and_arrives_is_told() {
    for mut bench in all() {
        let last = bench.product.spec().axes - 1;
        bench.says(last, Severity::Fine, "at position: it stands at its target, 0 microsteps");
        bench.says(last, Severity::Fine, "driver: no error");
        bench.send(&format!("MVP ABS, {last}, 51200"));
        bench.wait(200);
        let unit = if bench.product == Product::Tmcm3212 { "pps; now at " } else { "int; now at " };
        bench.says(last, Severity::Fine, "moves right");
        bench.says(last, Severity::Fine, unit);
        bench.wait(20_000);
        bench.says(last, Severity::Fine, "at position: it stands at its target, 51200 microsteps");
        assert!(bench.lines(last).iter().all(|line| line.severity != Severity::Error));
    }
}

#[test]
fn a_switch_that_stops_the_motor_is_told() {
    for mut bench in all() {
        bench.send("SAP 13, 0, 0");
        bench.send("ROL 0, 500");
        bench.wait(500);
        bench.world("press left 0");
        bench.wait(500);
        let stops = "the left limit switch is closed: the motor does not turn left until it opens";
        bench.says(0, Severity::Warning, stops);
        assert_eq!(bench.reads("left limit switch of axis 0", Kind::Switch), "closed");
        bench.send("SAP 13, 0, 1");
        bench.says(0, Severity::Note, "the left limit switch is closed, and stops nothing (parameter 13 is 1)");
        bench.world("release left 0");
        bench.world("press right 0");
        bench.send("SAP 12, 0, 0");
        bench.says(0, Severity::Warning, "the right limit switch is closed");
    }
}

#[test]
fn a_reference_search_is_told() {
    for mut bench in all() {
        bench.send("SAP 193, 0, 1");
        bench.send("RFS START, 0");
        bench.wait(50);
        bench.says(0, Severity::Note, "homing: a reference search is under way");
        bench.send("RFS STOP, 0");
        bench.wait(2_000);
        assert!(!bench.lines(0).iter().any(|line| line.words.contains("homing")));
    }
}

#[test]
fn a_stall_is_told_until_it_is_read() {
    for mut bench in all() {
        let (speed, threshold) = if bench.product == Product::Tmcm3212 { (100_000, 20_000) } else { (1000, 200) };
        bench.send(&format!("SAP 181, 0, {threshold}"));
        bench.says(0, Severity::Fine, &format!("a stall above {threshold} "));
        bench.send(&format!("ROR 0, {speed}"));
        bench.wait(4_000);
        bench.says(0, Severity::Fine, "moves right, at ");
        bench.world("load 1 0");
        bench.wait(1_000);
        bench.says(0, Severity::Fine, "stands at ");
        let told = read_latched(&mut bench.module, 0).unwrap();
        if bench.product == Product::Tmcm1110 {
            assert_eq!((told[0].severity, latches(Some(bench.product))), (Severity::Note, false));
            assert!(told[0].words.starts_with("the TMCM-1110 has no extended error flags"), "{told:?}");
            continue;
        }
        assert!(told[0].words.starts_with("a stall has stopped the motor"), "{:?}: {told:?}", bench.product);
        let again = read_latched(&mut bench.module, 0).unwrap();
        assert_eq!(again[0].severity, Severity::Fine, "reading has cleared it");
    }
}

#[test]
fn faults_of_the_driver_are_told() {
    for mut bench in all() {
        let last = bench.product.spec().axes - 1;
        bench.send(&format!("ROR {last}, {}", if bench.product == Product::Tmcm3212 { 20_000 } else { 200 }));
        bench.wait(1_000);
        bench.world(&format!("fault open-a on {last}"));
        bench.wait(1_000);
        bench.says(last, Severity::Warning, "driver: open load at coil A");
        bench.world(&format!("fault open-a off {last}"));
        bench.wait(1_000);
        assert!(!bench.lines(last).iter().any(|line| line.words.contains("open load")), "{:?}", bench.product);
        bench.world(&format!("fault overtemperature on {last}"));
        bench.wait(500);
        bench.says(last, Severity::Error, "driver: over-temperature");
        bench.says(last, Severity::Fine, "stands at ");
        bench.world(&format!("fault overtemperature off {last}"));
        bench.wait(500);
        bench.says(last, Severity::Error, "the next motion command tries again");
        bench.send(&format!("ROR {last}, 100"));
        bench.wait(500);
        assert!(bench.lines(last).iter().all(|line| line.severity < Severity::Warning), "{:?}", bench.product);
        bench.world(&format!("fault short-b on {last}"));
        bench.wait(500);
        bench.says(last, Severity::Error, "driver: short to ground at coil B");
    }
}

#[test]
fn a_supply_that_is_too_low_locks_the_motors() {
    for mut bench in all().filter(|bench| bench.product != Product::Tmcm1110) {
        bench.world("supply 7.4");
        bench.says(0, Severity::Error, "locked: the supply is 7.4 V; no motor moves below 8.5 V");
        bench.world("supply 9.0");
        bench.says(0, Severity::Warning, "the supply is 9.0 V");
        bench.world("supply 24");
        assert!(bench.lines(0).iter().all(|line| !line.words.contains("supply")));
    }
}

#[test]
fn an_encoder_that_deviates_is_told() {
    let mut bench = Bench::new(Product::Tmcm1140);
    bench.send("SAP 212, 0, 2000");
    bench.says(0, Severity::Fine, "the encoder is 0 from the position; more than 2000 stops the motor");
    bench.world("slip 40 0");
    bench.says(0, Severity::Error, "the encoder is ");
    let told = read_latched(&mut bench.module, 0).unwrap();
    assert!(told[0].words.contains("an encoder deviated"), "{told:?}");
}

/// Speeds of a TMCM-3212 are in the unit that its unit mode says.
#[test]
fn speeds_have_the_unit_in_force() {
    let mut bench = Bench::new(Product::Tmcm3212);
    bench.send("SAP 255, 0, 0");
    bench.send("ROR 0, 50000");
    bench.wait(500);
    bench.says(0, Severity::Fine, " chip; now at ");
}

#[test]
fn what_was_not_answered_is_left_out() {
    for product in Product::ALL.map(Some).into_iter().chain([None]) {
        let count = requests(product, 0).len();
        let nothing = words(product, 0, &vec![None; count]);
        assert_eq!(nothing, words(product, 0, &[]));
        assert_eq!(nothing[0].words, "nothing of this axis has been read");
        for only in 0..count {
            let values: Vec<_> = (0..count).map(|at| (at == only).then_some(i32::MIN)).collect();
            assert!(!words(product, 0, &values).is_empty());
        }
    }
}
