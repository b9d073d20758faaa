//! The native board: the chips of a module, wired to the world, in virtual time.
//!
//! Time passes only by [`Board::advance_to`] and by SPI transfers, which take their time on the wire. A [`BoardKind`]
//! says which parts the board has, also what moves its motors. One pin enables all drivers; one bus has all chips but
//! the EEPROM, and the motion controllers run on 16 MHz. A restart of the firmware changes nothing in the chips, so a
//! motor that moves keeps moving; they forget only when the power is switched off.

mod bus;
mod calm;
mod chips;
mod devices;
mod faults;
pub(crate) mod kind;
mod motion;
pub(crate) mod products;
mod tmc429_tmc262;
mod tmc5160;

pub use bus::Datagram;
pub use calm::Calm;
pub use chips::Observed;
pub use devices::{SELECT_TIME, SharedBoard, SimPin, SimSpi};
pub use kind::{AbnPins, BoardKind, Chip, Input, MOST_ANALOG, MotionChips};
pub use products::*;
pub use tmc429_tmc262::TMC429_CLOCK_HZ;

use crate::chip::at25::At25;
use crate::chip::tmc262::Tmc262;
use crate::chip::tmc429::Tmc429;
use crate::chip::tmc5160::Tmc5160;
use crate::clock::Nanos;
use crate::fault::CanState;
use crate::world::config::WorldConfig;
use crate::world::pin::Pin;
use crate::world::stage::Abn;
use crate::world::{Outputs, World};
use bus::{Line, Loss};
use chips::Surroundings;
use motion::Motion;
use tmc429_tmc262::Tmc429sTmc262s;
use tmc5160::Tmc5160s;

/// The inputs of the board as a whole that the microcontroller can read without SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// The digital inputs: bit n is INn. The input of a normally open switch is high while the switch is pressed.
    pub digital: u32,
    /// The analog channels in their order, 0..=4095; zero where the board has no more channels.
    pub analog: [u16; MOST_ANALOG],
    /// Supply voltage in 0.1 V.
    pub supply: u16,
    /// Temperature in degrees Celsius.
    pub temperature: i32,
}

/// The inputs of one axis that the microcontroller can read without SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AxisInputs {
    /// The level of the home switch, for which the TMC429 has no input; high is pressed, if the switch is normally
    /// open.
    pub home: bool,
    /// The level of the right stop switch, which is connected to the motion controller as well.
    pub right: bool,
    /// The angle of the built-in encoder, 0..=1023 in a turn; `None` on a board without one.
    pub encoder: Option<u16>,
    /// The counter of the ABN encoder; all zero without one.
    pub abn: Abn,
    /// The level of the driver's pin SG_TST: high while the load value of a moving motor is zero.
    pub stall: bool,
}

/// The board, with the world around it.
#[derive(Debug)]
pub struct Board {
    kind: &'static BoardKind,
    now: Nanos,
    /// Until this time nothing happens by itself, so chips and world need not be looked at; 0 after a change from
    /// outside.
    due: Nanos,
    /// Steps of motors that change nothing but positions are due and have not been made yet; until this time nothing
    /// else happens by itself. `None` if chips and world are at the present.
    behind: Option<Nanos>,
    powered: bool,
    motion: Motion,
    at25: At25,
    world: World,
    /// The chip selects.
    lines: Vec<Line>,
    /// The datagrams on the motion bus since the last [`take_datagrams`](Board::take_datagrams); `None` before the
    /// first.
    recorded: Option<Vec<Datagram>>,
    /// Fault: the byte that the motion bus reads, whatever its chips send.
    motion_bus_stuck: Option<u8>,
    /// Fault: datagrams on the motion bus whose answers are lost.
    loss: Loss,
    /// Disturbance: what has become of the CAN controller, with and without power.
    can: CanState,
    /// Number of bytes that have been exchanged with the EEPROM.
    eeprom_bytes: u64,
    /// How often the world or the board was changed from outside.
    changes: u64,
    /// The value of `eeprom_bytes` at which the power is cut.
    cut_at: Option<u64>,
}

impl Board {
    /// A TMCM-1140 in the world that `config` describes, just powered on, at time 0, with a fresh EEPROM.
    /// `seed` is added to the world's own.
    pub fn new(config: &WorldConfig, seed: u64) -> Self {
        Self::of_kind(&TMCM_1140, config, seed)
    }

