//! `tmcl sim --eeprom`: what is stored outlives the process.

use std::fs::{self, File, Permissions};
use std::io::{BufRead, BufReader};
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;

use rustix::fs::inotify::{self, CreateFlags, Reader, WatchFlags};
use rustix::fs::{CWD, Mode};
use rustix::process::{Resource, Rlimit, Signal, prlimit};

use super::harness::{Sim, complaint, names, run, tmcl};
use super::image::image;

const OPTIONS: [&str; 4] = ["--tcp", "127.0.0.1:0", "--eeprom", "{}/module.bin"];

/// Starting a simulator on this file fails and says this.
fn refused(path: &Path, said: &str) {
    let output = run(&["sim", "--exit-with-stdin", "--tcp", "127.0.0.1:0", "--eeprom", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1), "{}", path.display());
    let complaint = complaint(&output);
    assert!(complaint.contains("--eeprom: ") && complaint.contains(said), "{complaint}");
}

#[test]
fn settings_survive_the_process_and_its_violent_end() {
    let mut folder = tempfile::tempdir().unwrap();
    for (value, signal) in [(1100, Signal::TERM), (1200, Signal::KILL), (1300, Signal::INT)] {
        let sim = Sim::start_in(folder, &OPTIONS);
        let mut host = sim.tcp();
        host.ok(&format!("SAP 4, 0, {value}"));
        host.ok("STAP 4, 0");
        folder = sim.end(signal).1;
        assert_eq!(names(folder.path()), ["module.bin"]);
        assert_eq!(fs::metadata(folder.path().join("module.bin")).unwrap().len(), 16_384);
        let sim = Sim::start_in(folder, &OPTIONS);
        assert_eq!(sim.tcp().ok("GAP 4, 0"), value);
        folder = sim.end(Signal::TERM).1;
    }
}

#[test]
fn a_file_has_one_simulator_at_a_time() {
    let sim = Sim::start(&OPTIONS);
    let path = sim.path("module.bin");
    symlink(&path, sim.path("other name")).unwrap();
    fs::set_permissions(&path, Permissions::from_mode(0o640)).unwrap();
    // Each store makes the file anew.
    for value in [1100, 1200] {
        refused(&path, "is the EEPROM of another simulator that runs");
        refused(&sim.path("other name"), "is the EEPROM of another simulator that runs");
        sim.tcp().ok(&format!("SAP 4, 0, {value}"));
        sim.tcp().ok("STAP 4, 0");
    }
    let folder = sim.end(Signal::KILL).1;
    let sim = Sim::start_in(folder, &["--tcp", "127.0.0.1:0", "--eeprom", "{}/other name"]);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1200);
    // It is still the file, not the link to it, that is kept, and whoever could read it can.
    sim.tcp().ok("SGP 68, 0, 9");
    assert!(sim.path("other name").is_symlink());
    assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o640);
    refused(&path, "is the EEPROM of another simulator that runs");
}

/// No file is there yet that could be locked: still one of two that start together has it, and the other is told why
/// not.
#[test]
fn of_two_that_start_together_on_a_new_file_one_is_refused() {
    for round in 0..20 {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("module.bin");
        let mut command = tmcl(&["sim", "--tcp", "127.0.0.1:0", "--eeprom", path.to_str().unwrap()]);
        let mut both = [command.spawn().unwrap(), command.spawn().unwrap()];
        let ready = both.each_mut().map(|child| {
            let lines = BufReader::new(child.stdout.take().unwrap()).lines();
            lines.map_while(Result::ok).any(|line| line == "ready")
        });
        let said = both.map(|mut child| {
            child.kill().unwrap();
            complaint(&child.wait_with_output().unwrap())
        });
        assert_eq!(ready.iter().filter(|ready| **ready).count(), 1, "round {round}: {said:?}");
        let refusals = said.iter().filter(|said| said.contains("is the EEPROM of another simulator that runs"));
        assert_eq!(refusals.count(), 1, "round {round}: {said:?}");
        assert_eq!(names(folder.path()), ["module.bin"]);
    }
}

