//! The commands of the text control protocol that concern a board: one line in, one command out.

mod reply;
mod state;
pub mod time;
mod touch;

pub use reply::ReplyFault;
pub use state::{AxisState, State, Switches};
pub use touch::{Touch, Touchable, touchables};

use crate::board::{Board, BoardKind, MotionChips};
use crate::fault::{CanState, Fault};
use crate::world::ANALOG_MAX;
use crate::world::pin::Pin;

/// A command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// `press left|right|home [AXIS]`, `release left|right|home [AXIS]`: a switch, by hand.
    Press {
        /// Of which axis.
        axis: usize,
        /// The switch.
        pin: Pin,
        /// Pressed or released.
        pressed: bool,
    },
    /// `input N 0|1`: level of a digital input; where a switch is connected, that is pressed or released, and an analog
    /// input goes to an end of its range.
    Input {
        /// Number of the input.
        number: usize,
        /// The level of the input.
        high: bool,
    },
    /// `analog N VALUE`: reading of an analog input.
    Analog {
        /// Number of the input.
        number: usize,
        /// 0..=4095.
        reading: u16,
    },
    /// `supply VOLTS`.
    Supply {
        /// 0.0..=60.0.
        volts: f64,
    },
    /// `temperature DEGC`.
    Temperature {
        /// Degrees Celsius, -55..=200.
        celsius: i32,
    },
    /// `load X [AXIS]`: load on a motor, a torque.
    Load {
        /// On that of which axis.
        axis: usize,
        /// 0.0..=1.0: a fraction of the motor's torque at full current, whatever current it has. 1.0 stalls it at full
        /// current, and with less current less does.
        load: f64,
    },
    /// `slip STEPS [AXIS]`: a blow moves a rotor by full steps.
    Slip {
        /// The axis of the rotor.
        axis: usize,
        /// -1000000..=1000000.
        full_steps: i64,
    },
    /// `fault NAME on|off [AXIS]`.
    Fault {
        /// Of which axis it is; 0 where it is one of the whole board.
        axis: usize,
        /// The fault.
        fault: Fault,
        /// Injected or removed.
        on: bool,
    },
    /// `fault reply-delay TIME`, `fault reply-drop N`, `fault reply-corrupt N`: no link is part of the board, so this
    /// is for the owner alone.
    Reply {
        /// The fault of the replies.
        fault: ReplyFault,
    },
    /// `can passive|off|on`: the owner also has to tell its bus, and what runs on the board.
    Can {
        /// The state that the CAN controller gets into.
        state: CanState,
    },
    /// `power off|on`: the owner also has to restart what runs on the board.
    Power {
        /// Switched on or off.
        on: bool,
    },
    /// `usb off|on`: no cable is part of the board, so this is for the owner alone.
    Usb {
        /// Plugged in or pulled out.
        on: bool,
    },
    /// `usb off --hangup`: the cable is pulled out, and hosts see their connections end. This is for the owner alone.
    HangUp,
    /// `state`: asks for the [`State`].
    State,
}

/// A line: a command and the module it is for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Line {
    /// Number of the module, from 1; without `module K` it is 1. Whether there is such a module is for
    /// the owner of the modules to say.
    pub module: usize,
    /// The command.
    pub control: Control,
}

/// The highest numbers that any board has.
const HIGHEST_AXIS: usize = 31;
const HIGHEST_INPUT: usize = 31;

/// The commands: the name of each, and how it is written.
pub const USAGE: [(&str, &str); 13] = [
    ("press", "press left|right|home [AXIS]"),
    ("release", "release left|right|home [AXIS]"),
    ("input", "input N 0|1"),
    ("analog", "analog N VALUE"),
    ("supply", "supply VOLTS"),
    ("temperature", "temperature DEGC"),
    ("load", "load X [AXIS]"),
    ("slip", "slip STEPS [AXIS]"),
    ("fault", "fault NAME on|off [AXIS]"),
    ("can", "can passive|off|on"),
    ("power", "power off|on"),
    ("usb", "usb off [--hangup]|on"),
    ("state", "state"),
];

impl Line {
    /// Reads a line. The error says what to write instead.
    pub fn parse(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (module, words) = leading_module(&words)?;
        let control = Control::from_words(words)?;
        Ok(Self { module: module.unwrap_or(1), control })
    }
}

