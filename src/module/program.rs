//! The knowledge that a module has of its program beside the interpreter: what it may still spend, whether it is still
//! to be started, and which link downloads another one.

use super::origin::Source;
use crate::device::{Circuit, Device};
use crate::store::{Memory, Store};
use crate::tmcl::Command;
use crate::vm::{Machine, Signals};

/// Units a program may spend in a millisecond.
const FUEL: u32 = 128;

/// The program of a module.
#[derive(Debug)]
#[repr(C)]
pub(super) struct Program {
    /// Units that the program may still spend in this millisecond; a command costs 1 or more.
    pub(super) fuel: u32,
    /// The program is still to be started, if global parameter 77 says so.
    pub(super) starts: bool,
    /// The link over which a program is being downloaded.
    pub(super) downloader: Option<Source>,
    /// The events of the axes for the interrupts of the program, in the turn under way.
    pub(super) signals: Signals,
}

impl Default for Program {
    fn default() -> Self {
        Program { fuel: 0, starts: true, downloader: None, signals: Signals::default() }
    }
}

impl Program {
    /// True while this link downloads.
    pub(super) fn downloads_here<M: Memory>(&self, store: &Store<M>, source: Source) -> bool {
        store.downloading().is_some() && !self.downloads_elsewhere(store, source)
    }

    /// True while another link downloads. If that link's host has vanished, command 255 ends the download.
    pub(super) fn downloads_elsewhere<M: Memory>(&self, store: &Store<M>, source: Source) -> bool {
        store.downloading().is_some() && self.downloader.is_some_and(|link| link != source)
    }

    /// Tells the program what the axes, stop switches and inputs have done since the last millisecond, and lets it
    /// spend anew.
    pub(super) fn begin_turn<T: Circuit, const AXES: usize>(
        &mut self,
        machine: &mut Machine,
        device: &Device<T, AXES>,
    ) {
        let mut signals = core::mem::take(&mut self.signals);
        for number in 0..AXES {
            let [left, right] = device.stop_switches(number).unwrap_or_default();
            signals.stop_switches(number as u8, left, right);
        }
        signals.inputs(device.inputs().digital);
        let runs = machine.runs();
        machine.interrupts.look(device.turn(), signals, runs);
        self.fuel = FUEL;
    }
}

/// The command at an address of program memory; `None` outside.
pub(super) fn program_command<M: Memory>(store: &Store<M>, address: u16) -> Option<Command> {
    let (commands, _) = store.program().as_chunks();
    commands.get(usize::from(address)).map(|bytes| Command::from_bytes(*bytes))
}
