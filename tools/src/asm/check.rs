//! Warnings about commands that can be assembled but that a module would refuse.

use std::ops::Range;

use tmcm::module::Spec;
use tmcm::module::ports::{ALL_PORTS, ANALOG, INPUTS, OUTPUTS};
use tmcm::param::{ALL_INTERRUPTS, AxisParameter, COORDINATES, Interrupt, STORED_USER_VARIABLES, TIMERS};
use tmcm::tmcl::{ALL_AXES, AxisSet, Command, FIRST_SET, Field, Instruction, MotorField, Opcode};
use tmcm_sim::wire::names::Named;

use super::message::Message;
use crate::product::parameter;
use crate::program::target;

/// Type of MVP COORD.
const COORD: u8 = 2;
/// Type of WAIT TICKS, which has no motor.
const TICKS: u8 = 0;
/// Types of CALC that divide.
const DIV: u8 = 3;
const MOD: u8 = 4;
/// Value that stands for that of the accumulator, in WAIT and in SIO for all outputs.
const FROM_ACCUMULATOR: i32 = -1;

/// Banks of SGP and its sisters.
const GLOBAL: u8 = 0;
const VARIABLES: u8 = 2;
const INTERRUPTS: u8 = 3;

/// The field of a command that a warning is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    Number,
    Kind,
    Motor,
    Value,
}

/// The warnings for a command of a program that has these addresses, for this product; for one that is not known,
/// `None`, those that hold for every module.
pub(super) fn warnings(spec: Option<&Spec>, command: Command, addresses: Range<usize>) -> Vec<(Part, Message)> {
    let Some(opcode) = Opcode::from_number(command.opcode) else { return unknown(command.opcode) };
    let instruction = opcode.instruction();
    if !instruction.program {
        return unknown(command.opcode);
    }
    if let Some(spec) = spec.filter(|spec| spec.lacks.contains(&opcode)) {
        let message = format!("a {} has no {}, and skips it", spec.usb, instruction.mnemonic);
        return vec![(Part::Number, message.into())];
    }
    let of_product = spec.map(|spec| {
        [kind(spec, command, opcode), motor(spec, command, opcode, instruction), value(spec, command, opcode)]
    });
    let of_all = [named(command, instruction), constant(command, opcode), jump(command, addresses)];
    of_product.into_iter().flatten().chain(of_all).flatten().collect()
}

/// Why a module of this product has no such motor, bank or set of axes; `None` where it has.
pub fn no_such_motor(spec: &Spec, command: Command) -> Option<String> {
    let opcode = Opcode::from_number(command.opcode)?;
    motor(spec, command, opcode, opcode.instruction()).map(|(_, message)| message.to_string())
}

/// Warnings for an unknown command number. Number 0 has none: it ends a program, and some hosts use it for that.
fn unknown(number: u8) -> Vec<(Part, Message)> {
    let message = match number {
        0 => return Vec::new(),
        Command::FIRST_CONTROL.. => {
            format!("command {number} cannot be in a program: a module carries it out while the program is loaded")
                .into()
        }
        _ => Message::new(format!("there is no command {number}")).advise("a module skips it"),
    };
    vec![(Part::Number, message)]
}

/// A type of which the command has none.
fn named(command: Command, instruction: &Instruction) -> Option<(Part, Message)> {
    let number = command.kind;
    let Some(Field::Named(names)) = instruction.fields.first() else { return None };
    let message = || format!("{} has no type {number}, only {}", instruction.mnemonic, names.join(", "));
    names.get(usize::from(number)).is_none().then(|| (Part::Kind, message().into()))
}

/// A constant that makes no sense on any module.
fn constant(command: Command, opcode: Opcode) -> Option<(Part, Message)> {
    let message = match (opcode, command.kind, command.value) {
        (Opcode::Calc, DIV, 0) => "this divides by 0: a module goes on with 0 in the accumulator".into(),
        (Opcode::Calc, MOD, 0) => "this divides by 0: a module leaves the accumulator as it is".into(),
        (Opcode::Wait, _, time) if time < 0 && time != FROM_ACCUMULATOR => {
            Message::new(format!("a time cannot be negative: with {time} this has no effect"))
                .advise(format!("{FROM_ACCUMULATOR} is the time in the accumulator"))
        }
        _ => return None,
    };
    Some((Part::Value, message))
}

