//! Measures what grows: the functions of a trait, the fields of a type, and the lines of a function.

use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Ident, ItemStruct, ItemTrait, TraitItem};

/// A thing that can be too large.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Sized {
    pub(crate) file: PathBuf,
    pub(crate) name: String,
    pub(crate) size: usize,
}

/// The sizes of the things in a source file.
#[derive(Debug, Default)]
pub(crate) struct Sizes {
    file: PathBuf,
    /// Functions of each trait, provided ones among them.
    pub(crate) traits: Vec<Sized>,
    /// Fields of each structure.
    pub(crate) fields: Vec<Sized>,
    /// Lines of each function, from its first to its last brace.
    pub(crate) lines: Vec<Sized>,
}

impl Sizes {
    /// Those of a file with this text.
    pub(crate) fn of(file: &Path, text: &str) -> Self {
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

/// The functions of a source that is formatted as rustfmt does it: the last brace of a function has the column of its first
/// word.
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
