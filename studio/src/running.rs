//! The actions of a page on a virtual module, whatever this runs.

use std::time::Duration;

use crate::scope::Watched;
use crate::types::{Contents, Line, Module, Nothing, Play, Request, SampleRow, Ticket, Turn};
use crate::world::WorldSeen;

/// A virtual module behind the doors.
pub trait Running {
    /// The module, as the page is told of it.
    fn module(&self) -> Module;

    /// Takes a request. Its reply comes with a later turn.
    fn ask(&mut self, asked: Request) -> Ticket;

    /// The module as it was when it began, and what has been done to it since.
    ///
    /// # Errors
    /// That is more than a session has.
    fn done(&mut self) -> Result<Play, String>;

    /// The contents of the module's EEPROM.
    fn eeprom(&mut self) -> Contents;

    /// The values of curves now, which are looked at without letting time pass.
    fn look(&mut self, watched: &Watched) -> SampleRow;

    /// The values of curves now, and how time goes.
    fn see(&mut self, watched: &Watched, at: Duration) -> WorldSeen;

    /// Makes a row of these curves at each millisecond from now on, in place of those before.
    fn watch(&mut self, watched: &Watched) -> Nothing;

    /// Takes a line of the control port. Its answer comes with a later turn, perhaps behind that to a later line.
    fn control(&mut self, line: &Line, at: Duration) -> Ticket;

    /// Lets time pass up to the present, or as far as a turn suffices.
    fn turn(&mut self, clock: &dyn Fn() -> Duration) -> Turn;
}
