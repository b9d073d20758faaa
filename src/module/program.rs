//! TMCL programs: how they are executed beside everything else, and the commands 128 to 135 that control them (manual
//! sections 3.3, 3.7.38).
//!
//! In each millisecond a program may spend 128 units: 16 on a command that talks to the chips, one on any other. So the
//! speed of a program is the same on every host and on the image, and leaves time for the axes and the links. It runs in
//! slices, between which the owner of the module looks at the links: a slice is one command that talks to the chips, or
//! others that take no longer together.

use super::origin::Source;
use super::outcome::Outcome;
use super::waiting::{Waiter, Waiting};
use super::{Executed, Hooks, Module, Platform};
use crate::param::{AGAINST_READING, AGAINST_WRITING, AxisParameter, GlobalParameter as G, Parameter};
use crate::store::Integrity;
use crate::tmcl::{Command, Instruction, Opcode, Reply, Status};
use crate::units::Micros;
use crate::vm::{self, Awaited, Machine, ProgramState, Wait};

/// Units a program may spend in a millisecond.
pub(super) const FUEL: u32 = 128;
/// What a command costs that talks to the chips.
const CHIP_COST: u32 = 16;
/// The length of a slice: this many commands that need the interpreter alone.
const SLICE: u32 = 32;
/// What any other command takes of a slice, if it does not talk to the chips.
const LONGER: u32 = 4;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// The interpreter, to look at.
    pub const fn machine(&self) -> &Machine {
        &self.machine
    }

    /// A value as an address in program memory; without program memory there is none.
    pub(super) fn address(&self, value: i32) -> Result<u16, Status> {
        if self.spec().commands == 0 {
            return Err(Status::NotAvailable);
        }
        vm::address(value, self.spec().commands).ok_or(Status::InvalidValue)
    }

    /// The command at an address of program memory; `None` outside.
    fn program_command(&self, address: u16) -> Option<Command> {
        let (commands, _) = self.device.store().program().as_chunks();
        commands.get(usize::from(address)).map(|bytes| Command::from_bytes(*bytes))
    }

    /// Checks that a program may run: there is memory for one, it is whole, no download is open, and the motors are not
    /// locked.
    fn runnable(&self) -> Result<(), Status> {
        let whole = self.spec().commands > 0
            && matches!(self.device.store().integrity(), Integrity::Whole | Integrity::Empty)
            && self.device.store().downloading().is_none();
        if whole && !self.device.is_locked() { Ok(()) } else { Err(Status::NotAvailable) }
    }

    fn protected(&self, against: i32) -> bool {
        self.global(G::CodeProtection) & against != 0
    }

    /// Command 129.
    pub(super) fn run_application(&mut self, kind: u8, value: i32) -> Result<(), Status> {
        let from = match kind {
            0 => None,
            1 => Some(self.address(value)?),
            _ => return Err(Status::WrongType),
        };
        self.runnable()?;
        match from {
            Some(from) => self.machine.run_from(from),
            None => self.machine.run(),
        }
        Ok(())
    }

    /// Command 130.
    pub(super) fn step_application(&mut self) -> Result<(), Status> {
        self.runnable()?;
        self.machine.step();
        Ok(())
    }

    /// Command 135.
    pub(super) fn application_status(&self, kind: u8) -> Result<Outcome, Status> {
        let pointer = match kind {
            0 => (self.device.store().downloading().unwrap_or_default() / Command::SIZE) as u16,
            1 => self.machine.counter(),
            2 => return Ok(Outcome::Value(self.machine.registers.accumulator)),
            3 => return Ok(Outcome::Value(self.machine.registers.x)),
            _ => return Err(Status::WrongType),
        };
        let [high, low] = pointer.to_be_bytes();
        // Step by step, a WAIT that a handler has returned to goes on with the next step; until a step is done it is
        // waited for, whatever it is.
        let waits = u8::from(match self.machine.state() {
            ProgramState::Step => self.machine.busy(),
            _ => self.machine.waits(),
        });
        Ok(Outcome::Value(i32::from_be_bytes([self.machine.state() as u8, waits, high, low])))
    }

    /// Command 132. Commands that the same link sends from now on are stored, until command 133.
    pub(super) fn enter_download(&mut self, source: Source, value: i32) -> Result<Outcome, Status> {
        let address = self.address(value)?;
        if self.protected(AGAINST_WRITING) {
            return Err(Status::EepromLocked);
        }
        if self.downloads_elsewhere(source) || !self.device.store().takes_download() {
            return Err(Status::NotAvailable);
        }
        self.machine.stop();
        self.downloader = Some(source);
        self.device.store_mut().begin_download(usize::from(address).saturating_mul(Command::SIZE));
        Ok(Outcome::stored(value))
    }

    /// During a download: stores a command in place of executing it.
    pub(super) fn download(&mut self, command: Command) -> Result<Outcome, Status> {
        if self.protected(AGAINST_WRITING) {
            Err(Status::EepromLocked)
        } else if self.device.store_mut().download(&command.to_bytes()) {
            Ok(Outcome::Special(Reply::echo(Status::Loaded, command)))
        } else {
            Err(Status::InvalidValue)
        }
    }

    /// True while this link downloads.
    pub(super) fn downloads_here(&self, source: Source) -> bool {
        self.device.store().downloading().is_some() && !self.downloads_elsewhere(source)
    }

    /// Command 133. Only the link that downloads can end the download: it alone knows that all commands have come.
    pub(super) fn exit_download(&mut self, source: Source, value: i32) -> Result<Outcome, Status> {
        if self.downloads_elsewhere(source) {
            return Err(Status::NotAvailable);
        }
        let unfinished = matches!(self.device.store().integrity(), Integrity::Incomplete | Integrity::BeingErased(_));
        if self.device.store().downloading().is_none() && unfinished {
            return Err(Status::NotAvailable);
        }
        self.device.store_mut().end_download();
        if !self.machine.runs() {
            self.machine.rewind();
        }
        Ok(Outcome::written(value))
    }

    /// True while another link downloads. If that link's host has vanished, command 255 ends the download.
    fn downloads_elsewhere(&self, source: Source) -> bool {
        self.device.store().downloading().is_some() && self.downloader.is_some_and(|link| link != source)
    }

    /// Command 134. A command of a read-protected program reads as an empty one.
    pub(super) fn read_memory(&self, value: i32) -> Result<Outcome, Status> {
        let command = self.program_command(self.address(value)?).unwrap_or_default();
        let shown = if self.protected(AGAINST_READING) { Command::default() } else { command };
        Ok(Outcome::Special(Reply::Memory(shown)))
    }

    /// True if writing this value to global parameter 81 takes the read protection off, so that the program is erased.
    pub(super) fn uncovers(&self, protection: i32) -> bool {
        self.protected(AGAINST_READING) && protection & AGAINST_READING == 0
    }

    /// At the start and when the supply is back: starts the program if parameter 77 says so.
    pub(super) fn autostart(&mut self) {
        // Before a restart no program starts: a host that wanted to stop it would not be heard any more.
        if self.device.is_locked() || self.device.restart().is_some() || !core::mem::take(&mut self.starts) {
            return;
        }
        if self.global(G::AutoStart) != 0 && self.runnable().is_ok() {
            self.machine.reset();
            self.machine.run();
        }
    }

    /// Tells the program what the axes, stop switches and inputs have done since the last millisecond, and lets it spend
    /// anew.
    pub(super) fn begin_turn(&mut self) {
        let mut signals = core::mem::take(&mut self.signals);
        for number in 0..AXES {
            let [left, right] = self.device.stop_switches(number).unwrap_or_default();
            signals.stop_switches(number as u8, left, right);
        }
        signals.inputs(self.device.inputs().digital);
        let (turn, runs) = (self.device.turn(), self.machine.runs());
        self.machine.interrupts.look(turn, signals, runs);
        self.fuel = FUEL;
    }

    /// Executes commands until the slice is used up, or the program has nothing more to do in this
    /// millisecond. Never inlined: pieces of a turn are not to have its stack frame.
    #[inline(never)]
    pub(super) fn run_slice(&mut self, now: Micros) {
        let (turn, mut slice) = (self.device.turn(), SLICE);
        while self.machine.busy() && self.fuel > 0 && slice > 0 {
            if self.machine.waits() && self.is_over() || self.machine.enter_handler(turn) {
                continue;
            }
            if self.machine.waits() {
                // Nothing changes before the next millisecond.
                self.fuel = 0;
                return;
            }
            let counter = self.machine.counter();
            let Some(command) = self.program_command(counter) else { return self.machine.end() };
            if vm::is_brief(command.opcode) {
                let executed = self.burst(now, slice);
                slice = slice.saturating_sub(executed);
                if executed > 0 {
                    continue;
                }
            }
            let instruction = Instruction::numbered(command.opcode);
            let cost = if instruction.is_some_and(|instruction| instruction.chip) { CHIP_COST } else { 1 };
            let length = if cost > 1 && !self.is_known(command) { SLICE } else { LONGER };
            if length > slice {
                return;
            }
            slice = slice.saturating_sub(length);
            let Some(left) = self.fuel.checked_sub(cost) else {
                self.fuel = 0;
                return;
            };
            self.fuel = left;
            let handler = self.machine.handles();
            let refused = self.run_command(now, turn, instruction, command).err();
            let executed = Executed { at: now, address: counter, command, handler, refused };
            self.hooks.executed(&executed, &self.machine.registers, self.machine.errors);
        }
    }

    /// True for a GAP that reads a value that was set, so that no chip has to be asked.
    fn is_known(&self, command: Command) -> bool {
        let is_setting = |found: &Parameter<AxisParameter>| found.function.index() < AxisParameter::SETTINGS;
        command.opcode == Opcode::Gap as u8 && self.spec().axis.find(command.kind).is_some_and(is_setting)
    }

    /// Executes commands that need the interpreter and the user variables alone, as far as the slice and the fuel of
    /// this millisecond go. Returns how many there were, each of which costs one unit. Never inlined: the registers of
    /// the processor are to be the interpreter's alone.
    #[inline(never)]
    fn burst(&mut self, now: Micros, slice: u32) -> u32 {
        let Module { machine, device, variables, hooks, fuel, .. } = self;
        let (program, _) = device.store().program().as_chunks();
        let most = if T::Hooks::BURSTS { slice.min(*fuel) } else { 1 };
        let (handler, errors) = (machine.handles(), machine.errors);
        let done = machine.burst(program, variables, most, |address, command, refused, registers| {
            hooks.executed(&Executed { at: now, address, command, handler, refused }, registers, errors);
        });
        *fuel = fuel.saturating_sub(done);
        done
    }

    /// Executes a command of the program. One that is refused has no effect, and the program goes on.
    fn run_command(
        &mut self,
        now: Micros,
        turn: Micros,
        instruction: Option<&Instruction>,
        command: Command,
    ) -> Result<(), Status> {
        if command.opcode == 0 {
            self.machine.end();
            return Ok(());
        }
        let done = match instruction {
            Some(instruction) if self.machine.execute(turn, instruction.opcode, command) => return Ok(()),
            Some(instruction) if instruction.program => self.perform(now, instruction, command),
            Some(_) => Err(Status::NotAvailable),
            None => Err(Status::InvalidCommand),
        };
        self.changed |= !matches!(done, Ok(Outcome::Read(_)));
        match done {
            Ok(Outcome::Read(value)) => self.machine.registers.load(value),
            Ok(Outcome::Stored { need, undo, .. }) if !self.device.store().settled(need) => {
                let waiting = Waiting { from: Waiter::Program, command, need, value: 0, undo, suppressed: true };
                self.forget_stores();
                if self.machine.runs() && self.waiting.push(waiting).is_ok() {
                    self.machine.wait_for_store();
                    // The rest of the millisecond is the store's.
                    self.fuel = 0;
                    return Ok(());
                }
            }
            // A vector that points outside program memory ends the program, like a jump to there.
            Err(Status::InvalidValue) if command.opcode == Opcode::Vect as u8 => self.machine.end(),
            _ => {}
        }
        // A program that has erased itself by its last command does not run any more.
        if self.machine.runs() {
            self.machine.next();
        }
        done.map(|_| ())
    }

    /// Ends the program's wait if its event has come or its time is over; true if so. Never inlined: most programs do
    /// not wait most of the time.
    #[inline(never)]
    fn is_over(&mut self) -> bool {
        let Some(Wait::For { awaited, motor, until }) = self.machine.wait() else { return false };
        let axis = self.device.axes().get(usize::from(motor));
        let come = match (awaited, axis) {
            (Awaited::Ticks, _) => false,
            (Awaited::Position, Some(axis)) => axis.at_target(),
            (Awaited::ReferenceSwitch, Some(axis)) => axis.home_switch(),
            (Awaited::LimitSwitch, Some(_)) => {
                self.device.stop_switches(motor.into()).is_some_and(|switches| switches.contains(&true))
            }
            (Awaited::ReferenceSearch, Some(axis)) => axis.search_status() == 0,
            // WAIT with the number of a motor that the product does not have: the command has no effect.
            (_, None) => true,
        };
        let over = come || until.is_some_and(|until| self.device.turn() >= until);
        if over {
            self.machine.waited(awaited, come);
        }
        over
    }
}
