//! Causes that have stopped a motor (axis parameter 207, the extended error flags), in words. To read the parameter is
//! to clear it.

use tmcm::param::AxisParameter;

use super::line::Line;
use crate::conversation::{Conversation, Error};
use crate::product::{Product, axis_number};

/// The flags, from bit 0 on: the short name of each, and what it says.
const FLAGS: [(&str, &str); 2] = [
    ("stall", "a stall has stopped the motor (stop on stall, parameter 181)"),
    ("deviation", "the motor was stopped because an encoder deviated too far from its position"),
];
/// The words for what ends the flags.
const CLEARED: &str = "this reading has cleared it, as the next motion command would have done";

/// The short names of the flags, from bit 0 on.
pub(crate) const EXTENDED_FLAGS: [&str; 2] = [FLAGS[0].0, FLAGS[1].0];

/// Whether a product has such flags, as those do that are not known.
pub fn latches(product: Option<Product>) -> bool {
    axis_number(product, AxisParameter::ExtendedErrorFlags).is_some()
}

/// Tells what the flags say that have just been read.
pub fn latched(flags: i32) -> Vec<Line> {
    let set = (0..).zip(FLAGS).filter(|(bit, _)| flags & (1 << bit) != 0);
    let mut lines: Vec<Line> = set.map(|(_, (_, words))| Line::error(format!("{words}; {CLEARED}"))).collect();
    let known = (1 << FLAGS.len()) - 1;
    if flags & !known != 0 {
        lines.push(Line::error(format!("flags whose meaning is not known: {:#x}; {CLEARED}", flags & !known)));
    }
    if lines.is_empty() {
        lines.push(Line::fine("neither a stall nor a deviation has stopped the motor since the last reading, or the last motion command; switches are told above"));
    }
    lines
}

/// Reads the flags of an axis, which clears them, and gives what they say.
///
/// # Errors
/// The module does not answer, or has no such axis.
pub fn read_latched(module: &mut Conversation, axis: u8) -> Result<Vec<Line>, Error> {
    match module.product()? {
        Some(product) if !latches(Some(product)) => {
            let name = product.name();
            Ok(vec![Line::note(format!(
                "the {name} has no extended error flags: it does not keep what has stopped a motor"
            ))])
        }
        _ => module.axis(axis, AxisParameter::ExtendedErrorFlags).map(latched),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::status::Severity;

    /// The table of parameter 207 in the manual of the TMCM-1140.
    #[test]
    fn each_flag_has_its_words() {
        let words = |flags| latched(flags).into_iter().map(|line| (line.severity, line.words)).collect::<Vec<_>>();
        assert!(words(1)[0].1.starts_with("a stall has stopped the motor"), "{:?}", words(1));
        assert!(words(2)[0].1.contains("an encoder deviated") && words(2)[0].1.contains("cleared"));
        assert_eq!((words(3).len(), words(3)[1].0), (2, Severity::Error));
        assert_eq!(words(0)[0].0, Severity::Fine);
        assert!(words(4)[0].1.starts_with("flags whose meaning is not known: 0x4"));
    }
}
