//! TMC429, the motion controller: three ramp generators with position counters, step/direction outputs and
//! reference switch inputs behind an SPI register file. Written from the datasheet, rev. 2.04, whose
//! sections the comments cite.
//!
//! Time inside the chip counts in ticks, periods of CLK/32. Both programmable dividers are taken as taps of
//! one counter that runs from power-on: ramp ticks are the multiples of 2^RAMP_DIV, pulse ticks those of
//! 2^PULSE_DIV. The datasheet leaves the order of events within a tick open. Here, in each tick:
//!
//! 1. the switch inputs are looked at as they were before the tick: interrupts on edges, latch, stop;
//! 2. on a pulse tick the pulse generator adds the velocity that the tick before left, and may step;
//! 3. on a ramp tick the ramp generator changes the velocity, knowing the position after that step;
//! 4. comparators and interrupts follow from the new position; a motor that may stop on its target does.
//!
//! Motors act in the order of their numbers. A written register is effective from the next tick on, and so
//! is a switch that a step closes.
//!
//! Where the datasheet is silent:
//!
//! * xEQt is the plain comparison of the position registers, also while the target is passed at speed;
//!   pos_end is its rising edge, in every mode of motion.
//! * A stop switch stops, and keeps from starting, in every mode of motion, hold_mode included.
//! * The tolerance around the origin applies to both switches (8.1.14 names no side); 0 excludes nothing.
//! * Interrupts for switches see the level after inv_ref, and ref_wrong and ref_miss are set when their
//!   conditions begin to hold.
//! * A step that comes while the pulse before is still high is lost for the driver. The counter has it, the pin shows
//!   no edge (8.2.4, "the step pulse timing must be compatible"). Power-on STPDIV is 15, 16 us.
//! * The delay of the first pulse after a change of direction (10.1) and the polarity of pulses (inv_stp)
//!   only shift steps by a pulse length and are left out. With step_half each edge is handed out as a step.
//! * In step/direction mode no datagram goes to a driver chain: a cover datagram waits, and CDGW stays set,
//!   until en_sd is cleared. The chain itself is only timed, nothing is connected to it.
//! * V_ACTUAL can be written in every mode, as 12.2 does.

mod axis;
mod global;
mod ramp;
mod registers;

#[cfg(test)]
mod tests;

use super::ticks::TickClock;
use super::{SpiSlave, StepDir};
use crate::clock::Nanos;
use axis::{Axis, NEVER};
use global::Global;
use registers::{axis as axis_register, common};

/// Number of axes of the chip.
const MOTORS: usize = 3;
/// Periods of CLK in a tick.
const CYCLES_PER_TICK: u64 = 32;
/// The bits of the six reference switch inputs.
const SWITCH_PINS: u8 = 0x3F;
/// Number of bytes in a datagram; one of any other length does nothing (6.2.1).
const DATAGRAM_BYTES: usize = 4;
/// The register address bits of the first byte, RRS and RW (6.2.2.1).
const RAM_SELECT: u8 = 0x80;
const READ: u8 = 0x01;
/// SMDA of the common registers.
const COMMON: usize = 3;
/// Status bits (6.2.2.2); those of motor n are xEQt at bit 2n and its left switch at bit 2n + 1.
const STATUS_INT: u8 = 0x80;
const STATUS_CDGW: u8 = 0x40;

/// The chip, from power-on.
#[derive(Debug)]
pub struct Tmc429 {
    clock: TickClock,
    now: Nanos,
    /// The earliest time of an internal event; the maximum when there is none.
    due: Nanos,
    powered_down: bool,
    /// A clock is at the pin CLK.
    clocked: bool,
    axes: [Axis; MOTORS],
    global: Global,
    /// The levels of the reference switch inputs.
    pins: u8,
    /// The tick of each motor's last pulse that was long enough to get out.
    pulses: [Option<u64>; MOTORS],
    selected: bool,
    /// The number of bytes since select, of which the first four are kept.
    received: usize,
    datagram: [u8; DATAGRAM_BYTES],
    /// The bytes to be shifted out.
    reply: [u8; DATAGRAM_BYTES],
}

impl Tmc429 {
    /// A chip that is powered at time 0, clocked with `clock_hz` (4 to 32 MHz), all switch inputs low.
    pub fn new(clock_hz: u32) -> Self {
        Self {
            clock: TickClock::new(clock_hz, CYCLES_PER_TICK),
            now: 0,
            due: Nanos::MAX,
            powered_down: false,
            clocked: true,
            axes: [Axis::new(), Axis::new(), Axis::new()],
            global: Global::new(),
            pins: 0,
            pulses: [None; MOTORS],
            selected: false,
            received: 0,
            datagram: [0; DATAGRAM_BYTES],
            reply: [0; DATAGRAM_BYTES],
        }
    }

