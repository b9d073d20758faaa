//! Products as data, one file for each: its parameters, its `Spec`, its memories and the slots of its settings. The
//! file of a product with another firmware has what is different there.
//!
//! [`products!`](crate::products) lists them. What a product's board consists of, and at which pins it is, stands with
//! the boards: `board` here, `hal_sim::board` in the simulator.

pub mod tmcm1110;
pub mod tmcm1140;
pub mod tmcm1140_canopen;
pub mod tmcm3110;
pub mod tmcm3212;
pub mod tmcm6110;

pub use tmcm1110::{TMCM_1110, Tmcm1110};
pub use tmcm1140::{TMCM_1140, Tmcm1140};
pub use tmcm1140_canopen::Tmcm1140Canopen;
pub use tmcm3110::{TMCM_3110, Tmcm3110};
pub use tmcm3212::{TMCM_3212, Tmcm3212};
pub use tmcm6110::{TMCM_6110, Tmcm6110};

/// Hands the list of all products with a TMCL firmware to the macro `$with`. Of each it hands on the type, the `Spec`,
/// and the chips that move its motors, by the name that the simulator has for them. The usual product is the first one,
/// the others follow in the order of their numbers.
///
/// ```
/// macro_rules! numbers {
///     ($($product:ident $spec:ident $chips:ident;)*) => { [$(tmcm::product::$spec.number),*] };
/// }
/// assert_eq!(tmcm::products!(numbers), [1140, 1110, 3110, 3212, 6110]);
/// ```
#[macro_export]
macro_rules! products {
    ($with:ident) => {
        $with! {
            Tmcm1140 TMCM_1140 Tmc429s;
            Tmcm1110 TMCM_1110 Tmc429s;
            Tmcm3110 TMCM_3110 Tmc429s;
            Tmcm3212 TMCM_3212 Tmc5160s;
            Tmcm6110 TMCM_6110 Tmc429s;
        }
    };
}

#[cfg(test)]
mod tests {
    use super::tmcm1140::{AXIS, GLOBAL, TMCM_1140, Tmcm1140};
    use crate::executor::Slots;
    use crate::executor::spec::check;

    /// The compiler evaluates the same function for each module, so what panics here does not compile there.
    #[test]
    fn a_module_has_as_many_axes_as_its_product() {
        check::<Tmcm1140>(1);
        assert!(std::panic::catch_unwind(|| check::<Tmcm1140>(2)).is_err());
    }

    /// Global parameters of the TMCM-1140 have slots up to 19, its axis parameters 46 slots.
    const GOOD: Slots = TMCM_1140.slots.unwrap();

    fn complaint(slots: Slots, axes: usize, count: usize) -> Option<String> {
        let panic = std::panic::catch_unwind(|| slots.check(&AXIS, &GLOBAL, axes, count)).err()?;
        Some(panic.downcast_ref::<&str>().copied().unwrap_or_default().to_owned())
    }

    /// The compiler evaluates the same function for each product, so what panics here does not compile there.
    #[test]
    fn settings_without_a_slot_of_their_own_are_refused() {
        assert_eq!(complaint(GOOD, 1, 142), None);
        assert_eq!(complaint(GOOD, 2, 208), None);
        for (slots, axes, count, reason) in [
            (GOOD, 1, 141, "an axis has no slots"),
            (GOOD, 3, 208, "an axis has no slots"),
            (Slots { variables: 19, ..GOOD }, 1, 208, "a global parameter has the slot of something else"),
            (Slots { coordinates: 45, ..GOOD }, 1, 208, "an axis parameter has the slot of a coordinate"),
            (Slots { axes: 75, ..GOOD }, 1, 208, "user variables have slots of an axis"),
            (Slots { each: 65, ..GOOD }, 1, 208, "coordinates have slots of the next axis"),
        ] {
            assert_eq!(complaint(slots, axes, count).as_deref(), Some(reason), "{slots:?}");
        }
    }
}
