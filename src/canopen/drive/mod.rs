//! The drive of CiA 402 (manual chapters 5 to 9): states and controlword, modes of operation, limits and faults.
//!
//! Here is what the drive notes. A controlword comes in by [`Node::obey`](super::Node::obey) and each millisecond's turn
//! by [`Node::drive`](super::Node::drive). `state.rs` says which command leads where, `power.rs` goes the way, `mode.rs`
//! tells the motor what the mode of operation asks for, `homing.rs` what homing does, `encoder.rs` compares the motor with
//! the built-in encoder, `limit.rs` keeps it within its limits, and `fault.rs` looks for what must stop it.

mod encoder;
mod fault;
mod homing;
mod limit;
mod mode;
mod parameters;
mod power;
mod state;
mod status;
mod turn;
pub(super) mod unit;

pub(super) use state::State;

use crate::units::Micros;

/// What the drive notes.
#[derive(Debug, Default)]
pub(super) struct Drive {
    pub(super) state: State,
    way: Way,
    /// The controlword that came last.
    controlword: u16,
    /// A controlword has come on the way to a state, and is obeyed there.
    waiting: bool,
    /// The brake is released.
    released: bool,
    /// The bridges are on, and at this time the current has drawn the rotor to the field: from then on there can be a
    /// following error. `None` while the bridges are off.
    held: Option<Micros>,
    /// The shaft has been turned while the bridges were off: once the rotor is held, the counter is to follow the encoder.
    turned: bool,
    pub(super) motion: Motion,
    limits: Limits,
    homing: Homing,
    /// Number of turns for which the driver has told of an open load at bridge A and at bridge B while the motor moves.
    open_load: [u8; 2],
    /// The statusword at the end of the last turn.
    shown: u32,
}

impl Drive {
    /// True while the drive is on no way to another state.
    pub(super) fn is_lasting(&self) -> bool {
        self.way == Way::Lasting
    }

    /// True while the motor obeys the mode of operation.
    const fn is_operating(&self) -> bool {
        matches!((self.state, self.way), (State::OperationEnabled, Way::Lasting))
    }
}

/// What the drive does on its way to another state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Way {
    /// Nothing: the state lasts.
    #[default]
    Lasting,
    /// The bridges are on, and the brake is released at this time.
    Energising(Micros),
    /// The brake is released, and OPERATION ENABLED is entered at this time.
    Releasing(Micros),
    /// The motor slows down, and the bridges go off for this state when it stands.
    Stopping(State),
    /// The brake is applied; at this time the bridges go off, and the state is entered.
    Applying(Micros, State),
}

/// The modes of operation, by the numbers of 6060h.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Mode {
    /// The motor stands.
    #[default]
    None = 0,
    /// pp: the motor goes to positions.
    ProfilePosition = 1,
    /// vl: the motor turns at 6042h.
    Velocity = 2,
    /// pv: the motor turns at 60FFh.
    ProfileVelocity = 3,
    /// hm: the motor looks for the home position.
    Homing = 6,
}

impl Mode {
    /// The mode with this number of 6060h.
    const fn numbered(number: u32) -> Self {
        match number {
            1 => Mode::ProfilePosition,
            2 => Mode::Velocity,
            3 => Mode::ProfileVelocity,
            6 => Mode::Homing,
            _ => Mode::None,
        }
    }
}

/// What the motor is to do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Task {
    /// To stand, after a ramp.
    #[default]
    Stand,
    /// To turn at this speed, in internal units.
    Turn(i32),
    /// To go to this position, in microsteps.
    Go(i32),
}

/// What the mode of operation notes.
#[derive(Debug, Default)]
pub(super) struct Motion {
    /// The mode in force.
    pub(super) mode: Mode,
    /// The motor first comes to a stand, because the mode has changed.
    settling: bool,
    /// The target position that was taken last; `None` if none has been since the mode or the state has changed.
    target: Option<i32>,
    /// The target has been taken with the last edge of bit 4, which is still set.
    acknowledged: bool,
    /// What the motor was told last; `None` if it is to be told anew in any case.
    told: Option<Task>,
    /// A command that a limit has ended. It is told again after another one.
    dropped: Option<Task>,
    /// The target is reached.
    reached: bool,
    /// The time since when the position has been within its window.
    within: Option<Micros>,
}

/// What is noted of the limits.
#[derive(Clone, Copy, Debug, Default)]
struct Limits {
    /// The limit switch of each end, that of negative positions first, has stopped the motor and is still closed.
    touched: [bool; 2],
    /// The motor has stalled, and has not been told anything since.
    stalled: bool,
}

/// What is noted of homing.
#[derive(Clone, Copy, Debug, Default)]
struct Homing {
    /// A homing is under way.
    running: bool,
    /// The homing under way waits for the motor to stand, and is over then (method 35).
    here: bool,
    /// The last homing has found the home position.
    attained: bool,
    /// The home offset (607Ch) when this homing began.
    offset: u32,
    /// That of the last homing that came to its end.
    used: u32,
}
