//! Finds the types of a crate, the methods of each, and the calls of its own methods from file to file.
//!
//! A method is what an inherent `impl` has, with `self` or without, or a free function that takes the type by `&mut`:
//! that is the same in other clothes. A call is `self.method()`, or the same with any name that stands for `self`: a
//! parameter of this type, `let module = self`; `Self::method`; and the path of a method or of such a function. Types
//! are told apart by the paths of their definitions, which `imports.rs` finds.
//!
//! Not seen are test modules, methods of traits, what macros make, and a closure's parameter whose type is not written.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::punctuated::Punctuated;
use syn::visit::{self, Visit};
use syn::{Block, Expr, ExprMethodCall, ExprPath, FnArg, ImplItem, Item, Local, Macro, Pat, PatType, Token, Type};

use crate::circles::Imports;
use crate::imports::Crate;
use crate::tokens::tokens;

/// A type that has methods.
#[derive(Debug, Default)]
pub(crate) struct Owner {
    pub(crate) fields: usize,
    /// By their paths from the root of the crate. `impl`s for different parameters of the type may share names, in
    /// files of their own.
    pub(crate) methods: BTreeMap<Vec<String>, BTreeSet<PathBuf>>,
    /// The calls between files: from, to, and the names of the methods.
    pub(crate) calls: Imports,
}

impl Owner {
    /// The files in which the methods are.
    pub(crate) fn files(&self) -> BTreeSet<&Path> {
        self.methods.values().flatten().map(PathBuf::as_path).collect()
    }
}

/// A method, or a free function that counts as one.
struct Method<'a> {
    owner: Vec<String>,
    path: Vec<String>,
    place: Place,
    inputs: &'a Punctuated<FnArg, Token![,]>,
    block: &'a Block,
}

/// A module, and its file.
#[derive(Clone)]
struct Place {
    file: usize,
    module: Vec<String>,
}

/// A crate and what it defines.
struct Definitions {
    files: Crate,
    /// Types, each with the number of its fields.
    types: BTreeMap<Vec<String>, usize>,
    functions: BTreeSet<Vec<String>>,
}

/// The types with methods of the crate with this root file, by the paths of their definitions.
pub(crate) fn owners(root: &Path) -> BTreeMap<Vec<String>, Owner> {
    let files = Crate::read(root);
    let sources = sources(&files);
    let mut crate_ = Definitions { files, types: BTreeMap::new(), functions: BTreeSet::new() };
    for (place, item) in sources.iter().flat_map(|(place, source)| items(place, &source.items)) {
        crate_.define(&place, item);
    }
    let all = sources.iter().flat_map(|(place, source)| items(place, &source.items));
    let methods: Vec<_> = all.flat_map(|(place, item)| crate_.methods(&place, item)).collect();
    let file = |method: &Method| crate_.files.files[method.place.file].path.clone();

    let mut owners: BTreeMap<_, Owner> = BTreeMap::new();
    for method in &methods {
        let owner = owners.entry(method.owner.clone()).or_default();
        owner.fields = crate_.types[&method.owner];
        owner.methods.entry(method.path.clone()).or_default().insert(file(method));
    }
    for method in &methods {
        let Some(owner) = owners.get_mut(&method.owner) else { continue };
        for called in Calls::of(&crate_, method) {
            let (from, name) = (file(method), called.last().cloned().unwrap_or_default());
            for to in owner.methods.get(&called).into_iter().flatten().filter(|to| **to != from) {
                let names = owner.calls.entry(from.clone()).or_default().entry(to.clone()).or_default();
                if !names.split(", ").any(|other| other == name) {
                    *names = if names.is_empty() { name.clone() } else { format!("{names}, {name}") };
                }
            }
        }
    }
    owners
}

