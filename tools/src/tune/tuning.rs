//! A measurement from its preparation to what was found.

use std::time::Duration;

use tmcm::param::AxisParameter as P;
use tmcm::tmcl::{Command, Opcode};
use tmcm::vm::ProgramState;

use super::bench::Bench;
use super::brake::Brake;
use super::drive::Drive;
use super::found::{Found, Measured};
use super::measurement::Measurement;
use super::order::{Order, What};
use super::plan::{Cruise, Setup};
use super::track::{Track, about};
use super::watch::Method;
use super::{coolstep, stallguard};
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::product::Product;
use crate::progress::Progress;
use crate::stop::Stop;

/// A measurement that has been prepared: nothing has moved yet, and nothing has changed.
pub struct Tuning<'a> {
    bench: Bench<'a>,
    order: &'a Order,
    setup: Setup,
    cruises: Vec<Cruise>,
    /// Parameter 6.
    current: i32,
    latency: Duration,
    track: Track,
}

impl<'a> Tuning<'a> {
    /// Prepares a measurement of an axis of `module`, which is a `product`. `reopen` opens its link anew when that is
    /// gone, if it can; `stop` says whether to end, at which the motor is stopped and the settings are put back.
    ///
    /// # Errors
    /// The module does not answer, its motor turns or may be moved by a program, or it has not the room or the speeds
    /// for this.
    pub fn prepare(
        module: Conversation,
        product: Product,
        order: &'a Order,
        reopen: &'a mut dyn FnMut() -> Option<Conversation>,
        stop: &'a dyn Stop,
    ) -> Result<Self, Failure> {
        let mut bench = Bench::new(module, reopen, stop, product, order.axis);
        check(&mut bench)?;
        let setup = Setup::read(&mut bench, order.steps)?;
        let cruises = setup.cruises(&order.speeds)?;
        let current = bench.get(P::MaximumCurrent)?;
        let latency = latency(&mut bench)?;
        let need = setup.need(&cruises, method(order.what, current), latency);
        let track = order.room(setup.microsteps).track(bench.get(P::ActualPosition)?, &need);
        if !track.is_enough(&need) {
            return Err(Failure::Failed(format!(
                "the motor needs {:.0} microsteps to reach its speed, be measured and stop, and has room for {:.0}: give it \
                 more with --room, or measure at lower speeds",
                need.least().ceil(),
                track.way()
            )));
        }
        Ok(Tuning { bench, order, setup, cruises, current, latency, track })
    }

    /// The announcement of what is going to happen, in a sentence: how far the motor goes, and for how long.
    pub fn announcement(&self) -> String {
        let Tuning { order, setup, track, latency, .. } = self;
        let method = method(order.what, self.current);
        let time = |cruise| setup.time(cruise, method, readings(order.what), track.way(), *latency);
        let turns = track.way() / f64::from(setup.microsteps) / f64::from(order.steps);
        let Track { low, high, home } = track;
        format!(
            "To measure {}, motor {} goes to and fro between {low} and {high}, which are {turns:.1} turns, for {}; it is at \
             {home} now and comes back.",
            order.what.name(),
            order.axis,
            about(self.cruises.iter().map(time).sum())
        )
    }

