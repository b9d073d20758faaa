//! Measures what grows: the functions of a trait, the fields of a type, and the lines of a function.

use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Ident, ItemStruct, ItemTrait, TraitItem};

use crate::{root, sources};

/// The most functions that a trait of the firmware may have.
const MOST_FUNCTIONS: usize = 20;
/// The most lines that a function of the firmware may have.
const MOST_LINES: usize = 100;
/// The most fields that an axis may have, and what it is made of.
const MOST_FIELDS: usize = 14;
/// Types that may have more: a search is data that is worked out once.
const DATA: [&str; 1] = ["Search"];
#[test]
fn traits_functions_and_axes_are_small() {
    let files = sources(&root().join("src"));
    let sizes: Vec<_> = files.iter().map(|file| Sizes::of(file, &fs::read_to_string(file).unwrap())).collect();
    let motion = root().join("src/motion");
    let of_axes = |thing: &&Sized| thing.file.starts_with(&motion) && !DATA.contains(&thing.name.as_str());
    let checked = [
        ("functions", MOST_FUNCTIONS, sizes.iter().flat_map(|sizes| &sizes.traits).collect::<Vec<_>>()),
        ("lines", MOST_LINES, sizes.iter().flat_map(|sizes| &sizes.lines).collect()),
        ("fields", MOST_FIELDS, sizes.iter().flat_map(|sizes| &sizes.fields).filter(of_axes).collect()),
    ];
    for (what, most, things) in checked {
        assert!(things.len() > 10, "{} with {what}", things.len());
        let large: Vec<_> = things.into_iter().filter(|thing| thing.size > most).collect();
        assert!(large.is_empty(), "more than {most} {what}: {large:#?}");
    }
}

/// A thing that can be too large.
#[derive(Debug, PartialEq, Eq)]
struct Sized {
    file: PathBuf,
    name: String,
    size: usize,
}

/// The sizes of the things in a source file.
#[derive(Debug, Default)]
struct Sizes {
    file: PathBuf,
    /// Functions of each trait, provided ones among them.
    traits: Vec<Sized>,
    /// Fields of each structure.
    fields: Vec<Sized>,
    /// Lines of each function, from its first to its last brace.
    lines: Vec<Sized>,
}

impl Sizes {
    /// Takes the sizes of a file with this text.
    fn of(file: &Path, text: &str) -> Self {
        let mut sizes = Sizes { file: file.to_path_buf(), ..Sizes::default() };
        sizes.visit_file(&syn::parse_file(text).unwrap());
        let thing = |(name, size): (&str, usize)| Sized { file: file.to_path_buf(), name: name.into(), size };
        sizes.lines = functions(text).into_iter().map(thing).collect();
        sizes
    }

    fn thing(&self, name: &Ident, size: usize) -> Sized {
        Sized { file: self.file.clone(), name: name.to_string(), size }
    }
}

impl Visit<'_> for Sizes {
    fn visit_item_trait(&mut self, item: &ItemTrait) {
        let functions = item.items.iter().filter(|item| matches!(item, TraitItem::Fn(_))).count();
        self.traits.push(self.thing(&item.ident, functions));
        visit::visit_item_trait(self, item);
    }

    fn visit_item_struct(&mut self, item: &ItemStruct) {
        self.fields.push(self.thing(&item.ident, item.fields.len()));
    }
}

/// The functions of a source that is formatted as rustfmt does it: the last brace of a function has the column of its
/// first word.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<_> = text.lines().collect();
    let begun = |line: &str| line.split_whitespace().any(|word| word == "fn");
    let first = lines.iter().enumerate().filter(|(_, line)| begun(line) && !line.trim_start().starts_with("//"));
    first
        .filter_map(|(at, line)| {
            let indent = line.len() - line.trim_start().len();
            let ends = |line: &&str| line.len() == indent + 1 && line.ends_with('}');
            let length = if line.ends_with([';', '}']) { 1 } else { lines[at..].iter().position(ends)? + 1 };
            let name = line.split("fn ").nth(1)?.split(['(', '<']).next()?;
            Some((name, length))
        })
        .collect()
}

#[test]
fn functions_fields_and_lines_are_counted() {
    let text = "\
trait A {
    fn a();
    fn b() {
    }
    const C: u8;
}
struct B(u8, u8);
struct C {
    a: u8,
}
mod m {
    impl B {
        // fn no
        pub(super) const fn c<T>(
            &self,
        ) {
            if true {
            }
        }
    }
}
fn d() {}
";
    let sizes = Sizes::of(Path::new("x"), text);
    let told = |things: &[Sized]| things.iter().map(|thing| (thing.name.clone(), thing.size)).collect::<Vec<_>>();
    assert_eq!(told(&sizes.traits), [("A".into(), 2)]);
    assert_eq!(told(&sizes.fields), [("B".into(), 2), ("C".into(), 1)]);
    assert_eq!(told(&sizes.lines), [("a".into(), 1), ("b".into(), 2), ("c".into(), 6), ("d".into(), 1)]);
}
