//! A search over all bit rates of a link.

use super::scanner::{End, Scanner};
use super::search::{Event, Medium, Search};
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::stop::Stop;

/// Looks for modules. `open` opens the link, at a bit rate where it has one, in such a way that whoever answers is
/// taken. What it has opened is closed before it is called again. `hear` takes what there is to tell.
///
/// # Errors
/// No module answers, the link cannot be opened or fails, it has been asked to end, or `hear` fails.
pub fn search<E: From<Failure>>(
    wanted: &Search,
    mut open: impl FnMut(Option<u32>) -> Result<Conversation, E>,
    stop: &dyn Stop,
    mut hear: impl FnMut(Event<'_, E>) -> Result<(), E>,
) -> Result<(), E> {
    let rates: Vec<Option<u32>> = match &wanted.medium {
        Medium::Serial(rates) => rates.iter().copied().map(Some).collect(),
        Medium::Bytes | Medium::Can => vec![None],
    };
    let mut modules = 0;
    let mut heard = false;
    for (index, rate) in rates.iter().enumerate() {
        let mut scanner = match open(*rate) {
            Ok(module) => Scanner::new(module, wanted, *rate),
            // A serial adapter may not support all bit rates.
            Err(failure) if index > 0 => {
                hear(Event::Unavailable(failure))?;
                continue;
            }
            Err(failure) => return Err(failure),
        };
        if index > 0 {
            scanner.settle(stop);
        }
        let end = scanner.scan(stop, &mut hear)?;
        modules += scanner.modules;
        heard |= scanner.heard;
        let first = scanner.first.filter(|_| rates.len() > 1);
        // The serial device is closed before it is opened again at another bit rate.
        drop(scanner);
        match end {
            End::Complete => {}
            End::SingleModule => break,
            End::Interrupted => return Err(stop.interrupted("").into()),
        }
        if let Some(address) = first {
            let other = rates.iter().find(|other| *other != rate).copied().unwrap_or(*rate);
            let mut elsewhere = Scanner::new(open(other)?, wanted, other);
            elsewhere.settle(stop);
            if elsewhere.find(address, stop)?.is_some() {
                // The module answers at another bit rate, too: the link (a pseudo terminal, say) has no real bit rate,
                // and further bit rates would find the same modules.
                break;
            }
        }
    }
    let none = |why: &str| Err(Failure::Failed(why.into()).into());
    match modules {
        0 if heard => none(
            "no module answers, but something does: what came is not the reply of a module. Check what the link leads \
             to, its bit rate, and whether several modules have one address",
        ),
        0 => none("no module answers; check power and wiring, and try a longer --timeout"),
        _ => Ok(()),
    }
}
