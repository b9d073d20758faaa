//! The program `tmcl` as a library: the virtual module is what the firmware's own tests run on, too.

pub mod virtual_module;
