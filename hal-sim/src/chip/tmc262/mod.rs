//! The driver stage: TMC262, configured by SPI, moved by step pulses.
//!
//! From the datasheets of the TMC26x family:
//! - A datagram has 20 bits, MSB first; the response leaves in the same 20 clocks. Hosts send 24 clocks with four
//!   leading zeros. What counts is the last 20 bits in. As the shift register is 20 bits long, a host reads the
//!   response in the upper 20 of its 24 bits. The register is written when chip select rises; fewer than 20 clocks
//!   write nothing.
//! - The response is captured when chip select falls, in the format that RDSEL of the DRVCONF written
//!   before selects.
//! - All registers are zero after power-on: bridges off (TOFF = 0), 256 microsteps, current scale 1/32.
//!
//! Decisions where the datasheet is silent: a high level at DIR counts the microstep pointer up. A full step is 256
//! microsteps, and MRES changes keep the pointer where it is. INTPOL has no effect (the field moves with each pulse,
//! not between them). A step pulse has two edges, so that with DEDGE it moves two microsteps. The open load bits show
//! injected faults only (the real ones give false alarms at standstill and at speed). OT falls as soon as the
//! temperature is below its threshold again.

use super::SpiSlave;
use super::bits::{field, sign_extend};
use super::load::{CoolStep, LoadRatio, Response, StallGuard, Threshold};
use crate::clock::{Nanos, SECOND};

/// Frequency of the chip's internal oscillator in Hz (typical).
pub const CLOCK_HZ: u64 = 15_000_000;
/// Without a step for 2^20 clocks the chip reports standstill: 69.9 ms.
pub const STANDSTILL: Nanos = (1 << 20) * SECOND / CLOCK_HZ;
/// Microsteps in an electrical period: four full steps of 256.
pub const PERIOD: i64 = 1024;
/// Temperature in degrees Celsius from which the over-temperature pre-warning is on.
pub const PREWARNING_CELSIUS: i32 = 100;
/// Temperature in degrees Celsius from which the bridges are shut down.
pub const SHUTDOWN_CELSIUS: i32 = 150;

/// The five configuration words as last written, 20 bits each with their register addresses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Registers {
    /// Driver control: step resolution in step/direction mode, coil currents in SPI mode.
    pub drvctrl: u32,
    /// Chopper configuration; its four lowest bits are TOFF.
    pub chopconf: u32,
    /// coolStep configuration.
    pub smarten: u32,
    /// stallGuard2 threshold and filter, current scale.
    pub sgcsconf: u32,
    /// Driver configuration: RDSEL, VSENSE, SDOFF, protection.
    pub drvconf: u32,
}

/// Either bridge, with the coil at it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Bridge {
    /// Coil A.
    A,
    /// Coil B.
    B,
}

/// The chip.
#[derive(Clone, Debug)]
pub struct Tmc262 {
    registers: Registers,
    supplied: bool,
    disabled: bool,
    temperature: i32,
    short: [bool; 2],
    open: [bool; 2],
    shorted: [bool; 2],
    bridges_on: bool,
    /// Microsteps per pulse: those per active edge, times the edges of a pulse; 0 in SPI mode.
    microsteps: i64,
    field: i64,
    pointer: i64,
    /// Length of the current vector given by SPI mode, 0..=248; 248 in step/direction mode.
    amplitude: u32,
    last_step: Option<Nanos>,
    stall_guard: StallGuard,
    cool_step: CoolStep,
    shift: u32,
    bits: u32,
}

const COIL_FULL_SCALE: u32 = 248;

impl Tmc262 {
    /// A chip right after power-on, with its pin ENN high (disabled), at 25 degrees Celsius. `response` is what
    /// stallGuard2 makes of the motor's load, and `seed` the start of the random numbers for its noise.
    pub fn new(response: Response, seed: u64) -> Self {
        let mut chip = Self {
            registers: Registers::default(),
            supplied: true,
            disabled: true,
            temperature: 25,
            short: [false; 2],
            open: [false; 2],
            shorted: [false; 2],
            bridges_on: false,
            microsteps: 1,
            field: 0,
            pointer: 0,
            amplitude: COIL_FULL_SCALE,
            last_step: None,
            stall_guard: StallGuard::new(response, seed),
            cool_step: CoolStep::default(),
            shift: 0,
            bits: 0,
        };
        chip.reset();
        chip
    }

    /// Resets the chip as at power-on: registers and microstep pointer are zero, and the field jumps to the nearest
    /// angle with pointer zero.
    pub fn reset(&mut self) {
        self.registers = Registers::default();
        self.shorted = [false; 2];
        self.last_step = None;
        self.stall_guard.reset();
        self.cool_step.reset();
        self.pointer = 0;
        self.amplitude = COIL_FULL_SCALE;
        self.turn_field_to(0);
        self.update();
    }

