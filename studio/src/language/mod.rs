//! Questions that the page's editor and its direct mode ask the assembler. Lines and columns count from 0, columns in
//! units of UTF-16.

mod types;

use std::path::{Path, PathBuf};

use tmcl_tools::asm::{self, editor};
use tmcl_tools::sources::Texts;

use crate::program::NamedText;
use crate::stop::known;

#[cfg(test)]
pub(crate) use types::examples;
pub use types::{
    Advice, Checked, Completion, CompletionItem, Explained, Explanation, LineAsked, Mistake, PlaceAsked, Severity,
    TextAsked, TextLabel, TextPlace,
};

fn sources(texts: Vec<NamedText>) -> Texts {
    Texts(texts.into_iter().map(|NamedText { name, text }| (PathBuf::from(name), text)).collect())
}

/// The parts of a text, its mistakes, and what it has.
///
/// # Errors
/// There is no such text.
pub fn check(TextAsked { texts, main, product }: TextAsked) -> Result<Checked, String> {
    let examined = editor::examine(&sources(texts), Path::new(&main), known(product.as_deref()))?;
    let editor::Examined { lines, commands, labels, mistakes, more, used, room } = examined;
    let parts = |piece: editor::Piece| [piece.range.start, piece.range.end, piece.kind as usize];
    let lines = lines.into_iter().map(|pieces| pieces.into_iter().flat_map(parts).collect()).collect();
    let labels = labels.into_iter().map(|editor::Label { name, line }| TextLabel { name, line }).collect();
    Ok(Checked { lines, messages: mistakes.into_iter().map(mistake).collect(), more, commands, labels, used, room })
}

fn mistake(editor::Mistake { file, line, range, severity, message }: editor::Mistake) -> Mistake {
    let severity = match severity {
        asm::Severity::Error => Severity::Error,
        asm::Severity::Warning => Severity::Warning,
    };
    let advice = message.advice.map(|advice| match advice {
        asm::Advice::Words(words) => Advice::Words(words),
        asm::Advice::Name(name) => Advice::Instead(name),
    });
    Mistake { file, line, start: range.start, end: range.end, severity, words: message.words, advice }
}

/// Tells what can be written at a place in a text.
///
/// # Errors
/// There is no such text.
pub fn complete(PlaceAsked { texts, main, product, line, column }: PlaceAsked) -> Result<Completion, String> {
    let product = known(product.as_deref());
    editor::complete(&sources(texts), Path::new(&main), product, line, column).map(completion)
}

/// Tells what can be written at a place in a line of direct mode.
pub fn complete_line(LineAsked { line, column, product }: &LineAsked) -> Completion {
    completion(editor::complete_command(line, known(product.as_deref()), *column))
}

fn completion(editor::Completion { range, items }: editor::Completion) -> Completion {
    let items = items.into_iter().map(|editor::Item { text, note }| CompletionItem { text, note }).collect();
    Completion { start: range.start, end: range.end, items }
}

/// Tells what stands at a place in a text.
///
/// # Errors
/// There is no such text.
pub fn explain(PlaceAsked { texts, main, product, line, column }: PlaceAsked) -> Result<Explained, String> {
    let product = known(product.as_deref());
    let found = editor::explain(&sources(texts), Path::new(&main), product, line, column)?;
    let found = found.map(|editor::Explanation { range, words, definition }| Explanation {
        start: range.start,
        end: range.end,
        words,
        place: definition.map(|editor::Definition { file, line, column }| {
            let file = file.map(|file| file.display().to_string());
            TextPlace { file, line, column }
        }),
    });
    Ok(Explained { found })
}

#[cfg(test)]
mod tests {
    use tmcl_tools::asm::{Diagnostics, assemble_file};

    use super::*;

    const TEXT: &str = "#include speeds.inc\nLoop: ROR 0, Sped\n\tMVP ABS, 0 /* 😀\n ü */ JA Lop\nSAP 4, 0, 12ab\n";
    const SPEEDS: &str = "Speed = 500 *\n";

    fn texts(main: &str) -> Vec<NamedText> {
        let text = |name: &str, text: &str| NamedText { name: name.into(), text: text.into() };
        vec![text("speeds.inc", SPEEDS), text("main.tmc", main)]
    }

    fn asked(main: &str) -> TextAsked {
        TextAsked { texts: texts(main), main: "main.tmc".into(), product: Some("1140".into()) }
    }

    fn place(line: usize, column: usize) -> PlaceAsked {
        let TextAsked { texts, main, product } = asked(TEXT);
        PlaceAsked { texts, main, product, line, column }
    }