/// The files of a crate, but for test modules.
fn sources(files: &Crate) -> Vec<(Place, syn::File)> {
    let mut sources = Vec::new();
    let mut open = vec![0];
    while let Some(number) = open.pop() {
        let file = &files.files[number];
        let text = fs::read_to_string(&file.path).unwrap();
        let source = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", file.path.display()));
        let place = Place { file: number, module: file.module.clone() };
        for (_, item) in items(&place, &source.items) {
            if let Item::Mod(module) = item {
                open.extend(file.children.get(&module.ident.to_string()));
            }
        }
        sources.push((place, source));
    }
    sources
}

/// Items with their modules: those given, and those of inner modules that are no test modules.
fn items<'a>(place: &Place, all: &'a [Item]) -> Vec<(Place, &'a Item)> {
    let mut found = Vec::new();
    for item in all {
        if let Item::Mod(module) = item {
            if module.attrs.iter().any(|given| given.path().is_ident("cfg") && is_test(given)) {
                continue;
            }
            let inner = [&place.module[..], &[module.ident.to_string()]].concat();
            let content = module.content.iter().map(|(_, content)| content);
            let place = Place { module: inner, ..*place };
            found.extend(content.flat_map(|content| items(&place, content)));
        }
        found.push((place.clone(), item));
    }
    found
}

fn is_test(given: &syn::Attribute) -> bool {
    given.parse_args::<syn::Ident>().is_ok_and(|condition| condition == "test")
}

/// The path that a type is written as, without references; `None` for tuples and the like.
fn written(given: &Type) -> Option<Vec<String>> {
    match given {
        Type::Reference(reference) => written(&reference.elem),
        Type::Path(path) if path.qself.is_none() => Some(names(&path.path)),
        _ => None,
    }
}

fn names(path: &syn::Path) -> Vec<String> {
    path.segments.iter().map(|segment| segment.ident.to_string()).collect()
}

impl Definitions {
    /// Notes a type or a free function.
    fn define(&mut self, place: &Place, item: &Item) {
        let path = |name: &syn::Ident| [&place.module[..], &[name.to_string()]].concat();
        match item {
            Item::Struct(item) => _ = self.types.insert(path(&item.ident), item.fields.len()),
            Item::Enum(item) => _ = self.types.insert(path(&item.ident), 0),
            Item::Fn(item) => _ = self.functions.insert(path(&item.sig.ident)),
            _ => {}
        }
    }

