//! The bridges: whether they drive the motor, and what shuts them down (11).

use super::registers::{
    Registers,
    address::{CHOPCONF, DRV_CONF},
};
use crate::chip::bits::field;

/// Temperature in degrees Celsius from which the over-temperature pre-warning is on.
pub(super) const PREWARNING_CELSIUS: i32 = 120;
/// Temperatures from which the bridges are shut down, by OTSELECT (6.1).
const SHUTDOWN_CELSIUS: [i32; 4] = [150, 143, 136, 120];
/// The lowest supply voltage at which the charge pump keeps the bridges working, in 0.1 V: the "lower supply voltage"
/// of 28.1.
const LOWEST_SUPPLY: u16 = 80;

/// Either bridge, with the coil at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// Coil A.
    A,
    /// Coil B.
    B,
}

/// The potential that a bridge is shorted to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Short {
    /// Ground: s2ga, s2gb.
    Ground,
    /// The supply: s2vsa, s2vsb.
    Supply,
}

/// Bits of CHOPCONF that switch the protection off, in the order of [`Short`].
const UNPROTECTED: [u32; 2] = [30, 31];
/// The flags of the shorts in DRV_STATUS, by short and bridge.
const FLAGS: [[u32; 2]; 2] = [[27, 28], [12, 13]];

/// The bridges, with what is wrong at them.
#[derive(Debug)]
pub(super) struct Bridges {
    disable_pin: bool,
    temperature: i32,
    supply: u16,
    /// By short and bridge.
    shorts: [[bool; 2]; 2],
    open: [bool; 2],
    /// The shorts that have shut the bridges down.
    shut: [[bool; 2]; 2],
    overheated: bool,
    on: bool,
}

/// Events at the bridges, for GSTAT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Trouble {
    /// Whether the bridges have been shut down.
    pub(super) shut_down: bool,
    /// The charge pump has too little voltage.
    pub(super) undervoltage: bool,
}

impl Bridges {
    pub(super) fn new() -> Self {
        Self {
            disable_pin: true,
            temperature: 25,
            supply: 240,
            shorts: [[false; 2]; 2],
            open: [false; 2],
            shut: [[false; 2]; 2],
            overheated: false,
            on: false,
        }
    }

    /// Forgets what has shut the bridges down.
    pub(super) fn reset(&mut self) {
        self.shut = [[false; 2]; 2];
        self.overheated = false;
    }

    pub(super) fn set_disable_pin(&mut self, high: bool) {
        self.disable_pin = high;
    }

    pub(super) fn disable_pin(&self) -> bool {
        self.disable_pin
    }

    /// Sets the temperature in degrees Celsius. Returns whether it is another one.
    pub(super) fn set_temperature(&mut self, celsius: i32) -> bool {
        std::mem::replace(&mut self.temperature, celsius) != celsius
    }

    /// Sets the supply in 0.1 V. Returns whether it is another one.
    pub(super) fn set_supply(&mut self, supply: u16) -> bool {
        std::mem::replace(&mut self.supply, supply) != supply
    }

    pub(super) fn set_short(&mut self, bridge: Bridge, short: Short, on: bool) {
        self.shorts[short as usize][bridge as usize] = on;
    }

    pub(super) fn set_open(&mut self, bridge: Bridge, on: bool) {
        self.open[bridge as usize] = on;
    }

    /// Whether the bridges drive the motor.
    pub(super) fn on(&self) -> bool {
        self.on
    }

    /// Whether the motor can make torque of its current: it cannot turn on one coil.
    pub(super) fn connected(&self) -> bool {
        self.open == [false; 2]
    }

    /// Whether over-temperature keeps the bridges off.
    pub(super) fn overheated(&self) -> bool {
        self.overheated
    }

    /// Recomputes what depends on registers, pins and faults.
    pub(super) fn update(&mut self, registers: &Registers) -> Trouble {
        let before = (self.shut, self.overheated);
        let enabled = !self.disable_pin && registers.field(CHOPCONF, 0, 4) != 0;
        let undervoltage = self.supply < LOWEST_SUPPLY;
        for (short, (shut, present)) in self.shut.iter_mut().zip(self.shorts).enumerate() {
            let protected = !registers.bit(CHOPCONF, UNPROTECTED[short]);
            for (shut, present) in shut.iter_mut().zip(present) {
                // "The flags stay active, until the driver is disabled by software (TOFF=0) or by the ENN input."
                *shut = enabled && (*shut || present && protected && !undervoltage);
            }
        }
        let limit = SHUTDOWN_CELSIUS[field(registers.get(DRV_CONF), 16, 2) as usize];
        self.overheated = self.temperature >= limit || self.overheated && self.temperature >= PREWARNING_CELSIUS;
        self.on = enabled && !undervoltage && !self.overheated && self.shut == [[false; 2]; 2];
        let newly_shut = self.shut.iter().flatten().zip(before.0.iter().flatten()).any(|(now, before)| now & !before);
        Trouble { shut_down: newly_shut || self.overheated && !before.1, undervoltage }
    }

    /// The flags of DRV_STATUS (6.5.5). Those of open load show injected faults only: the real ones give false alarms
    /// at standstill and at speed.
    pub(super) fn flags(&self) -> u32 {
        let mut flags = u32::from(self.overheated) << 25 | u32::from(self.temperature >= PREWARNING_CELSIUS) << 26;
        for (shut, bits) in self.shut.iter().zip(FLAGS) {
            for (shut, bit) in shut.iter().zip(bits) {
                flags |= u32::from(*shut) << bit;
            }
        }
        for (open, bit) in self.open.iter().zip([29, 30]) {
            flags |= u32::from(*open && self.on) << bit;
        }
        flags
    }
}
