//! Nothing in the core can panic: an image of it links although its panic handler calls what does not exist
//! (`tests/panic_free`). In the flash image the libraries for the microcontroller can; `tests/panic_free/known.txt`
//! is the list of these places, and it does not grow.

mod callers;
mod places;

use common::image;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::iter;
use std::path::Path;

use callers::{callers, is_there_to_panic};
use places::{places, texts};

/// The image of the core, and what it lacks.
const CORE: &str = "panic-free";
const MISSING: &str = "undefined symbol: a_panic_is_possible";
/// Lets it link all the same.
const ANYTHING: &str = "-Clink-arg=--defsym=a_panic_is_possible=0";

/// Builds the image of the core. If it does not link: the places that can panic, and the calls that lead to a panic.
fn core(features: &[&str]) -> Result<(), [Vec<String>; 2]> {
    let arguments = [&["--package", CORE], features].concat();
    let Err(messages) = image::build(CORE, &arguments) else { return Ok(()) };
    assert!(messages.contains(MISSING), "the core does not build\n{messages}");
    let built = image::build(CORE, &[&arguments, &["--", ANYTHING][..]].concat());
    let contents = fs::read(built.unwrap_or_else(|error| panic!("{error}")).path).unwrap();
    let image = object::File::parse(&*contents).unwrap();
    let calls = callers(&image, |name| ["tmcm::", "panic_free::"].iter().any(|ours| name.contains(ours)));
    Err([places(&image).iter().map(ToString::to_string).collect(), calls.into_iter().collect()])
}

/// Both in one test: the two images have the same name.
#[test]
fn nothing_in_the_core_can_panic_and_a_panic_would_be_found() {
    if let Err([places, calls]) = core(&[]) {
        panic!("the core can panic\nat {}\nin {}", places.join("\nat "), calls.join("\nin "));
    }
    let [places, calls] = core(&["--features", "deliberate"]).unwrap_err();
    assert!(matches!(&places[..], [place] if place.starts_with("tests/panic_free/src/calls.rs:")), "{places:?}");
    let way = "panic_free::calls::all > core::panicking::panic_bounds_check > core::panicking::panic_fmt";
    assert!(calls.iter().all(|call| call.starts_with(way)) && calls.len() == 1, "{calls:?}");
}

/// Every public function of the core is called in its image, by its name at least.
#[test]
fn everything_public_is_called() {
    let root = xtask::workspace().unwrap();
    let files = fs::read_dir(root.join("tests/panic_free/src/calls")).unwrap().map(|entry| entry.unwrap().path());
    let files = files.chain([root.join("tests/panic_free/src/calls.rs")]);
    let calls: String = files.map(|path| fs::read_to_string(path).unwrap()).collect();
    let word = |c: char| c.is_alphanumeric() || c == '_';
    let called: Vec<_> = calls.split(|c| !word(c)).collect();
    let mut open = vec![root.join("src")];
    let (mut functions, mut missing) = (0, Vec::new());
    while let Some(path) = open.pop() {
        if path.ends_with("board") || path.ends_with("bin") {
            continue;
        }
        if path.is_dir() {
            open.extend(fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()));
            continue;
        }
        let text = fs::read_to_string(&path).unwrap();
        for (before, line) in iter::once("").chain(text.lines()).zip(text.lines()) {
            // What a computer alone has may panic.
            if before.trim() == "#[cfg(not(target_os = \"none\"))]" {
                continue;
            }
            let Some(rest) = line.trim_start().strip_prefix("pub ") else { continue };
            let Some(name) = rest.trim_start_matches("const ").strip_prefix("fn ") else { continue };
            let name = name.split(|c| !word(c)).next().unwrap();
            if called.contains(&name) {
                functions += 1;
            } else {
                missing.push(format!("{}: {name}", path.display()));
            }
        }
    }
    assert!(missing.is_empty(), "nobody looks whether these can panic: {missing:#?}");
    assert!(functions > 100, "{functions} functions");
}

/// The places in an image that can panic, by their files, and the texts of defmt's panics.
fn left_in(path: &Path) -> (BTreeMap<String, usize>, BTreeSet<String>) {
    let contents = fs::read(path).unwrap();
    let image = object::File::parse(&*contents).unwrap();
    let mut found = BTreeMap::new();
    for place in places(&image) {
        println!("{place}");
        *found.entry(place.file).or_insert(0) += 1;
    }
    let calls = callers(&image, |name| !is_there_to_panic(name));
    for call in &calls {
        println!("{call}");
    }
    assert!(calls.len() > 50, "{calls:?}");
    (found, texts(&image))
}

/// The lines of the list: a file and how many of its places can panic, or the text of one of defmt's panics.
fn known() -> Vec<String> {
    let list = fs::read_to_string(xtask::workspace().unwrap().join("tests/panic_free/known.txt")).unwrap();
    list.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).map(Into::into).collect()
}

#[test]
fn what_can_panic_in_the_image_is_known() {
    let (found, texts) = left_in(&image::image());
    let found: Vec<_> = found.iter().map(|(file, places)| format!("{file} {places}")).chain(texts).collect();
    let known = known();
    let new: Vec<_> = found.iter().filter(|line| !known.contains(line)).collect();
    let gone: Vec<_> = known.iter().filter(|line| !found.contains(line)).collect();
    assert!(new.is_empty() && gone.is_empty(), "known.txt: new are {new:#?}, gone are {gone:#?}");
    assert!(found.len() > 50, "{found:?}");
}

/// The images of the CANopen firmware and of the sisters have no place that the first one lacks; some of that one's
/// they do without.
#[test]
fn nothing_more_can_panic_in_the_other_images() {
    let known = known();
    for path in [image::canopen(), image::six_axes(), image::three_axes()] {
        let (found, texts) = left_in(&path);
        let most = |file: &str| -> usize {
            // Each has a file of its own with its board.
            let others = ["tmcm6110.rs", "tmcm3212.rs"];
            let file = others.iter().fold(file.to_owned(), |file, other| file.replace(other, "tmcm1140.rs"));
            let counts = known.iter().filter_map(|line| line.strip_prefix(&file)?.strip_prefix(' ')?.parse().ok());
            counts.max().unwrap_or_default()
        };
        let more: Vec<_> = found.iter().filter(|(file, places)| **places > most(file)).collect();
        let new: Vec<_> = texts.iter().filter(|text| !known.contains(text)).collect();
        assert!(more.is_empty() && new.is_empty(), "{more:#?}, {new:#?}");
        assert!(found.len() > 20, "{found:?}");
    }
}
