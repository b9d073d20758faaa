//! The TMCL firmware: a [`Device`], all that a telegram can ask for, and programs.
//!
//! A command comes in by [`Module::execute`], which [`Module::request`] calls for what a link brings; time comes in by
//! [`Module::poll`]. A reply may come later: after each `poll` the caller takes the replies that are due by
//! [`Module::next_reply`], and events by [`Module::next_event`]. There is no clock, no wait, and no access to hardware but through the device; digital and
//! analog signals are exchanged as plain values.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod arrival;
mod axes;
mod calm;
mod can;
mod desk;
mod direct;
mod dispatch;
mod globals;
mod hooks;
mod io;
mod link;
mod link_settings;
mod origin;
mod outcome;
mod overheard;
mod port;
pub mod ports;
mod program;
mod slots;
pub mod spec;
mod supervision;
mod waiting;

pub use desk::{LinkEnds, deliver, serve};
pub use hooks::{Executed, Hooks};
pub use link_settings::{LinkMode, LinkSettings, ReplyAddresses};
pub use origin::{Answer, Due, Origin, Source};
pub use port::{Message, Port, Request};
pub use slots::Slots;
pub use spec::*;

use arrival::Arrivals;
use outcome::Outcome;
use overheard::Overheard;
use supervision::Supervision;
use waiting::{Waiter, Waiting};

use core::task::Poll;

use heapless::{Deque, Vec};

use crate::device::{Board, Device, Inputs, Outputs, Parts, Piece};
use crate::motion::Axis;
use crate::param::{COORDINATES, GlobalParameter as G, USER_VARIABLES};
use crate::store::Store;
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::{Machine, Signals};

/// The types of which a module is made: a board, whose product has a [`Spec`], and additions.
pub trait Platform: Board<Product: Product> {
    /// Additions to the module: user functions, and an observer of the program.
    type Hooks: Hooks;
}

/// Number of links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Number of commands that can wait for the store: one per link, that of the program, and that of an interrupt handler
/// in it.
const WAITING: usize = LINKS + 2;

/// The time between the reply to a software reset and the reset, in which the reply is sent: at 9600 bit/s in 9.4 ms,
/// after a moderate telegram pause.
const RESTART_DELAY: Micros = Micros::from_millis(100);