    /// The methods that an item is, or has.
    fn methods<'a>(&self, place: &Place, item: &'a Item) -> Vec<Method<'a>> {
        let method =
            |owner: Vec<String>, path, inputs, block| Method { owner, path, place: place.clone(), inputs, block };
        match item {
            Item::Impl(item) if item.trait_.is_none() => {
                let Some(owner) = self.owner(place, &item.self_ty) else { return Vec::new() };
                let own = item.items.iter().filter_map(|item| match item {
                    ImplItem::Fn(own) => {
                        let path = [&owner[..], &[own.sig.ident.to_string()]].concat();
                        Some(method(owner.clone(), path, &own.sig.inputs, &own.block))
                    }
                    _ => None,
                });
                own.collect()
            }
            Item::Fn(item) => {
                let taken = item.sig.inputs.iter().filter_map(|input| match input {
                    FnArg::Typed(PatType { ty, .. }) => match &**ty {
                        Type::Reference(reference) if reference.mutability.is_some() => {
                            self.owner(place, &reference.elem)
                        }
                        _ => None,
                    },
                    FnArg::Receiver(_) => None,
                });
                let path = [&place.module[..], &[item.sig.ident.to_string()]].concat();
                taken.map(|owner| method(owner, path.clone(), &item.sig.inputs, &item.block)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// The path of the definition of a type of this crate.
    fn owner(&self, place: &Place, given: &Type) -> Option<Vec<String>> {
        self.definition(place, &written(given)?, 0).filter(|path| self.types.contains_key(path))
    }

    /// The path of the definition to which a path leads from a module: through what is imported there and handed on
    /// elsewhere, by name or as one of all. The path may go on behind a type, to a method.
    fn definition(&self, place: &Place, path: &[String], depth: usize) -> Option<Vec<String>> {
        let known = |path: &Vec<String>| {
            (1..=path.len()).any(|length| self.types.contains_key(&path[..length])) || self.functions.contains(path)
        };
        let here = [&place.module[..], path].concat();
        if known(&here) {
            return Some(here);
        }
        let absolute = self.files.absolute(place.file, &place.module, path);
        let followed = absolute.and_then(|absolute| self.files.defining(&absolute, 0));
        let (file, rest) = followed.unwrap_or_else(|| (place.file, path.to_vec()));
        let module = self.files.files[file].module.clone();
        let there = [&module[..], &rest].concat();
        if known(&there) {
            return Some(there);
        }
        let place = Place { file, module };
        let all = self.files.files[file].globs.iter().filter(|_| depth < 5);
        all.map(|all| [&all[..], &rest].concat()).find_map(|path| self.definition(&place, &path, depth + 1))
    }
}

/// Collects the calls in a method.
struct Calls<'a> {
    crate_: &'a Definitions,
    method: &'a Method<'a>,
    /// Names that stand for the owner.
    own: BTreeSet<String>,
    called: BTreeSet<Vec<String>>,
}

impl<'a> Calls<'a> {
    /// The paths that a method calls, among them those of its owner's methods.
    fn of(crate_: &'a Definitions, method: &'a Method<'a>) -> BTreeSet<Vec<String>> {
        let mut calls = Calls { crate_, method, own: BTreeSet::from(["self".into()]), called: BTreeSet::new() };
        method.inputs.iter().for_each(|input| calls.visit_fn_arg(input));
        calls.visit_block(method.block);
        calls.called
    }

    fn call(&mut self, name: String) {
        self.called.insert([&self.method.owner[..], &[name]].concat());
    }

    /// True for a name of the owner, also if it is borrowed anew.
    fn is_own(&self, given: &Expr) -> bool {
        match given {
            Expr::Path(path) => path.path.get_ident().is_some_and(|name| self.own.contains(&name.to_string())),
            Expr::Reference(inner) => self.is_own(&inner.expr),
            Expr::Unary(inner) => self.is_own(&inner.expr),
            Expr::Paren(inner) => self.is_own(&inner.expr),
            _ => false,
        }
    }

    /// A pattern stands for the owner from now on, if it is a name.
    fn bind(&mut self, pattern: &Pat) {
        if let Pat::Ident(name) = pattern {
            self.own.insert(name.ident.to_string());
        }
    }
}

impl<'a> Visit<'a> for Calls<'_> {
    fn visit_expr_method_call(&mut self, call: &'a ExprMethodCall) {
        if self.is_own(&call.receiver) {
            self.call(call.method.to_string());
        }
        visit::visit_expr_method_call(self, call);
    }

    fn visit_expr_path(&mut self, path: &'a ExprPath) {
        match &names(&path.path)[..] {
            [own, name] if own == "Self" => self.call(name.clone()),
            names => self.called.extend(self.crate_.definition(&self.method.place, names, 0)),
        }
    }

    fn visit_pat_type(&mut self, typed: &'a PatType) {
        let is_self = written(&typed.ty).is_some_and(|path| path == ["Self"]);
        if is_self || self.crate_.owner(&self.method.place, &typed.ty).as_ref() == Some(&self.method.owner) {
            self.bind(&typed.pat);
        }
        visit::visit_pat_type(self, typed);
    }

    fn visit_local(&mut self, local: &'a Local) {
        if local.init.as_ref().is_some_and(|value| self.is_own(&value.expr)) {
            self.bind(&local.pat);
        }
        visit::visit_local(self, local);
    }

    /// The tokens that a macro takes need not be Rust; but a call of `self` looks like Rust.
    fn visit_macro(&mut self, given: &'a Macro) {
        for four in tokens(&given.tokens.to_string()).windows(4) {
            match *four {
                [own, ".", name, "("] if self.own.contains(own) => self.call(name.into()),
                ["Self", ":", ":", name] => self.call(name.into()),
                _ => {}
            }
        }
    }
}
