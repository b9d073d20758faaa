//! For how long a board goes on as it does: so long whoever looks at it finds nothing new but positions and loads of
//! motors that turn at constant speeds.

use super::Board;
use super::chips::Prospect;
use crate::clock::{MILLISECOND, Nanos};

/// How much earlier than a motor gets somewhere the board counts as calm no more: positions that are compared with it
/// may have been read as long ago.
const MARGIN: Nanos = 2 * MILLISECOND;

/// For how long a board goes on as it does, if nothing reaches it from outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Calm {
    /// Before this time nothing happens but that motors turn on at constant speeds: no input changes, and no chip tells
    /// anything new but the positions and loads of those motors.
    pub until: Nanos,
    /// By this time the encoders of absolute angles are to be read. Later a motor may have turned by more than half a
    /// turn, and would seem to have turned the other way.
    pub readable: Nanos,
}

impl Calm {
    /// No calm: the board is just doing something else.
    const NOT: Self = Self { until: 0, readable: 0 };

    fn and(self, other: Self) -> Self {
        Self { until: self.until.min(other.until), readable: self.readable.min(other.readable) }
    }
}

impl Board {
    /// For how long the board goes on as it does. By axis `room` is the number of steps that a motor may make until
    /// then, less those of 2 ms; 0 is for one that is to rest.
    pub fn calm(&self, room: &[u32]) -> Calm {
        let told = self.recorded.is_some() || self.loss.is_due() || self.lines.iter().any(|line| line.selected);
        if !self.powered || told || self.at25.next_event().is_some() {
            return Calm::NOT;
        }
        let axes = (0..).zip(room).map(|(number, room)| self.calm_of_axis(number, (*room).into()));
        axes.reduce(Calm::and).unwrap_or(Calm::NOT)
    }

    fn calm_of_axis(&self, number: usize, room: u64) -> Calm {
        let (axis, chips) = (self.world.axis(number), self.motion.chips());
        match chips.prospect(number, self.now) {
            Prospect::Rests(until) if room == 0 => {
                let until = axis.motor().next_event().map_or(until, |event| event.min(until));
                Calm { until, readable: Nanos::MAX }
            }
            Prospect::Turns { steps, microsteps, up } if room > 0 => {
                let steps_on = |way: i64| way.unsigned_abs().checked_div(microsteps).unwrap_or(u64::MAX);
                let before = |step: u64| chips.time_of_step(number, step).saturating_sub(MARGIN);
                let until = before(steps.min(room).min(steps_on(axis.clear_way(up))));
                let eighth = steps_on(axis.stage().units_per_turn() / 8);
                let readable = match self.kind.magnetic_encoders {
                    false => Nanos::MAX,
                    // So fast a motor is misread anyhow.
                    true if before(eighth) < self.now => 0,
                    true => before(3 * eighth),
                };
                Calm { until, readable }
            }
            _ => Calm::NOT,
        }
    }

    /// Number of times that each chip select fell, in the order of the lines, since the board was made.
    pub fn datagram_counts(&self) -> impl Iterator<Item = u64> {
        self.lines.iter().map(|line| line.datagrams)
    }

    /// Counts datagrams that were left out because nobody would have learnt anything by them, in the order of the
    /// lines.
    pub fn count_datagrams(&mut self, left_out: impl Iterator<Item = u64>) {
        for (line, count) in self.lines.iter_mut().zip(left_out) {
            line.datagrams += count;
        }
    }

    /// A number that is another one after each change of the world or of the board itself from outside.
    pub fn changes(&self) -> u64 {
        self.changes
    }
}