/// A module: a device, and the parameters, programs and links of TMCL.
///
/// The order of the fields matters, hence `repr(C)`: load and store instructions of a Cortex-M reach only offsets below
/// 1 KiB, or 4 KiB, without further arithmetic. With the machine first, a command of a program takes 23 cycles less
/// than with the machine behind the device, where the compiler would put it.
#[derive(Debug)]
#[repr(C)]
pub struct Module<T: Platform, const AXES: usize> {
    machine: Machine,
    /// Units that the program may still spend in this millisecond; a command costs 1 or more.
    fuel: u32,
    /// Something has happened since the last poll that returned outputs, so the next one returns them.
    changed: bool,
    device: Device<T, AXES>,
    hooks: T::Hooks,
    globals: [i32; G::SETTINGS],
    variables: [i32; USER_VARIABLES],
    coordinates: [[i32; COORDINATES]; AXES],
    /// The program is still to be started, if global parameter 77 says so.
    starts: bool,
    /// The link over which a program is being downloaded.
    downloader: Option<Source>,
    link_settings: LinkSettings,
    /// A global parameter has been written since `link_settings` was made of the global parameters.
    link_settings_stale: bool,
    /// The requests to other modules that were overheard, on RS485 and on CAN.
    overheard: [Overheard; 2],
    /// Commands whose values are not safe in the EEPROM yet.
    waiting: Vec<Waiting, WAITING>,
    /// Replies that are due, oldest first: one per link.
    replies: Deque<Due, LINKS>,
    arrivals: Arrivals,
    supervision: Supervision,
    /// The events of the axes for the interrupts of the program, in the turn under way.
    signals: Signals,
    /// The state of the random numbers.
    random: u32,
    /// The time at which the status LED changes next.
    blinks: Micros,
    /// The time, in milliseconds wrapping at 32 bits, from which the tick timer counts; a write to the timer may put it
    /// into the future.
    tick_offset: u32,
    /// In a module inside another firmware: no motor may be started, because the other one forbids it.
    barred: bool,
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// A module before its [start](Self::start). `seed` starts the random numbers. Inlined, as [`Device::new`] is, so
    /// that on the way to its place the module is on the stack once, not three times.
    #[inline(always)]
    pub fn new(parts: Parts<T, AXES>, hooks: T::Hooks, seed: u32) -> Self {
        const { spec::check::<T::Product>(AXES) };
        let spec = T::Product::SPEC;
        let globals = spec.global.defaults();
        Module {
            device: Device::new(parts, spec.axis),
            hooks,
            globals,
            variables: [0; USER_VARIABLES],
            coordinates: [[0; COORDINATES]; AXES],
            machine: Machine::new(spec.commands),
            starts: true,
            downloader: None,
            fuel: 0,
            changed: false,
            link_settings: LinkSettings::of(&globals),
            link_settings_stale: false,
            overheard: Default::default(),
            waiting: Vec::new(),
            replies: Deque::new(),
            arrivals: Arrivals::default(),
            supervision: Supervision::new(Micros(0)),
            signals: Signals::default(),
            random: seed,
            blinks: Micros(0),
            tick_offset: 0,
            barred: false,
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
        self.restore();
        self.link_settings = LinkSettings::of(&self.globals);
        self.supervision = Supervision::new(now);
        self.tick_offset = now.millis() as u32;
        self.device.start(now, self.inversion());
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

    /// The value that GAP or GGP would read, past all links: reading it so is no sign of life of a host.
    ///
    /// # Errors
    /// The status with which the command is refused.
    pub fn peek(&mut self, now: Micros, command: Command) -> Result<i32, Status> {
        let Command { kind, motor, .. } = command;
        match self.admit(Source::Usb, command)? {
            Some(Opcode::Gap) => self.get_axis(kind, motor),
            Some(Opcode::Ggp) => self.get_global(now, kind, motor),
            _ => Err(Status::NotAvailable),
        }
    }

    /// [`Module::execute`] while no restart is due. What hosts ask most often, GAP and GGP, and what is refused goes a
    /// short way here; all else is executed by [`Module::carry_out`].
    fn obey(&mut self, now: Micros, origin: Origin, command: Command) -> Answer {
        self.supervision.hear(now, origin.source);
        let Command { opcode, kind, motor, .. } = command;
        let read = match self.admit(origin.source, command) {
            Ok(Some(Opcode::Gap)) => self.get_axis(kind, motor),
            Ok(Some(Opcode::Ggp)) => self.get_global(now, kind, motor),
            Ok(admitted) => return self.carry_out(now, origin, admitted, command),
            Err(status) => Err(status),
        };
        let reply = match read {
            Ok(value) => Reply::Plain { status: Status::Ok, opcode, value },
            Err(status) => Reply::echo(status, command),
        };
        if self.suppressed(opcode) { Poll::Ready(None) } else { Poll::Ready(Some(reply)) }
    }

    /// Carries out a command of a link: one that was admitted, or one of a download. Never inlined: reading a parameter
    /// is not to have its stack frame.
    #[inline(never)]
    fn carry_out(&mut self, now: Micros, origin: Origin, admitted: Option<Opcode>, command: Command) -> Answer {
        let suppressed = self.suppressed(command.opcode);
        let outcome = match admitted {
            Some(opcode) => self.act(now, Some(origin), opcode, command),
            None => self.download(command),
        };
        let reply = match outcome {
            Ok(Outcome::Unanswered) => return Poll::Ready(None),
            Ok(Outcome::Special(reply)) => reply,
            Ok(Outcome::Stored { value, need, undo }) if !self.device.store().settled(need) => {
                let waiting = Waiting { from: Waiter::Link(origin), command, need, value, undo, suppressed };
                return match self.waiting.push(waiting) {
                    Ok(()) => Poll::Pending,
                    // The queue is full only if a host sends on without waiting for its replies.
                    Err(_) => Poll::Ready(Some(Reply::echo(Status::NotAvailable, command))),
                };
            }
            Ok(Outcome::Value(value) | Outcome::Read(value) | Outcome::Stored { value, .. }) => {
                Reply::Plain { status: Status::Ok, opcode: command.opcode, value }
            }
            Err(status) => Reply::echo(status, command),
        };
        if suppressed { Poll::Ready(None) } else { Poll::Ready(Some(reply)) }
    }

    /// True if a poll at `now` takes the inputs over, as the first of each millisecond does; slices of a program do not
    /// look at them. What inputs note until they are read, as edges of an encoder, is to be read for such a poll only.
    pub const fn takes_inputs(&self, now: Micros) -> bool {
        now.0 >= self.device.deadline().0 && matches!(self.device.next_piece(), Piece::Beginning)
    }

    /// Does the next piece of what is due at `now`: to be called at [`Module::deadline`], or as soon after it as can be.
    /// Takes the inputs as they are now.
    ///
    /// A piece is one of the turn of each millisecond, or a slice of the program: while the program has commands to
    /// execute in this millisecond, the deadline is in the past, and each call executes the next few of them. So that
    /// nobody waits for long, the owner looks at the links between two pieces.
    ///
    /// Returns the outputs as they are to be set, at least once a millisecond, and whenever the program has executed a
    /// command that does more than read: then there may be replies, jobs of the store, and new link settings, too.
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
        let due = self.device.restart().is_some_and(|at| now >= at) && self.is_done();
        let outputs = self.device.outputs_mut();
        outputs.restart = due;
        *outputs
    }

    /// Does the next piece of the turn of each millisecond. Never inlined: slices of a program, which come more often,
    /// are not to have its stack frame.
    #[inline(never)]
    pub(crate) fn take_turn(&mut self, now: Micros, inputs: &Inputs<AXES>) {
        match self.device.next_piece() {
            Piece::Lines => return self.device.next_lines(),
            Piece::Reading => return self.device.next_reading(),
            Piece::Axis => {}
            Piece::Beginning => {
                self.update_link_settings();
                let supervised = self.device.begin(now, inputs);
                self.supervise(now, supervised);
            }
        }
        let (axis, events) = self.device.next_axis(now);
        self.heed(axis as u8, events);
        if self.device.next_piece() == Piece::Axis {
            return;
        }
        self.settle();
        self.autostart();
        self.begin_turn();
        self.blink(now);
        self.changed = true;
    }

    /// Keeps global parameter 77 from starting the program until the supply has been lost and has come back. A firmware
    /// that was restarted by a fault calls this, because its position is lost.
    pub const fn hold_program(&mut self) {
        self.starts = false;
    }

    /// The time at which [`Module::poll`] is to be called next.
    pub const fn deadline(&self) -> Micros {
        if self.fuel > 0 && self.machine.busy() { self.device.turn() } else { self.device.deadline() }
    }

    /// The additions to the module.
    pub const fn hooks(&mut self) -> &mut T::Hooks {
        &mut self.hooks
    }

    /// The axes, to look at.
    pub const fn axes(&self) -> &[Axis<T::Hardware>; AXES] {
        self.device.axes()
    }

    /// The settings and the program on their way to the EEPROM: the caller takes jobs from here and reports how they
    /// went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        self.device.store_mut()
    }

    /// Restarts the firmware at `at`. From now on requests are neither executed nor answered and the program stands, so
    /// that nothing new delays the restart.
    fn restart(&mut self, at: Micros) {
        self.machine.stop();
        self.device.restart_at(at);
    }

    /// True if global parameter 255 suppresses the reply to this command. Commands that read a value are always
    /// answered (manual section 5.1).
    fn suppressed(&self, opcode: u8) -> bool {
        const READ: [u8; 3] = [Opcode::Gap as u8, Opcode::Ggp as u8, Opcode::Gio as u8];
        self.global(G::SuppressReply) != 0 && !READ.contains(&opcode)
    }
}
