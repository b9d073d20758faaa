//! Files of `docs` that are made from tables.

/// Compares a file of `docs` with what the tables say; with `UPDATE_DOCS=1` in the environment it is written anew.
/// `test` tells Cargo which test this is.
pub fn compare(name: &str, test: &str, expected: &str) {
    let path = xtask::workspace().unwrap().join("docs").join(name);
    if std::env::var_os("UPDATE_DOCS").is_some_and(|value| value == "1") {
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, expected).unwrap();
        return;
    }
    // A checkout may have brought other line ends along.
    let found = std::fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    let difference = expected.lines().zip(found.lines().chain(std::iter::repeat(""))).find(|(a, b)| a != b);
    if let Some((expected, found)) = difference {
        panic!("{} is stale: UPDATE_DOCS=1 cargo test {test}\n- {found}\n+ {expected}", path.display());
    }
    assert!(found == expected, "{} has lines too many", path.display());
}
