//! Operating systems are told apart in few files; what is of one of them alone is beside these.

use std::fs;

use crate::tokens::tokens;
use crate::{FOLDERS, root, sources};

/// The files that tell operating systems apart: the user's terminal, what can be waited for, files that are held,
/// pseudo terminals, and how a browser is opened.
const SEAMS: [&str; 5] = [
    "cli/src/terminal/system/mod.rs",
    "link/src/system/mod.rs",
    "server/src/held/mod.rs",
    "server/src/pty/mod.rs",
    "studio/build/src/opener.rs",
];

/// True if something is there on Unix alone or on Windows alone, in whatever words.
fn asks_for_a_system(tokens: &[&str]) -> bool {
    let conditions = (0..tokens.len()).filter(|at| matches!(tokens[*at], "cfg" | "cfg_attr"));
    conditions.into_iter().any(|at| {
        let mut open = 0;
        let within = tokens[at + 1..].iter().skip_while(|token| **token == "!").take_while(|token| {
            open += i32::from(**token == "(") - i32::from(**token == ")");
            open > 0
        });
        within.into_iter().any(|token| matches!(*token, "unix" | "windows"))
    })
}

#[test]
fn what_is_of_one_system_is_found() {
    for source in
        ["#[cfg(unix)] mod a;", "if cfg!(windows) {}", "#[cfg(not(windows))] mod a;", "#[cfg_attr(unix, path)] mod a;"]
    {
        assert!(asks_for_a_system(&tokens(source)), "{source}");
    }
    for source in ["#[cfg(test)] mod unix;", "for two in list.windows(2) {}", "use cfg::windows;"] {
        assert!(!asks_for_a_system(&tokens(source)), "{source}");
    }
}

#[test]
fn operating_systems_are_told_apart_in_few_places() {
    let mut seams = Vec::new();
    for folder in FOLDERS {
        for path in sources(&root().join(folder)) {
            let text = fs::read_to_string(&path).unwrap();
            let name = path.strip_prefix(root()).unwrap().to_str().unwrap().to_owned();
            let is_test = name.split('/').any(|part| part == "tests");
            if asks_for_a_system(&tokens(&text)) {
                seams.push(name.clone());
            }
            let is_maker = SEAMS.iter().any(|seam| name.starts_with(seam.trim_end_matches("mod.rs")));
            let of_a_system = ["std::os::unix", "std::os::fd", "std::os::windows"].iter().any(|os| text.contains(os));
            assert!(is_test || is_maker || !of_a_system, "{name}");
        }
    }
    seams.sort();
    assert_eq!(seams, SEAMS);
}
