//! Reference search: when its legs end, and what disturbs them.

use common::Bench;
use common::loose::LooseBench;
use hal_sim::board::{Board, SharedBoard};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::world::config::WorldConfig;
use tmcm::module::Source;
use tmcm::tmcl::{Command, Opcode, text};
use tmcm::vm::ErrorFlag;
use tmcm_sim::VirtualModule;

/// The leg under way, as RFS STATUS tells, without waiting for the reply.
fn leg(bench: &mut Bench) -> i32 {
    bench.module.read(Command::new(Opcode::Rfs as u8, 2, 0, 0)).unwrap()
}

/// Lets polls pass until another leg is under way, and gives how many.
fn polls_until_next_leg(bench: &mut Bench) -> usize {
    let before = leg(bench);
    (1..10_000)
        .find(|_| {
            bench.poll(1);
            leg(bench) != before
        })
        .expect("the leg does not end")
}

/// A search by mode 1 without a stage, on its way to the left switch.
fn begun(settings: &[&str]) -> Bench {
    let mut bench = Bench::new();
    for line in settings {
        bench.ok(line);
    }
    for line in ["SAP 193, 0, 1", "RFS START, 0"] {
        bench.ok(line);
    }
    bench.run(300 * MILLISECOND);
    assert_eq!(leg(&mut bench), 1);
    bench
}

/// A leg is over when the motor has stood for twenty polls with nothing new; the poll that sees the switch open is none
/// of them. A switch that bounces in the last of them has them counted anew.
#[test]
fn a_switch_that_bounces_keeps_a_leg_from_ending() {
    for bounce in 8..20 {
        let mut bench = begun(&[]);
        bench.control("press left");
        polls_until_next_leg(&mut bench);
        bench.run(300 * MILLISECOND);
        bench.control("release left");
        bench.poll(bounce);
        bench.control("press left");
        bench.poll(1);
        bench.control("release left");
        assert_eq!((leg(&mut bench), polls_until_next_leg(&mut bench)), (2, 21), "bounce after {bounce} polls");
        assert_eq!(leg(&mut bench), 3);
    }
}

/// A switch that was seen and is gone is looked for as far back as the motor had run past it and four full steps
/// further. At that very microstep it still counts. One microstep beyond, the search for it begins again.
#[test]
fn a_switch_is_looked_for_up_to_the_limit() {
    // At an internal speed of 10 the motor takes three milliseconds for a microstep: each one is seen.
    let mut bench = begun(&["SAP 195, 0, 10"]);
    bench.control("press left");
    bench.poll(1);
    let (seen, _) = bench.module.position(0).unwrap();
    bench.control("release left");
    polls_until_next_leg(&mut bench);
    let (stood, _) = bench.module.position(0).unwrap();
    let limit = seen + (seen - stood) + 4 * 256;
    let mut furthest = stood;
    while leg(&mut bench) == 2 {
        bench.poll(1);
        furthest = furthest.max(bench.module.position(0).unwrap().0);
    }
    assert_eq!((leg(&mut bench), furthest), (1, limit + 1));
    // Closed at the limit it is the switch, and the search ends there.
    let mut bench = begun(&["SAP 195, 0, 10"]);
    bench.control("press left");
    bench.poll(1);
    bench.control("release left");
    polls_until_next_leg(&mut bench);
    bench.run_until(10 * SECOND, |bench| bench.module.position(0).unwrap().0 == limit);
    bench.control("press left");
    bench.poll(20);
    assert_eq!(leg(&mut bench), 2);
    bench.control("release left");
    polls_until_next_leg(&mut bench);
    assert_eq!(leg(&mut bench), 3);
}

/// Begins a search by `mode` whose slow legs go at an internal speed of 500, and waits for leg `number`. The stop
/// switches are at 9000 to either side, and the home switch is from 2000 to 5000. The motor needs 33 ms to come to a
/// stand from that speed, in which it makes some 250 microsteps.
fn in_slow_leg(mode: i32, number: i32) -> Bench {
    let stage = "[stage]\nleft = -9000\nleft_width = 3000\nright = 9000\nright_width = 3000\nhome = [2000, 5000]\n";
    let mut bench = Bench::in_world(stage);
    bench.configure(&["SAP 195, 0, 500", &format!("SAP 193, 0, {mode}"), "RFS START, 0"]);
    while leg(&mut bench) != number {
        polls_until_next_leg(&mut bench);
    }
    bench
}

/// A contact that closes and opens again while the motor is on its way back to the edge that it has left is not the far
/// side of the switch. The leg that crosses the switch goes on, and the zero point is the middle of the switch. The
/// home switch is sampled once in a millisecond, in which the motor makes 15 microsteps.
#[test]
fn a_contact_before_the_first_edge_does_not_end_the_crossing() {
    for (mode, switch, middle, off) in [(4, "left", -10_500, 2), (68, "right", 10_500, 2), (6, "home", 3_500, 8)] {
        let mut bench = in_slow_leg(mode, 3);
        for (open, closed) in [(4, 3), (4, 3)] {
            bench.poll(open);
            bench.control(&format!("press {switch}"));
            bench.poll(closed);
            bench.control(&format!("release {switch}"));
        }
        bench.run_until(5 * SECOND, |bench| leg(bench) == 0);
        let differs = (bench.rotor() - middle).abs();
        assert!(differs <= off && !bench.cut_short(), "mode {mode}: {}", bench.rotor());
    }
}

