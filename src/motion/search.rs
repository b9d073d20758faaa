//! The state machine of a reference search (manual section 7.1). A search finds a switch, passes its edges slowly, and
//! makes one of them, or the middle between them, the zero point. Which legs a search has is said by a [`Plan`]. This
//! file carries it out by what each poll sees, as a pure function without access to the hardware; `searching.rs` tells
//! the hardware.
//!
//! After the last leg the motor goes to the zero point, and the position and both encoders become zero there. A switch
//! that is closed at the start counts as found. A leg that ends where a switch opens begins with the switch closed, or
//! closes it on its way. So a fast motor that has run past a narrow home switch finds its way back.
//!
//! The ramp generator itself watches the stop switches: it stops the motor at once where one closes, and latches the
//! position where one opens. The home switch, and the zero point of the built-in encoder, which can end a leg, are
//! sampled by the poll of each millisecond. Their edges are seen late by less than the way of 1 ms at the slow speed.
//! Where two edges are passed in opposite directions, both are taken too far outwards, and their middle is off by less
//! than half of that way.
//!
//! The level of a switch that ends a leg must still be there when the motor has stood for [`SETTLED`] polls, else the
//! leg goes on. So neither a glitch nor a bouncing switch is taken for an edge. Only a motor that finds the home switch
//! may have run past it. Therefore the leg that comes back looks for the switch as far back as the motor has run past
//! it, and a little further. If the switch is not found there, it was a glitch, and the leg before begins again.
//!
//! Modes 5 and 6 turn round at the first stop switch. Any other closed stop switch in the way of a leg ends the search.
//! This happens at the second end of the axis, and where the stop switch at the other end is in the way. It also
//! happens where the home switch overlaps a stop switch, so that it cannot be crossed. The manual does not say what
//! happens then. Here a search that gives up leaves the motor standing, RFS STATUS 0, and position and encoders as they
//! were. It also raises the error flag EPO.
//!
//! A search whose switch does not exist runs on until it is ended by RFS STOP, a motion command, or a change of
//! parameter 1 or 138. In modes 5 and 6 it does so if the axis has no stop switches either. A search in mode 3 or 4
//! whose stop switch never opens on its far side runs on in the same way. After a search the axis is in positioning
//! mode: parameter 138 is 0, also where it was 1 before.

use super::hardware::{Goal, Known};
use super::plan::{Leg, Mark, Plan, Sought, Until};
use super::switch::{SETTLED, Side, Stops, Switches};

/// The view that one poll has of the motor.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub switches: Switches,
    /// The motor, with its position and speed read in this poll.
    pub known: Known,
    /// The position of the built-in encoder's absolute zero point, in microsteps, if it has been passed since the poll
    /// before.
    pub index: Option<i32>,
    /// How much further back than the motor's overrun a switch is looked for, in microsteps.
    pub slack: i32,
}

/// The caller's task between [`Search::see`] and [`Search::act`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Notice {
    /// The switch has closed: the ramp generator is to latch the position at which the switch opens again.
    pub closed: bool,
    /// The leg has come to its end, and the position of this edge is to be passed to [`Search::mark`].
    pub ended: Option<Edge>,
}

/// The position of the edge at which a leg has come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    /// The latched position, or, if none has been latched, the position of the motor.
    Latched,
    /// The position of the motor.
    Here,
}

/// The next act of the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Act {
    /// Nothing.
    Wait,
    /// The motor is to be brought to a stand.
    Stand,
    /// A leg begins, as [`Search::begin`] tells.
    Begin,
    /// The motor stands at the zero point: the search is over.
    Arrive,
    /// The search cannot go on, because of a closed stop switch at this side, and is over.
    GiveUp(Side),
}

/// The state of the motor in a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum LegMotion {
    /// The motor has been told to stand, and is braking or standing.
    Resting,
    /// The motor has been told to move, but a datagram of that may not have got through to a chip.
    Starting,
    /// The motor moves as the leg demands.
    Running,
}

/// How a leg stands, as of one poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
    /// The leg goes on.
    Underway,
    /// The leg has come to its end.
    Over,
    /// A closed stop switch is in the way, and it is not the switch at which the leg ends.
    Blocked,
    /// No switch is where the leg before has seen one: that was a glitch.
    Mistaken,
}

