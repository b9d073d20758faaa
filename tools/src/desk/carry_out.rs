//! Carries out the lines that come to the control port.

use std::time::Duration;

use hal_sim::board::BoardKind;
use tmcm_sim::VirtualModule;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::{Request, Seen};

use super::answer::Told;
use super::controller::{ControllerId, Outcome};
use super::inquiries::Inquiries;
use super::timekeeper::{Task, Timekeeper};
use super::watch::Watch;
use crate::suggest::{module_command, world_command};

/// Carries out a line from a connection to the control port, or begins with it. `kinds` are the boards of the modules,
/// that of module 1 first.
///
/// # Errors
/// The line asks for what there is not, or what cannot be done now; then nothing has been changed.
pub fn carry_out(
    from: ControllerId,
    line: &str,
    kinds: &[&'static BoardKind],
    fleet: &mut Fleet<impl VirtualModule>,
    timekeeper: &mut Timekeeper,
    inquiries: &mut Inquiries,
    at: Duration,
) -> Result<Outcome, String> {
    let now = fleet.now();
    let told = match Request::parse(line, kinds).map_err(|error| misplaced(line).unwrap_or(error))? {
        Request::World(line) => {
            fleet.control(&line)?.map(|state| Told::State(Box::new(timekeeper.report(state, at, now))))
        }
        Request::At { delay, line } => {
            fleet.at(delay, line)?;
            Some(Told::time(now + delay))
        }
        Request::Pause { after_reply } => {
            timekeeper.pause(after_reply, fleet)?;
            Some(Told::time(now))
        }
        Request::Resume => {
            timekeeper.resume(at, fleet)?;
            Some(Told::time(now))
        }
        Request::Speed(speed) => {
            timekeeper.set_speed(speed, at);
            None
        }
        Request::Step(span) => return timekeeper.begin(from, Task::Step(span)).map(|()| Outcome::Later),
        Request::RunUntil { module, condition, longest } => {
            if let Some(module) = fleet.modules_mut().get_mut(module) {
                // What cannot be looked at is refused now, and not when time has passed.
                condition.violated(&mut Seen(module))?;
            }
            return timekeeper.begin(from, Task::RunUntil { module, condition, longest }).map(|()| Outcome::Later);
        }
        Request::Interrupt if timekeeper.interrupt(from, now) => return Ok(Outcome::Later),
        Request::Interrupt => Some(Told::time(now)),
        Request::Restart => return timekeeper.ask_restart(from).map(|()| Outcome::Later),
        Request::Watch { module: index, every, values } => {
            if let Some(module) = fleet.modules_mut().get_mut(index) {
                values.iter().try_for_each(|value| value.read(&mut Seen(module)).map(drop))?;
            }
            return Ok(Outcome::Watch(Watch::new(index, every, values, now)));
        }
        Request::Unwatch => return Ok(Outcome::Unwatch),
        Request::Send { module, command } => {
            timekeeper.refuse_if_busy()?;
            return inquiries.ask(from, fleet, module, &command).map(|()| Outcome::Later);
        }
    };
    Ok(Outcome::Done(told))
}

/// Message about a line that would be a command in small letters, or for the module; `None` for any other line.
fn misplaced(line: &str) -> Option<String> {
    if let Some(meant) = world_command(line) {
        return Some(format!("the commands here are written in small letters; did you mean '{meant}'?"));
    }
    let command = module_command(line)?;
    Some(format!("'{command}' is a command for the module; write: send {command}"))
}

#[cfg(test)]
mod tests {
    use super::super::answer::answer;
    use super::*;
    use hal_sim::board::TMCM_1140;
    use hal_sim::world::config::WorldConfig;
    use tmcm_sim::protocol::Speed;

    const FIRST: ControllerId = ControllerId(1);

    /// Answers to lines that are carried out at once.
    fn ask(timekeeper: &mut Timekeeper, line: &str) -> String {
        let mut fleet = Fleet::new(&WorldConfig::default(), &[None], 1);
        match carry_out(FIRST, line, &[&TMCM_1140], &mut fleet, timekeeper, &mut Inquiries::default(), Duration::ZERO) {
            Ok(Outcome::Done(told)) => answer(Ok(told)),
            Ok(other) => format!("{other:?}"),
            Err(error) => answer(Err(error)),
        }
    }

    #[test]
    fn one_line_of_json_for_each_command() {
        let mut timekeeper = Timekeeper::new(Speed::Factor(1.0), None, Duration::ZERO, 0);
        let mut ask = |line: &str| ask(&mut timekeeper, line);
        assert_eq!(ask("supply 12.5"), r#"{"ok":true}"#);
        assert_eq!(ask("module 2 state"), r#"{"ok":false,"error":"no module 2: there is 1 module"}"#);
        assert_eq!(ask("power off"), r#"{"ok":true}"#);
        let state: serde_json::Value = serde_json::from_str(&ask("module 1 state")).unwrap();
        assert_eq!((&state["ok"], &state["power"], &state["time"]), (&true.into(), &true.into(), &"running".into()));
        assert!(state["time_us"].is_u64() && state["speed_factor"].is_f64() && state["speed_wanted"] == 1.0);
        assert!(ask("Power OFF").contains("did you mean 'power off'?"));
        assert!(ask("PAUSE").contains("did you mean 'pause'?"));
        assert!(ask("gap 1, 0").contains("'GAP 1, 0' is a command for the module"));
        assert!(ask("jump").starts_with(r#"{"ok":false,"error":"unknown command 'jump'"#));
        let now = ask("resume");
        assert!(now.starts_with(r#"{"ok":true,"time_us":"#));
        assert!(ask("at 2.5 ms power off").starts_with(r#"{"ok":true,"time_us":"#) && ask("at 0 s power off") == now);
        assert!(ask("at 1 ms module 2 power off").contains("there is 1 module"));
        assert!(ask("at 1 ms state").contains("changes nothing"));
    }

    #[test]
    fn there_are_no_steps_while_time_goes_by_the_clock() {
        let mut timekeeper = Timekeeper::new(Speed::Max, None, Duration::ZERO, 0);
        for line in ["step 1 s", "run-until rotor = 0 max 1 s"] {
            assert!(ask(&mut timekeeper, line).contains("write 'pause' before it"), "{line}");
        }
        assert!(ask(&mut timekeeper, "pause 10 ms").starts_with(r#"{"ok":true,"time_us":"#));
        assert_eq!(ask(&mut timekeeper, "step 1 s"), "Later");
        for line in ["pause", "resume", "step 1 s", "run-until rotor = 0 max 1 s", "restart"] {
            assert!(ask(&mut timekeeper, line).contains("busy: a 'step' is under way"), "{line}");
        }
        assert!(ask(&mut timekeeper, "state").contains(r#""time":"paused""#));
        assert_eq!(ask(&mut timekeeper, "speed 2"), r#"{"ok":true}"#);
    }
}
