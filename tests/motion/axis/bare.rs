//! Requests that no command of TMCL makes to an axis, and other languages do: an axis of a device on the simulated
//! board, without a module.

use hal_sim::board::{AxisInputs, Board, SharedBoard, SimSpi};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use hal_sim::fault::Fault;
use hal_sim::world::config::WorldConfig;
use tmcm::device::{Device, Inputs, Inversion, Piece};
use tmcm::motion::tmc429::Tmc429Tmc262;
use tmcm::motion::{Error, Events, Joined, Pace, Sensors};
use tmcm::param::AxisParameter as P;
use tmcm::product::TMCM_1140;
use tmcm::units::Micros;
use tmcm_sim::native::{Simulated, parts};

type Chips = Tmc429Tmc262<SimSpi, SimSpi>;

/// An axis of a TMCM-1140 that nobody commands but the test.
pub(super) struct Bare {
    pub(super) board: SharedBoard,
    pub(super) device: Device<Simulated<()>, 1>,
}

impl Bare {
    /// In a world that the text describes, ready to move.
    pub(super) fn in_world(toml: &str) -> Self {
        let board = SharedBoard::new(Board::new(&WorldConfig::parse(toml).unwrap(), 1));
        let mut device = Device::new(parts(&board), TMCM_1140.axis);
        device.halt();
        device.start(Micros(0), Inversion::default());
        device.enable_drivers(true);
        Bare { board, device }
    }

    /// Has the axis do something now.
    pub(super) fn tell(&mut self, act: impl FnOnce(&mut Joined<'_, Chips>, Micros) -> Result<(), Error>) {
        let now = Micros(self.board.borrow().now() / MICROSECOND);
        act(&mut self.device.axis(0).unwrap(), now).unwrap();
    }

    pub(super) fn set(&mut self, number: u8, value: i32) {
        self.tell(|axis, now| axis.write(now, TMCM_1140.axis.find(number).unwrap(), value));
    }

    pub(super) fn get(&mut self, parameter: P) -> i32 {
        self.device.axis(0).unwrap().read(parameter).unwrap()
    }

    /// Lets one poll pass, with the reading before it: there is one of both in each millisecond.
    pub(super) fn poll(&mut self) -> Events {
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
    pub(super) fn polls_until(&mut self, mut awaited: impl FnMut(&mut Self, Events) -> bool) -> usize {
        (1..60_000)
            .find(|_| {
                let events = self.poll();
                awaited(self, events)
            })
            .expect("it does not come")
    }

    /// The speed as the motion controller has it.
    pub(super) fn speed(&self) -> i32 {
        self.board.borrow().tmc429(0).velocity(0)
    }

    pub(super) fn rotor(&self) -> i64 {
        self.board.borrow().world().axis(0).motor().rotor()
    }
}

/// At divisors 7 and 3 an acceleration of 1000 changes the speed by 15.3 in a millisecond. From 1000 to 0 that takes 66
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

/// A move is given another target, and another pace, while it is under way: it never stands in between, and arrives at
/// the last target alone.
#[test]
fn a_move_is_aimed_anew_while_the_motor_turns() {
    let mut bare = Bare::in_world("");
    bare.tell(|axis, now| axis.move_to(now, 100_000));
    bare.polls_until(|bare, _| bare.speed() == 1000);
    let pace = Pace { speed: Some(300), acceleration: Some(500), shape: None };
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
    bare.tell(|axis, now| axis.move_at(now, 300_000, Pace { speed: Some(700), acceleration: None, shape: None }));
    let mut fastest = 0;
    bare.polls_until(|bare, events| {
        fastest = fastest.max(bare.speed());
        events.reached
    });
    assert_eq!((fastest, bare.rotor()), (700, 300_000));
    assert_eq!((bare.get(P::MaximumSpeed), bare.get(P::MaximumAcceleration)), (1000, 1000));
}

/// A unit of speed is 16 MHz / (2^divisor * 2048 * 32). Whatever the divisor, a motor that is too slow by one microstep
/// gets as much speed as makes up for it in 2^18 clocks, which are 16.4 ms.
#[test]
fn a_lag_is_made_up_for_in_the_same_time_at_every_pulse_divisor() {
    let mut bare = Bare::in_world("");
    for divisor in 0..=12 {
        bare.set(154, divisor);
        let correction = bare.device.axes()[0].correction(256);
        let unit = 16e6 / f64::from(1 << divisor) / 65_536.0;
        let way = f64::from(correction) / 256.0 * unit * f64::from(1 << 18) / 16e6;
        assert!((way - 1.0).abs() < 1e-9, "{divisor}: {way}");
    }
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

/// A device that was given up because its motion controller was silent, and was to be restarted, is as good as new
/// after another start.
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
