//! The user, who holds the shaft.

use tmcl_tools::failure::Failure;
use tmcl_tools::tune::{Brake, Drive};

use super::ask::Lines;

/// The user, who holds the shaft.
#[derive(Debug)]
pub(super) struct Hand(Lines);

impl Hand {
    /// The user at standard input.
    ///
    /// # Errors
    /// It cannot be read.
    pub(super) fn open() -> Result<Self, Failure> {
        Ok(Hand(Lines::open()?))
    }

    /// Waits until the user has done what is asked for, while the motor goes to and fro.
    fn ask(&mut self, text: &str, drive: &mut Drive<'_, '_>) -> Result<(), Failure> {
        self.0.say(text);
        while !self.0.confirmed()? {
            drive.look()?;
        }
        Ok(())
    }
}

impl Brake for Hand {
    fn hold(&mut self, drive: &mut Drive<'_, '_>) -> Result<String, Failure> {
        self.ask("Now brake the shaft while it turns, nearly as much as it can bear, and press Enter.", drive)?;
        Ok("by hand".into())
    }

    fn release(&mut self, drive: &mut Drive<'_, '_>) -> Result<(), Failure> {
        self.ask("Now let go of the shaft, and press Enter.", drive)
    }

    fn lost(&mut self, _: &mut Drive<'_, '_>) -> Result<i64, Failure> {
        Ok(0)
    }
}
