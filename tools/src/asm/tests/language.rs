//! Tests of the language: what sources may contain, and the messages about mistakes.

use super::*;

#[test]
fn names_and_numbers_in_every_form() {
    let source = "
speed = $3E8 /* 1000 */ Half = Speed / 2
";
    assert!(errors(source).contains("a comma or an operator"), "one statement in a line");
    let source = "
Speed = $3E8 /* 1000 */
Half = -(SPEED - 0xA) / 2
here: THERE:
    ror %0, 0b11_0
";
    assert!(errors(source).contains("'0b11_0' is not a number"));
    let source = "
Speed = $3E8 /* 1000 */
HALF = -(SPEED - 0xA) / 2 // -495
here: THERE:
    ror %0, 0b110
    sap 4, motor, half + speed * 2
    Gap, 1 /* motor left out */
    mst
    rfs Start
    jc Eq, There
    ja here + 2
    Motor = 0
    6 1
    UF0 1, 2, $FFFFFFFF
    stop
";
    let expected = [
        "ROR 0, 6",
        "SAP 4, 0, 1505",
        "GAP 1, 0",
        "MST 0",
        "RFS START, 0",
        "JC EQ, 0",
        "JA 2",
        "GAP 1, 0",
        "UF0 1, 2, -1",
        "STOP",
    ];
    let assembly = assembled(source);
    assert_eq!(assembly.commands, commands(&expected));
    assert_eq!(assembly.symbols.labels().collect::<Vec<_>>(), [("here", 0), ("THERE", 0)]);
    assert_eq!(assembly.symbols.constants().collect::<Vec<_>>(), [("Speed", 1000), ("HALF", -495), ("Motor", 0)]);
    assert_eq!((assembly.symbols.value("tHeRe"), assembly.symbols.value("nobody")), (Some(0), None));
    assert_eq!(
        assembly.line(1).map(|line| (line.number, line.text())),
        Some((6, "    sap 4, motor, half + speed * 2"))
    );
}

/// The assembler and `text::parse`, which reads single commands, agree on the operands that may be left out.
#[test]
fn single_commands_are_read_as_everywhere_else() {
    let lines = [
        "WAIT TICKS, 0, 50",
        "RFS START, 0",
        "RFS STOP",
        "STOP",
        "GAP 1, 0",
        "GAP 1",
        "CSUB 5",
        "MST",
        "CALCX SWAP",
        "CLE ALL",
        "EI 255",
        "VECT 0, 1",
        "6, 1, 0, 0",
        "6 1",
        "0",
        "77, 1, 2, -3",
        "MVP COORD, 255, 1",
        "SCO 0, 255, 0",
        "MVP 7, 0, 1",
        "WAIT TICKS, 0",
        "SAP 4",
        "MST 0, 1",
        "CALC ADD",
        "STOP 1",
        "GAP 256, 0",
        "GAP -1, 0",
        "GOTO 1",
        "256, 0",
        "MVP UP, 0, 1",
        "STAP 4, 0, 0",
        "RSAP 4, 0, 0",
        "STGP 4, 2, 0",
        "RSGP 4, 2, $0",
        "GCO 4, 0, 0",
        "STAP 4, 0, 1",
        "GCO 4, 0, 0, 0",
        "STAP 4, 0,",
        "GAP 4, 0, 0",
        "JC ESD, 0",
    ];
    for line in lines {
        let alone = text::parse(line).ok();
        let assembled = assemble_text("test.tmc", line, Some(Product::Tmcm1140))
            .ok()
            .and_then(|assembly| assembly.commands.first().copied());
        assert_eq!(assembled, alone, "{line}");
    }
}

#[test]
fn stop_is_put_at_the_end_where_it_is_missing() {
    for (source, expected) in [
        ("", &["STOP"][..]),
        ("MST 0", &["MST 0", "STOP"]),
        ("MST 0\nSTOP", &["MST 0", "STOP"]),
        ("JA End\nSTOP\nEnd:", &["JA 2", "STOP", "STOP"]),
        ("JA End\nEnd:", &["JA 1", "STOP"]),
        ("MST 0\n#nostop", &["MST 0"]),
        ("#nostop", &[]),
    ] {
        assert_eq!(assembled(source).commands, commands(expected), "{source}");
    }
    assert_eq!(assembled("MST 0").line(1), None);
}

