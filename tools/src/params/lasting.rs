//! Changes that a command leaves in the EEPROM of a module, in place of what was there.

use tmcm::param::Storage;
use tmcm::tmcl::{ALL_AXES, CONFIRMATION, Command, Opcode};

use super::file::Setting;
use crate::product::Product;

/// A change by a command that lasts for longer than until the module is switched off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lasting {
    /// STAP or STGP stores the value that a parameter has.
    Stored(Setting),
    /// SAP or SGP writes a parameter that the module stores by itself.
    ByItself(Setting),
    /// SCO with all axes stores coordinates.
    Coordinates,
    /// Command 137 resets all settings to their factory defaults.
    Defaults,
}

impl Lasting {
    /// Finds the lasting change by a command; `None` if it changes nothing so.
    pub fn of(command: Command, product: Option<Product>) -> Option<Self> {
        let Command { kind: number, motor, value, .. } = command;
        match Opcode::from_number(command.opcode)? {
            Opcode::Stap => Some(Lasting::Stored(Setting::Axis { number, axis: motor, value })),
            Opcode::Stgp => Some(Lasting::Stored(Setting::Global { number, bank: motor, value })),
            Opcode::Sco if motor == ALL_AXES => Some(Lasting::Coordinates),
            Opcode::FactorySettings if value == CONFIRMATION => Some(Lasting::Defaults),
            _ => Setting::of(command).filter(|setting| stores_itself(*setting, product)).map(Lasting::ByItself),
        }
    }
}

/// True for a parameter that the module stores by itself when it is written. Of a product that is not known that may be
/// so for all parameters of bank 0.
pub fn stores_itself(setting: Setting, product: Option<Product>) -> bool {
    match setting.row(product) {
        Some(row) => matches!(row.storage, Storage::Automatic(_)),
        None => product.is_none() && matches!(setting, Setting::Global { bank: 0, .. }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::{Symbols, command};

    fn of(line: &str, product: Option<Product>) -> Option<Lasting> {
        Lasting::of(command(line, product, &Symbols::default()).unwrap(), product)
    }

    #[test]
    fn what_stays_is_told_from_what_does_not() {
        let product = Some(Product::Tmcm1140);
        let speed = Setting::Axis { number: 4, axis: 0, value: 0 };
        assert_eq!(of("STAP 4, 0", product), Some(Lasting::Stored(speed)));
        assert_eq!(of("7, 4, 0, 0", product), Some(Lasting::Stored(speed)));
        let variable = Setting::Global { number: 3, bank: 2, value: 0 };
        assert_eq!(of("STGP 3, 2", product), Some(Lasting::Stored(variable)));
        let address = Setting::Global { number: 66, bank: 0, value: 5 };
        assert_eq!(of("SGP 66, 0, 5", product), Some(Lasting::ByItself(address)));
        assert_eq!(of("SGP 66, 0, 5", None), Some(Lasting::ByItself(address)));
        assert_eq!(of("SCO 0, 255, 0", product), Some(Lasting::Coordinates));
        assert_eq!(of("137, 0, 0, 1234", product), Some(Lasting::Defaults));
        for line in ["137, 0, 0, 1", "SAP 4, 0, 5", "SGP 3, 2, 5", "SCO 1, 0, 5", "GAP 4, 0", "RSAP 4, 0", "ROR 0, 5"] {
            assert_eq!(of(line, product), None, "{line}");
        }
    }
}
