//! Quantities that are read of an axis, so that there is something to say of it.

use tmcm::module::ports::Signal;
use tmcm::param::AxisParameter as P;
use tmcm::tmcl::{Command, Opcode};

use crate::product::{Product, numbers};

/// Type of RFS that asks for the state of a reference search.
const STATUS: u8 = 2;

/// A quantity that is read of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// A parameter of the axis.
    Parameter(P),
    /// The state of its reference search.
    Search,
    /// The supply voltage of the module, in tenths of a volt.
    Supply,
}

/// All that is read of an axis, where the product has it. The extended error flags are not among it: to read them is to
/// clear them.
const ALL: [Quantity; 24] = [
    Quantity::Parameter(P::TargetPosition),
    Quantity::Parameter(P::ActualPosition),
    Quantity::Parameter(P::ActualSpeed),
    Quantity::Parameter(P::PositionReached),
    Quantity::Parameter(P::RampMode),
    Quantity::Search,
    Quantity::Parameter(P::LeftSwitch),
    Quantity::Parameter(P::RightSwitch),
    Quantity::Parameter(P::HomeSwitch),
    Quantity::Parameter(P::LeftSwitchDisable),
    Quantity::Parameter(P::RightSwitchDisable),
    Quantity::Parameter(P::DriverErrorFlags),
    Quantity::Supply,
    Quantity::Parameter(P::MaximumCurrent),
    Quantity::Parameter(P::StandbyCurrent),
    Quantity::Parameter(P::SmartEnergyActualCurrent),
    Quantity::Parameter(P::ChopperOffTime),
    Quantity::Parameter(P::StopOnStall),
    Quantity::Parameter(P::EncoderPosition),
    Quantity::Parameter(P::MaximumEncoderDeviation),
    Quantity::Parameter(P::ExternalEncoderPosition),
    Quantity::Parameter(P::MaximumExternalEncoderDeviation),
    Quantity::Parameter(P::ChipEncoderDeviation),
    Quantity::Parameter(P::UnitMode),
];

/// The commands that read what there is to say of an axis, in a fixed order. Of an unknown product that is what all
/// known ones have under the same number.
pub fn requests(product: Option<Product>, axis: u8) -> Vec<Command> {
    all(product, axis).map(|(_, command)| command).collect()
}

/// The quantities that are read of an axis, each with its command.
pub(super) fn all(product: Option<Product>, axis: u8) -> impl Iterator<Item = (Quantity, Command)> {
    ALL.into_iter().filter_map(move |quantity| Some((quantity, command(product, axis, quantity)?)))
}

fn command(product: Option<Product>, axis: u8, quantity: Quantity) -> Option<Command> {
    let gap = |number| Command::new(Opcode::Gap as u8, number, axis, 0);
    match quantity {
        Quantity::Parameter(parameter) => number(product, parameter).map(gap),
        Quantity::Search => Some(Command::new(Opcode::Rfs as u8, STATUS, axis, 0)),
        Quantity::Supply => {
            let measures = product.is_some_and(|product| product.spec().signals.contains(&Signal::Supply));
            let (bank, port) = Signal::Supply.place();
            measures.then(|| Command::new(Opcode::Gio as u8, port, bank, 0))
        }
    }
}

/// The number of an axis parameter, if the product has it.
fn number(product: Option<Product>, parameter: P) -> Option<u8> {
    let of = |product| numbers(product).axis.row(parameter).map(|row| row.number);
    let number = of(product)?;
    let is_shared = || Product::ALL.into_iter().all(|product| of(Some(product)) == Some(number));
    (product.is_some() || is_shared()).then_some(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(product: Option<Product>, axis: u8) -> Vec<String> {
        requests(product, axis).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn what_is_read_is_what_the_product_has() {
        let usual = told(Some(Product::Tmcm1140), 0);
        assert_eq!(usual[..6], ["GAP 0, 0", "GAP 1, 0", "GAP 3, 0", "GAP 8, 0", "GAP 138, 0", "RFS STATUS, 0"]);
        assert!(usual.contains(&"GIO 8, 1".into()) && usual.contains(&"GAP 216, 0".into()));
        let third = told(Some(Product::Tmcm3212), 2);
        assert!(third.contains(&"GAP 255, 2".into()) && !third.contains(&"GAP 138, 2".into()), "{third:?}");
        // A TMCM-1110 has no supply voltage, but a reading of a converter, and its one encoder at 209.
        let single = told(Some(Product::Tmcm1110), 0);
        assert!(!single.contains(&"GIO 8, 1".into()) && single.contains(&"GAP 209, 0".into()), "{single:?}");
    }

    /// To read the extended error flags is to clear them, so nothing reads them again and again.
    #[test]
    fn extended_error_flags_are_not_sampled() {
        for product in Product::ALL.map(Some).into_iter().chain([None]) {
            let extended = Command::new(Opcode::Gap as u8, 207, 0, 0);
            assert!(!requests(product, 0).contains(&extended), "{product:?}");
        }
    }

    #[test]
    fn of_an_unknown_product_only_what_all_have_is_read() {
        let unknown = told(None, 0);
        assert!(unknown.contains(&"GAP 208, 0".into()) && !unknown.contains(&"GAP 138, 0".into()), "{unknown:?}");
        for product in Product::ALL {
            let known = told(Some(product), 0);
            assert!(unknown.iter().all(|line| known.contains(line)), "{product:?}");
        }
    }
}
