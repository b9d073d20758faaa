//! Reference search (manual section 7.1): finds a switch, passes its edges slowly and makes a place between them, or one
//! of them, the zero point. What it does is a [`Plan`]; here it is carried out, by what is to be seen in each poll, and
//! without touching the hardware.
//!
//! When all legs are done the motor goes to its place, and counter and encoders are set to zero there. A switch that is
//! closed at the start counts as found. A leg across an edge begins with the switch closed, or closes it on
//! its way: so a fast motor that has run past a narrow home switch finds its way back.
//!
//! Stop switches are caught by the hardware: it stops at once where one closes and latches the position where
//! one opens. The home switch is sampled with every poll, and so is the built-in encoder, whose zero point can end a leg:
//! each edge is late by less than one poll's way, 1 ms at the slow speed. Where two edges are passed in opposite directions, both lag outwards and the middle is
//! off by less than half of that.
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

use super::hardware::{Goal, Known};
use super::plan::{Leg, Mark, Plan, Sought, Until};
use super::switch::{SETTLED, Side, Stops, Switches};

/// What is to be seen in one poll.
#[derive(Clone, Copy, Debug)]
pub(super) struct View {
    pub switches: Switches,
    /// The motor, with position and speed of this poll.
    pub known: Known,
    /// The built-in encoder has passed its zero point since the poll before.
    pub index: bool,
    /// How much further than the motor's overrun a switch is looked for, in microsteps.
    pub slack: i32,
}

/// What is to be told, or asked, before the search [acts](Search::act).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Notice {
    /// The switch has closed: the position shall be latched at which it opens.
    pub closed: bool,
    /// The leg has come to its end: where is to be [marked](Search::mark).
    pub ended: Option<Edge>,
}

/// Where a leg has come to its end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Edge {
    /// At the position that has been latched; where none has, where the motor is.
    Latched,
    /// Where the motor is.
    Here,
}

/// What the search does next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Act {
    /// Nothing.
    Wait,
    /// The motor comes to a stand.
    Stand,
    /// The next leg begins; [`Search::begin`] tells how.
    Begin,
    /// The motor is at its place: the search is over.
    Arrive,
    /// There is no way on.
    GiveUp,
}

/// The motor in a leg.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// The motor comes to a stand, or stands.
    Resting,
    /// The motor was to be started, but not all datagrams for that may have got through.
    Starting,
    /// The motor runs.
    Running,
}

/// How a leg stands, as of one poll.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Verdict {
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
    plan: Plan,
    /// Sign of the direction in which the switch is looked for.
    direction: i32,
    /// The search has turned round at a stop switch; it does so once.
    turned: bool,
    /// The speeds of the rough search and of all else.
    fast: i32,
    slow: i32,
    /// Number of legs that are done.
    done: usize,
    motion: Motion,
    /// The verdict of the last poll on this leg.
    verdict: Verdict,
    /// For how many polls the motor has stood with that verdict.
    stood: u8,
    /// The switch has been closed in this leg.
    closed: bool,
    /// The built-in encoder has passed its zero point in this leg.
    index: bool,
    /// Position, in microsteps, at which the switch was seen first in a leg that finds it.
    seen: i32,
    /// Position as far as which the switch is looked for on the way back.
    limit: i32,
    /// Positions of the two edges, and of the stop switch on the other side, in microsteps.
    first: i32,
    second: Option<i32>,
    far: Option<i32>,
}

impl Search {
    /// A search by a plan, at these speeds.
    pub(super) const fn new(plan: Plan, fast: i32, slow: i32) -> Self {
        Search {
            plan,
            direction: if plan.positive { 1 } else { -1 },
            turned: false,
            fast,
            slow,
            done: 0,
            motion: Motion::Resting,
            verdict: Verdict::Underway,
            stood: 0,
            closed: false,
            index: false,
            seen: 0,
            limit: 0,
            first: 0,
            second: None,
            far: None,
        }
    }

    /// The number of the leg under way, counted from 1.
    pub(super) const fn number(&self) -> i32 {
        self.done as i32 + 1
    }

    /// The speed at which it goes to its place.
    pub(super) const fn slow_speed(&self) -> i32 {
        self.slow
    }

    /// Where the stop switch on the other side is, in microsteps, if the search has been there.
    pub(super) const fn far(&self) -> Option<i32> {
        self.far
    }

