//! The analog inputs: the ports, the supply, and the temperature of the microcontroller. They are read in thread mode,
//! where the wait for the converter delays no other part of the firmware.

use core::sync::atomic::{AtomicI16, AtomicU16, Ordering};

use embassy_stm32::adc::{Adc, AnyAdcChannel, SampleTime, Temperature};
use embassy_stm32::peripherals::ADC1;
use embassy_time::Timer;

use crate::device::ANALOG;

/// Time between two readings, in ms. A supply that is gone is noticed after two of them.
const PERIOD_MS: u64 = 2;
/// The largest reading of the converter, of 12 bits.
const FULL_SCALE: u32 = 4_095;
/// Voltage at a pin for which the converter reads full scale: 3.3 V, in units of 0.1 mV.
const REFERENCE: u32 = 33_000;
/// Voltage of the microcontroller's temperature sensor at 25 degrees Celsius: 760 mV, in units of 0.1 mV.
const AT_25_DEGREES: u32 = 7_600;
/// The sensor's voltage rises by this in a degree: 2.5 mV, in units of 0.1 mV.
const PER_DEGREE: i32 = 25;

/// The latest readings of the ports; 0 where the board has none.
static PORTS: [AtomicU16; ANALOG] = [const { AtomicU16::new(0) }; ANALOG];
/// The latest supply voltage in 0.1 V.
static SUPPLY: AtomicU16 = AtomicU16::new(0);
/// The latest temperature in degrees Celsius.
static TEMPERATURE: AtomicI16 = AtomicI16::new(0);

/// The analog inputs of a board.
pub(crate) struct Inputs {
    /// The converter.
    pub(crate) adc: Adc<'static, ADC1>,
    /// The ports by their numbers.
    pub(crate) ports: [Option<AnyAdcChannel<'static, ADC1>>; ANALOG],
    /// The supply, over a divider.
    pub(crate) supply: AnyAdcChannel<'static, ADC1>,
    /// The supply voltage for which the converter reads full scale, in units of 0.1 V.
    pub(crate) full_scale: u32,
}

/// The converter with its inputs.
pub(crate) struct Sensors {
    adc: Adc<'static, ADC1>,
    ports: [Option<AnyAdcChannel<'static, ADC1>>; ANALOG],
    supply: AnyAdcChannel<'static, ADC1>,
    full_scale: u32,
    temperature: Temperature,
    /// The last reading of the supply.
    last: u16,
}

impl Sensors {
    /// Reads all inputs for the first time.
    pub(crate) fn new(inputs: Inputs) -> Self {
        let Inputs { adc, ports, supply, full_scale } = inputs;
        let temperature = adc.enable_temperature();
        let mut sensors = Sensors { adc, ports, supply, full_scale, temperature, last: 0 };
        sensors.read();
        sensors
    }

    fn read(&mut self) {
        let Sensors { adc, ports, supply, full_scale, temperature, .. } = self;
        // At 21 MHz 84 cycles are 4 us, enough for a source of 50 kOhm. The temperature sensor needs 10 us; 480 cycles
        // are 23 us.
        let (time, long) = (SampleTime::CYCLES84, SampleTime::CYCLES480);
        for (latest, port) in PORTS.iter().zip(ports) {
            if let Some(port) = port {
                latest.store(adc.blocking_read(port, time), Ordering::Relaxed);
            }
        }
        let supply = adc.blocking_read(supply, time);
        let temperature = adc.blocking_read(temperature, long);
        // The motor's chopper makes dips of microseconds in the supply voltage. Of two readings the larger one counts,
        // as no dip lasts from one to the next.
        let before = core::mem::replace(&mut self.last, supply);
        SUPPLY.store(scaled(supply.max(before), *full_scale) as u16, Ordering::Relaxed);
        let above = scaled(temperature, REFERENCE).cast_signed() - AT_25_DEGREES.cast_signed();
        let degrees = 25 + (above + PER_DEGREE / 2).div_euclid(PER_DEGREE);
        TEMPERATURE.store(degrees as i16, Ordering::Relaxed);
    }
}

/// Reads all inputs every two milliseconds.
#[embassy_executor::task]
pub(crate) async fn watch(mut sensors: Sensors) {
    loop {
        Timer::after_millis(PERIOD_MS).await;
        sensors.read();
    }
}

/// The analog value of each port, 0..=4095.
pub(crate) fn ports() -> [u16; ANALOG] {
    PORTS.each_ref().map(|port| port.load(Ordering::Relaxed))
}

/// Supply voltage in 0.1 V.
pub(crate) fn supply() -> u16 {
    SUPPLY.load(Ordering::Relaxed)
}

/// Temperature in degrees Celsius.
pub(crate) fn temperature() -> i16 {
    TEMPERATURE.load(Ordering::Relaxed)
}

/// A reading in the unit in which full scale is `whole`, rounded.
fn scaled(reading: u16, whole: u32) -> u32 {
    (u32::from(reading) * whole + FULL_SCALE / 2) / FULL_SCALE
}
