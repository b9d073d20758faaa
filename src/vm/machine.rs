//! The interpreter's state, and the commands that change the course of the program: WAIT, STOP and RETI (manual
//! sections 3.7.22, 3.7.23, 3.7.35). Run, step, stop and reset of the program are here, too.

use heapless::Vec;

use super::{ErrorFlag, Errors, Interrupts, Registers};
use crate::tmcl::{Command, Opcode};
use crate::units::Micros;

/// Largest depth of nested subroutine calls (manual section 3.7.20).
const STACK: usize = 8;
/// Length of a tick of WAIT in milliseconds (manual section 3.7.22).
const TICK_MS: u64 = 10;

/// State of the program, numbered as in global parameter 128.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum ProgramState {
    /// The program has ended or has been stopped.
    #[default]
    Stop = 0,
    /// The program runs.
    Run = 1,
    /// A host executes the program command by command.
    Step = 2,
    /// The program has been reset.
    Reset = 3,
}

/// The event that a WAIT waits for, in the order of the type numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Awaited {
    /// TICKS: the time has passed.
    Ticks,
    /// POS: the axis has reached its target position.
    Position,
    /// REFSW: the home switch is active.
    ReferenceSwitch,
    /// LIMSW: a stop switch is active.
    LimitSwitch,
    /// RFS: the end of the reference search.
    ReferenceSearch,
}

/// Why the program does not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// A WAIT command.
    For {
        /// The event that ends the WAIT.
        awaited: Awaited,
        /// The axis of the event.
        motor: u8,
        /// End of the time-out; `None` if the WAIT has no time-out.
        until: Option<Micros>,
    },
    /// A storing command, until its value is durable in the EEPROM.
    Store,
}

/// The state that an interrupt handler has interrupted, saved for RETI.
#[derive(Clone, Copy, Debug)]
struct Interrupted {
    registers: Registers,
    counter: u16,
    wait: Option<Wait>,
    /// When the handler began.
    at: Micros,
    /// Number of return addresses on the stack when the handler began. RETI drops those that the handler has added.
    depth: usize,
}

/// The state of the interpreter.
#[derive(Clone, Debug)]
pub struct Machine {
    /// Accumulator, X register, arithmetic flags.
    pub registers: Registers,
    /// Error flags.
    pub errors: Errors,
    /// Settings and state of the interrupts.
    pub interrupts: Interrupts,
    /// Size of program memory, in commands.
    size: u16,
    state: ProgramState,
    pub(super) counter: u16,
    pub(super) stack: Vec<u16, STACK>,
    wait: Option<Wait>,
    /// The state to which RETI returns; `None` while no handler runs.
    interrupted: Option<Interrupted>,
    /// True after a RETI until a command of the program has been executed: no other handler begins before, so that the
    /// program goes on however many interrupts are pending.
    returned: bool,
    /// In the state [`ProgramState::Step`]: true until the command that command 130 asks for has been executed.
    stepping: bool,
}

impl Machine {
    /// An interpreter that is stopped at address 0 of a program memory of `size` commands.
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

    /// State of the program.
    pub const fn state(&self) -> ProgramState {
        self.state
    }

    /// Program counter: the address of the present command, in commands from 0.
    #[inline]
    pub const fn counter(&self) -> u16 {
        self.counter
    }

    /// Command 135. With type 0 it gives the state of the program, whether it waits, and `loaded`, the address to which
    /// the next command of a download goes. With type 1 it gives the program counter in place of `loaded`; with types 2
    /// and 3 accumulator and X register. `None` for other types.
    pub fn status(&self, kind: u8, loaded: u16) -> Option<i32> {
        let pointer = match kind {
            0 => loaded,
            1 => self.counter,
            2 => return Some(self.registers.accumulator),
            3 => return Some(self.registers.x),
            _ => return None,
        };
        let [high, low] = pointer.to_be_bytes();
        // Step by step, a WAIT that a handler has returned to goes on with the next step; until a step is done it is
        // waited for, whatever it is.
        let waits = if self.state == ProgramState::Step { self.stepping } else { self.waits() };
        Some(i32::from_be_bytes([self.state as u8, u8::from(waits), high, low]))
    }

    /// The condition that the program waits for before the next command; `None` while the program does not wait.
    pub const fn wait(&self) -> Option<Wait> {
        self.wait
    }

    /// True while the program waits before the next command.
    #[inline]
    pub const fn waits(&self) -> bool {
        self.wait.is_some()
    }

    /// True while events raise interrupts: the program runs or is stepped through.
    #[inline]
    pub const fn runs(&self) -> bool {
        matches!(self.state, ProgramState::Run | ProgramState::Step)
    }

    /// True while a command is to be executed or the program waits.
    #[inline]
    pub const fn busy(&self) -> bool {
        matches!(self.state, ProgramState::Run) || self.stepping
    }

    /// The time before which a program that waits, or that does not run, does nothing by itself. Only an event of an
    /// axis or an input can end its wait before. `None` while it has something to do.
    pub fn calm_until(&self) -> Option<Micros> {
        match self.wait {
            _ if !self.runs() => Some(Micros(u64::MAX)),
            Some(Wait::For { until, .. }) if !self.stepping => {
                let timers = self.interrupts.calm_until()?;
                Some(until.map_or(timers, |until| until.min(timers)))
            }
            _ => None,
        }
    }

    /// True while the handler of an interrupt runs.
    #[inline]
    pub const fn handles(&self) -> bool {
        self.interrupted.is_some()
    }

