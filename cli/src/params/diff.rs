//! Comparing the settings of two files or modules.

use std::io::Write;
use std::path::Path;

use tmcl_link::EndSignal;
use tmcl_tools::conversation::Conversation;
use tmcl_tools::params::{Setting, all, differences, values};
use tmcl_tools::product::Product;

use super::read;
use crate::failure::Failure;
use crate::files::STANDARD;
use crate::link::LinkTarget;
use crate::progress;
use crate::reach::{LinkOptions, Reach};
use crate::tell::{self, Tone};

/// A side of the comparison, as the user has named it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Side {
    /// A file of settings, or standard input.
    File(String),
    /// A module.
    Link(String, LinkTarget),
}

impl Side {
    /// A file if there is one of this name, and a link if not.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        if text == STANDARD || Path::new(text).is_file() {
            return Ok(Side::File(text.into()));
        }
        if text.ends_with(".tmcl") {
            return Err("there is no such file".into());
        }
        let link = LinkTarget::parse(text)?;
        match &link {
            // A device that is missing is told when it is opened.
            LinkTarget::Serial(path) if !Path::new(path).exists() && !path.starts_with("/dev/") => {
                Err("there is no such file, and it is no LINK".into())
            }
            _ => Ok(Side::Link(text.into(), link)),
        }
    }

    fn name(&self) -> &str {
        match self {
            Side::File(name) | Side::Link(name, _) => name,
        }
    }
}

/// The settings of one side. Where it has no value for one that the other has, it is not in the list.
struct Settings {
    /// The number of the product; `None` if it is not known.
    number: Option<u16>,
    product: Option<Product>,
    list: Vec<Setting>,
}

/// A side that has been opened: a file that has been read, a link to a module that can be asked.
enum Opened {
    File(Settings),
    Module(Box<Conversation>),
}

impl Opened {
    fn open(side: &Side, link_options: &LinkOptions) -> Result<Self, Failure> {
        Ok(match side {
            Side::File(name) => {
                let settings = read(Path::new(name))?;
                let product = settings.product.and_then(Product::numbered);
                Opened::File(Settings { number: settings.product, product, list: settings.list })
            }
            Side::Link(_, link) => {
                let reach = Reach { link: link.clone(), link_options: link_options.clone() };
                Opened::Module(Box::new(reach.open()?))
            }
        })
    }

    /// The settings: those of the file; of a module those that `asked` names, or else all.
    fn settings(self, asked: Option<&[Setting]>, signal: &EndSignal) -> Result<Settings, Failure> {
        match self {
            Opened::File(settings) => Ok(settings),
            Opened::Module(mut module) => {
                let identity = module.identity()?;
                let list = match asked {
                    Some(asked) => values(&mut module, asked, signal, &mut progress::bar())?,
                    None => all(&mut module, signal, &mut progress::bar())?,
                };
                Ok(Settings { number: Some(identity.number), product: identity.product, list })
            }
        }
    }
}

/// Prints what is different between `a` and `b`: lines of `a` behind a minus, of `b` behind a plus. Fails if anything
/// is.
pub(super) fn diff(a: &Side, b: &Side, link_options: &LinkOptions) -> Result<(), Failure> {
    if a.name() == STANDARD && b.name() == STANDARD {
        return Err(Failure::Arguments("standard input can be one of the two, and not both".into()));
    }
    let (first, second) = (Opened::open(a, link_options)?, Opened::open(b, link_options)?);
    // Until here a signal ends the program by itself.
    let signal = &EndSignal::watch()?;
    // What a file does not have is not asked of a module.
    let (first, second) = if matches!(first, Opened::File(_)) {
        let first = first.settings(None, signal)?;
        let second = second.settings(Some(&first.list), signal)?;
        (first, second)
    } else {
        let second = second.settings(None, signal)?;
        (first.settings(Some(&second.list), signal)?, second)
    };
    let (name, other) = (a.name(), b.name());
    if let (Some(one), Some(two)) = (first.number, second.number)
        && one != two
    {
        return Err(Failure::Failed(format!(
            "{name} is of a TMCM-{one}, and {other} of a TMCM-{two}: the same number may mean something else there"
        )));
    }
    let product = first.product.or(second.product);
    let lines = differences(&first.list, &second.list, product);
    if lines.is_empty() {
        return Ok(());
    }
    let mut out = tell::out();
    writeln!(out, "--- {name}\n+++ {other}")?;
    for line in &lines {
        out.toned("", if line.starts_with('-') { Tone::Former } else { Tone::Changed }, line, "\n")?;
    }
    Err(Failure::Reported)
}
