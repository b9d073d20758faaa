//! The file format of assembled programs: eight bytes per command, without a header.

use tmcm::tmcl::Command;

use crate::product::Product;

/// Bytes of a command in a file: the seven bytes of program memory and their sum in eight bits.
pub const RECORD: usize = Command::SIZE + 1;

/// The bytes of a program's file.
pub fn encode(commands: &[Command]) -> Vec<u8> {
    commands.iter().flat_map(|command| record(*command)).collect()
}

/// The bytes of a command in a file.
pub fn record(command: Command) -> [u8; RECORD] {
    let [opcode, kind, motor, a, b, c, d] = command.to_bytes();
    [opcode, kind, motor, a, b, c, d, sum(command)]
}

/// The commands in a file for a product.
///
/// # Errors A message about the first command that is cut off or has a wrong sum, or about more commands than the
/// product has room for; that of a product that is not known is the module's matter.
pub fn decode(bytes: &[u8], product: Option<Product>) -> Result<Vec<Command>, String> {
    let (records, rest) = bytes.as_chunks::<RECORD>();
    if !rest.is_empty() {
        let (length, address) = (bytes.len(), records.len());
        return Err(format!(
            "command {address} is cut off: it has {} bytes in place of {RECORD}; the file, {length} bytes long, is \
             damaged, or it is no TMCL program",
            rest.len()
        ));
    }
    if let Some(room) = product.map(|product| product.spec().commands)
        && records.len() > room.into()
    {
        return Err(format!("it has more commands than the {room} that program memory holds"));
    }
    let decoded = records.iter().enumerate().map(|(address, &[opcode, kind, motor, a, b, c, d, found])| {
        let command = Command::from_bytes([opcode, kind, motor, a, b, c, d]);
        let wanted = sum(command);
        if found == wanted {
            return Ok(command);
        }
        Err(format!(
            "command {address} ({command}) has the checksum {found:02X} and should have {wanted:02X}; \
             the file is damaged, or it is no TMCL program"
        ))
    });
    decoded.collect()
}

fn sum(command: Command) -> u8 {
    command.to_bytes().iter().fold(0, |sum, byte| sum.wrapping_add(*byte))
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: Option<Product> = Some(Product::Tmcm1140);

    #[test]
    fn files_read_back_and_mistakes_name_the_command() {
        let commands = [Command::new(4, 1, 0, -10_000), Command::new(28, 0, 0, 0)];
        let mut bytes = encode(&commands);
        assert_eq!(bytes, [4, 1, 0, 0xFF, 0xFF, 0xD8, 0xF0, 0xCB, 28, 0, 0, 0, 0, 0, 0, 28]);
        assert_eq!(decode(&bytes, KNOWN).as_deref(), Ok(&commands[..]));
        bytes[15] = 29;
        let error = decode(&bytes, KNOWN).unwrap_err();
        assert!(error.starts_with("command 1 (STOP) has the checksum 1D and should have 1C"), "{error}");
        let error = decode(&bytes[..13], KNOWN).unwrap_err();
        assert!(error.starts_with("command 1 is cut off: it has 5 bytes in place of 8"), "{error}");
        assert!(decode(&[0; RECORD * 2048], KNOWN).is_ok());
        assert!(decode(&[0; RECORD * 2049], KNOWN).unwrap_err().contains("more commands than the 2048"));
        assert!(decode(&[0; RECORD * 2049], None).is_ok());
    }
}
