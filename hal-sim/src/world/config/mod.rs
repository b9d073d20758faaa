//! The world file: a description in TOML of what is around the module. Every table and every entry may be left out;
//! `hal-sim/worlds/stage.toml` shows all of them, and `gantry.toml` beside it three axes.
//!
//! The tables `[motor]`, `[stage]`, `[abn]` and `[encoder]` hold for all axes. The n-th `[[axis]]` is that of axis
//! n - 1. An entry in one of its tables (`[axis.motor]` ...) replaces the entry that holds for all axes, and leaves the
//! others as they are.

mod axis;
mod stage;
mod wrong;

pub use axis::{AbnConfig, AxisConfig, EncoderTable, MotorTable};
pub use stage::{StageConfig, Zone};

use super::motor::FULL_TORQUE;
use crate::board::kind::BoardKind;
use crate::board::products::TMCM_1140;
use serde::Deserialize;
use toml::{Spanned, Table, Value};
use wrong::{Wrong, line_at, within};

/// A world as its file describes it. The default has a bare 200-step motor on each axis, a supply of 24 V, 25 degrees
/// Celsius, and nothing connected to the inputs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct WorldConfig {
    /// The seed of the random numbers, for noise and torn EEPROM pages.
    pub seed: u64,
    /// The surroundings of those axes that have no entry of their own in `axes`.
    pub every: AxisConfig,
    /// The surroundings of the first axes, as many as the file has tables `[[axis]]`.
    pub axes: Vec<AxisConfig>,
    /// Supply, temperature and analog input.
    pub supply: SupplyTable,
}

/// Table `[supply]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SupplyTable {
    /// Supply voltage in volts, 0.0..=60.0, 24 by default.
    pub volts: f64,
    /// Temperature of the board in degrees Celsius, -55..=200, 25 by default.
    pub temperature: i32,
    /// Reading of the analog input IN0, 0..=4095, 0 by default. Other analog inputs read 0 at the start.
    pub analog: u16,
}

impl Default for SupplyTable {
    fn default() -> Self {
        Self { volts: 24.0, temperature: 25, analog: 0 }
    }
}

impl SupplyTable {
    fn check(&self) -> Result<(), Wrong> {
        within(&["supply.volts"], self.volts, 0.0, 60.0)?;
        within(&["supply.temperature"], self.temperature, -55, 200)?;
        within(&["supply.analog"], self.analog, 0, 4095)
    }
}

/// The tables of the file as they stand in it.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct File {
    seed: u64,
    motor: MotorTable,
    stage: StageConfig,
    abn: Option<AbnConfig>,
    encoder: EncoderTable,
    supply: SupplyTable,
    axis: Vec<Spanned<AxisConfig>>,
}

impl WorldConfig {
    /// Reads the text of a world file for a TMCM-1140.
    ///
    /// # Errors
    /// A text that names the line and the entry that is wrong.
    pub fn parse(text: &str) -> Result<Self, String> {
        Self::parse_for(&TMCM_1140, text)
    }

    /// Reads the text of a world file for any kind of board.
    ///
    /// # Errors
    /// As of [`parse`](Self::parse).
    pub fn parse_for(kind: &BoardKind, text: &str) -> Result<Self, String> {
        let File { seed, motor, stage, abn, encoder, supply, axis } =
            toml::from_str(text).map_err(|error| error.to_string())?;
        let lines: Vec<usize> = axis.iter().map(|table| line_at(text, table.span().start)).collect();
        if let Some(line) = lines.get(kind.axes()) {
            let (table, name, axes) = (kind.axes() + 1, kind.name, kind.axes());
            let has = if axes == 1 { "one axis".into() } else { format!("{axes} axes") };
            return Err(format!("line {line}: this is [[axis]] number {table}, and the {name} has {has}"));
        }
        let every = AxisConfig { motor, stage, abn, encoder };
        let mut axes = Vec::new();
        if !axis.is_empty() {
            let mut common: Table = text.parse().map_err(|error: toml::de::Error| error.to_string())?;
            let tables = common.remove("axis");
            common.retain(|name, _| name != "seed" && name != "supply");
            for table in tables.into_iter().filter_map(|tables| tables.try_into::<Vec<Table>>().ok()).flatten() {
                axes.push(merged(&common, table)?);
            }
        }
        let config = Self { seed, every, axes, supply };
        match config.check(kind) {
            Ok(()) => Ok(config),
            Err((axis, wrong)) => {
                let line = wrong.line(text, axis).or_else(|| lines.get(axis?).copied());
                let line = line.map_or_else(String::new, |line| format!("line {line}: "));
                let axis = axis.map_or_else(String::new, |axis| format!("axis {axis}: "));
                Err(format!("{line}{axis}{wrong}"))
            }
        }
    }

