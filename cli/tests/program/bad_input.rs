//! Every tool with what can go wrong around it: files, links, modules, numbers, signals, and the ends of pipes. It says
//! one sentence, ends with the right code, and never hangs.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::os::unix::process::ExitStatusExt;
use std::process::{Command, ExitStatus, Output, Stdio};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};
use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::fake::{Fake, State};
use super::harness::{Sim, command, tmcl, tmcl_path};
use super::pty::Terminal;

/// The time that a command may take at most to notice that something is wrong, on a busy computer.
const SOON: Duration = Duration::from_secs(20);
const PROGRAM: &str = "Loop: WAIT TICKS, 0, 1\n\tJA Loop\n";
const SETTINGS: &str = "SAP 4, 0, 1001\nSAP 5, 0, 501\n";

/// A tool with its arguments, where `{link}` and the names of files in the folder of the test stand for what they are;
/// and what is typed into it.
struct Tool {
    arguments: &'static [&'static str],
    typed: &'static str,
}

const fn tool(arguments: &'static [&'static str]) -> Tool {
    Tool { arguments, typed: "" }
}

/// Everything that talks to a module.
const LINKED: [Tool; 18] = [
    tool(&["send", "{link}", "GAP 1, 0"]),
    tool(&["send", "{link}", "GAP APActualPosition, 0"]),
    tool(&["send", "{link}", "--json", "GAP 1, 0"]),
    tool(&["params", "{link}", "save", "{new}"]),
    tool(&["params", "{link}", "save", "-"]),
    tool(&["params", "{link}", "restore", "{settings}"]),
    tool(&["params", "{link}", "list"]),
    tool(&["monitor", "{link}", "--count", "3"]),
    tool(&["monitor", "{link}", "--csv", "--count", "3"]),
    tool(&["scan", "{link}", "--addresses", "1-2"]),
    tool(&["load", "{link}", "{program}"]),
    tool(&["dump", "{link}", "--count", "3"]),
    tool(&["debug", "{link}", "{program}"]),
    tool(&["debug", "{link}", "{program}", "--attach"]),
    Tool { arguments: &["shell", "{link}"], typed: "GAP 1, 0\n" },
    tool(&["tune", "stallguard", "{link}", "--yes"]),
    tool(&["tune", "coolstep", "{link}", "--yes"]),
    tool(&["scan", "{link}", "--addresses", "1", "--json"]),
];

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
struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        std::fs::write(folder.at("program.tmc"), PROGRAM).unwrap();
        std::fs::write(folder.at("settings.tmcl"), SETTINGS).unwrap();
        folder
    }

    fn at(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().to_owned()
    }

    /// Arguments with the files in the place of their names, and another name in the place of `other`.
    fn fill(&self, arguments: &[&str], other: (&str, &str)) -> Vec<String> {
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

/// A peer at the other end of a link that is no good module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Peer {
    /// Says nothing.
    Silent,
    /// Closes the connection when it is asked something.
    Closing,
    /// Answers with bytes that are no reply.
    Rubbish,
    /// Sends bytes without end.
    Flood,
    /// Answers with the beginning of a reply.
    Short,
    /// Answers when nobody waits any longer.
    Late,
}

impl Peer {
    const ALL: [Peer; 6] = [Peer::Silent, Peer::Closing, Peer::Rubbish, Peer::Flood, Peer::Short, Peer::Late];

    /// Starts it, and gives the link to it.
    fn start(self) -> String {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let link = format!("tcp:{}", listener.local_addr().unwrap());
        std::thread::spawn(move || {
            for host in listener.incoming() {
                let host = host.unwrap();
                std::thread::spawn(move || self.talk(host));
            }
        });
        link
    }

    fn talk(self, mut host: TcpStream) {
        let mut request = [0; TELEGRAM];
        while host.read_exact(&mut request).is_ok() {
            let said = match self {
                Peer::Silent => Ok(()),
                Peer::Closing => return,
                Peer::Rubbish => host.write_all(b"no module"),
                Peer::Flood => loop {
                    if host.write_all(&[0xA5; 4096]).is_err() {
                        return;
                    }
                },
                Peer::Short => host.write_all(&request[..4]),
                Peer::Late => {
                    std::thread::sleep(Duration::from_millis(300));
                    let command = binary::decode_command(&request).unwrap();
                    host.write_all(&binary::encode_reply(2, 1, &Reply::echo(Status::Ok, command)))
                }
            };
            if said.is_err() {
                return;
            }
        }
    }
}

