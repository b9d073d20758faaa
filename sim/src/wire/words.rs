//! Replies in words: the value with its unit and name, and the status.

use tmcm::param::Unit;
use tmcm::tmcl::binary::Telegram;
use tmcm::tmcl::{Command, Opcode};

use super::names::{parameter, speed_unit, with_unit};
use super::reply::{Reply, TENTHS};
use crate::native::Product;

/// Bank of the user variables, which have no names.
const VARIABLES: u8 = 2;

/// The meaning of a reply.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Meaning {
    /// The reply in words, one line.
    pub text: String,
    /// True if the command has been executed.
    pub done: bool,
}

/// True for a command about a parameter, or a speed, whose name and unit are in the tables of the product.
pub fn needs_names(command: Command) -> bool {
    match Opcode::from_number(command.opcode) {
        Some(Opcode::Ror | Opcode::Rol) => true,
        Some(Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Stap | Opcode::Rsap) => true,
        Some(Opcode::Ggp | Opcode::Sgp | Opcode::Agp | Opcode::Stgp | Opcode::Rsgp) => command.motor != VARIABLES,
        _ => false,
    }
}

/// True for a command about a speed or an acceleration of a product that has these in pps and pps2, or in units of its
/// chip.
pub fn depends_on_unit_mode(product: Option<Product>, command: Command) -> bool {
    let (Some(product), Some(opcode)) = (product, Opcode::from_number(command.opcode)) else { return false };
    let unit = match opcode {
        Opcode::Ror | Opcode::Rol => Some(speed_unit(product)),
        _ => parameter(product.spec(), opcode, command).map(|parameter| parameter.row.unit),
    };
    matches!(unit, Some(Unit::Pps | Unit::Pps2))
}

/// The meaning of a reply to `command` from a module of this product, as [`Reply::read`] has it.
pub fn meaning(product: Option<Product>, in_chip: bool, command: Command, reply: &Telegram) -> Meaning {
    Meaning::from(&Reply::read(product, in_chip, command, reply))
}

impl From<&Reply> for Meaning {
    fn from(reply: &Reply) -> Self {
        let what = if reply.done() { what(reply) } else { String::new() };
        let status = reply.status.zip(reply.meaning).map(|(status, meaning)| format!("status {status} {meaning}"));
        let error = reply.error.as_ref().map(|error| match status {
            Some(_) => format!("but {error}"),
            None => error.clone(),
        });
        let parts = [Some(what).filter(|what| !what.is_empty()), status, error];
        Meaning { text: parts.into_iter().flatten().collect::<Vec<_>>().join(", "), done: reply.done() }
    }
}

impl From<Option<&Reply>> for Meaning {
    fn from(reply: Option<&Reply>) -> Self {
        match reply {
            Some(reply) => Meaning::from(reply),
            None => Meaning { text: "no reply, as it should be".into(), done: true },
        }
    }
}

/// The value of a reply with its unit and name; empty where the value has no meaning.
fn what(reply: &Reply) -> String {
    if let Some(text) = &reply.text {
        return text.clone();
    }
    let value = reply.value.map(|value| match reply.unit {
        TENTHS => format!("{}.{} V", value / 10, (value % 10).abs()),
        unit => with_unit(value, unit),
    });
    match (value, &reply.name) {
        (Some(value), Some(name)) => format!("{value} ({name})"),
        (None, Some(name)) => name.clone(),
        (value, None) => value.unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::{self, Status, binary, text};

    const KNOWN: Option<Product> = Some(Product::Tmcm1140);

    fn in_words(line: &str, status: Status, value: i32) -> String {
        let command = text::parse(line).unwrap();
        let reply = binary::encode_reply(2, 1, &tmcl::Reply::Plain { status, opcode: command.opcode, value });
        meaning(KNOWN, false, command, &reply).text
    }

    #[test]
    fn values_have_units_and_names() {
        assert_eq!(in_words("GAP 4, 0", Status::Ok, 1000), "1000 int (maximum positioning speed), status 100 ok");
        assert_eq!(in_words("GAP 1, 0", Status::Ok, -7), "-7 microsteps (actual position), status 100 ok");
        assert_eq!(in_words("GGP 66, 0", Status::Ok, 1), "1 (serial address), status 100 ok");
        assert_eq!(in_words("GGP 0, 3", Status::Ok, 5), "5 ms (timer 0 period), status 100 ok");
        assert_eq!(in_words("GGP 9, 2", Status::Ok, 5), "5, status 100 ok");
        assert_eq!(in_words("GIO 8, 1", Status::Ok, 241), "24.1 V (supply), status 100 ok");
        assert_eq!(in_words("GIO 9, 1", Status::Ok, 25), "25 degC (temperature), status 100 ok");
        assert_eq!(in_words("STAP 4, 0", Status::Ok, 0), "maximum positioning speed, status 100 ok");
        assert_eq!(in_words("MST 0", Status::Ok, 0), "status 100 ok");
        assert_eq!(in_words("136, 1", Status::Ok, 0x0474_012A), "TMCM-1140, firmware version 1.42, status 100 ok");
    }

    #[test]
    fn the_reply_to_a_refused_command_is_shown_without_its_value() {
        let text = "status 4 value, motor or bank out of range";
        assert_eq!(in_words("SAP 4, 0, 5000", Status::InvalidValue, 5000), text);
        let command = text::parse("MST 0").unwrap();
        let refused = binary::encode_reply(2, 1, &tmcl::Reply::WRONG_CHECKSUM);
        let expected = Meaning { text: "status 1 wrong checksum".into(), done: false };
        assert_eq!(meaning(KNOWN, false, command, &refused), expected);
        assert_eq!(
            meaning(KNOWN, false, command, &[1; 9]).text,
            "reply with a wrong checksum: 01 01 01 01 01 01 01 01 01; check the wiring, and on RS485 --baud and termination"
        );
        let other = binary::encode_reply(2, 1, &tmcl::Reply::echo(Status::Ok, Command::new(6, 0, 0, 0)));
        let in_words = meaning(KNOWN, false, command, &other);
        assert!(!in_words.done && in_words.text.contains("it answers command 6"), "{in_words:?}");
    }

    #[test]
    fn special_replies() {
        let version = text::parse("136, 0").unwrap();
        let reply = binary::encode_reply(2, 1, &tmcl::Reply::Version(*b"1140V142"));
        assert_eq!(meaning(KNOWN, false, version, &reply), Meaning { text: "1140V142".into(), done: true });
        let read = text::parse("134, 0, 0, 12").unwrap();
        let reply = binary::encode_reply(2, 1, &tmcl::Reply::Memory(text::parse("MVP ABS, 0, 90000").unwrap()));
        assert_eq!(meaning(KNOWN, false, read, &reply).text, "MVP ABS, 0, 90000");
        assert_eq!(in_words("134, 0, 0, 12", Status::NotAvailable, 12), "status 6 not available in this mode or state");
    }
}
