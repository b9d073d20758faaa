//! Commands to the firmware that come to the control port (`send`), and whose replies have not come yet.

use std::task::Poll;

use tmcm::tmcl::Command;
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Client;
use tmcm_sim::fleet::Fleet;
use tmcm_sim::wire::words::depends_on_unit_mode;
use tmcm_sim::wire::{Reply, stays_unanswered};
use tmcm_sim::{Product, binary::Telegram};

use super::answer::Told;
use super::controller::ControllerId;
use super::timekeeper::Finished;
use crate::request::{Answered, Typed};

/// Why there may be no reply.
const SILENCE: &str = "no reply; is the module's power on, its USB cable in, and its USB link in binary mode? With --image \
                       the cable is in for --tcp and --serial alone, until 'usb on'";

/// The replies that are waited for, oldest first.
#[derive(Debug, Default)]
pub struct Inquiries(Vec<Inquiry>);

#[derive(Debug)]
struct Inquiry {
    /// The connection that has asked.
    asker: ControllerId,
    client: Client,
    command: Command,
    /// The product of the module, unless the command was written in numbers and is answered in numbers.
    product: Option<Product>,
}

impl Inquiries {
    /// Sends a command to the module with this index. The answer is for `asker`.
    ///
    /// # Errors
    /// It is no command, or one with a name that the module's product does not have.
    pub fn ask(
        &mut self,
        asker: ControllerId,
        fleet: &mut Fleet<impl VirtualModule>,
        module: usize,
        command: &str,
    ) -> Result<(), String> {
        let product = fleet.product(module);
        let request = Typed::parse(command)?.request(product)?;
        let client = fleet.ask(module, request.command);
        let product = product.filter(|_| !request.numeric);
        self.0.push(Inquiry { asker, client, command: request.command, product });
        Ok(())
    }

    /// Takes those of which it is known how they end.
    pub fn finished(&mut self, fleet: &mut Fleet<impl VirtualModule>) -> Vec<Finished> {
        let mut finished = Vec::new();
        self.0.retain(|inquiry| match fleet.reply_to(inquiry.client) {
            Poll::Ready(reply) => {
                finished.push(inquiry.outcome(reply.as_ref()));
                false
            }
            Poll::Pending => true,
        });
        finished
    }

    /// Ends all of them without a reply.
    pub fn end(&mut self) -> Vec<Finished> {
        self.0.drain(..).map(|inquiry| inquiry.outcome(None)).collect()
    }
}

impl Inquiry {
    fn outcome(&self, reply: Option<&Telegram>) -> Finished {
        let Inquiry { asker, command, product, .. } = *self;
        let mut reply = reply.map(|reply| Reply::read(product, false, command, reply));
        if let Some(reply) = reply.as_mut().filter(|_| depends_on_unit_mode(product, command)) {
            // Which of the two units it is, another parameter of the axis decides.
            reply.unit = "";
        }
        let error = (reply.is_none() && !stays_unanswered(command)).then(|| SILENCE.into());
        (asker, Ok(Some(Told::Reply(Box::new(Answered { command: command.to_string(), reply, error })))))
    }
}
