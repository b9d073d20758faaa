//! The motor field of MVP COORD on a product with several axes (TMCL reference 2.22, section 3.4): the axes that it
//! means.

use super::ALL_AXES;

/// Bit of the motor field: the axes move at once.
const TOGETHER: u8 = 0x80;
/// Bit of the motor field: the axes move on a straight line.
const STRAIGHT: u8 = 0x40;
/// The bits of the motor field that stand for axes, bit n for axis n.
const AXES: u8 = 0x3F;
/// The lowest motor field that stands for a set of axes, of products that have several.
pub const FIRST_SET: u8 = STRAIGHT;
/// Number of axes that can move on a straight line.
const STRAIGHT_AXES: u32 = 3;

/// Some of the axes of a product.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisSet {
    /// The axes, axis n in bit n; there is one at least.
    pub bits: u8,
    /// The axes move on a straight line, and arrive at once; else each moves for itself, and they start at once.
    pub straight: bool,
}

impl AxisSet {
    /// The axes that a motor field means on a product with so many axes: one by its number, several by their bits, or
    /// all by [`ALL_AXES`]. `None` if it means no axis, one that does not exist, or more than three on a straight line;
    /// and with both bits 6 and 7.
    pub const fn of(motor: u8, axes: u8) -> Option<Self> {
        let all = !u8::MAX.unbounded_shl(axes as u32);
        if motor < axes {
            return Some(AxisSet { bits: 1_u8.unbounded_shl(motor as u32), straight: false });
        }
        if motor == ALL_AXES {
            return Some(AxisSet { bits: all, straight: false });
        }
        let set = AxisSet { bits: motor & AXES, straight: motor & !AXES == STRAIGHT };
        let known = motor & !AXES == TOGETHER || set.straight && set.bits.count_ones() <= STRAIGHT_AXES;
        if known && set.bits != 0 && set.bits & !all == 0 && axes > 1 { Some(set) } else { None }
    }

    /// True if an axis is one of the set.
    pub const fn contains(self, axis: u8) -> bool {
        self.bits.unbounded_shr(axis as u32) & 1 != 0
    }

    /// The axis of the lowest number.
    pub const fn first(self) -> u8 {
        self.bits.trailing_zeros() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motor_field_means_an_axis_or_a_set_of_them() {
        let set = |motor, axes| AxisSet::of(motor, axes).map(|set| (set.bits, set.straight));
        assert_eq!((set(5, 6), set(6, 6), set(0, 1), set(1, 1)), (Some((0x20, false)), None, Some((1, false)), None));
        assert_eq!((set(0x47, 6), set(0x87, 6)), (Some((7, true)), Some((7, false))));
        assert_eq!((set(0xBF, 6), set(0x7F, 6), set(0x4F, 6)), (Some((0x3F, false)), None, None));
        assert_eq!((set(255, 6), set(255, 3), set(255, 1)), (Some((0x3F, false)), Some((7, false)), Some((1, false))));
        // No axis, a missing one, both bits; and a product with one axis knows no sets.
        for (motor, axes) in [(0x40, 6), (0x80, 6), (0x88, 3), (0x48, 3), (0xC1, 6), (0xFE, 6), (0x41, 1), (0x81, 1)] {
            assert_eq!(set(motor, axes), None, "{motor:#x} of {axes}");
        }
        assert_eq!(AxisSet::of(0x46, 6).map(AxisSet::first), Some(1));
    }
}
