//! The scenarios' own machinery: what it makes of mistakes, and what it makes of a module that does wrong.

use std::path::Path;

use hal_sim::board::Board;
use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::Line;
use tmcm::can::Frame;
use tmcm::tmcl::{Command, text};

use super::program::Program;
use super::suite::{self, File, News, Outcome, Start};
use super::{Mistake, Rig, Scenario, Stand, Surroundings, run_case};
use crate::look::Look;
use crate::module::VirtualModule;
use crate::native::{FirmwareKind, Model, Product};

/// The scenarios of a text, in whose folder there is a program.
fn read(text: &str) -> Vec<Scenario> {
    let assemble = |path: &Path, product: Product| match path.to_str() {
        Some("folder/program.tmc") => Ok(program()),
        _ => Err(format!("{}: no such program for the {}", path.display(), product.name())),
    };
    let surroundings = Surroundings {
        folder: Path::new("folder"),
        product: Product::Tmcm1140,
        firmware: FirmwareKind::Tmcl,
        world: "",
        assemble: &assemble,
    };
    super::read(text, &surroundings)
}

/// Counts variable `Counter` up to `Most` and stops.
fn program() -> Program {
    let lines = ["SGP 7, 2, 0", "GGP 7, 2", "CALC ADD, 1", "AGP 7, 2", "COMP 5", "JC LT, 1", "STOP"];
    Program {
        commands: lines.map(|line| text::parse(line).unwrap()).to_vec(),
        names: [("Counter", 7), ("Most", 5), ("Loop", 1), ("Start", 0)]
            .map(|(name, value)| (name.into(), value))
            .to_vec(),
        labels: vec!["Loop".into(), "Start".into()],
    }
}

/// Line and message of the only mistake in a file.
fn mistake(text: &str) -> (usize, String) {
    let mistakes: Vec<_> = read(text).into_iter().filter_map(|scenario| scenario.cases.err()).collect();
    assert_eq!(mistakes.len(), 1, "{text}: {mistakes:?}");
    (mistakes[0].line, mistakes[0].message.clone())
}

fn mistake_in_step(step: &str) -> String {
    let (line, message) = mistake(&format!("# comment\n== Title\n\n{step}\n"));
    assert_eq!(line, 4, "{step}");
    message
}

#[test]
fn errors_in_steps_say_what_to_write() {
    let cases = [
        ("GOTO 5", "unknown command 'GOTO'"),
        ("SAP 4, 0", "usage: SAP <type>, <motor or bank>, <value>"),
        ("SAP 4, 0, $speed", "'$speed' is neither a parameter nor remembered"),
        ("MST 0 -> maybe", "usage: COMMAND -> STATUS"),
        ("MST 0 -> 100 5 6", "'6' is one word too many"),
        ("jump 5", "unknown step 'jump'; there are: expect, wait, at, post, let, control, power cycle, load"),
        ("at noon", "a time is missing, such as 500 ms"),
        ("at 2 h", "time '2 h' is too long"),
        ("post", "a TMCL command is missing"),
        ("post MST 0 -> 100", "'->' is one word too many"),
        ("expct rotor = 5", "unknown step 'expct'; did you mean 'expect'?"),
        ("prodct: 3110", "unknown step 'prodct:'; did you mean 'product:'?"),
        ("load", "usage: load FILE.tmc"),
        ("load other.tmc", "folder/other.tmc: no such program for the TMCM-1140"),
        ("run Loop", "'Loop': no program has been loaded above"),
        ("run -1", "usage: run, run LABEL or run ADDRESS"),
        ("sdo 0x6060 i8 = 1", "usage: sdo INDEX:SUB TYPE"),
        ("sdo 0x6060:0 = 1", "the type of the object is missing before '='; there are: u8, i8"),
        ("sdo 0x6060:0 i8", "to read it: expect sdo"),
        ("sdo 0x6060:0 i8 = 1 -> x", "ABORT_CODE"),
        ("nmt go", "'go' is no command of network management; there are: start, stop"),
        ("frame 201 0F", "usage: frame ID BYTE BYTE"),
        ("frame 0x801 0F", "0x801 is no identifier of 11 bits"),
        ("frame 0x201 256", "'256' is no byte"),
        ("wait 1 s for frame 0x201 1 2 3 4 5 6 7 8 9", "8 bytes at most"),
        ("sync 5", "usage: sync"),
        ("expect rotor", "one of = != < <= > >= between is missing before the end of the line"),
        ("expect roter = 5", "unknown value 'roter'; did you mean 'rotor'?"),
        ("expect rotor 1 = 5", "no axis 1: the TMCM-1140 has one, axis 0"),
        ("SAP 4, 0, 2.5", "SAP: 2.5 is not a whole number"),
        ("expect rotor = 5 +- ", "a value is missing before the end of the line"),
        ("expect rotor between 5", "usage: VALUE between VALUE and VALUE"),
        ("expect rotor = 5 for 3 h", "time '3 h' is too long"),
        ("wait until rotor = 5", "a time is missing, such as 500 ms"),
        ("wait 5x s", "'x' is not a unit of time"),
        ("wait $y s", "'$y' is no parameter"),
        ("wait 1.2.3 s", "'1.2.3' is not a number"),
        ("let 5 = rotor", "usage: let NAME = VALUE"),
        ("control press up", "there are: left, right, home"),
        ("control pres left", "did you mean 'press'?"),
        ("press left", "did you mean 'control press ...'?"),
        ("expect programm = 1", "unknown value 'programm'; did you mean 'program'?"),
        ("expect zzz = 1", "by other names bridges, left_switch"),
        ("control module 2 press left", "there is one module only"),
        ("control at 5 ms state", "looked at by 'expect'"),
        ("control at 5 parsec power off", "'parsec' is not a unit of time"),
        ("control at 5 ms power of", "'of' is neither 'on' nor 'off'"),
        ("control state", "looked at by 'expect'"),
        ("power on", "usage: power cycle"),
        ("expect rotor = 5 % 3", "'%' means nothing here"),
    ];
    for (step, expected) in cases {
        let message = mistake_in_step(step);
        assert!(message.contains(expected), "{step}: {message}");
    }
}

