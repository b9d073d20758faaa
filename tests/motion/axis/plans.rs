//! Reference searches by lists of legs that no mode of parameter 193 has, and the right stop switch that the axis
//! watches itself.

use super::bare::Bare;
use hal_sim::fault::Fault;
use tmcm::motion::tmc429::Trapezoid;
use tmcm::motion::{Error, Leg, Mark, Pace, Plan, Side, Sought, Until};
use tmcm::param::AxisParameter as P;
use tmcm::units::Micros;

/// The pace of slow legs: one microstep in a poll or none.
const PACE: Pace<Trapezoid> = Pace { speed: Some(20), acceleration: Some(800), shape: None };

/// Searches for a zero point by a list of legs, and gives where on the rotor's scale it is, unless the search gives up.
/// The zero point gets the position -777.
fn zero_by(world: &str, plan: Plan, start: i32) -> Option<i64> {
    zero_of(&mut Bare::in_world(world), plan, start, PACE)
}

fn zero_of(bare: &mut Bare, plan: Plan, start: i32, pace: Pace<Trapezoid>) -> Option<i64> {
    if start != 0 {
        bare.tell(|axis, now| axis.move_to(now, start));
        bare.polls_until(|_, events| events.reached || events.cut_short);
    }
    bare.tell(|axis, now| axis.search_by(now, plan, -777, 500, pace));
    let mut found = false;
    bare.polls_until(|bare, events| {
        found = events.reached;
        (events.reached || events.cut_short) && !bare.device.axes()[0].searches()
    });
    assert!(!found || (bare.device.axes()[0].last_position(), bare.get(P::EncoderPosition)) == (-777, -777));
    found.then(|| bare.rotor())
}

/// Searches that end at an edge of a switch, and none of them is one of parameter 193. The zero point is where the
/// switch opens when the motor leaves it. From beyond the home switch only a search that turns round finds it, and
/// leaves it on the other side.
#[test]
fn another_search_is_another_list_of_legs() {
    let world = "[stage]\nleft = -9000\nright = 9000\nhome = [2000, 4000]\n";
    const LEGS: &[Leg] = &[Leg::FIND, Leg::LEAVE];
    let home = Sought::Home { inverted: false };
    for (sought, turns, positive, start, place) in [
        (Sought::Stop, false, false, 0, Some(-9000)),
        (Sought::Stop, false, false, 6000, Some(-9000)),
        (Sought::Stop, false, true, 0, Some(9000)),
        (home, false, true, 0, Some(2000)),
        (home, false, true, 3000, Some(2000)),
        (home, false, true, 6000, None),
        (home, true, true, 6000, Some(4000)),
        (home, false, false, 6000, Some(4000)),
        (home, false, false, 3000, Some(4000)),
        (home, false, false, 0, None),
    ] {
        let turned = turns.then_some(LEGS);
        let zero = zero_by(world, Plan { sought, positive, stops: [true; 2], legs: LEGS, turned }, start);
        let differs = zero.unwrap_or_default().abs_diff(place.unwrap_or_default());
        let case = format!("{sought:?}, positive {positive}, from {start}: {zero:?}");
        assert!(zero.is_some() == place.is_some() && differs <= 3, "{case}");
    }
}

/// The zero point of the built-in encoder, once in a turn of 51 200 microsteps: the next one from a switch on, or from
/// where the motor is.
#[test]
fn a_search_ends_at_the_index_of_the_encoder() {
    const BACK: Leg = Leg { ahead: false, ..Leg::to(Until::Index, Mark::First) };
    const FROM_SWITCH: &[Leg] = &[Leg::FIND, Leg::LEAVE, BACK];
    const ALONE: &[Leg] = &[Leg::to(Until::Index, Mark::First)];
    let world = "[stage]\nleft = -20000\nright = 45000\n[encoder]\noffset = -13000\n";
    let sought = Sought::Stop;
    for (positive, legs, start, index) in [
        (false, FROM_SWITCH, 0, -13_000),
        (true, FROM_SWITCH, 0, 38_200),
        (false, ALONE, -8_000, -13_000),
        (true, ALONE, 33_000, 38_200),
        (true, ALONE, -18_000, -13_000),
    ] {
        let zero = zero_by(world, Plan { sought, positive, stops: [true; 2], legs, turned: None }, start).unwrap();
        assert!((zero - index).abs() <= 2, "positive {positive}, {legs:?} from {start}: {zero}");
    }
}

