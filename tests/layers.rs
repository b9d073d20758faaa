//! Tests of the dependencies between modules, files and crates.
//!
//! * Each module of the firmware uses only modules declared above it in `src/lib.rs`.
//! * Each floor of the board uses only floors declared above it in `src/board/mod.rs`.
//! * Chip drivers, motion, the store, the device and the CANopen firmware do not use the language TMCL, and neither
//!   chip drivers nor the store use a parameter table ([`APART`]).
//! * What a motion chip demands is known by its driver and by one folder in `motion`: no other file names its registers
//!   ([`AT_CHIPS`]).
//! * The device, the interpreter, the language TMCL and its firmware name no chip and no product. Chip drivers and the
//!   store name no parameter by its number. Both rules hold in comments, too: `layers/words.rs`.
//! * Comments of all crates name their subject, have sentences of thirty words at most, and end at column 120:
//!   `layers/comments.rs`.
//! * No two files of a crate import each other, directly or through other files; `layers/imports.rs` defines
//!   imports.
//! * Calls of a type's own methods between files form no circle, and the methods are in few files: else it is several
//!   types in one ([`MOST_FILES`]); `layers/owners.rs` defines methods and calls.
//! * Traits and functions of the firmware, an axis and what it is made of are small: `layers/sizes.rs`.
//! * The services of CiA 301 use nothing of the firmware but frames and units.
//! * The simulated hardware does not use the firmware, the virtual modules do not use the tools, and the tools neither
//!   the command line nor an operating system: `layers/world.rs`.
//! * The functions that `docs/architecture.md` names exist in the files it names, and a path through the code visits no
//!   file twice without a reason.
//! * Operating systems are told apart in five files: `layers/systems.rs`.
//! * Only the board uses `unsafe`, and the doors through which a page calls.
//! * Nothing knows the folder in which it was compiled.

#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

#[path = "layers/checker.rs"]
mod checker;
#[path = "layers/circles.rs"]
mod circles;
#[path = "layers/comments.rs"]
mod comments;
#[path = "layers/imports.rs"]
mod imports;
#[path = "layers/owners.rs"]
mod owners;
#[path = "layers/sizes.rs"]
mod sizes;
#[path = "layers/systems.rs"]
mod systems;
#[path = "layers/tokens.rs"]
mod tokens;
#[path = "layers/words.rs"]
mod words;
#[path = "layers/world.rs"]
mod world;

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use tokens::tokens;

/// The modules that a source names by a path from the crate's root: `crate::a::b`, `crate::{a, b::c}`, or by as many
/// `super` as lead to the root. `depth` is the depth of the file's own module; 1 is directly below the root.
fn modules_used<'a>(tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let mut used = Vec::new();
    // For each open brace, whether it is the brace of a module.
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

/// The first name of a path, or of each path of a group in braces.
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

/// The modules that a module uses although `order` has them below it.
fn violations<'a>(order: &[&str], module: &str, tokens: &[&'a str], depth: usize) -> Vec<&'a str> {
    let position = |name: &str| order.iter().position(|other| *other == name);
    let own = position(module);
    modules_used(tokens, depth).into_iter().filter(|used| position(used) > own).collect()
}

/// The modules declared in a library's root, in the order of their declarations.
fn declared<'a>(tokens: &[&'a str]) -> Vec<&'a str> {
    tokens.windows(3).filter(|three| three[0] == "mod" && three[2] == ";").map(|three| three[1]).collect()
}

fn root() -> &'static Path {
    static ROOT: LazyLock<PathBuf> = LazyLock::new(|| xtask::workspace().unwrap());
    &ROOT
}

/// All Rust sources in a folder and its subfolders, or the file at this path.
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
    assert_eq!(order[order.len() - 2..], ["board", "image"]);
    let mut checked = 0;
    for module in &order {
        for (path, text, depth) in files_of(module) {
            let wrong = violations(&order, module, &tokens(&text), depth);
            assert!(wrong.is_empty(), "{}: uses {wrong:?}, which stand below `{module}` in lib.rs", path.display());
            checked += 1;
        }
    }
    assert!(checked > order.len(), "{checked} files");
}

/// Finds the imports that lead from a floor of a board to one declared below it, or out of the floors to the file that
/// declares them. A floor is a folder with a module.
fn upward<'a>(board: &Path, floors: &[&str], imports: &'a circles::Imports) -> Vec<(&'a Path, &'a Path, &'a str)> {
    let floor = |path: &Path| floors.iter().position(|floor| path.starts_with(board.join(floor)));
    let root = board.join("mod.rs");
    let all = imports.iter().flat_map(|(from, others)| others.iter().map(move |(to, name)| (from, to, name)));
    let inside = all.filter_map(|(from, to, name)| Some((floor(from)?, from, to, name)));
    let wrong = inside.filter(|(own, _, to, _)| floor(to) > Some(*own) || **to == root);
    wrong.map(|(_, from, to, name)| (from.as_path(), to.as_path(), name.as_str())).collect()
}

