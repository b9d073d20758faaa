//! Curves: what can be read again and again of a module, and how.
//!
//! A curve has a text, by which a user keeps it. The text is the command that reads the curve (`GAP 1, 0`), or the name
//! of a value of a virtual module's world (`rotor 2`).

use hal_sim::board::BoardKind;
use serde::{Deserialize, Serialize};
use tmcl_tools::product::{axis_number, numbers, parameter, speed_unit, symbol};
use tmcm::module::Spec;
use tmcm::param::{AxisParameter, GlobalParameter, Row};
use tmcm::tmcl::{Command, Opcode, text};
use tmcm_sim::Product;
use tmcm_sim::look::Look;
use tmcm_sim::native::may_peek;
use tmcm_sim::protocol::Quantity;
use tmcm_sim::wire::Reply;

use crate::stop::{axes, known};
use crate::types::{Outcome, Read, Request, Value};

/// Most curves at once.
pub const MOST: usize = 12;
/// The note on a parameter that is cleared by being read.
const CLEARS: &str = "reading it clears it";
/// The note on a value of a virtual module that is read by a telegram.
const OVER_THE_LINK: &str = "read by telegrams while time goes by itself, some 20 times a second; the other values of a \
                             virtual module are looked at each millisecond";
/// Digits behind the point of values of the world that are not whole.
const DIGITS: u8 = 3;

/// The module whose curves are wanted.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curves {
    /// The address of the module.
    pub address: u16,
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// Whether it is a virtual module, whose world can be seen.
    pub is_virtual: bool,
    /// The texts of the curves that are wanted.
    pub texts: Vec<String>,
}

/// Requests whose values are to be shown.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Shown {
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// Whether it is a virtual module, whose world can be seen.
    pub is_virtual: bool,
    /// The requests.
    pub requests: Vec<Request>,
}

/// Curves that there are.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Offers {
    /// The curves, one behind the other.
    pub curves: Vec<Curve>,
    /// The texts of those that are shown at first.
    pub usual: Vec<String>,
}

/// A curve.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Curve {
    /// The text of the curve.
    pub text: String,
    /// Under which heading it stands.
    pub group: String,
    /// The name of the curve.
    pub name: String,
    /// The unit of the values, which may be empty.
    pub unit: String,
    /// Number of digits behind the point.
    pub decimals: u8,
    /// A note that has to be known before the curve is read; empty if there is none.
    pub note: String,
    /// How a telegram reads it; null for a value of the world.
    pub request: Option<Request>,
    /// Whether a virtual module shows it at each of its milliseconds, without a telegram.
    pub looked_at: bool,
    /// Whether that is a look into the memory of the firmware's core: where a flash image runs, only telegrams read it.
    pub in_memory: bool,
}

/// The curves of a virtual module whose values make a row at each of its milliseconds.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Watched {
    /// The texts of the curves.
    pub texts: Vec<String>,
}

/// The value that a virtual module has to look at for a curve.
#[derive(Clone, Debug)]
pub enum Seen {
    /// A value of the world, or of the module's memory.
    As(Quantity),
    /// The speed of a motion controller, which is not in the unit of the product.
    Speed(Quantity),
}

/// All curves of a module.
pub fn offers(Curves { address, product, is_virtual, .. }: &Curves) -> Offers {
    let product = known(product.as_deref());
    let spec = numbers(product);
    let count = product.map_or(1, |product| axes(Some(product)));
    let mut curves = Vec::new();
    for axis in 0..count {
        let readable = spec.axis.rows.iter().map(|found| Command::new(Opcode::Gap as u8, found.row.number, axis, 0));
        curves.extend(readable);
    }
    curves.extend(spec.global.rows.iter().map(|found| Command::new(Opcode::Ggp as u8, found.row.number, 0, 0)));
    curves.extend((0..spec.inputs).map(|port| Command::new(Opcode::Gio as u8, port, 0, 0)));
    let analog = (0..8).filter(|port| spec.analog >> port & 1 != 0);
    curves.extend(analog.map(|port| Command::new(Opcode::Gio as u8, port, 1, 0)));
    let mut curves: Vec<Curve> =
        curves.into_iter().filter_map(|command| read(command, *address, product, *is_virtual)).collect();
    if let Some(product) = product.filter(|_| *is_virtual) {
        let kind = product.kind();
        curves.extend(worlds(kind));
    }
    let usual = [AxisParameter::ActualPosition, AxisParameter::ActualSpeed];
    let usual = usual.into_iter().filter_map(|parameter| axis_number(product, parameter));
    let usual = usual.map(|number| Command::new(Opcode::Gap as u8, number, 0, 0).to_string()).collect();
    Offers { curves, usual }
}

