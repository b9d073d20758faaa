//! `tmcl run`: a program in, a report, a trace and a plot out.

use std::process::Output;

use super::harness::{complaint, names, tmcl, type_into};
use super::page::words;
use super::pty::Terminal;

const SOURCE: &str = "\
        CALC LOAD, 2
        EI 255
        SAP 4, 0, 3000
Loop:   CSUB Count
        JC NZ, Loop
        COMP 7
        STOP
Count:  CALC SUB, 1
        AGP 3, 2
        WAIT TICKS, 0, 1
        RSUB
";

const TRACE: &str = "  time in ms    at         command                      accumulator           X  flags
       0.024     0         CALC LOAD, 2                           2           0
       0.024     1         EI 255                                 2           0
       0.024     2         SAP 4, 0, 3000                         2           0  no effect: value, motor or bank out of range
       0.024     3  Loop:  CSUB Count                             2           0
       0.024     7  Count: CALC SUB, 1                            1           0
       0.024     8         AGP 3, 2                               1           0
       0.024     9         WAIT TICKS, 0, 1                       1           0
      10.024    10         RSUB                                   1           0
      10.024     4         JC NZ, Loop                            1           0
      10.024     3  Loop:  CSUB Count                             1           0
      10.024     7  Count: CALC SUB, 1                            0           0  ZE
      10.024     8         AGP 3, 2                               0           0  ZE
      10.024     9         WAIT TICKS, 0, 1                       0           0  ZE
      20.024    10         RSUB                                   0           0  ZE
      20.024     4         JC NZ, Loop                            0           0  ZE
      20.024     5         COMP 7                                 0           0  LT
      20.024     6         STOP                                   0           0  LT
";

const REPORT: &str = "\
end               STOP at address 6 (Loop + 3)
virtual time      20.024 ms
commands executed 17, 1 of them without effect; the first: SAP 4, 0, 3000 at address 2, line 3: value, motor or bank out of range
position          0 microsteps
velocity          0 (internal units): the motor stands
outputs           OUT0 off, OUT1 off
accumulator       0
X register        0
error flags       none
user variables    as they were
";

/// A folder with a program, and `tmcl run` in it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(source: &str) -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        folder.write("program.tmc", source);
        folder
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).unwrap()
    }

    fn run(&self, arguments: &[&str]) -> Output {
        tmcl(&["run"]).args(arguments).current_dir(self.0.path()).output().unwrap()
    }

    /// The output of the program when all is well.
    fn shown(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    /// The complaint of the program when it ends with this code.
    fn complaint(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", complaint(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
        complaint(&output)
    }
}

/// The row of a report.
fn row<'a>(report: &'a str, name: &str) -> &'a str {
    let row = report.lines().find_map(|line| line.strip_prefix(name));
    row.unwrap_or_else(|| panic!("no row '{name}' in {report}")).trim()
}

#[test]
fn a_trace_and_a_report() {
    let folder = Folder::with(SOURCE);
    assert_eq!(folder.shown(&["program.tmc", "--trace"]), format!("{TRACE}\n{REPORT}"));
    assert_eq!(folder.shown(&["program.tmc", "--trace", "out"]), REPORT);
    assert_eq!(folder.read("out"), TRACE);
    // The same program, assembled; it has no labels then.
    assert!(tmcl(&["asm", "program.tmc"]).current_dir(folder.0.path()).output().unwrap().status.success());
    assert_eq!(row(&folder.shown(&["program.bin"]), "end"), "STOP at address 6");
}

#[test]
fn a_program_without_end_runs_until_its_time_is_over() {
    let folder =
        Folder::with("SGP 5, 2, -7\nSIO 1, 2, 1\nROR 0, 500\nCALC LOAD, 9\nCALCX LOAD\nL: WAIT RFS, 0, 0\nJA L\n");
    let report = folder.shown(&["program.tmc", "--until", "500 ms"]);
    assert_eq!(row(&report, "virtual time"), "500 ms");
    assert!(row(&report, "end").starts_with("still running after 500 ms, at address"), "{report}");
    assert_eq!(row(&report, "velocity"), "500 (internal units): the motor turns");
    assert_eq!(row(&report, "outputs"), "OUT0 off, OUT1 on");
    assert_eq!(row(&report, "accumulator"), "9");
    assert_eq!(row(&report, "X register"), "9");
    assert_eq!(row(&report, "user variables"), "5 = -7");
    let report = folder.shown(&["program.tmc"]);
    assert_eq!(row(&report, "virtual time"), "10 s");
    assert!(folder.complaint(2, &["program.tmc", "--until", "10"]).contains("for example '10 s'"));
}

