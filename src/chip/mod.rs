//! One driver per part, generic over embedded-hal: registers and datagrams, and nothing about axes.

pub mod at25;
pub mod encoder;
pub mod tmc262;
pub mod tmc429;
