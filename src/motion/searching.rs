//! The reference search of an axis (RFS), on its hardware. Each poll shows the search what there is to see, and then
//! does to the hardware what the state machine in `search.rs` asks for.

use super::Error;
use super::hardware::{Goal, Hardware, StopSwitches};
use super::joined::Joined;
use super::pace::Pace;
use super::plan::Plan;
use super::search::{Act, Edge, Search, View};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// How much further back than the motor's overrun a switch is looked for, in full steps: one electrical period of the
/// motor.
const SLACK: i32 = 4;

impl<H: Hardware> Joined<'_, H> {
    /// RFS START: begins a reference search by the mode of parameter 193, at the speeds of parameters 194 (fast legs)
    /// and 195 (slow legs). A later change of these parameters concerns the next search.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the two speeds is zero, because the search would never end; [`Error::Chip`] when a
    /// chip did not take a datagram.
    pub fn start_search(&mut self, now: Micros) -> Result<(), Error> {
        let (fast, slow) =
            (self.axis.values.get(P::ReferenceSearchSpeed), self.axis.values.get(P::ReferenceSwitchSpeed));
        let plan = Plan::of(self.axis.values.get(P::ReferenceSearchMode));
        self.search_by(now, plan, 0, fast, Pace { speed: Some(slow), ..Pace::default() })
    }

    /// Whether [`start_search`](Self::start_search) may begin a search.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of its two speeds is zero.
    pub fn may_search(&self) -> Result<(), Error> {
        let speeds = [P::ReferenceSearchSpeed, P::ReferenceSwitchSpeed];
        if speeds.into_iter().all(|speed| self.axis.values.is_on(speed)) { Ok(()) } else { Err(Error::NotNow) }
    }

    /// Begins a reference search by a plan; the zero point that it finds gets the position `home`, in microsteps. Fast
    /// legs go at the speed `fast`, slow legs at that of `pace`, or of parameter 195 where `pace` has none; both in the
    /// unit of parameter 4. The acceleration of `pace` holds for the whole search.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the two speeds is zero, because the search would never end; [`Error::Chip`] when a
    /// chip did not take a datagram.
    pub fn search_by(
        &mut self,
        now: Micros,
        plan: Plan,
        home: i32,
        fast: i32,
        pace: Pace<H::Shape>,
    ) -> Result<(), Error> {
        let slow = pace.speed.unwrap_or(self.axis.values.get(P::ReferenceSwitchSpeed));
        if fast == 0 || slow == 0 {
            return Err(Error::NotNow);
        }
        self.rotate_at(now, 0, pace.acceleration)?;
        self.axis.search = Some(Search::new(plan, home, fast, slow));
        self.axis.encoders.index = false;
        // While the motor comes to a stand, the stop switches already act as in the first leg.
        self.retune()
    }

    /// RFS STOP: ends a reference search and stops the motor along the ramp; without a search it does nothing.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn stop_search(&mut self, now: Micros) -> Result<(), Error> {
        if self.axis.search.is_some() { self.rotate(now, 0) } else { Ok(()) }
    }

    /// Advances the search by one poll, in which the position has been read before. If a datagram does not get through,
    /// `search` is not kept: the next poll does the same again from the state of the poll before.
    pub(super) fn poll_search(&mut self, now: Micros, mut search: Search) -> Result<(), Error> {
        let switches = self.turn_switches()?;
        self.actual_speed()?;
        let known = *self.axis.hardware.known();
        let slack = SLACK << self.axis.values.get(P::MicrostepResolution);
        let passed = core::mem::take(&mut self.axis.encoders.index);
        let angle = self.axis.sensors.encoder.filter(|_| passed);
        let index =
            angle.map(|angle| known.position.wrapping_sub(self.axis.encoders.beyond_index(angle, &self.axis.values)));
        let view = View { switches, known, index, slack };
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
            Act::GiveUp(side) => {
                self.axis.events.limit = Some(side);
                return self.end_search(false);
            }
        }
        self.axis.search = Some(search);
        Ok(())
    }

    /// Ends a search. From then on the stop switches act as their parameters say.
    fn end_search(&mut self, found: bool) -> Result<(), Error> {
        self.axis.search = None;
        self.set_pace(Pace::default());
        self.axis.events.reached |= found;
        self.axis.events.cut_short |= !found;
        self.retune()
    }

    /// Begins a leg: sets the stop switches for it, arms the latch if the switch is closed, and starts the motor.
    fn begin_leg(&mut self, now: Micros, mut search: Search, view: &View) -> Result<(), Error> {
        let (goal, closed) = search.begin(view);
        // With the search in place the profile below has the stop switches as this leg needs them.
        self.axis.search = Some(search);
        if closed {
            self.arm_latch()?;
        }
        match goal {
            Goal::Speed(speed) => self.run_at(now, speed)?,
            Goal::Position { target, .. } => self.travel_to(now, target)?,
        }
        search.begun();
        self.axis.search = Some(search);
        Ok(())
    }

    /// Arms the ramp generator's latch: it keeps the position at which the closed switch opens. A motor that stands on
    /// the edge may be off the switch before the next poll could see that.
    fn arm_latch(&mut self) -> Result<(), Error> {
        self.chips().latch()
    }

    /// The position that the latch has kept, in microsteps; `None` if it has kept none, as at a switch that the axis
    /// watches itself.
    fn latched(&mut self) -> Result<Option<i32>, Error> {
        self.chips().latched()
    }

    /// Gives the present position, the zero point that the search has found, its number. The positions of the encoders
    /// become the same, because their deviation (parameters 212 and 218) is counted from there. Parameter 197 keeps the
    /// former position, and parameter 196 the distance between the stop switches, if the search has measured it.
    fn zero(&mut self, now: Micros, search: &Search) -> Result<(), Error> {
        let zero = self.axis.last_position();
        self.set_positions(now, search.home())?;
        self.axis.values.set(P::LastReferencePosition, zero);
        if let Some(far) = search.far() {
            self.axis.values.set(P::EndSwitchDistance, far.wrapping_sub(zero).wrapping_abs());
        }
        Ok(())
    }
}
