//! Where the cycles of a reply, a poll or a program go: by function, in the order of the path, and in total.

use std::collections::HashMap;
use std::rc::Rc;

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use hal_sim::mcu::{Act, Machine, Step};

use super::arguments::Subject;
use super::canopen;
use super::host::{Failure, Host, Link, command};
use super::interrupts;
use super::load::OWNER;
use super::symbols::Symbols;

/// Exchanges of which the one with the median time is shown.
const SAMPLES: u64 = 21;
/// Their distance is a millisecond and this, so that they meet the poll at all its phases.
const SHIFT: Nanos = 137 * MICROSECOND;
/// Lines of the two tables.
const VISITS: usize = 200;
const FUNCTIONS: usize = 40;
/// Commands in a program's loop.
const LOOP: usize = 100;
/// Global parameter 128 while a program runs.
const RUNS: i32 = 1;

/// A visit of a function.
struct Visit {
    name: Rc<str>,
    depth: usize,
    /// When it begins, in cycles from the last bit in.
    start: u64,
    /// Cycles in it and in what it calls.
    cycles: u64,
    /// Cycles in the function itself.
    own: u64,
    instructions: u64,
}

/// Prints the profile of a subject.
pub(crate) fn run(elf: &[u8], symbols: &Symbols<'_>, subject: Subject<'_>) -> Result<(), Failure> {
    let steps = match subject {
        Subject::Reply(line, link) => reply(&mut Host::start(elf)?, line, link)?,
        Subject::Poll => {
            let mut host = Host::start(elf)?;
            host.tell_each(Link::Can, "ROR #, 1000")?;
            turn(&mut host.machine)?
        }
        Subject::Rest => turn(&mut Host::start(elf)?.machine)?,
        Subject::Program(line) => program(elf, line)?,
        Subject::Node(Some(frame)) => canopen::median(elf, frame, SAMPLES as usize)?,
        Subject::Node(None) => turn(&mut canopen::turning(elf)?.machine)?,
    };
    let cycles: u64 = steps.iter().map(|step| step.cycles).sum();
    match subject {
        Subject::Reply(..) => {}
        Subject::Node(Some(_)) => println!("from the last bit in: {cycles} cycles"),
        Subject::Poll | Subject::Rest | Subject::Program(_) | Subject::Node(None) => {
            println!("a turn of the owner of the module: {cycles} cycles");
        }
    }
    path(&steps, symbols);
    totals(&steps, symbols);
    Ok(())
}

/// The steps of a turn in which a program of such commands runs.
fn program(elf: &[u8], line: &str) -> Result<Vec<Step>, Failure> {
    let mut host = Host::start(elf)?;
    let program = std::iter::repeat_n(line.to_owned(), LOOP).chain(["JA 0".into()]);
    host.load(Link::Can, &program.collect::<Vec<_>>())?;
    host.tell(Link::Can, "129, 0, 0, 0")?;
    let steps = turn(&mut host.machine)?;
    if host.tell(Link::Can, "GGP 128, 0")? != RUNS {
        return Err(format!("{line}: the program ends with it; give a command that it goes on after").into());
    }
    Ok(steps)
}

/// The steps of the reply to `line` that takes as long as half of them.
fn reply(host: &mut Host, line: &str, link: Link) -> Result<Vec<Step>, Failure> {
    let command = command(line)?;
    let mut samples = Vec::new();
    for n in 0..SAMPLES {
        // The USB host's frames keep their distance from the poll while it is plugged in.
        if link == Link::Usb {
            host.machine.usb().plug(false);
            host.run(MILLISECOND + n * SHIFT)?;
            host.plug_usb()?;
        }
        host.run(n * SHIFT)?;
        let mut steps = Vec::new();
        let exchange = host.observe(link, command, &mut |step| steps.push(step))?;
        steps.retain(|step| exchange.has(step));
        samples.push((exchange, steps));
    }
    samples.sort_by_key(|(exchange, _)| exchange.cycles());
    let (exchange, steps) = samples.swap_remove(samples.len() / 2);
    println!(
        "{line}: {} cycles from the last bit in to the first bit out, status {}",
        exchange.cycles(),
        exchange.reply.status
    );
    Ok(steps)
}

