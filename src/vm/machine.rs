//! The program counter and what moves it: jumps, calls, WAIT, STOP, handlers (manual sections 3.7.17 to 3.7.23,
//! 3.7.35), run and step.

use heapless::Vec;

use super::{Condition, ErrorFlag, Errors, Interrupts, Registers};
use crate::tmcl::{Command, Opcode, Status};
use crate::units::Micros;

/// Nested subroutine calls (manual section 3.7.20).
const STACK: usize = 8;
/// Length of a tick of WAIT (manual section 3.7.22).
const TICK_MS: u64 = 10;

/// What the program is doing: the values of global parameter 128.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Mode {
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

/// What a WAIT waits for, by its type number.
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
        /// What for.
        awaited: Awaited,
        /// Of which motor.
        motor: u8,
        /// When it ends whatever happens.
        until: Option<Micros>,
    },
    /// What a command stores is not durable yet.
    Store,
}

/// What an interrupt has interrupted.
#[derive(Clone, Copy, Debug)]
struct Interrupted {
    registers: Registers,
    counter: u16,
    wait: Option<Wait>,
    at: Micros,
    /// Return addresses on the stack: what a handler leaves there goes with it.
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
    mode: Mode,
    counter: u16,
    stack: Vec<u16, STACK>,
    wait: Option<Wait>,
    /// What goes on after the handler that runs.
    interrupted: Option<Interrupted>,
    /// A handler has just ended: the program gets its turn before the next one.
    returned: bool,
    /// In mode step: a command is to be executed.
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
            mode: Mode::default(),
            counter: 0,
            stack: Vec::new(),
            wait: None,
            interrupted: None,
            returned: false,
            stepping: false,
        }
    }

    /// What the program is doing.
    pub const fn mode(&self) -> Mode {
        self.mode
    }

    /// Address of the current command.
    pub const fn counter(&self) -> u16 {
        self.counter
    }

    /// Why the program does not go on with the next command, if it does not.
    pub const fn wait(&self) -> Option<Wait> {
        self.wait
    }

    /// True while it does not go on with the next command.
    pub const fn waits(&self) -> bool {
        self.wait.is_some()
    }

    /// True while events count: the program runs, or is stepped through.
    pub const fn runs(&self) -> bool {
        matches!(self.mode, Mode::Run | Mode::Step)
    }

    /// True while there is something to be executed, or waited for.
    pub const fn busy(&self) -> bool {
        matches!(self.mode, Mode::Run) || self.stepping
    }

    /// True in the handler of an interrupt.
    pub const fn handles(&self) -> bool {
        self.interrupted.is_some()
    }

    /// Command 129, type 0: starts, or goes on where the program was stopped.
    pub fn run(&mut self) {
        self.mode = Mode::Run;
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
        self.mode = Mode::Step;
        self.stepping = true;
    }

    /// Stops the program where it is (command 128, and what stops it from outside). Program counter, subroutine stack and
    /// handler stay, so [`Machine::run`] goes on from here; a WAIT that is left begins anew then.
    pub fn stop(&mut self) {
        self.mode = Mode::Stop;
        self.stepping = false;
        self.wait = None;
        // Now, and not with the next look: it may go on before that.
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
        *self = Machine { interrupts, mode: Mode::Reset, ..Self::new(self.size) };
    }

    /// Goes to the handler of an interrupt, if one is due and may run: between two commands, in a WAIT, or while
    /// something is being stored. That is a step of its own, so that who goes step by step sees where the handler
    /// begins. True if it went there.
    pub fn interrupt(&mut self, now: Micros) -> bool {
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

    /// The command is done: goes on with the next one.
    pub fn next(&mut self) {
        self.go_to(self.counter.saturating_add(1));
    }

    /// Waits until what the command stores is durable.
    pub fn wait_for_store(&mut self) {
        self.wait = Some(Wait::Store);
    }

    /// For how many stores it waits: its own, and that which a handler has interrupted.
    pub fn stores(&self) -> usize {
        let interrupted = self.interrupted.and_then(|interrupted| interrupted.wait);
        [self.wait, interrupted].into_iter().filter(|wait| *wait == Some(Wait::Store)).count()
    }

    /// What was to be stored is durable, or cannot be; also what was to be stored before a handler began.
    pub fn stored(&mut self) {
        if self.wait == Some(Wait::Store) {
            self.next();
        }
        if let Some(interrupted) = self.interrupted.as_mut().filter(|i| i.wait == Some(Wait::Store)) {
            interrupted.wait = None;
            interrupted.counter = interrupted.counter.saturating_add(1);
        }
    }

    /// A WAIT is over; `in_time` if what it waited for has come.
    pub fn waited(&mut self, awaited: Awaited, in_time: bool) {
        if !in_time && awaited != Awaited::Ticks {
            self.errors.raise(ErrorFlag::Timeout);
        }
        self.next();
    }

    /// Executes a command that needs no more than what is in here. `None` if it is another one.
    ///
    /// # Errors
    /// It is refused, and the program goes on with the next one.
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

    /// Goes to an address; a jump to where there is none ends the program.
    fn jump(&mut self, to: i32) {
        match address(to, self.size) {
            Some(to) => self.arrive(to),
            None => self.end(),
        }
    }

    /// The command is done. Running off the end of program memory ends the program.
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

    /// A time of -1 is in the accumulator; a negative one is none, and the command has no effect.
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
