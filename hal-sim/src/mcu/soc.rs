//! The chip around the core: decodes addresses, and carries clocks, interrupts and signals between peripherals,
//! pins and board.

use super::adc::Adc;
use super::can::{Can, CanBus, CanFrame};
use super::cpu::Sram;
use super::dbgmcu::Dbgmcu;
use super::dma::Dma;
use super::exti::Exti;
use super::flash::Flash;
use super::gpio::Gpio;
use super::iwdg::Iwdg;
use super::peripheral::{Cycles, NEVER, Peripheral, Refusal, bit};
use super::pinout::Pinout;
use super::pwr::Pwr;
use super::rcc::{Cause, Clocks, Rcc};
use super::serial::{Character, Incoming};
use super::spi::Spi;
use super::syscfg::Syscfg;
use super::timebase::Timebase;
use super::timer::Timer;
use super::unit::{Decoder, SIZE, Unit};
use super::usart::Usart;
use super::usb::{Host, Otg, UsbDevice, UsbTimes};
use super::wiring::{SpiBus, Wiring};
use crate::board::{Board, Chip};
use crate::clock::{MICROSECOND, Nanos};

mod transfer;

/// Ports A to E.
const PORTS: usize = 5;
/// How long the channels inside the chip have to be sampled (table 70 of the datasheet).
const INNER_SAMPLING: Nanos = 10 * MICROSECOND;
/// How many interrupt lines there are, in words of 32.
const WORDS: usize = 3;
/// Reads of the same value from the same register that look like waiting.
const SPIN: u32 = 2;

/// An access that ends the run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fault {
    pub(super) peripheral: &'static str,
    pub(super) offset: u32,
    pub(super) address: u32,
    pub(super) written: Option<u32>,
    pub(super) reason: &'static str,
}

/// How much of what others send has not begun to arrive yet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Waiting {
    /// Bytes on the RS485 bus.
    pub rs485: usize,
    /// Bytes over USB.
    pub usb: usize,
    /// Frames on the CAN bus.
    pub can: usize,
}

/// The last register read, and how often it gave the same with nothing in between.
#[derive(Clone, Copy, Debug, Default)]
struct Watched {
    address: u32,
    value: u32,
    times: u32,
}

/// The chip without its core.
#[derive(Debug)]
pub(super) struct Soc {
    now: Cycles,
    time: Timebase,
    clocks: Clocks,
    decoder: Decoder,
    ports: [Gpio; PORTS],
    rcc: Rcc,
    flash: Flash,
    pwr: Pwr,
    syscfg: Syscfg,
    exti: Exti,
    dbgmcu: Dbgmcu,
    timers: [Timer; 4],
    usarts: [Usart; 3],
    spis: [Spi; 3],
    dmas: [Dma; 2],
    adc: Adc,
    iwdg: Iwdg,
    can: Can,
    otg: Otg,
    /// The other end of the USB cable.
    host: Host,
    /// What DMA reaches, once the core is there.
    sram: Option<Sram>,
    /// When each peripheral has its next event.
    due: [Cycles; Unit::ALL.len()],
    /// Interrupt lines of each peripheral.
    lines: [u32; Unit::ALL.len()],
    /// Peripherals that have been accessed, or had an event: one bit each.
    touched: u64,
    /// All interrupt lines.
    interrupts: [u32; WORDS],
    watched: Watched,
    wiring: Wiring,
    fault: Option<Fault>,
}

/// Whether registers of `unit` change only with events: not so counters, and pins that the board drives.
fn changes_by_events(unit: Unit) -> bool {
    use Unit::{GpioA, GpioB, GpioC, GpioD, GpioE, Tim2, Tim3, Tim4, Tim5};
    !matches!(unit, GpioA | GpioB | GpioC | GpioD | GpioE | Tim2 | Tim3 | Tim4 | Tim5)
}

/// Whether an access to `unit` may change the levels that the external interrupt lines see: by what it drives, selects
/// on the board, or chooses to look at. What others do to a pin takes an event of the board.
fn decides_on_pins(unit: Unit) -> bool {
    use Unit::{Exti, GpioA, GpioB, GpioC, GpioD, GpioE, Rcc, Syscfg};
    matches!(unit, Exti | GpioA | GpioB | GpioC | GpioD | GpioE | Rcc | Syscfg)
}

