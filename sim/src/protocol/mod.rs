//! The control protocol of `tmcl sim`: one line of text in, one request out. The commands for the world around a module
//! are those of [`hal_sim::control`]; here are those about time, and what becomes of a line that is neither.
//!
//! Reading a line carries nothing out. Everything that can be wrong with a command but for the moment at which it comes
//! is found here, because a step may not be refused in its middle.

mod quantity;
mod speed;

pub use quantity::{Quantity, Seen};
pub use speed::{SPEEDS, Speed};

use hal_sim::board::BoardKind;
use hal_sim::clock::{MICROSECOND, Nanos};
use hal_sim::control::{self, Line, time};

use crate::scenario::condition::{Condition, Vocabulary};
use crate::suggest::suggestion;

/// The shortest interval of a watch: a shorter one would hold the simulator up.
pub const SHORTEST_INTERVAL: Nanos = 100 * MICROSECOND;

/// The value that each line of a watch begins with.
pub const TIME: &str = "time_us";

/// The request of a line.
#[derive(Clone, Debug)]
pub enum Request {
    /// A command for the world around a module.
    World(Line),
    /// `pause [TIME]`: time stands still from now on.
    Pause {
        /// How much time passes after each reply all the same.
        after_reply: Nanos,
    },
    /// `resume`: time goes by the clock again.
    Resume,
    /// `speed X|max`: how fast it goes then.
    Speed(Speed),
    /// `step TIME`: lets paused time pass.
    Step(Nanos),
    /// `run-until CONDITION max TIME`: lets paused time pass until something holds.
    RunUntil {
        /// Index of the module whose values are looked at.
        module: usize,
        /// The condition that is to hold.
        condition: Condition,
        /// How much time passes at most.
        longest: Nanos,
    },
    /// `at TIME COMMAND`: a command for the world that is carried out later.
    At {
        /// In how much time from now.
        delay: Nanos,
        /// The command.
        line: Line,
    },
    /// `interrupt`: a step that is under way ends.
    Interrupt,
    /// `restart`: all begins anew.
    Restart,
    /// `send COMMAND`: a command of TMCL for a module.
    Send {
        /// Index of the module.
        module: usize,
        /// The command, which may have names in it that only its product knows.
        command: String,
    },
    /// `watch INTERVAL NAME...`: a line of values at each interval of virtual time.
    Watch {
        /// Index of the module whose values are told.
        module: usize,
        /// The interval.
        every: Nanos,
        /// The values, at least one, each once.
        values: Vec<Quantity>,
    },
    /// `unwatch`: no more such lines.
    Unwatch,
}

/// The commands about time, and to the firmware: the name of each, how it is written, and an example of one that takes
/// something.
pub const USAGE: [(&str, &str, &str); 11] = [
    ("pause", "pause [TIME]", "pause 10 ms"),
    ("resume", "resume", ""),
    ("speed", "speed X|max", "speed 2.5"),
    ("step", "step TIME", "step 20 ms"),
    ("run-until", "run-until CONDITION max TIME", "run-until velocity = 0 max 5 s"),
    ("interrupt", "interrupt", ""),
    ("at", "at TIME COMMAND", "at 2.5 ms power off"),
    ("restart", "restart", ""),
    ("watch", "watch INTERVAL NAME...", "watch 10 ms rotor velocity"),
    ("unwatch", "unwatch", ""),
    ("send", "send COMMAND", "send MVP ABS, 0, 51200"),
];

