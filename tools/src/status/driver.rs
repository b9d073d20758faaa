//! The error flags of a motor's driver (axis parameter 208), in words.

use super::line::{Line, Severity};

/// An error flag of a driver.
#[derive(Clone, Copy, Debug)]
struct Flag {
    /// The short name of the flag.
    name: &'static str,
    /// How much it matters while the motor turns, and while it stands.
    severity: [Severity; 2],
    /// The meaning of the flag, and what ends it, while the motor turns, and while it stands.
    words: [&'static str; 2],
}

impl Flag {
    /// A flag that says the same of every motor.
    const fn always(name: &'static str, severity: Severity, words: &'static str) -> Self {
        Flag { name, severity: [severity; 2], words: [words; 2] }
    }
}

/// The flag that is no error: the motor stands.
pub(crate) const STANDSTILL: i32 = 1 << 7;
/// The words for a shut-down of the driver, with what ends one that is over: the firmware has the flag until then.
macro_rules! shut_down {
    ($cause:literal) => {
        concat!($cause, ", and the driver has switched the motor off; the next motion command tries again")
    };
}
/// The words for an open load, which only informs: the driver does nothing about it.
macro_rules! open_load {
    ($coil:literal) => {
        [
            concat!("open load at coil ", $coil, ": is the motor connected? A fast motor may look so as well"),
            concat!("open load at coil ", $coil, ", which may mean nothing while the motor stands"),
        ]
    };
}
/// The severity of flags that are not to be relied on while the motor stands. The driver looks for current in a coil,
/// of which a motor at rest, or a fast one, may have none.
const OPEN: [Severity; 2] = [Severity::Warning, Severity::Note];

/// The flags, from bit 0 on. Only the TMCM-3212 has the last two.
const FLAGS: [Flag; 10] = [
    Flag {
        name: "SG",
        severity: [Severity::Note, Severity::Fine],
        words: [
            "stallGuard2: the load value is 0, as of a motor that stalls; at a low speed it says nothing",
            "stallGuard2: the load value is 0, which says nothing of a motor that stands",
        ],
    },
    Flag::always("OT", Severity::Error, shut_down!("over-temperature: the driver is too hot")),
    Flag::always(
        "OTPW",
        Severity::Warning,
        "over-temperature pre-warning: the driver is hot, and will shut down if it gets hotter",
    ),
    Flag::always("S2GA", Severity::Error, shut_down!("short to ground at coil A")),
    Flag::always("S2GB", Severity::Error, shut_down!("short to ground at coil B")),
    Flag { name: "OLA", severity: OPEN, words: open_load!("A") },
    Flag { name: "OLB", severity: OPEN, words: open_load!("B") },
    Flag::always("STST", Severity::Fine, "standstill: the driver gets no steps"),
    Flag::always("S2VSA", Severity::Error, shut_down!("short to the supply at coil A")),
    Flag::always("S2VSB", Severity::Error, shut_down!("short to the supply at coil B")),
];

/// The short names of the flags, from bit 0 on.
pub(crate) const DRIVER_FLAGS: [&str; FLAGS.len()] = {
    let mut names = [""; FLAGS.len()];
    let mut bit = 0;
    while bit < names.len() {
        names[bit] = FLAGS[bit].name;
        bit += 1;
    }
    names
};

/// Tells what the flags say of a motor that turns, or stands.
pub(super) fn lines(flags: i32, stands: bool) -> Vec<Line> {
    let set = (0..).zip(&FLAGS).filter(|(bit, _)| flags & (1 << bit) != 0);
    let mut lines: Vec<Line> = set
        .map(|(_, Flag { severity: [moving, resting], words: [of_moving, of_resting], .. })| {
            let (severity, words) = if stands { (*resting, *of_resting) } else { (*moving, *of_moving) };
            Line { severity, words: format!("driver: {words}") }
        })
        .collect();
    let known = (1 << FLAGS.len()) - 1;
    if flags & !known != 0 {
        lines.push(Line::note(format!("driver: further flags, whose meaning is not known: {:#x}", flags & !known)));
    }
    if flags & !STANDSTILL == 0 {
        lines.push(Line::fine("driver: no error"));
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of parameter 208 in the manual of the TMCM-1140.
    #[test]
    fn each_bit_has_its_words() {
        let first = |bit: i32, stands| {
            let line = lines(1 << bit, stands).swap_remove(0);
            (line.severity, line.words)
        };
        for (bit, severity, words) in [
            (0, Severity::Note, "stallGuard2"),
            (1, Severity::Error, "over-temperature:"),
            (2, Severity::Warning, "over-temperature pre-warning"),
            (3, Severity::Error, "short to ground at coil A"),
            (4, Severity::Error, "short to ground at coil B"),
            (5, Severity::Warning, "open load at coil A"),
            (6, Severity::Warning, "open load at coil B"),
            (7, Severity::Fine, "standstill"),
            (8, Severity::Error, "short to the supply at coil A"),
            (9, Severity::Error, "short to the supply at coil B"),
            (10, Severity::Note, "further flags, whose meaning is not known: 0x400"),
        ] {
            let (told, line) = first(bit, false);
            assert_eq!(told, severity, "bit {bit}");
            assert!(line.starts_with(&format!("driver: {words}")), "bit {bit}: {line}");
        }
        assert_eq!(first(0, true).0, Severity::Fine);
        assert_eq!(first(5, true).0, Severity::Note);
        assert_eq!(first(3, true).0, Severity::Error);
    }

    #[test]
    fn no_error_is_told_as_well() {
        let words = |flags| lines(flags, true).into_iter().map(|line| line.words).collect::<Vec<_>>();
        assert_eq!(words(0), ["driver: no error"]);
        assert_eq!(words(0x80), ["driver: standstill: the driver gets no steps", "driver: no error"]);
        assert_eq!(words(0b11000).len(), 2);
    }
}
