//! Settings that stand above the steps, for one scenario or for all of a file: product, firmware and world of the
//! module, and the tables of parameters.

use std::collections::BTreeMap;

use super::token::in_word;
use super::{Mistake, SourceLine};

/// A combination of parameters: name and value, as text.
pub(super) type Parameters = BTreeMap<String, String>;

/// The settings, with the lines that they stand in. Parameters have not been put into them yet.
#[derive(Clone, Debug, Default)]
pub(super) struct Settings {
    pub(super) product: Option<SourceLine>,
    pub(super) firmware: Option<SourceLine>,
    pub(super) world: Option<World>,
    pub(super) tables: Vec<Vec<Parameters>>,
    pub(super) not_on_image: Option<String>,
    /// The contents of the EEPROM, in lines.
    pub(super) eeprom: Option<Vec<SourceLine>>,
}

/// The world of a scenario.
#[derive(Clone, Debug)]
pub(super) enum World {
    /// The name of its file.
    File(SourceLine),
    /// The lines that describe it.
    Lines(Vec<SourceLine>),
}

/// The beginnings of settings.
pub(super) const HEADS: [&str; 6] = ["product:", "firmware:", "world:", "eeprom:", "not on the image:", "for "];
/// The settings that have lines below them.
const WITH_LINES: [&str; 2] = ["world:", "eeprom:"];

/// Most cases of a scenario. More are a mistake, such as a table for each bit of something.
const MOST_CASES: usize = 10_000;

impl Settings {
    /// Takes settings from the front of `lines`, and gives the lines behind them. They replace those in `common`, and
    /// tables those with a name in common.
    pub(super) fn read(lines: &[SourceLine], common: Settings) -> Result<(Settings, &[SourceLine]), Mistake> {
        let mut settings = Settings::default();
        let mut rest = lines;
        while let [line, after @ ..] = rest {
            if is_indented(line) {
                let message = "an indented line that belongs neither to 'world:' nor to 'for ...:'";
                return Err(Mistake::new(line.number, message));
            }
            let (block, others) = after.split_at(after.iter().take_while(|line| is_indented(line)).count());
            if !settings.take(line, block)? {
                break;
            }
            rest = others;
        }
        if let Some(late) = rest.iter().find(|line| HEADS.iter().any(|head| line.text.starts_with(head))) {
            return Err(Mistake::new(late.number, "product, firmware, 'world:' and 'for' come before the steps"));
        }
        match rest.iter().find(|line| is_indented(line)) {
            Some(stray) => Err(Mistake::new(stray.number, "steps are not indented")),
            None => Ok((settings.over(common), rest)),
        }
    }

    /// Merges settings: takes these, and where they say nothing those in `common`.
    fn over(self, common: Settings) -> Settings {
        let mut tables = common.tables;
        tables.retain(|table| !self.has_name_of(table));
        tables.extend(self.tables);
        Settings {
            product: self.product.or(common.product),
            firmware: self.firmware.or(common.firmware),
            world: self.world.or(common.world),
            not_on_image: self.not_on_image.or(common.not_on_image),
            eeprom: self.eeprom.or(common.eeprom),
            tables,
        }
    }

    /// True if one of these tables has a name that this table has, too. All rows of a table have the same names.
    fn has_name_of(&self, table: &[Parameters]) -> bool {
        let names = |table: &[Parameters]| table.first().cloned().unwrap_or_default();
        let wanted = names(table);
        self.tables.iter().any(|own| names(own).keys().any(|name| wanted.contains_key(name)))
    }

