//! The program counter and the commands that move it: jumps, calls, WAIT, STOP, handlers of interrupts (manual sections
//! 3.7.17 to 3.7.23, 3.7.35), run and step.

use heapless::Vec;

use super::{Condition, ErrorFlag, Errors, Interrupts, Registers};
use crate::tmcl::{Command, Opcode, Status};
use crate::units::Micros;

/// Nested subroutine calls (manual section 3.7.20).
const STACK: usize = 8;
/// Length of a tick of WAIT (manual section 3.7.22).
const TICK_MS: u64 = 10;

/// What the program is doing, as global parameter 128 tells it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ProgramState {
    /// It has ended or has been stopped.
    #[default]
    Stop = 0,
    /// It runs.
    Run = 1,
    /// It is executed command by command.
    Step = 2,
    /// It has been reset.
    Reset = 3,
}

/// The event of a WAIT, by its type number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Awaited {
    /// TICKS: the time alone.
    Ticks,
    /// POS: the target position.
    Position,
    /// REFSW: the reference switch.
    ReferenceSwitch,
    /// LIMSW: a limit switch.
    LimitSwitch,
    /// RFS: the end of the reference search.
    ReferenceSearch,
}

/// Why the program does not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// A WAIT command.
    For {
        /// The event, or the time alone.
        awaited: Awaited,
        /// The axis whose event it is.
        motor: u8,
        /// The end of the time-out; without one the WAIT may last for ever.
        until: Option<Micros>,
    },
    /// The value that a command stores is not durable in the EEPROM yet.
    Store,
}

/// What a handler interrupts, saved for RETI.
#[derive(Clone, Copy, Debug)]
struct Interrupted {
    registers: Registers,
    counter: u16,
    wait: Option<Wait>,
    at: Micros,
    /// Return addresses on the stack when the handler began: those that it leaves there are dropped.
    depth: usize,
}

/// The state of the interpreter.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Accumulator, X register, arithmetic flags.
    pub registers: Registers,
    /// Error flags.
    pub errors: Errors,
    /// Interrupts.
    pub interrupts: Interrupts,
    /// How many commands program memory holds.
    size: u16,
    state: ProgramState,
    counter: u16,
    stack: Vec<u16, STACK>,
    wait: Option<Wait>,
    /// While a handler runs: the state to which RETI returns.
    interrupted: Option<Interrupted>,
    /// A handler has just ended: one command of the program is executed before the next handler begins.
    returned: bool,
    /// In the state [`ProgramState::Step`]: a command is to be executed.
    stepping: bool,
}

impl Machine {
    /// The interpreter of a memory of so many commands, before it runs.
    pub fn new(size: u16) -> Self {
        Machine {
            registers: Registers::default(),
            errors: Errors::default(),
            interrupts: Interrupts::default(),
            size,
            state: ProgramState::default(),
            counter: 0,
            stack: Vec::new(),
            wait: None,
            interrupted: None,
            returned: false,
            stepping: false,
        }
    }

    /// What the program is doing.
    pub const fn state(&self) -> ProgramState {
        self.state
    }

    /// Address of the current command.
    pub const fn counter(&self) -> u16 {
        self.counter
    }

    /// Why the program does not go on with the next command, if it does not.
    pub const fn wait(&self) -> Option<Wait> {
        self.wait
    }

    /// True while the program does not go on with the next command.
    pub const fn waits(&self) -> bool {
        self.wait.is_some()
    }

    /// True while events count: the program runs, or is stepped through.
    pub const fn runs(&self) -> bool {
        matches!(self.state, ProgramState::Run | ProgramState::Step)
    }

    /// True while there is something to be executed, or waited for.
    pub const fn busy(&self) -> bool {
        matches!(self.state, ProgramState::Run) || self.stepping
    }

    /// True in the handler of an interrupt.
    pub const fn handles(&self) -> bool {
        self.interrupted.is_some()
    }

