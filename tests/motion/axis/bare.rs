//! What no command of TMCL asks of an axis, and other languages do: an axis of a device on the simulated board, without a
//! module.

use std::task::Poll;

use hal_sim::board::{AxisInputs, Board, SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::fault::Fault;
use hal_sim::world::config::WorldConfig;
use tmcm::device::{Device, Inputs, Inversion, Piece};
use tmcm::module::{Module, Source, TMCM_1140};
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::motion::{Error, Events, Joined, Leg, Mark, Pace, Plan, Sensors, Sought, Until};
use tmcm::param::AxisParameter as P;
use tmcm::tmcl::{Reply, Status, text};
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

type Chips = Tmc429Tmc262<SimSpi, SimSpi>;

/// An axis of a TMCM-1140 that nobody commands but the test.
struct Bare {
    board: SharedBoard,
    device: Device<Simulated<()>, 1>,
}

impl Bare {
    /// In a world that the text describes, ready to move.
    fn in_world(toml: &str) -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::parse(toml).unwrap(), 1));
        let mut device = Device::new(parts(&board), TMCM_1140.axis);
        device.halt();
        device.start(Micros(0), Inversion::default());
        device.enable_drivers(true);
        Bare { board, device }
    }

    /// Has the axis do something now.
    fn tell(&mut self, act: impl FnOnce(&mut Joined<'_, Chips>, Micros) -> Result<(), Error>) {
        let now = Micros(self.board.borrow().now() / MICROSECOND);
        act(&mut self.device.axis(0).unwrap(), now).unwrap();
    }

    fn set(&mut self, number: u8, value: i32) {
        self.tell(|axis, now| axis.write(now, TMCM_1140.axis.find(number).unwrap(), value));
    }

    fn get(&mut self, parameter: P) -> i32 {
        self.device.axis(0).unwrap().read(parameter).unwrap()
    }

    /// Lets one poll pass, with the reading before it: there is one of both in each millisecond.
    fn poll(&mut self) -> Events {
        let next = (self.board.borrow().now() / MILLISECOND + 1) * MILLISECOND;
        self.board.borrow_mut().advance_to(next - MILLISECOND / 2);
        self.device.next_reading();
        self.board.borrow_mut().advance_to(next);
        let seen = self.board.borrow().axis_inputs(0);
        let AxisInputs { stall, home, right, encoder, .. } = seen;
        let sensors = Sensors { stall, home, right, encoder, ..Sensors::default() };
        let now = Micros(self.board.borrow().now() / MICROSECOND);
        self.device.begin(now, &Inputs { axes: [sensors], ..Inputs::default() });
        self.device.next_axis(now).1
    }

    /// Lets polls pass until one is what is waited for, and tells how many that were.
    fn polls_until(&mut self, mut awaited: impl FnMut(&mut Self, Events) -> bool) -> usize {
        (1..60_000)
            .find(|_| {
                let events = self.poll();
                awaited(self, events)
            })
            .expect("it does not come")
    }

    /// The speed as the motion controller has it.
    fn speed(&self) -> i32 {
        self.board.borrow().tmc429(0).velocity(0)
    }

    fn rotor(&self) -> i64 {
        self.board.borrow().world().axis(0).motor().rotor()
    }
}

/// At divisors 7 and 3 an acceleration of 1000 changes the speed by 15.3 in a millisecond: from 1000 to 0 that takes 66
/// milliseconds, and with an acceleration of 200 five times as long. The next command has that of parameter 5 again.
#[test]
fn a_motor_stops_with_an_acceleration_of_its_own() {
    let mut bare = Bare::in_world("");
    for (acceleration, polls) in [(None, 66), (Some(200), 328), (None, 66), (Some(2000), 33)] {
        bare.tell(|axis, now| axis.rotate(now, 1000));
        let up = bare.polls_until(|bare, _| bare.speed() == 1000);
        assert!((64..=67).contains(&up), "{up} polls");
        bare.tell(|axis, now| axis.rotate_at(now, 0, acceleration));
        let down = bare.polls_until(|bare, _| bare.speed() == 0);
        assert!(down.abs_diff(polls) <= 4, "{acceleration:?}: {down} polls");
    }
}

/// A move is given another target, and another pace, while it is under way: it never stands in between, and arrives at the
/// last target alone.
#[test]
fn a_move_is_aimed_anew_while_the_motor_turns() {
    let mut bare = Bare::in_world("");
    bare.tell(|axis, now| axis.move_to(now, 100_000));
    bare.polls_until(|bare, _| bare.speed() == 1000);
    let pace = Pace { speed: Some(300), acceleration: Some(500) };
    bare.tell(|axis, now| axis.move_at(now, 200_000, pace));
    let mut slowest = i32::MAX;
    let mut arrivals = 0;
    bare.polls_until(|bare, events| {
        arrivals += i32::from(events.reached);
        if bare.device.axes()[0].last_position() < 190_000 {
            slowest = slowest.min(bare.speed());
        }
        events.reached
    });
    assert_eq!(
        (slowest, arrivals, bare.rotor(), bare.device.axes()[0].target_position()),
        (300, 1, 200_000, Some(200_000))
    );
    // Back at the speed of parameter 4, and round again.
    bare.tell(|axis, now| axis.move_to(now, 0));
    bare.polls_until(|bare, _| bare.speed() == -1000);
    bare.tell(|axis, now| axis.move_at(now, 300_000, Pace { speed: Some(700), acceleration: None }));
    let mut fastest = 0;
    bare.polls_until(|bare, events| {
        fastest = fastest.max(bare.speed());
        events.reached
    });
    assert_eq!((fastest, bare.rotor()), (700, 300_000));
    assert_eq!((bare.get(P::MaximumSpeed), bare.get(P::MaximumAcceleration)), (1000, 1000));
}

