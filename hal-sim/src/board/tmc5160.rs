//! A TMC5160 for each motor: stop switches and ABN encoder of the axis are at its own inputs. The drivers' enable pin
//! and the clock are common to all.

use super::chips::{MotionChips, Observed, Prospect, Surroundings};
use super::kind::{BoardKind, Chip};
use crate::chip::load::LoadRatio;
use crate::chip::tmc5160::{Bridge, Short, Tmc5160};
use crate::chip::{Mechanics, Sensed, SpiSlave, Tracks};
use crate::clock::Nanos;
use crate::fault::Fault;
use crate::world::Axis;
use crate::world::config::WorldConfig;
use crate::world::pin::Pin;

/// Clock of the TMC5160s, in Hz.
const CLOCK_HZ: u32 = 16_000_000;
/// A temperature in degrees Celsius at which the chip shuts its bridges down, whatever OTSELECT says.
const TOO_HOT: i32 = 150;

/// The chips, by axis.
#[derive(Debug)]
pub(super) struct Tmc5160s(Vec<Drive>);

/// The chip of an axis.
#[derive(Debug)]
struct Drive {
    chip: Tmc5160,
    /// Fault: it is too hot.
    overtemperature: bool,
    /// Fault: it does not hear its chip select.
    deaf: bool,
    /// Fault: its own supply has failed.
    unsupplied: bool,
}

/// A motor with what it drives, at the coils and inputs of a chip.
struct Motor<'a>(&'a mut Axis);

/// Gives what the chip of an axis finds at its inputs.
#[inline]
fn sensed(axis: &Axis) -> Sensed {
    Sensed { left: axis.level(Pin::Left), right: axis.level(Pin::Right), count: axis.stage().abn().count }
}

fn tracks(axis: &Axis, count: i64) -> Tracks {
    let [a, b, n] = axis.stage().tracks(count);
    Tracks { a, b, n }
}

impl Mechanics for Motor<'_> {
    #[inline]
    fn turn(&mut self, at: Nanos, field: i64) -> Sensed {
        self.0.follow(at, field);
        sensed(self.0)
    }

    #[inline]
    fn free_way(&self, up: bool) -> i64 {
        self.0.free_way(up)
    }

    fn energise(&mut self, current: u32) {
        self.0.motor_mut().set_current(current);
    }

    fn load(&self) -> LoadRatio {
        self.0.motor().load_ratio()
    }

    fn tracks(&self, count: i64) -> Tracks {
        tracks(self.0, count)
    }
}

impl Tmc5160s {
    pub(super) fn new(kind: &BoardKind, config: &WorldConfig, axes: &[Axis], seed: u64) -> Self {
        let drives = (0..kind.axes()).zip(axes).map(|(number, axis)| {
            let response = config.axis(number).motor.response();
            let mut chip = Tmc5160::new(response, seed.wrapping_add(number as u64));
            chip.set_external_clock(Some(CLOCK_HZ));
            let count = axis.stage().abn().count;
            chip.plug_encoder(count, tracks(axis, count));
            Drive { chip, overtemperature: false, deaf: false, unsupplied: false }
        });
        Self(drives.collect())
    }

    /// The chip of an axis.
    pub(super) fn tmc5160(&self, axis: usize) -> Option<&Tmc5160> {
        self.0.get(axis).map(|drive| &drive.chip)
    }
}

impl MotionChips for Tmc5160s {
    #[inline]
    fn advance(&mut self, to: Nanos, axes: &mut [Axis]) {
        for (drive, axis) in self.0.iter_mut().zip(axes) {
            if !drive.chip.rest(to) {
                drive.chip.advance(to, &mut Motor(axis));
            }
        }
    }

    fn next_due(&self) -> Nanos {
        self.0.iter().map(|drive| drive.chip.next_event().unwrap_or(Nanos::MAX)).min().unwrap_or(Nanos::MAX)
    }

    /// The chips are reset when they are told of their supply.
    fn power_off(&mut self) {
        self.set_disable_pin(true);
    }

