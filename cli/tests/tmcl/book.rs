//! README and the chapters of the book in `docs/` do not lie: what they show is done ([`super::page`]), and where they
//! lead there is something.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Component, Path, PathBuf};

use super::page::{Page, root};

const README: Page = Page {
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\" \"SAP 4, 0, 3000\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 206, 0\"",
    ],
    ..Page::plain("README.md")
};

const TOUR: Page = Page {
    not_run: &[
        ("cargo fw", "builds the flash image, as this test does by itself"),
        ("RANDOM_INPUTS=", "runs tests, for half a minute"),
    ],
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\" \"SAP 4, 0, 3000\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\" \"GAP 206, 0\"",
        // Reading parameter 207, which follows, clears it: so it is read once.
        "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\"",
    ],
    varies: &[
        (
            "{\"ok\":true,\"time_us\":#,\"power\":true,\"position\":#,\"velocity\":0,\"rotor\":#, ...",
            "when the load came",
        ),
        ("tmcl sim: # info: power on", "how long the image takes"),
        ("tmcl sim: # info: module runs at address 1", "how long the image takes"),
        ("tmcl sim: # info: RS485 at 9600 bit/s", "how long the image takes"),
    ],
    ..Page::plain("docs/tour.md")
};

const PROGRAMS: Page = Page {
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 \"GGP 10, 2\" \"GGP 128, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"GGP 128, 0\"",
    ],
    varies: &[("position # speed # int load # switches - driver - errors -", "where the program is")],
    mended: Some(["stage.tmc", "JA Lop", "JA Loop", "unknown name 'Lop'"]),
    ..Page::plain("docs/programs.md")
};

const AXES: Page = Page {
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 \"RFS STATUS, 0\" \"RFS STATUS, 1\" \"RFS STATUS, 2\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 1, 1\" \"GAP 1, 2\"",
        "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\"",
    ],
    ..Page::plain("docs/axes.md")
};

const TOOLS: Page = Page {
    awaited: &[
        "tmcl send tcp:127.0.0.1:4140 --value \"GAP APActualSpeed, 0\"",
        "tmcl send tcp:127.0.0.1:4140 \"RFS STATUS, 0\"",
    ],
    varies: &[("position # speed 1678 int load # switches - driver - errors -", "how long the motor has turned")],
    mended: Some(["count.tmc", "COMP Turnz", "COMP Turns", "unknown name 'Turnz'"]),
    ..Page::plain("docs/tools.md")
};

const HOST_SOFTWARE: Page = Page::plain("docs/host-software.md");
const CONTROL: Page = Page::plain("docs/control.md");
const CI: Page = Page::plain("docs/ci.md");

/// All pages whose commands are run here. Those of `docs/canopen.md` are run by python-canopen's own test,
/// `tests/clients/canopen_page.py`.
const PAGES: [&Page; 8] = [&README, &TOUR, &HOST_SOFTWARE, &PROGRAMS, &AXES, &TOOLS, &CONTROL, &CI];
const ELSEWHERE: [&str; 1] = ["docs/canopen.md"];

#[test]
fn what_readme_shows_happens() {
    README.check();
}

#[test]
fn what_the_tour_shows_happens() {
    TOUR.check();
}

#[test]
fn what_the_page_of_host_software_shows_happens() {
    HOST_SOFTWARE.check();
}

#[test]
fn what_the_page_of_programs_shows_happens() {
    PROGRAMS.check();
}

#[test]
fn what_the_page_of_several_axes_shows_happens() {
    AXES.check();
}

#[test]
fn what_the_page_of_the_tools_shows_happens() {
    let folder = TOOLS.check();
    let [is, was] = [folder.path().join("stall_homing.svg"), root().join("docs/stall_homing.svg")].map(fs::read);
    assert!(is.unwrap() == was.unwrap(), "docs/stall_homing.svg is not what the command of docs/tools.md draws");
}

#[test]
fn what_the_page_of_the_control_port_shows_happens() {
    CONTROL.check();
}

#[test]
fn what_the_page_of_ci_shows_happens() {
    CI.check();
}

#[test]
fn no_chapter_shows_what_nobody_runs() {
    let shown: BTreeSet<String> = pages()
        .into_iter()
        .filter(|page| text(page).lines().any(|line| line.starts_with("    $ ") || line.starts_with("$ ")))
        .collect();
    let run: BTreeSet<String> = PAGES.iter().map(|page| page.name).chain(ELSEWHERE).map(String::from).collect();
    assert_eq!(shown, run);
}