fn kind(spec: &Spec, command: Command, opcode: Opcode) -> Option<(Part, Message)> {
    let number = command.kind;
    let parameter = parameter(spec, opcode, command);
    let message = match opcode {
        Opcode::Sap | Opcode::Gap | Opcode::Stap | Opcode::Rsap | Opcode::Aap => {
            access(opcode, "axis parameter", number, parameter)
        }
        Opcode::Sgp | Opcode::Ggp | Opcode::Stgp | Opcode::Rsgp | Opcode::Agp => match command.motor {
            GLOBAL => access(opcode, "global parameter", number, parameter),
            VARIABLES => user_variable(opcode, number),
            INTERRUPTS => access(opcode, "interrupt parameter", number, parameter),
            _ => None,
        },
        Opcode::Sco | Opcode::Gco | Opcode::Cco | Opcode::Aco => coordinate(i32::from(number)),
        Opcode::Sio | Opcode::Gio => port(spec, command, opcode),
        Opcode::Ei | Opcode::Di | Opcode::Vect => {
            let all = number == ALL_INTERRUPTS && opcode != Opcode::Vect;
            let exists = all || Interrupt::find(number, spec.axes, spec.inputs).is_some();
            (!exists).then(|| format!("there is no interrupt {number}"))
        }
        _ => None,
    };
    message.map(|message| (Part::Kind, message.into()))
}

fn access(opcode: Opcode, what: &str, number: u8, parameter: Option<Named>) -> Option<String> {
    let Some(Named { row, name }) = parameter else { return Some(format!("there is no {what} {number}")) };
    match opcode {
        Opcode::Sap | Opcode::Sgp | Opcode::Aap | Opcode::Agp if !row.writable() => {
            Some(format!("{what} {number} ({name}) can only be read"))
        }
        Opcode::Stap | Opcode::Rsap if !row.stored() => Some(format!("{what} {number} ({name}) cannot be stored")),
        Opcode::Stgp | Opcode::Rsgp if row.stored() => {
            Some(format!("{what} {number} ({name}) is stored by SGP itself"))
        }
        Opcode::Stgp | Opcode::Rsgp => Some(format!("{what} {number} ({name}) cannot be stored")),
        _ => None,
    }
}

fn port(spec: &Spec, command: Command, opcode: Opcode) -> Option<String> {
    let (port, bank) = (command.kind, command.motor);
    let among = |what: &str, count: u8, all: bool| {
        let exists = all && port == ALL_PORTS || port < count;
        (!exists).then(|| format!("there is no {what} {port}, only 0..{}", count.saturating_sub(1)))
    };
    if opcode == Opcode::Gio && spec.signals.iter().any(|signal| signal.place() == (bank, port)) {
        return None;
    }
    match (opcode, bank) {
        (_, OUTPUTS) => among("output", spec.outputs, opcode == Opcode::Sio),
        (Opcode::Gio, INPUTS) => among("input", spec.inputs, true),
        (Opcode::Sio, INPUTS) => {
            let exists = port == 0 && spec.pull_ups > 0;
            (!exists).then(|| format!("there are no pull-up resistors at port {port}"))
        }
        (Opcode::Gio, ANALOG) => {
            let mut ports: Vec<u8> = (0..8).filter(|port| spec.analog & (1 << port) != 0).collect();
            let signals = spec.signals.iter().map(|signal| signal.place());
            ports.extend(signals.filter(|(bank, _)| *bank == ANALOG).map(|(_, port)| port));
            let all = ports.iter().map(u8::to_string).collect::<Vec<_>>().join(", ");
            (!ports.contains(&port)).then(|| format!("there is no analog input {port}, only {all}"))
        }
        _ => None,
    }
}

fn user_variable(opcode: Opcode, number: u8) -> Option<String> {
    let stores = matches!(opcode, Opcode::Stgp | Opcode::Rsgp) && usize::from(number) >= STORED_USER_VARIABLES;
    stores.then(|| format!("user variable {number} cannot be stored, only 0..{}", STORED_USER_VARIABLES - 1))
}

fn coordinate(number: i32) -> Option<String> {
    let exists = usize::try_from(number).is_ok_and(|number| number < COORDINATES);
    (!exists).then(|| format!("there is no coordinate {number}, only 0..{}", COORDINATES - 1))
}

