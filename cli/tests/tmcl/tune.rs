//! `tmcl tune`: what it proposes works, and what it touched is as before.

use std::process::Output;

use super::fake::{Fake, State};
use super::harness::{Sim, complaint, run};

/// The file of the example that has this extension.
pub(super) fn example(extension: &str) -> String {
    let path = xtask::workspace().unwrap().join("examples/stall_homing").with_extension(extension);
    path.to_str().unwrap().to_owned()
}
/// The hard end of the example's stage, and how far the program goes away from it.
const HARD_END: i32 = -102_400;
const AWAY: i32 = 51_200;
/// A few full steps, of 256 microsteps.
const FEW: i32 = 10 * 256;

/// Numbers drawn from a seed.
struct Draw(u64);

impl Draw {
    /// A number from `low` to `high`.
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 33) as f64 / f64::from(1_u32 << 31))
    }
}

/// The example's stage with another motor on it.
fn world(seed: u64) -> String {
    let mut draw = Draw(seed);
    // The first numbers of seeds that are close to each other are close, too.
    for _ in 0..4 {
        draw.within(0.0, 1.0);
    }
    let mut whole = |low: f64, high: f64| draw.within(low, high).round();
    let (zero, span, speed, noise) = (whole(-30.0, 40.0), whole(300.0, 900.0), whole(0.0, 150.0), whole(0.0, 12.0));
    let (friction, inertia, load) = (draw.within(0.02, 0.15), draw.within(0.0, 0.2), draw.within(0.0, 0.05));
    format!(
        "seed = {seed}\n[motor]\nfriction = {friction:.3}\ninertia = {inertia:.3}\nload = {load:.3}\n\
         stall_guard_noise = {noise}\nstall_guard_zero = {zero}\nstall_guard_span = {span}\nstall_guard_speed = {speed}\n\
         [stage]\nhard_left = {HARD_END}\n"
    )
}