/// The code that runs uses the boards, and these use the microcontroller: so neither a board nor the microcontroller is
/// written with what will run on it in mind.
#[test]
fn floors_of_the_board_use_only_those_above() {
    let board = root().join("src/board");
    let text = fs::read_to_string(board.join("mod.rs")).unwrap();
    let floors = declared(&tokens(&text));
    assert_eq!(floors, ["stm32f4", "boards", "runtime"]);
    let imports = imports::Crate::read(&root().join("src/lib.rs")).imports();
    for floor in &floors {
        let files = imports.keys().filter(|file| file.starts_with(board.join(floor))).count();
        assert!(files > 5, "{floor} has {files} files");
    }
    let wrong = upward(&board, &floors, &imports);
    assert!(wrong.is_empty(), "a floor uses one that is declared below it:\n{}", listed(&wrong));
}

/// Files in which the CANopen firmware uses TMCL: it takes the version, for hosts at its USB port. In TMCL mode it
/// passes bytes on.
const BETWEEN_LANGUAGES: [&str; 1] = ["canopen/usb.rs"];
/// Modules, each with the modules above it that it must not use.
const APART: [(&str, &[&str]); 6] = [
    ("chip", &["tmcl", "param", "vm", "executor", "module"]),
    ("motion", &["tmcl", "vm", "executor", "module"]),
    ("store", &["tmcl", "vm", "executor", "module", "param"]),
    ("device", &["tmcl", "vm", "executor", "module"]),
    ("executor", &["module", "canopen"]),
    ("canopen", &["tmcl", "vm", "module"]),
];
#[test]
fn what_is_below_or_beside_the_language_does_not_know_it() {
    let mut found = BTreeSet::new();
    for (module, forbidden) in APART {
        let apart = |path: &Path| !BETWEEN_LANGUAGES.iter().any(|between| path.ends_with(between));
        for (_, source, depth) in files_of(module).into_iter().filter(|(path, ..)| apart(path)) {
            let tokens = tokens(&source);
            let used = modules_used(&tokens, depth).into_iter();
            found.extend(used.filter_map(|used| Some((module, *forbidden.iter().find(|name| **name == used)?))));
        }
    }
    assert!(found.is_empty(), "{found:?}");
}

/// The modules, and the files of `motion`, that may name what stands in the driver of a motion chip.
const AT_CHIPS: [&str; 3] = ["chip", "motion/tmc429", "motion/tmc5160"];
#[test]
fn registers_are_named_where_the_chip_is_driven() {
    let source = root().join("src");
    let apart = |path: &&PathBuf| !AT_CHIPS.iter().any(|place| path.starts_with(source.join(place)));
    let mut checked = 0;
    for path in sources(&source).iter().map(|path| path.with_extension("")).filter(|path| apart(&path)) {
        let text = fs::read_to_string(path.with_extension("rs")).unwrap();
        let wrong = named_of_motion_chips(&tokens(&text));
        assert!(wrong.is_empty(), "{}: {wrong:?} of a motion chip", path.display());
        checked += 1;
    }
    assert!(checked > 50, "{checked} files");
}

/// Lists the names that a source takes from the drivers of motion chips, `chip::tmc...`, beside the one type that is
/// the driver.
fn named_of_motion_chips<'a>(tokens: &[&'a str]) -> Vec<&'a str> {
    let mut named = Vec::new();
    for at in 0..tokens.len() {
        match &tokens[at..] {
            ["chip", ":", ":", chip, ":", ":", rest @ ..] if chip.starts_with("tmc") => {
                named.extend(first_names(rest).into_iter().filter(|name| name.to_lowercase() != **chip));
            }
            ["chip", ":", ":", rest @ ..] => {
                named.extend(first_names(rest).into_iter().filter(|name| name.starts_with("tmc")));
            }
            _ => {}
        }
    }
    named
}

/// The files of a module of the firmware: path within `src`, text, and depth of the file's own module.
fn files_of(module: &str) -> Vec<(PathBuf, String, usize)> {
    let source = root().join("src");
    let file = source.join(module).with_extension("rs");
    let folder = if file.is_file() { file } else { source.join(module) };
    let files = sources(&folder).into_iter().map(|path| {
        let text = fs::read_to_string(&path).unwrap();
        let inside = path.strip_prefix(&source).unwrap();
        let depth = inside.with_extension("").components().filter(|part| part.as_os_str() != "mod").count();
        (inside.to_owned(), text, depth)
    });
    files.collect()
}

