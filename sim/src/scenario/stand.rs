//! The rig of a virtual module: one module with a host on its USB link and one on its CAN bus, in virtual time.

use std::convert::Infallible;

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::Line;
use tmcm::can::Frame;
use tmcm::tmcl::Command;
use tmcm::tmcl::binary::{self, TELEGRAM, Telegram};

use super::{Case, Rig};
use crate::client::Client;
use crate::fleet::{Fleet, Member, Node};
use crate::image::{ImageModule, Setup};
use crate::look::Look;
use crate::module::VirtualModule;
use crate::native::{FirmwareKind, NativeModule};

/// Longest time that the host waits for a reply.
const PATIENCE: Nanos = 2 * SECOND;
/// The host's program hears of what an emulated USB port has received in the next frame.
const FRAME: Nanos = MILLISECOND;
/// Seed of the module's random numbers.
const SEED: u32 = 1;
/// Serial address of a fresh module.
const ADDRESS: u8 = 1;
/// The host that waits for no reply: it does not take one for that to another command.
const POSTING: Client = Client(1);
/// The host's adapter on the CAN bus.
const ADAPTER: u64 = 0;

/// A virtual module and its hosts.
pub struct Stand<M> {
    fleet: Fleet<M>,
    /// Time that passes between a reply and the host's hearing of it.
    late: Nanos,
}

impl Stand<NativeModule> {
    /// A module that runs the firmware's core, for a case.
    pub fn native(case: &Case) -> Self {
        let start = |member: Member<'_>, seed| {
            Ok::<_, Infallible>(NativeModule::of(member.model, member.world, member.eeprom, seed))
        };
        let Ok(fleet) = Fleet::start(&[member(case)], SEED, start);
        Stand { fleet, late: 0 }
    }
}

impl Stand<ImageModule> {
    /// A module that runs a flash image, for a case of the image's product and firmware.
    ///
    /// # Errors
    /// A message: the image cannot start.
    pub fn image(elf: &[u8], case: &Case) -> Result<Self, String> {
        let setup = Setup { usb: case.model.firmware() == FirmwareKind::Tmcl, log: false };
        let start = |member: Member<'_>, seed| {
            let (product, Member { world, eeprom, .. }) = (member.model.product(), member);
            ImageModule::of(product, elf, world, eeprom, seed, setup).map_err(|stop| stop.to_string())
        };
        Ok(Stand { fleet: Fleet::start(&[member(case)], SEED, start)?, late: FRAME })
    }
}

impl<M: VirtualModule> Stand<M> {
    /// The module, to look at and to change.
    pub fn module_mut(&mut self) -> &mut M {
        &mut self.fleet.modules_mut()[0]
    }
}

fn member(case: &Case) -> Member<'_> {
    Member { model: case.model, world: &case.world, eeprom: case.eeprom.as_deref() }
}

impl<M: VirtualModule> Rig for Stand<M> {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        while self.fleet.sent().is_some() {}
        let end = self.fleet.now() + PATIENCE;
        self.fleet.hear_usb(Client::default(), &binary::encode_command(ADDRESS, command));
        let mut bytes = Vec::new();
        while self.fleet.now() < end {
            let next = self.fleet.next_event().unwrap_or(end).clamp(self.fleet.now() + 1, end);
            self.fleet.run_until(next);
            while let Some((_, sent)) = self.fleet.sent() {
                bytes.extend(sent.bytes.into_iter().filter(|_| sent.client == Client::default()));
            }
            if let Some(reply) = bytes.get(..TELEGRAM).and_then(|bytes| Telegram::try_from(bytes).ok()) {
                self.fleet.run(self.late);
                // A reply that cannot be read is none.
                let reply = binary::decode_reply(&reply).filter(|reply| reply.opcode == command.opcode)?;
                return Some((reply.status, reply.value));
            }
        }
        None
    }

    fn post(&mut self, command: Command) {
        self.fleet.hear_usb(POSTING, &binary::encode_command(ADDRESS, command));
    }

    fn control(&mut self, line: &Line) -> Result<(), String> {
        self.fleet.control(line).map(drop)
    }

    fn control_at(&mut self, delay: Nanos, line: &Line) -> Result<(), String> {
        self.fleet.at(delay, *line)
    }

    fn look(&mut self, look: &Look) -> f64 {
        self.fleet.modules_mut().first_mut().map_or(0.0, |module| look.read(&module.board_mut()))
    }

    fn now(&mut self) -> Nanos {
        self.fleet.now()
    }

    fn pass(&mut self, span: Nanos) {
        self.fleet.run(span);
    }

    fn send_frame(&mut self, frame: Frame) {
        self.fleet.send_can(ADAPTER, frame);
    }

    fn frame(&mut self) -> Option<Frame> {
        loop {
            let heard = self.fleet.can()?;
            if matches!(heard.from, Node::Module(_)) {
                return Some(heard.frame);
            }
        }
    }

    fn stopped(&self) -> Option<String> {
        self.fleet.modules().first().and_then(M::stopped)
    }
}
