//! The formulas: what one of a unit is in pps or pps2, on a ramp generator and with a motor.

use tmcm::module::Spec;
use tmcm::param::AxisParameter;

use super::exact::Exact;

/// Clock of the ramp generators of all products, in Hz (manual section 6.1; TMC5160 datasheet section 12.1).
pub(super) const CLOCK: i128 = 16_000_000;

/// The quantity that is converted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// A speed, in pps at last: microsteps per second.
    Speed,
    /// An acceleration, in pps2 at last: microsteps per second, per second.
    Acceleration,
}

/// A unit of speed, and of acceleration, where it is per second.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionUnit {
    /// The internal units of a TMC429.
    Internal,
    /// The units of the registers of a TMC5160.
    Chip,
    /// Microsteps per second.
    Pulses,
    /// Full steps per second.
    FullSteps,
    /// Turns per second.
    PerSecond,
    /// Turns per minute.
    PerMinute,
    /// Millimetres per second, of a stage with a lead screw or a belt.
    Millimetres,
}

/// A ramp generator, with the divisors that it has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Generator {
    /// A TMC429 with its divisors, 0..=13 each.
    Tmc429 {
        /// The pulse divisor: axis parameter 154.
        pulse_divisor: u8,
        /// The ramp divisor: axis parameter 153.
        ramp_divisor: u8,
    },
    /// A TMC5160.
    Tmc5160,
}

/// The meaning of numbers on an axis: its ramp generator and its motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Scale {
    pub(super) generator: Generator,
    /// Microsteps per full step, a power of two up to 256.
    pub(super) microsteps: u16,
    /// Full steps per turn of the motor, at least 1.
    pub(super) steps: u16,
    /// How many millimetres a turn of the motor moves the stage, above 0, if that is known.
    pub(super) lead: Option<Exact>,
}

impl Quantity {
    /// All quantities.
    pub(super) const ALL: [Quantity; 2] = [Quantity::Speed, Quantity::Acceleration];

    /// The quantity in words, with its article.
    pub(super) fn name(self) -> &'static str {
        match self {
            Quantity::Speed => "a speed",
            Quantity::Acceleration => "an acceleration",
        }
    }
}

impl MotionUnit {
    /// All units, in the order in which they are shown.
    pub(super) const ALL: [MotionUnit; 7] = [
        MotionUnit::Internal,
        MotionUnit::Chip,
        MotionUnit::Pulses,
        MotionUnit::FullSteps,
        MotionUnit::PerSecond,
        MotionUnit::PerMinute,
        MotionUnit::Millimetres,
    ];

    /// The unit as it is shown, and read.
    pub(super) fn name(self, quantity: Quantity) -> &'static str {
        match (self, quantity) {
            (MotionUnit::Internal, _) => "int",
            (MotionUnit::Chip, _) => "chip",
            (MotionUnit::Pulses, Quantity::Speed) => "pps",
            (MotionUnit::Pulses, Quantity::Acceleration) => "pps2",
            (MotionUnit::FullSteps, Quantity::Speed) => "full steps/s",
            (MotionUnit::FullSteps, Quantity::Acceleration) => "full steps/s2",
            (MotionUnit::PerSecond, Quantity::Speed) => "rps",
            (MotionUnit::PerSecond, Quantity::Acceleration) => "rps/s",
            (MotionUnit::PerMinute, Quantity::Speed) => "rpm",
            (MotionUnit::PerMinute, Quantity::Acceleration) => "rpm/s",
            (MotionUnit::Millimetres, Quantity::Speed) => "mm/s",
            (MotionUnit::Millimetres, Quantity::Acceleration) => "mm/s2",
        }
    }
}

impl Generator {
    /// The ramp generator of a product, with these pulse and ramp divisors if it has any.
    pub(super) fn of(spec: &Spec, (pulse_divisor, ramp_divisor): (u8, u8)) -> Self {
        match spec.axis.row(AxisParameter::PulseDivisor) {
            Some(_) => Generator::Tmc429 { pulse_divisor, ramp_divisor },
            None => Generator::Tmc5160,
        }
    }

    /// The unit of the generator's registers, which take whole numbers.
    pub(super) fn own_unit(self) -> MotionUnit {
        match self {
            Generator::Tmc429 { .. } => MotionUnit::Internal,
            Generator::Tmc5160 => MotionUnit::Chip,
        }
    }

    /// The largest number that its registers take: V_MAX and A_MAX of the TMC429 have 11 bits; VMAX of the TMC5160 ends
    /// at 2^23 - 512, and AMAX has 16 bits (its datasheet, sections 6.3.1 and 12.2).
    pub(super) fn largest(self, quantity: Quantity) -> i128 {
        match (self, quantity) {
            (Generator::Tmc429 { .. }, _) => 2047,
            (Generator::Tmc5160, Quantity::Speed) => (1 << 23) - 512,
            (Generator::Tmc5160, Quantity::Acceleration) => (1 << 16) - 1,
        }
    }

