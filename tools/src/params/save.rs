//! Reading a module's settings.

use tmcm::param::{COORDINATES, STORED_USER_VARIABLES};

use super::each::read_each;
use super::entry::{is_axis_setting, is_global_setting};
use super::file::{Setting, TITLE, VARIABLES};
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::{Product, numbers};
use crate::progress::Progress;
use crate::stop::Stop;

/// A heading of the file and the settings below it.
struct Section {
    heading: String,
    settings: Vec<Setting>,
}

/// The settings of a module as a file has them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Saved {
    /// The text of the file.
    pub text: String,
    /// Number of settings in it.
    pub saved: usize,
    /// Number of settings that the module does not know.
    pub missing: usize,
}

/// Reads all settings of a module.
///
/// # Errors
/// The link fails, or it is to end.
pub fn save(
    module: &mut Conversation,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Saved, Failure> {
    let identity = module.identity()?;
    let mut text = format!("{TITLE}{identity}, saved by tmcl params\n");
    let sections = sections(identity.product, module.axes()?);
    let total = count(&sections);
    let what = format!("reading {total} settings");
    let mut reach = |done| progress(Progress { what: &what, done, total });
    reach(0);
    let (mut asked, mut saved) = (0, 0);
    for Section { heading, settings } in sections {
        text += &format!("\n// {heading}\n");
        for setting in settings {
            if let Some(value) = value(module, setting)? {
                text += &format!("{}\n", setting.with(value).line(identity.product));
                saved += 1;
            }
            if stop.happened() {
                return Err(stop.interrupted(""));
            }
            asked += 1;
            reach(asked);
        }
    }
    Ok(Saved { text, saved, missing: asked - saved })
}

/// All settings of a module with their values, as they would be saved.
///
/// # Errors
/// The link fails, or it is to end.
pub fn all(
    module: &mut Conversation,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Setting>, Failure> {
    let product = module.product()?;
    let sections = sections(product, module.axes()?);
    let settings: Vec<Setting> = sections.into_iter().flat_map(|section| section.settings).collect();
    values(module, &settings, stop, progress)
}

/// Reads these settings with the values that they have in a module, without those that it does not have.
///
/// # Errors
/// The link fails, or it is to end.
pub fn values(
    module: &mut Conversation,
    settings: &[Setting],
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Vec<Setting>, Failure> {
    let read = read_each(module, settings, stop, progress)?;
    let read = settings.iter().zip(read).filter_map(|(setting, read)| Some(setting.with(read.ok()?)));
    Ok(read.collect())
}

fn count(sections: &[Section]) -> usize {
    sections.iter().map(|section| section.settings.len()).sum()
}

/// The value of a setting; `None` if the module does not have the setting.
fn value(module: &mut Conversation, setting: Setting) -> Result<Option<i32>, Error> {
    match module.value(setting.read()) {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.is_refusal() => Ok(None),
        Err(error) => Err(error),
    }
}

/// The settings to save of a module of this product, with `axes` axes.
fn sections(product: Option<Product>, axes: u8) -> Vec<Section> {
    let spec = numbers(product);
    let globals = spec.global.rows.iter().filter(|found| is_global_setting(found)).map(|found| &found.row);
    let globals = globals.map(|row| Setting::Global { number: row.number, bank: 0, value: 0 });
    let (interface, globals) = globals.partition(|setting| setting.is_interface(product));

    let mut sections = Vec::new();
    for axis in 0..axes {
        let rows = spec.axis.rows.iter().filter(|found| is_axis_setting(found, product));
        let settings = rows.map(|found| Setting::Axis { number: found.row.number, axis, value: 0 }).collect();
        sections.push(Section { heading: format!("Axis {axis}"), settings });
    }
    sections.push(Section { heading: "Global parameters".into(), settings: globals });
    let variables =
        (0..STORED_USER_VARIABLES as u8).map(|number| Setting::Global { number, bank: VARIABLES, value: 0 });
    sections.push(Section { heading: "User variables".into(), settings: variables.collect() });
    for axis in 0..axes {
        let coordinates = (1..COORDINATES as u8).map(|number| Setting::Coordinate { number, axis, value: 0 });
        sections.push(Section { heading: format!("Coordinates of axis {axis}"), settings: coordinates.collect() });
    }
    let heading = "Interfaces: restored only with --interface".into();
    sections.push(Section { heading, settings: interface });
    sections
}
