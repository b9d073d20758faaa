//! Requests that stop all motors of a module: MST for each axis, and command 128, which stops a program that may move
//! them again.

use tmcl_tools::product;
use tmcm::tmcl::{Command, Opcode, Status, binary};
use tmcm_sim::Product;

use crate::types::{Axes, Download, Moved, Noted, Outcome, Read, Request, Requests};

/// The product of this short name, if there is one.
pub(crate) fn known(product: Option<&str>) -> Option<Product> {
    product.and_then(|name| product::named(name).ok())
}

/// The axes of a product; of an unknown one as many as the largest known one has, because it refuses those that it has
/// not.
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

/// Type of MVP that moves several axes, whose motor is a set of them.
const COORD: u8 = 2;
/// Leaves download mode, in which a module stores commands and does not carry them out.
const LEAVE_DOWNLOAD: Command = Command::new(Opcode::ExitDownload as u8, 0, 0, 0);

/// Tells what a link has to know of a request: what stops what it sets in motion, and what it makes of download mode.
pub fn noted(Moved { request, product }: &Moved) -> Noted {
    let all = || requests(&Axes { address: request.address, product: product.clone() }).requests;
    let at = |command| Request::new(request.address, command);
    let axis = || vec![at(Command::new(Opcode::Mst as u8, 0, request.motor, 0))];
    let opcode = Opcode::from_number(request.opcode);
    let stops = match opcode {
        // The motor of a move of several axes is a set of them.
        Some(Opcode::Mvp) if request.kind == COORD => all(),
        // Whatever SAP has written: a target, a speed, or a setting that makes no difference to a motor that stands.
        Some(Opcode::Ror | Opcode::Rol | Opcode::Mvp | Opcode::Rfs | Opcode::Sap) => axis(),
        Some(Opcode::RunApplication | Opcode::StepApplication) => all(),
        _ => Vec::new(),
    };
    let download = match opcode {
        Some(Opcode::EnterDownload) => {
            let nothing = Command::new(Opcode::Stop as u8, 0, 0, 0);
            Download::Begun {
                end: at(LEAVE_DOWNLOAD),
                clear: [request.command(), nothing, LEAVE_DOWNLOAD].map(at).into(),
            }
        }
        Some(Opcode::ExitDownload) => Download::Over,
        _ => Download::Same,
    };
    Noted { stops, download }
}

/// The requests that are to be sent because a request that stops something has ended so. There are none if it has been
/// carried out, or refused. If the module has stored it, the end of download mode comes before it.
pub fn left(Read { request, outcome }: &Read) -> Requests {
    let reply = match outcome {
        Outcome::Reply(bytes) => bytes.first_chunk().and_then(binary::decode_reply),
        _ => None,
    };
    let requests = match reply.filter(|reply| reply.opcode == request.opcode).map(|reply| reply.status) {
        Some(status) if status == Status::Loaded as u8 => {
            vec![Request::new(request.address, LEAVE_DOWNLOAD), *request]
        }
        Some(_) => Vec::new(),
        None => vec![*request],
    };
    Requests { requests }
}

#[cfg(test)]
mod tests {
    use tmcm::tmcl::Reply;

    use super::*;

    #[test]
    fn what_moves_is_stopped() {
        let stops = |command| {
            let moved = Moved { request: Request::new(1, command), product: Some("3110".into()) };
            noted(&moved).stops.iter().map(|request| request.command().to_string()).collect::<Vec<_>>()
        };
        assert_eq!(stops(Command::new(4, 2, 0x41, 1)).len(), 4);
        assert_eq!(stops(Command::new(1, 0, 2, 500)), ["MST 2"]);
        assert_eq!(stops(Command::new(4, 1, 1, 500)), ["MST 1"]);
        assert_eq!(stops(Command::new(129, 0, 0, 0)), ["128, 0, 0, 0", "MST 0", "MST 1", "MST 2"]);
        assert!(stops(Command::new(6, 1, 0, 0)).is_empty() && stops(Command::new(3, 0, 0, 0)).is_empty());
    }

    /// In download mode a module stores what should stop it, and answers that.
    #[test]
    fn what_was_stored_is_sent_again_when_download_mode_is_over() {
        let request = Request::new(1, Command::new(Opcode::Mst as u8, 0, 2, 0));
        let left = |outcome| {
            let left = left(&Read { request, outcome }).requests;
            left.iter().map(|request| request.command().to_string()).collect::<Vec<_>>()
        };
        let answered = |status, opcode| {
            Outcome::Reply(binary::encode_reply(2, 1, &Reply::Plain { status, opcode, value: 0 }).into())
        };
        let reply = |status| answered(status, Opcode::Mst as u8);
        assert_eq!(left(reply(Status::Loaded)), ["133, 0, 0, 0", "MST 2"]);
        assert_eq!(left(Outcome::NoReply(3)), ["MST 2"]);
        assert!(left(reply(Status::Ok)).is_empty() && left(reply(Status::InvalidValue)).is_empty());
        assert_eq!(left(answered(Status::Ok, Opcode::Gap as u8)), ["MST 2"], "a late reply to something else");
    }

    /// A program that is loaded to address 7 and broken off leaves a STOP there.
    #[test]
    fn of_a_download_that_is_broken_off_nothing_is_left() {
        let noted = |opcode: Opcode, value| {
            let command = Command::new(opcode as u8, 0, 0, value);
            noted(&Moved { request: Request::new(2, command), product: None }).download
        };
        let Download::Begun { end, clear } = noted(Opcode::EnterDownload, 7) else { panic!() };
        assert_eq!((end.address, end.command()), (2, LEAVE_DOWNLOAD));
        let clear: Vec<_> = clear.iter().map(|request| (request.address, request.command().to_string())).collect();
        assert_eq!(clear, ["132, 0, 0, 7", "STOP", "133, 0, 0, 0"].map(|line| (2, line.into())));
        assert_eq!((noted(Opcode::ExitDownload, 0), noted(Opcode::Gap, 0)), (Download::Over, Download::Same));
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
