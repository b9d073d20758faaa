//! Hosts that connect to the TCP ports of `tmcl sim`: too many, web pages, and those who never read.

use std::collections::HashSet;
use std::fs;
use std::io::{ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Instant;

use rustix::process::{Resource, Rlimit, getrlimit, prlimit};

use super::harness::{Controller, Host, PATIENCE, Sim, request};

const LINKS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
/// Connections at one time to one port, as `tmcl sim --help` tells.
const MOST: usize = 16;

#[test]
fn nothing_that_a_web_page_sends_is_carried_out() {
    let sim = Sim::start(&LINKS);
    let methods = ["GET", "HEAD", "POST", "PUT", "DELETE", "CONNECT", "OPTIONS", "TRACE", "PATCH", "PROPFIND", "MKCOL"];
    let mut firsts: Vec<String> = methods.iter().map(|method| format!("{method} / HTTP/1.1\r")).collect();
    firsts.extend(["PRI * HTTP/2.0\r".into(), "GET /".into(), format!("POST /{} HTTP/1.1\r", "x".repeat(5000))]);
    // Methods that few know, in any case, and however long what follows is.
    let odd = ["PROPFIND / http/1.1\r", "MKCOL /\r", "QUERY http://module/", "m-search * Http/1.1\r", "search /"];
    firsts.extend(odd.map(String::from));
    firsts.push(format!("PROPFIND x{} HTTP/1.1\r", "x".repeat(5000)));
    for first in firsts {
        let mut stream = TcpStream::connect(sim.told("control")).unwrap();
        stream.set_read_timeout(Some(PATIENCE)).unwrap();
        // It may be closed before all is written; how it is closed depends on what is on its way then.
        let _ = stream.write_all(format!("{first}\nHost: module\r\n\r\npress left\nstate\n").as_bytes());
        let mut answers = Vec::new();
        let _ = stream.read_to_end(&mut answers);
        assert_eq!(String::from_utf8_lossy(&answers), "", "{first:.20}");
    }
    let mut controller = Controller::new(&sim);
    assert_eq!(controller.ask("state")["switches"]["left"], false);
    // Whoever has begun otherwise is no browser.
    assert_eq!(controller.ask("GET / HTTP/1.1")["ok"], false);
    assert_eq!(controller.ask("press left")["ok"], true);
}

/// In each turn of the simulator time passes and everybody is served; what waits of a client's lines waits for the next
/// one.
#[test]
fn a_client_has_few_lines_carried_out_in_a_turn() {
    const LINES: usize = 600;
    let sim = Sim::start(&LINKS);
    let mut greedy = Controller::new(&sim);
    greedy.stream.write_all("state\n".repeat(LINES).as_bytes()).unwrap();
    let times: HashSet<u64> = (0..LINES).map(|_| greedy.answer().unwrap()["time_us"].as_u64().unwrap()).collect();
    // Four lines; a turn in which this computer was busy with something else may let no time pass.
    assert!(times.len() >= LINES / 8, "{} turns", times.len());
}

/// A host that has vanished, without a word, is noticed in the end: its connection is tried now and then.
#[test]
fn connections_are_tried_for_whether_anybody_is_there() {
    let sim = Sim::start(&[&LINKS[..], &["--slcan-tcp", "127.0.0.1:0"]].concat());
    for link in ["tcp", "control", "slcan-tcp"] {
        let port = |address: SocketAddr| format!(":{:04X}", address.port());
        let stream = TcpStream::connect(sim.told(link)).unwrap();
        let (from, to) = (port(stream.local_addr().unwrap()), port(stream.peer_addr().unwrap()));
        // The kernel's word for a timer that keeps a connection alive is 2.
        let is_tried = || {
            let table = fs::read_to_string("/proc/net/tcp").unwrap();
            table.lines().any(|line| {
                let words: Vec<&str> = line.split_whitespace().collect();
                let ends = |index: usize, port: &str| words.get(index).is_some_and(|word| word.ends_with(port));
                ends(1, &to) && ends(2, &from) && words.get(5).is_some_and(|timer| timer.starts_with("02:"))
            })
        };
        let end = Instant::now() + PATIENCE;
        while !is_tried() {
            assert!(Instant::now() < end, "{link}");
            std::thread::yield_now();
        }
    }
}

#[test]
fn commands_wait_until_the_answers_before_them_are_read() {
    const LINES: usize = 40_000;
    let sim = Sim::start(&LINKS);
    let mut greedy = Controller::new(&sim);
    let text = "state\n".repeat(LINES) + "press left\n";
    let mut writer = greedy.stream.try_clone().unwrap();
    let writing = std::thread::spawn(move || writer.write_all(text.as_bytes()).unwrap());
    // In each turn of the simulator some lines of each connection are taken.
    let mut other = Controller::new(&sim);
    for _ in 0..500 {
        assert_eq!(other.ask("state")["switches"]["left"], false);
    }
    for _ in 0..LINES {
        assert!(greedy.answer().unwrap()["time_us"].is_u64());
    }
    assert_eq!(greedy.answer().unwrap(), serde_json::json!({ "ok": true }));
    assert_eq!(other.ask("state")["switches"]["left"], true);
    writing.join().unwrap();
}

#[test]
fn who_reads_no_answers_is_not_listened_to_for_ever() {
    /// Far more than sockets hold.
    const LARGE: usize = 40 << 20;
    let sim = Sim::start(&LINKS);
    let mut greedy = TcpStream::connect(sim.told("control")).unwrap();
    greedy.set_nonblocking(true).unwrap();
    let mut other = Controller::new(&sim);
    let lines = "state\n".repeat(10_000);
    let mut written = 0;
    loop {
        match greedy.write(lines.as_bytes()) {
            Ok(count) => written += count,
            Err(error) => assert_eq!(error.kind(), ErrorKind::WouldBlock),
        }
        assert!(written < LARGE, "there is no end of what is taken");
        // The simulator has had many turns since, and there is no more room for a line.
        (0..50).for_each(|_| assert_eq!(other.ask("state")["ok"], true));
        if greedy.write(b"state\n").is_err() {
            return;
        }
    }
}

#[test]
fn the_controller_that_has_been_idle_longest_makes_room() {
    let sim = Sim::start(&LINKS);
    let mut all: Vec<Controller> = Vec::new();
    for _ in 0..MOST {
        let mut controller = Controller::new(&sim);
        assert_eq!(controller.ask("state")["ok"], true);
        all.push(controller);
    }
    assert_eq!(all[0].ask("state")["ok"], true);
    let mut late = Controller::new(&sim);
    assert_eq!(late.ask("state")["ok"], true);
    let farewell = all[1].answer().unwrap();
    assert!(farewell["error"].as_str().unwrap().contains("there are 16 connections"), "{farewell}");
    assert_eq!(all[1].answer(), None, "closed");
    for index in [0, 2, MOST - 1] {
        assert_eq!(all[index].ask("state")["ok"], true);
    }
}

#[test]
fn a_host_too_many_is_refused_at_once() {
    let sim = Sim::start(&LINKS);
    let mut all: Vec<Host<TcpStream>> = Vec::new();
    for _ in 0..MOST {
        let mut host = sim.tcp();
        host.ok("GAP 4, 0");
        all.push(host);
    }
    let mut late = sim.tcp();
    assert!(late.has_news(PATIENCE), "closed, not kept waiting");
    assert_eq!(late.0.read(&mut [0; 9]).unwrap(), 0);
    assert_eq!(all[0].ok("GAP 4, 0"), 1000);
    all.pop();
    let end = Instant::now() + PATIENCE;
    while {
        let mut next = sim.tcp();
        // It may be closed before this is written.
        let _ = next.0.write_all(&request("GAP 4, 0"));
        !next.0.read(&mut [0; 9]).is_ok_and(|count| count == 9)
    } {
        assert!(Instant::now() < end, "there is room again");
    }
}

#[test]
fn without_file_descriptors_it_sleeps_and_serves_who_is_there() {
    let sim = Sim::start(&LINKS);
    let process = format!("/proc/{}", sim.pid().as_raw_nonzero());
    let mut host = sim.tcp();
    host.ok("GAP 4, 0");
    let open = fs::read_dir(format!("{process}/fd")).unwrap();
    let highest = open.map(|fd| fd.unwrap().file_name().to_str().unwrap().parse::<u64>().unwrap()).max().unwrap();
    let limit = getrlimit(Resource::Nofile);
    let few = Rlimit { current: Some(highest + 1), maximum: limit.maximum };
    prlimit(Some(sim.pid()), Resource::Nofile, few).unwrap();
    let (mut late, mut controller) = (sim.tcp(), Controller::new(&sim));
    // Who never sleeps never leaves the processor of its own will.
    let naps = || -> u64 {
        let status = fs::read_to_string(format!("{process}/status")).unwrap();
        let count = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:")).unwrap();
        count.trim().parse().unwrap()
    };
    host.ok("GAP 4, 0");
    let (before, end) = (naps(), Instant::now() + PATIENCE);
    while naps() < before + 20 {
        assert!(Instant::now() < end, "a busy loop");
        std::thread::yield_now();
    }
    host.ok("GAP 4, 0");
    prlimit(Some(sim.pid()), Resource::Nofile, limit).unwrap();
    assert_eq!(late.ok("GAP 4, 0"), 1000);
    assert_eq!(controller.ask("state")["ok"], true);
}
