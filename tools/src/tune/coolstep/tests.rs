use super::*;

fn reading(load: [i32; 2], current: [i32; 2]) -> Reading {
    let mut reading = Reading::default();
    load.into_iter().zip(current).for_each(|(load, current)| reading.take(load, current));
    reading
}

/// Values of 172 up to `saving` let the current fall to `low`, those above do not; it is whole under load from `whole`.
fn at_speed(saving: i32, low: i32, whole: i32) -> AtSpeed {
    let cruise = Cruise { speed: 800, name: "800 int".into(), pulses: 1.0, full_step: Duration::from_millis(10) };
    let row = |start: i32| {
        let current = if start <= saving { low } else { 16 };
        let loaded = (start >= whole).then(|| reading([0, 0], [16, 16]));
        Row { setting: Some((172, start)), free: reading([300, 300], [current, current]), loaded }
    };
    let off = Row { setting: None, free: reading([300, 310], [16, 16]), loaded: None };
    AtSpeed { cruise, off, starts: STARTS.map(row).collect(), others: Vec::new() }
}

/// A row without load, of which nothing but the current counts.
fn free(current: [i32; 2]) -> Row {
    Row { setting: None, free: reading([300, 300], current), loaded: None }
}

/// A run at a speed whose current with 172 = 5 is `chosen`, and `others` with the values of 170 and at last with 168 =
/// 1.
fn with_others(chosen: [i32; 2], others: [[i32; 2]; 6]) -> AtSpeed {
    let mut at_speed = at_speed(5, 8, 1);
    at_speed.starts[4].free = reading([300, 300], chosen);
    at_speed.others = others.map(free).into();
    at_speed
}

fn number(parameter: P) -> Option<u8> {
    tmcm::product::TMCM_1140.axis.row(parameter).map(|row| row.number)
}

const CHOICE: Choice = Choice { start: 5, hysteresis: 0, minimum: 0 };

/// The proposal for a parameter: its value and the reason.
fn proposed(at_speed: &AtSpeed, choice: Choice, parameter: u8) -> (i32, String) {
    let proposals = propose(std::slice::from_ref(at_speed), choice, Some(7), 128, 0, "int", number);
    let found = proposals.into_iter().find(|found| found.parameter == parameter).unwrap();
    (found.value, found.reason)
}

/// Parameter 6 is of 255, a scale of 32 steps: with 128 the 17th, from which the current goes down to 0 in 16
/// measurements of four full steps.
#[test]
fn the_current_has_time_to_fall() {
    let settle = |current| method(current).settle;
    assert_eq!(method(128), Method { settle: 4 * 16 + 16, apart: 4 });
    assert_eq!([0, 7, 8, 255].map(settle), [16, 16, 20, 4 * 31 + 16]);
    assert_eq!((settle(-8), settle(256)), (16, 140));
}

/// Off, with 15 values of 172, with 5 of 170 and with one of 168; under load only the first two.
#[test]
fn the_readings_are_those_of_the_rows() {
    assert_eq!(READINGS, (1 + 15 + 5 + 1, 1 + 15));
}

/// The threshold of 172 = 5 is 160: at that load value the current does not rise.
#[test]
fn below_the_lower_threshold_the_current_rises() {
    let rises = |high| gives_more(&reading([0, high], [16, 16]).load, 5);
    assert_eq!([0, 159, 160, 161].map(rises), [true, true, false, false]);
}

#[test]
fn the_middle_of_the_starts_that_save_is_chosen() {
    assert_eq!(choose_start(&[at_speed(5, 8, 1)]), Ok(3));
    assert_eq!(choose_start(&[at_speed(5, 8, 1), at_speed(3, 8, 2)]), Ok(3));
    assert_eq!(choose_start(&[at_speed(15, 8, 14)]), Ok(15));
    assert!(choose_start(&[at_speed(5, 8, 6)]).unwrap_err().contains("saves no current"));
    assert!(choose_start(&[at_speed(5, 8, 16)]).unwrap_err().contains("load the motor more"));
    let mut blind = at_speed(5, 8, 1);
    blind.off.free = reading([0, 0], [16, 16]);
    assert!(choose_start(&[at_speed(5, 8, 1), blind]).unwrap_err().contains("tmcl tune stallguard"));
    // A load value of 1 is one.
    let mut dim = at_speed(5, 8, 1);
    dim.off.free = reading([1, 1], [16, 16]);
    assert_eq!(choose_start(&[dim]), Ok(3));
}

/// Of the values that leave the current whole under load, those count with which it is lowest without, be there one or
/// many.
#[test]
fn the_lowest_current_counts() {
    let mut at_speed = at_speed(5, 8, 1);
    at_speed.starts[8].free = reading([300, 300], [7, 7]);
    assert_eq!(choose_start(std::slice::from_ref(&at_speed)), Ok(9));
    // Once it is not whole under load, what is second best counts.
    at_speed.starts[8].loaded = Some(reading([0, 0], [16, 15]));
    assert_eq!(choose_start(std::slice::from_ref(&at_speed)), Ok(3));
    // Together, 16 + 8 at one speed and 8 + 8 at the other.
    assert_eq!(choose_start(&[self::at_speed(5, 8, 1), self::at_speed(9, 8, 5)]), Ok(5));
}

