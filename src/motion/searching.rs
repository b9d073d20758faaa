//! An axis in a reference search (RFS): it carries out the plan in `search.rs` leg by leg.

use embedded_hal::spi::SpiDevice;

use super::search::{Leg, Motion, Search, Verdict};
use super::switch::{SETTLED, Switches};
use super::{Axis, Error};
use crate::chip::tmc429::{Register, Tmc429, reference};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// Full steps that a switch may be away from where it was seen, beside the motor's overrun: one electrical period.
const SLACK: i32 = 4;

impl<D: SpiDevice> Axis<D> {
    /// RFS START: begins a search by the mode of parameter 193, at the speeds of parameters 194 and 195. A later
    /// change of these parameters concerns the next search.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the search speeds (194, 195) is zero: it would never end.
    pub fn start_search<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        let (fast, slow) = (self.value(P::ReferenceSearchSpeed), self.value(P::ReferenceSwitchSpeed));
        if fast == 0 || slow == 0 {
            return Err(Error::NotNow);
        }
        self.rotate(now, chip, 0)?;
        self.search = Some(Search::of(self.value(P::ReferenceSearchMode), fast, slow));
        // While the motor comes to a stand the switches act as in the first leg.
        self.configure(chip)
    }

    /// RFS STOP: ends a search and stops the motor; without a search it does nothing.
    pub fn stop_search<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        if self.search.is_some() { self.rotate(now, chip, 0) } else { Ok(()) }
    }

    /// True while a search is under way.
    pub const fn searches(&self) -> bool {
        self.search.is_some()
    }

    /// RFS STATUS: 0, or the number of the leg under way.
    pub fn search_status(&self) -> i32 {
        self.search.map_or(0, |search| search.done as i32 + 1)
    }

    /// Takes the search on by one poll; the position has been read in it.
    pub(super) fn poll_search<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        mut search: Search,
    ) -> Result<(), Error> {
        let (left, right) = self.switches(chip)?;
        let switches = Switches { left, right, home: self.sensors.home };
        let standing = self.actual_speed(chip)? == 0;
        let closed = search.is_closed(switches);
        if closed && !search.closed {
            search.closed = true;
            self.arm_latch(chip)?;
        } else if search.leg() == Leg::Cross && !closed && search.beyond(&self.position, search.first) < 0 {
            // The contact that was closed was not that of the switch, which begins only at the first edge.
            search.closed = false;
        }
        let verdict = search.judge(switches, &self.position, standing);
        if verdict == Verdict::Over && search.verdict != Verdict::Over {
            search.mark(self.edge(chip, &search)?);
        }
        search.stood = if standing && verdict == search.verdict { search.stood.saturating_add(1) } else { 0 };
        search.verdict = verdict;
        if search.leg() == Leg::Middle && verdict == Verdict::Over {
            let zeroed = self.zero(now, chip, &search);
            return self.end_search(chip, zeroed.is_ok());
        }
        match search.motion {
            Motion::Running if verdict == Verdict::Underway => {}
            Motion::Running | Motion::Starting => {
                self.run_at(now, chip, 0)?;
                search.motion = Motion::Resting;
            }
            Motion::Resting if search.stood >= SETTLED => {
                if !search.proceed(&self.position, SLACK << self.value(P::MicrostepResolution)) {
                    return self.end_search(chip, false);
                }
                return self.begin_leg(now, chip, search, switches);
            }
            Motion::Resting => {}
        }
        self.search = Some(search);
        Ok(())
    }

    /// Ends a search: from now on the stop switches act as their parameters say.
    fn end_search<M: SpiDevice>(&mut self, chip: &mut Tmc429<M>, found: bool) -> Result<(), Error> {
        self.search = None;
        self.events.reached |= found;
        self.events.cut_short |= !found;
        self.configure(chip)
    }

    fn begin_leg<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        mut search: Search,
        switches: Switches,
    ) -> Result<(), Error> {
        search.closed = search.is_closed(switches);
        search.verdict = Verdict::Underway;
        search.stood = 0;
        search.motion = Motion::Starting;
        // The stop switches act as this leg wants it.
        self.search = Some(search);
        if search.closed {
            self.arm_latch(chip)?;
        }
        if search.leg() == Leg::Middle {
            self.travel_to(now, chip, search.middle())?;
        } else {
            self.run_at(now, chip, search.speed())?;
        }
        search.motion = Motion::Running;
        self.search = Some(search);
        Ok(())
    }

    /// The chip will keep the position where the closed switch opens. Where the motor stands on the edge, it
    /// may be off the switch before the next poll.
    fn arm_latch<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.generator, Register::XLatched, 0)?)
    }

    /// Where the present leg ends: as the chip has latched it, if it has; a standing motor latches nothing (datasheet
    /// section 8.1.15).
    fn edge<M: SpiDevice>(&self, chip: &mut Tmc429<M>, search: &Search) -> Result<i32, Error> {
        if !search.edge_is_latched()
            || chip.read(self.generator, Register::RefConfMode)? & reference::LATCH_PENDING != 0
        {
            return Ok(self.position.actual);
        }
        Ok(self.position.extend(chip.read(self.generator, Register::XLatched)?))
    }

    /// Makes the position zero, which is the middle. The encoders become zero with it: their
    /// deviation (parameters 212 and 218) is counted from there.
    fn zero<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>, search: &Search) -> Result<(), Error> {
        let zero = self.position.actual;
        self.set_position(now, chip, 0)?;
        self.encoder.set(0);
        self.external.set(0);
        self.set_value(P::LastReferencePosition, zero);
        if let Some(far) = search.far {
            self.set_value(P::EndSwitchDistance, far.wrapping_sub(zero).wrapping_abs());
        }
        Ok(())
    }
}
