//! Replies in words: the value with its unit and name, and the status.

use tmcm::param::Unit;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{CONFIRMATION, Command, Opcode};

use crate::conversation::{self, Answer, executed, hexadecimal};
use crate::product::{Named, Product, parameter, speed_unit, symbol, with_unit};

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

/// True for commands that a module executes without a reply.
pub fn stays_unanswered(command: Command) -> bool {
    match Opcode::from_number(command.opcode) {
        Some(Opcode::FactorySettings) => command.value == CONFIRMATION,
        Some(Opcode::EnterBootloader) => command == Command::ENTER_BOOTLOADER,
        _ => false,
    }
}

/// True for a command about a parameter, or a speed, whose name and unit are in the tables of the product.
pub(super) fn needs_names(command: Command) -> bool {
    match Opcode::from_number(command.opcode) {
        Some(Opcode::Ror | Opcode::Rol) => true,
        Some(Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Stap | Opcode::Rsap) => true,
        Some(Opcode::Ggp | Opcode::Sgp | Opcode::Agp | Opcode::Stgp | Opcode::Rsgp) => command.motor != VARIABLES,
        _ => false,
    }
}

/// True for a command about a speed or an acceleration of a product that has these in pps and pps2, or in units of its
/// chip.
pub(crate) fn depends_on_unit_mode(product: Option<Product>, command: Command) -> bool {
    let (Some(product), Some(opcode)) = (product, Opcode::from_number(command.opcode)) else { return false };
    let unit = match opcode {
        Opcode::Ror | Opcode::Rol => Some(speed_unit(product)),
        _ => parameter(product.spec(), opcode, command).map(|parameter| parameter.row.unit),
    };
    matches!(unit, Some(Unit::Pps | Unit::Pps2))
}

/// The meaning of a reply to `command` from a module of this product. Without a product, values of parameters have
/// neither unit nor name. `in_chip` says that speeds and accelerations of the axis are in units of its chip.
pub fn meaning(product: Option<Product>, in_chip: bool, command: Command, reply: &Telegram) -> Meaning {
    match Answer::read(command, reply) {
        Answer::Version(text) => Meaning { text, done: true },
        Answer::Memory(stored) => Meaning { text: stored.to_string(), done: true },
        Answer::Plain(Received { status, value, .. }) => {
            let done = executed(status);
            let what = if done { what(product, in_chip, command, value) } else { String::new() };
            let separator = if what.is_empty() { "" } else { ", " };
            Meaning { text: format!("{what}{separator}status {status} {}", conversation::meaning(status)), done }
        }
        Answer::Strange => {
            let bytes = hexadecimal(reply);
            let text = match binary::decode_reply(reply) {
                Some(Received { status, opcode, .. }) => {
                    let status = format!("status {status} {}", conversation::meaning(status));
                    format!("{status}, but it answers command {opcode}: {bytes}")
                }
                None => format!("reply with a wrong checksum: {bytes}"),
            };
            Meaning { text, done: false }
        }
    }
}

/// The value of a reply with its unit and name; empty where the value has no meaning.
fn what(product: Option<Product>, in_chip: bool, command: Command, value: i32) -> String {
    let Some(opcode) = Opcode::from_number(command.opcode) else { return value.to_string() };
    let parameter = product.and_then(|product| parameter(product.spec(), opcode, command));
    match opcode {
        Opcode::Stap | Opcode::Rsap | Opcode::Stgp | Opcode::Rsgp => {
            parameter.map_or_else(String::new, |parameter| parameter.name)
        }
        Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Ggp | Opcode::Sgp | Opcode::Agp => match parameter {
            Some(Named { row, name }) => format!("{} ({name})", with_unit(value, symbol(row.unit, in_chip))),
            None => value.to_string(),
        },
        Opcode::Mvp => format!("{} (target)", with_unit(value, Unit::Microsteps.symbol())),
        Opcode::Ror | Opcode::Rol => {
            with_unit(value, product.map_or("", |product| symbol(speed_unit(product), in_chip)))
        }
        Opcode::Sco | Opcode::Gco | Opcode::Cco => with_unit(value, Unit::Microsteps.symbol()),
        Opcode::Gio => match (command.motor, command.kind) {
            (1, 8) => format!("{}.{} V (supply)", value / 10, (value % 10).abs()),
            (1, 9) => format!("{value} degC (temperature)"),
            _ => value.to_string(),
        },
        Opcode::FirmwareVersion => firmware(value),
        Opcode::Mst => String::new(),
        _ => value.to_string(),
    }
}

/// Type and firmware version of a module, from the value of the reply to `136, 1`.
pub(crate) fn firmware(value: i32) -> String {
    let [high, low, major, minor] = value.to_be_bytes();
    format!("TMCM-{}, firmware version {major}.{minor:02}", u16::from_be_bytes([high, low]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use tmcm::tmcl::{Reply, Status, text};

    const KNOWN: Option<Product> = Some(Product::Tmcm1140);

    fn in_words(line: &str, status: Status, value: i32) -> String {
        let command = text::parse(line).unwrap();
        let reply = binary::encode_reply(2, 1, &Reply::Plain { status, opcode: command.opcode, value });
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
        let refused = binary::encode_reply(2, 1, &Reply::WRONG_CHECKSUM);
        let expected = Meaning { text: "status 1 wrong checksum".into(), done: false };
        assert_eq!(meaning(KNOWN, false, command, &refused), expected);
        assert_eq!(
            meaning(KNOWN, false, command, &[1; 9]).text,
            "reply with a wrong checksum: 01 01 01 01 01 01 01 01 01"
        );
        let other = binary::encode_reply(2, 1, &Reply::echo(Status::Ok, Command::new(6, 0, 0, 0)));
        let in_words = meaning(KNOWN, false, command, &other);
        assert!(!in_words.done && in_words.text.contains("it answers command 6"), "{in_words:?}");
    }

    #[test]
    fn special_replies() {
        let version = text::parse("136, 0").unwrap();
        let reply = binary::encode_reply(2, 1, &Reply::Version(*b"1140V142"));
        assert_eq!(meaning(KNOWN, false, version, &reply), Meaning { text: "1140V142".into(), done: true });
        let read = text::parse("134, 0, 0, 12").unwrap();
        let reply = binary::encode_reply(2, 1, &Reply::Memory(text::parse("MVP ABS, 0, 90000").unwrap()));
        assert_eq!(meaning(KNOWN, false, read, &reply).text, "MVP ABS, 0, 90000");
        assert_eq!(in_words("134, 0, 0, 12", Status::NotAvailable, 12), "status 6 not available in this mode or state");
    }
}