#[test]
fn a_program_ends_in_many_ways() {
    let end = |source: &str, arguments: &[&str]| {
        let report = Folder::with(source).shown(&[&["program.tmc"], arguments].concat());
        row(&report, "end").to_string()
    };
    assert_eq!(end("#nostop\nCALC LOAD, 1\n", &[]), "an empty command at address 1: a program ends with STOP");
    assert_eq!(end("JA 2048\n", &[]), "JA 2048 at address 0 leads out of program memory");
    assert_eq!(end("L: JA L\n", &["--at", "5 ms: 128, 0, 0, 0"]), "stopped from outside, after address 0 (L)");
    assert_eq!(end("L: JA L\n", &["--at", "5 ms: 131, 0, 0, 0"]), "reset from outside, after address 0 (L)");
    assert_eq!(end("L: JA L\n", &["--at", "5 ms: power off"]), "the module has no power");
    let waiting = "still running after 30 ms, in WAIT TICKS at address 0";
    assert_eq!(end("WAIT TICKS, 0, 100\n", &["--until", "30 ms"]), waiting);
}

#[test]
fn the_world_and_the_host_have_their_say() {
    let folder = Folder::with(
        "SAP 13, 0, 0\nROL 0, 1000\nBegin: GAP 3, 0\nJC ZE, Begin\nTurn: GAP 3, 0\nJC NZ, Turn\nGet: GGP 0, 2\nJC ZE, Get\nSTOP\n",
    );
    let events = ["--at", "2 s: SGP 0, 2, 12", "--at", "500 ms: press left", "--at", "1 s: SAP 4, 0, 9999"];
    let report = folder.shown(&[&["program.tmc"], &events[..]].concat());
    assert_eq!(row(&report, "end"), "STOP at address 8 (Get + 2)");
    assert!(row(&report, "virtual time").starts_with("2.00"), "{report}");
    assert_eq!(row(&report, "accumulator"), "12");
    let (_, happened) = report.split_once("events").unwrap();
    let happened: Vec<&str> = happened.trim().lines().map(str::trim).collect();
    let expected = [
        "500 ms: press left",
        "1 s: SAP 4, 0, 9999: status 4 value, motor or bank out of range",
        "2 s: SGP 0, 2, 12: 12, status 100 ok",
    ];
    assert_eq!(happened, expected);
    // The trace has them between the commands.
    folder.shown(&[&["program.tmc", "--trace", "out"], &events[..]].concat());
    assert!(folder.read("out").contains("\n     500.000        // press left\n"));
    let wrong = folder.complaint(2, &["program.tmc", "--at", "500 ms: push left"]);
    assert!(wrong.contains("unknown command 'push'"), "{wrong}");
}

#[test]
fn a_world_of_ones_own() {
    let folder = Folder::with("SAP 12, 0, 0\nROR 0, 1000\nWAIT TICKS, 0, 200\nSTOP\n");
    folder.write("world.toml", "[stage]\nright = 20000\n");
    let report = folder.shown(&["program.tmc", "--world", "world.toml"]);
    assert_eq!(row(&report, "velocity"), "0 (internal units): the motor stands");
    folder.write("world.toml", "[stage]\nhard_right = 20000\n");
    let report = folder.shown(&["program.tmc", "--world", "world.toml"]);
    assert!(row(&report, "position").contains("; the motor has lost steps, it is "), "{report}");
    folder.write("world.toml", "[stage]\nfront = 1\n");
    let wrong = folder.complaint(1, &["program.tmc", "--world", "world.toml"]);
    assert!(wrong.contains("world.toml") && wrong.contains("front"), "{wrong}");
}