impl Control {
    fn from_words(words: &[&str]) -> Result<Self, String> {
        Ok(match *words {
            ["press", name, ref axis @ ..] if axis.len() < 2 => {
                Self::Press { axis: axis_number(axis)?, pin: switch(name)?, pressed: true }
            }
            ["release", name, ref axis @ ..] if axis.len() < 2 => {
                Self::Press { axis: axis_number(axis)?, pin: switch(name)?, pressed: false }
            }
            ["input", number, level] => Self::Input {
                number: number_within("input number", number, 0, HIGHEST_INPUT)?,
                high: number_within("input level", level, 0, 1)? == 1,
            },
            ["analog", number, reading] => Self::Analog {
                number: number_within("analog input number", number, 0, HIGHEST_INPUT)?,
                reading: number_within("analog value", reading, 0, ANALOG_MAX)?,
            },
            ["supply", volts] => Self::Supply { volts: number_within("supply voltage", volts, 0.0, 60.0)? },
            ["temperature", celsius] => Self::Temperature { celsius: number_within("temperature", celsius, -55, 200)? },
            ["load", load, ref axis @ ..] if axis.len() < 2 => {
                Self::Load { axis: axis_number(axis)?, load: number_within("load", load, 0.0, 1.0)? }
            }
            ["slip", steps, ref axis @ ..] if axis.len() < 2 => Self::Slip {
                axis: axis_number(axis)?,
                full_steps: number_within("number of full steps", steps, -1_000_000, 1_000_000)?,
            },
            ["fault", ref words @ ..] if let Some(fault) = ReplyFault::parse(words) => Self::Reply { fault: fault? },
            ["fault", name, state, ref axis @ ..] if axis.len() < 2 => {
                let fault = Fault::parse(name).map_err(with_those_of_replies)?;
                if let ([axis], false) = (axis, fault.is_of_an_axis()) {
                    return Err(format!("fault '{name}' is one of the whole board: leave out the axis '{axis}'"));
                }
                Self::Fault { axis: axis_number(axis)?, fault, on: on_off(state)? }
            }
            ["can", state] => Self::Can { state: CanState::parse(state)? },
            ["power", state] => Self::Power { on: on_off(state)? },
            ["usb", "off", "--hangup"] => Self::HangUp,
            ["usb", state] => Self::Usb { on: on_off(state)? },
            ["state"] => Self::State,
            ["module", ..] => return Err("'module' can be given only once".into()),
            [word, ..] => return Err(misused(word)),
            [] => return Err("empty line; 'state' shows the state".into()),
        })
    }

    /// Whether a board of this kind has what the command speaks of; the error says what it has.
    pub fn check(self, kind: &BoardKind) -> Result<(), String> {
        let name = kind.name;
        match self {
            Self::Press { axis, .. } | Self::Load { axis, .. } | Self::Slip { axis, .. } => kind.check_axis(axis),
            Self::Fault { fault: Fault::Encoder, .. } if !kind.magnetic_encoders => {
                Err(format!("fault 'encoder': the {name} has no built-in encoder"))
            }
            Self::Fault { fault, .. } if !has_chip(kind, fault) => {
                Err(format!("fault '{}': the {name} has no such chip", fault.name()))
            }
            Self::Fault { axis, .. } => kind.check_axis(axis),
            Self::Input { number, .. } if !kind.has_input(number) => {
                let more =
                    kind.enable_input.map_or(String::new(), |number| format!(", and {number}, its ENABLE input"));
                let last = kind.inputs.len().saturating_sub(1);
                Err(format!("no input {number}: the {name} has inputs 0 to {last}{more}"))
            }
            Self::Analog { number, .. } if kind.analog().all(|channel| channel != number) => {
                let there_are: Vec<String> = kind.analog().map(|channel| channel.to_string()).collect();
                Err(format!("no analog input {number}; of the {name} are analog: {}", there_are.join(", ")))
            }
            _ => Ok(()),
        }
    }