fn motor(spec: &Spec, command: Command, opcode: Opcode, instruction: &Instruction) -> Option<(Part, Message)> {
    let motor = command.motor;
    let message = match (opcode, instruction.motor) {
        (Opcode::Sgp | Opcode::Ggp | Opcode::Stgp | Opcode::Rsgp | Opcode::Agp, _)
            if !matches!(motor, GLOBAL | VARIABLES | INTERRUPTS) =>
        {
            Message::new(format!("there is no bank {motor}"))
                .advise("0 has the global parameters, 2 user variables, 3 interrupts")
        }
        (Opcode::Sio, _) if !matches!(motor, INPUTS | OUTPUTS) => {
            Message::new(format!("there is no bank {motor} to set"))
                .advise("0 has the pull-up resistors of the inputs, 2 the outputs")
        }
        (Opcode::Gio, _) if !matches!(motor, INPUTS | ANALOG | OUTPUTS) => {
            Message::new(format!("there is no bank {motor}"))
                .advise("0 has the digital inputs, 1 the analog ones, 2 the outputs")
        }
        (_, MotorField::AxisOrAll) if motor == ALL_AXES => return None,
        (Opcode::Mvp, _) if command.kind == COORD && AxisSet::of(motor, spec.axes).is_some() => return None,
        (Opcode::Mvp, _) if command.kind == COORD && spec.axes > 1 && motor >= FIRST_SET => format!(
            "${motor:02X} is no set of axes: bits 0..{} are the axes of this module, and bit 7 moves them at once, bit 6 up to \
             three of them on a straight line",
            spec.axes.saturating_sub(1)
        )
        .into(),
        (_, MotorField::Axis | MotorField::AxisOrAll | MotorField::AxisSet) if motor >= spec.axes => {
            Message::new(format!("there is no axis {motor}")).advise(last_axis(spec))
        }
        (Opcode::Wait, _) if command.kind != TICKS && motor >= spec.axes => {
            Message::new(format!("there is no axis {motor}, for which the program would not wait at all"))
                .advise(last_axis(spec))
        }
        _ => return None,
    };
    Some((Part::Motor, message))
}

/// Tells which axes a module has, where there is one too many.
fn last_axis(spec: &Spec) -> String {
    format!("the last of this module is {}", spec.axes.saturating_sub(1))
}

fn value(spec: &Spec, command: Command, opcode: Opcode) -> Option<(Part, Message)> {
    let message = match opcode {
        Opcode::Sgp if command.motor == INTERRUPTS && command.kind < TIMERS && command.value < 0 => {
            let (value, taken) = (command.value, command.value as u32);
            Some(format!("a time cannot be negative: {value} ms are taken for {taken} ms").into())
        }
        Opcode::Sap | Opcode::Sgp => range(&parameter(spec, opcode, command)?, command.value).map(Message::new),
        Opcode::Sio => output(spec, command).map(Message::new),
        Opcode::Ror | Opcode::Rol => {
            let message = range(&spec.axis.row(AxisParameter::TargetSpeed)?.into(), command.value)?;
            let message = Message::new(message);
            Some(if spec.limits_speed { message.advise("the motor turns at that limit") } else { message })
        }
        Opcode::Mvp if command.kind == COORD => coordinate(command.value).map(Message::new),
        _ => None,
    };
    message.map(|message| (Part::Value, message))
}

fn range(Named { row, name }: &Named, value: i32) -> Option<String> {
    let ranges: Vec<String> = row.ranges.iter().map(|(low, high)| format!("{low}..{high}")).collect();
    let writable = row.writable() && !row.accepts(value);
    writable.then(|| format!("{value} is out of range: {name} takes {}", ranges.join(", ")))
}

/// The value of SIO.
fn output(spec: &Spec, command: Command) -> Option<String> {
    let value = command.value;
    let (low, high, what) = match (command.motor, command.kind) {
        (OUTPUTS, ALL_PORTS) => (FROM_ACCUMULATOR, 255, "SIO for all outputs"),
        (OUTPUTS, port) if port < spec.outputs => (0, 1, "an output"),
        (INPUTS, 0) if spec.pull_ups > 0 => (0, 3, "SIO for the pull-up resistors"),
        _ => return None,
    };
    (!(low..=high).contains(&value)).then(|| format!("{value} is out of range: {what} takes {low}..{high}"))
}

