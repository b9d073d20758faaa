//! The warnings compared with what the firmware of each product says to the same commands.

use hal_sim::clock::SECOND;
use hal_sim::world::config::WorldConfig;
use tmcm::module::{Source, Spec};
use tmcm::param::AxisParameter;
use tmcm::tmcl::binary::{self, Received};
use tmcm::tmcl::{Field, Instruction, Opcode, Status};
use tmcm_sim::NativeModule;

use super::super::check;
use super::*;

/// A module that has just been switched on.
fn new_module(product: Product) -> NativeModule {
    NativeModule::of(product, &WorldConfig::default(), None, 1)
}

/// The status of a module's reply, if there is one.
fn status(module: &mut NativeModule, command: Command) -> Option<Status> {
    let sent = module.exchange(Source::Usb, binary::encode_command(1, command), 10 * SECOND)?;
    let Received { status, .. } = binary::decode_reply(&sent.telegram()?)?;
    Status::from_number(status)
}

/// Whether a module refuses a command for what it says, whatever the state of the module is.
fn refuses(module: &mut NativeModule, product: Product, command: Command) -> bool {
    let status = status(module, command).or_else(|| {
        // The command before this one was the setting that keeps a module from answering.
        *module = new_module(product);
        status(module, command)
    });
    match status {
        Some(Status::Ok | Status::NotAvailable) => false,
        Some(Status::InvalidCommand | Status::WrongType | Status::InvalidValue) => true,
        other => panic!("{command}: {other:?}"),
    }
}

/// Whether a command is one that a module carries out, but hardly as it is meant.
fn is_misleading(spec: &Spec, opcode: Opcode, Command { kind, motor, value, .. }: Command) -> bool {
    match opcode {
        Opcode::Calc => matches!(kind, 3 | 4) && value == 0,
        Opcode::Sgp => motor == 3 && kind < 3 && value < 0,
        Opcode::Ror | Opcode::Rol if motor < spec.axes && spec.limits_speed => {
            spec.axis.row(AxisParameter::TargetSpeed).is_some_and(|row| !row.accepts(value))
        }
        _ => false,
    }
}

/// The values that are tried in a command: for a parameter the ends of its ranges, too.
fn values(spec: &Spec, instruction: &Instruction, command: Command) -> Vec<i32> {
    if !instruction.fields.contains(&Field::Value) {
        return vec![0];
    }
    let parameter = crate::product::parameter(spec, instruction.opcode, command);
    let ends = parameter.into_iter().flat_map(|parameter| parameter.row.ranges).flat_map(|(low, high)| [*low, *high]);
    let around = ends.flat_map(|end| [end.saturating_sub(1), end, end.saturating_add(1)]);
    [0, 1, 2, 3, 4, 20, 21, 255, 256, 2048, -1, -2, i32::MAX, i32::MIN].into_iter().chain(around).collect()
}

/// Tries an instruction with every type, on axes and in banks that there are and are not.
fn compare(product: Product, instruction: &Instruction) {
    let spec = product.spec();
    let mut module = new_module(product);
    for kind in 0..=u8::MAX {
        // Some parameters can be set to what fits the others, which have their values after power-on in a new module.
        if instruction.opcode == Opcode::Sap && spec.axis.find(kind).is_some() {
            module = new_module(product);
        }
        for motor in [0, 1, 2, 3, spec.axes - 1, spec.axes, 0xFF] {
            let command = Command::new(instruction.opcode as u8, kind, motor, 0);
            if let Some(parameter) = crate::product::parameter(spec, instruction.opcode, command) {
                // AAP and AGP set what is in the accumulator, which is no matter of the program's text.
                let load = Command::new(Opcode::Calc as u8, 9, 0, parameter.row.default);
                assert!(!refuses(&mut module, product, load));
            }
            for value in values(spec, instruction, command) {
                let command = Command { value, ..command };
                let warnings = check::warnings(Some(spec), command, 0..usize::from(spec.commands));
                let refused = refuses(&mut module, product, command);
                let expected = refused || is_misleading(spec, instruction.opcode, command);
                let name = product.name();
                assert_eq!(!warnings.is_empty(), expected, "{name}: {command}: {warnings:?}");
            }
        }
    }
}

#[test]
fn what_a_module_refuses_is_warned_of_and_nothing_else() {
    // What user functions take is known to the image that has them.
    let user = Opcode::Uf0 as u8..=Opcode::Uf7 as u8;
    for product in Product::ALL {
        let both = Instruction::all().filter(|instruction| instruction.direct && instruction.program);
        for instruction in both.filter(|instruction| !user.contains(&(instruction.opcode as u8))) {
            compare(product, instruction);
        }
    }
}