    fn power_on(&mut self, now: Nanos, axes: &mut [Axis]) {
        self.set_clock(now, true);
        for (drive, axis) in self.0.iter_mut().zip(axes) {
            let count = axis.stage().abn().count;
            drive.chip.plug_encoder(count, tracks(axis, count));
            axis.motor_mut().restart(drive.chip.field());
        }
    }

    fn set_disable_pin(&mut self, high: bool) {
        for drive in &mut self.0 {
            drive.chip.set_disable_pin(high);
        }
    }

    /// Without the clock the chips run on their internal ones.
    fn set_clock(&mut self, now: Nanos, running: bool) {
        for drive in &mut self.0 {
            drive.chip.rest(now);
            drive.chip.set_external_clock(running.then_some(CLOCK_HZ));
        }
    }

    fn connect(&mut self, number: usize, axis: &mut Axis, around: Surroundings) {
        let Some(Drive { chip, overtemperature, unsupplied, .. }) = self.0.get_mut(number) else { return };
        chip.rest(around.now);
        chip.set_supply(if *unsupplied { 0 } else { around.supply });
        chip.set_temperature(around.temperature.max(if *overtemperature { TOO_HOT } else { i32::MIN }));
        let motor = axis.motor_mut();
        motor.set_current(chip.torque_current());
        motor.turn_field(around.now, chip.field());
    }

    fn sense(&mut self, now: Nanos, axes: &[Axis]) {
        for (Drive { chip, .. }, axis) in self.0.iter_mut().zip(axes) {
            chip.rest(now);
            chip.sense(sensed(axis), |count| tracks(axis, count));
        }
    }

    #[inline]
    fn slave(&mut self, chip: Chip, now: Nanos) -> Option<&mut dyn SpiSlave> {
        let Chip::Tmc5160(axis) = chip else { return None };
        let drive = self.0.get_mut(axis).filter(|drive| !drive.deaf)?;
        drive.chip.rest(now);
        Some(&mut drive.chip)
    }

    fn deafness(&mut self, chip: Chip) -> Option<&mut bool> {
        let Chip::Tmc5160(axis) = chip else { return None };
        self.0.get_mut(axis).map(|drive| &mut drive.deaf)
    }

    fn set_fault(&mut self, fault: Fault, number: usize, _: &Axis, on: bool, _: Nanos) {
        let Some(drive) = self.0.get_mut(number) else { return };
        match fault {
            Fault::ShortA => drive.chip.set_short(Bridge::A, Short::Ground, on),
            Fault::ShortB => drive.chip.set_short(Bridge::B, Short::Ground, on),
            Fault::OpenA => drive.chip.set_open(Bridge::A, on),
            Fault::OpenB => drive.chip.set_open(Bridge::B, on),
            Fault::Overtemperature => drive.overtemperature = on,
            Fault::ChipSupply => drive.unsupplied = on,
            _ => {}
        }
    }

    fn observe(&self, number: usize, _: &Axis, _: Nanos) -> Observed {
        let chip = &self.0[number].chip;
        Observed {
            position: chip.position(),
            velocity: chip.velocity(),
            bridges_on: chip.bridges_on(),
            current: chip.current(),
            stall_guard: chip.stall_guard(),
            encoder: 0,
        }
    }

    fn prospect(&self, number: usize, _now: Nanos) -> Prospect {
        let chip = &self.0[number].chip;
        if chip.stands() {
            return Prospect::Rests(chip.next_event().unwrap_or(Nanos::MAX));
        }
        match chip.cruise() {
            Some((up, steps, microsteps)) => Prospect::Turns { steps, microsteps, up },
            None => Prospect::Changes,
        }
    }

    fn time_of_step(&self, number: usize, step: u64) -> Nanos {
        self.0[number].chip.time_of_step(step)
    }

    /// The chip has no such pin.
    fn stall_pin(&self, _number: usize, _now: Nanos) -> bool {
        false
    }
}
