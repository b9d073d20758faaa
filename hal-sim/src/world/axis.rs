//! The surroundings of one axis: its motor, the stage on it with switches or an encoder, and a recording of the motion.

use super::config::{self, AxisConfig};
use super::motor::Motor;
use super::pin::Pin;
use super::stage::Stage;
use super::trace::Trace;
use crate::board::kind::{AbnPins, BoardKind};
use crate::clock::Nanos;

/// The surroundings of one axis.
#[derive(Clone, Debug)]
pub struct Axis {
    motor: Motor,
    stage: Stage,
    trace: Option<Trace>,
}

impl Axis {
    pub(super) fn new(kind: &BoardKind, config: &AxisConfig) -> Self {
        let mut motor = Motor::new(config.motor(kind), config.motor.start);
        motor.set_load(config::torque(config.motor.load));
        let tracks_at_switches = kind.abn == AbnPins::Switches;
        let abn = config.abn.clone();
        let stage = Stage::new(&config.stage, abn, tracks_at_switches, config.units_per_turn(), motor.rotor());
        Self { motor, stage, trace: None }
    }

    /// The motor.
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The stage: its pins and the ABN counter.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Presses or releases a switch by hand, whatever the stage does.
    pub fn press(&mut self, pin: Pin, pressed: bool) {
        self.stage.press(pin, pressed);
    }

    /// Presses or releases a switch by hand so that its pin has this level, unless the stage presses it.
    pub fn set_level(&mut self, pin: Pin, high: bool) {
        self.stage.set_level(pin, high);
    }

    /// Sets the external load on the motor, a torque as a fraction of that of the motor at full current: 0.0 is none,
    /// 1.0 stalls the motor at full current. With less current less stalls it.
    pub fn set_load(&mut self, load: f64) {
        self.motor.set_load(config::torque(load));
    }

    /// Moves the rotor by full steps without the motor's steps, see [`Motor::slip`].
    pub fn slip(&mut self, full_steps: i64, now: Nanos) {
        self.motor.slip(full_steps);
        self.moved(now);
    }

    /// Starts a recording of the rotor. `interval` is as in [`Trace::new`], in nanoseconds.
    pub fn start_trace(&mut self, interval: Nanos, now: Nanos) {
        self.trace = Some(Trace::new(interval));
        self.moved(now);
    }

    /// The recording so far; `None` if none was started.
    pub fn trace(&self) -> Option<&Trace> {
        self.trace.as_ref()
    }

    /// Ends the recording and returns it.
    pub fn take_trace(&mut self) -> Option<Trace> {
        self.trace.take()
    }

    pub(crate) fn motor_mut(&mut self) -> &mut Motor {
        &mut self.motor
    }

    /// Moves the motor after the driver has moved its field to `field` (1/256 full steps) by a step at `at`.
    #[inline]
    pub(crate) fn follow(&mut self, at: Nanos, field: i64) {
        self.motor.follow(at, field);
        self.moved(at);
    }

    /// How far the field may move up or down, in 1/256 full steps, before anything but the positions of field and rotor
    /// changes. The value is 0 if the motor is to be told of each step.
    #[inline]
    pub(crate) fn free_way(&self, up: bool) -> i64 {
        if self.trace.is_some() { 0 } else { self.clear_way(up) }
    }

    /// As [`free_way`](Self::free_way), but for the recording of the motion.
    pub(crate) fn clear_way(&self, up: bool) -> i64 {
        self.motor.free_way(up).min(self.stage.free_way(self.motor.rotor(), up))
    }

    /// Moves the motor on to `now` after time without steps. Returns whether the rotor moved.
    #[inline]
    pub(crate) fn settle(&mut self, now: Nanos) -> bool {
        let moved = self.motor.settle(now);
        if moved {
            self.moved(now);
        }
        moved
    }

    /// The levels of the stop switches in the order of the TMC429's REFERENCE_SWITCHES: bit 0 right, bit 1 left.
    #[inline]
    pub(crate) fn reference_pins(&self) -> u8 {
        const LEFT: u8 = Pin::Left.bit();
        const RIGHT: u8 = Pin::Right.bit();
        let pins = self.stage.pins();
        u8::from(pins & RIGHT != 0) | u8::from(pins & LEFT != 0) << 1
    }

    /// The level of the pin that a switch is connected to.
    #[inline]
    pub fn level(&self, pin: Pin) -> bool {
        self.stage.pins() & pin.bit() != 0
    }

    /// Whether the level of this pin can change when the rotor moves.
    pub fn moves(&self, pin: Pin) -> bool {
        self.stage.moving_pins() & pin.bit() != 0
    }

    #[inline]
    fn moved(&mut self, at: Nanos) {
        let rotor = self.motor.rotor();
        self.stage.move_to(rotor);
        if let Some(trace) = &mut self.trace {
            trace.record(at, rotor, self.motor.field());
        }
    }
}
