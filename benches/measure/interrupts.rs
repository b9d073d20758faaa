//! How long interrupts wait, in a session with traffic on all links.

use std::collections::HashMap;
use std::rc::Rc;

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::mcu::{Act, Step};

use super::host::{FAST, Failure, Host, Link, command};
use super::load::OWNER;
use super::report::{Report, progress};
use super::statistics::{Spread, grouped, microseconds};
use super::symbols::Symbols;

/// The exception of interrupt 0.
const FIRST: u16 = 16;
/// Names of interrupts.
const NAMES: [(u16, &str); 7] = [
    (20, "CAN1_RX0"),
    (19, "CAN1_TX"),
    (29, "TIM3, owner of the module"),
    (39, "USART3, RS485"),
    (40, "EXTI15_10, encoder"),
    (50, "TIM5, time"),
    (67, "OTG_FS, USB"),
];
/// Time for a request and its reply over RS485, and by how much the rounds of requests differ.
const ROUND: Nanos = 2 * MILLISECOND;
const SHIFT: Nanos = 37 * MICROSECOND;
/// Rounds between two storing commands.
const STORE_EVERY: u64 = 8;
/// Places that mask interrupts, in the table.
const PLACES: usize = 6;

/// The name of the interrupt that comes as this exception.
pub(crate) fn name(exception: u16) -> Option<&'static str> {
    NAMES.iter().find(|(interrupt, _)| interrupt + FIRST == exception).map(|(_, name)| *name)
}

/// The observations so far.
#[derive(Default)]
struct Watch {
    /// Where the last step ended.
    end: u64,
    /// Interrupts that are wanted, and since when.
    since: HashMap<u16, u64>,
    wanted: [u32; 3],
    /// By interrupt, and whether it had to wait for its own handler.
    waits: HashMap<(u16, bool), Vec<u64>>,
    /// Handlers that have begun, the innermost last.
    handlers: Vec<u16>,
    /// Whether the owner was running when it was wanted again.
    behind_itself: bool,
    masked: Option<(u64, u32)>,
    /// Spans with interrupts masked: where they began, how long they were.
    spans: Vec<(u32, u64)>,
}

/// Watches a session for `span`.
pub(crate) fn measure(elf: &[u8], symbols: &Symbols<'_>, span: Nanos, report: &mut Report) -> Result<(), Failure> {
    progress("interrupts");
    let mut watch = Watch::default();
    session(elf, span, &mut |step| watch.add(&step))?;
    report.title("Interrupts");
    report.text(
        "From the time at which an interrupt is wanted to the first instruction of its handler, with the motor moving, \
         a program on its full fuel, storing, and requests on all links. The owner of the module looks at the clock and \
         the links before it returns: what comes while it runs is served then.",
    );
    let mut rows = Vec::new();
    for (interrupt, name) in NAMES {
        for (behind_itself, addition) in [(false, ""), (true, ", wanted while it runs")] {
            if let Some(waits) = watch.waits.get(&(interrupt, behind_itself)) {
                let [median, p99, max, _] = Spread::of(waits.clone()).cells();
                let most = microseconds(Spread::of(waits.clone()).max);
                rows.push([format!("{name}{addition}"), grouped(waits.len() as u64), median, p99, max, most]);
            }
        }
    }
    report.table(["", "times", "median", "99 %", "most", "most, us"], &rows);
    masked(&watch, symbols, report);
    Ok(())
}

fn masked(watch: &Watch, symbols: &Symbols<'_>, report: &mut Report) {
    let mut places: HashMap<Rc<str>, Vec<u64>> = HashMap::new();
    for (pc, cycles) in &watch.spans {
        places.entry(symbols.function(*pc).1).or_default().push(*cycles);
    }
    let mut places: Vec<(Rc<str>, u64, Spread)> =
        places.into_iter().map(|(name, spans)| (name, spans.len() as u64, Spread::of(spans))).collect();
    places.sort_by(|(a, _, x), (b, _, y)| y.max.cmp(&x.max).then_with(|| a.cmp(b)));
    let rows: Vec<[String; 5]> = places
        .into_iter()
        .take(PLACES)
        .map(|(name, times, spread)| {
            [format!("`{name}`"), grouped(times), grouped(spread.median), grouped(spread.max), microseconds(spread.max)]
        })
        .collect();
    report.text("Where interrupts are masked the longest:");
    report.table(["", "times", "median", "most", "most, us"], &rows);
}

fn session(elf: &[u8], span: Nanos, observer: &mut dyn FnMut(Step)) -> Result<(), Failure> {
    let mut host = Host::start_at(elf, FAST)?;
    host.plug_usb()?;
    host.run_program(Link::Can, &["GAP 1, 0", "CALC ADD, 1", "JA 0"])?;
    host.tell(Link::Can, "ROR 0, 1000")?;
    let end = host.machine.now() + span;
    let mut n: u64 = 0;
    while host.machine.now() < end {
        if n.is_multiple_of(STORE_EVERY) {
            host.send(Link::Can, command(&format!("SAP 4, 0, {}", 500 + n % 1000))?);
            host.send(Link::Can, command("STAP 4, 0")?);
        }
        host.send(Link::Rs485, command("GAP 5, 0")?);
        for link in [Link::Can, Link::Usb] {
            for line in ["GAP 1, 0", "GAP 5, 0", "GGP 66, 0"] {
                host.send(link, command(line)?);
            }
        }
        // All the time: a gap would hide what goes on in it.
        host.watch(ROUND + n % 8 * SHIFT, observer)?;
        n += 1;
    }
    Ok(())
}

impl Watch {
    fn add(&mut self, step: &Step) {
        // Of what was going on before, nobody knows since when.
        if step.at != self.end {
            self.handlers = Vec::from_iter(Some(step.exception).filter(|exception| *exception != 0));
            self.wanted = step.wanted;
            self.since.clear();
            self.masked = None;
        }
        self.end = step.at + step.cycles;
        self.want(step);
        match step.act {
            Act::Entry(number) => {
                self.handlers.push(number);
                if let Some(line) = number.checked_sub(FIRST)
                    && let Some(since) = self.since.remove(&line)
                {
                    let wait = (step.at + step.cycles).saturating_sub(since);
                    let behind_itself = number == OWNER && std::mem::take(&mut self.behind_itself);
                    self.waits.entry((line, behind_itself)).or_default().push(wait);
                }
            }
            // A return.
            _ if self.handlers.last().copied().unwrap_or_default() != step.exception => {
                while self.handlers.last().is_some_and(|handler| *handler != step.exception) {
                    self.handlers.pop();
                }
            }
            _ => {}
        }
        match (self.masked, step.masked) {
            (None, true) => self.masked = Some((step.at + step.cycles, step.pc)),
            (Some((since, pc)), false) => {
                self.spans.push((pc, step.at - since));
                self.masked = None;
            }
            _ => {}
        }
    }

    /// Notes what is wanted anew.
    fn want(&mut self, step: &Step) {
        for (word, (before, after)) in self.wanted.into_iter().zip(step.wanted).enumerate() {
            let mut new = after & !before;
            while new != 0 {
                let line = 32 * word as u16 + new.trailing_zeros() as u16;
                new &= new - 1;
                self.since.insert(line, step.at);
                if line + FIRST == OWNER {
                    self.behind_itself = self.handlers.contains(&OWNER);
                }
            }
        }
        self.wanted = step.wanted;
    }
}