fn jump(command: Command, addresses: Range<usize>) -> Option<(Part, Message)> {
    let target = target(&command)?;
    let inside = usize::try_from(target).is_ok_and(|target| addresses.contains(&target));
    let message = || {
        let begin = if addresses.start > 0 { format!("begins at {} and ", addresses.start) } else { String::new() };
        let end = addresses.end.saturating_sub(1);
        format!("address {target} is outside of the program, which {begin}ends at {end}")
    };
    (!inside).then(|| (Part::Value, message().into()))
}

#[cfg(test)]
mod tests {
    use tmcm::product::{TMCM_1140, TMCM_3110, TMCM_3212, TMCM_6110};
    use tmcm::tmcl::text;

    use super::*;

    fn messages_on(spec: Option<&Spec>, line: &str) -> Vec<String> {
        warnings(spec, text::parse(line).unwrap(), 0..10).into_iter().map(|(_, message)| message.to_string()).collect()
    }

    fn messages(line: &str) -> Vec<String> {
        messages_on(Some(&TMCM_1140), line)
    }

    #[test]
    fn good_commands_are_not_warned_about() {
        for line in [
            "SAP 4, 0, 2047",
            "GAP 3, 0",
            "STAP 4, 0",
            "SGP 66, 0, 9",
            "SGP 255, 2, -1",
            "SGP 0, 3, 1000",
            "STGP 55, 2",
            "SAP 193, 0, 65",
            "MVP COORD, 0, 20",
            "MVP COORD, 255, 1",
            "SCO 0, 255, 0",
            "JA 9",
            "JC ZE, 0",
            "EI 255",
            "VECT 27, 5",
            "WAIT TICKS, 7, 50",
            "UF0 200, 200, -1",
            "0, 0, 0, 0",
            "CALCX SWAP",
            "CLE ESD",
            "SIO 1, 2, 1",
            "SIO 255, 2, 3",
            "SIO 0, 0, 1",
            "GIO 3, 0",
            "GIO 11, 0",
            "GIO 0, 1",
            "GIO 9, 1",
            "GIO 255, 0",
            "SIO 255, 2, -1",
            "CALC DIV, 1",
            "CALC ADD, 0",
            "CALCX DIV",
            "WAIT POS, 0, -1",
            "SGP 0, 3, 0",
            "SGP 0, 2, -5",
        ] {
            assert_eq!(messages(line), [""; 0], "{line}");
        }
    }

