//! The stage that a motor drives, with stop and home switches on three input pins, and an encoder with A, B and N
//! tracks. On some boards the three pins serve either; then the encoder takes the place of the switches.
//!
//! Each pin is driven by a push-pull sensor: low while its switch is open or does not exist, high while it is pressed.
//! (With the polarity parameter at 0 the TMC429 takes a high pin for an active switch.) The pin of a normally closed
//! switch is high unless the switch is pressed. A switch is pressed while the stage or a hand presses it. The module's
//! pull-up resistors change nothing.
//!
//! The switches see only the positions at which the rotor comes to stand after each step. A blow that carries the rotor
//! across a switch leaves that switch as it is.

use super::config::{AbnConfig, StageConfig};
use super::pin::Pin;
use super::switch::{Cam, Window};

/// The counter of an ABN encoder: what a quadrature decoder makes of its tracks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Abn {
    /// Quadrature counts since the start of the world, four per line.
    pub count: i64,
    /// The edges at which the null track N became high.
    pub null_high: Edges,
    /// The edges at which the null track N became low.
    pub null_low: Edges,
}

/// The edges of the null track in one direction of its level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Edges {
    /// The number of these edges since the start of the world.
    pub times: u64,
    /// The count right after the last of them.
    pub count: i64,
}

impl Edges {
    fn add(&mut self, times: u64, count: i64) {
        *self = Self { times: self.times + times, count };
    }
}

/// The stage. Positions are in 1/256 full steps of the rotor.
#[derive(Clone, Debug)]
pub struct Stage {
    cams: Vec<(Pin, Cam)>,
    abn_config: Option<AbnConfig>,
    /// The encoder's tracks are connected to the pins of the switches, and the stage has no switches.
    tracks_at_switches: bool,
    units_per_turn: i64,
    /// The positions around the rotor at which no pin changes.
    window: Window,
    /// The switches that the stage presses, or the levels of the encoder's tracks, as bits of pins.
    sensed: u8,
    /// The switches that are pressed by hand, as bits of pins.
    by_hand: u8,
    /// The normally closed switches, as bits of pins.
    inverted: u8,
    abn: Abn,
}

impl Stage {
    /// A stage on a motor with `units_per_turn` units in a turn and its rotor at position `rotor`. With
    /// `tracks_at_switches` an ABN encoder takes the place of the switches.
    pub fn new(
        config: &StageConfig,
        abn_config: Option<AbnConfig>,
        tracks_at_switches: bool,
        units_per_turn: i64,
        rotor: i64,
    ) -> Self {
        let tracks_at_switches = tracks_at_switches && abn_config.is_some();
        let mut stage = Self {
            cams: if tracks_at_switches { Vec::new() } else { Cam::all(config) },
            abn_config,
            tracks_at_switches,
            units_per_turn: units_per_turn.max(1),
            window: Window { lowest: rotor, highest: rotor },
            sensed: 0,
            by_hand: 0,
            inverted: config.normally_closed.iter().fold(0, |pins, pin| pins | pin.bit()),
            abn: Abn::default(),
        };
        if let Some(abn) = &stage.abn_config {
            stage.abn.count = stage.count(abn, rotor);
        }
        stage.sense(rotor);
        stage
    }

    /// Moves the stage to the rotor's position. This takes little time as long as no pin changes.
    #[inline]
    pub fn move_to(&mut self, rotor: i64) {
        if !self.window.contains(rotor) {
            self.sense(rotor);
        }
    }

    /// How far a rotor at `rotor` may move up or down before a pin can change or the encoder counts.
    #[inline]
    pub(super) fn free_way(&self, rotor: i64, up: bool) -> i64 {
        let Window { lowest, highest } = self.window;
        (if up { highest.saturating_sub(rotor) } else { rotor.saturating_sub(lowest) }).max(0)
    }

    /// The number of units of position in a turn of the motor.
    pub fn units_per_turn(&self) -> i64 {
        self.units_per_turn
    }

    /// The levels of the pins: bit 0 left, bit 1 right, bit 2 home.
    #[inline]
    pub fn pins(&self) -> u8 {
        (self.sensed | self.by_hand) ^ self.inverted
    }

