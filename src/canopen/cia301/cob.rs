//! COB-IDs: what a COB-ID object may be set to (CiA 301).

use super::abort::Abort;

/// Bit of a COB-ID: the PDO, or the emergency message, is off.
pub(crate) const OFF: u32 = 1 << 31;
/// Bit of a PDO's COB-ID: the PDO is not sent for a remote frame; of 1005h: the node makes the SYNC.
pub(crate) const BIT_30: u32 = 1 << 30;
/// Bits of the CAN identifier in a COB-ID.
const CAN_ID: u32 = 0x7FF;

/// The CAN identifier in a COB-ID.
pub(crate) const fn can_id(cob_id: u32) -> u16 {
    (cob_id & CAN_ID) as u16
}

/// True if CiA 301 keeps this identifier for NMT, SDO, error control and other services.
const fn restricted(id: u16) -> bool {
    matches!(id, 0x000..=0x07F | 0x101..=0x180 | 0x581..=0x5FF | 0x601..=0x67F | 0x6E0..=0x6FF | 0x701..=0x7FF)
}

/// Checks a COB-ID of which only these bits and the identifier may be set. An identifier that is in use must not be
/// restricted.
fn check(cob_id: u32, bits: u32) -> Result<(), Abort> {
    let unused = cob_id & !(bits | CAN_ID) != 0;
    let refused = cob_id & bits & OFF == 0 && restricted(can_id(cob_id));
    if unused || refused { Err(Abort::Value) } else { Ok(()) }
}

/// Checks the COB-ID of the SYNC message, of which bit 31 says nothing (CiA 301), and returns it without that bit.
pub(crate) fn sync(cob_id: u32) -> Result<u32, Abort> {
    let cob_id = cob_id & !OFF;
    check(cob_id, 0)?;
    Ok(cob_id)
}

/// Checks the COB-ID of the emergency message.
pub(crate) fn emergency(cob_id: u32) -> Result<(), Abort> {
    check(cob_id, OFF)
}

/// Checks the COB-ID of a PDO.
pub(crate) fn pdo(cob_id: u32) -> Result<(), Abort> {
    check(cob_id, OFF | BIT_30)
}
