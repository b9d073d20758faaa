//! The board at the microcontroller's pins, as a [`Pinout`] says: its chips, its inputs and outputs, its transceivers.

use super::gpio::Gpio;
use super::misfit::{Misfit, OutputPins};
use super::peripheral::Cycles;
use super::pinout::{Pin, Pinout};
use super::rs485::Rs485;
use super::select::Select;
use super::spi::Word;
use super::timebase::Timebase;
use super::usart::Frame;
use crate::board::{Board, Chip, TMC429_CLOCK_HZ};
use crate::world::{ANALOG_MAX, Outputs};

/// Alternate functions: MCO, TIM4, SPI1, SPI3, USART3, CAN1.
const AF_MCO: u32 = 0;
const AF_TIM4: u32 = 2;
const AF_SPI1: u32 = 5;
const AF_SPI3: u32 = 6;
const AF_USART3: u32 = 7;
const AF_CAN1: u32 = 9;

/// Channels inside the chip: its temperature, its reference (RM0090 13.10).
const TEMPERATURE: u32 = 16;
const REFERENCE: u32 = 17;
/// The converter's full scale: 3.3 V, in microvolts. The sensor has 0.76 V at 25 degrees and 2.5 mV a degree, the
/// reference 1.21 V (tables 70 and 73 of the datasheet).
const FULL_SCALE: i64 = 3_300_000;
const SENSOR_AT_25: i64 = 760_000;
const SENSOR_SLOPE: i64 = 2_500;
const REFERENCE_VOLTAGE: i64 = 1_210_000;

/// An SPI bus of the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SpiBus {
    /// SPI1: the motion chips.
    Motion,
    /// SPI3: the EEPROM.
    Eeprom,
}

impl SpiBus {
    /// Clock, input, output, and their alternate function.
    fn pins(self, pinout: &Pinout) -> ([Pin; 3], u32) {
        match self {
            Self::Motion => (pinout.motion_bus, AF_SPI1),
            Self::Eeprom => (pinout.eeprom_bus, AF_SPI3),
        }
    }

    /// Tells what the firmware does with a pin of the bus that it has left out.
    fn unused(self) -> &'static str {
        match self {
            Self::Motion => "uses SPI1 without it",
            Self::Eeprom => "uses SPI3 without it",
        }
    }

    fn has(self, chip: Chip) -> bool {
        (chip == Chip::At25) == (self == Self::Eeprom)
    }
}

/// The mode of all chips: clock high at rest, data sampled at its rising edge.
const SPI_MODE: u32 = 3;
/// The value that is read from a bus that nobody drives.
const FLOATING: u16 = 0xFF;

/// The wiring of the microcontroller's pins.
#[derive(Debug)]
pub struct Wiring {
    pub(super) board: Board,
    pub(super) rs485: Rs485,
    pinout: &'static Pinout,
    outputs_of_board: OutputPins,
    /// The first pin about which firmware and board disagree.
    misfit: Option<Misfit>,
    /// The ports that the board drives pins of, one bit each.
    driven: u32,
    /// ENN has its pull-up resistor.
    disable_pulled_up: bool,
    /// The pads are connected with each other.
    pads_connected: bool,
    /// In the order of the pinout's.
    selects: Vec<Select>,
    disabled: bool,
    outputs: Outputs,
    clocked: bool,
}

fn selects(pinout: &Pinout) -> Vec<Select> {
    pinout.selects.iter().map(|(_, chip)| Select::new(*chip)).collect()
}

fn level(ports: &[Gpio], (port, pin): Pin) -> Option<bool> {
    let port = ports.get(port)?;
    port.output(pin).or(port.is_pulled_up(pin).then_some(true))
}

fn alternate(ports: &[Gpio], (port, pin): Pin) -> Option<u32> {
    ports.get(port)?.alternate(pin)
}

impl Wiring {
    pub(super) fn new(board: Board, pinout: &'static Pinout) -> Self {
        Self {
            board,
            rs485: Rs485::default(),
            pinout,
            outputs_of_board: OutputPins::of(pinout),
            misfit: None,
            driven: pinout.driven_ports(),
            disable_pulled_up: true,
            pads_connected: false,
            selects: selects(pinout),
            disabled: true,
            outputs: Outputs::default(),
            clocked: true,
        }
    }

    /// Fits the resistor on the board that pulls ENN up, or takes it off. Without it - nobody knows whether the
    /// module has one - the pin keeps its level while nobody drives it.
    pub fn fit_enable_pull_up(&mut self, fitted: bool) {
        self.disable_pulled_up = fitted;
    }

    /// Connects the pads for a factory reset with each other, or not.
    pub fn connect_pads(&mut self, on: bool) {
        self.pads_connected = on;
    }