impl Soc {
    /// The chip just switched on, at the board's time, when the core has counted `now` cycles.
    pub(super) fn new(board: Board, pinout: &'static Pinout, now: Cycles) -> Self {
        let rcc = Rcc::new(now, Cause::Power, 0);
        let clocks = rcc.clocks();
        let mut soc = Self {
            now,
            time: Timebase::new(clocks.hz, now, board.now()),
            clocks,
            decoder: Decoder::new(),
            ports: std::array::from_fn(Gpio::new),
            rcc,
            flash: Flash::default(),
            pwr: Pwr::new(),
            syscfg: Syscfg::default(),
            exti: Exti::default(),
            dbgmcu: Dbgmcu::default(),
            timers: [Timer::new(true), Timer::new(false), Timer::new(false), Timer::new(true)],
            usarts: std::array::from_fn(|_| Usart::new()),
            spis: std::array::from_fn(|_| Spi::new()),
            dmas: std::array::from_fn(Dma::new),
            adc: Adc::new(),
            iwdg: Iwdg::new(),
            can: Can::new(),
            otg: Otg::new(),
            host: Host::new(),
            sram: None,
            due: [NEVER; Unit::ALL.len()],
            lines: [0; Unit::ALL.len()],
            touched: 0,
            interrupts: [0; WORDS],
            watched: Watched::default(),
            wiring: Wiring::new(board, pinout),
            fault: None,
        };
        soc.start();
        soc
    }

    /// All peripherals start anew, for `cause`. The board has been told of it.
    pub(super) fn reset(&mut self, now: Cycles, cause: Cause) {
        self.now = now;
        // While the board was off, its time went on and no cycle was counted.
        let nanos = self.time.nanos(now).max(self.board().now());
        self.time = Timebase::new(self.time.hz(), now, nanos);
        for unit in Unit::ALL {
            self.peripheral(unit).reset();
        }
        self.rcc = self.rcc.restarted(now, cause);
        self.host.device_lost(self.time.nanos(now), &mut self.otg);
        self.watched = Watched::default();
        self.fault = None;
        self.start();
    }

    fn start(&mut self) {
        let now = self.now;
        for unit in Unit::ALL {
            self.peripheral(unit).advance(now);
        }
        self.touched = (1 << Unit::ALL.len()) - 1;
        self.apply_clocks();
    }

    /// The conversion between core cycles and virtual time.
    pub(super) fn time(&self) -> &Timebase {
        &self.time
    }

    /// The board as it is.
    pub(super) fn board(&self) -> &Board {
        &self.wiring.board
    }

    /// The board, to be changed, at the present time.
    pub(super) fn board_mut(&mut self) -> &mut Board {
        self.touched |= 1 << Unit::Exti as u32;
        &mut self.wiring.board
    }

    /// The board has its power again.
    pub(super) fn power_on(&mut self) {
        self.wiring.forget();
        self.can.forget();
        self.wiring.board.power_on();
    }

    /// Levels of the interrupt lines, one bit each.
    pub(super) fn interrupts(&self) -> [u32; WORDS] {
        self.interrupts
    }

    /// The access that ended the run.
    pub(super) fn fault(&self) -> Option<Fault> {
        self.fault
    }

    /// True while the program seems to wait for the register it has just read.
    pub(super) fn is_spinning(&self) -> bool {
        self.watched.times >= SPIN
    }

    /// DMA works on this memory.
    pub(super) fn attach(&mut self, sram: Sram) {
        self.sram = Some(sram);
    }

    /// Whether there is a watchdog that will bite.
    pub(super) fn has_watchdog(&self) -> bool {
        self.iwdg.is_running()
    }

    /// Whether the watchdog has not been fed.
    pub(super) fn watchdog_bites(&self) -> bool {
        self.iwdg.has_expired()
    }

    /// Fits the resistor that pulls ENN up, or takes it off.
    pub(super) fn set_disable_pull_up(&mut self, fitted: bool) {
        self.wiring.disable_pulled_up = fitted;
    }

