//! `tmcl sim --product`: which modules there are, and what in their world is the product's.

use std::fs::{self, File, OpenOptions};

use rustix::process::Signal;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::text;

use super::canopen::Master;
use super::harness::{Host, Sim, complaint, run};

const TCP: [&str; 2] = ["--tcp", "127.0.0.1:0"];
const CONTROL: [&str; 2] = ["--control", "127.0.0.1:0"];
const FAST: [&str; 2] = ["--speed", "20"];
/// A module of each product.
const MIXED: [&str; 2] = ["--product", "1140,3110,3212,6110,1110"];
/// Numbers that differ between the modules of these, module 1 first: number, axes, and bytes of the EEPROM.
const PRODUCTS: [(i32, u8, u64); 5] = [
    (0x0474_012A, 1, 16_384),
    (0x0C26_010E, 3, 32_768),
    (0x0C8C_0105, 3, 65_536),
    (0x17DE_012E, 6, 32_768),
    (0x0456_0103, 1, 16_384),
];
/// The names of the EEPROM files of their modules.
const FILES: [&str; 5] = ["module.bin", "module.bin.2", "module.bin.3", "module.bin.4", "module.bin.5"];

/// The output of a simulator that ends when it is ready.
pub(super) fn said(arguments: &[&str]) -> String {
    let output = run(&[&["sim", "--exit-with-stdin"], arguments].concat());
    assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
    String::from_utf8(output.stdout).unwrap()
}

/// Asserts that a simulator does not start with these arguments, for a reason that has all of these parts.
pub(super) fn refused(arguments: &[&str], code: i32, parts: &[&str]) {
    let output = run(&[&["sim", "--exit-with-stdin"], arguments].concat());
    assert_eq!((output.status.code(), output.stdout.len()), (Some(code), 0), "{arguments:?}: {}", complaint(&output));
    for part in parts {
        assert!(complaint(&output).contains(part), "{arguments:?}: {part}: {}", complaint(&output));
    }
}

/// The host on the RS485 bus.
pub(super) struct Bus(Host<File>);

impl Bus {
    pub(super) fn of(sim: &Sim) -> Self {
        Bus(Host(OpenOptions::new().read(true).write(true).open(sim.told("rs485")).unwrap()))
    }

    /// Asks a module; it is the one that answers.
    fn ask(&mut self, module: u8, line: &str) -> Received {
        self.0.write(&binary::encode_command(module, text::parse(line).unwrap()));
        let reply = binary::decode_reply(&self.0.read()).unwrap();
        assert_eq!(reply.module, module, "{line}");
        reply
    }

    pub(super) fn ok(&mut self, module: u8, line: &str) -> i32 {
        let reply = self.ask(module, line);
        assert_eq!(reply.status, 100, "{module}: {line}");
        reply.value
    }
}

/// A number that no other axis of a fleet has, within what can be a speed.
fn place(module: u8, axis: u8) -> i32 {
    100 * i32::from(module) + i32::from(axis)
}

/// A field of each axis in the state of a module.
pub(super) fn of_axes(state: &serde_json::Value, field: &str) -> Vec<serde_json::Value> {
    state["axes"].as_array().unwrap().iter().map(|axis| axis[field].clone()).collect()
}

#[test]
fn a_product_has_a_name_with_or_without_its_prefix() {
    for (name, is) in [
        ("1140", "A virtual TMCM-1140 with firmware version 1.42. Ctrl-C ends it."),
        ("1110", "A virtual TMCM-1110 with firmware version 1.03. Ctrl-C ends it."),
        ("TMCM-3110", "A virtual TMCM-3110 with firmware version 1.14. Ctrl-C ends it."),
        ("3212", "A virtual TMCM-3212 with firmware version 1.05. Ctrl-C ends it."),
        ("tmcm-6110", "A virtual TMCM-6110 with firmware version 1.46. Ctrl-C ends it."),
        ("6110", "A virtual TMCM-6110 with firmware version 1.46. Ctrl-C ends it."),
    ] {
        assert_eq!(said(&[&["--product", name][..], &TCP].concat()).lines().next(), Some(is));
    }
    assert!(said(&TCP).starts_with("A virtual TMCM-1140 with firmware version 1.42. "), "that is the default");
    refused(&["--product", "6111"], 2, &["'6111' is none of 1140, 1110, 3110, 3212, 6110; did you mean '6110'?"]);
    refused(
        &["--product", "tmcm-3111"],
        2,
        &["'tmcm-3111' is none of 1140, 1110, 3110, 3212, 6110; did you mean '3110'?"],
    );
    refused(&["--product", "1140,servo"], 2, &["'servo' is none of 1140, 1110, 3110, 3212, 6110\n"]);
    refused(&["--product", "1140,"], 2, &["'' is none of 1140, 1110, 3110, 3212, 6110\n"]);
}

