//! Finds which file of a crate imports which other file.
//!
//! A crate is read from its root by its `mod` lines, `#[path]` included. Paths are taken from the whole of a file: from
//! each `use`, and from anywhere in code, tests too. A path counts if it begins with `crate`, `super` or `self`, with a
//! child module, or with a name that a `use` of the file has brought in. It is followed to the file that *defines* the
//! named item, through modules, and through every re-export on the way. So `use super::Axis` leads to `axis.rs` also
//! where the parent says `pub use axis::Axis`. A name from `use x::*` counts if the file mentions the name.
//!
//! These do not count:
//! * `mod` lines, and re-exports (`pub use`, `pub(crate) use` ...) from the file's own children, unless the file's own
//!   code mentions the name;
//! * items that a file uses from its parent module's file, if the parent's file defines them itself: a child is a part
//!   of its parent.
//!
//! Calls of methods are not seen, because they name no file; names made by macros are not seen, either.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::tokens::tokens;

/// A path from the root of the crate; `None` for a path to another crate.
pub(crate) type Absolute = Option<Vec<String>>;

/// A file of a crate.
pub(crate) struct File {
    pub(crate) path: PathBuf,
    /// Path of the file's module from the root of the crate.
    pub(crate) module: Vec<String>,
    /// The modules that it declares, each with the number of its file.
    pub(crate) children: BTreeMap<String, usize>,
    /// Names that `use` lines bring in, each with its path.
    names: BTreeMap<String, Vec<String>>,
    /// Names in `names` that are re-exports of a child's items.
    handed_on: BTreeSet<String>,
    /// Modules whose names a `use x::*` brings in.
    pub(crate) globs: Vec<Vec<String>>,
    /// Paths in `use` lines and in code.
    paths: Vec<Vec<String>>,
    /// Words of the file outside `use` lines.
    words: BTreeSet<String>,
}

/// The files of a crate.
pub(crate) struct Crate {
    /// The root is the first.
    pub(crate) files: Vec<File>,
}

impl Crate {
    /// Reads the crate with this root file.
    pub(crate) fn read(root: &Path) -> Self {
        let mut found = Crate { files: Vec::new() };
        found.add(root, Vec::new(), true);
        found
    }

    /// Adds a file and all its children; returns the file's number. With `like_mod` the children lie beside the file,
    /// as with a `mod.rs`; otherwise in a folder with the file's name.
    fn add(&mut self, path: &Path, module: Vec<String>, like_mod: bool) -> usize {
        let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let tokens = tokens(&text);
        let number = self.files.len();
        let mut file = File::new(path.to_owned(), module.clone());
        file.scan(&tokens);
        self.files.push(file);
        let beside = path.parent().unwrap_or(Path::new(""));
        let folder = if like_mod { beside.to_owned() } else { path.with_extension("") };
        for (name, given) in children(&text, &tokens) {
            let candidates = match given {
                Some(given) => vec![(beside.join(given), true)],
                None => {
                    vec![(folder.join(&name).with_extension("rs"), false), (folder.join(&name).join("mod.rs"), true)]
                }
            };
            let Some((path, like_mod)) = candidates.into_iter().find(|(path, _)| path.is_file()) else { continue };
            let child = self.add(&path, [module.clone(), vec![name.clone()]].concat(), like_mod);
            self.files[number].children.insert(name, child);
        }
        number
    }

    /// The number of the file that defines the item at a path, and what is left of the path there.
    pub(crate) fn defining(&self, path: &[String], depth: usize) -> Option<(usize, Vec<String>)> {
        let mut file = 0;
        for (at, name) in path.iter().enumerate() {
            if let Some(child) = self.files[file].children.get(name) {
                file = *child;
                continue;
            }
            let Some(target) = self.files[file].names.get(name).filter(|_| depth < 20) else {
                return Some((file, path[at..].to_vec()));
            };
            let absolute = self.absolute(file, &self.files[file].module, target)?;
            return self.defining(&[&absolute, &path[at + 1..]].concat(), depth + 1);
        }
        Some((file, Vec::new()))
    }

