//! TMC429s, each with up to three motors, and a TMC262 for each motor. The TMC429 steps the TMC262, whose field turns
//! the motor. The stop switches of the axis are at the reference inputs of that motor.

use super::chips::{MotionChips, Observed, Prospect, Surroundings};
use super::kind::{BoardKind, Chip};
use crate::chip::encoder::MagneticEncoder;
use crate::chip::tmc262::{Bridge, SHUTDOWN_CELSIUS, Tmc262};
use crate::chip::tmc429::Tmc429;
use crate::chip::{SpiSlave, StepDir};
use crate::clock::Nanos;
use crate::fault::Fault;
use crate::world::Axis;
use crate::world::config::{EncoderTable, WorldConfig};

/// Clock of the TMC429s, in Hz.
pub const TMC429_CLOCK_HZ: u32 = 16_000_000;
/// The lowest supply voltage at which a TMC262 works, in units of 0.1 V.
const DRIVER_SUPPLY: u16 = 50;
/// The levels of reference inputs of a TMC429 to which nothing is wired: REFR2 and REFR3 have pull-up resistors in the
/// chip and read high, the others low.
const UNWIRED: u8 = 0b01_0100;

/// The chips.
#[derive(Debug)]
pub(super) struct Tmc429sTmc262s {
    controllers: Vec<Controller>,
    drives: Vec<Drive>,
}

/// A motion controller.
#[derive(Debug)]
struct Controller {
    chip: Tmc429,
    /// The number of the axis of the controller's first motor, and the number of its axes.
    first: usize,
    axes: usize,
    /// Levels of the controller's reference inputs, in the order of its register REFERENCE_SWITCHES.
    pins: u8,
    /// Fault: the controller does not hear its chip select.
    deaf: bool,
}

/// The driver of an axis, and the built-in encoder at its motor.
#[derive(Debug)]
struct Drive {
    chip: Tmc262,
    encoder: MagneticEncoder,
    /// Fault: the driver is too hot.
    overtemperature: bool,
    /// Fault: the driver does not hear its chip select.
    deaf: bool,
}

/// The connections of a TMC429's step/direction outputs and reference inputs. The first axis is that of its motor 0.
struct Wiring<'a> {
    drives: &'a mut [Drive],
    axes: &'a mut [Axis],
    pins: &'a mut u8,
}

impl Wiring<'_> {
    /// Sets the two reference inputs of a motor to the levels of its stop switches.
    #[inline]
    fn connect(pins: &mut u8, motor: usize, axis: &Axis) {
        *pins = *pins & !(0b11 << (2 * motor)) | axis.reference_pins() << (2 * motor);
    }
}

impl StepDir for Wiring<'_> {
    #[inline]
    fn step(&mut self, at: Nanos, motor: usize, dir_pin: bool) -> u8 {
        if let (Some(drive), Some(axis)) = (self.drives.get_mut(motor), self.axes.get_mut(motor)) {
            let driver = &mut drive.chip;
            let full_step = driver.step(at, dir_pin);
            axis.follow(at, driver.field());
            if full_step {
                let load = axis.motor().load_ratio();
                driver.take_reading(at, load);
                axis.motor_mut().set_current(driver.torque_current());
            }
            Self::connect(self.pins, motor, axis);
        }
        *self.pins
    }

    #[inline]
    fn free_steps(&self, motor: usize, dir_pin: bool) -> u32 {
        let (Some(drive), Some(axis)) = (self.drives.get(motor), self.axes.get(motor)) else { return u32::MAX };
        let way = axis.free_way(dir_pin);
        drive.chip.steps_to_full_step(dir_pin).min(drive.chip.steps_on(way))
    }

    #[inline]
    fn skip(&mut self, at: Nanos, motor: usize, dir_pin: bool, steps: u32) {
        if let (Some(drive), Some(axis)) = (self.drives.get_mut(motor), self.axes.get_mut(motor)) {
            drive.chip.skip(at, dir_pin, steps);
            axis.follow(at, drive.chip.field());
        }
    }
}

impl Controller {
    fn new(first: usize, axes: usize) -> Self {
        Self { chip: Tmc429::new(TMC429_CLOCK_HZ), first, axes, pins: UNWIRED, deaf: false }
    }