#[test]
fn errors_in_the_structure_name_their_line() {
    let cases = [
        ("", 1, "no scenario"),
        ("MST 0\n== T\nMST 0", 1, "before the first scenario"),
        ("==\nMST 0", 1, "no title"),
        ("== T\n# nothing", 1, "no steps"),
        ("== T\nMST 0\nworld:", 3, "come before the steps"),
        ("== T\nMST 0\n  MST 0", 3, "steps are not indented"),
        ("== T\n  MST 0", 2, "belongs neither"),
        ("== T\nfor a b:\n  1 2\n  3\nMST 0", 4, "1 values for 2 names"),
        ("== T\nfor a b:\nMST 0", 2, "no rows"),
        ("== T\nfor a = 1,,2\nMST 0", 2, "a value is missing"),
        ("== T\nfor 5 = 1\nMST 0", 2, "'5' is not a name"),
        ("== T\nfor a in 1\nMST 0", 2, "usage: for NAME = VALUE"),
        ("== T\nproduct: TMCM-999\nMST 0", 2, "'TMCM-999' is no product; there are: TMCM-1140"),
        ("== T\nfirmware: x\nMST 0", 2, "there are: tmcl, canopen"),
        ("== T\nproduct: 3110\nfirmware: canopen\nMST 0", 3, "the TMCM-3110 has no CANopen firmware"),
        ("== T\nproduct:\nMST 0", 2, "something is missing behind 'product:'"),
        ("== T\neeprom: file\nMST 0", 2, "stand in the lines below 'eeprom:'"),
        ("== T\neeprom:\n  0: 12\n  0010 12\nMST 0", 4, "'0010 12' is no line of an EEPROM"),
        ("== T\neeprom:\n  0010: 123\nMST 0", 3, "is no line of an EEPROM"),
        ("== T\neeprom:\n  FFFFF: 12\nMST 0", 3, "the EEPROM has 0x"),
        ("== T\nproduct: 6110\n  x\nMST 0", 3, "nothing stands below"),
        ("== T\nMST 0\nproduct: 6110", 3, "come before the steps"),
        ("== T\nproduct: 6110\nproduct: 1140\nMST 0", 3, "a second 'product:'"),
        ("== T\nfor a = 1\nfor a b:\n  1 2\nMST 0", 3, "a second table with the same name"),
        ("== T\nfor a = 1120\nproduct: $a\nMST 0", 3, "'1120' is no product; there are: TMCM-1140, TMCM-1110"),
        ("== T\nworld:\n  [stage]\n  lft = 5\nMST 0", 4, "unknown field"),
        ("== T\nworld: none.toml\nMST 0", 2, "world: none.toml: "),
        ("firmware: canopen\n== T\nload program.tmc", 3, "executes no TMCL programs"),
        ("== T\nload program.tmc\nrun Lop", 3, "the program has no label 'Lop'; did you mean 'Loop'?"),
        ("for a = 1\n== T\nlet a = 5", 3, "'a' is a parameter already"),
        ("world:\n  [stage]\n  lefft = 5\n== T\nMST 0", 3, "line 3"),
        ("for a = 1, x\n== T\nSAP 4, 0, $a", 3, "'x' is neither a number nor a known name"),
    ];
    for (text, line, expected) in cases {
        let (found, message) = mistake(text);
        assert!(message.contains(expected), "{text}: {message}");
        assert_eq!(found, line, "{text}: {message}");
    }
}

