//! The surroundings of modules with several axes: world files, switches, loads, faults, encoders, inputs and outputs.

use std::fs;

use serde_json::Value;

use super::harness::{PATIENCE, Sim, run};
use super::sim_products::{of_axes, refused};

const LINKS: [&str; 6] = ["--tcp", "127.0.0.1:0", "--control", "127.0.0.1:0", "--speed", "20"];

/// A module of a product in a world.
fn start(product: &str, world: &str) -> Sim {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("world.toml"), world).unwrap();
    Sim::start_in(folder, &[&LINKS[..], &["--product", product, "--world", "{}/world.toml"]].concat())
}

/// The error of a line at the control port.
fn error(sim: &Sim, line: &str) -> String {
    let answer = sim.control(&[line]);
    assert_eq!(answer["ok"], false, "{line}");
    answer["error"].as_str().unwrap().into()
}

/// Has the control port carry out lines that it must take, and gives the state after them.
fn state(sim: &Sim, lines: &[&str]) -> Value {
    for line in lines {
        assert_eq!(sim.control(&[line])["ok"], true, "{line}");
    }
    sim.control(&["state"])
}

/// Waits for a state.
fn until(sim: &Sim, what: &str, there: impl Fn(&Value) -> bool) -> Value {
    let end = std::time::Instant::now() + PATIENCE;
    loop {
        let state = sim.control(&["state"]);
        if there(&state) {
            return state;
        }
        assert!(std::time::Instant::now() < end, "{what}: {state}");
    }
}

/// A list of six, or another number, with one value that is different.
fn only(axes: usize, axis: usize, other: i64, usual: i64) -> Vec<i64> {
    (0..axes).map(|n| if n == axis { other } else { usual }).collect()
}

#[test]
fn a_world_file_has_no_more_axes_than_the_product() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("world.toml");
    let path = path.to_str().unwrap();
    let wrong = |product: &str, world: &str, error: &str| {
        fs::write(path, world).unwrap();
        refused(
            &["--product", product, "--world", path, "--tcp", "127.0.0.1:0"],
            1,
            &[&format!("--world: {path}: {error}\n")],
        );
    };
    let axes = |count: usize| "\n[[axis]]".repeat(count);
    wrong("1140", &axes(2), "line 3: this is [[axis]] number 2, and the TMCM-1140 has one axis");
    wrong("3110", &axes(6), "line 5: this is [[axis]] number 4, and the TMCM-3110 has 3 axes");
    wrong("6110", &axes(7), "line 8: this is [[axis]] number 7, and the TMCM-6110 has 6 axes");
    // Of several modules it is said which one cannot have it, unless all are the same.
    wrong("3110,3110", &axes(4), "line 5: this is [[axis]] number 4, and the TMCM-3110 has 3 axes");
    wrong("6110,3110", &axes(4), "module 2: line 5: this is [[axis]] number 4, and the TMCM-3110 has 3 axes");
    wrong("6110,3110,1140", &axes(2), "module 3: line 3: this is [[axis]] number 2, and the TMCM-1140 has one axis");
    let none = "abn.lines: no ABN encoder can be connected to the TMCM-6110; leave out the table";
    wrong("6110", "[abn]\nlines = 500", &format!("line 2: {none}"));
    wrong("6110", "[[axis]]\n[[axis]]\nabn.lines = 500", &format!("line 3: axis 1: {none}"));
    wrong("3110,6110", "[[axis]]\nabn.lines = 500", &format!("module 2: line 2: axis 0: {none}"));
    wrong("3110", "[[axis]]\n[[axis]]\nmotor.load = 1.5", "line 3: axis 1: motor.load: 1.5 is not within 0 to 1");
    // Stages that cannot be, on every product.
    for (product, encoder) in [("1140", None), ("3110", Some("3110")), ("3212", Some("3212")), ("6110", Some("6110"))] {
        let behind = "no search ever finds it";
        wrong(
            product,
            "[stage]\nleft = 500\n\nright = -500",
            "line 2: stage.left: 500 is not below stage.right (-500); if the motor is built in the other way round, \
             stage.reversed = true says so",
        );
        wrong(
            product,
            "[[axis]]\n[axis.stage]\nhard_right = 900\nhome = [1000, 1100]",
            &format!(
                "line 4: axis 0: stage.home: 1000 to 1100 is behind the hard end stage.hard_right (900): {behind}"
            ),
        );
        wrong(
            product,
            "stage.hard_left = 10",
            "line 1: motor.start: the rotor cannot start at 0, below the hard end stage.hard_left (10)",
        );
        if let Some(name) = encoder {
            let error = format!("line 1: encoder.offset: the TMCM-{name} has no built-in encoder; leave it out");
            wrong(product, "encoder.offset = 5", &error);
        }
    }
    wrong(
        "3110",
        "[[axis]]\nstart = 5",
        "TOML parse error at line 2, column 1\n  |\n2 | start = 5\n  | ^^^^^\nunknown field `start`, expected one of `motor`, `stage`, `abn`, `encoder`",
    );
    let missing = folder.path().join("missing");
    let output = run(&["sim", "--product", "1140,6110", "--world", missing.to_str().unwrap()]);
    assert_eq!(output.status.code(), Some(1));
}

