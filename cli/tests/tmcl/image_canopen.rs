//! `tmcl sim --image` with the flash image of the CANopen firmware, which tells by itself what it is.

use std::sync::OnceLock;

use rustix::process::Signal;

use super::canopen::Master;
use super::harness::{Sim, complaint, run};
use super::image;
use common::image as build;

/// Where the image is.
fn image() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| build::canopen().to_str().unwrap().into())
}

#[test]
fn it_is_told_by_the_file_and_fresh_modules_are_numbered() {
    let sim = Sim::start(&["--image", image(), "--modules", "2", "--slcan-tcp", "127.0.0.1:0", "--tcp", "127.0.0.1:0"]);
    let mut master = Master::new(&sim);
    for node in [1, 2] {
        assert_eq!(master.read(node, 0x2708, 0), u32::from(node));
    }
    assert_eq!(sim.tcp().ok("136, 1, 0, 0"), 0x0474_0314);
    assert_eq!(sim.end(Signal::TERM).0.code(), Some(0));
}

/// The bus of a module that runs an image has the bit rate of the module, also while nobody but the module has anything
/// to say.
#[test]
fn it_is_heard_again_after_bus_off_and_at_another_bit_rate() {
    let links = ["--slcan-tcp", "127.0.0.1:0", "--control", "127.0.0.1:0"];
    let sim = Sim::start(&[&["--image", image()][..], &links].concat());
    let mut master = Master::new(&sim);
    master.write(1, 0x1017, 0, &[20, 0]);
    master.until(0x701, &[127]);
    sim.control(&["can off"]);
    // Until the controller is off the bus.
    let time = |sim: &Sim| sim.control(&["state"])["time_us"].as_u64().unwrap();
    let start = time(&sim);
    while time(&sim) < start + 100_000 {}
    sim.control(&["can on"]);
    master.until(0x81, &[0x40, 0x81, 0x11, 0, 255, 0, 0, 0]);
    master.write(1, 0x2704, 0, &[125, 0]);
    master.write(1, 0x2706, 1, b"save");
    master.send(0, &[0x81, 1]);
    master.until(0x701, &[0]);
    assert_eq!(master.read(1, 0x2707, 0), 125);
}

#[test]
fn without_links_there_is_a_can_adapter() {
    let output = run(&["sim", "--image", image(), "--firmware", "canopen", "--exit-with-stdin"]);
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("slcan-tcp: ") && said.contains("network.add_node(1, "), "{said}");
    assert!(!said.contains("\ntcp: "), "{said}");
}

#[test]
fn a_firmware_that_the_image_has_not_is_refused() {
    for (firmware, image, says, remedy) in [
        ("tmcl", image(), "CANopen firmware", "`cargo fw`"),
        ("canopen", image::image(), "TMCL firmware", "fw-canopen"),
    ] {
        let output = run(&["sim", "--image", image, "--firmware", firmware]);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(2), 0), "{firmware}");
        for part in [&format!("--firmware {firmware}: the image has the {says}"), remedy] {
            assert!(complaint(&output).contains(part), "{}", complaint(&output));
        }
    }
    let output = run(&["sim", "--image", image(), "--rs485", "/nowhere/bus"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(complaint(&output).contains("leaves the module's RS485 port off"), "{}", complaint(&output));
}

/// Another product's, or a later firmware's.
#[test]
fn an_image_of_something_unknown_is_refused() {
    let mut elf = std::fs::read(image()).unwrap();
    let name = b"_firmware_TMCM_1140_canopen\0";
    let place = elf.windows(name.len()).position(|window| window == name).unwrap();
    elf[place + 15..place + 19].copy_from_slice(b"6110");
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("elf");
    std::fs::write(&path, elf).unwrap();
    let output = run(&["sim", "--image", path.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("an image of TMCM_6110_canopen, which cannot be simulated"));
}
