//! The identity of the page: the version of the project, and a number of all files. Sessions tell by which page they
//! were made, because another one may do them otherwise.

use crc::{CRC_64_XZ, Crc};

use crate::files::Files;

/// The place in the page where that comes to stand.
const PLACE: &str = "{made}";

/// Puts it into the page that stands for all of them. The error is one sentence.
pub fn place(files: &mut Files, index: &str) -> Result<(), String> {
    let crc = Crc::<u64>::new(&CRC_64_XZ);
    let mut digest = crc.digest();
    for (path, file) in files.iter() {
        // The length tells where a file ends.
        digest.update(path.as_bytes());
        digest.update(&(file.bytes.len() as u64).to_le_bytes());
        digest.update(&file.bytes);
    }
    let made = format!("{} {:016x}", env!("CARGO_PKG_VERSION"), digest.finalize());
    let page = files.get_mut(index).ok_or_else(|| format!("there is no {index}"))?;
    let text = str::from_utf8(&page.bytes).map_err(|error| format!("{index} is not text in UTF-8: {error}"))?;
    match text.matches(PLACE).count() {
        1 => page.bytes = text.replace(PLACE, &made).into_bytes(),
        count => {
            return Err(format!(
                "{PLACE} in {index}, where it says what it is, must stand there once, not {count} times"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(index: &str, script: &str) -> Result<String, String> {
        let mut files = Files::default();
        files.add("index.html", index.into()).unwrap();
        files.add("a.js", script.into()).unwrap();
        place(&mut files, "index.html")?;
        Ok(String::from_utf8(files.get_mut("index.html").unwrap().bytes.clone()).unwrap())
    }

    #[test]
    fn a_page_with_another_file_is_another_page() {
        let [one, same, other] = ["1", "1", "2"].map(|script| page("{made}", script).unwrap());
        assert!(one.starts_with(concat!(env!("CARGO_PKG_VERSION"), " ")) && one.len() > 16, "{one}");
        assert_eq!(one, same);
        assert_ne!(one, other);
        assert!(page("", "").unwrap_err().contains("not 0 times"));
    }
}