#[test]
fn one_name_is_that_of_all_modules_and_a_list_has_one_for_each() {
    let first = |arguments: &[&str]| said(&[arguments, &TCP].concat()).lines().next().unwrap().to_owned();
    let three = "3 virtual TMCM-3110s with firmware version 1.14. Ctrl-C ends them.";
    assert_eq!(first(&["--product", "3110", "--modules", "3"]), three);
    assert_eq!(first(&["--product", "3110,TMCM-3110,3110"]), three);
    assert_eq!(first(&["--modules", "2"]), "2 virtual TMCM-1140s with firmware version 1.42. Ctrl-C ends them.");
    let mixed = "3 virtual modules: 1 is a TMCM-6110 with firmware version 1.46, 2 a TMCM-1140 with firmware version \
                 1.42, 3 a TMCM-6110 with firmware version 1.46. Ctrl-C ends them.";
    assert_eq!(first(&["--product", "6110,1140,6110"]), mixed);
    assert_eq!(first(&["--modules", "3", "--product", "6110,1140,6110"]), mixed);
    let says = |count: &str| format!("--product 6110,1140,6110: these are 3 modules, and --modules says {count}. ");
    for count in ["1", "2", "4"] {
        refused(&["--product", "6110,1140,TMCM-6110", "--modules", count], 2, &[&says(count), "leave out --modules"]);
    }
    refused(&["--product", &["1140"; 128].join(",")], 2, &["these are 128 modules, and 127 are the most"]);
    refused(&["--modules", "128"], 2, &["128 is not in 1..=127"]);
    assert!(first(&["--product", &["1140"; 127].join(",")]).starts_with("127 virtual TMCM-1140s "));
}

/// As many modules run as there are, of each product. The first and the last, and those between them, have the
/// addresses of their numbers on both buses, and all of them end when the simulator does.
#[test]
fn there_may_be_127_modules() {
    for (product, (version, ..)) in ["1140", "3110", "3212", "6110", "1110"].into_iter().zip(PRODUCTS) {
        let links = ["--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"];
        let sim = Sim::start(&[&["--product", product, "--modules", "127"][..], &links, &CONTROL].concat());
        let (mut bus, mut can) = (Bus::of(&sim), Master::new(&sim));
        for module in [1, 2, 64, 126, 127] {
            assert_eq!(bus.ok(module, "136, 1, 0, 0"), version);
            bus.ok(module, &format!("MVP ABS, 0, {module}"));
            // GGP 71, the CAN identifier for requests, and GAP 0, the target.
            for (request, value) in [([10, 71, 0], i32::from(module)), ([6, 0, 0], module.into())] {
                can.send(module.into(), &[&request[..], &[0; 4]].concat());
                can.until(2, &[&[module, 100, request[0]][..], &value.to_be_bytes()].concat());
            }
        }
        assert_eq!(sim.control(&["module 127 send GGP 66, 0"])["value"], 127);
        let (status, _) = sim.end(Signal::INT);
        assert!(status.success(), "{product}: {status}");
    }
    let sim = Sim::start(&["--firmware", "canopen", "--modules", "127", "--slcan-tcp", "127.0.0.1:0"]);
    let mut master = Master::new(&sim);
    for node in [1, 64, 127] {
        assert_eq!(master.read(node, 0x2708, 0), u32::from(node));
    }
}

