//! The TMCM-3212: a TMC5160 for each axis.

use super::*;
use crate::control::{AxisState, Line, State};
use crate::world::pin::Pin;

/// Addresses of registers (datasheet chapter 6).
mod register {
    pub(super) const GSTAT: u8 = 0x01;
    pub(super) const IOIN: u8 = 0x04;
    pub(super) const IHOLD_IRUN: u8 = 0x10;
    pub(super) const RAMPMODE: u8 = 0x20;
    pub(super) const XACTUAL: u8 = 0x21;
    pub(super) const AMAX: u8 = 0x26;
    pub(super) const VMAX: u8 = 0x27;
    pub(super) const DMAX: u8 = 0x28;
    pub(super) const D1: u8 = 0x2A;
    pub(super) const XTARGET: u8 = 0x2D;
    pub(super) const SW_MODE: u8 = 0x34;
    pub(super) const RAMP_STAT: u8 = 0x35;
    pub(super) const X_ENC: u8 = 0x39;
    pub(super) const ENC_CONST: u8 = 0x3A;
    pub(super) const ENC_STATUS: u8 = 0x3B;
    pub(super) const ENC_DEVIATION: u8 = 0x3D;
    pub(super) const CHOPCONF: u8 = 0x6C;
    pub(super) const COOLCONF: u8 = 0x6D;
    pub(super) const DRV_STATUS: u8 = 0x6F;
    /// Added to the address for a write access.
    pub(super) const WRITE: u8 = 0x80;
}
use register::*;

/// The SPI clock of the module in Hz: 84 MHz / 16.
const HZ: u32 = 5_250_000;

/// A board whose drivers are on at full current, in velocity mode with VMAX 0, with both switches as stop switches.
fn board(world: &str) -> SharedBoard {
    let config = WorldConfig::parse_for(&TMCM_3212, world).unwrap();
    let board = SharedBoard::new(Board::of_kind(&TMCM_3212, &config, 0));
    board.enable_pin().set_low().unwrap();
    (0..3).for_each(|axis| set_up(&board, axis));
    board
}

fn set_up(board: &SharedBoard, axis: usize) {
    for (register, data) in [
        (GSTAT, 7),
        (RAMP_STAT, 0x80),
        (CHOPCONF, 0x1000_00C3),
        (IHOLD_IRUN, 0x1F1F),
        (COOLCONF, 13 << 16),
        (AMAX, 10_000),
        (DMAX, 10_000),
        (D1, 10_000),
        (SW_MODE, 3),
        (RAMPMODE, 1),
    ] {
        write(board, axis, register, data);
    }
}

/// Sends a datagram to the chip of an axis; gives status and data.
fn datagram(board: &SharedBoard, axis: usize, first: u8, data: u32) -> (u8, u32) {
    let [a, b, c, d] = data.to_be_bytes();
    let mut frame = [first, a, b, c, d];
    board.spi(Chip::Tmc5160(axis), HZ).transfer_in_place(&mut frame).unwrap();
    let [status, a, b, c, d] = frame;
    (status, u32::from_be_bytes([a, b, c, d]))
}

fn write(board: &SharedBoard, axis: usize, register: u8, data: u32) {
    datagram(board, axis, register | WRITE, data);
}

fn read(board: &SharedBoard, axis: usize, register: u8) -> u32 {
    datagram(board, axis, register, 0);
    datagram(board, axis, register, 0).1
}

/// Turns an axis with a velocity in microsteps per 2^24 clocks.
fn turn(board: &SharedBoard, axis: usize, velocity: i32) {
    write(board, axis, VMAX, velocity.unsigned_abs());
    write(board, axis, RAMPMODE, if velocity < 0 { 2 } else { 1 });
}

fn control(board: &SharedBoard, line: &str) {
    Line::parse(line).unwrap().control.apply(&mut board.borrow_mut()).unwrap();
}

