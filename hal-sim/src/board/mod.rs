//! The native board: the module's chips wired to the world, in virtual time.
//!
//! Time passes only through [`Board::advance_to`] and through SPI transfers, which take their time on the
//! wire. Wiring: TMC429 motor 0 steps the TMC262, whose field turns the motor; IN1 and IN2 are the TMC429's
//! reference switches as well; the TMC429 runs on 16 MHz. A restart of the firmware does nothing to the
//! chips: the TMC429 keeps running. Only switching the power off makes them forget.

mod devices;

pub use devices::{SELECT_TIME, SharedBoard, SimPin, SimSpi};

use crate::chip::at25::At25;
use crate::chip::encoder::MagneticEncoder;
use crate::chip::tmc262::{Bridge, SHUTDOWN_CELSIUS, Tmc262};
use crate::chip::tmc429::Tmc429;
use crate::chip::{SpiSlave, StepDir};
use crate::clock::Nanos;
use crate::fault::Fault;
use crate::world::config::WorldConfig;
use crate::world::stage::Abn;
use crate::world::{Outputs, World};

/// Clock of the TMC429 in Hz.
pub const TMC429_CLOCK_HZ: u32 = 16_000_000;
/// The lowest supply voltage at which the TMC262 works, in 0.1 V.
const DRIVER_SUPPLY: u16 = 50;
/// What a bus reads that nobody drives.
const FLOATING: u8 = 0xFF;

/// The chips that have a chip select.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Chip {
    /// The motion controller, on the motion bus.
    Tmc429,
    /// The driver stage, on the motion bus.
    Tmc262,
    /// The EEPROM, on a bus of its own.
    At25,
}

impl Chip {
    const ALL: [Self; 3] = [Self::Tmc429, Self::Tmc262, Self::At25];
}

/// What a chip of the motion bus is sent between the fall and the rise of its chip select, whether it hears it or not.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Datagram {
    /// The chip that is selected.
    pub chip: Chip,
    /// The bytes on MOSI.
    pub bytes: Vec<u8>,
}

/// What the microcontroller can read without SPI.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inputs {
    /// Digital inputs: bit n is IN0..IN3, high is pressed.
    pub digital: u8,
    /// Analog input IN0, 0..=4095.
    pub analog: u16,
    /// Supply voltage in 0.1 V.
    pub supply: u16,
    /// Temperature in degrees Celsius.
    pub temperature: i32,
    /// Built-in encoder, 0..=1023.
    pub encoder: u16,
    /// Counter of an ABN encoder on IN1..IN3, all zero without one.
    pub abn: Abn,
    /// The driver's stallGuard pin SG_TST.
    pub stall: bool,
}

/// The board.
#[derive(Debug)]
pub struct Board {
    now: Nanos,
    powered: bool,
    tmc429: Tmc429,
    tmc262: Tmc262,
    at25: At25,
    encoder: MagneticEncoder,
    world: World,
    datagrams: [u64; Chip::ALL.len()],
    /// The datagrams on the motion bus since they were last taken, if they are recorded.
    recorded: Option<Vec<Datagram>>,
    selected: [bool; Chip::ALL.len()],
    /// What the motion bus reads, whatever its chips say.
    motion_bus_stuck: Option<u8>,
    /// Chips that do not hear their chip select.
    deaf: [bool; Chip::ALL.len()],
    overtemperature: bool,
    eeprom_bytes: u64,
    cut_at: Option<u64>,
}

/// What the TMC429's step/direction outputs and reference inputs are connected to.
struct Wiring<'a> {
    driver: &'a mut Tmc262,
    world: &'a mut World,
}

impl StepDir for Wiring<'_> {
    #[inline]
    fn step(&mut self, at: Nanos, motor: usize, dir_pin: bool) -> u8 {
        if motor == 0 {
            let full_step = self.driver.step(at, dir_pin);
            self.world.follow(at, self.driver.field());
            if full_step {
                let load = self.world.motor().load_ratio();
                self.driver.take_reading(at, load);
                let current = self.driver.torque_current();
                self.world.motor_mut().set_current(current);
            }
        }
        self.world.reference_pins()
    }
}

impl Board {
    /// A board in the world that `config` describes, just powered on, at time 0, with a fresh EEPROM.
    /// `seed` is added to the world's own.
    pub fn new(config: &WorldConfig, seed: u64) -> Self {
        let seed = config.seed.wrapping_add(seed);
        let mut board = Self {
            now: 0,
            powered: true,
            tmc429: Tmc429::new(TMC429_CLOCK_HZ),
            tmc262: Tmc262::new(config.motor.stall_guard_noise, seed),
            at25: At25::new(seed),
            encoder: MagneticEncoder::new(config.units_per_turn(), config.encoder.offset),
            world: World::new(config),
            datagrams: [0; Chip::ALL.len()],
            recorded: None,
            selected: [false; Chip::ALL.len()],
            motion_bus_stuck: None,
            deaf: [false; Chip::ALL.len()],
            overtemperature: false,
            eeprom_bytes: 0,
            cut_at: None,
        };
        board.connect();
        board
    }