/// A search whose speed is zero would never end; one that meets a stop switch that it does not look for gives up.
#[test]
fn a_search_is_refused_or_gives_up() {
    const LEGS: &[Leg] = &[Leg::to(Until::Index, Mark::First)];
    let mut bare = Bare::in_world("[stage]\nleft = -1000\nright = 1000\n");
    let plan = Plan { sought: Sought::Stop, positive: true, stops: [true; 2], legs: LEGS, turned: None };
    for (fast, slow) in [(0, 100), (500, 0)] {
        let pace = Pace { speed: Some(slow), acceleration: None, shape: None };
        let mut axis = bare.device.axis(0).unwrap();
        assert_eq!(axis.search_by(Micros(0), plan, 0, fast, pace), Err(Error::NotNow));
    }
    bare.set(12, 0);
    bare.tell(|axis, now| {
        axis.search_by(now, plan, 0, 500, Pace { speed: Some(100), acceleration: None, shape: None })
    });
    let mut limit = None;
    bare.polls_until(|bare, events| {
        limit = limit.or(events.limit);
        events.cut_short && !bare.device.axes()[0].searches()
    });
    assert_eq!((bare.speed(), limit), (0, Some(Side::Right)));
}

/// A search of the home switch that begins anew with other legs after it has turned round. It always ends where the
/// left edge of the switch is, also where it runs over the switch from the right. A switch that is not there turns
/// nothing round and stops nothing.
#[test]
fn a_search_that_has_turned_round_goes_on_by_other_legs() {
    const LEGS: &[Leg] = &[Leg::FIND, Leg::LEAVE];
    const TURNED: &[Leg] = &[Leg::FIND, Leg::ONTO, Leg::OFF];
    let sought = Sought::Home { inverted: false };
    let plan = Plan { sought, positive: true, stops: [true; 2], legs: LEGS, turned: Some(TURNED) };
    for (home, edge) in [("[2000, 4000]", 2000), ("[2000, 2400]", 2000), ("[2000, 8000]", 2000)] {
        let world = format!("[stage]\nleft = -9000\nright = 9000\nhome = {home}\n");
        for start in [-5000, -9500, 0, 2200, 4500, 8500, 9500] {
            let zero = zero_by(&world, plan, start);
            assert!(zero.is_some_and(|zero| (zero - edge).abs() <= 2), "{home} from {start}: {zero:?}");
        }
    }
    let world = "[stage]\nleft = -9000\nright = 3000\nhome = [5000, 8000]\n";
    assert_eq!(zero_by(world, plan, 0), None, "the left switch ends it");
    let zero = zero_by(world, Plan { stops: [true, false], ..plan }, 0);
    assert!(zero.is_some_and(|zero| (zero - 5000).abs() <= 2), "{zero:?}");
}

/// The motor passes a zero point of the encoder while it comes to a stand behind the edge of a switch. That is the next
/// zero point from the edge on. One that the motor has passed before the edge, or on its way to the switch, is not.
#[test]
fn the_next_index_is_counted_from_the_edge() {
    const LEGS: &[Leg] = &[Leg::FIND, Leg::LEAVE, Leg::BACK_TO_INDEX];
    let plan = Plan { sought: Sought::Stop, positive: false, stops: [true; 2], legs: LEGS, turned: None };
    for (beyond, place) in [(-300, 51_200 - 300), (-60, 51_200 - 60), (60, 60), (100, 100), (600, 600)] {
        for start in [0, -9100] {
            let world = format!("[stage]\nleft = -9000\nright = 90000\n[encoder]\noffset = {}\n", beyond - 9000);
            let mut bare = Bare::in_world(&world);
            let pace = Pace { speed: Some(400), acceleration: Some(100), shape: None };
            let zero = zero_of(&mut bare, plan, start, pace).unwrap();
            assert!((zero + 9000 - place).abs() <= 50 + way(400), "{beyond} from {start}: {zero}");
        }
    }
}

/// While the motor passes the zero point of the encoder the motion controller does not answer. Where the zero point was
/// follows from the encoder's angle, and it does not matter when that is known.
#[test]
fn an_index_counts_where_it_was_though_the_position_was_not_heard() {
    let mut bare = Bare::in_world("[encoder]\noffset = 13000\n");
    let plan = Plan { sought: Sought::Stop, positive: true, stops: [true; 2], legs: &[Leg::INDEX], turned: None };
    let pace = Pace { speed: Some(2000), acceleration: Some(2000), shape: None };
    bare.tell(|axis, now| axis.search_by(now, plan, 0, 500, pace));
    bare.polls_until(|bare, _| bare.rotor() + way(2000) > 13_000);
    bare.board.borrow_mut().set_fault(Fault::Tmc429, 0, true);
    bare.poll();
    assert!(bare.rotor() > 13_000);
    bare.poll();
    bare.board.borrow_mut().set_fault(Fault::Tmc429, 0, false);
    bare.polls_until(|_, events| events.reached);
    assert!((bare.rotor() - 13_000).abs() <= 50 + way(2000), "{}", bare.rotor());
}

/// The way of a millisecond at a speed, in microsteps, with divisor 3.
fn way(speed: i32) -> i64 {
    i64::from(speed) * 16_000_000 / (2048 * 32 * 8) / 1000 + 1
}