/// A reference search that is under way. Positions are in microsteps.
#[derive(Clone, Copy, Debug)]
pub(super) struct Search {
    plan: Plan,
    /// The position that the zero point is to have, in microsteps.
    home: i32,
    /// The direction of the search as a sign: 1 to positive positions, -1 to negative ones.
    direction: i32,
    /// The speed of fast legs and that of slow ones, in the unit of parameter 4.
    fast: i32,
    slow: i32,
    /// Number of legs that are done.
    done: usize,
    motion: LegMotion,
    /// The verdict of the last poll on this leg.
    verdict: Verdict,
    /// Number of polls for which the motor has been standing with this verdict.
    stood: u8,
    /// The switch has been closed in this leg.
    closed: bool,
    /// The position of the built-in encoder's zero point that counts in this leg, in microsteps, once it has been
    /// passed.
    index: Option<i32>,
    /// Position at which the switch was first seen closed, in a leg that finds it.
    seen: i32,
    /// Position as far as which the leg that leaves the switch looks for it.
    limit: i32,
    /// Positions of the two edges of the switch, and of the stop switch at the other end.
    first: i32,
    second: Option<i32>,
    far: Option<i32>,
}

impl Search {
    /// A search by a plan, for a zero point that is to have the position `home`. The speeds of its fast and of its slow
    /// legs are in the unit of parameter 4.
    pub(super) const fn new(plan: Plan, home: i32, fast: i32, slow: i32) -> Self {
        Search {
            plan,
            home,
            direction: if plan.positive { 1 } else { -1 },
            fast,
            slow,
            done: 0,
            motion: LegMotion::Resting,
            verdict: Verdict::Underway,
            stood: 0,
            closed: false,
            index: None,
            seen: 0,
            limit: 0,
            first: 0,
            second: None,
            far: None,
        }
    }

    /// The number of the leg under way, counted from 1 (RFS STATUS).
    pub(super) const fn number(&self) -> i32 {
        self.done as i32 + 1
    }

    /// The speed of the slow legs, at which the motor also goes to the zero point.
    pub(super) const fn slow_speed(&self) -> i32 {
        self.slow
    }

    /// The position that the zero point is to have, in microsteps.
    pub(super) const fn home(&self) -> i32 {
        self.home
    }

    /// The position of the stop switch at the other end, in microsteps; `None` if the search has not been there.
    pub(super) const fn far(&self) -> Option<i32> {
        self.far
    }

    /// The effect of the stop switches in the leg under way. Parameters 12, 13 and 149 have no effect during a search.
    pub(super) fn stops(&self) -> Stops {
        let positive = self.direction > 0;
        let latch = if positive { Side::Right } else { Side::Left };
        let over = self.plan.sought == Sought::Stop && self.leg().over;
        let [left, right] = self.plan.stops;
        Stops {
            left: left && (!over || positive),
            right: right && (!over || !positive),
            soft: false,
            latch: Some(latch),
        }
    }

    /// Takes in what this poll sees: to be called once in each poll, before [`Search::act`].
    pub(super) fn see(&mut self, view: &View) -> Notice {
        let leg = self.leg();
        let Known { position, speed, .. } = view.known;
        let closed = self.is_closed(view.switches);
        let mut notice = Notice { closed: closed && !self.closed, ended: None };
        if notice.closed {
            self.closed = true;
        } else if leg.until == Until::Opened && !self.comes_back() && !closed && self.beyond(position, self.first) < 0 {
            // The switch begins only at its first edge, so the contact that was closed before was not the switch's.
            self.closed = false;
        }
        self.index = view.index.or(self.index);
        let verdict = self.judge(view);
        if verdict == Verdict::Over && self.verdict != Verdict::Over {
            let latches = self.plan.sought == Sought::Stop;
            match (leg.until, self.index) {
                (Until::Index, Some(index)) => self.mark(index),
                (Until::Opened, _) if latches => notice.ended = Some(Edge::Latched),
                _ => notice.ended = Some(Edge::Here),
            }
        }
        self.stood = if speed == 0 && verdict == self.verdict { self.stood.saturating_add(1) } else { 0 };
        self.verdict = verdict;
        notice
    }

    /// Keeps the position of the edge at which the leg under way ends, as the leg says.
    pub(super) fn mark(&mut self, edge: i32) {
        match self.leg().mark {
            Mark::Nothing => {}
            Mark::Seen => self.seen = edge,
            Mark::First => self.first = edge,
            Mark::Second => self.second = Some(edge),
            Mark::Far => self.far = Some(edge),
        }
    }