    /// What the stop switches do in the present leg. Parameters 12, 13 and 149 do not count.
    pub(super) fn stops(&self) -> Stops {
        let positive = self.direction > 0;
        let latch = if positive { Side::Right } else { Side::Left };
        let [left, right] = match self.plan.sought {
            Sought::Home { circular: true, .. } => [false, false],
            Sought::Stop if self.leg().over => [positive, !positive],
            Sought::Stop | Sought::Home { .. } => [true, true],
        };
        Stops { left, right, soft: false, latch }
    }

    /// Takes in what is to be seen, once in each poll.
    pub(super) fn see(&mut self, view: &View) -> Notice {
        let leg = self.leg();
        let Known { position, speed, .. } = view.known;
        let closed = self.is_closed(view.switches);
        let mut notice = Notice { closed: closed && !self.closed, ended: None };
        if notice.closed {
            self.closed = true;
        } else if leg.until == Until::Opened && leg.ahead && !closed && self.beyond(position, self.first) < 0 {
            // The contact that was closed was not that of the switch, which begins only at the first edge.
            self.closed = false;
        }
        self.index |= view.index;
        let verdict = self.judge(view);
        if verdict == Verdict::Over && self.verdict != Verdict::Over {
            let latched = self.plan.sought == Sought::Stop && leg.until == Until::Opened;
            notice.ended = Some(if latched { Edge::Latched } else { Edge::Here });
        }
        self.stood = if speed == 0 && verdict == self.verdict { self.stood.saturating_add(1) } else { 0 };
        self.verdict = verdict;
        notice
    }

    /// Notes the position of the edge at which the leg under way ends.
    pub(super) fn mark(&mut self, edge: i32) {
        match self.leg().mark {
            Mark::Nothing => {}
            Mark::Seen => self.seen = edge,
            Mark::First => self.first = edge,
            Mark::Second => self.second = Some(edge),
            Mark::Far => self.far = Some(edge),
        }
    }

    /// What comes next, after [`Search::see`].
    pub(super) fn act(&mut self, view: &View) -> Act {
        if self.leg().until == Until::There && self.verdict == Verdict::Over {
            return Act::Arrive;
        }
        match self.motion {
            Motion::Running if self.verdict == Verdict::Underway => Act::Wait,
            Motion::Running | Motion::Starting => {
                self.motion = Motion::Resting;
                Act::Stand
            }
            Motion::Resting if self.stood >= SETTLED => {
                if self.proceed(view) {
                    Act::Begin
                } else {
                    Act::GiveUp
                }
            }
            Motion::Resting => Act::Wait,
        }
    }

    /// Begins the leg: where the motor is to be sent, and whether the switch is closed, so that the position shall be
    /// latched at which it opens.
    pub(super) fn begin(&mut self, view: &View) -> (Goal, bool) {
        self.closed = self.is_closed(view.switches);
        self.index = false;
        self.verdict = Verdict::Underway;
        self.stood = 0;
        self.motion = Motion::Starting;
        let goal = if self.leg().until == Until::There {
            Goal::Position { target: self.place(), soft: false }
        } else {
            Goal::Speed(self.speed())
        };
        (goal, self.closed)
    }

    /// The motor is on its way.
    pub(super) const fn begun(&mut self) {
        self.motion = Motion::Running;
    }

    /// The leg under way.
    fn leg(&self) -> Leg {
        self.plan.legs.get(self.done).copied().unwrap_or(Leg::PLACE)
    }

    /// Speed of the leg under way; the sign is the direction.
    fn speed(&self) -> i32 {
        let Leg { ahead, fast, .. } = self.leg();
        let speed = if fast { self.fast } else { self.slow };
        if ahead { speed * self.direction } else { -speed * self.direction }
    }

    /// How far `position` lies beyond `mark`, in the direction of the search.
    fn beyond(&self, position: i32, mark: i32) -> i32 {
        position.wrapping_sub(mark).wrapping_mul(self.direction)
    }