#[test]
fn parameters_and_tables_make_cases() {
    let text = "
for start = -5, 7         # two
== First
for mode zero:
   1 -100
  65  100
  66  200
world:
  [motor]
  start = $start
SAP 193, 0, $mode
expect rotor = $zero - $start
== Second
let x = rotor + 1
MVP ABS, 0, $x + 100 -> 100 $x - -5
";
    let scenarios: Vec<_> = read(text).into_iter().map(|scenario| (scenario.title, scenario.cases.unwrap())).collect();
    assert_eq!(
        scenarios.iter().map(|(title, cases)| (title.as_str(), cases.len())).collect::<Vec<_>>(),
        [("First", 6), ("Second", 2)]
    );
    let case = &scenarios[0].1[4];
    assert_eq!(case.label, "mode = 65, start = 7, zero = 100");
    assert_eq!(case.world.axis(0).motor.start, 7);
    assert_eq!(case.steps[1].0.text, "expect rotor = 100 - 7");
    assert_eq!(scenarios[1].1[0].world.axis(0).motor.start, 0);
}

/// Answers every command with its type as status and the number of milliseconds that have passed as value;
/// type 0 is not answered.
struct Parrot(Board);

impl Rig for Parrot {
    fn send(&mut self, command: Command) -> Option<(u8, i32)> {
        self.pass(MILLISECOND);
        let value = (self.0.now() / MILLISECOND) as i32;
        (command.kind != 0).then_some((command.kind, value))
    }

    fn post(&mut self, _: Command) {}

    fn control(&mut self, line: &Line) -> Result<(), String> {
        line.control.apply(&mut self.0).map(drop)
    }

    fn control_at(&mut self, _: Nanos, _: &Line) -> Result<(), String> {
        Err("a parrot has no agenda".into())
    }

    fn look(&mut self, look: &Look) -> f64 {
        look.read(&self.0)
    }

    fn now(&mut self) -> Nanos {
        self.0.now()
    }

    fn pass(&mut self, span: Nanos) {
        self.0.advance_to(self.0.now() + span);
    }

    fn send_frame(&mut self, _: Frame) {}

    fn frame(&mut self) -> Option<Frame> {
        None
    }

    fn stopped(&self) -> Option<String> {
        None
    }
}

/// Runs a scenario that consists of these steps and gives where and how it fails.
fn run(steps: &str) -> Result<(), Mistake> {
    let case = read(&format!("== T\n{steps}")).remove(0).cases.unwrap().remove(0);
    run_case(&case, Parrot(Board::new(&case.world, 0)))
}

#[test]
fn what_is_met_passes() {
    let steps = "GAP 100, 0
GAP 5, 0 -> 5
GAP 100, 0 -> 100 3
GAP 0, 0 -> no reply
expect GAP 100, 0 = 5
expect time = 7 +- 2
expect time_us between 4500 and 9000.5
expect left_switch 0 + switches.right = 0
expect supply = 24.05 +- 0.05
expect 0x1F & 6 + 1 = 7
let x = time + 0x10 - 1
expect $x between 20 and 20
expect $x != 21
wait 1 s until GAP 100, 0 >= 500
expect time - 500 between 0 and 1
expect home_switch = 0 for 100 ms
control press home
expect home_switch = 1
power cycle
expect time between 795 and 805
";
    assert_eq!(run(steps), Ok(()));
}

