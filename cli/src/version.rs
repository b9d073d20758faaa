//! `tmcl --version`: the program's version and commit, and the products and firmwares that it knows.

use std::env;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;

use tmcm::canopen;
use tmcm_sim::{Model, Product};

/// Version and commit in a line, for `tmcl -V`.
pub const SHORT: &str = concat!(env!("CARGO_PKG_VERSION"), " (", env!("TMCL_COMMIT"), ")");

/// The same with a line for each product: the versions of the firmwares that virtual modules run.
pub static LONG: LazyLock<String> = LazyLock::new(|| {
    let mut text = format!("{SHORT}\n\nVirtual modules and the firmwares they run:\n");
    for product in Product::ALL {
        let spec = product.spec();
        let has_canopen = Model::Canopen.product() == product;
        let canopen = if has_canopen { format!(", CANopen {}", canopen::VERSION) } else { String::new() };
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {:<10} TMCL {}.{:02}{canopen}", product.name(), spec.major, spec.minor);
    }
    text.trim_end().into()
});

/// The text that stands in the place of the commit in a build that does not leave its checkout: see build.rs.
const OF_A_CHECKOUT: &str = "a build of a checkout";

/// Puts the commit of the checkout into the version of such a build. `text` is as [`SHORT`] or [`LONG`].
pub fn with_commit(text: &str) -> String {
    let git = |text: &str| {
        let output = Command::new("git")
            .args(["describe", "--always", "--dirty", "--abbrev=10", "--exclude=*"])
            .current_dir(checkout()?)
            .output()
            .ok()?;
        let commit = String::from_utf8(output.stdout).ok().filter(|_| output.status.success())?;
        Some(text.replacen(OF_A_CHECKOUT, commit.trim(), 1))
    };
    // Without git it stays what it is.
    Some(text).filter(|text| text.contains(OF_A_CHECKOUT)).and_then(git).unwrap_or_else(|| text.into())
}

/// The checkout of this build: the one in which it lies, or, where Cargo builds elsewhere, the one for which Cargo runs
/// it. It may have been moved, or copied, since this was compiled.
fn checkout() -> Option<PathBuf> {
    let package = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let places = [env::current_exe().ok(), package];
    let root = places.iter().flatten().find_map(|place| place.ancestors().find(|above| above.join(file!()).is_file()));
    root.map(Path::to_owned)
}
