//! Instructions of the flash memory, decoded when they are executed for the first time.

use rsemu::cpu::arm::v7m::isa::{self, Insn};

/// Halfwords for which there is room more than is needed now.
const ROOM: usize = 4096;

/// A decoded instruction.
#[derive(Clone, Copy, Debug)]
pub(super) struct Decoded {
    pub(super) insn: Insn,
    /// The length of the instruction in bytes; 0 where nothing has been decoded.
    pub(super) bytes: u32,
}

impl Decoded {
    const NONE: Self = Self { insn: Insn::Undefined, bytes: 0 };

    /// Decodes what begins with `first`; `second` gives the halfword after it. None where there is none.
    pub(super) fn decode(first: u32, second: impl FnOnce() -> Option<u32>) -> Option<Self> {
        let first = first as u16;
        let wide = isa::is_32bit(first);
        let second = if wide { second()? as u16 } else { 0 };
        Some(Self { insn: isa::decode(first, second), bytes: if wide { 4 } else { 2 } })
    }
}

/// The decoded instructions, one place for each halfword of flash memory up to the last one executed.
#[derive(Debug, Default)]
pub(super) struct Code(Vec<Decoded>);

impl Code {
    /// The instruction at an offset in flash memory, if it has been decoded.
    #[inline]
    pub(super) fn find(&self, offset: usize) -> Option<&Decoded> {
        self.0.get(offset / 2).filter(|decoded| decoded.bytes != 0)
    }

    /// Keeps the instruction at an offset.
    pub(super) fn keep(&mut self, offset: usize, decoded: Decoded) {
        let at = offset / 2;
        if at >= self.0.len() {
            self.0.resize(at + ROOM, Decoded::NONE);
        }
        self.0[at] = decoded;
    }

    /// The flash memory has changed.
    pub(super) fn forget(&mut self) {
        self.0.clear();
    }
}
