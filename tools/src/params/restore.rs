//! Writing settings from a file back to a module.

use std::collections::BTreeSet;

use tmcm::param::{AxisParameter, GlobalParameter};
use tmcm::tmcl::{ALL_AXES, Command, Opcode};

use super::file::{Setting, Settings, TITLE};
use crate::conversation::{Conversation, Error};
use crate::failure::Failure;
use crate::product::{Product, stores_axes};
use crate::progress::Progress;
use crate::stop::Stop;

/// Fails if the settings, which have this name, are those of another product than that of the module.
///
/// # Errors
/// They are, or the link fails.
pub fn check(module: &mut Conversation, settings: &Settings, name: &str) -> Result<(), Failure> {
    check_number(module.identity()?.number, settings.product, name).map_err(Failure::Failed)
}

/// Fails if settings of the product with the number `there`, which have this name, are not those of the product `here`.
///
/// # Errors
/// The message for the user.
pub fn check_number(here: u16, there: Option<u16>, name: &str) -> Result<(), String> {
    match there {
        Some(there) if there != here => Err(format!(
            "{name} has the settings of a TMCM-{there}, and this module is a TMCM-{here}: the same number may mean \
             something else there. To write them all the same, take the line \"{TITLE}{there}...\" out of the file"
        )),
        _ => Ok(()),
    }
}

/// The tasks with settings, beside writing them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// True if the settings are stored in the EEPROM, too.
    pub store: bool,
    /// True if the settings of the interfaces are written, too: addresses, identifiers, bit rates.
    pub interface: bool,
    /// The address under which the module answers over this link, which is written last.
    pub address: GlobalParameter,
}

/// The outcome for settings that were to be written.
#[derive(Debug)]
pub struct Restored {
    /// Number of settings that are other ones now.
    pub changed: usize,
    /// Number of settings that were so already.
    pub same: usize,
    /// Number of settings of the interfaces that are left as they are.
    pub left: usize,
    /// Whether they are stored, and whether those of the axes are; `None` if that was not wanted.
    pub stored: Option<bool>,
    /// The refusals of the module.
    pub refused: Vec<Error>,
}

impl Restored {
    /// The module's refusal of a setting.
    pub fn refusal(&self, setting: Setting, product: Option<Product>) -> Option<&Error> {
        let commands = [Some(setting.write()), setting.store(product)];
        self.refused.iter().find(|error| match error {
            Error::Refused { command, .. } => commands.contains(&Some(*command)),
            _ => false,
        })
    }

    /// The same in words, in lines.
    pub fn text(&self) -> String {
        let stored = match self.stored {
            Some(true) => ", all stored",
            Some(false) => ", stored but for those of the axes, which this module forgets when it is switched off",
            None => "",
        };
        let mut text = format!("settings restored: {}, the same already: {}{stored}\n", self.changed, self.same);
        if self.left > 0 {
            text += &format!("settings of the interfaces left as they are: {}; --interface restores them\n", self.left);
        }
        self.refused.iter().for_each(|refusal| text += &format!("refused: {refusal}\n"));
        text
    }
}

