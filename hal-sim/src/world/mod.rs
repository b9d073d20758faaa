//! The world around a module: motor, stage and switches of each axis, supply and temperature, and the levels of the
//! module's outputs. Positions are in 1/256 full steps everywhere; a 200-step motor has 51 200 of them in a turn.

mod axis;
pub mod config;
pub mod motor;
pub mod pin;
pub mod stage;
mod switch;
pub mod trace;

pub use axis::Axis;

use crate::board::kind::{BoardKind, Input, MOST_ANALOG};
use crate::clock::Nanos;
use config::WorldConfig;

/// The reading of a 12-bit converter at full scale.
pub const ANALOG_MAX: u16 = 4095;
/// The reading from which on an analog input counts as high when it is read as a digital one.
const ANALOG_HIGH: u16 = 2048;

/// The levels that the module puts out: bit n is output n or group n, true is on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Outputs {
    /// The digital outputs, OUT0 and up.
    pub digital: u32,
    /// The groups of pull-ups of the inputs (without effect here: the inputs are driven).
    pub pull_ups: u32,
    /// LED1 and LED2: true is lit.
    pub leds: [bool; 2],
}

impl Outputs {
    /// Whether output `number` is on.
    pub fn is_on(&self, number: u32) -> bool {
        self.digital.checked_shr(number).unwrap_or(0) & 1 != 0
    }
}

/// The surroundings of one module.
#[derive(Clone, Debug)]
pub struct World {
    kind: &'static BoardKind,
    axes: Vec<Axis>,
    supply: u16,
    temperature: i32,
    /// The readings of the analog channels in their order, zero where the board has no more channels.
    analog: [u16; MOST_ANALOG],
    /// The levels of the inputs that are set by hand alone, by their numbers.
    free: u32,
    outputs: Outputs,
}

impl World {
    /// The world that `config` describes around a board, at rest. The analog reading in `config` is that of the first
    /// analog channel; the others read zero.
    pub fn new(kind: &'static BoardKind, config: &WorldConfig) -> Self {
        let mut world = Self {
            kind,
            axes: (0..kind.axes()).map(|axis| Axis::new(kind, config.axis(axis))).collect(),
            supply: tenths(config.supply.volts),
            temperature: config.supply.temperature,
            analog: [0; MOST_ANALOG],
            free: 0,
            outputs: Outputs::default(),
        };
        if let Some(first) = kind.analog().next() {
            world.set_analog(first, config.supply.analog);
        }
        world
    }

    /// The surroundings of all axes.
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// The surroundings of an axis, which the board has to have.
    pub fn axis(&self, axis: usize) -> &Axis {
        &self.axes[axis]
    }

    /// The surroundings of an axis, to be changed. The board has to have this axis.
    pub fn axis_mut(&mut self, axis: usize) -> &mut Axis {
        &mut self.axes[axis]
    }

    pub(crate) fn axes_mut(&mut self) -> &mut [Axis] {
        &mut self.axes
    }

    /// The levels of the digital inputs: bit n is INn. An analog input is high from half of full scale on.
    pub fn inputs(&self) -> u32 {
        let mut analog = self.analog.iter();
        self.kind.inputs.iter().enumerate().fold(self.free, |levels, (number, input)| {
            let high = match *input {
                Input::Free => false,
                Input::Analog => analog.next().is_some_and(|reading| *reading >= ANALOG_HIGH),
                Input::Switch(axis, pin) => self.axes[axis].level(pin),
            };
            levels | u32::from(high) << number
        })
    }

    /// Whether the level of digital input `number` can change when a rotor moves.
    pub fn moves_input(&self, number: usize) -> bool {
        matches!(self.kind.inputs.get(number), Some(Input::Switch(axis, pin)) if self.axes[*axis].moves(*pin))
    }

    /// Supply voltage in 0.1 V.
    pub fn supply(&self) -> u16 {
        self.supply
    }

    /// Temperature in degrees Celsius.
    pub fn temperature(&self) -> i32 {
        self.temperature
    }

    /// Readings of the analog channels in their order, 0..=4095.
    pub fn analog(&self) -> &[u16] {
        let channels = self.kind.analog().count();
        self.analog.get(..channels).unwrap_or(&self.analog)
    }

    #[inline]
    pub(crate) fn analog_channels(&self) -> [u16; MOST_ANALOG] {
        self.analog
    }

    /// The levels that the module puts out.
    pub fn outputs(&self) -> Outputs {
        self.outputs
    }

