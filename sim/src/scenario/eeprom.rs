//! The contents of an EEPROM in lines: `01A0: 12 34`, the address and the bytes from there on, in hexadecimal. What no
//! line tells is 0xFF, as in an EEPROM that nobody has written.

use super::{Mistake, SourceLine};

/// A byte that was never written.
const ERASED: u8 = 0xFF;
/// Bytes of a line.
const LINE: usize = 16;

/// Contents in lines.
pub fn lines(contents: &[u8]) -> Vec<String> {
    let told = contents.chunks(LINE).enumerate().filter(|(_, bytes)| bytes.iter().any(|byte| *byte != ERASED));
    let line = |(index, bytes): (usize, &[u8])| {
        let bytes: String = bytes.iter().map(|byte| format!(" {byte:02X}")).collect();
        format!("{:04X}:{bytes}", index * LINE)
    };
    told.map(line).collect()
}

/// The contents of an EEPROM of `size` bytes.
///
/// # Errors
/// A line is none of these, or beyond the end.
pub(super) fn of_lines(lines: &[SourceLine], size: usize) -> Result<Vec<u8>, Mistake> {
    let mut contents = vec![ERASED; size];
    for SourceLine { number, text } in lines {
        let told = bytes(text.trim()).map_err(|why| Mistake::new(*number, why))?;
        let room = contents.get_mut(told.0..).and_then(|room| room.get_mut(..told.1.len()));
        let room = room.ok_or_else(|| Mistake::new(*number, format!("the EEPROM has {size:#X} bytes")))?;
        room.copy_from_slice(&told.1);
    }
    Ok(contents)
}

/// The address of a line, and its bytes.
fn bytes(line: &str) -> Result<(usize, Vec<u8>), String> {
    let none = || format!("'{line}' is no line of an EEPROM; write an address and bytes in hexadecimal: 01A0: 12 34");
    let (address, bytes) = line.split_once(':').ok_or_else(none)?;
    let address = usize::from_str_radix(address.trim(), 16).map_err(|_| none())?;
    let byte = |word: &str| u8::from_str_radix(word, 16).ok().filter(|_| word.len() == 2);
    let bytes = bytes.split_whitespace().map(byte).collect::<Option<Vec<u8>>>().ok_or_else(none)?;
    Ok((address, bytes))
}
