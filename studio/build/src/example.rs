//! The example programs as links of the page, as the documentation has them.

use std::fs;

/// The documentation with the links.
const PAGE: &str = "docs/studio.md";
/// The text in front of a link.
const LINK: &str = "    #session=";

/// Finds the link to an example, such as `examples/there_and_back`: the text behind the address of the page.
///
/// # Errors
/// There is no such example, or the documentation cannot be read; one sentence.
pub fn link(wanted: &str) -> Result<String, String> {
    let path = xtask::workspace()?.join(PAGE);
    let page = fs::read_to_string(&path).map_err(|error| format!("{} cannot be read: {error}", path.display()))?;
    let name = wanted.trim_start_matches("examples/").trim_end_matches(".tmc");
    let mut names = Vec::new();
    let mut title = "";
    for line in page.lines() {
        if let Some((found, _)) = line.strip_prefix('[').and_then(|line| line.split_once("](../examples/")) {
            title = found;
        } else if line.starts_with(LINK) {
            if title == name {
                return Ok(line.trim().into());
            }
            names.push(format!("examples/{title}"));
        }
    }
    Err(format!("there is no example {wanted:?}; there are: {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn examples_are_found_by_their_names() {
        let one = link("examples/jog").unwrap();
        assert!(one.starts_with("#session="));
        assert_eq!(link("examples/jog.tmc").unwrap(), one);
        assert_ne!(link("there_and_back").unwrap(), one);
        let told = link("examples/other").unwrap_err();
        assert!(
            told.contains("no example \"examples/other\"; there are: examples/homing_axes, examples/jog"),
            "{told}"
        );
    }
}
