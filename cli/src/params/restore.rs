//! Writing settings from a file back to a module.

use std::collections::BTreeSet;
use std::io::Write;
use std::path::Path;

use tmcm::param::{AxisParameter, GlobalParameter};
use tmcm::tmcl::{ALL_AXES, Command, Opcode};

use super::file::{Setting, Settings, TITLE};
use crate::conversation::{Conversation, Error, Reach};
use crate::failure::Failure;
use crate::link::LinkTarget;
use crate::product::{Product, stores_axes};
use crate::progress::Progress;
use crate::signal::EndSignal;
use crate::tell;

/// Fails if the settings are those of another product than that of the module.
pub(super) fn check(module: &mut Conversation, settings: &Settings, path: &Path) -> Result<(), Failure> {
    let here = module.identity()?.number;
    match settings.product {
        Some(there) if there != here => {
            let shown = path.display();
            Err(Failure::Failed(format!(
                "{shown} has the settings of a TMCM-{there}, and this module is a TMCM-{here}: the same number may mean \
                 something else there. To write them all the same, take the line \"{TITLE}{there}...\" out of the file"
            )))
        }
        _ => Ok(()),
    }
}

/// Writes the settings to the module. With `store` they are also stored in the EEPROM; only with `interface` the
/// settings of the interfaces are written, too. A signal, or a module that does not answer any more, ends it half way.
pub(super) fn restore(
    module: &mut Conversation,
    reach: &Reach,
    settings: Vec<Setting>,
    (store, interface): (bool, bool),
    signal: &EndSignal,
) -> Result<(), Failure> {
    let product = module.product()?;
    let (mut interfaces, settings): (Vec<_>, Vec<_>) =
        settings.into_iter().partition(|setting| setting.is_interface(product));
    let left = if interface { 0 } else { std::mem::take(&mut interfaces).len() };
    let effective = match reach.link {
        LinkTarget::Slcan(_) => GlobalParameter::CanId,
        LinkTarget::Serial(_) | LinkTarget::Tcp(_) | LinkTarget::Simulated => GlobalParameter::SerialAddress,
    };
    // The address in use is written last, because the module no longer answers under its old address after that.
    interfaces.sort_by_key(|setting| setting.global(product) == Some(effective));
    standstill(module, &settings)?;

    let total = settings.len() + interfaces.len();
    let progress = Progress::new(format!("restoring {total} settings"), total);
    let mut restorer = Restorer { module, signal, progress, total, done: 0, same: 0, changed: 0 };
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
    let (kept, mut complaints): (Vec<Setting>, Vec<Error>) = refused.into_iter().unzip();
    if store {
        let written: Vec<Setting> = settings.into_iter().filter(|setting| !kept.contains(setting)).collect();
        complaints.extend(restorer.store(&written, product)?);
    }
    complaints.extend(restorer.write(&interfaces)?.into_iter().map(|(_, error)| error));
    let Restorer { same, changed, progress, .. } = restorer;
    drop(progress);

    let mut out = tell::out();
    let stored = match store {
        true if stores_axes(product) => ", all stored",
        true => ", stored but for those of the axes, which this module forgets when it is switched off",
        false => "",
    };
    writeln!(out, "settings restored: {changed}, the same already: {same}{stored}")?;
    if left > 0 {
        writeln!(out, "settings of the interfaces left as they are: {left}; --interface restores them")?;
    }
    for complaint in &complaints {
        writeln!(out, "refused: {complaint}")?;
    }
    if complaints.is_empty() { Ok(()) } else { Err(Failure::Reported) }
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
    signal: &'a EndSignal,
    progress: Progress,
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
                    self.progress.reach(self.done);
                }
                Err(error) if error.is_refusal() => refused.push((*setting, error)),
                Err(error) => return Err(Failure::Failed(format!("{error}; {}", self.so_far()))),
            }
        }
        Ok(refused)
    }

    /// Fails if a signal has come.
    fn go_on(&self) -> Result<(), Failure> {
        if self.signal.happened() { Err(self.signal.failure(self.so_far())) } else { Ok(()) }
    }

    /// What a user has to know who finds it ended half way.
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
