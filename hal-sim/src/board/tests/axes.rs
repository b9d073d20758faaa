//! Boards with several axes and controllers: nothing of one axis shows in another.

use super::*;
use crate::chip::at25::AT25512;
use crate::control::{AxisState, Line, State};

/// Three axes on one TMC429, with ABN encoders on pins of their own and the home switches at the inputs.
static THREE: BoardKind = BoardKind {
    name: "board of three",
    controllers: &[3],
    inputs: &[Input::Switch(0, Pin::Home), Input::Switch(1, Pin::Home), Input::Switch(2, Pin::Home)],
    abn: AbnPins::Own,
    eeprom: AT25512,
    ..TMCM_6110
};

/// A board whose axes stand in velocity mode, with their bridges on.
fn board(kind: &'static BoardKind, world: &str) -> SharedBoard {
    let board = SharedBoard::new(Board::of_kind(kind, &WorldConfig::parse_for(kind, world).unwrap(), 0));
    board.enable_pin().set_low().unwrap();
    for axis in 0..kind.axes() {
        for word in [0xE_F050, 0xC_0D1F, 0x9_0135, 0xA_0000, 0x0_0000] {
            driver(&board, axis, word);
        }
    }
    for controller in 0..kind.controllers.len() {
        transfer(&board, Chip::Tmc429(controller), INTERFACE, 0x122);
        transfer(&board, Chip::Tmc429(controller), GLOBAL, 0x2);
    }
    for axis in 0..kind.axes() {
        for (register, data) in [(DIVIDERS, 0x3706), (V_MIN, 1), (V_MAX, 2047), (A_MAX, 2047), (MODE, 2)] {
            ramp(&board, axis, register, data);
        }
    }
    board
}

fn transfer(board: &SharedBoard, chip: Chip, register: u8, data: u32) -> u32 {
    let [_, high, middle, low] = data.to_be_bytes();
    let mut frame = [register, high, middle, low];
    board.spi(chip, MOTION_HZ).transfer_in_place(&mut frame).unwrap();
    u32::from_be_bytes([0, frame[1], frame[2], frame[3]])
}

/// Writes or reads a register of the ramp generator of an axis, as the boards here number them.
fn ramp(board: &SharedBoard, axis: usize, register: u8, data: u32) -> u32 {
    transfer(board, Chip::Tmc429(axis / 3), register | (axis as u8 % 3) << 5, data)
}

/// Writes to the driver of an axis, and gives the 20 bits that it answers.
fn driver(board: &SharedBoard, axis: usize, word: u32) -> u32 {
    let [_, high, middle, low] = word.to_be_bytes();
    let mut frame = [high, middle, low];
    board.spi(Chip::Tmc262(axis), MOTION_HZ).transfer_in_place(&mut frame).unwrap();
    u32::from_be_bytes([0, frame[0], frame[1], frame[2]]) >> 4
}

fn turn(board: &SharedBoard, axis: usize, speed: i32) {
    ramp(board, axis, V_TARGET, speed.cast_unsigned() & 0xFFF);
}

fn control(board: &SharedBoard, line: &str) {
    Line::parse(line).unwrap().control.apply(&mut board.borrow_mut()).unwrap();
}

fn axes(board: &SharedBoard) -> Vec<AxisState> {
    State::of(&board.borrow()).axes
}

/// The states of all axes but those in `apart`.
fn others(states: &[AxisState], apart: &[usize]) -> Vec<AxisState> {
    let others = states.iter().enumerate().filter(|(axis, _)| !apart.contains(axis));
    others.map(|(_, state)| state.clone()).collect()
}

