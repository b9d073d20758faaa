//! A running firmware of any product: what a [`NativeModule`](super::NativeModule) needs of it.

use hal_sim::board::SharedBoard;
use hal_sim::clock::Nanos;
use hal_sim::fault::CanState;
use tmcm::can::Frame;
use tmcm::canopen::Address;
use tmcm::module::{LinkSettings, Source};
use tmcm::store::{Integrity, LoadReport};
use tmcm::tmcl::Command;
use tmcm::units::Micros;
use tmcm::vm::Machine;

use super::ports::Ports;
use super::traffic::Traffic;
use crate::module::Rs485;
use crate::tracer::Step;

/// A firmware that runs on a simulated board.
pub(super) trait Firmware {
    /// When the firmware wants to be polled next.
    fn deadline(&self) -> Nanos;

    /// When the firmware may do something next that nobody can do in its place, so that it has to be polled.
    fn acts(&self) -> Nanos {
        self.deadline()
    }

    /// Leaves polls out that come before `to` and change nothing. Firmware, board and deadline, which this returns, are then as
    /// if all of them had come.
    fn skip(&mut self, _to: Nanos) -> Nanos {
        self.deadline()
    }

    /// True if the next poll begins the turn of a millisecond.
    fn begins_turn(&self) -> bool;

    /// Polls the firmware and the EEPROM, and writes the outputs of the board; then takes what has become due for the
    /// links. True if the firmware is to start anew.
    fn poll(&mut self, traffic: &mut Traffic) -> bool;

    /// Serves what has come next over the links; false if there is nothing now.
    fn serve(&mut self, traffic: &mut Traffic) -> bool;

    /// Whether the filters of the CAN controller let a frame pass.
    fn accepts(&self, frame: &Frame) -> bool;

    /// Whether the firmware acts upon a frame that has passed: others it only takes note of.
    fn is_addressed(&self, frame: &Frame) -> bool;

    /// Tells what has become of the CAN controller.
    fn set_can(&mut self, state: CanState, traffic: &mut Traffic);

    /// The port on the RS485 bus; `None` while it is off.
    fn rs485(&self) -> Option<Rs485>;

    /// The module's ends of its byte links, with the link settings in force.
    fn ports(&self) -> (&Ports, &LinkSettings);

    /// The same, to be changed.
    fn ports_mut(&mut self) -> (&mut Ports, &LinkSettings);

    /// The position of an axis in microsteps, as the firmware read it last, and its target in the modes that have one.
    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)>;

    /// The host at the other end of a link is gone.
    fn forget(&mut self, _: Source) {}

    /// The link on which a host waits for the event of command 138.
    fn subscriber(&self) -> Option<Source> {
        None
    }

    /// True while a command of a link waits for its reply.
    fn awaits(&self, _: Source) -> bool {
        false
    }

    /// True from a command that starts the firmware anew until it does: what comes meanwhile is neither carried out nor
    /// answered.
    fn is_restarting(&self) -> bool;

    /// What the firmware keeps in memory that survives a restart, but not the loss of the supply.
    fn kept(&self) -> Option<Address> {
        None
    }

    /// The interpreter, if the firmware executes programs.
    fn machine(&self) -> Option<&Machine> {
        None
    }

    /// The answer to a command that reads a value in memory, past all links.
    fn read(&mut self, _: Command) -> Option<i32> {
        None
    }

    /// The value that a command would read, as [`VirtualModule::peek`](crate::module::VirtualModule::peek) has it.
    fn peek(&mut self, _: Command) -> Result<i32, String> {
        Err("a CANopen node has no parameters of TMCL: use what the world shows, such as 'position' and 'velocity'"
            .into())
    }

    /// Records the commands that programs execute, or stops recording.
    fn trace(&mut self, _: bool) {}

    /// The commands that have been recorded since the last call.
    fn take_steps(&mut self) -> Vec<Step> {
        Vec::new()
    }
}

/// How a firmware is started.
pub(super) struct Start<'a> {
    pub(super) board: &'a SharedBoard,
    /// What the microcontroller's clock shows at the start.
    pub(super) clock: Micros,
    /// What the firmware has kept before a restart.
    pub(super) kept: Option<Address>,
    /// Starts the random numbers.
    pub(super) seed: u32,
    /// The commands of programs are recorded.
    pub(super) tracing: bool,
}

/// What a person should know of the contents of the EEPROM.
pub(super) fn messages(report: &LoadReport) -> Vec<String> {
    let LoadReport { foreign, valid, .. } = *report;
    let mut messages = Vec::new();
    if report.unreachable {
        messages.push("EEPROM does not answer: defaults apply, nothing can be stored".into());
    } else if foreign > 0 {
        messages.push(format!(
            "EEPROM: {foreign} settings pages are not this firmware's or damaged, {valid} are good; \
             defaults or the older copies apply"
        ));
    }
    if report.program == Integrity::Incomplete {
        messages.push("EEPROM: the program is damaged or its download was cut short: it will not run".into());
    }
    messages
}