    #[test]
    fn a_command_that_a_module_would_refuse_gets_a_warning() {
        for (line, part, message) in [
            ("GAP 14, 0", Part::Kind, "there is no axis parameter 14"),
            ("SAP 3, 0, 5", Part::Kind, "axis parameter 3 (actual speed) can only be read"),
            ("STAP 1, 0", Part::Kind, "axis parameter 1 (actual position) cannot be stored"),
            ("SAP 4, 0, 3000", Part::Value, "3000 is out of range: maximum positioning speed takes 1..2047"),
            ("SAP 193, 0, 9", Part::Value, "9 is out of range: reference search mode takes 1..8, 65..68, 133..136"),
            ("SAP 4, 1, 5", Part::Motor, "there is no axis 1; the last of this module is 0"),
            ("SGP 4, 0, 5", Part::Kind, "there is no global parameter 4"),
            ("GGP 4, 3", Part::Kind, "there is no interrupt parameter 4"),
            ("STGP 56, 2", Part::Kind, "user variable 56 cannot be stored, only 0..55"),
            (
                "SGP 4, 1, 5",
                Part::Motor,
                "there is no bank 1; 0 has the global parameters, 2 user variables, 3 interrupts",
            ),
            ("MVP ABS, 255, 5", Part::Motor, "there is no axis 255; the last of this module is 0"),
            ("ROR 0, 2048", Part::Value, "2048 is out of range: target speed takes -2047..2047"),
            ("MVP COORD, 0, 21", Part::Value, "there is no coordinate 21, only 0..20"),
            ("CCO 21, 0", Part::Kind, "there is no coordinate 21, only 0..20"),
            ("VECT 255, 0", Part::Kind, "there is no interrupt 255"),
            ("EI 4", Part::Kind, "there is no interrupt 4"),
            ("CALC 10, 5", Part::Kind, "CALC has no type 10, only ADD, SUB, MUL, DIV, MOD, AND, OR, XOR, NOT, LOAD"),
            ("JA 10", Part::Value, "address 10 is outside of the program, which ends at 9"),
            ("CSUB -1", Part::Value, "address -1 is outside of the program, which ends at 9"),
            ("SIO 2, 2, 1", Part::Kind, "there is no output 2, only 0..1"),
            ("GIO 2, 2", Part::Kind, "there is no output 2, only 0..1"),
            ("GIO 4, 0", Part::Kind, "there is no input 4, only 0..3"),
            ("GIO 4, 1", Part::Kind, "there is no analog input 4, only 0, 8, 9"),
            ("GIO 255, 2", Part::Kind, "there is no output 255, only 0..1"),
            ("GIO 0, 3", Part::Motor, "there is no bank 3; 0 has the digital inputs, 1 the analog ones, 2 the outputs"),
            (
                "SIO 0, 1, 1",
                Part::Motor,
                "there is no bank 1 to set; 0 has the pull-up resistors of the inputs, 2 the outputs",
            ),
            ("SIO 1, 2, 2", Part::Value, "2 is out of range: an output takes 0..1"),
            ("SIO 255, 2, 256", Part::Value, "256 is out of range: SIO for all outputs takes -1..255"),
            ("SIO 0, 0, 4", Part::Value, "4 is out of range: SIO for the pull-up resistors takes 0..3"),
            ("STGP 66, 0", Part::Kind, "global parameter 66 (serial address) is stored by SGP itself"),
            ("RSGP 132, 0", Part::Kind, "global parameter 132 (TMCL tick timer) cannot be stored"),
            ("SGP 1, 3, -5", Part::Value, "a time cannot be negative: -5 ms are taken for 4294967291 ms"),
            ("50, 0, 0, 0", Part::Number, "there is no command 50; a module skips it"),
            (
                "129, 0, 0, 0",
                Part::Number,
                "command 129 cannot be in a program: a module carries it out while the program is loaded",
            ),
        ] {
            let warnings = warnings(Some(&TMCM_1140), text::parse(line).unwrap(), 0..10);
            let told: Vec<_> = warnings.iter().map(|(part, message)| (*part, message.to_string())).collect();
            assert_eq!(told, [(part, message.to_string())], "{line}");
        }
    }

    #[test]
    fn constants_that_make_no_sense_on_any_module() {
        for (line, message) in [
            ("CALC DIV, 0", "this divides by 0: a module goes on with 0 in the accumulator"),
            ("CALC MOD, 0", "this divides by 0: a module leaves the accumulator as it is"),
            (
                "WAIT TICKS, 0, -5",
                "a time cannot be negative: with -5 this has no effect; -1 is the time in the accumulator",
            ),
            (
                "WAIT POS, 0, -2",
                "a time cannot be negative: with -2 this has no effect; -1 is the time in the accumulator",
            ),
            ("CLE 6", "CLE has no type 6, only ALL, ETO, EAL, EDV, EPO, ESD"),
        ] {
            for spec in [None, Some(&TMCM_1140), Some(&TMCM_3212)] {
                assert_eq!(messages_on(spec, line), [message], "{line}");
            }
        }
    }

    #[test]
    fn jumps_stay_in_the_program_wherever_it_begins() {
        let told = |line: &str| {
            warnings(None, text::parse(line).unwrap(), 50..60).pop().map(|(_, message)| message.to_string())
        };
        assert_eq!((told("JA 50"), told("JC ZE, 59")), (None, None));
        for outside in [49, 60] {
            let message = "is outside of the program, which begins at 50 and ends at 59";
            assert_eq!(told(&format!("CSUB {outside}")), Some(format!("address {outside} {message}")));
        }
    }

