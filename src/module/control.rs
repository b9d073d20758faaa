//! The commands 128 to 135, which control the program and load another one (manual section 3.7.38).

use super::origin::Source;
use super::program::{Program, program_command};
use crate::device::{Circuit, Device};
use crate::executor::{Globals, Outcome, Product};
use crate::param::{AGAINST_READING, AGAINST_WRITING, GlobalParameter as G};
use crate::store::Integrity;
use crate::tmcl::{Command, Reply, Status};
use crate::vm::Machine;

/// A program together with what the commands that control it reach.
pub(super) struct Control<'a, T: Circuit, const AXES: usize> {
    pub(super) program: &'a mut Program,
    pub(super) machine: &'a mut Machine,
    pub(super) device: &'a mut Device<T, AXES>,
    pub(super) globals: &'a Globals,
}

impl<T: Circuit<Product: Product>, const AXES: usize> Control<'_, T, AXES> {
    /// Checks that a program may run: there is memory for one, it is whole, no download is open, and the motors are not
    /// locked.
    fn runnable(&self) -> Result<(), Status> {
        let whole = T::Product::SPEC.commands > 0
            && matches!(self.device.store().integrity(), Integrity::Whole | Integrity::Empty)
            && self.device.store().downloading().is_none();
        if whole && !self.device.is_locked() { Ok(()) } else { Err(Status::NotAvailable) }
    }

    /// Command 129: runs the program from where it stands, or, with type 1, from an address.
    pub(super) fn run(&mut self, kind: u8, value: i32) -> Result<(), Status> {
        let from = match kind {
            0 => None,
            1 => Some(T::Product::SPEC.address(value)?),
            _ => return Err(Status::WrongType),
        };
        self.runnable()?;
        match from {
            Some(from) => self.machine.run_from(from),
            None => self.machine.run(),
        }
        Ok(())
    }

    /// Command 130: has the program execute one command.
    pub(super) fn step(&mut self) -> Result<(), Status> {
        self.runnable()?;
        self.machine.step();
        Ok(())
    }

    /// Command 135: the state of the program and an address in one value, or a register.
    pub(super) fn status(&self, kind: u8) -> Result<i32, Status> {
        let loaded = self.device.store().downloading().unwrap_or_default() / Command::SIZE;
        self.machine.status(kind, loaded as u16).ok_or(Status::WrongType)
    }

    /// Command 132. Commands that the same link sends from now on are stored, until command 133.
    pub(super) fn enter_download(&mut self, source: Source, value: i32) -> Result<Outcome, Status> {
        let address = T::Product::SPEC.address(value)?;
        if self.globals.protect(AGAINST_WRITING) {
            return Err(Status::EepromLocked);
        }
        let store = self.device.store_mut();
        if self.program.downloads_elsewhere(store, source) || !store.takes_download() {
            return Err(Status::NotAvailable);
        }
        self.machine.stop();
        self.program.downloader = Some(source);
        store.begin_download(usize::from(address).saturating_mul(Command::SIZE));
        Ok(Outcome::stored(value))
    }

    /// During a download: stores a command in place of executing it.
    pub(super) fn download(&mut self, command: Command) -> Result<Outcome, Status> {
        if self.globals.protect(AGAINST_WRITING) {
            Err(Status::EepromLocked)
        } else if self.device.store_mut().download(&command.to_bytes()) {
            Ok(Outcome::Special(Reply::echo(Status::Loaded, command)))
        } else {
            Err(Status::InvalidValue)
        }
    }

    /// Command 133. Only the link that downloads can end the download: it alone knows that all commands have come.
    pub(super) fn exit_download(&mut self, source: Source, value: i32) -> Result<Outcome, Status> {
        let store = self.device.store_mut();
        if self.program.downloads_elsewhere(store, source) {
            return Err(Status::NotAvailable);
        }
        let unfinished = matches!(store.integrity(), Integrity::Incomplete | Integrity::BeingErased(_));
        if store.downloading().is_none() && unfinished {
            return Err(Status::NotAvailable);
        }
        store.end_download();
        if !self.machine.runs() {
            self.machine.rewind();
        }
        Ok(Outcome::written(value))
    }

    /// Command 134. A command of a read-protected program reads as an empty one.
    pub(super) fn read_memory(&self, value: i32) -> Result<Outcome, Status> {
        let address = T::Product::SPEC.address(value)?;
        let command = program_command(self.device.store(), address).unwrap_or_default();
        let shown = if self.globals.protect(AGAINST_READING) { Command::default() } else { command };
        Ok(Outcome::Special(Reply::Memory(shown)))
    }

    /// At the start and when the supply is back: starts the program if parameter 77 says so.
    pub(super) fn autostart(&mut self) {
        // Before a restart no program starts: a host that wanted to stop it would not be heard any more.
        if self.device.is_locked() || self.device.restart().is_some() || !core::mem::take(&mut self.program.starts) {
            return;
        }
        if self.globals.get(G::AutoStart) != 0 && self.runnable().is_ok() {
            self.machine.reset();
            self.machine.run();
        }
    }
}
