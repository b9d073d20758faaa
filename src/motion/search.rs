//! Reference search (manual section 7.1): finds a switch, passes its edges slowly and makes the middle
//! between them the zero point.
//!
//! A search is a list of legs, each a run in one direction until a switch closes or opens:
//!
//! | modes | legs |
//! |---|---|
//! | 1 | find the stop switch fast, leave it slowly, return to it slowly |
//! | 2 | the other stop switch fast (from inside), then as mode 1 |
//! | 4 | find the stop switch fast, leave it slowly, cross it slowly |
//! | 3 | the other stop switch fast (from inside), then as mode 4 |
//! | 5..8 | find the home switch fast, leave it slowly, cross it slowly |
//!
//! Then the motor goes to the middle between the edge where it left the switch and the one where it
//! returned to it, or left it on the far side, and counter and encoders are set to zero there. A switch that is
//! closed at the start counts as found. A leg across an edge begins with the switch closed, or closes it on
//! its way: so a fast motor that has run past a narrow home switch finds its way back.
//!
//! Stop switches are caught by the chip: it stops at once where one closes and latches the position where
//! one opens. The home switch is sampled with every poll, and each edge is late by less than one poll's
//! way, 1 ms at the speed of parameter 195. The two edges are passed in opposite directions, so both lag
//! outwards and the middle is off by less than half of that.
//!
//! What ends a leg must still be so when the motor has stood for a while, or the leg goes on: neither a glitch nor a
//! switch that bounces is taken for an edge. Only a fast motor may have run past the home switch. Therefore the leg
//! that leaves a switch looks for it as far back as the motor had run past it, and a little further; a switch that
//! is not there was none, and the search for it goes on.
//!
//! Modes 5 and 6 turn round at the first stop switch. Any other stop switch that is closed where a leg has to go
//! ends the search: at the second end, where the home switch overlaps a stop switch, so that it cannot be crossed,
//! where the stop switch on the other side is in the way. The manual is silent on that; here a search that gives up
//! leaves the motor standing, RFS STATUS 0 and position and encoders as they were, and raises the error flag EPO.
//!
//! Without the switch they look for, and in modes 5 and 6 without stop switches either, searches run on until they are
//! ended by RFS STOP, a motion command, or a change of parameter 1 or 138; so do modes 3 and 4 where a stop switch
//! never opens on its far side.
//! After a search the axis is in positioning mode: parameter 138 is 0, also where it was 1 before.

use embedded_hal::spi::SpiDevice;

use super::axis::{SETTLED, stops};
use super::position::Position;
use super::{Axis, Error};
use crate::chip::tmc429::{Register, Tmc429, reference};
use crate::param::AxisParameter as P;
use crate::units::{Internal, Micros};

/// Modes 1..=4: the right switch in place of the left one.
const RIGHT: i32 = 64;
/// Modes 5..=8: inverted home switch.
const INVERTED: i32 = 128;

/// Full steps that a switch may be away from where it was seen, beside the motor's overrun: one electrical period.
const SLACK: i32 = 4;

/// One run of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Leg {
    /// Off the stop switch on the other side, if it is closed at the start.
    Clear,
    /// To that switch, fast.
    Far,
    /// To the switch, fast.
    Find,
    /// Away from it until it opens: the first edge.
    Leave,
    /// Back until it closes: the second edge.
    Return,
    /// Back and on until it opens on the far side: the second edge.
    Cross,
    /// To the middle between the edges, after all others.
    Middle,
}

/// What is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Goal {
    /// The stop switch in the direction of the search.
    Stop,
    /// The home switch; the stop switches turn the search round.
    Home,
    /// The home switch of a circular axis; stop switches do not count.
    Circular,
}

/// What the motor does in a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// It comes to a stand, or stands.
    Resting,
    /// It has been told to run, but the chip may have heard only half of that.
    Starting,
    /// It is on its way.
    Running,
}