impl Request {
    /// Reads a line. `kinds` are the boards of the modules, that of module 1 first.
    ///
    /// # Errors
    /// The line is no command, or asks for what there is not; the message says what to write instead.
    pub fn parse(line: &str, kinds: &[&'static BoardKind]) -> Result<Self, String> {
        let all: Vec<&str> = line.split_whitespace().collect();
        let (module, words) = control::leading_module(&all)?;
        let Some((&name, rest)) = words.split_first() else { return Line::parse(line).map(Self::World) };
        if is_about_time(name) {
            Self::about_time(name, rest, module, kinds)
        } else if is_about_the_world(name) {
            Line::parse(line).map(Self::World)
        } else {
            Err(unknown(name))
        }
    }

    fn about_time(
        name: &str,
        words: &[&str],
        module: Option<usize>,
        kinds: &[&'static BoardKind],
    ) -> Result<Self, String> {
        match (name, module) {
            ("run-until" | "watch" | "send", _) | (_, None) => {}
            ("at", Some(number)) => {
                return Err(format!("write the module behind the time: at TIME module {number} COMMAND"));
            }
            (_, Some(number)) => return Err(format!("all modules share one time: leave out 'module {number}'")),
        }
        match (name, words) {
            ("pause", []) => Ok(Self::Pause { after_reply: 0 }),
            ("pause", words) => Ok(Self::Pause { after_reply: only_span(name, words)? }),
            ("resume", []) => Ok(Self::Resume),
            ("speed", [speed]) => {
                Speed::parse(speed).map(Self::Speed).map_err(|error| format!("speed '{speed}': {error}"))
            }
            ("step", [_, ..]) => Ok(Self::Step(only_span(name, words)?)),
            ("run-until", [_, ..]) => run_until(words, addressed(module, kinds)?),
            ("at", [_, ..]) => at(words),
            ("interrupt", []) => Ok(Self::Interrupt),
            ("restart", []) => Ok(Self::Restart),
            ("watch", [_, ..]) => watch(words, addressed(module, kinds)?),
            ("unwatch", []) => Ok(Self::Unwatch),
            ("send", [_, ..]) => Ok(Self::Send { module: addressed(module, kinds)?.0, command: words.join(" ") }),
            _ => Err(usage(name)),
        }
    }

    /// The names of all commands.
    pub fn names() -> impl Iterator<Item = &'static str> {
        control::USAGE.iter().map(|(name, _)| *name).chain(["module"]).chain(USAGE.iter().map(|(name, ..)| *name))
    }
}

/// Index and board of the module that a command speaks of.
fn addressed(module: Option<usize>, kinds: &[&'static BoardKind]) -> Result<(usize, &'static BoardKind), String> {
    let number = module.unwrap_or(1);
    let index = number.wrapping_sub(1);
    match kinds.get(index) {
        Some(kind) => Ok((index, kind)),
        None if kinds.len() == 1 => Err(format!("no module {number}: there is 1 module")),
        None => Err(format!("no module {number}: there are {} modules", kinds.len())),
    }
}

fn run_until(words: &[&str], (module, kind): (usize, &'static BoardKind)) -> Result<Request, String> {
    let Some(end) = words.iter().rposition(|word| *word == "max") else {
        let wanted = words.join(" ");
        return Err(format!("'max' is missing: write how long to wait at most, as in: run-until {wanted} max 5 s"));
    };
    let (condition, longest) = (words.get(..end).unwrap_or_default(), words.get(end + 1..).unwrap_or_default());
    if condition.is_empty() {
        return Err(usage("run-until"));
    }
    let condition = Condition::parse(&condition.join(" "), Vocabulary::new(kind))?;
    Ok(Request::RunUntil { module, condition, longest: only_span("run-until", longest)? })
}

fn at(words: &[&str]) -> Result<Request, String> {
    let (delay, command) = time::leading_span(words)?;
    match control::leading_module(command)?.1.first() {
        None => Err(usage("at")),
        Some(name) if is_about_time(name) => {
            Err(format!("'{name}' cannot be put off; 'at' takes a command for the world, as in: {}", example("at")))
        }
        Some(name) if !is_about_the_world(name) => Err(unknown(name)),
        Some(_) => Ok(Request::At { delay, line: Line::parse(&command.join(" "))? }),
    }
}

fn watch(words: &[&str], (module, kind): (usize, &'static BoardKind)) -> Result<Request, String> {
    let (every, mut names) = time::leading_span(words)?;
    if every < SHORTEST_INTERVAL {
        return Err(format!("the interval is too short; {} us is the shortest", SHORTEST_INTERVAL / MICROSECOND));
    }
    let mut values: Vec<Quantity> = Vec::new();
    if names.is_empty() {
        return Err(usage("watch"));
    }
    while !names.is_empty() {
        let (value, rest) = Quantity::leading(names, kind)?;
        // What is named twice is told once, and the time is told anyway.
        if value.name() != TIME && values.iter().all(|other| other.name() != value.name()) {
            values.push(value);
        }
        names = rest;
    }
    Ok(Request::Watch { module, every, values })
}

/// The span of time that is all of these words.
fn only_span(name: &str, words: &[&str]) -> Result<Nanos, String> {
    match time::leading_span(words)? {
        (span, []) => Ok(span),
        (_, [word, ..]) => Err(format!("'{word}' is one word too many; {}", usage(name))),
    }
}

fn is_about_time(name: &str) -> bool {
    USAGE.iter().any(|(other, ..)| *other == name)
}

/// Whether a command is read as one for the world; a second `module` gets its error there.
pub(crate) fn is_about_the_world(name: &str) -> bool {
    name == "module" || control::USAGE.iter().any(|(other, _)| *other == name)
}

fn usage(name: &str) -> String {
    let row = USAGE.iter().find(|(other, ..)| *other == name);
    row.map_or_else(String::new, |(_, usage, example)| match *example {
        "" => format!("usage: {usage}"),
        example => format!("usage: {usage}, as in: {example}"),
    })
}

fn example(name: &str) -> &'static str {
    USAGE.iter().find(|(other, ..)| *other == name).map_or("", |(_, _, example)| example)
}

fn unknown(name: &str) -> String {
    unknown_among(name, Request::names().collect())
}

/// The message about a name that is no command for the world, where there is no other.
pub(crate) fn unknown_in_the_world(name: &str) -> String {
    unknown_among(name, control::USAGE.iter().map(|(name, _)| *name).filter(|name| *name != "state").collect())
}

fn unknown_among(name: &str, names: Vec<&str>) -> String {
    match suggestion(name, names.iter().copied()) {
        none if none.is_empty() => format!("unknown command '{name}'; there are: {}", names.join(", ")),
        suggestion => format!("unknown command '{name}'{suggestion}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::board::{TMCM_1140, TMCM_6110};
    use hal_sim::clock::{MILLISECOND, SECOND};
    use hal_sim::control::Control;

    fn request(line: &str) -> Request {
        Request::parse(line, &[&TMCM_1140, &TMCM_6110]).unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    fn error(line: &str) -> String {
        Request::parse(line, &[&TMCM_1140, &TMCM_6110]).map(|request| panic!("{line}: {request:?}")).unwrap_err()
    }

    fn names(values: &[Quantity]) -> Vec<&str> {
        values.iter().map(Quantity::name).collect()
    }

    #[test]
    fn time_is_paused_and_resumed() {
        assert!(matches!(request("pause"), Request::Pause { after_reply: 0 }));
        assert!(matches!(request(" pause  10 ms "), Request::Pause { after_reply } if after_reply == 10 * MILLISECOND));
        assert!(matches!(request("resume"), Request::Resume));
        assert!(matches!(request("speed 2.5"), Request::Speed(Speed::Factor(2.5))));
        assert!(matches!(request("speed max"), Request::Speed(Speed::Max)));
        assert!(matches!(request("restart"), Request::Restart));
        assert!(matches!(request("unwatch"), Request::Unwatch));
    }

    #[test]
    fn steps_have_a_length() {
        assert!(matches!(request("step 20 ms"), Request::Step(span) if span == 20 * MILLISECOND));
        assert!(matches!(request("step 1.5s"), Request::Step(span) if span == 1500 * MILLISECOND));
        assert!(matches!(request("step 0 s"), Request::Step(0)));
        assert!(matches!(request("step 1 h"), Request::Step(span) if span == 3600 * SECOND));
    }

    #[test]
    fn a_condition_stands_before_max() {
        let of = |line: &str| match request(line) {
            Request::RunUntil { module, longest, .. } => (module, longest),
            other => panic!("{other:?}"),
        };
        assert_eq!(of("run-until velocity = 0 max 5 s"), (0, 5 * SECOND));
        assert_eq!(of("module 2 run-until rotor 5 between -3 and 3 max 20ms"), (1, 20 * MILLISECOND));
        assert_eq!(of("run-until GAP 8, 0 = 1 max 1 min"), (0, 60 * SECOND));
    }

    #[test]
    fn commands_for_the_world_are_put_off() {
        let of = |line: &str| match request(line) {
            Request::At { delay, line } => (delay, line),
            other => panic!("{other:?}"),
        };
        assert_eq!(
            of("at 2.5 ms power off"),
            (2500 * MICROSECOND, Line { module: 1, control: Control::Power { on: false } })
        );
        assert_eq!(
            of("at 1s module 2 load 0.5 3"),
            (SECOND, Line { module: 2, control: Control::Load { axis: 3, load: 0.5 } })
        );
        assert!(matches!(request("press left"), Request::World(Line { module: 1, .. })));
    }

    #[test]
    fn a_watch_names_values() {
        let Request::Watch { module, every, values } = request("watch 10 ms rotor velocity time_us rotor") else {
            panic!("no watch")
        };
        assert_eq!((module, every, names(&values)), (0, 10 * MILLISECOND, vec!["rotor", "velocity"]));
        let line = "module 2 watch 100us rotor 2 GAP 4, 0 outputs.7 GGP 132,0 velocity 5";
        let Request::Watch { module, every, values } = request(line) else { panic!("no watch") };
        assert_eq!((module, every), (1, SHORTEST_INTERVAL));
        assert_eq!(names(&values), ["rotor 2", "GAP 4, 0", "outputs.7", "GGP 132,0", "velocity 5"]);
    }

    #[test]
    fn errors_say_what_to_write() {
        for (line, expected) in [
            ("step", "usage: step TIME, as in: step 20 ms"),
            ("step 20", "time '20' has no unit; write '20 ms'"),
            ("step -1 s", "time '-1 s' is negative; write how much time is to pass, such as '20 ms'"),
            ("step 2 h", "time '2 h' is too long; an hour, '1 h', is the longest"),
            ("step 1 s more", "'more' is one word too many; usage: step TIME"),
            ("pause now", "'now' is not a time; write a number and a unit"),
            ("pause -1 ms", "negative"),
            ("resume now", "usage: resume"),
            ("speed", "usage: speed X|max, as in: speed 2.5"),
            ("speed 0", "speed '0': give a number from 0.001 to 1000"),
            ("run-until", "usage: run-until CONDITION max TIME, as in: run-until velocity = 0 max 5 s"),
            (
                "run-until velocity = 0",
                "'max' is missing: write how long to wait at most, as in: run-until velocity = 0 max 5 s",
            ),
            ("run-until velocity = 0 max", "a time is missing"),
            ("run-until velocity = 0 max 2 h", "too long"),
            ("run-until max 1 s", "usage: run-until"),
            ("run-until velocty = 0 max 1 s", "unknown value 'velocty'; did you mean 'velocity'?"),
            ("run-until rotor 1 = 0 max 1 s", "no axis 1: the TMCM-1140 has one, axis 0"),
            ("run-until rotor 0 max 1 s", "= != < <= > >= between is missing"),
            ("run-until $x = 1 max 1 s", "'$x'"),
            ("module 3 run-until rotor = 0 max 1 s", "no module 3: there are 2 modules"),
            ("module 2 step 1 s", "all modules share one time: leave out 'module 2'"),
            ("at", "usage: at TIME COMMAND, as in: at 2.5 ms power off"),
            ("at power off", "'power' is not a time"),
            ("at 5 ms", "usage: at TIME COMMAND"),
            (
                "at 5 ms step 1 ms",
                "'step' cannot be put off; 'at' takes a command for the world, as in: at 2.5 ms power off",
            ),
            ("at 5 ms powr off", "unknown command 'powr'; did you mean 'power'?"),
            ("at 5 ms power of", "'of' is neither 'on' nor 'off'"),
            ("module 2 at 5 ms power off", "write the module behind the time: at TIME module 2 COMMAND"),
            ("watch", "usage: watch INTERVAL NAME..., as in: watch 10 ms rotor velocity"),
            ("watch 10 ms", "usage: watch"),
            ("watch rotor", "'rotor' is not a time"),
            ("watch 50 us rotor", "the interval is too short; 100 us is the shortest"),
            ("watch 10 ms roter", "unknown value 'roter'; did you mean 'rotor'?"),
            ("watch 10 ms rotor 6", "no axis 6"),
            ("watch 10 ms GAB 4, 0", "GAB 4, 0: "),
            ("unwatch all", "usage: unwatch"),
            ("restart now", "usage: restart"),
            ("restert", "unknown command 'restert'; did you mean 'restart'?"),
            ("jump", "unknown command 'jump'; there are: press, release, input"),
            ("", "empty line"),
            ("module 1 module 2 state", "only once"),
        ] {
            let said = error(line);
            assert!(said.contains(expected), "{line}: {said}");
        }
    }
}
