//! `tmcl test`: scenario files in, verdicts, reports and exit codes out.

use std::fs;
use std::path::PathBuf;
use std::process::Output;

use super::harness::{complaint, run, tmcl, type_into};
use common::image as build;

/// A scenario that passes with both of its rows, one that fails in one of two, and one that cannot be read.
const MIXED: &str = "\
for speed = 100, 500
== The motor turns
ROR 0, $speed
wait 1 s
expect velocity = $speed
== Only slow motors pass
ROR 0, $speed
wait 1 s
expect velocity < 200   # not those with 500
== Nobody understands this
jump high
";

/// A folder with files in it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Folder(folder)
    }

    /// Runs `tmcl test` in the folder.
    fn test(&self, arguments: &[&str]) -> Output {
        tmcl(&[&["test"], arguments].concat()).current_dir(self.0.path()).output().unwrap()
    }
}

fn said(output: &Output) -> String {
    String::from_utf8(output.stdout.clone()).unwrap()
}

#[test]
fn each_row_is_a_case_and_failures_have_their_lines() {
    let folder = Folder::with(&[("mixed.txt", MIXED)]);
    let output = folder.test(&["mixed.txt"]);
    let text = said(&output);
    let expected = "\
mixed.txt: The motor turns ... ok, 2 cases
mixed.txt: Only slow motors pass ... FAILED, 1 of 2 cases
mixed.txt: Nobody understands this ... FAILED

mixed.txt:9: expect velocity < 200: the left side is 500, the right side 200 (case: speed = 500)
mixed.txt:11: unknown step 'jump'; there are: expect, wait, at, post, let, control, power cycle, load, run, sdo, nmt, sync, frame, and \
TMCL commands in capitals

3 passed, 2 failed, in ";
    assert!(text.starts_with(expected), "{text}");
    assert_eq!((output.status.code(), complaint(&output).as_str()), (Some(1), ""));
    for arguments in [&["--only", "motor turns"][..], &["--only", "slow", "--first-rows"]] {
        let output = folder.test(&[&["mixed.txt"], arguments].concat());
        assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    }
}

#[test]
fn files_come_from_folders_and_from_standard_input() {
    let folder = Folder::with(&[("b.txt", "== B\nMST 0\n"), ("a.txt", "== A\nMST 0\n"), ("notes.md", "no scenario")]);
    let text = said(&folder.test(&["."]));
    assert!(text.starts_with("./a.txt: A ... ok\n./b.txt: B ... ok\n2 passed, 0 failed, in "), "{text}");
    let output = type_into(&["test", "-"], "== Typed\nMST 5\n");
    assert!(
        said(&output).contains("\nstandard input:2: MST 5: answered status 4 (value, motor or bank out of range)\n"),
        "{}",
        said(&output)
    );
    assert_eq!(output.status.code(), Some(1));
}

#[test]
fn a_report_for_other_programs() {
    let folder = Folder::with(&[("mixed.txt", MIXED)]);
    assert_eq!(folder.test(&["mixed.txt", "--junit", "report.xml"]).status.code(), Some(1));
    let report = fs::read_to_string(folder.0.path().join("report.xml")).unwrap();
    for part in [
        "<testsuite name=\"mixed.txt\" tests=\"5\" skipped=\"0\" errors=\"0\" failures=\"2\"",
        "<testcase name=\"The motor turns (speed = 500)\" classname=\"mixed.txt\"",
        "mixed.txt:9: expect velocity",
    ] {
        assert!(report.contains(part), "{part}: {report}");
    }
    // On standard output it is alone.
    let output = folder.test(&["mixed.txt", "--junit", "-"]);
    assert!(said(&output).starts_with("<?xml") && complaint(&output).contains("The motor turns ... ok"));
    let output = folder.test(&["mixed.txt", "--junit", "none/report.xml"]);
    assert!(complaint(&output).contains("--junit") && said(&output).is_empty(), "{}", complaint(&output));
}