#[test]
fn what_is_not_met_fails() {
    let cases = [
        ("GAP 4, 0", "answered status 4"),
        ("GAP 0, 0", "no reply"),
        ("GAP 5, 0 -> 4", "answered status 5"),
        ("GAP 5, 0 -> 5 77", "answered value 2"),
        ("GAP 5, 0 -> no reply", "answered status 5 ("),
        ("expect GAP 5, 0 = 2", "GAP answered status 5"),
        ("expect GAP 0, 0 = 2", "GAP: no reply"),
        ("expect rotor = 5 +- 4", "the left side is 0, the right side 5"),
        ("expect rotor = 5 +-4", "the left side is 0, the right side 5"),
        ("expect rotor != 0", "the left side is 0, the right side 0"),
        ("expect rotor < 0", "the left side is 0"),
        ("expect rotor > 0", "the left side is 0"),
        ("expect rotor <= -1", "the left side is 0"),
        ("expect rotor >= 1", "the left side is 0"),
        ("expect rotor between 1 and 2", "the left side is 0, the others are 1 and 2"),
        ("expect time < 5 for 10 ms", "the left side is 5, the right side 5"),
        ("wait 1 ms for frame 0x701 05", "no such frame in this time"),
        ("expect sdo 0x6041:0 u16 = 0", "no reply"),
        ("wait 10 ms until rotor = 1", "not in this time: the left side is 0, the right side 1"),
    ];
    for (step, expected) in cases {
        let Mistake { line, message } = run(&format!("GAP 100, 0\n{step}")).unwrap_err();
        assert_eq!(line, 3, "{step}");
        assert!(message.starts_with(step) && message.contains(expected), "{step}: {message}");
    }
}

/// Runs the scenarios of a text on virtual modules, and gives the outcome of each case.
fn outcomes(text: &str) -> Vec<Outcome> {
    let files = [File { name: "test.txt".into(), scenarios: read(text) }];
    let reports = suite::run(&files, |case| Start::Ready(Stand::native(case)), |_| {});
    reports.into_iter().flat_map(|report| report.rows).map(|row| row.outcome).collect()
}

#[test]
fn programs_are_loaded_and_their_names_known() {
    let text = "== The program counts and stops
load program.tmc
expect program != running
run
wait 100 ms until program = stopped
expect program_counter = Start
expect GGP Counter, 2 = Most
SGP Counter, 2, Most - 3
run Loop
wait 100 ms until program = stopped
expect GGP counter, 2 = 5
expect -Most + 5 = 0
";
    assert_eq!(outcomes(text), [Outcome::Passed]);
    let wrong = text.replace("expect program_counter = Start", "expect program_counter = Loop");
    let [Outcome::Failed(Mistake { line: 6, message })] = &outcomes(&wrong)[..] else {
        panic!("{:?}", outcomes(&wrong))
    };
    assert!(message.ends_with("the left side is 0, the right side 1"), "{message}");
}

#[test]
fn products_and_firmwares_are_those_of_the_file() {
    let text = "for product = TMCM-3110, 6110
product: $product
== An axis of its own
MVP ABS, 2, 1000
wait 1 s until velocity 2 = 0
expect rotor 2 = 1000
expect rotor = 0
== A node
product: TMCM-1140
firmware: canopen
wait 1 s for frame 0x701 00
expect sdo 0x6041:0 u16 & 0x4F = 0x40
sdo 0x6060:0 i8 = 1
expect sdo 0x6061:0 i8 = 1
sdo 0x6060:0 i8 = 99 -> 0x06090030
sdo 0x6041:0 u16 = 1 -> 0x06010002
nmt start
sdo 0x1017:0 u16 = 20
wait 100 ms for frame 0x701 05
";
    let models: Vec<Model> =
        read(text).iter().flat_map(|scenario| scenario.cases.as_ref().unwrap()).map(|case| case.model).collect();
    let [three, six] = [Product::Tmcm3110, Product::Tmcm6110].map(Model::Tmcl);
    assert_eq!(models, [three, six, Model::Canopen, Model::Canopen]);
    assert_eq!(outcomes(text), vec![Outcome::Passed; 4]);
}

#[test]
fn the_power_goes_off_within_a_command() {
    let text = "== A store is torn, and its reply does not come
SAP 4, 0, 500
control at 2.5 ms power off
STAP 4, 0 -> no reply
expect power = 0
";
    assert_eq!(outcomes(text), [Outcome::Passed]);
}

