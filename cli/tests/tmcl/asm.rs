//! `tmcl asm` and `tmcl disasm`: files in, files and text out.

use std::io::Write;
use std::process::{Output, Stdio};

use super::harness::{complaint, names, run, tmcl};

const SOURCE: &str = "\
// A flag that goes up and down once per second
#include TMCLParam.tmc
#include Interrupts.inc
Speed = 2 * 500

        SAP APMaxPositioningSpeed, Motor0, Speed
        VECT TI_TIMER0, Tick
        EI TI_TIMER0
Loop:   JA Loop /* all is done
                   by the interrupt */
Tick:   MVP REL, 0, -51200
        RETI
";

const LISTING: &str = "\
DIR/flag.tmc:
                                   1  // A flag that goes up and down once per second
                                   2  #include TMCLParam.tmc
                                   3  #include Interrupts.inc
                                   4  Speed = 2 * 500
                                   5
   0  05 04 00 00 00 03 E8 F4      6          SAP APMaxPositioningSpeed, Motor0, Speed
   1  25 00 00 00 00 00 04 29      7          VECT TI_TIMER0, Tick
   2  19 00 00 00 00 00 00 19      8          EI TI_TIMER0
   3  16 00 00 00 00 00 03 19      9  Loop:   JA Loop /* all is done
                                  10                     by the interrupt */
   4  04 01 00 FF FF 38 00 3B     11  Tick:   MVP REL, 0, -51200
   5  26 00 00 00 00 00 00 26     12          RETI
   6  1C 00 00 00 00 00 00 1C         STOP // put here by the assembler
labels:
  Loop = 3
  Tick = 4
constants:
  Speed = 1000
DIR/flag.bin: 7 commands, 56 bytes
";

const AGAIN: &str = "    SAP 4, 0, 1000                  // maximum positioning speed
    VECT 0, L4
    EI 0
L3:
    JA L3
L4:
    MVP REL, 0, -51200
    RETI
    STOP
";

/// A folder with files, and the program run in it.
struct Folder(tempfile::TempDir);