    /// How the leg stands.
    fn judge(&self, view: &View) -> Verdict {
        let View { switches, known, .. } = *view;
        let leg = self.leg();
        let closed = self.is_closed(switches);
        let other = switches.towards(-self.direction);
        let way = known.target.wrapping_sub(known.position);
        let over = match leg.until {
            Until::Seen => self.closed,
            Until::Closed => closed,
            Until::Opened => self.closed && !closed,
            Until::OtherClosed => other,
            Until::OtherOpen => !other,
            Until::Index => self.index,
            Until::There => self.motion == Motion::Running && known.speed == 0 && way == 0,
        };
        let heading = if leg.until == Until::There { way } else { self.speed() };
        if over {
            Verdict::Over
        } else if self.stops().hold(heading, [switches.left, switches.right]) {
            Verdict::Blocked
        } else if leg.until == Until::Opened
            && !leg.ahead
            && !self.closed
            && self.beyond(known.position, self.limit) < 0
        {
            Verdict::Mistaken
        } else {
            Verdict::Underway
        }
    }

    /// Goes on to the next leg, or back to one, now that the motor stands; false if the search has to give up.
    fn proceed(&mut self, view: &View) -> bool {
        let turns = matches!(self.plan.sought, Sought::Home { turns: true, .. });
        match (self.verdict, self.leg().until) {
            (Verdict::Underway, _) => {}
            (Verdict::Over, until) => {
                if until == Until::Seen {
                    let overrun = self.beyond(view.known.position, self.seen).saturating_abs();
                    let back = overrun.saturating_add(view.slack).wrapping_mul(self.direction);
                    self.limit = self.seen.wrapping_sub(back);
                }
                self.done = self.done.saturating_add(1);
            }
            // Back from leaving the switch to finding it.
            (Verdict::Mistaken, _) => self.done = self.done.saturating_sub(1),
            (Verdict::Blocked, Until::Seen) if turns && !self.turned => {
                self.turned = true;
                self.direction = -self.direction;
            }
            (Verdict::Blocked, _) => return false,
        }
        true
    }

    /// True if the switch that is searched is closed.
    fn is_closed(&self, switches: Switches) -> bool {
        match self.plan.sought {
            Sought::Stop => switches.towards(self.direction),
            Sought::Home { inverted, .. } => switches.home != inverted,
        }
    }

    /// The zero point: the middle between the two edges, or the only one, in microsteps.
    fn place(&self) -> i32 {
        let second = self.second.unwrap_or(self.first);
        self.first.wrapping_add(second.wrapping_sub(self.first) / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stage on which the switches are closed in these ranges of positions, ends included.
    #[derive(Clone, Copy)]
    struct Stage {
        left: [i32; 2],
        right: [i32; 2],
        home: [i32; 2],
    }

    /// Carries a search out with a motor that goes ten microsteps in a poll, or one, and stands at once; stop switches
    /// that do not stop it are run over. Gives the numbers of the legs and the place; none if the search gives up.
    fn searched(stage: Stage, mode: i32) -> Option<(Vec<i32>, i32)> {
        let mut search = Search::new(Plan::of(mode), 10, 1);
        let (mut known, mut legs, mut latched) = (Known::default(), Vec::new(), None);
        let mut goal = Goal::Speed(0);
        for _ in 0..10_000 {
            let at = |[first, last]: [i32; 2]| (first..=last).contains(&known.position);
            let switches = Switches { left: at(stage.left), right: at(stage.right), home: at(stage.home) };
            let view = View { switches, known, index: false, slack: 4 };
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
                Act::GiveUp => return None,
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

    /// From inside, with a home switch on the right: which legs each mode has, and where they lead. Edges are seen one
    /// microstep late, and twice as late where the motor comes back over them.
    #[test]
    fn each_mode_has_its_legs_and_its_place() {
        let stage = Stage { left: [-120, -100], right: [100, 140], home: [50, 70] };
        for (mode, legs, place) in [
            (1, 1..=4, -99),
            (65, 1..=4, 99),
            // The first leg, off the other stop switch, is over before it begins.
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
            assert!((found - place).abs() <= 1, "mode {mode}: {found}");
        }
        // Mode 5 looks to the left first, and begins its first leg again the other way round.
        let (legs, found) = searched(stage, 5).unwrap();
        assert!(legs == [1, 1, 2, 3, 4] && (found - 60).abs() <= 1, "{legs:?}, {found}");
    }

    /// A home switch within a stop switch cannot be crossed.
    #[test]
    fn a_search_that_cannot_go_on_gives_up() {
        let stage = Stage { left: [-120, -100], right: [60, 140], home: [50, 70] };
        assert_eq!(searched(stage, 6), None);
        assert!(searched(Stage { right: [80, 140], ..stage }, 6).is_some());
    }
}
