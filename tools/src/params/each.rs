//! Settings one after the other, each with what has become of it: what the module refuses does not keep it from the
//! others.

use super::file::Setting;
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::Product;
use crate::progress::Progress;
use crate::stop::Stop;

/// The outcome of each of some settings: a value or nothing, or the module's refusal.
pub type Each<T> = Vec<Result<T, Error>>;

/// Does something with each setting. `so_far` tells what a user has to know who ends it, or whose link fails, after so
/// many.
fn each<T>(
    settings: &[Setting],
    doing: &str,
    so_far: &dyn Fn(usize) -> String,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
    mut carry_out: impl FnMut(Setting) -> Result<T, Error>,
) -> Result<Each<T>, Failure> {
    let total = settings.len();
    let what = format!("{doing} {total} settings");
    let mut reach = |done| progress(Progress { what: &what, done, total });
    reach(0);
    let mut all = Vec::new();
    for (done, setting) in settings.iter().enumerate() {
        if stop.happened() {
            return Err(stop.interrupted(&so_far(done)));
        }
        match carry_out(*setting) {
            Err(error) if !error.is_refusal() => {
                return Err(match error.into() {
                    Failure::Failed(message) if !so_far(done).is_empty() => {
                        Failure::Failed(format!("{message}; {}", so_far(done)))
                    }
                    failure => failure,
                });
            }
            told => all.push(told),
        }
        reach(done + 1);
    }
    Ok(all)
}

/// The values of settings.
///
/// # Errors
/// The link fails, or it is to end.
pub fn read_each(
    module: &mut Conversation,
    settings: &[Setting],
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Each<i32>, Failure> {
    each(settings, "reading", &|_| String::new(), stop, progress, |setting| module.value(setting.read()))
}

/// Writes settings, with `store` into the EEPROM as well where that is done on command, and gives the values that the
/// module has then.
///
/// # Errors
/// The link fails, or it is to end.
pub fn write_each(
    module: &mut Conversation,
    settings: &[Setting],
    product: Option<Product>,
    store: bool,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Each<i32>, Failure> {
    let so_far = |done| format!("{done} of {} settings are written", settings.len());
    each(settings, "writing", &so_far, stop, progress, |setting| {
        super::write(module, setting, product, store)?;
        module.value(setting.read())
    })
}

/// Stores settings in the EEPROM with the values that they have. Those that cannot be stored on command are left out.
///
/// # Errors
/// The link fails, or it is to end.
pub fn store_each(
    module: &mut Conversation,
    settings: &[Setting],
    product: Option<Product>,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Each<()>, Failure> {
    let so_far = |done| format!("{done} of {} settings are stored", settings.len());
    each(settings, "storing", &so_far, stop, progress, |setting| match setting.store(product) {
        Some(command) => module.request(command).map(|_| ()),
        None => Ok(()),
    })
}