#[test]
fn what_is_printed_reaches_each_product() {
    let folder = tempfile::tempdir().unwrap();
    let bus = folder.path().join("bus");
    let bus = bus.to_str().unwrap();
    let links = [&TCP[..], &["--rs485", bus, "--slcan-tcp", "127.0.0.1:0"]].concat();
    let said_of = |product: &str| said(&[&["--product", product][..], &links].concat());
    let mixed = said_of("1140,6110,6110,3110");
    let can = mixed.lines().find_map(|line| line.strip_prefix("slcan-tcp: ")).unwrap();
    let tcp = mixed.lines().find_map(|line| line.strip_prefix("tcp: ")).unwrap();
    for (number, product) in [(1, "TMCM-1140"), (2, "TMCM-6110"), (4, "TMCM-3110")] {
        for line in [
            format!("    tmcl send {bus} --address {number} \"GAP 1, 0\"  # module {number}, a {product}"),
            format!("    tmcl send slcan:tcp:{can} --address {number} \"GAP 1, 0\"  # module {number}, a {product}"),
            format!(
                "    ConnectionManager(\"--interface serial_tmcl --port {bus} --data-rate 9600 --module-id {number}\")  # \
                 module {number}, a {product}"
            ),
        ] {
            assert!(mixed.lines().any(|found| found == line), "{line}: {mixed}");
        }
    }
    assert!(!mixed.contains("--address 3") && !mixed.contains("--module-id 3"), "another module 2: {mixed}");
    assert!(mixed.contains(&format!("\n    tmcl send tcp:{tcp} \"GAP 1, 0\"  # module 1, a TMCM-1140\n")), "{mixed}");
    // Where all are the same there is nothing to be told apart.
    let same = said_of("6110,6110");
    assert!(
        same.contains(&format!("\n    tmcl send {bus} --address 1 \"GAP 1, 0\"\n")) && !same.contains('#'),
        "{same}"
    );
    assert!(!same.contains("--address 2"), "{same}");
}

#[test]
fn the_canopen_firmware_is_that_of_one_product() {
    let canopen = |product: &str, parts: &[&str]| refused(&["--firmware", "canopen", "--product", product], 2, parts);
    let why = "has no such firmware, only the TMCM-1140 has. Leave out --firmware, or run the TMCM-1140";
    canopen("6110", &["--firmware canopen: the TMCM-6110 ", why]);
    canopen("1140,3110", &["--firmware canopen: the TMCM-3110 ", why]);
    for arguments in [&["--modules", "2", "--product", "1140"][..], &["--product", "1140,1140"]] {
        let said = said(&[&["--firmware", "canopen"], arguments].concat());
        assert!(said.starts_with("2 virtual TMCM-1140s with CANopen firmware version 3.20. "), "{said}");
    }
}

