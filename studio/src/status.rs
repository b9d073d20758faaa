//! Inputs, outputs and axes of a module, and what their readings mean, for the page.

use serde::{Deserialize, Serialize};
use tmcl_tools::failure::Failure;
use tmcl_tools::status::{self, Kind, Line, Port};

use crate::stop::known;
use crate::tools::Tools;
use crate::types::{Axes, Request};

/// The note on a module whose inputs and outputs are not known.
const UNKNOWN: &str =
    "which inputs and outputs this product has is not known here; GIO and SIO reach them in direct mode";

/// The inputs, outputs and axes that can be read of a module.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusRequests {
    /// The inputs and outputs of the module.
    pub inputs: Vec<StatusPort>,
    /// The axes of the module.
    pub axes: Vec<StatusAxis>,
    /// A note that the user has to know; null if there is none.
    pub note: Option<String>,
}

/// An input or an output.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusPort {
    /// The name of the input or output in the manual.
    pub name: String,
    /// The kind of the input or output.
    pub kind: Kind,
    /// The unit of its values; empty where there is none.
    pub unit: String,
    /// Whether it can be switched.
    pub switchable: bool,
    /// How it is read; null if it cannot be.
    pub request: Option<Request>,
    /// How it is switched; null if it cannot be.
    pub set: Option<StatusSwitch>,
}

/// The requests that switch something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusSwitch {
    /// Switches it on.
    pub on: Request,
    /// Switches it off.
    pub off: Request,
}

/// An axis, and what is read of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusAxis {
    /// The number of the axis.
    pub axis: u8,
    /// The requests whose values [`words`] takes.
    pub requests: Vec<Request>,
    /// Whether it keeps what has stopped its motor until that is read.
    pub latches: bool,
}

/// Values of an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusValues {
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// The number of the axis.
    pub axis: u8,
    /// The values of its requests, in their order; null where there is none.
    pub values: Vec<Option<i32>>,
}

/// The statements about an axis.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusLines {
    /// The statements.
    pub lines: Vec<Line>,
}

/// Values of inputs and outputs.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusRead {
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// The requests that were answered.
    pub requests: Vec<Request>,
    /// Their values, in their order; null where there is none.
    pub values: Vec<Option<i32>>,
}

/// Values of inputs and outputs as they are shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusReadings {
    /// The readings, one for each request, in their order.
    pub readings: Vec<StatusReading>,
}

/// A value of an input or an output as it is shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusReading {
    /// The value with its unit, or its meaning; empty if there is none.
    pub text: String,
    /// Whether it is on, of what is on or off; else null.
    pub on: Option<bool>,
}

/// An axis of a module.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StatusOf {
    /// The number of the axis.
    pub axis: u8,
}

/// The requests that read a module, and those that switch its outputs.
pub fn requests(Axes { address, product }: &Axes) -> StatusRequests {
    let product = known(product.as_deref());
    let at = |command| Request::new(*address, command);
    let port = |Port { name, kind, scale, read, switch }| StatusPort {
        name,
        kind,
        unit: scale.unit().into(),
        switchable: switch.is_some(),
        request: read.map(at),
        set: switch.map(|switch: status::Switch| StatusSwitch { on: at(switch.on), off: at(switch.off) }),
    };
    // Of an unknown product only the first axis is looked at.
    let axes = 0..product.map_or(1, |product| product.spec().axes);
    let axis = |axis| StatusAxis {
        axis,
        requests: status::requests(product, axis).into_iter().map(at).collect(),
        latches: status::latches(product),
    };
    StatusRequests {
        inputs: status::ports(product).into_iter().map(port).collect(),
        axes: axes.map(axis).collect(),
        note: product.is_none().then(|| UNKNOWN.into()),
    }
}

/// The statements about an axis.
pub fn words(StatusValues { product, axis, values }: &StatusValues) -> StatusLines {
    StatusLines { lines: status::words(known(product.as_deref()), *axis, values) }
}

/// Values of inputs and outputs as they are shown.
pub fn readings(StatusRead { product, requests, values }: &StatusRead) -> StatusReadings {
    let ports = status::ports(known(product.as_deref()));
    let reading = |(request, value): (&Request, &Option<i32>)| {
        let Some(value) = *value else { return StatusReading { text: String::new(), on: None } };
        match ports.iter().find(|port| port.read == Some(request.command())) {
            Some(Port { scale, .. }) => StatusReading { text: scale.text(value), on: scale.is_on(value) },
            None => StatusReading { text: value.to_string(), on: None },
        }
    };
    StatusReadings { readings: requests.iter().zip(values).map(reading).collect() }
}

impl Tools {
    /// Reads what has stopped the motor of an axis, which clears it.
    ///
    /// # Errors
    /// The module does not answer, or has no such axis.
    pub fn status_errors(&mut self, StatusOf { axis }: &StatusOf) -> Result<StatusLines, Failure> {
        let lines = status::read_latched(self.module(), *axis)?;
        Ok(StatusLines { lines })
    }
}

