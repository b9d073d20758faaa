//! Commands, and what a module replies to them, with units and names.

use tmcm::tmcl::{Command, Status};
use tmcm_sim::wire::stays_unanswered;
use tmcm_sim::wire::words::{depends_on_unit_mode, needs_names};
use tmcm_sim::wire::{Meaning, Reply};

use crate::asm::check::no_such_motor;
use crate::conversation::{Conversation, Error};
use crate::product::Product;
use crate::request::Request;
use crate::wire::LinkError;

/// Sends a command and gives the reply in words. Of a value, motor or bank out of range that says which motor, bank or
/// set of axes the module does not have, if that is what is wrong.
pub fn ask(module: &mut Conversation, request: Request) -> Result<Meaning, Error> {
    let reply = reply_to(module, request)?;
    let mut meaning = Meaning::from(reply.as_ref());
    let is_out_of_range = reply.is_some_and(|reply| reply.status == Some(Status::InvalidValue as u8));
    let why = |product: Product| no_such_motor(product.spec(), request.command);
    // What the module is makes a difference only where one of the products does not have it.
    if is_out_of_range
        && Product::ALL.into_iter().any(|product| why(product).is_some())
        && let Some(why) = module.product()?.and_then(why)
    {
        meaning.text = format!("{}: {why}", meaning.text);
    }
    Ok(meaning)
}

/// Sends a command and gives the reply; `None` for a command that modules execute without a reply.
pub fn reply_to(module: &mut Conversation, Request { command, numeric }: Request) -> Result<Option<Reply>, Error> {
    match module.exchange(command) {
        Ok(telegram) => {
            let plain = Reply::read(None, false, command, &telegram);
            if numeric || !plain.done() || !needs_names(command) {
                return Ok(Some(plain));
            }
            let (product, in_chip) = units(module, command)?;
            Ok(Some(Reply::read(product, in_chip, command, &telegram)))
        }
        Err(LinkError::NoReply { bytes: 0 } | LinkError::Others { .. }) if stays_unanswered(command) => Ok(None),
        Err(error) => Err(Error::Link { command, error }),
    }
}

/// The unit of the values of a command, and the name of what they are of; empty where there is none.
pub fn unit_and_name(module: &mut Conversation, command: Command) -> Result<(&'static str, Option<String>), Error> {
    let (product, in_chip) = units(module, command)?;
    let Reply { unit, name, .. } = Reply::of_value(product, in_chip, command, 0);
    Ok((unit, name))
}

/// The product of the module, and whether the values of the command are in units of its chip.
fn units(module: &mut Conversation, command: Command) -> Result<(Option<Product>, bool), Error> {
    let product = module.product()?;
    Ok((product, depends_on_unit_mode(product, command) && module.is_in_chip_units(command.motor)?))
}
