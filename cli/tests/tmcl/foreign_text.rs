//! Characters that control a terminal, in files, names, and what modules and simulators answer: they are shown, never
//! sent.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::path::Path;

use super::harness::{run, tmcl, type_into};

/// Sets a title, rings, clears the screen by a code of C1, goes back to the beginning of the line, turns the direction.
const EVIL: &str = "\u{1b}]0;x\u{7}\u{9b}2J\r\u{202e}";

/// Checks that the output of a command, on both ways, has nothing in it that controls a terminal, and shows it where it
/// is told.
fn is_shown(arguments: &[&str], typed: &str) {
    let output = type_into(arguments, typed);
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8(said).unwrap_or_else(|error| panic!("{arguments:?}: {error}"));
    let sent = said.chars().find(|c| c.is_control() && !['\n', '\t'].contains(c) || *c == '\u{202e}');
    assert_eq!(sent, None, "{arguments:?}: {said:?}");
    assert!(said.contains("\\u001b"), "{arguments:?}: it is not there: {said}");
}

/// Writes a file that has this where `EVIL` stands, and gives its path.
fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text.replace("EVIL", EVIL)).unwrap();
    path.to_str().unwrap().to_owned()
}

#[test]
fn what_stands_in_files_controls_no_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| file(folder.path(), name, text);
    let wrong = file("wrong.tmc", "MVP ABS, 0, EVIL\n");
    let right = file("right.tmc", "Loop: WAIT TICKS, 0, 1 // EVIL\nJA Loop\n");
    let settings = file("settings.tmcl", "SAP 4, 0, EVIL\n");
    let unclosed = file("unclosed.toml", "[motor]\nload = EVIL\n");
    let scenario = file("scenario.txt", "== It EVIL waits\n\nexpect position = 0\n");
    let mistaken = file("mistaken.txt", "== It waits\n\nexpect EVIL = 0\n");
    for arguments in [
        &["asm", &wrong][..],
        &["asm", &right, "--listing"],
        &["run", &wrong],
        &["load", "sim", &wrong],
        &["params", "sim", "restore", &settings],
        &["params", "diff", &settings, "sim"],
        &["send", "sim", "--world", &unclosed, "GAP 1, 0"],
        &["sim", "--world", &unclosed],
        &["test", &scenario],
        &["test", &mistaken],
        &["debug", "sim", &right],
    ] {
        is_shown(arguments, "");
    }
    let program = file("EVIL.tmc", "MVP ABS, 0, x\n").replace("EVIL", EVIL);
    std::fs::rename(folder.path().join("EVIL.tmc"), &program).unwrap();
    for arguments in [
        &["asm", &program][..],
        &["disasm", &program],
        &["params", "diff", &program, "sim"],
        &["monitor", &program],
        &["scan", &program],
    ] {
        is_shown(arguments, "");
    }
}

/// Something that answers whatever comes; the port on which it does.
fn answering(answer: Vec<u8>) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap().to_string();
    std::thread::spawn(move || {
        for host in listener.incoming() {
            let mut host = host.unwrap();
            let mut asked = [0; 64];
            // Nobody may be there any more.
            while host.read(&mut asked).is_ok_and(|count| count > 0) && host.write_all(&answer).is_ok() {}
        }
    });
    address
}

#[test]
fn what_a_simulator_answers_controls_no_terminal() {
    let escaped = EVIL.replace('\u{1b}', "\\u001b").replace('\u{7}', "\\u0007").replace('\r', "\\r");
    let refusal = answering(format!("{{\"ok\":false,\"error\":\"{escaped}\"}}\n").into_bytes());
    is_shown(&["world", &refusal, "state", "--value", "x"], "");
    let field = answering(format!("{{\"ok\":true,\"x\":\"{escaped}\",\"a\\u009bb\":\"\u{9b}\"}}\n").into_bytes());
    is_shown(&["world", &field, "state", "--value", "x"], "");
    // A line of JSON is one as before.
    let output = run(&["world", &field, "state"]);
    let line = String::from_utf8(output.stdout).unwrap();
    assert!(line.contains("\\u009b2J") && !line.contains('\u{9b}') && !line.contains('\u{202e}'), "{line:?}");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&line).unwrap()["x"], EVIL);
}

#[test]
fn what_a_module_answers_controls_no_terminal() {
    let link = format!("tcp:{}", answering(b"\x02\x1B[2J\x1B]0;".to_vec()));
    for arguments in [
        &["scan", &link, "--addresses", "1"][..],
        &["send", &link, "136, 0, 0, 0"],
        &["monitor", &link, "--count", "1"],
        &["dump", &link],
    ] {
        let output = run(arguments);
        let said = [output.stdout, output.stderr].concat();
        assert!(!said.is_empty() && said.iter().all(|byte| *byte >= b' ' || *byte == b'\n'), "{arguments:?}: {said:?}");
    }
}

/// The caret stands below the mistake, however much longer the line before it is shown.
#[test]
fn the_place_of_a_mistake_is_found_behind_what_is_shown() {
    let folder = tempfile::tempdir().unwrap();
    let path = file(folder.path(), "wrong.tmc", "/* EVIL */\tMVP ABS, 0, Speeed\n");
    let mut child = tmcl(&["asm", &path]).spawn().unwrap();
    let lines: Vec<String> = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap).collect();
    child.wait().unwrap();
    let column = |line: &str, part: &str| line.find(part).unwrap();
    assert_eq!(column(&lines[1], "Speeed"), column(&lines[2], "^^^^^^"), "{lines:?}");
    assert_eq!(column(&lines[1], "\t"), column(&lines[2], "\t"), "{lines:?}");
}
