//! The files of the page, in memory.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

/// The kinds of files that a page has: how the name ends, and what a browser is told.
const KINDS: [(&str, &str); 6] = [
    ("html", "text/html; charset=utf-8"),
    ("css", "text/css; charset=utf-8"),
    ("js", "text/javascript; charset=utf-8"),
    ("svg", "image/svg+xml"),
    ("wasm", "application/wasm"),
    ("txt", "text/plain; charset=utf-8"),
];

/// Names that a folder of the page may have beside the page, for those who write it: the settings and packages of their
/// tools.
const TOOLS: [&str; 4] = ["tsconfig.json", "package.json", "package-lock.json", "node_modules"];

/// A file of the page.
#[derive(Clone, Debug)]
pub struct File {
    /// The kind of the file, as a browser is told it, such as `application/wasm`.
    pub kind: &'static str,
    /// The contents of the file.
    pub bytes: Vec<u8>,
}

/// All files of the page by their paths, such as `plot/axis.js`, in the order of these.
#[derive(Clone, Debug, Default)]
pub struct Files(BTreeMap<String, File>);

impl Files {
    /// Reads a folder. What begins with a dot and what tools need is left out; anything else that is no file of a page
    /// is an error, which is one sentence.
    pub fn read(folder: &Path) -> Result<Self, String> {
        let mut files = Self::default();
        files.read_below(folder, "")?;
        Ok(files)
    }

    fn read_below(&mut self, folder: &Path, above: &str) -> Result<(), String> {
        let failed = |error| format!("{} cannot be read: {error}", folder.display());
        for entry in fs::read_dir(folder).map_err(failed)? {
            let path = entry.map_err(failed)?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with('.') || TOOLS.contains(&&*name) {
                continue;
            }
            let below = format!("{above}{name}");
            if path.is_dir() {
                self.read_below(&path, &format!("{below}/"))?;
            } else {
                let bytes = fs::read(&path).map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
                self.add(&below, bytes).map_err(|why| format!("{}: {why}", path.display()))?;
            }
        }
        Ok(())
    }

    /// Adds a file. The error is a sentence that leaves the file to be named.
    pub fn add(&mut self, path: &str, bytes: Vec<u8>) -> Result<(), String> {
        let kind = kind(path)?;
        match self.0.insert(path.to_owned(), File { kind, bytes }) {
            None => Ok(()),
            Some(_) => Err("the builder makes a file of that name itself, so this one needs another".into()),
        }
    }

    /// Writes them into a folder, which is made. The error is one sentence.
    pub fn write(&self, folder: &Path) -> Result<(), String> {
        for (path, file) in &self.0 {
            let path = folder.join(path);
            let made = fs::create_dir_all(path.parent().unwrap_or(folder)).and_then(|()| fs::write(&path, &file.bytes));
            made.map_err(|error| format!("{} cannot be written: {error}", path.display()))?;
        }
        Ok(())
    }

    /// The file of a path.
    pub fn get(&self, path: &str) -> Option<&File> {
        self.0.get(path)
    }

    /// The same, to be changed.
    pub fn get_mut(&mut self, path: &str) -> Option<&mut File> {
        self.0.get_mut(path)
    }

    /// All paths with their files.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &File)> {
        self.0.iter().map(|(path, file)| (path.as_str(), file))
    }
}

/// The kind of a file with this path, as a browser is told it. The error is a sentence that leaves the file to be
/// named.
fn kind(path: &str) -> Result<&'static str, String> {
    // These stand for themselves in an address.
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./".contains(letter);
    if !path.chars().all(is_plain) {
        return Err("the name of a file of the page has only unaccented letters, digits and - _ . in it".into());
    }
    let ending = path.rsplit_once('.').map(|(_, ending)| ending);
    let found = KINDS.iter().find(|(other, _)| ending == Some(other));
    found.map(|(_, kind)| *kind).ok_or_else(|| {
        let endings = KINDS.map(|(ending, _)| ending).join(", ");
        format!("a page has no such files, only those that end with {endings}; take it out of the folder")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_tells_the_kind() {
        assert_eq!(kind("index.html"), Ok("text/html; charset=utf-8"));
        assert_eq!(kind("plot/axis.test.js"), Ok("text/javascript; charset=utf-8"));
        assert_eq!(kind("tmcl_studio.wasm"), Ok("application/wasm"));
        for name in ["types.ts", "Makefile", "js", "index.HTML", "plot.js/axis", "two words.js", "a?.js", "\u{e9}.js"] {
            assert!(kind(name).is_err(), "{name}");
        }
    }

    #[test]
    fn what_tools_need_is_left_out_and_folders_are_not() {
        let folder = tempfile::tempdir().unwrap();
        let files = ["index.html", "plot/axis.js", ".eslintrc", ".git/a.js", "package.json", "node_modules/a/b.ts"];
        for path in files.map(|path| folder.path().join(path)) {
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, "text").unwrap();
        }
        let files = Files::read(folder.path()).unwrap();
        assert_eq!(files.iter().map(|(path, _)| path).collect::<Vec<_>>(), ["index.html", "plot/axis.js"]);
        let copy = folder.path().join("copy");
        files.write(&copy).unwrap();
        assert_eq!(fs::read(copy.join("plot/axis.js")).unwrap(), b"text");
    }

    #[test]
    fn a_foreign_file_is_named() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("photo.jpeg"), "").unwrap();
        let sentence = Files::read(folder.path()).unwrap_err();
        assert!(sentence.contains("photo.jpeg: a page has no such files"), "{sentence}");
    }
}
