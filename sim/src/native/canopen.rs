//! The CANopen firmware on a simulated board.

use tmcm::can::{CanFrame, Frame, Id};
use tmcm::canopen::{Filter, Filters, Node};
use tmcm::product::Tmcm1140Canopen;

use super::board::Simulated;
use super::firmware::{Insight, Simulable};

/// The CANopen firmware of the TMCM-1140.
pub(super) type Canopen = Node<Simulated<(), Tmcm1140Canopen>>;

impl Insight for Canopen {
    fn position(&self, axis: usize) -> Option<(i32, Option<i32>)> {
        let axis = self.axes().get(axis)?;
        Some((axis.last_position(), axis.target_position()))
    }

    fn accepts(&self, frame: &Frame, filters: &Filters) -> bool {
        let Id::Standard(id) = frame.id() else { return false };
        filters.contains(&Filter { id: id.as_raw(), remote: frame.is_remote_frame() })
    }

    fn is_addressed(&self, _: &Frame) -> bool {
        true
    }

    fn complaint(&self) -> Option<&'static str> {
        let unknown = self.address().is_none();
        unknown.then_some("CANopen: the node ID is unknown; 137 over USB starts node 1 with defaults")
    }
}

impl Simulable<1> for Canopen {}
