//! The inputs and outputs of a product.

use serde::{Deserialize, Serialize};
use tmcm::module::Spec;
use tmcm::module::ports::{ANALOG, INPUTS, OUTPUTS, Signal};
use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};

use super::scale::Scale;
use crate::product::Product;

/// The port of SIO, in the bank of the inputs, that switches the pull-up resistors.
const PULL_UPS: u8 = 0;
/// The switches of an axis.
const SWITCHES: [AxisParameter; 3] = [AxisParameter::LeftSwitch, AxisParameter::RightSwitch, AxisParameter::HomeSwitch];

/// The kind of a module's inputs and outputs that something is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// A digital input.
    Digital,
    /// A limit or home switch of an axis.
    Switch,
    /// An analog input.
    Analog,
    /// Something that the module measures of itself.
    Measured,
    /// A digital output.
    Output,
    /// Pull-up resistors, which cannot be read back.
    PullUps,
}

/// The commands that switch something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Switch {
    /// Switches it on.
    pub on: Command,
    /// Switches it off.
    pub off: Command,
}

/// An input or an output.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Port {
    /// The name of the port in the manual.
    pub name: String,
    /// The kind of the port.
    pub kind: Kind,
    /// The meaning of its value.
    pub scale: Scale,
    /// How it is read; `None` if it cannot be.
    pub read: Option<Command>,
    /// How it is switched; `None` if it cannot be.
    pub switch: Option<Switch>,
}

/// The names of a product's lines in its manual.
struct Names {
    /// The names of the digital inputs; the analog ones among them have the same.
    inputs: &'static [&'static str],
    /// The names of the outputs.
    outputs: &'static [&'static str],
}

/// The names of the TMCM-1110 (its manual, sections 4.5.14 and 4.5.15), which are others than those of its sisters.
const OF_1110: Names = Names {
    inputs: &["AIN_0", "PWMD0", "PWMD1", "PWMD2"],
    outputs: &["OpenDrain_1", "OpenDrain_2", "PWMU0", "PWMU1", "PWMU2"],
};
/// No names of its own: those of all others, IN0 and OUT0.
const USUAL: Names = Names { inputs: &[], outputs: &[] };

impl Names {
    fn of(product: Product) -> Self {
        if product == Product::Tmcm1110 { OF_1110 } else { USUAL }
    }

    fn input(&self, port: u8) -> String {
        self.inputs.get(usize::from(port)).map_or_else(|| format!("IN{port}"), ToString::to_string)
    }

    fn output(&self, port: u8) -> String {
        self.outputs.get(usize::from(port)).map_or_else(|| format!("OUT{port}"), ToString::to_string)
    }
}

/// All inputs and outputs of a product. What those of an unknown one are is not known: it has none here.
pub fn ports(product: Option<Product>) -> Vec<Port> {
    let Some(product) = product else { return Vec::new() };
    let (spec, names) = (product.spec(), Names::of(product));
    let inputs = (0..spec.inputs).map(|port| read(names.input(port), Kind::Digital, Scale::Level, (INPUTS, port)));
    let outputs = (0..spec.outputs).map(|port| Port {
        switch: Some(switch(OUTPUTS, port, 1)),
        ..read(names.output(port), Kind::Output, Scale::OnOff, (OUTPUTS, port))
    });
    let channels = (0..8).filter(|port| spec.analog & (1 << port) != 0);
    let highest = highest(spec.analog_bits);
    let analog = channels.map(|port| read(names.input(port), Kind::Analog, Scale::Counts(highest), (ANALOG, port)));
    let signals = spec.signals.iter().map(|signal| of_signal(*signal, highest));
    let mut ports: Vec<Port> = inputs.chain(analog).chain(signals).collect();
    ports.extend(switches(spec));
    ports.extend(outputs);
    ports.extend(pull_ups(spec));
    ports
}

/// The highest value of so many bits.
fn highest(bits: u8) -> i32 {
    1_i32.unbounded_shl(bits.into()).wrapping_sub(1)
}

fn read(name: String, kind: Kind, scale: Scale, (bank, port): (u8, u8)) -> Port {
    let read = Some(Command::new(Opcode::Gio as u8, port, bank, 0));
    Port { name, kind, scale, read, switch: None }
}

fn switch(bank: u8, port: u8, on: i32) -> Switch {
    let set = |value| Command::new(Opcode::Sio as u8, port, bank, value);
    Switch { on: set(on), off: set(0) }
}

fn of_signal(signal: Signal, highest: i32) -> Port {
    let (name, kind, scale) = match signal {
        Signal::Supply => ("supply voltage", Kind::Measured, Scale::Tenths),
        Signal::Temperature => ("temperature", Kind::Measured, Scale::Celsius),
        Signal::SupplyReading => ("ADC7 (+VS)", Kind::Analog, Scale::Counts(highest)),
        Signal::LogicSupplyReading => ("ADC6 (+5V)", Kind::Analog, Scale::Counts(highest)),
        Signal::Enable => ("ENABLE", Kind::Digital, Scale::Level),
        Signal::EncoderZero => ("sensOstep encoder", Kind::Digital, Scale::AtZero),
    };
    read(name.into(), kind, scale, signal.place())
}