    /// The size of one of the generator's own units in pps or pps2.
    fn own(self, quantity: Quantity) -> Exact {
        match (self, quantity) {
            // v * 16 MHz / (2^pulse_div * 2048 * 32), a * (16 MHz)^2 / 2^(ramp_div + pulse_div + 29): manual section
            // 6.1.
            (Generator::Tmc429 { pulse_divisor, .. }, Quantity::Speed) => {
                Exact::ratio(CLOCK, (2048 * 32) << pulse_divisor)
            }
            (Generator::Tmc429 { pulse_divisor, ramp_divisor }, Quantity::Acceleration) => {
                Exact::ratio(CLOCK * CLOCK, 1 << (u32::from(pulse_divisor) + u32::from(ramp_divisor) + 29))
            }
            // v * f/2 / 2^23, a * f^2 / (512 * 256) / 2^24: section 12.1 of the datasheet.
            (Generator::Tmc5160, Quantity::Speed) => Exact::ratio(CLOCK, 1 << 24),
            (Generator::Tmc5160, Quantity::Acceleration) => Exact::ratio(CLOCK * CLOCK, (512 * 256) << 24),
        }
    }
}

impl Scale {
    /// The units that there are on this axis, in the order in which they are shown.
    pub(super) fn units(self) -> impl Iterator<Item = MotionUnit> {
        MotionUnit::ALL.into_iter().filter(move |unit| self.factor(Quantity::Speed, *unit).is_some())
    }

    /// A number of `unit`, in pps or pps2; `None` if the generator has no such unit.
    pub(super) fn pulses(self, quantity: Quantity, unit: MotionUnit, number: Exact) -> Option<Exact> {
        Some(number * self.factor(quantity, unit)?)
    }

    /// A speed or acceleration in pps or pps2, as a number of `unit`; `None` if the generator has no such unit.
    pub(super) fn number(self, quantity: Quantity, unit: MotionUnit, pulses: Exact) -> Option<Exact> {
        Some(pulses * self.factor(quantity, unit)?.inverse())
    }

    /// A millimetre in microsteps, if it is known how far a turn of the motor moves the stage.
    pub(super) fn millimetre(self) -> Option<Exact> {
        Some(Exact::whole(i128::from(self.microsteps) * i128::from(self.steps)) * self.lead?.inverse())
    }