/// The tags of an XML document, which must be well-formed as far as tags go, and its texts.
fn texts(xml: &str) -> Vec<&str> {
    let (mut open, mut texts) = (Vec::new(), Vec::new());
    let mut rest = xml;
    while let Some((text, after)) = rest.split_once('<') {
        texts.extend(Some(text.trim()).filter(|text| !text.is_empty()));
        let (tag, after) = after.split_once('>').expect("a tag without an end");
        let name = tag.split([' ', '\n']).next().unwrap();
        assert_eq!(tag.matches('"').count() % 2, 0, "{tag}");
        if let Some(name) = name.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name));
        } else if !tag.ends_with('/') {
            open.push(name);
        }
        rest = after;
    }
    assert!(open.is_empty(), "{open:?} not closed");
    assert_eq!(rest.trim(), "");
    texts
}

#[test]
fn a_plot_has_its_panels_and_stays_small() {
    let folder = Folder::with(
        "SAP 174, 0, 1\nVECT 0, Blink\nSGP 0, 3, 7\nEI 0\nEI 255\nSAP 4, 0, 2000\nSAP 4, 0, 9000\n\
         Loop: MVP ABS, 0, 9000\nWAIT POS, 0, 0\nMVP ABS, 0, 0\nWAIT POS, 0, 0\nJA Loop\n\
         Blink: SIO 0, 2, 1\nSIO 1, 2, 0\nRETI\n",
    );
    folder.write("world.toml", "[motor]\nstall_guard_noise = 100\n");
    let options = ["program.tmc", "--world", "world.toml", "--plot", "out.svg", "--until"];
    let report = folder.shown(&[&options[..], &["3 s", "--at", "1 s: load 0.2"]].concat());
    assert_eq!(row(&report, "plot"), "out.svg");
    let svg = folder.read("out.svg");
    let texts = texts(&svg);
    for text in [
        "program.tmc",
        "3 s of virtual time",
        "position in microsteps",
        "velocity in internal units",
        "stallGuard2 value (parameter 206): 0 is a stall",
        "motor current in 1/32 of full scale",
        "OUT0",
        "Blink",
        "no effect",
        "load 0.2",
        "time in seconds",
    ] {
        assert!(texts.contains(&text), "{text} is not among {texts:?}");
    }
    // What never changes, and a rotor that is where it should be, are not drawn.
    for text in ["STOP", "left switch", "home switch", "OUT1", "IN0", "rotor, steps lost"] {
        assert!(!texts.contains(&text), "{text}");
    }
    folder.shown(&[&options[..], &["10 min"]].concat());
    assert!(folder.read("out.svg").len() < 200_000, "{}", folder.read("out.svg").len());
}

/// The plot opens its file before the run, so that no run is in vain, and goes to standard output by `-`.
#[test]
fn a_plot_goes_where_it_is_wanted() {
    let folder = Folder::with("ROR 0, 500\nWAIT TICKS, 0, 10\nSTOP\n");
    let output = folder.run(&["program.tmc", "--plot", "-"]);
    assert!(output.status.success());
    let svg = String::from_utf8(output.stdout.clone()).unwrap();
    assert!(texts(&svg).contains(&"program.tmc"));
    let report = complaint(&output);
    assert_eq!((row(&report, "end"), row(&report, "plot")), ("STOP at address 2", "standard output"));
    // A thousand hours would not end before the file is found to be impossible.
    let told = folder.complaint(1, &["program.tmc", "--until", "1000 h", "--plot", "none/out.svg"]);
    assert!(told.contains("cannot write none/out.svg"), "{told}");
    let told = folder.complaint(2, &["program.tmc", "--until", "1000 h", "--plot", "out.png"]);
    assert!(told.contains("give a name like plot.svg"), "{told}");
    assert_eq!(names(folder.0.path()), ["program.tmc"]);
    let output = folder.run(&["program.tmc", "--trace", "-"]);
    assert!(String::from_utf8(output.stdout).unwrap().contains("ROR 0, 500"));
}