#[test]
fn steps_have_times_of_the_module_and_commands_need_no_reply() {
    let text = "== Posted, and another one right behind it
at 200 ms
expect time_us = 200000
post ROR 0, 500
GAP 4, 0 -> 100
at 1.25 s
expect time_us = 1250000
expect velocity = 500
== Too late
at 2 s
at 1999.5 ms
";
    let outcomes = outcomes(text);
    assert_eq!(outcomes[0], Outcome::Passed);
    let Outcome::Failed(Mistake { line, message }) = &outcomes[1] else { panic!("{outcomes:?}") };
    assert_eq!((*line, message.as_str()), (11, "at 1999.5 ms: it is 2000000 us already"));
}

#[test]
fn a_module_has_the_eeprom_of_its_scenario() {
    let mut stand = Stand::native(&read("== T\nMST 0").remove(0).cases.unwrap().remove(0));
    for (number, value) in [(4, 321), (5, 123)] {
        assert_eq!(stand.send(Command::new(5, number, 0, value)), Some((100, value)));
        assert_eq!(stand.send(Command::new(7, number, 0, 0)).map(|(status, _)| status), Some(100));
    }
    let contents = super::eeprom::lines(stand.module_mut().board_mut().at25().contents());
    let text = format!("eeprom:\n  {}\n== Kept\nGAP 4, 0 -> 100 321\nGAP 5, 0 -> 100 123\n", contents.join("\n  "));
    assert_eq!(outcomes(&text), [Outcome::Passed]);
}

#[test]
fn news_come_in_the_order_of_the_files() {
    let text = "for wait = 9, 1\n== First\nwait $wait ms\n== Wrong\nMST 5\n== Unread\njump\n";
    let files = ["a.txt", "b.txt"].map(|name| File { name: name.into(), scenarios: read(text) });
    let (mut told, mut counts) = (Vec::new(), Vec::new());
    let start = |case: &super::Case| match case.label.as_str() {
        "wait = 1" => Start::LeftOut("one is too short".into()),
        _ => Start::Ready(Stand::native(case)),
    };
    let reports = suite::run(&files, start, |news| match news {
        News::Cases(done, total) => counts.push((done, total)),
        News::Scenario(report) => told.push(format!("{}: {} {}", report.file, report.title, report.verdict())),
    });
    let of = |file: &str| {
        let reason = "1 of 2 cases; the others are left out: one is too short";
        [
            format!("{file}: First ok, {reason}"),
            format!("{file}: Wrong FAILED, 1 of 2 cases"),
            format!("{file}: Unread FAILED"),
        ]
    };
    assert_eq!(told, [of("a.txt"), of("b.txt")].concat());
    assert_eq!(counts, (0..=8).map(|done| (done, 8)).collect::<Vec<_>>());
    let failures: Vec<String> = reports.iter().flat_map(suite::Report::failures).collect();
    assert_eq!(failures.len(), 4);
    assert_eq!(failures[0], "a.txt:5: MST 5: answered status 4 (value, motor or bank out of range) (case: wait = 9)");
    assert!(failures[1].starts_with("a.txt:7: unknown step 'jump'"), "{}", failures[1]);
}

#[test]
fn what_a_scenario_says_takes_the_place_of_what_its_file_says() {
    let text = "\u{feff}for x = 1, 2\nfor y = 5, 6\nproduct: 3110\n== T\nfor x = 3\nproduct: 6110\nexpect $x + $y between 8 and 9\n\
                expect rotor 5 = 0\n";
    assert_eq!(outcomes(text), [Outcome::Passed, Outcome::Passed]);
}

#[test]
fn there_is_an_end_to_the_number_of_cases() {
    let tables: String = (0..400).map(|table| format!("for x{table} = 1, 2\n")).collect();
    let [Outcome::Failed(Mistake { line: 1, message })] = &outcomes(&format!("== T\n{tables}MST 0"))[..] else {
        panic!("not refused");
    };
    assert!(message.ends_with("cases; a scenario has 10000 at most"), "{message}");
}

#[test]
fn what_is_written_close_together_means_the_same() {
    let text = "== T
MVP ABS, 0, 1000
wait 2s until rotor=1010 +-10
wait 500ms
expect rotor = 1003+-4 for 2.5ms
control load 0.1
expect load = 0.1
";
    assert_eq!(outcomes(text), [Outcome::Passed]);
}

#[test]
fn a_mistake_of_one_row_names_the_row() {
    let [Outcome::Failed(Mistake { line: 4, message })] =
        &outcomes("== T\nfor p = 1140, 3110\nproduct: $p\nexpect rotor 2 = 0")[..]
    else {
        panic!("not refused");
    };
    assert_eq!(message, "no axis 2: the TMCM-1140 has one, axis 0 (case: p = 1140)");
}
