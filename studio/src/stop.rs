//! What stops all motors of a module: MST for each axis, and command 128, which stops a program that may move them again.

use tmcl_tools::product;
use tmcm::tmcl::{Command, Opcode};
use tmcm_sim::Product;

use crate::types::{Axes, Moved, Request, Requests};

/// The product of this short name, if there is one.
pub(crate) fn known(product: Option<&str>) -> Option<Product> {
    product.and_then(|name| product::named(name).ok())
}

/// The axes of a product; of an unknown one as many as the largest known one has, because it refuses those that it has not.
pub(crate) fn axes(product: Option<Product>) -> u8 {
    match product {
        Some(product) => product.spec().axes,
        None => Product::ALL.into_iter().map(|product| product.spec().axes).max().unwrap_or(1),
    }
}

/// The requests that stop a module. The program comes first: it could set off again what has just been stopped.
pub fn requests(Axes { address, product }: &Axes) -> Requests {
    let program = Command::new(Opcode::StopApplication as u8, 0, 0, 0);
    let motors = (0..axes(known(product.as_deref()))).map(|axis| Command::new(Opcode::Mst as u8, 0, axis, 0));
    let requests = std::iter::once(program).chain(motors).map(|command| Request::new(*address, command));
    Requests { requests: requests.collect() }
}

/// The requests that stop what a request sets in motion; none for one that moves nothing.
pub fn requests_after(Moved { request, product }: &Moved) -> Requests {
    let axis = request.motor;
    let stop = || Request::new(request.address, Command::new(Opcode::Mst as u8, 0, axis, 0));
    match Opcode::from_number(request.opcode) {
        Some(Opcode::Ror | Opcode::Rol | Opcode::Mvp | Opcode::Rfs) => Requests { requests: vec![stop()] },
        // Whatever has been written: a target, a speed, or a setting that makes no difference to a motor that stands.
        Some(Opcode::Sap) => Requests { requests: vec![stop()] },
        Some(Opcode::RunApplication | Opcode::StepApplication) => {
            requests(&Axes { address: request.address, product: product.clone() })
        }
        _ => Requests { requests: Vec::new() },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_moves_is_stopped() {
        let stops = |command| {
            let moved = Moved { request: Request::new(1, command), product: Some("3110".into()) };
            requests_after(&moved).requests.iter().map(|request| request.command().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(stops(Command::new(1, 0, 2, 500)), ["MST 2"]);
        assert_eq!(stops(Command::new(4, 1, 1, 500)), ["MST 1"]);
        assert_eq!(stops(Command::new(129, 0, 0, 0)), ["128, 0, 0, 0", "MST 0", "MST 1", "MST 2"]);
        assert!(stops(Command::new(6, 1, 0, 0)).is_empty() && stops(Command::new(3, 0, 0, 0)).is_empty());
    }

    #[test]
    fn every_axis_is_stopped() {
        let stops = |product: Option<&str>| {
            let axes = Axes { address: 3, product: product.map(String::from) };
            let all = requests(&axes).requests;
            assert!(all.iter().all(|request| request.address == 3));
            all.iter().map(|request| request.command().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(stops(Some("1140")), ["128, 0, 0, 0", "MST 0"]);
        assert_eq!(stops(Some("6110")).len(), 7);
        assert_eq!(stops(None).last().map(String::as_str), Some("MST 5"));
    }
}
