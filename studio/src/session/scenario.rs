//! Writes a session as a scenario, which `tmcl test` runs: with the values of its curves as what is expected.
//!
//! What a scenario says has to be so in `tmcl test`, too, so the session is done once more here, and what comes of it
//! is written down. Commands that only read are left out if that makes no difference to any of these values.

use std::task::Poll;

use hal_sim::clock::{MICROSECOND, Nanos};
use tmcm::tmcl::binary::decode_reply;
use tmcm_sim::client::Client;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::protocol::{Quantity, Seen};
use tmcm_sim::scenario::eeprom;
use tmcm_sim::{NativeModule, Product};

use super::deed::{Deed, What};
use super::{Checked, Session, SessionMaker, SessionText};
use crate::scope::{Curves, in_the_world_named, offers};
use crate::virtual_module::{fleet, of_the_core};
use crate::world;

/// The title of a session that has none.
const UNTITLED: &str = "A session of the studio";
/// Longest session, in nanoseconds: times in a scenario are an hour at most.
const LONGEST: Nanos = 3600 * 1_000_000 * MICROSECOND;

/// A session as a scenario.
///
/// # Errors
/// The session is not as it has to be, or lasts longer than times in a scenario.
pub fn write(session: &Session) -> Result<SessionText, String> {
    let Checked { product, deeds, until } = session.check()?;
    if until > LONGEST {
        return Err("it lasts longer than an hour, which is the longest time in a scenario".into());
    }
    let start = |deeds| Rehearsal::new(session, product, deeds, until);
    let whole = start(&deeds)?.done();
    let short: Vec<Deed> = deeds.iter().filter(|deed| !deed.what.only_reads()).cloned().collect();
    let shortened = start(&short)?.done();
    let values = |steps: &[Step]| -> Vec<Vec<f64>> {
        steps.iter().filter(|step| step.is_looked_at()).map(|step| step.seen.clone()).collect()
    };
    let left_out = whole.len() - shortened.len();
    let same = values(&whole) == values(&shortened);
    let (steps, left_out) = if same { (shortened, left_out) } else { (whole, 0) };
    Ok(SessionText { text: Writer { session, product, left_out }.text(&steps)? })
}

/// A step of a session that has been done: what was seen right before, and what came of it.
struct Step {
    at: Nanos,
    /// The values of the curves, right before.
    seen: Vec<f64>,
    /// The action that is done; nothing at the end.
    what: Option<What>,
    /// Status and value of the reply, if it has come before the next step.
    reply: Option<(u8, i32)>,
}

impl Step {
    /// Whether its values are expected: those right before something is changed, and those at the end.
    fn is_looked_at(&self) -> bool {
        self.what.as_ref().is_none_or(|what| !what.only_reads())
    }
}

/// Does a session, and notes what comes of it.
struct Rehearsal<'a> {
    fleet: Fleet<NativeModule>,
    /// The values that are looked at, one for each curve that a scenario can expect something of.
    curves: Vec<Quantity>,
    deeds: &'a [Deed],
    until: Nanos,
}

impl<'a> Rehearsal<'a> {
    fn new(session: &Session, product: Product, deeds: &'a [Deed], until: Nanos) -> Result<Self, String> {
        let world = world::config(&session.start)?;
        let eeprom = world::eeprom(&session.start, product)?;
        let fleet = fleet(product, &world, eeprom.as_deref(), &of_the_core())?;
        let curves = names(session, product).iter().map(|name| quantity(name, product)).collect::<Result<_, _>>()?;
        Ok(Rehearsal { fleet, curves, deeds, until })
    }

    fn done(mut self) -> Vec<Step> {
        let mut steps: Vec<Step> = Vec::new();
        let mut asked: Option<Client> = None;
        for deed in self.deeds {
            let seen = self.look(deed.at, asked, steps.last_mut());
            asked = deed.what.carry_out(&mut self.fleet);
            steps.push(Step { at: deed.at, seen, what: Some(deed.what.clone()), reply: None });
        }
        let seen = self.look(self.until, asked, steps.last_mut());
        steps.push(Step { at: self.until, seen, what: None, reply: None });
        steps
    }