/// In the example with three axes each finds its own switches, on either product. The other axes of the TMCM-6110 have
/// what the file says for all of them, and nothing in their way.
#[test]
fn each_axis_of_the_gantry_finds_its_own_place() {
    let gantry = xtask::workspace().unwrap().join("hal-sim/worlds/gantry.toml");
    for (product, axes) in [("3110", 3), ("6110", 6)] {
        let sim = Sim::start(&[&LINKS[..], &["--product", product, "--world", gantry.to_str().unwrap()]].concat());
        let mut host = sim.tcp();
        let starts = of_axes(&sim.control(&["state"]), "rotor");
        assert_eq!(starts, [102_400, 51_200, 25_600, 0, 0, 0][..axes]);
        // The left switch, the middle of the home switch from the left switch, and the right switch.
        for (axis, mode) in [(0, 1), (1, 7), (2, 65)] {
            host.ok(&format!("SAP 193, {axis}, {mode}"));
            host.ok(&format!("RFS START, {axis}"));
        }
        if axes > 3 {
            host.ok("MVP ABS, 4, 12345");
        }
        (0..3).for_each(|axis| host.until(&format!("RFS STATUS, {axis}"), 0));
        let state = sim.control(&["state"]);
        for (axis, place) in [(0, 0_i64), (1, (304_640 + 309_760) / 2), (2, 409_600)] {
            let rotor = state["axes"][axis]["rotor"].as_i64().unwrap();
            assert!((rotor - place).abs() <= 16, "axis {axis} of the {product}: {rotor} for {place}");
        }
        if axes > 3 {
            host.until("GAP 8, 4", 1);
            assert_eq!(of_axes(&sim.control(&["state"]), "rotor")[3..], [0, 12_345, 0]);
        }
    }
}

/// The switches of these products have pins of their own: they are not at the digital inputs.
#[test]
fn each_axis_has_its_own_switches() {
    for (product, axes) in [("3110", 3), ("6110", 6)] {
        let sim = start(product, "");
        let mut host = sim.tcp();
        for (switch, parameter) in [("left", 11), ("right", 10), ("home", 9)] {
            for axis in 0..axes {
                sim.control(&[&format!("press {switch} {axis}")]);
                host.until(&format!("GAP {parameter}, {axis}"), 1);
                let seen: Vec<i64> = (0..axes).map(|n| host.ok(&format!("GAP {parameter}, {n}")).into()).collect();
                assert_eq!(seen, only(axes, axis, 1, 0), "{switch} {axis}");
                assert_eq!(host.ok("GIO 255, 0"), 0);
                sim.control(&[&format!("release {switch} {axis}")]);
                host.until(&format!("GAP {parameter}, {axis}"), 0);
            }
        }
        for line in
            ["press left #", "release home #", "load 0.5 #", "slip 4 #", "fault tmc429 on #", "fault open-a on #"]
        {
            let expected = format!("no axis {axes}: the TMCM-{product} has axes 0 to {}", axes - 1);
            assert_eq!(error(&sim, &line.replace('#', &axes.to_string())), expected, "{line}");
        }
        assert_eq!(
            error(&sim, "fault encoder on 1"),
            format!("fault 'encoder': the TMCM-{product} has no built-in encoder")
        );
    }
}

