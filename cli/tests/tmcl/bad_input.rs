//! Every tool with files, numbers and names that cannot be: it says one sentence, ends with the right code, and never
//! hangs.

use std::io::Write;
use std::net::TcpListener;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Signal};

use super::harness::tmcl;

/// The time that a command may take at most to notice that something is wrong, on a busy computer.
pub(crate) const SOON: Duration = Duration::from_secs(20);
const PROGRAM: &str = "Loop: WAIT TICKS, 0, 1\n\tJA Loop\n";
const SETTINGS: &str = "SAP 4, 0, 1001\nSAP 5, 0, 501\n";

/// Everything that reads a file; `{file}` is the wrong one.
const READING: [&[&str]; 10] = [
    &["asm", "{file}"],
    &["disasm", "{file}"],
    &["run", "{file}"],
    &["load", "sim", "{file}"],
    &["debug", "sim", "{file}"],
    &["params", "sim", "restore", "{file}"],
    &["sim", "--world", "{file}"],
    &["run", "{program}", "--world", "{file}"],
    &["send", "sim", "--world", "{file}", "GAP 1, 0"],
    &["tune", "stallguard", "sim", "--world", "{file}"],
];

/// Everything that writes a file that cannot be written; the motor of `run` and `tune` has not moved then.
const WRITING: [&[&str]; 7] = [
    &["asm", "{program}", "-o", "{nowhere}"],
    &["run", "{program}", "--plot", "{nowhere}"],
    &["run", "{program}", "--trace", "{nowhere}"],
    &["params", "sim", "save", "{nowhere}"],
    &["tune", "stallguard", "sim", "--plot", "{nowhere}"],
    &["eds", "-o", "{nowhere}"],
    &["tables", "-o", "{nowhere}"],
];

/// Numbers and names that cannot be, each with a word that the answer has to have.
const WRONG: [(&[&str], &str); 38] = [
    (&["send", "sim", "--address", "2048", "GAP 1, 0"], "2047"),
    (&["send", "sim", "--timeout", "0", "GAP 1, 0"], "600000"),
    (&["send", "sim", "--baud", "fast", "GAP 1, 0"], "fast"),
    (&["send", "sim", "--product", "1141", "GAP 1, 0"], "1140"),
    (&["send", "tcp:localhost", "GAP 1, 0"], "tcp:127.0.0.1:4140"),
    (&["send", "tcp:localhost:99999", "GAP 1, 0"], "tcp:127.0.0.1:4140"),
    (&["send", "127.0.0.1:4140", "GAP 1, 0"], "tcp:"),
    (&["send", "", "GAP 1, 0"], "/dev/ttyACM0"),
    (&["send", "tcp:127.0.0.1:1", "--world", "stage.toml", "GAP 1, 0"], "LINK sim"),
    (&["monitor", "sim", "--count", "-1"], "-1"),
    (&["monitor", "sim", "--interval", "often"], "often"),
    (&["scan", "sim", "--addresses", "9-1"], "1 to 255"),
    (&["run", "x.tmc", "--until", "10"], "unit"),
    (&["run", "x.tmc", "--at", "soon: press left"], "soon"),
    (&["run", "{program}", "--plot", "x.png"], ".svg"),
    (&["calc", "60 rpn"], "rpm"),
    (&["calc", "fast"], "60 rpm"),
    (&["sim", "--modules", "0"], "0"),
    (&["sim", "--tcp", "127.0.0.1"], "127.0.0.1:4140"),
    (&["world", "127.0.0.1"], "127.0.0.1:"),
    (&["tune", "stallguard", "sim", "--speeds", "0"], "above 0"),
    (&["tune", "stallguard", "sim", "--load", "2"], "from 0 to 1"),
    (&["tune", "coolstep", "sim", "--threshold", "64"], "63"),
    (&["load", "sim", "x.tmc", "--at", "2048x"], "2048x"),
    (&["send", "sim", "--address", "abc", "GAP 1, 0"], "give a whole number from 0 to 2047"),
    (&["send", "sim", "--address", "99999", "GAP 1, 0"], "give a whole number from 0 to 2047"),
    (&["send", "sim", "--timeout", "1s", "GAP 1, 0"], "give a whole number from 1 to 600000"),
    (&["monitor", "sim", "--params", "1,abc"], "give a whole number from 0 to 255"),
    // A number below 0 is a value that cannot be, and no option that is unknown.
    (&["run", "x.tmc", "--until", "-1s"], "not within 0 s and 1000 h"),
    (&["run", "x.tmc", "--until", "-1"], "unit"),
    (&["monitor", "sim", "--interval", "-5"], "invalid value '-5' for '--interval <MS>'"),
    (&["asm", "x.tmc", "--origin", "-5"], "an address is a number from 0 to 65535"),
    (&["load", "sim", "x.tmc", "--at", "-5"], "an address is a number from 0 to 65535"),
    (&["world", "127.0.0.1:1", "--timeout", "-1"], "invalid value '-1' for '--timeout <MS>'"),
    (&["tune", "stallguard", "sim", "--speeds", "-5"], "above 0"),
    (&["send", "sim", "--address", "-1", "GAP 1, 0"], "invalid value '-1' for '--address <N>'"),
    (&["params", "sim", "list", "--axis", "-1"], "invalid value '-1' for '--axis <N>'"),
    (&["calc", "-5", "s"], "a time is not negative"),
];

