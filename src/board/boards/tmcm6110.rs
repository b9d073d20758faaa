//! The pins of a board for the TMCM-6110. **They are this project's choice**, not those of a module.
//!
//! Neither microcontroller nor pin map of the TMCM-6110 are published. This is a board of our own with the chips that
//! are: two TMC429, six TMC262, and an STM32F405VG with an AT25256, which are chosen here. Where the TMCM-1140 has the
//! same part the pin is the same. **The image does not fit a module as it is sold**: whoever wants to run it there has
//! to find the module's pins first, and write them here.
//!
//! | pin | signal | |
//! |---|---|---|
//! | PA3 PA4 | TMC429 chip selects: axes 3 to 5, axes 0 to 2 | low active |
//! | PA5 PA6 PA7 | SPI1 clock, in, out: TMC429s and TMC262s | |
//! | PA8 | clock of both TMC429s | MCO1, 16 MHz |
//! | PA11 PA12 | USB data | |
//! | PA13 PA14 | SWDIO, SWCLK; connected with each other at power-up: factory reset | |
//! | PA15 | EEPROM chip select | low active |
//! | PB8 PB9 | pull-up resistors of the switches of axes 0 to 2, of axes 3 to 5 | high is on |
//! | PB10 PB11 | USART3 out, in: RS485 | |
//! | PB12..PB15 PC6..PC9 | OUT0..OUT7 | low is on |
//! | PC0 PC1 PC2 | analog IN0, supply over a divider of 11, analog IN4 | |
//! | PC4 PC5 | LED2 (trouble), LED1 (running) | high is on |
//! | PC10 PC11 PC12 | SPI3 clock, in, out: EEPROM | |
//! | PD0 PD1 | CAN in, out | |
//! | PD2..PD7 | home switches of axes 0 to 5; the stop switches are the TMC429s' alone | |
//! | PD8..PD15 | IN0..IN7 | |
//! | PE1 | ENN of all TMC262s | low switches the bridges on |
//! | PE2..PE7 | SG_TST of the TMC262s of axes 0 to 5 | high on a stall |
//! | PE8..PE13 | TMC262 chip selects of axes 0 to 5 | low active |
//! | PE15 | RS485 direction | high sends |

use core::array::from_fn;

use embassy_stm32::adc::{Adc, AdcChannel};
use embassy_stm32::gpio::Level;
use embassy_stm32::pac::{GPIOC, GPIOD, GPIOE};
use embassy_stm32::peripherals::{PB10, PB11};

use super::parts;
use super::signals::{self, Axis};
use super::tmc429_tmc262::StepMotors;
use crate::board::stm32f4::eeprom::Eeprom;
use crate::board::stm32f4::line::Line;
use crate::board::stm32f4::motion_bus::MotionBus;
use crate::board::stm32f4::{analog, can, clocks, pads, pins, rs485, usb, watchdog};

/// Number of axes on the board.
pub(crate) const AXES: usize = 6;

/// ENN of all TMC262s: high switches the bridges off.
pub(crate) const ENN: Line = Line::new(GPIOE, 1);
/// LED2, high is on.
pub(crate) const TROUBLE: Line = Line::new(GPIOC, 4);
/// SG_TST of the TMC262s.
const STALLS: [Line; AXES] = Line::row(GPIOE, 2);
/// The home switches.
const HOMES: [Line; AXES] = Line::row(GPIOD, 2);
/// IN0 to IN7.
const INPUTS: [Line; 8] = Line::row(GPIOD, 8);
/// Supply voltage for which the converter reads full scale: 36.3 V, in units of 0.1 V. The divider is 10 kOhm to 1
/// kOhm.
const SUPPLY: u32 = 363;

/// All parts of the board, ready for use; the motor drivers are off.
pub(crate) type Components = parts::Components<Motors, Signals, Rs485>;
/// The chips of this board, with an EEPROM that is divided as `P` says, and with additions `H`.
pub(crate) type Chips<P, H> = parts::Chips<P, H, Motors, AXES>;
/// The chips that move the motors.
pub(crate) type Motors = StepMotors<AXES, 2>;
/// Six axes, eight inputs, eight outputs, two groups of pull-up resistors.
pub(crate) type Signals = signals::Signals<AXES, 8, 8, 2>;
/// The RS485 interface.
pub(crate) type Rs485 = rs485::Pins<PB11, PB10>;

impl Components {
    /// Sets up the microcontroller, first the clocks, then the pins. The motor drivers stay off. To be called once.
    pub(crate) fn start() -> Self {
        let p = clocks::start();
        clocks::give(p.MCO1, p.PA8);
        STALLS.iter().for_each(|stall| stall.pull_down());
        let [out0, out1, out2, out3] = [p.PB12.into(), p.PB13.into(), p.PB14.into(), p.PB15.into()];
        let [out4, out5, out6, out7] = [p.PC6.into(), p.PC7.into(), p.PC8.into(), p.PC9.into()];
        let signals = Signals {
            axes: from_fn(|axis| Axis { stall: Some(STALLS[axis]), home: HOMES[axis], right: None, encoder: None }),
            inputs: INPUTS,
            enable: None,
            outputs: pins::outputs([out0, out1, out2, out3, out4, out5, out6, out7], signals::OFF),
            pull_ups: pins::outputs([p.PB8.into(), p.PB9.into()], Level::High),
            led: pins::output(p.PC5.into(), Level::Low),
        };
        let bus = MotionBus::new(p.SPI1, p.PA5, p.PA7, p.PA6);
        let drivers = [p.PE8.into(), p.PE9.into(), p.PE10.into(), p.PE11.into(), p.PE12.into(), p.PE13.into()];
        Components {
            motors: StepMotors::new(&bus, [p.PA4.into(), p.PA3.into()], drivers, p.PE1.into()),
            signals,
            eeprom: Eeprom::new(p.SPI3, p.PC10, p.PC12, p.PC11, p.PA15.into()),
            rs485: Rs485::new(p.USART3, p.PB11, p.PB10, p.PE15.into()),
            can: can::driver(p.CAN1, p.PD0, p.PD1),
            usb: usb::driver(p.USB_OTG_FS, p.PA12, p.PA11),
            analog: analog::Inputs {
                adc: Adc::new(p.ADC1),
                ports: [Some(p.PC0.degrade_adc()), None, None, None, Some(p.PC2.degrade_adc())],
                supply: p.PC1.degrade_adc(),
                full_scale: SUPPLY,
            },
            watchdog: watchdog::start(p.IWDG),
            factory_reset: pads::connected(p.PA13, p.PA14),
        }
    }
}
