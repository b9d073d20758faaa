//! The device: everything a telegram can ask for, and what goes on between telegrams.
//!
//! Two entrances: a command comes in by [`Module::execute`], which [`Module::request`] calls for what a link brings, and
//! time by [`Module::poll`]. A reply may come later: `poll` is followed by [`Module::next_reply`] until there is none
//! left. There is no clock, no wait and no hardware access but through the chip drivers; digital and analog signals are
//! exchanged as plain values.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod axes;
mod can;
mod desk;
mod dispatch;
mod globals;
mod hooks;
mod io;
mod link;
mod overheard;
mod port;
mod program;
mod slots;
mod spec;
mod supervision;

pub use desk::{Desk, LinkEnds};
pub use hooks::{Executed, Hooks};
pub use io::{Inputs, Outputs};
pub use link::Links;
pub use port::{Message, Mode, Port, Request, Taken};
pub use slots::Slots;
pub use spec::{Product, Spec, TMCM_1140, TMCM_1140_AXES, Tmcm1140, factory_reset};

use overheard::Overheard;
use supervision::Supervision;

use core::ops::DerefMut;

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use heapless::{Deque, Vec};

use crate::chip::tmc429::{RampGenerator, Tmc429};
use crate::motion::{self, Axis};
use crate::param::{COORDINATES, GlobalParameter as G, USER_VARIABLES};
use crate::store::{Finished, Need, Store};
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::Machine;

/// What a module runs on, as types.
pub trait Platform {
    /// The product that it is a module of.
    type Product: Product;
    /// The way to the motion controller.
    type Tmc429: SpiDevice;
    /// The way to the driver of an axis.
    type Tmc262: SpiDevice;
    /// The drivers' ENN: low when they are on.
    type Enable: OutputPin;
    /// How the store is owned. It is larger than a stack should be, so a module does not contain it.
    type Store: DerefMut<Target = Store<Self::Product>>;
    /// What is added to the module.
    type Hooks: Hooks;
}

/// What a module runs on: the hardware it drives itself, its memory, additions.
#[derive(Debug)]
pub struct Parts<T: Platform, const AXES: usize> {
    /// The motion controller.
    pub tmc429: T::Tmc429,
    /// The driver of each axis.
    pub tmc262: [T::Tmc262; AXES],
    /// The drivers' ENN.
    pub enable: T::Enable,
    /// A new store.
    pub store: T::Store,
    /// Additions.
    pub hooks: T::Hooks,
}

/// A link that commands come from and replies go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// USB, or TCP in its place: point to point.
    Usb,
    /// The RS485 bus.
    Rs485,
    /// The CAN bus.
    Can,
}

/// Where a request came from, and its reply goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Origin {
    /// The link.
    pub source: Source,
    /// Data bytes of the request's frame on CAN, 7 or 8, as many as its reply has. On other links it means nothing.
    pub length: u8,
}

impl From<Source> for Origin {
    fn from(source: Source) -> Self {
        Origin { source, length: 8 }
    }
}

/// A reply that comes later than the call that brought its request, or an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Due {
    /// Where it goes.
    pub to: Origin,
    /// The reply; `None` where the request is over, but global parameter 255 suppresses its reply.
    pub reply: Option<Reply>,
}

/// Links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Replies on their way: one per link, and one event.
const REPLIES: usize = LINKS + 1;
/// Commands that can wait for the store: one per link, the program's, and that of a handler within it.
const WAITING: usize = LINKS + 2;

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Answer at once.
    Reply(Reply),
    /// The reply, or that there is none, comes by [`Module::next_reply`]; until then the link brings no other command.
    Pending,
    /// No reply.
    Silent,
}

/// What a command led to, before it becomes a reply.
#[derive(Clone, Copy, Debug)]
enum Done {
    /// Executed; the value of the reply.
    Value(i32),
    /// A value was read: a program gets it into its accumulator.
    Read(i32),
    /// Executed, and answered once it is durable.
    Stored {
        /// The value of the reply.
        value: i32,
        /// What is to be durable.
        need: Need,
        /// What to take back if that fails.
        undo: Option<Undo>,
    },
    /// A reply of another form.
    Special(Reply),
    /// Executed without an answer.
    Silent,
}