    /// Lets the crystal stop or swing; true if that is an NMI.
    pub(super) fn set_crystal(&mut self, swings: bool) -> bool {
        match self.rcc.set_crystal(swings) {
            Ok(missed) => {
                self.apply_clocks();
                missed
            }
            Err(reason) => {
                self.refuse("RCC", 0, Unit::Rcc.description().base, None, reason);
                false
            }
        }
    }

    /// The level that ENN is driven to.
    pub(super) fn disable_pin(&self) -> Option<bool> {
        self.wiring.disable_pin(&self.ports)
    }

    /// Connects the pads for a factory reset with each other, or not.
    pub(super) fn connect_pads(&mut self, on: bool) {
        self.wiring.pads_connected = on;
    }

    /// The CAN bus that the module is on.
    pub(super) fn set_can_bus(&mut self, bus: CanBus) {
        self.can.set_bus(bus);
    }

    /// Plugs the USB cable in or out.
    pub(super) fn plug_usb(&mut self, on: bool) {
        self.host.plug(self.time.nanos(self.now), on, &mut self.otg);
        self.touched |= 1 << Unit::OtgFs as u32;
    }

    /// The USB host resets the port and begins anew.
    pub(super) fn reset_usb(&mut self) {
        self.host.reset(self.time.nanos(self.now), &mut self.otg);
        self.touched |= 1 << Unit::OtgFs as u32;
    }

    /// The USB host.
    pub(super) fn usb_host(&mut self) -> &mut Host {
        &mut self.host
    }

    /// What the USB host knows of the module.
    pub(super) fn usb_device(&self) -> &UsbDevice {
        self.host.device()
    }

    /// When the USB port took and had packets.
    pub(super) fn usb_times(&self) -> UsbTimes {
        self.host.times()
    }

    /// The chip that is selected on the motion bus, and whether a word is on the wire.
    pub(super) fn motion_bus(&self) -> (Option<Chip>, bool) {
        (self.wiring.selected(SpiBus::Motion), self.spis[0].is_shifting())
    }

    /// Others want to send a frame on the CAN bus.
    pub(super) fn send_frame(&mut self, frame: CanFrame) {
        self.can.advance(self.now);
        self.can.send(frame);
        self.touched |= 1 << Unit::Can1 as u32;
    }

    /// Frames of the module that have been on the CAN bus since the last call, with the times of their ends.
    pub(super) fn take_frames(&mut self) -> Vec<(Nanos, CanFrame)> {
        let sent = self.can.take_sent();
        sent.into_iter().map(|(frame, at)| (self.time.nanos(at), frame)).collect()
    }

    /// Others send on the RS485 bus.
    pub(super) fn send(&mut self, character: Incoming) {
        self.wiring.send(character);
    }

    /// When all that others send on the RS485 bus has been sent.
    pub(super) fn last_end(&self) -> Option<Nanos> {
        self.wiring.last_end()
    }

    /// How much others still want to send.
    pub(super) fn waiting(&self) -> Waiting {
        Waiting { rs485: self.wiring.waiting(), usb: self.host.waiting(), can: self.can.waiting() }
    }

    /// Core cycles of a bit on the RS485 port and on the CAN bus, as the module has set them.
    pub(super) fn bit_times(&self) -> [Option<Cycles>; 2] {
        [self.usarts[2].bit_time(), self.can.bit_time()]
    }

    /// When the RS485 transceiver has begun (true) and ended to send since the last call.
    pub(super) fn take_turns(&mut self) -> Vec<(Nanos, bool)> {
        self.wiring.take_turns()
    }

    /// What the module has sent on the RS485 bus since the last call.
    pub(super) fn take_sent(&mut self) -> Vec<Character> {
        self.wiring.take_sent()
    }

