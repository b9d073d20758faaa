//! Figures of the CANopen image: how soon it answers, what cyclic masters cost, and whether it loses frames.

use hal_sim::board::Chip;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::mcu::{Act, Step};

use super::host::Failure;
use super::load::{self, Load, OWNERS};
use super::master::{EMERGENCY, Heard, Master, NEXT_PDO, PDOS, RECEIVED, REPLY, REQUEST, SYNC, TRANSMITTED, VELOCITY};
use super::master::{upload, write};
use super::parallel;
use super::report::{Report, progress};
use super::statistics::{Spread, grouped, microseconds};

/// A message to the node, and the event that is waited for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Subject {
    /// An SDO request, and its reply.
    Sdo([u8; 8]),
    /// A PDO with another target velocity, and the end of the datagram that tells it to the TMC429.
    TargetVelocity,
    /// The SYNC, and the first PDO.
    Sync,
}

impl Subject {
    pub(crate) const UPLOAD: Self = Subject::Sdo(upload(0x1000, 0));
    pub(crate) const DOWNLOAD: Self = Subject::Sdo(write(0x6083, 0, &1_000_u32.to_le_bytes()));
}

const SUBJECTS: [(&str, Subject); 5] = [
    ("SDO upload of 1000h", Subject::UPLOAD),
    ("SDO upload of 6041h", Subject::Sdo(upload(0x6041, 0))),
    ("SDO download of 6083h", Subject::DOWNLOAD),
    ("RPDO of 6040h, 60FFh: end of its datagram", Subject::TargetVelocity),
    ("SYNC: first of four TPDOs", Subject::Sync),
];
/// Places of those that the budgets are about.
const UPLOAD: usize = 0;
const TARGET: usize = 3;
const FIRST: usize = 4;

/// How the samples' distances from the millisecond's turn differ. A thousand of them meet it in each microsecond.
const SHIFT: Nanos = 137 * MICROSECOND;
/// Number of SYNCs for each sample of another kind.
const SYNCS: usize = 20;
/// The velocity at which the motor turns at first.
const SPEED: i32 = 500;
/// First byte of the datagram that tells the first motor's target velocity.
const V_TARGET: u8 = 0x08;

/// The work of a master while the load is observed: name, target velocity, distance of its SYNCs.
const LOADS: [(&str, Option<i32>, Option<Nanos>); 4] = [
    ("at rest", None, None),
    ("profile velocity mode", Some(SPEED), None),
    ("the same, eight PDOs by SYNC every 2.5 ms", Some(SPEED), Some(2_500 * MICROSECOND)),
    ("the same, eight PDOs by SYNC every millisecond", Some(SPEED), Some(MILLISECOND)),
];
/// Place of that which the budget is about.
const EIGHT_PDOS: usize = 2;

/// Frames of a burst.
const BURST: usize = 300;
/// Number of SYNCs after which a PDO is sent that counts them.
const COUNTED: u8 = 100;

/// From the last bit of a frame in to what is waited for.
#[derive(Debug, Default)]
struct Samples {
    cycles: Vec<u64>,
    /// The same where the core's waits for the flash memory take time.
    stalled: Vec<u64>,
    /// Cycles less those in which the SPI wire was busy or the core slept.
    share: Vec<u64>,
    /// Of the SYNC: cycles between the end of a PDO and the beginning of the next.
    gaps: Vec<u64>,
}

/// The figures that the budgets are about.
#[derive(Debug, Default)]
pub(crate) struct Canopen {
    /// An SDO upload without an access to a chip: the median.
    pub(crate) upload: u64,
    /// A new target velocity by PDO, CPU share: the median.
    pub(crate) target: u64,
    /// From SYNC to the first PDO.
    pub(crate) sync: Spread,
    /// The same of 99 of 100; of few samples it depends on where they lie in the millisecond.
    pub(crate) sync_p99: Option<u64>,
    /// The longest gap between two of the PDOs that follow it.
    pub(crate) gap: u64,
    /// Share of the core that the owner takes less the SPI wire with eight PDOs, in millionths.
    pub(crate) owner: u64,
    /// Frames of bursts that were lost.
    pub(crate) lost: u64,
}

