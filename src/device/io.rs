//! The signals between a device and its board: what the board reads before each millisecond's turn, and what it puts
//! out after.

use crate::motion::Sensors;

/// Number of analog inputs that a board can have: ports 0 to 4, as on the products that have most.
pub const ANALOG: usize = 5;

/// The signals at the inputs of a module with `AXES` axes. Aligned to words, because it is copied each millisecond.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(align(4))]
pub struct Inputs<const AXES: usize> {
    /// The sensors of each axis. Which pin is the home switch of which axis is the board's matter.
    pub axes: [Sensors; AXES],
    /// The levels of the digital inputs, IN0 in bit 0. A pin that is also a switch of an axis appears here as well. The
    /// input that enables the drivers, on a board that has one, is bit 10, the number of its port.
    pub digital: u16,
    /// The analog inputs by port number, in the units of the board's converter, which has 12 bits: 0..=4095.
    pub analog: [u16; ANALOG],
    /// Supply voltage in units of 0.1 V; `None` on a board that does not measure it.
    pub supply: Option<u16>,
    /// Temperature in degrees Celsius.
    pub temperature: i16,
}

impl<const AXES: usize> Default for Inputs<AXES> {
    fn default() -> Self {
        let axes = [Sensors::default(); AXES];
        Inputs { axes, digital: 0, analog: [0; ANALOG], supply: None, temperature: 0 }
    }
}

/// The signals that a device wants at the outputs of its board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Outputs {
    /// General purpose outputs, OUT0 in bit 0.
    pub digital: u8,
    /// The groups of pull-up resistors that are switched on, the first group in bit 0.
    pub pull_ups: u8,
    /// The status LED is lit.
    pub led: bool,
    /// The error LED is lit, because a motion controller does not answer.
    pub trouble: bool,
    /// The board is to restart the firmware, as soon as the replies that the firmware has given out have been sent.
    pub restart: bool,
}

impl Default for Outputs {
    /// The state after power-on: outputs off, pull-up resistors on.
    fn default() -> Self {
        Outputs { digital: 0, pull_ups: u8::MAX, led: false, trouble: false, restart: false }
    }
}
