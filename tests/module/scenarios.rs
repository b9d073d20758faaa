//! Runs the scenario files in `tests/scenarios` on the virtual module: on the firmware's core with all rows of their
//! tables, and on the flash image in the emulated microcontroller, which is slow, with the first row of each. One line
//! is printed for each scenario; `SCENARIO=text cargo test --test module scenarios` runs those whose file name or title
//! contains the text, and `ALL_ROWS=1` all rows on the image as well.

use std::path::Path;

use crate::common::{Bench, image};
use crate::scenario::{Choice, Rig, run_directory};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::{Control, Line, State};
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm_sim::NativeModule;
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Client;
use tmcm_sim::image::{ImageModule, Setup};

/// How the built-in encoder is connected is not known.
const NO_ENCODER: &str = "the image does not read the built-in encoder";

/// Scenarios that are not run on the image, and why.
const NOT_ON_THE_IMAGE: [(&str, &str); 8] = [
    (
        "Distances beyond the 24 bits of the motion controller's counter are right",
        "140 s of virtual time take the emulated microcontroller minutes",
    ),
    ("The built-in encoder stops the motor after a slip", NO_ENCODER),
    ("A small slip, or no limit, and nothing happens", NO_ENCODER),
    ("Zeroing at the absolute zero point", NO_ENCODER),
    ("A deviation is told of once while the motor stands", NO_ENCODER),
    ("A turn of the built-in encoder is a turn of the motor at each resolution of the manual's table 20", NO_ENCODER),
    ("A deviation after a stall adds its flag", NO_ENCODER),
    ("Deviation supervision goes on after the search: the encoder becomes zero with the position", NO_ENCODER),
];

/// Status and value of the reply to `command` that these bytes are.
fn decoded(bytes: &[u8], command: Command) -> (u8, i32) {
    let reply = binary::decode_reply(bytes.try_into().unwrap()).expect("a reply with a wrong checksum");
    assert_eq!(reply.opcode, command.opcode, "the reply is to another command");
    (reply.status, reply.value)
}

impl Rig for Bench {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        let sent = self.exchange(Source::Usb, binary::encode_command(1, command))?;
        Some(decoded(&sent.bytes, command))
    }

    fn control(&mut self, line: &Line) {
        match line.control {
            // What runs on the board goes off with it.
            Control::Power { on } => self.module.set_power(on),
            Control::Usb { on } => self.module.plug_usb(on),
            control => drop(control.apply(&mut self.module.board().borrow_mut()).unwrap()),
        }
    }

    fn state(&mut self) -> State {
        State::of(&self.module.board().borrow())
    }

    fn pass(&mut self, span: Nanos) {
        self.run(span);
    }
}

/// A module that runs the image, with a host on USB.
struct Emulated(ImageModule);

/// Longest time that a host waits for a reply.
const PATIENCE: Nanos = 2 * SECOND;

impl Rig for Emulated {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        let Emulated(module) = self;
        while module.sent().is_some() {}
        let begin = module.now();
        module.hear(Source::Usb, Client::default(), &binary::encode_command(1, command));
        let mut reply = Vec::new();
        while reply.len() < TELEGRAM {
            if self.0.now() >= begin + PATIENCE {
                return None;
            }
            self.pass(MILLISECOND / 4);
            reply.extend(std::iter::from_fn(|| self.0.sent()).flat_map(|sent| sent.bytes));
        }
        // The host's program hears of it in the next frame.
        self.pass(MILLISECOND);
        Some(decoded(&reply, command))
    }

    fn control(&mut self, line: &Line) {
        match line.control {
            Control::Power { on } => self.0.set_power(on),
            Control::Usb { on } => self.0.plug_usb(on),
            control => drop(control.apply(&mut self.0.board_mut()).unwrap()),
        }
    }

    fn state(&mut self) -> State {
        State::of(&self.0.board_mut())
    }

    fn pass(&mut self, span: Nanos) {
        self.0.run_until(self.0.now() + span);
        assert_eq!(self.0.stopped(), None, "the image does what cannot be emulated");
    }
}

fn run<R: Rig>(first_rows: bool, except: &[(&str, &str)], rig: impl Fn(&WorldConfig) -> R + Sync) {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenarios");
    let filter = std::env::var("SCENARIO").unwrap_or_default();
    let failures = run_directory(&directory, &Choice { filter: &filter, first_rows, except }, rig);
    assert!(failures.is_empty(), "{} failed:\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn on_the_core() {
    run(false, &[], |world| Bench { module: NativeModule::new(world, None, 1) });
}

#[test]
fn on_the_image() {
    let elf = std::fs::read(image::image()).unwrap();
    let first_rows = std::env::var_os("ALL_ROWS").is_none();
    let setup = Setup { usb: true, log: false };
    run(first_rows, &NOT_ON_THE_IMAGE, |world| Emulated(ImageModule::new(&elf, world, None, 1, setup).unwrap()));
}
