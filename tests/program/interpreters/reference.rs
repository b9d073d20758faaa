//! A second interpreter for TMCL programs, written from the manual alone (TMCM-1140 TMCL firmware manual V1.42,
//! sections 3.3, 3.5, 3.6, 3.7, 5 and 8), to check the firmware's interpreter against. It is as simple as possible and
//! not fast: one match on command number, type and motor or bank. What no arm takes fails.
//!
//! There is no time and no motor in here. What needs one is handed to a [`World`]; a WAIT stays in
//! [`Machine::waiting`] until the caller ends it. A command that fails changes nothing, and the program goes on.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};

/// Number of commands in program memory.
pub const MEMORY: u16 = 2048;
/// Levels of the subroutine stack (3.7.20).
pub const STACK: usize = 8;
/// The interrupts of table 12, without 255, the global enable.
pub const INTERRUPTS: [u8; 12] = [0, 1, 2, 3, 15, 21, 27, 28, 39, 40, 41, 42];

/// The module around the program: motor, axis parameters, inputs, global parameters of bank 0, user functions.
pub trait World {
    /// Does a command. `Some` is what a reading command has read (GAP, GGP, RFS STATUS, GIO) or the position that CCO
    /// has captured; `None` says that the command failed or has nothing to return. `accumulator` is for AAP and AGP.
    fn command(&mut self, bytes: [u8; 7], accumulator: i32) -> Option<i32>;
}

/// A WAIT that has not ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wait {
    /// 0 TICKS, 1 POS, 2 REFSW, 3 LIMSW, 4 RFS.
    pub condition: u8,
    /// Ticks of 10 ms: how long TICKS lasts, the time limit of the others (0: none).
    pub ticks: i32,
}

/// State that an interrupt saves and RETI restores.
///
/// 3.6.6.2 and 3.7.35 name accumulator, X register, flags and program counter. "Flags" are read as the arithmetic ones
/// (3.7.17: "arithmetic status flags"). The error flags (3.7.31: "internal error flags") are not the program's own.
/// They stay until CLE, so an error that comes up during a handler outlives its RETI, and a CLE in a handler lasts. A
/// WAIT that was interrupted goes on after RETI. Of the subroutine stack its depth is saved; the interrupt enables are
/// not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Context {
    /// A register.
    pub accumulator: i32,
    /// X register.
    pub x: i32,
    /// Zero, equal, greater, less.
    pub flags: [bool; 4],
    /// The next command of the program, or its WAIT.
    pub program_counter: u16,
    /// The WAIT that was interrupted.
    pub waiting: Option<Wait>,
    /// Levels of the subroutine stack; what a handler leaves there goes with it, so that the program goes on as it was.
    pub depth: usize,
}

/// The state of a TMCL program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Machine {
    /// Program memory: number, type, motor or bank, value (most significant byte first).
    pub memory: Vec<[u8; 7]>,
    /// A register.
    pub accumulator: i32,
    /// X register.
    pub x: i32,
    /// Address of the next command, or of the one that waits; 0 at the end of the program.
    pub program_counter: u16,
    /// Return addresses, innermost last.
    pub stack: Vec<u16>,
    /// The last value loaded was zero, or the last comparison had no difference.
    pub zero: bool,
    /// Last comparison: accumulator and operand were equal.
    pub equal: bool,
    /// Last comparison: the accumulator was greater.
    pub greater: bool,
    /// Last comparison: the accumulator was less.
    pub less: bool,
    /// ETO
    pub timeout: bool,
    /// EAL
    pub alarm: bool,
    /// EDV
    pub deviation: bool,
    /// EPO
    pub position: bool,
    /// ESD
    pub shutdown: bool,
    /// The program runs.
    pub running: bool,
    /// The WAIT at the program counter that has not ended.
    pub waiting: Option<Wait>,
    /// User variables, bank 2.
    pub variables: [i32; 256],
    /// Values that STGP stored.
    pub stored: [i32; 56],
    /// Coordinates in RAM (global parameter 84 is taken as 0: they are not stored unless told to).
    pub coordinates: [i32; 21],
    /// Coordinates in EEPROM; number 0 is never used.
    pub stored_coordinates: [i32; 21],
    /// OUT0 and OUT1.
    pub outputs: [bool; 2],
    /// SIO 0, 0, x: the pull-up resistors of the switch inputs.
    pub pull_ups: bool,
    /// Interrupt parameters, bank 3.
    pub interrupt_settings: BTreeMap<u8, i32>,
    /// Interrupts enabled one by one.
    pub enabled: BTreeSet<u8>,
    /// EI 255
    pub globally_enabled: bool,
    /// Addresses of the handlers.
    pub vectors: BTreeMap<u8, u16>,
    /// Events that wait for their handler.
    pub pending: BTreeSet<u8>,
    /// State that the running handler interrupted; `None` outside of handlers.
    pub saved: Option<Context>,
    /// A handler has just ended: the next command is the program's, whatever is pending. A WAIT that goes on is not
    /// one.
    pub returned: bool,
    /// Number of the command that the last step executed, if it did.
    pub executed: Option<u8>,
}