/// Inputs, switches and the rotor are drawn where they say something: a motor that loses its steps at a hard end, and a
/// hand at an input and a switch.
#[test]
fn a_plot_shows_what_changes() {
    let folder = Folder::with("ROR 0, 500\nWAIT TICKS, 0, 100\nMST 0\nSTOP\n");
    folder.write("world.toml", "[stage]\nhard_right = 5000\n[motor]\nstall_guard_zero = 63\n");
    let events = ["--at", "100 ms: input 0 1", "--at", "200 ms: press left", "--at", "300 ms: release left"];
    let options = ["program.tmc", "--plot", "-", "--world", "world.toml"];
    let svg = String::from_utf8(folder.run(&[&options[..], &events[..]].concat()).stdout).unwrap();
    let there = texts(&svg);
    for text in ["rotor, steps lost", "out of step", "IN0", "left switch"] {
        assert!(there.contains(&text), "{text} is not among {there:?}");
    }
    assert!(!there.contains(&"right switch") && !there.contains(&"OUT0"), "{there:?}");
    // The threshold is far from what this motor needs: the load value is 0, and says nothing.
    assert!(!there.iter().any(|text| text.starts_with("stallGuard2")), "{there:?}");
}

const MISHAPS: &str = "\
        CALC LOAD, 7
        CALC DIV, 0
        RSUB
        CALCX LOAD
        CALC LOAD, 0
        CALCX SWAP
        CALCX MOD
Deeper: CSUB Again
        SAP 4, 0, 3000
        SAP 4, 0, 3000
        STOP
Again:  CSUB Again
        RSUB
";

/// Eight calls are all that the stack holds (manual section 3.7.24): the ninth is not made, and the eight returns that
/// follow lead back.
#[test]
fn mishaps_of_a_program_are_told_with_their_places() {
    let folder = Folder::with(MISHAPS);
    let report = folder.shown(&["program.tmc"]);
    let refusal = "SAP 4, 0, 3000 at address 8 (Deeper + 1), line 9: value, motor or bank out of range";
    assert!(row(&report, "commands executed").ends_with(&format!(", 2 of them without effect; the first: {refusal}")));
    assert_eq!(
        row(&report, "division by 0"),
        "2 times; the first: CALC DIV, 0 at address 1, line 2: the result is 0",
        "{report}"
    );
    assert_eq!(
        row(&report, "stack full"),
        "once: CSUB Again at address 11 (Again), line 12: the return stack is full, the subroutine is not called"
    );
    assert_eq!(
        row(&report, "stack empty"),
        "once: RSUB at address 2, line 3: the return stack is empty, the program goes on behind it"
    );
    let output = folder.run(&["program.tmc", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["end"], "STOP at address 10 (Deeper + 3)");
    assert_eq!((&json["running"], &json["accumulator"], &json["x"]), (&false.into(), &0.into(), &0.into()));
    assert_eq!(json["refused"]["count"], 2);
    assert_eq!(
        json["divisions_by_zero"],
        serde_json::json!({"count": 2, "first": {"command": "CALC DIV, 0", "address": 1, "line": 2, "reason": "the result is 0"}})
    );
    assert_eq!((&json["stack_full"]["count"], &json["stack_empty"]["first"]["address"]), (&1.into(), &2.into()));
    assert_eq!(json["axes"], serde_json::json!([{"axis": 0, "position": 0, "velocity": 0, "lost_steps": 0}]));
    // A program in which nothing goes wrong has none of it.
    folder.write("fine.tmc", "CSUB Sub\nCALC DIV, 2\nSTOP\nSub: RSUB\n");
    let report = folder.shown(&["fine.tmc", "--strict"]);
    assert!(!report.contains("stack") && !report.contains("division"), "{report}");
}

#[test]
fn strict_programs_are_free_of_warnings_and_mishaps() {
    let folder = Folder::with("Loop: CSUB Loop\nSTOP\n");
    let output = folder.run(&["program.tmc", "--strict"]);
    assert_eq!(output.status.code(), Some(1), "{}", complaint(&output));
    assert_eq!(complaint(&output), "tmcl: --strict: stack full once\n");
    assert!(String::from_utf8(output.stdout).unwrap().contains("stack full"));
    assert!(folder.run(&["program.tmc"]).status.success());
    // A value that the module refuses is a warning of the assembler, and with --strict an error.
    folder.write("program.tmc", "SAP 4, 0, 3000\nSTOP\n");
    assert!(folder.run(&["program.tmc"]).status.success());
    let told = folder.complaint(1, &["program.tmc", "--strict"]);
    assert!(told.starts_with("program.tmc:1:11: error: "), "{told}");
    // An assembled program has no warnings; what happens counts.
    let assembled = tmcl(&["asm", "program.tmc"]).current_dir(folder.0.path()).output().unwrap();
    assert!(assembled.status.success(), "{}", complaint(&assembled));
    let output = folder.run(&["program.bin", "--strict", "--json"]);
    assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(1), "tmcl: --strict: refused once\n"));
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(json["refused"]["first"].get("line").is_none(), "{json}");
}

