//! Comments, for people who know stepper motors but not this code, and whose language may not be English.

use std::fs;

use crate::{FOLDERS, root, sources};

/// Words that stand for a subject which a reader has not been told yet. A doc comment begins with none of them.
const SUBJECTLESS: [&str; 13] =
    ["It", "Its", "They", "What", "This", "That", "Those", "These", "Who", "Whose", "Which", "One", "There"];
/// The most words of a sentence.
const MOST_WORDS: usize = 30;
/// The last column of a comment. Rows of tables may be longer.
const LAST_COLUMN: usize = 120;

#[test]
fn comments_are_read_easily() {
    let mut found = Vec::new();
    let mut checked = 0;
    for path in FOLDERS.iter().flat_map(|folder| sources(&root().join(folder))) {
        let text = fs::read_to_string(&path).unwrap();
        let name = path.strip_prefix(root()).unwrap().display();
        for comment in comments(&text) {
            checked += 1;
            let faults = comment.faults();
            found.extend(faults.into_iter().map(|fault| format!("{name}:{}: {fault}", comment.line)));
        }
    }
    assert!(found.is_empty(), "{} comments:\n{}", found.len(), found.join("\n"));
    assert!(checked > 10_000, "{checked} comments");
}

#[test]
fn hard_comments_are_found() {
    let faults = |text: &str| comments(text).iter().flat_map(Comment::faults).collect::<Vec<_>>();
    let long = format!("/// The a{}.", " b".repeat(28));
    let longer = format!("/// The a{}.", " b".repeat(29));
    for good in [
        "/// The mistake.\nstruct A;",
        "//! Reads. It waits.",
        "// It is so.",
        "/// Some\n/// That is a second line.",
        &long,
        &format!("/// | {} |", "b ".repeat(70)),
        &format!("/// ```\n/// {}\n/// ```", "b ".repeat(40)),
        "let a = \"// It is\";",
    ] {
        assert_eq!(faults(good), [""; 0], "{good}");
    }
    for bad in ["/// It waits.", "//! What is wrong.", "/// [`That`] one.", &longer, &format!("// {}", "b".repeat(118))]
    {
        assert_eq!(faults(bad).len(), 1, "{bad}");
    }
}

/// Lines of comments that belong together.
struct Comment<'a> {
    /// The number of its first line, from 1.
    line: usize,
    /// The slashes, and the exclamation mark of a comment that stands within its item.
    marker: &'a str,
    /// The whole lines, with what they are indented by.
    lines: Vec<&'a str>,
}

/// The comments of a source, without those that stand behind code.
fn comments(text: &str) -> Vec<Comment<'_>> {
    let mut all: Vec<Comment> = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let Some(marker) = marker(line) else { continue };
        match all.last_mut() {
            Some(last) if last.line + last.lines.len() == number && last.marker == marker => last.lines.push(line),
            _ => all.push(Comment { line: number, marker, lines: vec![line] }),
        }
    }
    all
}

fn marker(line: &str) -> Option<&'static str> {
    let line = line.trim_start();
    ["///", "//!", "//"].into_iter().find(|marker| line.starts_with(marker))
}

impl Comment<'_> {
    fn faults(&self) -> Vec<String> {
        let texts = || self.lines.iter().map(|line| line.trim_start().trim_start_matches(self.marker).trim_end());
        let mut faults = Vec::new();
        let is_long = |line: &&&str| {
            line.chars().count() > LAST_COLUMN && !line.trim_start_matches(['/', '!', ' ']).starts_with('|')
        };
        faults
            .extend(self.lines.iter().filter(is_long).map(|line| format!("longer than {LAST_COLUMN} columns: {line}")));
        let first = texts().next().unwrap_or_default();
        let word: String =
            first.chars().skip_while(|c| " `[".contains(*c)).take_while(|c| c.is_alphanumeric()).collect();
        if self.marker != "//" && SUBJECTLESS.contains(&&*word) {
            faults.push(format!("names no subject:{first}"));
        }
        let sentences = sentences(texts());
        let is_long = |sentence: &&String| sentence.split_whitespace().count() > MOST_WORDS;
        faults.extend(
            sentences.iter().filter(is_long).map(|sentence| format!("more than {MOST_WORDS} words: {sentence}")),
        );
        faults
    }
}

/// The sentences of a comment, without tables, headings and code. Clauses behind a colon or a semicolon count as
/// sentences of their own where they begin with a capital letter.
fn sentences<'a>(lines: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut all = vec![String::new()];
    let mut is_code = false;
    for line in lines {
        let text = line.trim();
        let is_fence = text.starts_with("```");
        is_code ^= is_fence;
        let is_item = text.starts_with("- ")
            || text.starts_with("* ")
            || text.split_once(". ").is_some_and(|(number, _)| number.parse::<u8>().is_ok());
        let is_prose =
            !is_code && !is_fence && !text.is_empty() && !text.starts_with(['|', '#']) && !line.starts_with("    ");
        if !is_prose || is_item {
            all.push(String::new());
        }
        for word in text.split_whitespace().filter(|_| is_prose) {
            let last = all.last_mut().unwrap();
            let begins = word.starts_with(|c: char| c.is_uppercase() || "`[(".contains(c));
            if last.ends_with(['.', '!', '?']) || last.ends_with([':', ';']) && begins {
                all.push(word.into());
            } else {
                if !last.is_empty() {
                    last.push(' ');
                }
                last.push_str(word);
            }
        }
    }
    all
}