#[test]
fn each_axis_turns_at_its_own_speed_and_stands_when_it_is_told_to() {
    let board = board(&TMCM_6110, "");
    let speeds = [1_000, -800, 600, -400, 200, 1_200];
    for (axis, speed) in speeds.into_iter().enumerate() {
        let before = axes(&board);
        turn(&board, axis, speed);
        run(&board, SECOND);
        let after = axes(&board);
        assert_eq!(after[axis + 1..], before[axis + 1..], "axis {axis} was set going alone");
        assert_eq!(after[axis].velocity, speed);
    }
    let from = axes(&board);
    run(&board, 2 * SECOND);
    for (axis, ((before, after), speed)) in from.iter().zip(axes(&board)).zip(speeds).enumerate() {
        // One unit of velocity is 30.5176 microsteps/s.
        let way = (after.rotor - before.rotor) as f64;
        assert!((way - 2.0 * 30.517_6 * f64::from(speed)).abs() < 2.0, "axis {axis}: {way}");
        assert_eq!((after.rotor, after.lost_steps), (after.position.into(), 0), "axis {axis}");
    }
    turn(&board, 4, 0);
    run(&board, SECOND);
    let stood = axes(&board);
    run(&board, SECOND);
    let states = axes(&board);
    assert_eq!(states[4], stood[4]);
    assert!(others(&states, &[4]).iter().zip(others(&stood, &[4])).all(|(now, then)| now.rotor != then.rotor));
}

#[test]
fn each_axis_stops_at_its_own_switches() {
    let world = "
        [stage]
        right = 20000
        [[axis]]
        [[axis]]
        stage.right = 25000
        [[axis]]
        [[axis]]
        stage.left = -10000
        stage.home = [-50, 50]
        [[axis]]
        stage.normally_closed = ['home']
        [[axis]]
        stage.right = 30000
    ";
    let board = board(&TMCM_6110, world);
    for axis in 0..6 {
        turn(&board, axis, if axis == 3 { -500 } else { 500 });
    }
    let homes = || [0, 1, 2, 3, 4, 5].map(|axis| board.borrow().axis_inputs(axis).home);
    assert_eq!(homes(), [false, false, false, true, true, false]);
    assert_eq!(board.borrow().inputs().digital, 0, "no switch is at one of these");
    run(&board, 3 * SECOND);
    let rotors: Vec<i64> = axes(&board).iter().map(|axis| axis.rotor).collect();
    let stops: [i64; 6] = [20_000, 25_000, 20_000, -10_000, 20_000, 30_000];
    for (rotor, stop) in rotors.iter().zip(stops) {
        // The tick after the one that closed the switch may still step.
        assert!((0..=1).contains(&(rotor.abs() - stop.abs())), "{rotors:?}");
    }
    // REFERENCE_SWITCHES: bit 2n is the right switch of motor n, 2n + 1 the left one.
    assert_eq!(transfer(&board, Chip::Tmc429(0), SWITCHES | 1, 0), 0b01_01_01);
    assert_eq!(transfer(&board, Chip::Tmc429(1), SWITCHES | 1, 0), 0b01_01_10);
    assert_eq!(homes(), [false, false, false, false, true, false]);
}

#[test]
fn a_switch_pressed_by_hand_stops_one_axis() {
    for axis in 0..6 {
        let board = board(&TMCM_6110, "");
        for axis in 0..6 {
            turn(&board, axis, 1_000);
        }
        run(&board, SECOND);
        control(&board, &format!("press right {axis}"));
        run(&board, MILLISECOND);
        let mut expected = [1_000; 6];
        expected[axis] = 0;
        let states = axes(&board);
        assert_eq!(states.iter().map(|state| state.velocity).collect::<Vec<_>>(), expected);
        assert!(states.iter().enumerate().all(|(other, state)| state.switches.right == (other == axis)));
    }
}