#[test]
fn inputs_and_outputs_are_those_of_the_product() {
    for product in ["3110", "6110"] {
        let sim = start(product, "");
        let mut host = sim.tcp();
        for number in 0..8 {
            sim.control(&[&format!("input {number} 1")]);
            host.until(&format!("GIO {number}, 0"), 1);
            assert_eq!(host.ok("GIO 255, 0"), 1 << number);
            let full = if [0, 4].contains(&number) { 4095 } else { 0 };
            assert_eq!(host.ok("GIO 0, 1") + host.ok("GIO 4, 1"), full);
            sim.control(&[&format!("input {number} 0")]);
            host.until(&format!("GIO {number}, 0"), 0);
        }
        sim.control(&["analog 0 1000", "analog 4 3000"]);
        host.until("GIO 4, 1", 3000);
        assert_eq!(
            (host.ok("GIO 0, 1"), host.ok("GIO 255, 0")),
            (1000, 1 << 4),
            "from half of full scale on it is high"
        );
        for number in 0..8 {
            host.ok(&format!("SIO {number}, 2, 1"));
            let state = until(&sim, "output", |state| state["outputs"][number] == true);
            let on: Vec<bool> = (0..8).map(|n| n <= number).collect();
            assert_eq!(state["outputs"], Value::from(on));
        }
        assert_eq!(error(&sim, "input 8 1"), format!("no input 8: the TMCM-{product} has inputs 0 to 7"));
        for number in [1, 3, 5, 7] {
            let expected = format!("no analog input {number}; of the TMCM-{product} are analog: 0, 4");
            assert_eq!(error(&sim, &format!("analog {number} 5")), expected);
        }
        assert_eq!(error(&sim, "input 1 2"), "input level '2' is not a number within 0 to 1");
    }
}

/// `state` has what it always had, of axis 0, and all axes in a list.
#[test]
fn the_state_tells_of_all_axes() {
    for (product, axes) in [("1140", 1), ("3110", 3), ("6110", 6)] {
        let sim = start(product, "[[axis]]\nmotor.start = 1024\nmotor.load = 0.25");
        let state = state(&sim, &["press right"]);
        assert_eq!(state["axes"].as_array().unwrap().len(), axes);
        for (name, value) in state["axes"][0].as_object().unwrap() {
            assert_eq!(&state[name], value, "{name} of the {product}");
        }
        let fields = (&state["rotor"], &state["load"], &state["switches"]["right"]);
        assert_eq!(fields, (&1024.into(), &0.25.into(), &true.into()));
        let outputs = if product == "1140" { 2 } else { 8 };
        assert_eq!(state["outputs"].as_array().unwrap().len(), outputs);
        assert_eq!(state["pull_up_groups"].as_array().unwrap().len(), if product == "6110" { 2 } else { 1 });
    }
}

#[test]
fn loads_blows_and_faults_of_a_driver_meet_one_axis() {
    for (product, axes) in [("3110", 3), ("6110", 6)] {
        let sim = start(product, "");
        let mut host = sim.tcp();
        let last = axes - 1;
        let state_after = state(&sim, &[&format!("slip 8 {last}")]);
        assert_eq!(of_axes(&state_after, "rotor"), only(axes, last, 2048, 0));
        let turning: Vec<i64> = (0..axes as i64).map(|axis| 500 + 10 * axis).collect();
        (0..axes).for_each(|axis| {
            host.ok(&format!("ROR {axis}, {}", turning[axis]));
        });
        let speeds = |state: &Value| of_axes(state, "velocity").iter().map(|v| v.as_i64().unwrap()).collect::<Vec<_>>();
        until(&sim, "speeds", |state| speeds(state) == turning);
        // Of one motor the load keeps the rotor.
        sim.control(&["load 1 1"]);
        let lost =
            |state: &Value| of_axes(state, "lost_steps").iter().map(|n| n.as_i64().unwrap() > 100).collect::<Vec<_>>();
        let alone = |axis: usize| (0..axes).map(|n| n == axis).collect::<Vec<_>>();
        let state = until(&sim, "lost steps", |state| lost(state)[1]);
        assert_eq!((lost(&state), speeds(&state)), (alone(1), turning.clone()));
        sim.control(&["load 0 1"]);
        // One driver is too hot: that motor stops, and parameter 208 tells why.
        sim.control(&[&format!("fault overtemperature on {last}")]);
        let state = until(&sim, "over-temperature", |state| speeds(state)[last] == 0);
        assert_eq!(speeds(&state)[..last], turning[..last]);
        let hot: Vec<bool> = (0..axes).map(|axis| host.ok(&format!("GAP 208, {axis}")) & 2 != 0).collect();
        assert_eq!(hot, alone(last));
        // One driver is silent: the others are driven as before.
        sim.control(&["fault tmc262 on 0"]);
        (1..last).for_each(|axis| {
            host.ok(&format!("MVP ABS, {axis}, 1000"));
        });
        (1..last).for_each(|axis| host.until(&format!("GAP 1, {axis}"), 1000));
        let bridges = of_axes(&sim.control(&["state"]), "bridges_on");
        assert!(bridges[..last].iter().all(|on| *on == true) && bridges[last] == false, "{bridges:?}");
    }
}

