//! What `tmcl tune` does not wait for for ever: motors that do not get on.

use tmcm::tmcl::{Command, Opcode};

use super::fake::{Fake, POSITION, State};
use super::harness::{complaint, run};

/// How often a fake was asked this.
fn asked(fake: &Fake, opcode: Opcode, kind: u8) -> usize {
    let is_meant = |command: &&Command| command.opcode == opcode as u8 && command.kind == kind;
    fake.state().asked.iter().filter(is_meant).count()
}

/// What is changed for the time of a measurement, with values of which none is that of the measurement.
const CHANGED: [(u8, i32); 5] = [(4, 1234), (172, 3), (173, 1), (174, -7), (181, 900)];

/// A module whose motor accelerates quickly, and has short ways then.
fn fake(jumps: bool) -> Fake {
    let parameters = CHANGED.into_iter().chain([(5, 2047), (140, 8), (153, 7), (154, 3)]).collect();
    Fake::start(State { jumps, parameters, ..State::default() })
}

/// What is wrong is said, and everything that was changed has its old value again.
fn given_up(fake: &Fake, why: &str) {
    let output = run(&["tune", "stallguard", &fake.link, "--yes", "--speeds", "800"]);
    assert_eq!(output.status.code(), Some(1));
    let told = complaint(&output);
    assert!(told.contains(why) && told.ends_with("; all settings are as before\n"), "{told}");
    let state = fake.state();
    assert_eq!(CHANGED.map(|(number, _)| (number, state.parameters[&number])), CHANGED);
    let changes = state.asked.iter().filter(|it| it.opcode == Opcode::Sap as u8);
    let changed: Vec<u8> = changes.map(|it| it.kind).collect();
    // What was changed last is put back first.
    assert_eq!(changed, [172, 181, 173, 4, 174, 174, 4, 173, 181, 172]);
}

/// The speed is asked for once before anything, four times to see how long that takes, once before the motor is sent off, a
/// hundred times and once more while it does not move, and once each when it has been sent back and has been stopped.
#[test]
fn a_motor_that_does_not_move_is_given_up() {
    let fake = fake(false);
    given_up(&fake, "the motor stopped at 0 on its way to ");
    assert_eq!((asked(&fake, Opcode::Gap, 3), asked(&fake, Opcode::Mvp, 0)), (109, 2));
}

/// A motor that is at each target at once never has a constant speed: it is sent along its track twenty times, and once more,
/// and back to where it was.
#[test]
fn a_motor_that_is_never_at_constant_speed_is_given_up() {
    let fake = fake(true);
    given_up(&fake, "the motor is not long enough at constant speed");
    assert_eq!((asked(&fake, Opcode::Mvp, 0), fake.state().parameters[&POSITION]), (22, 0));
}
