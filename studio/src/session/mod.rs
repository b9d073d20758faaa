//! Sessions: what a virtual module was, and all that was done to it, so that it can be done again elsewhere with the
//! same numbers.
//!
//! A session comes from anybody. What it has is counted and checked here before anything of it is used, and it is done
//! on a virtual module only.
//!
//! * `deed` - a thing that was done, and its time
//! * `journal` - notes them
//! * `player` - does them again
//! * `scenario` - writes them as `tmcl test` runs them

mod deed;
mod journal;
mod player;
mod scenario;

use hal_sim::clock::{MICROSECOND, Nanos, SECOND};
use serde::{Deserialize, Serialize};
use tmcl_tools::product;
use tmcm_sim::Product;

pub use deed::{Around, Deed, What};
pub use journal::Journal;
pub use player::Player;
pub use scenario::write;

use crate::program::NamedText;
use crate::scope::{Curves, curves};
use crate::types::{Play, Start};
use crate::world;

/// The version of sessions that is written here; those before it are read as well.
const VERSION: u32 = 1;
/// Longest text of a session, in bytes: an EEPROM and many deeds have room.
const LONGEST: usize = 8_000_000;
/// Most things that are done in a session.
const MOST_DEEDS: usize = 100_000;
/// Most texts, and how long all of them are together, in bytes.
const MOST_TEXTS: usize = 100;
const LONGEST_TEXTS: usize = 1_000_000;
/// Longest name of a text, and longest title, in characters.
const LONGEST_NAME: usize = 100;
/// How long a session lasts at most.
const LONGEST_TIME: Nanos = 24 * 3600 * SECOND;

/// A session, as a file has it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Session {
    /// The version of this form, 1.
    pub session: u32,
    /// The subject of the session, in one line; may be empty.
    pub title: String,
    /// By which page it was made; null if by none.
    pub made: Option<SessionMaker>,
    /// The module.
    pub start: Start,
    /// Texts that belong to it: programs, and files that they include.
    pub texts: Vec<NamedText>,
    /// The curves of the scope.
    pub curves: Vec<String>,
    /// The deeds of the session, in the order of their times. Each has the microseconds of the module's time, and
    /// behind a space a command, as direct mode has it, or a line of the control port.
    pub done: Vec<String>,
    /// When it ends, in microseconds of the module's time.
    pub until: u64,
}

/// The page by which a session was made: numbers of another one may be others.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionMaker {
    /// The version of the project.
    pub version: String,
    /// A number of all of the page's files, in hexadecimal.
    pub hash: String,
}

/// A session that has been read and checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionRead {
    /// The session.
    pub session: Session,
    /// The name of its product, such as TMCM-1140.
    pub name: String,
    /// The deeds of the session, but for those that only read; each with its time.
    pub lines: Vec<String>,
    /// How many commands only read.
    pub readings: usize,
    /// How long it lasts, in seconds.
    pub length: f64,
}

/// The text of a session.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SessionText {
    /// The text, JSON.
    pub text: String,
}

/// A session that can be done again.
pub(crate) struct Checked {
    pub(crate) product: Product,
    pub(crate) deeds: Vec<Deed>,
    pub(crate) until: Nanos,
}

/// Reads the text of a session and checks all of it.
///
/// # Errors
/// It is none, of a later version, or not as it has to be: where, and how.
pub fn read(SessionText { text }: &SessionText) -> Result<SessionRead, String> {
    if text.len() > LONGEST {
        return Err(format!("it has {} bytes, and a session has {LONGEST} at most", text.len()));
    }
    // Its version first: a later one may have what this one does not know.
    #[derive(Deserialize)]
    struct Version {
        session: u32,
    }
    let none = |error: serde_json::Error| format!("it is no session of this page, or was cut off: {error}");
    let Version { session } = serde_json::from_str(text).map_err(none)?;
    if session == 0 || session > VERSION {
        return Err(format!("it is of a later version of this page ({session}); this one reads up to {VERSION}"));
    }
    let session: Session = serde_json::from_str(text).map_err(none)?;
    let Checked { product, deeds, until } = session.check()?;
    let done = deeds.iter().filter(|deed| !deed.what.only_reads());
    let lines: Vec<String> = done.map(|deed| format!("{:.3} s  {}", seconds(deed.at), deed.what)).collect();
    let readings = deeds.len() - lines.len();
    Ok(SessionRead { session, name: product.name().into(), lines, readings, length: seconds(until) })
}

fn seconds(time: Nanos) -> f64 {
    time as f64 / SECOND as f64
}

