//! The signals that the firmware exchanges with the board in each poll. Which pins they are is the table that the board
//! makes of [`Signals`]; the analog ones come from `analog`, counts of encoders from `encoder`.

use embassy_stm32::gpio::{Level, Output};

use crate::board::stm32f4::analog;
use crate::board::stm32f4::encoder::Encoder;
use crate::board::stm32f4::line::Line;
use crate::device::{Inputs, Outputs};
use crate::motion::Sensors;

/// The number of the ENABLE input among the digital inputs.
const ENABLE: u32 = 10;

/// The level of a digital output that is off, on all boards: that with which the published firmware of the TMCM-1140's
/// closest sibling starts.
pub(crate) const OFF: Level = Level::High;

/// The pins of the signals of a board with `AXES` axes, `INPUTS` digital inputs, `OUTPUTS` digital outputs, and pull-up
/// resistors that are switched in `GROUPS` groups.
pub(crate) struct Signals<const AXES: usize, const INPUTS: usize, const OUTPUTS: usize, const GROUPS: usize> {
    /// The signals of each axis.
    pub(crate) axes: [Axis; AXES],
    /// IN0 and the others. An input may be something else as well: a switch of an axis, a track of an
    /// encoder.
    pub(crate) inputs: [Line; INPUTS],
    /// The ENABLE input; `None` on a board without one.
    pub(crate) enable: Option<Line>,
    /// OUT0 and the others; [`OFF`] is the level of those that are off.
    pub(crate) outputs: [Output<'static>; OUTPUTS],
    /// The pull-up resistors of inputs; high is on.
    pub(crate) pull_ups: [Output<'static>; GROUPS],
    /// LED1, the status LED; high is on.
    pub(crate) led: Output<'static>,
}

/// The signals of an axis.
pub(crate) struct Axis {
    /// SG_TST of the driver, high while the load value is 0; `None` on a board whose drivers tell of a stall by SPI.
    pub(crate) stall: Option<Line>,
    /// The home switch.
    pub(crate) home: Line,
    /// The right stop switch; `None` on a board where the motion controller alone has it.
    pub(crate) right: Option<Line>,
    /// The external encoder; `None` on a board that does not count it.
    pub(crate) encoder: Option<&'static Encoder>,
}

impl<const AXES: usize, const INPUTS: usize, const OUTPUTS: usize, const GROUPS: usize>
    Signals<AXES, INPUTS, OUTPUTS, GROUPS>
{
    /// Lets the encoders note their null edges from now on.
    pub(crate) fn start(&self) {
        self.axes.iter().filter_map(|axis| axis.encoder).for_each(Encoder::start);
    }

    /// Reads all inputs, to their place: copies of them take as long as the reading. Never inlined: slices of a
    /// program, for which nothing is read, are not to have its registers.
    #[inline(never)]
    pub(crate) fn read(&self, inputs: &mut Inputs<AXES>) {
        for (Axis { stall, home, right, encoder }, sensors) in self.axes.iter().zip(&mut inputs.axes) {
            let (external, null) = encoder.map_or((0, [None; 2]), |encoder| (encoder.count(), encoder.edges()));
            let [stall, right] = [stall, right].map(|line| line.is_some_and(Line::is_high));
            let home = home.is_high();
            // The built-in encoder is not read, because its pins are not known.
            *sensors = Sensors { stall, home, right, encoder: None, external, null };
        }
        inputs.digital = (0..).zip(&self.inputs).fold(0, |bits, (n, line)| bits | u16::from(line.is_high()) << n);
        inputs.digital |= u16::from(self.enable.is_some_and(Line::is_high)) << ENABLE;
        inputs.analog = analog::ports();
        (inputs.supply, inputs.temperature) = (Some(analog::supply()), analog::temperature());
    }

    /// Sets all outputs. LED2 is `fault`'s.
    pub(crate) fn write(&mut self, outputs: &Outputs) {
        set(&mut self.outputs, !outputs.digital);
        set(&mut self.pull_ups, outputs.pull_ups);
        self.led.set_level(outputs.led.into());
    }
}

/// Sets pins to the levels in `bits`, the first pin in bit 0.
fn set(pins: &mut [Output<'static>], bits: u8) {
    for (bit, pin) in pins.iter_mut().enumerate() {
        pin.set_level((bits >> bit & 1 != 0).into());
    }
}
