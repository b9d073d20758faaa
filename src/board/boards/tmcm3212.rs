//! The pins of a board for the TMCM-3212. **They are this project's choice**, not those of a module.
//!
//! Neither microcontroller nor pin map of the TMCM-3212 are published. This is a board of our own with the chips that
//! are: three TMC5160, and an STM32F405VG with an AT25512, which are chosen here. Where the TMCM-1140 or the board for
//! the TMCM-6110 has the same part the pin is the same. **The image does not fit a module as it is sold**: whoever
//! wants to run it there has to find the module's pins first, and write them here.
//!
//! | pin | signal | |
//! |---|---|---|
//! | PA0..PA3 | analog IN0..IN3 | |
//! | PA5 PA6 PA7 | SPI1 clock, in, out: TMC5160s | |
//! | PA8 | clock of all TMC5160s | MCO1, 16 MHz |
//! | PA11 PA12 | USB data | |
//! | PA13 PA14 | SWDIO, SWCLK; connected with each other at power-up: factory reset | |
//! | PA15 | EEPROM chip select | low active |
//! | PB10 PB11 | USART3 out, in: RS485 | |
//! | PB12..PB15 | OUT0..OUT3 | low is on |
//! | PC1 | supply over a divider of 19 | |
//! | PC4 PC5 | LED2 (trouble), LED1 (running) | high is on |
//! | PC10 PC11 PC12 | SPI3 clock, in, out: EEPROM | |
//! | PD0 PD1 | CAN in, out | |
//! | PD2..PD4 | home switches of axes 0 to 2; stop switches and ABN encoders are the TMC5160s' alone | |
//! | PD8..PD11 | IN0..IN3 | |
//! | PD12 | ENABLE input | |
//! | PE1 | DRV_ENN of all TMC5160s | low switches the bridges on |
//! | PE8..PE10 | TMC5160 chip selects of axes 0 to 2 | low active |
//! | PE15 | RS485 direction | high sends |

use embassy_stm32::adc::{Adc, AdcChannel};
use embassy_stm32::gpio::Level;
use embassy_stm32::pac::{GPIOC, GPIOD, GPIOE};
use embassy_stm32::peripherals::{PB10, PB11};

use super::parts;
use super::signals::{self, Axis};
use super::tmc5160::ChipMotors;
use crate::board::stm32f4::eeprom::Eeprom;
use crate::board::stm32f4::line::Line;
use crate::board::stm32f4::motion_bus::MotionBus;
use crate::board::stm32f4::{analog, can, clocks, pads, pins, rs485, usb, watchdog};

/// Number of axes on the board.
pub(crate) const AXES: usize = 3;

/// DRV_ENN of all TMC5160s: high switches the bridges off.
pub(crate) const ENN: Line = Line::new(GPIOE, 1);
/// LED2, high is on.
pub(crate) const TROUBLE: Line = Line::new(GPIOC, 4);
/// The home switches.
const HOMES: [Line; AXES] = Line::row(GPIOD, 2);
/// IN0 to IN3.
const INPUTS: [Line; 4] = Line::row(GPIOD, 8);
/// The ENABLE input.
const ENABLE: Line = Line::new(GPIOD, 12);
/// Supply voltage for which the converter reads full scale: 62.7 V, in units of 0.1 V. The divider is 18 kOhm to 1
/// kOhm, because the module takes up to 53 V.
const SUPPLY: u32 = 627;

/// All parts of the board, ready for use; the motor drivers are off.
pub(crate) type Components = parts::Components<Motors, Signals, Rs485>;
/// The chips of this board, with an EEPROM that is divided as `P` says, and with additions `H`.
pub(crate) type Chips<P, H> = parts::Chips<P, H, Motors, AXES>;
/// The chips that move the motors.
pub(crate) type Motors = ChipMotors<AXES>;
/// Three axes, four inputs, four outputs, no pull-up resistors.
pub(crate) type Signals = signals::Signals<AXES, 4, 4, 0>;
/// The RS485 interface.
pub(crate) type Rs485 = rs485::Pins<PB11, PB10>;

impl Components {
    /// Sets up the microcontroller, first the clocks, then the pins. The motor drivers stay off. To be called once.
    pub(crate) fn start() -> Self {
        let p = clocks::start();
        clocks::give(p.MCO1, p.PA8);
        let signals = Signals {
            axes: HOMES.map(|home| Axis { stall: None, home, right: None, encoder: None }),
            inputs: INPUTS,
            enable: Some(ENABLE),
            outputs: pins::outputs([p.PB12.into(), p.PB13.into(), p.PB14.into(), p.PB15.into()], signals::OFF),
            pull_ups: [],
            led: pins::output(p.PC5.into(), Level::Low),
        };
        let bus = MotionBus::new(p.SPI1, p.PA5, p.PA7, p.PA6);
        let [in0, in1, in2, in3] = [p.PA0.degrade_adc(), p.PA1.degrade_adc(), p.PA2.degrade_adc(), p.PA3.degrade_adc()];
        Components {
            motors: ChipMotors::new(&bus, [p.PE8.into(), p.PE9.into(), p.PE10.into()], p.PE1.into()),
            signals,
            eeprom: Eeprom::new(p.SPI3, p.PC10, p.PC12, p.PC11, p.PA15.into()),
            rs485: Rs485::new(p.USART3, p.PB11, p.PB10, p.PE15.into()),
            can: can::driver(p.CAN1, p.PD0, p.PD1),
            usb: usb::driver(p.USB_OTG_FS, p.PA12, p.PA11),
            analog: analog::Inputs {
                adc: Adc::new(p.ADC1),
                ports: [Some(in0), Some(in1), Some(in2), Some(in3), None],
                supply: p.PC1.degrade_adc(),
                full_scale: SUPPLY,
            },
            watchdog: watchdog::start(p.IWDG),
            factory_reset: pads::connected(p.PA13, p.PA14),
        }
    }
}
