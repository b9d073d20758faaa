//! Motors that do not get on: `tmcl tune` does not wait for them for ever.

use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use rustix::process::{Pid, Signal};
use tmcm::tmcl::{Command, Opcode};

use super::fake::{Deed, Fake, Instead, POSITION, State};
use super::harness::{PATIENCE, complaint, run, tmcl};

/// How often a fake was asked this.
fn asked(fake: &Fake, opcode: Opcode, kind: u8) -> usize {
    let is_meant = |command: &&Command| command.opcode == opcode as u8 && command.kind == kind;
    fake.state().asked.iter().filter(is_meant).count()
}

/// The settings that were written, in the order in which they were.
pub(super) fn written(fake: &Fake) -> Vec<(u8, i32)> {
    let state = fake.state();
    let writes = state.asked.iter().filter(|it| it.opcode == Opcode::Sap as u8);
    writes.map(|it| (it.kind, it.value)).collect()
}

/// The parameters that are changed for the time of a measurement, with values of which none is that of the measurement.
pub(super) const BEFORE: [(u8, i32); 10] =
    [(4, 1234), (168, 1), (169, 2), (170, 5), (171, 1), (172, 3), (173, 2), (174, -7), (181, 900), (182, 77)];

/// A module whose motor accelerates quickly, and has short ways then. It moves so often.
pub(super) fn fake(jumps: usize, instead: Option<Instead>) -> Fake {
    let parameters = BEFORE.into_iter().chain([(5, 2047), (6, 128), (140, 8), (153, 7), (154, 3)]).collect();
    Fake::start(State { jumps, parameters, instead, ..State::default() })
}

/// The message of a measurement that fails.
pub(super) fn told(fake: &Fake, what: &[&str]) -> String {
    let output = run(&[&["tune", what[0], &fake.link, "--yes", "--speeds", "800"], &what[1..]].concat());
    assert_eq!(output.status.code(), Some(1));
    complaint(&output)
}

/// The settings of a measurement, and behind them those of before: what was changed last is put back first.
fn there_and_back(settings: &[(u8, i32)]) -> Vec<(u8, i32)> {
    let before = |number| BEFORE.into_iter().find(|(known, _)| *known == number).unwrap();
    let back = settings.iter().rev().map(|(number, _)| before(*number));
    settings.iter().copied().chain(back).collect()
}

/// The settings with which stallGuard2 is measured: coolStep, stop on stall and the filter are off, and the lowest
/// threshold is the first.
const STALLGUARD: [(u8, i32); 5] = [(172, 0), (181, 0), (173, 0), (4, 800), (174, -64)];

/// Checks that the mistake is told, and that everything that was changed has its old value again.
fn given_up(fake: &Fake, why: &str) {
    let told = told(fake, &["stallguard"]);
    assert!(told.contains(why) && told.ends_with("; all settings are as before\n"), "{told}");
    assert_eq!(written(fake), there_and_back(&STALLGUARD));
}

/// The speed is asked for once before anything, four times to see how long that takes, and once before the motor is
/// sent off. It is asked for a hundred times and once more while the motor does not move, and once each when the motor
/// has been sent back and has been stopped.
#[test]
fn a_motor_that_does_not_move_is_given_up() {
    let fake = fake(0, None);
    given_up(&fake, "the motor stopped at 0 on its way to ");
    assert_eq!((asked(&fake, Opcode::Gap, 3), asked(&fake, Opcode::Mvp, 0)), (109, 2));
    // Whatever is asked and told is what the manual has, also where a module does not look.
    let state = fake.state();
    let of = |opcode: Opcode| state.asked.iter().copied().filter(move |it| it.opcode == opcode as u8);
    assert!(of(Opcode::Gap).all(|it| (it.motor, it.value) == (0, 0)));
    assert_eq!(of(Opcode::ApplicationStatus).collect::<Vec<_>>(), [Command::new(135, 0, 0, 0)]);
    assert_eq!(of(Opcode::Mst).collect::<Vec<_>>(), [Command::new(3, 0, 0, 0)]);
}

/// coolStep is off at first, and as quick as can be later; stop on stall is off, the filter is on.
#[test]
fn coolstep_is_measured_with_settings_of_its_own() {
    let fake = fake(0, None);
    told(&fake, &["coolstep", "--threshold", "5"]);
    let settings = [(172, 0), (181, 0), (182, 0), (173, 1), (168, 0), (170, 0), (169, 3), (171, 3), (174, 5), (4, 800)];
    assert_eq!(written(&fake), there_and_back(&settings));
}

/// A motor that is at each target at once never has a constant speed. It is sent along its track twenty times, and once
/// more, and back to where it was.
#[test]
fn a_motor_that_is_never_at_constant_speed_is_given_up() {
    let fake = fake(usize::MAX, None);
    given_up(&fake, "the motor is not long enough at constant speed");
    assert_eq!((asked(&fake, Opcode::Mvp, 0), fake.state().parameters[&POSITION]), (22, 0));
}

