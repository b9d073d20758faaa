//! Every tool with links that cannot be opened, ports that are in use, and modules that answer late, rubbish, or not at
//! all.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Mutex;
use std::time::Duration;

use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::bad_input::{Folder, all_right, carry_out, wrong};
use super::harness::{Sim, tmcl};

/// A tool with its arguments, where `{link}` and the names of files in the folder of the test stand for what they are;
/// and what is typed into it.
pub(crate) struct Tool {
    pub(crate) arguments: &'static [&'static str],
    pub(crate) typed: &'static str,
}

const fn tool(arguments: &'static [&'static str]) -> Tool {
    Tool { arguments, typed: "" }
}

/// Everything that talks to a module.
pub(crate) const LINKED: [Tool; 18] = [
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

/// A peer at the other end of a link that is no good module.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Peer {
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
    pub(crate) fn start(self) -> String {
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