/// The switches of all axes, which are read as axis parameters, by the names that these have.
fn switches(spec: &'static Spec) -> impl Iterator<Item = Port> {
    let of_axis = move |axis| {
        SWITCHES.into_iter().filter_map(move |switch| {
            let row = spec.axis.row(switch)?;
            Some(Port {
                name: format!("{} of axis {axis}", row.name.trim_end_matches(" state")),
                kind: Kind::Switch,
                scale: Scale::Contact,
                read: Some(Command::new(Opcode::Gap as u8, row.number, axis, 0)),
                switch: None,
            })
        })
    };
    (0..spec.axes).flat_map(of_axis)
}

/// The pull-up resistors, all groups at once: one value of SIO is for all of them.
fn pull_ups(spec: &Spec) -> Option<Port> {
    (spec.pull_ups > 0).then(|| Port {
        name: "pull-up resistors of the switches".into(),
        kind: Kind::PullUps,
        scale: Scale::OnOff,
        read: None,
        switch: Some(switch(INPUTS, PULL_UPS, highest(spec.pull_ups))),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The names of the ports of a kind, each with the command that reads it.
    fn told(product: Product, kind: Kind) -> Vec<String> {
        let ports = ports(Some(product)).into_iter().filter(|port| port.kind == kind);
        ports.map(|Port { name, read, .. }| format!("{name}: {}", read.unwrap())).collect()
    }

    /// The tables of the manual of the TMCM-1140, sections 3.7.14 and 3.7.15.
    #[test]
    fn ports_are_those_of_the_manual() {
        use Product::{Tmcm1110, Tmcm1140, Tmcm3212, Tmcm6110};
        assert_eq!(
            told(Tmcm1140, Kind::Digital),
            ["IN0: GIO 0, 0", "IN1: GIO 1, 0", "IN2: GIO 2, 0", "IN3: GIO 3, 0", "sensOstep encoder: GIO 11, 0"]
        );
        assert_eq!(told(Tmcm1140, Kind::Analog), ["IN0: GIO 0, 1"]);
        assert_eq!(told(Tmcm1140, Kind::Measured), ["supply voltage: GIO 8, 1", "temperature: GIO 9, 1"]);
        assert_eq!(told(Tmcm1140, Kind::Output), ["OUT0: GIO 0, 2", "OUT1: GIO 1, 2"]);
        // The manual of the TMCM-1110, section 4.5.15.
        assert_eq!(
            told(Tmcm1110, Kind::Digital),
            ["AIN_0: GIO 0, 0", "PWMD0: GIO 1, 0", "PWMD1: GIO 2, 0", "PWMD2: GIO 3, 0"]
        );
        assert_eq!(told(Tmcm1110, Kind::Analog), ["AIN_0: GIO 0, 1", "ADC7 (+VS): GIO 1, 1", "ADC6 (+5V): GIO 2, 1"]);
        assert_eq!(told(Tmcm1110, Kind::Output)[4], "PWMU2: GIO 4, 2");
        assert_eq!(told(Tmcm3212, Kind::Digital)[4], "ENABLE: GIO 10, 0");
        assert_eq!((told(Tmcm3212, Kind::Analog).len(), told(Tmcm3212, Kind::Output).len()), (4, 4));
        assert_eq!(told(Tmcm6110, Kind::Analog), ["IN0: GIO 0, 1", "IN4: GIO 4, 1"]);
        assert_eq!(told(Tmcm6110, Kind::Digital).len(), 8);
    }

    #[test]
    fn each_axis_has_its_switches() {
        assert_eq!(
            told(Product::Tmcm1140, Kind::Switch),
            [
                "left limit switch of axis 0: GAP 11, 0",
                "right limit switch of axis 0: GAP 10, 0",
                "home switch of axis 0: GAP 9, 0"
            ]
        );
        assert_eq!(told(Product::Tmcm6110, Kind::Switch).len(), 18);
    }

    #[test]
    fn outputs_and_pull_ups_are_switched() {
        let switched = |product, kind| {
            let ports = ports(Some(product)).into_iter().filter(move |port| port.kind == kind);
            let switches: Vec<_> = ports.filter_map(|port| port.switch).collect();
            switches.iter().map(|switch| format!("{}; {}", switch.on, switch.off)).collect::<Vec<_>>()
        };
        assert_eq!(switched(Product::Tmcm1140, Kind::Output), ["SIO 0, 2, 1; SIO 0, 2, 0", "SIO 1, 2, 1; SIO 1, 2, 0"]);
        assert_eq!(switched(Product::Tmcm1140, Kind::PullUps), ["SIO 0, 0, 1; SIO 0, 0, 0"]);
        assert_eq!(switched(Product::Tmcm6110, Kind::PullUps), ["SIO 0, 0, 3; SIO 0, 0, 0"]);
        assert_eq!(switched(Product::Tmcm3212, Kind::PullUps), [""; 0]);
        assert_eq!(switched(Product::Tmcm1140, Kind::Digital), [""; 0]);
    }

    #[test]
    fn of_an_unknown_product_nothing_is_known() {
        assert_eq!(ports(None), []);
    }

    #[test]
    fn full_scale_is_that_of_the_product() {
        let scale = |product| ports(Some(product)).into_iter().find(|port| port.kind == Kind::Analog).unwrap().scale;
        assert_eq!(scale(Product::Tmcm1140), Scale::Counts(4095));
        assert_eq!(scale(Product::Tmcm3212), Scale::Counts(65_535));
    }
}