impl Machine {
    /// A machine about to run this program from address 0; the rest of the memory ends the program.
    pub fn new(program: &[[u8; 7]]) -> Machine {
        let mut memory = program.to_vec();
        assert!(memory.len() <= MEMORY as usize, "program too long");
        memory.resize(MEMORY as usize, [0; 7]);
        Machine {
            memory,
            accumulator: 0,
            x: 0,
            program_counter: 0,
            stack: Vec::new(),
            zero: false,
            equal: false,
            greater: false,
            less: false,
            timeout: false,
            alarm: false,
            deviation: false,
            position: false,
            shutdown: false,
            running: true,
            waiting: None,
            variables: [0; 256],
            stored: [0; 56],
            coordinates: [0; 21],
            stored_coordinates: [0; 21],
            outputs: [false; 2],
            pull_ups: true,
            interrupt_settings: [0, 1, 2, 27, 28, 39, 40, 41, 42].map(|number| (number, 0)).into(),
            enabled: BTreeSet::new(),
            globally_enabled: false,
            vectors: BTreeMap::new(),
            pending: BTreeSet::new(),
            saved: None,
            returned: false,
            executed: None,
        }
    }

    /// Executes one command, the first one of a handler if an interrupt is due. Does nothing while the program is
    /// stopped, or waits and is not interrupted.
    pub fn step(&mut self, world: &mut dyn World) {
        self.executed = None;
        if self.running && !(self.returned && self.waiting.is_none()) {
            self.dispatch();
        }
        if self.running && self.waiting.is_none() {
            self.returned = false;
            self.executed = Some(self.memory[self.program_counter as usize][0]);
            let next = self.execute(self.memory[self.program_counter as usize], world);
            self.go_to(next);
        }
    }

    /// An interrupt's event happens. It is remembered, once, if the interrupt is enabled and the program runs.
    pub fn interrupt(&mut self, number: u8) {
        if self.running && self.enabled.contains(&number) {
            self.pending.insert(number);
        }
    }

    /// The condition of the current WAIT is met, or its time limit (if it has one) is reached.
    pub fn finish_wait(&mut self, timed_out: bool) {
        if let Some(wait) = self.waiting.take() {
            self.returned = false;
            if timed_out && wait.condition != 0 && wait.ticks != 0 {
                self.timeout = true;
            }
            self.go_to(self.program_counter + 1);
        }
    }

    /// Goes to the handler of the first interrupt that is due: lowest number first, no nesting (3.6.6.2, 5.4).
    fn dispatch(&mut self) {
        if !self.globally_enabled || self.saved.is_some() {
            return;
        }
        let due = self.pending.iter().copied().find(|number| self.vectors.contains_key(number));
        if let Some(number) = due {
            self.pending.remove(&number);
            self.saved = Some(Context {
                accumulator: self.accumulator,
                x: self.x,
                flags: [self.zero, self.equal, self.greater, self.less],
                program_counter: self.program_counter,
                waiting: self.waiting.take(),
                depth: self.stack.len(),
            });
            self.program_counter = self.vectors[&number];
        }
    }

