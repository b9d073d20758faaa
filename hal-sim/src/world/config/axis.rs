//! The tables of a world file that concern an axis: their entries and the ranges of these. Positions are in 1/256 full
//! steps.

use super::{torque, within};
use crate::board::kind::{AbnPins, BoardKind};
use crate::world::motor::{FULL_STEP, MotorConfig};
use crate::world::pin::Pin;
use serde::Deserialize;

/// The largest position that a world file may have, so that no sum overflows.
const FARTHEST: i64 = 1 << 40;

/// The surroundings of an axis. The default is a bare 200-step motor with nothing connected to the inputs.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AxisConfig {
    /// The motor.
    pub motor: MotorTable,
    /// The stage that the motor drives.
    pub stage: StageConfig,
    /// The ABN encoder, if there is one; on some boards it takes the place of the switches.
    pub abn: Option<AbnConfig>,
    /// The built-in magnetic encoder, where the board has one.
    pub encoder: EncoderTable,
}

impl AxisConfig {
    /// Number of units of position (1/256 full step) in a turn.
    pub fn units_per_turn(&self) -> i64 {
        i64::from(self.motor.steps_per_turn.max(1)) * FULL_STEP
    }

    /// The properties of the motor, with the hard ends of its stage.
    pub fn motor(&self) -> MotorConfig {
        MotorConfig {
            friction: torque(self.motor.friction),
            inertia: torque(self.motor.inertia),
            pull_in: self.motor.pull_in.max(1),
            lowest: self.stage.hard_left.unwrap_or(i64::MIN),
            highest: self.stage.hard_right.unwrap_or(i64::MAX),
        }
    }

    pub(super) fn check(&self, kind: &BoardKind) -> Result<(), String> {
        let motor = &self.motor;
        within("motor.steps_per_turn", motor.steps_per_turn, 4, 10_000)?;
        within("motor.load", motor.load, 0.0, 1.0)?;
        within("motor.friction", motor.friction, 0.0, 1.0)?;
        within("motor.inertia", motor.inertia, 0.0, 1.0)?;
        within("motor.pull_in", motor.pull_in, 1, 100_000)?;
        within("motor.stall_guard_noise", motor.stall_guard_noise, 0, 1023)?;
        let stage = &self.stage;
        let positions = [
            ("motor.start", Some(motor.start)),
            ("encoder.offset", Some(self.encoder.offset)),
            ("abn.index", self.abn.as_ref().map(|abn| abn.index)),
        ];
        for (name, position) in positions {
            if let Some(position) = position {
                within(name, position, -FARTHEST, FARTHEST)?;
            }
        }
        stage.check()?;
        let (lowest, highest) = (stage.hard_left.unwrap_or(-FARTHEST), stage.hard_right.unwrap_or(FARTHEST));
        within("motor.start", motor.start, lowest, highest)?;
        let Some(abn) = &self.abn else { return Ok(()) };
        within("abn.lines", abn.lines, 1, 100_000)?;
        let switches =
            stage.left.or(stage.right).is_some() || stage.home.is_some() || !stage.normally_closed.is_empty();
        match kind.abn {
            AbnPins::None => Err(format!("[abn]: nothing like it can be connected to the {}", kind.name)),
            AbnPins::Switches if switches => {
                Err("[abn] uses the pins of the switches: leave out stage.left, stage.right, stage.home and \
                     stage.normally_closed, or [abn]"
                    .into())
            }
            AbnPins::Switches | AbnPins::Own => Ok(()),
        }
    }
}

/// Table `[motor]`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MotorTable {
    /// The name of the motor, only for readers.
    pub name: String,
    /// Full steps in a turn, 4..=10000; 200 by default.
    pub steps_per_turn: u32,
    /// Position of the rotor at the start, in 1/256 full steps, 0 by default.
    pub start: i64,
    /// External load as a fraction of the torque at full current, 0.0..=1.0, 0 by default.
    pub load: f64,
    /// Friction as a fraction of the torque at full current, 0.0..=1.0, 0 by default.
    pub friction: f64,
    /// Fraction of the torque at full current that an acceleration of 1000 full steps/s^2 takes,
    /// 0.0..=1.0, 0 by default.
    pub inertia: f64,
    /// Speed in full steps per second up to which a stalled rotor falls in again, 1..=100000, 200 by
    /// default.
    pub pull_in: u32,
    /// Amplitude of the noise on the stallGuard2 reading, 0..=1023, 0 by default.
    pub stall_guard_noise: u32,
}

impl Default for MotorTable {
    fn default() -> Self {
        Self {
            name: "200-step motor".into(),
            steps_per_turn: 200,
            start: 0,
            load: 0.0,
            friction: 0.0,
            inertia: 0.0,
            pull_in: MotorConfig::default().pull_in,
            stall_guard_noise: 0,
        }
    }
}

