//! Callers, in a program for the microcontroller, of functions that end in the panic handler, read from its machine
//! code.

use std::collections::{BTreeMap, BTreeSet};

use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};

/// The function that all panics end in.
const HANDLER: &str = "__rustc::rust_begin_unwind";

/// The calls that lead to the panic handler, from the last function that `stops` is true of.
pub(crate) fn callers(file: &object::File, stops: impl Fn(&str) -> bool) -> BTreeSet<String> {
    let functions = functions(file);
    let calls = calls(file);
    let mut found = BTreeSet::new();
    let handler = functions.iter().find(|(_, name)| *name == HANDLER);
    // Functions that lead to the handler, with the way there.
    let mut open: Vec<_> = handler.map(|(address, _)| (*address, String::new())).into_iter().collect();
    let mut seen = BTreeSet::new();
    while let Some((address, way)) = open.pop() {
        if !seen.insert(address) {
            continue;
        }
        for (at, _) in calls.iter().filter(|(_, to)| *to == address) {
            let Some((caller, name)) = functions.range(..=at).next_back() else { continue };
            let way = if way.is_empty() { name.clone() } else { format!("{name} > {way}") };
            if stops(name) {
                found.insert(way);
            } else {
                open.push((*caller, way));
            }
        }
    }
    found
}

/// Whether a function of a library does nothing but panic, by its name.
pub(crate) fn is_there_to_panic(name: &str) -> bool {
    let last = name.rsplit("::").next().unwrap_or(name);
    name.starts_with("core::panicking::") || last.contains("panic") || last.contains("_fail")
}

/// The functions by their addresses. Of several names of one the last is taken.
fn functions(file: &object::File) -> BTreeMap<u64, String> {
    let symbols = file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text);
    // Without the hash at the end. Bit 0 says that it is Thumb code.
    let name = |symbol: &object::Symbol| format!("{:#}", rustc_demangle::demangle(symbol.name().unwrap()));
    let mut named: Vec<_> = symbols.map(|symbol| (symbol.address() & !1, name(&symbol))).collect();
    named.sort();
    named.into_iter().collect()
}

/// All calls, from where and to where; a jump to another function is one, too.
fn calls(file: &object::File) -> Vec<(u64, u64)> {
    let mut calls = Vec::new();
    for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
        // Marks say where code begins, and where the constants in it (ELF for the Arm Architecture, mapping symbols).
        let marks = file.symbols().filter(|symbol| symbol.section_index() == Some(section.index()));
        let marks = marks.filter_map(|symbol| match symbol.name() {
            Ok("$t") => Some((symbol.address(), true)),
            Ok("$d") => Some((symbol.address(), false)),
            _ => None,
        });
        let marks: BTreeMap<_, _> = marks.collect();
        let (halves, _) = section.data().unwrap().as_chunks();
        let mut halves = (section.address()..).step_by(2).zip(halves.iter().map(|half| u16::from_le_bytes(*half)));
        while let Some((at, first)) = halves.next() {
            let is_code = marks.range(..=at).next_back().is_some_and(|(_, code)| *code);
            // From 0b11101 on in the highest bits an instruction has two halves.
            if is_code && first >= 0xE800 {
                let second = halves.next().map_or(0, |(_, second)| second);
                calls.extend(target(at, first, second).map(|to| (at, to)));
            }
        }
    }
    calls
}

/// Where an instruction of two halves goes on, if it is BL, or B in its longest form (Armv7-M Architecture Reference
/// Manual, A7.7.12 and A7.7.18).
fn target(at: u64, first: u16, second: u16) -> Option<u64> {
    if first >> 11 != 0b11110 || second >> 15 == 0 || second >> 12 & 1 == 0 {
        return None;
    }
    let bit = |word: u16, n: u16| i64::from(word >> n & 1);
    let sign = bit(first, 10);
    let high = (bit(second, 13) ^ sign ^ 1) << 1 | bit(second, 11) ^ sign ^ 1;
    let offset = high << 22 | i64::from(first & 0x3FF) << 12 | i64::from(second & 0x7FF) << 1;
    // The sign is bit 24. The instruction counts from its end.
    (at + 4).checked_add_signed(offset - (sign << 24))
}