    /// Takes one pulse on the step input at `at` with level `dir` on the direction input (true counts up). Returns
    /// whether the field has passed a full step; if so, the caller calls [`take_reading`](Self::take_reading).
    #[inline]
    pub fn step(&mut self, at: Nanos, dir: bool) -> bool {
        self.last_step = Some(at);
        let before = self.field;
        let delta = if dir { self.microsteps } else { -self.microsteps };
        self.pointer = (self.pointer + delta) & (PERIOD - 1);
        self.field += delta;
        before >> 8 != self.field >> 8
    }

    /// How many pulses with this level on the direction input there may be before one passes a full step.
    #[inline]
    pub fn steps_to_full_step(&self, dir: bool) -> u32 {
        let within = self.field & 0xFF;
        let way = if dir { 0xFF - within } else { within };
        // In SPI mode pulses do not move the field.
        way.checked_div(self.microsteps).map_or(u32::MAX, |steps| steps as u32)
    }

    /// How many pulses there may be before one moves the field further than `way`, in 1/256 full steps.
    #[inline]
    pub fn steps_on(&self, way: i64) -> u32 {
        way.checked_div(self.microsteps).map_or(u32::MAX, |steps| steps.clamp(0, u32::MAX.into()) as u32)
    }

    /// Takes so many pulses at once, of which the last comes at `at`, and which do not pass a full step.
    #[inline]
    pub fn skip(&mut self, at: Nanos, dir: bool, steps: u32) {
        self.last_step = Some(at);
        let way = self.microsteps * i64::from(steps);
        let delta = if dir { way } else { -way };
        self.pointer = (self.pointer + delta) & (PERIOD - 1);
        self.field += delta;
    }

    /// Measures stallGuard2 at the end of a full step, at `at`, with `load` on the motor, and lets coolStep react.
    pub fn take_reading(&mut self, at: Nanos, load: LoadRatio) {
        let sgcsconf = self.registers.sgcsconf;
        let threshold = Threshold { sgt: sign_extend(field(sgcsconf, 8, 7), 7), filtered: field(sgcsconf, 16, 1) == 1 };
        if let Some(reading) = self.stall_guard.measure(at, load, threshold, self.bridges_on) {
            self.cool_step.adapt(reading, self.registers.smarten, field(sgcsconf, 0, 5));
        }
    }

    /// The angle of the field that the coil currents make, in 1/256 full steps since the first power-on. Steps in
    /// positive direction count up, and 1024 are an electrical period.
    #[inline]
    pub fn field(&self) -> i64 {
        self.field
    }

    /// The configuration words as last written.
    pub fn registers(&self) -> Registers {
        self.registers
    }

    /// True if the bridges drive the motor: they are enabled by ENN and TOFF, and not shut down by a short or by
    /// temperature.
    pub fn bridges_on(&self) -> bool {
        self.bridges_on
    }

    /// The effective motor current in 1/32 of the full scale that VSENSE selects, 0 with the bridges off. It is what
    /// coolStep leaves of CS + 1, times the amplitude in SPI mode.
    #[inline]
    pub fn current(&self) -> u32 {
        if self.bridges_on { (self.cool_step.scale() + 1) * self.amplitude / COIL_FULL_SCALE } else { 0 }
    }

    /// The current of which the motor can make torque, in 1/32: as [`current`](Self::current), but 0 with an open coil,
    /// because a motor cannot turn on one coil.
    #[inline]
    pub fn torque_current(&self) -> u32 {
        if self.open == [false; 2] { self.current() } else { 0 }
    }

    /// The stallGuard2 value that was last measured, 0..=1023.
    pub fn stall_guard(&self) -> u16 {
        self.stall_guard.value()
    }

    /// The output pin SG_TST: high while the motor is being stepped and the stallGuard2 value is zero.
    pub fn stall_pin(&self, now: Nanos) -> bool {
        self.bridges_on && self.stall_guard.value() == 0 && !self.stands_still(now)
    }

    /// Sets the input pin ENN: high switches the bridges off.
    pub fn set_disable_pin(&mut self, high: bool) {
        self.disabled = high;
        self.update();
    }

    /// The level of the input pin ENN.
    pub fn disable_pin(&self) -> bool {
        self.disabled
    }

    /// Sets the temperature of the chip, in degrees Celsius.
    pub fn set_temperature(&mut self, celsius: i32) {
        self.temperature = celsius;
        self.update();
    }

    /// Tells the chip whether its motor supply is high enough for it to work (5 V). Without it the chip is held in
    /// reset and its SPI output reads zero.
    pub fn set_supplied(&mut self, supplied: bool) {
        if self.supplied && !supplied {
            self.supplied = false;
            self.reset();
        }
        self.supplied = supplied;
        self.update();
    }

    /// Fault injection: a short to ground at one bridge.
    pub fn set_short(&mut self, bridge: Bridge, on: bool) {
        self.short[bridge as usize] = on;
        self.update();
    }

    /// Fault injection: a coil that is not connected.
    pub fn set_open(&mut self, bridge: Bridge, on: bool) {
        self.open[bridge as usize] = on;
    }

