//! Leaves turns of a firmware out, the polls of a millisecond each, in which it would only take the same readings
//! again. It does so while the firmware rests, while its program waits, and while motors turn at constant speeds.
//! Firmware and board are then as if all turns had been polled, to the nanosecond and to the number of datagrams.
//!
//! Whether turns may be left out is for the firmware and the board to say. The firmware tells what it acts upon, and
//! the board how long nothing of that happens. What a firmware knows is as old as its readings, which it takes in
//! rotation. So before turns are left out, a whole rotation has been polled since anything has happened, by which the
//! firmware knows all that there is to know. Where motors turn, enough turns are polled behind them to bring everything
//! up to date that follows from positions and loads.

use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::{MILLISECOND, Nanos};

/// Knowledge of the turns that were polled.
pub(super) struct Quiet {
    /// Number of turns in a row that were polled and in which nothing happened.
    turns: usize,
    /// The board's number of changes from outside, when it was last seen.
    changes: u64,
    /// When the last turn that was polled has begun, and the numbers of datagrams by chip then.
    begun: Nanos,
    datagrams: Vec<u64>,
    /// The turns of the last rotation, and the place of the last one among them.
    rotation: Vec<Turn>,
    last: usize,
}

/// The effects of a turn.
#[derive(Clone, Default)]
struct Turn {
    /// The number of datagrams that each chip has got.
    datagrams: Vec<u64>,
    /// How long after its beginning it was asked whether the EEPROM is to be looked after.
    asked: Nanos,
}

impl Quiet {
    /// Before the first turn of a firmware whose readings come again after so many turns.
    pub(super) fn new(rotation: u32) -> Self {
        let rotation = vec![Turn::default(); rotation as usize];
        Quiet { turns: 0, changes: 0, begun: 0, datagrams: Vec::new(), rotation, last: 0 }
    }

    /// Something has reached the firmware, or has been asked of it.
    pub(super) fn disturb(&mut self) {
        self.turns = 0;
    }

    /// True if nothing has happened for a whole rotation, and the board has not been changed since.
    pub(super) fn lasts(&self, board: &SharedBoard) -> bool {
        self.turns > self.rotation.len() && self.changes == board.changes()
    }

    /// A turn is to begin at `due`, in which nothing happens. In the turn before it was asked at `asked` whether the
    /// EEPROM is to be looked after.
    pub(super) fn begin(&mut self, board: &Board, due: Nanos, asked: Nanos) {
        let changes = std::mem::replace(&mut self.changes, board.changes());
        if changes != self.changes {
            self.turns = 0;
            return;
        }
        // The turn behind those that were left out has been noted already.
        if self.turns > 0 && self.begun == due {
            return;
        }
        self.turns += 1;
        if self.turns > 1 {
            self.last = (self.last + 1) % self.rotation.len();
            let turn = &mut self.rotation[self.last];
            turn.asked = asked - self.begun;
            turn.datagrams.clear();
            turn.datagrams.extend(board.datagram_counts().zip(&self.datagrams).map(|(count, before)| count - before));
        }
        self.note(board, due);
    }

    /// So many rotations are left out, of which the first was to begin at `due`: counts their datagrams. Returns the
    /// times at which it would have been asked whether the EEPROM is to be looked after.
    pub(super) fn pass<'a>(
        &'a mut self,
        board: &mut Board,
        due: Nanos,
        rotations: usize,
    ) -> impl Iterator<Item = Nanos> + use<'a> {
        for turn in &self.rotation {
            board.count_datagrams(turn.datagrams.iter().map(|count| count * rotations as u64));
        }
        let turns = rotations * self.rotation.len();
        self.note(board, due + turns as Nanos * MILLISECOND);
        let turn = |n: usize| &self.rotation[(self.last + 1 + n) % self.rotation.len()];
        (0..turns).map(move |n| due + n as Nanos * MILLISECOND + turn(n).asked)
    }

    fn note(&mut self, board: &Board, due: Nanos) {
        self.begun = due;
        self.datagrams.clear();
        self.datagrams.extend(board.datagram_counts());
    }
}
