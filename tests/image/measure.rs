//! `cargo measure` tells its users what is wrong with what they ask for.

// Its own `main` is not used here.
#[allow(dead_code)]
#[path = "../../benches/measure/main.rs"]
mod bench;

use bench::arguments::{Order, Subject, USAGE, read};
use bench::canopen::Subject as Node;
use bench::host::Link;
use bench::{interrupts, run};

/// Returns the message with which the program fails.
fn error(arguments: &[&str]) -> String {
    let arguments: Vec<String> = arguments.iter().map(|&argument| argument.into()).collect();
    run(&arguments).unwrap_err().to_string()
}

#[test]
fn all_that_can_be_asked_for_is_understood() {
    let measure = |short, updates| Ok(Order::Measure { short, updates });
    assert_eq!(read(&[]), measure(false, false));
    assert_eq!(read(&["short"]), measure(true, false));
    assert_eq!(read(&["update"]), measure(false, true));
    let profile = |subject| Ok(Order::Profile(subject));
    assert_eq!(read(&["profile", "poll"]), profile(Subject::Poll));
    assert_eq!(read(&["profile", "rest"]), profile(Subject::Rest));
    assert_eq!(read(&["profile", "6110", "poll"]), Ok(Order::Sister("tmcm6110", Subject::Poll)));
    let of_sister = Ok(Order::Sister("tmcm3212", Subject::Reply("GAP 5", Link::Can)));
    assert_eq!(read(&["profile", "3212", "GAP 5", "can"]), of_sister);
    assert_eq!(read(&["profile", "program", "CALC ADD, 1"]), profile(Subject::Program("CALC ADD, 1")));
    assert_eq!(read(&["profile", "GAP 5"]), profile(Subject::Reply("GAP 5", Link::Rs485)));
    for (name, link) in [("rs485", Link::Rs485), ("can", Link::Can), ("usb", Link::Usb)] {
        assert_eq!(read(&["profile", "GAP 5", name]), profile(Subject::Reply("GAP 5", link)));
    }
    for (name, node) in [("upload", Some(Node::UPLOAD)), ("download", Some(Node::DOWNLOAD)), ("turn", None)] {
        assert_eq!(read(&["profile", "canopen", name]), profile(Subject::Node(node)));
    }
    for (name, node) in [("target", Node::TargetVelocity), ("sync", Node::Sync)] {
        assert_eq!(read(&["profile", "canopen", name]), profile(Subject::Node(Some(node))));
    }
    for help in [&["help"][..], &["--help"], &["-h"], &["profile", "--help"]] {
        assert_eq!(read(help), Ok(Order::Help));
    }
}

#[test]
fn what_is_wrong_is_said_before_the_usage() {
    for (arguments, wrong) in [
        (&["x"][..], "unknown command 'x'"),
        (&["profile", "GAP 5", "tcp"], "unknown link 'tcp': rs485, can or usb"),
        (&["profile", "GAP 5", "can", "now"], "'now' is one argument too many"),
        (&["short", "update"], "'update' is one argument too many"),
        (&["profile"], "profile of what: a command, poll, rest, or program COMMAND"),
        (&["profile", "6110"], "profile of what: a command, poll, rest, or program COMMAND"),
        (&["profile", "program"], "profile program: its command is missing"),
        (&["profile", "canopen"], "profile canopen of what: upload, download, target, sync or turn"),
        (&["profile", "canopen", "x"], "unknown subject 'x': upload, download, target, sync or turn"),
        (&["profile", "GOTO 1"], "profile: unknown command 'GOTO'"),
        (&["profile", "program", "SAP 4, 0"], "profile: SAP: missing <value>; usage: SAP"),
    ] {
        let error = error(arguments);
        assert!(error.starts_with(wrong) && error.ends_with(USAGE), "{arguments:?}: {error}");
    }
}

#[test]
fn a_command_without_a_reply_is_told_with_the_log() {
    let error = error(&["profile", "137, 0, 0, 1234", "can"]);
    let (what, log) = error.split_once('\n').unwrap();
    assert_eq!(what, "137, 0, 0, 1234: no reply within 2 s; the module's log:");
    assert!(log.lines().any(|line| line.ends_with(" info: module runs at address 1")), "{log}");
}

#[test]
fn a_program_has_a_profile_while_it_runs() {
    assert!(run(&["profile".into(), "program".into(), "CALC ADD, 1".into()]).unwrap());
    assert!(error(&["profile", "program", "STOP"]).starts_with("STOP: the program ends with it"));
    let error = error(&["profile", "program", "136, 1"]);
    assert!(error.starts_with("cannot be part of a program: 136, 1: status 100"), "{error}");
}

#[test]
fn the_canopen_image_has_profiles() {
    assert!(run(&["profile", "canopen", "sync"].map(str::to_owned)).unwrap());
    assert!(run(&["profile", "canopen", "turn"].map(str::to_owned)).unwrap());
}

#[test]
fn exceptions_have_the_names_of_their_interrupts() {
    assert_eq!(interrupts::name(16 + 29), Some("TIM3, owner of the module"));
    assert_eq!((interrupts::name(15), interrupts::name(16)), (None, None));
}