    /// The board has been switched off: what has been said to it is forgotten.
    pub(super) fn forget(&mut self) {
        self.selects = selects(self.pinout);
        self.disabled = true;
        self.outputs = Outputs::default();
        self.clocked = true;
        self.rs485.forget();
    }

    /// Brings the pins' levels to the board, which has been advanced to `now`. `mco` is the frequency of MCO1.
    pub(super) fn connect(
        &mut self,
        now: Cycles,
        ports: &[Gpio],
        mco: u64,
        time: &Timebase,
    ) -> Result<(), &'static str> {
        let pinout = self.pinout;
        self.misfit = self.misfit.or_else(|| self.outputs_of_board.misfit(ports, pinout));
        for (select, &(pin, chip)) in self.selects.iter_mut().zip(pinout.selects) {
            let low = level(ports, pin) == Some(false);
            if low != select.is_low() {
                if low {
                    self.board.select(chip)
                } else {
                    self.board.deselect(chip)
                }
                select.set(low, self.clocked, now, time)?;
            }
        }
        let on = |pin| level(ports, pin) == Some(true);
        let low = |pin| level(ports, pin) == Some(false);
        let left_alone = self.disable_pulled_up || self.disabled;
        let disabled = level(ports, pinout.disable).unwrap_or(left_alone);
        if disabled != self.disabled {
            self.disabled = disabled;
            self.board.set_disable_pin(disabled);
        }
        let word = |levels: &dyn Fn(Pin) -> bool, pins: &[Pin]| {
            (0..).zip(pins).fold(0, |word, (bit, &pin)| word | u32::from(levels(pin)) << bit)
        };
        let outputs = Outputs {
            digital: word(&low, pinout.outputs),
            pull_ups: word(&on, pinout.pull_ups),
            leds: pinout.leds.map(on),
        };
        if outputs != self.outputs {
            self.outputs = outputs;
            self.board.set_outputs(outputs);
        }
        let [_, _, direction] = pinout.rs485;
        self.rs485.direct(on(direction), now, self.board.now());
        let mco = if alternate(ports, pinout.motion_clock) == Some(AF_MCO) { mco } else { 0 };
        let clocked = mco != 0;
        if clocked && mco != u64::from(TMC429_CLOCK_HZ) {
            return Err("MCO1 gives the motion chips another clock than the 16 MHz of their models");
        }
        if clocked != self.clocked {
            self.clocked = clocked;
            self.board.set_motion_clock(clocked);
        }
        Ok(())
    }

    /// A pin about which firmware and board disagree; none as long as all is well.
    pub(super) fn misfit(&self) -> Option<Misfit> {
        self.misfit
    }

    /// The pin of ENN.
    pub(super) fn disable_pin(&self) -> Pin {
        self.pinout.disable
    }

    /// Whether the board drives pins of a port.
    pub(super) fn drives(&self, port: usize) -> bool {
        self.driven >> port & 1 != 0
    }

    /// Brings the board's outputs to the pins of the ports.
    pub(super) fn drive(&self, ports: &mut [Gpio]) {
        let mut drive = |(port, pin): Pin, high: bool| {
            if let Some(port) = ports.get_mut(port) {
                port.drive(1 << pin, u32::from(high) << pin);
            }
        };
        let levels = self.board.world().inputs();
        for (number, pin) in self.pinout.numbered_inputs() {
            drive(pin, levels >> number & 1 != 0);
        }
        for &(pin, axis) in self.pinout.homes {
            drive(pin, self.board.axis_inputs(axis).home);
        }
        for &(pin, axis) in self.pinout.stalls {
            drive(pin, self.board.axis_inputs(axis).stall);
        }
    }

    /// Whether events of the board may change the level of this pin.
    pub(super) fn moves(&self, pin: Pin) -> bool {
        let Pinout { homes, stalls, .. } = self.pinout;
        let input = self.pinout.numbered_inputs().find(|(_, input)| *input == pin);
        input.is_some_and(|(number, _)| self.board.world().moves_input(number))
            || homes.iter().chain(*stalls).any(|(other, _)| *other == pin)
    }

    /// Brings the level of each pad to the other one, if they are connected.
    pub(super) fn join_pads(&self, ports: &mut [Gpio]) {
        let [io, clock] = self.pinout.pads;
        for (from, to) in [(io, clock), (clock, io)] {
            let level = ports.get(from.0).and_then(|port| port.output(from.1)).filter(|_| self.pads_connected);
            if let Some(port) = ports.get_mut(to.0) {
                match level {
                    Some(high) => port.drive(1 << to.1, u32::from(high) << to.1),
                    None => port.release(1 << to.1),
                }
            }
        }
    }

    /// The count of the encoder on TIM4's inputs, if they are that.
    pub(super) fn encoder(&self, ports: &[Gpio]) -> Option<i64> {
        let connected = self.pinout.encoder?.iter().all(|&pin| alternate(ports, pin) == Some(AF_TIM4));
        connected.then(|| self.board.axis_inputs(0).abn.count)
    }

    /// Whether the CAN transceiver is connected to CAN1.
    pub(super) fn has_can(&self, ports: &[Gpio]) -> bool {
        self.pinout.can.iter().all(|&pin| alternate(ports, pin) == Some(AF_CAN1))
    }

    /// Gives the 12 bits that the converter makes of its input `channel`.
    pub(super) fn convert(&self, channel: u32) -> u16 {
        let inputs = self.board.inputs();
        let of =
            |part: i64, whole: i64| (part.max(0) * i64::from(ANALOG_MAX) / whole.max(1)).min(ANALOG_MAX.into()) as u16;
        match channel {
            TEMPERATURE => of(SENSOR_AT_25 + i64::from(inputs.temperature - 25) * SENSOR_SLOPE, FULL_SCALE),
            REFERENCE => of(REFERENCE_VOLTAGE, FULL_SCALE),
            _ if channel == u32::from(self.pinout.supply) => {
                of(inputs.supply.into(), self.pinout.supply_full_scale.into())
            }
            _ => {
                let mut analog = self.pinout.analog.iter().zip(inputs.analog);
                analog.find(|(input, _)| channel == u32::from(**input)).map_or(0, |(_, reading)| reading)
            }
        }
    }

    /// The selects of a bus that are low.
    fn on(&self, bus: SpiBus) -> impl Iterator<Item = &Select> {
        self.selects.iter().filter(move |select| select.is_low() && bus.has(select.chip()))
    }

    /// The chip that is selected on a bus.
    pub(super) fn selected(&self, bus: SpiBus) -> Option<Chip> {
        self.on(bus).next().map(Select::chip)
    }

    /// A word has been clocked out on a bus; gives what came in. The board has been advanced to its last bit.
    pub(super) fn exchange(
        &mut self,
        bus: SpiBus,
        ports: &[Gpio],
        mode: u32,
        word: Word,
        time: &Timebase,
    ) -> Result<u16, &'static str> {
        let (pins, function) = bus.pins(self.pinout);
        if self.lacks(&pins, function, bus.unused(), ports) {
            return Ok(if word.wide { FLOATING << 8 | FLOATING } else { FLOATING });
        }
        if mode != SPI_MODE {
            return Err("the chips on this bus want SPI mode 3");
        }
        self.on(bus).try_for_each(|select| select.check(word, self.clocked, time))?;
        let chip = self.selected(bus);
        if self.on(bus).count() > 1 {
            return Err("two chips are selected on one bus");
        }
        let mut byte = |mosi: u8| chip.map_or(FLOATING, |chip| self.board.byte(chip, mosi).into());
        Ok(if word.wide { byte((word.mosi >> 8) as u8) << 8 | byte(word.mosi as u8) } else { byte(word.mosi as u8) })
    }

    /// Whether one of the `pins` of a port that is in use does not have the port's `function`, which is noted with what
    /// the `firmware` does.
    fn lacks(&mut self, pins: &[Pin], function: u32, firmware: &'static str, ports: &[Gpio]) -> bool {
        let lacking = pins.iter().find(|&&pin| alternate(ports, pin) != Some(function));
        if let Some(&pin) = lacking {
            self.misfit.get_or_insert_with(|| Misfit::of(self.pinout, pin, firmware));
        }
        lacking.is_some()
    }

    /// USART3 is switched on: so the RS485 transceiver is to be there.
    pub(super) fn use_rs485(&mut self, ports: &[Gpio]) {
        let [sends, receives, _] = self.pinout.rs485;
        self.lacks(&[sends, receives], AF_USART3, "uses USART3 without it", ports);
    }

    /// CAN1 takes part in a bus: so the CAN transceiver is to be there.
    pub(super) fn use_can(&mut self, ports: &[Gpio]) {
        self.lacks(&self.pinout.can, AF_CAN1, "uses CAN1 without it", ports);
    }

    /// Whether the RS485 transceiver's receiver is connected to USART3.
    pub(super) fn hears_rs485(&self, ports: &[Gpio]) -> bool {
        let [_, receives, _] = self.pinout.rs485;
        alternate(ports, receives) == Some(AF_USART3)
    }

    /// USART3 has sent a frame.
    pub(super) fn transmit(&mut self, frame: Frame, ports: &[Gpio], time: &Timebase) {
        let [sends, _, _] = self.pinout.rs485;
        if alternate(ports, sends) == Some(AF_USART3) {
            self.rs485.transmit(frame, time);
        }
    }
}