    /// Brings the chip to time `to`. Every step pulse is handed to `load`, which returns the levels of the
    /// reference switch inputs after that step; they act from the next internal tick on.
    pub fn advance(&mut self, to: Nanos, load: &mut impl StepDir) {
        if !self.rest(to) {
            let last = self.clock.tick_at(to);
            self.run(last, load);
            self.global.finish_datagram(last);
            self.now = to;
            self.reschedule();
        }
    }

    /// Tells the chip that it is time `to`. False if something is due in it by then, which [`advance`](Self::advance)
    /// does.
    #[inline]
    pub fn rest(&mut self, to: Nanos) -> bool {
        self.now = self.now.max(to);
        // In power-down, when no clock runs, `due` is the maximum.
        to < self.due
    }

    /// Sets the reference switch inputs after a change without a step. `pins` are levels in the order of the register
    /// REFERENCE_SWITCHES: bit 0 REFR1, 1 REFL1, 2 REFR2, 3 REFL2, 4 REFR3, 5 REFL3.
    pub fn set_reference_pins(&mut self, pins: u8) {
        let pins = pins & SWITCH_PINS;
        if pins != self.pins {
            self.pins = pins;
            self.inputs_changed();
        }
    }

    /// Switches the clock at the pin CLK on or off at `now`, to which the chip has been advanced. Without a clock
    /// nothing moves, and datagrams have no effect.
    pub fn set_clocked(&mut self, now: Nanos, clocked: bool) {
        if clocked == self.clocked {
            return;
        }
        self.clocked = clocked;
        if self.powered_down {
            return;
        }
        if clocked {
            self.clock.resume(now);
        } else {
            self.clock.pause(now);
        }
        self.reschedule();
    }

    /// The earliest time at which anything may change without traffic on SPI or a change at the pins; `None` at rest.
    /// The time is never too late; some events of a ramp cannot be seen from outside.
    pub fn next_event(&self) -> Option<Nanos> {
        (self.due != Nanos::MAX).then_some(self.due)
    }

    /// The earliest time at which anything may happen but steps that change nothing but positions, here and at `load`;
    /// the maximum for never.
    pub fn next_pressing(&self, load: &impl StepDir) -> Nanos {
        if self.due == Nanos::MAX || !self.global.step_direction() {
            return self.due;
        }
        let moving = self.axes.iter().enumerate().filter(|(_, axis)| axis.next() != NEVER);
        let ticks = moving.map(|(motor, axis)| match self.free_steps(motor, load) {
            0 => axis.next(),
            free => axis.tick_of_step(free + 1),
        });
        ticks.chain(self.global.sent_at()).min().map_or(Nanos::MAX, |tick| self.clock.time_of(tick))
    }

    /// Whether a datagram that begins with `first` does and tells the same, whether steps that change nothing but
    /// positions have been made or not. Such a datagram asks for a register that is no position.
    pub fn ignores_steps(&self, first: u8) -> bool {
        let (motor, index) = register_address(first);
        let is_position = motor != COMMON && [axis_register::X_ACTUAL, axis_register::USTEP_COUNT].contains(&index);
        first & READ != 0 && first & RAM_SELECT == 0 && !is_position && !self.powered_down
    }

    /// True if the output nINT_SDO_C signals an interrupt, that is, is low for that reason (1.5.3). Unless sdo_int is
    /// set, this output is the data output while the chip is selected.
    pub fn interrupt_pin(&self) -> bool {
        self.interrupt() && (self.global.interrupt_only() || !self.selected)
    }

    /// True if the output POSCMP is active (8.2.4.1).
    pub fn position_compare_pin(&self) -> bool {
        self.global.compare_matched()
    }

    /// X_ACTUAL of a motor, sign-extended, for observers.
    pub fn position(&self, motor: usize) -> i32 {
        self.axes.get(motor).map_or(0, Axis::position)
    }

    /// V_ACTUAL of a motor, sign-extended, for observers.
    pub fn velocity(&self, motor: usize) -> i32 {
        self.axes.get(motor).map_or(0, Axis::velocity)
    }

    /// True if a motor stands, and will unless it is told otherwise or a switch changes.
    pub fn stands(&self, motor: usize) -> bool {
        self.axes.get(motor).is_none_or(|axis| axis.next() == NEVER)
    }

    /// For a motor that turns at a constant speed: its direction, true up, and the number of steps that it is certain
    /// to make at this speed; `None` for any other.
    pub fn cruise(&self, motor: usize) -> Option<(bool, u64)> {
        let axis = self.axes.get(motor).filter(|axis| axis.free_steps() > 0)?;
        Some((axis.counts_up(), axis.free_steps().into()))
    }

