//! Moves an axis of a virtual module, stores a parameter and downloads a program:
//! `cargo run -p tmcl-tools --example virtual_module`. A real module is another `Wire`.

use hal_sim::world::config::WorldConfig;
use tmcl_tools::asm::{assemble_text, command, names};
use tmcl_tools::conversation::Conversation;
use tmcl_tools::program::download;
use tmcl_tools::stop::Never;
use tmcl_tools::wire::VirtualWire;
use tmcm::param::AxisParameter;
use tmcm_sim::{NativeModule, Product};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let module = NativeModule::of(Product::Tmcm1140, &WorldConfig::default(), None, 1);
    let mut module = Conversation::new(Box::new(VirtualWire::new(module)), 1, None, |note| eprintln!("{note}"));
    let product = module.product()?;
    for line in ["SAP APMaxPositioningSpeed, 0, 1500", "STAP APMaxPositioningSpeed, 0", "MVP ABS, 0, 51200"] {
        module.request(command(line, product, &names(product))?)?;
    }
    while module.axis(0, AxisParameter::PositionReached)? == 0 {
        module.pause(std::time::Duration::from_millis(10), &Never);
    }
    println!("at {} after {:?}", module.axis(0, AxisParameter::ActualPosition)?, module.time());
    let program = assemble_text("turn.tmc", "Loop: ROR 0, 500\nWAIT TICKS, 0, 100\nMST 0\nJA Loop", product)?;
    download(&mut module, &program.into(), 0, &Never, &mut |told| {
        println!("{}: {} of {}", told.what, told.done, told.total)
    })?;
    Ok(())
}