/// The curves that are wanted, of which a module has those that are given.
///
/// # Errors
/// There is no such curve.
pub fn curves(Curves { address, product, is_virtual, texts }: &Curves) -> Result<Vec<Curve>, String> {
    if texts.len() > MOST {
        return Err(format!("{} curves are too many: there are at most {MOST}", texts.len()));
    }
    let product = known(product.as_deref());
    let count = product.map_or(u8::MAX, |product| axes(Some(product)));
    let curve = |wanted: &String| {
        let none = || format!("'{wanted}' is no curve of this module");
        match text::parse(wanted) {
            Ok(Command { opcode, motor, .. }) if opcode == Opcode::Gap as u8 && motor >= count => {
                Err(format!("'{wanted}': this module has no axis {motor}, but axes 0 to {}", count.saturating_sub(1)))
            }
            Ok(command) => read(command, *address, product, *is_virtual).ok_or_else(none),
            Err(_) => {
                let product = product.filter(|_| *is_virtual).ok_or_else(none)?;
                Look::parse(wanted, product.kind()).map(|look| world(&look))
            }
        }
    };
    texts.iter().map(curve).collect()
}

/// Curves of requests, in their order. One that is none of those that are offered is read by telegrams.
pub fn of_requests(Shown { product, is_virtual, requests }: &Shown) -> Offers {
    let product = known(product.as_deref());
    let curve = |request: &Request| {
        let command = request.command();
        let looked_at = *is_virtual && product.is_some_and(|product| can_be_seen(command, product));
        read(command, request.address, product, *is_virtual).unwrap_or_else(|| Curve {
            text: command.to_string(),
            group: String::new(),
            name: command.to_string(),
            unit: String::new(),
            decimals: 0,
            note: String::new(),
            request: Some(*request),
            looked_at,
            in_memory: looked_at,
        })
    };
    Offers { curves: requests.iter().map(curve).collect(), usual: Vec::new() }
}

/// The value that a virtual module has to look at for a curve.
///
/// # Errors
/// It is read by telegrams alone, or there is no such curve.
pub fn seen(wanted: &str, product: Product) -> Result<Seen, String> {
    let kind = product.kind();
    let quantity = |text: &str| {
        let words: Vec<&str> = text.split_whitespace().collect();
        Quantity::leading(&words, kind).map(|(quantity, _)| quantity)
    };
    let Ok(command) = text::parse(wanted) else { return quantity(wanted).map(Seen::As) };
    match in_the_world(command, product.spec()) {
        Some(name) if name.starts_with("velocity") => quantity(&name).map(Seen::Speed),
        Some(name) => quantity(&name).map(Seen::As),
        None => quantity(wanted).map(Seen::As),
    }
}

/// The value of the world that a curve of a virtual module shows, by the name that scenarios and conditions have for
/// it; `None` if it is read otherwise.
pub fn in_the_world_named(wanted: &str, product: Product) -> Option<String> {
    let name = match text::parse(wanted) {
        Ok(command) => in_the_world(command, product.spec())?,
        Err(_) => wanted.into(),
    };
    Look::parse(&name, product.kind()).ok().map(|look| look.name())
}

/// The value of the world that is the same as what a command reads, where that costs the module a datagram to a chip,
/// or its inputs.
fn in_the_world(command: Command, spec: &Spec) -> Option<String> {
    let Command { kind, motor, .. } = command;
    match Opcode::from_number(command.opcode)? {
        Opcode::Gap => {
            let name = match spec.axis.find(kind)?.function {
                AxisParameter::ActualPosition => "position",
                AxisParameter::ActualSpeed => "velocity",
                AxisParameter::LeftSwitch => "switches.left",
                AxisParameter::RightSwitch => "switches.right",
                _ => return None,
            };
            Some(format!("{name} {motor}"))
        }
        Opcode::Gio if motor == 0 => Some(format!("inputs.{kind}")),
        _ => None,
    }
}

/// The value of a reply, if there is one.
pub fn value(Read { request, outcome }: &Read) -> Value {
    let Outcome::Reply(bytes) = outcome else { return Value { value: None } };
    let reply = bytes.first_chunk().map(|telegram| Reply::read(None, false, request.command(), telegram));
    Value { value: reply.filter(Reply::done).and_then(|reply| reply.value) }
}