/// Examples of all types, with each alternative.
#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    use tmcl_tools::status::Severity;
    use tmcm::tmcl::Command;

    let request = Request::new(1, Command::new(14, 0, 2, 1));
    let switch = StatusSwitch { on: request, off: request };
    let port = |kind, request, set: Option<StatusSwitch>| {
        let (name, unit) = ("OUT0".into(), String::new());
        StatusPort { name, kind, unit, switchable: set.is_some(), request, set }
    };
    let ports = [
        port(Kind::Digital, Some(request), None),
        port(Kind::Switch, Some(request), None),
        port(Kind::Analog, Some(request), None),
        port(Kind::Measured, Some(request), None),
        port(Kind::Output, Some(request), Some(switch)),
        port(Kind::PullUps, None, Some(switch)),
    ];
    let axis = StatusAxis { axis: 0, requests: vec![request], latches: true };
    let line = |severity| Line { severity, words: "stands".into() };
    let lines = [Severity::Fine, Severity::Note, Severity::Warning, Severity::Error].map(line);
    let readings = [Some(true), None].map(|on| StatusReading { text: "on".into(), on });
    let mut examples = vec![
        ("StatusSwitch", json!(switch)),
        ("StatusAxis", json!(axis)),
        ("StatusOf", json!(StatusOf { axis: 0 })),
        ("StatusLines", json!(StatusLines { lines: lines.clone().into() })),
        ("StatusReadings", json!(StatusReadings { readings: readings.clone().into() })),
    ];
    examples.extend(ports.iter().flat_map(|port| [("StatusPort", json!(port)), ("StatusKind", json!(port.kind))]));
    examples
        .extend(lines.iter().flat_map(|line| [("StatusLine", json!(line)), ("StatusSeverity", json!(line.severity))]));
    examples.extend(readings.iter().map(|reading| ("StatusReading", json!(reading))));
    for product in [Some(String::from("1140")), None] {
        let note = product.is_none().then(|| UNKNOWN.into());
        let all = StatusRequests { inputs: ports.clone().into(), axes: vec![axis.clone()], note };
        let values = vec![Some(1), None];
        let read = StatusRead { product: product.clone(), requests: vec![request; 2], values: values.clone() };
        examples.push(("StatusRequests", json!(all)));
        examples.push(("StatusRead", json!(read)));
        examples.push(("StatusValues", json!(StatusValues { product, axis: 0, values })));
    }
    examples
}

#[cfg(test)]
mod tests {
    use tmcl_tools::status::Severity;
    use tmcm::tmcl::Command;

    use super::*;
    use crate::tools::tests::tools;

    fn of(product: Option<&str>) -> StatusRequests {
        requests(&Axes { address: 7, product: product.map(String::from) })
    }

    #[test]
    fn what_is_read_is_for_the_module_at_its_address() {
        let StatusRequests { inputs, axes, note } = of(Some("6110"));
        assert!(inputs.iter().filter_map(|port| port.request).all(|request| request.address == 7));
        assert_eq!((axes.len(), axes[5].axis, axes[5].latches, note), (6, 5, true, None));
        let output = inputs.iter().find(|port| port.kind == Kind::Output).unwrap();
        let set = output.set.unwrap();
        assert!(output.switchable && output.name == "OUT0");
        assert_eq!(
            (set.on.command().to_string(), set.off.command().to_string()),
            ("SIO 0, 2, 1".into(), "SIO 0, 2, 0".into())
        );
        let supply = inputs.iter().find(|port| port.kind == Kind::Measured).unwrap();
        assert_eq!((supply.unit.as_str(), supply.set), ("V", None));
        assert!(!of(Some("1110")).axes[0].latches);
    }

    #[test]
    fn of_an_unknown_product_there_is_one_axis_and_a_note() {
        let StatusRequests { inputs, axes, note } = of(None);
        assert_eq!((inputs, axes.len()), (vec![], 1));
        assert!(note.is_some_and(|note| note.contains("not known")));
    }

    #[test]
    fn values_are_told_with_their_units() {
        let gio = |port, bank| Request::new(1, Command::new(15, port, bank, 0));
        let requests = vec![gio(8, 1), gio(0, 2), gio(0, 1), gio(9, 1), gio(77, 0)];
        let values = vec![Some(241), Some(1), Some(302), None, Some(5)];
        let told = readings(&StatusRead { product: Some("1140".into()), requests, values }).readings;
        let told: Vec<_> = told.iter().map(|reading| (reading.text.as_str(), reading.on)).collect();
        assert_eq!(told, [("24.1 V", None), ("on", Some(true)), ("302 of 4095", None), ("", None), ("5", None)]);
    }

    #[test]
    fn an_axis_is_told_in_words() {
        let StatusRequests { axes, .. } = of(Some("1140"));
        let values =
            axes[0].requests.iter().map(|request| (request.command().to_string() == "GAP 208, 0").then_some(8));
        let told = words(&StatusValues { product: Some("1140".into()), axis: 0, values: values.collect() }).lines;
        assert_eq!(told.len(), 1);
        assert!(told[0].severity == Severity::Error && told[0].words.contains("short to ground at coil A"));
    }

    #[test]
    fn what_has_stopped_a_motor_is_read() {
        let mut tools = tools("1140");
        let told = tools.status_errors(&StatusOf { axis: 0 }).unwrap();
        assert_eq!(told.lines[0].severity, Severity::Fine);
        let refused = tools.status_errors(&StatusOf { axis: 1 }).unwrap_err().to_string();
        assert!(refused.contains("GAP 207, 1"), "{refused}");
    }
}
