//! Editors are told the same as the assembler says. All sources of these tests are looked at in this way.

use std::path::PathBuf;

use super::super::editor::{Examined, Piece, PieceKind, complete, examine, explain};
use super::*;

const NAME: &str = "any.tmc";
const KNOWN: Option<Product> = Some(Product::Tmcm1140);

/// Asserts that editors are told the mistakes and commands that a source has, at the same places, and that nothing in
/// it is a trouble to them.
pub(super) fn agree(text: &str) {
    let sources = Texts([(PathBuf::from(NAME), text.into())].into());
    let name = Path::new(NAME);
    let Examined { lines, commands, mistakes, used, .. } = examine(&sources, name, KNOWN).unwrap();
    let written: Vec<&str> = text.split('\n').collect();
    assert_eq!(lines.len(), written.len(), "{text:?}");
    let diagnostics = match assemble_file(&sources, name, KNOWN).result {
        Ok(assembly) => {
            let numbered = assembly.lines.iter().filter(|line| !line.source.built_in && line.address.is_some());
            assert_eq!(commands, numbered.map(|line| line.number - 1).collect::<Vec<_>>(), "{text:?}");
            assert_eq!(used, assembly.commands.len(), "{text:?}");
            assembly.warnings
        }
        Err(errors) => errors,
    };
    assert_eq!(mistakes.len(), diagnostics.first().len());
    for (mistake, diagnostic) in mistakes.iter().zip(diagnostics.first()) {
        assert_eq!((&mistake.message, mistake.severity), (&diagnostic.message, diagnostic.severity));
        let location = diagnostic.location.as_ref().unwrap();
        assert_eq!((mistake.line + 1, &mistake.file), (location.line, &None));
        let shown: String = location.text.chars().take(location.last).skip(location.column - 1).collect();
        let units: Vec<u16> = written[mistake.line].trim_end_matches('\r').encode_utf16().collect();
        let range = mistake.range.start.min(units.len())..mistake.range.end.min(units.len());
        assert_eq!(String::from_utf16(&units[range]).unwrap(), shown, "{text:?}");
    }
    for (line, pieces) in written.iter().zip(&lines) {
        check_pieces(line.trim_end_matches('\r'), pieces);
    }
    let line = text.len() % written.len();
    let column = text.len() % (written[line].encode_utf16().count() + 2);
    let completion = complete(&sources, name, KNOWN, line, column).unwrap();
    assert!(completion.items.is_empty() || completion.range.start <= column, "{text:?}");
    explain(&sources, name, KNOWN, line, column).unwrap();
}

/// Asserts that the parts of a line follow each other and leave nothing out but spaces, up to what is wrong.
fn check_pieces(line: &str, pieces: &[Piece]) {
    let units: Vec<u16> = line.encode_utf16().collect();
    let is_empty = |range| {
        let text = String::from_utf16(&units[range]).unwrap();
        text.strip_prefix('\u{feff}').unwrap_or(&text).trim().is_empty()
    };
    let mut end = 0;
    for Piece { range, kind } in pieces {
        assert!(end <= range.start && range.start < range.end, "{line:?}: {pieces:?}");
        assert!(is_empty(end..range.start), "{line:?}: {pieces:?}");
        end = range.end;
        if *kind == PieceKind::Wrong {
            return;
        }
    }
    assert!(is_empty(end..units.len()), "{line:?}: {pieces:?}");
}

#[test]
fn lines_end_as_in_every_system() {
    for text in
        ["", "\n", "STOP\r\nSTOP", "\u{feff}STOP 5\r\n\r\nMST 0 /* 😀\r\n*/", "\u{feff}\u{feff}", "STOP\rSTOP\r"]
    {
        agree(text);
    }
}
