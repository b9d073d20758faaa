//! The example programs as links of the page, in `docs/studio.md`: each does what the command in the comments of the
//! program does. `UPDATE_DOCS=1` in the environment writes them anew.

use std::fs;
use std::path::{Path, PathBuf};

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use hal_sim::control::time;
use tmcl_tools::asm::{Assembly, assemble_file};
use tmcl_tools::sources::Texts;

use super::tests::played;
use super::*;

/// The page of the documentation that has the links, and what stands before and behind them there.
const PAGE: &str = "docs/studio.md";
const BEGIN: &str = "<!-- links of the examples -->\n";
const END: &str = "<!-- end of the links -->\n";
/// How long an example is followed whose comments do not say it.
const USUAL: Nanos = 10 * SECOND;
/// When the program is loaded, and how much time a command of that takes at most.
const LOADED: Nanos = 100 * MILLISECOND;
const EACH: Nanos = 10 * MILLISECOND;
/// Most characters of a link.
const MOST: usize = 8000;

fn workspace() -> PathBuf {
    xtask::workspace().unwrap()
}

/// The words of a command line; those with spaces stand between quotation marks.
fn words(line: &str) -> Vec<String> {
    let parts = line.split('"').enumerate();
    parts
        .flat_map(|(number, part)| if number % 2 == 1 { vec![part] } else { part.split_whitespace().collect() })
        .map(String::from)
        .collect()
}

/// The command in the comments of an example, without its first words. Further lines of it begin with an option.
fn command(text: &str, name: &str) -> Option<Vec<String>> {
    let begin = format!("tmcl run examples/{name} ");
    let mut comments = text.lines().map_while(|line| line.strip_prefix("//")).map(str::trim);
    let first = comments.find_map(|line| line.strip_prefix(&begin))?;
    let more = comments.take_while(|line| line.starts_with("--"));
    Some(std::iter::once(first).chain(more).flat_map(words).collect())
}

/// The example in a file.
fn example(name: &str) -> Session {
    let text = fs::read_to_string(workspace().join("examples").join(name)).unwrap();
    let words = command(&text, name).unwrap_or_else(|| panic!("{name} has no command"));
    let of = |option: &str| -> Vec<&String> {
        words.windows(2).filter(|pair| pair[0] == option).map(|pair| &pair[1]).collect()
    };
    let product = of("--product").first().map_or("1140", |product| product.as_str()).to_owned();
    let world = of("--world").first().map(|path| fs::read_to_string(workspace().join(path)).unwrap());
    let until = of("--until").first().map_or(USUAL, |until| time::span(until).unwrap());
    let known = product::named(&product).unwrap();
    let texts = Texts([(PathBuf::from(name), text.clone())].into());
    let Assembly { commands, .. } = assemble_file(&texts, Path::new(name), Some(known)).result.unwrap();
    let load = ["131, 0, 0, 0", "132, 0, 0, 0"].map(String::from).into_iter();
    let load = load.chain(commands.iter().map(ToString::to_string)).chain([String::from("133, 0, 0, 0")]);
    let mut deeds: Vec<(Nanos, String)> =
        (0..).zip(load).map(|(number, what)| (LOADED + number * EACH, what)).collect();
    // The times of the command count from the start of the program.
    let started = deeds.last().map_or(LOADED, |(at, _)| *at) + EACH;
    deeds.push((started, "129, 0, 0, 0".into()));
    for later in of("--at") {
        let (at, what) = later.split_once(": ").unwrap();
        deeds.push((started + time::span(at).unwrap(), what.into()));
    }
    deeds.sort_by_key(|(at, _)| *at);
    let axes = known.spec().axes;
    Session {
        session: VERSION,
        title: format!("The example {}", name.trim_end_matches(".tmc")),
        made: None,
        start: Start { product, world, eeprom: None },
        texts: vec![NamedText { name: name.into(), text }],
        curves: if axes == 1 {
            vec!["GAP 1, 0".into(), "GAP 3, 0".into()]
        } else {
            (0..axes.min(3)).map(|axis| format!("GAP 1, {axis}")).collect()
        },
        done: deeds.iter().map(|(at, what)| format!("{} {what}", at / MICROSECOND)).collect(),
        until: (started + until) / MICROSECOND,
    }
}

/// The text behind the address of the page, as `session-link.js` packs it.
fn link(session: &Session) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
    let packed = miniz_oxide::deflate::compress_to_vec(&serde_json::to_vec(session).unwrap(), 10);
    let letters = packed.chunks(3).flat_map(|bytes| {
        let bits = bytes.iter().enumerate().fold(0, |bits, (at, byte)| bits | u32::from(*byte) << (16 - 8 * at));
        (0..=bytes.len()).map(move |at| char::from(LETTERS[(bits >> (18 - 6 * at) & 63) as usize]))
    });
    letters.fold("#session=".into(), |link, letter| link + &letter.to_string())
}

#[test]
fn the_links_of_the_examples_are_those_of_the_documentation() {
    let mut names: Vec<String> = fs::read_dir(workspace().join("examples"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.ends_with(".tmc"))
        .collect();
    names.sort();
    let mut lines = vec![String::new()];
    for name in names {
        let session = example(&name);
        session.check().unwrap_or_else(|why| panic!("{name}: {why}"));
        let link = link(&session);
        assert!(link.len() <= MOST, "{name} has {} characters", link.len());
        let short = name.trim_end_matches(".tmc");
        lines.push(format!("[{short}](../examples/{name})\n\n    {link}\n"));
    }
    let path = workspace().join(PAGE);
    let page = fs::read_to_string(&path).unwrap();
    let (before, rest) = page.split_once(BEGIN).unwrap();
    let (_, behind) = rest.split_once(END).unwrap();
    let wanted = format!("{before}{BEGIN}{}\n{END}{behind}", lines.join("\n"));
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        fs::write(path, &wanted).unwrap();
    }
    assert!(
        fs::read_to_string(workspace().join(PAGE)).unwrap() == wanted,
        "{PAGE} is stale: UPDATE_DOCS=1 cargo test -p tmcl-studio links_of"
    );
}

/// The motor does turn, and not because of the loading alone.
#[test]
fn an_example_moves_its_motors() {
    for (name, curve) in [("there_and_back.tmc", 0), ("homing_axes.tmc", 2), ("jog.tmc", 0), ("six_point_ramp.tmc", 0)]
    {
        let rows = played(&example(name));
        let first = rows[0].values[curve];
        assert!(rows.iter().any(|row| row.values[curve] != first), "{name}");
    }
}
