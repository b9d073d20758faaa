//! The tools and virtual modules for a page in a browser, as WebAssembly without any imports but those of
//! [`Wire`](tmcl_tools::wire::Wire) and [`Stop`](tmcl_tools::stop::Stop).
//!
//! The page has instances of this in workers: one for each link, and one for the tools. That of a link has a virtual
//! module or the framing of a serial port. The tools reach a link by their wire. What goes through the doors is JSON,
//! with the types of [`types`].
//!
//! * [`mod@doors`] - what the page calls, and what is called of it; the only file with `unsafe`
//! * [`types`] - what is asked, and what is told
//! * [`running`] - what a page does with a virtual module, whatever this runs
//! * [`virtual_module`] - a virtual module, and the lines of its control port
//! * [`watching`] - what happens at its moments
//! * [`writes`] - how often it has stored something
//! * [`world`] - what there is to be touched and drawn around it
//! * [`session`] - what was done to a virtual module, to be done again elsewhere
//! * [`serial`] - telegrams of nine bytes on a stream of bytes
//! * [`stop`] - what stops all motors
//! * [`log`] - what goes over a link, in lines
//! * [`recorder`] - rows of values of a virtual module
//! * [`scope`] - curves: values that are read again and again
//! * [`status`] - inputs, outputs and axes, and what their readings mean
//! * [`tools`] - the tools, one job at a time
//! * [`program`] - programs in a module, loaded and followed step by step
//! * [`language`] - what an editor of programs asks of the assembler
//! * [`parameters`] - parameters, their tables and files of them
//! * [`page`] - the wire and the stop that the page gives

#[cfg(test)]
mod compared;
pub mod doors;
pub mod language;
pub mod log;
pub mod page;
pub mod parameters;
pub mod program;
pub mod recorder;
pub mod running;
pub mod scope;
pub mod serial;
pub mod session;
pub mod status;
pub mod stop;
pub mod tools;
pub mod types;
pub mod virtual_module;
pub mod watching;
pub mod world;
pub mod writes;
