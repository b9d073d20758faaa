//! Flash images in a page: all doors of [`tmcl_studio`], and those by which a virtual module runs an image on the
//! emulated microcontroller. It is a program of its own, which a page loads when an image is opened. The reason is its
//! size: the emulator and what decodes the log of an image are as large as a good part of the rest.
//!
//! * [`doors`] - what the page calls
//! * [`image`] - an image, and the module that runs it

pub mod doors;
pub mod image;
