//! The whole: core, chip and board, in virtual time.

mod execution;
mod part;

use super::cpu::Cpu;
use super::elf::Image;
use super::log::Log;
use super::peripheral::Cycles;
use super::pinout::Pinout;
use super::rcc::Cause;
use super::soc::Soc;
use super::step::{Observer, Step};
use super::stop::Stop;
use crate::board::Board;
use crate::clock::Nanos;
use execution::Execution;

pub use execution::Counters;
pub use part::{BitRates, Part, Waiting};

/// How often the log is fetched, in cycles: before its buffer can be full.
const LOG_EVERY: Cycles = 84_000;

/// A module: the emulated microcontroller with its image, on the simulated board.
///
/// Time passes only in [`run_until`](Self::run_until). What the module consists of and is connected to is to be had
/// between two runs: [`board`](Self::board), [`rs485`](Self::rs485), [`can`](Self::can), [`usb`](Self::usb),
/// [`wiring`](Self::wiring), [`cpu`](Self::cpu), [`log`](Self::log). When the board loses its power, the core stands
/// still until it is [switched on](Self::set_power) again.
pub struct Machine {
    soc: Soc,
    execution: Execution,
    powered: bool,
    stack: core::ops::Range<u32>,
    log: Log,
    log_due: Cycles,
    stops_at_reset: bool,
    stopped: Option<Stop>,
}

impl Machine {
    /// A machine with the image `elf` on `board`, which is switched on: the firmware starts now.
    ///
    /// # Errors
    /// The file is no image for this microcontroller, or nothing is known of the pins of such a board.
    pub fn new(elf: &[u8], board: Board) -> Result<Self, Stop> {
        let name = board.kind().name;
        let pinout = Pinout::of(board.kind());
        let pinout = pinout.ok_or_else(|| Stop::Image(format!("no microcontroller is known for the {name}")))?;
        Self::wired(elf, board, pinout)
    }

    /// The same with any board, at whose pins the microcontroller is.
    ///
    /// # Errors
    /// The file is no image for this microcontroller.
    pub fn wired(elf: &[u8], board: Board, pinout: &'static Pinout) -> Result<Self, Stop> {
        let image = Image::parse(elf)?;
        let powered = board.is_powered();
        let cpu = Cpu::new(image.flash);
        let sram = cpu.sram().clone();
        let mut soc = Soc::new(board, pinout, 0);
        soc.attach(sram.clone());
        Ok(Self {
            execution: Execution::new(cpu, powered),
            soc,
            powered,
            stack: image.stack,
            log: Log::new(elf, image.rtt, sram),
            log_due: 0,
            stops_at_reset: false,
            stopped: None,
        })
    }

    /// Virtual time.
    pub fn now(&self) -> Nanos {
        self.soc.present()
    }

    /// Lets time pass until `to`.
    ///
    /// # Errors
    /// The run cannot go on. From then on every run ends with the same error.
    pub fn run_until(&mut self, to: Nanos) -> Result<(), Stop> {
        self.go(to, None)
    }

    /// Lets time pass until `to`, and shows `observer` each step of the core. It is the same run, only slower.
    ///
    /// # Errors
    /// As [`run_until`](Self::run_until).
    pub fn observe_until(&mut self, to: Nanos, observer: &mut dyn FnMut(Step)) -> Result<(), Stop> {
        self.go(to, Some(observer))
    }

    fn go(&mut self, to: Nanos, observer: Observer<'_>) -> Result<(), Stop> {
        if let Some(stop) = &self.stopped {
            return Err(stop.clone());
        }
        let outcome = self.run_on(to, observer);
        self.log.drain();
        self.stopped = outcome.as_ref().err().cloned();
        outcome
    }

    /// Lets time pass until the microcontroller is reset, by its watchdog or by the program, or until `to`. True if it
    /// was.
    ///
    /// # Errors
    /// As [`run_until`](Self::run_until).
    pub fn run_to_reset(&mut self, to: Nanos) -> Result<bool, Stop> {
        let starts = self.execution.counters().starts;
        self.stops_at_reset = true;
        let outcome = self.run_until(to);
        self.stops_at_reset = false;
        outcome.map(|()| self.execution.counters().starts != starts)
    }

    /// Lets `span` pass.
    ///
    /// # Errors
    /// As [`run_until`](Self::run_until).
    pub fn run(&mut self, span: Nanos) -> Result<(), Stop> {
        self.run_until(self.now() + span)
    }