#[test]
fn a_load_a_blow_and_the_faults_of_a_driver_concern_one_axis() {
    for (line, axis) in [
        ("load 1.0 2", 2),
        ("slip 8 4", 4),
        ("fault short-a on 1", 1),
        ("fault short-b on 3", 3),
        ("fault open-a on 5", 5),
        ("fault open-b on", 0),
        ("fault overtemperature on 4", 4),
    ] {
        let (touched, untouched) = (board(&TMCM_6110, ""), board(&TMCM_6110, ""));
        for board in [&touched, &untouched] {
            (0..6).for_each(|axis| turn(board, axis, 1_500));
            run(board, SECOND);
        }
        control(&touched, line);
        [&touched, &untouched].into_iter().for_each(|board| run(board, SECOND / 2));
        let (now, otherwise) = (axes(&touched), axes(&untouched));
        assert_eq!(others(&now, &[axis]), others(&otherwise, &[axis]), "{line}");
        assert_ne!(now[axis].rotor, otherwise[axis].rotor, "{line}");
        let answers = |board: &SharedBoard| [0, 1, 2, 3, 4, 5].map(|axis| driver(board, axis, 0xE_F050) & 0x7E);
        let flags = answers(&touched);
        assert!(flags.iter().enumerate().all(|(other, flags)| *flags == 0 || other == axis), "{line}: {flags:?}");
        assert_eq!(flags[axis] != 0, line.starts_with("fault"), "{line}: {flags:?}");
    }
}

#[test]
fn one_controller_of_two_is_silent_and_its_motors_run_on() {
    let board = board(&TMCM_6110, "");
    (0..6).for_each(|axis| turn(&board, axis, 1_000));
    run(&board, SECOND);
    control(&board, "fault tmc429 on 4");
    // The deaf second controller does not take the stop of its axes.
    (0..6).for_each(|axis| turn(&board, axis, 0));
    run(&board, SECOND);
    let answers = || [0, 1].map(|number| transfer(&board, Chip::Tmc429(number), SWITCHES | 1, 0));
    assert_eq!(answers(), [0, 0xFF_FFFF]);
    let speeds = || axes(&board).iter().map(|axis| axis.velocity).collect::<Vec<_>>();
    assert_eq!(speeds(), [0, 0, 0, 1_000, 1_000, 1_000]);
    // The fault of a motion controller can be given by any of its axes.
    control(&board, "fault tmc429 off 3");
    control(&board, "fault tmc429 on 0");
    assert_eq!(answers(), [0xFF_FFFF, 0]);
    control(&board, "fault tmc429 off");
    (3..6).for_each(|axis| turn(&board, axis, 0));
    run(&board, SECOND);
    assert_eq!(speeds(), [0; 6]);
}

#[test]
fn a_silent_driver_leaves_the_others_on_the_bus() {
    let board = board(&TMCM_6110, "");
    control(&board, "fault tmc262 on 5");
    for axis in 0..6 {
        assert_eq!(driver(&board, axis, 0xE_F050) == 0xF_FFFF, axis == 5, "axis {axis}");
        driver(&board, axis, 0x9_0131);
    }
    for axis in 0..6 {
        let chopconf = board.borrow().tmc262(axis).registers().chopconf;
        assert_eq!(chopconf, if axis == 5 { 0x9_0135 } else { 0x9_0131 }, "axis {axis}");
    }
}

#[test]
fn datagrams_are_counted_and_recorded_chip_by_chip() {
    let board = board(&TMCM_6110, "");
    board.borrow_mut().take_datagrams();
    let chips = [Chip::Tmc429(0), Chip::Tmc429(1), Chip::Tmc262(0), Chip::Tmc262(5)];
    let counted = || chips.map(|chip| board.borrow().datagrams(chip));
    let before = counted();
    turn(&board, 4, 7);
    driver(&board, 5, 0xE_F050);
    // A datagram to a chip that the board does not have is not answered and not counted.
    assert_eq!(transfer(&board, Chip::Tmc429(2), SWITCHES | 1, 0), 0xFF_FFFF);
    assert_eq!(driver(&board, 6, 0xE_F050), 0xF_FFFF);
    assert_eq!(counted(), [before[0], before[1] + 1, before[2], before[3] + 1]);
    assert_eq!(board.borrow().datagrams(Chip::Tmc262(6)), 0);
    let seen = |chip, bytes: &[u8]| Datagram { chip, bytes: bytes.to_vec() };
    let expected = [seen(Chip::Tmc429(1), &[V_TARGET | 1 << 5, 0, 0, 7]), seen(Chip::Tmc262(5), &[0x0E, 0xF0, 0x50])];
    assert_eq!(board.borrow_mut().take_datagrams(), expected);
}