    /// The values of the curves at a time, up to which the reply to the step before may have come.
    fn look(&mut self, at: Nanos, asked: Option<Client>, before: Option<&mut Step>) -> Vec<f64> {
        self.fleet.run_until(at);
        if let (Some(client), Some(step)) = (asked, before)
            && let Poll::Ready(Some(reply)) = self.fleet.reply_to(client)
            && let Some(What::Command(command)) = &step.what
        {
            let reply = decode_reply(&reply).filter(|reply| reply.opcode == command.opcode);
            step.reply = reply.map(|reply| (reply.status, reply.value));
        }
        let Some(module) = self.fleet.modules_mut().first_mut() else { return Vec::new() };
        let mut seen = Seen(module);
        self.curves.iter().map(|curve| curve.read(&mut seen).unwrap_or_default()).collect()
    }
}

/// The names of the values of the world that the curves of a session show, as scenarios have them.
fn names(session: &Session, product: Product) -> Vec<String> {
    // As the page shows a session that names none.
    let usual = || {
        let product = Some(session.start.product.clone());
        offers(&Curves { address: 1, product, is_virtual: true, texts: Vec::new() }).usual
    };
    let curves = if session.curves.is_empty() { usual() } else { session.curves.clone() };
    let mut names: Vec<String> = Vec::new();
    for name in curves.iter().filter_map(|curve| in_the_world_named(curve, product)) {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    names
}

fn quantity(name: &str, product: Product) -> Result<Quantity, String> {
    let words: Vec<&str> = name.split_whitespace().collect();
    Quantity::leading(&words, product.kind()).map(|(quantity, _)| quantity)
}

/// Puts steps into lines.
struct Writer<'a> {
    session: &'a Session,
    product: Product,
    /// How many commands that only read are left out.
    left_out: usize,
}

impl Writer<'_> {
    fn text(&self, steps: &[Step]) -> Result<String, String> {
        let Session { title, made, start, .. } = self.session;
        let mut lines = vec![match made {
            Some(SessionMaker { version, hash }) => format!("# A session of the TMCL studio {version} ({hash})."),
            None => "# A session of the TMCL studio.".into(),
        }];
        if self.left_out > 0 {
            lines.push(format!(
                "# Commands that only read make no difference here, and are left out: {}.",
                self.left_out
            ));
        }
        // A '#' would begin a comment.
        let title = title.replace('#', " ");
        let title = Some(title.trim_matches(['=', ' '])).filter(|title| !title.is_empty()).unwrap_or(UNTITLED);
        lines.extend([
            String::new(),
            format!("== {title}"),
            String::new(),
            format!("product: {}", self.product.name()),
        ]);
        if let Some(world) = &start.world {
            lines.push("world:".into());
            lines.extend(world.lines().filter(|line| !line.trim().is_empty()).map(|line| format!("  {line}")));
        }
        if let Some(contents) = world::eeprom(start, self.product)? {
            lines.push("eeprom:".into());
            lines.extend(eeprom::lines(&contents).iter().map(|line| format!("  {line}")));
        }
        lines.push(String::new());
        let names = names(self.session, self.product);
        for step in steps {
            lines.push(format!("at {} us", step.at / MICROSECOND));
            if step.is_looked_at() {
                lines.extend(names.iter().zip(&step.seen).map(|(name, value)| format!("expect {name} = {value}")));
            }
            lines.extend(step.what.as_ref().map(|what| done(what, step.reply)));
        }
        Ok(lines.join("\n") + "\n")
    }
}

/// The line of something that is done.
fn done(what: &What, reply: Option<(u8, i32)>) -> String {
    match (what, reply) {
        (What::Command(command), Some((status, value))) => format!("{} -> {status} {value}", command),
        (What::Command(command), None) => format!("post {}", command),
        (What::Around(line, _), _) => format!("control {line}"),
    }
}
