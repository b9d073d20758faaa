//! Peripherals that the chip has to look at: those that have been accessed, and those that have an event; and the
//! interrupts they want.

use crate::mcu::peripheral::{Cycles, NEVER, Peripheral, bit};
use crate::mcu::step::LINES;
use crate::mcu::unit::{PeripheralName, Units};

/// When each peripheral is to be looked at, and what it was seen to want.
#[derive(Debug)]
pub(in crate::mcu) struct Agenda {
    /// When each peripheral has its next event.
    due: [Cycles; PeripheralName::ALL.len()],
    /// The first of these.
    next: Cycles,
    /// Interrupt lines of each peripheral.
    lines: [u32; PeripheralName::ALL.len()],
    /// Peripherals that have been accessed, or had an event.
    touched: Units,
    /// All interrupt lines.
    interrupts: [u32; LINES],
}

impl Agenda {
    /// Nothing is due.
    pub(super) fn new() -> Self {
        Self {
            due: [NEVER; PeripheralName::ALL.len()],
            next: NEVER,
            lines: [0; PeripheralName::ALL.len()],
            touched: Units::default(),
            interrupts: [0; LINES],
        }
    }

    /// A peripheral is to be looked at.
    #[inline]
    pub(in crate::mcu) fn touch(&mut self, unit: PeripheralName) {
        self.touched.insert(unit);
    }

    /// All peripherals are to be looked at.
    pub(super) fn touch_all(&mut self) {
        self.touched = Units::ALL;
    }

    /// All peripherals but one are to be looked at.
    pub(super) fn touch_all_but(&mut self, unit: PeripheralName) {
        self.touched.insert_all_but(unit);
    }

    /// The peripherals that are to be looked at now.
    #[inline]
    pub(super) fn take_touched(&mut self) -> Units {
        std::mem::take(&mut self.touched)
    }

    /// Whether the event of a peripheral has come by `now`.
    #[inline]
    pub(super) fn is_due(&self, unit: PeripheralName, now: Cycles) -> bool {
        self.due[unit as usize] <= now
    }

    /// The next event of any peripheral.
    #[inline]
    pub(super) fn next_event(&self) -> Cycles {
        self.next
    }

    /// Levels of all interrupt lines, one bit each.
    #[inline]
    pub(in crate::mcu) fn interrupts(&self) -> [u32; LINES] {
        self.interrupts
    }

    /// Asks a peripheral for its next event and its interrupts.
    pub(super) fn refresh(&mut self, unit: PeripheralName, peripheral: &dyn Peripheral) {
        let (due, lines) = (peripheral.next_event(), peripheral.interrupts());
        let before = std::mem::replace(&mut self.due[unit as usize], due);
        if due <= self.next {
            self.next = due;
        } else if before == self.next {
            self.next = self.due.into_iter().fold(NEVER, Cycles::min);
        }
        if lines == self.lines[unit as usize] {
            return;
        }
        self.lines[unit as usize] = lines;
        for (index, &number) in unit.description().interrupts.iter().enumerate() {
            let (word, mask) = (usize::from(number / 32), 1 << (number % 32));
            if bit(lines, index as u32) {
                self.interrupts[word] |= mask;
            } else {
                self.interrupts[word] &= !mask;
            }
        }
    }
}
