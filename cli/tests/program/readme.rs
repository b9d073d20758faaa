//! README does not lie: what it shows is done here in its order, by the real program on real ports, and comes out as it
//! shows it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::{Child, Stdio};
use std::sync::mpsc;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

use super::build;
use super::harness::{PATIENCE, tmcl};

/// Commands that are not run here, by how they begin, and why.
const NOT_RUN: [(&str, &str); 2] = [
    ("cargo fw", "builds the flash image, as this test does by itself"),
    ("RANDOM_INPUTS=", "runs tests, for half a minute"),
];

/// Commands that a reader types some seconds later than this test. They only ask, and are repeated until they tell what
/// README shows.
const AWAITED: [&str; 8] = [
    "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\" \"SAP 4, 0, 3000\"",
    "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\" \"GAP 206, 0\"",
    // Reading parameter 207, which follows, clears it: so it is read once.
    "tmcl send tcp:127.0.0.1:4140 \"GAP 3, 0\"",
    "tmcl send tcp:127.0.0.1:4140 \"GGP 10, 2\" \"GGP 128, 0\"",
    "tmcl send tcp:127.0.0.1:4140 \"GGP 128, 0\"",
    "tmcl send tcp:127.0.0.1:4140 \"RFS STATUS, 0\" \"RFS STATUS, 1\" \"RFS STATUS, 2\"",
    "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 1, 1\" \"GAP 1, 2\"",
    "tmcl send tcp:127.0.0.1:4140 \"GAP 1, 0\" \"GAP 8, 0\"",
];

/// Lines with numbers that nobody knows beforehand, where `#` stands for one, and why.
const VARIES: [(&str, &str); 5] = [
    ("{\"ok\":true,\"time_us\":#,\"power\":true,\"position\":#,\"velocity\":0,\"rotor\":#, ...", "when the load came"),
    ("tmcl sim: # info: power on", "how long the image takes"),
    ("tmcl sim: # info: module runs at address 1", "how long the image takes"),
    ("tmcl sim: # info: RS485 at 9600 bit/s", "how long the image takes"),
    ("position # speed # int load # switches - driver SG errors -", "where the program is"),
];

/// The mistake in the program that README has its reader mend once the assembler has found it, and the mended line.
const MISTAKE: (&str, &str) = ("JA Lop", "JA Loop");

/// What a port is called in README; here each is a free one.
const HOST: &str = "127.0.0.1";
/// Where README has its serial ports; here that is a folder of its own.
const PORTS: &str = "/tmp/";
/// What the debugger asks with where somebody sees it; the line behind it is typed.
const PROMPT: &str = "(tmcl) ";
/// Any number of lines, or the rest of one.
const REST: &str = "...";

#[test]
fn what_it_shows_happens() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let mut reader = Reader::at_home(&root);
    fs::write(reader.path("stage.tmc"), source(&readme, "stage.tmc")).unwrap();
    let shown = shown(&readme);
    for Shown { line, command, output } in &shown {
        let told = match words(command) {
            _ if NOT_RUN.iter().any(|(start, _)| command.starts_with(start)) => continue,
            words if words.get(1).is_some_and(|word| word == "sim") => reader.start(&words[2..], output),
            words => reader.carry_out(&words, output, AWAITED.contains(&&**command)),
        };
        let said = told.iter().map(|line| format!("    {line}\n")).collect::<String>();
        assert!(matches(output, &told), "README.md:{line}: $ {command}\nin truth says\n{said}");
        if told.iter().any(|line| line.contains("unknown name 'Lop'")) {
            reader.mend();
        }
    }
    let [is, was] = [reader.path("stall_homing.svg"), root.join("docs/stall_homing.svg")].map(fs::read);
    assert!(is.unwrap() == was.unwrap(), "docs/stall_homing.svg is not what README's command draws");

    let commands = |start: &str| shown.iter().any(|shown| shown.command.starts_with(start));
    assert!(NOT_RUN.iter().all(|(start, _)| commands(start)) && AWAITED.iter().all(|start| commands(start)));
    let lines = |pattern| shown.iter().flat_map(|shown| &shown.output).any(|line| fits(pattern, line));
    assert!(VARIES.iter().all(|(pattern, _)| lines(pattern)), "something varies that is not shown");
}

/// `cargo sim` and `cargo tmcl` are what is run for them here.
#[test]
fn its_short_commands_are_those_of_the_program() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.cargo");
    let aliases = fs::read_to_string(folder.join("config.toml")).unwrap();
    for (name, end) in [("sim", "-- sim\""), ("tmcl", "--\"")] {
        let alias = aliases.lines().find(|line| line.starts_with(&format!("{name} = \"run "))).unwrap();
        assert!(alias.contains(" -p tmcl-cli --bin tmcl ") && alias.ends_with(end), "{alias}");
    }
}