    /// Command 129, type 0: starts, or goes on where the program was stopped.
    pub fn run(&mut self) {
        self.state = ProgramState::Run;
        self.stepping = false;
    }

    /// Command 129, type 1: starts a routine. Calls and handlers that were left halfway are forgotten; registers,
    /// enables and vectors stay.
    pub fn run_from(&mut self, address: u16) {
        self.stack.clear();
        self.interrupted = None;
        self.go_to(address);
        self.run();
    }

    /// Command 130: executes one command.
    pub fn step(&mut self) {
        self.state = ProgramState::Step;
        self.stepping = true;
    }

    /// Stops the program where it is (command 128, low supply, or a motion controller that does not answer). Program
    /// counter, subroutine stack and handler stay, so [`Machine::run`] goes on from here; a WAIT that is left begins
    /// anew then.
    pub fn stop(&mut self) {
        self.state = ProgramState::Stop;
        self.stepping = false;
        self.wait = None;
        // Pending events are dropped now, and not with the next look at them: the program may go on before that.
        self.interrupts.forget();
    }

    /// The program has come to its end, so [`Machine::run`] starts it again. Host software lives by that: it runs a
    /// program that ends by STOP again and again with command 129, type 0.
    pub fn end(&mut self) {
        self.stop();
        self.rewind();
    }

    /// Takes a program that stands back to its first command: program counter 0, subroutine stack and handler are
    /// forgotten; registers, error flags, interrupt enables and vectors stay.
    pub fn rewind(&mut self) {
        self.counter = 0;
        self.stack.clear();
        self.interrupted = None;
        self.returned = false;
    }

    /// Command 131: everything as after power-on but bank 3.
    pub fn reset(&mut self) {
        let mut interrupts = core::mem::take(&mut self.interrupts);
        interrupts.reset();
        *self = Machine { interrupts, state: ProgramState::Reset, ..Self::new(self.size) };
    }

    /// Goes to the handler of an interrupt, if one is due and may run: between two commands, in a WAIT, or while
    /// a value is being stored. Going there is a step of its own, so that a user who steps through the program sees
    /// where the handler begins. True if the program is in a handler now that it was not in before.
    pub fn enter_handler(&mut self, now: Micros) -> bool {
        let turn = self.returned && self.wait.is_none();
        if turn || self.interrupted.is_some() {
            return false;
        }
        let Some(handler) = self.interrupts.take() else { return false };
        self.interrupted = Some(Interrupted {
            registers: self.registers,
            counter: self.counter,
            wait: self.wait.take(),
            at: now,
            depth: self.stack.len(),
        });
        self.counter = handler;
        self.stepping = false;
        true
    }

    /// Goes on with the next command, now that one is done.
    pub fn next(&mut self) {
        self.go_to(self.counter.saturating_add(1));
    }

    /// Waits until the value that the command stores is durable.
    pub fn wait_for_store(&mut self) {
        self.wait = Some(Wait::Store);
    }

    /// For how many values the program waits to be durable: at most one of the present command, and one of the command
    /// that a handler has interrupted.
    pub fn stores(&self) -> usize {
        let interrupted = self.interrupted.and_then(|interrupted| interrupted.wait);
        [self.wait, interrupted].into_iter().filter(|wait| *wait == Some(Wait::Store)).count()
    }

    /// The values that the program stores are durable, or cannot be; also one that was to be stored before a handler
    /// began.
    pub fn stored(&mut self) {
        if self.wait == Some(Wait::Store) {
            self.next();
        }
        if let Some(interrupted) = self.interrupted.as_mut().filter(|i| i.wait == Some(Wait::Store)) {
            interrupted.wait = None;
            interrupted.counter = interrupted.counter.saturating_add(1);
        }
    }

    /// A WAIT is over; `in_time` if its event has come, and not the end of its time-out.
    pub fn waited(&mut self, awaited: Awaited, in_time: bool) {
        if !in_time && awaited != Awaited::Ticks {
            self.errors.raise(ErrorFlag::Timeout);
        }
        self.next();
    }

