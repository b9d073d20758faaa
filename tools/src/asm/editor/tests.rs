//! Tests of what editors ask.

use std::path::{Path, PathBuf};

use super::super::{Severity, assemble_file};
use super::*;
use crate::product::Product;
use crate::sources::Texts;

const KNOWN: Option<Product> = Some(Product::Tmcm1140);
const MAIN: &str = "main.tmc";

fn texts(texts: &[(&str, &str)]) -> Texts {
    Texts(texts.iter().map(|(name, text)| (PathBuf::from(name), (*text).to_string())).collect())
}

/// The place of the bar in a text, and the text without it.
fn place(text: &str) -> (String, usize, usize) {
    let (before, behind) = text.split_once('|').unwrap();
    let line = before.rsplit('\n').next().unwrap();
    (format!("{before}{behind}"), before.matches('\n').count(), line.encode_utf16().count())
}

fn completion(marked: &str, others: &[(&str, &str)]) -> Completion {
    let (text, line, column) = place(marked);
    let mut sources = texts(others);
    sources.0.insert(MAIN.into(), text);
    complete(&sources, Path::new(MAIN), KNOWN, line, column).unwrap()
}

fn offered(marked: &str) -> Vec<String> {
    completion(marked, &[]).items.into_iter().map(|item| item.text).collect()
}

fn explained(marked: &str, others: &[(&str, &str)]) -> Option<Explanation> {
    let (text, line, column) = place(marked);
    let mut sources = texts(others);
    sources.0.insert(MAIN.into(), text);
    explain(&sources, Path::new(MAIN), KNOWN, line, column).unwrap()
}

fn words(marked: &str) -> String {
    explained(marked, &[]).map_or_else(String::new, |explanation| explanation.words)
}

#[test]
fn each_token_has_a_colour() {
    use PieceKind::*;
    let text =
        "\u{feff}Lü: 😀: sap 4, %0 // ü\n#include \"a b\" /* from\n\n here */ x = STOP(\nsap = 12a STOP\nRFS STOP\n";
    let told: Vec<Vec<(usize, usize, PieceKind)>> = tokens(text)
        .into_iter()
        .map(|line| line.into_iter().map(|Piece { range, kind }| (range.start, range.end, kind)).collect())
        .collect();
    let expected: [&[_]; 7] = [
        &[(1, 3, Label), (3, 4, Symbol), (5, 7, Wrong)],
        &[(0, 8, Directive), (9, 14, File), (15, 22, Comment)],
        &[],
        &[(0, 8, Comment), (9, 10, Name), (11, 12, Symbol), (13, 17, Name), (17, 18, Symbol)],
        &[(0, 3, Name), (4, 5, Symbol), (6, 9, Wrong)],
        &[(0, 3, Mnemonic), (4, 8, Name)],
        &[],
    ];
    assert_eq!(told, expected);
    let line = tokens("a: B: nop, 5 // 😀").remove(0);
    let kinds: Vec<PieceKind> = line.iter().map(|piece| piece.kind).collect();
    assert_eq!(kinds, [Label, Symbol, Label, Symbol, Mnemonic, Symbol, Number, Comment]);
    assert_eq!(line.last().unwrap().range, 13..18);
}

#[test]
fn a_text_is_examined_with_those_that_it_includes() {
    let sources = texts(&[
        (MAIN, "#include speeds.inc\nLoop: ROR 0, Sped // 😀\n\t/*😀*/ MVP ABS, 0\nEnd:\n  JA Loop\n5 = 6\n"),
        ("speeds.inc", "Speed = 500 *\nROL 0, 1\n"),
    ]);
    let examined = examine(&sources, Path::new(MAIN), KNOWN).unwrap();
    assert_eq!(examined.lines.len(), 7);
    assert_eq!(examined.commands, [1, 2, 4, 5]);
    let labels: Vec<(&str, usize)> = examined.labels.iter().map(|label| (label.name.as_str(), label.line)).collect();
    assert_eq!(labels, [("Loop", 1), ("End", 3)]);
    // The five commands that could be read, and the STOP behind them.
    assert_eq!((examined.used, examined.room), (6, Some(2048)));
    let told: Vec<_> = examined.mistakes.iter().map(|m| (m.file.as_deref(), m.line, m.range.clone())).collect();
    let expected = [(Some("speeds.inc"), 0, 13..14), (None, 1, 13..17), (None, 2, 18..19), (None, 5, 2..3)];
    assert_eq!(told, expected);
    assert!(examine(&sources, Path::new("none"), KNOWN).unwrap_err().contains("there is no such file"));
}

