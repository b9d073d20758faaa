//! External ABN encoders: a timer counts A and B, and an interrupt of N notes the count at each edge.

use core::cell::Cell;

use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::timer::TimGp16;
use embassy_stm32::pac::{EXTI, Interrupt, SYSCFG};
use embassy_sync::blocking_mutex::CriticalSectionMutex;

use super::line::Line;

/// An encoder, in static memory, because its interrupt uses it.
pub(crate) struct Encoder {
    /// The timer, which counts in quadrature.
    timer: TimGp16,
    null: Line,
    /// The interrupt of N: its handler calls [`Encoder::edge`].
    interrupt: Interrupt,
    /// The counts at the last edge of N to low and at that to high, since they were last read.
    edges: CriticalSectionMutex<Cell<[Option<u16>; 2]>>,
}

impl Encoder {
    /// The encoder that `timer` counts, with N at the pin `null`; the handler of `interrupt`, which is that of this
    /// pin's number, is to call [`Encoder::edge`].
    pub(crate) const fn new(timer: TimGp16, null: Line, interrupt: Interrupt) -> Self {
        Encoder { timer, null, interrupt, edges: CriticalSectionMutex::new(Cell::new([None; 2])) }
    }

    /// Enables the interrupt of N. The timer is counting already.
    pub(crate) fn start(&self) {
        let line = self.null.pin();
        SYSCFG.exticr(line / 4).modify(|w| w.set_exti(line % 4, self.null.port() as u8));
        EXTI.rtsr(0).modify(|w| w.set_line(line, true));
        EXTI.ftsr(0).modify(|w| w.set_line(line, true));
        EXTI.imr(0).modify(|w| w.set_line(line, true));
        self.interrupt.set_priority(Priority::P3);
        // SAFETY: the handler uses only registers and this encoder, which is static.
        unsafe { self.interrupt.enable() };
    }

    /// Notes the count at an edge of N: to be called by the interrupt handler.
    #[inline(always)]
    pub(crate) fn edge(&self) {
        EXTI.pr(0).write(|w| w.set_line(self.null.pin(), true));
        let count = self.count();
        let high = self.null.is_high();
        self.edges.lock(|edges| {
            let [low_at, high_at] = edges.get();
            edges.set(if high { [low_at, Some(count)] } else { [Some(count), high_at] });
        });
    }

    /// The count of A and B, which wraps at 65 536.
    pub(crate) fn count(&self) -> u16 {
        self.timer.cnt().read().cnt()
    }

    /// The counts at the last edge of N to low and at that to high since the last call; `None` without such an edge.
    pub(crate) fn edges(&self) -> [Option<u16>; 2] {
        self.edges.lock(|edges| edges.replace([None; 2]))
    }
}
