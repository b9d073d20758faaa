//! What a reference search does, as data: a list of legs, each a run in one direction until a switch closes or opens.
//!
//! | modes | legs |
//! |---|---|
//! | 1 | find the stop switch fast, leave it slowly, return to it slowly |
//! | 2 | the other stop switch fast (from inside), then as mode 1 |
//! | 4 | find the stop switch fast, leave it slowly, cross it slowly |
//! | 3 | the other stop switch fast (from inside), then as mode 4 |
//! | 5..8 | find the home switch fast, leave it slowly, cross it slowly |
//!
//! After the last leg the motor goes to its place, the zero point: to the middle between the first and the second edge
//! that the legs have marked, or to the first where there is no second.

/// Modes 1..=4: the right switch in place of the left one.
const RIGHT: i32 = 64;
/// Modes 5..=8: inverted home switch.
const INVERTED: i32 = 128;

/// The legs of modes 5..=8.
const HOME: &[Leg] = &[Leg::FIND, Leg::LEAVE, Leg::CROSS];

/// The switch that is searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sought {
    /// The stop switch in the direction of the search.
    Stop,
    /// The home switch. It counts as closed while its input is high, or `inverted`, while that is low.
    Home {
        /// It is normally closed.
        inverted: bool,
        /// The stop switches do not count: the axis is a circle.
        circular: bool,
        /// At the first stop switch the search turns round.
        turns: bool,
    },
}

/// When a leg is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// The switch has been seen closed: the motor may have run past it since.
    Seen,
    /// The switch is closed.
    Closed,
    /// The switch is open, after it was closed in this leg.
    Opened,
    /// The stop switch on the other side is closed.
    OtherClosed,
    /// The stop switch on the other side is open.
    OtherOpen,
    /// The built-in encoder has passed its zero point.
    Index,
    /// The motor is at its place.
    There,
}

/// What the position is where a leg ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Nothing.
    Nothing,
    /// Where the switch was seen first.
    Seen,
    /// The first edge.
    First,
    /// The second edge.
    Second,
    /// Where the stop switch on the other side is.
    Far,
}

/// One run of a search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leg {
    /// It goes in the direction of the search, not back.
    pub ahead: bool,
    /// It goes at the speed of the rough search.
    pub fast: bool,
    /// It may run over the stop switch that is searched while that is closed.
    pub over: bool,
    /// When it is over.
    pub until: Until,
    /// What the position is there.
    pub mark: Mark,
}

impl Leg {
    /// Off the stop switch on the other side, if it is closed at the start.
    pub const CLEAR: Leg = Leg::to(Until::OtherOpen, Mark::Nothing);
    /// To that switch, fast.
    pub const FAR: Leg = Leg { ahead: false, fast: true, ..Leg::to(Until::OtherClosed, Mark::Far) };
    /// To the switch, fast.
    pub const FIND: Leg = Leg { fast: true, ..Leg::to(Until::Seen, Mark::Seen) };
    /// Away from it until it opens.
    pub const LEAVE: Leg = Leg { ahead: false, ..Leg::to(Until::Opened, Mark::First) };
    /// Back until it closes.
    pub const RETURN: Leg = Leg::to(Until::Closed, Mark::Second);
    /// Back and on until it opens on the far side.
    pub const CROSS: Leg = Leg { over: true, ..Leg::to(Until::Opened, Mark::Second) };
    /// To the middle between the edges, or to the only one, after all others: a positioning move.
    pub(super) const PLACE: Leg = Leg { over: true, ..Leg::to(Until::There, Mark::Nothing) };

    /// Slowly in the direction of the search until then.
    pub const fn to(until: Until, mark: Mark) -> Self {
        Leg { ahead: true, fast: false, over: false, until, mark }
    }
}

/// A search, before it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// What is searched.
    pub sought: Sought,
    /// The direction of the search is that of positive positions.
    pub positive: bool,
    /// The legs, in order; the last one, to the zero point, is not among them.
    pub legs: &'static [Leg],
}

impl Plan {
    /// The search of a mode of parameter 193.
    pub(super) const fn of(mode: i32) -> Self {
        let right = mode & RIGHT != 0;
        let inverted = mode & INVERTED != 0;
        let number = mode & !(RIGHT | INVERTED);
        let (sought, positive, legs): (_, _, &[Leg]) = match number {
            1 => (Sought::Stop, right, &[Leg::FIND, Leg::LEAVE, Leg::RETURN]),
            2 => (Sought::Stop, right, &[Leg::CLEAR, Leg::FAR, Leg::FIND, Leg::LEAVE, Leg::RETURN]),
            3 => (Sought::Stop, right, &[Leg::CLEAR, Leg::FAR, Leg::FIND, Leg::LEAVE, Leg::CROSS]),
            4 => (Sought::Stop, right, &[Leg::FIND, Leg::LEAVE, Leg::CROSS]),
            // Modes 6 and 7 search the home switch in positive direction.
            5 | 6 => (Sought::Home { inverted, circular: false, turns: true }, number == 6, HOME),
            _ => (Sought::Home { inverted, circular: true, turns: false }, number == 7, HOME),
        };
        Plan { sought, positive, legs }
    }
}