    /// A board of any kind, as [`new`](Self::new) makes a TMCM-1140.
    pub fn of_kind(kind: &'static BoardKind, config: &WorldConfig, seed: u64) -> Self {
        let seed = config.seed.wrapping_add(seed);
        let world = World::new(kind, config);
        let motion = match kind.motion {
            MotionChips::Tmc429Tmc262 => Motion::Tmc429sTmc262s(Tmc429sTmc262s::new(kind, config, seed)),
            MotionChips::Tmc5160 => Motion::Tmc5160s(Tmc5160s::new(kind, config, world.axes(), seed)),
        };
        let mut board = Self {
            kind,
            now: 0,
            due: 0,
            behind: None,
            powered: true,
            motion,
            at25: At25::new(kind.eeprom, seed),
            world,
            lines: Line::all(kind),
            recorded: None,
            motion_bus_stuck: None,
            loss: Loss::default(),
            can: CanState::On,
            eeprom_bytes: 0,
            changes: 0,
            cut_at: None,
        };
        board.connect();
        board
    }

    /// The kind of the board, which says what parts it has.
    pub fn kind(&self) -> &'static BoardKind {
        self.kind
    }

    /// The virtual time since the board was made, in nanoseconds.
    #[inline]
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// Lets time pass until `to`; chips and world move on. A time in the past changes nothing.
    #[inline]
    pub fn advance_to(&mut self, to: Nanos) {
        if to > self.now {
            self.now = to;
            if to >= self.due {
                self.act(to);
            }
        }
    }

    /// Lets time pass until `to`, but steps that change nothing but positions wait until somebody
    /// [looks](Self::catch_up). A motor that turns at a constant speed makes up to 61 in a millisecond, and most of
    /// them are nobody's business.
    #[inline]
    fn pass_to(&mut self, to: Nanos) {
        if to > self.now {
            self.now = to;
            if to >= self.due {
                self.wait(to);
            }
        }
    }

    /// Something is due by `to`, the present: does it, unless it can wait.
    fn wait(&mut self, to: Nanos) {
        let pressing = self.behind.unwrap_or_else(|| self.next_pressing());
        if to < pressing {
            self.behind = Some(pressing);
        } else {
            self.act(to);
        }
    }

    /// Brings chips and world to the present.
    #[inline]
    fn catch_up(&mut self) {
        if self.behind.is_some() {
            self.act(self.now);
        }
    }

    /// Does what is due by `to`, the present.
    fn act(&mut self, to: Nanos) {
        self.behind = None;
        if self.powered {
            self.motion.chips_mut().advance(to, self.world.axes_mut());
            self.at25.advance(to);
        }
        if self.world.settle(to) {
            self.show_switches();
        }
        self.due = self.next_due();
    }

    /// The next time at which something may change without the firmware's doing; it may be too early, but is never too
    /// late. `None` while all is at rest.
    pub fn next_event(&self) -> Option<Nanos> {
        let due = self.next_due();
        (due != Nanos::MAX).then_some(due)
    }

    /// As [`next_event`](Self::next_event), with the maximum for `None`.
    fn next_due(&self) -> Nanos {
        self.next_with(self.motion.chips().next_due())
    }

    /// As [`next_due`](Self::next_due), but steps that change nothing but positions do not count.
    fn next_pressing(&mut self) -> Nanos {
        let chips = self.motion.chips_mut().next_pressing(self.world.axes_mut());
        self.next_with(chips)
    }

    /// The next time at which something is due, if it is at `chips` in those of the motors.
    fn next_with(&self, chips: Nanos) -> Nanos {
        let due = |event: Option<Nanos>| event.unwrap_or(Nanos::MAX);
        let mut next = Nanos::MAX;
        if self.powered {
            next = due(self.at25.next_event()).min(chips);
        }
        for axis in self.world.axes() {
            next = next.min(due(axis.motor().next_event()));
        }
        next
    }

    /// Whether the board has power.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// Cuts the power: TMC429s and TMC262s forget everything, an EEPROM page that is being written is torn, and the
    /// outputs go off. The rotors stay where they are.
    pub fn power_off(&mut self) {
        if self.powered {
            self.powered = false;
            self.at25.power_cut();
            self.world.set_outputs(Outputs::default());
            self.motion.chips_mut().power_off();
            self.connect();
        }
    }

    /// Switches the power on again: the chips start from their reset states.
    pub fn power_on(&mut self) {
        if !self.powered {
            self.powered = true;
            self.motion.chips_mut().power_on(self.now, self.world.axes_mut());
            self.connect();
        }
    }

    /// Restarts the microcontroller, as watchdog or reset command do: its outputs and LEDs go off, and a datagram that
    /// is under way ends. The chips and the drivers' enable pin stay as they are.
    pub fn warm_reset(&mut self) {
        self.world.set_outputs(Outputs::default());
        for index in 0..self.lines.len() {
            let Line { chip, selected, .. } = self.lines[index];
            if selected {
                self.deselect(chip);
            }
        }
    }

    /// Gives the inputs of the board as a whole that the microcontroller can read without SPI.
    pub fn inputs(&self) -> Inputs {
        Inputs {
            digital: self.world.inputs(),
            analog: self.world.analog_channels(),
            supply: self.world.supply(),
            temperature: self.world.temperature(),
        }
    }

    /// Gives the inputs of an axis that the microcontroller can read without SPI. The board has to have the axis.
    pub fn axis_inputs(&self, axis: usize) -> AxisInputs {
        let world = self.world.axis(axis);
        AxisInputs {
            home: world.level(Pin::Home),
            right: world.level(Pin::Right),
            encoder: self.kind.magnetic_encoders.then(|| self.observe(axis).encoder),
            abn: world.stage().abn(),
            stall: self.powered && self.motion.chips().stall_pin(axis, self.now),
        }
    }

    /// Sets outputs, pull-ups and LEDs.
    pub fn set_outputs(&mut self, outputs: Outputs) {
        self.world.set_outputs(outputs);
    }

    /// Sets the level of the pin ENN of all drivers: low (false) enables them.
    pub fn set_disable_pin(&mut self, high: bool) {
        self.motion.chips_mut().set_disable_pin(high);
        self.connect();
    }

    /// Lets the clock of the motion controllers run, as it does from power-on, or stops it: then TMC429s stand still,
    /// and TMC5160s go on with their internal clocks.
    pub fn set_motion_clock(&mut self, running: bool) {
        self.motion.chips_mut().set_clock(self.now, running);
        self.changes += 1;
        self.due = 0;
    }

    /// Changes the world, for example switches, load or supply, and brings the levels at the chips up to date.
    pub fn change_world<R>(&mut self, change: impl FnOnce(&mut World) -> R) -> R {
        let result = change(&mut self.world);
        self.connect();
        result
    }

    /// Gives what can be seen of the chips of an axis, which the board has to have.
    pub fn observe(&self, axis: usize) -> Observed {
        let observed = self.motion.chips().observe(axis, self.world.axis(axis), self.now);
        // A chip without power has no speed, whatever its register held.
        if self.is_powered() { observed } else { Observed { velocity: 0, ..observed } }
    }

    /// The TMC429 of a number, to look at.
    ///
    /// # Panics
    /// If the board does not have it.
    pub fn tmc429(&self, number: usize) -> &Tmc429 {
        match &self.motion {
            Motion::Tmc429sTmc262s(chips) => chips.tmc429(number),
            Motion::Tmc5160s(_) => None,
        }
        .unwrap_or_else(|| self.lacks(Chip::Tmc429(number)))
    }

    /// The TMC262 of an axis, to look at.
    ///
    /// # Panics
    /// If the board does not have it.
    pub fn tmc262(&self, axis: usize) -> &Tmc262 {
        match &self.motion {
            Motion::Tmc429sTmc262s(chips) => chips.tmc262(axis),
            Motion::Tmc5160s(_) => None,
        }
        .unwrap_or_else(|| self.lacks(Chip::Tmc262(axis)))
    }

    /// The TMC5160 of an axis, to look at.
    ///
    /// # Panics
    /// If the board does not have it.
    pub fn tmc5160(&self, axis: usize) -> &Tmc5160 {
        match &self.motion {
            Motion::Tmc5160s(chips) => chips.tmc5160(axis),
            Motion::Tmc429sTmc262s(_) => None,
        }
        .unwrap_or_else(|| self.lacks(Chip::Tmc5160(axis)))
    }

    /// Whoever looks at a chip that the board does not have is told so.
    #[expect(clippy::panic, reason = "a mistake of the caller's")]
    fn lacks(&self, chip: Chip) -> ! {
        panic!("the {} has no {chip:?}", self.kind.name)
    }

    /// The EEPROM, to look at.
    pub fn at25(&self) -> &At25 {
        &self.at25
    }

    /// The EEPROM, to load its contents from a file.
    pub fn at25_mut(&mut self) -> &mut At25 {
        &mut self.at25
    }

    /// The world, to look at.
    pub fn world(&self) -> &World {
        &self.world
    }

    /// Brings all levels between chips and world up to date after something has changed.
    fn connect(&mut self) {
        self.changes += 1;
        for axis in 0..self.kind.axes() {
            self.connect_axis(axis);
        }
        self.settle();
    }

    /// Brings the levels between chips and world of one axis up to date.
    fn connect_axis(&mut self, axis: usize) {
        let supply = if self.powered { self.world.supply() } else { 0 };
        let around = Surroundings { now: self.now, supply, temperature: self.world.temperature() };
        let surroundings = self.world.axis_mut(axis);
        surroundings.motor_mut().set_supply(supply);
        self.motion.chips_mut().connect(axis, surroundings, around);
    }

    fn settle(&mut self) {
        self.world.settle(self.now);
        self.show_switches();
    }

    /// Brings the inputs of the motion controllers to the levels of switches and encoders.
    fn show_switches(&mut self) {
        self.due = 0;
        if self.powered {
            self.motion.chips_mut().sense(self.now, self.world.axes());
        }
    }
}

#[cfg(test)]
mod tests;
