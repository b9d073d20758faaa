//! The order that the arguments of the command line give.

use super::canopen::Subject as Node;
use super::host::{Link, command};

pub(crate) const USAGE: &str = "\
usage: cargo measure                              all figures of the flash images, against their budgets
       cargo measure short                        the same, with fewer samples
       cargo measure update                       and puts them into docs/figures.md
       cargo measure profile COMMAND [LINK]       where the cycles of a reply go: cargo measure profile 'GAP 5'
                                                  COMMAND is one argument, LINK is rs485, can or usb
       cargo measure profile poll                 and those of a poll with all axes moving
       cargo measure profile rest                 and those of a poll at rest
       cargo measure profile program COMMAND      and those of a millisecond of a program of such commands
       cargo measure profile canopen SUBJECT      and those of the CANopen image: SUBJECT is upload, download, target, sync
                                                  or turn, with a moving axis
       cargo measure profile 6110 ...             any of these but the last, of the image of the TMCM-6110; or 3212
       cargo measure help                         this text";

/// An order of the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Order<'a> {
    /// To print the usage.
    Help,
    /// To measure all, with few samples or into the documentation.
    Measure { short: bool, updates: bool },
    /// To print a profile.
    Profile(Subject<'a>),
    /// The same of the image of this name, that of a sister.
    Sister(&'static str, Subject<'a>),
}

/// The subject of a profile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject<'a> {
    /// The reply to a command.
    Reply(&'a str, Link),
    /// A poll with all axes moving.
    Poll,
    /// A poll at rest.
    Rest,
    /// A millisecond of a program that consists of a command.
    Program(&'a str),
    /// The work of the CANopen image with a frame; none is a turn of the image.
    Node(Option<Node>),
}

/// Reads the arguments. The error says what is wrong and how it is written.
pub(crate) fn read<'a>(arguments: &[&'a str]) -> Result<Order<'a>, String> {
    if arguments.iter().any(|argument| matches!(*argument, "help" | "--help" | "-h")) {
        return Ok(Order::Help);
    }
    order(arguments).map_err(|wrong| format!("{wrong}\n\n{USAGE}"))
}

fn order<'a>(arguments: &[&'a str]) -> Result<Order<'a>, String> {
    let (order, rest) = match arguments {
        [] => (Order::Measure { short: false, updates: false }, &[][..]),
        ["short", rest @ ..] => (Order::Measure { short: true, updates: false }, rest),
        ["update", rest @ ..] => (Order::Measure { short: false, updates: true }, rest),
        ["profile", "canopen"] => return Err(format!("profile canopen of what: {NODES}")),
        ["profile", "canopen", name, rest @ ..] => (Order::Profile(Subject::Node(node(name)?)), rest),
        ["profile", number @ ("6110" | "3212"), of @ ..] => {
            let (subject, rest) = subject(of)?;
            (Order::Sister(if *number == "6110" { "tmcm6110" } else { "tmcm3212" }, subject), rest)
        }
        ["profile", of @ ..] => {
            let (subject, rest) = subject(of)?;
            (Order::Profile(subject), rest)
        }
        [word, ..] => return Err(format!("unknown command '{word}'")),
    };
    match rest {
        [] => Ok(order),
        [word, ..] => Err(format!("'{word}' is one argument too many")),
    }
}

/// Reads the subject of a profile of an image with TMCL. Gives the arguments behind it as well.
fn subject<'a, 'b>(arguments: &'b [&'a str]) -> Result<(Subject<'a>, &'b [&'a str]), String> {
    Ok(match arguments {
        [] => return Err("profile of what: a command, poll, rest, or program COMMAND".into()),
        ["poll", rest @ ..] => (Subject::Poll, rest),
        ["rest", rest @ ..] => (Subject::Rest, rest),
        ["program"] => return Err("profile program: its command is missing".into()),
        ["program", line, rest @ ..] => (Subject::Program(readable(line)?), rest),
        [line] => (Subject::Reply(readable(line)?, Link::Rs485), &[]),
        [line, name, rest @ ..] => (Subject::Reply(readable(line)?, link(name)?), rest),
    })
}

fn link(name: &str) -> Result<Link, String> {
    match name {
        "rs485" => Ok(Link::Rs485),
        "can" => Ok(Link::Can),
        "usb" => Ok(Link::Usb),
        _ => Err(format!("unknown link '{name}': rs485, can or usb")),
    }
}

/// The subjects that a profile of the CANopen image can have.
const NODES: &str = "upload, download, target, sync or turn";

fn node(name: &str) -> Result<Option<Node>, String> {
    match name {
        "upload" => Ok(Some(Node::UPLOAD)),
        "download" => Ok(Some(Node::DOWNLOAD)),
        "target" => Ok(Some(Node::TargetVelocity)),
        "sync" => Ok(Some(Node::Sync)),
        "turn" => Ok(None),
        _ => Err(format!("unknown subject '{name}': {NODES}")),
    }
}

/// A line, if it is a command.
fn readable(line: &str) -> Result<&str, String> {
    command(line).map(|_| line).map_err(|wrong| format!("profile: {wrong}"))
}