    /// Carries the command out. Gives the state if that is what was asked for. The error is that of [`Control::check`].
    pub fn apply(self, board: &mut Board) -> Result<Option<State>, String> {
        self.check(board.kind())?;
        let now = board.now();
        match self {
            Self::Press { axis, pin, pressed } => {
                board.change_world(|world| world.axis_mut(axis).press(pin, pressed));
            }
            Self::Input { number, high } => board.change_world(|world| world.set_input(number, high)),
            Self::Analog { number, reading } => board.change_world(|world| world.set_analog(number, reading)),
            Self::Supply { volts } => board.change_world(|world| world.set_supply(volts)),
            Self::Temperature { celsius } => {
                board.change_world(|world| world.set_temperature(celsius));
            }
            Self::Load { axis, load } => board.change_world(|world| world.axis_mut(axis).set_load(load)),
            Self::Slip { axis, full_steps } => {
                board.change_world(|world| world.axis_mut(axis).slip(full_steps, now));
            }
            Self::Fault { axis, fault, on } => board.set_fault(fault, axis, on),
            Self::Can { state } => board.set_can(state),
            Self::Power { on: true } => board.power_on(),
            Self::Power { on: false } => board.power_off(),
            Self::Usb { .. } | Self::HangUp | Self::Reply { .. } => {}
            Self::State => return Ok(Some(State::of(board))),
        }
        Ok(None)
    }
}

/// Whether a board has the chip that a fault is of; true for faults of anything else.
fn has_chip(kind: &BoardKind, fault: Fault) -> bool {
    match fault {
        Fault::Tmc429 | Fault::Tmc262 => kind.motion == MotionChips::Tmc429Tmc262,
        Fault::Tmc5160 | Fault::ChipSupply => kind.motion == MotionChips::Tmc5160,
        _ => true,
    }
}

/// The message about an unknown fault, which lists those of the board, with those of replies.
fn with_those_of_replies(message: String) -> String {
    ReplyFault::USAGE.iter().fold(message, |message, (name, _)| format!("{message}, {name}"))
}

/// The number of the module that a line is for, if it begins with one, and the words behind that.
///
/// # Errors
/// `module` has no number from 1 on behind it.
pub fn leading_module<'a, 'b>(words: &'a [&'b str]) -> Result<(Option<usize>, &'a [&'b str]), String> {
    match words {
        ["module", number, rest @ ..] => Ok((Some(number_within("module", number, 1, 127)?), rest)),
        ["module"] => Err("usage: module K COMMAND".into()),
        rest => Ok((None, rest)),
    }
}

/// The number of an axis, 0 if there is none behind a command.
fn axis_number(words: &[&str]) -> Result<usize, String> {
    words.first().map_or(Ok(0), |word| number_within("axis", word, 0, HIGHEST_AXIS))
}

fn switch(name: &str) -> Result<Pin, String> {
    match name {
        "left" => Ok(Pin::Left),
        "right" => Ok(Pin::Right),
        "home" => Ok(Pin::Home),
        _ => Err(format!("unknown switch '{name}'; there are: left, right, home")),
    }
}

fn on_off(word: &str) -> Result<bool, String> {
    match word {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("'{word}' is neither 'on' nor 'off'")),
    }
}

fn number_within<T>(what: &str, word: &str, low: T, high: T) -> Result<T, String>
where
    T: core::str::FromStr + PartialOrd + core::fmt::Display,
{
    word.parse()
        .ok()
        .filter(|number| (&low..=&high).contains(&number))
        .ok_or_else(|| format!("{what} '{word}' is not a number within {low} to {high}"))
}

