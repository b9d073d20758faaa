//! Words that the Tab key completes: commands at the beginning of a line, names behind them.

use tmcl_tools::asm;
use tmcl_tools::product::Product;
use tmcl_tools::shell::WORDS;
use tmcm::tmcl::{Field, Instruction, Opcode};

use crate::terminal::editor::{Complete, begins, word};

/// The words that can be typed to a module of a product.
#[derive(Clone, Debug)]
pub(super) struct Words {
    names: Vec<String>,
}

impl Words {
    /// The words for a product; without one there are no names of parameters.
    pub(super) fn of(product: Option<Product>) -> Self {
        Words { names: asm::names(product).names().map(String::from).collect() }
    }

    /// The words that may stand behind the text `before`, which ends with a space or a comma, or is empty.
    fn candidates(&self, before: &str) -> Vec<&str> {
        let mut words = before.split_whitespace();
        let Some(first) = words.next() else {
            let mnemonics = Instruction::all().map(|instruction| instruction.mnemonic).filter(|name| !name.is_empty());
            return mnemonics.chain(WORDS.into_iter().filter(|word| *word != "axis")).collect();
        };
        let names = |beginning: &'static str| {
            let names = self.names.iter().map(String::as_str);
            names.filter(move |name| name.starts_with(beginning))
        };
        if first.eq_ignore_ascii_case("watch") {
            return names("AP").chain(["axis"]).collect();
        }
        if first.eq_ignore_ascii_case("jog") {
            return names("Motor").collect();
        }
        let Some(instruction) = Instruction::by_mnemonic(first) else { return Vec::new() };
        let operand = before.matches(',').count();
        match (instruction.operands().get(operand), instruction.opcode) {
            (Some(Field::Named(choices)), _) => choices.to_vec(),
            (Some(Field::Kind), Opcode::Gap | Opcode::Sap | Opcode::Aap | Opcode::Stap | Opcode::Rsap) => {
                names("AP").collect()
            }
            (Some(Field::Kind), Opcode::Ggp | Opcode::Sgp | Opcode::Agp | Opcode::Stgp | Opcode::Rsgp) => {
                names("GP").chain(names("TI_")).collect()
            }
            (Some(Field::Kind), Opcode::Ei | Opcode::Di | Opcode::Vect) => names("TI_").collect(),
            (Some(Field::Motor), _) => names("Motor").collect(),
            (Some(Field::Value), _) => names("").collect(),
            _ => Vec::new(),
        }
    }
}

impl Complete for Words {
    fn complete(&self, line: &str, position: usize) -> (usize, Vec<String>) {
        let (begin, before, typed) = word(line, position);
        let fitting = self.candidates(before).into_iter().filter(|name| begins(typed, name));
        (begin, fitting.map(String::from).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn complete(line: &str) -> (usize, Vec<String>) {
        Words::of(Some(Product::Tmcm3110)).complete(line, line.len())
    }

    #[test]
    fn commands_and_names_are_completed() {
        for (line, begin, expected) in [
            ("sta", 0, &["STAP"][..]),
            ("jo", 0, &["jog"]),
            ("gap apactualp", 4, &["APActualPosition"]),
            ("SGP GPSerialA", 4, &["GPSerialAddress"]),
            ("MVP ", 4, &["ABS", "REL", "COORD"]),
            ("MVP ABS, ", 9, &["Motor0", "Motor1", "Motor2"]),
            ("watch APActualS", 6, &["APActualSpeed"]),
            ("SAP 4, 0, 2*APMaxC", 12, &["APMaxCurrent"]),
            ("nonsense ", 9, &[]),
        ] {
            let (at, mut words) = complete(line);
            let mut expected: Vec<String> = expected.iter().map(|word| word.to_string()).collect();
            words.sort();
            expected.sort();
            assert_eq!((at, words), (begin, expected), "{line}");
        }
        assert!(complete("").1.len() > 20);
    }
}