#[test]
fn the_report_of_a_run_is_an_object() {
    let folder = Folder::with("SGP 5, 2, -7\nSIO 1, 2, 1\nL: JA L\n");
    let json = |options: &[&str]| {
        let output = folder.run(&[&["program.tmc", "--json", "--until", "500 ms"], options].concat());
        assert!(output.status.success(), "{}", complaint(&output));
        let text = String::from_utf8(output.stdout).unwrap();
        assert_eq!(text.lines().count(), 1);
        serde_json::from_str::<serde_json::Value>(&text).unwrap()
    };
    let report = json(&["--at", "100 ms: press left", "--plot", "out.svg", "--product", "3110"]);
    assert_eq!(
        (&report["running"], &report["time_s"], &report["plot"]),
        (&true.into(), &0.5.into(), &"out.svg".into())
    );
    assert_eq!((&report["user_variables"]["5"], &report["outputs"][1]), (&(-7).into(), &true.into()));
    assert_eq!(report["axes"].as_array().unwrap().len(), 3);
    assert_eq!(report["events"], serde_json::json!([{"time_s": 0.1, "what": "press left"}]));
    let dark = json(&["--at", "100 ms: power off"]);
    assert!(dark.get("axes").is_none() && dark.get("accumulator").is_none(), "{dark}");
    assert_eq!(dark["end"], "the module has no power");
}

#[test]
fn what_cannot_be_run_is_told() {
    let folder = Folder::with("ROR 0, Sped\n");
    let expected = "\
program.tmc:1:8: error: unknown name 'Sped'
    ROR 0, Sped
           ^^^^
";
    assert_eq!(folder.complaint(1, &["program.tmc"]), expected);
    assert!(folder.complaint(1, &["none.tmc"]).starts_with("tmcl: cannot read none.tmc: "));
    assert!(folder.complaint(1, &["none.bin"]).starts_with("tmcl: cannot read none.bin: "));
    folder.write("program.tmc", "136, 1, 0, 0\n");
    folder.write("fine.tmc", "STOP\n");
    for option in ["--trace", "--plot"] {
        let complaint = folder.complaint(1, &["fine.tmc", option, "./fine.tmc"]);
        assert_eq!(complaint, format!("tmcl: {option} would replace the program; give another file\n"));
        let told = folder.complaint(1, &["fine.tmc", option, "none/out.svg"]);
        assert!(told.starts_with(&format!("tmcl: {option}: cannot write none/out.svg: ")), "{told}");
    }
    let told = folder.complaint(2, &["fine.tmc", "--plot", "./program.tmc"]);
    assert!(told.starts_with("tmcl: --plot: ./program.tmc does not end in .svg"), "{told}");
    assert_eq!(folder.read("fine.tmc"), "STOP\n");
    assert_eq!(names(folder.0.path()), ["fine.tmc", "program.tmc"]);
    for (options, told) in [
        (&["--trace", "-", "--json"][..], "--json and --trace cannot both have standard output"),
        (&["--plot", "-", "--json"], "--json and --plot cannot both have standard output"),
        (&["--plot", "-", "--trace", "-"], "--trace and --plot cannot have the same file"),
    ] {
        assert!(folder.complaint(2, &[&["fine.tmc"], options].concat()).contains(told), "{told}");
    }
    // The motor is locked: nothing can run.
    folder.write("dark.toml", "[supply]\nvolts = 7.0\n");
    let complaint = folder.complaint(1, &["fine.tmc", "--world", "dark.toml"]);
    assert!(complaint.starts_with("tmcl: the module does not start the program: status 6"), "{complaint}");
}