/// A folder with the files that tools need.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        std::fs::write(folder.at("program.tmc"), PROGRAM).unwrap();
        std::fs::write(folder.at("settings.tmcl"), SETTINGS).unwrap();
        folder
    }

    pub(crate) fn at(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    /// Arguments with the files in the place of their names, and another name in the place of `other`.
    pub(crate) fn fill(&self, arguments: &[&str], other: (&str, &str)) -> Vec<String> {
        let fill = |argument: &&str| match *argument {
            name if name == other.0 => other.1.to_owned(),
            "{program}" => self.at("program.tmc"),
            "{settings}" => self.at("settings.tmcl"),
            "{new}" => self.at("new.tmcl"),
            "{nowhere}" => self.at("none/such.svg"),
            argument => argument.to_owned(),
        };
        arguments.iter().map(fill).collect()
    }
}

/// Runs a command to its end, which must come soon.
pub(crate) fn carry_out(command: &mut Command, typed: &str) -> Output {
    let mut child = command.stdin(Stdio::piped()).spawn().unwrap();
    // Who has had enough does not read.
    let _ = child.stdin.take().unwrap().write_all(typed.as_bytes());
    let pid = Pid::from_child(&child);
    let (done, waits) = std::sync::mpsc::channel();
    std::thread::spawn(move || {
        if waits.recv_timeout(SOON).is_err() {
            // It may have ended in this moment.
            let _ = rustix::process::kill_process(pid, Signal::KILL);
        }
    });
    let output = child.wait_with_output().unwrap();
    // Nobody waits any longer if it took too long.
    let _ = done.send(());
    output
}

/// The mistake at the end of a command: it must have this exit code, and its last word must be one sentence.
pub(crate) fn wrong(arguments: &[String], output: &Output, code: i32) -> Option<String> {
    let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
    let last = complaint.lines().last().unwrap_or_default();
    // What the reader of arguments, and the assembler, have to say begins with "error", and the reply to `send` is its
    // result.
    let is_sentence = complaint.starts_with("error: ")
        || last.starts_with("tmcl: ")
        || arguments.first().is_some_and(|tool| tool == "send") && !output.stdout.is_empty();
    let panicked = complaint.contains("panicked");
    let riddle = complaint.contains("(os error");
    let right = output.status.code() == Some(code) && is_sentence && !panicked && !riddle;
    (!right).then(|| format!("tmcl {}: {:?}, not {code}: {complaint}", arguments.join(" "), output.status))
}

