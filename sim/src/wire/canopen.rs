//! Frames of CANopen (CiA 301) in words. Each is read by itself. What a PDO carries depends on its mapping, and what
//! the segments of a long SDO transfer belong to on its beginning, so neither is told.

use tmcm::can::{CanFrame, Frame};
use tmcm::canopen::{Abort, COMMAND, CONTROL, Emergency, Entry, SDO_REPLY, SDO_REQUEST, Type};

use super::answer::hexadecimal;

/// Identifier of SYNC; with a node ID, those of emergencies begin here.
const SYNC: u16 = 0x080;
/// Identifier of the first transmitted PDO, without the node ID; PDOs of both directions take turns from here on.
const FIRST_PDO: u16 = 0x180;
/// The bits of the node ID in an identifier.
const NODE: u16 = 0x07F;

/// The meaning of a frame with this identifier.
pub(super) fn meaning(id: u16, frame: &Frame) -> String {
    let (node, data, function) = (id & NODE, frame.data(), id & !NODE);
    let asks = frame.is_remote_frame();
    match function {
        _ if id == COMMAND && !asks => command(data),
        _ if id == SYNC && !asks => "SYNC".into(),
        _ if node == 0 => "no frame of a node".into(),
        SYNC if !asks => emergency(node, data),
        CONTROL if asks => format!("guarding of {node}"),
        CONTROL => state(node, data),
        SDO_REQUEST if !asks => format!("SDO to {node}: {}", request(data)),
        SDO_REPLY if !asks => format!("SDO from {node}: {}", reply(data)),
        FIRST_PDO..SDO_REPLY => {
            let nth = (function - FIRST_PDO) / (NODE + 1);
            let (number, name) = (nth / 2 + 1, if nth.is_multiple_of(2) { "TPDO" } else { "RPDO" });
            format!("{name}{number} of {node}{}", if asks { " asked for" } else { "" })
        }
        _ => "no frame of a node".into(),
    }
}

/// A command of network management.
fn command(data: &[u8]) -> String {
    let [command, node, ..] = *data else { return format!("NMT: {} of 2 bytes", data.len()) };
    let what = match command {
        0x01 => "start",
        0x02 => "stop",
        0x80 => "enter pre-operational",
        0x81 => "reset node",
        0x82 => "reset communication",
        _ => "unknown command",
    };
    match node {
        0 => format!("NMT to all: {what}"),
        node => format!("NMT to {node}: {what}"),
    }
}

/// Boot-up, heartbeat, or the answer to node guarding.
fn state(node: u16, data: &[u8]) -> String {
    let Some(state) = data.first() else { return format!("state of {node}: 0 of 1 bytes") };
    let name = match state & 0x7F {
        0 => return format!("boot-up of {node}"),
        4 => "stopped",
        5 => "operational",
        127 => "pre-operational",
        _ => "unknown",
    };
    format!("state of {node}: {name}")
}

fn emergency(node: u16, data: &[u8]) -> String {
    let Some([low, high, register, first, second]) = data.first_chunk().copied() else {
        return format!("EMCY of {node}: {} of 8 bytes", data.len());
    };
    let code = u16::from_le_bytes([low, high]);
    let mut known = Emergency::ALL.iter().map(|emergency| emergency.data());
    let known = known.find(|(number, field, ..)| (*number, *field) == (code, [first, second]));
    let meaning = known.map_or("unknown", |(.., meaning)| meaning);
    format!("EMCY of {node}: {code:04X}h {meaning}, error register {register:02X}h")
}

/// The request of a client to an SDO server.
fn request(data: &[u8]) -> String {
    let Some(&[head, .., d, e, f, g]) = data.first_chunk::<8>() else { return few(data) };
    let object = Place::of(data);
    match head >> 5 {
        0 => segment(data, "write"),
        1 if head & 2 != 0 => format!("write {object} = {}", object.value(head, [d, e, f, g])),
        1 => format!("write {object}, {}", length(head, [d, e, f, g])),
        2 => format!("read {object}"),
        3 => "read segment".into(),
        4 => abort(object, [d, e, f, g]),
        _ => "unknown request".into(),
    }
}

/// The answer of an SDO server.
fn reply(data: &[u8]) -> String {
    let Some(&[head, .., d, e, f, g]) = data.first_chunk::<8>() else { return few(data) };
    let object = Place::of(data);
    match head >> 5 {
        0 => segment(data, "read"),
        1 => "segment written".into(),
        2 if head & 2 != 0 => format!("{object} is {}", object.value(head, [d, e, f, g])),
        2 => format!("{object}, {}", length(head, [d, e, f, g])),
        3 => format!("{object} written"),
        4 => abort(object, [d, e, f, g]),
        _ => "unknown reply".into(),
    }
}

fn few(data: &[u8]) -> String {
    format!("{} of 8 bytes", data.len())
}

/// The length of what follows in segments, if it is told.
fn length(head: u8, length: [u8; 4]) -> String {
    match head & 1 {
        0 => "in segments".into(),
        _ => format!("{} bytes in segments", u32::from_le_bytes(length)),
    }
}

fn segment(data: &[u8], what: &str) -> String {
    let [head, rest @ ..] = data else { return few(data) };
    let unused = usize::from(head >> 1 & 7);
    let bytes = rest.get(..rest.len().saturating_sub(unused)).unwrap_or_default();
    format!("{what} segment {}{}", hexadecimal(bytes), if head & 1 != 0 { ", the last" } else { "" })
}

fn abort(object: Place, code: [u8; 4]) -> String {
    let code = u32::from_le_bytes(code);
    format!("{object} refused, {code:08X}h {}", Abort::from_code(code).map_or("unknown", Abort::meaning))
}

/// An object as a frame names it.
#[derive(Clone, Copy, Debug)]
struct Place {
    index: u16,
    sub: u8,
}

impl Place {
    /// The object in the second to fourth byte of the data.
    fn of(data: &[u8]) -> Self {
        match *data {
            [_, low, high, sub, ..] => Place { index: u16::from_le_bytes([low, high]), sub },
            _ => Place { index: 0, sub: 0 },
        }
    }

    /// The value in the frame itself: by the type of the object if its size is that, else its bytes.
    fn value(self, head: u8, bytes: [u8; 4]) -> String {
        let size = if head & 1 != 0 { 4 - usize::from(head >> 2 & 3) } else { 4 };
        let kind = Entry::find(self.index, self.sub).map(|entry| entry.row().data);
        match kind {
            Ok(kind) if kind.size() == size && !matches!(kind, Type::Text | Type::Octets) => {
                kind.value(kind.extend(u32::from_le_bytes(bytes))).to_string()
            }
            _ => hexadecimal(bytes.get(..size).unwrap_or_default()),
        }
    }
}

/// Index and sub-index, and the name of an object that is known.
impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:04X}h.{}", self.index, self.sub)?;
        match Entry::find(self.index, self.sub) {
            Ok(entry) => write!(f, " {}", entry.row().name.replace('#', &(entry.nth + 1).to_string())),
            Err(_) => Ok(()),
        }
    }
}
