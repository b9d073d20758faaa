//! TMC5160: a motion controller with a six-point ramp, an ABN counter and a driver for one motor, behind an SPI
//! register file. Written from the datasheet, rev. 1.14, whose sections the comments cite.
//!
//! Time inside the chip counts in periods of its clock from power-on. At a clock at which several things are due, the
//! step comes first, then the change of velocity; a step's effects on switches and encoder come with the step.
//!
//! Where the datasheet is silent, or says two things:
//!
//! * Registers that can only be written, and addresses without a register, read 0.
//! * Flags are cleared by writing 1 (6.1, 6.3.2, 6.4), not by reading (4.1.2 and 17.4 say so).
//! * What a read access returns is latched when its own datagram ends, as the status is (4.1.2).
//! * A change of polarity or of swap_lr is no edge: only a change at a pin latches.
//! * VSTART belongs to positioning; velocity mode has only VMAX and AMAX (12.2.3).
//! * The ramp brakes when it must in order to be at VSTOP at the target. Having begun to, it does not accelerate before
//!   a target is written again, also where parameters would now let it (6.3.1, "Hint" of XTARGET).
//! * n_event and the latching of N events need clr_cont or clr_once. With ENCMODE at 0 and no encoder connected an
//!   event would never end, yet ENC_STATUS is 0 after a reset.
//! * After a reset the motor stands still (stst), and its current is that of IHOLD.
//! * DIAG outputs other than interrupt and position compare, UART, step/direction input and direct mode are not
//!   modelled. Neither are the emergency stop of ENCA and the slowing down of dcStep under load. Nothing on the board
//!   uses any of them.

mod access;
mod bridges;
mod driver;
mod encoder;
mod motion;
mod port;
mod ramp;
mod registers;
mod sine;
mod status;
mod switches;
mod thresholds;

#[cfg(test)]
mod tests;

pub use bridges::{Bridge, Short};
pub use port::Refusal;

use super::Tracks;
use super::load::Response;
use super::ticks::TickClock;
use crate::clock::Nanos;
use bridges::Bridges;
use driver::{Driver, State};
use encoder::Encoder;
use port::{Limits, Port};
use ramp::{NEVER, Ramp};
use registers::Registers;
use registers::address::{COOLCONF, SW_MODE};
use switches::{Switches, mode};

/// Frequency of the internal clock, in Hz.
pub const INTERNAL_CLOCK_HZ: u32 = 12_000_000;
/// The lowest supply voltage at which the chip is not in reset, in 0.1 V (28.2, VSA undervoltage threshold).
pub const LOWEST_SUPPLY: u16 = 40;

/// Bits of GSTAT (6.1).
mod gstat {
    pub(super) const RESET: u32 = 1 << 0;
    pub(super) const DRV_ERR: u32 = 1 << 1;
    pub(super) const UV_CP: u32 = 1 << 2;
}

/// The chip, from power-on.
#[derive(Debug)]
pub struct Tmc5160 {
    clock: TickClock,
    /// The frequency at the pin CLK; `None` if the internal clock runs.
    external: Option<u32>,
    now: Nanos,
    /// The earliest time of an internal event; the maximum when there is none.
    due: Nanos,
    supplied: bool,
    registers: Registers,
    gstat: u32,
    ramp: Ramp,
    switches: Switches,
    xlatch: i32,
    /// event_stop_sg.
    stalled: bool,
    encoder: Encoder,
    driver: Driver,
    bridges: Bridges,
    port: Port,
}

