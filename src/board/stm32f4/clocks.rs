//! The start of the microcontroller: its watchdog, clocks and flash memory, which are the same on all boards.

use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::pac::{DBGMCU, FLASH, IWDG, RCC};
use embassy_stm32::peripherals::MCO1;
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Mco, Mco1Source, McoConfig, McoPin, Pll, PllMul, PllPDiv, PllPreDiv,
    PllQDiv, PllSource, Sysclk,
};
use embassy_stm32::time::Hertz;
use embassy_stm32::{Config, Peri, Peripherals};

use crate::units::Micros;

/// Sets up watchdog and clocks, and hands out what the microcontroller has. To be called once.
///
/// The watchdog runs from now on, with its default time of 512 ms: if the crystal does not start, it restarts the
/// microcontroller for another attempt.
pub(crate) fn start() -> Peripherals {
    IWDG.kr().write(|w| w.set_key(Key::START));
    let peripherals = embassy_stm32::init(clocks());
    accelerate_flash();
    // A crystal that stops later raises NMI: without the TMC429's clock nothing is known of the motor.
    RCC.cr().modify(|w| w.set_csson(true));
    peripherals
}

/// The time since the firmware started. The ticks of embassy-time are microseconds.
pub(crate) fn now() -> Micros {
    Micros(embassy_time::Instant::now().as_ticks())
}

/// Gives the motion chips the crystal's 16 MHz at their clock inputs: all velocities are multiples of them.
pub(crate) fn give(output: Peri<'static, MCO1>, pin: Peri<'static, impl McoPin<MCO1>>) {
    Mco::new(output, pin, Mco1Source::HSE, McoConfig::default());
}

/// Switches the flash accelerator on, without which the core, at 168 MHz, waits five cycles for each line of 16 bytes.
/// Embassy sets these wait states and leaves all else off.
///
/// Silicon of revision A has to do without prefetch (erratum "ART accelerator prefetch queue instruction is not
/// supported", ES0182). It says that it is a chip of another family, 0x411 (erratum "MCU device ID is incorrect"), or
/// revision 0x1000.
fn accelerate_flash() {
    let id = DBGMCU.idcode().read();
    let is_revision_a = id.dev_id() != 0x413 || id.rev_id() == 0x1000;
    FLASH.acr().modify(|w| {
        w.set_prften(!is_revision_a);
        w.set_icen(true);
        w.set_dcen(true);
    });
}

/// The clocks. The crystal's 16 MHz / 8 = 2 MHz go into the PLL, x 168 = 336 MHz. The core has 336 MHz / 2 = 168 MHz,
/// USB 336 MHz / 7 = 48 MHz. APB2 has 168 / 2 = 84 MHz (SPI1), APB1 168 / 4 = 42 MHz (SPI3, USART3; its timers run at
/// 84 MHz).
fn clocks() -> Config {
    let mut config = Config::default();
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