    /// The time at which the flag of standstill comes, if the motor is not stepped until then; `None` if it is there.
    pub fn standstill(&self) -> Option<Nanos> {
        self.last_step.map(|last| last + STANDSTILL)
    }

    /// Whether coolStep is switched on, so that the current follows the load.
    pub fn cool_steps(&self) -> bool {
        field(self.registers.smarten, 0, 4) != 0
    }

    /// The number of microsteps in a pulse; 0 in SPI mode.
    pub fn microsteps(&self) -> i64 {
        self.microsteps
    }

    fn stands_still(&self, now: Nanos) -> bool {
        self.last_step.is_none_or(|last| now.saturating_sub(last) >= STANDSTILL)
    }

    fn step_dir_mode(&self) -> bool {
        field(self.registers.drvconf, 7, 1) == 0
    }

    /// Recomputes what depends on registers, pins and faults.
    fn update(&mut self) {
        let registers = &self.registers;
        let enabled = self.supplied && !self.disabled && field(registers.chopconf, 0, 4) != 0;
        let protected = field(registers.drvconf, 10, 1) == 0;
        for (latched, short) in self.shorted.iter_mut().zip(self.short) {
            *latched = enabled && (*latched || short && protected);
        }
        let overheated = self.temperature >= SHUTDOWN_CELSIUS;
        self.bridges_on = enabled && self.shorted == [false; 2] && !overheated;
        self.microsteps = if self.step_dir_mode() {
            let resolution = field(registers.drvctrl, 0, 4).min(8);
            (1 << resolution) << field(registers.drvctrl, 8, 1)
        } else {
            0
        };
    }

    /// Moves the field to the nearest angle that is `pointer` within an electrical period.
    fn turn_field_to(&mut self, pointer: i64) {
        let forward = (pointer - self.field).rem_euclid(PERIOD);
        self.field += if forward > PERIOD / 2 { forward - PERIOD } else { forward };
    }

    /// In SPI mode, sets the field by the coil currents. Coil A is the sine, coil B the cosine of the pointer.
    fn apply_coil_currents(&mut self) {
        let word = self.registers.drvctrl;
        let coil = |sign, low| {
            let amount = f64::from(field(word, low, 8).min(COIL_FULL_SCALE));
            if field(word, sign, 1) == 1 { -amount } else { amount }
        };
        let (a, b) = (coil(17, 9), coil(8, 0));
        self.amplitude = (a.hypot(b).round() as u32).min(COIL_FULL_SCALE);
        if self.amplitude > 0 {
            let turn = a.atan2(b) / core::f64::consts::TAU;
            self.turn_field_to((turn * PERIOD as f64).round() as i64);
        }
    }

    fn write(&mut self, word: u32) {
        let was_step_dir = self.step_dir_mode();
        match word >> 17 {
            0b000 | 0b001 => self.registers.drvctrl = word,
            0b100 => self.registers.chopconf = word,
            0b101 => self.registers.smarten = word,
            0b110 => self.registers.sgcsconf = word,
            0b111 => self.registers.drvconf = word,
            _ => {} // No register has 01 in its two highest bits.
        }
        if !self.step_dir_mode() {
            self.apply_coil_currents();
        } else if !was_step_dir {
            self.amplitude = COIL_FULL_SCALE;
            self.turn_field_to(self.pointer);
        }
        self.cool_step.limit(self.registers.smarten, field(self.registers.sgcsconf, 0, 5));
        self.update();
    }

    fn response(&self, now: Nanos) -> u32 {
        let sg = u32::from(self.stall_guard.value());
        let value = match field(self.registers.drvconf, 4, 2) {
            0 => self.pointer as u32,
            1 => sg,
            2 => sg >> 5 << 5 | self.cool_step.scale(),
            _ => 0, // RDSEL 3 is not defined for this part.
        };
        let flags = [
            self.stall_pin(now),
            self.temperature >= SHUTDOWN_CELSIUS,
            self.temperature >= PREWARNING_CELSIUS,
            self.shorted[0],
            self.shorted[1],
            self.open[0] && self.bridges_on,
            self.open[1] && self.bridges_on,
            self.stands_still(now),
        ];
        let flags = flags.iter().rev().fold(0, |bits, &flag| bits << 1 | u32::from(flag));
        value << 10 | flags
    }
}

impl SpiSlave for Tmc262 {
    fn select(&mut self, now: Nanos) {
        self.shift = if self.supplied { self.response(now) } else { 0 };
        self.bits = 0;
    }

    fn byte(&mut self, mosi: u8) -> u8 {
        let miso = (self.shift >> 12) as u8;
        self.shift = (self.shift << 8 | u32::from(mosi)) & 0xF_FFFF;
        self.bits += 8;
        miso
    }

    fn deselect(&mut self, _now: Nanos) {
        if self.bits >= 20 && self.supplied {
            self.write(self.shift);
        }
        self.bits = 0;
    }
}

#[cfg(test)]
mod tests;
