//! Every tool when a signal ends it, when standard input or output is closed, and on a terminal that is narrow.

use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::process::{ExitStatus, Stdio};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

use super::bad_input::{Folder, SOON, all_right, carry_out};
use super::bad_links::{LINKED, Peer, Tool};
use super::fake::{Fake, State};
use super::harness::{command, tmcl, tmcl_path};
use super::pty::Terminal;

/// Ctrl-C and SIGTERM end a tool at once, also while it waits for a module that says nothing.
#[test]
fn signals_end_every_tool_at_once() {
    let folder = Folder::new();
    let link = Peer::Silent.start();
    let mut complaints = Vec::new();
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143)] {
        let begun = LINKED.each_ref().map(|Tool { arguments, typed }| {
            let arguments = folder.fill(arguments, ("{link}", &link));
            let mut child =
                tmcl(&[]).args(&arguments).args(["--timeout", "60000"]).stdin(Stdio::piped()).spawn().unwrap();
            let mut stdin = child.stdin.take().unwrap();
            stdin.write_all(typed.as_bytes()).unwrap();
            (arguments, child, stdin)
        });
        // They wait for the module by then, as is likely, and makes no difference.
        std::thread::sleep(Duration::from_secs(1));
        for (_, child, _) in &begun {
            rustix::process::kill_process(Pid::from_child(child), signal).unwrap();
        }
        let end = Instant::now() + SOON;
        for (arguments, mut child, _stdin) in begun {
            let status = loop {
                match child.try_wait().unwrap() {
                    Some(status) => break Some(status),
                    None if Instant::now() > end => break None,
                    None => std::thread::sleep(Duration::from_millis(5)),
                }
            };
            if !status.is_some_and(|status| ended_by(status, code)) {
                complaints.push(format!("tmcl {}: {status:?}, not {code}", arguments.join(" ")));
            }
            // It may have ended already.
            let _ = child.kill();
            child.wait().unwrap();
        }
    }
    all_right(complaints);
}

/// A program that a signal ends has this code as shells show it, whether it says so itself or not.
fn ended_by(status: ExitStatus, code: i32) -> bool {
    status.code() == Some(code) || status.signal().is_some_and(|signal| signal + 128 == code)
}

/// At a terminal standard input never ends by itself. A program that reads it to its end is ended by any signal, and
/// the module has been asked what it is, at most.
#[test]
fn signals_end_what_waits_for_standard_input() {
    let mut complaints = Vec::new();
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143), (Signal::HUP, 129)] {
        for arguments in [&["load", "{}", "-"][..], &["load", "{}", "-", "--run"], &["params", "{}", "restore", "-"]] {
            let fake = Fake::start(State::default());
            let arguments: Vec<&str> =
                arguments.iter().map(|argument| if *argument == "{}" { &fake.link } else { *argument }).collect();
            let mut terminal = Terminal::start(&arguments);
            terminal.keys("MVP REL, 0, 5\r");
            // The program is there before the signal; that it waits by then is likely, and makes no difference.
            std::thread::sleep(Duration::from_millis(300));
            terminal.signal(signal);
            let begun = Instant::now();
            let (status, said) = terminal.end();
            let asked = fake.state().asked.iter().all(|command| command.opcode == 136);
            if !ended_by(status, code) || !asked || begun.elapsed() > SOON {
                complaints.push(format!("tmcl {}: {status:?}, not {code}: {said}", arguments.join(" ")));
            }
        }
    }
    all_right(complaints);
}

/// Commands that write something, with a virtual module; all of it works.
const TALKING: [&[&str]; 15] = [
    &["send", "sim", "GAP 1, 0"],
    &["send", "sim", "--json", "GAP 1, 0"],
    &["params", "sim", "save", "-"],
    &["params", "sim", "list"],
    &["monitor", "sim", "--count", "3", "--interval", "1"],
    &["monitor", "sim", "--csv", "--count", "3", "--interval", "1"],
    &["scan", "sim", "--addresses", "1-2"],
    &["asm", "{program}", "--listing"],
    &["asm", "--names"],
    &["run", "{program}", "--until", "1 s"],
    &["calc", "60 rpm"],
    &["eds"],
    &["tables", "6110"],
    &["tune", "stallguard", "sim", "--speeds", "800"],
    &["completions", "bash"],
];

/// Nobody reads: quiet, and the code that shells expect.
#[test]
fn standard_output_that_is_closed() {
    let folder = Folder::new();
    let mut complaints = Vec::new();
    for arguments in TALKING {
        let arguments = folder.fill(arguments, ("", ""));
        let (reader, writer) = std::io::pipe().unwrap();
        drop(reader);
        let output = carry_out(tmcl(&[]).args(&arguments).stdout(writer), "");
        let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
        let quiet =
            !complaint.contains("panicked") && !complaint.contains("roken pipe") && !complaint.contains("cannot");
        if output.status.code() != Some(141) || !quiet {
            complaints.push(format!("tmcl {}: {:?}: {complaint}", arguments.join(" "), output.status));
        }
    }
    all_right(complaints);
}

/// Standard input that is closed altogether changes nothing.
#[test]
fn standard_input_that_is_closed() {
    let folder = Folder::new();
    let mut complaints = Vec::new();
    for arguments in TALKING.into_iter().chain([&["shell", "sim"][..], &["debug", "sim", "{program}"]]) {
        let arguments = folder.fill(arguments, ("", ""));
        let mut shell = command("sh");
        shell.args(["-c", "exec \"$@\" <&-", "sh", tmcl_path()]).args(&arguments);
        let output = carry_out(shell.stdout(Stdio::piped()).stderr(Stdio::piped()), "");
        if !output.status.success() {
            let complaint = String::from_utf8_lossy(&output.stderr).into_owned();
            complaints.push(format!("tmcl {}: {:?}: {complaint}", arguments.join(" "), output.status));
        }
    }
    all_right(complaints);
}

/// On a terminal with 40 columns everything works, and the terminal is as before. What fails, fails there as elsewhere.
#[test]
fn a_terminal_with_40_columns() {
    let folder = Folder::new();
    let silent = Peer::Silent.start();
    let mut complaints = Vec::new();
    let works = TALKING.into_iter().map(|arguments| (folder.fill(arguments, ("", "")), Some(0)));
    let fails = LINKED.iter().map(|tool| {
        let mut arguments = folder.fill(tool.arguments, ("{link}", &silent));
        arguments.extend(["--timeout".into(), "50".into()]);
        // A shell and a debugger wait for what is typed.
        let code = (tool.arguments.first() != Some(&"shell")).then_some(1);
        (arguments, code)
    });
    for (arguments, code) in works.chain(fails).filter(|(_, code)| code.is_some()) {
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let mut terminal = Terminal::start_with(&arguments, 40);
        let (status, text) = terminal.end();
        if status.code() != code || text.contains("panicked") || !terminal.is_as_before() {
            complaints.push(format!("tmcl {}: {status:?}: {text}", arguments.join(" ")));
        }
    }
    all_right(complaints);
}
