//! Open firmware for TMCM-1140 class stepper motor modules: TMC429 motion controller, TMC262 driver,
//! AT25128 EEPROM, driven by TMCL (Trinamic Motion Control Language).
//!
//! # Words
//!
//! * **Module** - the product as a whole: one to six axes with a microcontroller. The host talks to it. In the code it
//!   is also the TMCL firmware, [`module::Module`].
//! * **Executor** - what carries out the commands of TMCL on a device, wherever they come from: [`executor`].
//! * **Device** - the hardware of a module as every firmware has it, without a language: [`device::Device`].
//! * **Host** - the computer that sends commands to the module.
//! * **Command** - number, type, motor or bank, and value, as TMCL has it: `MVP ABS, 0, 51200`. A **telegram** is a
//!   command or a reply on a byte link, nine bytes with an address in front and a check sum behind; on CAN it is a
//!   frame. A **request** is what a link brings: a telegram, a line of text or a frame.
//! * **Link** - USB, RS485 or CAN. A byte link, USB or RS485, is in **binary mode** (telegrams) or in **ASCII mode**
//!   (lines of text).
//! * **Parameter** - a numbered setting or reading: axis parameters belong to an axis, global parameters to a bank of
//!   the module. Setting one changes it until power-off; storing one puts it into its **slot** in the EEPROM.
//! * **User function** - what an image makes of one of the commands UF0 to UF7: [`module::Hooks`] has it, and
//!   [`module::Execute`] is what it can do.
//! * **Axis** - a motor with all that moves it: ramp generator, driver, switches, encoders.
//! * **Motion controller** - a chip with one or several ramp generators; a TMC429 has three.
//! * **Ramp generator** - makes the step pulses of one motor, with speeds and positions that follow a ramp. Its **ramp
//!   mode** says whether it goes to a position, turns at a velocity, or holds one.
//! * **Driver** - a TMC262: makes coil currents of step pulses, and measures the motor's load (stallGuard2). A source
//!   file that talks to a chip is a driver, too; the comments say of which chip.
//! * **Microstep** - the unit of positions; a full step, a 200th of a turn as a rule, has 1 to 256 of them.
//! * **Internal velocity** - the unit of speeds, -2047..=2047 on a TMC429, whose pulse divisor and clock make it
//!   microsteps per second.
//! * **Datagram** - one exchange with a chip over SPI, 24 us for a TMC429. They are counted: a poll has time for two or
//!   three.
//! * **Turn** - what the device and its firmware do in each millisecond: supervise, **poll** each axis once, give the
//!   program its share.
//! * **Goal** - what a motor is to do: go to a position, or turn at a speed. Its **motion profile** is how: with which
//!   speed, acceleration and stop switches. The **shape** of a ramp is what it has besides a top speed and one
//!   acceleration.
//! * **Waypoint** - a target that a TMC429 gets on the way to a distant one, as it has only 24 bits for positions.
//! * **Leg** - one run of a reference search, in one direction until a switch closes or opens. The search ends at its
//!   **zero point**.
//! * **Interrupt** - of a TMCL program: an event that calls a handler in the program. In `board` the word means the
//!   interrupts of the microcontroller.
//! * **Node** - a module with the CANopen firmware: [`canopen::Node`]. Its **objects** have an index and a sub-index;
//!   the **master** reads and writes them by **SDO**, and exchanges some of them in **PDOs**, which are not confirmed.
//!   An **emergency** is a message about an error.
//!
//! # The way of a telegram
//!
//! The bytes of `GAP 1, 0` reach a [`module::LinkPort`], the module's end of a byte link, which collects and decodes
//! them by [`tmcl::binary`]. [`module::Module::request`] checks whether the address is the module's;
//! [`module::Module::execute`] looks the command up in the instruction table and calls what it asks for. Here it finds
//! the parameter in [`param`] and has [`motion::Joined::read`] ask the ramp generator by [`chip::tmc429`], with one
//! datagram. The answer goes back the same way, is encoded by the port, and leaves over the link. A command that stores
//! something is answered later, when its value is safe in the EEPROM: its reply comes by
//! [`module::Module::next_reply`]. `docs/architecture.md` follows this and four other ways from file to file.
//!
//! # The modules
//!
//! In dependency order; each knows only those above it (`tests/layers.rs` keeps it so):
//!
//! * [`units`] - microseconds, internal velocity, current scale
//! * [`can`] - a frame of the CAN bus
//! * [`tmcl`] - the language: instruction table, commands, replies, the binary, ASCII and CAN codecs, text
//! * [`param`] - what parameters there are, and how their tables are written
//! * [`chip`] - one driver per part, on embedded-hal
//! * [`motion`] - axes: moves, reference searches, motor current, what stops a motor
//! * [`store`] - settings and the program in the EEPROM, safe against power cuts
//! * [`device`] - the hardware of a module as every firmware has it: axes, inputs and outputs, supply, restart
//! * [`vm`] - TMCL programs: registers, program counter, interrupts
//! * [`executor`] - carries out the commands of TMCL that need no more than a device and the interpreter's registers
//! * [`module`] - the TMCL firmware, a device, the executor, links and programs: `execute(command)`, `poll(now)`
//! * [`canopen`] - the CANopen firmware, a device and CiA 301: `receive(frame)`, `next_frame()`, `poll(now)`
//! * [`firmware`] - a firmware as that on which it runs sees it, board or simulator, whatever language it speaks
//! * [`product`] - the products as data: parameters, memories, slots of settings
//! * `board` - the microcontroller, compiled for bare metal only, and only with the feature of that name
//! * [`image!`] - the binary of an image
//!
//! The core has no clock, no executor and no heap: time is passed in, a call returns what to do next.

#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]

pub mod units;

pub mod can;

pub mod tmcl;

pub mod param;

pub mod chip;

pub mod motion;

pub mod store;

pub mod device;

pub mod vm;

pub mod executor;

pub mod module;

pub mod canopen;

pub mod firmware;

pub mod product;

#[cfg(all(target_os = "none", feature = "board"))]
#[allow(unsafe_code)]
pub mod board;

mod image;