/// A motion controller moves three axes. Without an answer of one of them nothing moves any more, on either.
#[test]
fn a_silent_controller_takes_its_own_axes_with_it_and_stops_all() {
    for (silent, hear) in [(4, [true, true, true, false, false, false]), (1, [false, false, false, true, true, true])] {
        let sim = start("6110", "");
        let mut host = sim.tcp();
        (0..6).for_each(|axis| {
            host.ok(&format!("ROR {axis}, 500"));
        });
        let turn = |state: &Value| of_axes(state, "velocity").iter().map(|speed| *speed != 0).collect::<Vec<_>>();
        until(&sim, "all turn", |state| of_axes(state, "velocity") == [500; 6]);
        sim.control(&[&format!("fault tmc429 on {silent}")]);
        let state = until(&sim, "drivers off", |state| of_axes(state, "bridges_on") == [false; 6]);
        // Who cannot hear that it is to stop does not.
        assert!(
            turn(&state).iter().zip(hear).all(|(turns, hears)| !hears || !turns) && turn(&state)[silent],
            "{state}"
        );
        for axis in 0..6 {
            assert_eq!(host.ask(&format!("ROR {axis}, 500")).status, 6);
        }
        sim.control(&[&format!("fault tmc429 off {silent}")]);
        until(&sim, "all stand", |state| of_axes(state, "velocity") == [0; 6]);
    }
}

/// Each axis of the TMCM-3110 has an encoder on pins of its own, beside its switches.
#[test]
fn each_axis_has_its_own_encoder() {
    let world = "
        [abn]
        lines = 256
        [stage]
        right = 500000
        [[axis]]
        [[axis]]
        abn.lines = 512
        [[axis]]
        motor.steps_per_turn = 400
    ";
    let sim = start("3110", world);
    let mut host = sim.tcp();
    let mut counts = || [0, 1, 2].map(|axis| host.ok(&format!("GAP 209, {axis}")));
    assert_eq!(counts(), [0; 3]);
    // 200 full steps are a turn of axes 0 and 1, which is 1024 and 2048 counts. The default prescaler makes 50
    // microsteps of each.
    for (axis, expected) in [(0, [51_200, 0, 0]), (1, [51_200, 102_400, 0]), (2, [51_200, 102_400, 25_600])] {
        let before = of_axes(&sim.control(&["state"]), "abn");
        let after = of_axes(&state(&sim, &[&format!("slip 200 {axis}")]), "abn");
        assert!((0..3).all(|n| (before[n] != after[n]) == (n == axis)), "{before:?} {after:?}");
        let end = std::time::Instant::now() + PATIENCE;
        while counts() != expected {
            assert!(std::time::Instant::now() < end, "axis {axis}: {:?}", counts());
        }
    }
    // Tracks and switches are apart.
    host.ok("SAP 12, 1, 0");
    host.ok("MVP ABS, 1, 600000");
    host.until("GAP 10, 1", 1);
    assert_eq!((host.ok("GAP 10, 0"), host.ok("GAP 10, 2"), host.ok("GIO 255, 0")), (0, 0, 0));
    host.until("GAP 3, 1", 0);
    let rotor = of_axes(&sim.control(&["state"]), "rotor")[1].as_i64().unwrap();
    assert!((500_000..500_200).contains(&rotor), "{rotor}");
}
