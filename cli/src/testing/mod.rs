//! `tmcl test`: scenario files on virtual modules. The language and what carries it out are those of
//! [`tmcm_sim::scenario`]; here are the files, the assembler for programs, the flash image, and the reports.

mod images;
mod junit;
mod options;
mod programs;
mod report;
mod sources;

pub use images::on_image;
pub use options::Options;
pub use sources::{expanded, read_file, read_text, select};

use std::io::Write;
use std::time::Instant;

use tmcl_server::image::Image;
use tmcm_sim::scenario::suite::{self, Start};
use tmcm_sim::scenario::{Case, Stand};

use crate::failure::Failure;
use crate::output::Output;
use report::Printer;

/// Runs the scenarios; fails if any of them does.
pub fn run(options: &Options) -> Result<(), Failure> {
    let image = options.image.as_deref().map(Image::read).transpose()?;
    let model = options.model(image.as_ref().and_then(|image| image.model))?;
    let mut files = options.read(model)?;
    let count = select(&mut files, options.only.as_deref().unwrap_or_default(), options.first_rows);
    if let (0, Some(text)) = (count, &options.only) {
        return Err(Failure::Arguments(format!("--only: no file or title contains '{text}'")));
    }
    let mut junit = options.junit.as_deref().map(|path| Output::open("--junit", path)).transpose()?;
    let began = Instant::now();
    let mut printer = Printer::new(junit.as_ref().is_some_and(Output::is_standard));
    let reports = match &image {
        None => suite::run(&files, |case| Start::Ready(Stand::native(case)), |news| printer.tell(&news)),
        Some(image) => {
            let start = |case: &Case| match Options::suits_image(case, model) {
                Ok(()) => on_image(&image.elf, case),
                Err(reason) => Start::LeftOut(reason),
            };
            suite::run(&files, start, |news| printer.tell(&news))
        }
    };
    let passed = printer.finish(&reports, began.elapsed())?;
    if let Some(mut junit) = junit.take() {
        junit.write_all(junit::text(&reports, began.elapsed())?.as_bytes())?;
        junit.finish()?;
    }
    if passed { Ok(()) } else { Err(Failure::Reported) }
}
