//! Circles of files: those from which imports lead back to themselves.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// By file, those that it imports, each with a name that it takes.
pub(crate) type Imports = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// All files that imports lead to from `start`; `start` itself only if they lead back.
fn reached<'a>(imports: &'a Imports, start: &'a Path) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut open = vec![start];
    while let Some(file) = open.pop() {
        let next = imports.get(file).into_iter().flat_map(BTreeMap::keys);
        open.extend(next.map(PathBuf::as_path).filter(|file| reached.insert(*file)));
    }
    reached
}

/// The circles, each as the imports within it: file, file, name.
pub(crate) fn circles(imports: &Imports) -> Vec<Vec<(&Path, &Path, &str)>> {
    let all: BTreeMap<&Path, _> = imports.keys().map(|file| (file.as_path(), reached(imports, file))).collect();
    let mut circles = Vec::new();
    let mut seen: BTreeSet<&Path> = BTreeSet::new();
    for (file, ahead) in &all {
        if seen.contains(file) || !ahead.contains(file) {
            continue;
        }
        let circle: BTreeSet<&Path> =
            ahead.iter().copied().filter(|other| all.get(other).is_some_and(|back| back.contains(file))).collect();
        seen.extend(&circle);
        let within = |from: &&'_ Path| -> Vec<(&Path, &Path, &str)> {
            let (from, others) = imports.get_key_value(*from).expect("a file of the circle");
            let others = others.iter().filter(|(to, _)| circle.contains(to.as_path()));
            others.map(|(to, name)| (from.as_path(), to.as_path(), name.as_str())).collect()
        };
        circles.push(circle.iter().flat_map(within).collect());
    }
    circles
}