    /// The pins whose levels can change when the rotor moves, as bits in the order of [`pins`](Self::pins).
    pub fn moving_pins(&self) -> u8 {
        if self.tracks_at_switches { 0b111 } else { self.cams.iter().fold(0, |pins, (pin, _)| pins | pin.bit()) }
    }

    /// Presses or releases a switch by hand.
    pub fn press(&mut self, pin: Pin, pressed: bool) {
        if pressed {
            self.by_hand |= pin.bit();
        } else {
            self.by_hand &= !pin.bit();
        }
    }

    /// Presses or releases a switch by hand so that its pin has this level, if the stage does not press it.
    pub fn set_level(&mut self, pin: Pin, high: bool) {
        self.press(pin, high != (self.inverted & pin.bit() != 0));
    }

    /// The counter of the ABN encoder; all zero without an encoder.
    pub fn abn(&self) -> Abn {
        self.abn
    }

    /// The levels of the tracks A, B and N where the encoder has counted to `count`; all low without an encoder.
    /// Counting up, A leads B.
    pub fn tracks(&self, count: i64) -> [bool; 3] {
        let Some(abn) = &self.abn_config else { return [false; 3] };
        let quarter = count.rem_euclid(4);
        [quarter == 1 || quarter == 2, quarter >= 2, count.rem_euclid(abn.counts_per_turn()) == 0]
    }

    fn count(&self, abn: &AbnConfig, rotor: i64) -> i64 {
        let units = i128::from(rotor - abn.index) * i128::from(abn.counts_per_turn());
        units.div_euclid(i128::from(self.units_per_turn)) as i64
    }

    #[cold]
    fn sense(&mut self, rotor: i64) {
        let (switches, window) = self.sense_switches(rotor);
        (self.sensed, self.window) = (switches, window);
        if let Some(abn) = self.abn_config.clone() {
            let (tracks, same) = self.sense_tracks(&abn, rotor);
            self.window = window.and(same);
            if self.tracks_at_switches {
                self.sensed = tracks;
            }
        }
    }

    /// The switches that are closed at a position, as bits of pins, and the positions around it where the same are
    /// closed.
    fn sense_switches(&self, rotor: i64) -> (u8, Window) {
        let mut window = Window::ALL;
        let mut sensed = 0;
        for (pin, cam) in &self.cams {
            let (closed, same) = cam.sense(rotor, self.sensed & pin.bit() != 0);
            window = window.and(same);
            if closed {
                sensed |= pin.bit();
            }
        }
        (sensed, window)
    }

