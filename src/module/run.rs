//! How a program is executed beside everything else (manual section 3.3).
//!
//! In each millisecond a program may spend 128 units: 16 on a command that talks to the chips, one on any other. So the
//! speed of a program is the same on every host and on the image, and leaves time for the axes and the links. It runs
//! in slices, between which the owner of the module looks at the links. A slice is one command that talks to the chips,
//! or others that take no longer together.

use super::program::{Program, program_command};
use super::waiting::{Waiter, WaitingCommand};
use super::{Executed, Hooks, Module, Platform, Product};
use crate::executor::{Executor, Outcome, check_motor};
use crate::param::{AxisParameter, Parameter};
use crate::tmcl::{Command, Instruction, Opcode, Status};
use crate::units::Micros;
use crate::vm::{self, Awaited, Wait};

/// Cost of a command that talks to the chips.
const CHIP_COST: u32 = 16;
/// The length of a slice: this many commands that need the interpreter alone.
const SLICE: u32 = 32;
/// Share of a slice that any other command takes, if it does not talk to the chips.
const LONGER: u32 = 4;

impl<T: Platform, const AXES: usize> Module<T, AXES> {
    /// Executes commands until the slice is used up, or the program has nothing more to do in this
    /// millisecond. Never inlined: pieces of a turn are not to have its stack frame.
    #[inline(never)]
    pub(super) fn run_slice(&mut self, now: Micros) {
        let (turn, mut slice) = (self.device.turn(), SLICE);
        while self.machine.busy() && self.program.fuel > 0 && slice > 0 {
            if self.machine.waits() && self.is_over() || self.machine.enter_handler(turn) {
                continue;
            }
            if self.machine.waits() {
                // Nothing changes before the next millisecond.
                self.program.fuel = 0;
                return;
            }
            let counter = self.machine.counter();
            let Some(command) = program_command(self.device.store(), counter) else { return self.machine.end() };
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
            let Some(left) = self.program.fuel.checked_sub(cost) else {
                self.program.fuel = 0;
                return;
            };
            self.program.fuel = left;
            let handler = self.machine.handles();
            let refused = self.run_command(now, turn, instruction, command).err();
            let executed = Executed { at: now, address: counter, command, handler, refused };
            self.hooks.executed(&executed, &self.machine.registers, self.machine.errors);
        }
    }

    /// True for a GAP that reads a value that was set, so that no chip has to be asked.
    fn is_known(&self, command: Command) -> bool {
        let is_setting = |found: &Parameter<AxisParameter>| found.function.index() < AxisParameter::SETTINGS;
        command.opcode == Opcode::Gap as u8 && T::Product::SPEC.axis.find(command.kind).is_some_and(is_setting)
    }

    /// Executes commands that need the interpreter and the user variables alone, as far as the slice and the fuel of
    /// this millisecond go. Returns how many there were, each of which costs one unit. Never inlined: the registers of
    /// the processor are to be the interpreter's alone.
    #[inline(never)]
    fn burst(&mut self, now: Micros, slice: u32) -> u32 {
        let Module { machine, device, executor, hooks, program: Program { fuel, .. }, .. } = self;
        let Executor { variables, .. } = executor;
        let (commands, _) = device.store().program().as_chunks();
        let most = if T::Hooks::BURSTS { slice.min(*fuel) } else { 1 };
        let (handler, errors) = (machine.handles(), machine.errors);
        let done = machine.burst(commands, variables, most, |address, command, refused, registers| {
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
            Some(instruction) if instruction.program => self.act_for_program(now, instruction, command),
            Some(_) => Err(Status::NotAvailable),
            None => Err(Status::InvalidCommand),
        };
        self.changed |= !matches!(done, Ok(Outcome::Read(_)));
        match done {
            Ok(Outcome::Read(value)) => self.machine.registers.load(value),
            Ok(Outcome::Stored { need, undo, .. }) if !self.device.store().settled(need) => {
                let waiting = WaitingCommand { from: Waiter::Program, command, need, value: 0, undo, suppressed: true };
                self.waiting.forget_stores(&self.machine);
                if self.machine.runs() && self.waiting.push(waiting) {
                    self.machine.wait_for_store();
                    // The rest of the millisecond is the store's.
                    self.program.fuel = 0;
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

    /// Carries out a command of the program that is not the interpreter's own. GAP goes a short way, as that of a link
    /// does.
    fn act_for_program(&mut self, now: Micros, instruction: &Instruction, command: Command) -> Result<Outcome, Status> {
        check_motor::<T::Product, AXES>(instruction, command.motor)?;
        match instruction.opcode {
            Opcode::Gap => self.readings(now).get_axis(command.kind, command.motor).map(Outcome::Read),
            opcode => self.perform(now, opcode, command),
        }
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