    #[test]
    fn each_product_has_axes_and_pins_of_its_own() {
        for line in
            ["SAP 4, 5, 0", "SIO 7, 2, 1", "GIO 7, 0", "GIO 4, 1", "EI 8", "VECT 38, 5", "EI 46", "SAP 213, 5, 1"]
        {
            assert_eq!(messages_on(Some(&TMCM_6110), line), [""; 0], "{line}");
            assert_eq!(messages_on(None, line), [""; 0], "{line}");
            assert_ne!(messages(line), [""; 0], "{line}");
        }
        let wait = |line: &str| messages_on(Some(&TMCM_6110), line);
        assert!(wait("WAIT POS, 6, 0")[0].contains("no axis 6, for which the program would not wait"));
        assert_eq!((wait("WAIT POS, 5, 0").len(), wait("WAIT TICKS, 6, 0").len()), (0, 0));
        assert_eq!(messages_on(Some(&TMCM_6110), "MST 6"), ["there is no axis 6; the last of this module is 5"]);
        assert_eq!(messages_on(Some(&TMCM_6110), "GAP 209, 0"), ["there is no axis parameter 209"]);
        assert_eq!(messages_on(Some(&TMCM_3110), "GAP 209, 2"), [""; 0]);
        assert_eq!(messages_on(Some(&TMCM_3110), "EI 6"), ["there is no interrupt 6"]);
        assert_eq!(messages_on(None, "JA 10").len(), 1);
        assert_eq!(messages_on(None, "50, 0, 0, 0").len(), 1);
    }

    /// Three axes with four inputs and outputs, of which the inputs are analog, too; ENABLE is input 10; and nothing of
    /// an axis is stored.
    #[test]
    fn what_the_tmcm_3212_has_and_lacks() {
        let on = |line: &str| messages_on(Some(&TMCM_3212), line);
        for line in [
            "ROR 2, 7999774",
            "SAP 5, 0, 7629278",
            "SAP 255, 1, 0",
            "GIO 3, 1",
            "GIO 10, 0",
            "SIO 3, 2, 1",
            "EI 42",
            "VECT 32, 5",
            "MVP COORD, 71, 20",
            "STGP 55, 2",
            "GGP 84, 0",
        ] {
            assert_eq!(on(line), [""; 0], "{line}");
        }
        assert_eq!(on("STAP 4, 0"), ["a TMCM-3212 has no STAP, and skips it"]);
        assert_eq!(on("RSAP 4, 0"), ["a TMCM-3212 has no RSAP, and skips it"]);
        let beyond = "8000000 is out of range: target speed takes -7999774..7999774";
        assert_eq!(on("SAP 2, 0, 8000000"), [beyond]);
        assert_eq!(on("ROL 0, 8000000"), [format!("{beyond}; the motor turns at that limit")]);
        assert_eq!(on("ROR 3, 100"), ["there is no axis 3; the last of this module is 2"]);
        assert_eq!(on("SAP 153, 0, 7"), ["there is no axis parameter 153"]);
        assert_eq!(on("SGP 79, 0, 1"), ["there is no global parameter 79"]);
        assert_eq!(on("GIO 4, 1"), ["there is no analog input 4, only 0, 1, 2, 3, 8, 9"]);
        assert_eq!(on("GIO 11, 0"), ["there is no input 11, only 0..3"]);
        assert_eq!(on("SIO 4, 2, 1"), ["there is no output 4, only 0..3"]);
        assert_eq!(on("SIO 0, 0, 1"), ["there are no pull-up resistors at port 0"]);
        assert_eq!(on("EI 43"), ["there is no interrupt 43"]);
    }

    #[test]
    fn masks_of_axes() {
        for good in [0x47, 0x41, 0x78, 0x87, 0xBF, 0xFF, 5] {
            assert_eq!(messages_on(Some(&TMCM_6110), &format!("MVP COORD, {good}, 1")), [""; 0], "{good}");
        }
        let no_set = |mask: &str, last: u8| {
            format!(
                "{mask} is no set of axes: bits 0..{last} are the axes of this module, and bit 7 moves them at once, bit 6 up \
                 to three of them on a straight line"
            )
        };
        for (spec, bad, message) in [
            (&TMCM_6110, 0x4F, no_set("$4F", 5)),
            (&TMCM_6110, 0x80, no_set("$80", 5)),
            (&TMCM_6110, 0xC3, no_set("$C3", 5)),
            (&TMCM_3110, 0x88, no_set("$88", 2)),
            (&TMCM_3110, 7, "there is no axis 7; the last of this module is 2".into()),
            (&TMCM_1140, 0x41, "there is no axis 65; the last of this module is 0".into()),
        ] {
            assert_eq!(messages_on(Some(spec), &format!("MVP COORD, {bad}, 1")), [message], "{bad}");
        }
    }
}
