//! The examples in `--help` work: each is run by a shell, against virtual modules in place of real ones.

use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Stdio;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};

use super::harness::{PATIENCE, Sim, command, run, tmcl_path};
use common::image as build;

/// Commands that go on until somebody ends them, by how they begin; here that is done as soon as they have printed
/// something, or after a moment.
const ENDLESS: [&str; 4] = ["tmcl sim", "tmcl monitor", "tmcl shell", "tmcl load {watch}"];
/// Examples that are not run, by how they begin, and why.
const NOT_RUN: [(&str, &str); 3] = [
    ("tmcl run stage.tmc --trace | less", "waits for keys"),
    ("tmcl tune stallguard tcp:", "takes a minute, and has a test of its own in tune.rs"),
    ("tmcl tune stallguard /dev/ttyACM0", "asks somebody at a terminal, who also holds the shaft"),
];

/// The links of examples to modules that are there.
const LINKS: [&str; 4] = ["slcan:/dev/ttyACM0", "/dev/ttyACM0", "/dev/ttyUSB0", "tcp:127.0.0.1:4140"];

/// How many commands are tried at a time.
const AT_A_TIME: usize = 8;

/// The text of a program that an example may be about, in the folder where it is run.
const PROGRAM: &str =
    "#include TMCLParam.tmc\nLoop: SAP APMaxPositioningSpeed, 0, 1000\n\tWAIT TICKS, 0, 1\n\tJA Loop\n";
const WORLD: &str = "[stage]\nleft = -51200\nright = 512000\n";

#[test]
fn every_command_has_examples_that_work() {
    let modules = ["--serial", "{}/usb", "--rs485", "{}/rs485", "--slcan", "{}/can", "--tcp", "127.0.0.1:0"];
    let modules = [&modules[..], &["--control", "127.0.0.1:0", "--product", "3110", "--modules", "3"]].concat();
    let commands = commands();
    assert!(commands.len() >= 17, "{commands:?}");
    // Most of them wait, so a few go on at a time; each command has modules of its own.
    let left = Mutex::new(commands.iter());
    let wrong = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            scope.spawn(|| {
                loop {
                    let Some(command) = left.lock().unwrap().next() else { break };
                    let sim = Sim::start(&modules);
                    let examples = examples(command);
                    assert!(!examples.is_empty(), "tmcl {command} --help has no example");
                    let is_run = |example: &&String| !NOT_RUN.iter().any(|(start, _)| example.starts_with(start));
                    let failed = examples.iter().filter(is_run).filter_map(|example| works(&sim, example).err());
                    wrong.lock().unwrap().extend(failed.collect::<Vec<_>>());
                }
            });
        }
    });
    let wrong = wrong.into_inner().unwrap();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// The comparison of an example with what is endless is worth something only if it finds both.
#[test]
fn what_is_endless_is_known() {
    assert!(is_endless("tmcl world 127.0.0.1:4141 \"watch 1 s rotor\"") && !is_endless("tmcl world 127.0.0.1:4141"));
    assert!(is_endless("tmcl sim --modules 3") && is_endless("tmcl load /dev/ttyACM0 a.tmc --run --watch"));
    assert!(!is_endless("tmcl send sim \"MST 0\"") && !is_endless("tmcl load /dev/ttyACM0 a.tmc"));
    assert!(!is_endless("tmcl monitor sim --count 5") && !is_endless("printf 'MST 0' | tmcl shell sim"));
}

fn is_endless(example: &str) -> bool {
    let watches = example.starts_with("tmcl load") && example.contains("--watch");
    let watches = watches || example.starts_with("tmcl world") && example.contains("\"watch ");
    let counts = example.contains("--count");
    watches || (!counts && ENDLESS.iter().any(|start| example.starts_with(start)))
}

/// The names of all commands, as `tmcl --help` lists them.
fn commands() -> Vec<String> {
    let help = String::from_utf8(run(&["--help"]).stdout).unwrap();
    let list = help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    // The explanation of a command stands behind its name, and may go on in further lines.
    let names = list.filter(|line| !line.starts_with("   ")).filter_map(|line| line.split_whitespace().next());
    names.filter(|name| *name != "help").map(String::from).collect()
}

/// The examples of a command. An example ends where its explanation begins, some spaces behind it.
fn examples(command: &str) -> Vec<String> {
    let help = String::from_utf8(run(&[command, "--help"]).stdout).unwrap();
    let lines = help.lines().skip_while(|line| *line != "Examples:").skip(1);
    let lines = lines.map_while(|line| line.strip_prefix("  "));
    let examples = lines.filter(|line| !line.starts_with(' '));
    let examples = examples.filter(|line| line.contains("tmcl "));
    examples.map(|line| line.split("  ").next().unwrap().trim().to_owned()).collect()
}

/// Runs an example with virtual modules at its links. Who asks a module waits for it, however busy this computer is. A
/// scan waits for those that are not there, too, so it does so for longer only if it has found nobody.
fn works(sim: &Sim, example: &str) -> Result<(), String> {
    if example.starts_with("tmcl scan") {
        let tried = ["", " --timeout 1000"].iter().any(|more| carry_out(sim, &format!("{example}{more}")).is_ok());
        return if tried { Ok(()) } else { carry_out(sim, &format!("{example} --timeout 8000")) };
    }
    let asked = LINKS.iter().find(|link| example.contains(*link));
    let patient = asked.map_or(example.into(), |link| example.replacen(link, &format!("{link} --timeout 60000"), 1));
    carry_out(sim, &patient)
}

