//! Names for addresses in the image: from its symbols and its debug information.

use std::cell::RefCell;
use std::collections::HashMap;
use std::rc::Rc;

use addr2line::gimli::{Dwarf, EndianSlice, LittleEndian};
use addr2line::{Context, demangle_auto};
use object::{Object, ObjectSection, ObjectSymbol, SymbolKind};

use super::host::Failure;

type Slice<'e> = EndianSlice<'e, LittleEndian>;

/// The functions of an image.
pub(crate) struct Symbols<'e> {
    context: Context<Slice<'e>>,
    /// First address and name of each function that has code of its own, in the order of addresses.
    functions: Vec<(u32, Rc<str>)>,
    inlined: RefCell<HashMap<u32, Rc<str>>>,
}

impl<'e> Symbols<'e> {
    /// Reads the image `elf`.
    pub(crate) fn read(elf: &'e [u8]) -> Result<Self, Failure> {
        let file = object::File::parse(elf)?;
        let mut functions: Vec<(u32, Rc<str>)> = file
            .symbols()
            .filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0)
            .filter_map(|symbol| Some((symbol.address() as u32 & !1, short(symbol.name().ok()?).into())))
            .collect();
        functions.sort();
        functions.dedup_by_key(|(start, _)| *start);
        let section = |id: addr2line::gimli::SectionId| {
            let data = file.section_by_name(id.name()).map_or(Ok(&[][..]), |section| section.data())?;
            Ok::<_, object::Error>(Slice::new(data, LittleEndian))
        };
        let context = Context::from_dwarf(Dwarf::load(section)?)?;
        Ok(Self { context, functions, inlined: RefCell::default() })
    }

    /// First address and name of the function whose code `pc` is in.
    pub(crate) fn function(&self, pc: u32) -> (u32, Rc<str>) {
        let after = self.functions.partition_point(|(start, _)| *start <= pc);
        after.checked_sub(1).and_then(|index| self.functions.get(index)).cloned().unwrap_or((pc, "?".into()))
    }

    /// Name of the function that the source has at `pc`; it may be part of the code of another one.
    pub(crate) fn inlined(&self, pc: u32) -> Rc<str> {
        self.inlined.borrow_mut().entry(pc).or_insert_with(|| self.innermost(pc)).clone()
    }

    /// Whether `pc` is in a function of the source whose name ends so, or in what is part of its code there.
    pub(crate) fn is_in(&self, pc: u32, names: &[&str]) -> bool {
        let Ok(mut frames) = self.context.find_frames(pc.into()).skip_all_loads() else { return false };
        while let Ok(Some(frame)) = frames.next() {
            let name = frame.function.and_then(|function| Some(short(&function.raw_name().ok()?)));
            if name.is_some_and(|name| names.iter().any(|wanted| name.ends_with(wanted))) {
                return true;
            }
        }
        false
    }

    fn innermost(&self, pc: u32) -> Rc<str> {
        let frames = self.context.find_frames(pc.into()).skip_all_loads();
        let frame = frames.ok().and_then(|mut frames| frames.next().ok().flatten());
        let name = frame.and_then(|frame| Some(short(&frame.function?.raw_name().ok()?).into()));
        name.unwrap_or_else(|| self.function(pc).1)
    }
}

/// A mangled name as people read it: without hash and type parameters.
fn short(name: &str) -> String {
    let name = demangle_auto(name.into(), None);
    let mut text = String::new();
    let mut depth = 0_u32;
    // `<T as Trait>::name` begins with a bracket that is no list of parameters.
    let mut before = ':';
    for character in name.chars() {
        match character {
            '<' if depth > 0 || before.is_alphanumeric() || before == '_' => depth += 1,
            '>' if depth > 0 && before != '-' => depth -= 1,
            _ if depth > 0 => {}
            _ => text.push(character),
        }
        before = character;
    }
    match text.rsplit_once("::h") {
        Some((rest, hash)) if hash.len() == 16 && hash.chars().all(|digit| digit.is_ascii_hexdigit()) => rest.into(),
        _ => text,
    }
}