    fn advance(&mut self, to: Nanos, drives: &mut [Drive], axes: &mut [Axis]) {
        let (chip, mut wiring) = self.wired(drives, axes);
        chip.advance(to, &mut wiring);
    }

    /// The chip, and what is connected to it.
    fn wired<'a>(&'a mut self, drives: &'a mut [Drive], axes: &'a mut [Axis]) -> (&'a mut Tmc429, Wiring<'a>) {
        let own = self.first..self.first + self.axes;
        (&mut self.chip, Wiring { drives: &mut drives[own.clone()], axes: &mut axes[own], pins: &mut self.pins })
    }
}

impl Tmc429sTmc262s {
    pub(super) fn new(kind: &BoardKind, config: &WorldConfig, seed: u64) -> Self {
        let firsts = (0..kind.axes()).filter(|axis| kind.motor(*axis).is_some_and(|(_, motor)| motor == 0));
        let controllers = firsts.zip(kind.controllers).map(|(first, &axes)| Controller::new(first, axes));
        let drives = (0..kind.axes()).map(|axis| {
            let (config, seed) = (config.axis(axis), seed.wrapping_add(axis as u64));
            let EncoderTable { offset, noise } = config.encoder;
            Drive {
                chip: Tmc262::new(config.motor.response(), seed),
                encoder: MagneticEncoder::new(config.units_per_turn(), offset, noise, seed),
                overtemperature: false,
                deaf: false,
            }
        });
        Self { controllers: controllers.collect(), drives: drives.collect() }
    }

    /// The motion controller of a number.
    pub(super) fn tmc429(&self, number: usize) -> Option<&Tmc429> {
        self.controllers.get(number).map(|controller| &controller.chip)
    }

    /// The motion controller of an axis, and the number of its motor there.
    fn motor(&self, axis: usize) -> Option<(&Tmc429, usize)> {
        let own = |controller: &&Controller| (controller.first..controller.first + controller.axes).contains(&axis);
        let controller = self.controllers.iter().find(own)?;
        Some((&controller.chip, axis - controller.first))
    }

    /// The driver of an axis.
    pub(super) fn tmc262(&self, axis: usize) -> Option<&Tmc262> {
        self.drives.get(axis).map(|drive| &drive.chip)
    }
}

impl MotionChips for Tmc429sTmc262s {
    #[inline]
    fn advance(&mut self, to: Nanos, axes: &mut [Axis]) {
        for controller in &mut self.controllers {
            if !controller.chip.rest(to) {
                controller.advance(to, &mut self.drives, axes);
            }
        }
    }

    fn next_due(&self) -> Nanos {
        let due = self.controllers.iter().map(|controller| controller.chip.next_event().unwrap_or(Nanos::MAX));
        due.min().unwrap_or(Nanos::MAX)
    }

    fn next_pressing(&mut self, axes: &mut [Axis]) -> Nanos {
        let pressing = self.controllers.iter_mut().map(|controller| {
            let (chip, wiring) = controller.wired(&mut self.drives, axes);
            chip.next_pressing(&wiring)
        });
        pressing.min().unwrap_or(Nanos::MAX)
    }

    fn ignores_steps(&self, chip: Chip, first: u8) -> bool {
        let Chip::Tmc429(number) = chip else { return false };
        self.controllers.get(number).is_some_and(|controller| controller.chip.ignores_steps(first))
    }

    fn power_off(&mut self) {
        for drive in &mut self.drives {
            drive.chip.set_disable_pin(true);
            drive.chip.reset();
        }
    }

    fn power_on(&mut self, now: Nanos, axes: &mut [Axis]) {
        for controller in &mut self.controllers {
            *controller = Controller { deaf: controller.deaf, ..Controller::new(controller.first, controller.axes) };
            controller.advance(now, &mut self.drives, axes);
        }
        for (drive, axis) in self.drives.iter().zip(axes) {
            axis.motor_mut().restart(drive.chip.field());
        }
    }

    fn set_disable_pin(&mut self, high: bool) {
        for drive in &mut self.drives {
            drive.chip.set_disable_pin(high);
        }
    }

    /// Without a clock the TMC429s stand still.
    fn set_clock(&mut self, now: Nanos, running: bool) {
        for controller in &mut self.controllers {
            controller.chip.rest(now);
            controller.chip.set_clocked(now, running);
        }
    }