#[test]
fn several_axes_move_and_are_drawn() {
    let folder = Folder::with(
        "#include TMCLParam.tmc\nSAP APMaxPositioningSpeed, Motor2, 2000\nMVP ABS, Motor0, 2000\nMVP ABS, Motor2, -51200\n\
         SIO 5, 2, 1\nWAIT POS, Motor2, 0\nSTOP\n",
    );
    for product in ["3110", "tmcm-6110"] {
        let events = ["--at", "400 ms: press home 2", "--at", "500 ms: load 0.5 1", "--at", "600 ms: release home 2"];
        let options = ["program.tmc", "--product", product, "--plot", "out.svg"];
        let report = folder.shown(&[&options[..], &events[..]].concat());
        assert_eq!(row(&report, "axis 0"), "position 2000 microsteps; velocity 0 (internal units): the motor stands");
        assert_eq!(row(&report, "axis 2"), "position -51200 microsteps; velocity 0 (internal units): the motor stands");
        assert_eq!(report.contains("axis 5"), product != "3110", "{report}");
        assert!(row(&report, "outputs").ends_with("OUT4 off, OUT5 on, OUT6 off, OUT7 off"), "{report}");
        let svg = folder.read("out.svg");
        let texts = texts(&svg);
        for text in [
            "axis 0: position in microsteps",
            "axis 0: velocity in internal units",
            "axis 2: position in microsteps",
            "OUT5",
            "home switch 2",
        ] {
            assert!(texts.contains(&text), "{text} is not among {texts:?}");
        }
        let idle = |text: &&str| {
            text.starts_with("axis 1") || text.contains("current") || text.starts_with("left") || *text == "OUT0"
        };
        assert!(!texts.iter().any(idle), "{texts:?}");
    }
    // Another product has its speeds in another unit.
    folder.write("pps.tmc", "ROR 1, 40000\nWAIT TICKS, 0, 100\nSTOP\n");
    let report = folder.shown(&["pps.tmc", "--product", "3212", "--at", "500 ms: GAP 3, 1", "--plot", "pps.svg"]);
    assert!(row(&report, "axis 1").ends_with(" microsteps; velocity 40000 (pps): the motor turns"), "{report}");
    assert_eq!(row(&report, "axis 0"), "position 0 microsteps; velocity 0 (pps): the motor stands");
    assert!(row(&report, "events").contains(" pps (actual speed), status 100 ok"), "{report}");
    let svg = folder.read("pps.svg");
    assert!(texts(&svg).contains(&"axis 1: velocity in pps") && texts(&svg).contains(&"40\u{2009}000"), "{svg}");
    let told = folder.complaint(2, &["program.tmc", "--product", "3110", "--at", "1 s: press home 3"]);
    assert_eq!(told, "tmcl: --at 'press home 3': no axis 3: the TMCM-3110 has axes 0 to 2\n");
    assert!(folder.complaint(1, &["program.tmc"]).contains("unknown name 'Motor2'"));
    folder.write("still.tmc", "STOP\n");
    folder.shown(&["still.tmc", "--product", "3110", "--plot", "out.svg"]);
    assert!(texts(&folder.read("out.svg")).contains(&"axis 0: position in microsteps"));
    // A world has room for three axes.
    folder.write("world.toml", "[[axis]]\n[[axis]]\n[[axis]]\nmotor.start = 7\n[axis.stage]\nhard_left = -20000\n");
    let report = folder.shown(&["program.tmc", "--product", "3110", "--world", "world.toml"]);
    assert!(row(&report, "axis 2").contains("; the motor has lost steps, it is "), "{report}");
    assert!(folder.complaint(1, &["still.tmc", "--world", "world.toml"]).contains("the TMCM-1140 has one axis"));
}

/// A run that somebody ends has its report and its plot up to there.
#[test]
fn a_run_can_be_interrupted() {
    let folder = Folder::with("L: JA L\n");
    let file = |name: &str| folder.0.path().join(name).to_str().unwrap().to_owned();
    let (program, plot) = (file("program.tmc"), file("out.svg"));
    let options = ["run", &program, "--until", "1000 h", "--plot", &plot];
    let mut terminal = Terminal::start_with(&options, 40);
    let bar = terminal.expect(" %");
    assert!(bar.trim_start_matches('\r').chars().count() < 40, "{bar:?}");
    terminal.keys("\x03");
    let (status, shown) = terminal.end();
    assert_eq!(status.code(), Some(130));
    assert!(shown.contains("interrupted by Ctrl-C, at address 0 (L)"), "{shown}");
    assert!(texts(&folder.read("out.svg")).contains(&"program.tmc"));
    assert!(terminal.is_as_before());
}

