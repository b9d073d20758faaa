//! The device: everything a telegram can ask for, and what goes on between telegrams.
//!
//! Two entrances: a command comes in by [`Module::execute`] (or from a byte link's [`Port`] by
//! [`Module::serial`], as a frame by [`Module::can`]) and time by [`Module::poll`]. A reply may come later: `poll`
//! is followed by [`Module::next_serial`] and [`Module::next_frame`] until they have nothing more. There is no clock, no
//! wait and no hardware access but through the chip drivers; digital and analog signals are exchanged as plain
//! values.

#![deny(clippy::indexing_slicing, clippy::arithmetic_side_effects, clippy::unwrap_used, clippy::expect_used)]

mod axes;
mod can;
mod dispatch;
mod globals;
mod io;
mod link;
mod overheard;
mod port;
mod spec;
mod supervision;

pub use io::{Inputs, Outputs};
pub use link::{Answer, Links};
pub use port::{Heard, Message, Mode, Port, Request};
pub use spec::{Spec, TMCM_1140};

use overheard::Overheard;
use supervision::Supervision;

use embedded_hal::digital::OutputPin;
use embedded_hal::spi::SpiDevice;
use heapless::{Deque, Vec};

use crate::chip::tmc429::{Motor, Tmc429};
use crate::motion::{self, Axis};
use crate::param::{COORDINATES, GlobalParameter as G, InterruptParameter, USER_VARIABLES};
use crate::store::Store;
use crate::tmcl::{Command, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::Registers;

/// The hardware the core drives itself, as embedded-hal devices. The enable pin is low when the motor
/// drivers are on.
#[derive(Debug)]
pub struct Parts<M, D, E, const AXES: usize> {
    /// The motion controller.
    pub tmc429: M,
    /// The driver of each axis.
    pub tmc262: [D; AXES],
    /// The drivers' ENN.
    pub enable: E,
}

/// A link that commands come from and replies go to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// USB, or TCP in its place: point to point.
    Usb,
    /// The RS485 bus.
    Rs485,
    /// The CAN bus.
    Can {
        /// Data bytes of the request, 7 or 8; its replies have as many.
        length: u8,
    },
}

impl Source {
    /// True if both are the same link.
    fn same_link(self, other: Self) -> bool {
        core::mem::discriminant(&self) == core::mem::discriminant(&other)
    }
}

/// Links that can wait for a reply at the same time.
const LINKS: usize = 3;
/// Replies on their way: one per link, and one event.
const REPLIES: usize = LINKS + 1;

/// What became of a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// Answer at once.
    Reply(Reply),
    /// The reply comes by [`Module::next_serial`] or [`Module::next_frame`]; until then the link brings no other command.
    Pending,
    /// No reply.
    Silent,
}

/// Commands UF0..UF7: an image may give them a meaning (manual section 3.7.36).
pub trait UserFunctions {
    /// Executes user function `number`, 0..=7. The value is returned in the reply.
    ///
    /// # Errors
    /// The status to answer with; [`Status::NotAvailable`] unless overridden.
    fn call(&mut self, number: u8, command: Command) -> Result<i32, Status> {
        let _ = (number, command);
        Err(Status::NotAvailable)
    }
}

impl UserFunctions for () {}

/// What a command led to, before it becomes a reply.
#[derive(Clone, Copy, Debug)]
enum Done {
    /// Executed; the value of the reply.
    Value(i32),
    /// Executed, and answered with the value once it is durable; what to take back if that fails.
    Stored(i32, Option<Undo>),
    /// A reply of another form.
    Special(Reply),
    /// Executed without an answer.
    Silent,
}

/// A coordinate before the command that set and stored it. Parameters need none: what is stored of them is
/// what they are.
#[derive(Clone, Copy, Debug)]
struct Undo {
    axis: u8,
    number: u8,
    value: i32,
}

/// A reply that waits for the store.
#[derive(Clone, Copy, Debug)]
struct Waiting {
    source: Source,
    command: Command,
    /// The value of the reply if all goes well.
    value: i32,
    undo: Option<Undo>,
    silent: bool,
}

