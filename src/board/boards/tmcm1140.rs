//! The pins and clocks of the TMCM-1140, as far as they are known.
//!
//! Microcontroller and pin map of the TMCM-1140 are not published. This is the map of its closest published sibling.
//! The sibling has the same motion controller, driver, EEPROM and interfaces, and its GD32F425VG is pin and register
//! compatible with the STM32F405VG used here. What the pins marked "chosen" are connected to is not known of the
//! sibling either. They were chosen so that no output works against another one on a board wired like the sibling's.
//! What is an input here is one in the sibling's published firmware. What is an output here is one there and starts
//! with the same level. Pins that the sibling has beyond these are left alone. **The whole map is to be checked against
//! the module before flashing.**
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
//! | PD8 PD9 | IN0, IN3 | chosen |
//! | PD10 PD11 | OUT0, OUT1 | chosen; low is on: the sibling starts them high, and outputs are off at power-up |
//! | PD12 PD13 | IN1, IN2 | chosen; the inputs of TIM4, which can count the ABN encoder there |
//! | PD14 | pull-up resistors of IN1..IN3 | chosen; high is on, as at power-up |
//! | PE0 | SG_TST of the TMC262 | high on a stall |
//! | PE1 | ENN of the TMC262 | low switches the bridges on |
//! | PE15 | RS485 direction | high sends |

use embassy_stm32::adc::{Adc, AdcChannel};
use embassy_stm32::gpio::Level;
use embassy_stm32::interrupt;
use embassy_stm32::pac::{GPIOC, GPIOD, GPIOE, Interrupt, TIM4};
use embassy_stm32::peripherals::{PB10, PB11};
use embassy_stm32::timer::qei::{self, Qei};

use super::parts;
use super::signals::{self, Axis};
use super::tmc429_tmc262::StepMotors;
use crate::board::stm32f4::eeprom::Eeprom;
use crate::board::stm32f4::encoder::Encoder;
use crate::board::stm32f4::line::Line;
use crate::board::stm32f4::motion_bus::MotionBus;
use crate::board::stm32f4::{analog, can, clocks, pads, pins, rs485, usb, watchdog};

/// Number of axes on the board.
pub(crate) const AXES: usize = 1;

/// ENN of the TMC262: high switches the bridges off.
pub(crate) const ENN: Line = Line::new(GPIOE, 1);
/// LED2, high is on.
pub(crate) const TROUBLE: Line = Line::new(GPIOC, 4);
/// SG_TST of the TMC262.
const STALL: Line = Line::new(GPIOE, 0);
/// IN1 and IN2, A and B of the encoder: their levels can be read although they are inputs of its timer.
const TRACKS: [Line; 2] = Line::row(GPIOD, 12);
/// IN2 is also the right stop switch.
const IN2: Line = TRACKS[1];
/// IN3 is also the home switch, and N of the encoder.
const IN3: Line = Line::new(GPIOD, 9);
/// IN0 to IN3.
const INPUTS: [Line; 4] = [Line::new(GPIOD, 8), TRACKS[0], IN2, IN3];
/// Supply voltage for which the converter reads full scale: 36.3 V, in units of 0.1 V. The divider is 10 kOhm to 1
/// kOhm.
const SUPPLY: u32 = 363;

/// The external encoder.
static ENCODER: Encoder = Encoder::new(TIM4, IN3, Interrupt::EXTI9_5);

/// The interrupt of IN3.
#[interrupt]
unsafe fn EXTI9_5() {
    ENCODER.edge();
}

/// All parts of the board, ready for use; the motor drivers are off.
pub(crate) type Components = parts::Components<Motors, Signals, Rs485>;
/// The chips of this board, with an EEPROM that is divided as `P` says, and with additions `H`.
pub(crate) type Chips<P, H> = parts::Chips<P, H, Motors, AXES>;
/// The chips that move the motor.
pub(crate) type Motors = StepMotors<AXES, 1>;
/// The signals of one axis, four inputs, two outputs and one group of pull-up resistors.
pub(crate) type Signals = signals::Signals<AXES, 4, 2, 1>;
/// The RS485 interface.
pub(crate) type Rs485 = rs485::Pins<PB11, PB10>;

impl Components {
    /// Sets up the microcontroller, first the clocks, then the pins. The motor drivers stay off. To be called once.
    pub(crate) fn start() -> Self {
        let p = clocks::start();
        clocks::give(p.MCO1, p.PA8);
        STALL.pull_down();
        // A destructor would disconnect these two.
        core::mem::forget(Qei::new(p.TIM4, p.PD12, p.PD13, qei::Config::default()));
        let signals = Signals {
            axes: [Axis { stall: Some(STALL), home: IN3, right: Some(IN2), encoder: Some(&ENCODER) }],
            inputs: INPUTS,
            enable: None,
            outputs: pins::outputs([p.PD10.into(), p.PD11.into()], signals::OFF),
            pull_ups: pins::outputs([p.PD14.into()], Level::High),
            led: pins::output(p.PC5.into(), Level::Low),
        };
        let bus = MotionBus::new(p.SPI1, p.PA5, p.PA7, p.PA6);
        Components {
            motors: StepMotors::new(&bus, [p.PA4.into()], [p.PC3.into()], p.PE1.into()),
            signals,
            eeprom: Eeprom::new(p.SPI3, p.PC10, p.PC12, p.PC11, p.PA15.into()),
            rs485: Rs485::new(p.USART3, p.PB11, p.PB10, p.PE15.into()),
            can: can::driver(p.CAN1, p.PD0, p.PD1),
            usb: usb::driver(p.USB_OTG_FS, p.PA12, p.PA11),
            analog: analog::Inputs {
                adc: Adc::new(p.ADC1),
                ports: [Some(p.PC0.degrade_adc()), None, None, None, None],
                supply: p.PC1.degrade_adc(),
                full_scale: SUPPLY,
            },
            watchdog: watchdog::start(p.IWDG),
            factory_reset: pads::connected(p.PA13, p.PA14),
        }
    }
}
