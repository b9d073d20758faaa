//! The TMCM-1140's pins and clocks - as far as they are known.
//!
//! Microcontroller and pin map of the TMCM-1140 are not published. This is the map of its closest published
//! sibling, whose GD32F425VG is pin and register compatible with the STM32F405VG used here: same motion
//! controller, driver, EEPROM and interfaces. What the sibling does not have is marked "chosen": those pins
//! are ours. **All of it is to be checked against the module before flashing.**
//!
//! | pin | signal | |
//! |---|---|---|
//! | PA4 | TMC429 chip select | low active |
//! | PA5 PA6 PA7 | SPI1 clock, in, out: TMC429 and TMC262 | |
//! | PA8 | clock of the TMC429 | MCO1, 16 MHz |
//! | PA15 | EEPROM chip select | low active |
//! | PB10 PB11 | USART3 out, in: RS485 | |
//! | PC3 | TMC262 chip select | low active |
//! | PC4 PC5 | LED2 (trouble), LED1 (running) | high is on |
//! | PC10 PC11 PC12 | SPI3 clock, in, out: EEPROM | |
//! | PD8 PD9 | OUT0, OUT1 | chosen; high is on |
//! | PD10 | pull-up resistors of IN1..IN3 | chosen; high is on |
//! | PD11..PD14 | IN0..IN3 | chosen; PD12, PD13 are the inputs of TIM4, which can count the ABN encoder at IN1, IN2 |
//! | PE0 | SG_TST of the TMC262 | high on a stall |
//! | PE1 | ENN of the TMC262 | low switches the bridges on |
//! | PE15 | RS485 direction | high sends |

use core::arch::global_asm;

use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::mode::Blocking;
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::{GPIOC, GPIOE, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Mco, Mco1Source, McoConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv,
    PllSource, Sysclk,
};
use embassy_stm32::spi::mode::Master;
use embassy_stm32::spi::{self, Spi};
use embassy_stm32::time::Hertz;
use embassy_stm32::usart::{self, BufferedUart};
use embassy_stm32::{Peri, bind_interrupts, peripherals};
use static_cell::ConstStaticCell;

/// Bit of ENN in port E.
const ENN: usize = 1;
/// Bit of LED2 in port C.
const TROUBLE: usize = 4;

/// SPI clock of the TMC429: 84 MHz / 64. The chip, itself at 16 MHz, takes 2 MHz at most (eight of its clocks
/// a bit); 84 MHz / 32 would be too fast.
const TMC429_CLOCK: Hertz = Hertz(1_312_500);
/// SPI clock of the TMC262: 84 MHz / 32.
const TMC262_CLOCK: Hertz = Hertz(2_625_000);
/// SPI clock of the EEPROM: 42 MHz / 16. The sibling divides by 16, too.
const EEPROM_CLOCK: Hertz = Hertz(2_625_000);

bind_interrupts!(struct Irqs {
    USART3 => usart::BufferedInterruptHandler<peripherals::USART3>;
});

/// An SPI bus whose transfers are waited for.
pub(super) type Bus = Spi<'static, Blocking, Master>;

/// All that is connected, ready for use; the motor drivers are off.
pub struct Board {
    pub(super) motion: Motion,
    pub(super) eeprom: Eeprom,
    pub(super) rs485: Rs485,
}

/// What the owner of the module has.
pub(super) struct Motion {
    pub(super) bus: Bus,
    pub(super) select_tmc429: Output<'static>,
    pub(super) select_tmc262: Output<'static>,
    pub(super) enable: Output<'static>,
    pub(super) signals: Signals,
}

