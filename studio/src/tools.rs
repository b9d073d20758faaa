//! The tools at work on the module at the page's link: one job at a time.

use tmcl_tools::conversation::{ASK_VERSION, Conversation, Error};
use tmcl_tools::debug::Debugger;
use tmcl_tools::failure::Failure;
use tmcl_tools::params;
use tmcl_tools::product;
use tmcl_tools::progress::Progress;
use tmcl_tools::replies;
use tmcl_tools::request::Typed;
use tmcl_tools::wire::Wire;
use tmcm::tmcl::{Command, Opcode, Status};
use tmcm_sim::Product;

use crate::page::PageStop;
use crate::types::{Line, Module, Nothing, Products, Reach, Text};

/// A command that every module with the TMCL firmware answers, and that changes nothing.
const PRESENT: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);
/// The note on a module that carries out command 136 and refuses all others.
const CANOPEN: &str = "this module tells what it is (command 136), and carries out nothing else of TMCL: it has the \
                       CANopen firmware, which a CANopen master commands over CAN";

/// The products that there are, the usual one first.
pub fn products(Nothing {}: Nothing) -> Products {
    let mut products: Vec<String> = Product::ALL.into_iter().map(|product| product::short(product).into()).collect();
    products.sort_by_key(|name| name != product::USUAL);
    Products { products }
}

/// The tools, with the module that they are at.
pub struct Tools {
    pub(crate) module: Conversation,
    pub(crate) stop: PageStop,
    /// The debugger of the program that was loaded last.
    pub(crate) debugger: Option<Debugger>,
}

/// A failure of a conversation, for doors.
pub(crate) fn failed(error: impl Into<Failure>) -> Failure {
    error.into()
}

impl Tools {
    /// The tools at the module with this address.
    pub fn connect(wire: Box<dyn Wire>, stop: PageStop, Reach { address, timeout }: &Reach) -> Self {
        let mut module = Conversation::new(wire, *address, None, |_| {});
        module.set_timeout(std::time::Duration::from_millis((*timeout).into()));
        Tools { module, stop, debugger: None }
    }

    /// The module that they are at.
    pub(crate) fn module(&mut self) -> &mut Conversation {
        &mut self.module
    }

    /// Asks the module what it is.
    ///
    /// # Errors
    /// It does not answer, or nothing but that: the CANopen firmware is commanded over CAN.
    pub fn identify(&mut self, Nothing {}: Nothing) -> Result<Module, Failure> {
        let told = self.module.value(ASK_VERSION);
        if let Err(error @ Error::Link { .. }) = told {
            return Err(error.into());
        }
        match self.module.request(PRESENT) {
            Err(error) if error.is(Status::NotAvailable) && told.is_ok() => {
                return Err(Failure::Failed(CANOPEN.into()));
            }
            Err(error @ Error::Link { .. }) => return Err(error.into()),
            _ => {}
        }
        let identity = self.module.identity().map_err(failed)?;
        let name = match identity.version {
            Some((major, minor)) => format!("TMCM-{}, firmware {major}.{minor:02}", identity.number),
            None => format!("TMCM-{}", identity.number),
        };
        Ok(Module { name, product: identity.product.map(|product| product::short(product).into()) })
    }

    /// Sends a command as it was typed, and gives its reply in words.
    ///
    /// # Errors
    /// It is no command, or the module does not answer.
    pub fn send(&mut self, Line { line }: &Line) -> Result<Text, Failure> {
        let typed = Typed::parse(line).map_err(Failure::Failed)?;
        let product = if typed.has_names() { self.module.product().map_err(failed)? } else { None };
        let request = typed.request(product).map_err(Failure::Failed)?;
        let meaning = replies::ask(&mut self.module, request).map_err(failed)?;
        Ok(Text { text: format!("{}: {}", request.command, meaning.text), done: meaning.done })
    }

    /// Reads all settings of the module, as a file of `tmcl params`.
    ///
    /// # Errors
    /// The module does not answer, or it has been asked to end.
    pub fn settings(&mut self, Nothing {}: Nothing, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Text, Failure> {
        let saved = params::save(&mut self.module, &self.stop, progress)?;
        Ok(Text { text: saved.text, done: true })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use hal_sim::world::config::WorldConfig;
    use tmcl_tools::wire::VirtualWire;
    use tmcm_sim::NativeModule;

    use super::*;
    use crate::page::Calls;

    /// Nobody asks to end.
    const CALLS: Calls = Calls {
        exchange: |_| Vec::new(),
        pause: |_| false,
        time: || std::time::Duration::ZERO,
        within: |_| false,
        forget: || (),
    };

    /// The tools at a fresh virtual module.
    pub(crate) fn tools(product: &str) -> Tools {
        let module = NativeModule::of(product::named(product).unwrap(), &WorldConfig::default(), None, 1);
        Tools::connect(Box::new(VirtualWire::new(module)), PageStop(CALLS), &Reach { address: 1, timeout: 1000 })
    }

    #[test]
    fn a_module_is_told_and_commanded() {
        let mut tools = tools("3110");
        let module = tools.identify(Nothing {}).unwrap();
        assert!(module.name.starts_with("TMCM-3110, firmware ") && module.product.as_deref() == Some("3110"));
        let mut send = |line: &str| tools.send(&Line { line: line.into() });
        let told = send("GAP 1, 2").unwrap();
        assert_eq!((told.text.as_str(), told.done), ("GAP 1, 2: 0 microsteps (actual position), status 100 ok", true));
        assert!(!send("MST 3").unwrap().done);
        assert!(send("GAP 300, 0").unwrap_err().to_string().contains("out of range"));
        assert!(send("dance").unwrap_err().to_string().contains("unknown command 'dance'"));
    }
}
