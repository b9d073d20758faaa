//! `tmcl sim --image` with the flash images of the TMCM-6110 and of the TMCM-3212, which tell by themselves what they
//! are; and images that do not.

use std::fs;
use std::path::Path;
use std::sync::OnceLock;

use rustix::process::Signal;

use super::harness::{Sim, run};
use super::image;
use super::sim_products::{Bus, of_axes, refused, said};
use common::image as build;

const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];
const CONTROL: [&str; 2] = ["--control", "127.0.0.1:0"];
/// The reply to command 136, type 1.
const VERSION: i32 = 0x17DE_012E;

/// Where the image is.
fn image() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| build::six_axes().to_str().unwrap().into())
}

/// Where that of the TMCM-3212 is.
fn image_3212() -> &'static str {
    static PATH: OnceLock<String> = OnceLock::new();
    PATH.get_or_init(|| build::three_axes().to_str().unwrap().into())
}

/// An image whose symbol has another name.
fn marked(folder: &Path, image: &str, is: &str, mark: &str) -> String {
    assert_eq!(mark.len(), is.len());
    let mut elf = fs::read(image).unwrap();
    let place = elf.windows(is.len()).position(|window| window == is.as_bytes()).unwrap();
    elf[place..place + is.len()].copy_from_slice(mark.as_bytes());
    let path = folder.join(mark);
    fs::write(&path, elf).unwrap();
    path.to_str().unwrap().into()
}

#[test]
fn it_is_told_by_the_file_and_each_axis_moves() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), "[[axis]]\n[[axis]]\n[[axis]]\n[[axis]]\nstage.right = 3000").unwrap();
    let arguments =
        [&["--image", image(), "--world", "{}/world.toml", "--serial", "{}/usb"][..], &TCP, &CONTROL].concat();
    let sim = Sim::start_in(folder, &arguments);
    let (mut host, mut other) = (sim.tcp(), sim.serial());
    assert_eq!(host.ok("136, 1, 0, 0"), VERSION);
    host.ok("SAP 12, 3, 0");
    (0..6).for_each(|axis| {
        host.ok(&format!("MVP ABS, {axis}, {}", 4000 + axis));
    });
    [0, 1, 2, 4, 5].into_iter().for_each(|axis| other.until(&format!("GAP 8, {axis}"), 1));
    other.until("GAP 10, 3", 1);
    other.until("GAP 3, 3", 0);
    let state = sim.control(&["press home 5", "input 6 1", "analog 4 1234", "state"]);
    let rotors: Vec<i64> = of_axes(&state, "rotor").iter().map(|rotor| rotor.as_i64().unwrap()).collect();
    assert!((3_000..3_100).contains(&rotors[3]), "{rotors:?}");
    assert_eq!([0, 1, 2, 4, 5].map(|axis| rotors[axis]), [4000, 4001, 4002, 4004, 4005]);
    for line in [("GAP 9, 5", 1), ("GIO 6, 0", 1), ("GIO 4, 1", 1234)] {
        host.until(line.0, line.1);
    }
    assert_eq!(host.ask("GAP 1, 6").status, 4);
    assert_eq!(sim.control(&["press left 6"])["error"], "no axis 6: the TMCM-6110 has axes 0 to 5");
    assert_eq!(sim.end(Signal::TERM).0.code(), Some(0));
}

#[test]
fn fresh_modules_are_numbered_and_what_is_stored_survives() {
    let options = ["--image", image(), "--modules", "2", "--rs485", "{}/bus", "--eeprom", "{}/module.bin"];
    let sim = Sim::start(&options);
    let mut bus = Bus::of(&sim);
    for module in [1, 2] {
        assert_eq!(bus.ok(module, "136, 1, 0, 0"), VERSION);
        bus.ok(module, &format!("SAP 4, 5, 77{module}"));
        bus.ok(module, "STAP 4, 5");
    }
    let (_, folder) = sim.end(Signal::KILL);
    for name in ["module.bin", "module.bin.2"] {
        assert_eq!(fs::metadata(folder.path().join(name)).unwrap().len(), 32_768);
    }
    // The core has the same settings as the image.
    let sim = Sim::start_in(folder, &["--product", "6110,6110", "--rs485", "{}/bus", "--eeprom", "{}/module.bin"]);
    let mut bus = Bus::of(&sim);
    assert_eq!([1, 2].map(|module| bus.ok(module, "GAP 4, 5")), [771, 772]);
}

