//! The contents of a module where a program is to go.

use tmcm::tmcl::Command;

use super::{Program, is_readable};
use crate::conversation::Conversation;
use crate::failure::Failure;
use crate::progress::Progress;
use crate::stop::Stop;

/// The contents of a module's program memory, beside a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum There {
    /// The same program.
    Same,
    /// No command at all where the program is to go.
    Nothing,
    /// Something else, which loading would overwrite.
    Other {
        /// The address of the first command that differs.
        address: u16,
        /// The command that stands there.
        found: Command,
    },
    /// The program memory is protected from being read (global parameter 81), so nobody can tell.
    Unknown,
}

/// Looks at what a module has at the addresses of a program, from `at` on, up to the first command that is neither the
/// program's nor empty.
///
/// # Errors
/// The link fails, or it is to end.
pub fn there(
    module: &mut Conversation,
    program: &Program,
    at: u16,
    stop: &dyn Stop,
    progress: &mut dyn FnMut(Progress<'_>),
) -> Result<There, Failure> {
    if !is_readable(module)? {
        return Ok(There::Unknown);
    }
    let total = program.commands.len();
    let mut reach = |done| progress(Progress { what: "looking at the program in the module", done, total });
    reach(0);
    let mut first_empty = None;
    let mut is_empty = true;
    for (done, (address, wanted)) in (1..).zip(program.at_addresses(at)) {
        if stop.happened() {
            return Err(stop.interrupted("interrupted; nothing has been changed"));
        }
        let found = module.memory(address)?;
        let nothing = found == Command::default();
        is_empty &= nothing;
        if found != wanted {
            if !nothing {
                return Ok(There::Other { address, found });
            }
            first_empty.get_or_insert((address, found));
        }
        reach(done);
    }
    Ok(match first_empty {
        None => There::Same,
        Some(_) if is_empty => There::Nothing,
        // A beginning that is the same, with nothing behind it.
        Some((address, found)) => There::Other { address, found },
    })
}

#[cfg(test)]
mod tests {
    use hal_sim::world::config::WorldConfig;
    use tmcm_sim::{NativeModule, Product};

    use super::*;
    use crate::program::download;
    use crate::stop::Never;
    use crate::wire::VirtualWire;

    #[test]
    fn another_program_is_told_by_its_first_command_that_differs() {
        let module = NativeModule::of(Product::Tmcm1140, &WorldConfig::default(), None, 1);
        let mut module = Conversation::new(Box::new(VirtualWire::new(module)), 1, None, |_| {});
        let program = |lines: &[&str]| -> Program {
            lines.iter().map(|line| tmcm::tmcl::text::parse(line).unwrap()).collect::<Vec<_>>().into()
        };
        let mine = program(&["ROR 0, 500", "WAIT TICKS, 0, 10", "STOP"]);
        let look =
            |module: &mut Conversation, program: &Program| there(module, program, 0, &Never, &mut |_| {}).unwrap();
        assert_eq!(look(&mut module, &mine), There::Nothing);
        download(&mut module, &mine, 0, &Never, &mut |_| {}).unwrap();
        assert_eq!(look(&mut module, &mine), There::Same);
        let longer = program(&["ROR 0, 500", "WAIT TICKS, 0, 10", "STOP", "STOP"]);
        assert_eq!(look(&mut module, &longer), There::Other { address: 3, found: Command::default() });
        let other = program(&["ROR 0, 500", "MST 0"]);
        let found = tmcm::tmcl::text::parse("WAIT TICKS, 0, 10").unwrap();
        assert_eq!(look(&mut module, &other), There::Other { address: 1, found });
        assert_eq!(look(&mut module, &program(&[])), There::Same);
    }
}
