//! The events of option `--at`: changes of the world and commands of the host at given times.

use hal_sim::board::BoardKind;
use hal_sim::clock::Nanos;
use hal_sim::control::{Control, Line};
use tmcm::tmcl::{Command, text};

use super::time;
use crate::suggest::{module_command, world_command};

/// An event of option `--at`.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Time since the start of the program, in nanoseconds.
    pub at: Nanos,
    /// The action as the user has written it.
    pub text: String,
    /// The action.
    pub action: Action,
}

/// The action of an event.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
    /// The world changes.
    World(Control),
    /// The host sends a command.
    Host(Command),
}

impl Event {
    /// Reads `TIME: WHAT`. As in the scenario files, commands for the module begin with a capital or a number, changes
    /// of the world with a small letter.
    ///
    /// # Errors
    /// A message that says how an event is written.
    pub fn parse(text: &str) -> Result<Self, String> {
        let Some((at, what)) = text.split_once(':') else {
            return Err("give a time, a colon and what happens then, for example '500 ms: press left'".into());
        };
        let what = what.trim();
        let action = if what.starts_with(|c: char| c.is_ascii_lowercase()) {
            match Line::parse(what).map_err(|error| in_capitals(what).unwrap_or(error))? {
                Line { control: Control::State, .. } => return Err("the state cannot be shown here".into()),
                Line { control: Control::Usb { .. }, .. } => return Err("there is no USB cable here".into()),
                Line { module: 1, control } => Action::World(control),
                Line { .. } => return Err("there is one module only".into()),
            }
        } else {
            Action::Host(text::parse(what).map_err(|error| in_small_letters(what).unwrap_or(error.to_string()))?)
        };
        Ok(Event { at: time::parse(at)?, text: what.into(), action })
    }

    /// Fails if the event is about something that a board of this kind does not have.
    ///
    /// # Errors
    /// A message that says what it lacks.
    pub fn check(&self, kind: &BoardKind) -> Result<(), String> {
        match self.action {
            Action::World(control) => control.check(kind).map_err(|error| format!("--at '{}': {error}", self.text)),
            Action::Host(_) => Ok(()),
        }
    }
}

/// Message about a command for the module that was written in small letters; `None` if it is none.
fn in_capitals(what: &str) -> Option<String> {
    let meant = module_command(what)?;
    Some(format!("commands for the module are written in capitals, those for the world small; did you mean '{meant}'?"))
}

/// Message about a change of the world that was written in capitals; `None` if it is none.
fn in_small_letters(what: &str) -> Option<String> {
    let meant = world_command(what)?;
    Some(format!("commands for the module are written in capitals, those for the world small; did you mean '{meant}'?"))
}

/// The events sorted by time; events with the same time keep their order.
pub fn in_order(events: &[Event]) -> Vec<Event> {
    let mut events = events.to_vec();
    events.sort_by_key(|event| event.at);
    events
}

#[cfg(test)]
mod tests {
    use hal_sim::board::{TMCM_1140, TMCM_6110};
    use hal_sim::clock::MILLISECOND;

    use super::*;

    #[test]
    fn world_and_host_have_their_own_words() {
        let event = Event::parse("500 ms: load 0.5").unwrap();
        assert_eq!((event.at, event.action), (500 * MILLISECOND, Action::World(Control::Load { axis: 0, load: 0.5 })));
        let event = Event::parse("1 s: SGP 0, 2, 500").unwrap();
        assert_eq!((event.text.as_str(), event.action), ("SGP 0, 2, 500", Action::Host(Command::new(9, 0, 2, 500))));
        assert_eq!(Event::parse("0 s: 129, 1, 0, 1").unwrap().action, Action::Host(Command::new(129, 1, 0, 1)));
    }

    #[test]
    fn errors_show_how_an_event_is_written() {
        let error = |text| Event::parse(text).unwrap_err();
        assert!(error("press left").contains("'500 ms: press left'"));
        assert!(error("5: press left").contains("unit"));
        assert!(error("5 s: pres left").contains("unknown command 'pres'"));
        assert!(error("5 s: MVP ABS, 0").contains("missing <value>"));
        assert!(error("5 s: state").contains("cannot be shown"));
        assert!(error("5 s: usb off").contains("no USB cable"));
        assert!(error("5 s: module 2 press left").contains("one module"));
        assert!(error("5 s:").contains("no command"));
        assert!(error("5 s: mvp abs, 0, 9").ends_with("did you mean 'MVP abs, 0, 9'?"));
        assert!(error("5 s: Press LEFT").ends_with("did you mean 'press left'?"));
    }

    #[test]
    fn events_are_about_what_there_is() {
        let event = Event::parse("500 ms: press home 5").unwrap();
        assert_eq!(event.check(&TMCM_6110), Ok(()));
        assert_eq!(
            event.check(&TMCM_1140),
            Err("--at 'press home 5': no axis 5: the TMCM-1140 has one, axis 0".into())
        );
        assert!(Event::parse("1 s: input 7 1").unwrap().check(&TMCM_1140).unwrap_err().contains("no input 7"));
        assert_eq!(Event::parse("1 s: MST 7").unwrap().check(&TMCM_1140), Ok(()));
    }

    #[test]
    fn events_come_in_the_order_of_their_times() {
        let events = ["2 s: load 1", "1 s: load 0", "2 s: load 0"].map(|text| Event::parse(text).unwrap());
        let texts: Vec<String> = in_order(&events).into_iter().map(|event| event.text).collect();
        assert_eq!(texts, ["load 0", "load 1", "load 0"]);
    }
}
