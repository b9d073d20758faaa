//! The chip around the core: carries clocks, interrupts and signals between peripherals, pins and board.
//!
//! | file | what |
//! |---|---|
//! | `access` | the core's accesses |
//! | `agenda` | which peripherals are to be looked at, and the interrupts they want |
//! | `clocks` | RCC's clocks and resets |
//! | `peripherals` | all of them |
//! | `pins` | between the peripherals and the board |
//! | `transfer` | DMA |
//! | `watched` | the register that the program waits for |

mod access;
mod agenda;
mod clocks;
mod peripherals;
mod pins;
mod transfer;
mod watched;

use super::cpu::Ram;
use super::peripheral::{Cycles, NEVER};
use super::pinout::Pinout;
use super::rcc::{Cause, Clocks};
use super::stop::Fault;
use super::timebase::Timebase;
use super::unit::{Decoder, PeripheralName};
use super::usb::UsbHost;
use super::wiring::{SpiBus, Wiring};
use crate::board::{Board, Chip};
use crate::clock::Nanos;
use agenda::Agenda;
use peripherals::Peripherals;
use watched::Watched;

/// The chip without its core.
#[derive(Debug)]
pub(super) struct Soc {
    pub(super) now: Cycles,
    pub(super) time: Timebase,
    clocks: Clocks,
    decoder: Decoder,
    pub(super) peripherals: Peripherals,
    /// The other end of the USB cable.
    pub(super) host: UsbHost,
    /// The memory that DMA reaches, once the core is there.
    sram: Option<Ram>,
    pub(super) agenda: Agenda,
    pub(super) watched: Watched,
    /// The wiring of the pins. The board is to be changed by [`board_mut`](Self::board_mut).
    pub(super) wiring: Wiring,
    /// The access that ended the run.
    pub(super) fault: Option<Fault>,
}

impl Soc {
    /// The chip just switched on, at the board's time, when the core has counted `now` cycles.
    pub(super) fn new(board: Board, pinout: &'static Pinout, now: Cycles) -> Self {
        let peripherals = Peripherals::new(now);
        let clocks = peripherals.rcc.clocks();
        let mut soc = Self {
            now,
            time: Timebase::new(clocks.hz, now, board.now()),
            clocks,
            decoder: Decoder::new(),
            peripherals,
            host: UsbHost::new(),
            sram: None,
            agenda: Agenda::new(),
            watched: Watched::default(),
            wiring: Wiring::new(board, pinout),
            fault: None,
        };
        soc.start();
        soc
    }

    /// All peripherals start anew, for `cause`. The board has been told of it.
    pub(super) fn reset(&mut self, now: Cycles, cause: Cause) {
        self.now = now;
        // While the board was off, its time went on and no cycle was counted.
        let nanos = self.time.nanos(now).max(self.board().now());
        self.time = Timebase::new(self.time.hz(), now, nanos);
        for unit in PeripheralName::ALL {
            self.peripherals.of(unit).reset();
        }
        self.peripherals.rcc = self.peripherals.rcc.restarted(now, cause);
        self.host.device_lost(self.time.nanos(now), &mut self.peripherals.otg);
        self.watched = Watched::default();
        self.fault = None;
        self.start();
    }

    fn start(&mut self) {
        let now = self.now;
        for unit in PeripheralName::ALL {
            self.peripherals.of(unit).advance(now);
        }
        self.agenda.touch_all();
        self.apply_clocks();
    }

    /// The present, as core and board have it.
    pub(super) fn present(&self) -> Nanos {
        let board = self.board();
        if board.is_powered() { self.time.nanos(self.now) } else { board.now() }
    }

    /// The board as it is.
    pub(super) fn board(&self) -> &Board {
        &self.wiring.board
    }

    /// The board, to be changed, at the present time.
    pub(super) fn board_mut(&mut self) -> &mut Board {
        self.agenda.touch(PeripheralName::Exti);
        &mut self.wiring.board
    }

    /// The board has its power again.
    pub(super) fn power_on(&mut self) {
        self.wiring.forget();
        self.peripherals.can.forget();
        self.wiring.board.power_on();
    }

    /// DMA works on this memory.
    pub(super) fn attach(&mut self, sram: Ram) {
        self.sram = Some(sram);
    }