#[test]
fn mistakes_in_programs_and_worlds_are_told_where_they_are_named() {
    let scenarios = "== Program\nMST 0\nload wrong.tmc\n== World\nworld: none.toml\nMST 0\n== Table\nworld:\n  [stage]\n  lefft = 1\nMST 0\n";
    let folder = Folder::with(&[("a.txt", scenarios), ("wrong.tmc", "Loop:\n\tJA Lop\n\tGOTO 5\n")]);
    let text = said(&folder.test(&["a.txt"]));
    let program = "a.txt:3: wrong.tmc:2:";
    assert!(text.contains(program) && text.contains("did you mean 'Loop'?; tmcl asm shows all 2 errors"), "{text}");
    assert!(text.contains("a.txt:5: world: none.toml: "), "{text}");
    assert!(text.contains("a.txt:10: world: ") && text.contains("lefft"), "{text}");
}

#[test]
fn what_the_files_do_not_say_the_command_line_says() {
    let world = "[stage]\nright = 5000\n";
    let steps = "== T\nSAP 12, 0, 0\nMVP ABS, 0, 9000\nwait 2 s until velocity = 0\nexpect rotor = 5000 +- 1\nexpect rotor 2 = 0\n";
    let folder = Folder::with(&[("world.toml", world), ("a.txt", steps)]);
    let output = folder.test(&["a.txt", "--product", "6110", "--world", "world.toml"]);
    assert_eq!(output.status.code(), Some(0), "{}", said(&output));
    assert!(said(&folder.test(&["a.txt"])).contains("a.txt:6: no axis 2: the TMCM-1140 has one, axis 0"));
}

#[test]
fn a_wrong_command_line_has_a_code_of_its_own() {
    let folder = Folder::with(&[("a.txt", "== T\nMST 0\n")]);
    let canopen = build::canopen().display().to_string();
    for (arguments, expected) in [
        (&[][..], "<FILE>"),
        (&["a.txt", "--only", "nothing"], "--only: no file or title contains 'nothing'"),
        (&["a.txt", "--product", "3110", "--firmware", "canopen"], "the TMCM-3110 has no CANopen firmware"),
        (&["a.txt", "--image", &canopen, "--firmware", "tmcl"], "it is one of the TMCM-1140 with the CANopen firmware"),
    ] {
        let output = folder.test(arguments);
        assert!(complaint(&output).contains(expected), "{arguments:?}: {}", complaint(&output));
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
    }
    for (arguments, expected) in [
        (&["none.txt"][..], "cannot read none.txt"),
        (&["a.txt", "--world", "none.toml"], "--world: cannot read none.toml"),
        (&["a.txt", "--image", "a.txt"], "--image: a.txt: the image cannot be used: not an ELF file of 32 bits."),
    ] {
        let output = folder.test(arguments);
        assert!(complaint(&output).contains(expected), "{arguments:?}: {}", complaint(&output));
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
    }
}

#[test]
fn scenarios_on_an_image_are_those_for_it() {
    let scenarios = "== For it\nMVP ABS, 0, 1000\nwait 1 s until rotor = 1000\n== For another\nproduct: 3110\nMST 2\n\
        == Not for any\nnot on the image: it is slow\nMST 0\n";
    let folder = Folder::with(&[("a.txt", scenarios)]);
    let image: PathBuf = build::image();
    let output = folder.test(&["a.txt", "--image", &image.display().to_string()]);
    let expected = "\
a.txt: For it ... ok
a.txt: For another ... left out: the image is one of the TMCM-1140
a.txt: Not for any ... left out: it is slow
1 passed, 0 failed, 2 left out, in ";
    assert!(said(&output).starts_with(expected), "{}{}", said(&output), complaint(&output));
    assert_eq!(output.status.code(), Some(0));
}

#[test]
fn the_help_says_where_the_language_is_described() {
    let help = said(&run(&["test", "--help"]));
    assert!(help.contains("docs/scenarios.md") && help.contains("The exit code is 1 if a scenario fails"), "{help}");
}
