//! `tmcl monitor`: live values.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpListener;
use std::process::Stdio;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use rustix::fs::{Mode, OFlags};
use rustix::process::{Pid, Signal};
use rustix::pty::OpenptFlags;
use rustix::termios::Winsize;

use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Command, Opcode, Reply, Status};

use super::harness::{Sim, complaint, run, tmcl};
use super::pty::Terminal;

/// A TMCM-1140 that answers as a test wants it, and after as long; without an answer it hangs up. Gives the name of the
/// link to it.
fn module(mut answer: impl FnMut(Command) -> Option<i32> + Send + 'static) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        let mut request = [0; TELEGRAM];
        while stream.read_exact(&mut request).is_ok() {
            let command = binary::decode_command(&request).unwrap();
            let reply = match answer(command) {
                Some(value) => Reply::Plain { status: Status::Ok, opcode: command.opcode, value },
                None => return,
            };
            stream.write_all(&binary::encode_reply(2, 1, &reply)).unwrap();
        }
    });
    link
}

/// True for the command that reads this parameter of an axis.
fn reads(command: Command, number: u8) -> bool {
    command.opcode == Opcode::Gap as u8 && command.kind == number
}

/// After each second sample of the position of this module the other parameters take half a second. The times of the
/// rows have to tell when the position was read, not when the row was complete. It was read after the reply before it,
/// and before the next parameter was asked for; however long that takes on a busy computer.
#[test]
fn a_row_is_stamped_when_its_position_was_read() {
    let start = Instant::now();
    let seconds = move || start.elapsed().as_secs_f64();
    let read = Arc::new(Mutex::new(Vec::<[f64; 2]>::new()));
    let (times, mut replied, mut is_next) = (Arc::clone(&read), seconds(), false);
    let link = module(move |command| {
        let mut times = times.lock().unwrap();
        if std::mem::take(&mut is_next) {
            times.last_mut().unwrap()[1] = seconds();
        }
        if reads(command, 1) {
            times.push([replied, f64::INFINITY]);
            is_next = true;
        }
        if reads(command, 12) || reads(command, 206) && times.len() % 2 == 0 {
            std::thread::sleep(Duration::from_millis(500));
        }
        replied = seconds();
        Some(0)
    });
    let output =
        run(&["monitor", &link, "--product", "1140", "--axis", "0", "--csv", "--interval", "0", "--count", "4"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let stamps: Vec<f64> = text.lines().skip(1).map(|line| line.split(',').next().unwrap().parse().unwrap()).collect();
    let read = read.lock().unwrap().clone();
    // The module may have been asked for the position before.
    let read = &read[read.len() - stamps.len()..];
    for (row, [after, before]) in read.iter().enumerate() {
        // The file has its times in milliseconds.
        let (least, most) = (after - read[0][1] - 0.002, before - read[0][0] + 0.002);
        let stamp = stamps[row] - stamps[0];
        assert!((least..=most).contains(&stamp), "row {row} at {stamp}, not from {least} to {most}: {text}");
    }
}

/// The sum of the late samples is what a user has to know, once, whatever becomes of the samples.
#[test]
fn an_interval_that_cannot_be_kept_is_told_once() {
    let link = module(|command| {
        std::thread::sleep(Duration::from_millis(if reads(command, 206) { 50 } else { 0 }));
        Some(0)
    });
    let output =
        run(&["monitor", &link, "--product", "1140", "--axis", "0", "--interval", "10", "--count", "6", "--csv"]);
    assert!(output.status.success());
    let told = complaint(&output);
    let took = told.strip_prefix("tmcl: --interval 10: a sample takes ").unwrap_or_else(|| panic!("{told}"));
    let (took, rest) = took.split_once(" ms over this link, so there is one about every ").unwrap();
    assert!(took.parse::<u32>().unwrap() >= 50 && rest.starts_with(took), "{told}");
    assert_eq!(told.lines().count(), 1, "{told}");
    let output = run(&["monitor", "sim", "--interval", "100", "--count", "4", "--csv"]);
    assert_eq!(complaint(&output), "");
}

#[test]
fn a_module_that_vanishes_ends_the_line_before_the_message() {
    let mut asked = 0;
    let link = module(move |_| {
        asked += 1;
        (asked < 40).then_some(7)
    });
    let mut terminal = Terminal::start(&["monitor", &link, "--product", "1140", "--axis", "0", "--interval", "1"]);
    terminal.expect("position           7");
    let shown = terminal.expect("tmcl: ");
    assert!(shown.ends_with("\x1b[K\r\ntmcl: "), "{shown:?}");
    let (status, _) = terminal.end();
    assert_eq!(status.code(), Some(1));
}

#[test]
fn parameters_of_ones_own_choice_are_columns() {
    let lines = |options: &[&str]| {
        let output = run(&[&["monitor", "sim", "--count", "2", "--interval", "50"], options].concat());
        assert!(output.status.success(), "{}", complaint(&output));
        let text = String::from_utf8(output.stdout).unwrap();
        text.lines().map(str::to_owned).collect::<Vec<_>>()
    };
    // Parameters 6 and 7 are 128 and 8 of a new TMCM-1140 (manual, chapter 4).
    let csv = lines(&["--params", "1,6,7,206", "--csv"]);
    assert_eq!(csv[0], "time_s,position,maximum_current,standby_current,load");
    assert_eq!((csv.len(), csv[1].split_once(',').unwrap().1), (3, "0,128,8,0"));
    // The clock is that of the virtual module.
    assert!(csv[2].starts_with("0.05"), "{csv:?}");
    let several = lines(&["--params", "1,206", "--csv", "--product", "3110", "--axis", "0,2"]);
    assert_eq!(several[0], "time_s,position_0,load_0,position_2,load_2");
    assert_eq!(lines(&["--params", "1,7"])[0], "position 0  standby_current 8");
    let output = run(&["monitor", "sim", "--params", "1,99"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("GAP 99, 0: status 3"), "{}", complaint(&output));
    assert_eq!(run(&["monitor", "sim", "--params", "1,256"]).status.code(), Some(2));
}

#[test]
fn samples_are_objects() {
    let options = ["--product", "6110", "--axis", "0,5", "--params", "1,8", "--json", "--count", "2"];
    let output = run(&[&["monitor", "sim"], &options[..]].concat());
    let text = String::from_utf8(output.stdout).unwrap();
    let objects: Vec<serde_json::Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(objects.iter().map(|object| &object["axis"]).collect::<Vec<_>>(), [0, 5, 0, 5]);
    assert!(objects.iter().all(|object| object["position"] == 0 && object.as_object().unwrap().len() == 4), "{text}");
    assert!(objects[2]["time_s"].as_f64().unwrap() >= 0.1, "{text}");
    assert_eq!(run(&["monitor", "sim", "--json", "--csv"]).status.code(), Some(2));
}

#[test]
fn samples_are_lines_of_numbers() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    sim.control(&["press left"]);
    sim.tcp().ok("MVP ABS, 0, 100");
    sim.tcp().until("GAP 8, 0", 1);
    sim.tcp().until("GAP 208, 0", 128);
    let output = run(&["monitor", &link, "--csv", "--interval", "1", "--count", "3"]);
    assert!(output.status.success(), "{}", complaint(&output));
    let text = String::from_utf8(output.stdout).unwrap();
    let mut lines = text.lines();
    let headline = "time_s,position,speed,load,driver_flags,extended_flags,left_switch,right_switch,home_switch";
    assert_eq!(lines.next(), Some(headline));
    let values: Vec<&str> = lines.map(|line| line.split_once(',').unwrap().1).collect();
    assert_eq!(values, ["100,0,0,128,0,1,0,0"; 3]);
    let output = run(&["monitor", &link, "--count", "1"]);
    let line = String::from_utf8(output.stdout).unwrap();
    assert_eq!(line, "position         100  speed     0 int  load    0  switches left  driver STST  errors -\n");
}

#[test]
fn an_interrupt_ends_it_well() {
    let sim = Sim::start(&["--tcp", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    let mut monitor = tmcl(&["monitor", &link, "--csv"]).spawn().unwrap();
    let mut lines = BufReader::new(monitor.stdout.take().unwrap()).lines();
    assert!(lines.next().unwrap().unwrap().starts_with("time_s,"));
    assert!(lines.next().unwrap().unwrap().ends_with(",0,0,0,128,0,0,0,0"));
    rustix::process::kill_process(Pid::from_child(&monitor), Signal::INT).unwrap();
    assert_eq!(monitor.wait().unwrap().code(), Some(130));
}

#[test]
fn an_axis_that_is_not_there_is_told() {
    let output = run(&["monitor", "sim", "--axis", "1"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("--axis 1: the module has axis 0 only"), "{}", complaint(&output));
}

#[test]
fn several_axes_are_shown_side_by_side() {
    let sim = Sim::start(&["--product", "3110", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    let link = format!("tcp:{}", sim.told("tcp"));
    sim.control(&["press home 2"]);
    for (axis, line) in [(0, "MVP ABS, 0, 100"), (2, "MVP ABS, 2, -300")] {
        sim.tcp().ok(line);
        sim.tcp().until(&format!("GAP 8, {axis}"), 1);
        sim.tcp().until(&format!("GAP 208, {axis}"), 128);
    }
    let csv = |options: &[&str]| {
        let output = run(&[&["monitor", &link, "--csv", "--interval", "1", "--count", "1"], options].concat());
        assert!(output.status.success(), "{}", complaint(&output));
        let text = String::from_utf8(output.stdout).unwrap();
        let (head, values) = text.trim_end().split_once('\n').unwrap();
        (head.to_owned(), values.split_once(',').unwrap().1.to_owned())
    };
    let (head, values) = csv(&[]);
    assert!(head.starts_with("time_s,position_0,speed_0,load_0,") && head.ends_with(",home_switch_2"), "{head}");
    assert!(head.contains(",home_switch_0,position_1,"), "{head}");
    assert_eq!(values, "100,0,0,128,0,0,0,0,0,0,0,128,0,0,0,0,-300,0,0,128,0,0,0,1");
    let (head, values) = csv(&["--axis", "0,2"]);
    assert!(head.contains(",home_switch_0,position_2,"), "{head}");
    assert_eq!(values, "100,0,0,128,0,0,0,0,-300,0,0,128,0,0,0,1");
    // One axis has no number, whichever it is.
    let (head, values) = csv(&["--axis", "2"]);
    assert!(head.starts_with("time_s,position,speed,") && head.ends_with(",home_switch"), "{head}");
    assert_eq!(values, "-300,0,0,128,0,0,0,1");

    let output = run(&["monitor", &link, "--count", "1"]);
    let said = String::from_utf8(output.stdout).unwrap();
    let expected = "\
axis 0  position         100  speed     0 int  load    0  switches -  driver STST  errors -
axis 1  position           0  speed     0 int  load    0  switches -  driver STST  errors -
axis 2  position        -300  speed     0 int  load    0  switches home  driver STST  errors -
";
    assert_eq!(said, expected);
    let output = run(&["monitor", &link, "--axis", "0,3"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("--axis 3: the module has axes 0 to 2"), "{}", complaint(&output));
}

/// Six axes in one line of a terminal, however wide that is.
#[test]
fn a_terminal_has_one_line_for_all_axes() {
    for (columns, shown) in
        [(200, "0           0     0 ----  1           0"), (80, "0:         0 1:         0"), (20, "0:         0 ...")]
    {
        let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        rustix::pty::grantpt(&master).unwrap();
        rustix::pty::unlockpt(&master).unwrap();
        let path = rustix::pty::ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
        let slave = rustix::fs::open(path.as_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty()).unwrap();
        let size = Winsize { ws_row: 24, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 };
        rustix::termios::tcsetwinsize(&slave, size).unwrap();
        let mut command = tmcl(&["monitor", "sim", "--product", "6110", "--count", "1"]);
        let status = command.stdout(Stdio::from(slave)).status().unwrap();
        drop(command);
        assert!(status.success());
        let mut bytes = [0; 1000];
        let count = rustix::io::read(&master, &mut bytes).unwrap();
        let text = String::from_utf8(bytes[..count].to_vec()).unwrap();
        let line = text.strip_prefix('\r').unwrap().split('\x1b').next().unwrap();
        assert!(line.starts_with(shown), "{columns}: {line:?}");
        assert!(line.len() < usize::from(columns), "{columns}: {line:?}");
    }
}

/// Whatever a module does, the program ends with one sentence; whatever the reader does, it ends quietly.
#[test]
fn what_does_not_answer_well_is_told_in_one_sentence() {
    let told = |link: &str, options: &[&str]| {
        let output =
            run(&[&["monitor", link, "--product", "1140", "--axis", "0", "--timeout", "200"], options].concat());
        assert_eq!(output.status.code(), Some(1));
        let told = complaint(&output);
        assert_eq!(told.lines().count(), 1, "{told}");
        told
    };
    // It answers late.
    let link = module(|_| {
        std::thread::sleep(Duration::from_secs(1));
        Some(0)
    });
    assert!(told(&link, &[]).starts_with("tmcl: GAP 1, 0: "));
    // What it answers is no reply.
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let mut stream = listener.accept().unwrap().0;
        let mut request = [0; TELEGRAM];
        while stream.read_exact(&mut request).is_ok() {
            let _ = stream.write_all(&[0x55; TELEGRAM]);
        }
    });
    assert!(told(&link, &[]).contains("what came is not the reply to it: 55 55"));
    // Nobody listens there.
    assert!(told("tcp:127.0.0.1:1", &[]).contains("127.0.0.1:1"));
    for wrong in [&["--interval", "86400001"][..], &["--interval", "fast"], &["--axis", "256"], &["--params", ""]] {
        let output = run(&[&["monitor", "sim"], wrong].concat());
        assert_eq!(output.status.code(), Some(2), "{wrong:?}: {}", complaint(&output));
    }
    let mut monitor = tmcl(&["monitor", "sim", "--csv", "--interval", "1000"]).spawn().unwrap();
    drop(monitor.stdout.take());
    assert_eq!(monitor.wait().unwrap().code(), Some(141));
    assert_eq!(complaint(&monitor.wait_with_output().unwrap()), "");
}

/// Ctrl-C at a narrow terminal: what was shown has fitted, the terminal is as before, and the line has ended.
#[test]
fn a_narrow_terminal_is_left_as_it_was() {
    for options in [&["--params", "1,206,180,3,4,5,6,7"][..], &[], &["--product", "6110"]] {
        let mut terminal = Terminal::start_with(&[&["monitor", "sim", "--interval", "500"], options].concat(), 40);
        terminal.expect("\x1b[K");
        let line = terminal.expect("\x1b[K");
        let line = line.trim_start_matches('\r').trim_end_matches("\x1b[K");
        assert!(!line.is_empty() && line.chars().count() < 40 && !line.contains('\n'), "{line:?}");
        terminal.keys("\x03");
        let (status, rest) = terminal.end();
        assert!(rest.ends_with("\x1b[K\r\n") || rest.ends_with("^C\r\n"), "{rest:?}");
        assert_eq!(status.code(), Some(130));
        assert!(terminal.is_as_before());
    }
}
