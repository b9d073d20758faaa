//! Values of a module with the TMCL firmware that can be looked at while nobody notices: at no cost of time, without a
//! telegram, and without a change.

use tmcm::module::Spec;
use tmcm::param::{AxisParameter as P, GlobalParameter as G};
use tmcm::tmcl::{Command, Opcode, SEARCH_STATUS};

/// Whether reading a value by this command costs the module nothing, and changes nothing.
///
/// # Errors
/// Why it is not to be read so, and what to look at instead.
pub fn check(spec: &Spec, command: Command) -> Result<(), String> {
    let Command { opcode, kind, motor, .. } = command;
    match Opcode::from_number(opcode) {
        Some(Opcode::Gap) => match spec.axis.find(kind).map(|parameter| parameter.function) {
            Some(P::ExtendedErrorFlags) => Err(format!("'GAP {kind}, {motor}' clears what it reads: ask over a link")),
            Some(function) => of_a_chip(function).map_or(Ok(()), |instead| {
                let instead = instead.map_or("ask over a link".into(), |name| {
                    format!("use '{name}{}' of the world", if motor > 0 { format!(" {motor}") } else { String::new() })
                });
                Err(format!("'GAP {kind}, {motor}' would cost the module a datagram to a chip: {instead}"))
            }),
            None => Ok(()),
        },
        Some(Opcode::Ggp) => match spec.global.find(kind).filter(|_| motor == 0).map(|parameter| parameter.function) {
            Some(G::RandomNumber) => Err(format!("'GGP {kind}, {motor}' changes what it reads: ask over a link")),
            _ => Ok(()),
        },
        Some(Opcode::Gio) => Ok(()),
        Some(Opcode::Rfs) if kind == SEARCH_STATUS => Ok(()),
        _ => Err("only GAP, GGP, GIO and 'RFS STATUS' can be used here: others would cost the module time".into()),
    }
}

/// For a parameter that is read from a chip: the value of the world that shows it, if there is one. `None` for a
/// parameter in memory.
fn of_a_chip(function: P) -> Option<Option<&'static str>> {
    match function {
        P::ActualPosition => Some(Some("position")),
        P::ActualSpeed => Some(Some("velocity")),
        P::LeftSwitch => Some(Some("switches.left")),
        P::RightSwitch => Some(Some("switches.right")),
        P::TargetSpeed
        | P::ActualAcceleration
        | P::MeasuredSpeed
        | P::PwmScale
        | P::PwmMode
        | P::LatchedPosition
        | P::LatchedEncoderPosition
        | P::ChipEncoderPosition => Some(None),
        _ => None,
    }
}