    /// Virtual time since the board was made.
    pub fn now(&self) -> Nanos {
        self.now
    }

    /// Lets time pass until `to`; chips and world move on. A time that has passed already does nothing.
    pub fn advance_to(&mut self, to: Nanos) {
        if to <= self.now {
            return;
        }
        self.now = to;
        if self.powered {
            let mut wiring = Wiring { driver: &mut self.tmc262, world: &mut self.world };
            self.tmc429.advance(to, &mut wiring);
            self.at25.advance(to);
        }
        self.settle();
    }

    /// The next time at which something may change without the firmware's doing (it may be early, but
    /// never late); none while all is at rest.
    pub fn next_event(&self) -> Option<Nanos> {
        let chips = if self.powered { [self.tmc429.next_event(), self.at25.next_event()] } else { [None; 2] };
        let world = self.world.motor().next_event();
        chips.into_iter().chain([world]).flatten().min()
    }

    /// Whether the board has power.
    pub fn is_powered(&self) -> bool {
        self.powered
    }

    /// Cuts the power: TMC429 and TMC262 forget everything, an EEPROM page being written is torn, the
    /// outputs go off. The rotor stays where it is.
    pub fn power_off(&mut self) {
        if self.powered {
            self.powered = false;
            self.at25.power_cut();
            self.world.set_outputs(Outputs::default());
            self.tmc262.set_disable_pin(true);
            self.tmc262.reset();
            self.connect();
        }
    }

    /// Switches the power on again: the chips start from their reset states.
    pub fn power_on(&mut self) {
        if !self.powered {
            self.powered = true;
            self.tmc429 = Tmc429::new(TMC429_CLOCK_HZ);
            let mut wiring = Wiring { driver: &mut self.tmc262, world: &mut self.world };
            self.tmc429.advance(self.now, &mut wiring);
            let field = self.tmc262.field();
            self.world.motor_mut().restart(field);
            self.connect();
        }
    }

    /// The microcontroller restarts (watchdog, reset command): its outputs and LEDs go off and a datagram
    /// under way ends. The chips and the driver's enable pin stay as they are.
    pub fn warm_reset(&mut self) {
        self.world.set_outputs(Outputs::default());
        for chip in Chip::ALL {
            if self.selected[chip as usize] {
                self.deselect(chip);
            }
        }
    }

    /// What the microcontroller can read without SPI.
    pub fn inputs(&self) -> Inputs {
        Inputs {
            digital: self.world.inputs(),
            analog: self.world.analog(),
            supply: self.world.supply(),
            temperature: self.world.temperature(),
            encoder: self.encoder.position(self.world.motor().rotor()),
            abn: self.world.stage().abn(),
            stall: self.powered && self.tmc262.stall_pin(self.now),
        }
    }

    /// Sets OUT0, OUT1, pull-ups and LEDs.
    pub fn set_outputs(&mut self, outputs: Outputs) {
        self.world.set_outputs(outputs);
    }

    /// Sets the level of the driver's pin ENN: low (false) enables it.
    pub fn set_disable_pin(&mut self, high: bool) {
        self.tmc262.set_disable_pin(high);
        self.connect();
    }

    /// Lets the TMC429's clock run, as it does from power-on, or stops it: then the chip stands still.
    pub fn set_motion_clock(&mut self, running: bool) {
        self.tmc429.set_clocked(self.now, running);
    }

    /// Changes the world (switches, load, supply ...) and lets the chips see it.
    pub fn change_world<R>(&mut self, change: impl FnOnce(&mut World) -> R) -> R {
        let result = change(&mut self.world);
        self.connect();
        result
    }

    /// Injects or removes a fault.
    pub fn set_fault(&mut self, fault: Fault, on: bool) {
        match fault {
            Fault::Eeprom => self.at25.set_answering(!on),
            Fault::Spi => self.motion_bus_stuck = on.then_some(0xFF),
            Fault::SpiLow => self.motion_bus_stuck = on.then_some(0),
            Fault::Tmc429 => self.set_deaf(Chip::Tmc429, on),
            Fault::Tmc262 => self.set_deaf(Chip::Tmc262, on),
            Fault::ShortA => self.tmc262.set_short(Bridge::A, on),
            Fault::ShortB => self.tmc262.set_short(Bridge::B, on),
            Fault::OpenA => self.tmc262.set_open(Bridge::A, on),
            Fault::OpenB => self.tmc262.set_open(Bridge::B, on),
            Fault::Overtemperature => self.overtemperature = on,
            Fault::Encoder => self.encoder.set_stuck(on, self.world.motor().rotor()),
        }
        self.connect();
    }