    /// Measures, with what loads the motor when that is wanted, and brings all back to how it was.
    ///
    /// # Errors
    /// The measurement fails, or it has been asked to end: the motor is stopped and the settings are put back, and what
    /// cannot be is told.
    pub fn measure(self, brake: &mut dyn Brake, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Found, Failure> {
        let Tuning { mut bench, order, setup, cruises, current, track, .. } = self;
        let total = readings(order.what) as usize * cruises.len();
        let drive = Drive::new(&mut bench, track, setup.microsteps);
        let mut measurement = Measurement::new(drive, cruises, brake, progress, order.what.name(), total);
        let measured = match order.what {
            What::Stallguard => stallguard::measure(&mut measurement).map(Measured::Stallguard),
            What::Coolstep { threshold } => coolstep::measure(&mut measurement, threshold, current)
                .map(|(speeds_tried, choice)| Measured::Coolstep { speeds_tried, choice, threshold, current }),
        };
        let load = measurement.load().to_owned();
        if measured.is_err() {
            brake.let_go();
        }
        let measured = match measured {
            Ok(measured) => bench.bring_back(track.home).map(|()| measured),
            Err(failure @ Failure::Failed(_)) if bench.answers() => {
                // Why the measurement has failed counts, and not why the motor does not come back: where it stands is
                // told.
                let _ = bench.bring_back(track.home);
                Err(failure)
            }
            Err(failure) => Err(failure),
        };
        let measured = put_back(&mut bench, &track, measured)?;
        Ok(Found { measured, product: bench.product, axis: order.axis, load, unit: setup.live.unit() })
    }
}

/// How a reading is made, with `current` in parameter 6.
fn method(what: What, current: i32) -> Method {
    match what {
        What::Stallguard => stallguard::METHOD,
        What::Coolstep { .. } => coolstep::method(current),
    }
}

/// Number of readings that are made about, of one speed.
fn readings(what: What) -> u32 {
    let (free, loaded) = match what {
        What::Stallguard => stallguard::READINGS,
        What::Coolstep { .. } => coolstep::READINGS,
    };
    free + loaded
}

/// Fails if the motor turns, or a program could move it.
fn check(bench: &mut Bench<'_>) -> Result<(), Failure> {
    let axis = bench.axis;
    if let Some(message) = bench.module.no_such_axis(axis)? {
        return Err(Failure::Failed(message));
    }
    if bench.get(P::ActualSpeed)? != 0 {
        return Err(Failure::Failed(format!("motor {axis} turns; stop it first, for example with \"MST {axis}\"")));
    }
    let ask = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);
    match bench.module.value(ask) {
        Ok(status) if status.to_be_bytes().first() == Some(&(ProgramState::Run as u8)) => Err(Failure::Failed(
            "a program runs in the module and could move the motor; stop it first, for example with 128, 0, 0, 0"
                .into(),
        )),
        Err(error) if !error.is_refusal() => Err(error.into()),
        _ => Ok(()),
    }
}

/// How long a sample takes: it is made of so many requests.
fn latency(bench: &mut Bench<'_>) -> Result<Duration, Failure> {
    const REQUESTS: u32 = 4;
    let begun = bench.module.time();
    for _ in 0..REQUESTS {
        bench.get(P::ActualSpeed)?;
    }
    Ok(bench.module.time().saturating_sub(begun))
}

/// Stops the motor and puts everything back. A failure is told with what the user has to know besides.
fn put_back<T>(bench: &mut Bench<'_>, track: &Track, found: Result<T, Failure>) -> Result<T, Failure> {
    let left = bench.restore();
    let also = if !left.is_empty() {
        let left: Vec<String> = left.iter().map(ToString::to_string).collect();
        format!(
            "the module could not be told to go back to how it was; when it answers again, send {}",
            left.join("; ")
        )
    } else {
        match bench.whereabouts() {
            Some(here) if here != track.home && !bench.is_simulated() => {
                let (axis, home) = (bench.axis, track.home);
                format!(
                    "all settings are as before, and the motor stands at {here}; MVP ABS, {axis}, {home} brings it back"
                )
            }
            _ => "all settings are as before".into(),
        }
    };
    match (found, left.is_empty()) {
        (Ok(found), true) => Ok(found),
        (Ok(_), false) => Err(Failure::Failed(also)),
        (Err(Failure::Failed(message)), _) => Err(Failure::Failed(format!("{message}; {also}"))),
        (Err(Failure::Interrupted { signal, .. }), _) => Err(Failure::Interrupted { signal, message: also }),
        (Err(failure), true) => Err(failure),
        (Err(_), false) => Err(Failure::Failed(also)),
    }
}
