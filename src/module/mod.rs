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
pub use io::{Inputs, Outputs};
pub use link_settings::{LinkMode, LinkSettings, ReplyAddresses};
pub use origin::{Answer, Due, Origin, Source};
pub use port::{Message, Port, Request, Taken};
pub use slots::Slots;
pub use spec::{Product, Spec, TMCM_1140, TMCM_1140_AXES, Tmcm1140, factory_reset};

use outcome::Outcome;
use overheard::Overheard;
use supervision::Supervision;
use waiting::{Waiter, Waiting};

use core::ops::DerefMut;
use core::task::Poll;

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use heapless::{Deque, Vec};

use crate::chip::tmc429::Tmc429;
use crate::motion::tmc429::Tmc429Tmc262;
use crate::motion::{self, Hardware};
use crate::param::{COORDINATES, GlobalParameter as G, USER_VARIABLES};
use crate::store::Store;
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

/// Links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Replies on their way: one per link, and one event.
const REPLIES: usize = LINKS + 1;
/// Commands that can wait for the store: one per link, the program's, and that of a handler within it.
const WAITING: usize = LINKS + 2;

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

/// What an axis of a module runs on.
type Chips<T> = Tmc429Tmc262<<T as Platform>::Tmc429, <T as Platform>::Tmc262>;
type Axis<T> = motion::Axis<Chips<T>>;

/// A module: axes, parameters, storage and links.
#[derive(Debug)]
pub struct Module<T: Platform, const AXES: usize> {
    controller: Tmc429<T::Tmc429>,
    axes: [motion::Axis<Tmc429Tmc262<T::Tmc429, T::Tmc262>>; AXES],
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
    link_settings: LinkSettings,
    /// A global parameter has been written since the link settings were taken from the global parameters.
    link_settings_stale: bool,
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
        let mut numbers = 0..;
        let Parts { tmc429, tmc262, enable, store, hooks } = parts;
        Module {
            controller: Tmc429::new(tmc429),
            axes: tmc262
                .map(|driver| Axis::<T>::new(Tmc429Tmc262::new(numbers.next().unwrap_or_default(), driver), spec.axis)),
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
            link_settings: LinkSettings::default(),
            link_settings_stale: false,
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
        let _ = Chips::<T>::halt(&mut self.controller);
        self.store.forget();
        load(&mut self.store);
        self.restore();
        self.link_settings = LinkSettings::of(&self.globals);
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
        Chips::<T>::start(&mut self.controller)?;
        self.apply_polarity_and_direction()?;
        for axis in &mut self.axes {
            axis.on(&mut self.controller).start(now)?;
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
    pub fn execute(&mut self, now: Micros, origin: impl Into<Origin>, command: Command) -> Answer {
        let origin = origin.into();
        if self.restart.is_some() {
            return Poll::Ready(None);
        }
        self.supervision.hear(now, origin.source);
        let suppressed = self.suppressed(command.opcode);
        let outcome = self.dispatch(now, origin, command);
        if outcome.is_ok() && command.opcode == Opcode::PositionReachedEvent as u8 {
            self.subscriptions = self.subscriptions.wrapping_add(1);
        }
        let reply = match outcome {
            Ok(Outcome::Unanswered) => return Poll::Ready(None),
            Ok(Outcome::Special(reply)) => reply,
            Ok(Outcome::Stored { value, need, undo }) if !self.store.settled(need) => {
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
    pub fn poll(&mut self, now: Micros, inputs: &Inputs) -> Outputs {
        if now >= self.next {
            self.inputs = *inputs;
            // From a late poll the next one is counted anew: polls do not bunch up.
            let due = self.next.after(PERIOD);
            self.next = if due > now { due } else { now.after(PERIOD) };
            self.update_link_settings();
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
    pub const fn axes(&self) -> &[motion::Axis<Chips<T>>; AXES] {
        &self.axes
    }

    /// The settings on their way to the EEPROM: take jobs from here, tell how they went.
    pub fn store(&mut self) -> &mut Store<T::Product> {
        &mut self.store
    }

    /// From now on requests are neither executed nor answered and the program stands, so nothing new delays the restart
    /// that is due at `at`.
    fn restart(&mut self, at: Micros) {
        self.machine.stop();
        self.restart = Some(at);
    }

    /// Global parameter 255; what reads something is answered always (manual section 5.1).
    fn suppressed(&self, opcode: u8) -> bool {
        const READ: [u8; 3] = [Opcode::Gap as u8, Opcode::Ggp as u8, Opcode::Gio as u8];
        self.global(G::SuppressReply) != 0 && !READ.contains(&opcode)
    }
}