    /// The time at which a motor that turns at a constant speed makes a step, counted from 1, if it does so until then.
    pub fn time_of_step(&self, motor: usize, step: u64) -> Nanos {
        self.axes.get(motor).map_or(Nanos::MAX, |axis| self.clock.time_of(axis.tick_of_step(step)))
    }

    /// The level of the direction output while a motor counts up, or down.
    pub fn direction_pin(&self, up: bool) -> bool {
        self.global.direction_pin(up)
    }

    /// Executes all ticks up to `last`.
    fn run(&mut self, last: u64, load: &mut impl StepDir) {
        while self.next() <= last {
            if self.axes.iter().any(|axis| axis.free_steps_due(last) > 1) && self.global.step_direction() {
                self.skip_steps(last, load);
            }
            let tick = self.next();
            if tick > last {
                return;
            }
            let switches = self.global.switches(self.pins);
            for motor in 0..MOTORS {
                if self.axes[motor].next() == tick {
                    let own = switches >> (2 * motor);
                    if let Some(up) = self.axes[motor].tick(tick, own & 1 != 0, own & 2 != 0) {
                        self.step(motor, up, tick, load);
                    }
                }
            }
        }
    }

    /// The next tick at which something happens to a motor.
    #[inline]
    fn next(&self) -> u64 {
        let [first, second, third] = &self.axes;
        first.next().min(second.next()).min(third.next())
    }

    /// Makes the steps at once that are due by tick `last` and change nothing but positions, up to the first tick at
    /// which something else happens to any motor. Some of the last ones may be left.
    fn skip_steps(&mut self, last: u64, load: &mut impl StepDir) {
        let mut end = last;
        for (motor, axis) in self.axes.iter().enumerate().filter(|(_, axis)| axis.next() <= last) {
            let free = self.free_steps(motor, load);
            if free < axis.free_steps_due(end) || free == 0 {
                end = end.min(axis.tick_of_step(free + 1) - 1);
            }
        }
        for motor in 0..MOTORS {
            let axis = &mut self.axes[motor];
            let steps = axis.free_steps_due(end) as u32;
            if steps > 1 {
                let tick = axis.skip(steps);
                let direction = self.global.direction_pin(axis.counts_up());
                self.pulses[motor] = Some(tick);
                load.skip(self.clock.time_of(tick), motor, direction, steps);
            }
        }
        self.compare_positions();
    }

    /// How many steps of a motor, which are due, change nothing but positions.
    fn free_steps(&self, motor: usize, load: &impl StepDir) -> u64 {
        let axis = &self.axes[motor];
        let free = axis.free_steps();
        if free == 0 || !self.get_out(motor) {
            return 0;
        }
        let compared = if motor == self.global.compare_motor() {
            axis.steps_before(self.global.compare_position())
        } else {
            u32::MAX
        };
        let told = load.free_steps(motor, self.global.direction_pin(axis.counts_up()));
        free.min(compared).min(told).into()
    }

    /// Whether the step pulses of a motor get out: none comes while the one before is still high.
    fn get_out(&self, motor: usize) -> bool {
        let Some(length) = self.global.pulse_cycles() else { return true };
        let axis = &self.axes[motor];
        let first = self.pulses[motor].map_or(u64::MAX, |before| axis.next() - before);
        first.min(axis.shortest_period()).saturating_mul(CYCLES_PER_TICK) >= length
    }

    /// Makes the outputs follow a position counter that has moved.
    fn step(&mut self, motor: usize, up: bool, tick: u64, load: &mut impl StepDir) {
        if motor == self.global.compare_motor() {
            self.compare_positions();
        }
        if !self.global.step_direction() {
            self.global.send_datagram(tick);
            return;
        }
        if let (Some(length), Some(before)) = (self.global.pulse_cycles(), self.pulses[motor])
            && (tick - before) * CYCLES_PER_TICK < length
        {
            return;
        }
        self.pulses[motor] = Some(tick);
        let pins = load.step(self.clock.time_of(tick), motor, self.global.direction_pin(up)) & SWITCH_PINS;
        if pins != self.pins {
            self.pins = pins;
            for axis in &mut self.axes {
                axis.inputs_changed(tick);
            }
        }
    }

    /// Notes that the switches may read differently from the next tick on.
    fn inputs_changed(&mut self) {
        let tick = self.clock.tick_at(self.now);
        for axis in &mut self.axes {
            axis.inputs_changed(tick);
        }
        self.reschedule();
    }