/// Table `[stage]`: positions in 1/256 full steps on the rotor's scale. A switch or end that is left out does not
/// exist.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct StageConfig {
    /// The position at which the left stop switch closes on the way down; without a width it is closed everywhere
    /// below.
    pub left: Option<i64>,
    /// Number of positions that keep the left switch closed, 1 or more: from `left - left_width + 1` to `left`, both
    /// included.
    pub left_width: Option<i64>,
    /// The position at which the right stop switch closes on the way up; without a width it is closed everywhere above.
    pub right: Option<i64>,
    /// Number of positions that keep the right switch closed, 1 or more: from `right` to `right + right_width - 1`,
    /// both included.
    pub right_width: Option<i64>,
    /// The home switch is closed from the first to the second position, both included.
    pub home: Option<[i64; 2]>,
    /// The switches that are normally closed: their pins are low while they are pressed, and high otherwise.
    pub normally_closed: Vec<Pin>,
    /// How far beyond the position at which a switch closes it opens again, on both sides; 0 by default.
    pub hysteresis: i64,
    /// Length of the circle of a rotary stage: each switch repeats after so many units, in both directions. Then every
    /// switch needs a width, and there are no hard ends.
    pub circle: Option<i64>,
    /// The lowest position that the stage can reach, at which it is blocked.
    pub hard_left: Option<i64>,
    /// The highest position that the stage can reach, at which it is blocked.
    pub hard_right: Option<i64>,
}

impl StageConfig {
    fn check(&self) -> Result<(), String> {
        let positions = [
            ("stage.left", self.left),
            ("stage.right", self.right),
            ("stage.home", self.home.map(|[from, _]| from)),
            ("stage.home", self.home.map(|[_, to]| to)),
            ("stage.hard_left", self.hard_left),
            ("stage.hard_right", self.hard_right),
        ];
        for (name, position) in positions {
            if let Some(position) = position {
                within(name, position, -FARTHEST, FARTHEST)?;
            }
        }
        if let Some([from, to]) = self.home
            && from > to
        {
            return Err(format!("stage.home: {from} is above {to}; give the lower position first"));
        }
        within("stage.hysteresis", self.hysteresis, 0, FARTHEST)?;
        let end_switches = [("stage.left", self.left, self.left_width), ("stage.right", self.right, self.right_width)];
        for (name, position, width) in end_switches {
            if let Some(width) = width {
                within(&format!("{name}_width"), width, 1, FARTHEST)?;
                if position.is_none() {
                    return Err(format!("{name}_width: there is no {name}"));
                }
            }
            if self.circle.is_some() && position.is_some() && width.is_none() {
                return Err(format!("{name}: on a rotary stage (stage.circle) it needs {name}_width"));
            }
        }
        if let Some(circle) = self.circle {
            within("stage.circle", circle, 2, FARTHEST)?;
            if self.hard_left.or(self.hard_right).is_some() {
                return Err("stage.circle: a rotary stage has no hard ends; leave out stage.hard_left and \
                     stage.hard_right, or stage.circle"
                    .into());
            }
            let home = self.home.map(|[from, to]| to - from + 1);
            let widths =
                [("stage.left_width", self.left_width), ("stage.right_width", self.right_width), ("stage.home", home)];
            for (name, width) in widths {
                let width = width.unwrap_or(1) + 2 * self.hysteresis;
                if width >= circle {
                    return Err(format!(
                        "{name}: with the hysteresis it takes {width} of the {circle} units of a circle"
                    ));
                }
            }
        }
        let (lowest, highest) = (self.hard_left.unwrap_or(-FARTHEST), self.hard_right.unwrap_or(FARTHEST));
        if lowest >= highest {
            return Err(format!("stage.hard_left: {lowest} is not below stage.hard_right ({highest})"));
        }
        Ok(())
    }
}

/// Table `[abn]`: an encoder on the motor's shaft.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AbnConfig {
    /// Number of lines per turn, 1..=100000, which must be given. The encoder counts four times as many.
    pub lines: u32,
    /// Position of the rotor, in 1/256 full steps, at which the null track is high, once a turn.
    pub index: i64,
}

impl AbnConfig {
    /// Quadrature counts in a turn.
    pub fn counts_per_turn(&self) -> i64 {
        i64::from(self.lines.max(1)) * 4
    }
}

/// Table `[encoder]`: the built-in magnetic encoder.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct EncoderTable {
    /// Position of the rotor, in 1/256 full steps, at which the sensor reads zero.
    pub offset: i64,
}
