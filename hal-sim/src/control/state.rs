//! The state of a board, as the control protocol tells it.

use crate::board::Board;
use crate::fault::CanState;
use crate::world::pin::Pin;
use serde::Serialize;

/// The state of a board, as `state` tells it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct State {
    /// Virtual time in microseconds.
    pub time_us: u64,
    /// Whether the board has power.
    pub power: bool,
    /// Axis 0, whose fields stand beside those of the board.
    #[serde(flatten)]
    pub first: AxisState,
    /// Levels of the digital inputs, IN0 and up.
    pub inputs: Vec<bool>,
    /// Level of the ENABLE input; left out where the board has none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub enable: Option<bool>,
    /// Reading of the first analog input, 0..=4095.
    pub analog: u16,
    /// Readings of all analog inputs, in the order of their numbers.
    pub analogs: Vec<u16>,
    /// Outputs, OUT0 and up.
    pub outputs: Vec<bool>,
    /// Whether the first group of the inputs' pull-ups is on.
    pub pull_ups: bool,
    /// Whether they are on, group by group.
    pub pull_up_groups: Vec<bool>,
    /// LED1 and LED2.
    pub leds: [bool; 2],
    /// The CAN controller.
    pub can: CanState,
    /// Supply voltage in volts.
    pub supply: f64,
    /// Temperature in degrees Celsius.
    pub temperature: i32,
    /// All axes, axis 0 first.
    pub axes: Vec<AxisState>,
}

/// The state of an axis, as `state` tells it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AxisState {
    /// The position in the motion controller, X_ACTUAL or XACTUAL, in microsteps.
    pub position: i32,
    /// The velocity in the motion controller, V_ACTUAL or VACTUAL, in its internal unit.
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
    /// Load on the motor: a torque as a fraction of that of the motor at full current, 0.0..=1.0.
    pub load: f64,
    /// The switches.
    pub switches: Switches,
    /// Built-in encoder, 0..=1023.
    pub encoder: u16,
    /// Counts of an ABN encoder.
    pub abn: i64,
}

/// The levels of the switches' pins: true (high) is pressed, but released for a normally closed switch.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Switches {
    /// The left stop switch.
    pub left: bool,
    /// The right one.
    pub right: bool,
    /// The home switch.
    pub home: bool,
}

impl State {
    /// The state of `board` now.
    pub fn of(board: &Board) -> Self {
        let (world, kind) = (board.world(), board.kind());
        let outputs = world.outputs();
        let bits = |word: u32, count: u32| (0..count).map(|number| word >> number & 1 != 0).collect();
        let pull_up_groups: Vec<bool> = bits(outputs.pull_ups, kind.pull_ups);
        Self {
            time_us: board.now() / crate::clock::MICROSECOND,
            power: board.is_powered(),
            first: AxisState::of(board, 0),
            inputs: bits(world.inputs(), kind.inputs.len() as u32),
            enable: kind.enable_input.map(|number| world.inputs() >> number & 1 != 0),
            analog: world.analog().first().copied().unwrap_or_default(),
            analogs: world.analog().to_vec(),
            outputs: bits(outputs.digital, kind.outputs),
            pull_ups: pull_up_groups.first().copied().unwrap_or_default(),
            pull_up_groups,
            leds: outputs.leds,
            can: board.can(),
            supply: f64::from(world.supply()) / 10.0,
            temperature: world.temperature(),
            axes: (0..kind.axes()).map(|axis| AxisState::of(board, axis)).collect(),
        }
    }
}

impl AxisState {
    fn of(board: &Board, axis: usize) -> Self {
        let (world, inputs, chips) = (board.world().axis(axis), board.axis_inputs(axis), board.observe(axis));
        let motor = world.motor();
        Self {
            position: chips.position,
            velocity: chips.velocity,
            rotor: motor.rotor(),
            field: motor.field(),
            lost_steps: motor.lost_steps(),
            bridges_on: chips.bridges_on,
            current: chips.current,
            stall_guard: chips.stall_guard,
            load: motor.load_told(),
            switches: Switches {
                left: world.level(Pin::Left),
                right: world.level(Pin::Right),
                home: world.level(Pin::Home),
            },
            encoder: inputs.encoder.unwrap_or_default(),
            abn: inputs.abn.count,
        }
    }
}
