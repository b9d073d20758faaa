//! `tmcl run`: a program in, a report and a trace out.

use std::process::Output;

use super::harness::{complaint, tmcl};

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
pub(crate) struct Folder(pub(crate) tempfile::TempDir);

impl Folder {
    pub(crate) fn with(source: &str) -> Self {
        let folder = Folder(tempfile::tempdir().unwrap());
        folder.write("program.tmc", source);
        folder
    }

    pub(crate) fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.path().join(name), text).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.path().join(name)).unwrap()
    }

    pub(crate) fn run(&self, arguments: &[&str]) -> Output {
        tmcl(&["run"]).args(arguments).current_dir(self.0.path()).output().unwrap()
    }

    /// The output of the program when all is well.
    pub(crate) fn shown(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    /// The complaint of the program when it ends with this code.
    pub(crate) fn complaint(&self, code: i32, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {}", complaint(&output));
        assert!(output.stdout.is_empty(), "{arguments:?}");
        complaint(&output)
    }
}

/// The row of a report.
pub(crate) fn row<'a>(report: &'a str, name: &str) -> &'a str {
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
