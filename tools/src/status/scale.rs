//! The meaning of the value of an input or output.

/// The meaning of the value of an input or output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// The level of a line.
    Level,
    /// A switch, by its logical state.
    Contact,
    /// An output, or something else that is switched.
    OnOff,
    /// Whether an encoder is at the zero of its turn.
    AtZero,
    /// A reading of a converter; the highest one.
    Counts(i32),
    /// Tenths of a volt.
    Tenths,
    /// Degrees Celsius.
    Celsius,
}

impl Scale {
    /// The unit of the text of a value; empty where there is none.
    pub fn unit(self) -> &'static str {
        match self {
            Scale::Tenths => "V",
            Scale::Celsius => "degC",
            Scale::Level | Scale::Contact | Scale::OnOff | Scale::AtZero | Scale::Counts(_) => "",
        }
    }

    /// A value as a text, with its unit.
    pub fn text(self, value: i32) -> String {
        let either = |yes: &str, no: &str| match value {
            0 => no.to_owned(),
            1 => yes.to_owned(),
            other => other.to_string(),
        };
        match self {
            Scale::Level => either("high", "low"),
            Scale::Contact => either("closed", "open"),
            Scale::OnOff => either("on", "off"),
            Scale::AtZero => either("at zero", "elsewhere"),
            Scale::Counts(highest) => format!("{value} of {highest}"),
            Scale::Tenths => volts(value),
            Scale::Celsius => format!("{value} degC"),
        }
    }

    /// Whether a value of something that is either on or off means on; `None` of anything else.
    pub fn is_on(self, value: i32) -> Option<bool> {
        match self {
            Scale::Level | Scale::Contact | Scale::OnOff | Scale::AtZero => Some(value != 0),
            Scale::Counts(_) | Scale::Tenths | Scale::Celsius => None,
        }
    }
}

/// A voltage in tenths of a volt, as a text in volts.
pub(super) fn volts(tenths: i32) -> String {
    let sign = if tenths < 0 { "-" } else { "" };
    let tenths = tenths.unsigned_abs();
    format!("{sign}{}.{} V", tenths / 10, tenths % 10)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_have_words_and_units() {
        let texts = [
            (Scale::Level, 1, "high", Some(true)),
            (Scale::Contact, 0, "open", Some(false)),
            (Scale::OnOff, 1, "on", Some(true)),
            (Scale::AtZero, 0, "elsewhere", Some(false)),
            (Scale::Level, 7, "7", Some(true)),
            // The example of the manual's section 3.7.15.
            (Scale::Counts(4095), 302, "302 of 4095", None),
            (Scale::Tenths, 241, "24.1 V", None),
            (Scale::Tenths, -5, "-0.5 V", None),
            (Scale::Celsius, -12, "-12 degC", None),
        ];
        for (scale, value, text, on) in texts {
            assert_eq!((scale.text(value).as_str(), scale.is_on(value)), (text, on), "{scale:?}");
            assert!(text.ends_with(scale.unit()));
        }
    }
}