pub(super) fn shown(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// The value that is proposed for a parameter of axis 0.
pub(super) fn proposed(text: &str, parameter: u8) -> Option<i32> {
    let start = format!("SAP {parameter}, 0, ");
    let line = text.lines().find_map(|line| line.strip_prefix(&start))?;
    line.split_whitespace().next().map(|value| value.parse().unwrap())
}

/// Runs the example with a threshold. Whether it has found its zero at the hard end: by the encoder, which counts from
/// where the motor was at the start, it then stands `AWAY` from there.
fn homes(folder: &tempfile::TempDir, world: &str, threshold: i32) -> bool {
    let source = std::fs::read_to_string(example("tmc")).unwrap();
    let changed = source.replace("Threshold = 1 ", &format!("Threshold = {threshold} "));
    assert!(changed != source || threshold == 1);
    let program = folder.path().join("homing.tmc");
    std::fs::write(&program, changed).unwrap();
    let output = run(&["run", program.to_str().unwrap(), "--world", world, "--at", "9900 ms: GAP 209, 0"]);
    let report = shown(&output);
    assert!(output.status.success(), "{}", complaint(&output));
    let line = report.lines().find_map(|line| line.split_once("GAP 209, 0: ")).unwrap().1;
    let encoder: i32 = line.split_whitespace().next().unwrap().parse().unwrap();
    report.contains("OUT0 on") && report.contains("end               STOP") && (encoder - HARD_END - AWAY).abs() <= FEW
}

/// In ten random worlds out of ten the proposed threshold brings the example home. And not because any would: the
/// lowest stops it at once, and the highest never.
#[test]
fn the_proposed_threshold_homes_in_ten_random_worlds() {
    let folder = tempfile::tempdir().unwrap();
    let mut thresholds = Vec::new();
    for seed in 1..=10 {
        let path = folder.path().join("world.toml");
        std::fs::write(&path, world(seed)).unwrap();
        let path = path.to_str().unwrap();
        let output = run(&["tune", "stallguard", "sim", "--world", path, "--speeds", "800"]);
        assert!(output.status.success(), "{}\n{}\n{}", world(seed), shown(&output), complaint(&output));
        let threshold = proposed(&shown(&output), 174).unwrap();
        assert!(homes(&folder, path, threshold), "{threshold} does not home in\n{}\n{}", world(seed), shown(&output));
        for worst in [-64, 63] {
            assert!(!homes(&folder, path, worst), "{worst} homes in\n{}", world(seed));
        }
        thresholds.push(threshold);
    }
    let (low, high) = (*thresholds.iter().min().unwrap(), *thresholds.iter().max().unwrap());
    assert!(high - low > 30, "the worlds are all alike: {thresholds:?}");
    assert!(!homes(&folder, folder.path().join("world.toml").to_str().unwrap(), low.min(high - 30)));
}

/// The example's stage as it is. With half of the current (parameter 6: 128, of 32 steps the 17th) and a friction of a
/// tenth the load of the free motor is a tenth of 17/32. So the value is 512 x (1 - 0.188) + 64 x (SGT - 5) with a
/// noise of 4. It is above 0 from SGT -1 on. The load takes nine tenths of the rest: 512 x 0.1 x 0.812 = 42 is left, so
/// it is 0 up to SGT 4.
#[test]
fn the_example_s_threshold() {
    let world = example("toml");
    let output = run(&["tune", "stallguard", "sim", "--world", &world, "--speeds", "800"]);
    let text = shown(&output);
    assert_eq!([174, 173, 181].map(|number| proposed(&text, number)), [Some(1), Some(0), Some(640)], "{text}");
    assert!(text.contains("// within -1 to 4,"), "{text}");
    assert!(complaint(&output).starts_with("To measure stallGuard2, motor 0 goes to and fro between 0 and "));
}

/// Where the curves go to standard output, the rest goes to standard error.
#[test]
fn curves_on_standard_output_are_alone_there() {
    let world = example("toml");
    let output = run(&["tune", "stallguard", "sim", "--world", &world, "--speeds", "800", "--plot", "-"]);
    let (image, rest) = (shown(&output), complaint(&output));
    assert!(image.starts_with("<svg") && image.ends_with("</svg>\n"), "{image}");
    assert_eq!(proposed(&rest, 174), Some(1), "{rest}");
}

/// A motor that has a load of 0.2 and a friction of 0.1 already has 0.231 of its 17/32 in reserve, of which nine tenths
/// come to its load: 0.408.
#[test]
fn what_loads_the_motor_already_stays() {
    let folder = tempfile::tempdir().unwrap();
    let world = folder.path().join("world.toml");
    std::fs::write(&world, "[motor]\nfriction = 0.1\nload = 0.2\n").unwrap();
    let output = run(&["tune", "stallguard", "sim", "--world", world.to_str().unwrap(), "--speeds", "800"]);
    let text = shown(&output);
    assert!(text.starts_with("Axis 0 of a TMCM-1140 at 800 int (24414 pps), load 0.41: "), "{text}");
}

/// With SGT 2 the value is 224 without load at the whole current of 17/32 and 138 at 9/32, and 0 under load. So the
/// current falls to the half as long as the upper threshold, (172 + 1) * 32, is not above 138, and sometimes above 160
/// with noise.
#[test]
fn coolstep_saves_current_and_gives_it_back() {
    let world = example("toml");
    let output = run(&["tune", "coolstep", "sim", "--world", &world, "--speeds", "800", "--threshold", "2"]);
    let text = shown(&output);
    assert!(output.status.success(), "{}", complaint(&output));
    let row = |name: &str| text.lines().find(|line| line.starts_with(name)).unwrap().to_owned();
    assert!(row("off").contains("16 (16 to 16)   16 (16 to 16)   22"), "{text}");
    assert!(row("172 = 2").contains(" 8 (8 to 8)   16 (16 to 16)"), "{text}");
    assert!(row("172 = 7").contains("16 (16 to 16)   16 (16 to 16)"), "{text}");
    assert!(matches!(proposed(&text, 172), Some(2 | 3)), "{text}");
    assert_eq!([173, 174, 182, 183].map(|number| proposed(&text, number)), [1, 2, 640, 128].map(Some), "{text}");
}

#[test]
fn what_cannot_be_measured_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let world = folder.path().join("world.toml");
    let world = world.to_str().unwrap();
    let tune = |text: &str, more: &[&str]| {
        std::fs::write(world, text).unwrap();
        let mut arguments = vec!["tune", "stallguard", "sim", "--world", world, "--speeds", "800"];
        arguments.extend(more);
        let output = run(&arguments);
        (output.status.code().unwrap(), complaint(&output))
    };
    // 200 full steps are too little room: v^2 / a for the ramps, and a few samples.
    let (code, message) = tune("[stage]\nhard_left = -1024\nhard_right = 1536\n", &[]);
    assert!(code == 1 && message.contains("has room for 512: give it more with --room"), "{message}");
    // Back-EMF is short below 5000 full steps a second, and this motor makes 95.
    let (code, message) = tune("[motor]\nstall_guard_speed = 5000\nstall_guard_noise = 20\n", &[]);
    assert!(code == 1 && message.contains("Try a higher speed, or load the motor more"), "{message}");
    // A load that the motor cannot bear makes it lose steps.
    let (code, message) = tune("", &["--load", "0.9"]);
    assert!(code == 1 && message.contains("full steps under load 0.90: give it less with --load"), "{message}");
    let (code, message) = tune("", &["--room", "0"]);
    assert!(code == 1 && message.contains("has room for 0"), "{message}");
    let (code, message) = tune("", &["--speeds", "60 s"]);
    assert!(code == 2 && message.contains("--speeds: 60 s: that is no speed"), "{message}");
    let (code, message) = tune("", &["--axis", "1"]);
    assert!(code == 1 && message.contains("axis 1: the module has axis 0 only"), "{message}");
    let (code, message) = tune("", &["--plot", "curve.png"]);
    assert!(code == 2 && message.contains(".svg"), "{message}");
}

