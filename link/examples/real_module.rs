//! Moves an axis of a module, stores a parameter and downloads a program:
//! `cargo run -p tmcl-link --example real_module -- /dev/ttyACM0`, or the HOST:PORT of `tmcl sim --tcp`.

use std::time::Duration;

use tmcl_link::Link;
use tmcl_tools::asm::{assemble_text, command, names};
use tmcl_tools::conversation::Conversation;
use tmcl_tools::program::download;
use tmcl_tools::stop::Never;
use tmcm::param::AxisParameter;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let port = std::env::args().nth(1).ok_or("give a serial device, or HOST:PORT")?;
    let (baud, timeout) = (9600, Duration::from_secs(1));
    let link = if port.contains(':') { Link::tcp(&port, timeout)? } else { Link::serial(&port, baud, timeout)? };
    let mut module = Conversation::new(Box::new(link), 1, None, |note| eprintln!("{note}"));
    let product = module.product()?;
    for line in ["SAP APMaxPositioningSpeed, 0, 1500", "STAP APMaxPositioningSpeed, 0", "MVP REL, 0, 51200"] {
        module.request(command(line, product, &names(product))?)?;
    }
    while module.axis(0, AxisParameter::PositionReached)? == 0 {
        module.pause(Duration::from_millis(10), &Never);
    }
    println!("at {}", module.axis(0, AxisParameter::ActualPosition)?);
    let program = assemble_text("turn.tmc", "Loop: ROR 0, 500\nWAIT TICKS, 0, 100\nMST 0\nJA Loop", product)?;
    Ok(download(&mut module, &program.into(), 0, &Never, &mut |_| {})?)
}