    /// The core reads.
    pub(super) fn read(&mut self, now: Cycles, address: u32, bytes: usize) -> u32 {
        self.now = now;
        let word = address & !3;
        let Some((unit, offset)) = self.enter(word, None) else { return 0 };
        let outcome = self.peripheral(unit).read(offset);
        let value = self.outcome(unit, offset, word, None, outcome).unwrap_or(0);
        if self.watched.address == address && self.watched.value == value && changes_by_events(unit) {
            self.watched.times += 1;
        } else {
            self.watched = Watched { address, value, times: 0 };
        }
        let shifted = value >> (8 * (address & 3));
        if bytes < 4 { shifted & ((1 << (8 * bytes)) - 1) } else { shifted }
    }

    /// The core writes.
    pub(super) fn write(&mut self, now: Cycles, address: u32, _bytes: usize, value: u32) {
        self.now = now;
        self.watched = Watched::default();
        if let Some((unit, offset)) = self.enter(address, Some(value)) {
            let outcome = if address & 3 == 0 {
                self.peripheral(unit).write(offset, value)
            } else {
                Err(Refusal::Use("writes of single bytes are not modelled"))
            };
            self.outcome(unit, offset, address, Some(value), outcome);
            self.touched |= 1 << unit as u32;
        }
    }

    /// Finds the peripheral of an access and brings it up to date.
    fn enter(&mut self, address: u32, written: Option<u32>) -> Option<(Unit, u32)> {
        let Some((unit, offset)) = self.decoder.find(address) else {
            self.refuse("nothing known", address % SIZE, address, written, "this peripheral is not modelled");
            return None;
        };
        if !self.rcc.is_enabled(unit) {
            // It reads zero (RM0090 7.3); a write would be lost.
            if written.is_some() {
                self.refuse(unit.description().name, offset, address, written, "its clock is off");
            }
            return None;
        }
        let now = self.now;
        self.peripheral(unit).advance(now);
        if unit.port().is_some_and(|port| self.wiring.drives(port)) {
            // Pins that the board drives are read as they are now.
            self.sync();
            self.wiring.drive(&mut self.ports);
        }
        if unit == Unit::GpioA {
            self.wiring.join_pads(&mut self.ports);
        }
        if unit == Unit::Tim4 && self.timers[2].follows_encoder() {
            self.sync();
            if let Some(count) = self.wiring.encoder(&self.ports) {
                self.timers[2].follow(count);
            }
        }
        // Reading takes data and clears flags.
        self.touched |= 1 << unit as u32;
        Some((unit, offset))
    }

    fn outcome<T>(
        &mut self,
        unit: Unit,
        offset: u32,
        address: u32,
        written: Option<u32>,
        outcome: Result<T, Refusal>,
    ) -> Option<T> {
        let reason = match outcome {
            Ok(value) => return Some(value),
            Err(Refusal::Register) => "this register is not modelled",
            Err(Refusal::Use(reason)) => reason,
        };
        self.refuse(unit.description().name, offset, address, written, reason);
        None
    }

    fn refuse(
        &mut self,
        peripheral: &'static str,
        offset: u32,
        address: u32,
        written: Option<u32>,
        reason: &'static str,
    ) {
        self.fault.get_or_insert(Fault { peripheral, offset, address, written, reason });
    }

    /// Brings everything to `now`: events that are due, and what accesses have brought about. Gives the time of the
    /// next event.
    pub(super) fn settle(&mut self, now: Cycles) -> Cycles {
        self.now = now;
        loop {
            for unit in Unit::ALL {
                if self.due[unit as usize] <= now {
                    self.peripheral(unit).advance(now);
                    self.touched |= 1 << unit as u32;
                    // What was read may have changed since: nobody knows yet that it is waited for on.
                    self.watched = Watched::default();
                }
            }
            self.hear();
            if self.pins_change() <= now {
                self.watch_pins();
            }
            let time = self.time.nanos(now);
            if self.host.next_event() <= time {
                self.host.advance(time, &mut self.otg);
                self.touched |= 1 << Unit::OtgFs as u32;
            }
            if self.touched == 0 {
                break;
            }
            let mut touched = std::mem::take(&mut self.touched);
            while touched != 0 {
                let index = touched.trailing_zeros() as usize;
                touched &= touched - 1;
                if let Some(&unit) = Unit::ALL.get(index) {
                    self.follow(unit);
                    self.refresh(unit);
                }
            }
            self.transfer();
        }
        self.next_event()
    }