/// A hysteresis is chosen only if the current swings without; a quarter only if it saves.
#[test]
fn hysteresis_and_minimum() {
    let mut at_speed = at_speed(5, 8, 1);
    at_speed.others = [[6, 9], [8, 8], [8, 8], [12, 12], [16, 16], [8, 8]].map(free).into();
    let chosen = |at_speed: AtSpeed| {
        let speeds_tried = [at_speed];
        (choose_hysteresis(&speeds_tried, 5), choose_minimum(&speeds_tried, 5))
    };
    assert_eq!(chosen(at_speed), (0, 0));
    assert_eq!(chosen(with_others([6, 10], [[6, 9], [8, 8], [8, 8], [12, 12], [16, 16], [5, 5]])), (2, 1));
}

/// The current swings if its samples are more than one step apart. It is as low as without a hysteresis if it is one
/// step higher at most.
#[test]
fn a_current_is_steady_within_a_step() {
    let chosen = |swing, others| choose_hysteresis(&[with_others(swing, others)], 5);
    let steady = [[8, 8]; 6];
    assert_eq!((chosen([8, 9], steady), chosen([7, 9], steady)), (0, 1));
    assert_eq!(chosen([7, 9], [[7, 9], [8, 9], [8, 8], [8, 8], [8, 8], [8, 8]]), 2, "9 is one step above 8");
    assert_eq!(chosen([7, 9], [[7, 9], [7, 9], [10, 10], [9, 9], [8, 8], [8, 8]]), 8);
    assert_eq!(chosen([7, 9], [[7, 9], [7, 9], [7, 9], [10, 10], [9, 9], [8, 8]]), 15);
    assert_eq!(chosen([7, 9], [[7, 9], [7, 9], [10, 10], [11, 11], [12, 12], [8, 8]]), 0, "none is both");
    assert_eq!(choose_hysteresis(&[with_others([7, 9], steady)], 99), 0, "nothing was measured with it");
}

/// At each speed the current has to be steady, and the sum of all may be one step higher for each.
#[test]
fn a_hysteresis_is_for_all_speeds() {
    let steady = with_others([8, 8], [[8, 8]; 6]);
    let swings = with_others([7, 9], [[7, 9], [10, 10], [9, 9], [9, 9], [9, 9], [8, 8]]);
    assert_eq!(choose_hysteresis(&[steady.clone(), swings.clone()], 5), 2);
    assert_eq!(choose_hysteresis(&[swings.clone(), steady], 5), 2);
    assert_eq!(choose_hysteresis(&[swings.clone(), swings], 5), 4, "10 + 10 are more than 8 + 8 and one each");
}

/// A step less at each speed is a saving.
#[test]
fn a_quarter_is_chosen_if_it_saves_a_step() {
    let minimum = |quarters: &[i32]| {
        let others = |quarter| [[8, 8], [8, 8], [8, 8], [8, 8], [8, 8], [quarter, quarter]];
        let speeds_tried: Vec<AtSpeed> = quarters.iter().map(|quarter| with_others([8, 8], others(*quarter))).collect();
        choose_minimum(&speeds_tried, 5)
    };
    assert_eq!([minimum(&[9]), minimum(&[8]), minimum(&[7]), minimum(&[4])], [0, 0, 1, 1]);
    assert_eq!([minimum(&[7, 8]), minimum(&[7, 7]), minimum(&[6, 8])], [0, 1, 1]);
}

/// 8 steps down at 40 ms a measurement: 2560 ms with 8 measurements for each, 640 ms with 2. Up in one go of 8: 40 ms;
/// of 4: 80 ms.
#[test]
fn times_follow_from_the_speed() {
    let proposals = propose(&[at_speed(5, 8, 1)], CHOICE, None, 128, 0, "int", number);
    let value = |number| proposals.iter().find(|found| found.parameter == number).map(|found| found.value);
    assert_eq!([168, 169, 170, 171, 172, 173, 182, 183].map(value), [0, 2, 0, 2, 5, 1, 640, 128].map(Some));
    assert_eq!(value(174), None);
    assert!(propose(&[], CHOICE, None, 128, 0, "int", number).is_empty());
}

/// The proposals for 169 and 171 if the current falls by so many of 16 steps, and a full step takes so many
/// microseconds. They are the values, and the milliseconds until the current is down, and whole again.
fn times(steps: i32, full_step: u64) -> [(i32, String); 2] {
    let mut at_speed = at_speed(5, 16 - steps, 1);
    at_speed.cruise.full_step = Duration::from_micros(full_step);
    [169, 171].map(|parameter| {
        let (value, reason) = proposed(&at_speed, CHOICE, parameter);
        (value, reason.rsplit_once("after ").unwrap().1.to_owned())
    })
}

