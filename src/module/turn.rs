//! The turn of each millisecond: the device goes first, and what it has noticed is passed on. A host that falls silent
//! (global parameters 68 and 82) has the motors stopped here. For a supply that is too low or a silent motion
//! controller the device has stopped them already; here the program is stopped and the error flags are raised.
//!
//! Turns may be left out by whoever simulates a module: those in which it does nothing but to take the same readings
//! again.

use super::{Module, Platform};
use crate::device::{Device, Inputs, Outputs, Piece, Supervised, Supply};
use crate::motion::{Calm, Events, Foreseeable};
use crate::param::AxisParameter as P;
use crate::units::Micros;
use crate::vm::ErrorFlag;

/// The time that the status LED is on, and then off, in milliseconds.
const BLINK_MS: u64 = 1000;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Does the next piece of the turn of each millisecond. Never inlined: slices of a program, which come more often,
    /// are not to have its stack frame.
    #[inline(never)]
    pub(super) fn take_turn(&mut self, now: Micros, inputs: &Inputs<AXES>) {
        match self.device.next_piece() {
            Piece::Interpolations => return self.device.next_interpolations(),
            Piece::Reading => return self.device.next_reading(),
            Piece::Axis => {}
            Piece::Beginning => {
                self.links.update(&self.executor.globals, &self.waiting);
                let supervised = self.device.begin(now, inputs);
                self.supervise(now, supervised);
            }
        }
        let (axis, events) = self.device.next_axis(now);
        self.heed(axis, events);
        if self.device.next_piece() == Piece::Axis {
            return;
        }
        self.waiting.settle(self.device.store(), &mut self.machine);
        self.control().autostart();
        self.program.begin_turn(&mut self.machine, &self.device);
        self.blink(now);
        self.changed = true;
    }

    /// Stops the motors along the ramp when a host misses its heartbeat; until a host is heard again no motor can be
    /// started. Where the device has stopped the motors in this turn, stops the program, too.
    fn supervise(&mut self, now: Micros, supervised: Supervised) {
        let Supervised { supply, silent, resumed, ended } = supervised;
        self.note_ended(ended);
        if silent || supply == Supply::Lost {
            self.machine.stop();
        }
        if supply == Supply::Restored {
            self.program.starts = true;
        }
        if resumed {
            self.device.enable_drivers(true);
        }
        if self.links.heartbeat_missed(now, &self.executor.globals) && self.is_under_way() {
            let ended = self.device.end_moves(|axis| axis.rotate(now, 0));
            self.note_ended(Some(ended));
        }
        if self.device.lacks_supply() {
            self.machine.errors.raise(ErrorFlag::Shutdown);
        }
        if self.device.is_given_up() {
            self.machine.errors.raise(ErrorFlag::Alarm);
        }
    }

    /// Notes that all axes have been stopped, if `ended` is not `None`. Its bits are the axes that were on a
    /// positioning move.
    fn note_ended(&mut self, ended: Option<u32>) {
        let Some(moving) = ended else { return };
        if moving != 0 {
            self.machine.errors.raise(ErrorFlag::Position);
        }
        self.arrivals.disarm(u8::MAX);
    }

    /// True if a motor is on a move, or turns, or if its motion controller does not answer.
    fn is_under_way(&mut self) -> bool {
        (0..AXES).any(|number| {
            let Some(mut axis) = self.device.axis(number) else { return false };
            axis.state().travelling() || !matches!(axis.read(P::TargetSpeed), Ok(0))
        })
    }

    /// Passes the events of an axis on: to the error flags, to the interrupts of the program, and to the host of
    /// command 138.
    fn heed(&mut self, number: usize, events: Events) {
        let Events { reached, at_target, stall, cut_short, deviation, alarm, at_switch, limit: _ } = events;
        let (axis, bit) = (number as u8, 1_u8.unbounded_shl(number as u32));
        if at_switch && let Some(mut axis) = self.device.axis(number) {
            axis.end_at_switch();
        }
        for (event, flag) in
            [(cut_short, ErrorFlag::Position), (deviation, ErrorFlag::Deviation), (alarm, ErrorFlag::Alarm)]
        {
            if event {
                self.machine.errors.raise(flag);
            }
        }
        let signals = &mut self.program.signals;
        if at_target {
            signals.reached(axis);
        }
        if stall {
            signals.stall(axis);
        }
        if deviation {
            signals.deviation(axis);
        }
        if reached {
            self.arrivals.arrive(bit);
        } else if cut_short || stall || deviation || alarm {
            self.arrivals.disarm(bit);
        }
    }

    /// Lets the status LED blink. The division of 64 bits takes its time, so that there is one with each change only.
    fn blink(&mut self, now: Micros) {
        if now >= self.blinks {
            let count = now.millis() / BLINK_MS;
            self.blinks = Micros::from_millis(count.saturating_add(1).saturating_mul(BLINK_MS));
            self.device.outputs_mut().led = count.is_multiple_of(2);
        }
    }
}

impl<T: Platform<Hardware: Foreseeable>, const AXES: usize> Module<T, AXES> {
    /// Number of turns after which the same readings come again, as [`Device::ROTATION`].
    pub const ROTATION: u32 = Device::<T, AXES>::ROTATION;
    /// Number of turns after which nothing that is known of a motor that turns is older than they are, as
    /// [`Device::FRESH`].
    pub const FRESH: u32 = Device::<T, AXES>::FRESH;

    /// The prospects of the module until a request comes, if its inputs and its chips stay as they are. They are the
    /// time before which a turn only takes readings, and by axis how far motors may turn meanwhile, as in [`Calm`].
    /// `None` if the next turn may do more, or if the turn under way is not over. The status LED does not count.
    pub fn calm(&self) -> Option<(Micros, [u32; AXES])> {
        // The program is asked first: where one never waits, each turn is asked for in vain, and this is the shortest
        // answer.
        let program = self.machine.calm_until()?;
        let idle = !self.links.are_stale()
            && !self.changed
            && !self.program.starts
            && self.waiting.is_empty()
            && !self.waiting.owes_replies()
            && !self.arrivals.wait()
            && (self.program.fuel == 0 || !self.machine.busy());
        if !idle {
            return None;
        }
        let hosts = self.links.calm_until(&self.executor.globals);
        let axes = self.device.calm().filter(|_| self.device.store().is_idle())?;
        let until = axes.iter().fold(program.min(hosts), |until, axis| until.min(axis.until));
        Some((until, axes.map(|Calm { room, .. }| room)))
    }

    /// Lets whole rotations of turns pass that change nothing, as [`Module::calm`] has told. Returns the outputs as
    /// they are to be set after the last of them.
    pub fn pass(&mut self, rotations: u32) -> Outputs {
        self.device.pass(rotations);
        self.blink(self.device.turn());
        *self.device.outputs()
    }
}
