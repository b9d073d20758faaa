//! The large structure of a scenario file: scenarios with their settings and their steps.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use hal_sim::board::BoardKind;
use hal_sim::world::config::WorldConfig;

use super::condition::Vocabulary;
use super::program::{Assemble, Program};
use super::settings::{Parameters, Settings, World, substitute};
use super::step::Step;
use super::{Case, Mistake, Scenario, SourceLine, eeprom};
use crate::native::{FirmwareKind, Model, Product};

/// Facts that a file does not say by itself.
#[derive(Clone, Copy)]
pub struct Surroundings<'a> {
    /// The folder of the file, in which files that it names are looked for.
    pub folder: &'a Path,
    /// The product of scenarios that name none.
    pub product: Product,
    /// The firmware of scenarios that name none.
    pub firmware: FirmwareKind,
    /// The world of scenarios that have none, as the text of a world file.
    pub world: &'a str,
    /// The function that makes programs of the files that scenarios load.
    pub assemble: &'a Assemble<'a>,
}

/// Reads the text of a file. A scenario with a mistake does not keep the others from running.
pub fn read(text: &str, surroundings: &Surroundings<'_>) -> Vec<Scenario> {
    // An editor may have put a byte order mark before the text.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let lines: Vec<SourceLine> = (1..)
        .zip(text.lines())
        .map(|(number, text)| SourceLine { number, text: without_comment(text).to_string() })
        .filter(|line| !line.text.is_empty())
        .collect();
    let is_title = |line: &SourceLine| line.text.starts_with("==");
    let first = lines.iter().position(is_title).unwrap_or(lines.len());
    let (preamble, rest) = lines.split_at(first);
    let failed =
        |title: &str, mistake: Mistake| vec![Scenario { title: title.into(), line: mistake.line, cases: Err(mistake) }];
    let common = match Settings::read(preamble, Settings::default()) {
        Ok((common, [])) => common,
        Ok((_, [line, ..])) => {
            let message = "a step before the first scenario; scenarios begin with '== title'";
            return failed("(preamble)", Mistake::new(line.number, message));
        }
        Err(mistake) => return failed("(preamble)", mistake),
    };
    let reader = Reader { surroundings, programs: RefCell::default() };
    let mut scenarios = Vec::new();
    let mut rest = rest;
    while let [heading, after @ ..] = rest {
        let (body, others) = after.split_at(after.iter().position(is_title).unwrap_or(after.len()));
        let title = heading.text.trim_matches('=').trim().to_string();
        let cases = reader.cases(heading, &title, body, common.clone());
        scenarios.push(Scenario { title, line: heading.number, cases });
        rest = others;
    }
    if scenarios.is_empty() {
        return failed("(empty)", Mistake::new(1, "no scenario; scenarios begin with '== title'"));
    }
    scenarios
}

