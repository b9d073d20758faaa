//! Host programs against modules whose time is paused: each gets its replies, and time passes as far as they need.

use std::io::{BufRead, Write};
use std::process::Output;

use tmcm::tmcl::text;

use super::harness::{Controller, Sim, complaint, run, type_into};
use super::image;
use super::turns::{MOST_CONNECTIONS, adapter, frame};

const PAUSED: [&str; 5] = ["--paused", "--control", "127.0.0.1:0", "--tcp", "127.0.0.1:0"];

/// The output of a command that must succeed.
fn said(output: &Output) -> String {
    assert!(output.status.success(), "{}", complaint(output));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// How much time passes while something is done.
fn passes(sim: &Sim, act: impl FnOnce()) -> u64 {
    let mut port = Controller::new(sim);
    let begun = port.time();
    act();
    port.time() - begun
}

#[test]
fn requests_are_answered_on_every_link() {
    let links = ["--serial", "{}/usb", "--rs485", "{}/rs485", "--slcan", "{}/can", "--modules", "2"];
    let sim = Sim::start(&[&PAUSED[..], &links].concat());
    let can = format!("slcan:{}", sim.told("slcan"));
    for (link, address) in [
        (sim.told("serial"), "1"),
        (&format!("tcp:{}", sim.told("tcp")), "1"),
        (sim.told("rs485"), "1"),
        (sim.told("rs485"), "2"),
        (&can, "1"),
        (&can, "2"),
    ] {
        let passed = passes(&sim, || {
            let output = run(&["send", link, "--address", address, "GAP 4, 0"]);
            assert!(said(&output).starts_with("GAP 4, 0: 1000 "), "{link}");
        });
        assert!((100..100_000).contains(&passed), "{link}: {passed} us");
    }
    // A module that is not there answers nothing, and costs a second at most.
    let passed = passes(&sim, || {
        assert!(!run(&["send", sim.told("rs485"), "--address", "9", "--timeout", "500", "GAP 4, 0"]).status.success());
    });
    assert!(passed <= 1_100_000, "{passed} us");
}

/// An event that a host has asked for comes once time passes. Until then a host that has gone must not keep its place.
#[test]
fn hosts_come_and_go_while_time_stands_still_and_the_module_is_busy() {
    let sim = Sim::start(&["--paused", "--control", "127.0.0.1:0", "--slcan-tcp", "127.0.0.1:0"]);
    let ask = |lines: [&str; 3]| {
        let mut host = adapter(&sim);
        host.get_mut().write_all(lines.map(frame).concat().as_bytes()).unwrap();
        let mut lines = host.split(b'\r').map_while(Result::ok);
        // The reply to GAP 4, whose value is 1000.
        assert!(lines.any(|line| line.starts_with(b"t0028016406000003E8")));
    };
    ask(["MVP ABS, 0, 1000000", "138, 0, 0, 1", "GAP 4, 0"]);
    for _ in 0..2 * MOST_CONNECTIONS {
        let mut host = adapter(&sim);
        // The channel is open.
        assert_eq!(host.read_until(b'\r', &mut Vec::new()).unwrap(), 1);
    }
    ask(["GAP 1, 0", "GAP 3, 0", "GAP 4, 0"]);
}

#[test]
fn tools_need_no_option() {
    let sim = Sim::start(&PAUSED);
    let link = &format!("tcp:{}", sim.told("tcp"));
    let file = |name: &str, text: &str| {
        let path = sim.path(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let program = file("count.tmc", "Loop: CALC ADD, 1\n\tWAIT TICKS, 0, 1\n\tJA Loop\n");
    // Storing a program takes the EEPROM more than a second.
    let passed = passes(&sim, || {
        said(&run(&["load", link, &program]));
    });
    assert!(passed > 20_000, "{passed} us");
    let told = said(&type_into(&["debug", link, &program], "step\nstep\nbreak 2\ncontinue\nregisters\n"));
    assert!(told.contains("breakpoint") && told.contains("program counter 2"), "{told}");
    let rows = said(&run(&["monitor", link, "--count", "3", "--interval", "20", "--csv"]));
    assert_eq!(rows.lines().count(), 4, "{rows}");
    let told = said(&type_into(&["shell", link], "SAP 4, 0, 777\nGAP 4, 0\n"));
    assert!(told.contains("GAP 4, 0: 777 "), "{told}");
    assert_eq!(Controller::new(&sim).ok("state")["time"], "paused");
}

#[test]
fn several_modules_share_one_time() {
    let sim = Sim::start(&[&PAUSED[..], &["--rs485", "{}/rs485", "--product", "1140,6110"]].concat());
    let mut port = Controller::new(&sim);
    let send = |address, line: &str| {
        assert!(text::parse(line).is_ok());
        said(&run(&["send", sim.told("rs485"), "--address", address, line]));
    };
    send("1", "ROR 0, 500");
    send("2", "ROR 5, 500");
    let begun = port.time();
    let met = port.ok("module 2 run-until rotor 5 > 5000 max 10 s");
    assert_eq!(met["met"], true);
    let (first, second) = (port.ok("state"), port.ok("module 2 state"));
    assert_eq!((&first["time_us"], &second["time_us"]), (&met["time_us"], &met["time_us"]));
    assert!(first["rotor"].as_i64() > Some(0) && second["axes"][5]["rotor"].as_i64() > Some(5_000));
    assert!(met["time_us"].as_u64().unwrap() > begun);
    assert_eq!(port.refused("module 3 run-until rotor > 0 max 1 s"), "no module 3: there are 2 modules");
    assert_eq!(port.refused("module 2 step 1 s"), "all modules share one time: leave out 'module 2'");
}

/// Two runs of the image in which the host sleeps differently.
#[test]
fn the_image_is_paused_as_its_core_is() {
    let run = |nap| {
        let sim = image::start(&[&PAUSED, &["--serial", "{}/usb"]]);
        let (mut host, mut port) = (sim.serial(), Controller::new(&sim));
        let fresh = port.ok("state");
        assert_eq!(fresh["time"], "paused");
        let mut told = vec![port.ok("pause 5 ms")];
        host.ok("SAP 4, 0, 1500");
        host.ok("MVP ABS, 0, 4000");
        let mut polls = 0;
        while host.ok("GAP 8, 0") == 0 {
            std::thread::sleep(nap);
            polls += 1;
            assert!(polls < 1_000);
        }
        told.push(polls.into());
        port.ok("pause");
        host.ok("STAP 4, 0");
        port.ok("at 12 ms press left");
        told.push(port.ok("run-until switches.left = 1 max 1 s"));
        std::thread::sleep(nap);
        told.push(host.ok("GAP 11, 0").into());
        host.ok("ROR 0, 500");
        told.push(port.ok("step 50 ms"));
        told.push(port.ok("state")["rotor"].clone());
        assert!(port.refused("run-until GAP 4, 0 = 1 max 1 s").contains("image"));
        told.push(port.ok("restart"));
        assert_eq!(port.ok("state")["time_us"], fresh["time_us"]);
        assert_eq!(port.ok("state")["rotor"], 0);
        told.push(host.ok("GAP 4, 0").into());
        told.push(port.ok("state")["time_us"].clone());
        told
    };
    let [first, second] = [0, 7].map(|millis| run(std::time::Duration::from_millis(millis)));
    assert_eq!(first, second);
    assert_eq!(first[first.len() - 2], 1500);
}