#[test]
fn program_memory_has_2048_commands() {
    let with = |count: usize, rest: &str| format!("{}{rest}", "MST 0\n".repeat(count));
    assert_eq!(assembled(&with(2047, "")).commands.len(), 2048);
    assert_eq!(assembled(&with(2047, "STOP")).commands.len(), 2048);
    assert_eq!(assembled(&with(2048, "#nostop")).commands.len(), 2048);
    assert!(errors(&with(2048, "")).starts_with("test.tmc:2048:1: error: the program is too long: with the STOP"));
    let errors = errors(&with(3000, ""));
    assert!(
        errors.starts_with("test.tmc:2049:1: error: the program is too long: program memory holds 2048"),
        "{errors}"
    );
    assert_eq!(errors.lines().count(), 3);
}

/// All mistakes of a source are reported in one run, each with its location, its line and a way to mend it.
#[test]
fn mistakes() {
    let source = "\
#include TMCLParam.tmc
\tSAP APMaxSped, 0, 1000 // with a tab
Loop: ROR 0, Lop
Loop: MVP UPP, 0, 5
WAIT TICKS 0, 50
SAP 4, 0
STOP: JA loop
GIOO 1
EI TI_TIMER0
B = C + 1
C = 5
Big = 65536 * 65536
SAP 300, 0, 1
#define X
CALC ADD,
MST 0, 1 + 1
GAP 1, 0 ; where
300, 1
6, 1, 0, 0, 0
GAP 1, 0,
/* no end
";
    let expected = "\
test.tmc:2:6: error: unknown name 'APMaxSped'; did you mean 'APMaxPositioningSpeed'?
    \tSAP APMaxSped, 0, 1000 // with a tab
    \t    ^^^^^^^^^
test.tmc:3:14: error: unknown name 'Lop'; did you mean 'Loop'?
    Loop: ROR 0, Lop
                 ^^^
test.tmc:4:1: error: 'Loop' is defined twice; it is also in test.tmc:3
    Loop: MVP UPP, 0, 5
    ^^^^
test.tmc:4:11: error: 'UPP' is none of ABS, REL, COORD
    Loop: MVP UPP, 0, 5
              ^^^
test.tmc:5:12: error: a comma is missing between TICKS and this
    WAIT TICKS 0, 50
               ^
test.tmc:6:9: error: SAP: missing <value>; usage: SAP <type>, <motor or bank>, <value>
    SAP 4, 0
            ^
test.tmc:7:1: error: 'STOP' is a command; take another name
    STOP: JA loop
    ^^^^
test.tmc:8:1: error: unknown command 'GIOO'; did you mean 'GIO'?
    GIOO 1
    ^^^^
test.tmc:9:4: error: unknown name 'TI_TIMER0'; it is in a built-in file: add the line #include Interrupts.inc
    EI TI_TIMER0
       ^^^^^^^^^
test.tmc:10:5: error: 'C' has no value yet; its line (test.tmc:11) has to be above this one
    B = C + 1
        ^
test.tmc:12:13: error: the result does not fit 32 bits (-2147483648..4294967295)
    Big = 65536 * 65536
                ^
test.tmc:13:5: error: 300 is out of range; 0..255 fits here
    SAP 300, 0, 1
        ^^^
test.tmc:14:1: error: there are #include and #nostop; a constant is written Name = value
    #define X
    ^^^^^^^
test.tmc:15:10: error: a value is missing here
    CALC ADD,
             ^
test.tmc:16:8: error: MST: '1 + 1' is one operand too many; usage: MST <motor or bank>
    MST 0, 1 + 1
           ^^^^^
test.tmc:17:10: error: ';' means nothing in TMCL; comments begin with //
    GAP 1, 0 ; where
             ^
test.tmc:18:1: error: command numbers are 0..255
    300, 1
    ^^^
test.tmc:19:13: error: one operand too many; after a command number there are type, motor or bank, and value
    6, 1, 0, 0, 0
                ^
test.tmc:20:10: error: nothing follows this comma; it is one too many
    GAP 1, 0,
             ^
test.tmc:21:1: error: this comment does not end; close it with */
    /* no end
    ^^";
    let found = errors(source);
    for (found, expected) in found.lines().zip(expected.lines()) {
        assert_eq!(found, expected);
    }
    assert_eq!(found.lines().count(), expected.lines().count());
}

#[test]
fn warnings_have_the_place_of_the_operand() {
    let source = "SAP 4, 0, 3 * 1000\nSAP 3, 0, 1\nJA 17\nRFS START, 1\n129, 1\nGAP 14";
    let warnings = assembled(source).warnings;
    let places: Vec<_> =
        warnings.0.iter().filter_map(|w| w.location.as_ref()).map(|l| (l.line, l.column, l.last)).collect();
    assert_eq!(places, [(1, 11, 18), (2, 5, 5), (3, 4, 5), (4, 12, 12), (5, 1, 3), (6, 5, 6)]);
    assert_eq!(warnings.errors(), 0);
}

/// Pages and editors need not read out of the text of a message what they want of it.
#[test]
fn messages_have_fields() {
    let refused = |source: &str| {
        let told = assemble_text("stage.tmc", source, Settings::default()).unwrap_err().0.remove(0);
        (told.message, told.location.unwrap())
    };
    let (message, place) = refused("Speed = 5\n\u{1f600} ROR 0, Speeed");
    assert_eq!((message.words.as_str(), message.advice), ("'\u{1f600}' means nothing in TMCL", None));
    assert_eq!((place.file.as_str(), place.line, place.column, place.last), ("stage.tmc", 2, 1, 1));
    let (message, place) = refused("Speed = 5\n/* \u{1f600}\u{e4} */ ROR 0, Speeed");
    assert_eq!((message.words.as_str(), message.advice), ("unknown name 'Speeed'", Some(Advice::Name("Speed".into()))));
    // The emoji is one character, and two units of UTF-16.
    assert_eq!((place.column, place.last), (17, 22));
    assert_eq!((place.utf16(1), place.utf16(4), place.utf16(5), place.utf16(place.column)), (1, 4, 6, 18));
    let (message, _) = refused("GAP 300, 0");
    assert_eq!(
        (message.words.as_str(), message.advice),
        ("300 is out of range", Some(Advice::Words("0..255 fits here".into())))
    );
    let (message, place) = refused("MVP ABS, 0");
    let usage = Advice::Words("usage: MVP <ABS|REL|COORD>, <motor or bank>, <value>".into());
    assert_eq!((message.words.as_str(), message.advice), ("MVP: missing <value>", Some(usage)));
    assert_eq!((place.column, place.last, place.utf16(place.last)), (11, 11, 11), "behind the end of the line");
}

