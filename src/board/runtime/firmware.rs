//! What the owner serves: a firmware, which has a device and speaks a language.

use super::ends::Ends;
use crate::device::{Board, Inputs, Outputs, Parts};
use crate::module::{LinkSettings, Source};
use crate::store::{Job, Store};
use crate::units::Micros;

/// A firmware with `AXES` axes. Only the owner calls it, so no call interrupts another.
pub trait Firmware<const AXES: usize>: Sized + 'static {
    /// The types of which its device is made.
    type Board: Board;

    /// A firmware before its [start](Self::start). `seed` starts what is random.
    fn new(parts: Parts<Self::Board, AXES>, seed: u32) -> Self;

    /// Stops all motors, has `load` fill the store from the EEPROM, and sets up the chips.
    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<<Self::Board as Board>::Product>));

    /// Has a store write the settings of the factory.
    fn factory_reset(store: &mut Store<<Self::Board as Board>::Product>);

    /// Tells that a fault has restarted the firmware: nothing may move by itself, because the position is lost.
    fn recover(&mut self);

    /// The name of the USB device.
    fn usb_name(&self) -> &'static str;

    /// Bit rate of RS485 in bit/s, taken at the start; `None` leaves the port off.
    fn baud_rate(&self) -> Option<u32>;

    /// Bit rate of CAN in bit/s, taken at the start; `None` while it is unknown: then the controller is not started before the
    /// firmware signals the rate.
    fn can_bit_rate(&self) -> Option<u32>;

    /// The settings in force of the byte links.
    fn link_settings(&self) -> &LinkSettings;

    /// True if the CAN controller is to send what has waited longest, not the lowest identifier.
    const CAN_IN_ORDER: bool;

    /// Serves one request of a link. False if there is none.
    fn serve(&mut self, ends: &mut Ends, now: impl Fn() -> Micros) -> bool;

    /// The time at which [`Firmware::poll`] is to be called next.
    fn deadline(&self) -> Micros;

    /// True if the next poll looks at the inputs: what they have noted since they were read last is then its alone.
    fn takes_inputs(&self, now: Micros) -> bool;

    /// Does a piece of what is due; takes the inputs as they were read last. Returns the outputs as they are to be set, at
    /// least once a millisecond; `None` if outputs, replies, jobs and settings are as they were.
    fn poll(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Option<Outputs>;

    /// Hands out what a poll has made for the links, and looks after them.
    fn deliver(&mut self, ends: &mut Ends);

    /// Sends what has waited for a mailbox of the CAN controller, one of which has become free.
    fn refill(&mut self, ends: &mut Ends);

    /// Keeps the interrupt of received frames from coming again and again while they cannot be taken.
    fn hold(&self);

    /// True if nothing is on its way for which a restart should wait.
    fn has_sent(&self) -> bool;

    /// The next job to be done in the EEPROM.
    fn next_job(&mut self) -> Option<Job>;

    /// Tells how the job handed out last has gone.
    fn stored(&mut self, written: bool);

    /// Forgets the host at the other end of a link, which is gone.
    fn forget(&mut self, source: Source);
}
