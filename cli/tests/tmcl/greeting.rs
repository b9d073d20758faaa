//! The beginning of a connection to a TCP port of `tmcl sim`: that of a web browser is closed, that of a host is not.

use std::io::{Read, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

use tmcl_tools::slcan;
use tmcm::tmcl::binary::{self, TELEGRAM, Telegram};
use tmcm::tmcl::{Command, text};

use super::harness::{Host, PATIENCE, SILENCE, Sim};

/// The three kinds of TCP ports.
const DOORS: [&str; 3] = ["tcp", "slcan-tcp", "control"];
const LINKS: [&str; 6] = ["--tcp", "127.0.0.1:0", "--slcan-tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
/// The beginnings of requests of HTTP and of its second version, and a hello of TLS as curl sends it.
const GREETINGS: [&[u8]; 13] = [
    b"GET ",
    b"HEAD ",
    b"POST ",
    b"PUT ",
    b"DELETE ",
    b"CONNECT ",
    b"OPTIONS ",
    b"TRACE ",
    b"PATCH ",
    b"PROPFIND ",
    b"PRI ",
    b"\x16\x03\x01\x02\x00\x01\x00\x01\xFC",
    b"\x16\x03\x03\x00\x05\x01\x00\x00\x01",
];
/// Longer than it takes the simulator to read a byte, on a computer that is not busy.
const MOMENT: Duration = Duration::from_millis(2);

fn connect(sim: &Sim, door: &str) -> TcpStream {
    let stream = TcpStream::connect(sim.told(door)).unwrap();
    stream.set_nodelay(true).unwrap();
    stream.set_read_timeout(Some(PATIENCE)).unwrap();
    stream
}

/// The bytes that a page puts into its request for this port: telegrams, frames or lines, after so many bytes that lead
/// into step.
fn harm(door: &str, phase: usize) -> Vec<u8> {
    let turn = text::parse("ROR 0, 500").unwrap();
    let said = match door {
        "tcp" => binary::encode_command(1, turn).repeat(20),
        "slcan-tcp" => {
            let frame = tmcm::can::Frame::standard(1, &tmcm::tmcl::can::encode_command(turn)).unwrap();
            format!("\rS8\rO\r{}\r", slcan::line(&frame)).into_bytes()
        }
        _ => b"\npress left\nsend ROR 0, 500\n".to_vec(),
    };
    [vec![b' '; phase], said].concat()
}

/// Sends some pieces with pauses between them, and takes all that comes until the connection is closed.
fn said_to<'a>(mut stream: TcpStream, pieces: impl IntoIterator<Item = &'a [u8]>, pause: Duration) -> Vec<u8> {
    for (index, piece) in pieces.into_iter().enumerate() {
        std::thread::sleep(if index > 0 { pause } else { Duration::ZERO });
        // It may be closed before all is written; how it is closed depends on what is on its way then.
        let _ = stream.write_all(piece);
    }
    let _ = stream.shutdown(Shutdown::Write);
    let mut answers = Vec::new();
    let _ = stream.read_to_end(&mut answers);
    answers
}

/// Nothing has reached the module: its motor has no speed to go to, and no hand has closed a switch.
fn nothing_has_happened(sim: &Sim, what: &str) {
    assert_eq!(sim.tcp().ok("GAP 2, 0"), 0, "{what}");
    assert_eq!(sim.control(&["state"])["switches"]["left"], false, "{what}");
}

#[test]
fn a_web_page_reaches_the_module_through_no_port_and_in_no_phase() {
    let sim = Sim::start(&LINKS);
    for door in DOORS {
        for greeting in GREETINGS {
            for phase in 0..TELEGRAM {
                let page = [greeting, b"/ HTTP/1.1\r\nHost: module\r\n\r\n", &harm(door, phase)].concat();
                let answers = said_to(connect(&sim, door), [page.as_slice()], MOMENT);
                assert!(answers.is_empty(), "{door} {}: {answers:?}", greeting.escape_ascii());
            }
            nothing_has_happened(&sim, &format!("{door} {}", greeting.escape_ascii()));
        }
    }
}

#[test]
fn a_web_page_that_comes_byte_by_byte_is_one_too() {
    let sim = Sim::start(&LINKS);
    for door in DOORS {
        for greeting in GREETINGS {
            let harm = harm(door, 0);
            let answers = said_to(connect(&sim, door), greeting.chunks(1).chain([harm.as_slice()]), MOMENT);
            assert!(answers.is_empty(), "{door} {}: {answers:?}", greeting.escape_ascii());
        }
        // A silence in between ends a telegram, but does not make a host of a page.
        for greeting in [b"POST ".as_slice(), b"\x16\x03\x01\x02\x00\x01\x00\x01\xFC"] {
            let (begun, rest) = greeting.split_at(2);
            let rest = [rest, &harm(door, 0)].concat();
            let answers = said_to(connect(&sim, door), [begun, &rest], SILENCE);
            assert!(answers.is_empty(), "{door} {}: {answers:?}", greeting.escape_ascii());
        }
        nothing_has_happened(&sim, door);
    }
}

/// The telegram for a module with any address, of which that at a link between two ends takes each.
fn telegram(address: u8, line: &str) -> Telegram {
    binary::encode_command(address, text::parse(line).unwrap())
}

/// Address 22 with command 3 is the beginning of a hello of TLS, 71 and 80 are letters that methods begin with.
#[test]
fn every_address_is_heard_in_the_first_telegram() {
    let sim = Sim::start(&LINKS);
    for address in 0..=u8::MAX {
        for line in ["MST 0", "GAP 4, 0", "136, 1, 0, 0", "MVP COORD, 0, 5"] {
            let mut host = sim.tcp();
            host.write(&telegram(address, line));
            assert!(binary::decode_reply(&host.read()).is_some(), "{address}: {line}");
        }
    }
    for address in [22, 67, 71, 72, 80] {
        for line in ["MST 0", "GAP 4, 0"] {
            let mut host = sim.tcp();
            for byte in telegram(address, line) {
                host.write(&[byte]);
                std::thread::sleep(MOMENT);
            }
            assert!(binary::decode_reply(&host.read()).is_some(), "{address}: {line}");
        }
    }
    // A command that there is not is answered as well, whatever letters are in it.
    let mut host = sim.tcp();
    host.write(&binary::encode_command(71, Command::new(69, 84, 33, 0)));
    assert_ne!(binary::decode_reply(&host.read()).unwrap().status, 100);
    // Nor is it a hello if the connection has begun with something else.
    host.write(b"\x16\x03\x01\x02\x00\x01\x00\x01\xFC");
    assert_eq!(binary::decode_reply(&host.read()).unwrap().status, 1, "a wrong check sum");
    host.write(&telegram(1, "GAP 4, 0"));
    assert_eq!(binary::decode_reply(&host.read()).unwrap().value, 1000);
}

/// A silence ends the telegram that is held back; the power takes it along.
#[test]
fn a_telegram_that_has_come_in_part_is_given_up_as_ever() {
    let sim = Sim::start(&LINKS);
    for begun in [&b"G"[..], b"PO", b"O", b"TRACE"] {
        let mut host = sim.tcp();
        host.write(begun);
        std::thread::sleep(SILENCE);
        assert_eq!(host.ok("GAP 4, 0"), 1000, "{begun:?}");
        let mut host = sim.tcp();
        host.write(begun);
        std::thread::sleep(MOMENT * 10);
        sim.control(&["usb off", "usb on"]);
        assert_eq!(host.ok("GAP 4, 0"), 1000, "{begun:?}");
    }
}

#[test]
fn lines_may_begin_with_the_letters_of_a_method() {
    let sim = Sim::start(&LINKS);
    // An adapter that is closed opens its channel, or refuses what it does not know.
    for (line, answer) in [("O\r", b'\r'), ("C\r", b'\r'), ("P\r", 7), ("GET\r", 7), ("OPTIONS\r", 7)] {
        for pause in [Duration::ZERO, MOMENT] {
            let mut stream = connect(&sim, "slcan-tcp");
            for byte in line.as_bytes() {
                stream.write_all(&[*byte]).unwrap();
                std::thread::sleep(pause);
            }
            let mut answered = [0];
            stream.read_exact(&mut answered).unwrap();
            assert_eq!(answered, [answer], "{line:?}");
        }
    }
    let refused = said_to(connect(&sim, "control"), [b"POST".as_slice()], MOMENT);
    assert!(String::from_utf8_lossy(&refused).starts_with(r#"{"ok":false"#), "the last line may have no end");
}

/// ASCII mode from the start of the module on, with its echo: modules 7 and 16 have the letters G and P.
#[test]
fn lines_of_ascii_mode_may_begin_so_too() {
    for (address, letter) in [(7, 'G'), (16, 'P')] {
        let sim = Sim::start(&LINKS);
        let mut host = sim.tcp();
        host.ok("SGP 67, 0, 1");
        host.ok(&format!("SGP 66, 0, {address}"));
        sim.control(&["power off", "power on"]);
        let line = format!("{letter}GAP 4, 0\r");
        for pause in [MOMENT, SILENCE] {
            let mut host = Host(connect(&sim, "tcp"));
            host.write(&line.as_bytes()[..1]);
            std::thread::sleep(pause);
            // Somebody who types slowly sees the first letter.
            assert!(pause == MOMENT || host.has_news(PATIENCE), "{line:?}");
            host.write(&line.as_bytes()[1..]);
            let mut said = String::new();
            while !said.ends_with("100 1000\r") {
                let mut bytes = [0; 64];
                let count = host.0.read(&mut bytes).unwrap();
                assert!(count > 0, "{line:?}: {said:?}");
                said += &String::from_utf8_lossy(&bytes[..count]);
            }
            assert_eq!(said, format!("{line}B{letter} 100 1000\r"));
        }
    }
}

/// While time stands still, a request is there before the line that its host writes to the control port afterwards.
#[test]
fn a_first_request_keeps_its_place_in_paused_time() {
    let sim = Sim::start(&[&LINKS[..], &["--paused"]].concat());
    for address in [1, 22, 71] {
        let mut host = sim.tcp();
        host.write(&telegram(address, "MST 0"));
        sim.control(&["step 5 ms"]);
        assert_eq!(binary::decode_reply(&host.read()).unwrap().status, 100, "{address}");
    }
}
