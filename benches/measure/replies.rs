//! How soon the module answers, with nothing else to do.

use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::mcu::{Act, Step};
use tmcm::tmcl::Command;

use super::host::{FAST, FASTER, Failure, Host, Link, SLOW, command};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{Spread, grouped};

/// A command: its name in the table, and itself.
type Named = (&'static str, &'static str);

/// Commands that are sent to a module at rest.
const AT_REST: [Named; 5] = [
    ("GAP 5", "GAP 5, 0"),
    ("GGP 66", "GGP 66, 0"),
    ("unknown command", "99, 0, 0, 0"),
    ("GAP 1, one register of a chip", "GAP 1, 0"),
    ("SAP 4", "SAP 4, 0, 1000"),
];
/// Commands that make the module move, and change the target while it does. The first MVP after ROR has more to do.
const MOVING: [Named; 4] = [
    ("ROR", "ROR 0, 200"),
    ("MST", "MST 0"),
    ("MVP ABS, from rest", "MVP ABS, 0, 100000"),
    ("MVP ABS, target changed only", "MVP ABS, 0, 200000"),
];
const COMMANDS: usize = AT_REST.len() + MOVING.len();

/// The links, with the rate of RS485.
const LINKS: [(Link, u32, &str); 5] = [
    (Link::Rs485, SLOW, "RS485 at 9 600 bit/s"),
    (Link::Rs485, FAST, "RS485 at 115 200 bit/s"),
    (Link::Rs485, FASTER, "RS485 at 230 400 bit/s"),
    (Link::Can, SLOW, "CAN at 1 Mbit/s"),
    (Link::Usb, SLOW, "USB"),
];

/// The chips of axis 0, of which a board has some.
const CHIPS: [Chip; 3] = [Chip::Tmc429(0), Chip::Tmc262(0), Chip::Tmc5160(0)];

/// How the sample's distances from the poll differ.
const SHIFT: u64 = 137 * MICROSECOND;
/// How often the USB host's frames are moved against the poll.
const FRAMES: usize = 8;

/// The replies to a command.
#[derive(Debug, Default)]
struct Samples {
    /// From the last bit in to the first bit out.
    cycles: Vec<u64>,
    /// The same from the end of that last bit.
    turnaround: Vec<u64>,
    /// From the last bit in to the first bit out, where the core's waits for the flash memory take time.
    stalled: Vec<u64>,
    /// Cycles less those in which the SPI wire was busy or the core slept.
    share: Vec<u64>,
    /// Datagrams to the chips of axis 0.
    datagrams: [Vec<u64>; CHIPS.len()],
}

/// The figures that the budgets are about: medians.
#[derive(Debug, Default)]
pub(crate) struct Budgeted {
    /// Of replies without an access to a chip, the longest.
    pub(crate) plain: u64,
    /// The same from the end of the last bit.
    pub(crate) turnaround: u64,
    /// How much longer the core's waits for the flash memory make it, if they do.
    pub(crate) stalls: u64,
    /// CPU share of GAP 1.
    pub(crate) register: u64,
    /// CPU share and datagrams of MVP ABS.
    pub(crate) target: u64,
    pub(crate) datagrams: u64,
}

/// The figures of the links that the budgets are about.
#[derive(Debug, Default)]
pub(crate) struct Replies {
    /// At 9 600, 115 200 and 230 400 bit/s.
    pub(crate) slow: Budgeted,
    pub(crate) rs485: Budgeted,
    pub(crate) faster: Budgeted,
    pub(crate) can: Budgeted,
    pub(crate) usb: Budgeted,
}

impl Samples {
    /// Computes the cycles that the core's waits for the flash memory add to the median.
    fn added(&self) -> u64 {
        median(&self.stalled).saturating_sub(median(&self.cycles))
    }
}

impl Budgeted {
    fn of(all: &[Samples]) -> Self {
        let [gap, ggp, unknown, register, .., target] = all else { return Self::default() };
        let plain = [gap, ggp, unknown];
        Self {
            plain: plain.map(|samples| median(&samples.cycles)).into_iter().max().unwrap_or_default(),
            turnaround: plain.map(|samples| median(&samples.turnaround)).into_iter().max().unwrap_or_default(),
            stalls: plain.map(Samples::added).into_iter().max().unwrap_or_default(),
            register: median(&register.share),
            target: median(&target.share),
            datagrams: target.datagrams.iter().map(|counts| median(counts)).sum(),
        }
    }
}

fn median(samples: &[u64]) -> u64 {
    Spread::of(samples.to_vec()).median
}

/// Measures all commands on all links.
pub(crate) fn measure(elf: &[u8], samples: usize, report: &mut Report) -> Result<Replies, Failure> {
    let measured = sample_all(elf, samples, "replies")?;
    report.title("Replies");
    report.text(
        "With nothing else going on, at varied distances from the poll. First bit out is counted from the receiver's \
         interrupt, as one compares firmwares; the turnaround, a median, from the end of the request's last bit, as a \
         host sees it. On RS485 the interrupt comes in the middle of the stop bit; the other half of that belongs to \
         the host still, and no reply begins before it is over: 8 750 cycles at 9 600 bit/s, 729 at 115 200, 365 at \
         230 400. On CAN the interrupt comes at the end of the frame, on USB when the endpoint has taken the packet: \
         there both are the same. The first bit is out with the start bit, the start of the frame, or when the packet \
         is ready for the host. Cycles are those of a core that never waits for its flash memory; stalls are what these \
         waits add to the median in a second run. CPU share: less the time on the SPI wire and asleep, median.",
    );
    for ((.., name), all) in LINKS.into_iter().zip(&measured) {
        let rows: Vec<[String; 9]> =
            AT_REST.iter().chain(&MOVING).zip(all).map(|((name, _), samples)| row(name, samples)).collect();
        let head = [name, "first bit out", "99 %", "most", "us", "stalls", "turnaround", "CPU share", "datagrams"];
        report.table(head, &rows);
    }
    Ok(Replies::of(&measured))
}