/// The book has every page, and README stays one that is read in two minutes.
#[test]
fn the_book_is_whole_and_readme_short() {
    let written: BTreeSet<String> = fs::read_dir(root().join("docs"))
        .unwrap()
        .map(|entry| format!("docs/{}", entry.unwrap().file_name().into_string().unwrap()))
        .filter(|name| name.ends_with(".md") && name != SUMMARY)
        .collect();
    let listed: Vec<String> = pages().into_iter().filter(|page| page.starts_with("docs/")).collect();
    assert_eq!(listed.iter().cloned().collect::<BTreeSet<_>>(), written, "{SUMMARY} has not the pages that are there");
    assert_eq!(listed.len(), written.len(), "{SUMMARY} has a page twice");
    let lines = text("README.md").lines().count();
    assert!(lines <= 150, "README has {lines} lines, 150 are what one reads in two minutes");
}

/// Each link leads to a file, and to a heading of it. Pages of the book lead to no page outside of it, which a reader
/// of the book does not have. Files that they lead to are copied beside it by `scripts/pages`.
#[test]
fn every_link_leads_somewhere() {
    let others = [SUMMARY, "CONTRIBUTING.md", "CHANGELOG.md", "examples/README.md", "python/README.md"];
    let mut wrong = Vec::new();
    for page in pages().into_iter().chain(others.map(String::from)) {
        for target in links(&text(&page)) {
            if target.starts_with("https://") || target.starts_with("http://") {
                continue;
            }
            let (file, heading) = target.split_once('#').map_or((&*target, None), |(file, id)| (file, Some(id)));
            let file = if file.is_empty() { PathBuf::from(&page) } else { beside(&page, file) };
            let leaves = page.starts_with("docs/") && !file.starts_with("docs");
            let is_there = root().join(&file).exists()
                && !(leaves && (file.extension().is_none_or(|end| end == "md")))
                && heading.is_none_or(|heading| headings(&text(file.to_str().unwrap())).contains(heading));
            if !is_there {
                wrong.push(format!("{page}: {target}"));
            }
        }
    }
    assert!(wrong.is_empty(), "lead nowhere:\n{}", wrong.join("\n"));
}

#[test]
fn links_and_headings_are_found() {
    let text =
        "[a](b.md#c) and ![d](e.svg), `[f](g)`\n\n    [h](i)\n\n```\n[j](k)\n```\n## One `two`, 3: four\n## One\n";
    assert_eq!(links(text), ["b.md#c", "e.svg"]);
    assert_eq!(headings(text).into_iter().collect::<Vec<_>>(), ["one", "one-two-3-four"]);
    assert_eq!(beside("docs/a.md", "../b/c.tmc"), Path::new("b/c.tmc"));
}

/// `cargo sim` and `cargo tmcl` are what is run for them here.
#[test]
fn its_short_commands_are_those_of_the_program() {
    let folder = root().join(".cargo");
    let aliases = fs::read_to_string(folder.join("config.toml")).unwrap();
    for (name, end) in [("sim", "-- sim\""), ("tmcl", "--\"")] {
        let alias = aliases.lines().find(|line| line.starts_with(&format!("{name} = \"run "))).unwrap();
        assert!(alias.contains(" -p tmcl-cli --bin tmcl ") && alias.ends_with(end), "{alias}");
    }
}

/// The chapters in their order, as mdBook reads them.
const SUMMARY: &str = "docs/SUMMARY.md";

fn text(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap()
}

/// README, and the pages of the book.
fn pages() -> Vec<String> {
    let chapters = links(&text(SUMMARY)).into_iter().map(|chapter| format!("docs/{chapter}"));
    ["README.md".to_owned()].into_iter().chain(chapters).collect()
}

/// Where links and pictures of a page lead, without those in code.
fn links(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    for line in prose(page) {
        // Every second piece is code.
        let text: String = line.split('`').step_by(2).collect();
        let mut rest = &*text;
        while let Some((_, from)) = rest.split_once("](") {
            let (target, after) = from.split_once(')').unwrap_or((from, ""));
            found.push(target.to_owned());
            rest = after;
        }
    }
    found
}

/// The names of a page's headings behind the `#` of a link: small letters, digits and hyphens.
fn headings(page: &str) -> BTreeSet<String> {
    let titles = prose(page).filter(|line| line.starts_with('#')).map(|line| line.trim_start_matches('#').trim());
    let kept = |c: char| match c {
        ' ' => Some('-'),
        _ if c.is_alphanumeric() || c == '-' || c == '_' => Some(c.to_ascii_lowercase()),
        _ => None,
    };
    titles.map(|title| title.chars().filter_map(kept).collect()).collect()
}

/// Lines of a page that are neither indented nor in a block of code. Lists within lists are indented, but not by four.
fn prose(page: &str) -> impl Iterator<Item = &str> {
    let mut is_code = false;
    page.lines().filter(move |line| {
        is_code ^= line.starts_with("```");
        !is_code && (!line.starts_with("    ") || line.trim_start().starts_with("- "))
    })
}

/// A path that a page writes, as it is from the root.
fn beside(page: &str, target: &str) -> PathBuf {
    let mut path = Path::new(page).parent().unwrap().to_owned();
    for part in Path::new(target).components() {
        match part {
            Component::ParentDir => _ = path.pop(),
            part => path.push(part),
        }
    }
    path
}