/// Measures the image.
pub(crate) fn measure(elf: &[u8], samples: usize, span: Nanos, report: &mut Report) -> Result<Canopen, Failure> {
    let mut figures = Canopen::default();
    answers(elf, samples, &mut figures, report)?;
    loads(elf, span, &mut figures, report)?;
    figures.lost = bursts(elf, report)?;
    Ok(figures)
}

fn answers(elf: &[u8], samples: usize, figures: &mut Canopen, report: &mut Report) -> Result<(), Failure> {
    let measured = parallel::map(&SUBJECTS, |(name, subject)| {
        progress(&format!("CANopen: {name}"));
        let samples = if *subject == Subject::Sync { SYNCS * samples } else { samples };
        let mut plain = sample(elf, *subject, samples, false)?;
        plain.stalled = sample(elf, *subject, samples, true)?.cycles;
        Ok(plain)
    })?;
    report.title("CANopen: replies and PDOs");
    report.text(
        "As above over CAN at 1 Mbit/s, at varied distances from the millisecond's turn: from the last bit in to the first \
         bit out; of the PDO with a target velocity to the end of the datagram that tells it to the TMC429. The motor stands \
         for SDO, with PDOs off, and turns in profile velocity mode for the others, with four TPDOs that are sent by SYNC. \
         Frames on the emulated bus have no stuff bits.",
    );
    let rows: Vec<[String; 7]> =
        SUBJECTS.iter().zip(&measured).map(|((name, _), samples)| row(name, samples)).collect();
    report.table(["", "cycles", "99 %", "most", "us", "stalls", "CPU share"], &rows);
    let [gap, p99, most, _] = Spread::of(measured[FIRST].gaps.clone()).cells();
    report.text(&format!(
        "Between two of the four TPDOs after a SYNC the bus is idle for {gap} cycles as a median, {p99} of 99 %, {most} at \
         most."
    ));
    figures.upload = Spread::of(measured[UPLOAD].cycles.clone()).median;
    figures.target = Spread::of(measured[TARGET].share.clone()).median;
    figures.sync = Spread::of(measured[FIRST].cycles.clone());
    figures.sync_p99 = (samples * SYNCS >= 1000).then_some(figures.sync.p99);
    figures.gap = Spread::of(measured[FIRST].gaps.clone()).max;
    Ok(())
}

fn row(name: &str, samples: &Samples) -> [String; 7] {
    let spread = Spread::of(samples.cycles.clone());
    let [median, p99, most, _] = spread.cells();
    let stalls = Spread::of(samples.stalled.clone()).median.saturating_sub(spread.median);
    let share = Spread::of(samples.share.clone()).median;
    [name.into(), median, p99, most, microseconds(spread.median), format!("+{}", grouped(stalls)), grouped(share)]
}

fn sample(elf: &[u8], subject: Subject, count: usize, stalls: bool) -> Result<Samples, Failure> {
    let mut master = ready(elf, subject)?;
    master.machine.set_flash_stalls(stalls);
    let mut samples = Samples::default();
    for n in 0..count {
        let once = once(&mut master, subject, n)?;
        samples.cycles.push(once.cycles());
        samples.share.push(once.share());
        samples.gaps.extend(once.gaps);
    }
    Ok(samples)
}

/// The steps of the sample that takes as long as half of `count`.
pub(crate) fn median(elf: &[u8], subject: Subject, count: usize) -> Result<Vec<Step>, Failure> {
    let mut master = ready(elf, subject)?;
    let mut all = (0..count).map(|n| once(&mut master, subject, n)).collect::<Result<Vec<Once>, Failure>>()?;
    all.sort_by_key(Once::cycles);
    Ok(all.swap_remove(count / 2).steps)
}