/// What is to be said of a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// It goes on.
    Underway,
    /// It is done.
    Over,
    /// A stop switch that it does not look for is in its way.
    Blocked,
    /// There is no switch where one was seen.
    Mistaken,
}

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    goal: Goal,
    legs: &'static [Leg],
    inverted: bool,
    /// Sign of the direction in which the switch is looked for.
    direction: i32,
    turned: bool,
    /// Parameters 194 and 195 as they were at the start.
    fast: Internal,
    slow: Internal,
    /// How many legs are done.
    done: usize,
    motion: Motion,
    /// What the last poll said of this leg, and for how many polls the motor has stood with that.
    verdict: Verdict,
    stood: u8,
    /// The switch has been closed in this leg.
    closed: bool,
    /// Where it was seen at first, and how far back it is looked for from there.
    seen: i32,
    limit: i32,
    /// The edges.
    first: i32,
    second: i32,
    far: Option<i32>,
}

impl Search {
    fn of(mode: i32, fast: Internal, slow: Internal) -> Self {
        use Leg::{Clear, Cross, Far, Find, Leave, Return};
        let number = mode & !(RIGHT | INVERTED);
        // Modes 6 and 7 search the home switch in positive direction.
        let (goal, legs, positive): (_, &[Leg], _) = match number {
            1 => (Goal::Stop, &[Find, Leave, Return], mode & RIGHT != 0),
            2 => (Goal::Stop, &[Clear, Far, Find, Leave, Return], mode & RIGHT != 0),
            3 => (Goal::Stop, &[Clear, Far, Find, Leave, Cross], mode & RIGHT != 0),
            4 => (Goal::Stop, &[Find, Leave, Cross], mode & RIGHT != 0),
            5 | 6 => (Goal::Home, &[Find, Leave, Cross], number == 6),
            _ => (Goal::Circular, &[Find, Leave, Cross], number == 7),
        };
        Search {
            goal,
            legs,
            inverted: mode & INVERTED != 0,
            direction: if positive { 1 } else { -1 },
            turned: false,
            fast,
            slow,
            done: 0,
            motion: Motion::Resting,
            verdict: Verdict::Underway,
            stood: 0,
            closed: false,
            seen: 0,
            limit: 0,
            first: 0,
            second: 0,
            far: None,
        }
    }

    fn leg(&self) -> Leg {
        self.legs.get(self.done).copied().unwrap_or(Leg::Middle)
    }

    /// The speed of parameter 195, for all but the rough search.
    pub(super) const fn switch_speed(&self) -> Internal {
        self.slow
    }

    /// Speed of the present leg.
    fn speed(&self) -> Internal {
        match self.leg() {
            Leg::Far => -self.fast * self.direction,
            Leg::Find => self.fast * self.direction,
            Leg::Leave => -self.slow * self.direction,
            Leg::Clear | Leg::Return | Leg::Cross => self.slow * self.direction,
            // That leg is a positioning move.
            Leg::Middle => 0,
        }
    }

    /// Reference switch bits of the TMC429 for the present leg. Parameters 12, 13 and 149 do not count.
    pub(super) fn reference(&self) -> u32 {
        let (ahead, latched) = if self.direction > 0 {
            (reference::DISABLE_STOP_R, reference::REF_RNL)
        } else {
            (reference::DISABLE_STOP_L, 0)
        };
        let disabled = match (self.goal, self.leg()) {
            (Goal::Circular, _) => reference::DISABLE_STOP_L | reference::DISABLE_STOP_R,
            // The motor runs over the closed switch.
            (Goal::Stop, Leg::Cross | Leg::Middle) => ahead,
            (Goal::Stop | Goal::Home, _) => 0,
        };
        disabled | latched
    }

    /// How far `position` lies beyond `mark`, in the direction of the search.
    fn beyond(&self, position: &Position, mark: i32) -> i32 {
        position.actual.wrapping_sub(mark).wrapping_mul(self.direction)
    }

