//! Between the peripherals and what the pins are connected to: levels, words on SPI, start bits, conversions.

use super::Soc;
use crate::clock::{MICROSECOND, Nanos};
use crate::mcu::gpio::Gpio;
use crate::mcu::peripheral::{Cycles, NEVER, Peripheral};
use crate::mcu::unit::PeripheralName;
use crate::mcu::wiring::SpiBus;

/// How long the channels inside the chip have to be sampled (table 70 of the datasheet).
const INNER_SAMPLING: Nanos = 10 * MICROSECOND;

impl Soc {
    /// When a pin may change next that an external interrupt line looks at.
    pub(super) fn pins_change(&self) -> Cycles {
        let watched = self.peripherals.exti.watched();
        let moves = |line| self.wiring.moves((self.peripherals.syscfg.port(line as usize), line));
        let change = if lines_of(watched).any(moves) { self.wiring.board.next_event() } else { None };
        change.map_or(NEVER, |at| self.time.cycles(at))
    }

    /// Brings the levels of the pins to the board.
    pub(super) fn connect(&mut self, unit: PeripheralName) {
        self.sync();
        if let Err(reason) = self.wiring.connect(self.now, &self.peripherals.ports, self.clocks.mco1, &self.time) {
            let description = unit.description();
            self.refuse(description.name, 0, description.base, None, reason);
        }
    }

    /// A word has been clocked out on a bus.
    pub(super) fn exchange(&mut self, bus: SpiBus, index: usize) {
        let Some(word) = self.peripherals.spis[index].take_done() else { return };
        self.wiring.board.advance_to(self.time.nanos(word.at));
        let mode = self.peripherals.spis[index].mode();
        match self.wiring.exchange(bus, &self.peripherals.ports, mode, word, &self.time) {
            Ok(miso) => self.peripherals.spis[index].complete(miso),
            Err(reason) => {
                let base = if index == 0 { PeripheralName::Spi1 } else { PeripheralName::Spi3 }.description();
                self.refuse(base.name, 0, base.base, None, reason);
            }
        }
    }

    /// Start bits on the RS485 bus that are due.
    pub(super) fn hear(&mut self) {
        let now = self.time.nanos(self.now);
        while let Some(start) = self.wiring.rs485.next_start()
            && self.time.cycles(start) <= self.now
        {
            let connected = self.wiring.hears_rs485(&self.peripherals.ports);
            if let Some(edge) = self.wiring.rs485.hear(now.max(start), connected, &self.time) {
                self.peripherals.usarts[2].advance(self.now);
                self.peripherals.usarts[2].receive(edge);
                self.agenda.touch(PeripheralName::Usart3);
            }
        }
    }

    /// Shows the external interrupt lines the pins they look at.
    pub(super) fn watch_pins(&mut self) {
        self.sync();
        self.wiring.drive(&mut self.peripherals.ports);
        let ports = self.peripherals.ports.each_ref().map(Gpio::levels);
        let levels = (0..16).fold(0, |levels, line| {
            let port = ports.get(self.peripherals.syscfg.port(line)).copied().unwrap_or(0);
            levels | port & 1 << line
        });
        self.peripherals.exti.set_levels(levels);
        self.refresh(PeripheralName::Exti);
    }

    /// The converter has sampled a channel.
    pub(super) fn convert(&mut self) {
        let Some(channel) = self.peripherals.adc.take_done() else { return };
        self.sync();
        if channel >= 16 && self.peripherals.adc.sampling(channel) < self.time.span(INNER_SAMPLING) {
            let base = PeripheralName::Adc1.description().base;
            self.refuse("ADC1", 0, base, None, "the channels inside the chip want 10 us to be sampled");
        }
        let connected = channel < 16 || self.peripherals.adc.inner_channels();
        let value = if connected { self.wiring.convert(channel) } else { 0 };
        self.peripherals.adc.complete(value);
    }
}

/// The lines in a set, from the lowest on.
fn lines_of(mut set: u32) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        let line = (set != 0).then(|| set.trailing_zeros())?;
        set &= set - 1;
        Some(line)
    })
}
