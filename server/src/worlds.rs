//! The file of option --world, and the worlds around modules that it describes.

use std::path::Path;

use hal_sim::world::config::WorldConfig;
use tmcl_link::wording::words;
use tmcm_sim::Product;

use crate::failure::Failure;
use crate::files::read_text;
use crate::options::Options;

/// The world of each module. Each product has its own idea of what there can be.
pub(crate) fn of_all(options: &Options) -> Result<Vec<WorldConfig>, Failure> {
    let Some(path) = &options.world else { return Ok(vec![WorldConfig::default(); options.product.len()]) };
    let file = WorldFile::read(path)?;
    let world = |(number, product): (usize, &Product)| {
        let module = if options.is_mixed() { format!("module {number}: ") } else { String::new() };
        file.world(*product, &module)
    };
    (1..).zip(&options.product).map(world).collect()
}

/// Reads the file of option --world for a module of a product.
pub fn read_world(path: &Path, product: Product) -> Result<WorldConfig, Failure> {
    WorldFile::read(path)?.world(product, "")
}

struct WorldFile<'a> {
    path: &'a Path,
    text: String,
}

impl<'a> WorldFile<'a> {
    fn read(path: &'a Path) -> Result<Self, Failure> {
        let cannot = |error: std::io::Error| {
            Failure::Failed(format!("--world: cannot read {}: {}", path.display(), words(error)))
        };
        Ok(WorldFile { path, text: read_text(path).map_err(cannot)? })
    }

    /// The world around a module of a product. An error names the file, and the `module` where that is given.
    fn world(&self, product: Product, module: &str) -> Result<WorldConfig, Failure> {
        let wrong =
            |error: String| Failure::Failed(format!("--world: {}: {module}{}", self.path.display(), error.trim_end()));
        WorldConfig::parse_for(product.kind(), &self.text).map_err(wrong)
    }
}
