//! The order of the modules: each uses only those that stand above it in `src/lib.rs`. And two things that hold
//! beyond that: the simulated hardware does not know the firmware, and `unsafe` is left to the board.

use std::fs;
use std::path::{Path, PathBuf};

/// Cuts a source into words and single characters, without comments and without what stands in quotes.
fn tokens(source: &str) -> Vec<&str> {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    let mut rest = source;
    while let Some(first) = rest.chars().next() {
        let length = match first {
            _ if first.is_whitespace() => first.len_utf8(),
            '/' if rest.starts_with("//") => rest.find('\n').unwrap_or(rest.len()),
            '/' if rest.starts_with("/*") => block_comment(rest),
            '"' => 1 + quoted(&rest[1..], '"'),
            // A character, unless it is a lifetime.
            '\'' if rest[1..].starts_with('\\') || rest.chars().nth(2) == Some('\'') => 1 + quoted(&rest[1..], '\''),
            _ => match raw_string(rest) {
                Some(length) => length,
                None => {
                    let length = if word(first) { rest.find(|c| !word(c)) } else { Some(first.len_utf8()) };
                    let length = length.unwrap_or(rest.len());
                    tokens.push(&rest[..length]);
                    length
                }
            },
        };
        rest = &rest[length..];
    }
    tokens
}

/// Length of a block comment; they nest.
fn block_comment(text: &str) -> usize {
    let (mut depth, mut at) = (0, 0);
    loop {
        let rest = &text[at..];
        let step = match rest.as_bytes() {
            [] => return at,
            [b'/', b'*', ..] => (1, 2),
            [b'*', b'/', ..] => (-1, 2),
            _ => (0, rest.chars().next().map_or(0, char::len_utf8)),
        };
        depth += step.0;
        at += step.1;
        if depth == 0 {
            return at;
        }
    }
}

/// Length up to and with the closing quote.
fn quoted(text: &str, quote: char) -> usize {
    let mut escaped = false;
    for (at, c) in text.char_indices() {
        match c {
            _ if escaped => escaped = false,
            '\\' => escaped = true,
            _ if c == quote => return at + c.len_utf8(),
            _ => {}
        }
    }
    text.len()
}

/// Length of a raw string - `r"`, `br#"` ... - at the start of the text, if there is one.
fn raw_string(text: &str) -> Option<usize> {
    let body = text.strip_prefix("br").or_else(|| text.strip_prefix('r'))?;
    let fence = body.trim_start_matches('#');
    let marks = body.len() - fence.len();
    let inner = fence.strip_prefix('"')?;
    let end = format!("\"{}", "#".repeat(marks));
    let start = text.len() - inner.len();
    Some(inner.find(&end).map_or(text.len(), |at| start + at + end.len()))
}

/// The modules a source names by a path from the crate's root: `crate::a::b`, `crate::{a, b::c}`, or by as many
/// `super` as lead there. `depth` is that of the file's own module; 1 right below the root.
fn modules_used<'a>(tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let mut used = Vec::new();
    // Open braces, and whether each is that of a module.
    let mut open = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let rest = &tokens[at..];
        at += match rest {
            ["mod", _, "{", ..] => {
                open.push(true);
                3
            }
            ["{", ..] => {
                open.push(false);
                1
            }
            ["}", ..] => {
                open.pop();
                1
            }
            ["crate", ":", ":", ..] => {
                used.extend(first_names(&rest[3..]));
                3
            }
            ["super", ":", ":", ..] => {
                let up = rest.chunks(3).take_while(|chunk| *chunk == ["super", ":", ":"]).count();
                if up >= depth + open.iter().filter(|module| **module).count() {
                    used.extend(first_names(&rest[3 * up..]));
                }
                3 * up
            }
            _ => 1,
        };
    }
    used
}

/// What a path, or each path of a group, begins with.
fn first_names<'a>(path: &[&'a str]) -> Vec<&'a str> {
    let ["{", group @ ..] = path else { return path.first().copied().into_iter().collect() };
    let mut names = Vec::new();
    let (mut depth, mut expected) = (1, true);
    for token in group {
        match *token {
            "{" => depth += 1,
            "}" => depth -= 1,
            "," => expected = depth == 1,
            name => {
                if expected {
                    names.push(name);
                }
                expected = false;
            }
        }
        if depth == 0 {
            break;
        }
    }
    names
}

/// What a module of `order` uses although it stands below it.
fn violations<'a>(order: &[&str], module: &str, tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let place = |name: &str| order.iter().position(|other| *other == name);
    let own = place(module);
    modules_used(tokens, depth).into_iter().filter(|used| place(used) > own).collect()
}

