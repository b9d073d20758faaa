//! `jog` of `tmcl shell` with modules that do not move, answer too late, or are out of reach for a while.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::time::{Duration, Instant};

use rustix::process::Signal;
use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::harness::{PATIENCE, Sim};
use super::pty::Terminal;
use super::shell_jog::{Bench, LINKS, REPEAT, RIGHT};

#[test]
fn a_module_that_does_not_move_is_told_and_ends_the_jog() {
    let mut bench = Bench::jogging(&[], "jog");
    bench.sim.control(&["supply 7"]);
    // The module notices within some milliseconds.
    let end = Instant::now() + PATIENCE;
    while bench.sim.tcp().ask("MVP ABS, 0, 0").status == 100 {
        assert!(Instant::now() < end);
    }
    bench.shell.keys(RIGHT);
    bench.shell.expect("the jog is over: MVP ABS, 0, ");
    bench.shell.expect("status 6 ");
    bench.shell.expect("The motors are locked; the supply is 7.0 V");
    bench.shell.expect("(tmcl) ");
    bench.sim.control(&["supply 24"]);
    let end = Instant::now() + PATIENCE;
    while bench.sim.tcp().ask("MVP ABS, 0, 0").status != 100 {
        assert!(Instant::now() < end);
    }
    bench.jog("jog");
    bench.sim.control(&["usb off"]);
    bench.shell.expect("the jog is over: GAP ");
    bench.shell.expect("no reply");
    bench.shell.expect("(tmcl) ");
    bench.sim.control(&["usb on"]);
    bench.shell.line("GAP 5, 0");
    bench.shell.expect("GAP 5, 0: 1000 int (maximum acceleration), status 100 ok");
    // The module vanishes for good.
    bench.jog("jog");
    let (_, _folder) = std::mem::replace(&mut bench.sim, Sim::start(&LINKS)).end(Signal::KILL);
    bench.shell.expect("the jog is over: ");
    bench.shell.expect("(tmcl) ");
    bench.shell.keys("\x04");
    assert_eq!(bench.shell.end().0.code(), Some(0));
    assert!(bench.shell.is_as_before());
}

/// A module whose replies take their time; it has 1000 as speed and acceleration, with the divisors from the factory.
/// Gives its link.
fn slow_module(delay: Duration) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        let (mut port, _) = listener.accept().unwrap();
        let mut request = [0; TELEGRAM];
        while port.read_exact(&mut request).is_ok() {
            let command = binary::decode_command(&request).unwrap();
            let value = match (command.opcode, command.kind) {
                (136, _) => 0x0474_012A,
                (6, 4 | 5) => 1000,
                (6, 153) => 7,
                (6, 154) => 3,
                _ => 0,
            };
            std::thread::sleep(delay);
            let reply = Reply::Plain { status: Status::Ok, opcode: command.opcode, value };
            // Nobody may be there any more.
            let _ = port.write_all(&binary::encode_reply(2, 1, &reply));
        }
    });
    link
}

#[test]
fn a_module_that_answers_too_late_is_not_moved() {
    let mut shell = Terminal::start(&["shell", &slow_module(Duration::from_millis(100))]);
    shell.expect("(tmcl) ");
    shell.line("jog");
    shell.expect("position ");
    let end = Instant::now() + PATIENCE;
    while !shell.shows("the module's replies take too long for a jog") {
        shell.keys(RIGHT);
        std::thread::sleep(REPEAT);
        assert!(Instant::now() < end);
    }
    shell.signal(Signal::TERM);
    assert_eq!(shell.end().0.code(), Some(143));
    assert!(shell.is_as_before());
}

/// The fuel of a key is the round trip's affair. Where it would have to be so long that the motor went on too long, it
/// is told how slow the link is, and how slow it may be.
#[test]
fn a_link_that_is_too_slow_is_told_by_how_much() {
    let mut shell = Terminal::start_with(&["shell", &slow_module(Duration::from_millis(60))], 200);
    shell.expect("(tmcl) ");
    shell.line("jog");
    shell.expect("position ");
    let end = Instant::now() + PATIENCE;
    while !shell.shows("the module's replies take too long for a jog: ") {
        shell.keys(RIGHT);
        std::thread::sleep(REPEAT);
        assert!(Instant::now() < end);
    }
    let told = shell.expect(" ms is the most");
    let (took, most) = told.split_once(" ms each, where ").unwrap();
    let took = took.rsplit(' ').next().unwrap();
    assert!(took.parse::<u32>().unwrap() >= 60 && most.starts_with("24"), "{told}");
}

/// While the module is out of reach, its speed of positioning is that of the jog; it gets it back as soon as it can.
#[test]
fn a_speed_that_could_not_be_put_back_is_put_back_later() {
    for line in ["GAP 1, 0", "quit"] {
        let mut bench = Bench::jogging(&[], "jog 0 500");
        bench.sim.control(&["usb off"]);
        bench.shell.expect("it could not be put back");
        bench.shell.expect("(tmcl) ");
        bench.sim.control(&["usb on"]);
        assert_eq!(bench.ok("GAP 4, 0"), 500);
        bench.shell.line(line);
        bench.shell.expect("parameter 4 of axis 0 is 1000 again");
        assert_eq!(bench.ok("GAP 4, 0"), 1000);
    }
}