fn refusal(board: &SharedBoard, line: &str) -> String {
    Line::parse(line).unwrap().control.apply(&mut board.borrow_mut()).unwrap_err()
}

fn axes(board: &SharedBoard) -> Vec<AxisState> {
    State::of(&board.borrow()).axes
}

#[test]
fn each_axis_turns_at_its_own_speed_and_arrives_at_its_own_target() {
    let board = board("");
    let speeds = [50_000, -30_000, 7_000];
    for (axis, speed) in speeds.into_iter().enumerate() {
        turn(&board, axis, speed);
    }
    run(&board, SECOND);
    let before = axes(&board);
    run(&board, 2 * SECOND);
    for (axis, ((before, after), speed)) in before.iter().zip(axes(&board)).zip(speeds).enumerate() {
        // 16 MHz / 2^24 = 0.953674 microsteps/s.
        let way = (after.rotor - before.rotor) as f64;
        assert!((way - 2.0 * 0.953_674 * f64::from(speed)).abs() < 2.0, "axis {axis}: {way}");
        assert_eq!((after.rotor, after.lost_steps, after.velocity), (after.position.into(), 0, speed));
    }
    for axis in 0..3 {
        write(&board, axis, XTARGET, 10_000 * axis as u32);
        write(&board, axis, RAMPMODE, 0);
    }
    write(&board, 1, VMAX, 100_000);
    run(&board, 10 * SECOND);
    let rotors: Vec<i64> = axes(&board).iter().map(|axis| axis.rotor).collect();
    assert_eq!((rotors, read(&board, 2, XACTUAL)), (vec![0, 10_000, 20_000], 20_000));
    // Standstill, position reached.
    read(&board, 1, IOIN);
    assert_eq!(datagram(&board, 1, IOIN, 0).0 & 0x28, 0x28);
    run(&board, SECOND);
    assert_eq!(board.borrow().next_event(), None);
}

/// With half of the resolution a step is twice as wide, and the field stands in the middle of the parts of the table.
#[test]
fn the_rotor_follows_the_field_at_any_resolution() {
    for resolution in 0..=8_u32 {
        let board = board("");
        write(&board, 0, CHOPCONF, 0xC3 | resolution << 24);
        write(&board, 0, XTARGET, 40);
        write(&board, 0, VMAX, 1_000);
        write(&board, 0, RAMPMODE, 0);
        run(&board, 2 * SECOND);
        let offset = 1_i64 << resolution >> 1;
        assert_eq!((axes(&board)[0].position, axes(&board)[0].rotor), (40, (40 << resolution) + offset));
    }
}

#[test]
fn stop_switches_are_at_the_chips_inputs_and_home_switches_have_pins_of_their_own() {
    let world = "
        [stage]
        right = 20000
        [[axis]]
        [[axis]]
        stage.left = -10000
        stage.home = [-50, 50]
    ";
    let board = board(world);
    for (axis, speed) in [30_000, -30_000, 30_000].into_iter().enumerate() {
        turn(&board, axis, speed);
    }
    let homes = || [0, 1, 2].map(|axis| board.borrow().axis_inputs(axis).home);
    assert_eq!(homes(), [false, true, false]);
    control(&board, "press home 2");
    run(&board, 3 * SECOND);
    assert_eq!(homes(), [false, false, true]);
    let rotors: Vec<i64> = axes(&board).iter().map(|axis| axis.rotor).collect();
    assert_eq!(rotors, [20_000, -10_000, 20_000]);
    assert_eq!([0, 1, 2].map(|axis| read(&board, axis, IOIN) & 3), [2, 1, 2]);
    assert_eq!(board.borrow().inputs().digital, 0, "no switch is at one of these");
    control(&board, "release right 1");
    turn(&board, 1, 30_000);
    run(&board, SECOND);
    control(&board, "press right 1");
    run(&board, MILLISECOND);
    assert_eq!((axes(&board)[1].velocity, read(&board, 1, RAMP_STAT) & 0x22), (0, 0x22));
    assert!(board.borrow().world().axis(1).level(Pin::Right));
}

