//! How the core goes on: instruction by instruction, asleep until an event, and past loops that only wait.

use std::sync::Arc;

use super::shared::Shared;
use crate::board::Chip;
use crate::mcu::cpu::{Cpu, Registers};
use crate::mcu::peripheral::Cycles;
use crate::mcu::step::{Act, LINES, Observer, Step, View};

/// The most cycles the core executes before it is asked whether it wants a reset or is stuck.
const SLICE: Cycles = 16_384;

/// What a machine has done since it was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Cycles of the core clock.
    pub cycles: u64,
    /// Those of them that the core slept through.
    pub asleep: u64,
    /// Instructions executed (exception entries count as one).
    pub instructions: u64,
    /// Those of them in waiting loops that were skipped: they change nothing.
    pub skipped: u64,
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
    shared: Arc<Shared>,
    /// The core's time.
    pub(super) now: Cycles,
    counters: Counters,
    /// Interrupt lines as the core has them.
    interrupts: [u32; LINES],
    asleep: bool,
    /// Since when it has neither slept nor used the chip.
    busy_since: Cycles,
    round: Option<Round>,
}

impl Execution {
    /// The core before its first instruction; with power, that is the firmware's first start.
    pub(super) fn new(cpu: Cpu, shared: Arc<Shared>, powered: bool) -> Self {
        Self {
            cpu,
            shared,
            now: 0,
            counters: Counters { starts: powered.into(), ..Counters::default() },
            interrupts: [0; LINES],
            asleep: false,
            busy_since: 0,
            round: None,
        }
    }

    /// What has been done so far.
    pub(super) fn counters(&self) -> Counters {
        Counters { cycles: self.now, ..self.counters }
    }

    /// The core starts anew, and the firmware with it.
    pub(super) fn restart(&mut self) {
        self.cpu.reset();
        self.interrupts = [0; LINES];
        self.asleep = false;
        self.round = None;
        self.counters.starts += 1;
    }

    /// The program waits for no register.
    pub(super) fn forget_round(&mut self) {
        self.round = None;
    }

    /// Executes until the chip wants attention.
    pub(super) fn execute(&mut self, due: Cycles, observer: &mut Observer<'_>) {
        if observer.is_none() && self.now >= self.busy_since + SLICE {
            self.pass_over(due);
        }
        let end = due.min(self.now + SLICE);
        let mut now = self.now;
        let mut instructions = 0;
        while now < end.min(self.shared.due()) {
            self.shared.set_now(now);
            let before = observer.is_some().then(|| self.view());
            let used = self.cpu.step();
            now += used;
            // All that takes longer is no waiting.
            let asleep = used == 1 && self.cpu.is_asleep();
            instructions += u64::from(!(asleep && self.asleep));
            self.asleep = asleep;
            let mut passed = 0;
            if asleep {
                passed = self.cpu.idle(due.saturating_sub(now));
                now += passed;
                self.counters.asleep += passed;
            }
            if let (Some(observer), Some(before)) = (observer.as_mut(), before) {
                observer(self.step(now - used - passed, now, &before, &self.view()));
            }
            if asleep {
                break;
            }
        }
        self.now = now;
        self.counters.instructions += instructions;
        if self.asleep || self.shared.due() == 0 {
            self.busy_since = now;
        }
    }

    /// For long there has been no access to the chip. If the program goes round in a circle of one or two instructions,
    /// as one that hangs does, it will do so until an interrupt comes: goes on by as many rounds as there are before
    /// `due`.
    fn pass_over(&mut self, due: Cycles) {
        let first =
            Round { registers: self.cpu.registers(), at: self.now, instructions: self.counters.instructions, reads: 0 };
        self.busy_since = self.now;
        for _ in 0..2 {
            self.shared.set_now(self.now);
            self.now += self.cpu.step();
            self.counters.instructions += 1;
            if self.cpu.registers() == first.registers {
                self.busy_since = 0;
                self.round = Some(first);
                let bus = self.shared.lock().motion_bus();
                return self.skip(due, bus, &mut None);
            }
        }
    }

    fn view(&self) -> View {
        self.cpu.view(self.shared.lock().motion_bus())
    }

    /// The step that has just been done.
    fn step(&self, at: Cycles, end: Cycles, before: &View, after: &View) -> Step {
        let act = match after.entered(before, |exception| self.cpu.handler(exception)) {
            Some(number) => Act::Entry(number),
            None if self.asleep => Act::Sleep,
            None => Act::Instruction,
        };
        let wanted = std::array::from_fn(|word| (after.pending[word] | self.interrupts[word]) & after.enabled[word]);
        let View { exception, masked, .. } = *after;
        let View { pc, bus: (chip, clocked), .. } = *before;
        Step { at, cycles: end - at, act, pc, exception, masked, wanted, chip, clocked }
    }

    /// The program has read the same value again, with the motion bus as it is. If it has come round to the same state,
    /// it will do so until something changes: goes on by as many rounds as there are before `due`.
    pub(super) fn skip(&mut self, due: Cycles, bus: (Option<Chip>, bool), observer: &mut Observer<'_>) {
        let registers = self.cpu.registers();
        if let Some(round) = &mut self.round
            && round.registers != registers
            && round.reads < READS
        {
            round.reads += 1;
            return;
        }
        if let Some(round) = &self.round
            && round.registers == registers
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
                let view = self.cpu.view(bus);
                let step = self.step(self.now - passed, self.now, &view, &view);
                observer(Step { act: Act::Wait { instructions: skipped }, ..step });
            }
        }
        self.round = Some(Round { registers, at: self.now, instructions: self.counters.instructions, reads: 0 });
    }

    /// Brings changed interrupt lines to the core.
    pub(super) fn interrupt(&mut self, lines: [u32; LINES]) {
        if lines == self.interrupts {
            return;
        }
        for (word, (before, after)) in self.interrupts.into_iter().zip(lines).enumerate() {
            let mut changed = before ^ after;
            while changed != 0 {
                let bit = changed.trailing_zeros();
                changed &= changed - 1;
                self.cpu.set_interrupt((32 * word as u32 + bit) as u16, after >> bit & 1 != 0);
            }
        }
        self.interrupts = lines;
    }
}
