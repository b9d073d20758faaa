//! Pages of the documentation do not lie: what they show is done here in its order, by the real program on real ports,
//! and comes out as they show it.
//!
//! A page has its commands in blocks that are indented by four spaces, behind `$ `, and what they print below; `...`
//! stands for any lines. Files that it has the reader write stand in a block below a line with "Write `NAME`".

use std::collections::BTreeMap;
use std::env;
use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

use super::harness::{PATIENCE, command, tmcl, tmcl_path};
use common::image as build;

/// The host of a port on a page; here each port is a free one.
const HOST: &str = "127.0.0.1";
/// Where a page has its serial ports; here that is a folder of its own.
const PORTS: &str = "/tmp/";
/// The text with which interactive commands ask where somebody sees it; the line behind it is typed.
const PROMPT: &str = "(tmcl) ";
/// Any number of lines, or the rest of one.
const REST: &str = "...";
/// Other programs of pages, which every computer has.
const OTHERS: [&str; 5] = ["bash", "cat", "cmp", "cp", "tail"];

/// A page, and what is special about its commands.
pub(crate) struct Page {
    /// The page's name in the repository.
    pub(crate) name: &'static str,
    /// Commands that are not run here, by how they begin, and why.
    pub(crate) not_run: &'static [(&'static str, &'static str)],
    /// Commands that a reader types some seconds later than this test. They only ask, and are repeated until they tell
    /// what the page shows.
    pub(crate) awaited: &'static [&'static str],
    /// Lines with numbers that nobody knows beforehand, where `#` stands for one, and why.
    pub(crate) varies: &'static [(&'static str, &'static str)],
    /// The mistake that the page has its reader mend: a file, what is wrong in it, what is right, and what tells of the
    /// mistake.
    pub(crate) mended: Option<[&'static str; 4]>,
}

impl Page {
    /// A page without anything special.
    pub(crate) const fn plain(name: &'static str) -> Self {
        Page { name, not_run: &[], awaited: &[], varies: &[], mended: None }
    }

    fn text(&self) -> String {
        fs::read_to_string(root().join(self.name)).unwrap()
    }

    /// Does what the page says, and fails where something else comes out. Gives the folder with what has been written.
    pub(crate) fn check(&self) -> tempfile::TempDir {
        let text = self.text();
        let mut reader = Reader::at_home();
        let mut commands = Vec::new();
        for item in items(&text) {
            let Shown { line, command, output } = match item {
                Item::File { name, text } => {
                    fs::write(reader.path(&name), text).unwrap();
                    continue;
                }
                Item::Command(shown) => shown,
            };
            let told = match words(&command) {
                _ if self.not_run.iter().any(|(start, _)| command.starts_with(start)) => None,
                words if words.get(1).is_some_and(|word| word == "sim") => {
                    Some(reader.start(self, &words[2..], &output))
                }
                words => Some(reader.carry_out(self, &words, &output, self.awaited.contains(&&*command))),
            };
            if let Some(told) = told {
                let said = told.iter().map(|line| format!("    {line}\n")).collect::<String>();
                let name = self.name;
                assert!(self.matches(&output, &told), "{name}:{line}: $ {command}\nin truth says\n{said}");
                if let Some([file, wrong, right, sign]) = self.mended
                    && told.iter().any(|line| line.contains(sign))
                {
                    let text = fs::read_to_string(reader.path(file)).unwrap();
                    fs::write(reader.path(file), text.replace(wrong, right)).unwrap();
                }
            }
            commands.push((command, output));
        }
        assert!(!commands.is_empty(), "{} shows no command", self.name);
        let is_shown = |start: &str| commands.iter().any(|(command, _)| command.starts_with(start));
        assert!(
            self.not_run.iter().all(|(start, _)| is_shown(start)) && self.awaited.iter().all(|start| is_shown(start))
        );
        let lines = |pattern| commands.iter().flat_map(|(_, output)| output).any(|line| fits(pattern, line));
        assert!(self.varies.iter().all(|(pattern, _)| lines(pattern)), "something varies that is not shown");
        reader.folder
    }