/// NOP is command 0, which ends a program, although some programs contain NOP in the belief that it does nothing.
#[test]
fn nop_is_command_0_and_ends_the_program() {
    let assembly = assembled("Nothing: nop\nJA Nothing");
    assert_eq!(assembly.commands, commands(&["0, 0, 0, 0", "JA 0", "STOP"]));
    let expected = "\
test.tmc:1:10: warning: this ends the program: a module takes command 0 for the end, none does nothing
    Nothing: nop
             ^^^";
    assert_eq!(assembly.warnings.to_string(), expected);
    assert!(errors("NOP 0").contains("NOP stands alone"));
    assert!(assembled("0").warnings.0.is_empty(), "hosts put the number there to end a program");
}

/// For a file that is no TMCL source only the first mistakes are shown.
#[test]
fn of_many_mistakes_only_the_first_are_shown() {
    let found = errors(&"nothing\n".repeat(100_000));
    assert_eq!(found.matches("error: unknown command").count(), 20);
    assert!(found.ends_with("and more; these are the first 20"), "{found}");
    let warnings = assembled(&"EI 99\n".repeat(100)).warnings.to_string();
    assert_eq!(warnings.matches("warning").count(), 20);
    assert!(warnings.ends_with("and more; these are the first 20"), "{warnings}");
}

#[test]
fn of_a_long_line_the_part_with_the_mistake_is_shown() {
    let found = errors(&format!("MVP ABS, 0, {} Nobody", "1 + ".repeat(1000)));
    let lines: Vec<&str> = found.lines().collect();
    assert_eq!(lines[0], "test.tmc:1:4014: error: unknown name 'Nobody'");
    let place = lines[2].find('^').unwrap();
    assert_eq!((&lines[1][place..], lines[2].trim()), ("Nobody", "^^^^^^"));
    assert!(lines[1].len() <= 204);
}