    /// The act that the caller is to carry out next: to be called once in each poll, after [`Search::see`].
    pub(super) fn act(&mut self, view: &View) -> Act {
        if self.leg().until == Until::There && self.verdict == Verdict::Over {
            return Act::Arrive;
        }
        match self.motion {
            LegMotion::Running if self.verdict == Verdict::Underway => Act::Wait,
            LegMotion::Running | LegMotion::Starting => {
                self.motion = LegMotion::Resting;
                Act::Stand
            }
            LegMotion::Resting if self.stood >= SETTLED => {
                if self.proceed(view) {
                    Act::Begin
                } else {
                    Act::GiveUp(Side::towards(self.heading(view)))
                }
            }
            LegMotion::Resting => Act::Wait,
        }
    }

    /// Begins the leg. Returns the goal of the motor, and whether the switch is closed now, so that the ramp generator
    /// is to latch the position at which it opens.
    pub(super) fn begin(&mut self, view: &View) -> (Goal, bool) {
        self.closed = self.is_closed(view.switches);
        // What the motor has passed while it came to a stand behind an edge counts as passed from there.
        let follows = self.leg().until == Until::Index && self.done > 0;
        self.index = self.index.filter(|index| follows && self.passes(*index, self.first));
        self.verdict = Verdict::Underway;
        self.stood = 0;
        self.motion = LegMotion::Starting;
        let goal = if self.leg().until == Until::There {
            Goal::Position { target: self.zero_point(), soft: false }
        } else {
            Goal::Speed(self.speed())
        };
        (goal, self.closed)
    }

    /// Notes that all datagrams that start the motor have got through.
    pub(super) const fn begun(&mut self) {
        self.motion = LegMotion::Running;
    }

    /// The leg under way.
    fn leg(&self) -> Leg {
        self.plan.legs.get(self.done).copied().unwrap_or(Leg::TO_ZERO)
    }

    /// The speed of the leg under way; right is positive.
    fn speed(&self) -> i32 {
        let Leg { ahead, fast, .. } = self.leg();
        let speed = if fast { self.fast } else { self.slow };
        if ahead { speed * self.direction } else { -speed * self.direction }
    }

    /// Where the motor is to go in the leg under way; only the sign counts, right is positive.
    fn heading(&self, view: &View) -> i32 {
        match self.leg().until {
            Until::There => view.known.target.wrapping_sub(view.known.position),
            _ => self.speed(),
        }
    }

    /// True if the leg before has only seen the switch, so that this leg may begin beyond it.
    fn comes_back(&self) -> bool {
        let before = self.done.checked_sub(1).and_then(|before| self.plan.legs.get(before));
        before.is_some_and(|leg| leg.until == Until::Seen)
    }

    /// True if `position` lies beyond `mark` in the direction of the leg under way.
    fn passes(&self, position: i32, mark: i32) -> bool {
        position.wrapping_sub(mark).signum() == self.speed().signum()
    }

    /// How far `position` lies beyond `mark` in the direction of the search, in microsteps; negative if it lies before
    /// it.
    fn beyond(&self, position: i32, mark: i32) -> i32 {
        position.wrapping_sub(mark).wrapping_mul(self.direction)
    }

    /// How the leg under way stands, by what this poll sees.
    fn judge(&self, view: &View) -> Verdict {
        let View { switches, known, .. } = *view;
        let leg = self.leg();
        let closed = self.is_closed(switches);
        let other = switches.towards(-self.direction);
        let over = match leg.until {
            Until::Seen => self.closed,
            Until::Closed => closed,
            Until::Opened => self.closed && !closed,
            Until::OtherClosed => other,
            Until::OtherOpen => !other,
            Until::Index => self.index.is_some(),
            Until::There => self.motion == LegMotion::Running && known.speed == 0 && known.target == known.position,
        };
        if over {
            Verdict::Over
        } else if self.stops().hold(self.heading(view), [switches.left, switches.right]) {
            Verdict::Blocked
        } else if self.comes_back() && !self.closed && self.passes(known.position, self.limit) {
            Verdict::Mistaken
        } else {
            Verdict::Underway
        }
    }

    /// Chooses the leg to begin now that the motor stands: the next one, the same, or the one before. False if the
    /// search has to give up.
    fn proceed(&mut self, view: &View) -> bool {
        match (self.verdict, self.leg().until) {
            (Verdict::Underway, _) => {}
            (Verdict::Over, until) => {
                if until == Until::Seen {
                    let overrun = self.beyond(view.known.position, self.seen).saturating_abs();
                    let back = overrun.saturating_add(view.slack).wrapping_mul(self.speed().signum());
                    self.limit = self.seen.wrapping_sub(back);
                }
                self.done = self.done.saturating_add(1);
            }
            // Without a switch where the leg that leaves it looks for it, the leg that finds it begins anew.
            (Verdict::Mistaken, _) => self.done = self.done.saturating_sub(1),
            (Verdict::Blocked, Until::Seen) => {
                let Some(legs) = self.plan.turned.take() else { return false };
                self.plan.legs = legs;
                self.direction = -self.direction;
            }
            (Verdict::Blocked, _) => return false,
        }
        true
    }

