//! The results of a measurement: as a text with tables and proposals, and as curves.

use std::fmt::{self, Write};

use super::coolstep::{self, AtSpeed, Choice};
use super::plot;
use super::proposal::{self, Proposal};
use super::stallguard::{self, Curve};
use super::table;
use crate::product::{Product, axis_number};

/// The values that were measured.
pub(super) enum Measured {
    /// The load value over the threshold of stallGuard2.
    Stallguard(Vec<Curve>),
    /// The current over the settings of coolStep.
    Coolstep {
        /// The values that were measured, for each speed.
        speeds_tried: Vec<AtSpeed>,
        /// The settings that were chosen.
        choice: Choice,
        /// The threshold of stallGuard2 that the user has named.
        threshold: Option<i32>,
        /// Parameter 6.
        current: i32,
    },
}

/// The results of a measurement, and the axis that was measured.
pub struct Found {
    pub(super) measured: Measured,
    pub(super) product: Product,
    pub(super) axis: u8,
    /// The load of the motor, in words.
    pub(super) load: String,
    /// The unit of its speeds.
    pub(super) unit: &'static str,
}

impl Found {
    /// The settings that are proposed, or why none can be, for the user.
    pub fn proposals(&self) -> Result<Vec<Proposal>, String> {
        let Found { measured, product, axis, unit, .. } = self;
        let number = |parameter| axis_number(Some(*product), parameter);
        match measured {
            Measured::Stallguard(curves) => {
                stallguard::propose(curves, *axis, unit, |parameter| number(parameter).unwrap_or_default())
            }
            Measured::Coolstep { speeds_tried, choice, threshold, current } => {
                Ok(coolstep::propose(speeds_tried, *choice, *threshold, *current, *axis, unit, number))
            }
        }
    }

    /// The tables of what was measured, and behind them what is proposed, in lines of at most so many columns as far as
    /// words allow it.
    pub fn text(&self, columns: usize) -> String {
        let mut text = String::new();
        // Writing to a string cannot fail.
        let _ = self.write(&mut text, columns);
        text
    }

    fn write(&self, out: &mut String, columns: usize) -> fmt::Result {
        let Found { measured, product, axis, load, .. } = self;
        let name = product.name();
        match measured {
            Measured::Stallguard(curves) => {
                for curve in curves {
                    let speed = &curve.cruise.name;
                    let title = format!("Axis {axis} of a {name} at {speed}, {load}: value 206 by threshold 174");
                    table::text(out, &title, columns)?;
                    table::curve(out, curve, columns)?;
                    writeln!(out)?;
                }
            }
            Measured::Coolstep { speeds_tried, .. } => {
                for at_speed in speeds_tried {
                    let speed = &at_speed.cruise.name;
                    let title = format!("Axis {axis} of a {name} at {speed}, {load}: current 180, value 206");
                    table::text(out, &title, columns)?;
                    table::at_speed(out, at_speed, columns)?;
                    writeln!(out)?;
                }
            }
        }
        self.proposals().map_or(Ok(()), |proposals| proposal::write(out, &proposals, columns))
    }

    /// The curves as an SVG image.
    pub fn svg(&self) -> String {
        let Found { measured, product, axis, load, .. } = self;
        let title = |what: &str| format!("{what} of axis {axis} of a {}, {load}", product.name());
        match measured {
            Measured::Stallguard(curves) => plot::curves(&title("stallGuard2"), curves),
            Measured::Coolstep { speeds_tried, .. } => plot::speeds_tried(&title("coolStep"), speeds_tried),
        }
    }
}