/// The line that a message about a world speaks of.
fn line_in(message: &str) -> Option<usize> {
    let (_, behind) = message.split_once("line ")?;
    behind.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

fn without_comment(line: &str) -> &str {
    line.split_once('#').map_or(line, |(text, _)| text).trim_end()
}

/// The label that tells a case from the others of its scenario.
fn label(parameters: &Parameters) -> String {
    parameters.iter().map(|(name, value)| format!("{name} = {value}")).collect::<Vec<_>>().join(", ")
}

/// The name of a program's file, and that of the product that it is for.
type Wanted = (String, &'static str);

/// Reads the scenarios of one file.
struct Reader<'a> {
    surroundings: &'a Surroundings<'a>,
    /// The programs that have been assembled, so that each is once and not for each row of a table.
    programs: RefCell<HashMap<Wanted, Result<Arc<Program>, String>>>,
}

impl Reader<'_> {
    fn cases(
        &self,
        heading: &SourceLine,
        title: &str,
        body: &[SourceLine],
        common: Settings,
    ) -> Result<Vec<Case>, Mistake> {
        if title.is_empty() {
            return Err(Mistake::new(heading.number, "the scenario has no title; write '== title'"));
        }
        let (settings, steps) = Settings::read(body, common)?;
        if steps.is_empty() {
            return Err(Mistake::new(heading.number, "the scenario has no steps"));
        }
        let combinations = settings.combinations().map_err(|message| Mistake::new(heading.number, message))?;
        let case = |parameters| self.case(heading, &settings, steps, parameters);
        let mut cases = Vec::new();
        for (parameters, result) in combinations.iter().map(|parameters| (parameters, case(parameters))) {
            match result {
                Ok(case) => cases.push(case),
                // Where others have the same mistake, it is none of this row.
                Err(mistake) if combinations.iter().all(|parameters| case(parameters).is_err()) => return Err(mistake),
                Err(Mistake { line, message }) => {
                    return Err(Mistake { line, message: format!("{message} (case: {})", label(parameters)) });
                }
            }
        }
        Ok(cases)
    }

    fn case(
        &self,
        heading: &SourceLine,
        settings: &Settings,
        steps: &[SourceLine],
        parameters: &Parameters,
    ) -> Result<Case, Mistake> {
        let model = self.model(heading, settings, parameters)?;
        let kind = model.product().kind();
        let world = self.world(heading, settings, parameters, kind)?;
        let eeprom = settings.eeprom.as_deref().map(|lines| eeprom::of_lines(lines, kind.eeprom.size)).transpose()?;
        let mut names: Vec<String> = Vec::new();
        let mut program: Option<Arc<Program>> = None;
        let mut parsed = Vec::new();
        for source in steps {
            let source = SourceLine { number: source.number, text: substitute(&source.text, parameters) };
            let vocabulary = Vocabulary { kind, names: &names, program: program.as_deref() };
            let load = |name: &str| self.program(name, model);
            let step =
                Step::parse(&source.text, vocabulary, load).map_err(|message| Mistake::new(source.number, message))?;
            if let Step::Let { name, .. } = &step {
                if parameters.contains_key(name) {
                    return Err(Mistake::new(source.number, format!("'{name}' is a parameter already")));
                }
                names.push(name.clone());
            }
            if let Step::Load(loaded) = &step {
                program = Some(Arc::clone(loaded));
            }
            parsed.push((source, step));
        }
        let not_on_image = settings.not_on_image.clone();
        Ok(Case { label: label(parameters), model, world, not_on_image, eeprom, steps: parsed })
    }

    fn model(&self, heading: &SourceLine, settings: &Settings, parameters: &Parameters) -> Result<Model, Mistake> {
        let mut line = heading.number;
        let mut named = |setting: &Option<SourceLine>| {
            setting.as_ref().map(|setting| {
                line = setting.number;
                (setting.number, substitute(&setting.text, parameters))
            })
        };
        let product = match named(&settings.product) {
            None => self.surroundings.product,
            Some((number, name)) => Product::named(&name).ok_or_else(|| {
                let names = Product::ALL.map(Product::name).join(", ");
                Mistake::new(number, format!("'{name}' is no product; there are: {names}"))
            })?,
        };
        let firmware = match named(&settings.firmware) {
            None => self.surroundings.firmware,
            Some((number, name)) => FirmwareKind::named(&name)
                .ok_or_else(|| Mistake::new(number, format!("'{name}' is no firmware; there are: tmcl, canopen")))?,
        };
        Model::of(product, firmware).map_err(|message| Mistake::new(line, message))
    }

    fn world(
        &self,
        heading: &SourceLine,
        settings: &Settings,
        parameters: &Parameters,
        kind: &'static BoardKind,
    ) -> Result<WorldConfig, Mistake> {
        let (line, place, text) = match &settings.world {
            None => (heading.number, String::new(), self.surroundings.world.to_string()),
            Some(World::File(file)) => {
                let name = substitute(&file.text, parameters);
                let text = std::fs::read_to_string(self.surroundings.folder.join(&name));
                let text = text.map_err(|error| Mistake::new(file.number, format!("world: {name}: {error}")))?;
                (file.number, format!("{name}: "), text)
            }
            Some(World::Lines(lines)) => {
                // Empty lines in place of what comes before keep the line numbers of the TOML parser's messages right.
                let mut toml = String::new();
                for line in lines {
                    while toml.lines().count() + 1 < line.number {
                        toml.push('\n');
                    }
                    toml.push_str(substitute(&line.text, parameters).trim_start());
                    toml.push('\n');
                }
                (lines.first().map_or(1, |line| line.number), String::new(), toml)
            }
        };
        WorldConfig::parse_for(kind, &text).map_err(|message| {
            let told = line_in(&message).filter(|_| matches!(settings.world, Some(World::Lines(_))));
            Mistake::new(told.unwrap_or(line), format!("world: {place}{}", message.trim_end()))
        })
    }

    /// The program in a file for a module.
    fn program(&self, name: &str, model: Model) -> Result<Arc<Program>, String> {
        if model.firmware() != FirmwareKind::Tmcl {
            return Err("load: this firmware executes no TMCL programs".into());
        }
        let product = model.product();
        let assemble = || (self.surroundings.assemble)(&self.surroundings.folder.join(name), product).map(Arc::new);
        self.programs.borrow_mut().entry((name.into(), product.name())).or_insert_with(assemble).clone()
    }
}