#[test]
fn files_that_include_each_other_and_marks_in_front_are_no_trouble() {
    let sources = texts(&[(MAIN, "\u{feff}Sapp 1\n#include b.inc\n"), ("b.inc", "#include main.tmc\nB: JA B\n")]);
    let examined = examine(&sources, Path::new(MAIN), None).unwrap();
    let told: Vec<_> = examined.mistakes.iter().map(|m| (m.file.as_deref(), m.line, m.range.clone())).collect();
    assert_eq!(told, [(None, 0, 1..5), (Some("b.inc"), 0, 9..17)]);
    assert_eq!((examined.used, examined.room), (2, None));
    assert!(examined.mistakes[1].message.words.contains("includes itself"));
    let completion = complete(&sources, Path::new(MAIN), None, 2, 0).unwrap();
    assert!(completion.items.iter().any(|item| item.text == "MVP"));
}

/// The lines that have commands are those to which the assembler gives addresses.
#[test]
fn the_assembler_has_commands_in_the_same_lines() {
    let text = "Motor = 0\nA: B: ROR Motor, 5\n6, 1\nC:\n// STOP\n/* STOP\nSTOP */ STOP\n#nostop\nNOP";
    let sources = texts(&[(MAIN, text)]);
    let examined = examine(&sources, Path::new(MAIN), KNOWN).unwrap();
    let assembly = assemble_file(&sources, Path::new(MAIN), KNOWN).result.unwrap();
    let lines = assembly.lines.iter().filter(|line| line.address.is_some());
    assert_eq!(examined.commands, lines.map(|line| line.number - 1).collect::<Vec<_>>());
    assert_eq!(examined.used, assembly.commands.len());
    assert_eq!(examined.mistakes[0].severity, Severity::Warning);
}

#[test]
fn what_is_too_large_is_told() {
    let many = |count: usize| "ROR 0, 1\n".repeat(count) + "STOP";
    let examined = |text: &str| examine(&texts(&[(MAIN, text)]), Path::new(MAIN), KNOWN).unwrap();
    let fits = examined(&many(2047));
    assert_eq!((fits.used, fits.mistakes.len()), (2048, 0));
    let too_many = examined(&many(2048));
    assert_eq!((too_many.used, too_many.commands.len()), (2049, 2049));
    assert_eq!((too_many.mistakes[0].line, too_many.mistakes.len()), (2048, 1));
    assert!(too_many.mistakes[0].message.words.contains("too long: program memory holds 2048 commands"));
    let wrong = examined(&"x ".repeat(1 << 20));
    assert!(wrong.mistakes[0].message.words.starts_with("unknown command"));
    let wrong = examined(&"x\n".repeat(1 << 20));
    assert_eq!((wrong.mistakes.len(), wrong.lines.len()), (20, (1 << 20) + 1));
    assert!(wrong.more.unwrap().contains("the first 20"));
}

#[test]
fn commands_stand_where_a_statement_begins() {
    assert_eq!(offered("ST|"), ["STAP", "STGP", "STOP"]);
    assert_eq!(offered("Loop: mv|p ABS"), ["MVP"]);
    let all = offered("|");
    assert!(all.contains(&"RETI".into()) && all.contains(&"UF7".into()) && !all.contains(&String::new()));
    let Completion { range, items } = completion("ü😀: M| // x", &[]);
    // What is before it is wrong, so that nobody can tell what stands here.
    assert_eq!((range, items.len()), (6..6, 0));
    let Completion { range, items } = completion("ü: ms|t 0", &[]);
    let item = Item { text: "MST".into(), note: "<motor or bank>".into() };
    assert_eq!((range, items), (3..6, vec![item]));
    for nothing in
        ["ST|: STOP", "ST| = 4", "// ST|", "ST // |", "/* ST|", "/*\nST|\n*/", "/*\n|\n*/", "12|", "sapp |", "; ST|"]
    {
        assert!(offered(nothing).is_empty(), "{nothing}");
    }
    assert!(!offered("/* */ ST|").is_empty() && !offered("/*\n*/|").is_empty() && !offered("|// x").is_empty());
    assert_eq!((offered("#|"), offered("# NO|")), (vec!["#include".into(), "#nostop".into()], vec!["#nostop".into()]));
    assert!(offered("SAP #|").is_empty());
}

