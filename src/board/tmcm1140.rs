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

use core::arch::global_asm;

use embassy_stm32::adc::Adc;
use embassy_stm32::can::{self, Can};
use embassy_stm32::gpio::{AfType, Flex, Input, Level, Output, OutputType, Pull, Speed};
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::gpio::vals::{Moder, Pupdr};
use embassy_stm32::pac::iwdg::vals::Key;
use embassy_stm32::pac::{GPIOC, GPIOE, IWDG, RCC};
use embassy_stm32::rcc::{
    AHBPrescaler, APBPrescaler, Hse, HseMode, Mco, Mco1Source, McoConfig, Pll, PllMul, PllPDiv, PllPreDiv, PllQDiv,
    PllSource, Sysclk,
};
use embassy_stm32::spi::Spi;
use embassy_stm32::time::Hertz;
use embassy_stm32::timer::qei::{self, Qei};
use embassy_stm32::usart::{self, Uart};
use embassy_stm32::usb;
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peri, bind_interrupts, interrupt, peripherals};
use static_cell::ConstStaticCell;

use super::analog::Inputs;
use super::signals::Signals;
use super::spi::{self, Bus};
use super::wake::OnFrame;
use super::watchdog;

/// Bit of ENN in port E.
const ENN: usize = 1;
/// Bit of LED2 in port C.
const TROUBLE: usize = 4;

bind_interrupts!(struct Irqs {
    CAN1_TX => can::TxInterruptHandler<peripherals::CAN1>;
    CAN1_RX0 => can::Rx0InterruptHandler<peripherals::CAN1>, OnFrame;
    CAN1_RX1 => can::Rx1InterruptHandler<peripherals::CAN1>;
    CAN1_SCE => can::SceInterruptHandler<peripherals::CAN1>;
    OTG_FS => usb::InterruptHandler<peripherals::USB_OTG_FS>;
});

/// All parts of the board, ready for use; the motor drivers are off.
pub struct Board {
    pub(super) motion: Motion,
    pub(super) eeprom: Eeprom,
    pub(super) rs485: Rs485,
    pub(super) can: Can<'static>,
    pub(super) usb: usb::Driver<'static, peripherals::USB_OTG_FS>,
    pub(super) adc: Adc<'static, peripherals::ADC1>,
    pub(super) analog: Inputs,
    pub(super) watchdog: IndependentWatchdog<'static, peripherals::IWDG>,
    /// The pads that ask for factory settings are connected.
    pub(super) factory_reset: bool,
}

/// The parts that the owner of the module uses.
pub(super) struct Motion {
    pub(super) bus: Bus,
    pub(super) select_tmc429: Output<'static>,
    pub(super) select_tmc262: Output<'static>,
    pub(super) enable: Output<'static>,
    pub(super) signals: Signals,
}

/// The EEPROM, which has an SPI bus of its own.
pub(super) struct Eeprom {
    pub(super) bus: Bus,
    pub(super) select: Output<'static>,
}

/// The RS485 interface before it is opened, because its baud rate is a stored setting.
pub(super) struct Rs485 {
    usart: Peri<'static, peripherals::USART3>,
    rx: Peri<'static, peripherals::PB11>,
    tx: Peri<'static, peripherals::PB10>,
    direction: Output<'static>,
}

impl Board {
    /// Sets up the microcontroller, first the clocks, then the pins. The motor drivers stay off. To be called once.
    ///
    /// LED2 is on until the set-up has succeeded. If the crystal does not start, LED2 stays on, and the watchdog
    /// restarts the microcontroller for another attempt.
    pub fn start() -> Self {
        show_trouble(true);
        IWDG.kr().write(|w| w.set_key(Key::START));
        let p = embassy_stm32::init(clocks());
        // A crystal that stops later raises NMI: without the TMC429's clock nothing is known of the motor.
        RCC.cr().modify(|w| w.set_csson(true));
        for handler in
            [interrupt::CAN1_TX, interrupt::CAN1_RX0, interrupt::CAN1_RX1, interrupt::CAN1_SCE, interrupt::OTG_FS]
        {
            handler.set_priority(Priority::P5);
        }
        // The watchdog runs already, with its default time of 512 ms; it takes this time when it is fed first.
        let watchdog = IndependentWatchdog::new(p.IWDG, watchdog::TIMEOUT_US);
        let factory_reset = pads_connected(p.PA13, p.PA14);
        // The TMC429's clock is the crystal's: all velocities are multiples of its 16 MHz.
        Mco::new(p.MCO1, p.PA8, Mco1Source::HSE, McoConfig::default());

        let signals = Signals {
            stall: Input::new(p.PE0, Pull::Down),
            _inputs: [Input::new(p.PD11, Pull::None), Input::new(p.PD14, Pull::None)],
            _encoder: Qei::new(p.TIM4, p.PD12, p.PD13, qei::Config::default()),
            outputs: [Output::new(p.PD8, Level::Low, Speed::Low), Output::new(p.PD9, Level::Low, Speed::Low)],
            pull_ups: Output::new(p.PD10, Level::High, Speed::Low),
            led: Output::new(p.PC5, Level::Low, Speed::Low),
        };
        static USB: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; _]);
        // The supply pin of the USB connector is not read: a host that communicates is connected.
        let mut usb_config = usb::Config::default();
        usb_config.vbus_detection = false;
        Board {
            can: Can::new(p.CAN1, p.PD0, p.PD1, Irqs),
            usb: usb::Driver::new_fs(p.USB_OTG_FS, Irqs, p.PA12, p.PA11, USB.take(), usb_config),
            adc: Adc::new(p.ADC1),
            analog: Inputs { in0: p.PC0, supply: p.PC1 },
            watchdog,
            factory_reset,
            motion: Motion {
                bus: Spi::new_blocking(p.SPI1, p.PA5, p.PA7, p.PA6, spi::config()),
                select_tmc429: Output::new(p.PA4, Level::High, Speed::Medium),
                select_tmc262: Output::new(p.PC3, Level::High, Speed::Medium),
                enable: Output::new(p.PE1, Level::High, Speed::Low),
                signals,
            },
            eeprom: Eeprom {
                bus: Spi::new_blocking(p.SPI3, p.PC10, p.PC12, p.PC11, spi::config()),
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
    /// Sets up the port, which receives from then on, and returns the direction pin. All else about the port is done by
    /// its interrupt handler. Its clock of 42 MHz gives the rates of parameter 65 within 0.2 %.
    pub(super) fn open(self, baud: u32) -> Result<Output<'static>, usart::ConfigError> {
        let mut config = usart::Config::default();
        config.baudrate = baud;
        // While the transceiver sends, it does not drive its output to the microcontroller.
        config.rx_pull = Pull::Up;
        // The destructor of `Uart` would switch the port off.
        core::mem::forget(Uart::new_blocking(self.usart, self.rx, self.tx, config)?);
        Ok(self.direction)
    }
}