    /// True if the switch that is searched for is closed.
    fn is_closed(&self, switches: Switches) -> bool {
        match self.plan.sought {
            Sought::Stop => switches.towards(self.direction),
            Sought::Home { inverted } => switches.home != inverted,
        }
    }

    /// The zero point of the search, in microsteps: the middle between the two edges, or the only edge.
    fn zero_point(&self) -> i32 {
        let second = self.second.unwrap_or(self.first);
        self.first.wrapping_add(second.wrapping_sub(self.first) / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stage on which each switch is closed in a range of positions, in microsteps, ends included.
    #[derive(Clone, Copy)]
    struct Stage {
        left: [i32; 2],
        right: [i32; 2],
        home: [i32; 2],
    }

    /// Carries a search out with a motor that goes ten microsteps in a poll in fast legs and one in slow ones. The
    /// motor starts and stops without a ramp, and runs over stop switches that do not stop it. Returns the numbers of
    /// the legs in the order in which they began, and the zero point; `None` if the search gives up.
    fn searched(stage: Stage, mode: i32) -> Option<(Vec<i32>, i32)> {
        let mut search = Search::new(Plan::of(mode), 0, 10, 1);
        let (mut known, mut legs, mut latched) = (Known::default(), Vec::new(), None);
        let mut goal = Goal::Speed(0);
        for _ in 0..10_000 {
            let at = |[first, last]: [i32; 2]| (first..=last).contains(&known.position);
            let switches = Switches { left: at(stage.left), right: at(stage.right), home: at(stage.home) };
            let view = View { switches, known, index: None, slack: 4 };
            let notice = search.see(&view);
            if notice.closed {
                latched = None;
            }
            match notice.ended {
                Some(Edge::Latched) => search.mark(latched.unwrap_or(known.position)),
                Some(Edge::Here) => search.mark(known.position),
                None => {}
            }
            match search.act(&view) {
                Act::Wait => {}
                Act::Stand => goal = Goal::Speed(0),
                Act::Begin => {
                    legs.push(search.number());
                    goal = search.begin(&view).0;
                    search.begun();
                }
                Act::Arrive => return Some((legs, known.position)),
                Act::GiveUp(_) => return None,
            }
            (known.target, known.speed) = match goal {
                Goal::Position { target, .. } => (target, (target - known.position).signum()),
                Goal::Speed(speed) => (known.target, speed),
            };
            if search.stops().hold(known.speed, [switches.left, switches.right]) {
                known.speed = 0;
            }
            known.position += known.speed;
        }
        panic!("mode {mode} does not end");
    }

    /// The motor starts at position 0, between the stop switches and left of the home switch. An edge is seen one
    /// microstep late, and two late where the motor comes back over it.
    #[test]
    fn each_mode_has_its_legs_and_its_zero_point() {
        let stage = Stage { left: [-120, -100], right: [100, 140], home: [50, 70] };
        for (mode, legs, zero) in [
            (1, 1..=4, -99),
            (65, 1..=4, 99),
            // The first leg, which leaves the other stop switch, is over before it begins.
            (2, 2..=6, -99),
            (66, 2..=6, 99),
            (3, 2..=6, -110),
            (67, 2..=6, 120),
            (4, 1..=4, -110),
            (68, 1..=4, 120),
            (6, 1..=4, 60),
            (7, 1..=4, 60),
        ] {
            let (gone, found) = searched(stage, mode).unwrap();
            assert_eq!(gone, legs.collect::<Vec<_>>(), "mode {mode}");
            assert!((found - zero).abs() <= 1, "mode {mode}: {found}");
        }
        // Mode 5 first searches to the left, and begins its first leg again to the right.
        let (legs, found) = searched(stage, 5).unwrap();
        assert!(legs == [1, 1, 2, 3, 4] && (found - 60).abs() <= 1, "{legs:?}, {found}");
    }

    /// The motor cannot cross a home switch that lies within the range of a stop switch.
    #[test]
    fn a_search_that_cannot_go_on_gives_up() {
        let stage = Stage { left: [-120, -100], right: [60, 140], home: [50, 70] };
        assert_eq!(searched(stage, 6), None);
        assert!(searched(Stage { right: [80, 140], ..stage }, 6).is_some());
    }
}
