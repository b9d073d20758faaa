//! The firmware as that on which it runs sees it, a board or a simulator, whatever language it speaks; and what happens
//! behind each of its polls, in which order.
//!
//! A [`Firmware`] has neither to have a device nor a store. What one on a [`Circuit`] is made of, and how
//! it starts, is [`OnBoard`].

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod canopen;
mod tmcl;

use crate::canopen::Bus;
use crate::device::{Circuit, Inputs, Outputs, Parts};
use crate::module::{LinkEnds, LinkSettings, Source};
use crate::store::{Job, Store};
use crate::units::Micros;

/// A firmware. Its owner calls it, and nobody else does, so no call interrupts another.
pub trait Firmware {
    /// The readings that a poll takes.
    type Inputs
    where
        Self: Sized;

    /// Serves one request of a link. False if there is none.
    fn serve(&mut self, around: &mut impl Surroundings) -> bool
    where
        Self: Sized;

    /// Does a piece of what is due at `now`; takes the inputs as they were read last. Returns the outputs as they are
    /// to be set, at least once a millisecond: then [`pass_on`] is to be called. `None` if outputs, replies, jobs and
    /// settings are as they were.
    fn poll(&mut self, now: Micros, inputs: &Self::Inputs) -> Option<Outputs>
    where
        Self: Sized;

    /// Hands out what a poll has made for the links, and looks after them.
    fn deliver(&mut self, around: &mut impl Surroundings)
    where
        Self: Sized;

    /// Sends what has waited for a mailbox of the CAN controller, one of which has become free.
    fn refill(&mut self, _around: &mut impl Surroundings)
    where
        Self: Sized,
    {
    }

    /// The time at which [`Firmware::poll`] is to be called next.
    fn deadline(&self) -> Micros;

    /// True if a poll at `now` takes the inputs over: what they have noted since they were read last is then its alone.
    fn takes_inputs(&self, now: Micros) -> bool;

    /// The next job to be done in the EEPROM.
    fn next_job(&mut self) -> Option<Job>;

    /// Tells how the job handed out last has gone.
    fn stored(&mut self, written: bool);

    /// The name of the USB device.
    fn usb_name(&self) -> &'static str;

    /// The settings in force of the byte links.
    fn link_settings(&self) -> &LinkSettings;

    /// Bit rate of RS485 in bit/s, taken at the start; `None` leaves the port off.
    fn baud_rate(&self) -> Option<u32>;

    /// Bit rate of CAN in bit/s, taken when it is known first; `None` until then: the controller stays off the bus.
    fn can_bit_rate(&self) -> Option<u32>;

    /// Two words that are to survive a restart, but not the loss of the supply; they belong to the bit rate of CAN.
    fn kept(&self) -> Option<[u32; 2]> {
        None
    }

    /// Tells that a fault has restarted the firmware: nothing may move by itself, because the position is lost.
    fn recover(&mut self) {}

    /// Forgets the host at the other end of a link, which is gone.
    fn forget(&mut self, _source: Source) {}

    /// True while a command of a link waits for its reply.
    fn awaits(&self, source: Source) -> bool;

    /// True from a command that restarts the firmware until it does: what comes meanwhile is neither carried out nor
    /// answered.
    fn is_restarting(&self) -> bool;
}

/// A firmware with `AXES` axes on a board, and with a store.
pub trait OnBoard<const AXES: usize>: Firmware<Inputs = Inputs<AXES>> + Sized {
    /// The types of which its device is made.
    type Circuit: Circuit;

    /// A firmware before its [start](Self::start). `seed` starts what is random.
    fn new(parts: Parts<Self::Circuit, AXES>, seed: u32) -> Self;

    /// Before the start: what the firmware has [kept](Firmware::kept) before a restart, or anything after the loss of
    /// the supply.
    fn remember(&mut self, _kept: [u32; 2]) {}

    /// Stops all motors, has `load` fill the store from the EEPROM, and sets up the chips.
    fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<<Self::Circuit as Circuit>::Product>));

    /// Has a store write the settings of the factory.
    fn factory_reset(store: &mut Store<<Self::Circuit as Circuit>::Product>);
}

/// The surroundings of a firmware: its links, its outputs, and the memory of what it stores.
pub trait Surroundings: LinkEnds {
    /// The CAN controller as a node of CANopen uses it.
    type Bus: Bus;

    /// The CAN controller, once it has joined the bus; `None` as well for a firmware that uses it by [`LinkEnds`].
    fn bus(&mut self) -> Option<&mut Self::Bus>;

    /// Sets the outputs.
    fn set(&mut self, outputs: &Outputs);

    /// Looks after the EEPROM, which takes the `next` job when it has none. Tells how a job has gone that has ended.
    fn keep(&mut self, next: impl FnOnce() -> Option<Job>) -> Option<bool>;

    /// Puts the settings of the links in force.
    fn put_in_force(&mut self, settings: &LinkSettings);

    /// The firmware has done all that it had begun, and is to start anew as soon as its replies are sent. Asked for
    /// again and again until it does.
    fn restart(&mut self);
}

