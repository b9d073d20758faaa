//! The control port of a virtual module, by which its motor is loaded.

use std::time::Duration;

use serde_json::{Map, Value};
use tmcl_tools::failure::Failure;
use tmcl_tools::tune::{Brake, Drive, careful, in_words};

use crate::world::Port;

/// Longest wait for an answer of a control port.
const PATIENCE: Duration = Duration::from_secs(5);

/// The control port of `tmcl sim`, where a load is a fraction of the torque at full current.
pub(super) struct ControlPort {
    port: Port,
    /// The number of the axis.
    axis: usize,
    /// The load that the user has named.
    load: Option<f64>,
    /// The load that was there before.
    before: f64,
}

impl ControlPort {
    /// The control port at an address, to load an axis so, or else as most motors can bear it.
    pub(super) fn connect(address: &str, axis: u8, load: Option<f64>) -> Result<Self, crate::failure::Failure> {
        let mut port = ControlPort { port: Port::connect(address, PATIENCE)?, axis: axis.into(), load, before: 0.0 };
        port.before = port.state()?.get("load").and_then(Value::as_f64).unwrap_or_default();
        Ok(port)
    }

    /// Sends a command that has to be carried out, and returns the answer.
    fn send(&mut self, command: &str) -> Result<Map<String, Value>, Failure> {
        let (_, answer) = self.port.ask(command).map_err(|failure| Failure::Failed(format!("--control: {failure}")))?;
        match answer.get("error").and_then(Value::as_str) {
            Some(why) => Err(Failure::Failed(format!("--control: {command}: {why}"))),
            None => Ok(answer),
        }
    }

    /// The state of the axis.
    fn state(&mut self) -> Result<Value, Failure> {
        let (state, axis) = (self.send("state")?, self.axis);
        let found = state.get("axes").and_then(|axes| axes.get(axis)).cloned();
        found.ok_or_else(|| Failure::Failed(format!("--control: the module there has no axis {axis}")))
    }

    fn put_back(&mut self) -> Result<(), Failure> {
        let (before, axis) = (self.before, self.axis);
        self.send(&format!("load {before} {axis}")).map(|_| ())
    }
}

impl Brake for ControlPort {
    fn hold(&mut self, _: &mut Drive<'_, '_>) -> Result<String, Failure> {
        let (state, axis) = (self.state()?, self.axis);
        let current = state.get("current").and_then(Value::as_f64).unwrap_or_default();
        let load = self.load.unwrap_or(careful(current));
        self.send(&format!("load {load:.4} {axis}"))?;
        Ok(in_words(load))
    }

    fn release(&mut self, _: &mut Drive<'_, '_>) -> Result<(), Failure> {
        self.put_back()
    }

    fn lost(&mut self, _: &mut Drive<'_, '_>) -> Result<i64, Failure> {
        Ok(self.state()?.get("lost_steps").and_then(Value::as_i64).unwrap_or_default())
    }

    fn let_go(&mut self) {
        // A port that is gone has no module to load.
        let _ = self.put_back();
    }
}
