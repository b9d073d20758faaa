//! The states of the drive and the commands that change them, as a table (manual section 6.1.1, figure 8 and table
//! 185). Pure: what a change takes - ramps, brake, bridges - is done in `power.rs`.

/// State of the drive. *Not ready to switch on* is over before the node can be asked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum State {
    /// The bridges are off, and settings that are only then changed can be written.
    #[default]
    SwitchOnDisabled,
    /// The bridges are off.
    ReadyToSwitchOn,
    /// The bridges are off, or on the way to OPERATION ENABLED.
    SwitchedOn,
    /// The motor obeys the mode of operation.
    OperationEnabled,
    /// The motor has been stopped, or is being stopped, and the bridges are on.
    QuickStopActive,
    /// A fault has come up, and the motor is being stopped.
    FaultReactionActive,
    /// The bridges are off until the fault is reset.
    Fault,
}

impl State {
    /// Bits 0 to 3, 5 and 6 of the statusword, which encode the state (manual table 191).
    pub(super) const fn bits(self) -> u32 {
        match self {
            State::SwitchOnDisabled => 0x40,
            State::ReadyToSwitchOn => 0x21,
            State::SwitchedOn => 0x23,
            State::OperationEnabled => 0x27,
            State::QuickStopActive => 0x07,
            State::FaultReactionActive => 0x0F,
            State::Fault => 0x08,
        }
    }

    /// True in the states in which the bridges are on.
    pub(crate) const fn is_driving(self) -> bool {
        matches!(self, State::OperationEnabled | State::QuickStopActive | State::FaultReactionActive)
    }

    /// The state to which a command leads from this one; `None` if it changes nothing. `resumes` is true if quick stop
    /// active can be left for operation enabled, as it can with the option codes 5 and 6 (605Ah).
    pub(super) const fn after(self, command: Command, resumes: bool) -> Option<State> {
        use Command as C;
        Some(match (self, command) {
            // Transition 2, 6 and 8.
            (State::SwitchOnDisabled | State::SwitchedOn | State::OperationEnabled, C::Shutdown) => {
                State::ReadyToSwitchOn
            }
            // Transitions 3 and 5.
            (State::ReadyToSwitchOn | State::OperationEnabled, C::SwitchOn) => State::SwitchedOn,
            // Transitions 3 and 4 together, and 4.
            (State::ReadyToSwitchOn | State::SwitchedOn, C::EnableOperation) => State::OperationEnabled,
            // Transition 16.
            (State::QuickStopActive, C::EnableOperation) if resumes => State::OperationEnabled,
            // Transitions 7 and 10.
            (State::ReadyToSwitchOn | State::SwitchedOn, C::DisableVoltage | C::QuickStop) => State::SwitchOnDisabled,
            // Transitions 9 and 12.
            (State::OperationEnabled | State::QuickStopActive, C::DisableVoltage) => State::SwitchOnDisabled,
            // Transition 11.
            (State::OperationEnabled, C::QuickStop) => State::QuickStopActive,
            _ => return None,
        })
    }
}

/// The command that the bits 0 to 3 and 7 of a controlword encode.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Shutdown,
    /// *Switch on*, which in OPERATION ENABLED is *disable operation*.
    SwitchOn,
    EnableOperation,
    DisableVoltage,
    QuickStop,
}

impl Command {
    /// The command in a controlword; `None` if bit 7 is set, which makes it a fault reset and nothing else.
    pub(super) const fn of(controlword: u16) -> Option<Self> {
        Some(match controlword & 0x8F {
            0x80.. => return None,
            word if word & 0b0010 == 0 => Command::DisableVoltage,
            word if word & 0b0100 == 0 => Command::QuickStop,
            word if word & 0b0001 == 0 => Command::Shutdown,
            word if word & 0b1000 == 0 => Command::SwitchOn,
            _ => Command::EnableOperation,
        })
    }
}