/// Writes the settings to the module. It may be ended half way, as by a module that does not answer any more.
///
/// # Errors
/// A motor turns, the link fails, or it is to end.
pub fn restore(
    module: &mut Conversation,
    settings: Vec<Setting>,
    Wanted { store, interface, address }: Wanted,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<Restored, Failure> {
    let product = module.product()?;
    let (mut interfaces, settings): (Vec<_>, Vec<_>) =
        settings.into_iter().partition(|setting| setting.is_interface(product));
    let left = if interface { 0 } else { std::mem::take(&mut interfaces).len() };
    // The address in use is written last, because the module no longer answers under its old address after that.
    interfaces.sort_by_key(|setting| setting.global(product) == Some(address));
    standstill(module, &settings)?;

    let total = settings.len() + interfaces.len();
    let what = format!("restoring {total} settings");
    let mut reach = |done| progress(Progress { what: &what, done, total });
    reach(0);
    let mut restorer = Restorer { module, stop, reach: &mut reach, total, done: 0, same: 0, changed: 0 };
    let mut refused = restorer.write(&settings)?;
    // A refused parameter may depend on one further down, as the acceleration does on its divisor, so refused ones are
    // written again until that changes nothing more.
    while !refused.is_empty() {
        let again: Vec<Setting> = refused.iter().map(|(setting, _)| *setting).collect();
        refused = restorer.write(&again)?;
        if refused.len() == again.len() {
            break;
        }
    }
    let (kept, mut refusals): (Vec<Setting>, Vec<Error>) = refused.into_iter().unzip();
    if store {
        let written: Vec<Setting> = settings.into_iter().filter(|setting| !kept.contains(setting)).collect();
        refusals.extend(restorer.store(&written, product)?);
    }
    refusals.extend(restorer.write(&interfaces)?.into_iter().map(|(_, error)| error));
    let Restorer { same, changed, .. } = restorer;
    Ok(Restored { changed, same, left, stored: store.then(|| stores_axes(product)), refused: refusals })
}

/// Fails if one of the motors turns, because some parameters must only be changed at standstill.
fn standstill(module: &mut Conversation, settings: &[Setting]) -> Result<(), Failure> {
    let axes: BTreeSet<u8> = settings
        .iter()
        .filter_map(|setting| match setting {
            Setting::Axis { axis, .. } => Some(*axis),
            _ => None,
        })
        .collect();
    for axis in axes {
        match module.axis(axis, AxisParameter::ActualSpeed) {
            Ok(0) => {}
            Ok(_) => {
                let hint = format!("stop it first, for example with \"MST {axis}\"");
                return Err(Failure::Failed(format!("motor {axis} turns; {hint}")));
            }
            // An axis that the module does not have is reported when its settings are refused.
            Err(error) if error.is_refusal() => {}
            Err(error) => return Err(error.into()),
        }
    }
    Ok(())
}

/// The state of restoring, with counts of settings.
struct Restorer<'a> {
    module: &'a mut Conversation,
    stop: &'a dyn Stop,
    reach: &'a mut dyn FnMut(usize),
    total: usize,
    done: usize,
    same: usize,
    changed: usize,
}

impl Restorer<'_> {
    /// Writes the settings whose values differ. Returns the settings that the module refuses.
    fn write(&mut self, settings: &[Setting]) -> Result<Vec<(Setting, Error)>, Failure> {
        let mut refused = Vec::new();
        for setting in settings {
            self.go_on()?;
            match self.write_one(*setting) {
                Ok(()) => {
                    self.done += 1;
                    (self.reach)(self.done);
                }
                Err(error) if error.is_refusal() => refused.push((*setting, error)),
                Err(error) => return Err(Failure::Failed(format!("{error}; {}", self.so_far()))),
            }
        }
        Ok(refused)
    }

    /// Fails if it is to end.
    fn go_on(&self) -> Result<(), Failure> {
        if self.stop.happened() { Err(self.stop.interrupted(&self.so_far())) } else { Ok(()) }
    }

    /// The message for a user who finds it ended half way.
    fn so_far(&self) -> String {
        let (done, total) = (self.done, self.total);
        format!("{done} of {total} settings are as in the file; restore it again for the rest")
    }

    fn write_one(&mut self, setting: Setting) -> Result<(), Error> {
        match self.module.value(setting.read()) {
            Ok(value) if value == setting.value() => self.same += 1,
            Err(error) if !error.is_refusal() => return Err(error),
            // A setting that cannot be read is written all the same: the module refuses the line that is in the file.
            Ok(_) | Err(_) => {
                self.module.request(setting.write())?;
                self.changed += 1;
            }
        }
        Ok(())
    }

    /// Stores axis parameters, user variables and coordinates in the EEPROM of a product, as far as it does that.
    /// Returns the refusals of the module.
    fn store(&mut self, settings: &[Setting], product: Option<Product>) -> Result<Vec<Error>, Failure> {
        let mut commands: Vec<Command> = settings.iter().filter_map(|setting| setting.store(product)).collect();
        if settings.iter().any(|setting| matches!(setting, Setting::Coordinate { .. })) {
            commands.push(Command::new(Opcode::Sco as u8, 0, ALL_AXES, 0));
        }
        let mut refused = Vec::new();
        for command in commands {
            self.go_on()?;
            match self.module.request(command) {
                Ok(_) => {}
                Err(error) if error.is_refusal() => refused.push(error),
                Err(error) => return Err(Failure::Failed(format!("{error}; not all settings are stored"))),
            }
        }
        Ok(refused)
    }
}