#[test]
fn all_axes_run_on_over_a_warm_reset_and_all_forget_without_power() {
    let board = board(&TMCM_6110, "");
    (0..6).for_each(|axis| turn(&board, axis, 1_000));
    run(&board, SECOND);
    board.borrow_mut().warm_reset();
    let before = axes(&board);
    run(&board, SECOND);
    let after = axes(&board);
    assert!(before.iter().zip(&after).all(|(before, after)| after.rotor - before.rotor > 30_000));
    board.borrow_mut().power_off();
    run(&board, SECOND);
    assert!(axes(&board).iter().zip(&after).all(|(now, then)| now.rotor == then.rotor && !now.bridges_on));
    board.borrow_mut().power_on();
    assert!(axes(&board).iter().all(|axis| (axis.position, axis.velocity, axis.lost_steps) == (0, 0, 0)));
    run(&board, SECOND);
    assert_eq!(board.borrow().next_event(), None);
}

#[test]
fn the_enable_pin_and_the_supply_are_common_to_all_axes() {
    let board = board(&TMCM_6110, "");
    let bridges = || axes(&board).iter().map(|axis| axis.bridges_on).collect::<Vec<_>>();
    assert_eq!(bridges(), [true; 6]);
    board.enable_pin().set_high().unwrap();
    assert_eq!(bridges(), [false; 6]);
    board.enable_pin().set_low().unwrap();
    control(&board, "supply 4.9");
    assert_eq!(bridges(), [false; 6]);
    control(&board, "supply 24");
    assert!((0..6).all(|axis| board.borrow().tmc262(axis).registers() == Default::default()));
}

#[test]
fn each_axis_has_its_encoder_and_its_home_switch_at_the_inputs() {
    let world = "
        [abn]
        lines = 500
        [stage]
        right = 20000
        [[axis]]
        [[axis]]
        abn.lines = 1000
        [[axis]]
        motor.steps_per_turn = 400
    ";
    let board = board(&THREE, world);
    let counts = || [0, 1, 2].map(|axis| board.borrow().axis_inputs(axis).abn.count);
    assert_eq!(counts(), [0; 3]);
    for (axis, expected) in [(0, [2_000, 0, 0]), (1, [2_000, 4_000, 0]), (2, [2_000, 4_000, 1_000])] {
        control(&board, &format!("slip 200 {axis}"));
        assert_eq!(counts(), expected);
    }
    assert!(axes(&board).iter().all(|axis| axis.switches.right), "the switches have pins of their own");
    for axis in 0..3 {
        control(&board, &format!("press home {axis}"));
        assert_eq!(board.borrow().inputs().digital, 1 << axis);
        control(&board, &format!("input {axis} 0"));
        assert!(!board.borrow().axis_inputs(axis).home);
    }
    let error = Line::parse("fault encoder on").unwrap().control.apply(&mut board.borrow_mut()).unwrap_err();
    assert_eq!(error, "fault 'encoder': the board of three has no built-in encoder");
}