/// The signals exchanged with each poll.
pub(super) struct Signals {
    pub(super) stall: Input<'static>,
    pub(super) inputs: [Input<'static>; 4],
    pub(super) outputs: [Output<'static>; 2],
    pub(super) pull_ups: Output<'static>,
    pub(super) led: Output<'static>,
}

/// The EEPROM has a bus of its own.
pub(super) struct Eeprom {
    pub(super) bus: Bus,
    pub(super) select: Output<'static>,
}

/// The RS485 interface, not yet open: the baud rate is a stored setting.
pub(super) struct Rs485 {
    usart: Peri<'static, peripherals::USART3>,
    rx: Peri<'static, peripherals::PB11>,
    tx: Peri<'static, peripherals::PB10>,
    direction: Output<'static>,
}

impl Board {
    /// Takes charge of the microcontroller: clocks, then pins. The motor drivers stay off. To be called once.
    pub fn start() -> Self {
        let p = embassy_stm32::init(clocks());
        // The TMC429 has the crystal's clock: all velocities rest on its 16 MHz.
        Mco::new(p.MCO1, p.PA8, Mco1Source::HSE, McoConfig::default());

        let signals = Signals {
            stall: Input::new(p.PE0, Pull::Down),
            inputs: [
                Input::new(p.PD11, Pull::None),
                Input::new(p.PD12, Pull::None),
                Input::new(p.PD13, Pull::None),
                Input::new(p.PD14, Pull::None),
            ],
            outputs: [Output::new(p.PD8, Level::Low, Speed::Low), Output::new(p.PD9, Level::Low, Speed::Low)],
            pull_ups: Output::new(p.PD10, Level::High, Speed::Low),
            led: Output::new(p.PC5, Level::Low, Speed::Low),
        };
        Board {
            motion: Motion {
                bus: Spi::new_blocking(p.SPI1, p.PA5, p.PA7, p.PA6, tmc429_spi()),
                select_tmc429: Output::new(p.PA4, Level::High, Speed::Medium),
                select_tmc262: Output::new(p.PC3, Level::High, Speed::Medium),
                enable: Output::new(p.PE1, Level::High, Speed::Low),
                signals,
            },
            eeprom: Eeprom {
                bus: Spi::new_blocking(p.SPI3, p.PC10, p.PC12, p.PC11, spi(EEPROM_CLOCK)),
                select: Output::new(p.PA15, Level::High, Speed::Medium),
            },
            rs485: Rs485 {
                usart: p.USART3,
                rx: p.PB11,
                tx: p.PB10,
                direction: Output::new(p.PE15, Level::Low, Speed::Medium),
            },
        }
    }
}

impl Rs485 {
    /// Opens the interface: the port and the direction pin.
    ///
    /// # Errors
    /// The baud rate cannot be made from 42 MHz.
    pub(super) fn open(self, baud: u32) -> Result<(BufferedUart<'static>, Output<'static>), usart::ConfigError> {
        // One reply at a time goes out, a few requests may come in: see `rs485`.
        static TX: ConstStaticCell<[u8; 16]> = ConstStaticCell::new([0; _]);
        static RX: ConstStaticCell<[u8; 64]> = ConstStaticCell::new([0; _]);
        let mut config = usart::Config::default();
        config.baudrate = baud;
        // While sending, the transceiver leaves the line from it to here open.
        config.rx_pull = Pull::Up;
        // Every byte is told of at once. Else the last one would be a whole character late.
        config.eager_reads = Some(1);
        let port = BufferedUart::new(self.usart, self.rx, self.tx, TX.take(), RX.take(), Irqs, config)?;
        Ok((port, self.direction))
    }
}

// The very first thing after reset, before RAM is set up and the clock is fast, which takes a millisecond: at
// reset ENN floats, and only a resistor on the board, if there is one, keeps it high. There is a stack already;
// statics there are none yet, and `drivers_off` uses none. cortex-m-rt has its name for this from assembler only.
global_asm!(".global __pre_init", ".thumb_func", "__pre_init: b {first}", first = sym drivers_off);

/// Sets ENN: no current in the motor, whatever the chips do. Touches registers only, so that it may be called
/// at any time, by whatever is left.
pub(super) extern "C" fn drivers_off() {
    RCC.ahb1enr().modify(|w| w.set_gpioeen(true));
    // The port takes two bus cycles to wake up; a read makes them pass.
    let _ = RCC.ahb1enr().read();
    GPIOE.bsrr().write(|w| w.set_bs(ENN, true));
    GPIOE.pupdr().modify(|w| w.set_pupdr(ENN, Pupdr::PULL_UP));
    GPIOE.moder().modify(|w| w.set_moder(ENN, Moder::OUTPUT));
}

/// Lights LED2, under the same conditions.
pub(super) fn show_trouble() {
    RCC.ahb1enr().modify(|w| w.set_gpiocen(true));
    let _ = RCC.ahb1enr().read();
    GPIOC.bsrr().write(|w| w.set_bs(TROUBLE, true));
    GPIOC.moder().modify(|w| w.set_moder(TROUBLE, Moder::OUTPUT));
}

/// 16 MHz crystal / 8 = 2 MHz into the PLL, x 168 = 336 MHz, / 2 = 168 MHz for the core; 336 MHz / 7 = 48 MHz
/// for USB. APB2 168 / 2 = 84 MHz (SPI1), APB1 168 / 4 = 42 MHz (SPI3, USART3; its timers run at 84 MHz).
fn clocks() -> embassy_stm32::Config {
    let mut config = embassy_stm32::Config::default();
    let rcc = &mut config.rcc;
    rcc.hse = Some(Hse { freq: Hertz(16_000_000), mode: HseMode::Oscillator });
    rcc.pll_src = PllSource::HSE;
    rcc.pll = Some(Pll {
        prediv: PllPreDiv::DIV8,
        mul: PllMul::MUL168,
        divp: Some(PllPDiv::DIV2),
        divq: Some(PllQDiv::DIV7),
        divr: None,
    });
    rcc.sys = Sysclk::PLL1_P;
    rcc.ahb_pre = AHBPrescaler::DIV1;
    rcc.apb1_pre = APBPrescaler::DIV4;
    rcc.apb2_pre = APBPrescaler::DIV2;
    config
}

/// How the TMC429 wants the shared bus.
pub(super) fn tmc429_spi() -> spi::Config {
    spi(TMC429_CLOCK)
}

/// How the TMC262 wants the shared bus.
pub(super) fn tmc262_spi() -> spi::Config {
    spi(TMC262_CLOCK)
}

/// All parts use mode 3, and a part that is missing reads as all ones.
fn spi(frequency: Hertz) -> spi::Config {
    let mut config = spi::Config::default();
    config.mode = spi::MODE_3;
    config.frequency = frequency;
    config.miso_pull = Pull::Up;
    config
}