impl Tmc5160 {
    /// A chip that is powered at time 0, with its internal clock and its pin DRV_ENN high (disabled), at 25 degrees
    /// Celsius and 24 V, all inputs low. `response` is what stallGuard2 makes of the motor's load,
    /// and `seed` the start of the random numbers for its noise.
    pub fn new(response: Response, seed: u64) -> Self {
        let registers = Registers::new();
        let mut chip = Self {
            clock: TickClock::new(INTERNAL_CLOCK_HZ, 1),
            external: None,
            now: 0,
            due: Nanos::MAX,
            supplied: true,
            gstat: 0,
            ramp: Ramp::new(&registers, 0),
            switches: Switches::default(),
            xlatch: 0,
            stalled: false,
            encoder: Encoder::default(),
            driver: Driver::new(response, seed),
            bridges: Bridges::new(),
            port: Port::default(),
            registers,
        };
        chip.reset();
        chip
    }

    /// Resets the chip as at power-on (25): all registers have their reset values, the field jumps to the nearest angle
    /// with MSCNT 0, and the reset flag is set.
    pub fn reset(&mut self) {
        let clock = self.present();
        self.registers = Registers::new();
        self.gstat = gstat::RESET;
        self.ramp = Ramp::new(&self.registers, clock);
        self.switches.reset();
        self.xlatch = 0;
        self.stalled = false;
        self.encoder.reset();
        self.bridges.reset();
        self.port = Port::default();
        self.driver.reset(&self.registers);
        self.check_bridges();
        self.latch_answer(0);
        self.reschedule();
    }

    /// Brings the chip to time `to`, if nothing happens in it by then, and returns true; else returns false.
    #[inline]
    pub fn rest(&mut self, to: Nanos) -> bool {
        let rests = to < self.due;
        if rests {
            self.now = self.now.max(to);
        }
        rests
    }

    /// The earliest time at which anything may change without traffic on SPI or a change at the pins; `None` at rest.
    /// The time is never too late.
    pub fn next_event(&self) -> Option<Nanos> {
        (self.due != Nanos::MAX).then_some(self.due)
    }

    /// Connects the encoder where it stands, without counting.
    pub fn plug_encoder(&mut self, count: i64, tracks: Tracks) {
        self.encoder.plug(count, tracks);
    }

    /// Switches the clock at the pin CLK, of `hz`, on or off at the time to which the chip was advanced. Without it the
    /// chip runs on its internal clock (26).
    pub fn set_external_clock(&mut self, hz: Option<u32>) {
        if hz != self.external {
            self.external = hz;
            self.clock.set_hz(hz.unwrap_or(INTERNAL_CLOCK_HZ), self.now);
            self.reschedule();
        }
    }

    /// Sets the input pin DRV_ENN: high switches the bridges off.
    pub fn set_disable_pin(&mut self, high: bool) {
        self.bridges.set_disable_pin(high);
        self.check_bridges();
    }

    /// Sets the temperature of the chip, in degrees Celsius.
    pub fn set_temperature(&mut self, celsius: i32) {
        if self.bridges.set_temperature(celsius) {
            self.check_bridges();
        }
    }

    /// Sets the supply in 0.1 V. Below [`LOWEST_SUPPLY`] the chip is held in reset, and its SPI output reads zero.
    pub fn set_supply(&mut self, supply: u16) {
        if !self.bridges.set_supply(supply) {
            return;
        }
        let was_supplied = std::mem::replace(&mut self.supplied, supply >= LOWEST_SUPPLY);
        if was_supplied && !self.supplied {
            self.reset();
        }
        self.check_bridges();
    }

    /// Fault injection: a short at one bridge.
    pub fn set_short(&mut self, bridge: Bridge, short: Short, on: bool) {
        self.bridges.set_short(bridge, short, on);
        self.check_bridges();
    }

    /// Fault injection: a coil that is not connected.
    pub fn set_open(&mut self, bridge: Bridge, on: bool) {
        self.bridges.set_open(bridge, on);
    }

    /// The angle of the field that the coil currents make, in 1/256 full steps since the first power-on; 1024 are an
    /// electrical period.
    #[inline]
    pub fn field(&self) -> i64 {
        self.driver.field()
    }

    /// Whether the bridges drive the motor: they are enabled by DRV_ENN and TOFF, and not shut down.
    pub fn bridges_on(&self) -> bool {
        self.supplied && self.bridges.on()
    }

