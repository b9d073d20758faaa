//! The TMCL firmware: a [`Device`], the [executor](crate::executor) of TMCL, links and programs.
//!
//! A command comes in by [`Module::execute`], which [`Module::request`] calls for what a link brings; time comes in by
//! [`Module::poll`]. A reply may come later: after each `poll` the caller takes the replies that are due by
//! [`Module::next_reply`], and events by [`Module::next_event`]. There is no clock, no wait, and no access to hardware
//! but through the device; digital and analog signals are exchanged as plain values.
//!
//! A module is made of values that know nothing of each other, each in a file of its own. They are the program and its
//! downloads (`program`, and `control` for the commands), and the links (`links`, `link_settings`, `overheard`,
//! `supervision`). Others are the commands that wait for the EEPROM (`waiting`) and the host that waits for arrivals
//! (`arrival`). Its methods only put these together: `desk` and `link` bring a request, and `dispatch` has it carried
//! out. `perform` does that by the executor and by the additions of `hooks`. `turn` is the turn of each millisecond,
//! and `run` a slice of the program.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod arrival;
mod control;
mod desk;
mod dispatch;
mod hooks;
mod link;
mod link_settings;
mod links;
mod origin;
mod overheard;
mod perform;
mod port;
mod program;
mod run;
mod supervision;
mod turn;
mod waiting;

pub use crate::executor::{Slots, ports, spec, spec::*};
pub use desk::{LinkEnds, deliver, serve};
pub use hooks::{Execute, Executed, Hooks};
pub use link_settings::{LinkMode, LinkSettings, ReplyAddresses};
pub use origin::{Answer, Due, Origin, Source};
pub use port::{LinkPort, Message, Request};

use arrival::Arrivals;
use links::Links;
use program::Program;
use waiting::Waiting;

use core::task::Poll;

use crate::device::{Circuit, Device, Inputs, Outputs, Parts, Piece};
use crate::executor::Executor;
use crate::motion::Axis;
use crate::param::{BAUD_RATES, CAN_BIT_RATES, GlobalParameter as G};
use crate::store::{Finished, Need, Store};
use crate::tmcl::{Command, Status};
use crate::units::Micros;
use crate::vm::Machine;

/// The types of which a module is made: a board, whose product has a [`Spec`], and additions.
pub trait Platform: Circuit<Product: Product> {
    /// Additions to the module: user functions, and an observer of the program.
    type Hooks: Hooks;
}

/// A module: a device, and the parameters, programs and links of TMCL.
///
/// The order of the fields matters, hence `repr(C)`: load and store instructions of a Cortex-M reach only offsets below
/// 1 KiB, or 4 KiB, without further arithmetic. With the machine first, a command of a program takes 23 cycles less
/// than with the machine behind the device, where the compiler would put it.
#[derive(Debug)]
#[repr(C)]
pub struct Module<T: Platform, const AXES: usize> {
    machine: Machine,
    program: Program,
    /// Something has happened since the last poll that returned outputs, so the next one returns them.
    changed: bool,
    device: Device<T, AXES>,
    executor: Executor<AXES>,
    links: Links,
    /// Commands whose values are not safe in the EEPROM yet, and replies that are due.
    waiting: Waiting,
    arrivals: Arrivals,
    /// The time at which the status LED changes next.
    blinks: Micros,
    /// User functions, and an observer of the program.
    hooks: T::Hooks,
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// A module before its [start](Self::start). `seed` starts the random numbers. Inlined, as [`Device::new`] is, so
    /// that on the way to its place the module is on the stack once, not three times.
    #[inline(always)]
    pub fn new(parts: Parts<T, AXES>, hooks: T::Hooks, seed: u32) -> Self {
        const { spec::check::<T::Product>(AXES) };
        let spec = T::Product::SPEC;
        Module {
            device: Device::new(parts, spec.axis),
            machine: Machine::new(spec.commands),
            program: Program::default(),
            changed: false,
            links: Links::new(),
            executor: Executor::new::<T::Product>(seed),
            waiting: Waiting::default(),
            arrivals: Arrivals::default(),
            blinks: Micros(0),
            hooks,
        }
    }

