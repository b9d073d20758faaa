//! The order for a search, and what a search tells.

use std::ops::RangeInclusive;
use std::time::Duration;

use super::found::Found;
use crate::progress::Progress;

/// The medium that carries the telegrams.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Medium {
    /// A serial device, which is tried at these bit rates, in bit/s.
    Serial(Vec<u32>),
    /// Bytes without a bit rate.
    Bytes,
    /// CAN, where modules have identifiers in place of addresses.
    Can,
}

/// The order for a search: what is looked for, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Search {
    /// The medium that carries the telegrams.
    pub medium: Medium,
    /// The addresses, or on CAN the identifiers, that are asked, 1 to 2047.
    pub addresses: RangeInclusive<u16>,
    /// How long a reply is waited for. Modules may be set to pause for up to 255 ms before they reply (global parameter
    /// 75).
    pub timeout: Duration,
    /// How long the reply of a module that is alone on its link is waited for, once at each bit rate.
    pub first_timeout: Duration,
}

/// An event that a search tells.
#[derive(Debug)]
pub enum Event<'a, E> {
    /// How far it has got at this bit rate.
    Progress(Progress<'a>),
    /// A module.
    Found(&'a Found),
    /// A bit rate at which the link cannot be opened.
    Unavailable(E),
}
