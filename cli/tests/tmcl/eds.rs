//! `tmcl eds`: the file, and where it goes.

use std::fs::OpenOptions;

use super::harness::{complaint, run, tmcl};

#[test]
fn the_file_goes_to_standard_output_or_to_a_file() {
    let all = run(&["eds"]);
    assert!(all.status.success() && all.stderr.is_empty(), "{}", complaint(&all));
    assert_eq!(String::from_utf8(all.stdout.clone()).unwrap(), tmcl_tools::eds::text(None));
    assert_eq!(run(&["eds", "-o", "-"]).stdout, all.stdout);

    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axis.dcf");
    let written = run(&["eds", "--node-id", "5", "--output", path.to_str().unwrap()]);
    assert!(written.status.success() && written.stdout.is_empty(), "{}", complaint(&written));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), tmcl_tools::eds::text(Some(5)));
}

#[test]
fn what_cannot_be_done_is_told() {
    for id in ["0", "128", "-1", "five"] {
        let refused = run(&["eds", "--node-id", id]);
        assert_eq!(refused.status.code(), Some(2), "{id}");
        assert!(refused.stdout.is_empty());
    }
    let full = run(&["eds", "-o", "/dev/full"]);
    assert_eq!(full.status.code(), Some(1));
    assert!(complaint(&full).starts_with("tmcl: cannot write /dev/full: "), "{}", complaint(&full));
    let full = tmcl(&["eds"]).stdout(OpenOptions::new().write(true).open("/dev/full").unwrap()).output().unwrap();
    assert_eq!(full.status.code(), Some(1));
    assert!(complaint(&full).starts_with("tmcl: cannot write the output: "), "{}", complaint(&full));
}