/// 1000 lines are 4000 counts, so 12.8 microsteps a count; the counters of the chips follow the rotors, not the fields.
#[test]
fn encoders_are_counted_in_the_chips() {
    let board = board("[abn]\nlines = 1000\n[[axis]]\n[[axis]]\nmotor.start = 51200");
    for axis in 0..3 {
        write(&board, axis, ENC_CONST, 12 << 16 | 52_429);
        write(&board, axis, ENC_DEVIATION, 100);
        turn(&board, axis, 50_000);
    }
    run(&board, 2 * SECOND);
    for axis in 0..3 {
        let apart = read(&board, axis, X_ENC).abs_diff(read(&board, axis, XACTUAL));
        // A count is 12.8 microsteps, and the motor goes on for a microstep or two between the two accesses.
        assert!(apart <= 15, "axis {axis}: {apart}");
        assert_eq!(read(&board, axis, ENC_STATUS), 0);
    }
    control(&board, "slip -4 1");
    assert_eq!([0, 1, 2].map(|axis| read(&board, axis, ENC_STATUS)), [0, 2, 0]);
    // Without its supply a chip forgets; what the rotor did meanwhile is not counted.
    board.borrow_mut().power_off();
    control(&board, "slip 8 2");
    board.borrow_mut().power_on();
    assert_eq!([0, 1, 2].map(|axis| read(&board, axis, X_ENC)), [0; 3]);
}

#[test]
fn a_load_a_blow_and_the_faults_of_a_chip_concern_one_axis() {
    // The flags of DRV_STATUS that the fault sets.
    for (line, axis, flags) in [
        ("load 1.0 2", 2, 0),
        ("slip 8 1", 1, 0),
        ("fault short-a on 1", 1, 1 << 27),
        ("fault short-b on", 0, 1 << 28),
        ("fault open-a on 2", 2, 1 << 29),
        ("fault open-b on 1", 1, 1 << 30),
        ("fault overtemperature on", 0, 3 << 25),
    ] {
        let (touched, untouched) = (board(""), board(""));
        for board in [&touched, &untouched] {
            (0..3).for_each(|axis| turn(board, axis, 50_000));
            run(board, SECOND);
        }
        control(&touched, line);
        [&touched, &untouched].into_iter().for_each(|board| run(board, SECOND / 2));
        for (other, (now, otherwise)) in axes(&touched).iter().zip(axes(&untouched)).enumerate() {
            assert_eq!(*now == otherwise, other != axis, "{line}: axis {other}");
            let expected = if other == axis { flags } else { 0 };
            assert_eq!(read(&touched, other, DRV_STATUS) & 0x7E00_3000, expected, "{line}: axis {other}");
            let shuts = flags & 0x1E00_0000 != 0 && other == axis;
            assert_eq!(read(&touched, other, GSTAT) & 2 != 0, shuts, "{line}: axis {other}");
        }
    }
}

#[test]
fn a_chip_that_loses_its_supply_comes_back_reset_with_the_rotor_where_it_is() {
    let board = board("");
    (0..3).for_each(|axis| turn(&board, axis, 50_000));
    run(&board, SECOND);
    control(&board, "fault chip-supply on 1");
    assert_eq!(datagram(&board, 1, IOIN, 0), (0, 0), "it is in reset");
    let before = axes(&board);
    run(&board, SECOND);
    control(&board, "fault chip-supply off 1");
    let after = axes(&board);
    assert_eq!((after[1].rotor, after[1].position, after[1].bridges_on), (before[1].rotor, 0, false));
    assert!([0, 2].iter().all(|&axis| after[axis].rotor - before[axis].rotor > 40_000));
    assert_eq!([0, 1, 2].map(|axis| read(&board, axis, GSTAT)), [0, 1, 0]);
    assert_eq!(datagram(&board, 1, IOIN, 0).0 & 1, 1);
    set_up(&board, 1);
    turn(&board, 1, 50_000);
    run(&board, SECOND);
    assert!(axes(&board)[1].rotor - after[1].rotor > 40_000);
}

