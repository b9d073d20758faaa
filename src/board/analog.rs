//! The analog inputs: IN0, the supply, and the temperature of the microcontroller. They are read in thread mode, where
//! the wait for the converter delays no other part of the firmware.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, SampleTime, Temperature};
use embassy_stm32::peripherals::{ADC1, PC0, PC1};
use embassy_time::Timer;

/// Time between two readings, in ms. A supply that is gone is noticed after two of them.
const PERIOD_MS: u64 = 2;
/// The largest reading of the converter, of 12 bits.
const FULL_SCALE: u32 = 4_095;
/// Voltage at a pin for which the converter reads full scale: 3.3 V, in units of 0.1 mV.
const REFERENCE: u32 = 33_000;
/// Supply voltage for which the converter reads full scale: 36.3 V, in units of 0.1 V. The divider is 10 kOhm to 1
/// kOhm.
const SUPPLY: u32 = 363;
/// Voltage of the microcontroller's temperature sensor at 25 degrees Celsius: 760 mV, in units of 0.1 mV.
const AT_25_DEGREES: u32 = 7_600;
/// The sensor's voltage rises by this in a degree: 2.5 mV, in units of 0.1 mV.
const PER_DEGREE: i32 = 25;

/// The latest readings of the converter: IN0, supply, temperature.
static READINGS: [AtomicU32; 3] = [const { AtomicU32::new(0) }; 3];

/// The pins of the analog inputs.
pub(super) struct Inputs {
    pub(super) in0: Peri<'static, PC0>,
    pub(super) supply: Peri<'static, PC1>,
}

/// The converter with its inputs.
pub(super) struct Sensors {
    adc: Adc<'static, ADC1>,
    inputs: Inputs,
    temperature: Temperature,
    /// The last reading of the supply.
    supply: u16,
}

impl Sensors {
    /// Reads all inputs for the first time.
    pub(super) fn new(adc: Adc<'static, ADC1>, inputs: Inputs) -> Self {
        let temperature = adc.enable_temperature();
        let mut sensors = Sensors { adc, inputs, temperature, supply: 0 };
        sensors.read();
        sensors
    }

    fn read(&mut self) {
        let Sensors { adc, inputs: Inputs { in0, supply }, temperature, .. } = self;
        // At 21 MHz 84 cycles are 4 us, enough for a source of 50 kOhm. The temperature sensor needs 10 us; 480 cycles
        // are 23 us.
        let (time, long) = (SampleTime::CYCLES84, SampleTime::CYCLES480);
        let in0 = adc.blocking_read(in0, time);
        let supply = adc.blocking_read(supply, time);
        let temperature = adc.blocking_read(temperature, long);
        // The motor's chopper makes dips of microseconds in the supply voltage. Of two readings the larger one counts,
        // as no dip lasts from one to the next.
        let before = core::mem::replace(&mut self.supply, supply);
        for (latest, reading) in READINGS.iter().zip([in0, supply.max(before), temperature]) {
            latest.store(reading.into(), Ordering::Relaxed);
        }
    }
}

/// Reads all inputs every two milliseconds.
#[embassy_executor::task]
pub(super) async fn watch(mut sensors: Sensors) {
    loop {
        Timer::after_millis(PERIOD_MS).await;
        sensors.read();
    }
}

/// The analog value of IN0, 0..=4095.
pub(super) fn in0() -> u16 {
    let [in0, ..] = &READINGS;
    in0.load(Ordering::Relaxed) as u16
}

/// Supply voltage in 0.1 V.
pub(super) fn supply() -> u16 {
    let [_, supply, _] = &READINGS;
    scaled(supply, SUPPLY) as u16
}

/// Temperature in degrees Celsius.
pub(super) fn temperature() -> i16 {
    let [.., temperature] = &READINGS;
    let above = scaled(temperature, REFERENCE).cast_signed() - AT_25_DEGREES.cast_signed();
    (25 + (above + PER_DEGREE / 2).div_euclid(PER_DEGREE)) as i16
}

/// A reading in the unit in which full scale is `whole`, rounded.
fn scaled(reading: &AtomicU32, whole: u32) -> u32 {
    (reading.load(Ordering::Relaxed) * whole + FULL_SCALE / 2) / FULL_SCALE
}
