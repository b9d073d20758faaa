//! A reply in parts: status, value, unit and name, as they are shown in words and as JSON.

use serde::Serialize;
use tmcm::param::Unit;
use tmcm::tmcl::binary::{self, Received, Telegram};
use tmcm::tmcl::{Command, Opcode};

use super::answer::{Answer, executed, hexadecimal, meaning};
use super::names::{Named, parameter, speed_unit, symbol};
use crate::native::Product;

/// Unit of the supply voltage: tenths of a volt.
pub(super) const TENTHS: &str = "0.1 V";

/// The parts of a reply. Those that are not known, or have no meaning, are empty.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Reply {
    /// The status.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub status: Option<u8>,
    /// The meaning of the status.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub meaning: Option<&'static str>,
    /// The value of a command that was executed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub value: Option<i32>,
    /// The unit of the value.
    #[serde(skip_serializing_if = "str::is_empty")]
    pub unit: &'static str,
    /// The name of what the value is of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The text that the module says of itself, or a command of its program.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub text: Option<String>,
    /// The mistake in bytes that are no reply to the command.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
}

impl Reply {
    /// Reads the reply to `command` from a module of this product. Without a product, values of parameters have neither
    /// unit nor name. `in_chip` says that speeds and accelerations of the axis are in units of its chip.
    pub fn read(product: Option<Product>, in_chip: bool, command: Command, reply: &Telegram) -> Self {
        match Answer::read(command, reply) {
            Answer::Version(text) => Reply { text: Some(text), ..Reply::default() },
            Answer::Memory(stored) => Reply { text: Some(stored.to_string()), ..Reply::default() },
            Answer::Plain(Received { status, value, .. }) if executed(status) => {
                Reply { status: Some(status), ..Self::of_value(product, in_chip, command, value) }.with_meaning()
            }
            Answer::Plain(Received { status, .. }) => Reply { status: Some(status), ..Reply::default() }.with_meaning(),
            Answer::Strange => strange(reply),
        }
    }

    /// True if the command has been executed.
    pub fn done(&self) -> bool {
        self.error.is_none() && self.status.is_none_or(executed)
    }

    /// The value of a reply to `command`, with its unit and name, as [`Reply::read`] has them.
    pub fn of_value(product: Option<Product>, in_chip: bool, command: Command, value: i32) -> Self {
        let plain = Reply { value: Some(value), ..Reply::default() };
        let Some(opcode) = Opcode::from_number(command.opcode) else { return plain };
        let parameter = product.and_then(|product| parameter(product.spec(), opcode, command));
        let named = |unit, name: &str| Reply { unit, name: Some(name.into()), ..plain.clone() };
        match opcode {
            Opcode::Stap | Opcode::Rsap | Opcode::Stgp | Opcode::Rsgp => {
                Reply { name: parameter.map(|parameter| parameter.name), ..Reply::default() }
            }
            Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Ggp | Opcode::Sgp | Opcode::Agp => match parameter {
                Some(Named { row, name }) => named(symbol(row.unit, in_chip), &name),
                None => plain,
            },
            Opcode::Mvp => named(Unit::Microsteps.symbol(), "target"),
            Opcode::Ror | Opcode::Rol => {
                Reply { unit: product.map_or("", |product| symbol(speed_unit(product), in_chip)), ..plain }
            }
            Opcode::Sco | Opcode::Gco | Opcode::Cco => Reply { unit: Unit::Microsteps.symbol(), ..plain },
            Opcode::Gio => match (command.motor, command.kind) {
                (1, 8) => named(TENTHS, "supply"),
                (1, 9) => named("degC", "temperature"),
                _ => plain,
            },
            Opcode::FirmwareVersion => Reply { text: Some(firmware(value)), ..plain },
            Opcode::Mst => Reply::default(),
            _ => plain,
        }
    }

    fn with_meaning(self) -> Self {
        Reply { meaning: self.status.map(meaning), ..self }
    }
}

/// Bytes that are no reply to the command.
fn strange(reply: &Telegram) -> Reply {
    let bytes = hexadecimal(reply);
    match binary::decode_reply(reply) {
        Some(Received { status, opcode, .. }) => {
            let late = "if it came late for an earlier command, give the module more --timeout";
            let error = Some(format!("it answers command {opcode}: {bytes}; {late}"));
            Reply { status: Some(status), error, ..Reply::default() }.with_meaning()
        }
        None => {
            let hint = "check the wiring, and on RS485 --baud and termination";
            Reply { error: Some(format!("reply with a wrong checksum: {bytes}; {hint}")), ..Reply::default() }
        }
    }
}

/// Type and firmware version of a module, from the value of the reply to `136, 1`.
fn firmware(value: i32) -> String {
    let [high, low, major, minor] = value.to_be_bytes();
    format!("TMCM-{}, firmware version {major}.{minor:02}", u16::from_be_bytes([high, low]))
}