/// With its bridges off a motor has no current, whatever it is told, and has it again when they are on.
#[test]
fn bridges_are_switched() {
    let mut bare = Bare::in_world("");
    let current = |bare: &Bare| bare.board.borrow().tmc262(0).current();
    bare.poll();
    assert_eq!(current(&bare), 17);
    bare.tell(|axis, now| axis.switch_bridges(now, false));
    assert_eq!(current(&bare), 0);
    bare.tell(|axis, now| axis.rotate(now, 500));
    for _ in 0..100 {
        bare.poll();
        assert_eq!(current(&bare), 0);
    }
    assert_eq!(bare.rotor(), 0);
    bare.tell(|axis, now| axis.rotate(now, 0));
    bare.polls_until(|bare, _| bare.speed() == 0);
    bare.tell(|axis, now| axis.switch_bridges(now, true));
    assert_eq!(current(&bare), 17);
}

/// A firmware may keep the drivers off until it is told to switch them on. Those of a device whose motion controller is
/// silent stay off all the same.
#[test]
fn drivers_are_off_until_the_firmware_switches_them_on() {
    for (fault, high_at_last) in [(false, false), (true, true)] {
        let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
        board.borrow_mut().set_fault(Fault::Tmc429, 0, fault);
        let enable = || board.borrow().tmc262(0).disable_pin();
        let mut device = Device::<Simulated<()>, 1>::new(parts(&board), TMCM_1140.axis);
        device.halt();
        device.start(Micros(0), Inversion::default());
        assert!(enable());
        device.begin(Micros::from_millis(1), &Inputs::default());
        device.next_axis(Micros::from_millis(1));
        assert!(enable());
        device.enable_drivers(true);
        assert_eq!(enable(), high_at_last);
        device.enable_drivers(false);
        assert!(enable());
    }
}

/// A device that was given up because its motion controller was silent, and was to be restarted, is as good as new after
/// another start.
#[test]
fn another_start_forgets_that_a_motion_controller_was_silent() {
    let board = SharedBoard::new(Board::new(&WorldConfig::default(), 1));
    let mut device = Device::<Simulated<()>, 1>::new(parts(&board), TMCM_1140.axis);
    for silent in [true, false] {
        board.borrow_mut().set_fault(Fault::Tmc429, 0, silent);
        device.start(Micros(0), Inversion::default());
        device.enable_drivers(true);
        assert_eq!((device.is_given_up(), device.outputs().trouble), (silent, silent));
        assert_eq!((device.restart(), device.next_piece()), (None, Piece::Beginning));
        device.restart_at(Micros(1));
        device.begin(Micros(0), &Inputs::default());
        assert_eq!(board.borrow().tmc262(0).disable_pin(), silent);
    }
}

/// Searches for a zero point by a list of legs, and gives where on the rotor's scale it is, unless the search gives up.
fn zero_by(world: &str, plan: Plan, start: i32) -> Option<i64> {
    let mut bare = Bare::in_world(world);
    if start != 0 {
        bare.tell(|axis, now| axis.move_to(now, start));
        bare.polls_until(|_, events| events.reached || events.cut_short);
    }
    bare.tell(|axis, now| axis.search_by(now, plan, 0, 500, Pace { speed: Some(20), acceleration: Some(800) }));
    let mut found = false;
    bare.polls_until(|bare, events| {
        found = events.reached;
        (events.reached || events.cut_short) && !bare.device.axes()[0].searches()
    });
    assert!(!found || (bare.device.axes()[0].last_position(), bare.get(P::EncoderPosition)) == (0, 0));
    found.then(|| bare.rotor())
}

/// Searches that end at an edge of a switch, and none of them is one of parameter 193: the zero point is where the switch
/// opens when the motor leaves it. From beyond the home switch only a search that turns round finds it, and leaves it on
/// the other side.
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
        let pace = Pace { speed: Some(slow), acceleration: None };
        let mut axis = bare.device.axis(0).unwrap();
        assert_eq!(axis.search_by(Micros(0), plan, 0, fast, pace), Err(Error::NotNow));
    }
    bare.set(12, 0);
    bare.tell(|axis, now| axis.search_by(now, plan, 0, 500, Pace { speed: Some(100), acceleration: None }));
    bare.polls_until(|bare, events| events.cut_short && !bare.device.axes()[0].searches());
    assert_eq!(bare.speed(), 0);
}

/// A firmware hands its device to another one, which finds the motor and the axis parameters as they are; and back.
#[test]
fn a_device_goes_from_one_firmware_to_another() {
    let mut bare = Bare::in_world("");
    bare.set(4, 500);
    bare.tell(|axis, now| axis.move_to(now, 5_000));
    bare.polls_until(|_, events| events.reached);
    let Bare { board, device } = bare;
    let mut module = Module::with_device(device, (), 1);
    let settings = module.link_settings();
    assert_eq!((settings.address, settings.host), (1, 2), "the defaults of parameters 66 and 76");
    let mut ask = |line: &str| {
        let now = Micros(board.borrow().now() / MICROSECOND);
        match module.execute(now, Source::Usb, text::parse(line).unwrap()) {
            Poll::Ready(Some(Reply::Plain { status: Status::Ok, value, .. })) => value,
            other => panic!("{line}: {other:?}"),
        }
    };
    assert_eq!((ask("GAP 1, 0"), ask("GAP 0, 0"), ask("GAP 4, 0")), (5_000, 5_000, 500));
    ask("SAP 4, 0, 600");
    ask("MVP REL, 0, 1000");
    let mut bare = Bare { board, device: module.into_device() };
    bare.polls_until(|_, events| events.reached);
    assert_eq!((bare.rotor(), bare.get(P::MaximumSpeed)), (6_000, 600));
}
