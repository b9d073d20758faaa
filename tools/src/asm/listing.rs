//! The listing of an assembled program and the table of its symbols, as text.

use std::fmt::Write;
use std::sync::Arc;

use tmcm::tmcl::Command;

use super::assembler::Assembly;
use crate::program::binary::{RECORD, record};

/// Width of a command's bytes in hexadecimal, in characters.
const BYTES: usize = 3 * RECORD - 1;

/// The listing: address, bytes, line number and text of each source line. Built-in files are left out.
pub fn listing(assembly: &Assembly) -> String {
    let mut text = String::new();
    let mut file = None;
    for line in assembly.lines.iter().filter(|line| !line.source.built_in) {
        // Writing to a string cannot fail.
        if !file.is_some_and(|file| Arc::ptr_eq(file, &line.source)) {
            let _ = writeln!(text, "{}:", line.source.name);
            file = Some(&line.source);
        }
        let command = line.address.and_then(|address| assembly.command(address));
        text += &row(line.address, command, &line.number.to_string(), line.text());
    }
    let unwritten =
        assembly.addresses().zip(&assembly.commands).filter(|(address, _)| assembly.line(*address).is_none());
    for (address, command) in unwritten {
        text += &row(Some(address), Some(command), "", &format!("{command} // put here by the assembler"));
    }
    text
}

fn row(address: Option<usize>, command: Option<&Command>, number: &str, source: &str) -> String {
    let address = address.map_or_else(String::new, |address| address.to_string());
    let bytes = command.map_or_else(String::new, |command| record(*command).map(|b| format!("{b:02X}")).join(" "));
    let row = format!("{address:>4}  {bytes:BYTES$}  {number:>5}  {source}");
    format!("{}\n", row.trim_end())
}

/// The table of symbols: labels with their addresses, at which a host can start routines, and constants with their
/// values.
pub fn symbols(assembly: &Assembly) -> String {
    let mut text = String::new();
    let labels = assembly.symbols.labels().map(|(name, address)| (name, address.to_string()));
    let constants = assembly.symbols.constants().map(|(name, value)| (name, value.to_string()));
    table(&mut text, "labels", labels.collect());
    table(&mut text, "constants", constants.collect());
    text
}

fn table(text: &mut String, title: &str, rows: Vec<(&str, String)>) {
    if rows.is_empty() {
        return;
    }
    let width = rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or_default();
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{title}:");
    for (name, value) in rows {
        let _ = writeln!(text, "  {name:width$} = {value}");
    }
}
