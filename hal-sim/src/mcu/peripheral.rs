//! Common features of all peripherals.

/// A time or a span in cycles of the core clock.
pub(super) type Cycles = u64;

/// The time of an event that does not come.
pub(super) const NEVER: Cycles = Cycles::MAX;

/// Why an access is refused: the run ends with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    /// The register does not exist in the model.
    Register,
    /// The register is there, but what is asked of it is not modelled, or not allowed.
    Use(&'static str),
}

/// The outcome of an access.
pub(super) type Access<T = ()> = Result<T, Refusal>;

/// A peripheral, driven at its registers. Its owner calls [`advance`](Self::advance) before every access and
/// whenever an event is due.
pub(super) trait Peripheral {
    /// Reads the register at `offset`.
    fn read(&mut self, offset: u32) -> Access<u32>;

    /// Writes the register at `offset`.
    fn write(&mut self, offset: u32, value: u32) -> Access;

    /// Lets time pass until `to`.
    fn advance(&mut self, _to: Cycles) {}

    /// When something happens next without an access.
    fn next_event(&self) -> Cycles {
        NEVER
    }

    /// Levels of the interrupt lines, in the order of the peripheral's description.
    fn interrupts(&self) -> u32 {
        0
    }

    /// The bus clock has changed: one of its periods takes `divider` core cycles from now on.
    fn set_divider(&mut self, _divider: Cycles) {}

    /// Levels of the DMA requests.
    fn requests(&self) -> Requests {
        Requests::default()
    }

    /// Reset by RCC or with the whole chip.
    fn reset(&mut self);
}

/// DMA requests of a peripheral.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Requests {
    /// Data can be fetched from the data register.
    pub(super) receive: bool,
    /// The data register can take data.
    pub(super) transmit: bool,
}

/// Whether bit `bit` of `value` is set.
pub(super) fn bit(value: u32, bit: u32) -> bool {
    value >> bit & 1 != 0
}

/// The `width` bits of `value` from bit `low` on.
pub(super) fn field(value: u32, low: u32, width: u32) -> u32 {
    value >> low & ((1 << width) - 1)
}