    /// Executes a command that needs no more than the interpreter's own state. `None` for any other command.
    ///
    /// # Errors
    /// The command is refused, and the program goes on with the next one.
    pub fn execute(&mut self, now: Micros, opcode: Opcode, command: Command) -> Option<Result<(), Status>> {
        let Command { kind, motor, value, .. } = command;
        match opcode {
            Opcode::Calc => {
                let done = self.registers.calc(kind, value);
                self.next();
                return Some(done);
            }
            Opcode::Calcx => {
                let done = self.registers.calcx(kind);
                self.next();
                return Some(done);
            }
            Opcode::Comp => {
                self.registers.compare(value);
                self.next();
            }
            Opcode::Jc => match Condition::from_number(kind) {
                Some(condition) if self.registers.meets(condition, self.errors) => self.jump(value),
                _ => self.next(),
            },
            Opcode::Ja => self.jump(value),
            Opcode::Csub if self.stack.is_full() => self.next(),
            Opcode::Csub => {
                if address(value, self.size).is_some() {
                    // There is room.
                    let _ = self.stack.push(self.counter.saturating_add(1));
                }
                self.jump(value);
            }
            Opcode::Rsub => match self.stack.pop() {
                Some(back) => self.go_to(back),
                None => self.next(),
            },
            Opcode::Wait => match self.wait_of(now, kind, motor, value) {
                Some(wait) => self.wait = Some(wait),
                None => self.next(),
            },
            Opcode::Stop => self.end(),
            Opcode::Reti => match self.interrupted.take() {
                Some(interrupted) => self.return_to(now, interrupted),
                None => self.next(),
            },
            _ => return None,
        }
        Some(Ok(()))
    }

    /// Goes to an address; a jump out of program memory ends the program.
    fn jump(&mut self, to: i32) {
        match address(to, self.size) {
            Some(to) => self.arrive(to),
            None => self.end(),
        }
    }

    /// Goes on at an address. Running off the end of program memory ends the program.
    fn go_to(&mut self, address: u16) {
        self.arrive(address);
        if address >= self.size {
            self.end();
        }
    }

    /// The next command is the one at an address that is known to be inside.
    fn arrive(&mut self, address: u16) {
        self.counter = address;
        self.wait = None;
        self.returned = false;
        self.stepping = false;
    }

    /// The wait of a WAIT command; `value` is in ticks of 10 ms. The value -1 stands for the accumulator. A time that
    /// is still negative is none: the command has no effect then, as with an unknown type.
    fn wait_of(&self, now: Micros, kind: u8, motor: u8, value: i32) -> Option<Wait> {
        let awaited = match kind {
            0 => Awaited::Ticks,
            1 => Awaited::Position,
            2 => Awaited::ReferenceSwitch,
            3 => Awaited::LimitSwitch,
            4 => Awaited::ReferenceSearch,
            _ => return None,
        };
        let ticks = if value == -1 { self.registers.accumulator } else { value };
        let ticks = u64::try_from(ticks).ok()?;
        let until = (ticks != 0 || awaited == Awaited::Ticks)
            .then(|| now.after(Micros::from_millis(ticks.saturating_mul(TICK_MS))));
        Some(Wait::For { awaited, motor, until })
    }

    /// RETI. A WAIT that was interrupted goes on with the time it had left.
    fn return_to(&mut self, now: Micros, interrupted: Interrupted) {
        let Interrupted { registers, counter, mut wait, at, depth } = interrupted;
        self.stack.truncate(depth);
        self.registers = registers;
        self.counter = counter;
        if let Some(Wait::For { until: Some(until), .. }) = &mut wait {
            *until = now.after(until.since(at));
        }
        self.wait = wait;
        self.returned = true;
        self.stepping = false;
    }
}

/// A value as an address in a program memory of so many commands.
pub fn address(value: i32, commands: u16) -> Option<u16> {
    u16::try_from(value).ok().filter(|address| *address < commands)
}
