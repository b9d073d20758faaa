//! `tmcl tune` on modules that refuse commands, or do not answer any more.

use tmcm::tmcl::{Command, Opcode};

use super::fake::{Deed, Instead};
use super::tune_limits::{BEFORE, fake, told, written};

const fn sap(number: u8, value: i32) -> Command {
    Command::new(Opcode::Sap as u8, number, 0, value)
}

/// The state of the program, which is asked for before anything is moved.
const STATUS: Command = Command::new(Opcode::ApplicationStatus as u8, 0, 0, 0);

/// A module that does this with one command.
fn with(wanted: Command, deed: fn() -> Deed) -> Option<Instead> {
    Some(Box::new(move |command| (command == wanted).then(deed)))
}

/// A setting that is refused is the end. The motor is sent to where it is, and what was changed is put back; also what
/// was refused, because nobody knows what a refusal has left.
#[test]
fn a_setting_that_is_refused() {
    let fake = fake(0, with(sap(173, 0), || Deed::Refusal));
    let told = told(&fake, &["stallguard"]);
    assert!(told.contains("SAP 173, 0, 0: status 4"), "{told}");
    assert!(told.ends_with("; all settings are as before\n"), "{told}");
    assert_eq!(written(&fake), [(172, 0), (181, 0), (173, 0), (173, 2), (181, 900), (172, 3)]);
    let moves = fake.state().asked.iter().filter(|it| it.opcode == Opcode::Mvp as u8).count();
    assert_eq!(moves, 1);
}

/// A setting that cannot be put back is named, and does not keep the rest from being put back.
#[test]
fn a_setting_that_cannot_be_put_back() {
    let fake = fake(0, with(sap(181, 900), || Deed::Refusal));
    let told = told(&fake, &["stallguard"]);
    let end = "; the module could not be told to go back to how it was; when it answers again, send SAP 181, 0, 900\n";
    assert!(told.contains("the motor stopped at 0") && told.ends_with(end), "{told}");
    for (number, value) in BEFORE {
        assert_eq!(fake.state().parameters[&number], if number == 181 { 0 } else { value }, "{number}");
    }
}

/// A module that has gone before the motor has moved: it does not have to be stopped or brought back. One command is
/// sent to it again and again, and those after it are not.
#[test]
fn a_module_that_is_gone() {
    let mut is_gone = false;
    let fake = fake(
        0,
        Some(Box::new(move |command| {
            is_gone |= command == sap(173, 0);
            is_gone.then_some(Deed::Silence)
        })),
    );
    let told = told(&fake, &["stallguard"]);
    let end = "when it answers again, send SAP 173, 0, 2; SAP 181, 0, 900; SAP 172, 0, 3\n";
    assert!(told.ends_with(end), "{told}");
    assert_eq!(told.matches("trying for up to 10 seconds").count(), 1, "{told}");
    let state = fake.state();
    let last = state.asked.iter().skip_while(|it| **it != sap(173, 0)).skip(1);
    let last: Vec<Command> = last.copied().filter(|command| *command != sap(173, 0)).collect();
    assert!(last.len() > 1 && last.iter().all(|command| *command == sap(173, 2)), "{last:?}");
}

/// A module that knows no programs can have none that runs. One that does not answer is left alone.
#[test]
fn a_module_that_tells_nothing_of_its_program() {
    let refusing = fake(0, with(STATUS, || Deed::Refusal));
    assert!(told(&refusing, &["stallguard"]).contains("the motor stopped at 0 on its way"));
    let silent = fake(0, with(STATUS, || Deed::Silence));
    let told = told(&silent, &["stallguard"]);
    assert!(told.contains("135, 0, 0, 0: "), "{told}");
    assert!(written(&silent).is_empty());
}