#[test]
fn operands_are_the_names_that_fit() {
    assert_eq!(offered("MVP |")[..3], ["ABS", "COORD", "REL"]);
    assert_eq!(completion("rfs, st|", &[]).items[0].note, "type 0 of RFS");
    let items = completion("#include TMCLParam.tmc\nGAP APActualP|, 0", &[]).items;
    let note = "axis parameter 1, actual position (microsteps)";
    assert_eq!(items, [Item { text: "APActualPosition".into(), note: note.into() }]);
    // What cannot be written, stored or does not fit is not offered.
    assert!(offered("SAP apactuals|").is_empty() && offered("STAP apactualp|").is_empty());
    assert_eq!(offered("STAP APMaxC|"), ["APMaxCurrent"]);
    assert_eq!((offered("GAP 1, |"), offered("WAIT POS, M|")), (vec!["Motor0".into()], vec!["Motor0".into()]));
    assert_eq!(
        (offered("SGP GPAuto|"), offered("5, APMaxAcc|")),
        (vec!["GPAutoStart".into()], vec!["APMaxAcceleration".into()])
    );
    assert_eq!(
        (offered("EI TI_G|"), offered("VECT TI_G|"), offered("GGP TI_POS|")),
        (vec!["TI_GLOBAL".into()], vec![], vec![])
    );
    assert_eq!(offered("SGP TI_STOP_L|"), ["TI_STOP_LEFT0"]);
    assert!(offered("GAP 1 |").is_empty() && offered("STOP |").is_empty() && offered("GAP 1, 0, |").is_empty());
    // What is not included says how it is.
    assert!(completion("GAP APActualP|", &[]).items[0].note.ends_with("; wants #include TMCLParam.tmc"));
    // Three letters are looked for within names, too.
    assert!(offered("GAP position|").contains(&"APActualPosition".into()) && offered("GAP os|").is_empty());
}

#[test]
fn names_of_the_program_are_offered_with_their_values() {
    let program = "#include o.inc\nSpeed = 2 * Half\nLoop: MST 0\nLate = Loop\nJA |";
    let others = [("o.inc", "Half = $10\nThere:\n")];
    let items = completion(program, &others).items;
    let told: Vec<(&str, &str)> = items.iter().map(|item| (item.text.as_str(), item.note.as_str())).collect();
    let expected = [
        ("Loop", "label, line 3"),
        ("There", "label, o.inc:2"),
        ("Half", "constant, 16"),
        ("Late", "constant"),
        ("Speed", "constant, 32"),
    ];
    assert_eq!(told, expected);
    assert_eq!(offered("Speed = 5\nLoop: ROR 0, 3 * (s|"), ["Speed"]);
    assert_eq!(offered("Speed = 5\nLoop: Sum = |"), ["Loop", "Speed", "Sum"]);
    // A name of the program hides that of the product.
    assert_eq!(completion("APMaxCurrent = 9\nSAP APMaxC|", &[]).items[0].note, "constant, 9");
    let many: String = (0..300).map(|i| format!("C{i} = {i}\n")).collect();
    assert_eq!(offered(&format!("{many}COMP |")).len(), 200);
}

#[test]
fn files_are_offered_behind_include() {
    let others = [("speeds.inc", ""), ("a b.tmc", "")];
    let Completion { range, items } = completion("#include |", &others);
    let texts: Vec<&str> = items.iter().map(|item| item.text.as_str()).collect();
    assert_eq!((range, texts), (9..9, vec!["\"a b.tmc\"", "speeds.inc", "Interrupts.inc", "TMCLParam.tmc"]));
    assert_eq!(completion("#include \"a|", &others).range, 9..11);
    assert_eq!(completion("#include \"a|", &others).items.len(), 1);
    assert_eq!(completion("#include sp|eeds // x", &others).range, 9..15);
}

