//! The tables of a world file that concern an axis: their entries and the ranges of these. Positions are in 1/256 full
//! steps.

use super::stage::StageConfig;
use super::torque;
use super::wrong::{FARTHEST, Wrong, within};
use crate::board::kind::{AbnPins, BoardKind};
use crate::chip::load::Response;
use crate::world::motor::{FULL_STEP, MotorConfig, Winding};
use serde::Deserialize;

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

    /// The properties of the motor on a board, with the hard ends of its stage.
    pub fn motor(&self, kind: &BoardKind) -> MotorConfig {
        MotorConfig {
            friction: torque(self.motor.friction),
            inertia: torque(self.motor.inertia),
            winding: self.motor.winding(kind),
            drag: torque(self.motor.drag),
            pull_in: self.motor.pull_in.max(1),
            lowest: self.stage.hard_left.unwrap_or(i64::MIN),
            highest: self.stage.hard_right.unwrap_or(i64::MAX),
        }
    }

    pub(super) fn check(&self, kind: &BoardKind) -> Result<(), Wrong> {
        let motor = &self.motor;
        within(&["motor.steps_per_turn"], motor.steps_per_turn, 4, 10_000)?;
        within(&["motor.start"], motor.start, -FARTHEST, FARTHEST)?;
        within(&["motor.load"], motor.load, 0.0, 1.0)?;
        within(&["motor.friction"], motor.friction, 0.0, 1.0)?;
        within(&["motor.inertia"], motor.inertia, 0.0, 1.0)?;
        within(&["motor.resistance"], motor.resistance, 0.01, 1_000.0)?;
        within(&["motor.inductance"], motor.inductance, 0.0, 1_000.0)?;
        within(&["motor.holding_torque"], motor.holding_torque, 0.001, 100.0)?;
        within(&["motor.rated_current"], motor.rated_current, 0.01, 100.0)?;
        within(&["motor.drag"], motor.drag, 0.0, 1.0)?;
        within(&["motor.pull_in"], motor.pull_in, 1, 100_000)?;
        within(&["motor.stall_guard_noise"], motor.stall_guard_noise, 0, 1023)?;
        within(&["motor.stall_guard_zero"], motor.stall_guard_zero, -64, 63)?;
        within(&["motor.stall_guard_span"], motor.stall_guard_span, 1, 1023)?;
        within(&["motor.stall_guard_speed"], motor.stall_guard_speed, 0, 100_000)?;
        self.stage.check()?;
        self.check_start()?;
        within(&["encoder.offset"], self.encoder.offset, -FARTHEST, FARTHEST)?;
        within(&["encoder.noise"], self.encoder.noise, 0, 511)?;
        if self.encoder != EncoderTable::default() && !kind.magnetic_encoders {
            let why = format!("the {} has no built-in encoder; leave it out", kind.name);
            return Err(Wrong::new(&["encoder.offset", "encoder.noise"], why));
        }
        self.abn.as_ref().map_or(Ok(()), |abn| self.check_abn(abn, kind))
    }

    /// The rotor has to start between the hard ends.
    fn check_start(&self) -> Result<(), Wrong> {
        let start = self.motor.start;
        let StageConfig { hard_left, hard_right, .. } = self.stage;
        // A start that is not in the file is 0, and the hard end is what can be found there.
        let (entries, side, end): (&'static [&'static str; 2], _, _) = match (hard_left, hard_right) {
            (Some(end), _) if start < end => (&["motor.start", "stage.hard_left"], "below", end),
            (_, Some(end)) if start > end => (&["motor.start", "stage.hard_right"], "above", end),
            _ => return Ok(()),
        };
        let why = format!("the rotor cannot start at {start}, {side} the hard end {} ({end})", entries[1]);
        Err(Wrong::new(entries, why))
    }

    fn check_abn(&self, abn: &AbnConfig, kind: &BoardKind) -> Result<(), Wrong> {
        let entries = &["abn.lines", "abn.index", "abn"];
        within(&["abn.index"], abn.index, -FARTHEST, FARTHEST)?;
        if kind.abn == AbnPins::None {
            let why = format!("no ABN encoder can be connected to the {}; leave out the table", kind.name);
            return Err(Wrong::new(entries, why));
        }
        if abn.lines == 0 {
            return Err(Wrong::new(entries, "an encoder has 1 to 100000 lines; give abn.lines".into()));
        }
        within(&["abn.lines"], abn.lines, 1, 100_000)?;
        let stage = &self.stage;
        let switches =
            stage.left.or(stage.right).is_some() || stage.home.is_some() || !stage.normally_closed.is_empty();
        if kind.abn == AbnPins::Switches && switches {
            let why = "it uses the pins of the switches: leave out stage.left, stage.right, stage.home and \
                       stage.normally_closed, or [abn]";
            return Err(Wrong::new(entries, why.into()));
        }
        Ok(())
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
    /// External load: a torque as a fraction of that of the motor at full current, 0.0..=1.0, 0 by default. 1.0 stalls
    /// the motor at full current; with less current less does.
    pub load: f64,
    /// Friction as a fraction of the torque at full current, 0.0..=1.0, 0 by default.
    pub friction: f64,
    /// Fraction of the torque at full current that an acceleration of 1000 full steps/s^2 takes,
    /// 0.0..=1.0, 0 by default.
    pub inertia: f64,
    /// Resistance of a phase in ohms, 0.01..=1000, 1.4 by default.
    pub resistance: f64,
    /// Inductance of a phase in millihenries, 0.0..=1000, 3 by default. 0 is a motor that has all of its torque at any
    /// speed, and no drag.
    pub inductance: f64,
    /// Torque in newton metres that the motor holds with the rated current in both phases, 0.001..=100, 0.59 by
    /// default. With the rated current it says how much back-EMF there is.
    pub holding_torque: f64,
    /// Rated current of a phase in amperes, 0.01..=100, 2 by default.
    pub rated_current: f64,
    /// Fraction of the torque at full current that a speed of 1000 full steps/s takes, and twice as much at twice the
    /// speed. It is lost in bearings and iron. The range is 0.0..=1.0; it is 0.012 by default.
    pub drag: f64,
    /// Speed in full steps per second up to which a stalled rotor falls in again, 1..=100000, 200 by
    /// default.
    pub pull_in: u32,
    /// Amplitude of the noise on the stallGuard2 reading, 0..=1023, 0 by default.
    pub stall_guard_noise: u32,
    /// The stallGuard2 threshold at which the reading is zero exactly where the motor stalls, -64..=63, 5 by default.
    pub stall_guard_zero: i32,
    /// By how much the reading of a motor with its whole torque in reserve is above that, 1..=1023, 512 by default.
    pub stall_guard_span: u32,
    /// Speed in full steps per second below which this difference falls in proportion to the speed, 0..=100000. The
    /// default, 0, is a motor that has all of it at any speed.
    pub stall_guard_speed: u32,
}

