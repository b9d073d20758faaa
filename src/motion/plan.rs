//! The plans of reference searches, as data (parameter 193, manual section 7.1): a list of legs, each a run in one
//! direction until a switch closes or opens. `search.rs` carries it out.
//!
//! | modes | legs |
//! |---|---|
//! | 1 | find the stop switch fast, leave it slowly, return to it slowly |
//! | 2 | find the other stop switch fast, then as mode 1 |
//! | 3 | find the other stop switch fast, then as mode 4 |
//! | 4 | find the stop switch fast, leave it slowly, cross it slowly |
//! | 5..8 | find the home switch fast, leave it slowly, cross it slowly |
//!
//! In modes 2 and 3 a motor that begins on the other stop switch first leaves that slowly, towards the inside.
//!
//! After the last leg the motor goes to the zero point. This is the middle between the first and the second edge of the
//! switch that the legs have marked, or the first where no second one is marked.

/// Added to modes 1..=4: the search is for the right stop switch in place of the left one.
const RIGHT: i32 = 64;
/// Added to modes 5..=8: the home switch is inverted.
const INVERTED: i32 = 128;

/// The legs of modes 5..=8.
const HOME: &[Leg] = &[Leg::FIND, Leg::LEAVE, Leg::CROSS];

/// The switch that is searched for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sought {
    /// The stop switch at the end to which the search goes.
    Stop,
    /// The home switch.
    Home {
        /// The home switch counts as closed while its input is low, in place of high.
        inverted: bool,
    },
}

/// When a leg is over.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Until {
    /// The switch has been seen closed in this leg. The fast motor may have run past it before it stands.
    Seen,
    /// The switch is closed.
    Closed,
    /// The switch is open, after it was closed in this leg.
    Opened,
    /// The stop switch at the other end is closed.
    OtherClosed,
    /// The stop switch at the other end is open.
    OtherOpen,
    /// The built-in encoder has passed its absolute zero point: in this leg, or since the leg before it has passed the
    /// edge at which it ends.
    Index,
    /// The motor stands at the zero point of the search.
    There,
}

/// The name under which the position at the end of a leg is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// The position is not kept.
    Nothing,
    /// The position at which the switch was first seen closed.
    Seen,
    /// The first edge of the switch.
    First,
    /// The second edge of the switch.
    Second,
    /// The position of the stop switch at the other end.
    Far,
}

/// A run of a search, in one direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Leg {
    /// The leg goes in the direction of the search, not back.
    pub ahead: bool,
    /// The leg goes at the fast speed of the search (parameter 194), not at the slow one (195).
    pub fast: bool,
    /// The motor may run over the stop switch that is searched for: that switch does not stop it.
    pub over: bool,
    /// When the leg is over.
    pub until: Until,
    /// The name under which the position at the end of the leg is kept.
    pub mark: Mark,
}

impl Leg {
    /// Leaves the stop switch at the other end slowly; over at once if that switch is open at the start.
    pub const CLEAR: Leg = Leg::to(Until::OtherOpen, Mark::Nothing);
    /// Finds the stop switch at the other end, fast.
    pub const FAR: Leg = Leg { ahead: false, fast: true, ..Leg::to(Until::OtherClosed, Mark::Far) };
    /// Finds the switch, fast.
    pub const FIND: Leg = Leg { fast: true, ..Leg::to(Until::Seen, Mark::Seen) };
    /// Goes back slowly until the switch opens.
    pub const LEAVE: Leg = Leg { ahead: false, ..Leg::to(Until::Opened, Mark::First) };
    /// Goes ahead slowly until the switch closes.
    pub const RETURN: Leg = Leg::to(Until::Closed, Mark::Second);
    /// Goes ahead slowly, over the switch, until it opens on its far side.
    pub const CROSS: Leg = Leg { over: true, ..Leg::to(Until::Opened, Mark::Second) };
    /// Goes back slowly to the switch that has been found; over at once if that is closed.
    pub const ONTO: Leg = Leg { ahead: false, ..Leg::to(Until::Seen, Mark::Seen) };
    /// Goes ahead slowly until the switch opens on its far side.
    pub const OFF: Leg = Leg::to(Until::Opened, Mark::First);
    /// Goes ahead slowly to the next zero point of the built-in encoder, from the first edge on.
    pub const INDEX: Leg = Leg::to(Until::Index, Mark::First);
    /// Goes back slowly to the next zero point of the built-in encoder, from the first edge on.
    pub const BACK_TO_INDEX: Leg = Leg { ahead: false, ..Leg::INDEX };
    /// Goes slowly to the zero point, as a positioning move. This leg follows those of every plan.
    pub(super) const TO_ZERO: Leg = Leg { over: true, ..Leg::to(Until::There, Mark::Nothing) };

    /// A slow leg in the direction of the search.
    pub const fn to(until: Until, mark: Mark) -> Self {
        Leg { ahead: true, fast: false, over: false, until, mark }
    }
}

/// A reference search, before it begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The switch that is searched for.
    pub sought: Sought,
    /// The search goes in the direction of positive positions, else of negative ones.
    pub positive: bool,
    /// The stop switches, left and right, that there are. A switch that there is not does not stop the motor; on an
    /// axis that is a circle there is none.
    pub stops: [bool; 2],
    /// The legs in order, without the last one, to the zero point, which every search has.
    pub legs: &'static [Leg],
    /// The legs with which a search begins anew, in the other direction, at the first stop switch that its first leg
    /// meets; `None` if it gives up there.
    pub turned: Option<&'static [Leg]>,
}

impl Plan {
    /// The plan of a mode of parameter 193.
    pub(super) fn of(mode: i32) -> Self {
        let right = mode & RIGHT != 0;
        let inverted = mode & INVERTED != 0;
        let number = mode & !(RIGHT | INVERTED);
        let sought = Sought::Home { inverted };
        let at_stop = |legs| Plan { sought: Sought::Stop, positive: right, stops: [true; 2], legs, turned: None };
        match number {
            1 => at_stop(&[Leg::FIND, Leg::LEAVE, Leg::RETURN]),
            2 => at_stop(&[Leg::CLEAR, Leg::FAR, Leg::FIND, Leg::LEAVE, Leg::RETURN]),
            3 => at_stop(&[Leg::CLEAR, Leg::FAR, Leg::FIND, Leg::LEAVE, Leg::CROSS]),
            4 => at_stop(&[Leg::FIND, Leg::LEAVE, Leg::CROSS]),
            // Modes 6 and 7 search the home switch in positive direction; in modes 7 and 8 the axis is a circle.
            5 | 6 => Plan { sought, positive: number == 6, stops: [true; 2], legs: HOME, turned: Some(HOME) },
            _ => Plan { sought, positive: number == 7, stops: [false; 2], legs: HOME, turned: None },
        }
    }
}