fn misused(word: &str) -> String {
    match USAGE.iter().find(|(name, _)| *name == word) {
        Some((_, usage)) => format!("usage: {usage}"),
        None => {
            let names = USAGE.map(|(name, _)| name).join(", ");
            format!("unknown command '{word}'; there are: {names}, module")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::config::WorldConfig;

    fn command(line: &str) -> Control {
        Line::parse(line).unwrap().control
    }

    fn error(line: &str) -> String {
        Line::parse(line).unwrap_err()
    }

    #[test]
    fn every_command_of_the_protocol_is_understood() {
        let cases = [
            ("press left", Control::Press { axis: 0, pin: Pin::Left, pressed: true }),
            ("release home", Control::Press { axis: 0, pin: Pin::Home, pressed: false }),
            ("input 2 1", Control::Input { number: 2, high: true }),
            ("analog 0 4095", Control::Analog { number: 0, reading: 4095 }),
            ("supply 8.4", Control::Supply { volts: 8.4 }),
            ("temperature -5", Control::Temperature { celsius: -5 }),
            ("load 0.5", Control::Load { axis: 0, load: 0.5 }),
            ("slip -8", Control::Slip { axis: 0, full_steps: -8 }),
            ("fault eeprom on", Control::Fault { axis: 0, fault: Fault::Eeprom, on: true }),
            ("can passive", Control::Can { state: CanState::Passive }),
            ("power off", Control::Power { on: false }),
            ("usb on", Control::Usb { on: true }),
            ("usb off --hangup", Control::HangUp),
            ("fault reply-drop 2", Control::Reply { fault: ReplyFault::Drop(2) }),
            ("  state  ", Control::State),
            ("press left 2", Control::Press { axis: 2, pin: Pin::Left, pressed: true }),
            ("release right 0", Control::Press { axis: 0, pin: Pin::Right, pressed: false }),
            ("load 0.5 5", Control::Load { axis: 5, load: 0.5 }),
            ("slip 4 1", Control::Slip { axis: 1, full_steps: 4 }),
            ("fault tmc262 off 3", Control::Fault { axis: 3, fault: Fault::Tmc262, on: false }),
            ("analog 4 7", Control::Analog { number: 4, reading: 7 }),
        ];
        for (line, expected) in cases {
            assert_eq!(command(line), expected, "{line}");
        }
        let line = Line::parse("module 3 press right").unwrap();
        assert_eq!(line.module, 3);
        assert_eq!(Line::parse("state").unwrap().module, 1);
    }

    #[test]
    fn errors_say_what_to_write() {
        assert!(error("").contains("empty"));
        assert!(error("jump").contains("press, release, input"));
        assert_eq!(error("press"), "usage: press left|right|home [AXIS]");
        assert_eq!(error("load 0.5 1 2"), "usage: load X [AXIS]");
        assert!(error("press left first").contains("axis 'first' is not a number within 0"));
        assert_eq!(error("fault spi on 1"), "fault 'spi' is one of the whole board: leave out the axis '1'");
        assert!(error("press up").contains("left, right, home"));
        assert!(error("input 32 1").contains("input number '32'"));
        assert!(error("input 1 2").contains("0 to 1"));
        assert!(error("analog x 5").contains("analog input number"));
        assert!(error("analog 0 4096").contains("0 to 4095"));
        assert!(error("supply nan").contains("supply voltage 'nan'"));
        assert!(error("load 1.1").contains("0 to 1"));
        assert!(
            error("fault fire on").contains("overtemperature") && error("fault fire on").ends_with(", reply-corrupt")
        );
        assert!(error("power maybe").contains("neither 'on' nor 'off'"));
        assert!(error("can of").contains("passive, off, on"));
        assert_eq!(error("can"), "usage: can passive|off|on");
        assert_eq!(error("usb"), "usage: usb off [--hangup]|on");
        assert_eq!(error("usb on --hangup"), "usage: usb off [--hangup]|on");
        assert!(error("module").contains("module K"));
        assert!(error("module 0 state").contains("module '0'"));
        assert!(error("module 1 module 2 state").contains("only once"));
    }

    #[test]
    fn what_is_set_shows_in_the_state() {
        let mut board = Board::new(&WorldConfig::default(), 0);
        for line in ["press left", "input 3 1", "input 0 1", "supply 12.5", "temperature 40", "load 0.25", "can off"] {
            assert_eq!(command(line).apply(&mut board), Ok(None));
        }
        let state = command("state").apply(&mut board).unwrap().unwrap();
        let switches = Switches { left: true, right: false, home: true };
        assert_eq!(state.first.switches, switches);
        assert_eq!(state.inputs, [true, true, false, true]);
        assert_eq!((state.analog, state.supply), (4095, 12.5));
        assert_eq!((state.temperature, state.first.load, state.can), (40, 0.25, CanState::Off));
        command("power off").apply(&mut board).unwrap();
        assert!(!State::of(&board).power);
    }

    #[test]
    fn what_the_board_lacks_is_refused_and_changes_nothing() {
        let mut board = Board::new(&WorldConfig::default(), 0);
        let before = State::of(&board);
        for (line, expected) in [
            ("press left 1", "no axis 1: the TMCM-1140 has one, axis 0"),
            ("load 0.5 2", "no axis 2: the TMCM-1140 has one, axis 0"),
            ("slip 4 1", "no axis 1: the TMCM-1140 has one, axis 0"),
            ("fault tmc429 on 3", "no axis 3: the TMCM-1140 has one, axis 0"),
            ("input 4 1", "no input 4: the TMCM-1140 has inputs 0 to 3"),
            ("analog 1 5", "no analog input 1; of the TMCM-1140 are analog: 0"),
        ] {
            assert_eq!(command(line).apply(&mut board), Err(expected.into()), "{line}");
        }
        assert_eq!(State::of(&board), before);
    }
}
