//! Runs the scenario files in `tests/scenarios` on the virtual module. One line is printed for each scenario;
//! `SCENARIO=text cargo test --test scenarios` runs those whose file name or title contains the text.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;
mod scenario;

use std::path::Path;

use common::Bench;
use hal_sim::clock::Nanos;
use hal_sim::control::{Control, Line, State};
use hal_sim::world::config::WorldConfig;
use scenario::Rig;
use tmcl_cli::virtual_module::VirtualModule;
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};

impl Rig for Bench {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        let sent = self.exchange(Source::Usb, binary::encode_command(1, command))?;
        let reply = binary::decode_reply(&sent.telegram().unwrap()).expect("a reply with a wrong checksum");
        assert_eq!(reply.opcode, command.opcode, "the reply is to another command");
        Some((reply.status, reply.value))
    }

    fn control(&mut self, line: &Line) {
        match line.control {
            // What runs on the board goes off with it.
            Control::Power { on } => self.module.set_power(on),
            control => drop(control.apply(&mut self.module.board().borrow_mut())),
        }
    }

    fn state(&mut self) -> State {
        State::of(&self.module.board().borrow())
    }

    fn pass(&mut self, span: Nanos) {
        self.run(span);
    }
}

#[test]
fn scenarios() {
    let directory = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/scenarios");
    let filter = std::env::var("SCENARIO").unwrap_or_default();
    let rig = |world: &WorldConfig| Bench { module: VirtualModule::new(world, None, 1) };
    let failures = scenario::run_directory(&directory, &filter, rig);
    assert!(failures.is_empty(), "{} failed:\n{}", failures.len(), failures.join("\n"));
}
