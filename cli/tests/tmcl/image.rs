//! `tmcl sim --image`: the flash image behind the same links.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::OnceLock;
use std::time::Instant;

use rustix::process::Signal;
use tmcm::tmcl::binary;

use super::harness::{SILENCE, Sim, complaint, request, run, tmcl_path};
use common::image as build;

pub(crate) const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];
pub(crate) const CONTROL: [&str; 2] = ["--control", "127.0.0.1:0"];

/// Where the image is.
pub(super) fn image() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| build::image().to_str().unwrap().into())
}

/// Starts a module that runs it.
pub(crate) fn start(arguments: &[&[&str]]) -> Sim {
    Sim::start(&[&["--image", image()], arguments.concat().as_slice()].concat())
}

/// The output of `tmcl send`.
fn send(link: &str, address: &str, command: &str) -> String {
    let output = run(&["send", link, "--timeout", "60000", "--address", address, command]);
    assert!(output.status.success(), "{link}: {command}: {}", complaint(&output));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn it_answers_and_moves_on_every_link() {
    let sim = start(&[&TCP, &CONTROL, &["--serial", "{}/usb", "--rs485", "{}/rs485", "--slcan", "{}/slcan"]]);
    let mut host = sim.serial();
    // Changed at one link, seen at the others.
    assert_eq!(host.ok("SAP 4, 0, 1500"), 1500);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1500);
    for link in [sim.told("rs485").into(), format!("slcan:{}", sim.told("slcan"))] {
        assert!(send(&link, "1", "GAP 4, 0").starts_with("GAP 4, 0: 1500 "), "{link}");
    }
    host.ok("MVP ABS, 0, 25600");
    host.until("GAP 8, 0", 1);
    let state = sim.control(&["press left", "state"]);
    assert_eq!((&state["rotor"], &state["switches"]["left"]), (&25_600.into(), &true.into()));
    host.until("GAP 11, 0", 1);
    assert_eq!(sim.end(Signal::TERM).0.code(), Some(0));
}

#[test]
fn telegrams_may_come_in_pieces_and_rubbish_ends_with_a_silence() {
    let sim = start(&[&TCP, &CONTROL]);
    let mut host = sim.tcp();
    for cut in [1, 5, 8] {
        let telegram = request("GAP 4, 0");
        let (head, tail) = telegram.split_at(cut);
        host.write(head);
        let begun = Instant::now();
        // Much longer than the firmware waits, but not than TCP is waited for.
        std::thread::sleep(SILENCE / 6);
        host.write(tail);
        // Else this test itself was held up: the telegram may be torn or not.
        if begun.elapsed() < SILENCE / 2 || host.has_news(SILENCE) {
            assert_eq!(binary::decode_reply(&host.read()).unwrap().value, 1000);
        }
    }
    host.write(b"rub");
    sim.has_looked();
    std::thread::sleep(SILENCE);
    sim.has_looked();
    assert_eq!(host.ok("GAP 4, 0"), 1000);
}

#[test]
fn everybody_gets_its_own_replies() {
    let sim = start(&[&TCP, &["--serial", "{}/usb"]]);
    let (mut first, mut second, mut third) = (sim.tcp(), sim.tcp(), sim.serial());
    for n in 0..10 {
        second.write(&request(&format!("SGP 68, 0, {n}")));
        first.write(&request("GAP 5, 0"));
        third.write(&request(&format!("SGP 9, 2, {n}")));
        let replies = [first.read(), second.read(), third.read()].map(|reply| {
            let reply = binary::decode_reply(&reply).unwrap();
            (reply.status, reply.opcode, reply.value)
        });
        assert_eq!(replies, [(100, 6, 1000), (100, 9, n), (100, 9, n)]);
    }
}

#[test]
fn what_is_stored_survives_power_and_process() {
    let options = [&["--image", image(), "--eeprom", "{}/module.bin"][..], &TCP, &CONTROL].concat();
    let sim = Sim::start(&options);
    let mut host = sim.tcp();
    host.ok("SAP 4, 0, 1234");
    host.ok("STAP 4, 0");
    host.ok("SAP 4, 0, 77");
    assert_eq!(sim.control(&["power off", "state"])["power"], false);
    assert_eq!(sim.control(&["power on", "state"])["power"], true);
    // The bytes wait until the module is up and its USB port open again.
    assert_eq!(host.ok("GAP 4, 0"), 1234);
    let folder = sim.end(Signal::KILL).1;
    let sim = Sim::start_in(folder, &options);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1234);
}

#[test]
fn a_usb_cable_that_was_out_leaves_nothing_behind() {
    let sim = start(&[&TCP, &CONTROL]);
    let mut host = sim.tcp();
    host.ok("SAP 4, 0, 1500");
    host.write(&request("SAP 4, 0, 1600")[..5]);
    sim.control(&["usb off"]);
    host.write(&request("SAP 4, 0, 1700"));
    assert!(!host.has_news(SILENCE));
    sim.control(&["usb on"]);
    // The bytes wait until the port is open again.
    assert_eq!(host.ok("GAP 4, 0"), 1500);
}