#[test]
fn no_two_files_import_each_other() {
    let mut wrong = String::new();
    for root in roots() {
        let imports = imports::Crate::read(&root).imports();
        for circle in circles::circles(&imports) {
            wrong.push_str(&listed(&circle));
        }
    }
    assert!(wrong.is_empty(), "files import each other:\n{wrong}");
}

/// The imports of a circle, one per line.
fn listed(circle: &[(&Path, &Path, &str)]) -> String {
    let short = |path: &Path| path.strip_prefix(root()).unwrap_or(path).display().to_string();
    circle.iter().map(|(from, to, name)| format!("  {} -> {}: {name}\n", short(from), short(to))).collect()
}

/// The crates whose types are looked at. The simulated hardware is left out: a chip and a core are one state in their
/// data sheets.
const WITH_OWNERS: [(&str, &str); 2] = [("tmcm", "src/lib.rs"), ("tmcm_sim", "sim/src/lib.rs")];
/// The most files in which the methods of a type may be.
const MOST_FILES: usize = 6;
/// `cargo test --workspace --test layers own_methods -- --nocapture` prints the types with methods in several files.
#[test]
fn calls_of_own_methods_between_files_form_no_circle() {
    let (mut table, mut wrong) = (Vec::new(), String::new());
    for (name, file) in WITH_OWNERS {
        for (path, owner) in owners::owners(&root().join(file)) {
            let path = format!("{name}::{}", path.join("::"));
            let circles = circles::circles(&owner.calls);
            let circle = circles.iter().map(|circle| circles::files(circle).len()).max().unwrap_or_default();
            let files = owner.files().len();
            table.push((files, owner.methods.len(), owner.fields, circle, path.clone()));
            if circle > 0 || files > MOST_FILES {
                wrong.push_str(&format!("{path}: {circle} files in a circle, {files} with methods\n"));
                wrong.extend(circles.iter().map(|circle| listed(circle)));
            }
        }
    }
    table.sort_by(|one, other| other.cmp(one));
    println!("| type | files | methods | fields | largest circle |\n|---|---|---|---|---|");
    for (files, methods, fields, circle, path) in table.iter().filter(|(files, ..)| *files > 1) {
        println!("| `{path}` | {files} | {methods} | {fields} | {circle} |");
    }
    assert!(table.len() > 100, "{} types", table.len());
    assert!(wrong.is_empty(), "give the state an owner below the others:\n{wrong}");
}

/// Modules of the firmware that the services of CiA 301 use, besides each other.
const BELOW_CIA_301: [&str; 2] = ["can", "units"];
#[test]
fn the_services_of_cia_301_know_no_node() {
    let source = root().join("src");
    let services = source.join("canopen/cia301");
    let below = BELOW_CIA_301.map(|module| source.join(module));
    let imports = imports::Crate::read(&source.join("lib.rs")).imports();
    let of_services: Vec<_> = imports.iter().filter(|(from, _)| from.starts_with(&services)).collect();
    assert!(of_services.len() > 5, "{of_services:?}");
    for (from, to) in of_services.into_iter().flat_map(|(from, to)| to.keys().map(move |to| (from, to))) {
        let known = to.starts_with(&services) || below.iter().any(|below| to.with_extension("").starts_with(below));
        assert!(known, "{}: uses {}", from.display(), to.display());
    }
}

/// The roots of all crates of the workspace.
fn roots() -> Vec<PathBuf> {
    let mut roots = Vec::new();
    let packages =
        ["", "xtask", "hal-sim", "hal-sim/cbor-edn", "sim", "tools", "link", "server", "cli", "studio", "studio/build"];
    for package in packages.into_iter().chain(["studio/image", "tests/common", "tests/panic_free"]) {
        let package = root().join(package);
        roots.extend(["build.rs", "src/lib.rs", "src/main.rs"].map(|file| package.join(file)));
        for folder in ["src/bin", "tests", "benches"] {
            for entry in fs::read_dir(package.join(folder)).into_iter().flatten().flatten() {
                let path = entry.path();
                roots.push(if path.is_dir() { path.join("main.rs") } else { path });
            }
        }
    }
    roots.retain(|path| path.is_file() && path.extension().is_some_and(|end| end == "rs"));
    roots
}