/// The steps of the longest of some turns of the owner of the module, from when its timer wants it until it returns.
fn turn(machine: &mut Machine) -> Result<Vec<Step>, Failure> {
    machine.run(500 * MILLISECOND)?;
    let mut turns: Vec<Vec<Step>> = Vec::new();
    machine.observe_until(machine.now() + 5 * MILLISECOND, &mut |step| {
        if step.act == Act::Entry(OWNER) {
            turns.push(Vec::new());
        }
        if let Some(steps) = turns.last_mut().filter(|_| step.act != Act::Sleep) {
            steps.push(step);
        }
    })?;
    for steps in &mut turns {
        // What follows the return is not part of it.
        let end = steps.iter().rposition(|step| step.exception == OWNER);
        steps.truncate(end.map_or(0, |index| index + 1));
    }
    let cycles = |steps: &Vec<Step>| steps.iter().map(|step| step.cycles).sum::<u64>();
    Ok(turns.into_iter().max_by_key(cycles).unwrap_or_default())
}

fn path(steps: &[Step], symbols: &Symbols<'_>) {
    let visits = visits(steps, symbols);
    println!("\n{:>8} {:>8} {:>8} {:>8}  in the order of the path", "at", "cycles", "own", "instr.");
    let left = visits.len().saturating_sub(VISITS);
    for Visit { name, depth, start, cycles, own, instructions } in visits.into_iter().take(VISITS) {
        println!("{start:>8} {cycles:>8} {own:>8} {instructions:>8}  {:indent$}{name}", "", indent = 2 * depth);
    }
    if left > 0 {
        println!("{left:>8} more");
    }
}

/// The calls that the steps are made of. A jump to the start of a function is a call of it; a jump into the middle of
/// one that has been called is a return.
fn visits(steps: &[Step], symbols: &Symbols<'_>) -> Vec<Visit> {
    let mut visits: Vec<Visit> = Vec::new();
    // Those that are open: start of the function, index of the visit.
    let mut stack: Vec<(u32, usize)> = Vec::new();
    let begin = steps.first().map_or(0, |step| step.at);
    let mut asleep = false;
    for step in steps {
        let open = |name: Rc<str>, stack: &mut Vec<(u32, usize)>, visits: &mut Vec<Visit>, function| {
            let start = step.at - begin;
            visits.push(Visit { name, depth: stack.len(), start, cycles: 0, own: 0, instructions: 0 });
            stack.push((function, visits.len() - 1));
        };
        match step.act {
            Act::Entry(number) => {
                let name = interrupts::name(number).map(|name| format!(": {name}")).unwrap_or_default();
                open(format!("[exception {number}{name}]").into(), &mut stack, &mut visits, 0);
                asleep = false;
            }
            Act::Sleep => {
                if !asleep {
                    open("[asleep]".into(), &mut stack, &mut visits, 0);
                }
                asleep = true;
            }
            Act::Instruction | Act::Wait { .. } => {
                if asleep {
                    stack.pop();
                    asleep = false;
                }
                let (function, name) = symbols.function(step.pc);
                let top = stack.last().map(|(function, _)| *function);
                if top != Some(function) || (step.pc == function && stack.len() < 2) {
                    let caller = stack.iter().rposition(|(open, _)| *open == function);
                    match caller {
                        Some(index) if step.pc != function => stack.truncate(index + 1),
                        _ => open(name, &mut stack, &mut visits, function),
                    }
                }
            }
        }
        let instructions = match step.act {
            Act::Instruction => 1,
            Act::Wait { instructions } => instructions,
            Act::Entry(_) | Act::Sleep => 0,
        };
        for (_, index) in &stack {
            visits[*index].cycles += step.cycles;
        }
        if let Some((_, index)) = stack.last() {
            visits[*index].own += step.cycles;
            visits[*index].instructions += instructions;
        }
    }
    visits
}

fn totals(steps: &[Step], symbols: &Symbols<'_>) {
    let mut functions: HashMap<Rc<str>, (u64, u64)> = HashMap::new();
    let mut all = 0;
    for step in steps {
        let (name, instructions) = match step.act {
            Act::Instruction => (symbols.inlined(step.pc), 1),
            Act::Wait { instructions } => (symbols.inlined(step.pc), instructions),
            Act::Entry(_) => ("[exception entries]".into(), 0),
            Act::Sleep => ("[asleep]".into(), 0),
        };
        let entry = functions.entry(name).or_default();
        *entry = (entry.0 + step.cycles, entry.1 + instructions);
        all += step.cycles;
    }
    let mut functions: Vec<_> = functions.into_iter().collect();
    functions.sort_by(|(a, (x, _)), (b, (y, _))| y.cmp(x).then_with(|| a.cmp(b)));
    println!("\n{:>8} {:>8} {:>8}  in total, by function of the source", "cycles", "share", "instr.");
    for (name, (cycles, instructions)) in functions.into_iter().take(FUNCTIONS) {
        println!("{cycles:>8} {:>6.1} % {instructions:>8}  {name}", 100.0 * cycles as f64 / all.max(1) as f64);
    }
}
