//! Lines of ASCII mode in words.

use tmcm::tmcl::ascii::Line;

use super::answer::meaning;

/// The host's line, which ends with CR or LF.
pub(super) fn request(line: &[u8]) -> String {
    let text = shown(line);
    let Some((_, rest)) = line.split_first().filter(|_| !text.is_empty()) else { return "empty line".into() };
    match Line::parse(rest) {
        Line::Wrong { status, .. } => format!("line {text:?}: {}", status.meaning()),
        Line::Leave => format!("line {text:?}: back to binary mode"),
        Line::Command(_) => format!("line {text:?}"),
    }
}

/// The module's line: a reply, or else the echo of what was typed.
pub(super) fn reply(line: &[u8]) -> String {
    let text = shown(line);
    match status(&text) {
        Some(status) => format!("line {text:?}: status {status} {}", meaning(status)),
        None => format!("echo {text:?}"),
    }
}

/// Status of a reply `BA 100 -5`: the characters of host and module, status, value.
fn status(text: &str) -> Option<u8> {
    let mut words = text.split(' ');
    let (addresses, status, value) = (words.next()?, words.next()?, words.next()?);
    let is_reply = addresses.len() == 2 && value.parse::<i64>().is_ok() && words.next().is_none();
    status.parse().ok().filter(|_| is_reply)
}

/// The characters but the end of the line; what is no text is shown as a question mark.
fn shown(line: &[u8]) -> String {
    String::from_utf8_lossy(line.trim_ascii()).replace(char::REPLACEMENT_CHARACTER, "?")
}