#[test]
fn control_characters_do_not_reach_the_terminal() {
    assert!(!errors("MVP \u{1b}[2J, 0, 0").contains('\u{1b}'));
}

// ---- files that include others

struct Files(Texts);

impl Files {
    fn new(files: &[(&str, &str)]) -> Self {
        Files(Texts(files.iter().map(|(name, text)| ((*name).into(), (*text).into())).collect()))
    }

    fn assemble(&self, name: &str) -> Result<Assembly, Diagnostics> {
        assemble_file(&self.0, Path::new(name), Some(Product::Tmcm1140)).result
    }

    fn errors(&self, name: &str) -> String {
        self.assemble(name).expect_err("errors").to_string()
    }
}

#[test]
fn included_files_are_found_beside_the_including_one() {
    let files = Files::new(&[
        ("main.tmc", "#include lib/a.tmc\nJA A\n#include \"lib\\b b.tmc\"\n#include tmclparam.tmc\nGAP APActualSpeed"),
        ("lib/a.tmc", "A: ROR 0, Speed\n#include c.inc"),
        ("lib/c.inc", "\u{feff}Speed = 500"),
        ("lib/b b.tmc", "MST 0\r\n#include <TMCLParam.tmc>\r\n"),
    ]);
    let assembly = files.assemble("main.tmc").unwrap();
    assert_eq!(assembly.commands, commands(&["ROR 0, 500", "JA 0", "MST 0", "GAP 3, 0", "STOP"]));
    let places = (0..4).map(|address| {
        let line = assembly.line(address).unwrap();
        (line.source.path.as_deref().and_then(Path::file_name).unwrap().to_string_lossy(), line.number)
    });
    let expected = [("a.tmc", 1), ("main.tmc", 2), ("b b.tmc", 1), ("main.tmc", 5)];
    assert_eq!(places.collect::<Vec<_>>(), expected.map(|(file, line)| (file.into(), line)));
}

#[test]
fn a_file_of_ones_own_goes_before_a_built_in_one() {
    let files = Files::new(&[("main.tmc", "#include TMCLParam.tmc\nGAP Mine"), ("TMCLParam.tmc", "Mine = 1")]);
    assert_eq!(files.assemble("main.tmc").unwrap().commands, commands(&["GAP 1, 0", "STOP"]));
}

#[test]
fn mistakes_in_included_files() {
    let files = Files::new(&[
        ("main.tmc", "#include a.tmc\n#include none.tmc\nROR 0, Speed"),
        ("a.tmc", "Speed = 5\nROR 0\n#include main.tmc"),
        ("twice.tmc", "#include names.inc\n#include names.inc"),
        ("names.inc", "Speed = 5"),
    ]);
    assert_eq!(
        files.errors("main.tmc"),
        "\
a.tmc:2:6: error: ROR: missing <value>; usage: ROR <motor or bank>, <value>
    ROR 0
         ^
a.tmc:3:10: error: main.tmc includes itself
    #include main.tmc
             ^^^^^^^^
main.tmc:2:10: error: cannot read none.tmc: there is no such file or folder; TMCLParam.tmc and Interrupts.inc \
         are built in
    #include none.tmc
             ^^^^^^^^"
    );
    assert!(
        files.errors("twice.tmc").contains("names.inc:1:1: error: 'Speed' is defined twice; it is also in names.inc:1")
    );
    assert!(files.errors("missing.tmc").starts_with("tmcl: cannot read missing.tmc"));
}

/// Each file includes the next one several times; without a limit reading them would take for ever.
#[test]
fn the_number_of_included_files_is_limited() {
    let names: Vec<String> = (0..20).map(|i| format!("{i}.tmc")).collect();
    let texts: Vec<String> = (1..=20).map(|i| format!("#include {i}.tmc\n").repeat(4)).collect();
    let files: Vec<(&str, &str)> = names.iter().map(String::as_str).zip(texts.iter().map(String::as_str)).collect();
    let errors = Files::new(&files).errors("0.tmc");
    assert!(errors.contains("files include each other more than 16 deep"), "{errors}");
    let many = Files::new(&[("main.tmc", &"#include empty\n".repeat(501)), ("empty", "")]);
    assert!(many.errors("main.tmc").contains("main.tmc:501:10: error: more than 500 files are included"));
}