/// The observations of one sample.
struct Once {
    begin: u64,
    end: u64,
    /// The steps between.
    steps: Vec<Step>,
    gaps: Vec<u64>,
}

impl Once {
    fn new(begin: u64, end: u64, mut steps: Vec<Step>) -> Self {
        steps.retain(|step| (begin..end).contains(&step.at));
        Once { begin, end, steps, gaps: Vec::new() }
    }

    fn cycles(&self) -> u64 {
        self.end - self.begin
    }

    /// Cycles less those in which the SPI wire was busy or the core slept.
    fn share(&self) -> u64 {
        let idle = self.steps.iter().filter(|step| step.clocked || step.act == Act::Sleep);
        self.cycles().saturating_sub(idle.map(|step| step.cycles.min(self.end - step.at)).sum())
    }
}

fn once(master: &mut Master, subject: Subject, n: usize) -> Result<Once, Failure> {
    // What was sent and done before is over. Each sample comes the same time later in its millisecond than the one
    // before: so a thousand of them come at as many places.
    master.run(2 * MILLISECOND + SHIFT)?;
    let mut steps = Vec::new();
    match subject {
        Subject::Sdo(request) => {
            let (asked, reply) = master.observe(request, &mut |step| steps.push(step))?;
            Ok(Once::new(asked, reply.begin, steps))
        }
        Subject::TargetVelocity => target_velocity(master, SPEED + 1 + n as i32),
        Subject::Sync => sync(master),
    }
}

fn ready(elf: &[u8], subject: Subject) -> Result<Master, Failure> {
    if let Subject::Sdo(_) = subject { Master::start(elf) } else { turning(elf) }
}

/// A node in profile velocity mode whose motor turns, and which sends its four PDOs by SYNC.
pub(crate) fn turning(elf: &[u8]) -> Result<Master, Failure> {
    let mut master = Master::enabled(elf, VELOCITY)?;
    master.synchronise(0)?;
    master.write(0x60FF, 0, &SPEED.to_le_bytes())?;
    master.run(500 * MILLISECOND)?;
    master.heard();
    Ok(master)
}

fn target_velocity(master: &mut Master, target: i32) -> Result<Once, Failure> {
    master.machine.board().take_datagrams();
    let asked = master.turn_at(0xF, target);
    let mut steps = Vec::new();
    master.watch(2 * MILLISECOND, &mut |step| steps.push(step))?;
    let told = master.machine.board().take_datagrams();
    let told = told.iter().filter(|datagram| datagram.chip == Chip::Tmc429(0)).rev();
    let last = told.map(|datagram| datagram.bytes.first()).position(|first| first == Some(&V_TARGET));
    let ends = ends(&steps);
    let done = last.and_then(|last| ends.iter().rev().nth(last)).ok_or("no datagram tells the target velocity")?;
    Ok(Once::new(asked, *done, steps))
}

/// The cycles at which datagrams to the TMC429 ended; one that has begun before the steps is among them, and one that
/// ends after them.
fn ends(steps: &[Step]) -> Vec<u64> {
    let mut ends: Vec<u64> = Vec::new();
    for step in steps.iter().filter(|step| step.chip == Some(Chip::Tmc429(0))) {
        match ends.last_mut() {
            Some(end) if *end == step.at => *end += step.cycles,
            _ => ends.push(step.at + step.cycles),
        }
    }
    ends
}

fn sync(master: &mut Master) -> Result<Once, Failure> {
    master.heard();
    let asked = master.send(SYNC, &[]);
    let mut steps = Vec::new();
    master.watch(MILLISECOND, &mut |step| steps.push(step))?;
    let pdos: Vec<Heard> = master.heard().into_iter().filter(is_pdo).collect();
    let [first, .., _] = *pdos else { return Err("no PDOs after the SYNC".into()) };
    if pdos.len() != PDOS as usize {
        return Err(format!("{} PDOs after the SYNC", pdos.len()).into());
    }
    let gaps = pdos.windows(2).map(|two| two[1].begin.saturating_sub(two[0].end)).collect();
    Ok(Once { gaps, ..Once::new(asked, first.begin, steps) })
}

