//! The chips of a module as seen from their pins, one model per file, written from the datasheets.

pub mod at25;
mod bits;
pub mod encoder;
pub mod load;
mod ticks;
pub mod tmc262;
pub mod tmc429;
pub mod tmc5160;

use crate::clock::Nanos;

/// A chip with a chip select on an SPI bus. The bus belongs to the native board or to the emulated microcontroller;
/// before each call its owner has advanced the model to the present time.
pub trait SpiSlave {
    /// Chip select becomes active (falls).
    fn select(&mut self, now: Nanos);
    /// Eight clocks: takes the byte on MOSI and returns the byte the chip shifted out meanwhile.
    fn byte(&mut self, mosi: u8) -> u8;
    /// Eight clocks for each of `bytes`, with the byte on MOSI there before and the one the chip shifted out after.
    fn bytes(&mut self, bytes: &mut [u8]) {
        bytes.iter_mut().for_each(|byte| *byte = self.byte(*byte));
    }
    /// Chip select becomes inactive (rises); a complete datagram takes effect now.
    fn deselect(&mut self, now: Nanos);
}

/// The drivers and switches at the step/direction outputs and the reference switch inputs of the TMC429.
pub trait StepDir {
    /// Motor `motor` (0..=2) gets one step pulse at `at`; `up` is true when the position counter counts up (the
    /// direction pin's inversion by `inv_dir` is already applied to `dir_pin`). Returns the levels of the six reference
    /// switch pins after the step. Their order is that of the chip's REFERENCE_SWITCHES register: bit 0 REFR1, 1 REFL1,
    /// 2 REFR2, 3 REFL2, 4 REFR3, 5 REFL3.
    fn step(&mut self, at: Nanos, motor: usize, dir_pin: bool) -> u8;
    /// How many steps in this direction would change nothing but positions, neither a switch nor a current nor a
    /// measurement: these need not be told one by one. 0 if each step is to be told.
    fn free_steps(&self, motor: usize, dir_pin: bool) -> u32;
    /// Motor `motor` gets as many step pulses at once, of which the last comes at `at`. There are at most as many as
    /// [`free_steps`](Self::free_steps) says.
    fn skip(&mut self, at: Nanos, motor: usize, dir_pin: bool, steps: u32);
}

/// The levels of an ABN encoder's outputs.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tracks {
    /// Track A.
    pub a: bool,
    /// Track B.
    pub b: bool,
    /// The null track.
    pub n: bool,
}

/// The inputs of a chip that drives a motor by itself, as the chip finds them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sensed {
    /// The level at REFL.
    pub left: bool,
    /// The level at REFR.
    pub right: bool,
    /// The position of the encoder in quadrature counts; 0 without an encoder.
    pub count: i64,
}

/// The mechanics at the coils and the inputs of a TMC5160: a motor, with what it drives.
pub trait Mechanics {
    /// The field of the coils has moved to `field`, in 1/256 full steps, at `at`. Returns the inputs after that.
    fn turn(&mut self, at: Nanos, field: i64) -> Sensed;
    /// How far the field may move up or down, in 1/256 full steps, before anything but the motor's position changes.
    /// The value is 0 if the motor is to be told of each step. Steps on this way need not be told, but for the last
    /// one.
    fn free_way(&self, up: bool) -> i64;
    /// The current that makes torque is now `current`, in 1/32 of the full current; 0 with the bridges off.
    fn energise(&mut self, current: u32);
    /// The load on the motor.
    fn load(&self) -> load::LoadRatio;
    /// The levels of the encoder's outputs where it has counted to `count`.
    fn tracks(&self, count: i64) -> Tracks;
}