/// Modules of four products are on an RS485 bus and a CAN bus. Each has the address of its number, its own axes, and
/// its own settings, and nobody takes what another one says for a request.
#[test]
fn different_products_share_the_buses() {
    let sim =
        Sim::start(&[&MIXED[..], &TCP, &CONTROL, &FAST, &["--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"]].concat());
    let (mut bus, mut can) = (Bus::of(&sim), Master::new(&sim));
    for (module, (version, axes, _)) in (1..).zip(PRODUCTS) {
        assert_eq!(bus.ok(module, "136, 1, 0, 0"), version);
        can.send(module.into(), &[136, 1, 0, 0, 0, 0, 0]);
        can.until(2, &[&[module, 100, 136][..], &version.to_be_bytes()].concat());
        for axis in 0..axes {
            let target = place(module, axis);
            bus.ok(module, &format!("MVP ABS, {axis}, {target}"));
        }
        // MVP ABS to an axis that does not exist.
        assert_eq!(bus.ask(module, &format!("MVP ABS, {axes}, 5")).status, 4);
        can.send(module.into(), &[4, 0, axes, 0, 0, 0, 5]);
        can.until(2, &[module, 4, 4, 0, 0, 0, 5]);
    }
    for (module, (_, axes, _)) in (1..).zip(PRODUCTS) {
        for axis in 0..axes {
            while bus.ok(module, &format!("GAP 8, {axis}")) == 0 {}
            // GAP 1 over CAN, as it was told over RS485.
            let target = place(module, axis);
            can.send(module.into(), &[6, 1, axis, 0, 0, 0, 0]);
            can.until(2, &[&[module, 100, 6][..], &target.to_be_bytes()].concat());
        }
        let state = sim.control(&[&format!("module {module} state")]);
        let expected: Vec<_> = (0..axes).map(|axis| place(module, axis)).collect();
        assert_eq!(of_axes(&state, "rotor"), expected, "module {module}");
    }
    assert_eq!(sim.tcp().ok("136, 1, 0, 0"), PRODUCTS[0].0, "USB is that of module 1");
    let error = |line: &str| sim.control(&[line])["error"].clone();
    assert_eq!(error("press left 1"), "no axis 1: the TMCM-1140 has one, axis 0");
    assert_eq!(error("module 2 press left 3"), "no axis 3: the TMCM-3110 has axes 0 to 2");
    assert_eq!(error("module 3 press left 3"), "no axis 3: the TMCM-3212 has axes 0 to 2");
    assert_eq!(error("module 4 press left 6"), "no axis 6: the TMCM-6110 has axes 0 to 5");
    assert_eq!(error("module 5 press left 1"), "no axis 1: the TMCM-1110 has one, axis 0");
    assert_eq!(error("module 6 state"), "no module 6: there are 5 modules");
}

/// Module 2 has the address to which replies go, and hears what module 1 says. With six axes its requests look like
/// refusals of others: SAP and MVP have the numbers 5 and 4.
#[test]
fn module_2_hears_what_is_for_any_of_its_axes() {
    let sim = Sim::start(&["--product", "1140,6110", "--rs485", "{}/bus", "--slcan-tcp", "127.0.0.1:0"]);
    let (mut bus, mut can) = (Bus::of(&sim), Master::new(&sim));
    for axis in 0..6 {
        for (module, status) in [(1, if axis == 0 { 100 } else { 4 }), (2, 100)] {
            let value = place(module, axis);
            for line in [format!("SAP 4, {axis}, {value}"), format!("GAP 4, {axis}"), format!("MVP REL, {axis}, 0")] {
                assert_eq!(bus.ask(module, &line).status, status, "{module}: {line}");
            }
            // SAP 5, GAP 5 and MVP REL over CAN; what is refused comes back as it is.
            let [high, low] = value.to_be_bytes()[2..] else { continue };
            for request in [[5, 5, axis, 0, 0, high, low], [6, 5, axis, 0, 0, high, low], [4, 1, axis, 0, 0, 0, 0]] {
                can.send(module.into(), &request);
                can.until(2, &[&[module, status, request[0]], &request[3..]].concat());
            }
        }
    }
}

/// Each module has a file of its product's size, and finds there what it has stored, however the simulator ended.
#[test]
fn each_product_has_an_eeprom_of_its_own_size() {
    let options = [&MIXED[..], &["--rs485", "{}/bus", "--eeprom", "{}/module.bin"]].concat();
    let sim = Sim::start(&options);
    let mut bus = Bus::of(&sim);
    for (module, (_, axes, _)) in (1..).zip(PRODUCTS) {
        for axis in 0..axes {
            bus.ok(module, &format!("SCO 1, {axis}, {}", place(module, axis)));
        }
        bus.ok(module, "SCO 0, 255, 0");
    }
    let (_, folder) = sim.end(Signal::KILL);
    for (name, (_, _, size)) in FILES.into_iter().zip(PRODUCTS) {
        assert_eq!(fs::metadata(folder.path().join(name)).unwrap().len(), size, "{name}");
    }
    let sim = Sim::start_in(folder, &options);
    let mut bus = Bus::of(&sim);
    for (module, (_, axes, _)) in (1..).zip(PRODUCTS) {
        bus.ok(module, "GCO 0, 255");
        for axis in 0..axes {
            assert_eq!(bus.ok(module, &format!("GCO 1, {axis}")), place(module, axis));
        }
    }
}