    /// The size of a unit in pps or pps2 (manual section 6.1.4).
    fn factor(self, quantity: Quantity, unit: MotionUnit) -> Option<Exact> {
        let (microsteps, steps) = (i128::from(self.microsteps), i128::from(self.steps));
        match unit {
            MotionUnit::Internal | MotionUnit::Chip => {
                (unit == self.generator.own_unit()).then(|| self.generator.own(quantity))
            }
            MotionUnit::Pulses => Some(Exact::whole(1)),
            MotionUnit::FullSteps => Some(Exact::whole(microsteps)),
            MotionUnit::PerSecond => Some(Exact::whole(microsteps * steps)),
            MotionUnit::PerMinute => Some(Exact::ratio(microsteps * steps, 60)),
            MotionUnit::Millimetres => self.millimetre(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A usual motor, at the finest resolution.
    fn scale(generator: Generator) -> Scale {
        Scale { generator, microsteps: 256, steps: 200, lead: None }
    }

    fn tmc429(pulse_divisor: u8, ramp_divisor: u8) -> Scale {
        scale(Generator::Tmc429 { pulse_divisor, ramp_divisor })
    }

    /// The unit in pps or pps2.
    fn one(scale: Scale, quantity: Quantity, unit: MotionUnit) -> String {
        scale.pulses(quantity, unit, Exact::whole(1)).map_or_else(|| "none".into(), Exact::shown)
    }

    /// Manual section 6.1.1: 1678 at pulse divisor 3 is about 51208.5 pps. 1678 * 16e6 / (8 * 65536) = 51208.49609375.
    #[test]
    fn the_manuals_speed() {
        let pps = tmc429(3, 7).pulses(Quantity::Speed, MotionUnit::Internal, Exact::whole(1678));
        assert_eq!(pps.map(Exact::shown).as_deref(), Some("51208.496094"));
    }

    /// Manual section 6.1.2: 100 at divisors 7 and 3 is about 46566 pps2. 100 * 256e12 / 2^39 = 46566.1287...
    #[test]
    fn the_manuals_acceleration() {
        let pps2 = tmc429(3, 7).pulses(Quantity::Acceleration, MotionUnit::Internal, Exact::whole(100));
        assert_eq!(pps2.map(Exact::shown).as_deref(), Some("46566.128731"));
    }

    /// Manual section 6.1.4: with 200 full steps and 256 microsteps 51200 pps is 1 rps, 60 rpm.
    #[test]
    fn the_manuals_turn() {
        let pulses = Exact::whole(51_200);
        for (unit, number) in [(MotionUnit::PerSecond, 1), (MotionUnit::PerMinute, 60), (MotionUnit::FullSteps, 200)] {
            assert_eq!(tmc429(3, 7).number(Quantity::Speed, unit, pulses), Some(Exact::whole(number)), "{unit:?}");
        }
    }

    /// Each divisor more halves a speed; an acceleration is halved by either. At divisors of 0 one unit is 16e6 / 65536
    /// = 244.140625 pps and 256e12 / 2^29 = 476837.158203125 pps2.
    #[test]
    fn divisors_halve() {
        assert_eq!(one(tmc429(0, 0), Quantity::Speed, MotionUnit::Internal), "244.140625");
        assert_eq!(one(tmc429(0, 13), Quantity::Speed, MotionUnit::Internal), "244.140625");
        assert_eq!(one(tmc429(13, 0), Quantity::Speed, MotionUnit::Internal), "0.029802");
        assert_eq!(one(tmc429(0, 0), Quantity::Acceleration, MotionUnit::Internal), "476837.158203");
        assert_eq!(one(tmc429(2, 1), Quantity::Acceleration, MotionUnit::Internal), "59604.644775");
        assert_eq!(one(tmc429(13, 13), Quantity::Acceleration, MotionUnit::Internal), "0.007105");
    }

    /// TMC5160 at 16 MHz: a unit is 16e6 / 2^24 = 0.953674 pps and 256e12 / 2^41 = 116.415322 pps2. So AMAX at most is
    /// 65535 * 116.415322 = 7629278 pps2, the limit of the TMCM-3212. VMAX at most is 8388096 * 0.953674 = 7999512 pps.
    #[test]
    fn the_units_of_the_tmc5160() {
        let scale = scale(Generator::Tmc5160);
        assert_eq!(one(scale, Quantity::Speed, MotionUnit::Chip), "0.953674");
        assert_eq!(one(scale, Quantity::Acceleration, MotionUnit::Chip), "116.415322");
        let most = |quantity| Exact::whole(Generator::Tmc5160.largest(quantity));
        let rounded = |quantity| scale.pulses(quantity, MotionUnit::Chip, most(quantity)).map(Exact::rounded);
        assert_eq!(rounded(Quantity::Speed), Some(7_999_512));
        assert_eq!(rounded(Quantity::Acceleration), Some(7_629_278));
    }

    /// A screw with a lead of 4 mm: 1 mm/s is a quarter of a turn per second, 12800 pps.
    #[test]
    fn a_lead_screw() {
        let screw = Scale { lead: Exact::parse("4"), ..tmc429(3, 7) };
        assert_eq!(one(screw, Quantity::Speed, MotionUnit::Millimetres), "12800");
        assert_eq!(one(screw, Quantity::Acceleration, MotionUnit::Millimetres), "12800");
        assert_eq!(one(tmc429(3, 7), Quantity::Speed, MotionUnit::Millimetres), "none");
    }

    #[test]
    fn a_generator_has_its_own_unit_only() {
        let units = |scale: Scale| scale.units().map(|unit| unit.name(Quantity::Speed)).collect::<Vec<_>>();
        assert_eq!(units(tmc429(3, 7)), ["int", "pps", "full steps/s", "rps", "rpm"]);
        assert_eq!(units(scale(Generator::Tmc5160)), ["chip", "pps", "full steps/s", "rps", "rpm"]);
    }

    /// To and fro, at the largest and the smallest that there is: exactly what it was.
    #[test]
    fn nothing_is_lost_between_units() {
        for generator in [
            Generator::Tmc429 { pulse_divisor: 13, ramp_divisor: 13 },
            Generator::Tmc429 { pulse_divisor: 0, ramp_divisor: 0 },
            Generator::Tmc5160,
        ] {
            for (microsteps, steps) in [(256, u16::MAX), (1, 1), (256, 65_521)] {
                let scale = Scale { generator, microsteps, steps, lead: Exact::parse("1.27") };
                for number in [Exact::parse("999999999999999"), Exact::parse("-0.00000000000001")] {
                    let number = number.expect("a number");
                    for (from, to) in scale.units().flat_map(|from| scale.units().map(move |to| (from, to))) {
                        for quantity in Quantity::ALL {
                            let there = scale
                                .pulses(quantity, from, number)
                                .and_then(|pulses| scale.number(quantity, to, pulses));
                            let there = there.expect("both units are the generator's");
                            let back = scale
                                .pulses(quantity, to, there)
                                .and_then(|pulses| scale.number(quantity, from, pulses));
                            assert_eq!(back, Some(number), "{from:?} to {to:?}");
                            // The number can be shown, too.
                            assert!(!there.shown().is_empty());
                        }
                    }
                }
            }
        }
    }
}
