//! A firmware of one's own: the folder `examples/own-firmware`, copied to where no checkout is. It builds as it is but
//! for the place of the checkout, and its user function turns the motor on the emulated microcontroller.
//! `docs/own-firmware.md` tells of it.

use common::image;
use common::image_host::{Host, LOADED, NOT_AVAILABLE, OK, ONE_AXIS, Product, assert_logged};
use hal_sim::clock::{MILLISECOND, SECOND};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

/// The files of the example that are copied as they are.
const FILES: [&str; 3] = [".cargo/config.toml", "build.rs", "src/main.rs"];
/// Status of a reply: there is no such axis.
const INVALID_VALUE: u8 = 4;
/// The stack of an image, in bytes.
const STACK: u32 = 16 * 1024;

/// A folder that goes with its owner.
struct Elsewhere(PathBuf);

impl Drop for Elsewhere {
    fn drop(&mut self) {
        // What is left lies where the computer keeps what may be thrown away.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// The example as somebody has it who works outside of the checkout. It gets the versions with which the checkout is
/// tested, as the documents advise.
fn copy(root: &Path) -> Elsewhere {
    let folder = std::env::temp_dir().join(format!("own-firmware-{}", std::process::id()));
    let example = root.join("examples/own-firmware");
    for file in FILES {
        let place = folder.join(file);
        fs::create_dir_all(place.parent().unwrap()).unwrap();
        fs::copy(example.join(file), place).unwrap();
    }
    let manifest = fs::read_to_string(example.join("Cargo.toml")).unwrap();
    let here = manifest.replace("path = \"../..\"", &format!("path = {root:?}"));
    assert_ne!(here, manifest, "the example names the checkout");
    fs::write(folder.join("Cargo.toml"), here).unwrap();
    fs::copy(root.join("Cargo.lock"), folder.join("Cargo.lock")).unwrap();
    Elsewhere(folder)
}

/// The bytes of the image, which is built at the first call.
fn own() -> &'static [u8] {
    static IMAGE: LazyLock<Vec<u8>> = LazyLock::new(|| {
        let elsewhere = copy(&xtask::workspace().unwrap());
        let built = image::build_in(&elsewhere.0, "own-firmware").unwrap_or_else(|error| panic!("{error}"));
        assert!(!built.messages.contains("warning"), "{}", built.messages);
        fs::read(built.path).unwrap()
    });
    &IMAGE
}

/// The product on which the firmware runs.
const OWN: Product = Product { image: own, ..ONE_AXIS };

/// Sets the analog input, and gives the firmware the time to measure it.
fn turn_knob(host: &mut Host, reading: u16) {
    host.control(&format!("analog 0 {reading}"));
    host.run(50 * MILLISECOND);
}

/// A link on which a host asks.
type Ask = fn(&mut Host, &str) -> (u8, i32);

/// The speed of the example at a reading of the input.
fn speed(reading: u16) -> i32 {
    i32::from(reading) * 2000 / 4095
}

#[test]
fn a_user_function_reads_an_input_and_sets_a_speed() {
    let mut host = Host::of(OWN, "");
    assert_logged(&host.log(), &["info: module runs at address 1"]);
    host.plug_usb();
    for (ask, reading) in [(Host::ask as Ask, 1000), (Host::ask_can, 4095), (Host::ask_usb, 250), (Host::ask, 0)] {
        turn_knob(&mut host, reading);
        assert_eq!(ask(&mut host, "UF0 0, 0, 0"), (OK, speed(reading)));
        host.run(2 * SECOND);
        assert_eq!(host.speed(), speed(reading), "at a reading of {reading}");
    }
    // There is no axis 1, and no other function.
    assert_eq!(host.ask("UF0 0, 1, 0"), (INVALID_VALUE, 0));
    assert_eq!(host.ask("UF1 0, 0, 0"), (NOT_AVAILABLE, 0));
}

/// A program follows the knob, and on the way a host calls the same function.
#[test]
fn a_program_calls_the_user_function() {
    let mut host = Host::of(OWN, "");
    host.ok("132, 0, 0, 0");
    for line in ["UF0 0, 0, 0", "WAIT TICKS, 0, 1", "JA 0"] {
        assert_eq!(host.ask(line).0, LOADED, "{line}");
    }
    host.ok("133");
    host.ok("129, 1, 0, 0");
    for reading in [2000, 3000, 100] {
        turn_knob(&mut host, reading);
        host.run(2 * SECOND);
        assert_eq!(host.speed(), speed(reading), "at a reading of {reading}");
        assert_eq!(host.ok("UF0 0, 0, 0"), speed(reading));
    }
    let used = host.machine.stack_used();
    println!("stack: {used} of {STACK} bytes");
    assert!(used < STACK / 2, "{used}");
}