    /// True if another command may not follow the present one at once: a host steps through the program, or an
    /// interrupt is pending and no handler runs. While this is false only a new millisecond or a command can make it
    /// true.
    #[inline]
    pub(super) const fn may_be_interrupted(&self) -> bool {
        self.stepping || self.interrupted.is_none() && self.interrupts.wanted()
    }

    /// Command 129, type 0: starts the program, or goes on where the program was stopped.
    pub fn run(&mut self) {
        self.state = ProgramState::Run;
        self.stepping = false;
    }

    /// Command 129, type 1: starts the program at an address. Return addresses and an interrupted state are dropped;
    /// registers, interrupt enables and vectors stay.
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

    /// Stops the program at the present command (command 128, low supply, or a motion controller that does not answer).
    /// Program counter, return addresses and interrupted state stay, so [`Machine::run`] goes on from here; a WAIT that
    /// was not over begins anew then.
    pub fn stop(&mut self) {
        self.state = ProgramState::Stop;
        self.stepping = false;
        self.wait = None;
        // Pending interrupts are dropped at once, because the program may go on before the next millisecond.
        self.interrupts.forget();
    }

    /// Ends the program, so that [`Machine::run`] starts it again from the beginning. Host software relies on that: it
    /// repeats a program that ends with STOP by command 129, type 0.
    pub fn end(&mut self) {
        self.stop();
        self.rewind();
    }

    /// Takes a stopped program back to address 0 and drops return addresses and interrupted state. Registers, error
    /// flags, interrupt enables and vectors stay.
    pub fn rewind(&mut self) {
        self.counter = 0;
        self.stack.clear();
        self.interrupted = None;
        self.returned = false;
    }

    /// Command 131: the state after power-on; only the parameters of bank 3 stay.
    pub fn reset(&mut self) {
        let mut interrupts = core::mem::take(&mut self.interrupts);
        interrupts.reset();
        *self = Machine { interrupts, state: ProgramState::Reset, ..Self::new(self.size) };
    }

    /// Goes to the handler of a pending interrupt if a handler may begin: between two commands, in a WAIT, or while a
    /// value is being stored. Going to the handler counts as a step of its own, so that a user who steps through the
    /// program sees where the handler begins. True if a handler has begun.
    #[inline(always)]
    pub fn enter_handler(&mut self, now: Micros) -> bool {
        self.interrupts.wanted() && self.begin_handler(now)
    }

    /// A function of its own, marked as cold: it is asked before every command whether a handler is to begin.
    #[cold]
    fn begin_handler(&mut self, now: Micros) -> bool {
        let command_first = self.returned && self.wait.is_none();
        if command_first || self.interrupted.is_some() {
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

    /// Goes on with the next command, because the present command is done.
    pub fn next(&mut self) {
        self.go_to(self.counter.saturating_add(1));
    }

    /// Lets the program wait until the value that the present command stores is durable.
    pub fn wait_for_store(&mut self) {
        self.wait = Some(Wait::Store);
    }

    /// Number of storing commands whose values are not durable yet, 0..=2: the present command, and the one that a
    /// handler has interrupted.
    pub fn stores(&self) -> usize {
        let interrupted = self.interrupted.and_then(|interrupted| interrupted.wait);
        [self.wait, interrupted].into_iter().filter(|wait| *wait == Some(Wait::Store)).count()
    }

    /// Ends the wait of all storing commands, because their values are durable or could not be stored. This includes a
    /// command that a handler has interrupted.
    pub fn stored(&mut self) {
        if self.wait == Some(Wait::Store) {
            self.next();
        }
        if let Some(interrupted) = self.interrupted.as_mut().filter(|i| i.wait == Some(Wait::Store)) {
            interrupted.wait = None;
            interrupted.counter = interrupted.counter.saturating_add(1);
        }
    }

    /// Ends a WAIT. `in_time` is true if the event has come, false if the time-out has passed.
    pub fn waited(&mut self, awaited: Awaited, in_time: bool) {
        if !in_time && awaited != Awaited::Ticks {
            self.errors.raise(ErrorFlag::Timeout);
        }
        self.next();
    }

    /// Executes WAIT, STOP or RETI. False for any other command.
    pub fn execute(&mut self, now: Micros, opcode: Opcode, command: Command) -> bool {
        let Command { kind, motor, value, .. } = command;
        match opcode {
            Opcode::Wait => match self.wait_of(now, kind, motor, value) {
                Some(wait) => self.wait = Some(wait),
                None => self.next(),
            },
            Opcode::Stop => self.end(),
            Opcode::Reti => match self.interrupted.take() {
                Some(interrupted) => self.return_to(now, interrupted),
                None => self.next(),
            },
            _ => return false,
        }
        true
    }

    /// Goes on at an address. The program ends if the address lies behind program memory.
    pub(super) fn go_to(&mut self, address: u16) {
        self.arrive(address);
        if address >= self.size {
            self.end();
        }
    }

    /// Makes the command at an address the present command.
    fn arrive(&mut self, address: u16) {
        self.counter = address;
        self.wait = None;
        self.returned = false;
        self.stepping = false;
    }

    /// The wait of a WAIT command. `value` is the time in ticks of 10 ms; -1 stands for the value of the accumulator.
    /// `None`, so that the command has no effect, for an unknown type or a negative time.
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

    /// RETI: returns to the interrupted state. A WAIT in that state goes on with the time that was left when the
    /// handler began.
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

/// The address with this value; `None` if it lies outside a program memory of `commands` commands.
pub fn address(value: i32, commands: u16) -> Option<u16> {
    u16::try_from(value).ok().filter(|address| *address < commands)
}