/// Passes on what a poll has led to. First come the outputs, which are in a hurry. Then comes what has become of the
/// pages that are stored, on which replies wait. Then come these replies, and only behind them the link settings that
/// were changed by the commands they answer. A restart comes last, when all of this is done.
#[inline(always)]
pub fn pass_on(firmware: &mut impl Firmware, around: &mut impl Surroundings, outputs: &Outputs) {
    around.set(outputs);
    // A job that has ended makes room for the next.
    while let Some(written) = around.keep(|| firmware.next_job()) {
        firmware.stored(written);
    }
    firmware.deliver(around);
    around.put_in_force(firmware.link_settings());
    if outputs.restart {
        around.restart();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::can::Frame;
    use crate::canopen::{BusState, Filters};
    use crate::module::{LinkMode, Origin, Request};
    use crate::tmcl::Reply;
    use std::vec::Vec;

    /// A firmware with neither axes nor a store, as a loader is, which does nothing but have something to pass on.
    #[derive(Default)]
    struct Loader {
        settings: LinkSettings,
        restarts: bool,
        stored: Vec<bool>,
    }

    impl Firmware for Loader {
        type Inputs = ();

        fn serve(&mut self, _: &mut impl Surroundings) -> bool {
            false
        }

        fn poll(&mut self, _: Micros, (): &()) -> Option<Outputs> {
            Some(Outputs { restart: self.restarts, ..Outputs::default() })
        }

        fn deliver(&mut self, around: &mut impl Surroundings) {
            let replies = self.stored.len();
            for _ in 0..replies {
                around.answer(Source::Usb.into(), Some(&Reply::WRONG_CHECKSUM), None, &self.settings);
            }
            self.settings.pause = 1;
        }

        fn deadline(&self) -> Micros {
            Micros(0)
        }

        fn takes_inputs(&self, _: Micros) -> bool {
            false
        }

        fn next_job(&mut self) -> Option<Job> {
            None
        }

        fn stored(&mut self, written: bool) {
            self.stored.push(written);
        }

        fn usb_name(&self) -> &'static str {
            "loader"
        }

        fn link_settings(&self) -> &LinkSettings {
            &self.settings
        }

        fn baud_rate(&self) -> Option<u32> {
            None
        }

        fn can_bit_rate(&self) -> Option<u32> {
            None
        }

        fn awaits(&self, _: Source) -> bool {
            false
        }

        fn is_restarting(&self) -> bool {
            self.restarts
        }
    }

    /// Notes what it is told, in order.
    #[derive(Default)]
    struct Notes {
        told: Vec<&'static str>,
        ended: Option<bool>,
    }

    impl LinkEnds for Notes {
        fn now(&self) -> Micros {
            Micros(0)
        }

        fn request(&mut self, _: Source, _: &LinkSettings) -> Option<Request> {
            None
        }

        fn takes_event(&mut self, _: Source) -> bool {
            true
        }

        fn answer(&mut self, _: Origin, _: Option<&Reply>, _: Option<LinkMode>, settings: &LinkSettings) {
            self.told.push(if settings.pause == 0 { "reply" } else { "reply under new settings" });
        }
    }

    impl Surroundings for Notes {
        type Bus = NoBus;

        fn bus(&mut self) -> Option<&mut NoBus> {
            None
        }

        fn set(&mut self, _: &Outputs) {
            self.told.push("outputs");
        }

        fn keep(&mut self, next: impl FnOnce() -> Option<Job>) -> Option<bool> {
            assert!(next().is_none());
            self.told.push("page");
            self.ended.take()
        }

        fn put_in_force(&mut self, settings: &LinkSettings) {
            self.told.push(if settings.pause == 1 { "new settings" } else { "settings" });
        }

        fn restart(&mut self) {
            self.told.push("restart");
        }
    }

    /// A controller that nobody has.
    enum NoBus {}

    impl Bus for NoBus {
        fn state(&self) -> BusState {
            match *self {}
        }

        fn listen_to(&mut self, _: &Filters) {
            match *self {}
        }

        fn read(&mut self) -> Option<Frame> {
            match *self {}
        }

        fn has_overrun(&mut self) -> bool {
            match *self {}
        }

        fn settle(&mut self) {
            match *self {}
        }

        fn has_room(&self) -> bool {
            match *self {}
        }

        fn is_empty(&self) -> bool {
            match *self {}
        }

        fn write(&mut self, _: &Frame) {
            match *self {}
        }

        fn clear(&mut self) {
            match *self {}
        }

        fn wait(&mut self, _: bool) {
            match *self {}
        }
    }

    /// A page that is written has its reply at once, the reply goes under the old settings, and a restart is last.
    #[test]
    fn what_a_poll_has_led_to_is_passed_on_in_order() {
        for (ended, restarts, order) in [
            (None, false, ["outputs", "page", "new settings"].as_slice()),
            (Some(true), true, &["outputs", "page", "page", "reply", "new settings", "restart"]),
        ] {
            let (mut loader, mut notes) =
                (Loader { restarts, ..Loader::default() }, Notes { ended, ..Notes::default() });
            let outputs = loader.poll(Micros(0), &()).unwrap();
            pass_on(&mut loader, &mut notes, &outputs);
            assert_eq!((notes.told.as_slice(), loader.stored), (order, ended.into_iter().collect()));
        }
    }
}