    /// Chip select of `chip` falls. The owner has advanced the board to the time at which it does.
    pub fn select(&mut self, chip: Chip) {
        self.selected[chip as usize] = true;
        self.datagrams[chip as usize] += 1;
        if chip != Chip::At25
            && let Some(recorded) = &mut self.recorded
        {
            recorded.push(Datagram { chip, bytes: Vec::with_capacity(4) });
        }
        if self.hears(chip) {
            let now = self.now;
            self.slave(chip).select(now);
        }
    }

    /// Eight clocks on the bus of `chip`, which is selected. Gives what MISO reads.
    pub fn byte(&mut self, chip: Chip, mosi: u8) -> u8 {
        // The motion bus has one datagram at a time: the last one is under way.
        if chip != Chip::At25
            && let Some(datagram) = self.recorded.as_mut().and_then(|recorded| recorded.last_mut())
        {
            datagram.bytes.push(mosi);
        }
        if !self.hears(chip) {
            return FLOATING;
        }
        let miso = self.slave(chip).byte(mosi);
        if chip == Chip::At25 {
            self.eeprom_bytes += 1;
            if self.cut_at == Some(self.eeprom_bytes) {
                self.power_off();
                return FLOATING;
            }
            return miso;
        }
        self.motion_bus_stuck.unwrap_or(miso)
    }

    /// How many bytes the EEPROM has exchanged since the board was made.
    pub fn eeprom_bytes(&self) -> u64 {
        self.eeprom_bytes
    }

    /// The power is cut right after that many bytes in all have been exchanged with the EEPROM, whatever is
    /// going on then.
    pub fn cut_power_at_byte(&mut self, bytes: u64) {
        self.cut_at = Some(bytes);
    }

    /// Chip select of `chip` rises; its datagram takes effect.
    pub fn deselect(&mut self, chip: Chip) {
        self.selected[chip as usize] = false;
        if self.hears(chip) {
            let now = self.now;
            self.slave(chip).deselect(now);
            self.connect();
        }
    }

    /// How many datagrams `chip` has been sent (times its chip select fell) since the board was made.
    pub fn datagrams(&self, chip: Chip) -> u64 {
        self.datagrams[chip as usize]
    }

    /// The datagrams to the chips of the motion bus since the last call, oldest first; they are recorded from the first
    /// call on.
    pub fn take_datagrams(&mut self) -> Vec<Datagram> {
        self.recorded.replace(Vec::new()).unwrap_or_default()
    }

    /// The motion controller, to look at.
    pub fn tmc429(&self) -> &Tmc429 {
        &self.tmc429
    }

    /// The driver stage, to look at.
    pub fn tmc262(&self) -> &Tmc262 {
        &self.tmc262
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

    /// Takes the chip select of `chip` away from it, or gives it back.
    fn set_deaf(&mut self, chip: Chip, deaf: bool) {
        let was = std::mem::replace(&mut self.deaf[chip as usize], deaf);
        if self.powered && self.selected[chip as usize] && was != deaf {
            let now = self.now;
            let slave = self.slave(chip);
            if deaf { slave.deselect(now) } else { slave.select(now) }
        }
    }

    fn hears(&self, chip: Chip) -> bool {
        self.powered && !self.deaf[chip as usize]
    }

    fn slave(&mut self, chip: Chip) -> &mut dyn SpiSlave {
        match chip {
            Chip::Tmc429 => &mut self.tmc429,
            Chip::Tmc262 => &mut self.tmc262,
            Chip::At25 => &mut self.at25,
        }
    }

    /// Brings all levels between chips and world up to date after something has changed.
    fn connect(&mut self) {
        let supplied = self.powered && self.world.supply() >= DRIVER_SUPPLY;
        self.tmc262.set_supplied(supplied);
        let mut temperature = self.world.temperature();
        if self.overtemperature {
            temperature = temperature.max(SHUTDOWN_CELSIUS);
        }
        self.tmc262.set_temperature(temperature);
        let (current, field) = (self.tmc262.torque_current(), self.tmc262.field());
        let motor = self.world.motor_mut();
        motor.set_current(current);
        motor.turn_field(self.now, field);
        self.settle();
    }

    fn settle(&mut self) {
        self.world.settle(self.now);
        if self.powered {
            let pins = self.world.reference_pins();
            self.tmc429.set_reference_pins(pins);
        }
    }
}

#[cfg(test)]
mod tests;