/// Stores go well, then fail while `spoil` has had its way with the simulator and its folder, and go well again after
/// `mend`. What was answered with 100 is there after a violent end.
fn outage(options: &[&str], spoil: impl Fn(&Sim), mend: impl Fn(&Sim)) {
    let messages = tempfile::NamedTempFile::new().unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("kept")).unwrap();
    let options = [options, &["--tcp", "127.0.0.1:0", "--eeprom", "{}/kept/module.bin"]].concat();
    let sim = Sim::start_saying(folder, &options, messages.reopen().unwrap().into());
    let mut host = sim.tcp();
    let mut store = |value: i32| {
        host.ok(&format!("SAP 4, 0, {value}"));
        let status = host.ask("STAP 4, 0").status;
        host.ok("RSAP 4, 0");
        (status, host.ok("GAP 4, 0"))
    };
    let said = || fs::read_to_string(messages.path()).unwrap();
    assert_eq!(store(1100), (100, 1100));
    assert_eq!(said(), "");
    spoil(&sim);
    assert_eq!([store(1200), store(1300)], [(5, 1100); 2], "a store that failed changes nothing");
    assert_eq!(said().matches("--eeprom: cannot write").count(), 1, "told once: {}", said());
    mend(&sim);
    assert_eq!([store(1400), store(1500)], [(100, 1400), (100, 1500)]);
    assert_eq!(said().matches("is written again").count(), 1, "{}", said());
    spoil(&sim);
    assert_eq!(store(1600), (5, 1500));
    assert_eq!(said().matches("--eeprom: cannot write").count(), 2, "told again: {}", said());
    mend(&sim);
    let folder = sim.end(Signal::KILL).1;
    assert_eq!(names(&folder.path().join("kept")), ["module.bin"]);
    let sim = Sim::start_in(folder, &options);
    assert_eq!(sim.tcp().ok("GAP 4, 0"), 1500);
}

fn take_away(sim: &Sim) {
    fs::rename(sim.path("kept"), sim.path("away")).unwrap();
}

fn bring_back(sim: &Sim) {
    fs::rename(sim.path("away"), sim.path("kept")).unwrap();
}

#[test]
fn without_its_folder_a_store_is_answered_with_status_5() {
    outage(&[], take_away, bring_back);
}

#[test]
fn the_image_notices_too_that_its_store_is_lost() {
    outage(&["--image", image()], take_away, bring_back);
}

#[test]
fn with_a_full_disk_a_store_is_answered_with_status_5() {
    let limit = |sim: &Sim, current| {
        prlimit(Some(sim.pid()), Resource::Fsize, Rlimit { current, maximum: None }).unwrap();
    };
    // Files of this process may have half the bytes of an EEPROM.
    outage(&[], |sim| limit(sim, Some(8192)), |sim| limit(sim, None));
}

#[test]
fn a_file_that_has_taken_the_place_of_ours_stays() {
    let sim = Sim::start(&OPTIONS);
    let path = sim.path("module.bin");
    fs::rename(&path, sim.path("moved")).unwrap();
    fs::write(&path, "somebody else's").unwrap();
    assert_eq!(sim.tcp().ask("SGP 68, 0, 7").status, 5);
    assert_eq!(fs::read_to_string(&path).unwrap(), "somebody else's");
    // One that was removed comes back whole.
    fs::remove_file(&path).unwrap();
    sim.tcp().ok("SGP 68, 0, 8");
    assert_eq!(fs::metadata(&path).unwrap().len(), 16_384);
}

#[test]
fn nobody_can_foresee_the_name_of_the_new_file() {
    let sim = Sim::start(&OPTIONS);
    let watch = inotify::init(CreateFlags::NONBLOCK).unwrap();
    inotify::add_watch(&watch, sim.folder.path(), WatchFlags::CREATE).unwrap();
    sim.tcp().ok("SGP 68, 0, 7");
    sim.tcp().ok("SGP 68, 0, 8");
    let mut buffer = [std::mem::MaybeUninit::uninit(); 4096];
    let mut events = Reader::new(&watch, &mut buffer);
    let mut made: Vec<String> = Vec::new();
    while let Ok(event) = events.next() {
        made.push(event.file_name().unwrap().to_str().unwrap().into());
    }
    assert_eq!(made.len(), 2, "{made:?}");
    assert_ne!(made[0], made[1]);
    let pid = sim.pid().as_raw_nonzero().to_string();
    assert!(made.iter().all(|name| name.starts_with("module.bin.") && !name.contains(&pid)), "{made:?}");
    assert_eq!(names(sim.folder.path()), ["module.bin"]);
}

