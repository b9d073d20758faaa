//! The commands of the text control protocol that concern a board: one line in, one command out.

use crate::board::Board;
use crate::fault::Fault;
use crate::world::ANALOG_MAX;
use crate::world::motor::FULL_TORQUE;
use crate::world::pin::Pin;
use serde::Serialize;

/// A command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Control {
    /// `press left|right|home`, `release left|right|home`: a switch, by hand.
    Press {
        /// Which switch.
        pin: Pin,
        /// Pressed or released.
        pressed: bool,
    },
    /// `input N 0|1`: level of a digital input; 1..3 press or release the switches, 0 sets the analog input to an end of
    /// its range.
    Input {
        /// Number of the input, 0..=3.
        number: u8,
        /// Its level.
        high: bool,
    },
    /// `analog 0 VALUE`: reading of the analog input.
    Analog {
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
    /// `load X`: load on the motor.
    Load {
        /// 0.0 free .. 1.0 stalls it at full current.
        load: f64,
    },
    /// `slip STEPS`: a blow moves the rotor by full steps.
    Slip {
        /// -1000000..=1000000.
        full_steps: i64,
    },
    /// `fault NAME on|off`.
    Fault {
        /// Which fault.
        fault: Fault,
        /// Injected or removed.
        on: bool,
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

/// How each command is written, for error messages.
const USAGE: [(&str, &str); 12] = [
    ("press", "press left|right|home"),
    ("release", "release left|right|home"),
    ("input", "input N 0|1"),
    ("analog", "analog 0 VALUE"),
    ("supply", "supply VOLTS"),
    ("temperature", "temperature DEGC"),
    ("load", "load X"),
    ("slip", "slip STEPS"),
    ("fault", "fault NAME on|off"),
    ("power", "power off|on"),
    ("usb", "usb off|on"),
    ("state", "state"),
];

impl Line {
    /// Reads a line. The error says what to write instead.
    pub fn parse(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (module, words) = match words.as_slice() {
            ["module", number, rest @ ..] => (number_within("module", number, 1, 127)?, rest),
            ["module"] => return Err("usage: module K COMMAND".into()),
            rest => (1, rest),
        };
        let control = Control::from_words(words)?;
        Ok(Self { module, control })
    }
}

impl Control {
    fn from_words(words: &[&str]) -> Result<Self, String> {
        Ok(match *words {
            ["press", name] => Self::Press { pin: switch(name)?, pressed: true },
            ["release", name] => Self::Press { pin: switch(name)?, pressed: false },
            ["input", number, level] => Self::Input {
                number: number_within("input number", number, 0, 3)?,
                high: number_within("input level", level, 0, 1)? == 1,
            },
            ["analog", number, reading] => {
                number_within("analog input number", number, 0, 0)?;
                let reading = number_within("analog value", reading, 0, ANALOG_MAX)?;
                Self::Analog { reading }
            }
            ["supply", volts] => Self::Supply { volts: number_within("supply voltage", volts, 0.0, 60.0)? },
            ["temperature", celsius] => Self::Temperature { celsius: number_within("temperature", celsius, -55, 200)? },
            ["load", load] => Self::Load { load: number_within("load", load, 0.0, 1.0)? },
            ["slip", steps] => {
                Self::Slip { full_steps: number_within("number of full steps", steps, -1_000_000, 1_000_000)? }
            }
            ["fault", name, state] => Self::Fault { fault: Fault::parse(name)?, on: on_off(state)? },
            ["power", state] => Self::Power { on: on_off(state)? },
            ["usb", state] => Self::Usb { on: on_off(state)? },
            ["state"] => Self::State,
            ["module", ..] => return Err("'module' can be given only once".into()),
            [word, ..] => return Err(misused(word)),
            [] => return Err("empty line; 'state' shows the state".into()),
        })
    }

    /// Carries the command out. Gives the state if that is what was asked for.
    pub fn apply(self, board: &mut Board) -> Option<State> {
        let now = board.now();
        match self {
            Self::Press { pin, pressed } => board.change_world(|world| world.press(pin, pressed)),
            Self::Input { number, high } => board.change_world(|world| match number {
                1 => world.set_level(Pin::Left, high),
                2 => world.set_level(Pin::Right, high),
                3 => world.set_level(Pin::Home, high),
                _ => world.set_analog(if high { ANALOG_MAX } else { 0 }),
            }),
            Self::Analog { reading } => board.change_world(|world| world.set_analog(reading)),
            Self::Supply { volts } => board.change_world(|world| world.set_supply(volts)),
            Self::Temperature { celsius } => {
                board.change_world(|world| world.set_temperature(celsius));
            }
            Self::Load { load } => board.change_world(|world| world.set_load(load)),
            Self::Slip { full_steps } => board.change_world(|world| world.slip(full_steps, now)),
            Self::Fault { fault, on } => board.set_fault(fault, on),
            Self::Power { on: true } => board.power_on(),
            Self::Power { on: false } => board.power_off(),
            Self::Usb { .. } => {}
            Self::State => return Some(State::of(board)),
        }
        None
    }
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

/// What `state` tells of a board.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct State {
    /// Virtual time in microseconds.
    pub time_us: u64,
    /// Whether the board has power.
    pub power: bool,
    /// X_ACTUAL of the TMC429, in microsteps.
    pub position: i32,
    /// V_ACTUAL of the TMC429, in its internal unit.
    pub velocity: i32,
    /// Rotor position in 1/256 full steps.
    pub rotor: i64,
    /// Position the rotor would have without lost steps, in 1/256 full steps.
    pub field: i64,
    /// Lost full steps since power-on, negative when the rotor is ahead.
    pub lost_steps: i64,
    /// Whether the driver's bridges are on.
    pub bridges_on: bool,
    /// The driver's effective current in 1/32 of full scale, 0..=32.
    pub current: u32,
    /// The driver's last stallGuard2 value, 0..=1023.
    pub stall_guard: u16,
    /// Load on the motor, 0.0..=1.0.
    pub load: f64,
    /// The switches.
    pub switches: Switches,
    /// Levels of the digital inputs IN0..IN3.
    pub inputs: [bool; 4],
    /// Reading of the analog input, 0..=4095.
    pub analog: u16,
    /// Outputs OUT0 and OUT1.
    pub outputs: [bool; 2],
    /// Whether the inputs' pull-ups are on.
    pub pull_ups: bool,
    /// LED1 and LED2.
    pub leds: [bool; 2],
    /// Built-in encoder, 0..=1023.
    pub encoder: u16,
    /// Counts of an ABN encoder on the inputs.
    pub abn: i64,
    /// Supply voltage in volts.
    pub supply: f64,
    /// Temperature in degrees Celsius.
    pub temperature: i32,
}

/// The levels of the switches' pins: true (high) is pressed, but released for a normally closed switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Switches {
    /// IN1.
    pub left: bool,
    /// IN2.
    pub right: bool,
    /// IN3.
    pub home: bool,
}

impl State {
    /// The state of `board` now.
    pub fn of(board: &Board) -> Self {
        let (world, motor) = (board.world(), board.world().motor());
        let inputs = board.inputs();
        let level = |number: u8| inputs.digital >> number & 1 == 1;
        let outputs = world.outputs();
        Self {
            time_us: board.now() / crate::clock::MICROSECOND,
            power: board.is_powered(),
            position: board.tmc429().position(0),
            velocity: board.tmc429().velocity(0),
            rotor: motor.rotor(),
            field: motor.field(),
            lost_steps: motor.lost_steps(),
            bridges_on: board.tmc262().bridges_on(),
            current: board.tmc262().current(),
            stall_guard: board.tmc262().stall_guard(),
            load: f64::from(motor.load()) / f64::from(FULL_TORQUE),
            switches: Switches { left: level(1), right: level(2), home: level(3) },
            inputs: [0, 1, 2, 3].map(level),
            analog: inputs.analog,
            outputs: outputs.out,
            pull_ups: outputs.pull_ups,
            leds: outputs.leds,
            encoder: inputs.encoder,
            abn: inputs.abn.count,
            supply: f64::from(inputs.supply) / 10.0,
            temperature: inputs.temperature,
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
            ("press left", Control::Press { pin: Pin::Left, pressed: true }),
            ("release home", Control::Press { pin: Pin::Home, pressed: false }),
            ("input 2 1", Control::Input { number: 2, high: true }),
            ("analog 0 4095", Control::Analog { reading: 4095 }),
            ("supply 8.4", Control::Supply { volts: 8.4 }),
            ("temperature -5", Control::Temperature { celsius: -5 }),
            ("load 0.5", Control::Load { load: 0.5 }),
            ("slip -8", Control::Slip { full_steps: -8 }),
            ("fault eeprom on", Control::Fault { fault: Fault::Eeprom, on: true }),
            ("power off", Control::Power { on: false }),
            ("usb on", Control::Usb { on: true }),
            ("  state  ", Control::State),
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
        assert_eq!(error("press"), "usage: press left|right|home");
        assert!(error("press up").contains("left, right, home"));
        assert!(error("input 4 1").contains("input number '4'"));
        assert!(error("input 1 2").contains("0 to 1"));
        assert!(error("analog 1 5").contains("analog input number"));
        assert!(error("analog 0 4096").contains("0 to 4095"));
        assert!(error("supply nan").contains("supply voltage 'nan'"));
        assert!(error("load 1.1").contains("0 to 1"));
        assert!(error("fault fire on").contains("overtemperature"));
        assert!(error("power maybe").contains("neither 'on' nor 'off'"));
        assert_eq!(error("usb"), "usage: usb off|on");
        assert!(error("module").contains("module K"));
        assert!(error("module 0 state").contains("module '0'"));
        assert!(error("module 1 module 2 state").contains("only once"));
    }

    #[test]
    fn what_is_set_shows_in_the_state() {
        let mut board = Board::new(&WorldConfig::default(), 0);
        for line in ["press left", "input 3 1", "input 0 1", "supply 12.5", "temperature 40", "load 0.25"] {
            assert_eq!(command(line).apply(&mut board), None);
        }
        let state = command("state").apply(&mut board).unwrap();
        let switches = Switches { left: true, right: false, home: true };
        assert_eq!(state.switches, switches);
        assert_eq!(state.inputs, [true, true, false, true]);
        assert_eq!((state.analog, state.supply), (4095, 12.5));
        assert_eq!((state.temperature, state.load), (40, 0.25));
        command("power off").apply(&mut board);
        assert!(!State::of(&board).power);
    }
}
