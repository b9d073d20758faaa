//! Does natively what a page does with a virtual module: reads a list of steps from standard input, and prints what
//! comes of each. A test compares that with what comes of them in a browser, byte by byte.

use std::cell::Cell;
use std::io::Read;
use std::time::Duration;

use serde::Deserialize;
use tmcl_studio::running::Running;
use tmcl_studio::types::{Line, Request, Start};
use tmcl_studio::virtual_module::Virtual;

/// A step.
#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
enum Step {
    Start(Start),
    Ask(Request),
    Control(Line),
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    let steps: Vec<Step> = serde_json::from_str(&text)?;
    // A clock that goes on by a hundredth of a millisecond with each look.
    let ticks = Cell::new(0);
    let clock = || {
        ticks.set(ticks.get() + 10);
        Duration::from_micros(ticks.get())
    };
    let mut module = None;
    for step in steps {
        let Some(module) = (match step {
            Step::Start(start) => {
                module = Some(Virtual::start(&start, clock())?);
                continue;
            }
            _ => module.as_mut(),
        }) else {
            return Err("the first step starts a module".into());
        };
        let is_line = match step {
            Step::Ask(request) => {
                module.ask(request);
                false
            }
            Step::Control(line) => {
                module.control(&line, clock());
                true
            }
            Step::Start(_) => continue,
        };
        loop {
            let turn = module.turn(&clock);
            turn.lines.iter().for_each(|told| println!("{}", told.line));
            if let Some(finished) = turn.replies.first() {
                println!("{}", serde_json::to_string(&finished.outcome)?);
                break;
            }
            if is_line && turn.lines.iter().any(|told| told.ticket.is_some()) {
                break;
            }
        }
    }
    Ok(())
}