/// Measures the same, and reports the medians alone, all links in one table.
pub(crate) fn measure_briefly(
    elf: &[u8],
    samples: usize,
    title: &str,
    report: &mut Report,
) -> Result<Replies, Failure> {
    let measured = sample_all(elf, samples, title)?;
    report.title(title);
    report.text("As those of the TMCM-1140 above: from the last bit in to the first bit out, medians, in cycles.");
    let names = AT_REST.iter().chain(&MOVING).map(|(name, _)| *name);
    let rows: Vec<[String; 1 + LINKS.len()]> = names
        .enumerate()
        .map(|(index, name)| {
            let cell = |link: usize| measured.get(link).and_then(|all| all.get(index)).map(|one| median(&one.cycles));
            std::array::from_fn(|column| match column.checked_sub(1) {
                Some(link) => cell(link).map_or_else(String::new, grouped),
                None => name.into(),
            })
        })
        .collect();
    let head = std::array::from_fn(|column| column.checked_sub(1).map_or("", |link| LINKS[link].2));
    report.table(head, &rows);
    Ok(Replies::of(&measured))
}

/// All samples, in the order of the links.
fn sample_all(elf: &[u8], samples: usize, title: &str) -> Result<Vec<Vec<Samples>>, Failure> {
    parallel::map(&LINKS, |(link, baud, name)| {
        progress(&format!("{title} over {name}"));
        let mut all = ask(&mut Host::start_at(elf, *baud)?, *link, samples)?;
        let mut host = Host::start_at(elf, *baud)?;
        host.machine.set_flash_stalls(true);
        for (samples, stalled) in all.iter_mut().zip(ask(&mut host, *link, samples)?) {
            samples.stalled = stalled.cycles;
        }
        Ok(all)
    })
}

impl Replies {
    fn of(measured: &[Vec<Samples>]) -> Self {
        let of = |link: usize| measured.get(link).map(|all| Budgeted::of(all)).unwrap_or_default();
        let [slow, rs485, faster, can, usb] = std::array::from_fn(of);
        Self { slow, rs485, faster, can, usb }
    }
}

fn row(name: &str, samples: &Samples) -> [String; 9] {
    let [median, p99, max, microseconds] = Spread::of(samples.cycles.clone()).cells();
    let stalls = format!("+{}", grouped(samples.added()));
    let turnaround = grouped(self::median(&samples.turnaround));
    let share = grouped(self::median(&samples.share));
    let datagrams: u64 = samples.datagrams.iter().map(|counts| self::median(counts)).sum();
    [name.into(), median, p99, max, microseconds, stalls, turnaround, share, datagrams.to_string()]
}

fn ask(host: &mut Host, link: Link, samples: usize) -> Result<Vec<Samples>, Failure> {
    let mut all: Vec<Samples> = (0..COMMANDS).map(|_| Samples::default()).collect();
    for n in 0..samples {
        if link == Link::Usb && n % samples.div_ceil(FRAMES) == 0 {
            host.machine.usb().plug(false);
            host.run(10 * MILLISECOND + n as u64 * SHIFT)?;
            host.plug_usb()?;
        }
        for (index, (_, line)) in AT_REST.iter().chain(&MOVING).enumerate() {
            host.run((n * COMMANDS + index) as u64 * SHIFT % MILLISECOND)?;
            let Command { value, .. } = command(line)?;
            // So that it changes something.
            let asked = Command { value: value + n as i32, ..command(line)? };
            sample(host, link, asked, &mut all[index])?;
        }
        host.tell(link, "MST 0")?;
        host.run(20 * MILLISECOND)?;
    }
    Ok(all)
}

fn sample(host: &mut Host, link: Link, command: Command, samples: &mut Samples) -> Result<(), Failure> {
    let mut steps: Vec<Step> = Vec::new();
    let exchange = host.observe(link, command, &mut |step| {
        if step.chip.is_some() || step.act == Act::Sleep {
            steps.push(step);
        }
    })?;
    steps.retain(|step| exchange.has(step));
    // Sleep reaches over the window's end where the core waits for what ends it.
    let waits = |step: &&Step| step.clocked || step.act == Act::Sleep;
    let idle: u64 = steps.iter().filter(waits).map(|step| step.cycles.min(exchange.answered - step.at)).sum();
    samples.cycles.push(exchange.cycles());
    samples.turnaround.push(exchange.turnaround());
    samples.share.push(exchange.cycles().saturating_sub(idle));
    for (counts, chip) in samples.datagrams.iter_mut().zip(CHIPS) {
        counts.push(datagrams(&steps, chip));
    }
    Ok(())
}

/// How often a chip was selected.
fn datagrams(steps: &[Step], chip: Chip) -> u64 {
    let mut end = None;
    let mut count = 0;
    for step in steps.iter().filter(|step| step.chip == Some(chip)) {
        count += u64::from(end != Some(step.at));
        end = Some(step.at + step.cycles);
    }
    count
}
