//! What was found, and how it is shown: tables, proposals and curves.

use std::io::Write;

use tmcl_tools::product::{Product, axis_number};

use super::coolstep::{self, AtSpeed, Choice};
use super::plot;
use super::proposal;
use super::stallguard::{self, Curve};
use super::table;
use crate::failure::Failure;
use crate::output::Output;
use crate::tell;
use crate::terminal;

/// What was found.
pub(super) enum Found {
    /// The load value over the threshold of stallGuard2.
    Stallguard(Vec<Curve>),
    /// The current over the settings of coolStep.
    Coolstep {
        /// What was measured, for each speed.
        speeds_tried: Vec<AtSpeed>,
        /// What was chosen.
        choice: Choice,
        /// The threshold of stallGuard2 that the user has named.
        threshold: Option<i32>,
        /// Parameter 6.
        current: i32,
    },
}

/// What it was found of.
pub(super) struct Subject {
    pub(super) product: Product,
    pub(super) axis: u8,
    /// What the motor was loaded with, in words.
    pub(super) load: String,
    /// The unit of its speeds.
    pub(super) unit: &'static str,
}

impl Found {
    /// Shows it on standard output, and draws it. Where the image goes to standard output, the rest goes to standard error.
    pub(super) fn show(&self, subject: &Subject, plot: Option<Output>) -> Result<(), Failure> {
        let columns = terminal::columns();
        let Subject { product, axis, load, unit } = subject;
        let (name, axis) = (product.name(), *axis);
        let mut out = Vec::new();
        let (proposals, drawn) = match self {
            Found::Stallguard(curves) => {
                for curve in curves {
                    let speed = &curve.cruise.name;
                    let title = format!("Axis {axis} of a {name} at {speed}, {load}: value 206 by threshold 174");
                    table::text(&mut out, &title, columns)?;
                    table::curve(&mut out, curve, columns)?;
                    writeln!(out)?;
                }
                let number = |parameter| axis_number(Some(*product), parameter).unwrap_or_default();
                let title = format!("stallGuard2 of axis {axis} of a {name}, {load}");
                (stallguard::propose(curves, axis, unit, number), plot::curves(&title, curves))
            }
            Found::Coolstep { speeds_tried, choice, threshold, current } => {
                for at_speed in speeds_tried {
                    let speed = &at_speed.cruise.name;
                    let title = format!("Axis {axis} of a {name} at {speed}, {load}: current 180, value 206");
                    table::text(&mut out, &title, columns)?;
                    table::at_speed(&mut out, at_speed, columns)?;
                    writeln!(out)?;
                }
                let number = |parameter| axis_number(Some(*product), parameter);
                let title = format!("coolStep of axis {axis} of a {name}, {load}");
                let proposals = coolstep::propose(speeds_tried, *choice, *threshold, *current, axis, unit, number);
                (Ok(proposals), plot::speeds_tried(&title, speeds_tried))
            }
        };
        if let Ok(proposals) = &proposals {
            proposal::write(&mut out, proposals, columns)?;
        }
        match plot.as_ref().is_some_and(Output::is_standard) {
            // A closed standard error does not keep the image from being drawn.
            true => tell::err().write_all(&out).unwrap_or_default(),
            false => tell::out().write_all(&out).and_then(|()| tell::out().flush())?,
        }
        if let Some(mut plot) = plot {
            plot.write_all(drawn.as_bytes())?;
            plot.finish()?;
        }
        proposals.map(|_| ()).map_err(Failure::Failed)
    }
}
