//! A firmware of any product as it shows itself to those who look at a virtual module.

use tmcm::can::Frame;
use tmcm::canopen::Filters;
use tmcm::device::Outputs;
use tmcm::firmware::{Firmware, OnBoard};
use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::units::Micros;
use tmcm::vm::Machine;

use crate::tracer::Tracer;

/// A view into a firmware, whichever it is.
pub(super) trait Insight: Firmware {
    /// The position of an axis in microsteps, as the firmware read it last, and its target in the modes that have one.
    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)>;

    /// Whether the CAN controller lets a frame pass, where it has been given `filters`.
    fn accepts(&self, frame: &Frame, filters: &Filters) -> bool;

    /// Whether the firmware acts upon a frame that has passed: others it only takes note of.
    fn is_addressed(&self, frame: &Frame) -> bool;

    /// The message for a person about the start, if there is one.
    fn complaint(&self) -> Option<&'static str> {
        None
    }

    /// The link on which a host waits for the event of command 138, with the number of that request.
    fn subscriber(&self) -> Option<(Source, u32)> {
        None
    }

    /// The interpreter, if the firmware executes programs.
    fn machine(&self) -> Option<&Machine> {
        None
    }

    /// The answer to a command that reads a value in memory, past all links.
    fn read(&mut self, _now: Micros, _: Command) -> Option<i32> {
        None
    }

    /// The value that a command would read, as [`VirtualModule::peek`](crate::module::VirtualModule::peek) has it.
    fn peek(&mut self, _now: Micros, _: Command) -> Result<i32, String> {
        Err("a CANopen node has no parameters of TMCL: use what the world shows, such as 'position' and 'velocity'"
            .into())
    }

    /// The tracer that records the commands that programs execute.
    fn tracer(&mut self) -> Option<&mut Tracer> {
        None
    }
}

/// A firmware that runs on simulated boards with `AXES` axes.
pub(super) trait Simulable<const AXES: usize>: Insight + OnBoard<AXES> + 'static {
    /// Number of turns after which the same readings come again.
    const ROTATION: u32 = 1;
    /// Number of turns after which nothing that is known of a motor that turns is older than they are.
    const FRESH: u32 = 0;

    /// As [`Module::calm`](tmcm::module::Module::calm); `None` for a firmware that is always polled.
    fn calm(&self) -> Option<(Micros, [u32; AXES])> {
        None
    }

    /// Lets whole rotations of turns pass that change nothing, as [`calm`](Self::calm) has told.
    fn pass(&mut self, _rotations: u32) -> Outputs {
        Outputs::default()
    }
}
