//! The TMCL firmware on a simulated board.

use std::task::Poll;

use tmcm::can::Frame;
use tmcm::canopen::Filters;
use tmcm::device::Outputs;
use tmcm::module::{Module, Product, Source};
use tmcm::tmcl::{Command, Reply, Status, can};
use tmcm::units::Micros;
use tmcm::vm::Machine;

use super::board::{Simulated, Wired};
use super::firmware::{Insight, Simulable};
use super::peek;
use crate::tracer::Tracer;

/// The TMCL firmware of product `P` with `N` motion controllers.
pub(super) type Tmcl<P, const AXES: usize, const N: usize> = Module<Simulated<Tracer, P, N>, AXES>;

impl<P: Wired + Product, const AXES: usize, const N: usize> Insight for Tmcl<P, AXES, N> {
    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        let axis = self.axes().get(axis)?;
        Some((axis.last_position(), axis.target_position()))
    }

    /// The firmware looks through what is sent to others as well.
    fn accepts(&self, frame: &Frame, _: &Filters) -> bool {
        can::decode(frame).is_some()
    }

    fn is_addressed(&self, frame: &Frame) -> bool {
        let settings = self.link_settings();
        let own = [Some(settings.can_id), settings.can_secondary];
        can::decode(frame).is_some_and(|request| own.contains(&Some(request.id)))
    }

    fn subscriber(&self) -> Option<(Source, u32)> {
        self.subscriber()
    }

    fn machine(&self) -> Option<&Machine> {
        Some(self.machine())
    }

    fn read(&mut self, now: Micros, command: Command) -> Option<i32> {
        match self.execute(now, Source::Usb, command) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => Some(value),
            _ => None,
        }
    }

    fn peek(&mut self, now: Micros, command: Command) -> Result<i32, String> {
        peek::check(P::SPEC, command)?;
        let refused = |status: Status| format!("the module does not read this: {}", status.meaning());
        self.peek(now, command).map_err(refused)
    }

    fn tracer(&mut self) -> Option<&mut Tracer> {
        Some(self.hooks())
    }
}

impl<P: Wired + Product, const AXES: usize, const N: usize> Simulable<AXES> for Tmcl<P, AXES, N> {
    const ROTATION: u32 = Self::ROTATION;
    const FRESH: u32 = Self::FRESH;

    fn calm(&self) -> Option<(Micros, [u32; AXES])> {
        self.calm()
    }

    fn pass(&mut self, rotations: u32) -> Outputs {
        self.pass(rotations)
    }
}