#[test]
fn the_image_of_the_tmcm_3212_moves_its_axes_and_keeps_what_is_stored() {
    let options = [&["--image", image_3212(), "--eeprom", "{}/module.bin"][..], &TCP, &CONTROL].concat();
    let sim = Sim::start(&options);
    let mut host = sim.tcp();
    // 3212 and version 1.05.
    assert_eq!(host.ok("136, 1, 0, 0"), 0x0C8C_0105);
    (0..3).for_each(|axis| {
        host.ok(&format!("MVP ABS, {axis}, {}", 4000 + axis));
    });
    (0..3).for_each(|axis| host.until(&format!("GAP 8, {axis}"), 1));
    let state = sim.control(&["press home 2", "input 10 1", "state"]);
    let rotors: Vec<i64> = of_axes(&state, "rotor").iter().map(|rotor| rotor.as_i64().unwrap()).collect();
    assert_eq!((rotors, &state["enable"]), (vec![4000, 4001, 4002], &true.into()));
    host.until("GAP 9, 2", 1);
    host.until("GIO 10, 0", 1);
    for line in ["SGP 55, 2, 777", "STGP 55, 2"] {
        host.ok(line);
    }
    let (_, folder) = sim.end(Signal::KILL);
    assert_eq!(fs::metadata(folder.path().join("module.bin")).unwrap().len(), 65_536);
    // The core has the same settings as the image.
    let options = [&["--product", "3212", "--eeprom", "{}/module.bin"][..], &TCP].concat();
    let sim = Sim::start_in(folder, &options);
    assert_eq!(sim.tcp().ok("GGP 55, 2"), 777);
}

#[test]
fn an_image_is_for_the_product_that_it_tells() {
    for (image, product, is) in [
        (image::image(), "6110", "TMCM-1140"),
        (image::image(), "1140,3110", "TMCM-1140"),
        (image(), "1140", "TMCM-6110"),
        (image(), "3110", "TMCM-6110"),
        (image(), "6110,1140", "TMCM-6110"),
        (image_3212(), "6110", "TMCM-3212"),
    ] {
        let why =
            format!("--product {product}: the image is one for the {is}. Leave out --product, or give the image of");
        refused(&["--image", image, "--product", product], 2, &[&why]);
    }
    let why =
        "--firmware canopen: the TMCM-6110, for which the image is, has no such firmware, only the TMCM-1140 has. ";
    refused(&["--image", image(), "--firmware", "canopen"], 2, &[why]);
    refused(&["--image", image(), "--firmware", "canopen", "--product", "6110"], 2, &[why]);
    for (image, product, modules) in [
        (image::image(), "1140", "A virtual TMCM-1140 that runs "),
        (image::image(), "1140,1140", "2 virtual TMCM-1140s that run "),
        (image(), "TMCM-6110", "A virtual TMCM-6110 that runs "),
        (image_3212(), "3212", "A virtual TMCM-3212 that runs "),
    ] {
        let said = said(&[&["--image", image, "--product", product][..], &TCP].concat());
        assert!(said.starts_with(&format!("{modules}{image}. ")), "{said}");
    }
}

/// Other people's images have no such symbol.
#[test]
fn of_an_image_that_does_not_tell_the_product_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let [one, six] = [(image::image(), "1140"), (image(), "6110")].map(|(image, product)| {
        let (is, mark) = (format!("_firmware_TMCM_{product}_tmcl"), format!("some_other_symbol_{product}_"));
        marked(folder.path(), image, &is, &format!("{mark:_<24}"))
    });
    assert!(said(&[&["--image", &one][..], &TCP].concat()).starts_with("A virtual TMCM-1140 that runs "));
    let sim = Sim::start(&[&["--image", &six, "--product", "TMCM-6110"][..], &TCP].concat());
    let mut host = sim.tcp();
    assert_eq!((host.ok("136, 1, 0, 0"), host.ask("GAP 1, 5").status), (VERSION, 100));
    let why = "--product 1140,6110: all modules run the image, which is for one product. Give its name alone";
    refused(&["--image", &one, "--product", "1140,6110"], 2, &[why]);
    let why = "--firmware canopen: the TMCM-6110 has no such firmware, only the TMCM-1140 has. ";
    refused(&["--image", &six, "--product", "6110", "--firmware", "canopen"], 2, &[why]);
    let output = run(&["sim", "--image", &one, "--product", "3110"]);
    assert_eq!(output.status.code(), Some(1));
    refused(&["--image", &one, "--product", "3110"], 1, &[&format!("--image: {one}: "), "`cargo fw-6110`"]);
}
