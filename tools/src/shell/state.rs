//! Facts that the shell has to tell, as values. Their text is made in [`super::text`].

use serde::Serialize;

/// Something that the shell tells.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "state", rename_all = "snake_case")]
pub enum State {
    /// A module has answered for the first time.
    Connected {
        /// The product that the module is.
        module: String,
    },
    /// The help: what can be typed.
    Help,
    /// A command has been answered.
    Answered {
        /// The command in mnemonic form.
        command: String,
        /// The reply in words.
        answer: String,
        /// Whether it was executed.
        done: bool,
    },
    /// Parameters have been read.
    Watched {
        /// Their values, in the order of their names.
        values: Vec<Watched>,
    },
    /// A jog waits for keys.
    JogReady {
        /// The number of the axis.
        axis: u8,
        /// The speed, in the module's unit.
        speed: i32,
        /// The speed that was asked for, if stopping from there would take too long.
        #[serde(skip_serializing_if = "Option::is_none")]
        wanted: Option<i32>,
        /// The unit in words.
        unit: &'static str,
    },
    /// Where the axis of a jog is.
    Jogging {
        /// The position in microsteps.
        position: i32,
        /// The speed, in the module's unit.
        speed: i32,
        /// The unit in words.
        unit: &'static str,
    },
    /// A jog is over.
    JogEnded {
        /// The number of the axis.
        axis: u8,
        /// Why.
        end: JogEnd,
        /// The speed of positioning that the user has to know about, if it could not be put back.
        #[serde(skip_serializing_if = "Option::is_none")]
        left: Option<Left>,
    },
    /// A speed of positioning that a jog could not put back is what it was again.
    PutBack {
        /// The number of the axis.
        axis: u8,
        /// The speed, in the module's unit.
        speed: i32,
    },
    /// Something could not be done.
    Wrong {
        /// Why, and what to do.
        message: String,
    },
}

/// A parameter and its value.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Watched {
    /// The parameter as the user has named it.
    pub name: String,
    /// The value of the parameter in its unit.
    pub value: i32,
}

/// Why a jog is over.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
#[serde(tag = "why", rename_all = "snake_case")]
pub enum JogEnd {
    /// The user has pressed a key.
    Key,
    /// A signal has come, or the terminal is gone.
    Signal,
    /// The replies of the module take so long that the motor would stutter, or not stop in time.
    Slow {
        /// The time that one of them takes, in milliseconds.
        round_ms: u64,
        /// The time that it may take at most, in milliseconds.
        most_ms: u64,
    },
    /// The module has not done what it was told.
    Failed {
        /// The answer of the module in words, or that it said nothing.
        error: String,
        /// The supply voltage in tenths of volts, where the motors are locked.
        #[serde(skip_serializing_if = "Option::is_none")]
        supply: Option<i32>,
    },
}

/// The speed of positioning that a jog could not put back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Left {
    /// The present speed.
    pub now: i32,
    /// The speed before the jog.
    pub before: i32,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Programs that show the states elsewhere than on a terminal take them as JSON.
    #[test]
    fn states_are_objects_that_tell_what_they_are() {
        let json = |state: &State| serde_json::to_string(state).unwrap();
        let values = vec![Watched { name: "APActualSpeed".into(), value: -7 }];
        assert_eq!(
            json(&State::Watched { values }),
            r#"{"state":"watched","values":[{"name":"APActualSpeed","value":-7}]}"#
        );
        assert_eq!(
            json(&State::JogReady { axis: 1, speed: 137, wanted: None, unit: "int" }),
            r#"{"state":"jog_ready","axis":1,"speed":137,"unit":"int"}"#
        );
        assert_eq!(
            json(&State::JogEnded { axis: 0, end: JogEnd::Slow { round_ms: 60, most_ms: 24 }, left: None }),
            r#"{"state":"jog_ended","axis":0,"end":{"why":"slow","round_ms":60,"most_ms":24}}"#
        );
    }
}