#[test]
fn a_trace_whose_reader_has_had_enough_ends_quietly() {
    let folder = Folder::with("L: CALC ADD, 1\nJA L\n");
    let mut command = tmcl(&["run", "program.tmc", "--trace"]);
    let mut run = command.current_dir(folder.0.path()).spawn().unwrap();
    drop(run.stdout.take());
    let output = run.wait_with_output().unwrap();
    assert_eq!((output.status.code(), complaint(&output)), (Some(141), String::new()));
}

#[test]
fn what_is_wrong_with_the_arguments_is_told_in_one_sentence() {
    let folder = Folder::with("STOP\n");
    folder.write("world.toml", "[stage]\nleft = 5\nright = 1\n");
    folder.write("noise.tmc", "\u{0}\u{1}\u{2}");
    for (code, arguments, told) in [
        (1, &["none.tmc"][..], "cannot read none.tmc"),
        (1, &["."], "cannot read ."),
        (1, &["noise.tmc"], "noise.tmc is no text"),
        (1, &["program.tmc", "--world", "none.toml"], "--world: cannot read none.toml"),
        (
            1,
            &["program.tmc", "--world", "world.toml"],
            "world.toml: line 2: stage.left: 5 is not below stage.right (1)",
        ),
        (1, &["program.tmc", "--world", "world.toml", "--trace", "world.toml"], "--trace would replace the world"),
        (1, &["program.tmc", "--trace", "/dev/full"], "--trace: cannot write /dev/full"),
        (2, &["program.tmc", "--until", "forever"], "'forever' is no time"),
        (2, &["program.tmc", "--product", "9999"], "'9999' is none of 1140, 1110, 3110, 3212, 6110"),
        (2, &["program.tmc", "--at", "1 s: presss left"], "unknown command 'presss'"),
    ] {
        let said = folder.complaint(code, arguments);
        assert!(said.contains(told), "{arguments:?}: {said}");
    }
    assert_eq!(folder.read("world.toml"), "[stage]\nleft = 5\nright = 1\n");
    // A program from standard input.
    let output = type_into(&["run", "-", "--plot", "-"], "STOP\n");
    assert!(output.status.success(), "{}", complaint(&output));
    assert!(texts(&String::from_utf8(output.stdout).unwrap()).contains(&"standard input"));
    assert!(type_into(&["run", "-"], "").status.code().is_some());
}

/// Plots in `docs` are what the commands in the comments of the examples draw. `UPDATE_DOCS=1` in the environment
/// writes them anew.
#[test]
fn the_plots_of_the_examples_are_up_to_date() {
    let root = xtask::workspace().unwrap();
    let page = std::fs::read_to_string(root.join("examples/README.md")).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let names = ["homing_axes", "straight_line", "pick_and_place", "six_point_ramp"];
    for name in names {
        assert!(page.contains(&format!("(../docs/{name}.svg)")), "{name}");
        let source = std::fs::read_to_string(root.join(format!("examples/{name}.tmc"))).unwrap();
        // The command and the lines with further options are indented.
        let lines = source.lines().filter_map(|line| line.strip_prefix("//     "));
        let command =
            lines.filter(|line| line.contains(" --") || line.starts_with("tmcl ")).collect::<Vec<_>>().join(" ");
        let (plot, drawn) = (format!("{name}.svg"), folder.path().join(format!("{name}.svg")));
        let words: Vec<String> = words(&command)
            .into_iter()
            .map(|word| if word == plot { drawn.to_str().unwrap().to_owned() } else { word })
            .collect();
        assert_eq!(words[..2], ["tmcl", "run"], "{command}");
        let words: Vec<&str> = words[1..].iter().map(String::as_str).collect();
        let output = tmcl(&words).current_dir(&root).output().unwrap();
        assert!(output.status.success(), "{command}: {}", complaint(&output));
        let there = root.join("docs").join(plot);
        if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
            std::fs::copy(&drawn, &there).unwrap();
        }
        let same = std::fs::read(&there).is_ok_and(|found| found == std::fs::read(&drawn).unwrap());
        assert!(same, "docs/{name}.svg is stale: UPDATE_DOCS=1 cargo test -p tmcl-cli --test program the_plots_of");
    }
}
