//! The text of what the shell tells.

use super::state::{JogEnd, Left, State};
use crate::product::with_unit;

/// The help: what can be typed.
const HELP: &str = "\
GAP 1, 0             a command, as in a program; names and
                     expressions as well: SAP APMaxCurrent, 0, 2*50
watch NAME...        parameters of axis 0, again and again, until a
                     key is pressed; watch NAME... axis 1
jog [AXIS] [SPEED]   the arrow keys move the motor while they are
                     held; space stops it, any other key ends the jog
help                 this
quit                 the end, as Ctrl-D; motors go on as they are
Tab completes commands and names, the up arrow brings back a line.";

/// The text of a state, in one line where it is not help.
pub fn text(state: &State) -> String {
    match state {
        State::Connected { module } => format!("{module}; help shows what can be typed"),
        State::Help => HELP.into(),
        State::Answered { command, answer, .. } => format!("{command}: {answer}"),
        State::Watched { values } => {
            let values: Vec<String> =
                values.iter().map(|watched| format!("{}={}", watched.name, watched.value)).collect();
            values.join(" ")
        }
        State::JogReady { axis, speed, wanted, unit } => {
            let less = match wanted {
                Some(wanted) => {
                    format!(" (not {}, from which it would not stop in time)", with_unit(*wanted, unit))
                }
                None => String::new(),
            };
            let speed = with_unit(*speed, unit);
            format!(
                "axis {axis} at {speed}{less}: hold the left or right arrow; space stops, any other key ends the jog"
            )
        }
        State::Jogging { position, speed, unit } => format!("position {position}  speed {}", with_unit(*speed, unit)),
        State::JogEnded { axis, end, left } => {
            let why = match end {
                JogEnd::Key | JogEnd::Signal => format!("axis {axis} is stopped"),
                JogEnd::Slow { round_ms, most_ms } => format!(
                    "the module's replies take too long for a jog: {round_ms} ms each, where {most_ms} ms is the most with \
                     which it neither stutters nor goes on too long; try USB, or a faster bit rate"
                ),
                JogEnd::Failed { error, supply: Some(supply) } => {
                    let (volts, tenths) = (supply / 10, (supply % 10).abs());
                    format!("the jog is over: {error}. The motors are locked; the supply is {volts}.{tenths} V")
                }
                JogEnd::Failed { error, supply: None } => format!("the jog is over: {error}"),
            };
            match left {
                Some(Left { now, before }) => {
                    format!(
                        "{why}. Parameter 4 of axis {axis} is {now} and was {before}; it could not be put back; the next command tries again"
                    )
                }
                None => why,
            }
        }
        State::PutBack { axis, speed } => format!("parameter 4 of axis {axis} is {speed} again"),
        State::Wrong { message } => message.clone(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn help_fits_a_terminal() {
        assert!(HELP.lines().all(|line| line.chars().count() < 80));
    }

    #[test]
    fn a_locked_motor_is_told_with_its_supply() {
        let end = JogEnd::Failed { error: "MVP ABS, 0, 5: status 6".into(), supply: Some(74) };
        let ended = State::JogEnded { axis: 2, end, left: Some(Left { now: 100, before: 1000 }) };
        assert_eq!(
            text(&ended),
            "the jog is over: MVP ABS, 0, 5: status 6. The motors are locked; the supply is 7.4 V. Parameter 4 of axis 2 \
             is 100 and was 1000; it could not be put back; the next command tries again"
        );
    }
}
