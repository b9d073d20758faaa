//! An axis in a reference search (RFS): it looks, and does what the search in `search.rs` makes of what there is to be
//! seen.

use super::Error;
use super::axis::{Joined, Pace};
use super::hardware::{Goal, Hardware};
use super::plan::Plan;
use super::search::{Act, Edge, Search, View};
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
        let plan = Plan::of(self.values.get(P::ReferenceSearchMode));
        self.search_by(now, plan, fast, Pace { speed: Some(slow), acceleration: None })
    }

    /// Begins a search by a plan: the rough search goes at the speed `fast`, all else at that of `pace`, or of
    /// parameter 195 where that has none.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the speeds is zero: it would never end.
    pub fn search_by(&mut self, now: Micros, plan: Plan, fast: i32, pace: Pace) -> Result<(), Error> {
        let slow = pace.speed.unwrap_or(self.values.get(P::ReferenceSwitchSpeed));
        if fast == 0 || slow == 0 {
            return Err(Error::NotNow);
        }
        self.rotate_at(now, 0, pace.acceleration)?;
        self.search = Some(Search::new(plan, fast, slow));
        // While the motor comes to a stand the switches act as in the first leg.
        self.adjust()
    }

    /// RFS STOP: ends a search and stops the motor; without a search it does nothing.
    pub fn stop_search(&mut self, now: Micros) -> Result<(), Error> {
        if self.search.is_some() { self.rotate(now, 0) } else { Ok(()) }
    }

    /// Takes the search on by one poll; the position has been read in it. Where a datagram does not get through, the
    /// next poll does all of that again.
    pub(super) fn poll_search(&mut self, now: Micros, mut search: Search) -> Result<(), Error> {
        let switches = self.switches()?;
        self.actual_speed()?;
        let known = *self.hardware.known();
        let slack = SLACK << self.values.get(P::MicrostepResolution);
        let view = View { switches, known, index: self.encoders.index, slack };
        let notice = search.see(&view);
        if notice.closed {
            self.arm_latch()?;
        }
        match notice.ended {
            Some(Edge::Here) => search.mark(known.position),
            Some(Edge::Latched) => search.mark(self.latched()?.unwrap_or(known.position)),
            None => {}
        }
        match search.act(&view) {
            Act::Wait => {}
            Act::Stand => self.run_at(now, 0)?,
            Act::Begin => return self.begin_leg(now, search, &view),
            Act::Arrive => {
                let zeroed = self.zero(now, &search);
                return self.end_search(zeroed.is_ok());
            }
            Act::GiveUp => return self.end_search(false),
        }
        self.search = Some(search);
        Ok(())
    }

    /// Ends a search: from now on the stop switches act as their parameters say.
    fn end_search(&mut self, found: bool) -> Result<(), Error> {
        self.search = None;
        self.pace = Pace::default();
        self.events.reached |= found;
        self.events.cut_short |= !found;
        self.adjust()
    }

    fn begin_leg(&mut self, now: Micros, mut search: Search, view: &View) -> Result<(), Error> {
        let (goal, closed) = search.begin(view);
        // The stop switches act as this leg wants it.
        self.search = Some(search);
        if closed {
            self.arm_latch()?;
        }
        match goal {
            Goal::Speed(speed) => self.run_at(now, speed)?,
            Goal::Position { target, .. } => self.travel_to(now, target)?,
        }
        search.begun();
        self.search = Some(search);
        Ok(())
    }

    /// The position will be kept where the closed switch opens. Where the motor stands on the edge, it may be off the
    /// switch before the next poll.
    fn arm_latch(&mut self) -> Result<(), Error> {
        let (hardware, controller) = self.reach();
        hardware.latch(controller)
    }

    /// The position that has been kept, if one has.
    fn latched(&mut self) -> Result<Option<i32>, Error> {
        let (hardware, controller) = self.reach();
        hardware.latched(controller)
    }

    /// Makes the position zero, where the search has led. The encoders become zero with it: their
    /// deviation (parameters 212 and 218) is counted from there.
    fn zero(&mut self, now: Micros, search: &Search) -> Result<(), Error> {
        let zero = self.last_position();
        self.set_position(now, 0)?;
        self.encoders.zero();
        self.values.set(P::LastReferencePosition, zero);
        if let Some(far) = search.far() {
            self.values.set(P::EndSwitchDistance, far.wrapping_sub(zero).wrapping_abs());
        }
        Ok(())
    }
}
