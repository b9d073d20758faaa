//! What is around the module: motor and stage, switches, supply and temperature, and the levels of its
//! outputs. Positions are in 1/256 full steps everywhere; a 200-step motor has 51 200 of them in a turn.

pub mod config;
pub mod motor;
pub mod pin;
pub mod stage;
mod switch;
pub mod trace;

use crate::clock::Nanos;
use config::WorldConfig;
use motor::Motor;
use pin::Pin;
use stage::Stage;
use trace::Trace;

/// Reading of a 12-bit converter at full scale.
pub const ANALOG_MAX: u16 = 4095;
/// From this reading on the analog input counts as high when it is read as a digital one.
const ANALOG_HIGH: u16 = 2048;

/// The levels the module puts out.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// OUT0 and OUT1: true is on.
    pub out: [bool; 2],
    /// Pull-ups of IN1..IN3 (without effect here: the inputs are driven).
    pub pull_ups: bool,
    /// LED1 and LED2: true is lit.
    pub leds: [bool; 2],
}

/// The surroundings of one module.
#[derive(Clone, Debug)]
pub struct World {
    motor: Motor,
    stage: Stage,
    supply: u16,
    temperature: i32,
    analog: u16,
    outputs: Outputs,
    trace: Option<Trace>,
}

impl World {
    /// The world that `config` describes, at rest.
    pub fn new(config: &WorldConfig) -> Self {
        let mut motor = Motor::new(config.motor(), config.motor.start);
        motor.set_load(config::torque(config.motor.load));
        let stage = Stage::new(&config.stage, config.abn.clone(), config.units_per_turn(), motor.rotor());
        Self {
            motor,
            stage,
            supply: tenths(config.supply.volts),
            temperature: config.supply.temperature,
            analog: config.supply.analog.min(ANALOG_MAX),
            outputs: Outputs::default(),
            trace: None,
        }
    }

    /// The motor.
    pub fn motor(&self) -> &Motor {
        &self.motor
    }

    /// The stage: its pins and the ABN counter.
    pub fn stage(&self) -> &Stage {
        &self.stage
    }

    /// Levels of the digital inputs: bit n is INn. IN0 is the analog input read as a digital one.
    pub fn inputs(&self) -> u8 {
        self.stage.pins() << 1 | u8::from(self.analog >= ANALOG_HIGH)
    }

    /// The digital inputs that change with the rotor, in the order of [`inputs`](Self::inputs).
    pub fn moving_inputs(&self) -> u8 {
        self.stage.moving_pins() << 1
    }

    /// Levels of the TMC429's six reference switch pins, in the order of its REFERENCE_SWITCHES register.
    /// IN1 (left) is wired to REFL1 and IN2 (right) to REFR1. Nothing is wired to the others: REFR2 and
    /// REFR3 have pull-ups in the chip and read high, REFL2 and REFL3 low.
    #[inline]
    pub fn reference_pins(&self) -> u8 {
        const OPEN: u8 = 0b01_0100;
        const IN1: u8 = 1;
        const IN2: u8 = 2;
        const REFR1: u8 = 1;
        const REFL1: u8 = 2;
        let pins = self.stage.pins();
        let left = if pins & IN1 != 0 { REFL1 } else { 0 };
        let right = if pins & IN2 != 0 { REFR1 } else { 0 };
        OPEN | left | right
    }

    /// Supply voltage in 0.1 V.
    pub fn supply(&self) -> u16 {
        self.supply
    }

    /// Temperature in degrees Celsius.
    pub fn temperature(&self) -> i32 {
        self.temperature
    }

    /// Reading of the analog input, 0..=4095.
    pub fn analog(&self) -> u16 {
        self.analog
    }

    /// What the module puts out.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// Presses or releases a switch by hand.
    pub fn press(&mut self, pin: Pin, pressed: bool) {
        self.stage.press(pin, pressed);
    }

