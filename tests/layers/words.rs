//! Names and numbers that sources do not name, not even in comments.

use std::collections::BTreeSet;

use crate::files_of;

/// Modules that must not name a chip or a product: products are data.
const NAMELESS: [&str; 5] = ["tmcl", "device", "vm", "executor", "module"];
#[test]
fn what_holds_for_all_products_names_none() {
    let mut found = String::new();
    let mut checked = 0;
    for module in NAMELESS {
        for (path, text, _) in files_of(module) {
            for (number, line) in (1..).zip(text.lines()) {
                for name in names_of_products(line) {
                    found.push_str(&format!("{}:{number}: {name}\n", path.display()));
                }
            }
            checked += 1;
        }
    }
    assert!(found.is_empty(), "chips or products are named:\n{found}");
    assert!(checked > 30, "{checked} files");
}

/// The words of a line that name a chip (TMC and a number, AT25...), or a product by its name or number.
fn names_of_products(line: &str) -> Vec<&str> {
    const NUMBERS: [&str; 5] = ["1110", "1140", "3110", "3212", "6110"];
    let words = line.split(|c: char| !c.is_alphanumeric());
    let names = |word: &&str| {
        let word = word.to_lowercase();
        let chip = word.strip_prefix("tmc").is_some_and(|rest| rest.starts_with(|c: char| c == 'm' || c.is_numeric()));
        chip || word.starts_with("at25") || NUMBERS.iter().any(|number| word.contains(number))
    };
    words.filter(names).collect()
}

#[test]
fn names_of_products_are_recognised() {
    let all =
        names_of_products("TMCM-3212 of tmcm6110::AXIS, Tmc429 and AT25512; TMCL 1234 \"1140V142\" TMCM_1140 tmc");
    assert_eq!(all, ["TMCM", "3212", "tmcm6110", "Tmc429", "AT25512", "1140V142", "TMCM", "1140"]);
}

/// Modules that must not name a TMCL parameter by its number.
const NUMBERED: [&str; 2] = ["chip", "store"];
#[test]
fn drivers_and_store_name_no_parameter_by_its_number() {
    let mut found = BTreeSet::new();
    for module in NUMBERED {
        let files = files_of(module).into_iter();
        found.extend(files.filter(|(_, source, _)| !numbers_of_parameters(source).is_empty()).map(|(path, ..)| path));
    }
    assert!(found.is_empty(), "{found:?}");
}

/// The numbers of parameters that a text names: 81 for "parameter 81", 6 for "parameters 6 and 7".
fn numbers_of_parameters(text: &str) -> Vec<u32> {
    let mut words = text.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty()).peekable();
    let mut numbers = Vec::new();
    while let Some(word) = words.next() {
        if matches!(word.to_ascii_lowercase().as_str(), "parameter" | "parameters") {
            numbers.extend(words.peek().and_then(|number| number.parse::<u32>().ok()));
        }
    }
    numbers
}

#[test]
fn finds_numbers_of_parameters() {
    assert_eq!(numbers_of_parameters("// Parameter\n/// 81, and parameters 6 and 7;"), [81, 6]);
    assert!(numbers_of_parameters("from_parameter(40), a parameter, one of 5").is_empty());
}
