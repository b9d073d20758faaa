//! Runs the scenario files of `tests/scenarios` and `examples`, and the examples of `docs/scenarios.md`, by the code
//! that `tmcl test` runs. They run on the firmware's core with all rows of their tables. Those of `tests/scenarios`
//! also run on the flash images in the emulated microcontroller, which is slow, with the first row of each. One line is
//! printed for each scenario; `SCENARIO=text cargo test -p tmcl-cli --test toolchain scenarios` runs those whose file
//! name or title contains the text, and `ALL_ROWS=1` all rows on the images as well.

use std::io::Write as _;
use std::path::PathBuf;

use common::image;
use tmcl_cli::testing;
use tmcm_sim::look::Look;
use tmcm_sim::scenario::suite::{self, File, News, Report, Start};
use tmcm_sim::scenario::{Case, Rig, Stand};
use tmcm_sim::{Model, Product};

/// The scenarios of a folder that are wanted, of which there may be none.
fn files(folder: &str, first_rows: bool) -> Vec<File> {
    let folder = xtask::workspace().unwrap().join(folder);
    let paths = testing::expanded(&folder).unwrap();
    let filter = std::env::var("SCENARIO").unwrap_or_default();
    let read = |path: &PathBuf| {
        let file = testing::read_file(path, Model::default(), "").unwrap();
        File { name: path.file_name().unwrap().to_string_lossy().into(), ..file }
    };
    let mut files: Vec<File> = paths.iter().map(read).collect();
    testing::select(&mut files, &filter, first_rows);
    files
}

fn run<R: Rig>(files: &[File], start: impl Fn(&Case) -> Start<R> + Sync) {
    let reports = suite::run(files, start, |news| {
        if let News::Scenario(report) = news {
            // Not `println`: the test harness would keep it to itself.
            let line = format!("{}: {} ... {}", report.file, report.title, report.verdict());
            writeln!(std::io::stdout().lock(), "{line}").unwrap();
        }
    });
    let failures: Vec<String> = reports.iter().flat_map(Report::failures).collect();
    assert!(failures.is_empty(), "{} failed:\n{}", failures.len(), failures.join("\n"));
}

fn on_core(files: &[File]) {
    run(files, |case| Start::Ready(Stand::native(case)));
}

#[test]
fn on_the_core() {
    on_core(&files("tests/scenarios", false));
}

#[test]
fn of_the_examples() {
    on_core(&files("examples", false));
}

/// The examples stand in blocks of code that are marked as scenarios.
#[test]
fn of_the_documentation() {
    let folder = xtask::workspace().unwrap().join("docs");
    let page = std::fs::read_to_string(folder.join("scenarios.md")).unwrap();
    let blocks: Vec<&str> = page.split("```scenario\n").skip(1).map(|rest| rest.split("```").next().unwrap()).collect();
    assert!(blocks.len() > 5);
    let read = |block: &&str| testing::read_text("docs/scenarios.md", block, &folder, Model::default(), "");
    on_core(&blocks.iter().map(read).collect::<Vec<_>>());
}

/// The meaning of each value of the world can be read there, too.
#[test]
fn the_documentation_has_all_values() {
    let path = xtask::workspace().unwrap().join("docs/scenarios.md");
    let page = std::fs::read_to_string(path).unwrap();
    for product in Product::ALL {
        for name in Look::all(product.kind()).map(|look| look.name()) {
            // Of a list the first stands for all.
            let first = name.rsplit_once('.').filter(|(_, number)| number.parse::<u8>().is_ok());
            let name = first.map_or(name.clone(), |(list, _)| format!("{list}.0"));
            assert!(page.contains(&format!("`{name}`")), "'{name}' is missing");
        }
    }
}

/// Every example program is loaded by the scenarios that stand beside it.
#[test]
fn each_example_has_a_scenario() {
    let folder = xtask::workspace().unwrap().join("examples");
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let programs: Vec<_> = paths.filter(|path| path.extension().is_some_and(|extension| extension == "tmc")).collect();
    assert!(programs.len() > 8);
    for program in programs {
        let scenarios = std::fs::read_to_string(program.with_extension("txt")).unwrap_or_default();
        let load = format!("load {}", program.file_name().unwrap().to_str().unwrap());
        assert!(scenarios.lines().any(|line| line.trim() == load), "no scenario does '{load}'");
    }
}

#[test]
fn on_the_images() {
    let images = [
        (Model::Tmcl(Product::Tmcm1140), image::image()),
        (Model::Canopen, image::canopen()),
        (Model::Tmcl(Product::Tmcm6110), image::six_axes()),
        (Model::Tmcl(Product::Tmcm3212), image::three_axes()),
    ]
    .map(|(model, path)| (model, std::fs::read(path).unwrap()));
    let first_rows = std::env::var_os("ALL_ROWS").is_none();
    run(&files("tests/scenarios", first_rows), |case| match images.iter().find(|(model, _)| *model == case.model) {
        Some((_, elf)) => testing::on_image(elf, case),
        None => Start::LeftOut(format!("there is no image of the {}", case.model.product().name())),
    });
}