    /// The effective motor current in 1/32 of the full scale, with GLOBALSCALER; 0 with the bridges off.
    pub fn current(&self) -> u32 {
        self.driver.current(self.state(self.present()))
    }

    /// The current of which the motor can make torque, in 1/32: as [`current`](Self::current), but 0 with an open coil,
    /// because a motor cannot turn on one coil.
    pub fn torque_current(&self) -> u32 {
        self.torque_at(self.present())
    }

    /// The stallGuard2 value that was last measured, 0..=1023.
    pub fn stall_guard(&self) -> u16 {
        self.driver.stall_guard()
    }

    /// XACTUAL, for observers.
    pub fn position(&self) -> i32 {
        self.ramp.position()
    }

    /// VACTUAL, for observers.
    pub fn velocity(&self) -> i32 {
        self.ramp.velocity()
    }

    /// True if the motor stands.
    pub fn stands(&self) -> bool {
        self.ramp.stands()
    }

    /// The motion of a motor that turns at a constant speed, and whose current does not follow the load; `None` for any
    /// other. The first two values are the direction in which the field turns, true up, and the number of steps that it
    /// is certain to make at this speed. The third is how far a step moves the field, in 1/256 full steps.
    pub fn cruise(&self) -> Option<(bool, u64, u64)> {
        let steps = self.ramp.quiet().filter(|_| !self.heeds_load())?;
        Some((self.driver.turns_up(self.ramp.direction() > 0), steps, self.driver.width()))
    }

    /// The time at which a motor that turns at a constant speed makes a step, counted from 1, if it does so until then.
    pub fn time_of_step(&self, step: u64) -> Nanos {
        self.clock.time_of(self.ramp.clock_of_step(step))
    }

    /// Whether coolStep or a stop at a stall is switched on.
    fn heeds_load(&self) -> bool {
        self.registers.field(COOLCONF, 0, 4) != 0 || self.registers.bit(SW_MODE, mode::SG_STOP)
    }

    /// The contents of a register that keeps what was written, for observers.
    pub fn register(&self, address: u8) -> u32 {
        self.registers.get(address)
    }

    /// Why the last of the datagrams that the chip did not understand was refused; `None` if there was none since the
    /// reset.
    pub fn refused(&self) -> Option<Refusal> {
        self.port.refused()
    }

    /// The time for which chip select has to be high between two datagrams, in nanoseconds.
    pub fn select_high(&self) -> Nanos {
        self.limits().high
    }

    /// The present clock.
    fn present(&self) -> u64 {
        self.clock.tick_at(self.now)
    }

    /// As [`torque_current`](Self::torque_current), at `clock`.
    fn torque_at(&self, clock: u64) -> u32 {
        if self.bridges.connected() { self.driver.current(self.state(clock)) } else { 0 }
    }

    fn state(&self, clock: u64) -> State<'_> {
        let speed = self.ramp.velocity().unsigned_abs();
        State { registers: &self.registers, clock, speed, driven: self.bridges_on() }
    }

    fn limits(&self) -> Limits {
        Limits::of(self.external.is_some(), self.external.unwrap_or(INTERNAL_CLOCK_HZ))
    }

    /// Brings the bridges to registers, pins and faults, and GSTAT to what happens to them.
    fn check_bridges(&mut self) {
        let trouble = self.bridges.update(&self.registers);
        if !self.supplied {
            return;
        }
        if trouble.shut_down {
            self.gstat |= gstat::DRV_ERR;
        }
        if trouble.undervoltage {
            self.gstat |= gstat::UV_CP;
        }
    }

    fn reschedule(&mut self) {
        let clock = self.present();
        let change = self.driver.next_change(self.state(clock)).unwrap_or(NEVER);
        let next = self.ramp.next().min(change);
        self.due = if next == NEVER { Nanos::MAX } else { self.clock.time_of(next) };
    }
}
