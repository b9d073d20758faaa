//! The firmwares that run on this board.

use crate::board::boards::chosen::AXES;
use crate::board::stm32f4::can_link::CanLink;
use crate::board::stm32f4::can_node::NodeLink;
use crate::board::stm32f4::can_tmcl::TmclLink;
use crate::canopen::Node;
use crate::device::Circuit;
use crate::executor::Product;
use crate::firmware::OnBoard;
use crate::module::{Module, Platform};

/// A firmware, with what it takes of the board.
pub trait Runs: OnBoard<AXES> + 'static {
    /// The link by which the firmware uses the CAN controller.
    type Can: CanLink + 'static;

    /// Logs who has started.
    fn introduce(&self);
}

impl<T: Platform<Hooks: Default> + 'static> Runs for Module<T, AXES> {
    type Can = TmclLink;

    fn introduce(&self) {
        defmt::info!("module runs at address {=u8}", self.link_settings().address);
    }
}

/// A node has one axis, and so has its board.
impl<T: Circuit<Product: Product> + 'static> Runs for Node<T>
where
    Node<T>: OnBoard<AXES>,
{
    type Can = NodeLink;

    fn introduce(&self) {
        match self.address() {
            Some(address) => defmt::info!("CANopen node {=u8} at {=u16} kbit/s", address.node, address.bit_rate),
            None => defmt::error!("CANopen: the node ID is unknown; 137 over USB starts node 1 with defaults"),
        }
    }
}