impl MotorTable {
    /// The winding at the driver of a board; `None` if the motor has no inductance.
    fn winding(&self, kind: &BoardKind) -> Option<Winding> {
        let phase = [self.resistance, self.inductance / 1_000.0];
        let torque = (self.holding_torque, self.rated_current);
        let winding =
            || Winding::of_data_sheet(phase, torque, self.steps_per_turn, f64::from(kind.full_current) / 1_000.0);
        (self.inductance > 0.0).then(winding)
    }

    /// Gives the response of stallGuard2 to the load on this motor.
    pub fn response(&self) -> Response {
        Response {
            zero: self.stall_guard_zero,
            span: self.stall_guard_span,
            speed: self.stall_guard_speed,
            noise: self.stall_guard_noise,
        }
    }
}

impl Default for MotorTable {
    fn default() -> Self {
        let usual = Response::default();
        Self {
            name: "200-step motor".into(),
            steps_per_turn: 200,
            start: 0,
            load: 0.0,
            friction: 0.0,
            inertia: 0.0,
            // A NEMA 17 that can be bought: StepperOnline 17HS19-2004S1, 1.8 degrees, 2 A, 1.4 ohms, 3.0 mH, 59 Ncm.
            resistance: 1.4,
            inductance: 3.0,
            holding_torque: 0.59,
            rated_current: 2.0,
            // Its data sheet has no word on that. With this much it gives up without a load at 3500 rpm, by 24 V and at
            // the full current of a TMCM-1140.
            drag: 0.012,
            pull_in: MotorConfig::default().pull_in,
            stall_guard_noise: usual.noise,
            stall_guard_zero: usual.zero,
            stall_guard_span: usual.span,
            stall_guard_speed: usual.speed,
        }
    }
}

/// Table `[abn]`: an encoder on the motor's shaft.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct AbnConfig {
    /// Number of lines per turn, 1..=100000, which has to be given. The encoder counts four times as many.
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
    /// By how many counts of 1024 in a turn a reading is off at most, 0..=511, 0 by default: in each millisecond by
    /// another number.
    pub noise: u32,
}