    /// Sets digital input `number` to a level: presses or releases the switch that is connected to it, or sets the
    /// analog channel to an end of its range. The ENABLE input is set like any other, and is low at the start.
    pub fn set_input(&mut self, number: usize, high: bool) {
        match self.kind.inputs.get(number) {
            None if self.kind.enable_input != Some(number) => {}
            None | Some(Input::Free) => self.free = self.free & !(1 << number) | u32::from(high) << number,
            Some(Input::Analog) => self.set_analog(number, if high { ANALOG_MAX } else { 0 }),
            Some(&Input::Switch(axis, pin)) => self.axes[axis].set_level(pin, high),
        }
    }

    /// Sets the reading of the analog channel of input `number`, 0..=4095 (higher ones are limited).
    pub fn set_analog(&mut self, number: usize, reading: u16) {
        let index = self.kind.analog().position(|channel| channel == number);
        if let Some(channel) = index.and_then(|index| self.analog.get_mut(index)) {
            *channel = reading.min(ANALOG_MAX);
        }
    }

    /// Sets the supply voltage in volts, rounded to 0.1 V.
    pub fn set_supply(&mut self, volts: f64) {
        self.supply = tenths(volts);
    }

    /// Sets the temperature in degrees Celsius.
    pub fn set_temperature(&mut self, celsius: i32) {
        self.temperature = celsius;
    }

    pub(crate) fn set_outputs(&mut self, outputs: Outputs) {
        self.outputs = outputs;
    }

    /// Moves all motors on to `now` after time without steps. Returns whether a rotor moved.
    #[inline]
    pub(crate) fn settle(&mut self, now: Nanos) -> bool {
        let mut moved = false;
        for axis in &mut self.axes {
            moved |= axis.settle(now);
        }
        moved
    }
}

fn tenths(volts: f64) -> u16 {
    (volts * 10.0).round() as u16
}

#[cfg(test)]
mod tests {
    use super::pin::Pin;
    use super::*;
    use crate::board::products::TMCM_1140;

    #[test]
    fn the_pins_and_the_analog_channel_reach_the_inputs() {
        let mut world = World::new(&TMCM_1140, &WorldConfig::default());
        assert_eq!(world.inputs(), 0);
        world.axis_mut(0).press(Pin::Left, true);
        assert_eq!(world.inputs(), 0b0010);
        world.axis_mut(0).press(Pin::Right, true);
        world.axis_mut(0).press(Pin::Home, true);
        assert_eq!(world.inputs(), 0b1110);
        world.axis_mut(0).press(Pin::Left, false);
        world.set_analog(0, 2048);
        assert_eq!(world.inputs(), 0b1101);
        world.set_analog(0, 5000);
        assert_eq!(world.analog(), [4095]);
        world.set_input(3, false);
        world.set_input(0, false);
        assert_eq!((world.inputs(), world.analog()), (0b0100, [0].as_slice()));
    }

    #[test]
    fn inputs_that_nothing_is_connected_to_are_set_by_hand_and_analog_channels_by_their_numbers() {
        static KIND: BoardKind =
            BoardKind { inputs: &[Input::Free, Input::Analog, Input::Free, Input::Analog], ..TMCM_1140 };
        let mut world = World::new(&KIND, &WorldConfig::parse("[supply]\nanalog = 7").unwrap());
        world.set_input(2, true);
        world.set_analog(3, 4000);
        world.set_analog(2, 4000);
        assert_eq!((world.inputs(), world.analog()), (0b1100, [7, 4000].as_slice()));
        world.set_input(2, false);
        world.set_input(4, true);
        assert_eq!(world.inputs(), 0b1000);
    }

    #[test]
    fn steps_move_the_stage_and_are_recorded() {
        let config = WorldConfig::parse("[stage]\nright = 10").unwrap();
        let mut world = World::new(&TMCM_1140, &config);
        world.axis_mut(0).motor_mut().set_supply(240);
        world.axis_mut(0).motor_mut().set_current(32);
        world.settle(crate::clock::SECOND);
        world.axis_mut(0).start_trace(0, crate::clock::SECOND);
        for step in 1..=10_i64 {
            world.axis_mut(0).follow(2 * crate::clock::SECOND + step as Nanos, step);
            assert_eq!(world.inputs() & 4 != 0, step >= 10);
        }
        assert_eq!(world.axis_mut(0).take_trace().unwrap().samples().len(), 11);
        assert!(world.axis(0).trace().is_none());
    }

    #[test]
    fn the_supply_is_rounded_to_tenths() {
        let mut world = World::new(&TMCM_1140, &WorldConfig::default());
        assert_eq!(world.supply(), 240);
        world.set_supply(8.46);
        assert_eq!(world.supply(), 85);
    }
}
