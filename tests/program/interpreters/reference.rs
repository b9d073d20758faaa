//! A second interpreter for TMCL programs, written from the manual alone (TMCM-1140 TMCL firmware manual V1.42,
//! sections 3.3, 3.5, 3.6, 3.7, 5 and 8), to check the firmware's interpreter against. It is as simple as possible and
//! not fast: one match on command number, type and motor or bank. What no arm takes fails.
//!
//! There is no time and no motor in here. What needs one is handed to a [`World`]; a WAIT stays in
//! [`Machine::waiting`] until the caller ends it. A command that fails changes nothing, and the program goes on.

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

/// What an interrupt saves and RETI restores.
///
/// 3.6.6.2 and 3.7.35 name accumulator, X register, flags and program counter. "Flags" are read as the arithmetic ones
/// (3.7.17: "arithmetic status flags"). The error flags (3.7.31: "internal error flags") are not the program's own:
/// they stay until CLE, so an error that comes up during a handler outlives its RETI, and a CLE in a handler lasts.
/// A WAIT that was interrupted goes on after RETI. Of the subroutine stack its depth is saved; the interrupt enables are
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
    /// What STGP stored.
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
    /// What the running handler interrupted; `None` outside of handlers.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Answers every command with the same value and writes down what it was given.
    struct Fake(Option<i32>, Vec<([u8; 7], i32)>);

    impl World for Fake {
        fn command(&mut self, bytes: [u8; 7], accumulator: i32) -> Option<i32> {
            self.1.push((bytes, accumulator));
            self.0
        }
    }

    /// Commands as four numbers, separated by semicolons: number, type, motor or bank, value (0 if left out).
    /// `@n` fills up to address n with the end of the program.
    fn program(text: &str) -> Vec<[u8; 7]> {
        let mut commands = Vec::new();
        for command in text.split(';') {
            if let Some(address) = command.trim().strip_prefix('@') {
                commands.resize(address.parse().unwrap(), [0; 7]);
                continue;
            }
            let mut numbers: Vec<i32> = command.split_whitespace().map(|number| number.parse().unwrap()).collect();
            numbers.resize(4, 0);
            let [v3, v2, v1, v0] = numbers[3].to_be_bytes();
            commands.push([numbers[0] as u8, numbers[1] as u8, numbers[2] as u8, v3, v2, v1, v0]);
        }
        commands
    }

    fn machine(text: &str) -> Machine {
        Machine::new(&program(text))
    }

    fn steps(machine: &mut Machine, count: usize) {
        (0..count).for_each(|_| machine.step(&mut Fake(None, Vec::new())));
    }

    /// Runs a program to its end.
    fn run(text: &str) -> Machine {
        let mut machine = machine(text);
        steps(&mut machine, 3000);
        assert!(!machine.running);
        machine
    }

    #[test]
    fn the_manuals_bytes() {
        assert_eq!(program("19 2 0 -5000; 21 5 0 10"), [[0x13, 2, 0, 0xFF, 0xFF, 0xEC, 0x78], [21, 5, 0, 0, 0, 0, 10]]);
    }

    #[test]
    fn calculations() {
        const MIN: i32 = i32::MIN;
        const MAX: i32 = i32::MAX;
        for (operation, a, b, result) in [
            (0, MAX, 1, MIN),
            (1, MIN, 1, MAX),
            (2, 65536, 65536, 0),
            (2, 3, -5000, -15000),
            (3, -7, 2, -3),
            (3, 7, 0, 0),
            (3, MIN, -1, MIN),
            (4, -7, 2, -1),
            (4, 7, -2, 1),
            (4, -7, 0, -7),
            (4, MIN, -1, 0),
            (5, 12, 10, 8),
            (6, 12, 10, 14),
            (7, 12, 10, 6),
            (8, 5, 99, -6),
            (9, 5, 99, 99),
            (10, 5, 99, 5),
        ] {
            let end = run(&format!("19 9 0 {a}; 19 {operation} 7 {b}"));
            assert_eq!((end.accumulator, end.zero), (result, result == 0), "CALC {operation}: {a}, {b}");
            if operation < 8 {
                let end = run(&format!("19 9 0 {b}; 33 9; 19 9 0 {a}; 33 {operation}"));
                assert_eq!((end.accumulator, end.x, end.zero), (result, b, result == 0), "CALCX {operation}: {a}, {b}");
            }
        }
        // CALCX NOT, SWAP, an unknown one
        for (text, accumulator, x, zero) in [
            ("19 9 0 5; 33 9; 33 8", 5, -6, false),
            ("19 9 0 5; 33 10", 0, 5, true),
            ("19 9 0 5; 33 9; 33 11", 5, 5, false),
            ("19 9 0 0; 33 8; 33 10; 33 9", -1, -1, false),
        ] {
            let end = run(text);
            assert_eq!((end.accumulator, end.x, end.zero), (accumulator, x, zero), "{text}");
        }
    }

    #[test]
    fn conditions() {
        // Bit n of the result: JC n jumps. From the right: ZE NZ EQ NE, GT GE LT LE, ETO EAL EDV EPO, ESD, unknown.
        for (text, error, taken) in [
            ("", false, 0b00_0000_0000_1010),
            ("", true, 0b01_1001_0000_1010),
            ("19 9 0 5; 20 0 0 5;", false, 0b1010_0101),
            ("19 9 0 5; 20 0 0 6;", false, 0b1100_1010),
            ("19 9 0 5; 20 0 0 4;", false, 0b0011_1010),
            ("19 9 0 -2147483648; 20 0 0 2147483647;", false, 0b1100_1010),
            ("19 9 0 2147483647; 20 0 0 -1;", false, 0b0011_1010),
            // A value loaded after COMP: ZE and NZ only.
            ("19 9 0 5; 20 0 0 6; 19 9 0 0;", false, 0b1100_1001),
        ] {
            for kind in 0..14 {
                let mut machine = machine(&format!("{text} 21 {kind} 0 9"));
                machine.timeout = error;
                machine.position = error;
                machine.shutdown = error;
                steps(&mut machine, text.matches(';').count() + 1);
                assert_eq!(machine.program_counter == 9, taken >> kind & 1 == 1, "{text} JC {kind}");
            }
        }
    }

    #[test]
    fn addresses() {
        for command in ["22 0 0 2048", "22 0 0 -1", "21 1 0 65536", "23 0 0 2048", "37 0 0 2048", "28 0 0 5", "0"] {
            let end = run(&format!("19 9 0 1; {command}"));
            assert_eq!((end.running, end.program_counter, end.stack.len()), (false, 0, 0), "{command}");
        }
        // Not taken, unknown condition, unknown interrupt, unknown and control commands: all are passed.
        let mut machine = machine("21 0 0 2048; 21 13 0 2048; 37 255 0 2048; 29; 131");
        steps(&mut machine, 5);
        assert_eq!((machine.running, machine.program_counter), (true, 5));
        // Address 2047 is the last: the command there is executed, and the program ends.
        let last = run("22 0 0 2047; @2047; 19 9 0 7");
        assert_eq!((last.running, last.program_counter, last.accumulator), (false, 0, 7));
        // CSUB at 2047 would return to 2048, which ends the program.
        let returned = run("22 0 0 2047; 24; @2047; 23 0 0 1");
        assert_eq!((returned.running, returned.program_counter), (false, 0));
    }

    #[test]
    fn the_end_forgets_calls_and_the_handler_but_nothing_else() {
        // A handler that has called a subroutine ends the program.
        let mut machine = machine("37 0 0 20; 25 0; 25 255; 19 9 0 5; 27 0 0 7; @20; 23 0 0 30; @30; 28");
        steps(&mut machine, 5);
        machine.timeout = true;
        machine.interrupt(0);
        steps(&mut machine, 2);
        assert_eq!((machine.running, machine.program_counter, machine.saved, machine.waiting), (false, 0, None, None));
        assert!(machine.stack.is_empty() && machine.globally_enabled && machine.timeout);
        assert_eq!((machine.accumulator, machine.vectors.get(&0)), (5, Some(&20)));
    }

    #[test]
    fn subroutines() {
        // RSUB without a call; eight calls, each to the next address; the ninth is ignored.
        let calls: String = (2..=9).map(|target| format!("23 0 0 {target};")).collect();
        let mut machine = machine(&format!("24; {calls} 23 0 0 5000; 24"));
        steps(&mut machine, 10);
        assert_eq!((machine.program_counter, &machine.stack[..]), (10, &[2, 3, 4, 5, 6, 7, 8, 9][..]));
        steps(&mut machine, 1);
        assert_eq!((machine.program_counter, machine.stack.len(), machine.running), (9, 7, true));
    }

    #[test]
    fn parameters() {
        // The example of 8.4 (with AGP to another variable), stored, changed and restored; 56 cannot be stored.
        let end =
            run("9 42 2 1234; 10 42 2; 19 2 0 2; 35 43 2; 11 43 2; 9 43 2 7; 12 43 2; 9 56 2 8; 11 56 2; 12 56 2");
        assert_eq!((end.accumulator, end.variables[43], end.variables[56]), (2468, 2468, 8));
        let end = run("19 9 0 4; 9 0 3 -1; 9 27 3 3; 9 27 3 4; 9 3 3 1; 35 39 3; 10 3 3; 10 0 1; 9 0 1 5");
        let setting = |number| end.interrupt_settings.get(&number).copied();
        assert_eq!([setting(0), setting(27), setting(39), setting(3)], [Some(-1), Some(3), Some(0), None]);
        assert_eq!((end.accumulator, end.variables[0]), (4, 0));
        assert_eq!(run("9 0 3 -1; 10 0 3").accumulator, -1);
    }

    #[test]
    fn outputs() {
        let end = run("14 1 2 1; 14 1 2 -1; 14 2 2 1; 14 0 1 1; 14 255 2 256; 15 1 2");
        assert_eq!((end.outputs, end.accumulator, end.pull_ups), ([false, true], 1, true));
        let end = run("19 9 0 253; 14 255 2 -1; 15 1 2");
        assert_eq!((end.outputs, end.accumulator, end.zero), ([true, false], 0, true));
        let end = run("19 9 0 257; 14 255 2 2; 14 255 2 -1; 15 255 2; 14 0 0 0");
        assert_eq!((end.outputs, end.accumulator, end.pull_ups), ([true, false], 257, false));
    }

    #[test]
    fn coordinates() {
        let end =
            run("30 0 0 10; 30 1 0 11; 30 20 0 12; 30 0 255; 30 0 0 20; 30 1 0 21; 30 20 0 22; 31 20 255; 31 1; 39 2");
        assert_eq!((end.accumulator, &end.coordinates[..3], end.coordinates[20]), (21, &[20, 21, 21][..], 12));
        assert_eq!(end.stored_coordinates[..3], [0, 11, 0]);
        let end =
            run("19 9 0 1; 30 5 0 9; 30 5 255; 30 5 0 8; 30 0 0 7; 31 0 255; 30 21 0 3; 30 6 1 3; 39 6 255; 31 21");
        assert_eq!((end.coordinates[0], end.coordinates[5], end.coordinates[6], end.accumulator), (7, 9, 0, 1));
    }

    #[test]
    fn error_flags() {
        for (kind, left) in [(0, 0), (1, 0b11110), (2, 0b11101), (3, 0b11011), (4, 0b10111), (5, 0b01111), (6, 0b11111)]
        {
            let mut m = machine(&format!("36 {kind}"));
            [m.timeout, m.alarm, m.deviation, m.position, m.shutdown] = [true; 5];
            steps(&mut m, 1);
            let flags = [m.timeout, m.alarm, m.deviation, m.position, m.shutdown];
            assert_eq!((0..5).map(|n| u8::from(flags[n]) << n).sum::<u8>(), left, "CLE {kind}");
        }
    }

    #[test]
    fn waits() {
        // None of the first five waits; then POS with a time limit, TICKS.
        let mut machine = machine("27 0 9 0; 27 0 0 -1; 27 1 0 -2; 27 1 1 5; 27 5 0 5; 27 1 0 3; 27 0 0 4");
        steps(&mut machine, 8);
        assert_eq!((machine.program_counter, machine.waiting), (5, Some(Wait { condition: 1, ticks: 3 })));
        machine.finish_wait(true);
        assert_eq!((machine.program_counter, machine.waiting, machine.timeout), (6, None, true));
        machine.timeout = false;
        steps(&mut machine, 1);
        assert_eq!(machine.waiting, Some(Wait { condition: 0, ticks: 4 }));
        machine.finish_wait(true);
        assert_eq!((machine.program_counter, machine.timeout), (7, false));
    }

    #[test]
    fn the_world() {
        // AAP; GAP and ROR of motor 1; MVP COORD, 255; CCO; RFS START; GAP. Motor 1 fails, RFS START does not load.
        let commands = program("34 0; 6 1 1; 1 0 1 5; 4 2 255 3; 32 3; 13 0; 6 1");
        let mut machine = Machine::new(&commands);
        machine.accumulator = 5;
        let mut world = Fake(Some(0), Vec::new());
        machine.coordinates[3] = 1;
        (0..6).for_each(|_| machine.step(&mut world));
        assert_eq!((machine.accumulator, machine.zero, machine.coordinates[3]), (5, false, 0));
        assert_eq!(world.1, [0, 3, 4, 5].map(|address| (commands[address], 5)));
        machine.step(&mut world);
        assert_eq!((machine.accumulator, machine.zero), (0, true));
    }

    #[test]
    fn interrupts() {
        let main = "37 0 0 20; 37 1 0 30; 25 0; 25 1; 25 255; 38; 19 9 0 5; 20 0 0 6; 27 0 0 7";
        let mut machine = machine(&format!("{main}; @20; 19 9 0 0; 33 10; 20 0 0 0; 38; @30; 38"));
        machine.interrupt(0); // not enabled: dropped
        steps(&mut machine, 4);
        assert!(machine.pending.is_empty());
        machine.interrupt(1); // globally disabled: remembered, once
        machine.interrupt(1);
        machine.interrupt(0);
        steps(&mut machine, 2); // EI 255, the first command of handler 0
        assert_eq!((machine.program_counter, machine.saved.unwrap().program_counter), (21, 5));
        steps(&mut machine, 3);
        assert_eq!((machine.program_counter, machine.saved, machine.equal), (5, None, false));
        steps(&mut machine, 1); // RETI outside of a handler is ignored
        assert_eq!((machine.program_counter, machine.saved), (6, None));
        steps(&mut machine, 1); // handler 1 is its RETI
        assert_eq!((machine.program_counter, machine.saved), (6, None));
        steps(&mut machine, 3); // LOAD, COMP, WAIT
        machine.timeout = true;
        let before = machine.clone();
        machine.interrupt(0);
        steps(&mut machine, 1);
        assert_eq!((machine.program_counter, machine.waiting), (21, None));
        machine.timeout = false;
        machine.alarm = true;
        steps(&mut machine, 3);
        // All as before the handler, the WAIT too, but the error flags.
        assert_eq!(machine.waiting, Some(Wait { condition: 0, ticks: 7 }));
        assert_eq!(machine, Machine { timeout: false, alarm: true, returned: true, executed: Some(38), ..before });
        machine.interrupt(0);
        steps(&mut machine, 1);
        machine.interrupt(0); // its own handler runs: remembered
        steps(&mut machine, 4);
        assert_eq!((machine.program_counter, machine.pending.len()), (21, 0));
    }

    #[test]
    fn disabling_and_vectors() {
        // No vector yet: remembered. DI 3 forgets it. EI 3, VECT 3: the handler ends the program.
        let mut machine = machine("25 3; 25 255; 26 3; 25 3; 37 3 0 9");
        steps(&mut machine, 2);
        machine.interrupt(3);
        steps(&mut machine, 1);
        assert!(machine.pending.is_empty());
        steps(&mut machine, 1);
        machine.interrupt(3);
        steps(&mut machine, 1);
        assert_eq!((machine.program_counter, machine.running), (5, true));
        steps(&mut machine, 1);
        assert_eq!((machine.program_counter, machine.running), (0, false));
        machine.interrupt(3); // stopped: dropped
        assert!(machine.pending.is_empty());
    }
}
