//! Circles of files: files from which imports lead back to the file itself.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// For each file the files that it imports, each with a name that it uses from there.
pub(crate) type Imports = BTreeMap<PathBuf, BTreeMap<PathBuf, String>>;

/// All files to which imports lead from `start`; `start` itself only if imports lead back to it.
fn reached<'a>(imports: &'a Imports, start: &'a Path) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut open = vec![start];
    while let Some(file) = open.pop() {
        let next = imports.get(file).into_iter().flat_map(BTreeMap::keys);
        open.extend(next.map(PathBuf::as_path).filter(|file| reached.insert(*file)));
    }
    reached
}

/// The circles, each as the list of its imports: importing file, imported file, name.
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

/// The files of a circle.
pub(crate) fn files<'a>(circle: &[(&'a Path, &'a Path, &str)]) -> BTreeSet<&'a Path> {
    circle.iter().map(|(from, ..)| *from).collect()
}
