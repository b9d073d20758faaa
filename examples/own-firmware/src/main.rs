//! A firmware of one's own for the TMCM-1140: UF0 turns a motor as fast as the analog input says.

#![no_std]
#![no_main]

use tmcm::module::{Execute, Hooks, ports};
use tmcm::tmcl::{Command, Status};

/// Speed at full scale of the analog input, in internal units.
const FASTEST: i32 = 2000;
/// Full scale of the analog input, which has 12 bits.
const FULL_SCALE: i32 = 4095;

/// The user functions.
#[derive(Default)]
struct Potentiometer;

impl Hooks for Potentiometer {
    /// `UF0 0, AXIS, 0` reads the input and sets the speed of an axis, which is the value of the reply.
    fn call(&mut self, number: u8, command: Command, module: &mut impl Execute) -> Result<i32, Status> {
        match number {
            0 => {
                let reading = module.input(0, ports::ANALOG)?;
                module.rotate(command.motor, reading * FASTEST / FULL_SCALE)
            }
            _ => Err(Status::NotAvailable),
        }
    }
}

tmcm::image! { firmware: tmcm::board::Tmcl<tmcm::product::Tmcm1140, Potentiometer> }