    /// Executes a command and returns the address of the next one.
    fn execute(&mut self, bytes: [u8; 7], world: &mut dyn World) -> u16 {
        let [number, kind, motor, v3, v2, v1, v0] = bytes;
        let value = i32::from_be_bytes([v3, v2, v1, v0]);
        let here = self.program_counter;
        let next = here + 1;
        match (number, kind, motor) {
            // The end of the program: an unused command, or STOP.
            (0 | 28, _, _) => return self.end(),
            // GAP, GGP in bank 0, RFS STATUS, GIO in banks 0 and 1
            (6 | 10, _, 0) | (13, 2, 0) | (15, _, 0 | 1) => {
                if let Some(read) = world.command(bytes, self.accumulator) {
                    self.load(read);
                }
            }
            // ROR, ROL, MST, MVP, SAP, STAP, RSAP, SGP in bank 0, RFS, AAP, AGP in bank 0, UF0..UF7
            (1..=5 | 7..=9 | 13 | 34 | 35, _, 0) | (4, 2, 255) | (64..=71, _, _) => {
                world.command(bytes, self.accumulator);
            }
            // SGP, AGP
            (9, _, bank) => self.set_global(kind, bank, value),
            (35, _, bank) => self.set_global(kind, bank, self.accumulator),
            // GGP
            (10, _, 2) => self.load(self.variables[kind as usize]),
            (10, _, 3) => {
                if let Some(&setting) = self.interrupt_settings.get(&kind) {
                    self.load(setting);
                }
            }
            // STGP, RSGP
            (11, 0..=55, 2) => self.stored[kind as usize] = self.variables[kind as usize],
            (12, 0..=55, 2) => self.variables[kind as usize] = self.stored[kind as usize],
            // SIO: pull-ups, one output, all outputs
            (14, 0, 0) if (0..=3).contains(&value) => self.pull_ups = value & 1 == 1,
            (14, 0 | 1, 2) if value == 0 || value == 1 => self.outputs[kind as usize] = value == 1,
            (14, 255, 2) => {
                let bits = if value == -1 { self.accumulator } else { value };
                // Of the accumulator the lower bits count, whatever is above them (3.7.14).
                if value == -1 || (0..=255).contains(&bits) {
                    self.outputs = [bits & 1 != 0, bits & 2 != 0];
                }
            }
            // GIO
            (15, 0 | 1, 2) => self.load(i32::from(self.outputs[kind as usize])),
            // CALC
            (19, 0..=8, _) => self.load(calculate(kind, self.accumulator, value)),
            (19, 9, _) => self.load(value),
            // COMP
            (20, _, _) => {
                self.zero = self.accumulator == value;
                self.equal = self.accumulator == value;
                self.greater = self.accumulator > value;
                self.less = self.accumulator < value;
            }
            // JC, JA
            (21, _, _) if !self.condition(kind) => {}
            (21 | 22, _, _) => return address(value).unwrap_or_else(|| self.end()),
            // CSUB, RSUB
            (23, _, _) if self.stack.len() < STACK => {
                let Some(target) = address(value) else {
                    return self.end();
                };
                self.stack.push(next);
                return target;
            }
            (24, _, _) => return self.stack.pop().unwrap_or(next),
            // EI, DI: an event that was remembered goes with its own enable, but not with the global one.
            (25, 255, _) => self.globally_enabled = true,
            (25, _, _) if INTERRUPTS.contains(&kind) => _ = self.enabled.insert(kind),
            (26, 255, _) => self.globally_enabled = false,
            (26, _, _) => {
                self.enabled.remove(&kind);
                self.pending.remove(&kind);
            }
            // WAIT TICKS, and the others
            (27, 0, _) | (27, 1..=4, 0) => {
                let ticks = if value == -1 { self.accumulator } else { value };
                if ticks > 0 || (ticks == 0 && kind != 0) {
                    self.waiting = Some(Wait { condition: kind, ticks });
                    return here;
                }
            }
            // SCO, ACO
            (30, 0..=20, 0) => self.coordinates[kind as usize] = value,
            (39, 0..=20, 0) => self.coordinates[kind as usize] = self.accumulator,
            (30, 0, 255) => self.stored_coordinates[1..].copy_from_slice(&self.coordinates[1..]),
            (30, 1..=20, 255) => self.stored_coordinates[kind as usize] = self.coordinates[kind as usize],
            // GCO
            (31, 0..=20, 0) => self.load(self.coordinates[kind as usize]),
            (31, 0, 255) => self.coordinates[1..].copy_from_slice(&self.stored_coordinates[1..]),
            (31, 1..=20, 255) => self.coordinates[kind as usize] = self.stored_coordinates[kind as usize],
            // CCO: the world knows the position, the coordinates are here.
            (32, 0..=20, 0) => {
                if let Some(position) = world.command(bytes, self.accumulator) {
                    self.coordinates[kind as usize] = position;
                }
            }
            // CALCX: NOT and LOAD write X only and leave accumulator and flags alone.
            (33, 8, _) => self.x = !self.x,
            (33, 9, _) => self.x = self.accumulator,
            (33, 10, _) => {
                let x = self.x;
                self.x = self.accumulator;
                self.load(x);
            }
            (33, 0..=7, _) => self.load(calculate(kind, self.accumulator, self.x)),
            // CLE
            (36, _, _) => {
                self.timeout &= kind != 0 && kind != 1;
                self.alarm &= kind != 0 && kind != 2;
                self.deviation &= kind != 0 && kind != 3;
                self.position &= kind != 0 && kind != 4;
                self.shutdown &= kind != 0 && kind != 5;
            }
            // VECT
            (37, _, _) if INTERRUPTS.contains(&kind) => {
                let Some(target) = address(value) else {
                    return self.end();
                };
                self.vectors.insert(kind, target);
            }
            // RETI
            (38, _, _) => {
                if let Some(saved) = self.saved.take() {
                    self.accumulator = saved.accumulator;
                    self.x = saved.x;
                    [self.zero, self.equal, self.greater, self.less] = saved.flags;
                    self.waiting = saved.waiting;
                    self.stack.truncate(saved.depth);
                    self.returned = true;
                    return saved.program_counter;
                }
            }
            // Unknown commands, control commands, whatever is out of range
            _ => {}
        }
        next
    }

