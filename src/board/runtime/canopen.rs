//! The CANopen firmware on a board, which has one axis.

use super::runs::Runs;
use crate::board::boards::chosen::AXES;
use crate::board::stm32f4::can_node::NodeLink;
use crate::canopen::Node;
use crate::device::Board;
use crate::executor::Product;
use crate::firmware::OnBoard;

impl<T: Board<Product: Product> + 'static> Runs for Node<T>
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