    /// The surroundings of an axis.
    pub fn axis(&self, axis: usize) -> &AxisConfig {
        self.axes.get(axis).unwrap_or(&self.every)
    }

    /// Checks all entries. An error comes with the number of the axis, unless it is about what all axes have in common.
    fn check(&self, kind: &BoardKind) -> Result<(), (Option<usize>, Wrong)> {
        self.supply.check().map_err(|wrong| (None, wrong))?;
        for (number, axis) in self.axes.iter().enumerate() {
            axis.check(kind).map_err(|wrong| (Some(number), wrong))?;
        }
        let all_have_tables = self.axes.len() >= kind.axes();
        if all_have_tables { Ok(()) } else { self.every.check(kind).map_err(|wrong| (None, wrong)) }
    }
}

/// The surroundings of an axis: the entries of its own tables, and those entries of the common tables that it does not
/// replace.
fn merged(common: &Table, own: Table) -> Result<AxisConfig, String> {
    let mut whole = common.clone();
    for (name, table) in own {
        match (whole.get_mut(&name), table) {
            (Some(Value::Table(common)), Value::Table(own)) => common.extend(own),
            (_, table) => drop(whole.insert(name, table)),
        }
    }
    whole.try_into().map_err(|error: toml::de::Error| error.to_string())
}