    fn compare_positions(&mut self) {
        let position = self.axes.get(self.global.compare_motor()).map(Axis::position);
        self.global.compare(position.map(|position| position.cast_unsigned() & axis_register::POSITION_MASK));
    }

    fn reschedule(&mut self) {
        let next = self.next().min(self.global.sent_at().unwrap_or(NEVER));
        self.due =
            if self.powered_down || !self.clocked || next == NEVER { Nanos::MAX } else { self.clock.time_of(next) };
    }

    fn interrupt(&self) -> bool {
        self.global.interrupt() || self.axes.iter().any(Axis::interrupt)
    }

    /// The status byte that goes ahead of each reply (6.2.2.2).
    fn status(&self) -> u8 {
        let switches = self.global.switches(self.pins);
        let mut status = 0;
        if self.interrupt() {
            status |= STATUS_INT;
        }
        if self.global.datagram_waiting() {
            status |= STATUS_CDGW;
        }
        for (motor, axis) in self.axes.iter().enumerate() {
            status |= u8::from(axis.at_target()) << (2 * motor);
            status |= switches & 2 << (2 * motor);
        }
        status
    }

    /// The 24 data bits at the address in the first byte of a datagram.
    fn read(&mut self, first: u8) -> u32 {
        if first & RAM_SELECT != 0 {
            return self.global.read_ram(ram_address(first));
        }
        let (motor, index) = register_address(first);
        if motor == COMMON {
            return self.global.read(index, self.pins);
        }
        self.axes.get_mut(motor).map_or(0, |axis| {
            // Between events nothing that can be read changes but the velocity.
            if axis.ramps() {
                axis.sync(self.clock.tick_at(self.now));
            }
            axis.read(index)
        })
    }

    fn write(&mut self, first: u8, data: u32) {
        if first & RAM_SELECT != 0 {
            self.global.write_ram(ram_address(first), data);
            return;
        }
        let tick = self.clock.tick_at(self.now);
        let (motor, index) = register_address(first);
        if let Some(axis) = self.axes.get_mut(motor) {
            axis.write(index, data, tick);
        } else {
            let switches = self.global.switches(self.pins);
            self.global.write(index, data, tick);
            if self.global.switches(self.pins) != switches {
                self.inputs_changed();
            }
            self.powered_down = index == common::POWER_DOWN;
        }
        self.compare_positions();
        self.reschedule();
    }
}

/// The motor (or [`COMMON`]) and the index in the first byte of a register datagram.
fn register_address(first: u8) -> (usize, u8) {
    (usize::from(first >> 5 & 3), first >> 1 & 0xF)
}

fn ram_address(first: u8) -> u8 {
    first >> 1 & 0x3F
}

impl SpiSlave for Tmc429 {
    /// nSCS_C falls: samples the status, and ends power-down (8.2.4.3).
    fn select(&mut self, now: Nanos) {
        self.received = 0;
        if !self.clocked {
            return;
        }
        if self.powered_down {
            self.powered_down = false;
            self.clock.resume(now);
            self.reschedule();
        }
        self.selected = true;
        self.reply = [self.status(), 0, 0, 0];
    }

    fn byte(&mut self, mosi: u8) -> u8 {
        let mut byte = [mosi];
        self.bytes(&mut byte);
        let [miso] = byte;
        miso
    }

    /// The first byte holds the address, so a read answers in the same datagram (6.2).
    fn bytes(&mut self, bytes: &mut [u8]) {
        if !self.clocked {
            return bytes.fill(0);
        }
        if let (0, Some(&first)) = (self.received, bytes.first())
            && first & READ != 0
        {
            let [_, high, middle, low] = self.read(first).to_be_bytes();
            self.reply = [self.reply[0], high, middle, low];
        }
        // A whole datagram at once, as nearly all of them come.
        if let (0, Ok(datagram)) = (self.received, <&mut [u8; DATAGRAM_BYTES]>::try_from(&mut *bytes)) {
            (self.datagram, self.received) = (*datagram, DATAGRAM_BYTES);
            *datagram = self.reply;
            return;
        }
        for byte in bytes {
            let miso = self.reply.get(self.received).copied().unwrap_or(0);
            if let Some(slot) = self.datagram.get_mut(self.received) {
                *slot = *byte;
            }
            self.received = self.received.saturating_add(1);
            *byte = miso;
        }
    }

    /// nSCS_C rises: a datagram of 32 bits takes effect.
    fn deselect(&mut self, now: Nanos) {
        self.selected = false;
        let [first, high, middle, low] = self.datagram;
        if self.received == DATAGRAM_BYTES && first & READ == 0 && self.clocked {
            self.write(first, u32::from_be_bytes([0, high, middle, low]));
            if self.powered_down {
                self.clock.pause(now);
            }
        }
    }
}
