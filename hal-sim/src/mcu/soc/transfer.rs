//! The data that the DMA controllers move between peripherals and memory.

use super::Soc;
use crate::mcu::dma::Item;
use crate::mcu::peripheral::Peripheral;
use crate::mcu::unit::PeripheralName;

impl Soc {
    /// Moves the items that DMA streams are asked for.
    pub(super) fn transfer(&mut self) {
        let controllers = [PeripheralName::Dma1, PeripheralName::Dma2];
        for (index, controller) in controllers.into_iter().enumerate() {
            loop {
                let item = self.peripherals.dmas[index].items().find(|item| self.asks(item));
                let Some(item) = item else { break };
                if !self.carry(item) {
                    return;
                }
                self.peripherals.dmas[index].step(item.stream);
                self.agenda.touch(item.unit);
                self.agenda.touch(controller);
            }
        }
    }

    /// Whether the peripheral of an item asks for it.
    fn asks(&self, item: &Item) -> bool {
        let requests = match item.unit {
            PeripheralName::Spi1 => self.peripherals.spis[0].requests(),
            PeripheralName::Spi2 => self.peripherals.spis[1].requests(),
            PeripheralName::Spi3 => self.peripherals.spis[2].requests(),
            PeripheralName::Usart1 => self.peripherals.usarts[0].requests(),
            PeripheralName::Usart2 => self.peripherals.usarts[1].requests(),
            PeripheralName::Usart3 => self.peripherals.usarts[2].requests(),
            PeripheralName::Adc1 => self.peripherals.adc.requests(),
            _ => return false,
        };
        if item.transmit { requests.transmit } else { requests.receive }
    }

    /// Moves an item between a data register and memory; false if that cannot be.
    fn carry(&mut self, item: Item) -> bool {
        let description = item.unit.description();
        let offset = item.register.wrapping_sub(description.base);
        let mut bytes = [0; 4];
        let cells = bytes.get_mut(..item.bytes);
        let (Some(sram), Some(cells)) = (&self.sram, cells) else { return false };
        let moved = if item.transmit {
            let loaded = sram.read(item.memory, cells);
            let value = u32::from_le_bytes(bytes);
            loaded.and_then(|()| self.peripherals.of(item.unit).write(offset, value).ok())
        } else {
            let sram = sram.clone();
            let value = self.peripherals.of(item.unit).read(offset);
            let bytes = value.unwrap_or(0).to_le_bytes();
            value.ok().and_then(|_| sram.write(item.memory, bytes.get(..item.bytes)?))
        };
        if moved.is_none() {
            self.refuse(description.name, offset, item.memory, None, "DMA does not reach this memory or register");
        }
        moved.is_some()
    }
}
