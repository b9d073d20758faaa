//! The parts of a product's board, as data: a further product of these chips is one more value of [`BoardKind`], in
//! `products.rs`.

use crate::chip::at25::Part;
use crate::world::pin::Pin;

/// The largest number of analog channels that a board can have.
pub const MOST_ANALOG: usize = 8;

/// The chips that have a chip select.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// A motion controller, by its number from 0; it is on the motion bus.
    Tmc429(usize),
    /// The driver of an axis, by the number of the axis; it is on the motion bus.
    Tmc262(usize),
    /// Motion controller and driver of an axis in one, by the number of the axis; it is on the motion bus.
    Tmc5160(usize),
    /// The EEPROM, which has a bus of its own.
    At25,
}

/// The chips that move the motors of a board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MotionChips {
    /// TMC429s, and a TMC262 for each axis. The axes of the second TMC429 are numbered after those of the first.
    Tmc429Tmc262,
    /// A TMC5160 for each axis.
    Tmc5160,
}

/// A kind of board.
#[derive(Debug, PartialEq, Eq)]
pub struct BoardKind {
    /// The product's name.
    pub name: &'static str,
    /// The chips that move the motors.
    pub motion: MotionChips,
    /// The number of axes of each motion controller: 1..=3 for a TMC429, 1 for a TMC5160.
    pub controllers: &'static [usize],
    /// The connections of the digital inputs, IN0 first; 32 at most, of which at most [`MOST_ANALOG`] are analog.
    pub inputs: &'static [Input],
    /// The number that the ENABLE input has among the digital inputs, beyond those of `inputs` and 31 at most.
    pub enable_input: Option<usize>,
    /// Number of digital outputs, OUT0 and up; 32 at most.
    pub outputs: u32,
    /// Number of groups of inputs whose pull-up resistors can be switched; 32 at most.
    pub pull_ups: u32,
    /// The full current of the drivers, at a current scale of 31, in milliamperes RMS.
    pub full_current: u32,
    /// Each motor has the built-in magnetic encoder on its shaft.
    pub magnetic_encoders: bool,
    /// Where an ABN encoder can be connected.
    pub abn: AbnPins,
    /// The EEPROM of the board.
    pub eeprom: Part,
}

/// The connection of a digital input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// Nothing: the level is set by hand.
    Free,
    /// A terminal that is also read by the analog channel of the same number.
    Analog,
    /// A switch of the axis of this number.
    Switch(usize, Pin),
}

/// Where the ABN encoder of an axis can be connected.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AbnPins {
    /// Nowhere.
    None,
    /// To the three inputs to which the switches are connected otherwise.
    Switches,
    /// To pins of its own.
    Own,
}

impl BoardKind {
    /// The number of axes of the board.
    pub fn axes(&self) -> usize {
        self.controllers.iter().sum()
    }

    /// The chips on the motion bus.
    pub fn motion_bus(&self) -> impl Iterator<Item = Chip> {
        let (chip, more): (fn(usize) -> Chip, _) = match self.motion {
            MotionChips::Tmc429Tmc262 => (Chip::Tmc429, self.axes()),
            MotionChips::Tmc5160 => (Chip::Tmc5160, 0),
        };
        (0..self.controllers.len()).map(chip).chain((0..more).map(Chip::Tmc262))
    }

    /// Whether the board has a digital input of this number.
    pub fn has_input(&self, number: usize) -> bool {
        number < self.inputs.len() || self.enable_input == Some(number)
    }

    /// The number of the motion controller that moves an axis, and the number of the axis' motor there; `None` if the
    /// board has no such axis.
    pub fn motor(&self, axis: usize) -> Option<(usize, usize)> {
        let mut first = 0;
        for (controller, &axes) in self.controllers.iter().enumerate() {
            if axis < first + axes {
                return Some((controller, axis - first));
            }
            first += axes;
        }
        None
    }

    /// The numbers of the inputs that have an analog channel, in the order of the channels.
    pub fn analog(&self) -> impl Iterator<Item = usize> {
        let inputs = self.inputs.iter().enumerate();
        inputs.filter(|(_, input)| **input == Input::Analog).map(|(number, _)| number)
    }

    /// Checks that the board has an axis.
    ///
    /// # Errors
    /// A text that says which axes the board has.
    pub fn check_axis(&self, axis: usize) -> Result<(), String> {
        let name = self.name;
        match self.axes() {
            axes if axis < axes => Ok(()),
            1 => Err(format!("no axis {axis}: the {name} has one, axis 0")),
            axes => Err(format!("no axis {axis}: the {name} has axes 0 to {}", axes - 1)),
        }
    }
}
