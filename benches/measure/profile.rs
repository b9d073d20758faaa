//! Where the cycles of a reply go: by function, in the order of the path, and in total.

use std::collections::HashMap;
use std::rc::Rc;

use hal_sim::clock::MICROSECOND;
use hal_sim::mcu::{Act, Step};

use super::host::{Failure, Host, Link, command};
use super::symbols::Symbols;

/// Exchanges of which the one with the median time is shown.
const SAMPLES: u64 = 21;
/// Their distance is a millisecond and this, so that they meet the poll at all its phases.
const SHIFT: u64 = 137 * MICROSECOND;
/// Functions of the second table.
const LONGEST: usize = 40;

/// A visit of a function.
struct Visit {
    name: Rc<str>,
    depth: usize,
    /// When it begins, in cycles from the last bit in.
    start: u64,
    /// Cycles in it and in what it calls.
    cycles: u64,
    /// Those in itself.
    own: u64,
    instructions: u64,
}

/// Prints the profile of the reply to `line`.
pub(crate) fn run(elf: &[u8], symbols: &Symbols<'_>, line: &str, link: Link) -> Result<(), Failure> {
    let command = command(line)?;
    let mut host = Host::start(elf)?;
    let mut samples = Vec::new();
    if link == Link::Usb {
        host.plug_usb()?;
    }
    for n in 0..SAMPLES {
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
    path(&steps, symbols);
    totals(&steps, symbols);
    Ok(())
}

fn path(steps: &[Step], symbols: &Symbols<'_>) {
    let visits = visits(steps, symbols);
    println!("\n{:>8} {:>8} {:>8} {:>8}  in the order of the path", "at", "cycles", "own", "instr.");
    for Visit { name, depth, start, cycles, own, instructions } in visits {
        println!("{start:>8} {cycles:>8} {own:>8} {instructions:>8}  {:indent$}{name}", "", indent = 2 * depth);
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
                open(format!("[exception {number}]").into(), &mut stack, &mut visits, 0);
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
    for (name, (cycles, instructions)) in functions.into_iter().take(LONGEST) {
        println!("{cycles:>8} {:>6.1} % {instructions:>8}  {name}", 100.0 * cycles as f64 / all.max(1) as f64);
    }
}
