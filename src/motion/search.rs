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
//! returned to it, or left it on the far side, and the counter is set to zero there. A switch that is
//! closed at the start counts as found. A leg across an edge begins with the switch closed, or closes it on
//! its way: so a fast motor that has run past a narrow home switch finds its way back.
//!
//! Stop switches are caught by the chip: it stops at once where one closes and latches the position where
//! one opens. The home switch is sampled with every poll, and each edge is late by less than one poll's
//! way, 1 ms at the speed of parameter 195. The two edges are passed in opposite directions, so both lag
//! outwards and the middle is off by less than half of that.
//!
//! Modes 5 and 6 turn round at the stop switch ahead and give up at the other one; then the motor stands and
//! the counter is as it was. The other modes go on until they find their switch, or are ended by RFS STOP
//! or any motion command.

use embedded_hal::spi::SpiDevice;

use super::{Axis, Error};
use crate::chip::tmc429::{Register, Tmc429, reference};
use crate::param::AxisParameter as P;
use crate::units::{Internal, Micros};

/// Modes 1..=4: the right switch in place of the left one.
const RIGHT: i32 = 64;
/// Modes 5..=8: inverted home switch.
const INVERTED: i32 = 128;

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

/// How far a leg is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Stage {
    /// To be begun.
    Ready,
    /// Under way.
    Running,
    /// At its end; the motor comes to a stand.
    Stopping,
    /// All legs done: on the way to the middle.
    Homing,
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
    number: usize,
    stage: Stage,
    /// The switch has been closed in this leg.
    closed: bool,
    first: i32,
    second: i32,
    far: Option<i32>,
}

/// How a search stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Progress {
    Searching,
    Found,
    Lost,
}