    /// Presses or releases a switch by hand so that its pin has this level.
    pub fn set_level(&mut self, pin: Pin, high: bool) {
        self.stage.set_level(pin, high);
    }

    /// Sets the supply voltage in volts, rounded to 0.1 V.
    pub fn set_supply(&mut self, volts: f64) {
        self.supply = tenths(volts);
    }

    /// Sets the temperature in degrees Celsius.
    pub fn set_temperature(&mut self, celsius: i32) {
        self.temperature = celsius;
    }

    /// Sets the reading of the analog input, 0..=4095 (higher ones are limited).
    pub fn set_analog(&mut self, reading: u16) {
        self.analog = reading.min(ANALOG_MAX);
    }

    /// Sets the load on the motor: 0.0 free, 1.0 stalls it at full current.
    pub fn set_load(&mut self, load: f64) {
        self.motor.set_load(config::torque(load));
    }

    /// Moves the rotor by full steps against the counter, see [`Motor::slip`].
    pub fn slip(&mut self, full_steps: i64, now: Nanos) {
        self.motor.slip(full_steps);
        self.moved(now);
    }

    /// Starts recording the rotor; see [`Trace::new`] for `interval`.
    pub fn start_trace(&mut self, interval: Nanos, now: Nanos) {
        self.trace = Some(Trace::new(interval));
        self.moved(now);
    }

    /// The recording so far.
    pub fn trace(&self) -> Option<&Trace> {
        self.trace.as_ref()
    }

    /// Ends the recording and hands it out.
    pub fn take_trace(&mut self) -> Option<Trace> {
        self.trace.take()
    }

    pub(crate) fn set_outputs(&mut self, outputs: Outputs) {
        self.outputs = outputs;
    }

    pub(crate) fn motor_mut(&mut self) -> &mut Motor {
        &mut self.motor
    }

    /// The driver has moved its field by a step.
    #[inline]
    pub(crate) fn follow(&mut self, at: Nanos, field: i64) {
        self.motor.follow(at, field);
        self.moved(at);
    }

    /// Time has passed without steps.
    pub(crate) fn settle(&mut self, now: Nanos) {
        if self.motor.settle(now) {
            self.moved(now);
        }
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

fn tenths(volts: f64) -> u16 {
    (volts * 10.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_pins_reach_inputs_and_reference_switches() {
        let mut world = World::new(&WorldConfig::default());
        assert_eq!((world.inputs(), world.reference_pins()), (0, 0b01_0100));
        world.press(Pin::Left, true);
        assert_eq!((world.inputs(), world.reference_pins()), (0b0010, 0b01_0110));
        world.press(Pin::Right, true);
        world.press(Pin::Home, true);
        assert_eq!((world.inputs(), world.reference_pins()), (0b1110, 0b01_0111));
        world.press(Pin::Left, false);
        world.set_analog(2048);
        assert_eq!((world.inputs(), world.reference_pins()), (0b1101, 0b01_0101));
        world.set_analog(5000);
        assert_eq!(world.analog(), 4095);
    }

    #[test]
    fn steps_move_the_stage_and_are_recorded() {
        let config = WorldConfig::parse("[stage]\nright = 10").unwrap();
        let mut world = World::new(&config);
        world.motor_mut().set_current(32);
        world.settle(crate::clock::SECOND);
        world.start_trace(0, crate::clock::SECOND);
        for step in 1..=10_i64 {
            world.follow(2 * crate::clock::SECOND + step as Nanos, step);
            assert_eq!(world.inputs() & 4 != 0, step >= 10);
        }
        assert_eq!(world.take_trace().unwrap().samples().len(), 11);
        assert!(world.trace().is_none());
    }

    #[test]
    fn the_supply_is_rounded_to_tenths() {
        let mut world = World::new(&WorldConfig::default());
        assert_eq!(world.supply(), 240);
        world.set_supply(8.46);
        assert_eq!(world.supply(), 85);
    }
}
