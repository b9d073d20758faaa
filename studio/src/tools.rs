//! The tools at work on the module at the page's link: one job at a time.

use std::path::PathBuf;

use tmcl_tools::asm::{Settings, assemble_text};
use tmcl_tools::conversation::{ASK_VERSION, Conversation, Error};
use tmcl_tools::debug::{self, Action, Around, Debugger};
use tmcl_tools::failure::Failure;
use tmcl_tools::params;
use tmcl_tools::product;
use tmcl_tools::program::{Transfer, fits, transfer};
use tmcl_tools::progress::Progress;
use tmcl_tools::replies;
use tmcl_tools::request::Typed;
use tmcl_tools::wire::Wire;
use tmcm::tmcl::{Command, Opcode, Status};
use tmcm_sim::Product;

use crate::page::PageStop;
use crate::types::{Line, Module, Nothing, Products, Program, Reach, Text};

/// A command that every module with the TMCL firmware answers, and that changes nothing.
const PRESENT: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);
/// What is said of a module that carries out command 136 and refuses all others.
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
    module: Conversation,
    stop: PageStop,
}

/// A failure of a conversation, for doors.
fn failed(error: impl Into<Failure>) -> Failure {
    error.into()
}

impl Tools {
    /// The tools at the module with this address.
    pub fn connect(wire: Box<dyn Wire>, stop: PageStop, Reach { address, timeout }: &Reach) -> Self {
        let mut module = Conversation::new(wire, *address, None, |_| {});
        module.set_timeout(std::time::Duration::from_millis((*timeout).into()));
        Tools { module, stop }
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

    /// Assembles a program, puts it into the module, and gives it to the debugger.
    ///
    /// # Errors
    /// The program has mistakes, the module does not take it, or it has been asked to end.
    pub fn load(&mut self, program: &Program, progress: &mut dyn FnMut(Progress<'_>)) -> Result<Text, Failure> {
        let settings = Settings { product: self.module.product().map_err(failed)?, ..Settings::default() };
        let assembly = assemble_text(&program.name, &program.text, settings);
        let assembly = assembly.map_err(|mistakes| Failure::Failed(mistakes.to_string()))?;
        let assembled = tmcl_tools::program::Program::from(assembly);
        let warning = fits(&assembled, settings)?;
        let mut lines: Vec<String> = warning.into_iter().collect();
        transfer(&mut self.module, &assembled, Transfer::default(), &self.stop, progress, |done| {
            lines.push(done.to_string());
            Ok::<_, Failure>(())
        })?;
        if !program.debug.is_empty() {
            lines.extend(self.debug(program, assembled, progress)?);
        }
        Ok(Text { text: lines.join("\n"), done: true })
    }

    fn debug(
        &mut self,
        Program { name, debug: script, .. }: &Program,
        program: tmcl_tools::program::Program,
        progress: &mut dyn FnMut(Progress<'_>),
    ) -> Result<Vec<String>, Failure> {
        let mut debugger = Debugger::new(&mut self.module, PathBuf::from(name), program).map_err(failed)?;
        let mut read = |_: &std::path::Path, _| Err("the program is loaded from the page".into());
        let mut lines = Vec::new();
        for line in script {
            let action = Action::parse(line).map_err(Failure::Failed)?;
            let mut around = Around { stop: &self.stop, read: &mut read, progress };
            lines.push(debug::words::text(&debugger.act(&mut self.module, action, &mut around).map_err(failed)?));
        }
        Ok(lines)
    }
}

#[cfg(test)]
mod tests {
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

    fn tools(product: Product) -> Tools {
        let module = NativeModule::of(product, &WorldConfig::default(), None, 1);
        Tools::connect(Box::new(VirtualWire::new(module)), PageStop(CALLS), &Reach { address: 1, timeout: 1000 })
    }

    #[test]
    fn a_module_is_told_and_commanded() {
        let mut tools = tools(Product::Tmcm3110);
        let module = tools.identify(Nothing {}).unwrap();
        assert!(module.name.starts_with("TMCM-3110, firmware ") && module.product.as_deref() == Some("3110"));
        let mut send = |line: &str| tools.send(&Line { line: line.into() });
        let told = send("GAP 1, 2").unwrap();
        assert_eq!((told.text.as_str(), told.done), ("GAP 1, 2: 0 microsteps (actual position), status 100 ok", true));
        assert!(!send("MST 3").unwrap().done);
        assert!(send("GAP 300, 0").unwrap_err().to_string().contains("out of range"));
        assert!(send("dance").unwrap_err().to_string().contains("unknown command 'dance'"));
    }

    #[test]
    fn a_program_is_loaded_and_stepped_through() {
        let mut tools = tools(Product::Tmcm1140);
        let mut seen = Vec::new();
        let program = |text: &str, debug: &[&str]| {
            let debug = debug.iter().map(ToString::to_string).collect();
            Program { name: "page.tmc".into(), text: text.into(), debug }
        };
        let mut progress = |told: Progress<'_>| seen.push((told.done, told.total));
        let told =
            tools.load(&program("CALC LOAD, 5\nCALC MUL, 3\nSTOP", &["step", "step", "print acc"]), &mut progress);
        let told = told.unwrap().text;
        assert!(told.starts_with("loaded to addresses 0 to 2\n") && told.contains("15"), "{told}");
        let told = tools.load(&program("ROR 0, Sped", &[]), &mut |_| {}).unwrap_err().to_string();
        assert!(told.starts_with("page.tmc:1:8: error: unknown name 'Sped'"), "{told}");
        assert_eq!(seen.last(), Some(&(3, 3)));
    }
}