/// The curve that a command reads.
fn read(command: Command, address: u16, product: Option<Product>, is_virtual: bool) -> Option<Curve> {
    let opcode = Opcode::from_number(command.opcode)?;
    let Command { kind, motor, .. } = command;
    let (group, name, unit) = match opcode {
        Opcode::Gap | Opcode::Ggp => {
            let spec = numbers(product);
            let named = parameter(spec, opcode, command);
            let group = if opcode == Opcode::Gap { format!("Axis {motor}") } else { "Global parameters".into() };
            let name = named.as_ref().map_or_else(|| command.to_string(), |named| named.name.clone());
            let name = if opcode == Opcode::Gap && spec.axes > 1 { format!("{name} {motor}") } else { name };
            (group, name, named.map_or("", |named| unit(named.row, product)))
        }
        Opcode::Gio if motor == 0 => ("Inputs".into(), format!("digital input {kind}"), ""),
        Opcode::Gio if motor == 1 => ("Inputs".into(), format!("analog input {kind}"), ""),
        _ => return None,
    };
    let spec = numbers(product);
    let is = |function| opcode == Opcode::Gap && spec.axis.find(kind).is_some_and(|found| found.function == function);
    let random = opcode == Opcode::Ggp
        && spec.global.find(kind).is_some_and(|found| found.function == GlobalParameter::RandomNumber);
    if random {
        return None;
    }
    let looked_at = is_virtual && product.is_some_and(|product| can_be_seen(command, product));
    let note = match (is(AxisParameter::ExtendedErrorFlags), is_virtual && !looked_at) {
        (true, _) => CLEARS,
        (_, true) => OVER_THE_LINK,
        _ => "",
    };
    Some(Curve {
        text: command.to_string(),
        group,
        name,
        unit: unit.into(),
        decimals: 0,
        note: note.into(),
        request: Some(Request::new(address, command)),
        looked_at,
        in_memory: looked_at && in_the_world(command, spec).is_none(),
    })
}

/// Whether a virtual module shows what a command reads without a telegram.
fn can_be_seen(command: Command, product: Product) -> bool {
    in_the_world(command, product.spec()).is_some() || may_peek(product.spec(), command).is_ok()
}

fn unit(row: &Row, product: Option<Product>) -> &'static str {
    let is_speed = product.is_some_and(|product| row.unit == speed_unit(product));
    match product {
        Some(product) if is_speed => symbol(speed_unit(product), false),
        _ => symbol(row.unit, false),
    }
}

/// The values of the world of a board, of each of its axes.
fn worlds(kind: &BoardKind) -> Vec<Curve> {
    let mut looks = Vec::new();
    for axis in 0.. {
        if kind.check_axis(axis).is_err() {
            break;
        }
        let of_axis = Look::all(kind).filter_map(|look| Look::named(&look.name(), Some(axis), kind).ok());
        looks.extend(of_axis);
    }
    looks.extend(Look::all(kind).filter(|look| Look::named(&look.name(), Some(0), kind).is_err()));
    looks.iter().map(world).collect()
}

fn world(look: &Look) -> Curve {
    let unit = look.unit();
    // What is told in whole numbers needs no digits behind a point.
    let whole = unit.starts_with("0 or 1") || unit.starts_with("0..1023") || unit.starts_with("0..4095");
    let decimals = if whole || unit.starts_with("1/") || unit.contains("steps") { 0 } else { DIGITS };
    Curve {
        text: look.name(),
        group: "World".into(),
        name: look.name(),
        unit: unit.into(),
        decimals,
        note: String::new(),
        request: None,
        looked_at: true,
        in_memory: false,
    }
}