/// Number of pulses with which the pads are tested.
const PAD_PULSES: usize = 10;

/// True if the pads of SWDIO and SWCLK are connected with each other, that is, if one follows the level of the other.
/// With a debugger attached the pins are left alone, and the answer is false.
fn pads_connected(mut data: Peri<'static, peripherals::PA13>, mut clock: Peri<'static, peripherals::PA14>) -> bool {
    if cortex_m::peripheral::DCB::is_debugger_attached() {
        return false;
    }
    let mut follows = true;
    {
        let mut out = Flex::new(data.reborrow());
        let mut input = Flex::new(clock.reborrow());
        input.set_as_input(Pull::Up);
        out.set_as_output(Speed::Low);
        for pulse in 0..2 * PAD_PULSES {
            let high = pulse % 2 != 0;
            out.set_level(high.into());
            // 3360 cycles are 20 us, enough for the pull-up resistor of 40 kOhm to lift the line.
            cortex_m::asm::delay(3_360);
            follows &= input.is_high() == high;
        }
    }
    // The pins are made the debug port again, as after reset: function 0, SWDIO with a pull-up, SWCLK with a pull-down
    // resistor.
    Flex::new(data).set_as_af_unchecked(0, AfType::output_pull(OutputType::PushPull, Speed::VeryHigh, Pull::Up));
    Flex::new(clock).set_as_af_unchecked(0, AfType::input(Pull::Down));
    follows
}

// `drivers_off` runs first of all after reset, before RAM is initialised and the clock is fast, which takes a
// millisecond: at reset ENN floats, and only a resistor on the board, if there is one, keeps it high. The stack can be
// used at that time, but no statics, and `drivers_off` uses none. The name that cortex-m-rt has for this function can
// be defined in assembler only.
global_asm!(".global __pre_init", ".thumb_func", "__pre_init: b {first}", first = sym drivers_off);

/// Sets ENN high: no current flows in the motor, whatever the chips do. The function uses only registers, so that it
/// can be called at any time, also by a firmware that has failed.
pub(super) extern "C" fn drivers_off() {
    RCC.ahb1enr().modify(|w| w.set_gpioeen(true));
    // The port is usable two bus cycles after its clock is on; this read lets them pass.
    let _ = RCC.ahb1enr().read();
    GPIOE.bsrr().write(|w| w.set_bs(ENN, true));
    GPIOE.pupdr().modify(|w| w.set_pupdr(ENN, Pupdr::PULL_UP));
    GPIOE.moder().modify(|w| w.set_moder(ENN, Moder::OUTPUT));
}

/// Switches LED2 on or off. The function uses only registers, as `drivers_off` does.
pub(super) fn show_trouble(on: bool) {
    RCC.ahb1enr().modify(|w| w.set_gpiocen(true));
    let _ = RCC.ahb1enr().read();
    GPIOC.bsrr().write(|w| if on { w.set_bs(TROUBLE, true) } else { w.set_br(TROUBLE, true) });
    GPIOC.moder().modify(|w| w.set_moder(TROUBLE, Moder::OUTPUT));
}

/// The clocks: the crystal's 16 MHz / 8 = 2 MHz go into the PLL, x 168 = 336 MHz, / 2 = 168 MHz for the core; 336 MHz /
/// 7 = 48 MHz for USB. APB2 has 168 / 2 = 84 MHz (SPI1), APB1 168 / 4 = 42 MHz (SPI3, USART3; its timers run at 84
/// MHz).
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