pub(crate) fn all_right(wrong: Vec<String>) {
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn files_that_cannot_be_read() {
    let folder = Folder::new();
    std::fs::write(folder.at("rubbish"), (0..=255).cycle().take(5000).collect::<Vec<u8>>()).unwrap();
    std::fs::create_dir(folder.at("folder")).unwrap();
    let mut complaints = Vec::new();
    for file in ["there-is-none", "folder", "rubbish"] {
        for arguments in READING {
            let arguments = folder.fill(arguments, ("{file}", &folder.at(file)));
            let output = carry_out(tmcl(&[]).args(&arguments), "");
            complaints.extend(wrong(&arguments, &output, 1));
            let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
            if !complaint.contains(file) {
                complaints.push(format!("tmcl {}: which file? {complaint}", arguments.join(" ")));
            }
        }
    }
    all_right(complaints);
}

/// Errors that the system calls by names and numbers of its own are said in words.
#[test]
fn errors_of_the_system_are_said_in_words() {
    let folder = Folder::new();
    let (here, none) = (folder.at(""), folder.at("none.tmc"));
    let held = TcpListener::bind("127.0.0.1:0").unwrap();
    let taken = held.local_addr().unwrap().to_string();
    let mut complaints = Vec::new();
    for (arguments, words) in [
        (&["disasm", here.as_str()][..], "it is a folder"),
        (&["params", "sim", "restore", &here], "it is a folder"),
        (&["disasm", &none], "there is no such file or folder"),
        (&["asm", &none, "-o", "-"], "there is no such file or folder"),
        (&["send", "tcp:127.0.0.1:1", "GAP 1, 0"], "nothing there takes connections"),
        (&["sim", "--tcp", &taken], "it is in use already"),
        (&["eds", "-o", "/dev/full"], "no room is left"),
        (&["params", "sim", "save", "/dev/full"], "no room is left"),
    ] {
        let output = carry_out(tmcl(&[]).args(arguments), "");
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        if output.status.code() != Some(1) || !complaint.contains(words) || complaint.contains("os error") {
            complaints.push(format!("tmcl {}: '{words}' is not in: {complaint}", arguments.join(" ")));
        }
    }
    all_right(complaints);
}

/// Every tool says in the same way that a file cannot be read.
#[test]
fn files_that_are_not_there_are_told_alike() {
    let folder = Folder::new();
    for arguments in READING {
        let arguments = folder.fill(arguments, ("{file}", &folder.at("none.tmc")));
        let output = carry_out(tmcl(&[]).args(&arguments), "");
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(complaint.starts_with("tmcl: "), "{arguments:?}: {complaint}");
        assert!(
            complaint.trim_end().ends_with("none.tmc: there is no such file or folder"),
            "{arguments:?}: {complaint}"
        );
    }
}

#[test]
fn files_that_cannot_be_written() {
    let folder = Folder::new();
    let mut complaints = Vec::new();
    for arguments in WRITING {
        let arguments = folder.fill(arguments, ("", ""));
        let output = carry_out(tmcl(&[]).args(&arguments), "");
        complaints.extend(wrong(&arguments, &output, 1));
        if !String::from_utf8_lossy(&output.stderr).contains("cannot write") {
            complaints.push(format!("tmcl {}: {}", arguments.join(" "), String::from_utf8_lossy(&output.stderr)));
        }
    }
    all_right(complaints);
}

#[test]
fn numbers_and_names_that_cannot_be() {
    let folder = Folder::new();
    let mut complaints = Vec::new();
    for (arguments, word) in WRONG {
        let arguments = folder.fill(arguments, ("", ""));
        let output = tmcl(&[]).args(&arguments).output().unwrap();
        complaints.extend(wrong(&arguments, &output, 2));
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        if !complaint.contains(word) {
            complaints.push(format!("tmcl {}: '{word}' is not in: {complaint}", arguments.join(" ")));
        }
    }
    all_right(complaints);
}
