//! How the core goes on: instruction by instruction, asleep until an event, and past loops that only wait.

use crate::board::Chip;
use crate::mcu::cpu::{Cpu, Registers};
use crate::mcu::peripheral::Cycles;
use crate::mcu::soc::Soc;
use crate::mcu::step::{Act, Observer, Step, View};

/// The most cycles the core executes before it is asked whether it wants a reset or is stuck.
const SLICE: Cycles = 16_384;

/// Counts of what a machine has done since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Cycles of the core clock.
    pub cycles: u64,
    /// Cycles among them that the core slept through.
    pub asleep: u64,
    /// Instructions executed (exception entries count as one).
    pub instructions: u64,
    /// Instructions among them that were skipped in waiting loops: they change nothing.
    pub skipped: u64,
    /// Cycles for which the core has waited for the flash memory, whether they took time or not.
    pub stalls: u64,
    /// How often the firmware has started.
    pub starts: u64,
}

/// A round of a loop that waits for a register.
#[derive(Debug)]
struct Round {
    registers: Registers,
    at: Cycles,
    instructions: u64,
    /// How often the register has been read since: compilers unroll such loops.
    reads: u32,
}

/// The most reads of the register in a loop that waits for it.
const READS: u32 = 8;

/// The core, as it has gone on so far.
pub(super) struct Execution {
    pub(super) cpu: Cpu,
    /// The core's time.
    pub(super) now: Cycles,
    counters: Counters,
    asleep: bool,
    /// Since when it has neither slept nor used the chip.
    busy_since: Cycles,
    round: Option<Round>,
}

impl Execution {
    /// The core before its first instruction; with power, that is the firmware's first start.
    pub(super) fn new(cpu: Cpu, powered: bool) -> Self {
        Self {
            cpu,
            now: 0,
            counters: Counters { starts: powered.into(), ..Counters::default() },
            asleep: false,
            busy_since: 0,
            round: None,
        }
    }

    /// Counts of what has been done so far.
    pub(super) fn counters(&self) -> Counters {
        Counters { cycles: self.now, stalls: self.cpu.stalls(), ..self.counters }
    }

    /// The core starts anew, and the firmware with it.
    pub(super) fn restart(&mut self) {
        self.cpu.reset();
        self.asleep = false;
        self.round = None;
        self.counters.starts += 1;
    }

    /// The program waits for no register.
    pub(super) fn forget_round(&mut self) {
        self.round = None;
    }

    /// Executes until the chip wants attention: when its next event is due, or after an access.
    pub(super) fn execute(&mut self, soc: &mut Soc, due: Cycles, observer: &mut Observer<'_>) {
        if observer.is_none() && self.now >= self.busy_since + SLICE {
            self.pass_over(soc, due);
        }
        let end = due.min(self.now + SLICE);
        match observer {
            None => {
                let ran = self.cpu.run(soc, self.now, end);
                self.now = ran.now;
                self.note(ran.steps, due);
            }
            Some(observer) => self.execute_observed(soc, end, due, observer),
        }
        if self.asleep || self.cpu.has_accessed() {
            self.busy_since = self.now;
        }
    }

    /// The same step by step.
    fn execute_observed(&mut self, soc: &mut Soc, end: Cycles, due: Cycles, observer: &mut dyn FnMut(Step)) {
        while self.now < end {
            let (at, pc, bus, stalls) = (self.now, self.cpu.pc(), soc.motion_bus(), self.cpu.stalls());
            let ran = self.cpu.run(soc, at, at + 1);
            self.now = ran.now;
            self.note(ran.steps, due);
            observer(Step { stalls: self.cpu.stalls() - stalls, ..self.step(at, pc, bus) });
            if self.asleep || self.cpu.has_accessed() {
                return;
            }
        }
    }

    /// Counts steps. If the core sleeps after them, that lasts until `due`, or until it is woken.
    fn note(&mut self, steps: u64, due: Cycles) {
        let asleep = self.cpu.is_asleep();
        // Sleeping on is no instruction.
        self.counters.instructions += steps - u64::from(asleep && self.asleep && steps != 0);
        self.asleep = asleep;
        if asleep {
            let passed = self.cpu.idle(due.saturating_sub(self.now));
            self.now += passed;
            self.counters.asleep += passed;
        }
    }

    /// Goes on when for long there has been no access to the chip. If the program goes round in a circle of one or two
    /// instructions, as one that hangs does, it will do so until an interrupt comes. In this case goes on by as many
    /// rounds as there are before `due`.
    fn pass_over(&mut self, soc: &mut Soc, due: Cycles) {
        let first = self.begin_round();
        self.busy_since = self.now;
        for _ in 0..2 {
            self.now += self.cpu.step(soc, self.now);
            self.counters.instructions += 1;
            if *self.cpu.registers() == first.registers {
                self.busy_since = 0;
                self.round = Some(first);
                return self.skip(soc, due, &mut None);
            }
        }
    }

    fn begin_round(&self) -> Round {
        let registers = *self.cpu.registers();
        Round { registers, at: self.now, instructions: self.counters.instructions, reads: 0 }
    }

    /// The step that has just been done, and began when the program stood at `pc`, with the motion bus as it was then.
    fn step(&self, at: Cycles, pc: u32, (chip, clocked): (Option<Chip>, bool)) -> Step {
        let View { entered, exception, masked, enabled, wanted } = self.cpu.view();
        let act = match entered {
            Some(number) => Act::Entry(number),
            None if self.asleep => Act::Sleep,
            None => Act::Instruction,
        };
        let wanted = std::array::from_fn(|word| wanted[word] & enabled[word]);
        Step { at, cycles: self.now - at, act, pc, exception, masked, wanted, chip, stalls: 0, clocked }
    }

    /// The program has read the same value again, with the motion bus as it is. If it has come round to the same state,
    /// it will do so until something changes: goes on by as many rounds as there are before `due`.
    pub(super) fn skip(&mut self, soc: &Soc, due: Cycles, observer: &mut Observer<'_>) {
        let registers = self.cpu.registers();
        if let Some(round) = &mut self.round
            && round.registers != *registers
            && round.reads < READS
        {
            round.reads += 1;
            return;
        }
        if let Some(round) = &self.round
            && round.registers == *registers
        {
            let length = self.now - round.at;
            let rounds = due.saturating_sub(self.now) / length.max(1);
            let passed = rounds * length;
            let mut left = passed;
            while left > 0 {
                left -= self.cpu.idle(left);
            }
            let skipped = rounds * (self.counters.instructions - round.instructions);
            self.counters.instructions += skipped;
            self.counters.skipped += skipped;
            self.now += passed;
            if let Some(observer) = observer
                && passed > 0
            {
                let step = self.step(self.now - passed, self.cpu.pc(), soc.motion_bus());
                observer(Step { act: Act::Wait { instructions: skipped }, ..step });
            }
        }
        self.round = Some(self.begin_round());
    }
}
