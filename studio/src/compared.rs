//! The types of the page beside those of the doors: what is given at a door has the type that the page says.

use std::collections::{BTreeMap, BTreeSet};

use serde_json::{Value as Json, json};

use tmcm::tmcl::Command;

use crate::types::*;

/// The types of the page, by their names.
fn page() -> BTreeMap<&'static str, &'static str> {
    let defined = |line: &'static str| {
        let (kind, name) = line.strip_prefix("/** @typedef {")?.strip_suffix(" */")?.rsplit_once("} ")?;
        Some((name, kind.trim()))
    };
    include_str!("../page/types.js").lines().filter_map(defined).collect()
}

/// The parts of a text between separators that stand outside of braces.
fn parts(text: &str, separator: char) -> Vec<&str> {
    let (mut depth, mut from, mut parts) = (0, 0, Vec::new());
    for (at, c) in text.char_indices() {
        depth += i32::from("{(".contains(c)) - i32::from("})".contains(c));
        if c == separator && depth == 0 {
            parts.push(text[from..at].trim());
            from = at + 1;
        }
    }
    parts.push(text[from..].trim());
    parts
}

/// Whether a value is of a type of the page, with all fields and no others; notes the alternatives that were used.
fn fits<'a>(kind: &'a str, value: &Json, types: &BTreeMap<&str, &'a str>, used: &mut BTreeSet<&'a str>) -> bool {
    let alternatives = parts(kind, '|');
    if alternatives.len() > 1 {
        let found = alternatives.into_iter().find(|kind| fits(kind, value, types, used));
        used.extend(found);
        return found.is_some();
    }
    match (kind, value) {
        ("null", Json::Null)
        | ("number", Json::Number(_))
        | ("string", Json::String(_))
        | ("boolean", Json::Bool(_)) => true,
        (_, Json::Array(list)) if kind.ends_with("[]") => {
            !list.is_empty()
                && list
                    .iter()
                    .all(|value| fits(kind.trim_end_matches("[]").trim_matches(['(', ')']), value, types, used))
        }
        (_, Json::Object(fields)) if kind.starts_with('{') => {
            let inner = kind.trim_start_matches('{').trim_end_matches('}');
            let expected: Vec<(&str, &str)> =
                parts(inner, ',').iter().filter_map(|field| field.split_once(": ")).collect();
            expected.len() == fields.len()
                && expected
                    .iter()
                    .all(|(name, kind)| fields.get(*name).is_some_and(|value| fits(kind, value, types, used)))
        }
        (_, Json::String(text)) if kind.starts_with('\'') => kind.trim_matches('\'') == text,
        _ => types.get(kind).is_some_and(|kind| fits(kind, value, types, used)),
    }
}

