//! When a firmware is polled, and which of its turns are left out, as firmware and board say by [`Quiet`].

use hal_sim::board::Calm;
use hal_sim::clock::{MILLISECOND, Nanos};

use super::firmware::Simulable;
use super::periphery::Periphery;
use super::quiet::Quiet;
use super::traffic::Traffic;

/// Number of turns that are left out at once at most.
const LONGEST: u64 = 10_000;

/// A firmware with what is around it.
pub(super) struct Run<F, const AXES: usize> {
    pub(super) firmware: F,
    pub(super) periphery: Periphery<AXES>,
    pub(super) quiet: Quiet,
}

/// When a firmware is polled.
pub(super) trait Due {
    /// When the firmware wants to be polled next.
    fn deadline(&self) -> Nanos;

    /// When the firmware may do something next that nobody can do in its place, so that it has to be polled.
    fn acts(&self, traffic: &Traffic) -> Nanos;

    /// Leaves polls out that come before `to` and change nothing. Firmware, board and deadline, which this returns, are
    /// then as if all of them had come.
    fn skip(&mut self, to: Nanos, traffic: &Traffic) -> Nanos;
}

impl<F: Simulable<AXES>, const AXES: usize> Due for Run<F, AXES> {
    fn deadline(&self) -> Nanos {
        self.periphery.when(self.firmware.deadline())
    }

    fn acts(&self, traffic: &Traffic) -> Nanos {
        let due = self.deadline();
        if !self.firmware.takes_inputs(self.firmware.deadline()) || !self.quiet.lasts(self.periphery.board()) {
            return due;
        }
        self.calm(traffic).map_or(due, |(calm, _)| due + self.turns_until(calm.until).min(LONGEST) * MILLISECOND)
    }

    /// Each turn that is polled is looked at before, also that behind others that were left out. It reads anew what
    /// follows from positions, so that others may be left out behind it.
    fn skip(&mut self, to: Nanos, traffic: &Traffic) -> Nanos {
        let next = self.firmware.deadline();
        let due = self.periphery.when(next);
        if due <= to && self.firmware.takes_inputs(next) { self.leave_out(due, to, traffic) } else { due }
    }
}

impl<F: Simulable<AXES>, const AXES: usize> Run<F, AXES> {
    /// For how long nothing happens from the turn on that begins next, and whether a motor turns; `None` if the
    /// firmware is in the middle of something.
    fn calm(&self, traffic: &Traffic) -> Option<(Calm, bool)> {
        let (until, room) = self.firmware.calm().filter(|_| !traffic.has_unread())?;
        let board = self.periphery.board().borrow();
        if board.now() > self.deadline() {
            return None;
        }
        let calm = board.calm(&room);
        Some((Calm { until: calm.until.min(self.periphery.when(until)), ..calm }, room != [0; AXES]))
    }

    /// Looks at the turn that begins next, which is due. For how long turns may be left out, and whether a motor turns;
    /// `None` if none may be.
    fn look(&mut self, traffic: &Traffic) -> Option<(Calm, bool)> {
        let due = self.deadline();
        let calm = self.calm(traffic).filter(|(calm, _)| calm.until.min(calm.readable) >= due + MILLISECOND);
        let Run { periphery, quiet, .. } = self;
        if calm.is_some() {
            quiet.begin(&periphery.board().borrow(), due, periphery.asked());
        } else {
            quiet.disturb();
        }
        calm.filter(|_| quiet.lasts(periphery.board()))
    }

    /// Leaves turns out, of which the first is due at `due` and begins next, and all of which are over by `to`. Returns
    /// when the first turn that is not left out is due. Never inlined: polls that begin no turn are not to have its
    /// stack frame.
    #[inline(never)]
    fn leave_out(&mut self, due: Nanos, to: Nanos, traffic: &Traffic) -> Nanos {
        let Some((calm, turning)) = self.look(traffic) else { return due };
        let fresh = if turning { F::FRESH } else { 0 };
        let turns = self.turns_until(calm.until.min(to)).saturating_sub(fresh.into());
        let turns = turns.min(self.turns_until(calm.readable)).min(LONGEST);
        let rotations = turns / u64::from(F::ROTATION);
        if rotations == 0 {
            return due;
        }
        let outputs = self.firmware.pass(rotations as u32);
        let Run { periphery, quiet, .. } = self;
        periphery.write(&outputs);
        let board = periphery.board().clone();
        periphery.pass(quiet.pass(&mut board.borrow_mut(), due, rotations as usize));
        let due = self.deadline();
        board.borrow_mut().advance_to(due);
        self.look(traffic);
        due
    }

    /// Number of turns from the one on that begins next that are over by `end`.
    fn turns_until(&self, end: Nanos) -> u64 {
        end.saturating_sub(self.deadline()) / MILLISECOND
    }
}