/// On the way to the zero point the stop switch before the motor ends the search, which has failed then. The one behind
/// it does not, nor does the one that is searched for. The motor comes from the far side of the switch; the search in
/// mode 5 has turned round at the left end before.
#[test]
fn the_stop_switch_before_the_motor_ends_the_way_to_the_zero_point() {
    for (mode, middle, before, behind) in [
        (4, -10_500, "right", "left"),
        (68, 10_500, "left", "right"),
        (6, 3_500, "left", "right"),
        (5, 3_500, "left", "right"),
    ] {
        for (switch, ends) in [(before, true), (behind, false)] {
            let mut bench = in_slow_leg(mode, 4);
            bench.poll(20);
            bench.control(&format!("press {switch}"));
            let polls = polls_until_next_leg(&mut bench);
            let differs = (bench.rotor() - middle).abs();
            let case = format!("mode {mode}, {switch}: {polls} polls, {differs} microsteps off");
            assert_eq!((leg(&mut bench), bench.cut_short()), (0, ends), "{case}");
            assert!(if ends { polls < 60 && differs > 1000 } else { polls > 60 && differs <= 8 }, "{case}");
        }
    }
}

/// In the modes that find the other end first it is the leg that finds the switch which begins again: no other.
#[test]
fn a_switch_that_was_a_glitch_is_looked_for_by_the_same_leg() {
    for (mode, switch, other) in [(2, "left", "right"), (3, "left", "right"), (66, "right", "left")] {
        let mut bench = Bench::new();
        bench.configure(&["SAP 195, 0, 500", &format!("SAP 193, 0, {mode}"), "RFS START, 0"]);
        let until = |bench: &mut Bench, number: i32| bench.run_until(SECOND, |bench| leg(bench) == number);
        until(&mut bench, 2);
        bench.poll(100);
        bench.control(&format!("press {other}"));
        until(&mut bench, 3);
        bench.control(&format!("release {other}"));
        bench.poll(100);
        bench.control(&format!("press {switch}"));
        bench.poll(2);
        bench.control(&format!("release {switch}"));
        until(&mut bench, 4);
        polls_until_next_leg(&mut bench);
        assert_eq!(leg(&mut bench), 3, "mode {mode}");
    }
}

/// A module that leaves polls out while nothing happens does not leave those out in which a search looks where the
/// motor is. Without the filter of stallGuard2 a whole measurement of the load, before which no polls are left out,
/// takes two full steps.
#[test]
fn a_switch_is_looked_for_up_to_the_limit_whatever_polls_are_left_out() {
    let mut bench = begun(&["SAP 195, 0, 10", "SAP 173, 0, 0"]);
    bench.control("press left");
    bench.run(MILLISECOND);
    bench.control("release left");
    bench.run_until(SECOND, |bench| leg(bench) == 2);
    let (stood, now) = (bench.rotor(), bench.module.now());
    bench.module.board().borrow_mut().change_world(|world| world.axis_mut(0).start_trace(0, now));
    bench.run(9 * SECOND);
    let trace = bench.module.board().borrow_mut().change_world(|world| world.axis_mut(0).take_trace()).unwrap();
    let furthest = trace.samples().iter().map(|sample| sample.rotor).max().unwrap();
    // Four full steps further than it was seen, and the way in which the motor stood behind that.
    assert!((4 * 256..6 * 256).contains(&(furthest - stood)), "{furthest} from {stood}");
    assert_eq!(leg(&mut bench), 1);
}

/// The tolerance of parameter 141 does not count in a search: the chip stops the motor where the switch closes.
#[test]
fn within_the_tolerance_of_parameter_141_the_switch_stops_a_search_at_once() {
    let mut bench = Bench::in_world("[stage]\nleft = -700\n");
    for line in ["SAP 141, 0, 4000", "SAP 193, 0, 1", "SAP 194, 0, 500", "RFS START, 0"] {
        bench.ok(line);
    }
    let mut lowest = 0;
    while leg(&mut bench) != 2 {
        bench.poll(1);
        lowest = lowest.min(bench.rotor());
    }
    assert!((-701..=-700).contains(&lowest), "{lowest}");
    bench.run_until(5 * SECOND, |bench| leg(bench) == 0);
    assert!((-701..=-699).contains(&bench.rotor()), "{}", bench.rotor());
}

/// A disturbance of a search: after `poll` polls, and some datagrams, so many are lost, or only their answers. Before
/// that a parameter may have been refused, so that it is written anew with the next leg.
#[derive(Clone, Copy, Debug, Default)]
struct Disturbed {
    poll: usize,
    refused: bool,
    spared: u32,
    lost: u32,
    heard: bool,
}

