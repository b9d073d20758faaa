//! The program `tmcl` as a library. Its virtual modules are those of [`tmcm_sim`].
//!
//! * [`sim`] - `tmcl sim`: virtual modules in real time, with links that host software opens
//! * [`world`] - `tmcl world`: the world around virtual modules, by the control port
//! * [`link`] - links as users name them: wires, and virtual modules inside this program
//! * [`reach`] - the options that name a module, and the link to it
//! * [`send`] - `tmcl send`: commands to a module, replies in words
//! * [`shell`] - `tmcl shell`: commands, watching and jogging at a terminal
//! * [`asm`] - `tmcl asm`: the assembler for TMCL programs
//! * [`dump`] - `tmcl dump`: the program in a module as source
//! * [`disasm`] - `tmcl disasm`: the source of an assembled program
//! * [`run`] - `tmcl run`: a program on a virtual module, in virtual time, with trace and plot
//! * [`testing`] - `tmcl test`: scenario files on virtual modules
//! * [`params`] - `tmcl params`: a module's settings in a file
//! * [`calc`] - `tmcl calc`: speeds, accelerations and times in the units of a product
//! * [`tune`] - `tmcl tune`: settings of stallGuard2 and coolStep by measurement
//! * [`eds`] - `tmcl eds`: the objects of the CANopen firmware as a file for masters
//! * [`tables`] - `tmcl tables`: parameters and objects as JSON
//! * [`completions`] - `tmcl completions`: for shells
//! * [`manual`] - `tmcl manual`: pages for man
//! * [`monitor`] - `tmcl monitor`: samples of an axis
//! * [`scan`] - `tmcl scan`: the modules on a link
//! * [`program`] - programs that users name: files, and modules that are to have them
//! * [`load`] - `tmcl load`: a program into a module
//! * [`debug`] - `tmcl debug`: a program in a module, step by step
//! * [`help`] - what `--help` says, of which product and on which system
//! * [`failure`] - the failure of a subcommand, with its exit code
//! * [`tell`] - what is told on standard output and standard error, without what controls a terminal
//! * [`output`] - files that a command writes, or standard output
//! * [`terminal`] - the user's terminal: lines with history, and single keys
//! * [`progress`] - a progress bar
//! * [`version`] - `tmcl --version`

pub mod asm;
pub mod calc;
pub mod completions;
pub mod debug;
pub mod disasm;
mod draft;
pub mod dump;
pub mod eds;
pub mod failure;
mod files;
pub mod help;
pub mod link;
pub mod load;
pub mod manual;
pub mod monitor;
pub mod output;
pub mod params;
pub mod program;
pub mod progress;
pub mod reach;
pub mod run;
pub mod scan;
pub mod send;
pub mod shell;
pub mod sim;
pub mod tables;
pub mod tell;
pub mod terminal;
pub mod testing;
pub mod tune;
pub mod version;
pub mod world;