/// Runs an example in a folder of its own. The error tells what it did instead of succeeding.
fn carry_out(sim: &Sim, example: &str) -> Result<(), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    furnish(folder.path());
    let port = |link: &str| sim.told(link).to_owned();
    let usb = sim.path("usb").display().to_string();
    let can = sim.path("can").display().to_string();
    let bus = sim.path("rs485").display().to_string();
    let line = example
        .replace("/tmp/", &format!("{}/", folder.path().display()))
        .replace("~/", &format!("{}/", folder.path().display()))
        .replace("slcan:/dev/ttyACM0", &format!("slcan:{can}"))
        .replace("/dev/ttyACM0", &usb)
        .replace("/dev/ttyUSB0", &bus)
        // As it is this takes ten seconds.
        .replace("--count 100 ", "--count 5 ");
    // A whole scan takes minutes.
    let is_whole_scan = line.starts_with("tmcl scan") && !line.contains("--addresses");
    let line = if is_whole_scan { line + " --addresses 1-4" } else { line };
    // A simulator takes ports of its own.
    let line = if line.starts_with("tmcl sim") {
        line.replace(":4140", ":0").replace(":4141", ":0")
    } else {
        line.replace("127.0.0.1:4140", &port("tcp")).replace("127.0.0.1:4141", &port("control"))
    };
    let program = Path::new(tmcl_path()).parent().unwrap().display().to_string();
    let search = format!("{program}:{}", std::env::var("PATH").unwrap());
    // The shell becomes the program where that is all, so that a signal reaches it.
    let line = if line.starts_with("tmcl ") && !line.contains(['|', '>', '&']) { format!("exec {line}") } else { line };
    let output = fs::File::create(path("output")).unwrap();
    let mut child = command("sh")
        .args(["-c", &line])
        .current_dir(folder.path())
        .env("PATH", search)
        .stdin(Stdio::null())
        .stdout(output.try_clone().unwrap())
        .stderr(output)
        .spawn()
        .unwrap();
    let said = || fs::read_to_string(path("output")).unwrap();
    let end = Instant::now() + PATIENCE;
    let mut signalled = false;
    let status = loop {
        if let Some(status) = child.try_wait().unwrap() {
            break status;
        }
        if Instant::now() > end {
            // It may have ended just now.
            let _ = child.kill();
            let _ = child.wait();
            return Err(format!("{example}: goes on\n{}", said()));
        }
        if is_endless(example) && !signalled && !said().is_empty() {
            signalled = true;
            rustix::process::kill_process(Pid::from_child(&child), Signal::INT).unwrap();
        }
        std::thread::sleep(Duration::from_millis(10));
    };
    let expected = if signalled && !example.starts_with("tmcl sim") { 130 } else { 0 };
    if status.code() == Some(expected) { Ok(()) } else { Err(format!("{example}\n{line}: {status}\n{}", said())) }
}

/// Puts what examples speak of into a folder.
fn furnish(folder: &Path) {
    let root = xtask::workspace().unwrap();
    for name in ["examples", "hal-sim"] {
        symlink(root.join(name), folder.join(name)).unwrap();
    }
    for (image, marker) in [("tmcm1140", build::image()), ("tmcm1140-canopen", build::canopen())] {
        let place = folder.join("target/thumbv7em-none-eabi/release").join(image);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        symlink(marker.canonicalize().unwrap(), place).unwrap();
    }
    fs::write(folder.join("stage.tmc"), PROGRAM).unwrap();
    fs::write(folder.join("routine.tmc"), "Back: MVP REL, 0, -100\n\tWAIT POS, 0, 0\n\tJC ZE, Back\n").unwrap();
    fs::write(folder.join("stage.toml"), WORLD).unwrap();
    fs::write(folder.join("stage.txt"), "== A move\nMVP ABS, 0, 1000\nwait 1 s until GAP 1, 0 = 1000\n").unwrap();
    fs::write(folder.join("axis.tmcl"), "SAP 4, 0, 1000\n").unwrap();
    let assembled = command(tmcl_path()).args(["asm", "stage.tmc"]).current_dir(folder).output();
    assert!(assembled.unwrap().status.success());
    for place in [".local/share/bash-completion/completions", ".zfunc", ".config/fish/completions"] {
        fs::create_dir_all(folder.join(place)).unwrap();
    }
}

#[test]
fn the_version_names_the_commit_of_the_checkout() {
    let output =
        command("git").args(["rev-parse", "--short=10", "HEAD"]).current_dir(xtask::workspace().unwrap()).output();
    let commit = output.ok().filter(|output| output.status.success()).map(|output| output.stdout);
    let expected = commit.map_or("a build of a checkout".into(), |commit| String::from_utf8(commit).unwrap());
    for option in ["-V", "--version"] {
        let said = String::from_utf8(run(&[option]).stdout).unwrap();
        assert!(
            said.starts_with(&format!("tmcl {} (", env!("CARGO_PKG_VERSION"))) && said.contains(expected.trim()),
            "{said}"
        );
    }
}