/// Runs a command to its end, which must come soon.
fn carry_out(command: &mut Command, typed: &str) -> Output {
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
fn wrong(arguments: &[String], output: &Output, code: i32) -> Option<String> {
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

fn all_right(wrong: Vec<String>) {
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Every tool ends with 1 soon after the time-out, whoever is at the other end of the link.
#[test]
fn modules_that_answer_late_or_rubbish_or_not_at_all() {
    let folder = Folder::new();
    let complaints = Mutex::new(Vec::new());
    let visit = |peer: Peer| {
        let link = peer.start();
        for Tool { arguments, typed } in &LINKED {
            let arguments = folder.fill(arguments, ("{link}", &link));
            let output = carry_out(tmcl(&[]).args(&arguments).args(["--timeout", "50"]), typed);
            let wrong = wrong(&arguments, &output, 1).map(|wrong| format!("{peer:?}: {wrong}"));
            complaints.lock().unwrap().extend(wrong);
        }
    };
    std::thread::scope(|scope| {
        for peer in Peer::ALL {
            scope.spawn(move || visit(peer));
        }
    });
    let complaints = complaints.into_inner().unwrap();
    assert!(!std::path::Path::new(&folder.at("new.tmcl")).exists(), "half a file");
    all_right(complaints);
}

/// Links that lead nowhere.
#[test]
fn links_that_cannot_be_opened() {
    let folder = Folder::new();
    let mut complaints = Vec::new();
    // Port 1 is nobody's.
    for link in
        ["/dev/there-is-no-such-port", "/dev/null", "tcp:127.0.0.1:1", "slcan:/dev/null", &folder.at("program.tmc")]
    {
        for Tool { arguments, typed } in &LINKED {
            let arguments = folder.fill(arguments, ("{link}", link));
            complaints.extend(wrong(&arguments, &carry_out(tmcl(&[]).args(&arguments), typed), 1));
        }
    }
    all_right(complaints);
}

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

/// The control port of a simulator is none of these.
#[test]
fn control_ports_that_are_none() {
    let mut complaints = Vec::new();
    for peer in Peer::ALL {
        let link = peer.start();
        let address = link.trim_start_matches("tcp:").to_owned();
        let arguments: Vec<String> = ["world", &address, "state", "--timeout", "100"].map(String::from).into();
        complaints.extend(wrong(&arguments, &carry_out(tmcl(&[]).args(&arguments), ""), 1));
    }
    let arguments: Vec<String> = ["world", "127.0.0.1:1", "state"].map(String::from).into();
    complaints.extend(wrong(&arguments, &carry_out(tmcl(&[]).args(&arguments), ""), 1));
    let arguments: Vec<String> = ["tune", "stallguard", "sim", "--control", "127.0.0.1:1"].map(String::from).into();
    complaints.extend(wrong(&arguments, &carry_out(tmcl(&[]).args(&arguments), ""), 1));
    all_right(complaints);
}

/// A port that another program listens at, and one that it has opened.
#[test]
fn ports_in_use() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--serial", "{}/port"]);
    let port = sim.path("port");
    let port = port.to_str().unwrap();
    let mut complaints = Vec::new();
    for arguments in
        [["sim", "--tcp", sim.told("tcp")], ["sim", "--control", sim.told("tcp")], ["sim", "--serial", port]]
    {
        let arguments: Vec<String> = arguments.map(String::from).into();
        complaints.extend(wrong(&arguments, &carry_out(tmcl(&[]).args(&arguments), ""), 1));
    }
    let mut first = tmcl(&["monitor", port]).spawn().unwrap();
    let mut line = [0; 20];
    first.stdout.as_mut().unwrap().read_exact(&mut line).unwrap();
    for arguments in [["send", port, "GAP 1, 0"], ["scan", port, "--json"]] {
        let arguments: Vec<String> = arguments.map(String::from).into();
        let output = carry_out(tmcl(&[]).args(&arguments), "");
        complaints.extend(wrong(&arguments, &output, 1));
        if !String::from_utf8_lossy(&output.stderr).contains("another program uses this port") {
            complaints.push(format!("tmcl {}: {output:?}", arguments.join(" ")));
        }
    }
    first.kill().unwrap();
    first.wait().unwrap();
    all_right(complaints);
}