impl Done {
    /// A setting was stored.
    const fn stored(value: i32) -> Self {
        Done::Stored { value, need: Need::Settings, undo: None }
    }

    /// Program memory was written.
    const fn written(value: i32) -> Self {
        Done::Stored { value, need: Need::Program, undo: None }
    }
}

/// A coordinate before the command that set and stored it. Parameters need none: what is stored of them is
/// what they are.
#[derive(Clone, Copy, Debug)]
struct Undo {
    axis: u8,
    number: u8,
    value: i32,
}

/// Who waits for a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Waiter {
    Link(Origin),
    Program,
    /// Who has asked is gone.
    Nobody,
}

/// A command that waits for the store.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    from: Waiter,
    command: Command,
    need: Need,
    /// The value of the reply if all goes well.
    value: i32,
    undo: Option<Undo>,
    silent: bool,
}

/// Command 138: who wants to know about which axes.
#[derive(Clone, Copy, Debug)]
struct Subscription {
    origin: Origin,
    /// Axes whose next MVP shall be told of, as bits.
    mask: i32,
    /// For one MVP only.
    once: bool,
    /// Axes on such a move.
    armed: i32,
}

/// The pause between the reply to a software reset and the reset: time for it to get through, at 9600
/// baud (9.4 ms) and with a moderate telegram pause.
const RESTART_DELAY: Micros = Micros::from_millis(100);

/// Time between two polls.
const PERIOD: Micros = Micros::from_millis(1);