    /// The chip that is selected on the motion bus, and whether a word is on the wire.
    pub(super) fn motion_bus(&self) -> (Option<Chip>, bool) {
        (self.wiring.selected(SpiBus::Motion), self.peripherals.spis[0].is_shifting())
    }

    /// The run ends with an access, unless it has ended already.
    fn refuse(
        &mut self,
        peripheral: &'static str,
        offset: u32,
        address: u32,
        written: Option<u32>,
        reason: &'static str,
    ) {
        self.fault.get_or_insert(Fault { peripheral, offset, address, written, reason });
    }

    /// Brings everything to `now`: events that are due, and what accesses have brought about. Gives the time of the
    /// next event.
    pub(super) fn settle(&mut self, now: Cycles) -> Cycles {
        self.now = now;
        loop {
            if self.agenda.next_event() <= now {
                let due = PeripheralName::ALL.map(|unit| self.agenda.is_due(unit, now));
                for (unit, _) in PeripheralName::ALL.into_iter().zip(due).filter(|(_, due)| *due) {
                    self.peripherals.of(unit).advance(now);
                    self.agenda.touch(unit);
                    // What was read may have changed since: nobody knows yet that it is waited for on.
                    self.watched = Watched::default();
                }
            }
            self.hear();
            if self.pins_change() <= now {
                self.watch_pins();
            }
            self.hear_host();
            let touched = self.agenda.take_touched();
            if touched.is_empty() {
                break;
            }
            for unit in touched {
                self.follow(unit);
                self.refresh(unit);
            }
            self.transfer();
        }
        self.next_event()
    }

    /// Lets the USB host do what is due.
    fn hear_host(&mut self) {
        // Without a cable nothing ever is.
        if self.host.next_event() == Nanos::MAX {
            return;
        }
        let time = self.time.nanos(self.now);
        if self.host.next_event() <= time {
            self.host.advance(time, &mut self.peripherals.otg);
            self.agenda.touch(PeripheralName::OtgFs);
        }
    }

    /// When something happens next, the core apart.
    fn next_event(&self) -> Cycles {
        let start = self.wiring.rs485.next_start().map_or(NEVER, |at| self.time.cycles(at));
        let host = match self.host.next_event() {
            Nanos::MAX => NEVER,
            at => self.time.cycles(at),
        };
        self.agenda.next_event().min(start).min(self.pins_change()).min(host).max(self.now + 1)
    }

    /// Brings about what happens around a peripheral that has changed.
    fn follow(&mut self, unit: PeripheralName) {
        match unit {
            PeripheralName::GpioA
            | PeripheralName::GpioB
            | PeripheralName::GpioC
            | PeripheralName::GpioD
            | PeripheralName::GpioE => self.connect(unit),
            PeripheralName::Rcc => self.change_clocks(),
            PeripheralName::Flash => self.check_flash(),
            PeripheralName::Spi1 => self.exchange(SpiBus::Motion, 0),
            PeripheralName::Spi3 => self.exchange(SpiBus::Eeprom, 2),
            PeripheralName::Usart3 => {
                if let Some(frame) = self.peripherals.usarts[2].take_sent() {
                    self.wiring.transmit(frame, &self.peripherals.ports, &self.time);
                }
                if self.peripherals.usarts[2].bit_time().is_some() {
                    self.wiring.use_rs485(&self.peripherals.ports);
                }
            }
            PeripheralName::Adc1 => self.convert(),
            PeripheralName::OtgFs => self.host.notice(self.time.nanos(self.now), &self.peripherals.otg),
            PeripheralName::Can1 if !self.wiring.has_can(&self.peripherals.ports) => {
                if self.peripherals.can.takes_part() {
                    self.wiring.use_can(&self.peripherals.ports);
                }
                self.peripherals.can.disconnect();
            }
            _ => {}
        }
        if self.peripherals.exti.watched() != 0 && unit.decides_on_pins() {
            self.watch_pins();
        }
    }

    fn refresh(&mut self, unit: PeripheralName) {
        self.agenda.refresh(unit, self.peripherals.of(unit));
    }

    /// Advances the board to the present.
    pub(super) fn sync(&mut self) {
        let now = self.time.nanos(self.now);
        self.wiring.board.advance_to(now);
    }
}

#[cfg(test)]
mod tests;
