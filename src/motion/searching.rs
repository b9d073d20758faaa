//! An axis in a reference search (RFS): it carries out the plan in `search.rs` leg by leg.

use super::Error;
use super::axis::Joined;
use super::hardware::Hardware;
use super::search::{Leg, Motion, Search, Verdict};
use super::switch::{SETTLED, Switches};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// Full steps that a switch may be away from where it was seen, beside the motor's overrun: one electrical period.
const SLACK: i32 = 4;

impl<H: Hardware> Joined<'_, H> {
    /// RFS START: begins a search by the mode of parameter 193, at the speeds of parameters 194 and 195. A later
    /// change of these parameters concerns the next search.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the search speeds (194, 195) is zero: it would never end.
    pub fn start_search(&mut self, now: Micros) -> Result<(), Error> {
        let (fast, slow) = (self.values.get(P::ReferenceSearchSpeed), self.values.get(P::ReferenceSwitchSpeed));
        if fast == 0 || slow == 0 {
            return Err(Error::NotNow);
        }
        self.rotate(now, 0)?;
        self.search = Some(Search::of(self.values.get(P::ReferenceSearchMode), fast, slow));
        // While the motor comes to a stand the switches act as in the first leg.
        self.adjust()
    }

    /// RFS STOP: ends a search and stops the motor; without a search it does nothing.
    pub fn stop_search(&mut self, now: Micros) -> Result<(), Error> {
        if self.search.is_some() { self.rotate(now, 0) } else { Ok(()) }
    }

    /// Takes the search on by one poll; the position has been read in it.
    pub(super) fn poll_search(&mut self, now: Micros, mut search: Search) -> Result<(), Error> {
        let switches = self.switches()?;
        let standing = self.actual_speed()? == 0;
        let known = *self.hardware.known();
        let closed = search.is_closed(switches);
        if closed && !search.closed {
            search.closed = true;
            self.arm_latch()?;
        } else if search.leg() == Leg::Cross && !closed && search.beyond(known.position, search.first) < 0 {
            // The contact that was closed was not that of the switch, which begins only at the first edge.
            search.closed = false;
        }
        let verdict = search.judge(switches, &known);
        if verdict == Verdict::Over && search.verdict != Verdict::Over {
            search.mark(self.edge(&search)?);
        }
        search.stood = if standing && verdict == search.verdict { search.stood.saturating_add(1) } else { 0 };
        search.verdict = verdict;
        if search.leg() == Leg::Middle && verdict == Verdict::Over {
            let zeroed = self.zero(now, &search);
            return self.end_search(zeroed.is_ok());
        }
        match search.motion {
            Motion::Running if verdict == Verdict::Underway => {}
            Motion::Running | Motion::Starting => {
                self.run_at(now, 0)?;
                search.motion = Motion::Resting;
            }
            Motion::Resting if search.stood >= SETTLED => {
                if !search.proceed(known.position, SLACK << self.values.get(P::MicrostepResolution)) {
                    return self.end_search(false);
                }
                return self.begin_leg(now, search, switches);
            }
            Motion::Resting => {}
        }
        self.search = Some(search);
        Ok(())
    }

    /// Ends a search: from now on the stop switches act as their parameters say.
    fn end_search(&mut self, found: bool) -> Result<(), Error> {
        self.search = None;
        self.events.reached |= found;
        self.events.cut_short |= !found;
        self.adjust()
    }

    fn begin_leg(&mut self, now: Micros, mut search: Search, switches: Switches) -> Result<(), Error> {
        search.closed = search.is_closed(switches);
        search.verdict = Verdict::Underway;
        search.stood = 0;
        search.motion = Motion::Starting;
        // The stop switches act as this leg wants it.
        self.search = Some(search);
        if search.closed {
            self.arm_latch()?;
        }
        if search.leg() == Leg::Middle {
            self.travel_to(now, search.middle())?;
        } else {
            self.run_at(now, search.speed())?;
        }
        search.motion = Motion::Running;
        self.search = Some(search);
        Ok(())
    }

    /// The position will be kept where the closed switch opens. Where the motor stands on the edge, it may be off the
    /// switch before the next poll.
    fn arm_latch(&mut self) -> Result<(), Error> {
        let (hardware, controller) = self.reach();
        hardware.latch(controller)
    }

    /// Where the present leg ends: as the hardware has latched it, if it has.
    fn edge(&mut self, search: &Search) -> Result<i32, Error> {
        let latched = if search.edge_is_latched() {
            let (hardware, controller) = self.reach();
            hardware.latched(controller)?
        } else {
            None
        };
        Ok(latched.unwrap_or(self.last_position()))
    }

    /// Makes the position zero, which is the middle. The encoders become zero with it: their
    /// deviation (parameters 212 and 218) is counted from there.
    fn zero(&mut self, now: Micros, search: &Search) -> Result<(), Error> {
        let zero = self.last_position();
        self.set_position(now, 0)?;
        self.encoders.zero();
        self.values.set(P::LastReferencePosition, zero);
        if let Some(far) = search.far {
            self.values.set(P::EndSwitchDistance, far.wrapping_sub(zero).wrapping_abs());
        }
        Ok(())
    }
}