/// Crates, each with the crates that it must not use. Virtual modules and tools are for other people's programs: they
/// bring along neither the command line nor what only Unix has.
const CRATES_APART: [(&str, &[&str]); 8] = [
    ("hal-sim", &["tmcm", "tmcm_sim", "tmcl_tools", "tmcl_link", "tmcl_server", "tmcl_cli"]),
    ("sim", &["tmcl_tools", "tmcl_link", "tmcl_server", "tmcl_cli", "clap", "rustix"]),
    ("tools", &["tmcl_link", "tmcl_server", "tmcl_cli", "clap", "rustix"]),
    ("link", &["tmcl_server", "tmcl_cli", "clap"]),
    ("server", &["tmcl_cli", "tmcl_studio"]),
    ("studio/src", &["tmcl_link", "tmcl_server", "tmcl_cli", "clap", "rustix"]),
    ("studio/image", &["tmcl_link", "tmcl_server", "tmcl_cli", "clap", "rustix"]),
    ("studio/build", &["tmcm", "tmcm_sim", "tmcl_tools", "tmcl_link", "tmcl_server", "tmcl_cli", "clap", "rustix"]),
];
#[test]
fn crates_use_only_those_below_them() {
    for (folder, forbidden) in CRATES_APART {
        let folder = root().join(folder);
        let package = if folder.ends_with("src") { folder.parent().unwrap() } else { &folder };
        let manifest = fs::read_to_string(package.join("Cargo.toml")).unwrap();
        let (_, dependencies) = manifest.split_once("[dependencies]").unwrap();
        for line in dependencies.lines() {
            let name = line.split([' ', '.', '=']).next().unwrap_or_default().replace('-', "_");
            assert!(!forbidden.contains(&name.as_str()), "{}: {line}", folder.display());
        }
        let sources = sources(&folder);
        assert!(!sources.is_empty());
        for path in sources {
            let text = fs::read_to_string(&path).unwrap();
            let used: Vec<_> = tokens(&text).into_iter().filter(|token| forbidden.contains(token)).collect();
            assert!(used.is_empty(), "{}: {used:?}", path.display());
        }
    }
}

/// A row of a table in `docs/architecture.md`: file, functions, description. `None` for any other line.
fn visit(line: &str) -> Option<(&str, Vec<&str>, &str)> {
    let [file, functions, happens] =
        line.strip_prefix("| `")?.strip_suffix(" |")?.splitn(3, " | ").collect::<Vec<_>>()[..]
    else {
        return None;
    };
    let functions = functions.split('`').skip(1).step_by(2).collect();
    Some((file.strip_suffix('`')?, functions, happens))
}

#[test]
fn the_functions_named_in_the_architecture_are_where_it_says() {
    let text = fs::read_to_string(root().join("docs/architecture.md")).unwrap();
    let ways: Vec<_> = text.split("\n### ").skip(1).collect();
    assert_eq!(ways.len(), 6);
    for way in ways {
        let mut visited = BTreeSet::new();
        for (file, functions, happens) in way.lines().filter_map(visit) {
            let source = fs::read_to_string(root().join(file)).unwrap_or_else(|error| panic!("{file}: {error}"));
            let tokens = tokens(&source);
            for function in functions {
                assert!(tokens.windows(2).any(|two| two == ["fn", function]), "{file} has no function {function}");
            }
            assert_eq!(happens.starts_with("Again"), !visited.insert(file), "{file}: {happens}");
        }
        assert!(visited.len() > 8, "{way}");
    }
}

/// Where the sources of all crates are.
const FOLDERS: [&str; 12] =
    ["src", "xtask", "hal-sim", "sim", "tools", "link", "server", "cli", "studio", "tests", "benches", "build.rs"];

#[test]
fn unsafe_is_left_to_the_board_and_the_doors_of_the_page() {
    let board = root().join("src/board");
    // This image uses `unsafe` once, to call a function that does not exist, so that code that can panic does not link.
    let unlinkable = root().join("tests/panic_free/src/main.rs");
    // What a page calls has a name without the compiler's additions, and it writes answers to where it is told.
    let doors = root().join("studio/src/doors.rs");
    for folder in FOLDERS {
        let may = |path: &Path| path.starts_with(&board) || path == unlinkable || path == doors;
        for path in sources(&root().join(folder)).iter().filter(|path| !may(path)) {
            assert!(!tokens(&fs::read_to_string(path).unwrap()).contains(&"unsafe"), "{}", path.display());
        }
    }
}

/// A checkout may be moved or copied with all that is built in it: what is there then uses that checkout, and not the
/// one where it was built.
#[test]
fn nothing_knows_the_folder_in_which_it_was_compiled() {
    let folders = ["MANIFEST_DIR", "TARGET_TMPDIR", "BIN_EXE_"].map(|name| format!("env!(\"CARGO_{name}"));
    let mut checked = 0;
    for folder in FOLDERS {
        for path in sources(&root().join(folder)) {
            let text = fs::read_to_string(&path).unwrap();
            assert!(!folders.iter().any(|name| text.contains(name)), "{}", path.display());
            checked += 1;
        }
    }
    assert!(checked > 400, "{checked} files");
}
