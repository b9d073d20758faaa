//! The native board: the chips of a module, wired to the world, in virtual time.
//!
//! Time passes only by [`Board::advance_to`] and by SPI transfers, which take their time on the wire. A [`BoardKind`]
//! says which parts the board has. Wiring: each motor of a TMC429 steps the TMC262 of its axis, whose field turns the
//! motor; the stop switches of the axis are at the reference inputs of that motor; the TMC429s run on 16 MHz. One pin
//! enables all drivers; one bus has all chips but the EEPROM. A restart of the firmware changes nothing in the chips,
//! so a TMC429 keeps running; they forget only when the power is switched off.

mod bus;
mod devices;
mod faults;
pub(crate) mod kind;

pub use bus::{Chip, Datagram};
pub use devices::{SELECT_TIME, SharedBoard, SimPin, SimSpi};
pub use kind::{AbnPins, BoardKind, Input, MOST_ANALOG, TMCM_1140, TMCM_3110, TMCM_6110};

use crate::chip::StepDir;
use crate::chip::at25::At25;
use crate::chip::encoder::MagneticEncoder;
use crate::chip::tmc262::{SHUTDOWN_CELSIUS, Tmc262};
use crate::chip::tmc429::Tmc429;
use crate::clock::Nanos;
use crate::fault::CanState;
use crate::world::config::WorldConfig;
use crate::world::pin::Pin;
use crate::world::stage::Abn;
use crate::world::{Axis, Outputs, World};
use bus::Line;

/// Clock of the TMC429s, in Hz.
pub const TMC429_CLOCK_HZ: u32 = 16_000_000;
/// The lowest supply voltage at which a TMC262 works, in units of 0.1 V.
const DRIVER_SUPPLY: u16 = 50;
/// The levels of reference inputs of a TMC429 to which nothing is wired: REFR2 and REFR3 have pull-up resistors in the
/// chip and read high, the others low.
const UNWIRED: u8 = 0b01_0100;

/// What the microcontroller can read without SPI of the board as a whole.
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

/// What the microcontroller can read of one axis without SPI.
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

/// A motion controller.
#[derive(Debug)]
struct Controller {
    chip: Tmc429,
    /// The number of the axis of the controller's first motor, and the number of its axes.
    first: usize,
    axes: usize,
    /// Levels of the controller's reference inputs, in the order of its register REFERENCE_SWITCHES.
    pins: u8,
    /// Fault: the controller does not hear its chip select.
    deaf: bool,
}

/// The driver of an axis, and the built-in encoder at its motor.
#[derive(Debug)]
struct Drive {
    chip: Tmc262,
    encoder: MagneticEncoder,
    /// Fault: the driver is too hot.
    overtemperature: bool,
    /// Fault: the driver does not hear its chip select.
    deaf: bool,
}

/// The board, with the world around it.
#[derive(Debug)]
pub struct Board {
    kind: &'static BoardKind,
    now: Nanos,
    /// Until this time nothing happens by itself, so chips and world need not be looked at; 0 after a change from
    /// outside.
    due: Nanos,
    powered: bool,
    controllers: Vec<Controller>,
    drives: Vec<Drive>,
    at25: At25,
    world: World,
    /// The chip selects, in the order of [`Board::line`].
    lines: Vec<Line>,
    /// The datagrams on the motion bus since the last [`take_datagrams`](Board::take_datagrams); `None` before the
    /// first.
    recorded: Option<Vec<Datagram>>,
    /// Fault: the byte that the motion bus reads, whatever its chips send.
    motion_bus_stuck: Option<u8>,
    /// Disturbance: what has become of the CAN controller, with and without power.
    can: CanState,
    /// Number of bytes that have been exchanged with the EEPROM.
    eeprom_bytes: u64,
    /// The value of `eeprom_bytes` at which the power is cut.
    cut_at: Option<u64>,
}

