//! Answers of the control port: one line of JSON for each line of text.

use hal_sim::clock::{MICROSECOND, Nanos};
use hal_sim::control::State;
use serde::Serialize;

use crate::request::Answered;

/// An answer. Serialised it is one line.
#[derive(Serialize)]
struct Answer {
    ok: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<String>,
    #[serde(flatten)]
    told: Option<Told>,
}

/// The facts that an answer tells beside that the command was carried out.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Told {
    /// The answer to `state`.
    State(Box<Report>),
    /// The answer to a command about time.
    Time(Moment),
    /// A command to the firmware, and its reply.
    Reply(Box<Answered>),
}

/// A moment, and what is the case then.
#[derive(Debug, Serialize)]
pub struct Moment {
    /// Whether a condition holds, if one was waited for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub met: Option<bool>,
    /// Virtual time in microseconds.
    pub time_us: u64,
}

/// The state of a module, and how time goes.
#[derive(Debug, Serialize)]
pub struct Report {
    /// The board's.
    #[serde(flatten)]
    pub state: State,
    /// Whether time goes by the clock.
    pub time: Going,
    /// How fast virtual time has been going lately, as a factor.
    pub speed_factor: f64,
    /// How fast it is wanted to go; `None` if as fast as it can.
    pub speed_wanted: Option<f64>,
}

/// Whether time goes by the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Going {
    /// Time goes by the clock.
    Running,
    /// Only steps and requests let it pass.
    Paused,
}

impl Told {
    /// A moment of virtual time.
    pub fn time(now: Nanos) -> Self {
        Told::Time(Moment { met: None, time_us: now / MICROSECOND })
    }

    /// The moment at which a condition was met, or was not waited for any longer.
    pub fn met(met: bool, now: Nanos) -> Self {
        Told::Time(Moment { met: Some(met), time_us: now / MICROSECOND })
    }
}

/// The line that answers a command, without its end.
pub fn answer(result: Result<Option<Told>, String>) -> String {
    let answer = match result {
        Ok(told) => Answer { ok: true, error: None, told },
        Err(error) => Answer { ok: false, error: Some(error), told: None },
    };
    serde_json::to_string(&answer)
        .unwrap_or_else(|_| r#"{"ok":false,"error":"the answer cannot be shown as JSON"}"#.into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::board::{Board, BoardKind, TMCM_1140};
    use hal_sim::control::Line;
    use hal_sim::world::config::WorldConfig;

    #[test]
    fn answers_are_one_line_each() {
        assert_eq!(answer(Ok(None)), r#"{"ok":true}"#);
        assert_eq!(answer(Err("no \"such\" thing".into())), r#"{"ok":false,"error":"no \"such\" thing"}"#);
        assert_eq!(answer(Ok(Some(Told::time(2_500_999)))), r#"{"ok":true,"time_us":2500}"#);
        assert_eq!(answer(Ok(Some(Told::met(false, 1_000)))), r#"{"ok":true,"met":false,"time_us":1}"#);
    }

    #[test]
    fn a_state_has_the_fields_of_axis_0_and_a_list_of_all_axes() {
        static KIND: BoardKind = BoardKind { controllers: &[3, 3], pull_ups: 2, ..TMCM_1140 };
        let mut board = Board::of_kind(&KIND, &WorldConfig::default(), 0);
        for line in ["press left 4", "load 0.5 5", "slip 8 0"] {
            Line::parse(line).unwrap().control.apply(&mut board).unwrap();
        }
        let report = Report { state: State::of(&board), time: Going::Paused, speed_factor: 0.5, speed_wanted: None };
        let state: serde_json::Value = serde_json::from_str(&answer(Ok(Some(Told::State(Box::new(report)))))).unwrap();
        let names = "abn analog analogs axes bridges_on can current encoder field inputs leds load lost_steps ok outputs position \
                     power pull_up_groups pull_ups rotor speed_factor speed_wanted stall_guard supply switches temperature \
                     time time_us velocity";
        let mut fields: Vec<&str> = state.as_object().unwrap().keys().map(String::as_str).collect();
        fields.sort_unstable();
        assert_eq!(fields, names.split_whitespace().collect::<Vec<_>>());
        assert_eq!((&state["time"], &state["speed_wanted"]), (&"paused".into(), &serde_json::Value::Null));
        let axes = state["axes"].as_array().unwrap();
        for (name, value) in axes[0].as_object().unwrap() {
            assert_eq!(&state[name], value, "{name}");
        }
        assert_eq!((axes.len(), &state["rotor"]), (6, &2048.into()));
        assert!((0..6).all(|axis| axes[axis]["switches"]["left"] == (axis == 4)));
        assert!((0..6).all(|axis| axes[axis]["load"] == if axis == 5 { 0.5 } else { 0.0 }));
    }
}
