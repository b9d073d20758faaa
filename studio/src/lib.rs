//! The tools and virtual modules for a page in a browser, as WebAssembly without any imports but those of
//! [`Wire`](tmcl_tools::wire::Wire) and [`Stop`](tmcl_tools::stop::Stop).
//!
//! The page has instances of this in workers: one for each link, which has a virtual module or the framing of a serial port, and
//! one for the tools, which reach a link by their wire. What goes through the doors is JSON, with the types of [`types`].
//!
//! * [`doors`] - what the page calls, and what is called of it; the only file with `unsafe`
//! * [`types`] - what is asked, and what is told
//! * [`virtual_module`] - a virtual module, and the lines of its control port
//! * [`serial`] - telegrams of nine bytes on a stream of bytes
//! * [`stop`] - what stops all motors
//! * [`sample`] - values that are read again and again
//! * [`tools`] - the tools, one job at a time
//! * [`page`] - the wire and the stop that the page gives

pub mod doors;
pub mod page;
pub mod sample;
pub mod serial;
pub mod stop;
pub mod tools;
pub mod types;
pub mod virtual_module;