/// The connections of a TMC429's step/direction outputs and reference inputs. The first axis is that of its motor 0.
struct Wiring<'a> {
    drives: &'a mut [Drive],
    axes: &'a mut [Axis],
    pins: &'a mut u8,
}

impl Wiring<'_> {
    /// Sets the two reference inputs of a motor to the levels of its stop switches.
    #[inline]
    fn connect(pins: &mut u8, motor: usize, axis: &Axis) {
        *pins = *pins & !(0b11 << (2 * motor)) | axis.reference_pins() << (2 * motor);
    }
}

impl StepDir for Wiring<'_> {
    #[inline]
    fn step(&mut self, at: Nanos, motor: usize, dir_pin: bool) -> u8 {
        if let (Some(drive), Some(axis)) = (self.drives.get_mut(motor), self.axes.get_mut(motor)) {
            let driver = &mut drive.chip;
            let full_step = driver.step(at, dir_pin);
            axis.follow(at, driver.field());
            if full_step {
                let load = axis.motor().load_ratio();
                driver.take_reading(at, load);
                axis.motor_mut().set_current(driver.torque_current());
            }
            Self::connect(self.pins, motor, axis);
        }
        *self.pins
    }
}

impl Controller {
    fn new(first: usize, axes: usize) -> Self {
        Self { chip: Tmc429::new(TMC429_CLOCK_HZ), first, axes, pins: UNWIRED, deaf: false }
    }