    /// The path from the crate's root for a path as it is written in a module of a file.
    pub(crate) fn absolute(&self, file: usize, module: &[String], path: &[String]) -> Absolute {
        let File { module: own, children, names, .. } = &self.files[file];
        let (first, rest) = path.split_first()?;
        match first.as_str() {
            "crate" => Some(rest.to_vec()),
            "self" => Some([module, rest].concat()),
            "super" => {
                let up = path.iter().take_while(|name| *name == "super").count();
                Some([&module[..module.len().checked_sub(up)?], &path[up..]].concat())
            }
            name if children.contains_key(name) => Some([own, path].concat()),
            name => {
                // A name that stands for itself alone (`use x;`) is another crate; following the name would never end.
                let target = names.get(name).filter(|target| target.first() != Some(first) || target.len() > 1)?;
                if target == path {
                    return None;
                }
                self.absolute(file, own, &[target, rest].concat())
            }
        }
    }

    /// All imports of the crate: for each file the files that it imports, each with a name that it uses from there.
    pub(crate) fn imports(&self) -> BTreeMap<PathBuf, BTreeMap<PathBuf, String>> {
        let mut imports = BTreeMap::new();
        for (number, file) in self.files.iter().enumerate() {
            let own: &mut BTreeMap<_, _> = imports.entry(file.path.clone()).or_default();
            for path in self.used(number) {
                let Some((other, _)) = self.defining(&path, 0) else { continue };
                let parent = file.module.split_last().map(|(_, parent)| parent);
                if other != number && parent != Some(&self.files[other].module) {
                    own.entry(self.files[other].path.clone()).or_insert_with(|| path.join("::"));
                }
            }
        }
        imports
    }

    /// The paths, from the root of the crate, of all items that a file uses.
    fn used(&self, number: usize) -> Vec<Vec<String>> {
        let file = &self.files[number];
        let mut used: Vec<_> = file.paths.iter().filter_map(|path| self.absolute(number, &file.module, path)).collect();
        for (name, target) in &file.names {
            if !file.handed_on.contains(name) || file.words.contains(name) {
                used.extend(self.absolute(number, &file.module, target));
            }
        }
        for glob in file.globs.iter().filter_map(|path| self.absolute(number, &file.module, path)) {
            if let Some((other, _)) = self.defining(&glob, 0) {
                let names = self.files[other].names.keys().filter(|name| file.words.contains(*name));
                used.extend(names.map(|name| [&self.files[other].module[..], std::slice::from_ref(name)].concat()));
            }
            used.push(glob);
        }
        used
    }
}

impl File {
    fn new(path: PathBuf, module: Vec<String>) -> Self {
        File {
            path,
            module,
            children: BTreeMap::new(),
            names: BTreeMap::new(),
            handed_on: BTreeSet::new(),
            globs: Vec::new(),
            paths: Vec::new(),
            words: BTreeSet::new(),
        }
    }

    /// Collects the names, paths and words of the file.
    fn scan(&mut self, tokens: &[&str]) {
        // For each open brace the name of the inner module to which it belongs, if any.
        let mut open: Vec<Option<String>> = Vec::new();
        let mut at = 0;
        while at < tokens.len() {
            let inner = open.iter().flatten().count();
            at += match &tokens[at..] {
                ["mod", name, "{", ..] => {
                    open.push(Some((*name).to_owned()));
                    3
                }
                ["{", ..] => {
                    open.push(None);
                    1
                }
                ["}", ..] => {
                    open.pop();
                    1
                }
                ["use", rest @ ..] if at == 0 || tokens[at - 1] != "+" => {
                    let visible = at > 0 && matches!(tokens[at - 1], "pub" | ")");
                    let mut leaves = Vec::new();
                    let length = tree(rest, &mut Vec::new(), &mut leaves);
                    for leaf in leaves {
                        self.bring(leaf, inner, visible);
                    }
                    1 + length
                }
                [first, ":", ":", ..] if is_name(first) && !tokens[..at].ends_with(&[":", ":"]) => {
                    let names = tokens[at..].chunks(3).take_while(|chunk| is_name(chunk[0]));
                    let mut path = Vec::new();
                    for chunk in names {
                        path.push(chunk[0].to_owned());
                        if chunk.get(1..) != Some(&[":", ":"]) {
                            break;
                        }
                    }
                    let length = 3 * path.len() - 2;
                    self.words.extend(path.iter().cloned());
                    self.use_path(path, inner);
                    length
                }
                [word, ..] => {
                    self.words.insert((*word).to_owned());
                    1
                }
                [] => 1,
            };
        }
    }