    /// When something happens next, the core apart.
    fn next_event(&self) -> Cycles {
        let start = self.wiring.next_start().map_or(NEVER, |at| self.time.cycles(at));
        let host = match self.host.next_event() {
            Nanos::MAX => NEVER,
            at => self.time.cycles(at),
        };
        self.due.into_iter().fold(start.min(self.pins_change()).min(host), Cycles::min).max(self.now + 1)
    }

    /// When a pin may change next that an external interrupt line looks at.
    fn pins_change(&self) -> Cycles {
        let watched = self.exti.watched();
        let moves = |line| bit(watched, line) && self.wiring.moves((self.syscfg.port(line as usize), line));
        let change = if (0..16).any(moves) { self.wiring.board.next_event() } else { None };
        change.map_or(NEVER, |at| self.time.cycles(at))
    }

    /// What happens around a peripheral that has changed.
    fn follow(&mut self, unit: Unit) {
        match unit {
            Unit::GpioA | Unit::GpioB | Unit::GpioC | Unit::GpioD | Unit::GpioE => self.connect(unit),
            Unit::Rcc => {
                if let Some((group, bits)) = self.rcc.take_resets() {
                    let reset = |unit: &Unit| {
                        let description = unit.description();
                        description.group == group && bit(bits, description.bit)
                    };
                    for unit in Unit::ALL.into_iter().filter(reset) {
                        self.peripheral(unit).reset();
                        self.touched |= 1 << unit as u32;
                    }
                }
                self.apply_clocks();
            }
            Unit::Spi1 => self.exchange(SpiBus::Motion, 0),
            Unit::Spi3 => self.exchange(SpiBus::Eeprom, 2),
            Unit::Usart3 => {
                if let Some(frame) = self.usarts[2].take_sent() {
                    self.wiring.transmit(frame, &self.ports, &self.time);
                }
            }
            Unit::Adc1 => {
                if let Some(channel) = self.adc.take_done() {
                    self.sync();
                    if channel >= 16 && self.adc.sampling(channel) < self.time.span(INNER_SAMPLING) {
                        let base = Unit::Adc1.description().base;
                        self.refuse("ADC1", 0, base, None, "the channels inside the chip want 10 us to be sampled");
                    }
                    let value =
                        if channel < 16 || self.adc.inner_channels() { self.wiring.convert(channel) } else { 0 };
                    self.adc.complete(value);
                }
            }
            Unit::OtgFs => self.host.notice(self.time.nanos(self.now), &self.otg),
            Unit::Can1 if !self.wiring.has_can(&self.ports) => self.can.disconnect(),
            _ => {}
        }
        if self.exti.watched() != 0 && decides_on_pins(unit) {
            self.watch_pins();
        }
    }

    /// Asks a peripheral for its next event and its interrupts.
    fn refresh(&mut self, unit: Unit) {
        let peripheral = self.peripheral(unit);
        let (due, lines) = (peripheral.next_event(), peripheral.interrupts());
        self.due[unit as usize] = due;
        if lines != self.lines[unit as usize] {
            self.lines[unit as usize] = lines;
            for (index, &number) in unit.description().interrupts.iter().enumerate() {
                let (word, mask) = (usize::from(number / 32), 1 << (number % 32));
                if bit(lines, index as u32) {
                    self.interrupts[word] |= mask;
                } else {
                    self.interrupts[word] &= !mask;
                }
            }
        }
    }

    /// Brings the clocks that RCC makes to all that runs on them.
    fn apply_clocks(&mut self) {
        let clocks = self.rcc.clocks();
        if clocks == self.clocks && self.time.hz() == clocks.hz {
            self.connect(Unit::Rcc);
        } else {
            // What has been counted so far was at the old clocks.
            for unit in Unit::ALL {
                let now = self.now;
                self.peripheral(unit).advance(now);
            }
            self.sync();
            self.clocks = clocks;
            self.time.change(clocks.hz, self.now);
            self.connect(Unit::Rcc);
        }
        for unit in Unit::ALL {
            self.peripheral(unit).set_divider(clocks.divider(unit));
        }
        self.can.set_core_clock(clocks.hz);
        self.touched |= ((1 << Unit::ALL.len()) - 1) & !(1 << Unit::Rcc as u32);
        if !self.flash.keeps_up_with(clocks.hz) {
            let base = Unit::Flash.description().base;
            self.refuse("FLASH", 0, base, None, "too few wait states for the core clock");
        }
    }