/// Converts a fraction of the torque at full current to 1/65536 of it.
pub(crate) fn torque(fraction: f64) -> u32 {
    (fraction * f64::from(FULL_TORQUE)).round() as u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::board::kind::AbnPins;
    use crate::board::products::{TMCM_1110, TMCM_3110, TMCM_3212, TMCM_6110};

    #[test]
    fn an_empty_file_is_the_default_world() {
        assert_eq!(WorldConfig::parse("").unwrap(), WorldConfig::default());
        assert_eq!(AxisConfig::default().units_per_turn(), 51_200);
    }

    /// The folder of the example files; Cargo runs tests in that of their package.
    const WORLDS: &str = "worlds";

    #[test]
    fn the_example_files_are_valid() {
        let files: [(&str, &[&BoardKind]); 2] = [
            ("gantry.toml", &[&TMCM_3110, &TMCM_3212, &TMCM_6110]),
            ("stage.toml", &[&TMCM_1110, &TMCM_1140, &TMCM_3110, &TMCM_3212, &TMCM_6110]),
        ];
        let mut found: Vec<_> = std::fs::read_dir(WORLDS).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        found.sort();
        assert_eq!(found, files.map(|(name, _)| name), "a file for which no product is named here");
        for (name, kinds) in files {
            let text = std::fs::read_to_string(format!("{WORLDS}/{name}")).unwrap();
            for kind in kinds {
                if let Err(error) = WorldConfig::parse_for(kind, &text) {
                    panic!("{name} for the {}: {error}", kind.name);
                }
            }
        }
    }

    /// Reads the lines that gantry.toml has in a comment, for the products that have pins for encoders.
    #[test]
    fn the_encoder_of_the_example_with_three_axes_is_valid_where_there_are_pins_for_it() {
        let text = std::fs::read_to_string(format!("{WORLDS}/gantry.toml")).unwrap();
        let (axes, encoder) = text.rsplit_once("# [axis.abn]").unwrap();
        let text = format!("{axes}[axis.abn]{}", encoder.replace("# ", ""));
        for kind in [&TMCM_3110, &TMCM_3212] {
            let world = WorldConfig::parse_for(kind, &text).unwrap();
            assert_eq!([0, 1, 2].map(|axis| world.axis(axis).abn.is_some()), [false, false, true]);
        }
        let error = WorldConfig::parse_for(&TMCM_6110, &text).unwrap_err();
        assert!(
            error.ends_with("axis 2: abn.lines: no ABN encoder can be connected to the TMCM-6110; leave out the table")
        );
    }

    #[test]
    fn errors_name_the_entry() {
        let error = |text| WorldConfig::parse(text).unwrap_err();
        assert!(error("[stage]\nlefft = 1").contains("lefft"));
        assert!(error("[stage]\nlefft = 1").contains("line 2"));
        assert!(error("[motor]\nload = 1.5").contains("motor.load: 1.5 is not within 0 to 1"));
        assert!(error("[motor]\nfriction = nan").contains("motor.friction"));
        assert!(error("[motor]\nstall_guard_zero = 64").contains("motor.stall_guard_zero: 64 is not within -64 to 63"));
        assert!(error("[motor]\nstall_guard_span = 0").contains("motor.stall_guard_span"));
        assert!(error("[motor]\nstall_guard_speed = 100001").contains("motor.stall_guard_speed"));
        assert!(error("[stage]\nhome = [5, 1]").contains("stage.home"));
        assert!(error("[stage]\nhard_left = 5\nhard_right = 1").contains("stage.hard_left"));
        assert!(error("[stage]\nhard_left = 5").contains("motor.start"));
        assert!(error("[stage]\nleft = 5\n[abn]\nlines = 500").contains("abn.lines: it uses the pins"));
        assert!(error("[stage]\nleft_width = 5").contains("there is no stage.left"));
        assert!(error("[stage]\nright = 5\nright_width = 0").contains("stage.right_width: 0 is not within 1"));
        assert!(error("[stage]\nhysteresis = -1").contains("stage.hysteresis"));
        assert!(error("[stage]\ncircle = 1").contains("stage.circle"));
        assert!(error("[stage]\nleft = 5\ncircle = 100").contains("needs stage.left_width"));
        assert!(error("[stage]\nhard_right = 5\ncircle = 100").contains("no hard ends"));
        assert!(error("[stage]\nhome = [1, 90]\nhysteresis = 5\ncircle = 100").contains("stage.home: with the"));
        assert!(error("[stage]\nnormally_closed = ['front']").contains("front"));
        assert!(error("[abn]\nindex = 5").contains("lines"));
        assert!(error("[supply]\nvolts = 'high'").contains("volts"));
    }

    /// Each world that cannot be is refused with the line that has to be changed, and the same world with one number
    /// different is taken.
    #[test]
    fn worlds_that_cannot_be_are_refused_with_the_line() {
        let cases = [
            // The left switch is closed at and below its position, the right one at and above.
            (
                "left = 500\nright = LAST",
                "-500",
                "502",
                "line 2: stage.left: 500 is not below stage.right (-500); if the",
            ),
            ("right = 0\nleft = LAST", "0", "-2", "line 3: stage.left: 0 is not below stage.right (0)"),
            ("left = 0\nright = 10\nhysteresis = LAST", "9", "8", "line 4: stage.hysteresis: with 9 the switches"),
            ("left = -500\nright = 500\nreversed = LAST", "true", "false", "line 2: stage.left: -500 is not above"),
            // Hard ends on the wrong side of the switches.
            (
                "hard_left = 0\nleft = LAST",
                "-1",
                "0",
                "line 3: stage.left: -1 is behind the hard end stage.hard_left (0)",
            ),
            (
                "hard_right = 9\nright = LAST",
                "10",
                "9",
                "line 3: stage.right: 10 is behind the hard end stage.hard_right",
            ),
            (
                "hard_right = 9\nleft = LAST",
                "9",
                "8",
                "line 3: stage.left: 9 is at the wrong hard end, stage.hard_right",
            ),
            (
                "hard_left = -9\nright = LAST",
                "-9",
                "-8",
                "line 3: stage.right: -9 is at the wrong hard end, stage.hard_l",
            ),
            ("hysteresis = 5\nhard_right = 9\nleft = LAST", "4", "3", "line 4: stage.left: 4 is at the wrong hard end"),
            (
                "hard_left = -5\nhard_right = LAST",
                "-5",
                "0",
                "line 2: stage.hard_left: -5 is not below stage.hard_right",
            ),
            // A home switch that no search finds, because the stage does not get there or is always there.
            (
                "hard_right = 99\nhome = [100, LAST]\nleft = -5",
                "120",
                "",
                "line 3: stage.home: 100 to 120 is behind the h",
            ),
            (
                "hard_right = 99\nhome = [LAST, 120]",
                "100",
                "99",
                "line 3: stage.home: 100 to 120 is behind the hard end",
            ),
            (
                "hard_left = 0\nhome = [-9, LAST]",
                "-1",
                "0",
                "stage.home: -9 to -1 is behind the hard end stage.hard_left (0)",
            ),
            ("hard_left = 0\nhard_right = 9\nhome = [-1, LAST]", "9", "8", "line 4: stage.home: -1 to 9: once pressed"),
            (
                "hard_left = -9\nhard_right = 9\nhome = [0, 0]\nhysteresis = LAST",
                "9",
                "8",
                "line 4: stage.home: 0 to 0: on",
            ),
            // The motor starts beyond the ends, wherever the file says so.
            (
                "hard_left = LAST",
                "1",
                "0",
                "line 2: motor.start: the rotor cannot start at 0, below the hard end stage.ha",
            ),
            (
                "hard_right = 9\n[motor]\nstart = LAST",
                "10",
                "9",
                "line 4: motor.start: the rotor cannot start at 10, above",
            ),
            // Two cams that are all of a circle: 40 and 60 of 100 units, where the second ends as the first begins.
            (
                "circle = 100\nleft = 39\nleft_width = 40\nright_width = 60\nright = LAST",
                "40",
                "39",
                "line 2: stage.circle: stage.left and stage.right leave nothing of the circle",
            ),
            ("[abn]\nlines = LAST", "0", "1", "line 3: abn.lines: an encoder has 1 to 100000 lines"),
        ];
        for (stage, wrong, right, message) in cases {
            let world = |last: &str| WorldConfig::parse(&format!("[stage]\n{}", stage.replace("LAST", last)));
            let error = world(wrong).expect_err(stage);
            assert!(error.contains(message), "{stage}: {error}");
            // Where no other number helps, the switch has to go.
            let taken = if right.is_empty() { WorldConfig::parse("[stage]\nhard_right = 99") } else { world(right) };
            assert!(taken.is_ok(), "{stage}: {taken:?}");
        }
    }

    /// A motor that is built in the other way round has its left switch where positions are high.
    #[test]
    fn a_motor_may_be_built_in_the_other_way_round() {
        let text = "[stage]\nreversed = true\nleft = 500\nright = -500\nhard_left = -600\nhard_right = 600";
        assert_eq!(WorldConfig::parse(text).map(|world| world.every.stage.left), Ok(Some(500)));
        let error = WorldConfig::parse(&text.replace("right = -500", "right = -601")).unwrap_err();
        assert!(error.starts_with("line 4: stage.right: -601 is behind the hard end stage.hard_left"), "{error}");
    }

    #[test]
    fn what_a_board_does_not_have_is_not_around_it() {
        let error = WorldConfig::parse_for(&TMCM_3212, "[motor]\nstart = 1\n[encoder]\noffset = 5").unwrap_err();
        assert_eq!(error, "line 4: encoder.offset: the TMCM-3212 has no built-in encoder; leave it out");
        assert!(WorldConfig::parse("[encoder]\noffset = 5").is_ok());
    }

    /// Three axes on a board whose encoders have pins of their own.
    static THREE: BoardKind = BoardKind { name: "board of three", controllers: &[3], abn: AbnPins::Own, ..TMCM_1140 };

    #[test]
    fn the_table_of_an_axis_takes_the_place_of_what_holds_for_all_entry_by_entry() {
        let text = "
            seed = 3
            [motor]
            name = 'small'
            friction = 0.1
            start = 5
            [stage]
            left = -100
            [supply]
            volts = 30.0
            [[axis]]
            [[axis]]
            motor.start = 7
            stage.right = 200
            [axis.abn]
            lines = 512
            [axis.encoder]
            offset = 9
        ";
        let world = WorldConfig::parse_for(&THREE, text).unwrap();
        let common = AxisConfig {
            motor: MotorTable { name: "small".into(), friction: 0.1, start: 5, ..MotorTable::default() },
            stage: StageConfig { left: Some(-100), ..StageConfig::default() },
            ..AxisConfig::default()
        };
        assert_eq!((world.axis(0), world.axis(2), world.axis(9)), (&common, &common, &common));
        let second = AxisConfig {
            motor: MotorTable { start: 7, ..common.motor.clone() },
            stage: StageConfig { right: Some(200), ..common.stage.clone() },
            abn: Some(AbnConfig { lines: 512, index: 0 }),
            encoder: EncoderTable { offset: 9, noise: 0 },
        };
        assert_eq!(world.axis(1), &second);
        assert_eq!((world.seed, world.supply.volts), (3, 30.0));
    }

    #[test]
    fn a_file_without_tables_of_axes_is_the_same_for_each_axis() {
        let text = "[motor]\nstart = 4\n[abn]\nlines = 100\n[stage]\nleft = -9";
        let world = WorldConfig::parse_for(&THREE, text).unwrap();
        assert!((0..3).all(|axis| world.axis(axis).motor.start == 4 && world.axis(axis).abn.is_some()));
    }

    #[test]
    fn errors_in_the_table_of_an_axis_name_line_axis_and_entry() {
        let error = |text| WorldConfig::parse_for(&THREE, text).unwrap_err();
        let unknown = error("[[axis]]\n[[axis]]\n[axis.stage]\nlefft = 1");
        assert!(unknown.contains("line 4") && unknown.contains("lefft"), "{unknown}");
        let unknown = error("[[axis]]\n[axis.supply]\nvolts = 5.0");
        assert!(unknown.contains("line 2") && unknown.contains("supply"), "{unknown}");
        let kind = error("[[axis]]\nmotor.load = 'much'");
        assert!(kind.contains("line 2") && kind.contains("load"), "{kind}");
        assert_eq!(
            error("[motor]\nload = 0.5\n[[axis]]\n\n[[axis]]\nmotor.load = 1.5"),
            "line 6: axis 1: motor.load: 1.5 is not within 0 to 1"
        );
        // An entry that holds for all axes may contradict an entry of one axis.
        assert_eq!(
            error("[motor]\nstart = 5\n[[axis]]\nstage.hard_left = 6"),
            "line 2: axis 0: motor.start: the rotor cannot start at 5, below the hard end stage.hard_left (6)"
        );
        assert_eq!(
            error("\n[[axis]]\n[[axis]]\n[[axis]]\n[[axis]]\n[[axis]]"),
            "line 5: this is [[axis]] number 4, and the board of three has 3 axes"
        );
        assert_eq!(
            WorldConfig::parse("[[axis]]\nmotor.load = 0.5\n[[axis]]").unwrap_err(),
            "line 3: this is [[axis]] number 2, and the TMCM-1140 has one axis"
        );
        // An error in the common tables is found where an axis has no table of its own.
        assert_eq!(
            error("[motor]\nload = 2.0\n[[axis]]\nmotor.load = 0.5"),
            "line 2: motor.load: 2 is not within 0 to 1"
        );
    }

    #[test]
    fn an_encoder_needs_pins_for_it() {
        static NONE: BoardKind = BoardKind { abn: AbnPins::None, ..TMCM_1140 };
        let with_switch = "[abn]\nlines = 100\n[stage]\nleft = -9";
        assert!(WorldConfig::parse(with_switch).unwrap_err().contains("uses the pins of the switches"));
        assert!(WorldConfig::parse_for(&THREE, with_switch).is_ok());
        let error = WorldConfig::parse_for(&NONE, "[abn]\nlines = 100").unwrap_err();
        assert_eq!(error, "line 2: abn.lines: no ABN encoder can be connected to the TMCM-1140; leave out the table");
    }

    #[test]
    fn fractions_become_torque() {
        assert_eq!(torque(0.25), 16_384);
        assert_eq!(torque(1.0), FULL_TORQUE);
    }
}
