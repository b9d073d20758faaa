//! The large structure of a scenario file: scenarios with their worlds, their tables of parameters and their
//! steps.

use std::collections::BTreeMap;

use hal_sim::world::config::WorldConfig;

use super::line::{self, Step};
use super::{Case, Mistake, Scenario, SourceLine};

/// One combination of parameters: name and value, as text.
type Parameters = BTreeMap<String, String>;

/// A world and a table of parameters, and the lines that belong to them.
#[derive(Clone, Debug, Default)]
struct Settings {
    world: Vec<SourceLine>,
    tables: Vec<Vec<Parameters>>,
}

/// Reads a file. A scenario with a mistake does not keep the others from running.
pub(super) fn read(text: &str) -> Vec<(String, Result<Scenario, Mistake>)> {
    let lines: Vec<SourceLine> = (1..)
        .zip(text.lines())
        .map(|(number, text)| SourceLine { number, text: without_comment(text).to_string() })
        .filter(|line| !line.text.is_empty())
        .collect();
    let is_title = |line: &SourceLine| line.text.starts_with("==");
    let first = lines.iter().position(is_title).unwrap_or(lines.len());
    let (preamble, rest) = lines.split_at(first);
    let common = match settings(preamble, Settings::default()) {
        Ok((common, [])) => common,
        Ok((_, [line, ..])) => {
            let mistake =
                Mistake::new(line.number, "a step before the first scenario; scenarios begin with '== title'");
            return vec![("(preamble)".into(), Err(mistake))];
        }
        Err(mistake) => return vec![("(preamble)".into(), Err(mistake))],
    };
    let mut scenarios = Vec::new();
    let mut rest = rest;
    while let [heading, after @ ..] = rest {
        let (body, others) = after.split_at(after.iter().position(is_title).unwrap_or(after.len()));
        let title = heading.text.trim_matches('=').trim().to_string();
        scenarios.push((title.clone(), scenario(heading, title, body, common.clone())));
        rest = others;
    }
    if scenarios.is_empty() {
        scenarios.push(("(empty)".into(), Err(Mistake::new(1, "no scenario; scenarios begin with '== title'"))));
    }
    scenarios
}

fn scenario(heading: &SourceLine, title: String, body: &[SourceLine], common: Settings) -> Result<Scenario, Mistake> {
    if title.is_empty() {
        return Err(Mistake::new(heading.number, "the scenario has no title; write '== title'"));
    }
    let (settings, steps) = settings(body, common)?;
    if steps.is_empty() {
        return Err(Mistake::new(heading.number, "the scenario has no steps"));
    }
    let cases = combinations(&settings.tables).into_iter().map(|parameters| case(&settings.world, steps, &parameters));
    Ok(Scenario { title, cases: cases.collect::<Result<_, _>>()? })
}

fn case(world: &[SourceLine], steps: &[SourceLine], parameters: &Parameters) -> Result<Case, Mistake> {
    let label = parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ");
    // Empty lines in place of what comes before keep the line numbers of the TOML parser's messages right.
    let (first, mut toml) = (world.first().map_or(1, |line| line.number), String::new());
    for line in world {
        while toml.lines().count() + 1 < line.number {
            toml.push('\n');
        }
        toml.push_str(substitute(&line.text, parameters).trim_start());
        toml.push('\n');
    }
    let world = WorldConfig::parse(&toml).map_err(|message| Mistake::new(first, format!("world: {message}")))?;
    let mut names: Vec<String> = Vec::new();
    let mut parsed = Vec::new();
    for source in steps {
        let source = SourceLine { number: source.number, text: substitute(&source.text, parameters) };
        let step = line::parse(&source.text, &names).map_err(|message| Mistake::new(source.number, message))?;
        if let Step::Let { name, .. } = &step {
            if parameters.contains_key(name) {
                return Err(Mistake::new(source.number, format!("'{name}' is a parameter already")));
            }
            names.push(name.clone());
        }
        parsed.push((source, step));
    }
    Ok(Case { label, world, steps: parsed })
}