    /// Switches the supply off or on. RAM is lost, the EEPROM keeps its contents.
    pub fn set_power(&mut self, on: bool) {
        if on == self.soc.board().is_powered() {
            return;
        }
        if on {
            self.soc.power_on();
            self.execution.cpu.sram().forget();
            self.restart(Cause::Power);
            self.powered = true;
        } else {
            self.soc.settle(self.execution.now);
            self.soc.sync();
            self.soc.board_mut().power_off();
            self.powered = false;
        }
    }

    /// Lets the supply of the microcontroller dip: it starts anew as after power-on, while the other chips keep their
    /// registers. RAM stays as it is, the worst case for a firmware that believes what it finds there.
    pub fn brown_out(&mut self) {
        if self.powered {
            self.soc.settle(self.execution.now);
            self.restart(Cause::Power);
        }
    }

    /// Lets the microcontroller's crystal stop, or swing when it is switched on.
    pub fn set_crystal(&mut self, swings: bool) {
        self.soc.settle(self.execution.now);
        if self.soc.set_crystal(swings) {
            self.execution.cpu.raise_nmi();
        }
    }

    /// Lets the core's waits for the flash memory take time, or not, as at the start. They are counted in any case.
    pub fn set_flash_stalls(&mut self, take_time: bool) {
        self.execution.cpu.set_stalls(take_time);
    }

    /// The core and its memories.
    pub fn cpu(&self) -> &Cpu {
        &self.execution.cpu
    }

    /// The core and its memories, to be changed.
    pub fn cpu_mut(&mut self) -> &mut Cpu {
        &mut self.execution.cpu
    }

    /// The firmware's log.
    pub fn log(&mut self) -> &mut Log {
        &mut self.log
    }

    /// Counts of what has been done so far.
    pub fn counters(&self) -> Counters {
        self.execution.counters()
    }

    /// The core clock in Hz.
    pub fn core_clock(&self) -> u64 {
        self.soc.time.hz()
    }

    /// The most bytes of stack that have been in use since power-on.
    pub fn stack_used(&self) -> u32 {
        self.cpu().sram().used_in(self.stack.clone())
    }

    fn run_on(&mut self, to: Nanos, mut observer: Observer<'_>) -> Result<(), Stop> {
        loop {
            if !self.powered {
                self.soc.board_mut().advance_to(to);
                return Ok(());
            }
            let due = self.soc.settle(self.execution.now);
            let cpu = &self.execution.cpu;
            if let Some(fault) = self.soc.fault {
                return Err(fault.stop(cpu.pc()));
            }
            if let Some(misfit) = self.soc.wiring.misfit() {
                return Err(Stop::Pin(misfit));
            }
            if let Some((pc, reason)) = cpu.refused() {
                return Err(Stop::Instruction { pc, reason });
            }
            if !self.soc.board().is_powered() {
                self.powered = false;
                continue;
            }
            // A core that is locked up waits for a reset, which may come.
            if cpu.is_locked_up() && !self.soc.peripherals.iwdg.is_running() {
                return Err(Stop::LockedUp { pc: cpu.pc() });
            }
            let bites = self.soc.peripherals.iwdg.has_expired();
            if bites || cpu.wants_reset() {
                self.restart(if bites { Cause::Watchdog } else { Cause::Software });
                if self.stops_at_reset {
                    return Ok(());
                }
                continue;
            }
            self.execution.cpu.set_interrupts(self.soc.agenda.interrupts());
            self.execution.cpu.set_up_flash(self.soc.peripherals.flash.setup());
            if self.execution.now >= self.log_due {
                self.log_due = self.execution.now + LOG_EVERY;
                self.log.drain();
            }
            let end = self.soc.time.cycles(to);
            if self.execution.now >= end {
                self.soc.sync();
                return Ok(());
            }
            let due = due.min(end);
            if self.soc.watched.is_spinning() {
                self.execution.skip(&self.soc, due, &mut observer);
            } else {
                self.execution.forget_round();
            }
            self.execution.execute(&mut self.soc, due, &mut observer);
        }
    }

    /// The chip and its core start anew.
    fn restart(&mut self, cause: Cause) {
        self.soc.reset(self.execution.now, cause);
        self.execution.restart();
    }
}