impl Folder {
    fn with(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        Folder(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().unwrap().into()
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap()
    }

    /// Runs the program in the folder.
    fn run(&self, arguments: &[&str]) -> Output {
        tmcl(arguments).current_dir(self.0.path()).output().unwrap()
    }

    /// The output of the program when all is well.
    fn shown(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", complaint(&output));
        assert!(output.stderr.is_empty(), "{arguments:?}: {}", complaint(&output));
        String::from_utf8(output.stdout).unwrap()
    }

    /// The complaint of the program when it ends with 1.
    fn complaint(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        complaint(&output)
    }
}

#[test]
fn a_program_there_and_back() {
    let folder = Folder::with(&[("flag.tmc", SOURCE)]);
    let shown = folder.shown(&["asm", &folder.path("flag.tmc"), "--listing", "--symbols"]);
    assert_eq!(shown.replace(folder.0.path().to_str().unwrap(), "DIR"), LISTING);
    let program = folder.read("flag.bin");
    assert_eq!(program.len(), 56);
    assert_eq!(program[32..40], [4, 1, 0, 0xFF, 0xFF, 0x38, 0, 0x3B]);
    let source = folder.shown(&["disasm", "flag.bin"]);
    assert_eq!(source, AGAIN);
    std::fs::write(folder.path("again.tmc"), source).unwrap();
    assert_eq!(folder.shown(&["asm", "again.tmc", "-o", "other"]), "other: 7 commands, 56 bytes\n");
    assert_eq!(folder.read("other"), program);
    assert_eq!(names(folder.0.path()), ["again.tmc", "flag.bin", "flag.tmc", "other"]);
}

#[test]
fn mistakes_are_shown_with_their_place_and_nothing_is_written() {
    let folder = Folder::with(&[
        ("main.tmc", "#include speeds.inc\nLoop: ROR 0, Sped\n\tMVP ABS, 0\n  JA Lop\n"),
        ("speeds.inc", "Speed = 500 *\n"),
    ]);
    let expected = "\
speeds.inc:1:14: error: a value is missing here
    Speed = 500 *
                 ^
main.tmc:2:14: error: unknown name 'Sped'; did you mean 'Speed'?
    Loop: ROR 0, Sped
                 ^^^^
main.tmc:3:12: error: MVP: missing <value>; usage: MVP <ABS|REL|COORD>, <motor or bank>, <value>
    \tMVP ABS, 0
    \t          ^
main.tmc:4:6: error: unknown name 'Lop'; did you mean 'Loop'?
      JA Lop
         ^^^
";
    assert_eq!(folder.complaint(&["asm", "main.tmc"]), expected);
    assert_eq!(names(folder.0.path()), ["main.tmc", "speeds.inc"]);
}

#[test]
fn warnings_are_shown_and_the_program_is_written() {
    let folder = Folder::with(&[("fast.tmc", "SAP 4, 0, 50000\nJA 9\n")]);
    let output = folder.run(&["asm", "fast.tmc"]);
    assert!(output.status.success());
    let expected = "\
fast.tmc:1:11: warning: 50000 is out of range: maximum positioning speed takes 1..2047
    SAP 4, 0, 50000
              ^^^^^
fast.tmc:2:4: warning: address 9 is outside of the program, which ends at 2
    JA 9
       ^
";
    assert_eq!(complaint(&output), expected);
    assert_eq!(folder.read("fast.bin").len(), 24);
}

#[test]
fn strictly_a_warning_is_an_error_and_nothing_is_written() {
    let folder = Folder::with(&[("fast.tmc", "SAP 4, 0, 50000\nJA 0\n"), ("slow.tmc", "SAP 4, 0, 500\n")]);
    let expected = "\
fast.tmc:1:11: error: 50000 is out of range: maximum positioning speed takes 1..2047
    SAP 4, 0, 50000
              ^^^^^
";
    assert_eq!(folder.complaint(&["asm", "fast.tmc", "--strict"]), expected);
    assert_eq!(folder.complaint(&["asm", "fast.tmc", "--strict", "-o", "-"]), expected);
    assert_eq!(names(folder.0.path()), ["fast.tmc", "slow.tmc"]);
    assert_eq!(folder.shown(&["asm", "slow.tmc", "--strict"]), "slow.bin: 2 commands, 16 bytes\n");
}

#[test]
fn sources_are_never_replaced() {
    let folder =
        Folder::with(&[("main.tmc", "#include part.bin\n"), ("part.bin", "STOP\n"), ("main.bin.tmc", "STOP\n")]);
    for output in ["main.tmc", "part.bin", "./main.tmc"] {
        let complaint = folder.complaint(&["asm", "main.tmc", "-o", output]);
        assert!(complaint.ends_with("is a source of this program; give another file with -o\n"), "{complaint}");
    }
    assert_eq!(folder.read("part.bin"), b"STOP\n");
    assert!(folder.complaint(&["asm", "part.bin"]).contains("part.bin is a source"));
}

#[test]
fn files_that_are_no_programs_are_told() {
    let folder = Folder::with(&[("text.bin", "STOP\n"), ("main.tmc", "STOP\n")]);
    let text = "tmcl: text.bin is text, not an assembled program; a source has a name that ends in .tmc, and tmcl asm \
                assembles it\n";
    assert_eq!(folder.complaint(&["disasm", "text.bin"]), text);
    std::fs::write(folder.path("short.bin"), [0; 13]).unwrap();
    let short = "tmcl: short.bin: command 1 is cut off: it has 5 bytes in place of 8; the file, 13 bytes long, is \
                 damaged, or it is no TMCL program\n";
    assert_eq!(folder.complaint(&["disasm", "short.bin"]), short);
    std::fs::write(folder.path("sum.bin"), [28, 0, 0, 0, 0, 0, 0, 29]).unwrap();
    let sum = "tmcl: sum.bin: command 0 (STOP) has the checksum 1D and should have 1C; the file is damaged, or it is \
               no TMCL program\n";
    assert_eq!(folder.complaint(&["disasm", "sum.bin"]), sum);
    std::fs::write(folder.path("long.bin"), [0; 8 * 3000]).unwrap();
    let long = "tmcl: long.bin: it has more commands than the 2048 that program memory holds\n";
    assert_eq!(folder.complaint(&["disasm", "long.bin"]), long);
    assert!(folder.complaint(&["disasm", "none.bin"]).starts_with("tmcl: cannot read none.bin: "));
    assert!(folder.complaint(&["asm", "none.tmc"]).starts_with("tmcl: cannot read none.tmc: "));
    let unwritable = folder.complaint(&["asm", "main.tmc", "-o", "none/main.bin"]);
    assert!(unwritable.starts_with("tmcl: cannot write none/main.bin: "), "{unwritable}");
}

#[test]
fn standard_input_and_output() {
    let through = |arguments: &[&str], input: &[u8]| {
        let mut child = tmcl(arguments).stdin(Stdio::piped()).spawn().unwrap();
        // A wrong call ends the program before it reads.
        let _ = child.stdin.take().unwrap().write_all(input);
        child.wait_with_output().unwrap()
    };
    let assembled = through(&["asm", "-", "-o", "-"], b"MST 0\n");
    assert_eq!(complaint(&assembled), "standard output: 2 commands, 16 bytes\n");
    let program = assembled.stdout;
    assert_eq!(program, [3, 0, 0, 0, 0, 0, 0, 3, 28, 0, 0, 0, 0, 0, 0, 28]);
    assert_eq!(through(&["disasm", "-"], &program).stdout, b"    MST 0\n    STOP\n");
    let nowhere = through(&["asm", "-"], b"");
    assert_eq!((nowhere.status.code(), complaint(&nowhere).contains("-o program.bin")), (Some(1), true));
    let wrong = through(&["asm", "-", "-o", "-"], b"MTS 0\n");
    assert!(complaint(&wrong).starts_with("standard input:1:1: error: unknown command 'MTS'"));
    assert!(wrong.stdout.is_empty());
    let both = through(&["asm", "-", "-o", "-", "--listing", "--symbols"], b"Here: MST 0\n");
    assert_eq!(both.stdout, program, "what is to be read does not get among the bytes");
    assert!(complaint(&both).contains("1  Here: MST 0\n") && complaint(&both).contains("labels:\n  Here = 0\n"));
}

#[test]
fn labels_count_from_the_origin() {
    let text = "Begin: JA End\nMST 0\nEnd: JA Begin\n";
    let folder = Folder::with(&[("routine.tmc", text), ("out.tmc", "JA 49\nJA 50\nJA 52\nSTOP\n")]);
    let listing = "\
routine.tmc:
  50  16 00 00 00 00 00 34 4A      1  Begin: JA End
  51  03 00 00 00 00 00 00 03      2  MST 0
  52  16 00 00 00 00 00 32 48      3  End: JA Begin
  53  1C 00 00 00 00 00 00 1C         STOP // put here by the assembler
labels:
  Begin = 50
  End   = 52
routine.bin: 4 commands, 32 bytes, to be loaded to address 50
";
    let shown = folder.shown(&["asm", "routine.tmc", "--origin", "50", "--listing", "--symbols"]);
    assert_eq!(shown, listing);
    let source = "L50:\n    JA L52\n    MST 0\nL52:\n    JA L50\n    STOP\n";
    assert_eq!(folder.shown(&["disasm", "routine.bin", "--origin", "50"]), source);
    let warned = complaint(&folder.run(&["asm", "out.tmc", "--origin", "50"]));
    let out = "out.tmc:1:4: warning: address 49 is outside of the program, which begins at 50 and ends at 53\n";
    assert!(warned.starts_with(out) && warned.lines().count() == 3, "{warned}");
    // Program memory has 2048 commands.
    let long = folder.complaint(&["asm", "routine.tmc", "--origin", "2046"]);
    let message =
        "routine.tmc:3:6: error: the program is too long: program memory holds 2 commands from address 2046 on\n";
    assert!(long.starts_with(message), "{long}");
    let beyond = folder.complaint(&["asm", "routine.tmc", "--origin", "3000"]);
    assert!(beyond.contains("the program is too long: program memory ends before address 3000"), "{beyond}");
    let stop = folder.complaint(&["asm", "routine.tmc", "--origin", "2045"]);
    let message =
        "with the STOP behind this it has 4 commands, and program memory holds 3 commands from address 2045 on";
    assert!(stop.contains(message), "{stop}");
}

#[test]
fn the_names_that_are_built_in() {
    let output = run(&["asm", "--names"]);
    let names = String::from_utf8(output.stdout).unwrap();
    for line in ["// TMCLParam.tmc", "APMaxPositioningSpeed = 4 // maximum positioning speed", "TI_GLOBAL = 255"] {
        assert!(names.contains(line), "{line}");
    }
    let folder = Folder::with(&[("names.tmc", &names)]);
    assert_eq!(folder.shown(&["asm", "names.tmc"]), "names.bin: 1 command, 8 bytes\n");
    assert_eq!(run(&["asm"]).status.code(), Some(2));
}

/// A program for several axes, which no module with one could run.
const AXES: &str = "\
#include TMCLParam.tmc
#include Interrupts.inc
        SAP APMaxPositioningSpeed, Motor2, 0
        VECT TI_STOP_RIGHT2, Hit
        EI TI_STOP_RIGHT2
Hit:    MVP COORD, $47, 1
        SIO 7, 2, 1
        GIO 4, 1
        RETI
";

#[test]
fn a_program_is_for_a_product() {
    let folder = Folder::with(&[("axes.tmc", AXES), ("wide.tmc", "SAP 4, 3, 5\nMVP COORD, $48, 1\n")]);
    for product in ["3110", "TMCM-6110"] {
        assert_eq!(
            folder.shown(&["asm", "axes.tmc", "--product", product]),
            "axes.bin: 8 commands, 64 bytes\n",
            "{product}"
        );
    }
    assert_eq!(folder.read("axes.bin")[8..16], [0x25, 32, 0, 0, 0, 0, 3, 0x48]);
    let told = folder.complaint(&["asm", "axes.tmc"]);
    assert!(
        told.contains(
            "axes.tmc:3:36: error: unknown name 'Motor2': the TMCM-1140 does not have it; --product says which module the \
             program is for, and there it is with 3110, 3212, 6110"
        ),
        "{told}"
    );
    let warned = complaint(&folder.run(&["asm", "wide.tmc", "--product", "3110"]));
    assert!(warned.contains("wide.tmc:1:8: warning: there is no axis 3; the last of this module is 2"), "{warned}");
    assert!(warned.contains("wide.tmc:2:12: warning: $48 is no set of axes: bits 0..2 are the axes"), "{warned}");
    assert!(complaint(&folder.run(&["asm", "wide.tmc", "--product", "6110"])).is_empty());
    let source = |product| folder.shown(&["disasm", "axes.bin", "--product", product]);
    assert!(source("3110").starts_with("    SAP 4, 2, 0                     // maximum positioning speed\n"));
    std::fs::write(folder.path("encoder.tmc"), "GAP 209, 0\n").unwrap();
    folder.shown(&["asm", "encoder.tmc"]);
    let source = |product| folder.shown(&["disasm", "encoder.bin", "--product", product]);
    assert_eq!(source("3110"), "    GAP 209, 0                      // encoder position\n    STOP\n");
    assert_eq!(source("6110"), "    GAP 209, 0\n    STOP\n");
}

#[test]
fn the_names_of_a_product() {
    let output = run(&["asm", "--names", "--product", "6110"]);
    let names = String::from_utf8(output.stdout).unwrap();
    for line in
        ["Motor5 = 5 // axis 5", "APGroupIndex = 213 // group index", "TI_STOP_LEFT5 = 37 // stop left 5 transition"]
    {
        assert!(names.contains(line), "{line}");
    }
    assert!(!names.contains("EncoderPosition"));
}
