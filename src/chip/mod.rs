//! One driver per part, generic over embedded-hal: registers, and nothing about what an axis wants.

pub mod at25;
pub mod encoder;
pub mod tmc262;
pub mod tmc429;