    /// Advances the board to the present.
    pub(super) fn sync(&mut self) {
        let now = self.time.nanos(self.now);
        self.wiring.board.advance_to(now);
    }

    /// Brings the levels of the pins to the board.
    fn connect(&mut self, unit: Unit) {
        self.sync();
        if let Err(reason) = self.wiring.connect(self.now, &self.ports, self.clocks.mco1, &self.time) {
            let description = unit.description();
            self.refuse(description.name, 0, description.base, None, reason);
        }
    }

    /// A word has been clocked out on a bus.
    fn exchange(&mut self, bus: SpiBus, index: usize) {
        let Some(word) = self.spis[index].take_done() else { return };
        self.wiring.board.advance_to(self.time.nanos(word.at));
        let mode = self.spis[index].mode();
        match self.wiring.exchange(bus, &self.ports, mode, word, &self.time) {
            Ok(miso) => self.spis[index].complete(miso),
            Err(reason) => {
                let base = if index == 0 { Unit::Spi1 } else { Unit::Spi3 }.description();
                self.refuse(base.name, 0, base.base, None, reason);
            }
        }
    }

    /// Start bits on the RS485 bus that are due.
    fn hear(&mut self) {
        let now = self.time.nanos(self.now);
        while self.wiring.next_start().is_some_and(|start| self.time.cycles(start) <= self.now) {
            if let Some(edge) =
                self.wiring.hear(now.max(self.wiring.next_start().unwrap_or(now)), &self.ports, &self.time)
            {
                self.usarts[2].advance(self.now);
                self.usarts[2].receive(edge);
                self.touched |= 1 << Unit::Usart3 as u32;
            }
        }
    }

    /// Shows the external interrupt lines the pins they look at.
    fn watch_pins(&mut self) {
        self.sync();
        self.wiring.drive(&mut self.ports);
        let levels = (0..16).fold(0, |levels, line| {
            let port = self.ports.get(self.syscfg.port(line));
            levels | u32::from(port.is_some_and(|port| bit(port.levels(), line as u32))) << line
        });
        self.exti.set_levels(levels);
        self.refresh(Unit::Exti);
    }

    fn peripheral(&mut self, unit: Unit) -> &mut dyn Peripheral {
        match unit {
            Unit::GpioA => &mut self.ports[0],
            Unit::GpioB => &mut self.ports[1],
            Unit::GpioC => &mut self.ports[2],
            Unit::GpioD => &mut self.ports[3],
            Unit::GpioE => &mut self.ports[4],
            Unit::Rcc => &mut self.rcc,
            Unit::Flash => &mut self.flash,
            Unit::Pwr => &mut self.pwr,
            Unit::Syscfg => &mut self.syscfg,
            Unit::Exti => &mut self.exti,
            Unit::Dbgmcu => &mut self.dbgmcu,
            Unit::Tim2 => &mut self.timers[0],
            Unit::Tim3 => &mut self.timers[1],
            Unit::Tim4 => &mut self.timers[2],
            Unit::Tim5 => &mut self.timers[3],
            Unit::Usart1 => &mut self.usarts[0],
            Unit::Usart2 => &mut self.usarts[1],
            Unit::Usart3 => &mut self.usarts[2],
            Unit::Spi1 => &mut self.spis[0],
            Unit::Spi2 => &mut self.spis[1],
            Unit::Spi3 => &mut self.spis[2],
            Unit::Dma1 => &mut self.dmas[0],
            Unit::Dma2 => &mut self.dmas[1],
            Unit::Adc1 => &mut self.adc,
            Unit::Iwdg => &mut self.iwdg,
            Unit::Can1 => &mut self.can,
            Unit::OtgFs => &mut self.otg,
        }
    }
}

#[cfg(test)]
mod tests;