    /// Whether lines are those shown.
    fn matches(&self, shown: &[String], said: &[String]) -> bool {
        match (shown, said) {
            ([], said) => said.is_empty(),
            ([rest, shown @ ..], said) if rest == REST => {
                (0..=said.len()).any(|skipped| self.matches(shown, &said[skipped..]))
            }
            ([typed, shown @ ..], said) if typed.starts_with(PROMPT) => self.matches(shown, said),
            ([expected, shown @ ..], [line, said @ ..]) => {
                let pattern = self.varies.iter().find(|(pattern, _)| fits(pattern, expected));
                pattern.map_or(expected == line, |(pattern, _)| fits(pattern, line)) && self.matches(shown, said)
            }
            _ => false,
        }
    }
}

/// The comparison is worth something only if it finds what is wrong.
#[test]
fn what_is_shown_in_vain_would_be_found() {
    const POWER: &str = "tmcl sim: # info: power on";
    let page = Page { varies: &[(POWER, "a time")], ..Page::plain("") };
    let alike = |shown: &[&str], said: &[&str]| {
        let [shown, said] = [shown, said].map(|lines| lines.iter().map(|line| line.to_string()).collect::<Vec<_>>());
        page.matches(&shown, &said)
    };
    assert!(alike(&["a", "b"], &["a", "b"]) && alike(&["(tmcl) a", "b"], &["b"]));
    assert!(alike(&["a", "...", "c", "..."], &["a", "b", "b", "c"]) && alike(&["...", "c"], &["c"]));
    assert!(!alike(&["a"], &["a", "b"]) && !alike(&["a", "b"], &["a"]) && !alike(&["a", "...", "c"], &["a", "b"]));
    assert!(!alike(&["GAP 5, 0: 1000"], &["GAP 5, 0: 1001"]) && !alike(&["a  b"], &["a b"]));
    let power = ["tmcl sim: 0.1 info: power on"];
    assert!(alike(&power, &["tmcl sim: 0.23 info: power on"]));
    for other in ["tmcl sim:  info: power on", "tmcl sim: 0.1 info: power off", "tmcl sim: 0.1 info: power on again"] {
        assert!(!alike(&power, &[other]), "{other}");
    }
    let text = "Text.\n\n    $ one\n    said\n\n    $ two \"2 3\"\n\nWrite `a.tmc`, so:\n\n    a\n\n      b\n\nText.\n\n    no\n";
    let told = items(text).map(|item| match item {
        Item::File { name, text } => format!("{name}: {text:?}"),
        Item::Command(Shown { line, command, output }) => format!("{line}: {:?} {}", words(&command), output.len()),
    });
    assert_eq!(told.collect::<Vec<_>>(), ["3: [\"one\"] 1", "6: [\"two\", \"2 3\"] 0", "a.tmc: \"a\\n\\n  b\\n\""]);
}

/// A command of a page, in which line it stands, and what follows it there.
struct Shown {
    line: usize,
    command: String,
    output: Vec<String>,
}

/// An item of a page that its reader follows.
enum Item {
    Command(Shown),
    File { name: String, text: String },
}

/// All that a page has its reader do. What follows a command ends with its block.
fn items(text: &str) -> impl Iterator<Item = Item> {
    let lines: Vec<&str> = text.lines().collect();
    let mut all: Vec<Item> = Vec::new();
    let mut file: Option<String> = None;
    let mut is_open = false;
    for (number, line) in lines.iter().enumerate() {
        match (line.strip_prefix("    "), &file, all.last_mut()) {
            (Some(line), Some(name), _) => {
                let block = lines[number..]
                    .iter()
                    .map_while(|line| if line.is_empty() { Some(*line) } else { line.strip_prefix("    ") });
                let text = block.collect::<Vec<_>>().join("\n");
                debug_assert!(text.starts_with(line));
                all.push(Item::File { name: name.clone(), text: format!("{}\n", text.trim_end()) });
                file = None;
                is_open = false;
            }
            (Some(line), None, _) if line.starts_with("$ ") => {
                all.push(Item::Command(Shown { line: number + 1, command: line[2..].into(), output: Vec::new() }));
                is_open = true;
            }
            (Some(line), None, Some(Item::Command(last))) if is_open => last.output.push(line.into()),
            _ => is_open = is_open && line.is_empty(),
        }
        if let Some((_, rest)) = line.split_once("Write `") {
            file = rest.split_once('`').map(|(name, _)| name.to_owned());
        }
    }
    all.into_iter()
}