/// A measurement takes four full steps. A step down takes 32, 8, 2 or 1 of them, and all are to be done within 2 s. In
/// one of them the current rises by 1, 2, 4 or 8 steps, and is to be whole within 100 ms.
#[test]
fn the_slowest_steps_are_proposed_that_are_quick_enough() {
    let is = |down: (i32, &str), up: (i32, &str)| [(down.0, down.1.to_owned()), (up.0, up.1.to_owned())];
    // 4 ms: 8 * 32 measurements, and 8.
    assert_eq!(times(8, 1_000), is((0, "1024 ms"), (0, "32 ms")));
    // 20 ms: 8 * 8 of them (8 * 32 take 5120 ms), and 4 (8 take 160 ms).
    assert_eq!(times(8, 5_000), is((1, "1280 ms"), (1, "80 ms")));
    // 80 ms: 8 * 2 of them (8 * 8 take 5120 ms), and one (2 take 160 ms).
    assert_eq!(times(8, 20_000), is((2, "1280 ms"), (3, "80 ms")));
    // 120 ms: 8 of them (16 take 1920 ms), and one, which is too long in any case.
    assert_eq!(times(8, 30_000), is((2, "1920 ms"), (3, "120 ms")));
    assert_eq!(times(8, 40_000), is((3, "1280 ms"), (3, "160 ms")));
    // A motor so slow that none of the steps is quick enough gets the quickest ones.
    assert_eq!(times(8, 1_000_000), is((3, "32000 ms"), (3, "4000 ms")));
    // 31.25 ms: 8 * 8 of them are 2 s, just within. 25 ms: 4 of them are 100 ms.
    assert_eq!(times(8, 7_812)[0], (1, "1999 ms".to_owned()));
    assert_eq!(times(8, 6_250)[1], (1, "100 ms".to_owned()));
    // A little more of them is too long: 4 * 25.01 ms.
    assert_eq!(times(8, 6_253)[1], (2, "50 ms".to_owned()));
}

/// The last step up may be a part of what is possible: 5 steps are 5, 3, 2 or 1 measurements, and 9 are 9, 5, 3 or 2.
#[test]
fn a_part_of_a_step_up_takes_a_whole_measurement() {
    assert_eq!(times(5, 10_000)[1], (2, "80 ms".to_owned()));
    assert_eq!(times(9, 12_500)[1], (3, "100 ms".to_owned()));
    assert_eq!(times(1, 10_000), [(0, "1280 ms".to_owned()), (0, "40 ms".to_owned())]);
    // Where nothing falls there is no time of 0.
    assert_eq!(times(0, 10_000), times(1, 10_000));
}

#[test]
fn exactly_two_seconds_are_soon_enough() {
    let mut at_speed = at_speed(5, 8, 1);
    at_speed.cruise.full_step = Duration::from_nanos(7_812_500);
    assert_eq!(proposed(&at_speed, CHOICE, 169), (1, "without load the current is down after 2000 ms".to_owned()));
}

/// Thresholds are multiples of 32: the lower one is that of 172, and the upper one is by 170 and 1 higher.
#[test]
fn reasons_have_the_thresholds() {
    let at_speed = at_speed(5, 8, 1);
    let reason = |choice, parameter| proposed(&at_speed, choice, parameter).1;
    assert_eq!(
        reason(CHOICE, 172),
        "below a load value of 160 the current rises: it is 8 of 16 without load, and whole with it"
    );
    let whole = reason(Choice { start: 6, ..CHOICE }, 172);
    assert!(whole.starts_with("below a load value of 192 the current rises: it is 16 of 16 without load"), "{whole}");
    let with = |hysteresis| reason(Choice { hysteresis, ..CHOICE }, 170);
    assert_eq!(with(0), "from a load value of 192 on the current falls; more of it is not needed");
    assert_eq!(with(1), "from a load value of 224 on the current falls; less of it lets the current swing");
    assert_eq!(with(4), "from a load value of 320 on the current falls; less of it lets the current swing");
    let minimum = |minimum| proposed(&at_speed, Choice { minimum, ..CHOICE }, 168);
    assert_eq!(minimum(0), (0, "down to a half: a quarter saves no more here".to_owned()));
    assert_eq!(minimum(1), (1, "down to a quarter, which saves more than a half".to_owned()));
    assert_eq!(proposed(&at_speed, CHOICE, 174), (7, "the threshold with which all this was measured".to_owned()));
    assert_eq!(
        proposed(&at_speed, CHOICE, 182),
        (640, "coolStep from 80 % of 800 int on, the slowest speed that was measured".to_owned())
    );
}

/// The times and the speed are those of the slowest speed.
#[test]
fn the_slowest_speed_counts() {
    let mut fast = at_speed(5, 4, 1);
    fast.cruise.speed = 1000;
    fast.cruise.full_step = Duration::from_millis(1);
    for speeds_tried in [[at_speed(5, 8, 1), fast.clone()], [fast, at_speed(5, 8, 1)]] {
        let proposals = propose(&speeds_tried, CHOICE, None, 128, 3, "int", number);
        let value = |number| proposals.iter().find(|found| found.parameter == number).map(|found| found.value);
        assert_eq!([169, 171, 182].map(value), [2, 2, 640].map(Some));
        assert!(proposals.iter().all(|proposal| proposal.axis == 3));
    }
}
