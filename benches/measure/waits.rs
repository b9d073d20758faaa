//! How much longer a reply takes behind other work.

use hal_sim::clock::{MICROSECOND, MILLISECOND};

use super::host::{FAST, Failure, Host, Link, command};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{Spread, grouped, microseconds};

/// The request over RS485.
const ASKED: &str = "GAP 5, 0";
/// How the samples' distances from the poll differ.
const SHIFT: u64 = 137 * MICROSECOND;
/// Requests of a flood for each sample: more than the link carries meanwhile.
const FLOOD: usize = 24;
/// Samples between two storing commands, which take 5 to 10 ms.
const STORE_EVERY: usize = 8;

/// Other work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Work {
    Nothing,
    Motion,
    Arithmetic,
    ChipAccess,
    CanFlood,
    UsbFlood,
    Storing,
    All,
}

const ALL: [(Work, &str); 8] = [
    (Work::Nothing, "nothing"),
    (Work::Motion, "the motor moving"),
    (Work::Arithmetic, "a program of arithmetic on its full fuel"),
    (Work::ChipAccess, "a program of GAP 1 on its full fuel"),
    (Work::CanFlood, "a flood of GAP 1 over CAN"),
    (Work::UsbFlood, "a flood of GAP 1 over USB"),
    (Work::Storing, "storing over CAN"),
    (Work::All, "all of these"),
];

impl Work {
    fn has(self, other: Work) -> bool {
        self == other || self == Work::All
    }
}

/// The extra over the median with no other work, the largest of all kinds of work.
#[derive(Debug, Default)]
pub(crate) struct Waits {
    /// Of what 99 of 100 do not exceed; of fewer samples it would be the longest.
    pub(crate) p99: Option<u64>,
    pub(crate) max: u64,
}

/// Measures GAP 5 over RS485 behind all kinds of work.
pub(crate) fn measure(elf: &[u8], samples: usize, report: &mut Report) -> Result<Waits, Failure> {
    let all = parallel::map(&ALL, |(work, name)| {
        progress(&format!("waits behind: {name}"));
        ask(elf, *work, samples)
    })?;
    // The first is with nothing else.
    let quiet = Spread::of(all.first().cloned().unwrap_or_default()).median;
    let mut waits = Waits::default();
    let mut rows = Vec::new();
    for ((_, name), cycles) in ALL.into_iter().zip(all) {
        let extra = Spread::of(cycles.iter().map(|cycles| cycles.saturating_sub(quiet)).collect());
        if samples >= 100 {
            waits.p99 = waits.p99.max(Some(extra.p99));
        }
        waits.max = waits.max.max(extra.max);
        let [median, p99, max, _] = extra.cells();
        rows.push([name.into(), median, p99, max, microseconds(extra.max)]);
    }
    report.title("Waiting behind other work");
    report.text(&format!(
        "GAP 5 over RS485 at 115 200 bit/s, {samples} samples each: how much longer the reply takes than the {} cycles \
         of the median with no other work.",
        grouped(quiet)
    ));
    report.table(["behind", "median", "99 %", "most", "most, us"], &rows);
    Ok(waits)
}

fn ask(elf: &[u8], work: Work, samples: usize) -> Result<Vec<u64>, Failure> {
    let mut host = Host::start_at(elf, FAST)?;
    if work.has(Work::UsbFlood) {
        host.plug_usb()?;
    }
    let program: &[&str] = match work {
        Work::Arithmetic => &["CALC ADD, 1", "CALCX SWAP", "COMP 7", "JC EQ, 0", "JA 0"],
        Work::ChipAccess | Work::All => &["GAP 1, 0", "JA 0"],
        _ => &[],
    };
    if !program.is_empty() {
        host.run_program(Link::Can, program)?;
    }
    if work.has(Work::Motion) {
        host.tell(Link::Can, "ROR 0, 1000")?;
    }
    let mut cycles = Vec::new();
    for n in 0..samples {
        if work.has(Work::Storing) && n % STORE_EVERY == 0 {
            host.send(Link::Can, command(&format!("SAP 4, 0, {}", 500 + n % 1000))?);
            host.send(Link::Can, command("STAP 4, 0")?);
        }
        for (flood, link) in [(Work::CanFlood, Link::Can), (Work::UsbFlood, Link::Usb)] {
            if work.has(flood) {
                for _ in 0..FLOOD {
                    host.send(link, command("GAP 1, 0")?);
                }
            }
        }
        host.run(n as u64 * SHIFT % MILLISECOND)?;
        cycles.push(host.exchange(Link::Rs485, command(ASKED)?)?.cycles());
    }
    Ok(cycles)
}