/// The position and the speed of each axis, which are always shown. Of an unknown product only the first axis is looked
/// at.
pub fn axes_of(Curves { address, product, is_virtual, .. }: &Curves) -> Offers {
    let product = known(product.as_deref());
    let count = product.map_or(1, |product| axes(Some(product)));
    let shown = [AxisParameter::ActualPosition, AxisParameter::ActualSpeed];
    let numbers: Vec<u8> = shown.into_iter().filter_map(|parameter| axis_number(product, parameter)).collect();
    let commands = (0..count).flat_map(|axis| numbers.iter().map(move |number| (axis, *number)));
    let commands = commands.map(|(axis, number)| Command::new(Opcode::Gap as u8, number, axis, 0));
    let curves = commands.filter_map(|command| read(command, *address, product, *is_virtual)).collect();
    Offers { curves, usual: Vec::new() }
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;
    let request = Request::new(1, Command::new(6, 1, 0, 0));
    let curve = Curve {
        text: "GAP 1, 0".into(),
        group: "Axis 0".into(),
        name: "actual position".into(),
        unit: "microsteps".into(),
        decimals: 0,
        note: String::new(),
        request: Some(request),
        looked_at: true,
        in_memory: false,
    };
    let texts = vec!["GAP 1, 0".into()];
    let shown = Shown { product: None, is_virtual: false, requests: vec![request] };
    let wanted = Curves { address: 1, product: Some("1140".into()), is_virtual: true, texts: texts.clone() };
    vec![
        ("Shown", json!(shown)),
        ("Shown", json!(Shown { product: Some("1140".into()), ..shown })),
        ("Curves", json!(wanted)),
        ("Curves", json!(Curves { product: None, ..wanted })),
        ("Curve", json!(curve)),
        ("Curve", json!(Curve { request: None, ..curve.clone() })),
        ("Offers", json!(Offers { curves: vec![curve], usual: texts.clone() })),
        ("Watched", json!(Watched { texts })),
    ]
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Reply as Said, Status, binary};

    use super::*;

    fn wanted(product: Option<&str>, is_virtual: bool, texts: &[&str]) -> Curves {
        let texts = texts.iter().map(ToString::to_string).collect();
        Curves { address: 1, product: product.map(String::from), is_virtual, texts }
    }

    /// Each offer leads to the curve itself again, on every product.
    #[test]
    fn what_is_offered_is_there() {
        for product in Product::ALL {
            for is_virtual in [false, true] {
                let short = tmcl_tools::product::short(product);
                let Offers { curves: offered, usual } = offers(&wanted(Some(short), is_virtual, &[]));
                assert_eq!(usual, ["GAP 1, 0", "GAP 3, 0"]);
                assert!(offered.len() > 60, "{short}: {}", offered.len());
                for curve in &offered {
                    let again = curves(&wanted(Some(short), is_virtual, &[&curve.text])).unwrap();
                    assert_eq!(again.first(), Some(curve));
                    assert!(!curve.looked_at || is_virtual);
                    assert!(!curve.looked_at || seen(&curve.text, product).is_ok(), "{}", curve.text);
                }
            }
        }
    }

    #[test]
    fn curves_have_names_units_and_what_is_to_be_known() {
        let of = |texts: &[&str]| curves(&wanted(Some("3212"), true, texts)).unwrap();
        let all = of(&["GAP 3, 2", "GAP 207, 0", "rotor 2", "load 1", "GIO 1, 0", "GAP 2, 0", "GAP 4, 0"]);
        let names: Vec<_> =
            all.iter().map(|curve| (curve.name.as_str(), curve.unit.as_str(), curve.decimals)).collect();
        assert_eq!(names[0], ("actual speed 2", "pps", 0));
        assert_eq!(names[2], ("rotor 2", "1/256 full steps", 0));
        assert_eq!(names[3], ("load 1", "0..1, of the torque at full current", 3));
        assert_eq!(names[4], ("digital input 1", "", 0));
        assert_eq!((all[1].note.as_str(), all[1].looked_at), (CLEARS, false));
        assert_eq!(all.iter().position(|curve| curve.in_memory), Some(6));
        assert_eq!((all[5].note.as_str(), all[5].looked_at), (OVER_THE_LINK, false));
        let none = |product, is_virtual, text| curves(&wanted(product, is_virtual, &[text])).unwrap_err();
        assert_eq!(none(Some("1140"), false, "rotor"), "'rotor' is no curve of this module");
        assert_eq!(none(Some("1140"), true, "MST 0"), "'MST 0' is no curve of this module");
        assert!(none(Some("1140"), true, "roter").contains("did you mean 'rotor'?"));
        assert!(curves(&wanted(None, false, &["GAP 1, 0"; 13])).unwrap_err().contains("at most 12"));
        assert!(!curves(&wanted(None, false, &["GAP 1, 0"])).unwrap()[0].looked_at);
        let requests = [(13, 2), (6, 1)].map(|(opcode, kind)| Request::new(1, Command::new(opcode, kind, 0, 0))).into();
        let shown = of_requests(&Shown { product: Some("1140".into()), is_virtual: true, requests }).curves;
        assert_eq!(shown.iter().map(|curve| curve.looked_at).collect::<Vec<_>>(), [true, true]);
    }

    #[test]
    fn only_what_was_executed_has_a_value() {
        let request = Request::new(1, Command::new(6, 1, 0, 0));
        let read = |status, value| {
            let reply = binary::encode_reply(2, 1, &Said::Plain { status, opcode: 6, value });
            super::value(&Read { request, outcome: Outcome::Reply(reply.into()) }).value
        };
        assert_eq!((read(Status::Ok, -7), read(Status::InvalidValue, 0)), (Some(-7), None));
        assert_eq!(super::value(&Read { request, outcome: Outcome::NoReply(0) }).value, None);
    }
}