/// Takes `world:` and `for` from the front of `lines`; a world replaces the common one, tables are added.
fn settings(lines: &[SourceLine], common: Settings) -> Result<(Settings, &[SourceLine]), Mistake> {
    let mut settings = common;
    let mut rest = lines;
    while let [line, after @ ..] = rest {
        let indented = |line: &SourceLine| line.text.starts_with([' ', '\t']);
        let block = after.iter().take_while(|line| indented(line)).count();
        let (block, others) = after.split_at(block);
        if indented(line) {
            return Err(Mistake::new(
                line.number,
                "an indented line that belongs neither to 'world:' nor to 'for ...:'",
            ));
        } else if line.text == "world:" {
            settings.world = block.to_vec();
            rest = others;
        } else if let Some(table) = line.text.strip_prefix("for ") {
            settings.tables.push(table_of(line.number, table, block)?);
            rest = others;
        } else {
            break;
        }
    }
    if let Some(late) = rest.iter().find(|line| line.text == "world:" || line.text.starts_with("for ")) {
        return Err(Mistake::new(late.number, "'world:' and 'for' come before the steps"));
    }
    if let Some(stray) = rest.iter().find(|line| line.text.starts_with([' ', '\t'])) {
        return Err(Mistake::new(stray.number, "steps are not indented"));
    }
    Ok((settings, rest))
}

/// `for name = value, value ...`, or `for name name ...:` with a row of values for each case below it.
fn table_of(number: usize, text: &str, rows: &[SourceLine]) -> Result<Vec<Parameters>, Mistake> {
    if let Some((name, values)) = text.split_once('=') {
        if let Some(row) = rows.first() {
            return Err(Mistake::new(row.number, "steps are not indented"));
        }
        let values = values.split(',').map(str::trim);
        return values.map(|value| row(number, &[name.trim()], &[value])).collect();
    }
    let Some(names) = text.strip_suffix(':') else {
        return Err(Mistake::new(number, "usage: for NAME = VALUE, VALUE ... or for NAME NAME ...: and rows below"));
    };
    let names: Vec<&str> = names.split_whitespace().collect();
    if rows.is_empty() {
        return Err(Mistake::new(number, "the table has no rows; they are indented"));
    }
    rows.iter().map(|line| row(line.number, &names, &line.text.split_whitespace().collect::<Vec<_>>())).collect()
}

fn row(number: usize, names: &[&str], values: &[&str]) -> Result<Parameters, Mistake> {
    if names.is_empty() || names.len() != values.len() {
        return Err(Mistake::new(number, format!("{} values for {} names", values.len(), names.len())));
    }
    for name in names {
        let word = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(line::in_word);
        if !word {
            return Err(Mistake::new(number, format!("'{name}' is not a name")));
        }
    }
    if values.contains(&"") {
        return Err(Mistake::new(number, "a value is missing"));
    }
    Ok(names.iter().map(ToString::to_string).zip(values.iter().map(ToString::to_string)).collect())
}

/// Every row of each table with every row of the others.
fn combinations(tables: &[Vec<Parameters>]) -> Vec<Parameters> {
    tables.iter().fold(vec![Parameters::new()], |so_far, table| {
        so_far.iter().flat_map(|left| table.iter().map(move |right| merged(left, right))).collect()
    })
}

fn merged(left: &Parameters, right: &Parameters) -> Parameters {
    left.iter().chain(right).map(|(name, value)| (name.clone(), value.clone())).collect()
}

/// Puts values in the place of `$name`; names that are no parameters stay.
fn substitute(text: &str, parameters: &Parameters) -> String {
    let mut result = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('$') {
        result.push_str(before);
        let (name, others) = after.split_at(after.find(|c| !line::in_word(c)).unwrap_or(after.len()));
        match parameters.get(name) {
            Some(value) => result.push_str(value),
            None => {
                result.push('$');
                result.push_str(name);
            }
        }
        rest = others;
    }
    result + rest
}

fn without_comment(line: &str) -> &str {
    line.split_once('#').map_or(line, |(text, _)| text).trim_end()
}