/// Command 138: who wants to know about which axes.
#[derive(Clone, Copy, Debug)]
struct Subscription {
    source: Source,
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
pub struct Module<M, D, E, U, const AXES: usize> {
    spec: &'static Spec,
    chip: Tmc429<M>,
    axes: [Axis<D>; AXES],
    enable: E,
    user: U,
    store: Store,
    globals: [i32; G::COUNT],
    variables: [i32; USER_VARIABLES],
    interrupts: [i32; InterruptParameter::COUNT],
    coordinates: [[i32; COORDINATES]; AXES],
    registers: Registers,
    links: Links,
    /// What was asked of other modules, on RS485 and on CAN.
    overheard: [Overheard; 2],
    waiting: Vec<Waiting, LINKS>,
    replies: Deque<(Source, Reply), REPLIES>,
    subscription: Option<Subscription>,
    supervision: Supervision,
    inputs: Inputs,
    outputs: Outputs,
    random: u32,
    /// The tick timer shows the milliseconds since this point, which may lie ahead.
    tick_offset: u32,
    restart: Option<Micros>,
    next: Micros,
}

/// Stops all motors, whatever the motion controller was doing: it keeps its registers through a restart of
/// the firmware and would run on. To be done before anything that takes time, such as reading the EEPROM.
///
/// # Errors
/// Those of the bus.
pub fn halt<M: SpiDevice>(tmc429: M) -> Result<(), M::Error> {
    Tmc429::new(tmc429).halt()
}

impl<M, D, E, U, const AXES: usize> Module<M, D, E, U, AXES>
where
    M: SpiDevice,
    D: SpiDevice,
    E: OutputPin,
    U: UserFunctions,
{
    /// Starts the module: stops whatever the motion controller was doing, restores the stored settings,
    /// sets up the chips and only then switches the drivers on. `seed` starts the random numbers.
    ///
    /// With a motion controller that does not answer the drivers stay off; the module answers all the same.
    pub fn new(
        spec: &'static Spec,
        parts: Parts<M, D, E, AXES>,
        user: U,
        store: Store,
        now: Micros,
        seed: u32,
    ) -> Self {
        let mut motors = Motor::ALL.into_iter().cycle();
        let mut module = Module {
            spec,
            chip: Tmc429::new(parts.tmc429),
            axes: parts.tmc262.map(|driver| Axis::new(motors.next().unwrap_or(Motor::M0), driver)),
            enable: parts.enable,
            user,
            store,
            globals: G::defaults(),
            variables: [0; USER_VARIABLES],
            interrupts: InterruptParameter::defaults(),
            coordinates: [[0; COORDINATES]; AXES],
            registers: Registers::default(),
            links: Links::default(),
            overheard: Default::default(),
            waiting: Vec::new(),
            replies: Deque::new(),
            subscription: None,
            supervision: Supervision::new(now),
            inputs: Inputs::default(),
            outputs: Outputs::default(),
            random: seed,
            tick_offset: now.millis() as u32,
            restart: None,
            next: now,
        };
        // An output pin of a microcontroller cannot fail; one that could would leave the drivers off.
        let _ = module.enable.set_high();
        module.restore();
        module.links = Links::of(&module.globals);
        if module.start(now).is_ok() {
            let _ = module.enable.set_low();
        }
        module
    }

    fn start(&mut self, now: Micros) -> Result<(), motion::Error> {
        self.chip.halt()?;
        self.chip.initialise()?;
        if !self.chip.present()? {
            return Err(motion::Error::Chip);
        }
        self.apply_polarity_and_direction()?;
        for axis in &mut self.axes {
            axis.start(now, &mut self.chip)?;
        }
        Ok(())
    }

    /// What the module is.
    pub const fn spec(&self) -> &'static Spec {
        self.spec
    }

    /// Executes a command from a link.
    pub fn execute(&mut self, now: Micros, source: Source, command: Command) -> Outcome {
        self.supervision.hear(now, source);
        let silent = self.suppressed(command.opcode);
        let reply = match self.dispatch(now, source, command) {
            Ok(Done::Silent) => return Outcome::Silent,
            Ok(Done::Special(reply)) => reply,
            Ok(Done::Stored(value, undo)) if !self.store.settled() => {
                let waiting = Waiting { source, command, value, undo, silent };
                return match self.waiting.push(waiting) {
                    Ok(()) => Outcome::Pending,
                    // Only a host that does not wait for replies comes here.
                    Err(_) => Outcome::Reply(Reply::echo(Status::NotAvailable, command)),
                };
            }
            Ok(Done::Value(value) | Done::Stored(value, _)) => {
                Reply::Plain { status: Status::Ok, opcode: command.opcode, value }
            }
            Err(status) => Reply::echo(status, command),
        };
        if silent { Outcome::Silent } else { Outcome::Reply(reply) }
    }

    /// Lets time pass: once a millisecond, or as soon after [`Module::deadline`] as can be. Takes the
    /// inputs as they are now and returns the outputs as they shall be.
    pub fn poll(&mut self, now: Micros, inputs: &Inputs) -> Outputs {
        if now < self.next {
            return self.outputs;
        }
        // From a late poll the next one is counted anew: polls do not bunch up.
        let due = self.next.after(PERIOD);
        self.next = if due > now { due } else { now.after(PERIOD) };
        self.inputs = *inputs;
        self.update_links();
        self.supervise(now);
        self.poll_axes(now);
        self.settle();
        let blink = (now.millis() / io::BLINK_MS).is_multiple_of(2);
        self.outputs.led = blink;
        self.outputs.restart = self.restart.is_some_and(|at| now >= at) && self.store.settled();
        self.outputs
    }

    /// When [`Module::poll`] wants to be called next.
    pub const fn deadline(&self) -> Micros {
        self.next
    }

    /// The settings on their way to the EEPROM: take jobs from here, tell how they went.
    pub const fn store(&mut self) -> &mut Store {
        &mut self.store
    }

    /// Releases the replies that waited for the store, once it is settled; if writing failed, with the
    /// status for that.
    pub fn stored(&mut self, written: bool) {
        self.store.finish(written);
        if written {
            return self.settle();
        }
        // What could not be stored is not in force either.
        self.reload_globals();
        let waiting = core::mem::take(&mut self.waiting);
        for Undo { axis, number, value } in waiting.iter().rev().filter_map(|waiting| waiting.undo) {
            if let Ok(place) = self.place(axis, number) {
                *place = value;
            }
        }
        // If the motion controller does not answer either, its driver knows that it has to write this again.
        let _ = self.apply_polarity_and_direction();
        for Waiting { source, command, silent, .. } in waiting {
            if !silent {
                let _ = self.replies.push_back((source, Reply::echo(Status::EepromLocked, command)));
            }
        }
    }

    fn settle(&mut self) {
        if !self.store.settled() {
            return;
        }
        for Waiting { source, command, value, silent, .. } in core::mem::take(&mut self.waiting) {
            if !silent {
                let reply = Reply::Plain { status: Status::Ok, opcode: command.opcode, value };
                let _ = self.replies.push_back((source, reply));
            }
        }
    }

    /// Global parameter 255; what reads something is answered always (manual section 5.1).
    fn suppressed(&self, opcode: u8) -> bool {
        let read = matches!(Opcode::from_number(opcode), Some(Opcode::Gap | Opcode::Ggp | Opcode::Gio));
        self.global(G::SuppressReply) != 0 && !read
    }
}
