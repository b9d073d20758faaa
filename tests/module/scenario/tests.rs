//! The scenarios' own machinery: what it makes of mistakes, and what it makes of a module that does wrong.

use hal_sim::board::Board;
use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::{Line, State};
use hal_sim::world::config::WorldConfig;
use tmcm::tmcl::Command;

use super::Rig;
use super::document::read;
use super::run::run_case;

/// Line and message of the only mistake in a file.
fn mistake(text: &str) -> (usize, String) {
    let mistakes: Vec<_> = read(text).into_iter().filter_map(|(_, scenario)| scenario.err()).collect();
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
        ("jump 5", "unknown step 'jump'; there are: expect, wait"),
        ("expect rotor", "one of = != < <= > >= between is missing before the end of the line"),
        ("expect roter = 5", "unknown value 'roter'; the world has: time, rotor"),
        ("expect rotor = 5 +-", "a value is missing before the end of the line"),
        ("expect rotor between 5", "usage: VALUE between VALUE and VALUE"),
        ("expect rotor = 5 for 3 h", "'h' is none of the units us, ms, s"),
        ("wait until rotor = 5", "a time is missing, such as 500 ms"),
        ("wait 5x s", "'5x' is not a number"),
        ("let 5 = rotor", "usage: let NAME = VALUE"),
        ("control press up", "there are: left, right, home"),
        ("control module 2 press left", "there is one module only"),
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
        ("for a = 1\n== T\nlet a = 5", 3, "'a' is a parameter already"),
        ("world:\n  [stage]\n  lefft = 5\n== T\nMST 0", 2, "line 3"),
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
    let scenarios: Vec<_> = read(text).into_iter().map(|(_, scenario)| scenario.unwrap()).collect();
    assert_eq!(
        scenarios.iter().map(|s| (s.title.as_str(), s.cases.len())).collect::<Vec<_>>(),
        [("First", 6), ("Second", 2)]
    );
    let case = &scenarios[0].cases[4];
    assert_eq!(case.label, "mode = 65, start = 7, zero = 100");
    assert_eq!(case.world.axis(0).motor.start, 7);
    assert_eq!(case.steps[1].0.text, "expect rotor = 100 - 7");
    assert_eq!(scenarios[1].cases[0].world.axis(0).motor.start, 0);
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

    fn control(&mut self, line: &Line) {
        line.control.apply(&mut self.0).unwrap();
    }

    fn state(&mut self) -> State {
        State::of(&self.0)
    }

    fn pass(&mut self, span: Nanos) {
        self.0.advance_to(self.0.now() + span);
    }
}

/// Runs a scenario that consists of these steps and gives where and how it fails.
fn run(steps: &str) -> Result<(), (usize, String)> {
    let scenario = read(&format!("== T\n{steps}")).remove(0).1.unwrap();
    run_case(&scenario.cases[0], &|world: &WorldConfig| Parrot(Board::new(world, 0)))
}

#[test]
fn what_is_met_passes() {
    let steps = "GAP 100, 0
GAP 5, 0 -> 5
GAP 100, 0 -> 100 3
GAP 0, 0 -> no reply
expect GAP 100, 0 = 5
expect time = 7 +- 2
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
        ("GAP 5, 0 -> no reply", "answered status 5, value 2"),
        ("expect GAP 5, 0 = 2", "GAP answered status 5"),
        ("expect GAP 0, 0 = 2", "GAP: no reply"),
        ("expect rotor = 5 +- 4", "the left side is 0, the right side 5"),
        ("expect rotor != 0", "the left side is 0, the right side 0"),
        ("expect rotor < 0", "the left side is 0"),
        ("expect rotor > 0", "the left side is 0"),
        ("expect rotor <= -1", "the left side is 0"),
        ("expect rotor >= 1", "the left side is 0"),
        ("expect rotor between 1 and 2", "the left side is 0, the others are 1 and 2"),
        ("expect time < 5 for 10 ms", "the left side is 5, the right side 5"),
        ("wait 10 ms until rotor = 1", "not in this time: the left side is 0, the right side 1"),
    ];
    for (step, expected) in cases {
        let (line, message) = run(&format!("GAP 100, 0\n{step}")).unwrap_err();
        assert_eq!(line, 3, "{step}");
        assert!(message.starts_with(step) && message.contains(expected), "{step}: {message}");
    }
}
