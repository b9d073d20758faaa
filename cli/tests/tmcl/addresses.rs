//! Replies of modules that were not asked.

use std::io::{Read, Write};
use std::net::TcpListener;
use std::process::Output;

use tmcm::tmcl::binary::{self, TELEGRAM};
use tmcm::tmcl::{Reply, Status};

use super::harness::{Sim, complaint, run};

/// Something on a TCP port that answers each request by replies of these modules, whose values are their addresses; it
/// goes on with the last one for ever if `endless`. Its link.
fn bus(modules: &'static [u8], endless: bool) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let link = format!("tcp:{}", listener.local_addr().unwrap());
    std::thread::spawn(move || {
        for host in listener.incoming() {
            let mut host = host.unwrap();
            std::thread::spawn(move || {
                let mut request = [0; TELEGRAM];
                while host.read_exact(&mut request).is_ok() {
                    let opcode = binary::decode_command(&request).unwrap().opcode;
                    let reply = |module: u8| {
                        let value = module.into();
                        binary::encode_reply(2, module, &Reply::Plain { status: Status::Ok, opcode, value })
                    };
                    let mut replies = modules.iter().copied().map(reply).collect::<Vec<_>>().concat();
                    while host.write_all(&replies).is_ok() && endless {
                        replies = reply(7).repeat(10_000);
                    }
                }
            });
        }
    });
    link
}

fn ask(link: &str, more: &[&str]) -> Output {
    run(&[&["send", link, "--timeout", "300", "--product", "1140", "GGP 0, 2"], more].concat())
}

fn said(output: &Output) -> String {
    assert!(output.status.success(), "{}", complaint(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_reply_of_another_module_is_passed_over() {
    let link = bus(&[7, 3, 1], false);
    assert!(said(&ask(&link, &[])).starts_with("GGP 0, 2: 1,"));
    assert!(said(&ask(&link, &["--address", "3"])).starts_with("GGP 0, 2: 3,"));
    assert!(said(&ask(&link, &["--any-address"])).starts_with("GGP 0, 2: 7,"));
    // What has been passed over is in the log.
    let logged = said(&ask(&link, &["--log-telegrams", "-"]));
    assert_eq!(logged.lines().filter(|line| line.contains(" < ")).count(), 3, "{logged}");
}

#[test]
fn if_nothing_else_comes_it_is_told_who_has_answered() {
    for (modules, endless, who) in [
        (&[7][..], false, "but module 7 answered"),
        (&[7, 3, 7], false, "but modules 7 and 3 answered"),
        (&[4, 7, 3], false, "but modules 4, 7 and 3 answered"),
        (&[7], true, "but module 7 answered"),
    ] {
        let link = bus(modules, endless);
        let output = ask(&link, &[]);
        assert_eq!(output.status.code(), Some(1));
        let told = complaint(&output);
        assert!(told.starts_with("tmcl: GGP 0, 2: no reply from module 1, ") && told.contains(who), "{told}");
        assert!(told.contains("use its address, or take replies from any address"), "{told}");
        // Whatever asks: what the module is, its settings, an axis.
        for arguments in [&["params", &link, "save", "-"][..], &["monitor", &link, "--count", "1"], &["dump", &link]] {
            let output = run(&[arguments, &["--timeout", "300"]].concat());
            assert_eq!((output.status.code(), complaint(&output).contains(who)), (Some(1), true), "{arguments:?}");
        }
        let json = ask(&link, &["--json"]);
        let told: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
        assert!(told["error"].as_str().unwrap().contains(who), "{told}");
    }
}

/// A late reply is from whom was asked before.
#[test]
fn a_late_reply_of_another_module_on_a_bus_is_none() {
    let sim = Sim::start(&["--modules", "2", "--rs485", "{}/bus", "--control", "127.0.0.1:0"]);
    let bus = sim.told("rs485");
    let send = |arguments: &[&str]| run(&[&["send", bus, "--product", "1140"], arguments].concat());
    said(&send(&["--timeout", "60000", "--address", "2", "SGP 0, 2, 2222"]));
    said(&send(&["--timeout", "60000", "--address", "1", "SGP 0, 2, 1111"]));
    // Module 2 has a longer way than module 1, whose reply comes first, and late.
    sim.control(&["fault reply-delay 300 ms", "module 2 fault reply-delay 600 ms"]);
    assert_eq!(send(&["--timeout", "1", "--address", "1", "GGP 0, 2"]).status.code(), Some(1));
    let second = said(&send(&["--timeout", "60000", "--address", "2", "GGP 0, 2"]));
    assert!(second.starts_with("GGP 0, 2: 2222,"), "{second}");
    // Nor does a module reply by its second address as if it were that.
    sim.control(&["fault reply-delay 0", "module 2 fault reply-delay 0"]);
    said(&send(&["--timeout", "60000", "--address", "2", "SGP 87, 0, 5"]));
    let told = complaint(&send(&["--timeout", "1000", "--address", "5", "GGP 0, 2"]));
    assert!(told.contains("no reply from module 5, but module 2 answered"), "{told}");
    let any = said(&send(&["--timeout", "60000", "--address", "5", "--any-address", "GGP 0, 2"]));
    assert!(any.starts_with("GGP 0, 2: 2222,"), "{any}");
}

/// At a USB connector there is one module, whatever address is asked.
#[test]
fn a_link_to_one_module_takes_its_reply_whatever_the_address() {
    let sim = Sim::start(&["--serial", "{}/port", "--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"]);
    sim.tcp().ok("SGP 66, 0, 7");
    sim.tcp().ok("SGP 0, 2, 7777");
    let (port, device) = (sim.told("serial"), std::fs::canonicalize(sim.told("serial")).unwrap());
    let tcp = format!("tcp:{}", sim.told("tcp"));
    let is_taken = |link: &str, more: &[&str]| {
        let arguments = ["send", link, "--timeout", "5000", "--product", "1140", "GGP 0, 2"];
        let output = run(&[&arguments[..], more].concat());
        String::from_utf8_lossy(&output.stdout).starts_with("GGP 0, 2: 7777,")
    };
    assert!(is_taken(port, &[]) && is_taken(port, &["--address", "9"]) && is_taken(device.to_str().unwrap(), &[]));
    assert!(is_taken(&tcp, &["--address", "7"]) && is_taken(&tcp, &["--any-address"]));
    assert!(!is_taken(&tcp, &["--timeout", "300"]));
    // The cable is plugged in again: another terminal, which is that of USB as well.
    sim.control(&["usb off --hangup", "usb on"]);
    assert!(is_taken(port, &[]));
    // A module inside the program is alone, too.
    let file = sim.path("module.bin");
    let file = ["--eeprom", file.to_str().unwrap(), "--product", "1140"];
    said(&run(&[&["send", "sim", "SGP 66, 0, 7"], &file[..]].concat()));
    assert!(said(&run(&[&["send", "sim", "GGP 66, 0"], &file[..]].concat())).starts_with("GGP 66, 0: 7 "));
}
