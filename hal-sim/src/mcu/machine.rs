//! The whole: core, chip and board, in virtual time.

use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::can::{CanBus, CanFrame};
use super::cpu::{Bus, Cpu, Registers};
use super::elf::Image;
use super::log::{Log, LogLine};
use super::peripheral::Cycles;
use super::pinout::Pinout;
use super::rcc::Cause;
use super::serial::{Character, Incoming};
use super::soc::{Soc, Waiting};
use super::step::{Act, LINES, Observer, Step, View};
use super::stop::Stop;
use super::usb::{UsbDevice, UsbTimes};
use crate::board::{Board, Chip};
use crate::clock::Nanos;

/// The most cycles the core executes before it is asked whether it wants a reset or is stuck.
const SLICE: Cycles = 16_384;
/// How often the log is fetched, in cycles: before its buffer can be full.
const LOG_EVERY: Cycles = 84_000;

/// The chip, as core and machine share it.
#[derive(Debug)]
struct Shared {
    soc: Mutex<Soc>,
    /// The core's time.
    now: AtomicU64,
    /// When the chip wants attention: its next event, or at once after an access.
    due: AtomicU64,
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Soc> {
        self.soc.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Bus for Shared {
    fn read(&self, address: u32, bytes: usize) -> u32 {
        let value = self.lock().read(self.now.load(Ordering::Relaxed), address, bytes);
        self.due.store(0, Ordering::Relaxed);
        value
    }

    fn write(&self, address: u32, bytes: usize, value: u32) {
        self.lock().write(self.now.load(Ordering::Relaxed), address, bytes, value);
        self.due.store(0, Ordering::Relaxed);
    }
}

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

/// The board of the [`Machine`]: to look at, and to change.
#[derive(Debug)]
pub struct BoardAccess<'a>(MutexGuard<'a, Soc>);

impl Deref for BoardAccess<'_> {
    type Target = Board;

    fn deref(&self) -> &Board {
        self.0.board()
    }
}

impl DerefMut for BoardAccess<'_> {
    fn deref_mut(&mut self) -> &mut Board {
        self.0.board_mut()
    }
}

/// A module: the emulated microcontroller with its image, on the simulated board.
///
/// Time passes only in [`run_until`](Self::run_until). Characters of the RS485 bus are given and taken with their
/// times. When the board loses its power, the core stands still until it is [switched on](Self::set_power) again.
pub struct Machine {
    shared: Arc<Shared>,
    cpu: Cpu,
    now: Cycles,
    counters: Counters,
    /// Lines as the core has them.
    interrupts: [u32; LINES],
    powered: bool,
    asleep: bool,
    /// Since when it has neither slept nor used the chip.
    busy_since: Cycles,
    round: Option<Round>,
    stack: core::ops::Range<u32>,
    log: Log,
    log_due: Cycles,
    stops_at_reset: bool,
    stopped: Option<Stop>,
}

impl Machine {
    /// A machine with the image `elf` on `board`, a TMCM-1140, which is switched on: the firmware starts now.
    ///
    /// # Errors
    /// The file is no image for this microcontroller.
    pub fn new(elf: &[u8], board: Board) -> Result<Self, Stop> {
        Self::wired(elf, board, &Pinout::TMCM_1140)
    }

    /// The same with any board, at whose pins the microcontroller is.
    ///
    /// # Errors
    /// As with [`Machine::new`].
    pub fn wired(elf: &[u8], board: Board, pinout: &'static Pinout) -> Result<Self, Stop> {
        let image = Image::parse(elf)?;
        let powered = board.is_powered();
        let soc = Mutex::new(Soc::new(board, pinout, 0));
        let shared = Arc::new(Shared { soc, now: AtomicU64::new(0), due: AtomicU64::new(0) });
        let bus: Arc<dyn Bus> = shared.clone();
        let cpu = Cpu::new(image.flash, &bus)?;
        shared.lock().attach(cpu.sram().clone());
        Ok(Self {
            cpu,
            shared,
            now: 0,
            counters: Counters { starts: powered.into(), ..Counters::default() },
            interrupts: [0; LINES],
            powered,
            asleep: false,
            busy_since: 0,
            round: None,
            stack: image.stack,
            log: Log::new(elf, image.rtt),
            log_due: 0,
            stops_at_reset: false,
            stopped: None,
        })
    }