impl Session {
    /// Checks all that it has.
    ///
    /// # Errors
    /// What is wrong, and where.
    pub(crate) fn check(&self) -> Result<Checked, String> {
        let Session { title, made, start, texts, curves: wanted, done, until, .. } = self;
        let product = product::named(&start.product)?;
        check_name(title, "its title")?;
        if let Some(SessionMaker { version, hash }) = made {
            check_name(version, "the version of the page that made it")?;
            check_name(hash, "the hash of the page that made it")?;
        }
        if texts.len() > MOST_TEXTS {
            return Err(format!("it has {} texts, and a session has {MOST_TEXTS} at most", texts.len()));
        }
        for NamedText { name, .. } in texts {
            check_name(name, "the name of a text")?;
            if name.is_empty() {
                return Err("a text has no name".into());
            }
        }
        let length: usize = texts.iter().map(|text| text.text.len()).sum();
        if length > LONGEST_TEXTS {
            return Err(format!("its texts have {length} bytes, and those of a session {LONGEST_TEXTS} at most"));
        }
        world::config(start)?;
        world::eeprom(start, product)?;
        let is_virtual = true;
        curves(&Curves { address: 1, product: Some(start.product.clone()), is_virtual, texts: wanted.clone() })?;
        let (deeds, until) = check_done(done, *until, product)?;
        Ok(Checked { product, deeds, until })
    }
}

/// The deeds of a session, and when it ends.
///
/// # Errors
/// Something of it cannot be done, or not then: what, and why.
fn check_done(done: &[String], until: u64, product: Product) -> Result<(Vec<Deed>, Nanos), String> {
    if done.len() > MOST_DEEDS {
        return Err(format!("{} things are done in it, and in a session {MOST_DEEDS} at most", done.len()));
    }
    let mut deeds: Vec<Deed> = Vec::with_capacity(done.len());
    for (number, text) in (1..).zip(done) {
        let deed =
            Deed::parse(text, product.kind()).map_err(|why| format!("what is done as number {number}: {why}"))?;
        if deeds.last().is_some_and(|before| before.at > deed.at) {
            return Err(format!("what is done as number {number}, '{text}', is before what is done before it"));
        }
        deeds.push(deed);
    }
    let end = until.saturating_mul(MICROSECOND);
    if end > LONGEST_TIME {
        return Err("it lasts longer than a day, which is the longest".into());
    }
    if let Some(late) = deeds.last().filter(|deed| deed.at > end) {
        return Err(format!("'{late}' is done after its end at {until} us"));
    }
    Ok((deeds, end))
}

impl Player {
    /// The player of what is done again to a module.
    ///
    /// # Errors
    /// Something of it cannot be done.
    pub fn of(Play { start, done, until }: &Play) -> Result<Self, String> {
        let (deeds, until) = check_done(done, *until, product::named(&start.product)?)?;
        Ok(Player::new(deeds, until))
    }
}

/// A name is short, and one line.
fn check_name(name: &str, what: &str) -> Result<(), String> {
    let count = name.chars().count();
    if count > LONGEST_NAME {
        return Err(format!("{what} has {count} characters; {LONGEST_NAME} is the most"));
    }
    if name.chars().any(char::is_control) {
        return Err(format!("{what} has a control character"));
    }
    Ok(())
}

#[cfg(test)]
pub(crate) fn examples() -> Vec<(&'static str, serde_json::Value)> {
    use crate::types::{Contents, WorldText};
    use serde_json::json;
    let start = Start { product: "1140".into(), world: None, eeprom: None };
    let done = vec![String::from("5 MST 0")];
    let maker = SessionMaker { version: "0.1.0".into(), hash: "00".into() };
    let session = |made| Session {
        session: VERSION,
        title: "A turn".into(),
        made,
        start: start.clone(),
        texts: vec![NamedText { name: "a.tmc".into(), text: "STOP".into() }],
        curves: vec!["GAP 1, 0".into()],
        done: done.clone(),
        until: 9,
    };
    let read =
        SessionRead { session: session(None), name: "TMCM-1140".into(), lines: done.clone(), readings: 0, length: 1.5 };
    vec![
        ("Session", json!(session(Some(maker.clone())))),
        ("Session", json!(session(None))),
        ("SessionMaker", json!(maker)),
        ("SessionRead", json!(read)),
        ("SessionText", json!(SessionText { text: String::new() })),
        ("Play", json!(Play { start: start.clone(), done, until: 9 })),
        ("Contents", json!(Contents { eeprom: "ff".into() })),
        ("WorldText", json!(WorldText { text: String::new(), product: "1140".into() })),
    ]
}

#[cfg(test)]
mod links;
#[cfg(test)]
mod tests;