#[test]
fn a_file_of_another_size_is_refused_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let eeprom = path("module.bin");
    let start = |product: &str, parts: &[&str]| {
        refused(&["--product", product, "--eeprom", &eeprom, "--tcp", "127.0.0.1:0"], 1, parts);
    };
    fs::write(&eeprom, vec![0xFF; 16_384]).unwrap();
    let small = " has 16384 bytes like that of a TMCM-1140 or TMCM-1110, the EEPROM of a TMCM-";
    let left = "6110 has 32768; the file is left alone. ";
    start("6110", &[&format!("--eeprom: {eeprom}{small}{left}"), "Give another name"]);
    start("3110,1140", &[&format!("{small}3110 has 32768; ")]);
    fs::write(path("module.bin.2"), vec![0xFF; 32_768]).unwrap();
    let large = " has 32768 bytes like that of a TMCM-3110 or TMCM-6110, the EEPROM of a TMCM-1140 has 16384; ";
    start("1140,1140", &[&format!("--eeprom: {}{large}", path("module.bin.2"))]);
    fs::write(path("module.bin.3"), vec![0xFF; 100]).unwrap();
    let odd = " has 100 bytes, the EEPROM of a TMCM-6110 has 32768; the file is left alone. ";
    start("1140,3110,6110", &[&format!("--eeprom: {}{odd}", path("module.bin.3"))]);
    fs::write(path("module.bin.4"), vec![0xFF; 65_536]).unwrap();
    let largest = " has 65536 bytes like that of a TMCM-3212, the EEPROM of a TMCM-6110 has 32768; ";
    fs::remove_file(path("module.bin.3")).unwrap();
    start("1140,3110,6110,6110", &[&format!("--eeprom: {}{largest}", path("module.bin.4"))]);
    let sizes = [0, 1, 3].map(|file| fs::metadata(path(FILES[file])).unwrap().len());
    assert_eq!(sizes, [16_384, 32_768, 65_536], "all are left alone");
}

/// Data that another product has stored are none of the module's business, until it stores something itself.
#[test]
fn settings_of_another_product_are_left_alone() {
    // Both EEPROMs end with the settings.
    let moved = |stored: Vec<u8>| [vec![0xFF; 32_768 - stored.len()], stored].concat();
    for (product, other) in [("6110", "1140"), ("3110", "1140"), ("6110", "3110")] {
        let options = |product| [&["--product", product, "--eeprom", "{}/module.bin"][..], &TCP].concat();
        let sim = Sim::start(&options(other));
        let mut host = sim.tcp();
        host.ok("SAP 4, 0, 77");
        host.ok("STAP 4, 0");
        host.ok("SGP 69, 0, 5");
        let (_, folder) = sim.end(Signal::TERM);
        let path = folder.path().join("module.bin");
        let stored = moved(fs::read(&path).unwrap());
        fs::write(&path, &stored).unwrap();
        let messages = folder.path().join("messages");
        let sim = Sim::start_saying(folder, &options(product), File::create(&messages).unwrap().into());
        let mut host = sim.tcp();
        assert_eq!(
            (host.ok("GAP 4, 0"), host.ok("GGP 69, 0")),
            (1000, 8),
            "a {product} with what a {other} has stored"
        );
        let told = fs::read_to_string(&messages).unwrap();
        assert!(told.contains("settings pages are not this firmware's or damaged, 0 are good"), "{told}");
        assert!(fs::read(&path).unwrap() == stored, "a {product} leaves alone what a {other} has stored");
        host.ok("SAP 4, 0, 88");
        host.ok("STAP 4, 0");
        let (_, folder) = sim.end(Signal::KILL);
        let sim = Sim::start_in(folder, &options(product));
        assert_eq!(sim.tcp().ok("GAP 4, 0"), 88, "a {product} after a {other}");
    }
}
