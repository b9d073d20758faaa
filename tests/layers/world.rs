//! The tools know no operating system: they run in a browser as well, where files, threads and clocks do not exist, and
//! where `Instant::now` panics.

use std::fs;

use super::first_names;
use super::tokens::tokens;

/// Modules of the standard library that need an operating system.
const MODULES: [&str; 6] = ["env", "fs", "net", "os", "process", "thread"];
/// Words that nothing else is called by: clocks, streams, and crates that only a program for a terminal has.
const WORDS: [&str; 14] = [
    "Instant",
    "SystemTime",
    "stdin",
    "stdout",
    "stderr",
    "Stdin",
    "Stdout",
    "Stderr",
    "print",
    "println",
    "eprint",
    "eprintln",
    "clap",
    "rustix",
];

/// Lists what a source uses of the world around a program, test modules apart.
fn used(source: &str) -> Vec<&str> {
    let tokens = without_tests(tokens(source));
    let words = tokens.iter().copied().filter(|token| WORDS.contains(token));
    let modules = (0..tokens.len()).filter(|at| tokens[*at..].starts_with(&["std", ":", ":"]));
    let modules = modules.flat_map(|at| first_names(&tokens[at + 3..])).filter(|name| MODULES.contains(name));
    words.chain(modules).collect()
}

/// The tokens of a source without its modules for tests.
fn without_tests(mut tokens: Vec<&str>) -> Vec<&str> {
    const TEST: [&str; 7] = ["#", "[", "cfg", "(", "test", ")", "]"];
    while let Some(start) = tokens.windows(TEST.len()).position(|some| some == TEST) {
        let mut open = 0;
        let ends = tokens[start..].iter().position(|token| {
            open += i32::from(*token == "{") - i32::from(*token == "}");
            open == 0 && matches!(*token, "}" | ";")
        });
        tokens.drain(start..ends.map_or(tokens.len(), |length| start + length + 1));
    }
    tokens
}

#[test]
fn the_tools_know_no_operating_system() {
    let tools = super::root().join("tools/src");
    let sources = super::sources(&tools);
    assert!(sources.len() > 30, "{}", sources.len());
    // Folders of tests are modules that another file declares for tests.
    for path in sources.iter().filter(|path| !path.strip_prefix(&tools).unwrap().iter().any(|part| part == "tests")) {
        let text = fs::read_to_string(path).unwrap();
        assert_eq!(used(&text), [""; 0], "{}", path.display());
    }
}

#[test]
fn what_is_used_of_the_world_is_found() {
    for word in WORDS {
        assert_eq!(used(&format!("fn a() {{ {word}(b) }}")), [word]);
    }
    for module in MODULES {
        assert_eq!(used(&format!("use std::{module}::a; use std::{{io, {module}}};")), [module, module]);
    }
    for (source, found) in [
        ("use std::fs::File;", ["fs"].as_slice()),
        ("use std::{io, thread}; fn a() { std::env::var(\"x\") }", &["thread", "env"]),
        ("use std::os::fd::AsFd; use std::{net::TcpStream, process};", &["os", "net", "process"]),
        ("use std::time::{Duration, Instant}; let now = SystemTime::now();", &["Instant", "SystemTime"]),
        ("fn a() { println!(\"x\"); eprint!(\"\"); io::stdin(); }", &["println", "eprint", "stdin"]),
        ("use clap::Args; fn b() { rustix::io::read() }", &["clap", "rustix"]),
        ("// std::fs\nuse std::time::Duration; fn fs() { \"std::fs\" } use super::net;", &[]),
        ("fn a() {} #[cfg(test)] mod tests { use std::fs; fn b() { print!(\"\") } } use std::env;", &["env"]),
        ("#[cfg(test)] mod tests; use std::fs;", &["fs"]),
    ] {
        assert_eq!(used(source), found, "{source}");
    }
}
