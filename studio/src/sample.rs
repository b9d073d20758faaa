//! Values that are read again and again: where each axis is, and how fast.

use tmcl_tools::product::{axis_number, speed_unit, symbol};
use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::wire::Reply;

use crate::stop::{axes, known};
use crate::types::{Axes, Column, Columns, Outcome, Read, Request, Value};

/// The position and the speed of each axis. Of an unknown product only the first axis is looked at.
pub fn columns(Axes { address, product }: &Axes) -> Columns {
    let product = known(product.as_deref());
    let count = product.map_or(1, |product| axes(Some(product)));
    let column = |axis, name: &str, parameter, unit: &str| {
        let number = axis_number(product, parameter).unwrap_or_default();
        let request = Request::new(*address, Command::new(Opcode::Gap as u8, number, axis, 0));
        Column { name: format!("{name} {axis}"), unit: unit.into(), request }
    };
    let speed = product.map_or("", |product| symbol(speed_unit(product), false));
    let both = |axis| {
        let position = column(axis, "position", AxisParameter::ActualPosition, "");
        [position, column(axis, "speed", AxisParameter::ActualSpeed, speed)]
    };
    Columns { columns: (0..count).flat_map(both).collect() }
}

/// The value of a reply, if there is one.
pub fn value(Read { request, outcome }: &Read) -> Value {
    let Outcome::Reply(bytes) = outcome else { return Value { value: None } };
    let reply = bytes.first_chunk().map(|telegram| Reply::read(None, false, request.command(), telegram));
    Value { value: reply.filter(Reply::done).and_then(|reply| reply.value) }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::{Reply as Said, Status, binary};

    use super::*;

    #[test]
    fn each_axis_has_two_columns() {
        let names = |product: Option<&str>| {
            let axes = Axes { address: 1, product: product.map(String::from) };
            columns(&axes)
                .columns
                .iter()
                .map(|column| format!("{}: {}", column.name, column.request.command()))
                .collect()
        };
        let one: Vec<String> = names(Some("1140"));
        assert_eq!(one, ["position 0: GAP 1, 0", "speed 0: GAP 3, 0"]);
        assert_eq!((names(Some("6110")).len(), names(None).len()), (12, 2));
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