/// A motor stays at the other end of its track. The position is asked for to see whether there is the axis, and where
/// its track begins. It is asked for once on each of the 21 ways, and when the motor does not come back. Then it is
/// asked for a hundred times and once more while the motor stands, and at last to say where. The speed is asked for
/// once before anything, four times to see how long that takes, 21 times, and when the motor is stopped.
#[test]
fn a_motor_that_does_not_come_back_is_given_up() {
    let fake = fake(21, None);
    let told = told(&fake, &["stallguard"]);
    let there = fake.state().parameters[&POSITION];
    assert_ne!(there, 0);
    assert!(told.contains("the motor is not long enough at constant speed"), "{told}");
    let end = format!("; all settings are as before, and the motor stands at {there}; MVP ABS, 0, 0 brings it back\n");
    assert!(told.ends_with(&end), "{told}");
    assert_eq!((asked(&fake, Opcode::Gap, 1), asked(&fake, Opcode::Gap, 3)), (2 + 21 + 1 + 101 + 1, 1 + 4 + 21 + 1));
}

/// A motor that turns on for so many questions after it was stopped.
fn stopping(questions: usize) -> Option<Instead> {
    let (mut is_stopped, mut left) = (false, questions);
    Some(Box::new(move |command| {
        is_stopped |= command.opcode == Opcode::Mst as u8;
        let turns = is_stopped && (command.opcode, command.kind) == (Opcode::Gap as u8, 3) && left > 0;
        left -= usize::from(turns);
        turns.then_some(Deed::Value(1))
    }))
}

/// The number of questions between the command that stops the motor and the first setting that is put back.
fn questions_while_it_stops(fake: &Fake) -> usize {
    let state = fake.state();
    let after = state.asked.iter().skip_while(|it| it.opcode != Opcode::Mst as u8).skip(1);
    after.take_while(|it| it.opcode != Opcode::Sap as u8).count()
}

/// The settings are put back when the motor stands, and not before.
#[test]
fn a_motor_has_the_time_to_stop() {
    let fake = fake(0, stopping(3));
    given_up(&fake, "the motor stopped at 0 on its way to ");
    assert_eq!(questions_while_it_stops(&fake), 4);
}

/// A motor that turns on and on when it was stopped is waited for no longer after a signal. A look every 5 ms asks for
/// its speed; had the signal no effect, there would be thousands of them in the twenty seconds that it has at most.
#[test]
fn a_signal_ends_the_wait_for_a_motor_that_does_not_stop() {
    let fake = fake(0, stopping(usize::MAX));
    let child = tmcl(&["tune", "stallguard", &fake.link, "--yes", "--speeds", "800"]).spawn().unwrap();
    let end = Instant::now() + PATIENCE;
    while asked(&fake, Opcode::Mst, 0) == 0 {
        assert!(Instant::now() < end, "it is not stopped");
        std::thread::sleep(Duration::from_millis(5));
    }
    let before = asked(&fake, Opcode::Gap, 3);
    rustix::process::kill_process(Pid::from_child(&child), Signal::TERM).unwrap();
    let output = child.wait_with_output().unwrap();
    assert!(complaint(&output).ends_with("; all settings are as before\n"), "{}", complaint(&output));
    assert_eq!(written(&fake), there_and_back(&STALLGUARD));
    let looks = asked(&fake, Opcode::Gap, 3) - before;
    assert!(looks < 2000, "{looks}");
}

/// A program that gets SIGTERM from the module, when that is told to move for the nth time.
struct Signalled {
    program: Arc<OnceLock<Pid>>,
}

impl Signalled {
    /// The program, and the module that sends it the signal, and otherwise does something in place of the usual.
    fn at(at: usize, mut otherwise: impl FnMut(Command) -> Option<Deed> + Send + 'static) -> (Self, Instead) {
        let program = Arc::new(OnceLock::<Pid>::new());
        let known = Arc::clone(&program);
        let mut moves = 0;
        let instead = move |command: Command| {
            let is_move = command.opcode == Opcode::Mvp as u8;
            moves += usize::from(is_move);
            if is_move && moves == at {
                rustix::process::kill_process(*known.wait(), Signal::TERM).unwrap();
            }
            otherwise(command)
        };
        (Signalled { program }, Box::new(instead))
    }

    /// Tunes a module to the end, and returns what is said.
    fn tune(&self, fake: &Fake) -> String {
        let child = tmcl(&["tune", "stallguard", &fake.link, "--yes", "--speeds", "800"]).spawn().unwrap();
        self.program.set(Pid::from_child(&child)).unwrap();
        complaint(&child.wait_with_output().unwrap())
    }
}

/// A motor that stays at the other end of its track is looked at a hundred times, but not after a signal. The signal
/// comes here when the motor is sent back, the 22nd time that it is sent anywhere.
#[test]
fn a_signal_ends_the_wait_for_a_motor_that_does_not_come_back() {
    let (program, instead) = Signalled::at(22, |_| None);
    let fake = fake(21, Some(instead));
    let told = program.tune(&fake);
    assert!(told.contains("; all settings are as before, and the motor stands at "), "{told}");
    // Those before it was sent back are 23, and one is to say where it stands.
    let looks = asked(&fake, Opcode::Gap, 1) - 24;
    assert!(looks < 50, "{looks}");
}

/// After a signal, too, a motor has the time to stop: it is asked for its speed until that is 0.
#[test]
fn after_a_signal_the_motor_has_the_time_to_stop() {
    let (program, instead) = Signalled::at(1, stopping(3).unwrap());
    let fake = fake(0, Some(instead));
    let told = program.tune(&fake);
    assert!(told.ends_with("tmcl: all settings are as before\n"), "{told}");
    assert_eq!(questions_while_it_stops(&fake), 4);
}