#[test]
fn inputs_and_outputs_are_as_many_as_the_kind_says() {
    let board = board(&TMCM_6110, "");
    for line in ["input 7 1", "input 0 1", "analog 4 2048", "analog 0 100", "input 3 1"] {
        control(&board, line);
    }
    let inputs = board.borrow().inputs();
    assert_eq!((inputs.digital, &inputs.analog[..3]), (0b1001_1000, [100, 2_048, 0].as_slice()));
    board.borrow_mut().set_outputs(Outputs { digital: 0b1000_0001, pull_ups: 0b10, leds: [false; 2] });
    let state = State::of(&board.borrow());
    assert_eq!(state.outputs, [true, false, false, false, false, false, false, true]);
    assert_eq!((state.pull_ups, state.pull_up_groups), (false, vec![false, true]));
    assert_eq!((state.analog, state.analogs, state.inputs.len()), (100, vec![100, 2_048], 8));
}

#[test]
fn the_eeprom_is_that_of_the_kind() {
    for (kind, size) in [(&TMCM_6110, 32_768), (&THREE, 65_536)] {
        assert_eq!(board(kind, "").borrow().at25().contents().len(), size);
    }
}

#[test]
fn the_next_event_of_the_board_is_that_of_any_axis() {
    for axis in 0..6 {
        let board = board(&TMCM_6110, "");
        run(&board, SECOND);
        assert_eq!(board.borrow().next_event(), None);
        turn(&board, axis, 1_000);
        assert!(board.borrow().next_event().is_some(), "axis {axis} turns");
        control(&board, &format!("load 1.0 {axis}"));
        run(&board, SECOND);
        // The chip stops at once and the rotor loses the field; less than five milliseconds later it falls in.
        control(&board, &format!("press right {axis}"));
        turn(&board, axis, 0);
        control(&board, &format!("load 0.0 {axis}"));
        assert_eq!(board.borrow().tmc429(axis / 3).next_event(), None);
        assert!(board.borrow().next_event().is_some(), "the rotor of axis {axis} falls in");
        run(&board, SECOND);
        assert_eq!(board.borrow().next_event(), None);
    }
}

#[test]
fn the_size_of_the_time_steps_does_not_matter_with_six_axes() {
    let final_state = |piece: Nanos| {
        let board = board(&TMCM_6110, "[stage]\nright = 20000\n[motor]\nfriction = 0.1\nstall_guard_noise = 9");
        (0..6).for_each(|axis| turn(&board, axis, 300 * (axis as i32 / 2) + 400));
        let end = board.borrow().now() + 2 * SECOND;
        while board.borrow().now() < end {
            let to = end.min(board.borrow().now() + piece);
            board.borrow_mut().advance_to(to);
        }
        State::of(&board.borrow())
    };
    let whole = final_state(2 * SECOND);
    assert_eq!(final_state(1_237 * MICROSECOND), whole);
    let noise = |axis: usize| whole.axes[axis].stall_guard;
    assert!([0, 2, 4].iter().any(|&axis| noise(axis) != noise(axis + 1)), "each driver has a noise of its own");
}

/// Speeds of some are read while others ramp or turn at constant speeds: the answers are those of a board that is
/// looked at all the time.
#[test]
fn steps_of_six_axes_may_wait_until_somebody_looks() {
    for seed in 0..10 {
        let [watched, unwatched] = [true, false].map(|is_watched| {
            let board = board(&TMCM_6110, "[stage]\nright = 20000\nleft = -20000\n[motor]\nfriction = 0.1");
            let mut random = Random::new(seed);
            let mut answers = Vec::new();
            for _ in 0..60 {
                turn(&board, random.below(6) as usize, random.below(4095) as i32 - 2047);
                ramp(&board, random.below(6) as usize, A_MAX, random.below(100));
                for _ in 0..30 {
                    let register = 2 * random.below(16) as u8 + 1;
                    answers.push(ramp(&board, random.below(6) as usize, register, 0));
                    board.advance_to(board.now() + some_time(&mut random) / 30);
                    if is_watched {
                        drop(board.borrow());
                    }
                }
            }
            (answers, format!("{:?}", board.borrow()))
        });
        assert!(watched == unwatched, "seed {seed}:\n{watched:?}\n{unwatched:?}");
    }
}