impl Search {
    fn of(mode: i32) -> Self {
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
            number: 0,
            stage: Stage::Ready,
            closed: false,
            first: 0,
            second: 0,
            far: None,
        }
    }

    fn leg(&self) -> Option<Leg> {
        self.legs.get(self.number).copied()
    }

    /// Reference switch bits of the TMC429 for the present leg. Parameters 12, 13 and 149 do not count.
    pub(super) fn reference(&self) -> u32 {
        let (ahead, latched) = if self.direction > 0 {
            (reference::DISABLE_STOP_R, reference::REF_RNL)
        } else {
            (reference::DISABLE_STOP_L, 0)
        };
        let both = reference::DISABLE_STOP_L | reference::DISABLE_STOP_R;
        let disabled = match (self.goal, self.leg()) {
            (Goal::Circular, _) | (_, None) => both,
            // The motor runs on over the closed switch.
            (Goal::Stop, Some(Leg::Cross)) => ahead,
            (Goal::Stop | Goal::Home, Some(_)) => 0,
        };
        disabled | latched
    }

    /// The edge that the present leg ends at.
    fn mark(&mut self, edge: i32) {
        match self.leg() {
            Some(Leg::Far) => self.far = Some(edge),
            Some(Leg::Leave) => self.first = edge,
            Some(Leg::Return | Leg::Cross) => self.second = edge,
            Some(Leg::Clear | Leg::Find) | None => {}
        }
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
    /// RFS START: begins a search by the mode of parameter 193.
    ///
    /// # Errors
    /// [`Error::NotNow`] when one of the search speeds (194, 195) is zero: it would never end.
    pub fn start_search<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        if self.value(P::ReferenceSearchSpeed) == 0 || self.value(P::ReferenceSwitchSpeed) == 0 {
            return Err(Error::NotNow);
        }
        self.rotate(now, chip, 0)?;
        self.search = Some(Search::of(self.value(P::ReferenceSearchMode)));
        self.configure(chip)
    }

    /// RFS STOP: ends a search and stops the motor; without a search it does nothing.
    pub fn stop_search<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>) -> Result<(), Error> {
        if self.search.is_some() { self.rotate(now, chip, 0) } else { Ok(()) }
    }

    /// RFS STATUS: 0, or the number of the leg under way.
    pub fn search_status(&self) -> i32 {
        self.search.map_or(0, |search| search.number as i32 + 1)
    }

    /// Takes the search on by one poll; the position has been read in it. True if it gave up.
    pub(super) fn poll_search<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        mut search: Search,
    ) -> Result<bool, Error> {
        let (left, right) = self.switches(chip)?;
        let switches = Switches { left, right, home: self.sensors.home };
        let progress = match search.stage {
            Stage::Ready if self.actual_speed(chip)? != 0 => Progress::Searching,
            Stage::Ready => {
                self.begin_leg(now, chip, &mut search, switches)?;
                Progress::Searching
            }
            Stage::Running => self.watch_leg(now, chip, &mut search, switches)?,
            Stage::Stopping => {
                search.number = search.number.saturating_add(1);
                search.stage = Stage::Ready;
                Progress::Searching
            }
            Stage::Homing => self.arrive(now, chip, &search)?,
        };
        if progress == Progress::Searching {
            self.search = Some(search);
            return Ok(false);
        }
        self.search = None;
        if progress == Progress::Lost {
            self.run_at(now, chip, 0)?;
        }
        // From now on the stop switches act as their parameters say.
        self.configure(chip)?;
        Ok(progress == Progress::Lost)
    }

    fn begin_leg<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        search: &mut Search,
        switches: Switches,
    ) -> Result<(), Error> {
        let leg = search.leg();
        search.stage = if leg.is_some() { Stage::Running } else { Stage::Homing };
        search.closed = switches.closed(search);
        if search.closed {
            self.arm_latch(chip)?;
        }
        // The stop switches act as this leg wants it.
        self.search = Some(*search);
        match leg {
            Some(leg) => self.run_at(now, chip, self.leg_speed(search, leg)),
            None => {
                let span = search.second.wrapping_sub(search.first);
                self.travel_to(now, chip, search.first.wrapping_add(span / 2))
            }
        }
    }

    /// The chip will keep the position where the closed switch opens. Where the motor stands on the edge, it
    /// may be off the switch before the next poll.
    fn arm_latch<M: SpiDevice>(&self, chip: &mut Tmc429<M>) -> Result<(), Error> {
        Ok(chip.write(self.motor, Register::XLatched, 0)?)
    }

    fn leg_speed(&self, search: &Search, leg: Leg) -> Internal {
        let speed = match leg {
            Leg::Far | Leg::Find => self.value(P::ReferenceSearchSpeed),
            Leg::Clear | Leg::Leave | Leg::Return | Leg::Cross => self.value(P::ReferenceSwitchSpeed),
        };
        match leg {
            Leg::Far | Leg::Leave => -speed * search.direction,
            Leg::Clear | Leg::Find | Leg::Return | Leg::Cross => speed * search.direction,
        }
    }

    fn watch_leg<M: SpiDevice>(
        &mut self,
        now: Micros,
        chip: &mut Tmc429<M>,
        search: &mut Search,
        switches: Switches,
    ) -> Result<Progress, Error> {
        let Some(leg) = search.leg() else { return Ok(Progress::Lost) };
        let closed = switches.closed(search);
        if closed && !search.closed {
            search.closed = true;
            self.arm_latch(chip)?;
        }
        let other = switches.stop(-search.direction);
        let over = match leg {
            Leg::Clear => !other,
            Leg::Far => other,
            Leg::Find | Leg::Return => closed,
            Leg::Leave | Leg::Cross => search.closed && !closed,
        };
        if over {
            let edge = if search.goal == Goal::Stop && matches!(leg, Leg::Leave | Leg::Cross) {
                self.position.extend(chip.read(self.motor, Register::XLatched)?)
            } else {
                self.position.actual
            };
            search.mark(edge);
            search.stage = Stage::Stopping;
            self.run_at(now, chip, 0)?;
        } else if search.goal == Goal::Home && switches.stop(self.leg_speed(search, leg).signum()) {
            // A stop switch in place of the home switch.
            if search.turned || leg != Leg::Find {
                return Ok(Progress::Lost);
            }
            search.turned = true;
            search.direction = -search.direction;
            search.stage = Stage::Ready;
        }
        Ok(Progress::Searching)
    }

    /// Waits for the motor to stand on the middle, and makes it zero.
    fn arrive<M: SpiDevice>(&mut self, now: Micros, chip: &mut Tmc429<M>, search: &Search) -> Result<Progress, Error> {
        let zero = self.position.target;
        if self.position.actual != zero || self.actual_speed(chip)? != 0 {
            return Ok(Progress::Searching);
        }
        self.set_value(P::LastReferencePosition, zero);
        if let Some(far) = search.far {
            self.set_value(P::EndSwitchDistance, far.wrapping_sub(zero).wrapping_abs());
        }
        self.set_position(now, chip, 0)?;
        Ok(Progress::Found)
    }
}