/// The comparison is worth something only if it finds what is wrong.
#[test]
fn what_it_shows_in_vain_would_be_found() {
    let alike = |shown: &[&str], said: &[&str]| {
        let [shown, said] = [shown, said].map(|lines| lines.iter().map(|line| line.to_string()).collect::<Vec<_>>());
        matches(&shown, &said)
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
    let shown = shown("Text.\n\n    $ one\n    said\n\n    $ two \"2 3\"\n\nText.\n\n    said by nobody\n");
    let commands: Vec<_> = shown.iter().map(|shown| (shown.line, words(&shown.command), shown.output.len())).collect();
    assert_eq!(commands, [(3, vec!["one".to_owned()], 1), (6, vec!["two".to_owned(), "2 3".to_owned()], 0)]);
}

/// A command of README, in which line it stands, and what follows it there.
pub(crate) struct Shown {
    pub(crate) line: usize,
    pub(crate) command: String,
    pub(crate) output: Vec<String>,
}

/// All commands of the text. What follows a command ends with its block.
pub(crate) fn shown(text: &str) -> Vec<Shown> {
    let mut all: Vec<Shown> = Vec::new();
    let mut is_open = false;
    for (number, line) in text.lines().enumerate() {
        match (line.strip_prefix("    "), all.last_mut()) {
            (Some(line), _) if line.starts_with("$ ") => {
                all.push(Shown { line: number + 1, command: line[2..].into(), output: Vec::new() });
                is_open = true;
            }
            (Some(line), Some(last)) if is_open => last.output.push(line.into()),
            _ => is_open = is_open && line.is_empty(),
        }
    }
    all
}

/// The block behind the sentence that has the file written.
fn source(text: &str, name: &str) -> String {
    let mut lines = text.lines().skip_while(|line| !line.contains(&format!("Write `{name}`"))).skip(2);
    let block = lines.by_ref().map_while(|line| if line.is_empty() { Some(line) } else { line.strip_prefix("    ") });
    block.map(|line| format!("{line}\n")).collect()
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

/// Whether lines are those shown.
pub(crate) fn matches(shown: &[String], said: &[String]) -> bool {
    match (shown, said) {
        ([], said) => said.is_empty(),
        ([rest, shown @ ..], said) if rest == REST => (0..=said.len()).any(|skipped| matches(shown, &said[skipped..])),
        ([typed, shown @ ..], said) if typed.starts_with(PROMPT) => matches(shown, said),
        ([expected, shown @ ..], [line, said @ ..]) => {
            let pattern = VARIES.iter().find(|(pattern, _)| fits(pattern, expected));
            pattern.map_or(expected == line, |(pattern, _)| fits(pattern, line)) && matches(shown, said)
        }
        _ => false,
    }
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

/// Somebody who does what README says, in a folder of their own.
struct Reader {
    folder: tempfile::TempDir,
    /// The ports of README, and those that stand for them.
    ports: BTreeMap<String, String>,
    sim: Option<Sim>,
}

impl Reader {
    /// Where the repository is, as far as README's commands read from it.
    fn at_home(root: &Path) -> Self {
        let reader = Reader { folder: tempfile::tempdir().unwrap(), ports: BTreeMap::new(), sim: None };
        let root = root.canonicalize().unwrap();
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

    /// Corrects the mistake.
    fn mend(&self) {
        let text = fs::read_to_string(self.path("stage.tmc")).unwrap();
        fs::write(self.path("stage.tmc"), text.replace(MISTAKE.0, MISTAKE.1)).unwrap();
    }

    /// A word of README as it is used here.
    fn real(&self, word: &str) -> String {
        let word = word.replace(PORTS, &format!("{}/", self.folder.path().display()));
        self.ports.iter().fold(word, |word, (shown, real)| word.replace(shown, real))
    }

    /// What is said here as README has it.
    fn shown(&self, text: &str) -> Vec<String> {
        let text = text.replace(&format!("{}/", self.folder.path().display()), PORTS);
        let text = self
            .ports
            .iter()
            .fold(text, |text, (shown, real)| text.replace(&format!("{HOST}:{real}"), &format!("{HOST}:{shown}")));
        text.lines().map(String::from).collect()
    }

    /// Starts a module, in place of the one that runs. Gives what it says, as far as README shows any of it.
    fn start(&mut self, options: &[String], output: &[String]) -> Vec<String> {
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
            if matches(&output[ready + 1..], &messages) || Instant::now() > end {
                return [said, messages].concat();
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Carries out any other command and gives what it says; again and again, if it is one to wait with.
    fn carry_out(&self, words: &[String], output: &[String], waits: bool) -> Vec<String> {
        let end = Instant::now() + PATIENCE;
        loop {
            let said = match words {
                [program, rest @ ..] if program == "tmcl" => self.tmcl(rest, output),
                _ => panic!("README has a command that this test does not know: {words:?}"),
            };
            let told = self.shown(&said);
            if !waits || matches(output, &told) || Instant::now() > end {
                return told;
            }
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Runs the program, types what README shows to be typed, and gives what it says.
    fn tmcl(&self, words: &[String], output: &[String]) -> String {
        let words: Vec<String> = words.iter().map(|word| self.real(word)).collect();
        let (mut said, both) = std::io::pipe().unwrap();
        let mut command = tmcl(&words.iter().map(String::as_str).collect::<Vec<_>>());
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
    /// What it said until it was ready.
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
