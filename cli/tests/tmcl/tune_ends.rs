//! `tmcl tune` ended by signals, by links that fail and by readers that go away: what it touched is as before.

use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};
use tmcm::tmcl::binary::TELEGRAM;

use super::harness::{PATIENCE, Sim, complaint, run, tmcl};
use super::tune::{assert_left_in_peace, example, module, settings, ways};

/// A measurement that has begun: the motor has been seen to turn.
fn begun(sim: &Sim, link: &str) -> Child {
    let control = sim.told("control");
    let child = tmcl(&["tune", "stallguard", link, "--control", control, "--yes", "--speeds", "800"]).spawn().unwrap();
    let end = Instant::now() + PATIENCE;
    while sim.control(&["state"])["velocity"] == 0 {
        assert!(Instant::now() < end, "the motor does not turn");
    }
    child
}

#[test]
fn a_signal_stops_the_motor_and_puts_everything_back() {
    let sim = module("1140");
    let before = settings(&sim);
    for (signal, code) in [(Signal::INT, 130), (Signal::TERM, 143), (Signal::HUP, 129)] {
        let child = begun(&sim, &ways(&sim).0);
        std::thread::sleep(Duration::from_millis(200));
        rustix::process::kill_process(Pid::from_child(&child), signal).unwrap();
        let output = child.wait_with_output().unwrap();
        assert_eq!(output.status.code(), Some(code), "{}", complaint(&output));
        assert!(
            complaint(&output).contains("all settings are as before, and the motor stands at "),
            "{}",
            complaint(&output)
        );
        assert_left_in_peace(&sim, &before);
    }
}

/// The load of a virtual motor is a setting of its world, and is put back like the others.
#[test]
fn a_signal_takes_the_load_away() {
    let sim = module("1140");
    let load = || sim.control(&["state"])["load"].as_f64().unwrap();
    sim.control(&["load 0.01"]);
    let before = load();
    let (link, control) = ways(&sim);
    let child =
        tmcl(&["tune", "stallguard", &link, "--control", &control, "--yes", "--speeds", "2000"]).spawn().unwrap();
    let end = Instant::now() + PATIENCE;
    while load() == before {
        assert!(Instant::now() < end, "the motor is not loaded");
    }
    rustix::process::kill_process(Pid::from_child(&child), Signal::TERM).unwrap();
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(143));
    assert_eq!(load(), before);
}

/// A cable between the program and a module, which fails.
struct Cable {
    link: String,
    /// Number of telegrams that still pass before it fails.
    left: Arc<AtomicUsize>,
    /// After it has failed it can be connected to again.
    mends: Arc<AtomicBool>,
}

impl Cable {
    fn to(address: &str) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let link = format!("tcp:{}", listener.local_addr().unwrap());
        let (left, mends) = (Arc::new(AtomicUsize::new(usize::MAX)), Arc::new(AtomicBool::new(true)));
        let (module, telegrams, mending) = (address.to_owned(), Arc::clone(&left), Arc::clone(&mends));
        std::thread::spawn(move || {
            for host in listener.incoming() {
                carry(host.unwrap(), TcpStream::connect(&module).unwrap(), &telegrams);
                if !mending.load(Ordering::SeqCst) {
                    return;
                }
                telegrams.store(usize::MAX, Ordering::SeqCst);
            }
        });
        Cable { link, left, mends }
    }

    fn fail(&self, mends: bool) {
        self.mends.store(mends, Ordering::SeqCst);
        self.left.store(20, Ordering::SeqCst);
    }
}

/// Carries telegrams to and fro until either side or the cable fails.
fn carry(mut host: TcpStream, mut module: TcpStream, left: &AtomicUsize) {
    let mut telegram = [0; TELEGRAM];
    while left.load(Ordering::SeqCst) > 0 {
        if host.read_exact(&mut telegram).is_err()
            || module.write_all(&telegram).is_err()
            || module.read_exact(&mut telegram).is_err()
            || host.write_all(&telegram).is_err()
        {
            return;
        }
        left.fetch_sub(1, Ordering::SeqCst);
    }
}

#[test]
fn a_link_that_fails_for_a_moment_is_opened_again() {
    let sim = module("1140");
    let before = settings(&sim);
    let cable = Cable::to(sim.told("tcp"));
    let child = begun(&sim, &cable.link);
    cable.fail(true);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert!(
        complaint(&output).contains("; all settings are as before, and the motor stands at "),
        "{}",
        complaint(&output)
    );
    assert_left_in_peace(&sim, &before);
}

#[test]
fn what_could_not_be_put_back_is_said_as_commands() {
    let sim = module("1140");
    let cable = Cable::to(sim.told("tcp"));
    let child = begun(&sim, &cable.link);
    cable.fail(false);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    let message = complaint(&output);
    // Who waits is told for what.
    assert_eq!(message.matches("trying for up to 10 seconds to put its settings back").count(), 1, "{message}");
    for command in ["MST 0", "SAP 4, 0, 1200", "SAP 173, 0, 1", "SAP 174, 0, -3", "SAP 172, 0, 4", "SAP 181, 0, 1500"] {
        assert!(message.contains(command), "{command}: {message}");
    }
    // What it says to send helps.
    let commands = message.rsplit_once("send ").unwrap().1.trim();
    let mut host = sim.tcp();
    for command in commands.split("; ") {
        host.ok(command);
    }
    host.until("GAP 3, 0", 0);
    assert_eq!((host.ok("GAP 4, 0"), host.ok("GAP 181, 0")), (1200, 1500));
}

/// A drawing is replaced by a complete one, and not by a measurement that fails.
#[test]
fn an_older_drawing_stays_until_there_is_a_new_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("old.svg");
    std::fs::write(&path, "old").unwrap();
    let plot = path.to_str().unwrap();
    let world = example("toml");
    let output =
        run(&["tune", "stallguard", "sim", "--world", &world, "--speeds", "800", "--load", "0.9", "--plot", plot]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    let sim = module("1140");
    let link = ways(&sim).0;
    let child = tmcl(&["tune", "stallguard", &link, "--control", sim.told("control"), "--yes", "--plot", plot]).spawn();
    let child = child.unwrap();
    let end = Instant::now() + PATIENCE;
    while sim.control(&["state"])["velocity"] == 0 {
        assert!(Instant::now() < end, "the motor does not turn");
    }
    rustix::process::kill_process(Pid::from_child(&child), Signal::TERM).unwrap();
    assert_eq!(child.wait_with_output().unwrap().status.code(), Some(143));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
}

/// Nobody reads the result any more: quiet, but only after all has been put back.
#[test]
fn a_closed_pipe_changes_nothing() {
    let sim = module("1140");
    let before = settings(&sim);
    let (link, control) = ways(&sim);
    let mut child = tmcl(&["tune", "stallguard", &link, "--control", &control, "--yes", "--speeds", "2000"])
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    assert_eq!(child.wait().unwrap().code(), Some(141));
    assert_left_in_peace(&sim, &before);
}