/// Where programs are found, this one among them.
fn with_tmcl() -> OsString {
    let own = Path::new(tmcl_path()).parent().unwrap().to_owned();
    let path = env::var_os("PATH").unwrap();
    env::join_paths([own].into_iter().chain(env::split_paths(&path))).unwrap()
}

/// The folder of the repository.
pub(crate) fn root() -> PathBuf {
    xtask::workspace().unwrap()
}

/// The words of a command line; quotes keep them together.
pub(crate) fn words(command: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (number, piece) in command.split('"').enumerate() {
        if number % 2 == 1 {
            words.push(piece.into());
        } else {
            words.extend(piece.split_whitespace().map(String::from));
        }
    }
    words
}

/// Puts numbers in the places of others, all at once: one that is put may begin like one that is to be replaced.
fn with_numbers(text: &str, others: &BTreeMap<String, String>) -> String {
    let is_digit = |c: char| c.is_ascii_digit();
    let (mut told, mut rest) = (String::new(), text);
    while let Some(start) = rest.find(is_digit) {
        let (before, from) = rest.split_at(start);
        let (number, after) = from.split_at(from.find(|c| !is_digit(c)).unwrap_or(from.len()));
        told.extend([before, others.get(number).map_or(number, String::as_str)]);
        rest = after;
    }
    told + rest
}

#[test]
fn free_ports_may_look_like_those_of_a_page() {
    let ports = [("4140", "41411"), ("4141", "34140")].map(|(shown, real)| (shown.to_owned(), real.to_owned()));
    let real = with_numbers("tcp:127.0.0.1:4140 4141, 4140", &ports.into());
    assert_eq!(real, "tcp:127.0.0.1:41411 34140, 41411");
}

/// Whether a line is like a pattern: `#` stands for a number, `...` at the end for the rest, a space for any.
fn fits(pattern: &str, line: &str) -> bool {
    let line = line.split_whitespace().collect::<Vec<_>>().join(" ");
    let (pattern, is_all) = pattern.strip_suffix(REST).map_or((pattern, true), |pattern| (pattern.trim_end(), false));
    let mut pieces = pattern.split('#');
    let Some(mut rest) = pieces.next().and_then(|first| line.strip_prefix(first)) else { return false };
    for piece in pieces {
        let number = rest.strip_prefix('-').unwrap_or(rest);
        let after = number.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.');
        let Some(behind) = after.strip_prefix(piece).filter(|_| after.len() < number.len()) else { return false };
        rest = behind;
    }
    !is_all || rest.is_empty()
}

/// Somebody who does what a page says, in a folder of their own.
struct Reader {
    folder: tempfile::TempDir,
    /// The ports of the page, and those that stand for them.
    ports: BTreeMap<String, String>,
    sim: Option<Sim>,
}