#[test]
fn several_modules_share_the_buses() {
    let sim = start(&[&["--modules", "2", "--rs485", "{}/rs485", "--slcan", "{}/slcan"]]);
    for link in [sim.told("rs485").into(), format!("slcan:{}", sim.told("slcan"))] {
        for number in ["1", "2"] {
            assert!(send(&link, number, "GGP 66, 0").starts_with(&format!("GGP 66, 0: {number} ")), "{link}");
        }
    }
}

#[test]
fn the_log_is_printed_if_it_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("log");
    let log = |options: &[&str]| {
        let options = [&["--image", image()], options, &TCP].concat();
        let sim = Sim::start_saying(tempfile::tempdir().unwrap(), &options, File::create(&path).unwrap().into());
        sim.tcp().ok("GAP 4, 0");
        sim.end(Signal::TERM);
        std::fs::read_to_string(&path).unwrap()
    };
    let lines = log(&["--log"]);
    let line = lines.lines().find(|line| line.ends_with("info: module runs at address 1")).unwrap();
    let (_, rest) = line.split_once("tmcl sim: ").unwrap();
    let (time, _) = rest.split_once(' ').unwrap();
    assert!(time.parse::<f64>().is_ok_and(|seconds| seconds > 0.0), "{line}");
    assert!(!log(&[]).contains("info"));
    let output = run(&["sim", "--log"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("--image"), "{}", complaint(&output));
}

#[test]
fn a_file_that_is_no_image_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, contents: Option<&[u8]>| {
        let path = folder.path().join(name);
        contents.into_iter().for_each(|contents| std::fs::write(&path, contents).unwrap());
        let output = run(&["sim", "--image", path.to_str().unwrap()]);
        assert_eq!(output.status.code(), Some(1), "{name}");
        assert!(complaint(&output).contains("cargo fw"), "{}", complaint(&output));
        complaint(&output)
    };
    assert!(refused("missing", None).contains("--image: ") && refused("missing", None).contains("cannot be read"));
    assert!(refused("text", Some(b"no ELF")).contains("the image cannot be used"));
    let host = std::fs::read(tmcl_path()).unwrap();
    assert!(refused("host", Some(&host)).contains("the image cannot be used"));
    assert!(refused("crash", Some(&crashing())).contains("the core is locked up"));
}

/// The image with addresses where there is no code: for the start, and for what a fault leads to.
fn crashing() -> Vec<u8> {
    let mut elf = Vec::new();
    File::open(Path::new(image())).unwrap().read_to_end(&mut elf).unwrap();
    // The vector table begins with the end of the stack, 16 KiB of RAM, and the start, which is in flash.
    let begins = |words: &[u8]| words[..4] == 0x2000_4000_u32.to_le_bytes() && words[6..] == [0x00, 0x08];
    let stack = elf.windows(8).position(begins).unwrap();
    // Near the end of flash, where nothing is.
    elf[stack + 4..stack + 8].copy_from_slice(&0x080F_F001_u32.to_le_bytes());
    elf[stack + 8..stack + 16].fill(0);
    elf
}

/// The image has no built-in encoder: each module says so once if a host reads its parameters, on whatever link.
#[test]
fn who_reads_the_built_in_encoder_is_warned_once() {
    let folder = tempfile::tempdir().unwrap();
    let messages = folder.path().join("messages");
    let links = [&TCP[..], &["--modules", "3", "--rs485", "{}/rs485", "--slcan", "{}/slcan"]].concat();
    let arguments = [&["--image", image()], links.as_slice()].concat();
    let sim = Sim::start_saying(folder, &arguments, File::create(&messages).unwrap().into());
    for line in ["GAP 4, 0", "GAP 215, 0", "GAP 209, 0", "GAP 215, 0"] {
        sim.tcp().ok(line);
    }
    send(sim.told("rs485"), "2", "GAP 209, 0");
    send(&format!("slcan:{}", sim.told("slcan")), "3", "GAP 215, 0");
    let (_, _folder) = sim.end(Signal::TERM);
    let told = std::fs::read_to_string(&messages).unwrap();
    let told: Vec<_> = told.lines().filter(|line| line.contains("built-in encoder")).collect();
    assert_eq!(told.len(), 3, "{told:?}");
    for (module, line) in (1..).zip(told) {
        let parameter = if module == 2 { 209 } else { 215 };
        let start = format!("tmcl sim: module {module}: parameter {parameter} was read, which is always 0 here: ");
        assert!(line.starts_with(&start), "{line}");
    }
}