/// A module on a loose bus that has searched by `mode`, between switches at -2000 and 2000, and the polls after which
/// another leg was under way, or none.
fn searched(mode: i32, disturbed: Disturbed) -> (LooseBench, Vec<usize>) {
    let world = "[stage]\nleft = -2000\nleft_width = 300\nright = 2000\nright_width = 300\n";
    let config = WorldConfig::parse(world).unwrap();
    let mut bench = LooseBench::on(SharedBoard::new(Board::new(&config, 1)), 0);
    for line in ["SAP 12, 0, 0", "SAP 13, 0, 0", &format!("SAP 193, 0, {mode}"), "RFS START, 0"] {
        bench.ok(line);
    }
    let status = |bench: &LooseBench| bench.module.axes()[0].search_status();
    let (mut changes, mut before) = (vec![0], status(&bench));
    let Disturbed { poll, refused, spared, lost, heard } = disturbed;
    for n in 1.. {
        if n == poll {
            if refused {
                bench.fails.set(1);
                let now = bench.now();
                let answer = bench.module.execute(now, Source::Usb, text::parse("SAP 5, 0, 999").unwrap());
                assert!(answer.is_ready());
            }
            bench.fails.after(spared, lost, heard);
        }
        bench.run(1);
        let now = status(&bench);
        if now != before {
            changes.push(n);
            before = now;
        }
        if now == 0 {
            break;
        }
        assert!(n < 20_000, "mode {mode}, {disturbed:?}: it does not end");
    }
    bench.run(100);
    assert_eq!(bench.speed(), 0, "mode {mode}, {disturbed:?}");
    (bench, changes)
}

/// Where rotor and counter are.
fn places(bench: &LooseBench) -> (i64, i32) {
    let board = bench.board.borrow();
    (board.world().axis(0).motor().rotor(), board.tmc429(0).position(0))
}

/// The zero point is in the middle between where the switch of the search closes and where it opens, which the ramp
/// generator latches. The switch is the left one or, from 64 on, the right one. At this speed, which the motor has by
/// then because of the hysteresis, it makes 30 microsteps between two polls. So what they see would be further away.
#[test]
fn the_zero_point_is_latched_at_the_switch_of_the_search() {
    for (mode, middle) in [(1, -28_500), (65, 28_500)] {
        for start in (0..60).step_by(7) {
            let stage = "[stage]\nleft = -30000\nright = 30000\nhysteresis = 3000\n";
            let mut bench = Bench::in_world(&format!("[motor]\nstart = {start}\n{stage}"));
            let search = format!("SAP 193, 0, {mode}");
            bench.configure(&[&search, "SAP 194, 0, 1000", "SAP 195, 0, 1000", "RFS START, 0"]);
            bench.run_until(20 * SECOND, |bench| bench.ok("RFS STATUS, 0") == 0);
            bench.run(100 * MILLISECOND);
            assert_eq!(bench.ok("GAP 1, 0"), 0);
            assert!((bench.rotor() - middle).abs() <= 3, "mode {mode} from {start}: {}", bench.rotor());
        }
    }
}

/// If datagrams are lost while a leg begins, the leg begins a little later, and the search finds its zero point.
#[test]
fn a_search_finds_its_zero_point_though_the_beginning_of_a_leg_was_not_heard() {
    for mode in [1, 3, 4, 66] {
        let (bench, changes) = searched(mode, Disturbed::default());
        let (place, _) = places(&bench);
        assert!(changes.len() >= 5, "{changes:?}");
        for poll in changes[..changes.len() - 1].iter().copied() {
            for (refused, heard) in [(false, false), (false, true), (true, false), (true, true)] {
                for (spared, lost) in [(0, 1), (0, 2), (0, 4), (1, 1), (1, 2), (2, 1), (2, 3), (3, 1)] {
                    let disturbed = Disturbed { poll, refused, spared, lost, heard };
                    let (bench, _) = searched(mode, disturbed);
                    let (found, position) = places(&bench);
                    assert!((found - place).abs() <= 1, "mode {mode}, {disturbed:?}: {found}, not {place}");
                    assert_eq!((position, bench.raised(ErrorFlag::Position)), (0, false), "mode {mode}, {disturbed:?}");
                }
            }
        }
    }
}

/// If datagrams are lost when the position is to become zero, the search gives up and reports that. The stop switches
/// then act as they did before.
#[test]
fn a_search_that_cannot_make_the_position_zero_has_given_up() {
    for mode in [1, 4] {
        let (_, changes) = searched(mode, Disturbed::default());
        let poll = *changes.last().unwrap();
        for lost in 1..=3 {
            let (mut bench, _) = searched(mode, Disturbed { poll, lost, ..Disturbed::default() });
            assert!(bench.raised(ErrorFlag::Position), "mode {mode}, {lost} lost");
            bench.fails.set(0);
            bench.ok("ROR 0, 500");
            bench.run(3000);
            assert_eq!((bench.speed(), places(&bench).0), (0, 2000), "mode {mode}, {lost} lost");
        }
    }
}
