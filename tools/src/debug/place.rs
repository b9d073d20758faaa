//! Places of the program: addresses, labels, expressions of them, and lines of the source.

use std::path::Path;

use tmcm_sim::suggest::suggestion;

use super::names::Names;
use crate::program::Program;

/// The address that the user has typed. `file` is the file of the program.
///
/// # Errors
/// A message for the user.
pub(super) fn address(text: &str, program: &Program, names: &Names, file: &Path) -> Result<u16, String> {
    let text = text.trim();
    let line = text.rsplit_once(':').and_then(|(file, number)| Some((file, number.trim().parse::<usize>().ok()?)));
    if let Some((named, number)) = line {
        return address_of_line(named.trim(), number, program, file);
    }
    let value = names.value(text).map_err(|message| {
        let is_word = text.chars().all(|c| c.is_alphanumeric() || c == '_');
        let labels = program.labels.iter().map(|(name, _)| name.as_str());
        match is_word && !text.starts_with(|c: char| c.is_ascii_digit()) {
            true => format!("'{text}' is neither an address nor a label of the program{}", suggestion(text, labels)),
            false => message,
        }
    })?;
    match u16::try_from(value) {
        Ok(address) if usize::from(address) < program.commands.len() => Ok(address),
        Ok(_) => Err(format!("the program ends before address {value}")),
        Err(_) => Err(format!("{value} is no address; they begin with 0")),
    }
}

/// The address of the first command in a line of the source or below it.
fn address_of_line(named: &str, wanted: usize, program: &Program, file: &Path) -> Result<u16, String> {
    let is_main = named.is_empty() || is_named(file, named);
    let commands = (0..=u16::MAX).take(program.commands.len());
    let lines = commands.filter_map(|address| Some((program.line(address)?, address)));
    // The lines of the main file have a number alone, those of other files have the name before it.
    let of_file = lines.filter_map(|(line, address)| {
        let (name, number) = line.place();
        let wanted = name.map_or(is_main, |name| !named.is_empty() && is_named(Path::new(name), named));
        wanted.then_some((number, address))
    });
    let of_file: Vec<(usize, u16)> = of_file.collect();
    if of_file.is_empty() {
        return Err(match program.labels.is_empty() && program.line(0).is_none() {
            true => "there is no source of this program; lines are known of programs that are loaded as source".into(),
            false => format!("no command of the program is in a file '{named}'"),
        });
    }
    let below = of_file.into_iter().filter(|(number, _)| *number >= wanted).min();
    below.map(|(_, address)| address).ok_or_else(|| format!("no command follows in line {wanted} or below"))
}

/// True if a path is this one, or ends in it.
fn is_named(path: &Path, named: &str) -> bool {
    path.ends_with(named)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::asm::assemble_file;
    use crate::product::Product;
    use crate::sources::Texts;

    #[test]
    fn places_are_found() {
        let main = Path::new("folder/main.tmc");
        let files = [
            ("folder/other.tmc", "\nSub: CALC ADD, 1\nRSUB\n"),
            ("folder/main.tmc", "// comment\nStart: CSUB Sub\n\n// wait\nLoop:\n  JA Loop\n#include other.tmc\n"),
        ];
        let files = Texts(files.map(|(name, text)| (name.into(), text.into())).into());
        let product = Some(Product::Tmcm1140);
        let program = Program::from(assemble_file(&files, main, product).result.unwrap());
        let names = Names::of(&program, product);
        let at = |text| address(text, &program, &names, main);
        for (text, expected) in [
            ("0", 0),
            ("$2", 2),
            ("loop", 1),
            ("Loop + 1", 2),
            (":1", 0),
            (":2", 0),
            (":3", 1),
            ("main.tmc:6", 1),
            ("other.tmc:1", 2),
            ("other.tmc : 3", 3),
        ] {
            assert_eq!(at(text), Ok(expected), "{text}");
        }
        assert_eq!(at(":7"), Err("no command follows in line 7 or below".into()));
        assert_eq!(at("third.tmc:1"), Err("no command of the program is in a file 'third.tmc'".into()));
        let told = "'Loopp' is neither an address nor a label of the program; did you mean 'Loop'?";
        assert_eq!(at("Loopp"), Err(told.into()));
        assert_eq!(at("Loop + 9"), Err("the program ends before address 10".into()));
        assert_eq!(at("Loop - 2"), Err("-1 is no address; they begin with 0".into()));
        assert!(at("Loop +").unwrap_err().contains("a value is missing"));
        let bare = Program::from(program.commands.clone());
        let told = address(":1", &bare, &Names::default(), main).unwrap_err();
        assert!(told.contains("no source of this program"), "{told}");
    }
}
