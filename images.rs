//! The images: the binaries in `Cargo.toml`. The build script and `cargo fw` read them there.

/// Each image in the text of `Cargo.toml`, with its board: the feature that the binary requires.
pub(crate) fn images(manifest: &str) -> Vec<(&str, &str)> {
    manifest.split("[[bin]]").skip(1).filter_map(image).collect()
}

/// Name and board of the binary with which a text begins.
fn image(text: &str) -> Option<(&str, &str)> {
    let (_, name) = text.split_once("name = \"")?;
    let (_, board) = text.split_once("required-features = [\"")?;
    Some((name.split('"').next()?, board.split('"').next()?))
}
