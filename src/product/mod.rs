//! Products as data: the parameter rows of each.

pub mod tmcm1140;
pub mod tmcm3110;
pub mod tmcm3212;
pub mod tmcm6110;
