//! Orders for measurements: what is to be measured, and how.

use hal_sim::world::config::WorldConfig;

use super::track::Room;

/// The feature of the driver that is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The threshold of stallGuard2 (axis parameter 174), with which a stall can be told from a motor that turns.
    Stallguard,
    /// The settings of coolStep (axis parameters 168 to 172), with which the current (180) follows the load.
    Coolstep {
        /// The threshold of stallGuard2 (174) to measure with, -64 to 63; without it that which the module has.
        threshold: Option<i32>,
    },
}

impl What {
    /// The name of the feature.
    pub fn name(self) -> &'static str {
        match self {
            What::Stallguard => "stallGuard2",
            What::Coolstep { .. } => "coolStep",
        }
    }
}

/// The room that the motor has.
#[derive(Clone, Debug)]
pub enum Way {
    /// As much as the measurement needs, to the right.
    Any,
    /// So many microsteps from where it is: to the right, or to the left if it is negative.
    Microsteps(i32),
    /// The room of a world around a virtual module.
    World(Box<WorldConfig>),
}

/// An order for a measurement: what is to be measured, and how.
#[derive(Clone, Debug)]
pub struct Order {
    /// The feature that is measured.
    pub what: What,
    /// The axis.
    pub axis: u8,
    /// Speeds to measure at: numbers of the product, or with a unit, as in "60 rpm". Without any they are the half and
    /// the whole of the maximum positioning speed (axis parameter 4).
    pub speeds: Vec<String>,
    /// The room that the motor has.
    pub way: Way,
    /// Full steps per turn of the motor, 1 to 65535, for speeds in turns.
    pub steps: u16,
}

impl Order {
    /// The room on both sides of the motor, a full step of which has so many microsteps.
    pub(super) fn room(&self, microsteps: i32) -> Room {
        match &self.way {
            Way::Any => Room::default(),
            Way::Microsteps(way) => Room::named(*way),
            Way::World(world) => Room::of_world(world, self.axis.into(), microsteps.into()),
        }
    }
}
