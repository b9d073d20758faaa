//! The parts of a machine, and what it is connected to, between two runs.

use std::fmt;
use std::ops::{Deref, DerefMut};

use super::Machine;
use crate::board::Board;
use crate::clock::Nanos;
use crate::mcu::can::{Can, CanFrame};
use crate::mcu::peripheral::Peripheral;
use crate::mcu::pinout::Pin;
use crate::mcu::rs485::Rs485;
use crate::mcu::serial::Incoming;
use crate::mcu::soc::Soc;
use crate::mcu::unit::PeripheralName;
use crate::mcu::usb::UsbHost;
use crate::mcu::wiring::Wiring;

/// A part of a [`Machine`] at the present time: to look at, and to change.
pub struct Part<'a, T> {
    soc: &'a mut Soc,
    of: fn(&Soc) -> &T,
    /// Sees to it that the rest of the machine notices the change.
    of_mut: fn(&mut Soc) -> &mut T,
}

impl<T> Deref for Part<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        (self.of)(self.soc)
    }
}

impl<T> DerefMut for Part<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        (self.of_mut)(self.soc)
    }
}

impl<T: fmt::Debug> fmt::Debug for Part<'_, T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        (**self).fmt(f)
    }
}

/// How much of what others send has not begun to arrive yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waiting {
    /// Bytes on the RS485 bus.
    pub rs485: usize,
    /// Bytes over USB.
    pub usb: usize,
    /// Frames on the CAN bus.
    pub can: usize,
}

/// Bit rates that the module has set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BitRates {
    /// At which it listens and sends on the RS485 bus; none while its port is off.
    pub rs485: Option<u32>,
    /// On the CAN bus; none while it takes no part in the traffic.
    pub can: Option<u32>,
}

impl Machine {
    /// The board.
    pub fn board(&mut self) -> Part<'_, Board> {
        if self.powered {
            self.soc.settle(self.execution.now);
            self.soc.sync();
        }
        Part { soc: &mut self.soc, of: Soc::board, of_mut: Soc::board_mut }
    }

    /// The wiring of the microcontroller's pins.
    pub fn wiring(&mut self) -> Part<'_, Wiring> {
        Part { soc: &mut self.soc, of: |soc| &soc.wiring, of_mut: |soc| &mut soc.wiring }
    }

    /// The RS485 bus.
    pub fn rs485(&mut self) -> Part<'_, Rs485> {
        Part { soc: &mut self.soc, of: |soc| &soc.wiring.rs485, of_mut: |soc| &mut soc.wiring.rs485 }
    }

    /// The CAN bus with the module's controller.
    pub fn can(&mut self) -> Part<'_, Can> {
        let of_mut: fn(&mut Soc) -> &mut Can = |soc| {
            soc.peripherals.can.advance(soc.now);
            soc.agenda.touch(PeripheralName::Can1);
            &mut soc.peripherals.can
        };
        Part { soc: &mut self.soc, of: |soc| &soc.peripherals.can, of_mut }
    }

    /// The USB cable with the host at its other end.
    pub fn usb(&mut self) -> Part<'_, UsbHost> {
        Part { soc: &mut self.soc, of: |soc| &soc.host, of_mut: |soc| &mut soc.host }
    }

    /// How much of what others send has not begun to arrive yet.
    pub fn waiting(&self) -> Waiting {
        let soc = &self.soc;
        Waiting { rs485: soc.wiring.rs485.waiting(), usb: soc.host.waiting(), can: soc.peripherals.can.waiting() }
    }

    /// Bit rates that the module has set.
    pub fn bit_rates(&self) -> BitRates {
        let soc = &self.soc;
        let hz = soc.time.hz();
        let rate = |bit: Option<u64>| bit.filter(|_| self.powered).map(|bit| (hz / bit.max(1)) as u32);
        let [_, _, rs485] = &soc.peripherals.usarts;
        BitRates { rs485: rate(rs485.bit_time()), can: rate(soc.peripherals.can.bit_time()) }
    }
}

impl Part<'_, Wiring> {
    /// The level to which the microcontroller itself drives a pin as an output; none while it leaves the pin to others.
    pub fn driven(&self, (port, pin): Pin) -> Option<bool> {
        let Soc { wiring, peripherals, .. } = &*self.soc;
        peripherals.ports.get(port)?.output(pin).filter(|_| wiring.board.is_powered())
    }

    /// The level to which the microcontroller itself drives ENN; none while it leaves the pin to a resistor.
    pub fn enable_pin(&self) -> Option<bool> {
        self.driven(self.soc.wiring.disable_pin())
    }
}

impl Part<'_, Rs485> {
    /// Others send bytes, one after the other, from now on. Gives the time at which the last stop bit ends.
    pub fn send(&mut self, bytes: &[u8], baud: u32) -> Nanos {
        self.send_at(0, bytes, baud)
    }

    /// Others send bytes, one after the other, the first not before `at`. Gives the time at which the last stop bit
    /// ends.
    pub fn send_at(&mut self, at: Nanos, bytes: &[u8], baud: u32) -> Nanos {
        let start = at.max(self.soc.present());
        for &byte in bytes {
            self.push(Incoming::byte(start, byte, baud));
        }
        self.last_end().unwrap_or(at)
    }

    /// Others bring `bits` levels (at most 128) to the bus, from the lowest of `levels` on, `baud` of them a second,
    /// not before `at`: a break, or noise. The first one is to be low. Gives the time at which the last one ends.
    pub fn send_levels(&mut self, at: Nanos, levels: u128, bits: u32, baud: u32) -> Nanos {
        let start = at.max(self.soc.present());
        self.push(Incoming { start, levels, bits: bits.min(128), baud });
        self.last_end().unwrap_or(at)
    }
}

impl Part<'_, Can> {
    /// Frames that the module has sent since the last call, with the times of their ends.
    pub fn take_sent(&mut self) -> Vec<(Nanos, CanFrame)> {
        let sent = self.soc.peripherals.can.take_ended();
        sent.into_iter().map(|(frame, at)| (self.soc.time.nanos(at), frame)).collect()
    }
}

impl Part<'_, UsbHost> {
    /// Plugs the cable in or out. The host at its other end enumerates the module and opens its serial port.
    pub fn plug(&mut self, on: bool) {
        let Soc { host, peripherals, agenda, time, now, .. } = &mut *self.soc;
        host.set_plugged(time.nanos(*now), on, &mut peripherals.otg);
        agenda.touch(PeripheralName::OtgFs);
    }

    /// The host resets the port, enumerates the module and opens its serial port, as one that starts anew: what was
    /// half said is lost.
    pub fn reset(&mut self) {
        let Soc { host, peripherals, agenda, time, now, .. } = &mut *self.soc;
        host.start_anew(time.nanos(*now), &mut peripherals.otg);
        agenda.touch(PeripheralName::OtgFs);
    }
}
