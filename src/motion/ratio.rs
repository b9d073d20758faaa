//! The ratio of two ways, as axes on a straight line have it.

/// A ratio of two ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Ratio {
    mantissa: u32,
    /// By how much a product with the mantissa is shifted right for a result in 1/256; at most 24.
    shift: u32,
}

impl Ratio {
    /// The ratio of `way` to `whole`, at most 2^24.
    pub fn new(way: u32, whole: u32) -> Self {
        let quotient = (u64::from(way) << 32).checked_div(whole.into()).unwrap_or(u64::MAX);
        let excess = 32_u32.saturating_sub(quotient.leading_zeros());
        match 24_u32.checked_sub(excess) {
            Some(shift) => Ratio { mantissa: quotient.unbounded_shr(excess) as u32, shift },
            None => Ratio { mantissa: u32::MAX, shift: 0 },
        }
    }

    /// The product with a number, in 1/256.
    pub fn times(self, number: u32) -> u64 {
        u64::from(self.mantissa).wrapping_mul(number.into()).unbounded_shr(self.shift)
    }

    /// The product with a number that is not negative, rounded up, and at most `most`.
    pub fn up(self, number: i32, most: i32) -> i32 {
        self.times(number.unsigned_abs()).div_ceil(256).min(u64::from(most.unsigned_abs())) as i32
    }

    /// The largest number whose product is not above `product`, in 1..=`most`; 0 if that or `product` is.
    pub fn limit(self, product: i32, most: i32) -> i32 {
        let number = u64::from(product.unsigned_abs()).unbounded_shl(self.shift.saturating_add(8));
        let number = number.checked_div(self.mantissa.into()).unwrap_or(u64::MAX);
        number.max(product.min(1) as u64).min(u64::from(most.unsigned_abs())) as i32
    }
}
