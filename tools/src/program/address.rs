//! Addresses in program memory as they are written on the command line.

/// Reads an address: a number in decimal, or in hexadecimal behind $ or 0x as in programs.
///
/// # Errors
/// A message that shows how an address is written.
pub fn address(text: &str) -> Result<u16, String> {
    let hexadecimal = ["$", "0x", "0X"].into_iter().find_map(|prefix| text.strip_prefix(prefix));
    let is_digits = |digits: &str| digits.chars().all(|digit| digit.is_ascii_hexdigit());
    let address = match hexadecimal {
        Some(digits) => u16::from_str_radix(digits, 16).ok().filter(|_| is_digits(digits)),
        None => text.parse().ok().filter(|_| is_digits(text)),
    };
    address.ok_or_else(|| format!("an address is a number from 0 to {}, for example 50 or $32", u16::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_written_as_numbers_in_programs() {
        for (text, number) in [("0", 0), ("50", 50), ("$32", 50), ("0x7fF", 2047), ("65535", u16::MAX)] {
            assert_eq!(address(text), Ok(number), "{text}");
        }
        for text in ["", "-1", "+5", "$", "$+5", "5 0", "65536", "$10000", "Loop", "1e3"] {
            assert!(address(text).is_err_and(|message| message.contains("for example 50 or $32")), "{text}");
        }
    }
}