    /// Adds a path of a module that lies `inner` levels inside the file: so many `super` at its beginning lead to the
    /// file itself and are removed.
    fn use_path(&mut self, path: Vec<String>, inner: usize) {
        let up = path.iter().take_while(|name| *name == "super").count();
        if up == 0 && inner > 0 && path[0] == "self" || up > 0 && up <= inner {
            return;
        }
        self.paths.push(if up > inner { path[inner..].to_vec() } else { path });
    }

    /// Adds a path of a `use` line and the name that it brings in; `None` stands for `*`.
    fn bring(&mut self, (mut path, name): (Vec<String>, Option<String>), inner: usize, visible: bool) {
        let up = path.iter().take_while(|name| *name == "super").count();
        if up > 0 && up <= inner {
            return;
        }
        path.drain(..inner.min(up));
        match name {
            None => self.globs.push(path),
            // Names that an inner module brings in are not names of the file.
            Some(_) if inner > 0 => self.paths.push(path),
            Some(name) => {
                let outside = matches!(path[0].as_str(), "crate" | "super");
                if visible && !outside {
                    self.handed_on.insert(name.clone());
                }
                self.names.insert(name, path);
            }
        }
    }
}

fn is_name(token: &str) -> bool {
    token.starts_with(|c: char| c.is_alphabetic() || c == '_')
}

/// Adds the paths of a `use` tree to `leaves`, each with the name that it brings in (`None` for `*`), and returns the
/// tree's length in tokens.
fn tree(tokens: &[&str], front: &mut Vec<String>, leaves: &mut Vec<(Vec<String>, Option<String>)>) -> usize {
    let (mut at, before) = (0, front.len());
    loop {
        match &tokens[at..] {
            [":", ":", ..] => at += 2,
            ["{", ..] => {
                at += 1;
                while !matches!(tokens.get(at), Some(&"}") | None) {
                    at += tree(&tokens[at..], front, leaves);
                    at += usize::from(tokens.get(at) == Some(&","));
                }
                at += 1;
            }
            ["*", ..] => {
                leaves.push((front.clone(), None));
                at += 1;
            }
            [name, "as", alias, ..] => {
                leaves.push(([&front[..], &[(*name).to_owned()]].concat(), Some((*alias).to_owned())));
                at += 3;
            }
            ["self", "," | "}" | ";", ..] if !front.is_empty() => {
                leaves.push((front.clone(), front.last().cloned()));
                at += 1;
            }
            [name, ":", ":", ..] => {
                front.push((*name).to_owned());
                at += 3;
            }
            [";" | "," | "}", ..] | [] => break,
            [name, ..] => {
                leaves.push(([&front[..], &[(*name).to_owned()]].concat(), Some((*name).to_owned())));
                at += 1;
            }
        }
    }
    front.truncate(before);
    at
}

/// The modules that a file declares, each with its `#[path]` if it has one.
fn children(text: &str, tokens: &[&str]) -> Vec<(String, Option<String>)> {
    let mut given = text.split("#[path = \"").skip(1).filter_map(|rest| rest.split('"').next());
    let mut children = Vec::new();
    for at in 0..tokens.len().saturating_sub(2) {
        if tokens[at] == "mod" && tokens[at + 2] == ";" {
            let before = tokens[..at].strip_suffix(&["pub"]).unwrap_or(&tokens[..at]);
            let path = before.ends_with(&["#", "[", "path", "=", "]"]).then(|| given.next().unwrap().to_owned());
            children.push((tokens[at + 1].to_owned(), path));
        }
    }
    children
}