/// New files that a simulator has left, because it was killed while it wrote, are removed by the next one. A file that
/// is not surely such a file of this EEPROM stays.
#[test]
fn new_files_of_a_simulator_that_was_killed_are_removed() {
    let stray = |name: &str| format!("{name}.0123456789abcdef.new");
    let others = [
        stray("module.bin.2"),
        stray("other.bin"),
        "module.bin.0123456789ABCDEF.new".into(),
        "module.bin.0123456789abcde.new".into(),
        "module.bin.0123456789abcdefg.new".into(),
        "module.bin.new".into(),
        "module.bin.0123456789abcdef".into(),
        // It is larger than an EEPROM.
        "module.bin.00000000000000aa.new".into(),
        // Somebody writes it.
        "module.bin.00000000000000bb.new".into(),
        // It leads elsewhere.
        "module.bin.00000000000000cc.new".into(),
        // It is a folder.
        "module.bin.00000000000000dd.new".into(),
    ];
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    for name in &others[..7] {
        fs::write(path(name), [0xFF; 16_384]).unwrap();
    }
    fs::write(path(&others[7]), [0xFF; 16_385]).unwrap();
    let busy = File::create(path(&others[8])).unwrap();
    busy.lock().unwrap();
    symlink(path("other"), path(&others[9])).unwrap();
    fs::write(path("other"), "somebody else's").unwrap();
    fs::create_dir(path(&others[10])).unwrap();
    let mut expected: Vec<String> = others.iter().cloned().chain(["module.bin".into(), "other".into()]).collect();
    expected.sort();
    // Half a file, all of it, and nothing yet; with a file of the EEPROM and, the first time, without one.
    let mut folder = folder;
    for _ in 0..2 {
        for (number, length) in [(1, 0), (2, 300), (3, 16_384)] {
            let name = format!("module.bin.{number:016x}.new");
            fs::write(folder.path().join(name), vec![0; length]).unwrap();
        }
        let sim = Sim::start_in(folder, &OPTIONS);
        assert_eq!(names(sim.folder.path()), expected);
        folder = sim.end(Signal::KILL).1;
    }
    drop(busy);
}

#[test]
fn what_cannot_be_an_eeprom_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("thesis.txt"), "irreplaceable").unwrap();
    refused(&path("thesis.txt"), "has 13 bytes, the EEPROM of a TMCM-1140 has 16384");
    assert_eq!(fs::read_to_string(path("thesis.txt")).unwrap(), "irreplaceable");
    // Nobody would live to see the end of reading it.
    File::create(path("huge")).unwrap().set_len(1 << 40).unwrap();
    refused(&path("huge"), "has 1099511627776 bytes");
    fs::write(path("read-only"), [0xFF; 16_384]).unwrap();
    fs::set_permissions(path("read-only"), Permissions::from_mode(0o444)).unwrap();
    refused(&path("read-only"), "is read-only");
    rustix::fs::mkfifoat(CWD, path("pipe"), Mode::RWXU).unwrap();
    for name in [path("pipe").as_path(), folder.path(), Path::new("/dev/zero")] {
        refused(name, "is no file");
    }
    symlink("nowhere", path("link")).unwrap();
    refused(&path("link"), "cannot be read");
    assert_eq!(names(folder.path()), ["huge", "link", "pipe", "read-only", "thesis.txt"]);
}

#[test]
fn a_file_that_cannot_be_made_is_told_at_once() {
    let folder = tempfile::tempdir().unwrap();
    refused(&folder.path().join("missing/module.bin"), "cannot write");
}