impl Reader {
    /// Where the repository is, as far as commands of pages read from it.
    fn at_home() -> Self {
        let reader = Reader { folder: tempfile::tempdir().unwrap(), ports: BTreeMap::new(), sim: None };
        let root = root();
        for name in ["examples", "hal-sim"] {
            symlink(root.join(name), reader.path(name)).unwrap();
        }
        let image = reader.path("target/thumbv7em-none-eabi/release/tmcm1140");
        fs::create_dir_all(image.parent().unwrap()).unwrap();
        symlink(build::image().canonicalize().unwrap(), image).unwrap();
        reader
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    /// A word of the page as it is used here.
    fn real(&self, word: &str) -> String {
        let word = word.replace(PORTS, &format!("{}/", self.folder.path().display()));
        with_numbers(&word, &self.ports)
    }

    /// The lines that are said here, as the page has them.
    fn shown(&self, text: &str) -> Vec<String> {
        let text = text.replace(&format!("{}/", self.folder.path().display()), PORTS);
        let text = self
            .ports
            .iter()
            .fold(text, |text, (shown, real)| text.replace(&format!("{HOST}:{real}"), &format!("{HOST}:{shown}")));
        text.lines().map(String::from).collect()
    }

    /// Starts a module, in place of the one that runs. Gives what it says, as far as the page shows any of it.
    fn start(&mut self, page: &Page, options: &[String], output: &[String]) -> Vec<String> {
        self.sim = None;
        self.ports.clear();
        let free: Vec<String> = options
            .iter()
            .map(|option| if option.starts_with(HOST) { format!("{HOST}:0") } else { self.real(option) })
            .collect();
        let messages = self.path("messages");
        let sim = self.sim.insert(Sim::start(self.folder.path(), &free, &messages));
        for link in options.windows(2).filter(|link| link[1].starts_with(HOST)) {
            let address = sim.said.iter().find_map(|line| line.strip_prefix(&format!("{}: ", &link[0][2..]))).unwrap();
            let port = |address: &str| address.rsplit_once(':').unwrap().1.to_owned();
            self.ports.insert(port(&link[1]), port(address));
        }
        let said = self.shown(&self.sim.as_ref().unwrap().said.join("\n"));
        // A module of which nothing is shown.
        let Some(ready) = output.iter().position(|line| line == "ready") else { return output.to_vec() };
        let end = Instant::now() + PATIENCE;
        loop {
            let messages = self.shown(&fs::read_to_string(&messages).unwrap());
            if page.matches(&output[ready + 1..], &messages) || Instant::now() > end {
                return [said, messages].concat();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Carries out any other command and gives what it says; again and again, if it is one to wait with.
    fn carry_out(&self, page: &Page, words: &[String], output: &[String], waits: bool) -> Vec<String> {
        let end = Instant::now() + PATIENCE;
        loop {
            let told = self.shown(&self.run(page, words, output));
            if !waits || page.matches(output, &told) || Instant::now() > end {
                return told;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Runs a program, types what the page shows to be typed, and gives what it says.
    fn run(&self, page: &Page, words: &[String], output: &[String]) -> String {
        let words: Vec<String> = words.iter().map(|word| self.real(word)).collect();
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let (mut said, both) = std::io::pipe().unwrap();
        let mut command = match words[..] {
            ["tmcl", ref words @ ..] => tmcl(words),
            [program, ref words @ ..] if OTHERS.contains(&program) => {
                let mut command = command(program);
                command.args(words).env("PATH", with_tmcl());
                command
            }
            _ => panic!("{} has a command that this test does not know: {words:?}", page.name),
        };
        command.current_dir(self.folder.path()).stdin(Stdio::piped());
        let mut child = command.stdout(both.try_clone().unwrap()).stderr(both).spawn().unwrap();
        drop(command);
        for line in output.iter().filter_map(|line| line.strip_prefix(PROMPT)) {
            writeln!(child.stdin.as_ref().unwrap(), "{line}").unwrap();
        }
        drop(child.stdin.take());
        let mut text = String::new();
        said.read_to_string(&mut text).unwrap();
        child.wait().unwrap();
        text
    }
}

/// A running module.
struct Sim {
    child: Child,
    /// The lines that the module printed until it was ready.
    said: Vec<String>,
}

impl Sim {
    fn start(folder: &Path, options: &[String], messages: &Path) -> Self {
        let mut command = tmcl(&["sim"]);
        let mut child =
            command.args(options).current_dir(folder).stderr(File::create(messages).unwrap()).spawn().unwrap();
        let stdout = child.stdout.take().unwrap();
        let mut sim = Sim { child, said: Vec::new() };
        let (sender, lines) = mpsc::channel();
        std::thread::spawn(move || {
            for line in BufReader::new(stdout).lines().map_while(Result::ok) {
                let _ = sender.send(line);
            }
        });
        while sim.said.last().is_none_or(|line| line != "ready") {
            sim.said.push(lines.recv_timeout(PATIENCE).unwrap_or_else(|_| panic!("not ready: {options:?}")));
        }
        sim
    }
}

impl Drop for Sim {
    /// As a reader ends it, by Ctrl-C.
    fn drop(&mut self) {
        let _ = rustix::process::kill_process(Pid::from_child(&self.child), Signal::INT);
        let _ = self.child.wait();
    }
}