    /// The conditions of JC (3.7.18); unknown ones are never met.
    fn condition(&self, kind: u8) -> bool {
        match kind {
            0 => self.zero,
            1 => !self.zero,
            2 => self.equal,
            3 => !self.equal,
            4 => self.greater,
            5 => self.greater || self.equal,
            6 => self.less,
            7 => self.less || self.equal,
            8 => self.timeout,
            9 => self.alarm,
            10 => self.deviation,
            11 => self.position,
            12 => self.shutdown,
            _ => false,
        }
    }

    /// Loads the accumulator; the zero flag follows.
    fn load(&mut self, value: i32) {
        self.accumulator = value;
        self.zero = value == 0;
    }

    /// Writes to bank 2 or 3 (5.3, 5.4). A timer period is an unsigned number: any 32 bits will do.
    fn set_global(&mut self, parameter: u8, bank: u8, value: i32) {
        match (parameter, bank) {
            (_, 2) => self.variables[parameter as usize] = value,
            (0..=2, 3) => _ = self.interrupt_settings.insert(parameter, value),
            (27 | 28 | 39..=42, 3) if (0..=3).contains(&value) => _ = self.interrupt_settings.insert(parameter, value),
            _ => {}
        }
    }

    /// Ends the program and gives the address where it would begin again; calls and handlers under way are forgotten.
    fn end(&mut self) -> u16 {
        self.running = false;
        self.waiting = None;
        self.stack.clear();
        self.saved = None;
        self.returned = false;
        0
    }

    /// Sets the program counter; past the last command the program ends.
    fn go_to(&mut self, address: u16) {
        self.program_counter = if address == MEMORY { self.end() } else { address };
    }
}

/// An address in program memory.
fn address(value: i32) -> Option<u16> {
    u16::try_from(value).ok().filter(|&address| address < MEMORY)
}

/// The operations that CALC and CALCX have in common, and CALC NOT. Quotients are cut towards zero, a remainder has the
/// sign of the dividend; a division by zero gives 0, its remainder is the dividend.
fn calculate(operation: u8, a: i32, b: i32) -> i32 {
    match operation {
        0 => a.wrapping_add(b),
        1 => a.wrapping_sub(b),
        2 => a.wrapping_mul(b),
        3 if b == 0 => 0,
        3 => a.wrapping_div(b),
        4 if b == 0 => a,
        4 => a.wrapping_rem(b),
        5 => a & b,
        6 => a | b,
        7 => a ^ b,
        _ => !a,
    }
}