    /// Virtual time.
    pub fn now(&self) -> Nanos {
        let soc = self.shared.lock();
        if self.powered { soc.time().nanos(self.now) } else { soc.board().now() }
    }

    /// The board at the present time.
    pub fn board(&mut self) -> BoardAccess<'_> {
        let mut soc = self.shared.lock();
        if self.powered {
            soc.settle(self.now);
            soc.sync();
        }
        BoardAccess(soc)
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
        self.log.drain(self.cpu.sram());
        self.stopped = outcome.as_ref().err().cloned();
        outcome
    }

    /// Lets time pass until the microcontroller is reset, by its watchdog or by the program, or until `to`. True if it
    /// was.
    ///
    /// # Errors
    /// As [`run_until`](Self::run_until).
    pub fn run_to_reset(&mut self, to: Nanos) -> Result<bool, Stop> {
        let starts = self.counters.starts;
        self.stops_at_reset = true;
        let outcome = self.run_until(to);
        self.stops_at_reset = false;
        outcome.map(|()| self.counters.starts != starts)
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
        let shared = self.shared.clone();
        let mut soc = shared.lock();
        if on == soc.board().is_powered() {
            return;
        }
        if on {
            soc.power_on();
            self.cpu.sram().forget();
            self.restart(&mut soc, Cause::Power);
            self.powered = true;
        } else {
            soc.settle(self.now);
            soc.sync();
            soc.board_mut().power_off();
            self.powered = false;
        }
    }

    /// Lets the supply of the microcontroller dip: it starts anew as after power-on, while the other chips keep their
    /// registers. RAM stays as it is, the worst case for a firmware that believes what it finds there.
    pub fn brown_out(&mut self) {
        let shared = self.shared.clone();
        let mut soc = shared.lock();
        if self.powered {
            soc.settle(self.now);
            self.restart(&mut soc, Cause::Power);
        }
    }

    /// Fits the resistor on the board that pulls ENN up, or takes it off. Without it - nobody knows whether the
    /// module has one - the pin keeps its level while nobody drives it.
    pub fn fit_enable_pull_up(&mut self, fitted: bool) {
        self.shared.lock().set_disable_pull_up(fitted);
    }

    /// Lets the microcontroller's crystal stop, or swing when it is switched on.
    pub fn set_crystal(&mut self, swings: bool) {
        let mut soc = self.shared.lock();
        soc.settle(self.now);
        if soc.set_crystal(swings) {
            self.cpu.raise_nmi();
        }
    }

    /// The level to which the microcontroller itself drives ENN; none while it leaves the pin to a resistor.
    pub fn enable_pin(&self) -> Option<bool> {
        self.shared.lock().disable_pin().filter(|_| self.powered)
    }

    /// Connects the pads for a factory reset with each other, or not.
    pub fn connect_pads(&mut self, on: bool) {
        self.shared.lock().connect_pads(on);
    }

    /// Programs the flash memory from `address` on, as a debug probe does. Gives what was there; none if it is not
    /// all flash memory.
    pub fn program(&mut self, address: u32, bytes: &[u8]) -> Option<Vec<u8>> {
        self.cpu.program(address, bytes)
    }

    /// Sends bytes to the module over the RS485 bus, one after the other, the first not before `at`. Gives the time
    /// at which the last stop bit ends.
    pub fn send(&mut self, at: Nanos, bytes: &[u8], baud: u32) -> Nanos {
        let now = self.now();
        let mut soc = self.shared.lock();
        for &byte in bytes {
            soc.send(Incoming::byte(at.max(now), byte, baud));
        }
        soc.last_end().unwrap_or(at)
    }

    /// Brings `bits` levels (at most 128) to the RS485 bus, from the lowest of `levels` on, `baud` of them a second, not
    /// before `at`: a break, or noise. The first one is to be low. Gives the time at which the last one ends.
    pub fn send_levels(&mut self, at: Nanos, levels: u128, bits: u32, baud: u32) -> Nanos {
        let start = at.max(self.now());
        let mut soc = self.shared.lock();
        soc.send(Incoming { start, levels, bits: bits.min(128), baud });
        soc.last_end().unwrap_or(at)
    }

    /// What the module has sent on the RS485 bus since the last call.
    pub fn take_sent(&mut self) -> Vec<Character> {
        self.shared.lock().take_sent()
    }

    /// Bit rate at which the module listens and sends on the RS485 bus; none while its port is off.
    pub fn rs485_bit_rate(&self) -> Option<u32> {
        let [rs485, _] = self.bit_rates();
        rs485
    }

    /// Bit rate of the module on the CAN bus; none while it takes no part in the traffic.
    pub fn can_bit_rate(&self) -> Option<u32> {
        let [_, can] = self.bit_rates();
        can
    }

    fn bit_rates(&self) -> [Option<u32>; 2] {
        let soc = self.shared.lock();
        let hz = soc.time().hz();
        soc.bit_times().map(|bit| bit.filter(|_| self.powered).map(|bit| (hz / bit.max(1)) as u32))
    }

    /// How much of what others send has not begun to arrive yet.
    pub fn waiting(&self) -> Waiting {
        self.shared.lock().waiting()
    }

    /// When the RS485 transceiver has begun (true) and ended (false) to send since the last call.
    pub fn take_turns(&mut self) -> Vec<(Nanos, bool)> {
        self.shared.lock().take_turns()
    }

    /// Puts the module on another CAN bus than one of 1 Mbit/s with others on it.
    pub fn set_can_bus(&mut self, bus: CanBus) {
        self.shared.lock().set_can_bus(bus);
    }

    /// Others send a frame on the CAN bus, as soon as it is free.
    pub fn send_frame(&mut self, frame: CanFrame) {
        self.shared.lock().send_frame(frame);
    }

    /// Frames that the module has sent on the CAN bus since the last call, with the times of their ends.
    pub fn take_frames(&mut self) -> Vec<(Nanos, CanFrame)> {
        self.shared.lock().take_frames()
    }

    /// Plugs the USB cable in or out. The host at its other end enumerates the module and opens its serial port.
    pub fn plug_usb(&mut self, on: bool) {
        self.shared.lock().plug_usb(on);
    }

    /// The USB host resets the port, enumerates the module and opens its serial port, as one that starts anew: what was half
    /// said is lost.
    pub fn reset_usb(&mut self) {
        self.shared.lock().reset_usb();
    }

    /// What the USB host knows of the module.
    pub fn usb_device(&self) -> UsbDevice {
        self.shared.lock().usb_device().clone()
    }

    /// Sends bytes to the module's USB serial port, as soon as it is open.
    pub fn send_usb(&mut self, bytes: &[u8]) {
        self.shared.lock().usb_host().send(bytes);
    }

    /// Lets the USB host fetch what the port has for it, or not, as when the program there does not read. When it is
    /// plugged in anew it does.
    pub fn read_usb(&mut self, on: bool) {
        self.shared.lock().usb_host().set_deaf(!on);
    }

    /// What the USB host has received since the last call, each with the short packet that ends it, and when.
    pub fn take_usb(&mut self) -> Vec<(Nanos, Vec<u8>)> {
        self.shared.lock().usb_host().take()
    }

    /// When the module's USB port took and had packets.
    pub fn usb_times(&self) -> UsbTimes {
        self.shared.lock().usb_times()
    }

    /// Whether the image has a log that can be read.
    pub fn has_log(&self) -> bool {
        self.log.is_readable()
    }

    /// The firmware's log since the last call.
    pub fn take_log(&mut self) -> Vec<LogLine> {
        self.log.drain(self.cpu.sram());
        self.log.take()
    }

    /// A debug probe that has fetched the log is pulled off: it had asked the firmware to wait for it, and fetches no more.
    pub fn pull_probe(&mut self) {
        self.log.leave(self.cpu.sram());
    }

    /// What has been done so far.
    pub fn counters(&self) -> Counters {
        Counters { cycles: self.now, ..self.counters }
    }

    /// The core clock in Hz.
    pub fn core_clock(&self) -> u64 {
        self.shared.lock().time().hz()
    }

    /// The most bytes of stack that have been in use since power-on.
    pub fn stack_used(&self) -> u32 {
        self.cpu.sram().used_in(self.stack.clone())
    }

    /// The word at `address` in memory, as a debug probe reads it; none where there is no memory.
    pub fn peek(&self, address: u32) -> Option<u32> {
        self.cpu.peek(address)
    }

    /// Puts another word at `address` in RAM, as a disturbance does. Gives what was there; none where there is no RAM.
    pub fn disturb(&mut self, address: u32, word: u32) -> Option<u32> {
        let before = self.cpu.sram().word(address)?;
        self.cpu.sram().write(address, &word.to_le_bytes())?;
        Some(before)
    }

    /// Whether the core waits for an interrupt or an event.
    pub fn is_asleep(&self) -> bool {
        self.cpu.is_asleep()
    }

    /// Where the program stands.
    pub fn pc(&self) -> u32 {
        self.cpu.pc()
    }

    fn run_on(&mut self, to: Nanos, mut observer: Observer<'_>) -> Result<(), Stop> {
        let shared = self.shared.clone();
        loop {
            let due = {
                let mut soc = shared.lock();
                if !self.powered {
                    soc.board_mut().advance_to(to);
                    return Ok(());
                }
                let due = soc.settle(self.now);
                if let Some(fault) = soc.fault() {
                    let pc = self.cpu.pc();
                    let super::soc::Fault { peripheral, offset, address, written, reason } = fault;
                    return Err(Stop::Access { peripheral, offset, address, written, pc, reason });
                }
                if !soc.board().is_powered() {
                    self.powered = false;
                    continue;
                }
                // A core that is locked up waits for a reset, which may come.
                if self.cpu.is_locked_up() && !soc.has_watchdog() {
                    return Err(Stop::LockedUp { pc: self.cpu.pc() });
                }
                let bites = soc.watchdog_bites();
                if bites || self.cpu.wants_reset() {
                    self.restart(&mut soc, if bites { Cause::Watchdog } else { Cause::Software });
                    if self.stops_at_reset {
                        return Ok(());
                    }
                    continue;
                }
                self.interrupt(soc.interrupts());
                if self.now >= self.log_due {
                    self.log_due = self.now + LOG_EVERY;
                    self.log.drain(self.cpu.sram());
                }
                let end = soc.time().cycles(to);
                if self.now >= end {
                    soc.sync();
                    return Ok(());
                }
                let due = due.min(end);
                if soc.is_spinning() {
                    let bus = soc.motion_bus();
                    self.skip(due, bus, &mut observer);
                } else {
                    self.round = None;
                }
                due
            };
            shared.due.store(due, Ordering::Relaxed);
            self.execute(due, &mut observer);
        }
    }

    /// Executes until the chip wants attention.
    fn execute(&mut self, due: Cycles, observer: &mut Observer<'_>) {
        if observer.is_none() && self.now >= self.busy_since + SLICE {
            self.pass_over(due);
        }
        let end = due.min(self.now + SLICE);
        let mut now = self.now;
        let mut instructions = 0;
        while now < end.min(self.shared.due.load(Ordering::Relaxed)) {
            self.shared.now.store(now, Ordering::Relaxed);
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
        if self.asleep || self.shared.due.load(Ordering::Relaxed) == 0 {
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
            self.shared.now.store(self.now, Ordering::Relaxed);
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
    fn skip(&mut self, due: Cycles, bus: (Option<Chip>, bool), observer: &mut Observer<'_>) {
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
    fn interrupt(&mut self, lines: [u32; LINES]) {
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

    fn restart(&mut self, soc: &mut Soc, cause: Cause) {
        soc.reset(self.now, cause);
        self.cpu.reset();
        self.interrupts = [0; LINES];
        self.asleep = false;
        self.round = None;
        self.counters.starts += 1;
    }
}
