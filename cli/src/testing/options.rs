//! The command line of `tmcl test`.

use std::path::PathBuf;

use clap::Args;
use tmcl_link::wording::words;
use tmcl_server::files::read_text;
use tmcl_server::options::FirmwareOption;
use tmcl_server::worlds::read_world;
use tmcl_tools::product;
use tmcm_sim::scenario::Case;
use tmcm_sim::scenario::suite::File;
use tmcm_sim::{FirmwareKind, Model, Product};

use super::sources::{expanded, read_file};
use crate::failure::Failure;

/// Test the behaviour of a module, or of a TMCL program in it, that scenario files describe
///
/// A scenario says in plain lines what a host sends, what happens around the module, and what must come of it. It is
/// run in virtual time on a fresh virtual module. docs/scenarios.md describes the language. A scenario with tables is
/// run once for each of their rows, as many at a time as there are processors. Each failure is told with file and line.
#[derive(Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Options {
    /// Scenario files, or folders with such files, whose names end in .txt; - is standard input
    #[arg(value_name = "FILE", required = true)]
    pub files: Vec<PathBuf>,

    /// The module of scenarios that name none: {numbers}
    ///
    /// Without it that of --image, or else 1140.
    #[arg(long, value_name = "NAME", value_parser = product::named)]
    pub product: Option<Product>,

    /// The firmware of scenarios that name none: tmcl or canopen
    ///
    /// Without it that of --image, or else tmcl.
    #[arg(long, value_name = "NAME", value_enum)]
    pub firmware: Option<FirmwareOption>,

    /// The world of scenarios that have none, as for `tmcl sim --world`
    #[arg(long, value_name = "FILE.toml")]
    pub world: Option<PathBuf>,

    /// Run the firmware's flash image on an emulated microcontroller, in place of its core
    ///
    /// Scenarios for another product or firmware than the image's are left out, and those that say `not on the image:`.
    /// It takes ten times as long or more; with --first-rows one row of each scenario is run.
    #[arg(long, value_name = "ELF")]
    pub image: Option<PathBuf>,

    /// Run only scenarios whose file or title contains TEXT
    #[arg(long, value_name = "TEXT")]
    pub only: Option<String>,

    /// Run only the first row of each scenario's tables
    #[arg(long)]
    pub first_rows: bool,

    /// Write a report for other programs in JUnit's form, with a test case for each row; - is standard output
    #[arg(long, value_name = "FILE.xml")]
    pub junit: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl test examples/jog.txt
      the scenarios of a file; each begins with == and its title
  tmcl test examples --only \"lid is open\"
      those of all files in a folder whose titles speak of that
  tmcl test examples --junit report.xml
      a report for a CI server
  tmcl test stage.txt --product 6110 --world hal-sim/worlds/gantry.toml
      on a module with six axes that moves a gantry
  tmcl test stage.txt --first-rows --image target/thumbv7em-none-eabi/release/tmcm1140
      on the flash image itself
  printf '== A move\\nMVP ABS, 0, 1000\\n' | tmcl test -
      from standard input
The exit code is 1 if a scenario fails or cannot be read.";

impl Options {
    /// The model of the module of a scenario that does not name one. `told` is what the image is, if it tells.
    pub(super) fn model(&self, told: Option<Model>) -> Result<Model, Failure> {
        let refused = |message: String| Err(Failure::Arguments(message));
        let product = self.product.or(told.map(Model::product)).unwrap_or_default();
        let firmware = self.firmware.map(FirmwareKind::from).or(told.map(Model::firmware)).unwrap_or_default();
        let model = match Model::of(product, firmware) {
            Ok(model) => model,
            Err(message) => return refused(format!("--firmware canopen: {message}")),
        };
        match told {
            Some(told) if told != model => refused(format!(
                "--image: it is one of {}. Leave out --product and --firmware, or give another image",
                described(told)
            )),
            _ => Ok(model),
        }
    }

    /// Reads the files.
    pub(super) fn read(&self, model: Model) -> Result<Vec<File>, Failure> {
        let world = match &self.world {
            None => String::new(),
            Some(path) => {
                // Whether it is a world shows now, and not in each scenario.
                read_world(path, model.product())?;
                let cannot =
                    |error| Failure::Failed(format!("--world: cannot read {}: {}", path.display(), words(error)));
                read_text(path).map_err(cannot)?
            }
        };
        let mut files = Vec::new();
        for path in &self.files {
            for path in expanded(path)? {
                files.push(read_file(&path, model, &world)?);
            }
        }
        Ok(files)
    }

    /// Checks that a case can run on an image of this product and firmware; the error is the reason why not.
    pub(super) fn suits_image(case: &Case, image: Model) -> Result<(), String> {
        if case.model == image { Ok(()) } else { Err(format!("the image is one of {}", described(image))) }
    }
}

/// Product and firmware in words.
fn described(model: Model) -> String {
    match model {
        Model::Tmcl(product) => format!("the {}", product.name()),
        Model::Canopen => format!("the {} with the CANopen firmware", model.product().name()),
    }
}
