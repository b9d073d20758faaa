//! Analog inputs: IN0, the supply, the temperature. Read in thread mode, where it holds up nobody.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_stm32::Peri;
use embassy_stm32::adc::{Adc, SampleTime, Temperature};
use embassy_stm32::peripherals::{ADC1, PC0, PC1};
use embassy_time::Timer;

/// Time between two readings. A supply that is gone is noticed after two of them.
const PERIOD_MS: u64 = 2;
/// The highest reading.
const FULL_SCALE: u32 = 4_095;
/// What it stands for at a pin: 3.3 V, here in 0.1 mV.
const REFERENCE: u32 = 33_000;
/// The supply comes over a divider of 10 kOhm to 1 kOhm: 36.3 V at full scale, here in 0.1 V.
const SUPPLY: u32 = 363;
/// The microcontroller's own temperature sensor gives 760 mV at 25 degrees and 2.5 mV a degree.
const AT_25_DEGREES: u32 = 7_600;
const PER_DEGREE: i32 = 25;

/// The latest readings: IN0, supply, temperature.
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
        // At 21 MHz 84 cycles are 4 us, enough for a source of 50 kOhm; the sensor wants 10 us and gets 23.
        let (time, long) = (SampleTime::CYCLES84, SampleTime::CYCLES480);
        let in0 = adc.blocking_read(in0, time);
        let supply = adc.blocking_read(supply, time);
        let temperature = adc.blocking_read(temperature, long);
        // The chopper makes dips of microseconds, which do not last from one reading to the next.
        let before = core::mem::replace(&mut self.supply, supply);
        for (place, reading) in READINGS.iter().zip([in0, supply.max(before), temperature]) {
            place.store(reading.into(), Ordering::Relaxed);
        }
    }
}

/// Reads all inputs again and again.
#[embassy_executor::task]
pub(super) async fn watch(mut sensors: Sensors) {
    loop {
        Timer::after_millis(PERIOD_MS).await;
        sensors.read();
    }
}

/// Analog value of IN0.
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

/// A reading in a unit in which full scale is `whole`, rounded.
fn scaled(reading: &AtomicU32, whole: u32) -> u32 {
    (reading.load(Ordering::Relaxed) * whole + FULL_SCALE / 2) / FULL_SCALE
}
