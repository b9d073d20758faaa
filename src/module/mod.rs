//! The TMCL firmware: a [`Device`] and the language, that is all that a telegram can ask for, and programs.
//!
//! Two entrances: a command comes in by [`Module::execute`], which [`Module::request`] calls for what a link brings, and
//! time by [`Module::poll`]. A reply may come later: `poll` is followed by [`Module::next_reply`] until there is none
//! left. There is no clock, no wait and no hardware access but through the device; digital and analog signals are
//! exchanged as plain values.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod arrival;
mod axes;
mod can;
mod desk;
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
mod program;
mod slots;
mod spec;
mod supervision;
mod waiting;

pub use desk::{Desk, LinkEnds};
pub use hooks::{Executed, Hooks};
pub use link_settings::{LinkMode, LinkSettings, ReplyAddresses};
pub use origin::{Answer, Due, Origin, Source};
pub use port::{Message, Port, Request, Taken};
pub use slots::Slots;
pub use spec::{Product, Spec, TMCM_1140, TMCM_1140_AXES, Tmcm1140, factory_reset};

use arrival::Arrivals;
use outcome::Outcome;
use overheard::Overheard;
use supervision::Supervision;
use waiting::{Waiter, Waiting};

use core::task::Poll;

use heapless::{Deque, Vec};

use crate::device::{Board, Device, Inputs, Outputs, Parts};
use crate::motion::Axis;
use crate::param::{COORDINATES, GlobalParameter as G, USER_VARIABLES};
use crate::store::Store;
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::{Machine, Signals};

/// What a module runs on, as types: a board, whose product has a [`Spec`], and additions.
pub trait Platform: Board<Product: Product> {
    /// What is added to the module.
    type Hooks: Hooks;
}

/// Links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Replies on their way: one per link, and one event.
const REPLIES: usize = LINKS + 1;
/// Commands that can wait for the store: one per link, the program's, and that of a handler within it.
const WAITING: usize = LINKS + 2;

/// The pause between the reply to a software reset and the reset: time for it to get through, at 9600
/// baud (9.4 ms) and with a moderate telegram pause.
const RESTART_DELAY: Micros = Micros::from_millis(100);

/// A module: a device, and the parameters, programs and links of TMCL.
///
/// The order of the fields counts, hence `repr(C)`: load and store instructions of a Cortex-M reach only offsets below
/// 1 KiB, or 4 KiB, without further arithmetic. With the machine first, a command of a program takes 23 cycles less than
/// where the compiler would put it, behind the device.
#[derive(Debug)]
#[repr(C)]
pub struct Module<T: Platform, const AXES: usize> {
    machine: Machine,
    /// Units that the program may still spend in this millisecond.
    fuel: u32,
    device: Device<T, AXES>,
    hooks: T::Hooks,
    globals: [i32; G::SETTINGS],
    variables: [i32; USER_VARIABLES],
    coordinates: [[i32; COORDINATES]; AXES],
    /// The program is to be started if parameter 77 says so.
    starts: bool,
    /// The link that downloads a program.
    downloader: Option<Source>,
    link_settings: LinkSettings,
    /// A global parameter has been written since the link settings were taken from the global parameters.
    link_settings_stale: bool,
    /// What was asked of other modules, on RS485 and on CAN.
    overheard: [Overheard; 2],
    waiting: Vec<Waiting, WAITING>,
    replies: Deque<Due, REPLIES>,
    arrivals: Arrivals,
    supervision: Supervision,
    /// What the axes have told the program in the turn under way.
    signals: Signals,
    random: u32,
    /// The tick timer shows the milliseconds since this point, which may lie ahead.
    tick_offset: u32,
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// A module before its [start](Self::start). `seed` starts the random numbers.
    pub fn new(parts: Parts<T, AXES>, hooks: T::Hooks, seed: u32) -> Self {
        Self::with_device(Device::new(parts, T::Product::SPEC.axis), hooks, seed)
    }

    /// A module that takes over the device of another firmware as it is, with its motors where they are and its axis
    /// parameters as they were set. It needs no start; global parameters, coordinates and variables have their defaults.
    pub fn with_device(device: Device<T, AXES>, hooks: T::Hooks, seed: u32) -> Self {
        const { spec::check::<T::Product>(AXES) };
        let spec = T::Product::SPEC;
        Module {
            device,
            hooks,
            globals: spec.global.defaults(),
            variables: [0; USER_VARIABLES],
            coordinates: [[0; COORDINATES]; AXES],
            machine: Machine::new(spec.commands),
            starts: true,
            downloader: None,
            fuel: 0,
            link_settings: LinkSettings::default(),
            link_settings_stale: false,
            overheard: Default::default(),
            waiting: Vec::new(),
            replies: Deque::new(),
            arrivals: Arrivals::default(),
            supervision: Supervision::new(Micros(0)),
            signals: Signals::default(),
            random: seed,
            tick_offset: 0,
        }
    }

