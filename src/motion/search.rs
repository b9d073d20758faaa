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
//! The level of a switch that ends a leg must still be there when the motor has stood for a while, or the leg goes on:
//! neither a glitch nor a switch that bounces is taken for an edge. Only a fast motor may have run past the home
//! switch. Therefore the leg that leaves a switch looks for it as far back as the motor had run past it, and a little
//! further; a switch that is not there was none, and the search for it goes on.
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

use super::hardware::Known;
use super::switch::{Side, Stops, Switches};

/// Modes 1..=4: the right switch in place of the left one.
const RIGHT: i32 = 64;
/// Modes 5..=8: inverted home switch.
const INVERTED: i32 = 128;

/// One run of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leg {
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

/// The switch that is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Goal {
    /// The stop switch in the direction of the search.
    Stop,
    /// The home switch; the stop switches turn the search round.
    Home,
    /// The home switch of a circular axis; stop switches do not count.
    Circular,
}

/// The motor in a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Motion {
    /// The motor comes to a stand, or stands.
    Resting,
    /// The motor was to be started, but not all datagrams for that may have got through.
    Starting,
    /// The motor runs.
    Running,
}

/// How a leg stands, as of one poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Verdict {
    /// The leg goes on.
    Underway,
    /// The leg has come to its end.
    Over,
    /// A stop switch is in the way that is not the one the leg looks for.
    Blocked,
    /// There is no switch where one was seen before: that was a glitch.
    Mistaken,
}

/// A search under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    goal: Goal,
    legs: &'static [Leg],
    /// The home switch is normally closed: it counts as closed while its input is low.
    inverted: bool,
    /// Sign of the direction in which the switch is looked for.
    direction: i32,
    /// The search has turned round at a stop switch; it does so once.
    turned: bool,
    /// Speeds of parameters 194 and 195 at the start of the search.
    fast: i32,
    slow: i32,
    /// Number of legs that are done.
    pub(super) done: usize,
    pub(super) motion: Motion,
    /// The verdict of the last poll on this leg.
    pub(super) verdict: Verdict,
    /// For how many polls the motor has stood with that verdict.
    pub(super) stood: u8,
    /// The switch has been closed in this leg.
    pub(super) closed: bool,
    /// Position, in microsteps, at which the switch was seen first in a leg of the kind [`Leg::Find`].
    seen: i32,
    /// Position as far as which the switch is looked for on the way back.
    limit: i32,
    /// Positions of the two edges, and of the stop switch on the other side, in microsteps.
    pub(super) first: i32,
    second: i32,
    pub(super) far: Option<i32>,
}

impl Search {
    /// The search of a mode (parameter 193), at the speeds of parameters 194 (fast) and 195 (slow).
    pub(super) fn of(mode: i32, fast: i32, slow: i32) -> Self {
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

    /// The leg under way.
    pub(super) fn leg(&self) -> Leg {
        self.legs.get(self.done).copied().unwrap_or(Leg::Middle)
    }

    /// The speed of parameter 195, for all but the rough search.
    pub(super) const fn switch_speed(&self) -> i32 {
        self.slow
    }

    /// Speed of the leg under way; the sign is the direction.
    pub(super) fn speed(&self) -> i32 {
        match self.leg() {
            Leg::Far => -self.fast * self.direction,
            Leg::Find => self.fast * self.direction,
            Leg::Leave => -self.slow * self.direction,
            Leg::Clear | Leg::Return | Leg::Cross => self.slow * self.direction,
            // That leg is a positioning move.
            Leg::Middle => 0,
        }
    }

    /// What the stop switches do in the present leg. Parameters 12, 13 and 149 do not count.
    pub(super) fn stops(&self) -> Stops {
        let positive = self.direction > 0;
        let latch = if positive { Side::Right } else { Side::Left };
        let [left, right] = match (self.goal, self.leg()) {
            (Goal::Circular, _) => [false, false],
            // The motor runs over the closed switch.
            (Goal::Stop, Leg::Cross | Leg::Middle) => [positive, !positive],
            (Goal::Stop | Goal::Home, _) => [true, true],
        };
        Stops { left, right, soft: false, latch }
    }

    /// How far `position` lies beyond `mark`, in the direction of the search.
    pub(super) fn beyond(&self, position: i32, mark: i32) -> i32 {
        position.wrapping_sub(mark).wrapping_mul(self.direction)
    }

    /// How the leg stands with these switches, and the motor as it is.
    pub(super) fn judge(&self, switches: Switches, known: &Known) -> Verdict {
        let closed = self.is_closed(switches);
        let other = switches.towards(-self.direction);
        let way = known.target.wrapping_sub(known.position);
        let over = match self.leg() {
            Leg::Clear => !other,
            Leg::Far => other,
            Leg::Find => self.closed,
            Leg::Return => closed,
            Leg::Leave | Leg::Cross => self.closed && !closed,
            Leg::Middle => self.motion == Motion::Running && known.speed == 0 && way == 0,
        };
        let heading = if self.leg() == Leg::Middle { way } else { self.speed() };
        if over {
            Verdict::Over
        } else if self.stops().hold(heading, [switches.left, switches.right]) {
            Verdict::Blocked
        } else if self.leg() == Leg::Leave && !self.closed && self.beyond(known.position, self.limit) < 0 {
            Verdict::Mistaken
        } else {
            Verdict::Underway
        }
    }

    /// Notes the position of the edge at which the leg under way ends.
    pub(super) fn mark(&mut self, edge: i32) {
        match self.leg() {
            Leg::Far => self.far = Some(edge),
            Leg::Find => self.seen = edge,
            Leg::Leave => self.first = edge,
            Leg::Return | Leg::Cross => self.second = edge,
            Leg::Clear | Leg::Middle => {}
        }
    }

    /// Goes on to the next leg, or back to one, now that the motor stands; false if the search has to give up. `slack`
    /// is how much further than the overrun the switch is looked for, in microsteps.
    pub(super) fn proceed(&mut self, position: i32, slack: i32) -> bool {
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

    /// True if the switch that is searched is closed; a normally closed home switch counts as closed while it is open.
    pub(super) fn is_closed(&self, switches: Switches) -> bool {
        match self.goal {
            Goal::Stop => switches.towards(self.direction),
            Goal::Home | Goal::Circular => switches.home != self.inverted,
        }
    }

    /// True where the chip latches the position of the edge that ends this leg: it does so for stop switches that open.
    pub(super) fn edge_is_latched(&self) -> bool {
        self.goal == Goal::Stop && matches!(self.leg(), Leg::Leave | Leg::Cross)
    }

    /// The middle between the two edges, in microsteps.
    pub(super) fn middle(&self) -> i32 {
        let span = self.second.wrapping_sub(self.first);
        self.first.wrapping_add(span / 2)
    }
}