    /// The place of a mistake as `tmcl asm` shows it, and the words behind it.
    fn as_shown(main: &str, mistake: &Mistake) -> String {
        let Mistake { file, line, start, end, severity, words, advice } = mistake;
        let text = if file.is_none() { main } else { SPEEDS }.lines().nth(*line).unwrap_or_default();
        // The page counts in units of UTF-16, `tmcl asm` in characters; behind the end of a line both are the same.
        let units: Vec<u16> = text.encode_utf16().collect();
        let characters = |end: usize| {
            let inside = String::from_utf16(&units[..end.min(units.len())]).unwrap().chars().count();
            inside + end.saturating_sub(units.len())
        };
        let (start, end) = (characters(*start), characters(*end));
        let severity = match severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        let advice = match advice {
            Some(Advice::Words(words)) => format!("; {words}"),
            Some(Advice::Instead(name)) => format!("; did you mean '{name}'?"),
            None => String::new(),
        };
        let file = file.as_deref().unwrap_or("main.tmc");
        let before: String = text.chars().take(start).map(|c| if c == '\t' { '\t' } else { ' ' }).collect();
        let before = before + &" ".repeat(start.saturating_sub(text.chars().count()));
        let (line, column, carets) = (line + 1, start + 1, "^".repeat(end - start));
        format!("{file}:{line}:{column}: {severity}: {words}{advice}\n    {text}\n    {before}{carets}")
    }

    /// Mistakes of all kinds, in texts with letters of one unit and of two.
    #[test]
    fn mistakes_stand_where_the_assembler_shows_them() {
        let many = "😀\n".repeat(30);
        for main in [
            TEXT,
            "#include <speeds.inc\n#include none.inc\n#incl x\n#nostop x\n",
            "Lö = 4 /* 😀 */ + Lo\nSAP APMaxCurent, 0, 1 // 😀\nSAP 4, 0, 50000\nJA 9\n",
            "SAP 4, 0, 50000 // 😀\nJA 9\n/* 😀 */ DIV: WAIT POS, 7, 1\nNOP\n255\n",
            "SAP 4 0, 1\n/*😀*/MVP ABX, 0, 1\nMVP ABS REL, 0, 1\nGAP 300, 0\nGAP 1, 0, 0, 0\nSTAP 4, 0,\nA:A:\nSTOP = 4\n",
            "COMP 5 / 0\nCOMP (3\nCOMP 3)\nCOMP * 3\nCOMP $FFFFFFFF * 2\nCOMP 4294967296\nCOMP 1;\n😀 /* 😀",
            &many,
        ] {
            let checked = check(asked(main)).unwrap();
            let sources = sources(texts(main));
            let assembled = assemble_file(&sources, Path::new("main.tmc"), known(Some("1140"))).result;
            let diagnostics = assembled.map_or_else(|errors| errors, |assembly| assembly.warnings);
            assert!(!diagnostics.is_empty());
            let mut shown: Vec<String> = checked.messages.iter().map(|mistake| as_shown(main, mistake)).collect();
            shown.extend(checked.more);
            assert_eq!(shown.join("\n"), Diagnostics::to_string(&diagnostics));
        }
    }

    #[test]
    fn a_text_is_checked() {
        let checked = check(asked(TEXT)).unwrap();
        let lines = [
            vec![0, 8, 5, 9, 19, 6],
            vec![0, 4, 2, 4, 5, 4, 6, 9, 0, 10, 11, 3, 11, 12, 4, 13, 17, 1],
            vec![1, 4, 0, 5, 8, 1, 8, 9, 4, 10, 11, 3, 12, 17, 7],
            vec![0, 5, 7, 6, 8, 0, 9, 12, 1],
            vec![0, 3, 0, 4, 5, 3, 5, 6, 4, 7, 8, 3, 8, 9, 4, 10, 14, 8],
            vec![],
        ];
        assert_eq!(checked.lines, lines);
        assert_eq!((checked.commands, checked.used, checked.room), (vec![1, 2, 3], 4, Some(2048)));
        assert_eq!(checked.labels, [TextLabel { name: "Loop".into(), line: 1 }]);
        let advice: Vec<Option<Advice>> = checked.messages.into_iter().map(|mistake| mistake.advice).collect();
        assert_eq!(advice[1], Some(Advice::Instead("Speed".into())));
        assert!(matches!(&advice[2], Some(Advice::Words(words)) if words.starts_with("usage: MVP")));
        let none = TextAsked { main: "none".into(), ..asked(TEXT) };
        assert!(check(none).unwrap_err().contains("no such file"));
    }

    #[test]
    fn a_place_is_completed_and_explained() {
        let Completion { start, end, items } = complete(place(3, 11)).unwrap();
        assert_eq!((start, end), (9, 12));
        assert_eq!(items, [CompletionItem { text: "Loop".into(), note: "label, line 2".into() }]);
        let found = explain(place(1, 2)).unwrap().found.unwrap();
        assert_eq!((found.start, found.end, found.words.as_str()), (0, 4, "label"));
        assert_eq!(found.place, Some(TextPlace { file: None, line: 1, column: 0 }));
        let found = explain(place(0, 10)).unwrap().found.unwrap();
        assert_eq!(found.place, Some(TextPlace { file: Some("speeds.inc".into()), line: 0, column: 0 }));
        assert_eq!(explain(place(9, 9)).unwrap().found, None);
        assert!(complete(place(9, 9)).unwrap().items.is_empty());
    }

    #[test]
    fn a_line_of_direct_mode_is_completed() {
        let asked = LineAsked { line: "GAP APActualP".into(), column: 13, product: Some("6110".into()) };
        let Completion { start, end, items } = complete_line(&asked);
        assert_eq!((start, end, items[0].text.as_str()), (4, 13, "APActualPosition"));
        let unknown = LineAsked { product: Some("9".into()), ..asked };
        assert!(complete_line(&unknown).items.is_empty());
    }
}