/// 28.2: the chip is reset below 4.0 V; below 8 V (28.1) its bridges are off and uv_cp tells of it.
#[test]
fn the_supply_of_the_board_is_that_of_all_chips() {
    let board = board("");
    let all = |register| [0, 1, 2].map(|axis| read(&board, axis, register));
    assert!(axes(&board).iter().all(|axis| axis.bridges_on));
    control(&board, "supply 7.9");
    assert!(axes(&board).iter().all(|axis| !axis.bridges_on));
    control(&board, "supply 24");
    assert!(axes(&board).iter().all(|axis| axis.bridges_on));
    assert_eq!(all(GSTAT), [4; 3]);
    control(&board, "supply 3.9");
    assert_eq!(all(GSTAT), [0; 3]);
    control(&board, "supply 24");
    assert_eq!(all(GSTAT), [1; 3]);
    assert!(axes(&board).iter().all(|axis| !axis.bridges_on));
}

#[test]
fn power_and_enable_pin_are_common_and_a_warm_reset_stops_nothing() {
    let board = board("");
    (0..3).for_each(|axis| turn(&board, axis, 50_000));
    run(&board, SECOND);
    board.borrow_mut().warm_reset();
    let before = axes(&board);
    run(&board, SECOND);
    let after = axes(&board);
    assert!(before.iter().zip(&after).all(|(before, after)| after.rotor - before.rotor > 40_000));
    board.enable_pin().set_high().unwrap();
    assert!(axes(&board).iter().all(|axis| !axis.bridges_on));
    assert_eq!(read(&board, 0, IOIN) >> 4 & 1, 1);
    board.borrow_mut().power_off();
    assert_eq!(datagram(&board, 0, IOIN, 0), (0xFF, u32::MAX), "nobody answers");
    run(&board, SECOND);
    board.borrow_mut().power_on();
    assert!(axes(&board).iter().all(|axis| (axis.position, axis.velocity, axis.lost_steps) == (0, 0, 0)));
    assert_eq!([0, 1, 2].map(|axis| read(&board, axis, GSTAT)), [1; 3]);
    run(&board, SECOND);
    assert_eq!(board.borrow().next_event(), None);
}

#[test]
fn a_silent_chip_leaves_the_others_on_the_bus_and_a_stuck_bus_all() {
    let board = board("");
    control(&board, "fault tmc5160 on 1");
    for axis in 0..3 {
        let silent = axis == 1;
        assert_eq!(read(&board, axis, IOIN) == u32::MAX, silent, "axis {axis}");
        write(&board, axis, VMAX, 1_000);
        assert_eq!(board.borrow().tmc5160(axis).register(VMAX) == 0, silent, "axis {axis}");
    }
    control(&board, "fault tmc5160 off 1");
    assert_eq!(read(&board, 1, IOIN) >> 24, 0x30);
    control(&board, "fault spi-low on");
    assert_eq!(datagram(&board, 2, IOIN, 0), (0, 0));
    control(&board, "fault spi-low off");
    control(&board, "fault spi on");
    assert_eq!(datagram(&board, 2, IOIN, 0), (0xFF, u32::MAX));
    assert!((0..3).all(|axis| board.borrow().tmc5160(axis).refused().is_none()));
}

