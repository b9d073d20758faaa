//! Suggestions for commands in the wrong place or with the wrong letters.

use tmcm::tmcl::Instruction;
use tmcm_sim::Product;
use tmcm_sim::protocol::Request;

/// The command to the simulated world that a line in any letters would be; the world has small letters. `None` if it is
/// none for the module that most people have.
pub fn world_command(line: &str) -> Option<String> {
    let small = line.trim().to_lowercase();
    Request::parse(&small, &[Product::default().kind()]).is_ok().then_some(small)
}

/// A line in any letters with its first word in capitals, if that is the mnemonic of a command of TMCL.
pub fn module_command(line: &str) -> Option<String> {
    let line = line.trim();
    let end = line.find(|c: char| c.is_whitespace() || c == ',').unwrap_or(line.len());
    let (word, rest) = line.split_at_checked(end)?;
    Instruction::by_mnemonic(word).map(|instruction| format!("{}{rest}", instruction.mnemonic))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_are_known_in_any_letters() {
        assert_eq!(world_command(" Press LEFT"), Some("press left".into()));
        assert_eq!(world_command("STEP 20 ms"), Some("step 20 ms".into()));
        assert_eq!(world_command("press"), None);
        assert_eq!(module_command("mvp abs, 0, 1000"), Some("MVP abs, 0, 1000".into()));
        assert_eq!(module_command("stop"), Some("STOP".into()));
        assert_eq!((module_command("press left"), module_command("")), (None, None));
    }
}
