//! Virtual time: nanoseconds since the board was powered, and the arithmetic around it.

/// A point in virtual time, or a span of it, in nanoseconds (584 years before it wraps).
pub type Nanos = u64;

/// A microsecond.
pub const MICROSECOND: Nanos = 1_000;
/// A millisecond.
pub const MILLISECOND: Nanos = 1_000_000;
/// A second.
pub const SECOND: Nanos = 1_000_000_000;