/// Two datagrams follow each other no sooner than the chip takes them, and faster clocks than its own are refused.
#[test]
fn the_bus_gives_the_chip_the_time_that_it_needs() {
    let board = board("");
    let before = board.borrow().now();
    datagram(&board, 0, IOIN, 0);
    datagram(&board, 0, IOIN, 0);
    // 40 bits at 5.25 MHz are 7619 ns, twice, with the select before and after. The board had its last datagram to axis
    // 2, and chip select is high for 135 ns in between.
    assert_eq!(board.borrow().now() - before, 2 * (7_619 + 2 * SELECT_TIME) + 135);
    let frame = [AMAX | WRITE, 0, 0, 0, 1];
    board.spi(Chip::Tmc5160(0), 10_000_000).write(&frame).unwrap();
    assert_eq!(board.borrow().tmc5160(0).register(AMAX), 10_000);
    assert!(board.borrow().tmc5160(0).refused().is_some());
    // Without the external clock 5.25 MHz is too fast, and 4 MHz is not.
    board.borrow_mut().set_motion_clock(false);
    write(&board, 1, AMAX, 1);
    assert_eq!(board.borrow().tmc5160(1).register(AMAX), 10_000);
    board.spi(Chip::Tmc5160(1), 4_000_000).write(&frame).unwrap();
    assert_eq!(board.borrow().tmc5160(1).register(AMAX), 1);
}

#[test]
fn inputs_are_analog_and_digital_and_number_10_is_enable() {
    let board = board("");
    for line in ["analog 3 4000", "analog 1 100", "input 0 1", "input 10 1"] {
        control(&board, line);
    }
    let inputs = board.borrow().inputs();
    assert_eq!((inputs.digital, &inputs.analog[..5]), (0b100_0000_1001, [4_095, 100, 0, 4_000, 0].as_slice()));
    let state = State::of(&board.borrow());
    assert_eq!((state.inputs.len(), state.enable, state.outputs.len()), (4, Some(true), 4));
    assert!(state.pull_up_groups.is_empty());
    control(&board, "input 10 0");
    assert_eq!(State::of(&board.borrow()).enable, Some(false));
    assert_eq!(refusal(&board, "input 4 1"), "no input 4: the TMCM-3212 has inputs 0 to 3, and 10, its ENABLE input");
    assert_eq!(refusal(&board, "analog 10 1"), "no analog input 10; of the TMCM-3212 are analog: 0, 1, 2, 3");
    assert_eq!(refusal(&board, "fault tmc429 on"), "fault 'tmc429': the TMCM-3212 has no such chip");
    assert_eq!(refusal(&board, "press left 3"), "no axis 3: the TMCM-3212 has axes 0 to 2");
    assert_eq!(refusal(&start(""), "fault chip-supply on"), "fault 'chip-supply': the TMCM-1140 has no such chip");
}

/// The demonstration of PyTrinamic turns the motor with 39 full steps a second, and raises SGT until the load value is
/// above 0.
#[test]
fn a_slow_motor_has_a_load_value() {
    let board = board("[motor]\nstall_guard_zero = 13\n");
    // 10 000 pps are 10 486 units: 39.06 full steps a second.
    turn(&board, 0, 10_486);
    write(&board, 0, COOLCONF, 0);
    run(&board, SECOND);
    assert_eq!(read(&board, 0, DRV_STATUS) & 0x3FF, 0);
    write(&board, 0, COOLCONF, 10 << 16);
    run(&board, SECOND);
    assert_ne!(read(&board, 0, DRV_STATUS) & 0x3FF, 0);
}

#[test]
fn the_size_of_the_time_steps_does_not_matter() {
    let final_state = |piece: Nanos| {
        let board = board("[stage]\nright = 20000\n[motor]\nfriction = 0.1\nstall_guard_noise = 9\n[abn]\nlines = 512");
        (0..3).for_each(|axis| turn(&board, axis, 9_000 * axis as i32 + 400));
        let end = board.borrow().now() + 2 * SECOND;
        while board.borrow().now() < end {
            let to = end.min(board.borrow().now() + piece);
            board.borrow_mut().advance_to(to);
        }
        let state = State::of(&board.borrow());
        (state, [0, 1, 2].map(|axis| read(&board, axis, X_ENC)))
    };
    let whole = final_state(2 * SECOND);
    assert_eq!(final_state(1_237 * MICROSECOND), whole);
    assert_eq!(final_state(31 * MICROSECOND), whole);
}