/// A right stop switch that is closed while its input is low, beside a left one that is closed while its input is high.
/// The ramp generator has the polarity of the left one, and the axis watches the right one. The axis stops the motor in
/// the poll that sees the switch closed, and lets the motor go back, but not on.
#[test]
fn an_axis_watches_a_right_switch_of_another_polarity() {
    let world = "[stage]\nleft = -9000\nright = 9000\nnormally_closed = [\"right\"]\n";
    for target in [20_000, 9_300] {
        let mut bare = Bare::in_world(world);
        bare.device.axis(0).unwrap().state_mut().watch_right_switch(Some(false));
        for number in [12, 13] {
            bare.set(number, 0);
        }
        bare.poll();
        assert_eq!(bare.device.stop_switches(0), Some([false, false]));
        bare.tell(|axis, now| axis.move_to(now, target));
        bare.polls_until(|_, events| events.cut_short);
        assert_eq!(bare.speed(), 0, "to {target}");
        let rotor = bare.rotor();
        assert!((9000..=9000 + way(1000)).contains(&rotor), "{rotor}");
        assert_eq!(bare.device.stop_switches(0), Some([false, true]));
        assert_eq!((bare.get(P::RightSwitch), bare.get(P::LeftSwitch)), (1, 0));
        // On it does not go; back it does, and back from the other side of the switch.
        bare.tell(|axis, now| axis.rotate(now, 1000));
        let polls = bare.polls_until(|bare, _| bare.speed() == 0);
        assert!(polls <= 2 && bare.rotor() <= rotor + 2, "{polls} polls, {}", bare.rotor());
        bare.tell(|axis, now| axis.move_to(now, 1000));
        bare.polls_until(|_, events| events.reached);
        assert_eq!(bare.rotor(), 1000);
    }
}

/// On the closed switch not even one microstep is made, by a move as well as by the slowest rotation, whichever reading
/// comes first.
#[test]
fn a_watched_switch_lets_a_motor_make_no_microstep() {
    let world = "[stage]\nright = 9000\nnormally_closed = [\"right\"]\n[motor]\nstart = 9100\n";
    for (rotates, polls) in [false, true].into_iter().flat_map(|rotates| (1..9).map(move |polls| (rotates, polls))) {
        let mut bare = Bare::in_world(world);
        bare.device.axis(0).unwrap().state_mut().watch_right_switch(Some(false));
        bare.set(12, 0);
        for _ in 0..polls {
            bare.poll();
        }
        let rotor = bare.rotor();
        bare.tell(|axis, now| if rotates { axis.rotate(now, 1) } else { axis.move_to(now, 1) });
        let told = bare.poll();
        let case = format!("rotates: {rotates}, after {polls} polls");
        assert_eq!((told.cut_short, bare.get(P::TargetSpeed), bare.get(P::RampMode)), (!rotates, 0, 2), "{case}");
        for _ in 0..200 {
            bare.poll();
        }
        assert_eq!((bare.rotor(), bare.speed()), (rotor, 0), "{case}");
    }
}

/// A motor that runs into the switch while it turns round is stopped there, and goes on to where it was sent.
#[test]
fn a_motor_that_turns_round_at_a_watched_switch_goes_back() {
    let world = "[stage]\nright = 9000\nnormally_closed = [\"right\"]\n";
    for velocity in [false, true] {
        let mut bare = Bare::in_world(world);
        bare.device.axis(0).unwrap().state_mut().watch_right_switch(Some(false));
        bare.set(12, 0);
        bare.set(5, 300);
        bare.tell(|axis, now| axis.move_to(now, 200_000));
        bare.polls_until(|bare, _| bare.rotor() > 8_000);
        bare.tell(|axis, now| if velocity { axis.rotate(now, -300) } else { axis.move_to(now, -2_000) });
        let (mut furthest, mut cut_short) = (0, false);
        bare.polls_until(|bare, events| {
            furthest = furthest.max(bare.rotor());
            cut_short |= events.cut_short;
            events.reached || bare.speed() == -300
        });
        assert!((9000..=9000 + way(1000)).contains(&furthest), "velocity {velocity}: {furthest}");
        assert!(!cut_short && (velocity || bare.rotor() == -2_000), "velocity {velocity}: {}", bare.rotor());
    }
}

/// A search for the right switch that the axis watches finds its edge to the way of a millisecond.
#[test]
fn a_search_ends_at_a_switch_that_the_axis_watches() {
    const LEGS: &[Leg] = &[Leg::FIND, Leg::LEAVE];
    let plan = Plan { sought: Sought::Stop, positive: true, stops: [true; 2], legs: LEGS, turned: None };
    for start in [0, 8990, 9400] {
        let stage = "[stage]\nleft = -9000\nright = 9000\nnormally_closed = [\"right\"]\n";
        let mut bare = Bare::in_world(&format!("{stage}[motor]\nstart = {start}\n"));
        bare.device.axis(0).unwrap().state_mut().watch_right_switch(Some(false));
        let zero = zero_of(&mut bare, plan, 0, PACE);
        assert!(zero.is_some_and(|zero| (zero - 9000).abs() <= way(20)), "from {start}: {zero:?}");
    }
}