    fn advance(&mut self, to: Nanos, drives: &mut [Drive], axes: &mut [Axis]) {
        let own = self.first..self.first + self.axes;
        let mut wiring = Wiring { drives: &mut drives[own.clone()], axes: &mut axes[own], pins: &mut self.pins };
        self.chip.advance(to, &mut wiring);
    }
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
        let firsts = (0..kind.axes()).filter(|axis| kind.motor(*axis).is_some_and(|(_, motor)| motor == 0));
        let controllers = firsts.zip(kind.controllers).map(|(first, &axes)| Controller::new(first, axes));
        let drives = (0..kind.axes()).map(|axis| {
            let config = config.axis(axis);
            Drive {
                chip: Tmc262::new(config.motor.stall_guard_noise, seed.wrapping_add(axis as u64)),
                encoder: MagneticEncoder::new(config.units_per_turn(), config.encoder.offset),
                overtemperature: false,
                deaf: false,
            }
        });
        let mut board = Self {
            kind,
            now: 0,
            due: 0,
            powered: true,
            controllers: controllers.collect(),
            drives: drives.collect(),
            at25: At25::new(kind.eeprom, seed),
            world: World::new(kind, config),
            lines: Line::all(kind),
            recorded: None,
            motion_bus_stuck: None,
            can: CanState::On,
            eeprom_bytes: 0,
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
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// Lets time pass until `to`; chips and world move on. A time in the past changes nothing.
    pub fn advance_to(&mut self, to: Nanos) {
        if to <= self.now {
            return;
        }
        self.now = to;
        if to < self.due {
            return;
        }
        if self.powered {
            for controller in &mut self.controllers {
                if !controller.chip.rest(to) {
                    controller.advance(to, &mut self.drives, self.world.axes_mut());
                }
            }
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
        let due = |event: Option<Nanos>| event.unwrap_or(Nanos::MAX);
        let mut next = Nanos::MAX;
        if self.powered {
            next = due(self.at25.next_event());
            for controller in &self.controllers {
                next = next.min(due(controller.chip.next_event()));
            }
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
            for drive in &mut self.drives {
                drive.chip.set_disable_pin(true);
                drive.chip.reset();
            }
            self.connect();
        }
    }

    /// Switches the power on again: the chips start from their reset states.
    pub fn power_on(&mut self) {
        if !self.powered {
            self.powered = true;
            for controller in &mut self.controllers {
                *controller =
                    Controller { deaf: controller.deaf, ..Controller::new(controller.first, controller.axes) };
                controller.advance(self.now, &mut self.drives, self.world.axes_mut());
            }
            for (drive, axis) in self.drives.iter().zip(self.world.axes_mut()) {
                axis.motor_mut().restart(drive.chip.field());
            }
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

    /// What the microcontroller can read without SPI of the board as a whole.
    pub fn inputs(&self) -> Inputs {
        Inputs {
            digital: self.world.inputs(),
            analog: self.world.analog_channels(),
            supply: self.world.supply(),
            temperature: self.world.temperature(),
        }
    }

    /// What the microcontroller can read of an axis, which the board has to have, without SPI.
    pub fn axis_inputs(&self, axis: usize) -> AxisInputs {
        let (drive, world) = (&self.drives[axis], self.world.axis(axis));
        let rotor = world.motor().rotor();
        AxisInputs {
            home: world.level(Pin::Home),
            right: world.level(Pin::Right),
            encoder: self.kind.magnetic_encoders.then(|| drive.encoder.position(rotor)),
            abn: world.stage().abn(),
            stall: self.powered && drive.chip.stall_pin(self.now),
        }
    }

    /// Sets outputs, pull-ups and LEDs.
    pub fn set_outputs(&mut self, outputs: Outputs) {
        self.world.set_outputs(outputs);
    }

    /// Sets the level of the pin ENN of all drivers: low (false) enables them.
    pub fn set_disable_pin(&mut self, high: bool) {
        for drive in &mut self.drives {
            drive.chip.set_disable_pin(high);
        }
        self.connect();
    }

    /// Lets the TMC429s' clock run, as it does from power-on, or stops it: then they stand still.
    pub fn set_motion_clock(&mut self, running: bool) {
        for controller in &mut self.controllers {
            controller.chip.rest(self.now);
            controller.chip.set_clocked(self.now, running);
        }
        self.due = 0;
    }

    /// Changes the world, for example switches, load or supply, and brings the levels at the chips up to date.
    pub fn change_world<R>(&mut self, change: impl FnOnce(&mut World) -> R) -> R {
        let result = change(&mut self.world);
        self.connect();
        result
    }

    /// The motion controller of a number, which the board has to have, to look at.
    pub fn tmc429(&self, number: usize) -> &Tmc429 {
        &self.controllers[number].chip
    }

    /// The driver of an axis, which the board has to have, to look at.
    pub fn tmc262(&self, axis: usize) -> &Tmc262 {
        &self.drives[axis].chip
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
        for axis in 0..self.drives.len() {
            self.connect_axis(axis);
        }
        self.settle();
    }

    /// Brings the levels between driver and world of one axis up to date.
    fn connect_axis(&mut self, axis: usize) {
        let drive = &mut self.drives[axis];
        drive.chip.set_supplied(self.powered && self.world.supply() >= DRIVER_SUPPLY);
        let mut temperature = self.world.temperature();
        if drive.overtemperature {
            temperature = temperature.max(SHUTDOWN_CELSIUS);
        }
        drive.chip.set_temperature(temperature);
        let motor = self.world.axis_mut(axis).motor_mut();
        motor.set_current(drive.chip.torque_current());
        motor.turn_field(self.now, drive.chip.field());
    }

    fn settle(&mut self) {
        self.world.settle(self.now);
        self.show_switches();
    }

    /// Brings the reference inputs of the motion controllers to the levels of the stop switches.
    fn show_switches(&mut self) {
        self.due = 0;
        if !self.powered {
            return;
        }
        for controller in &mut self.controllers {
            let axes = &self.world.axes()[controller.first..controller.first + controller.axes];
            for (motor, axis) in axes.iter().enumerate() {
                Wiring::connect(&mut controller.pins, motor, axis);
            }
            controller.chip.rest(self.now);
            controller.chip.set_reference_pins(controller.pins);
        }
    }
}

#[cfg(test)]
mod tests;