/// With the highest threshold the load value says nothing, and the motor comes back all the same. In a module that ends
/// with the program nobody can bring back anything.
#[test]
fn a_motor_comes_back_from_a_measurement_that_fails() {
    let sim = module("1140");
    let before = settings(&sim);
    let (link, control) = ways(&sim);
    let arguments = ["--speeds", "2000", "--threshold", "63"];
    let output = run(&[&["tune", "coolstep", &link, "--control", &control, "--yes"], &arguments[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    let told = complaint(&output);
    assert!(told.contains("--threshold") && told.ends_with("; all settings are as before\n"), "{told}");
    assert_eq!(sim.tcp().ok("GAP 1, 0"), 0);
    assert_left_in_peace(&sim, &before);
    let world = example("toml");
    let output = run(&["tune", "stallguard", "sim", "--world", &world, "--speeds", "800", "--load", "0.9"]);
    assert!(!complaint(&output).contains("MVP ABS"), "{}", complaint(&output));
}

/// All settings of a module, as a file has them.
pub(super) fn settings(sim: &Sim) -> String {
    let file = sim.path("settings");
    let link = format!("tcp:{}", sim.told("tcp"));
    let output = run(&["params", &link, "save", file.to_str().unwrap()]);
    assert!(output.status.success(), "{}", complaint(&output));
    std::fs::read_to_string(file).unwrap()
}

/// A module on the example's stage whose time goes faster, with settings that are not the usual ones.
pub(super) fn module(product: &str) -> Sim {
    let world = example("toml");
    let sim = Sim::start(&[
        "--tcp",
        "127.0.0.1:0",
        "--control",
        "127.0.0.1:0",
        "--world",
        &world,
        "--speed",
        "2",
        "--product",
        product,
    ]);
    let mut host = sim.tcp();
    if product == "3212" {
        // Short ramps, so that the test does not take long.
        host.ok("SAP 5, 0, 1000000");
        host.ok("SAP 17, 0, 1000000");
    }
    for (parameter, value) in
        [(174, -3), (172, 4), (168, 1), (169, 1), (171, 1), (170, 2), (173, 1), (181, 1500), (4, 1200)]
    {
        host.ok(&format!("SAP {parameter}, 0, {value}"));
    }
    sim
}

/// The link to it, and its control port.
pub(super) fn ways(sim: &Sim) -> (String, String) {
    (format!("tcp:{}", sim.told("tcp")), sim.told("control").into())
}

#[test]
fn by_the_control_port_all_is_as_before_in_the_end() {
    std::thread::scope(|scope| {
        for product in ["1140", "3212"] {
            scope.spawn(move || all_is_as_before(product));
        }
    });
}

fn all_is_as_before(product: &str) {
    let sim = module(product);
    let before_load = sim.control(&["load 0.01", "state"])["load"].clone();
    let before = settings(&sim);
    let (link, control) = ways(&sim);
    let plot = sim.path("curves.svg");
    let speed = if product == "3212" { "30000" } else { "2000" };
    let output = run(&[
        "tune",
        "stallguard",
        &link,
        "--control",
        &control,
        "--yes",
        "--speeds",
        speed,
        "--room",
        "100000",
        "--plot",
        plot.to_str().unwrap(),
    ]);
    assert!(output.status.success(), "{}", complaint(&output));
    assert!(
        proposed(&shown(&output), 174).is_some_and(|threshold| (-1..=5).contains(&threshold)),
        "{}",
        shown(&output)
    );
    assert_eq!(settings(&sim), before);
    let mut host = sim.tcp();
    assert_eq!((host.ok("GAP 1, 0"), host.ok("GAP 3, 0")), (0, 0));
    let state = sim.control(&["state"]);
    assert_eq!((&state["load"], &state["lost_steps"]), (&before_load, &0.into()));
    let image = std::fs::read_to_string(plot).unwrap();
    assert!(image.ends_with("</svg>\n") && image.contains("with load") && image.contains("parameter 174"), "{image}");
}

pub(super) fn assert_left_in_peace(sim: &Sim, before: &str) {
    let mut host = sim.tcp();
    assert_eq!((host.ok("GAP 3, 0"), host.ok("GAP 2, 0")), (0, 0));
    drop(host);
    assert_eq!(settings(sim), before);
    assert_eq!(sim.control(&["state"])["load"], 0.0);
}

/// A module that knows none of the commands that move a motor, and one that runs a program.
#[test]
fn modules_that_cannot_be_tuned() {
    let fake = Fake::start(State { mode: 1, ..State::default() });
    let output = run(&["tune", "stallguard", &fake.link, "--yes"]);
    assert_eq!(output.status.code(), Some(1));
    assert!(complaint(&output).contains("a program runs in the module"), "{}", complaint(&output));
    let fake = Fake::start(State { version: 0x270F_0100, ..State::default() });
    let output = run(&["tune", "stallguard", &fake.link, "--yes"]);
    assert!(complaint(&output).contains("a TMCM-9999 is not known here"), "{}", complaint(&output));
    let sim = module("1140");
    sim.tcp().ok("ROR 0, 500");
    let output = run(&["tune", "stallguard", &ways(&sim).0, "--yes"]);
    assert!(
        complaint(&output).contains("motor 0 turns; stop it first, for example with \"MST 0\""),
        "{}",
        complaint(&output)
    );
}
