//! The pins and clocks of the TMCM-1140, as far as they are known.
//!
//! Microcontroller and pin map of the TMCM-1140 are not published. This is the map of its closest published sibling,
//! which has the same motion controller, driver, EEPROM and interfaces, and whose GD32F425VG is pin and register
//! compatible with the STM32F405VG used here. Pins marked "chosen" have no counterpart on the sibling: they were chosen
//! for this firmware. **The whole map is to be checked against the module before flashing.**
//!
//! | pin | signal | |
//! |---|---|---|
//! | PA4 | TMC429 chip select | low active |
//! | PA5 PA6 PA7 | SPI1 clock, in, out: TMC429 and TMC262 | |
//! | PA8 | clock of the TMC429 | MCO1, 16 MHz |
//! | PA11 PA12 | USB data | |
//! | PA13 PA14 | SWDIO, SWCLK; connected with each other at power-up: factory reset | |
//! | PA15 | EEPROM chip select | low active |
//! | PB10 PB11 | USART3 out, in: RS485 | |
//! | PC0 PC1 | analog IN0, supply over a divider of 11 | chosen |
//! | PC3 | TMC262 chip select | low active |
//! | PC4 PC5 | LED2 (trouble), LED1 (running) | high is on |
//! | PC10 PC11 PC12 | SPI3 clock, in, out: EEPROM | |
//! | PD0 PD1 | CAN in, out | |
//! | PD8 PD9 | OUT0, OUT1 | chosen; high is on |
//! | PD10 | pull-up resistors of IN1..IN3 | chosen; high is on |
//! | PD11..PD14 | IN0..IN3 | chosen; PD12, PD13 are the inputs of TIM4, which can count the ABN encoder at IN1, IN2 |
//! | PE0 | SG_TST of the TMC262 | high on a stall |
//! | PE1 | ENN of the TMC262 | low switches the bridges on |
//! | PE15 | RS485 direction | high sends |

use embassy_stm32::adc::{Adc, AdcChannel};
use embassy_stm32::gpio::{Level, Output, Pull, Speed};
use embassy_stm32::interrupt;
use embassy_stm32::pac::{GPIOC, GPIOD, GPIOE, Interrupt, TIM4};
use embassy_stm32::rcc::{Mco, Mco1Source, McoConfig};
use embassy_stm32::spi::Spi;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::wdg::IndependentWatchdog;

use super::eeprom::Eeprom;
use super::encoder::Encoder;
use super::line::Line;
use super::motion_bus::MotionBus;
use super::parts::{self, Rs485};
use super::signals::{self, Axis};
use super::{analog, can, clocks, pads, pins, spi, watchdog};

/// Number of axes on the board.
pub const AXES: usize = 1;

/// Number of motion controllers on the board.
const CONTROLLERS: usize = 1;

/// ENN of the TMC262: high switches the bridges off.
pub(super) const ENN: Line = Line::new(GPIOE, 1);
/// LED2, high is on.
pub(super) const TROUBLE: Line = Line::new(GPIOC, 4);
/// SG_TST of the TMC262.
const STALL: Line = Line::new(GPIOE, 0);
/// IN0 to IN3. IN1 and IN2 are inputs of the encoder's timer, where their levels can still be read.
const INPUTS: [Line; 4] = [Line::new(GPIOD, 11), Line::new(GPIOD, 12), IN2, IN3];
/// IN2, which is also the right stop switch.
const IN2: Line = Line::new(GPIOD, 13);
/// IN3, which is also the home switch and N of the encoder.
const IN3: Line = Line::new(GPIOD, 14);
/// Supply voltage for which the converter reads full scale: 36.3 V, in units of 0.1 V. The divider is 10 kOhm to 1
/// kOhm.
const SUPPLY: u32 = 363;

/// The external encoder.
static ENCODER: Encoder = Encoder::new(TIM4, IN3, Interrupt::EXTI15_10);

/// The interrupt of IN3.
#[interrupt]
unsafe fn EXTI15_10() {
    ENCODER.edge();
}

/// All parts of the board, ready for use; the motor drivers are off.
pub type Board = parts::Board<Signals, AXES, CONTROLLERS>;
/// The chips of this board, with an EEPROM that is divided as `P` says.
pub type Chips<P> = parts::Chips<P, CONTROLLERS>;
/// The chips that move the motor.
pub(super) type Motion = parts::Motion<AXES, CONTROLLERS>;
/// One axis, four inputs, two outputs, one group of pull-up resistors.
pub(super) type Signals = signals::Signals<AXES, 4, 2, 1>;

impl Board {
    /// Sets up the microcontroller, first the clocks, then the pins. The motor drivers stay off. To be called once.
    ///
    /// LED2 is on until the set-up has succeeded. If the crystal does not start, LED2 stays on, and the watchdog
    /// restarts the microcontroller for another attempt.
    pub fn start() -> Self {
        TROUBLE.drive(true);
        let p = clocks::start();
        // The watchdog takes this time when it is fed first.
        let watchdog = IndependentWatchdog::new(p.IWDG, watchdog::TIMEOUT_US);
        let factory_reset = pads::connected(p.PA13, p.PA14);
        // The TMC429's clock is the crystal's: all velocities are multiples of its 16 MHz.
        Mco::new(p.MCO1, p.PA8, Mco1Source::HSE, McoConfig::default());

        pins::listen([p.PE0.into()], Pull::Down);
        pins::listen([p.PD11.into(), p.PD14.into()], Pull::None);
        // A destructor would disconnect these two.
        core::mem::forget(Qei::new(p.TIM4, p.PD12, p.PD13, qei::Config::default()));
        let signals = Signals {
            axes: [Axis { stall: STALL, home: IN3, right: Some(IN2), encoder: Some(&ENCODER) }],
            inputs: INPUTS,
            outputs: pins::outputs([p.PD8.into(), p.PD9.into()], Level::Low),
            pull_ups: pins::outputs([p.PD10.into()], Level::High),
            led: Output::new(p.PC5, Level::Low, Speed::Low),
        };
        let bus = MotionBus::new(Spi::new_blocking(p.SPI1, p.PA5, p.PA7, p.PA6, spi::config()));
        Board {
            motion: Motion {
                tmc429: [bus.tmc429(pins::select(p.PA4.into()))],
                tmc262: [bus.tmc262(pins::select(p.PC3.into()))],
                enable: Output::new(p.PE1, Level::High, Speed::Low),
            },
            signals,
            eeprom: Eeprom {
                bus: Spi::new_blocking(p.SPI3, p.PC10, p.PC12, p.PC11, spi::config()),
                select: pins::select(p.PA15.into()),
            },
            rs485: Rs485 {
                port: p.USART3,
                rx: p.PB11,
                tx: p.PB10,
                direction: Output::new(p.PE15, Level::Low, Speed::Medium),
            },
            can: can::driver(p.CAN1, p.PD0, p.PD1),
            usb: super::usb::driver(p.USB_OTG_FS, p.PA12, p.PA11),
            adc: Adc::new(p.ADC1),
            analog: analog::Inputs {
                ports: [Some(p.PC0.degrade_adc()), None, None, None, None],
                supply: p.PC1.degrade_adc(),
                full_scale: SUPPLY,
            },
            watchdog,
            factory_reset,
        }
    }
}
