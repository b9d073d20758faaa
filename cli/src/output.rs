//! Files that a command writes, where `-` stands for standard output.

use std::ffi::OsStr;
use std::fs::File;
use std::io::{self, BufWriter, Stdout, Write};
use std::path::Path;

use tmcl_link::wording;

use crate::draft::Draft;
use crate::failure::Failure;
use crate::files::is_standard;

/// An open output: a file, or standard output. It is opened before the work begins, so that a name that cannot be
/// written is noticed before a motor has moved.
#[derive(Debug)]
pub struct Output {
    /// The option that names it, in front of messages; empty for an argument without an option.
    option: &'static str,
    name: String,
    to: To,
}

#[derive(Debug)]
enum To {
    Standard(Stdout),
    File(BufWriter<File>),
    /// A file that takes the place of an older one when it is finished, and what it is going to have.
    Draft(Draft, Vec<u8>),
}

impl Output {
    /// Opens an output that an option names; it is empty for an argument without one. A file that exists stays as it is
    /// until this one is finished.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn open(option: &'static str, path: &Path) -> Result<Self, Failure> {
        let begin = || Draft::begin(path).map_err(|failure| named(option, failure));
        Self::to(option, path, || Ok(To::Draft(begin()?, Vec::new())))
    }

    /// The same for what grows for as long as the work goes on, and is worth something before its end. A file that
    /// exists is emptied.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn stream(option: &'static str, path: &Path) -> Result<Self, Failure> {
        let cannot = |error| cannot(option, &path.display().to_string(), &error);
        Self::to(option, path, || File::create(path).map(|file| To::File(BufWriter::new(file))).map_err(cannot))
    }

    /// Opens an output for an SVG image.
    ///
    /// # Errors
    /// The name of the file does not end in .svg, or it cannot be written.
    pub fn svg(option: &'static str, path: &Path) -> Result<Self, Failure> {
        let is_svg = path.extension().and_then(OsStr::to_str).is_some_and(|ending| ending.eq_ignore_ascii_case("svg"));
        if !is_svg && !is_standard(path) {
            let name = path.display();
            return Err(Failure::Arguments(format!(
                "{option}: {name} does not end in .svg, and what is drawn is an SVG image; give a name like plot.svg, or - \
                 for standard output"
            )));
        }
        Self::open(option, path)
    }

    fn to(option: &'static str, path: &Path, file: impl FnOnce() -> Result<To, Failure>) -> Result<Self, Failure> {
        if is_standard(path) {
            return Ok(Output { option, name: "standard output".into(), to: To::Standard(io::stdout()) });
        }
        Ok(Output { option, name: path.display().to_string(), to: file()? })
    }

    /// True for standard output. What a command prints beside its result goes to standard error then.
    pub fn is_standard(&self) -> bool {
        matches!(self.to, To::Standard(_))
    }

    /// The name of the file, or of standard output, in messages.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Writes what is left in buffers.
    ///
    /// # Errors
    /// The bytes cannot be written.
    pub fn finish(mut self) -> Result<(), Failure> {
        match self.to {
            To::Draft(draft, whole) => draft.finish(&whole).map_err(|failure| named(self.option, failure)),
            _ => Ok(self.flush()?),
        }
    }
}

/// An error that is not of standard output has a [`Failure`] inside, which names the file. What is flushed can be read
/// by others; a file that takes the place of an older one does so only when it is finished.
impl Write for Output {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match &mut self.to {
            To::Standard(out) => out.write(bytes),
            To::File(file) => file.write(bytes).map_err(|error| cannot(self.option, &self.name, &error).into()),
            To::Draft(_, whole) => whole.write(bytes),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match &mut self.to {
            To::Standard(out) => out.flush(),
            To::File(file) => file.flush().map_err(|error| cannot(self.option, &self.name, &error).into()),
            To::Draft(..) => Ok(()),
        }
    }
}

fn cannot(option: &str, name: &str, error: &io::Error) -> Failure {
    named(option, Failure::Failed(format!("cannot write {name}: {}", wording::of(error))))
}

/// The failure with the option that names the file in front.
fn named(option: &str, failure: Failure) -> Failure {
    match failure {
        Failure::Failed(message) if !option.is_empty() => Failure::Failed(format!("{option}: {message}")),
        failure => failure,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_have_a_name_of_their_own() {
        let folder = tempfile::tempdir().unwrap();
        for (name, is_one) in [("a.svg", true), ("a.SVG", true), ("a.png", false), ("svg", false), ("a.svg.bak", false)]
        {
            let path = folder.path().join(name);
            std::fs::write(&path, "old").unwrap();
            let opened = Output::svg("--plot", &path);
            assert_eq!(opened.is_ok(), is_one, "{name}");
            assert_eq!(std::fs::read_to_string(&path).unwrap(), "old", "{name} must not be touched");
            if let Ok(mut image) = opened {
                image.write_all(b"new").unwrap();
                image.finish().unwrap();
            }
            assert_eq!(std::fs::read_to_string(&path).unwrap() == "new", is_one, "{name}");
        }
        assert!(Output::svg("--plot", Path::new("-")).unwrap().is_standard());
        let nowhere = folder.path().join("none/a.svg");
        let failure = Output::svg("--plot", &nowhere).unwrap_err().to_string();
        assert!(failure.starts_with("--plot: cannot write ") && failure.contains("none/a.svg"), "{failure}");
    }
}