    /// Counts the encoder to a position. Returns the levels of its tracks, as bits of the pins of the switches, and the
    /// positions around it where they are the same.
    fn sense_tracks(&mut self, abn: &AbnConfig, rotor: i64) -> (u8, Window) {
        let per_turn = abn.counts_per_turn();
        let (before, count) = (self.abn.count, self.count(abn, rotor));
        // N is high for one count in each turn, that which begins at the index.
        let (from, to) = (before.div_euclid(per_turn), count.div_euclid(per_turn));
        if to > from {
            self.abn.null_high.add(to.abs_diff(from), to * per_turn);
        } else if to < from {
            self.abn.null_low.add(from.abs_diff(to), (to + 1) * per_turn - 1);
        }
        let (from, to) = ((before - 1).div_euclid(per_turn), (count - 1).div_euclid(per_turn));
        if to < from {
            self.abn.null_high.add(from.abs_diff(to), (to + 1) * per_turn);
        } else if to > from {
            self.abn.null_low.add(to.abs_diff(from), to * per_turn + 1);
        }
        self.abn.count = count;
        let levels = self.tracks(count).into_iter().zip([Pin::Left, Pin::Right, Pin::Home]);
        let tracks = levels.fold(0, |pins, (high, pin)| if high { pins | pin.bit() } else { pins });
        // The first position at which the encoder has this count, rounded up.
        let begin = |count: i64| {
            let units = -i128::from(count) * i128::from(self.units_per_turn);
            -units.div_euclid(i128::from(per_turn)) as i64 + abn.index
        };
        (tracks, Window { lowest: begin(count), highest: begin(count + 1) - 1 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LEFT: u8 = 1;
    const RIGHT: u8 = 2;
    const HOME: u8 = 4;

    fn stage() -> Stage {
        let config =
            StageConfig { left: Some(-1_000), right: Some(1_000), home: Some([-10, 10]), ..StageConfig::default() };
        Stage::new(&config, None, true, 51_200, 0)
    }

    #[test]
    fn switches_are_closed_at_and_beyond_their_positions() {
        let mut stage = stage();
        let expected = [
            (-5_000, LEFT),
            (-1_000, LEFT),
            (-999, 0),
            (-11, 0),
            (-10, HOME),
            (10, HOME),
            (11, 0),
            (999, 0),
            (1_000, RIGHT),
            (9_999, RIGHT),
        ];
        for &(at, pins) in expected.iter().chain(expected.iter().rev()) {
            stage.move_to(at);
            assert_eq!(stage.pins(), pins, "at {at}");
        }
        for at in -1_100..1_100 {
            stage.move_to(at);
            let fresh = {
                let mut other = stage.clone();
                other.sense(at);
                other.pins()
            };
            assert_eq!(stage.pins(), fresh, "at {at}");
        }
    }

    #[test]
    fn with_a_width_a_switch_opens_again_behind_the_cam() {
        let config = StageConfig {
            left: Some(-1_000),
            left_width: Some(100),
            right: Some(1_000),
            right_width: Some(1),
            ..StageConfig::default()
        };
        let mut stage = Stage::new(&config, None, true, 51_200, 0);
        let expected =
            [(-1_100, 0), (-1_099, LEFT), (-1_000, LEFT), (-999, 0), (999, 0), (1_000, RIGHT), (1_001, 0), (9_999, 0)];
        for &(at, pins) in expected.iter().chain(expected.iter().rev()) {
            stage.move_to(at);
            assert_eq!(stage.pins(), pins, "at {at}");
        }
    }

    /// Built in the other way round, the left switch is pressed where positions are high, and the cams go outward as
    /// they do otherwise.
    #[test]
    fn a_stage_may_be_the_other_way_round() {
        let config = StageConfig {
            left: Some(1_000),
            right: Some(-1_000),
            right_width: Some(100),
            reversed: true,
            ..StageConfig::default()
        };
        let mut stage = Stage::new(&config, None, true, 51_200, 0);
        let expected =
            [(-1_100, 0), (-1_099, RIGHT), (-1_000, RIGHT), (-999, 0), (999, 0), (1_000, LEFT), (9_999, LEFT)];
        for &(at, pins) in expected.iter().chain(expected.iter().rev()) {
            stage.move_to(at);
            assert_eq!(stage.pins(), pins, "at {at}");
        }
    }

    /// On a rotary stage of 3000 units, with switches that overlap, each switch is closed where the remainder of the
    /// position says, over three circles and step by step.
    #[test]
    fn a_rotary_stage_repeats_its_switches() {
        let config = StageConfig {
            left: Some(-1_000),
            left_width: Some(50),
            right: Some(4_000),
            right_width: Some(50),
            home: Some([-10, 1_010]),
            circle: Some(3_000),
            ..StageConfig::default()
        };
        let mut stage = Stage::new(&config, None, true, 51_200, 0);
        for at in (0..5_000_i64).chain((-5_000..5_000).rev()) {
            stage.move_to(at);
            let phase = at.rem_euclid(3_000);
            let level = |pin: u8, closed: bool| if closed { pin } else { 0 };
            let expected = level(LEFT, (1_951..=2_000).contains(&phase))
                | level(RIGHT, (1_000..1_050).contains(&phase))
                | level(HOME, phase <= 1_010 || phase >= 2_990);
            assert_eq!(stage.pins(), expected, "at {at}");
        }
    }

    #[test]
    fn hysteresis_holds_every_switch() {
        let config = StageConfig { left: Some(-100), home: Some([50, 60]), hysteresis: 8, ..StageConfig::default() };
        let mut stage = Stage::new(&config, None, true, 51_200, 0);
        for (at, pins) in
            [(-99, 0), (-100, LEFT), (-92, LEFT), (-91, 0), (-99, 0), (50, HOME), (68, HOME), (69, 0), (61, 0), (42, 0)]
        {
            stage.move_to(at);
            assert_eq!(stage.pins(), pins, "at {at}");
        }
    }

    #[test]
    fn a_normally_closed_switch_is_low_when_pressed() {
        let config =
            StageConfig { left: Some(-1_000), normally_closed: vec![Pin::Left, Pin::Home], ..StageConfig::default() };
        let mut stage = Stage::new(&config, None, true, 51_200, 0);
        assert_eq!(stage.pins(), LEFT | HOME);
        stage.press(Pin::Home, true);
        assert_eq!(stage.pins(), LEFT);
        stage.move_to(-1_000);
        assert_eq!(stage.pins(), 0);
        stage.set_level(Pin::Home, true);
        stage.set_level(Pin::Right, true);
        assert_eq!(stage.pins(), RIGHT | HOME);
    }

    #[test]
    fn a_switch_can_be_pressed_by_hand_wherever_the_stage_is() {
        let mut stage = stage();
        stage.move_to(500);
        stage.press(Pin::Left, true);
        assert_eq!(stage.pins(), LEFT);
        stage.move_to(-2_000);
        stage.press(Pin::Left, false);
        assert_eq!(stage.pins(), LEFT, "the stage presses it still");
    }

    #[test]
    fn pins_that_move_are_told() {
        assert_eq!(stage().moving_pins(), 0b111);
        let moving = |config: StageConfig| Stage::new(&config, None, true, 51_200, 0).moving_pins();
        assert_eq!(moving(StageConfig { right: Some(100), ..StageConfig::default() }), 0b010);
        assert_eq!(moving(StageConfig::default()), 0);
        assert_eq!(
            Stage::new(&StageConfig::default(), Some(AbnConfig { lines: 512, index: 0 }), true, 51_200, 0)
                .moving_pins(),
            0b111
        );
    }

    #[test]
    fn an_encoder_on_pins_of_its_own_leaves_the_switches_theirs() {
        let config = StageConfig { right: Some(1_000), ..StageConfig::default() };
        let abn = AbnConfig { lines: 512, index: 0 };
        let mut stage = Stage::new(&config, Some(abn), false, 51_200, 0);
        assert_eq!(stage.moving_pins(), RIGHT);
        for (at, count, pins) in [(24, 0, 0), (25, 1, 0), (999, 39, 0), (1_000, 40, RIGHT), (1_030, 41, RIGHT)] {
            stage.move_to(at);
            assert_eq!((stage.abn().count, stage.pins()), (count, pins), "at {at}");
        }
    }

    #[test]
    fn without_switches_all_pins_stay_low() {
        let mut stage = Stage::new(&StageConfig::default(), None, true, 51_200, 0);
        for at in [i64::MIN / 4, 0, i64::MAX / 4] {
            stage.move_to(at);
            assert_eq!(stage.pins(), 0);
        }
    }

    #[test]
    fn the_encoder_counts_four_per_line_and_shows_its_tracks() {
        // 512 lines are 2048 counts a turn: 51 200 / 2048 = 25 units a count.
        let abn = AbnConfig { lines: 512, index: 0 };
        let mut stage = Stage::new(&StageConfig::default(), Some(abn), true, 51_200, 1);
        let tracks: Vec<u8> = (0..5)
            .map(|count| {
                stage.move_to(count * 25);
                stage.pins()
            })
            .collect();
        assert_eq!(tracks, [HOME, LEFT, LEFT | RIGHT, RIGHT, 0]);
        assert_eq!(stage.abn().count, 4);
        stage.move_to(99);
        assert_eq!(stage.abn().count, 3);
        stage.move_to(-1);
        assert_eq!(stage.abn().count, -1);
    }

    #[test]
    fn null_is_counted_once_a_turn_however_far_a_step_goes() {
        let abn = AbnConfig { lines: 512, index: 100 };
        let mut stage = Stage::new(&StageConfig::default(), Some(abn), true, 51_200, 50);
        for at in 50..=51_400 {
            stage.move_to(at);
        }
        assert_eq!(stage.abn().null_high.times, 2);
        assert_eq!(stage.abn().null_high.count, 2_048);
        stage.move_to(51_250);
        assert_eq!(stage.abn().null_high.times, 3, "back over it");
        stage.move_to(0);
        assert_eq!((stage.abn().null_high.times, stage.abn().null_high.count), (4, 0));
        stage.move_to(3 * 51_200);
        assert_eq!((stage.abn().null_high.times, stage.abn().null_high.count), (7, 4_096));
    }
}