    fn connect(&mut self, number: usize, axis: &mut Axis, around: Surroundings) {
        let Some(drive) = self.drives.get_mut(number) else { return };
        drive.chip.set_supplied(around.supply >= DRIVER_SUPPLY);
        let hot = if drive.overtemperature { SHUTDOWN_CELSIUS } else { i32::MIN };
        drive.chip.set_temperature(around.temperature.max(hot));
        let motor = axis.motor_mut();
        motor.set_current(drive.chip.torque_current());
        motor.turn_field(around.now, drive.chip.field());
    }

    fn sense(&mut self, now: Nanos, axes: &[Axis]) {
        for controller in &mut self.controllers {
            let axes = &axes[controller.first..controller.first + controller.axes];
            for (motor, axis) in axes.iter().enumerate() {
                Wiring::connect(&mut controller.pins, motor, axis);
            }
            controller.chip.rest(now);
            controller.chip.set_reference_pins(controller.pins);
        }
    }

    #[inline]
    fn slave(&mut self, chip: Chip, now: Nanos) -> Option<&mut dyn SpiSlave> {
        match chip {
            Chip::Tmc429(number) => {
                let controller = self.controllers.get_mut(number).filter(|controller| !controller.deaf)?;
                controller.chip.rest(now);
                Some(&mut controller.chip)
            }
            Chip::Tmc262(axis) => {
                let drive = self.drives.get_mut(axis).filter(|drive| !drive.deaf)?;
                Some(&mut drive.chip)
            }
            Chip::Tmc5160(_) | Chip::At25 => None,
        }
    }

    fn deafness(&mut self, chip: Chip) -> Option<&mut bool> {
        match chip {
            Chip::Tmc429(number) => self.controllers.get_mut(number).map(|controller| &mut controller.deaf),
            Chip::Tmc262(axis) => self.drives.get_mut(axis).map(|drive| &mut drive.deaf),
            Chip::Tmc5160(_) | Chip::At25 => None,
        }
    }

    fn set_fault(&mut self, fault: Fault, number: usize, axis: &Axis, on: bool, now: Nanos) {
        let Some(drive) = self.drives.get_mut(number) else { return };
        match fault {
            Fault::ShortA => drive.chip.set_short(Bridge::A, on),
            Fault::ShortB => drive.chip.set_short(Bridge::B, on),
            Fault::OpenA => drive.chip.set_open(Bridge::A, on),
            Fault::OpenB => drive.chip.set_open(Bridge::B, on),
            Fault::Overtemperature => drive.overtemperature = on,
            Fault::Encoder => drive.encoder.set_stuck(on, axis.motor().rotor(), now),
            _ => {}
        }
    }

    fn observe(&self, number: usize, axis: &Axis, now: Nanos) -> Observed {
        let of = |read: fn(&Tmc429, usize) -> i32| {
            self.motor(number).map_or(0, |(controller, motor)| read(controller, motor))
        };
        let Drive { chip, encoder, .. } = &self.drives[number];
        Observed {
            position: of(Tmc429::position),
            velocity: of(Tmc429::velocity),
            bridges_on: chip.bridges_on(),
            current: chip.current(),
            stall_guard: chip.stall_guard(),
            encoder: encoder.position(axis.motor().rotor(), now),
        }
    }

    fn prospect(&self, number: usize, now: Nanos) -> Prospect {
        let Drive { chip: driver, encoder, .. } = &self.drives[number];
        let Some((controller, motor)) = self.motor(number).filter(|_| encoder.is_quiet()) else {
            return Prospect::Changes;
        };
        if controller.stands(motor) {
            let standstill = driver.standstill().filter(|at| *at > now);
            return Prospect::Rests(standstill.unwrap_or(Nanos::MAX));
        }
        match controller.cruise(motor) {
            Some((up, steps)) if !driver.cool_steps() => {
                let microsteps = driver.microsteps().unsigned_abs();
                Prospect::Turns { steps, microsteps, up: controller.direction_pin(up) }
            }
            _ => Prospect::Changes,
        }
    }

    fn time_of_step(&self, number: usize, step: u64) -> Nanos {
        self.motor(number).map_or(Nanos::MAX, |(controller, motor)| controller.time_of_step(motor, step))
    }

    fn stall_pin(&self, number: usize, now: Nanos) -> bool {
        self.drives[number].chip.stall_pin(now)
    }
}