#[test]
fn a_command_alone_has_the_names_of_the_product() {
    let offered = |marked: &str, product| {
        let (line, _, column) = place(marked);
        complete_command(&line, product, column)
    };
    let Completion { range, items } = offered("GAP APActualP|", KNOWN);
    let note = "axis parameter 1, actual position (microsteps)".into();
    assert_eq!((range, items), (4..13, vec![Item { text: "APActualPosition".into(), note }]));
    assert!(offered("GAP AP|", None).items.is_empty() && offered("J|", KNOWN).items.is_empty());
    assert_eq!(offered("gg|", None).items[0].text, "GGP");
    assert!(offered("#|", KNOWN).items.is_empty() && offered("x = |", KNOWN).items.is_empty());
    assert!(offered("MVP ABS, 0, |", KNOWN).items.is_empty() && offered("|", KNOWN).items.len() > 20);
    let lacking = |product| offered("STA|", Some(product)).items.len();
    assert_eq!((lacking(Product::Tmcm1140), lacking(Product::Tmcm3212)), (1, 0));
}

#[test]
fn names_are_explained() {
    assert_eq!(words("  sa|p 4, 0, 1"), "command 5: SAP <type>, <motor or bank>, <value>");
    assert_eq!(words("MVP |REL, 0, 1"), "type 1 of MVP");
    assert_eq!(words("nop|"), "command 0, which ends a program");
    assert_eq!(
        words("SAP APMax|Current, 0, 1"),
        "axis parameter 6, maximum current (1/255); takes 0..255, default 128, stored by STAP; 32 steps of 8; CS = value/8"
    );
    assert_eq!(words("SAP |6, 0, 1"), words("SAP APMaxCurrent|, 0, 1"));
    assert_eq!(words("GAP APActualLoa|d"), "axis parameter 206, actual load value; read only; stallGuard2 reading");
    assert_eq!(words("EI TI_G|LOBAL"), "interrupt 255, all interrupts together");
    assert!(
        words("SGP TI_STOP_LEFT0|, 3, 1")
            .starts_with("interrupt 27, stop left 0 transition; its parameter in bank 3 takes 0..3")
    );
    assert!(words("SGP 2|7, 3, 1").starts_with("parameter of interrupt 27, stop left 0 transition; takes 0..3"));
    assert!(
        words("GGP |77, 0").starts_with("global parameter 77, ") && words("Bank = 0\nGGP 7|7, Bank").contains("77")
    );
    assert_eq!((words("GGP 77|, 2"), words("COMP 7|7"), words("SAP |+ 6"), words("// S|AP")), Default::default());
    assert_eq!(words("#nosto|p"), "puts no STOP at the end");
    assert_eq!(words("ROR Motor|0, 1"), "axis 0");
    assert_eq!(words("#include Inter|rupts.inc"), "built-in file with the numbers of interrupts");
}

#[test]
fn a_name_leads_to_where_it_is_defined() {
    let others = [("o.inc", "  Half = $10\n")];
    let told = |marked: &str| explained(marked, &others).unwrap();
    let definition =
        |file: Option<&str>, line, column| Some(Definition { file: file.map(PathBuf::from), line, column });
    let program = "#include o.inc\n#include TMCLParam.tmc\nROR 0, 5\n/*😀*/ Loop: ROR 0, Half\nJA Lo|op + 1";
    let found = told(program);
    assert_eq!((found.range, found.words), (3..7, "label, address 1".into()));
    assert_eq!(found.definition, definition(None, 3, 7));
    let found = told("#include o.inc\nNoSuch 5\nROR 0, -ha|lf");
    assert_eq!((found.words, found.definition), ("constant, 16".into(), definition(Some("o.inc"), 0, 2)));
    // A label of what cannot be assembled has no address yet.
    assert_eq!(told("NoSuch 5\nLo|op: STOP").words, "label");
    let found = told("#include o.|inc");
    assert_eq!((found.words, found.definition), ("file o.inc".into(), definition(Some("o.inc"), 0, 0)));
    assert_eq!(explained("JA No|where", &others), None);
    assert_eq!(told("Late = Loop + 4\nLoop: COMP La|te").words, "constant, 4");
}
