//! Types of what is asked of the language, and of what is told.

use serde::{Deserialize, Serialize};

use crate::program::NamedText;

/// A text that is to be checked.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextAsked {
    /// All texts.
    pub texts: Vec<NamedText>,
    /// The name of the one that is meant; it may include the others.
    pub main: String,
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
}

/// A place in a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlaceAsked {
    /// All texts.
    pub texts: Vec<NamedText>,
    /// The name of the one that is meant; it may include the others.
    pub main: String,
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
    /// The line.
    pub line: usize,
    /// The column.
    pub column: usize,
}

/// A place in a line of direct mode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LineAsked {
    /// The line.
    pub line: String,
    /// The column.
    pub column: usize,
    /// The product, such as 1140; null for one that is not known.
    pub product: Option<String>,
}

/// A text as the assembler sees it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Checked {
    /// For each line its parts: start, end, and the number of the kind, one part behind the other. The kinds are, from
    /// 0 on: mnemonic, name, label, number, symbol, directive, file, comment, wrong.
    pub lines: Vec<Vec<usize>>,
    /// Errors and warnings of the whole program, the first of them.
    pub messages: Vec<Mistake>,
    /// The words that are said where there are more of them.
    pub more: Option<String>,
    /// The lines that have commands.
    pub commands: Vec<usize>,
    /// The labels of the text.
    pub labels: Vec<TextLabel>,
    /// Number of commands of the whole program; where there are errors, of those that could be read.
    pub used: usize,
    /// Number of commands that the product has room for; null for one that is not known.
    pub room: Option<usize>,
}

/// An error or a warning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mistake {
    /// The name of the text; null for the one that was asked for.
    pub file: Option<String>,
    /// The line.
    pub line: usize,
    /// The first column of the mistake.
    pub start: usize,
    /// The column behind its last one.
    pub end: usize,
    /// Whether the program can be assembled all the same.
    pub severity: Severity,
    /// The mistake, in words.
    pub words: String,
    /// The advice, which says what to do about it.
    pub advice: Option<Advice>,
}

/// How bad a mistake is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Severity {
    /// The program cannot be assembled.
    Error,
    /// The program can be assembled, but may not do what is meant.
    Warning,
}

/// Advice that says what to do about a mistake.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Advice {
    /// In words.
    Words(String),
    /// The text that is probably meant in place of what is written there.
    Instead(String),
}

/// A label of a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextLabel {
    /// The label.
    pub name: String,
    /// The line of the label.
    pub line: usize,
}

/// The texts that can be written at a place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Completion {
    /// The first column that it replaces.
    pub start: usize,
    /// The column behind the last one.
    pub end: usize,
    /// The texts that can be written, those that fit best first; at most 200.
    pub items: Vec<CompletionItem>,
}

/// Something that can be written.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CompletionItem {
    /// The text that is written.
    pub text: String,
    /// The meaning of the text, in a few words; it may be empty.
    pub note: String,
}

/// The answer to a question about what stands at a place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Explained {
    /// The explanation; null where nothing has a meaning of its own.
    pub found: Option<Explanation>,
}

/// An explanation of what stands at a place.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Explanation {
    /// The first column of what is explained.
    pub start: usize,
    /// The column behind its last one.
    pub end: usize,
    /// The explanation, in words.
    pub words: String,
    /// Where it is defined; null if that is in no text.
    pub place: Option<TextPlace>,
}

/// A place in a text.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TextPlace {
    /// The name of the text; null for the one that was asked for.
    pub file: Option<String>,
    /// The line.
    pub line: usize,
    /// The column.
    pub column: usize,
}

/// Examples of the types, for the test that compares them with the page's.
#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use serde_json::json;

    let texts = vec![NamedText { name: "a.tmc".into(), text: "STOP".into() }];
    let place = TextPlace { file: None, line: 1, column: 2 };
    let explanation = Explanation { start: 1, end: 2, words: "label".into(), place: Some(place.clone()) };
    let item = CompletionItem { text: "STOP".into(), note: String::new() };
    let advice = [Some(Advice::Words("more".into())), Some(Advice::Instead("Speed".into())), None];
    let mistakes: Vec<Mistake> = advice
        .iter()
        .zip([Severity::Error, Severity::Warning, Severity::Error])
        .map(|(advice, severity)| Mistake {
            file: advice.as_ref().map(|_| "a.tmc".into()),
            line: 0,
            start: 1,
            end: 2,
            severity,
            words: "wrong".into(),
            advice: advice.clone(),
        })
        .collect();
    let label = TextLabel { name: "Loop".into(), line: 1 };
    let mut examples = vec![
        ("TextLabel", json!(label)),
        ("TextPlace", json!(place)),
        ("TextPlace", json!(TextPlace { file: Some("a.tmc".into()), ..place.clone() })),
        ("Explanation", json!(explanation)),
        ("Explanation", json!(Explanation { place: None, ..explanation.clone() })),
        ("Explained", json!(Explained { found: Some(explanation) })),
        ("Explained", json!(Explained { found: None })),
        ("CompletionItem", json!(item)),
        ("Completion", json!(Completion { start: 0, end: 1, items: vec![item] })),
        ("Severity", json!(Severity::Error)),
        ("Severity", json!(Severity::Warning)),
    ];
    examples.extend(mistakes.iter().map(|mistake| ("Mistake", json!(mistake))));
    examples.extend(advice.iter().flatten().map(|advice| ("Advice", json!(advice))));
    for product in [Some(String::from("1140")), None] {
        let (texts, main) = (texts.clone(), String::from("a.tmc"));
        let room = product.as_ref().map(|_| 2048);
        let (lines, messages, labels) = (vec![vec![0, 4, 0]], mistakes.clone(), vec![label.clone()]);
        let checked = Checked { lines, messages, more: product.clone(), commands: vec![0], labels, used: 1, room };
        examples.push(("Checked", json!(checked)));
        let asked = TextAsked { texts: texts.clone(), main: main.clone(), product: product.clone() };
        examples.push(("TextAsked", json!(asked)));
        let asked = PlaceAsked { texts, main, product: product.clone(), line: 0, column: 1 };
        examples.push(("PlaceAsked", json!(asked)));
        let asked = LineAsked { line: "STOP".into(), column: 1, product: product.clone() };
        examples.push(("LineAsked", json!(asked)));
    }
    examples
}