/// Whether a frame of the node is a PDO.
fn is_pdo(heard: &Heard) -> bool {
    (0..PDOS).any(|pdo| heard.frame.id == TRANSMITTED + pdo * NEXT_PDO)
}

fn loads(elf: &[u8], span: Nanos, figures: &mut Canopen, report: &mut Report) -> Result<(), Failure> {
    let loads = parallel::map(&LOADS, |(name, target, every)| {
        progress(&format!("CANopen: load: {name}"));
        observe(elf, *target, *every, span)
    })?;
    figures.owner = loads[EIGHT_PDOS].share_of(&OWNERS);
    report.title("CANopen: load of the core");
    report.text(
        "The owner of the node is the handlers of TIM3 and of CAN1: frames are received and sent in the latter. The eight PDOs \
         are those of the defaults: four from the master, the last with another target velocity each time, then the SYNC, \
         then four of the node. Frames for others do not come this far.",
    );
    load::table(LOADS.iter().map(|(name, ..)| *name).zip(&loads), &OWNERS, span, report);
    Ok(())
}

fn observe(elf: &[u8], target: Option<i32>, every: Option<Nanos>, span: Nanos) -> Result<Load, Failure> {
    let mut master = Master::enabled(elf, VELOCITY)?;
    master.synchronise(PDOS as u16)?;
    if let Some(target) = target {
        master.write(0x60FF, 0, &target.to_le_bytes())?;
    }
    master.run(500 * MILLISECOND)?;
    let before = load::datagrams(&mut master.machine);
    let mut load = Load::default();
    let mut watched = 0;
    while watched < span {
        if let Some(every) = every {
            master.send_all(0xF, VELOCITY, target.unwrap_or_default() + (watched / every % 50) as i32);
        }
        let step = every.unwrap_or(span).min(span - watched);
        master.watch(step, &mut |step| load.add(&step))?;
        watched += step;
    }
    load.count_datagrams(before, &mut master.machine);
    Ok(load)
}

/// Sends frames back to back, and counts those that are lost: by what the node does not answer, and by the emergencies
/// that tell of a loss.
fn bursts(elf: &[u8], report: &mut Report) -> Result<u64, Failure> {
    progress("CANopen: bursts");
    let [syncs, mixed] = [burst(elf, COUNTED, false)?, burst(elf, 1, true)?];
    report.title("CANopen: bursts");
    report.text(&format!(
        "{BURST} frames back to back while the motor turns: {syncs} lost of SYNCs alone, 47 us each; {mixed} lost of SYNC, a \
         PDO with the controlword, and an SDO upload in turn, each SYNC and upload of which is answered between them."
    ));
    Ok(syncs + mixed)
}

fn burst(elf: &[u8], counted: u8, mixed: bool) -> Result<u64, Failure> {
    let mut master = turning(elf)?;
    // The others would be on their way when the next SYNC comes.
    for pdo in 0..PDOS as u16 {
        master.write(0x1800 + pdo, 2, &[if pdo == 0 { counted } else { 0xF0 }])?;
    }
    master.run(10 * MILLISECOND)?;
    master.heard();
    for n in 0..BURST {
        match n % 3 {
            1 if mixed => master.send(RECEIVED, &[0xF, 0]),
            2 if mixed => master.send(REQUEST, &upload(0x1000, 0)),
            _ => master.send(SYNC, &[]),
        };
    }
    master.run(100 * MILLISECOND)?;
    let heard = master.heard();
    let count = |id: u32| heard.iter().filter(|heard| heard.frame.id == id).count();
    let (pdos, replies) = (count(TRANSMITTED), count(REPLY));
    let expected = if mixed { 2 * BURST / 3 } else { BURST / usize::from(counted) };
    Ok((expected.abs_diff(pdos + replies) + count(EMERGENCY)) as u64)
}