#[test]
fn the_page_has_the_same_types() {
    let request = Request::new(1, Command::new(6, 1, 0, 0));
    let outcomes = [
        Outcome::Reply(vec![0; 9]),
        Outcome::NoReply(3),
        Outcome::Others { asked: 1, answered: vec![2] },
        Outcome::Address,
        Outcome::Lost("gone".into()),
        Outcome::Interrupted,
    ];
    let products = [Some(String::from("1140")), None];
    let mut examples = vec![
        ("Request", json!(request)),
        ("Exchange", json!(Exchange { request, timeout: 1000 })),
        ("Start", json!(Start { product: "1140".into(), world: Some("[motor]".into()), eeprom: None })),
        ("Start", json!(Start { product: "1140".into(), world: None, eeprom: Some("ff".into()) })),
        ("Line", json!(Line { line: "state".into() })),
        ("Ticket", json!(Ticket { ticket: 1 })),
        ("Bytes", json!(Bytes { bytes: vec![1] })),
        ("Taken", json!(Taken { outcome: None })),
        ("Requests", json!(Requests { requests: vec![request] })),
        ("Value", json!(Value { value: Some(1) })),
        ("Value", json!(Value { value: None })),
        ("Reach", json!(Reach { address: 1, timeout: 1000 })),
        ("Products", json!(Products { products: vec!["1140".into()] })),
        ("Text", json!(Text { text: "done".into(), done: true })),
        ("Progress", json!(Progress::default())),
        ("Answer", json!(Answer::<Nothing>::Error("no".into()))),
        ("Answer", json!(Answer::<Nothing>::Interrupted(String::new()))),
    ];
    let row = SampleRow { at: 1.0, values: vec![Some(1.5), None] };
    examples.push(("SampleRow", json!(row)));
    let begun = Download::Begun { end: request, clear: vec![request] };
    for download in [Download::Same, Download::Over, begun] {
        examples.push(("Download", json!(download)));
        examples.push(("Noted", json!(Noted { stops: vec![request], download })));
    }
    for outcome in outcomes {
        let finished = Finished { ticket: 1, outcome: outcome.clone() };
        let stopped = matches!(outcome, Outcome::Address).then(|| "the core is locked up".into());
        let (told, messages) = ([None, Some(5)], vec!["warning".into()]);
        let lines = told.map(|ticket| LineTold { ticket, line: "{}".into() }).to_vec();
        examples.extend(lines.iter().map(|line| ("LineTold", json!(line))));
        examples.push(("Outcome", json!(outcome)));
        examples.push(("Read", json!(Read { request, outcome: outcome.clone() })));
        examples.push(("Taken", json!(Taken { outcome: Some(outcome) })));
        examples.push(("Finished", json!(finished)));
        examples.push((
            "Turn",
            json!(Turn {
                replies: vec![finished],
                lines,
                messages,
                rows: vec![row.clone()],
                paused: true,
                powered: true,
                starts: 0,
                stored: 0,
                left: [Some(1.5), None][usize::from(stopped.is_some())],
                stopped,
                nap: 1.5
            }),
        ));
    }
    for product in products {
        examples.push(("Image", json!(Image { product: product.clone() })));
        examples.push(("Axes", json!(Axes { address: 1, product: product.clone() })));
        examples.push(("Moved", json!(Moved { request, product: product.clone() })));
        examples.push(("Module", json!(Module { name: "TMCM-1140".into(), product })));
    }
    examples.extend(crate::log::examples());
    examples.extend(crate::program::examples());
    examples.extend(crate::scope::examples());
    examples.extend(crate::session::examples());
    examples.extend(crate::status::examples());
    examples.extend(crate::world::examples());
    examples.extend(crate::language::examples());
    examples.extend(crate::parameters::types::examples());
    examples.extend(crate::parameters::view::examples());
    let types = page();
    let (mut used, mut seen) = (BTreeSet::new(), BTreeSet::new());
    for (name, value) in &examples {
        let kind = types.get(name).unwrap_or_else(|| panic!("the page has no {name}"));
        assert!(fits(kind, value, &types, &mut used), "{name}: {kind}, and not {value}");
        seen.insert(*name);
    }
    assert_eq!(types.keys().copied().collect::<BTreeSet<_>>(), seen, "the page has others");
    let alternatives = types.values().flat_map(|kind| parts(kind, '|')).filter(|kind| !kind.contains("any"));
    let unions: BTreeSet<&str> =
        types.values().filter(|kind| parts(kind, '|').len() > 1).flat_map(|kind| parts(kind, '|')).collect();
    assert!(alternatives.filter(|kind| unions.contains(kind)).all(|kind| used.contains(kind)), "{unions:?} {used:?}");
    // What is not so is noticed.
    let fits = |kind, value| fits(kind, &value, &types, &mut BTreeSet::new());
    assert!(!fits("Ticket", json!({ "ticket": "1" })) && !fits("Ticket", json!({ "ticket": 1, "more": 1 })));
    assert!(!fits("Ticket", json!({})) && !fits("Outcome", json!("gone")) && !fits("Value", json!({ "value": "x" })));
}