/// A module: axes, parameters, storage and links.
#[derive(Debug)]
pub struct Module<T: Platform, const AXES: usize> {
    chip: Tmc429<T::Tmc429>,
    axes: [Axis<T::Tmc262>; AXES],
    enable: T::Enable,
    hooks: T::Hooks,
    store: T::Store,
    globals: [i32; G::SETTINGS],
    variables: [i32; USER_VARIABLES],
    coordinates: [[i32; COORDINATES]; AXES],
    machine: Machine,
    /// The program is to be started if parameter 77 says so.
    starts: bool,
    /// The link that downloads a program.
    downloader: Option<Source>,
    /// What it may spend until the next one.
    fuel: u32,
    links: Links,
    /// A global parameter has been written since they were taken from there.
    links_stale: bool,
    /// What was asked of other modules, on RS485 and on CAN.
    overheard: [Overheard; 2],
    waiting: Vec<Waiting, WAITING>,
    replies: Deque<Due, REPLIES>,
    subscription: Option<Subscription>,
    /// How often there was a new one.
    subscriptions: u32,
    supervision: Supervision,
    inputs: Inputs,
    outputs: Outputs,
    random: u32,
    /// The tick timer shows the milliseconds since this point, which may lie ahead.
    tick_offset: u32,
    restart: Option<Micros>,
    next: Micros,
}

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// A module before its [start](Self::start). `seed` starts the random numbers.
    pub fn new(parts: Parts<T, AXES>, seed: u32) -> Self {
        const { spec::check::<T::Product>(AXES) };
        let spec = T::Product::SPEC;
        let mut generators = RampGenerator::ALL.into_iter().cycle();
        let Parts { tmc429, tmc262, enable, store, hooks } = parts;
        Module {
            chip: Tmc429::new(tmc429),
            axes: tmc262.map(|driver| Axis::new(generators.next().unwrap_or(RampGenerator::First), driver, spec.axis)),
            enable,
            hooks,
            store,
            globals: spec.global.defaults(),
            variables: [0; USER_VARIABLES],
            coordinates: [[0; COORDINATES]; AXES],
            machine: Machine::new(spec.commands),
            starts: true,
            downloader: None,
            fuel: 0,
            links: Links::default(),
            links_stale: false,
            overheard: Default::default(),
            waiting: Vec::new(),
            replies: Deque::new(),
            subscription: None,
            subscriptions: 0,
            supervision: Supervision::new(Micros(0)),
            inputs: Inputs::default(),
            outputs: Outputs::default(),
            random: seed,
            tick_offset: 0,
            restart: None,
            next: Micros(0),
        }
    }

    /// Starts the module: stops whatever the motion controller was doing - it keeps its registers through a
    /// restart of the firmware and would run on -, restores what is stored, sets up the chips and only then switches
    /// the drivers on. `load` fills the store, which takes its time.
    ///
    /// With a motion controller that does not answer the drivers stay off; the module answers all the same, and
    /// refuses motion commands.
    pub fn start(&mut self, now: Micros, load: impl FnOnce(&mut Store<T::Product>)) {
        // An output pin of a microcontroller cannot fail; one that could would leave the drivers off.
        let _ = self.enable.set_high();
        // One that does not hear now is asked again before the drivers are switched on.
        let _ = self.chip.halt();
        self.store.forget();
        load(&mut self.store);
        self.restore();
        self.links = Links::of(&self.globals);
        self.supervision = Supervision::new(now);
        self.tick_offset = now.millis() as u32;
        self.next = now;
        if (0..supervision::PATIENCE).any(|_| self.start_chips(now).is_ok()) {
            let _ = self.enable.set_low();
        } else {
            self.give_up();
        }
    }

    fn start_chips(&mut self, now: Micros) -> Result<(), motion::Error> {
        self.chip.confirm()?;
        self.chip.halt()?;
        self.chip.initialise()?;
        self.apply_polarity_and_direction()?;
        for axis in &mut self.axes {
            axis.start(now, &mut self.chip)?;
        }
        Ok(())
    }

    /// What the module is.
    pub const fn spec(&self) -> &'static Spec {
        T::Product::SPEC
    }

    /// The link on which somebody waits for the event of command 138, if somebody does. The number is another one
    /// after each such command that was carried out: by it those who share a link are told apart.
    pub fn subscriber(&self) -> Option<(Source, u32)> {
        let waited_for = |subscription: &Subscription| subscription.mask | subscription.armed != 0;
        self.subscription.filter(waited_for).map(|subscription| (subscription.origin.source, self.subscriptions))
    }

    /// Executes a command from a link. What comes after a command that restarts the module is neither executed nor
    /// answered.
    pub fn execute(&mut self, now: Micros, origin: impl Into<Origin>, command: Command) -> Outcome {
        let origin = origin.into();
        if self.restart.is_some() {
            return Outcome::Silent;
        }
        self.supervision.hear(now, origin.source);
        let silent = self.suppressed(command.opcode);
        let done = self.dispatch(now, origin, command);
        if done.is_ok() && command.opcode == Opcode::PositionReachedEvent as u8 {
            self.subscriptions = self.subscriptions.wrapping_add(1);
        }
        let reply = match done {
            Ok(Done::Silent) => return Outcome::Silent,
            Ok(Done::Special(reply)) => reply,
            Ok(Done::Stored { value, need, undo }) if !self.store.settled(need) => {
                let waiting = Waiting { from: Waiter::Link(origin), command, need, value, undo, silent };
                return match self.waiting.push(waiting) {
                    Ok(()) => Outcome::Pending,
                    // Only a host that does not wait for replies comes here.
                    Err(_) => Outcome::Reply(Reply::echo(Status::NotAvailable, command)),
                };
            }
            Ok(Done::Value(value) | Done::Read(value) | Done::Stored { value, .. }) => {
                Reply::Plain { status: Status::Ok, opcode: command.opcode, value }
            }
            Err(status) => Reply::echo(status, command),
        };
        if silent { Outcome::Silent } else { Outcome::Reply(reply) }
    }

    /// Lets time pass: once a millisecond, or as soon after [`Module::deadline`] as can be. Takes the
    /// inputs as they are now and returns the outputs as they shall be.
    ///
    /// A program gets its turn in slices: while it has something to do in this millisecond the deadline is past,
    /// and the call executes the next few commands.
    pub fn poll(&mut self, now: Micros, inputs: &Inputs) -> Outputs {
        if now >= self.next {
            self.inputs = *inputs;
            // From a late poll the next one is counted anew: polls do not bunch up.
            let due = self.next.after(PERIOD);
            self.next = if due > now { due } else { now.after(PERIOD) };
            self.update_links();
            self.supervise(now);
            let events = self.poll_axes(now);
            self.settle();
            self.autostart();
            self.begin_turn(events);
            let blink = (now.millis() / io::BLINK_MS).is_multiple_of(2);
            self.outputs.led = blink;
        }
        self.run_slice(now);
        self.outputs.restart = self.restart.is_some_and(|at| now >= at) && self.is_done();
        self.outputs
    }

    /// Keeps parameter 77 from starting the program until the supply comes back: for a firmware that has had to start
    /// anew and does not know why it is where it is.
    pub const fn hold_program(&mut self) {
        self.starts = false;
    }

    /// When [`Module::poll`] wants to be called next.
    pub const fn deadline(&self) -> Micros {
        if self.fuel > 0 && self.machine.busy() { self.turn() } else { self.next }
    }

    /// The time of the program: when the millisecond began that it is in, however late the poll.
    const fn turn(&self) -> Micros {
        self.next.since(PERIOD)
    }

    /// What has been added to the module.
    pub const fn hooks(&mut self) -> &mut T::Hooks {
        &mut self.hooks
    }

    /// The axes, to look at.
    pub const fn axes(&self) -> &[Axis<T::Tmc262>; AXES] {
        &self.axes
    }

    /// The settings on their way to the EEPROM: take jobs from here, tell how they went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        &mut self.store
    }

    /// Releases what waited for the store, once that is settled; if writing failed, with the status for that.
    pub fn stored(&mut self, written: bool) {
        let Finished { failed, erased } = self.store.finish(written);
        // What a factory reset makes of the parameters is for after the restart: until then the program is there, and
        // has to be protected.
        let resetting = self.restart.is_some();
        if let Some(protection) = erased.filter(|_| !resetting) {
            self.set_global_value(G::CodeProtection, protection);
        }
        let Some(failed) = failed else { return self.settle() };
        if failed == Need::Settings && !resetting {
            // What could not be stored is not in force either.
            self.reload_globals();
            for waiting in self.waiting.clone().iter().rev() {
                let Some(Undo { axis, number, value }) = waiting.undo else { continue };
                if let Ok(place) = self.place(axis, number) {
                    *place = value;
                }
            }
            // If the motion controller does not answer either, its driver knows that it has to write this again.
            let _ = self.apply_polarity_and_direction();
        }
        // Without its settings the program is not stored either.
        self.release(Status::EepromLocked, |waiting| failed == Need::Settings || waiting.need == failed);
    }

    /// From now on requests are neither executed nor answered and the program stands, so nothing new delays the restart
    /// that is due at `at`.
    fn restart(&mut self, at: Micros) {
        self.machine.stop();
        self.restart = Some(at);
    }

    /// What was asked before a restart is durable and answered.
    fn is_done(&self) -> bool {
        self.store.settled(Need::Settings) && self.waiting.is_empty()
    }

    fn settle(&mut self) {
        for need in [Need::Settings, Need::Program] {
            if self.store.settled(need) {
                self.release(Status::Ok, |waiting| waiting.need == need);
            }
        }
    }

    /// Answers the commands that waited for the store.
    fn release(&mut self, status: Status, which: impl Fn(&Waiting) -> bool) {
        self.waiting.retain(|waiting| {
            if !which(waiting) {
                return true;
            }
            let Waiting { from, command, value, silent, .. } = *waiting;
            let value = if status == Status::Ok { value } else { command.value };
            match from {
                Waiter::Program => self.machine.stored(),
                Waiter::Nobody => {}
                Waiter::Link(to) => {
                    let reply = Reply::Plain { status, opcode: command.opcode, value };
                    // A link has one command at a time that waits: there is room.
                    let _ = self.replies.push_back(Due { to, reply: (!silent).then_some(reply) });
                }
            }
            false
        });
    }

    /// Global parameter 255; what reads something is answered always (manual section 5.1).
    fn suppressed(&self, opcode: u8) -> bool {
        const READ: [u8; 3] = [Opcode::Gap as u8, Opcode::Ggp as u8, Opcode::Gio as u8];
        self.global(G::SuppressReply) != 0 && !READ.contains(&opcode)
    }
}