    /// Starts the module: stops all motors, restores the stored settings, sets up the chips, and only then switches the
    /// drivers on. `load` fills the store from the EEPROM, which takes some time.
    ///
    /// If a motion controller does not answer, the drivers stay off; the module answers all the same, and refuses
    /// motion commands.
    pub fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        self.device.halt();
        let store = self.device.store_mut();
        store.forget();
        load(store);
        self.executor.restore(&mut self.device);
        self.executor.begin_ticks(now);
        self.links.start(now, &self.executor.globals);
        self.device.start(now, self.executor.globals.inversion());
        self.device.enable_drivers(true);
    }

    /// The specification of the product.
    pub const fn spec(&self) -> &'static Spec {
        T::Product::SPEC
    }

    /// Executes a command of a link. Commands after one that restarts the module are neither executed nor answered.
    pub fn execute(&mut self, now: Micros, origin: impl Into<Origin>, command: Command) -> Answer {
        if self.device.restart().is_some() { Poll::Ready(None) } else { self.obey(now, origin.into(), command) }
    }

    /// The value that GAP, GGP, GIO or RFS (its status) would read, past all links: reading it so is no sign of life of
    /// a host. Whether a position is reached is told as the firmware has read it last.
    ///
    /// # Errors
    /// The status with which the command is refused.
    pub fn peek(&mut self, now: Micros, command: Command) -> Result<i32, Status> {
        match self.admit(Source::Usb, command)? {
            Some(opcode) => self.readings(now).peek(opcode, command),
            None => Err(Status::NotAvailable),
        }
    }

    /// True if a poll at `now` takes the inputs over, as the first of each millisecond does; slices of a program do not
    /// look at them. What inputs note until they are read, as edges of an encoder, is to be read for such a poll only.
    pub const fn takes_inputs(&self, now: Micros) -> bool {
        now.0 >= self.device.deadline().0 && matches!(self.device.next_piece(), Piece::Beginning)
    }

    /// Does the next piece of what is due at `now`: to be called at [`Module::deadline`], or as soon after it as can
    /// be. Takes the inputs as they are now.
    ///
    /// A piece is one of the turn of each millisecond, or a slice of the program. While the program has commands to
    /// execute in this millisecond, the deadline is in the past, and each call executes the next few of them. So that
    /// nobody waits for long, the owner looks at the links between two pieces.
    ///
    /// Returns the outputs as they are to be set, at least once a millisecond, and whenever the program has executed a
    /// command that does more than read. Then there may be replies, jobs of the store, and new link settings, too.
    #[inline(always)]
    pub fn poll(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Option<Outputs> {
        if now >= self.device.deadline() {
            self.take_turn(now, inputs);
        } else {
            self.run_slice(now);
        }
        if core::mem::take(&mut self.changed) { Some(self.outputs(now)) } else { None }
    }

    /// True from a command that restarts the firmware until it does: requests are neither executed nor answered.
    pub const fn is_restarting(&self) -> bool {
        self.device.restart().is_some()
    }

    /// The outputs as they are to be set. The restart is asked for when all is done that was begun before.
    #[inline(never)]
    fn outputs(&mut self, now: Micros) -> Outputs {
        let done = self.device.store().settled(Need::Settings) && self.waiting.is_empty();
        let due = self.device.restart().is_some_and(|at| now >= at) && done;
        let outputs = self.device.outputs_mut();
        outputs.restart = due;
        *outputs
    }

    /// Keeps global parameter 77 from starting the program until the supply has been lost and has come back. A firmware
    /// that was restarted by a fault calls this, because its position is lost.
    pub const fn hold_program(&mut self) {
        self.program.starts = false;
    }

    /// The time at which [`Module::poll`] is to be called next.
    pub const fn deadline(&self) -> Micros {
        if self.program.fuel > 0 && self.machine.busy() { self.device.turn() } else { self.device.deadline() }
    }

    /// The additions to the module.
    pub const fn hooks(&mut self) -> &mut T::Hooks {
        &mut self.hooks
    }

    /// The axes, to look at.
    pub const fn axes(&self) -> &[Axis<T::Hardware>; AXES] {
        self.device.axes()
    }

    /// The interpreter, to look at.
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// The settings and the program on their way to the EEPROM: the caller takes jobs from here and reports how they
    /// went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        self.device.store_mut()
    }

    /// Tells the module how the EEPROM job that it gave out last has gone. Commands that waited for it are answered:
    /// with status 100 if all they stored is written, with status 5 if it could not be. In the second case their
    /// settings are not in force either.
    pub fn stored(&mut self, written: bool) {
        let Module { machine, device, executor, links, waiting, .. } = self;
        let Finished { failed, erased, .. } = device.store_mut().finish(written);
        // A factory reset puts the parameters back with the restart that follows it. Until then the program is still in
        // memory, and its protection has to stay.
        let resetting = device.restart().is_some();
        if let Some(protection) = erased.filter(|_| !resetting) {
            executor.globals.set(G::CodeProtection, protection);
        }
        let Some(failed) = failed else { return waiting.settle(device.store(), machine) };
        if failed == Need::Settings && !resetting {
            executor.globals.reload(device.store());
            links.outdate();
            waiting.undos().for_each(|undo| executor.coordinates.undo(undo));
            // If the motion controller does not answer either, its driver knows that it has to write this again.
            let _ = device.invert(executor.globals.inversion());
        }
        waiting.fail(failed, machine);
    }

    /// The link settings in force.
    pub const fn link_settings(&self) -> &LinkSettings {
        &self.links.settings
    }

    /// The bit rate of RS485 that parameter 65 chooses, in bit/s. It is taken at the start of the module.
    pub fn baud_rate(&self) -> u32 {
        self.chosen(G::SerialBaudRate, &BAUD_RATES)
    }

    /// The bit rate of CAN that parameter 69 chooses, in bit/s. It is taken at the start of the module.
    pub fn can_bit_rate(&self) -> u32 {
        self.chosen(G::CanBitRate, &CAN_BIT_RATES)
    }

    /// The entry of `list` that a parameter chooses; its smallest value chooses the first entry.
    fn chosen(&self, parameter: G, list: &[u32]) -> u32 {
        let first = self.spec().global.row(parameter).and_then(|row| row.ranges.first()).map_or(0, |range| range.0);
        let index = self.executor.globals.get(parameter).saturating_sub(first);
        usize::try_from(index).ok().and_then(|index| list.get(index)).copied().unwrap_or_default()
    }

    /// True while a command of this link waits for its reply: the link is not to bring another one.
    pub fn awaits(&self, source: Source) -> bool {
        self.waiting.is_for(source)
    }

    /// Forgets the host at the other end of a link, which is gone: commands of this host that are still waiting are
    /// carried out, but nobody gets their replies. A download that it has begun stays open for the next host.
    pub fn forget(&mut self, source: Source) {
        self.waiting.forget(source);
        self.arrivals.forget(source);
    }

    /// The next of the replies that have become due, oldest first.
    #[inline(never)]
    pub fn next_reply(&mut self) -> Option<Due> {
        let due = self.waiting.next_reply();
        if due.is_none() {
            // The last reply that had to go out under the old settings has been fetched.
            self.links.update(&self.executor.globals, &self.waiting);
        }
        due
    }

    /// The link of the host that waits for an event of command 138, with a number that changes with each request: it
    /// distinguishes the hosts that share a link. `None` while no event can follow.
    pub fn subscriber(&self) -> Option<(Source, u32)> {
        self.arrivals.subscriber()
    }

    /// The next event of command 138, in the order of the axes, if its link `takes` one now; else it waits.
    #[inline(never)]
    pub fn next_event(&mut self, takes: impl FnOnce(Source) -> bool) -> Option<Due> {
        self.arrivals.next(takes)
    }
}