    fn judge(&self, switches: Switches, position: &Position, standing: bool) -> Verdict {
        let closed = switches.closed(self);
        let other = switches.stop(-self.direction);
        let way = position.target.wrapping_sub(position.actual);
        let over = match self.leg() {
            Leg::Clear => !other,
            Leg::Far => other,
            Leg::Find => self.closed,
            Leg::Return => closed,
            Leg::Leave | Leg::Cross => self.closed && !closed,
            Leg::Middle => self.motion == Motion::Running && standing && way == 0,
        };
        let heading = if self.leg() == Leg::Middle { way } else { self.speed() };
        if over {
            Verdict::Over
        } else if stops(self.reference(), heading, switches.left, switches.right) {
            Verdict::Blocked
        } else if self.leg() == Leg::Leave && !self.closed && self.beyond(position, self.limit) < 0 {
            Verdict::Mistaken
        } else {
            Verdict::Underway
        }
    }

    /// The edge that the present leg ends at.
    fn mark(&mut self, edge: i32) {
        match self.leg() {
            Leg::Far => self.far = Some(edge),
            Leg::Find => self.seen = edge,
            Leg::Leave => self.first = edge,
            Leg::Return | Leg::Cross => self.second = edge,
            Leg::Clear | Leg::Middle => {}
        }
    }

    /// Turns to what comes next, now that the motor stands; false if there is nothing.
    fn proceed(&mut self, position: &Position, slack: i32) -> bool {
        match (self.verdict, self.leg()) {
            (Verdict::Underway, _) => {}
            (Verdict::Over, leg) => {
                if leg == Leg::Find {
                    let overrun = self.beyond(position, self.seen).saturating_abs();
                    let back = overrun.saturating_add(slack).wrapping_mul(self.direction);
                    self.limit = self.seen.wrapping_sub(back);
                }
                self.done = self.done.saturating_add(1);
            }
            // Back from leaving the switch to finding it.
            (Verdict::Mistaken, _) => self.done = self.done.saturating_sub(1),
            (Verdict::Blocked, Leg::Find) if !self.turned => {
                self.turned = true;
                self.direction = -self.direction;
            }
            (Verdict::Blocked, _) => return false,
        }
        true
    }
}

/// The stop switches and the home switch as they are now, polarity applied.
#[derive(Clone, Copy)]
struct Switches {
    left: bool,
    right: bool,
    home: bool,
}

impl Switches {
    /// The stop switch in a direction.
    fn stop(self, direction: i32) -> bool {
        if direction > 0 { self.right } else { self.left }
    }

    /// The switch that is searched.
    fn closed(self, search: &Search) -> bool {
        match search.goal {
            Goal::Stop => self.stop(search.direction),
            Goal::Home | Goal::Circular => self.home != search.inverted,
        }
    }
}

impl<D: SpiDevice> Axis<D> {
    /// RFS START: begins a search by the mode of parameter 193, at the speeds of parameters 194 and 195; what becomes
    /// of these parameters later is for the next one.
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
        let closed = switches.closed(&search);
        if closed && !search.closed {
            search.closed = true;
            self.arm_latch(chip)?;
        } else if search.leg() == Leg::Cross && !closed && search.beyond(&self.position, search.first) < 0 {
            // Whatever was closed, it was not the switch: that begins where the first edge is.
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

    /// From now on the stop switches act as their parameters say.
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
        search.closed = switches.closed(&search);
        search.verdict = Verdict::Underway;
        search.stood = 0;
        search.motion = Motion::Starting;
        // The stop switches act as this leg wants it.
        self.search = Some(search);
        if search.closed {
            self.arm_latch(chip)?;
        }
        if search.leg() == Leg::Middle {
            let span = search.second.wrapping_sub(search.first);
            self.travel_to(now, chip, search.first.wrapping_add(span / 2))?;
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
        Ok(chip.write(self.motor, Register::XLatched, 0)?)
    }

    /// Where the present leg ends: as the chip has latched it, if it has; a standing motor latches nothing (datasheet
    /// section 8.1.15).
    fn edge<M: SpiDevice>(&self, chip: &mut Tmc429<M>, search: &Search) -> Result<i32, Error> {
        let opens = search.goal == Goal::Stop && matches!(search.leg(), Leg::Leave | Leg::Cross);
        if !opens || chip.read(self.motor, Register::RefConfMode)? & reference::LATCH_PENDING != 0 {
            return Ok(self.position.actual);
        }
        Ok(self.position.extend(chip.read(self.motor, Register::XLatched)?))
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