    /// Starts the module: stops whatever the motion controllers were doing, restores what is stored, sets up the chips and
    /// only then switches the drivers on. `load` fills the store, which takes its time.
    ///
    /// With a motion controller that does not answer the drivers stay off; the module answers all the same, and
    /// refuses motion commands.
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

    /// The device, for another firmware to take over as it is.
    pub fn into_device(self) -> Device<T, AXES> {
        self.device
    }

    /// What the module is.
    pub const fn spec(&self) -> &'static Spec {
        T::Product::SPEC
    }

    /// Executes a command from a link. What comes after a command that restarts the module is neither executed nor
    /// answered.
    pub fn execute(&mut self, now: Micros, origin: impl Into<Origin>, command: Command) -> Answer {
        let origin = origin.into();
        if self.device.restart().is_some() {
            return Poll::Ready(None);
        }
        self.supervision.hear(now, origin.source);
        let suppressed = self.suppressed(command.opcode);
        let outcome = self.dispatch(now, origin, command);
        let reply = match outcome {
            Ok(Outcome::Unanswered) => return Poll::Ready(None),
            Ok(Outcome::Special(reply)) => reply,
            Ok(Outcome::Stored { value, need, undo }) if !self.device.store().settled(need) => {
                let waiting = Waiting { from: Waiter::Link(origin), command, need, value, undo, suppressed };
                return match self.waiting.push(waiting) {
                    Ok(()) => Poll::Pending,
                    // Only a host that sends on without waiting for its replies can fill the queue.
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

    /// Lets time pass: once a millisecond, or as soon after [`Module::deadline`] as can be. Takes the
    /// inputs as they are now and returns the outputs as they shall be.
    ///
    /// A program gets its turn in slices: while it has something to do in this millisecond the deadline is past,
    /// and the call executes the next few commands.
    pub fn poll(&mut self, now: Micros, inputs: &Inputs<AXES>) -> Outputs {
        if now >= self.device.deadline() {
            self.take_turn(now, inputs);
        }
        if !self.device.is_in_turn() {
            self.run_slice(now);
        }
        let due = self.device.restart().is_some_and(|at| now >= at) && self.is_done();
        let outputs = self.device.outputs_mut();
        outputs.restart = due;
        *outputs
    }

    /// A piece of the turn of each millisecond. Never inlined: slices of a program, which come more often, are not to have
    /// its stack frame.
    #[inline(never)]
    fn take_turn(&mut self, now: Micros, inputs: &Inputs<AXES>) {
        if !self.device.is_in_turn() {
            self.update_link_settings();
            let supervised = self.device.begin(now, inputs);
            self.supervise(now, supervised);
        }
        let (axis, events) = self.device.next_axis(now);
        self.heed(axis as u8, events);
        if self.device.is_in_turn() {
            return;
        }
        self.settle();
        self.autostart();
        self.begin_turn();
        self.device.outputs_mut().led = (now.millis() / io::BLINK_MS).is_multiple_of(2);
    }

    /// Keeps parameter 77 from starting the program until the supply comes back: for a firmware that has had to start
    /// anew and does not know why it is where it is.
    pub const fn hold_program(&mut self) {
        self.starts = false;
    }

    /// When [`Module::poll`] wants to be called next.
    pub const fn deadline(&self) -> Micros {
        if self.fuel > 0 && self.machine.busy() { self.device.turn() } else { self.device.deadline() }
    }

    /// What has been added to the module.
    pub const fn hooks(&mut self) -> &mut T::Hooks {
        &mut self.hooks
    }

    /// The axes, to look at.
    pub const fn axes(&self) -> &[Axis<T::Hardware>; AXES] {
        self.device.axes()
    }

    /// The settings on their way to the EEPROM: take jobs from here, tell how they went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        self.device.store_mut()
    }

    /// From now on requests are neither executed nor answered and the program stands, so nothing new delays the restart
    /// that is due at `at`.
    fn restart(&mut self, at: Micros) {
        self.machine.stop();
        self.device.restart_at(at);
    }

    /// Global parameter 255; what reads something is answered always (manual section 5.1).
    fn suppressed(&self, opcode: u8) -> bool {
        const READ: [u8; 3] = [Opcode::Gap as u8, Opcode::Ggp as u8, Opcode::Gio as u8];
        self.global(G::SuppressReply) != 0 && !READ.contains(&opcode)
    }
}
