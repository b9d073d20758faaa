//! Knowledge of TMCL and of the modules that speak it, without an operating system: no files, no threads, no clock and
//! no terminal. It is the same for a program, for a page in a browser and for a test in virtual time.
//!
//! * [`product`] - the products that are known
//! * [`asm`] - the assembler for TMCL programs, whose texts come from [`sources`]
//! * [`disasm`] - the source of an assembled program
//! * [`dump`] - the program in a module, read back
//! * [`program`] - TMCL programs with what is known of their source, and their way into a module
//! * [`debug`] - a program in a module, step by step
//! * [`conversation`] - requests to one module over a [`wire`], with decoded replies; [`stop`] says whether to end
//! * [`params`] - a module's settings: in tables, in files, and the differences between them
//! * [`monitor`] - samples of axes, in rows and in lines
//! * [`request`] - commands as users type them; [`replies`] - what a module says to them
//! * [`scan`] - the modules on a link
//! * [`status`] - inputs, outputs and axes, in words
//! * [`shell`] - direct mode: lines, what there is to tell, and a motor that moves while a key is held
//! * [`desk`] - lines of the control port, and how virtual time passes
//! * [`run`] - a program on a virtual module, in virtual time
//! * [`calc`] - speeds, accelerations, times and currents in the units of a product
//! * [`tables`] - parameters and objects as JSON
//! * [`tune`] - settings of stallGuard2 and coolStep by measurement
//! * [`eds`] - the objects of the CANopen firmware as a file for masters
//! * [`slcan`] - CAN frames as lines of text, and an adapter that exchanges such lines with a host
//! * [`svg`] - images of curves
//! * [`shown`] - text that comes from elsewhere, as it may be shown
//! * [`failure`], [`progress`] - how jobs end, and how far they have got
//! * [`number`], [`suggest`] - numbers and commands as users write them

pub mod asm;
pub mod calc;
pub mod conversation;
pub mod debug;
pub mod desk;
pub mod disasm;
pub mod dump;
pub mod eds;
pub mod failure;
pub mod monitor;
pub mod number;
pub mod params;
pub mod product;
pub mod program;
pub mod progress;
pub mod replies;
pub mod request;
pub mod run;
pub mod scan;
pub mod shell;
pub mod shown;
pub mod slcan;
pub mod sources;
pub mod status;
pub mod stop;
pub mod suggest;
pub mod svg;
pub mod tables;
pub mod tune;
pub mod wire;