    /// Takes a setting and the lines below it; false if the line is none.
    fn take(&mut self, line: &SourceLine, block: &[SourceLine]) -> Result<bool, Mistake> {
        let Some(head) = HEADS.iter().find(|head| line.text.starts_with(*head)) else { return Ok(false) };
        let value = SourceLine { number: line.number, text: line.text.trim_start_matches(head).trim().into() };
        let takes_block = *head == "for " || WITH_LINES.contains(head) && value.text.is_empty();
        if let Some(stray) = block.first().filter(|_| !takes_block) {
            return Err(Mistake::new(stray.number, format!("nothing stands below '{}'", line.text)));
        }
        if value.text.is_empty() && !WITH_LINES.contains(head) {
            return Err(Mistake::new(line.number, format!("something is missing behind '{head}'")));
        }
        let is_second = match *head {
            "product:" => self.product.is_some(),
            "firmware:" => self.firmware.is_some(),
            "not on the image:" => self.not_on_image.is_some(),
            "world:" => self.world.is_some(),
            "eeprom:" => self.eeprom.is_some(),
            _ => false,
        };
        if is_second {
            return Err(Mistake::new(line.number, format!("a second '{head}'")));
        }
        match *head {
            "product:" => self.product = Some(value),
            "firmware:" => self.firmware = Some(value),
            "not on the image:" => self.not_on_image = Some(value.text),
            "world:" if value.text.is_empty() => self.world = Some(World::Lines(block.to_vec())),
            "world:" => self.world = Some(World::File(value)),
            "eeprom:" if value.text.is_empty() => self.eeprom = Some(block.to_vec()),
            "eeprom:" => {
                return Err(Mistake::new(line.number, "the contents stand in the lines below 'eeprom:'"));
            }
            _ => {
                let table = table_of(&value, block)?;
                if self.has_name_of(&table) {
                    return Err(Mistake::new(line.number, "a second table with the same name"));
                }
                self.tables.push(table);
            }
        }
        Ok(true)
    }

    /// Every row of each table with every row of the others.
    ///
    /// # Errors
    /// They are too many: the message says how many.
    pub(super) fn combinations(&self) -> Result<Vec<Parameters>, String> {
        let count = self.tables.iter().fold(1, |count: usize, table| count.saturating_mul(table.len()));
        if count > MOST_CASES {
            return Err(format!("the tables make {count} cases; a scenario has {MOST_CASES} at most"));
        }
        let combinations = self.tables.iter().fold(vec![Parameters::new()], |so_far, table| {
            so_far.iter().flat_map(|left| table.iter().map(move |right| merged(left, right))).collect()
        });
        Ok(combinations)
    }
}

fn is_indented(line: &SourceLine) -> bool {
    line.text.starts_with([' ', '\t'])
}

fn merged(left: &Parameters, right: &Parameters) -> Parameters {
    left.iter().chain(right).map(|(name, value)| (name.clone(), value.clone())).collect()
}

/// `name = value, value ...`, or `name name ...:` with a row of values for each case below it.
fn table_of(SourceLine { number, text }: &SourceLine, rows: &[SourceLine]) -> Result<Vec<Parameters>, Mistake> {
    if let Some((name, values)) = text.split_once('=') {
        if let Some(row) = rows.first() {
            return Err(Mistake::new(row.number, "steps are not indented"));
        }
        let values = values.split(',').map(str::trim);
        return values.map(|value| row(*number, &[name.trim()], &[value])).collect();
    }
    let Some(names) = text.strip_suffix(':') else {
        return Err(Mistake::new(*number, "usage: for NAME = VALUE, VALUE ... or for NAME NAME ...: and rows below"));
    };
    let names: Vec<&str> = names.split_whitespace().collect();
    if rows.is_empty() {
        return Err(Mistake::new(*number, "the table has no rows; they are indented"));
    }
    rows.iter().map(|line| row(line.number, &names, &line.text.split_whitespace().collect::<Vec<_>>())).collect()
}

fn row(number: usize, names: &[&str], values: &[&str]) -> Result<Parameters, Mistake> {
    if names.is_empty() || names.len() != values.len() {
        return Err(Mistake::new(number, format!("{} values for {} names", values.len(), names.len())));
    }
    for name in names {
        let word = name.starts_with(|c: char| c.is_ascii_alphabetic()) && name.chars().all(in_word);
        if !word {
            return Err(Mistake::new(number, format!("'{name}' is not a name")));
        }
    }
    if values.contains(&"") {
        return Err(Mistake::new(number, "a value is missing"));
    }
    Ok(names.iter().map(ToString::to_string).zip(values.iter().map(ToString::to_string)).collect())
}

/// Puts values in the place of `$name`; names that are no parameters stay.
pub(super) fn substitute(text: &str, parameters: &Parameters) -> String {
    let mut result = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once('$') {
        result.push_str(before);
        let (name, others) = after.split_at(after.find(|c| !in_word(c)).unwrap_or(after.len()));
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