/// The modules declared in a library's root, in order.
fn declared<'a>(tokens: &[&'a str]) -> Vec<&'a str> {
    tokens.windows(3).filter(|three| three[0] == "mod" && three[2] == ";").map(|three| three[1]).collect()
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// All Rust sources in a folder and below it, or the one file.
fn sources(path: &Path) -> Vec<PathBuf> {
    if path.is_file() {
        return vec![path.to_owned()];
    }
    let Ok(entries) = fs::read_dir(path) else { return Vec::new() };
    let paths = entries.flatten().map(|entry| entry.path());
    let wanted = paths.filter(|path| path.is_dir() || path.extension().is_some_and(|end| end == "rs"));
    wanted.flat_map(|path| sources(&path)).collect()
}

#[test]
fn modules_use_only_those_above() {
    let source = root().join("src");
    let library = fs::read_to_string(source.join("lib.rs")).unwrap();
    let order = declared(&tokens(&library));
    assert_eq!(order.first(), Some(&"units"));
    assert_eq!(order.last(), Some(&"board"));
    let mut checked = 0;
    for module in &order {
        let file = source.join(module).with_extension("rs");
        let folder = if file.is_file() { file } else { source.join(module) };
        for path in sources(&folder) {
            let text = fs::read_to_string(&path).unwrap();
            let inside = path.strip_prefix(&source).unwrap().with_extension("");
            let depth = inside.components().filter(|part| part.as_os_str() != "mod").count();
            let wrong = violations(&order, module, &tokens(&text), depth);
            assert!(wrong.is_empty(), "{}: uses {wrong:?}, which stand below `{module}` in lib.rs", path.display());
            checked += 1;
        }
    }
    assert!(checked > order.len(), "{checked} files");
}

#[test]
fn simulated_hardware_does_not_know_the_firmware() {
    let folder = root().join("hal-sim");
    let manifest = fs::read_to_string(folder.join("Cargo.toml")).unwrap();
    assert!(!manifest.split(|c: char| !c.is_alphanumeric() && c != '_').any(|word| word == "tmcm"));
    let sources = sources(&folder);
    assert!(!sources.is_empty());
    for path in sources {
        assert!(!tokens(&fs::read_to_string(&path).unwrap()).contains(&"tmcm"), "{}", path.display());
    }
}

#[test]
fn unsafe_is_left_to_the_board() {
    let board = root().join("src/board");
    // The image whose one use of it is to ask for a function that does not exist.
    let unlinkable = root().join("tests/panic_free/src/main.rs");
    for place in ["src", "fw", "hal-sim", "cli", "tests", "benches", "build.rs"] {
        for path in sources(&root().join(place)).iter().filter(|path| !path.starts_with(&board) && **path != unlinkable)
        {
            assert!(!tokens(&fs::read_to_string(path).unwrap()).contains(&"unsafe"), "{}", path.display());
        }
    }
}

/// The checks are worth something only if they find what is wrong.
mod checker {
    use super::*;

    const ORDER: [&str; 3] = ["low", "middle", "high"];

    fn in_middle(source: &str) -> Vec<&str> {
        violations(&ORDER, "middle", &tokens(source), 2)
    }

    #[test]
    fn finds_a_use_of_what_stands_below() {
        assert_eq!(in_middle("use crate::high::Thing;"), ["high"]);
        assert_eq!(in_middle("fn f() { crate::high::g(&crate::low::X) }"), ["high"]);
        assert_eq!(in_middle("use crate::{low::{A, high}, middle, high::{self, B}};"), ["high"]);
        assert_eq!(in_middle("use super::super::high;"), ["high"]);
        assert_eq!(in_middle("macro_rules! m { () => { $crate::high::X } }"), ["high"]);
        assert_eq!(in_middle("fn f<'a>() -> &'a str { \"\\\"\" } use crate::high::X; // '\"'"), ["high"]);
    }

    #[test]
    fn lets_pass_what_stands_above_or_in_the_module_itself() {
        assert!(
            in_middle("use crate::low::{A, B}; use crate::middle::C; use super::high; use crate::LOWEST;").is_empty()
        );
        assert!(in_middle("mod tests { use super::super::high; }").is_empty());
    }

    #[test]
    fn does_not_read_comments_and_strings() {
        assert!(in_middle("/// [`crate::high::X`]\n/* crate::high /* */ unsafe */ fn f() {}").is_empty());
        for text in ["\"unsafe\"", "r#\"an \" unsafe\"#", "b\"unsafe\"", "// unsafe", "'\"' /* \" */ // unsafe"] {
            assert!(!tokens(text).contains(&"unsafe"), "{text}");
        }
        assert!(tokens("let x = 'a'; unsafe { f(\"\\\\\") }").contains(&"unsafe"));
        assert!(tokens("fn f<'a>(x: &'a str) { unsafe { g('\\'', br\"\\\") } }").contains(&"unsafe"));
    }

    #[test]
    fn reads_the_order_from_the_root() {
        assert_eq!(
            declared(&tokens("//! mod no;\npub mod low;\n#[cfg(x)]\nmod middle;\nmod tests { }")),
            ["low", "middle"]
        );
    }
}
