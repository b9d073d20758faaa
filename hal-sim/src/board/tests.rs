mod axes;
mod tmcm3212;

use super::*;
use crate::clock::{MICROSECOND, MILLISECOND, SECOND};
use crate::fault::Fault;
use crate::random::Random;
use embedded_hal::digital::OutputPin;
use embedded_hal::spi::{Operation, SpiDevice};

const MOTION_HZ: u32 = 1_000_000;

/// The first bytes of writes to TMC429 registers of motor 0 (datasheet section 6.2.2).
const X_ACTUAL: u8 = 0x02;
const V_MIN: u8 = 0x04;
const V_MAX: u8 = 0x06;
const V_TARGET: u8 = 0x08;
const A_MAX: u8 = 0x0C;
const MODE: u8 = 0x14;
const DIVIDERS: u8 = 0x18;
const INTERFACE: u8 = 0x68;
const POWER_DOWN: u8 = 0x70;
const GLOBAL: u8 = 0x7E;
const SWITCHES: u8 = 0x7C;

fn tmc429(board: &SharedBoard, register: u8, data: u32) -> u32 {
    let [_, high, middle, low] = data.to_be_bytes();
    let mut frame = [register, high, middle, low];
    let mut spi = board.spi(Chip::Tmc429(0), MOTION_HZ);
    spi.transfer_in_place(&mut frame).unwrap();
    u32::from_be_bytes([0, frame[1], frame[2], frame[3]])
}

fn tmc262(board: &SharedBoard, word: u32) -> u32 {
    let [_, high, middle, low] = word.to_be_bytes();
    let mut frame = [high, middle, low];
    let mut spi = board.spi(Chip::Tmc262(0), MOTION_HZ);
    spi.transfer_in_place(&mut frame).unwrap();
    u32::from_be_bytes([0, frame[0], frame[1], frame[2]]) >> 4
}

/// A board whose driver is on at full current, with 256 microsteps and SGT 13, and whose TMC429 stands in velocity
/// mode. A motor whose reading is zero where it stalls at SGT 13, which is that of [`set_up`], and which loses nothing
/// by its speed.
const STIFF: &str = "[motor]\nstall_guard_zero = 13\ninductance = 0\n";

fn start(config: &str) -> SharedBoard {
    let board = SharedBoard::new(Board::new(&WorldConfig::parse(config).unwrap(), 0));
    set_up(&board);
    board
}

fn set_up(board: &SharedBoard) {
    for word in [0xE_F050, 0xC_0D1F, 0x9_0135, 0xA_0000, 0x0_0000] {
        tmc262(board, word);
    }
    board.enable_pin().set_low().unwrap();
    let registers = [
        (INTERFACE, 0x122),
        (GLOBAL, 0x2),
        // The divisors are PULSE_DIV 3 and RAMP_DIV 7.
        (DIVIDERS, 0x3706),
        (V_MIN, 1),
        (V_MAX, 2047),
        (A_MAX, 2047),
        // Both stop switches stop, velocity mode.
        (MODE, 0x0002),
    ];
    for (register, data) in registers {
        tmc429(board, register, data);
    }
}

fn run(board: &SharedBoard, time: Nanos) {
    let to = board.borrow().now() + time;
    board.borrow_mut().advance_to(to);
}

fn stop(board: &SharedBoard) {
    tmc429(board, V_TARGET, 0);
    run(board, SECOND);
}

/// A stage with all that stops or slows a motor.
const STAGE: &str = "[stage]\nleft = -9000\nright = 9000\nhome = [200, 4000]\nhard_left = -12000\nhard_right = 11000\n\
                     [motor]\nfriction = 0.1\npull_in = 100";

/// Does anything that may change how the motor turns on.
fn disturb(board: &SharedBoard, random: &mut Random) {
    let words = [0x9_0135, 0xA_2222, 0xA_0000, 0x0_0000, 0x0_0004, 0x0_0308, 0xE_F0D0, 0xE_F050, 0xC_0D1F];
    let registers = [(X_ACTUAL - 2, 20_000), (V_MAX, 2048), (V_TARGET, 4096), (A_MAX, 2048), (MODE, 0x1000)];
    match random.below(4) {
        0 => drop(tmc262(board, words[random.below(9) as usize])),
        1 => {
            let load = f64::from(random.below(8)) / 10.0;
            board.borrow_mut().change_world(|world| world.axis_mut(0).set_load(load));
        }
        _ => {
            let (register, limit) = registers[random.below(5) as usize];
            tmc429(board, register, random.below(limit));
        }
    }
}

/// Any time, short or long.
fn some_time(random: &mut Random) -> Nanos {
    let scale = random.below(10);
    Nanos::from(random.below(MILLISECOND as u32) << scale)
}

/// A recording of the rotor is told each step. Without one steps are made at once, and the board is the same
/// afterwards, to the nanosecond. So it is with switches, hard ends, loads, a coolStep that changes the current, coarse
/// and fine microsteps.
#[test]
fn steps_may_be_made_at_once() {
    for seed in 0..30 {
        let [told, skipped] = [true, false].map(|traced| {
            let board = start(STAGE);
            // The board counts the changes of its world: both have the same number.
            board.borrow_mut().change_world(|world| {
                if traced {
                    world.axis_mut(0).start_trace(SECOND, 0);
                }
            });
            let mut random = Random::new(seed);
            for _ in 0..100 {
                disturb(&board, &mut random);
                run(&board, some_time(&mut random));
            }
            board.borrow_mut().change_world(|world| world.axis_mut(0).take_trace());
            format!("{board:?}")
        });
        assert!(told == skipped, "seed {seed}:\n{told}\n{skipped}");
    }
}

/// While nobody looks at positions, steps wait. Whoever asks for registers in between gets the same answers as from a
/// board that is looked at all the time, and at the end both boards are the same.
#[test]
fn steps_may_wait_until_somebody_looks() {
    for seed in 0..30 {
        let [watched, unwatched] = [true, false].map(|is_watched| {
            let board = start(STAGE);
            let mut random = Random::new(seed);
            let mut answers = Vec::new();
            for _ in 0..100 {
                disturb(&board, &mut random);
                for _ in 0..20 {
                    let register = 2 * random.below(64) as u8 + 1;
                    answers.push(tmc429(&board, register, 0));
                    board.advance_to(board.now() + some_time(&mut random) / 20);
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

#[test]
fn the_datagrams_on_the_motion_bus_are_recorded_in_their_order_once_somebody_takes_them() {
    let board = start("");
    assert_eq!(board.borrow_mut().take_datagrams(), []);
    board.borrow_mut().set_fault(Fault::Tmc429, 0, true);
    tmc429(&board, V_MAX, 0x01_0203);
    tmc262(&board, 0x0_0042);
    board.spi(Chip::At25, MOTION_HZ).write(&[5]).unwrap();
    let seen = |chip, bytes: &[u8]| Datagram { chip, bytes: bytes.to_vec() };
    let expected = [seen(Chip::Tmc429(0), &[V_MAX, 1, 2, 3]), seen(Chip::Tmc262(0), &[0, 0, 0x42])];
    assert_eq!(board.borrow_mut().take_datagrams(), expected);
    assert_eq!(board.borrow_mut().take_datagrams(), []);
}

#[test]
fn a_transfer_takes_its_time_on_the_wire_and_is_counted() {
    let board = start("");
    let mut count = board.borrow().datagrams(Chip::Tmc429(0));
    let mut spi = board.spi(Chip::Tmc429(0), 1_312_500);
    // A bit at 1.3125 MHz takes 761.904 762 ns: 32 of them 24 380.952, 40 of them 30 476.190 and 160 of them 121
    // 904.762.
    for (bytes, wire) in [(4, 24_380), (5, 30_476), (20, 121_904)] {
        let before = board.borrow().now();
        spi.transfer_in_place(&mut vec![0; bytes]).unwrap();
        let took = board.borrow().now() - before;
        count += 1;
        assert_eq!(took, wire + 2 * SELECT_TIME, "{bytes} bytes, with selecting and deselecting");
        assert_eq!(board.borrow().datagrams(Chip::Tmc429(0)), count);
    }
    assert_eq!(board.borrow().datagrams(Chip::At25), 0);
}

/// A TMC429 in power-down stands still and is woken by its chip select (datasheet section 8.2.4.3). At 16 MHz, divisor
/// 0 and V_ACTUAL 2047 it makes 499 756 steps/s. X_ACTUAL is read with the first byte, 8.25 us after the select: four
/// steps later.
#[test]
fn a_tmc429_that_a_select_wakes_up_steps_in_the_same_datagram() {
    let board = start("");
    tmc429(&board, DIVIDERS, 0x0706);
    tmc429(&board, V_TARGET, 2047);
    run(&board, SECOND);
    tmc429(&board, POWER_DOWN, 0);
    let position = board.borrow().observe(0).position;
    run(&board, SECOND);
    assert_eq!(board.borrow().observe(0).position, position);
    let read = tmc429(&board, X_ACTUAL | 1, 0) as i32;
    assert_eq!(read, position + 4);
}

#[test]
fn steps_reach_the_rotor_at_the_speed_of_the_formula() {
    let board = start(STIFF);
    board.borrow_mut().change_world(|world| {
        world.axis_mut(0).start_trace(0, 0);
    });
    tmc429(&board, V_TARGET, 1_000);
    run(&board, 2 * SECOND);
    let now = board.borrow().now();
    {
        let board = board.borrow();
        // 16 MHz x 1000 / (2^3 x 2048 x 32) = 30 517.6 microsteps/s = 119.21 full steps/s.
        let trace = board.world().axis(0).trace().unwrap();
        let speed = trace.speed(now - SECOND, now).unwrap();
        assert!((speed - 119.21).abs() < 0.05, "{speed}");
        let rotor = board.world().axis(0).motor().rotor();
        assert_eq!(i64::from(board.tmc429(0).position(0)), rotor);
        assert_eq!(board.axis_inputs(0).encoder.map(i64::from), Some(rotor % 51_200 / 50));
        assert_eq!(board.tmc262(0).stall_guard(), 512);
        assert!(!board.axis_inputs(0).stall);
    }
    stop(&board);
    let rest = board.borrow().world().axis(0).motor().rotor();
    run(&board, SECOND);
    assert_eq!(board.borrow().world().axis(0).motor().rotor(), rest);
    assert_eq!(board.borrow().next_event(), None);
}

#[test]
fn an_end_switch_on_the_stage_stops_the_motor() {
    let board = start("[stage]\nright = 20000\nleft = -20000");
    tmc429(&board, V_TARGET, 500);
    run(&board, 4 * SECOND);
    // The chip stops with the tick after the step that closed the switch: 2 us later.
    let rotor = board.borrow().world().axis(0).motor().rotor();
    assert!((20_000..=20_001).contains(&rotor), "{rotor}");
    assert_eq!(board.borrow().inputs().digital, 0b0100);
    assert_eq!(tmc429(&board, SWITCHES | 1, 0) & 0b11, 0b01);
    tmc429(&board, V_TARGET, (-500_i32 as u32) & 0xFFF);
    run(&board, 6 * SECOND);
    let rotor = board.borrow().world().axis(0).motor().rotor();
    assert!((-20_001..=-20_000).contains(&rotor), "{rotor}");
    assert_eq!(board.borrow().inputs().digital, 0b0010);
}

#[test]
fn a_switch_pressed_by_hand_stops_the_motor() {
    let board = start("");
    tmc429(&board, V_TARGET, 1_000);
    run(&board, SECOND);
    board.borrow_mut().change_world(|world| world.axis_mut(0).press(crate::world::pin::Pin::Right, true));
    run(&board, MILLISECOND);
    assert_eq!(board.borrow().tmc429(0).velocity(0), 0);
}

#[test]
fn a_motor_that_a_switch_holds_starts_when_it_is_released() {
    let board = start("");
    board.borrow_mut().change_world(|world| world.axis_mut(0).press(Pin::Right, true));
    tmc429(&board, V_TARGET, 1_000);
    for _ in 0..3 {
        run(&board, SECOND);
    }
    assert_eq!(board.borrow().world().axis(0).motor().rotor(), 0);
    board.borrow_mut().change_world(|world| world.axis_mut(0).press(Pin::Right, false));
    run(&board, SECOND);
    assert!(board.borrow().world().axis(0).motor().rotor() > 30_000);
}

#[test]
fn a_datagram_takes_effect_when_its_select_rises_however_long_it_has_been_low() {
    let board = start("");
    let mut board = board.borrow_mut();
    let start = board.now();
    board.select(Chip::Tmc429(0));
    for (byte, at) in [V_TARGET, 0, 3, 0xE8].into_iter().zip(1..) {
        board.advance_to(start + at * SECOND);
        board.byte(Chip::Tmc429(0), byte);
    }
    board.advance_to(start + 5 * SECOND);
    board.deselect(Chip::Tmc429(0));
    // The acceleration 2047 is 16 MHz^2 x 2047 / 2^(3 + 7 + 29) = 953 000 microsteps/s^2: 47.7 microsteps in the first
    // ten milliseconds.
    board.advance_to(start + 5 * SECOND + 10 * MILLISECOND);
    let rotor = board.world().axis(0).motor().rotor();
    assert!((46..=48).contains(&rotor), "{rotor}");
}

#[test]
fn a_load_stalls_the_motor_and_shows_at_the_stall_pin() {
    let board = start(STIFF);
    tmc429(&board, V_TARGET, 2_000);
    run(&board, SECOND);
    board.borrow_mut().change_world(|world| world.axis_mut(0).set_load(1.0));
    let rotor = board.borrow().world().axis(0).motor().rotor();
    run(&board, SECOND / 2);
    {
        let board = board.borrow();
        assert_eq!(board.world().axis(0).motor().rotor(), rotor);
        assert!(board.axis_inputs(0).stall);
        // The velocity 2000 is 61 035 microsteps/s: 119 full steps in half a second.
        assert_eq!(board.world().axis(0).motor().lost_steps(), 119);
    }
    board.borrow_mut().change_world(|world| world.axis_mut(0).set_load(0.0));
    stop(&board);
    let lost = board.borrow().world().axis(0).motor().lost_steps();
    assert!(lost >= 119 && lost % 4 == 0, "{lost}");
}

#[test]
fn without_bridges_the_counter_runs_and_the_rotor_stays() {
    let board = start("");
    board.enable_pin().set_high().unwrap();
    tmc429(&board, V_TARGET, 1_000);
    run(&board, SECOND);
    assert!(board.borrow().tmc429(0).position(0) > 20_000);
    assert_eq!(board.borrow().world().axis(0).motor().rotor(), 0);
}

#[test]
fn a_warm_reset_leaves_the_motion_controller_running_and_power_off_stops_it() {
    let board = start("");
    tmc429(&board, V_TARGET, 1_000);
    run(&board, SECOND);
    board.borrow_mut().warm_reset();
    let before = board.borrow().world().axis(0).motor().rotor();
    run(&board, SECOND);
    let after = board.borrow().world().axis(0).motor().rotor();
    assert!(after - before > 30_000);
    board.borrow_mut().power_off();
    run(&board, SECOND);
    assert_eq!(board.borrow().world().axis(0).motor().rotor(), after);
    assert_eq!(tmc429(&board, SWITCHES | 1, 0), 0xFF_FFFF, "nobody answers");
    board.borrow_mut().power_on();
    assert_eq!(board.borrow().tmc429(0).position(0), 0);
    assert_eq!(board.borrow().tmc262(0).registers(), Default::default());
    assert!(!board.borrow().tmc262(0).bridges_on());
    set_up(&board);
    // The driver starts at microstep pointer 0 again, so the rotor is drawn to the nearest multiple of 1024.
    let rotor = board.borrow().world().axis(0).motor().rotor();
    assert_eq!(rotor % 1_024, 0);
    assert!((rotor - after).abs() <= 512);
    assert_eq!(board.borrow().world().axis(0).motor().lost_steps(), 0);
}

#[test]
fn the_eeprom_keeps_its_contents_over_a_power_cycle_but_for_a_torn_page() {
    let board = start("");
    let mut spi = board.spi(Chip::At25, 1_000_000);
    let mut write = |address: u16, byte: u8| {
        spi.write(&[0x06]).unwrap();
        let [high, low] = address.to_be_bytes();
        let mut operations = [Operation::Write(&[0x02, high, low]), Operation::Write(&[byte; 64])];
        spi.transaction(&mut operations).unwrap();
    };
    write(0, 0x11);
    run(&board, 5 * MILLISECOND);
    write(64, 0x22);
    assert!(board.borrow().next_event().is_some());
    run(&board, MILLISECOND);
    board.borrow_mut().power_off();
    board.borrow_mut().power_on();
    run(&board, SECOND);
    let mut read = [0; 64];
    let mut operations = [Operation::Write(&[0x03, 0, 0]), Operation::Read(&mut read)];
    board.spi(Chip::At25, 1_000_000).transaction(&mut operations).unwrap();
    assert_eq!(read, [0x11; 64]);
    let page = board.borrow().at25().contents()[64..128].to_vec();
    assert!(page.contains(&0x22) && page.contains(&0xFF));
}

#[test]
fn without_motor_supply_the_driver_forgets() {
    let board = start("");
    assert!(board.borrow().tmc262(0).bridges_on());
    board.borrow_mut().change_world(|world| world.set_supply(4.9));
    assert_eq!(tmc262(&board, 0x9_0135), 0);
    board.borrow_mut().change_world(|world| world.set_supply(24.0));
    assert_eq!(board.borrow().tmc262(0).registers(), Default::default());
    assert_eq!(board.borrow().inputs().supply, 240);
}

#[test]
fn faults_appear_and_disappear() {
    let board = start("");
    let set = |fault, on| board.borrow_mut().set_fault(fault, 0, on);
    set(Fault::Spi, true);
    assert_eq!(tmc262(&board, 0xE_F050), 0xF_FFFF);
    assert_eq!(tmc429(&board, SWITCHES | 1, 0), 0xFF_FFFF);
    tmc429(&board, X_ACTUAL, 1_234);
    set(Fault::Spi, false);
    assert_eq!(tmc429(&board, X_ACTUAL | 1, 0), 1_234, "it arrived");
    set(Fault::SpiLow, true);
    assert_eq!((tmc262(&board, 0xE_F050), tmc429(&board, SWITCHES | 1, 0)), (0, 0));
    set(Fault::SpiLow, false);
    assert_eq!(tmc429(&board, X_ACTUAL | 1, 0), 1_234);
    set(Fault::Tmc429, true);
    tmc429(&board, X_ACTUAL, 77);
    assert_eq!(tmc429(&board, X_ACTUAL | 1, 0), 0xFF_FFFF);
    set(Fault::Tmc429, false);
    assert_eq!(tmc429(&board, X_ACTUAL | 1, 0), 1_234, "it did not arrive");
    set(Fault::Tmc262, true);
    assert_eq!(tmc262(&board, 0x9_0131), 0xF_FFFF);
    set(Fault::Tmc262, false);
    assert_eq!(board.borrow().tmc262(0).registers().chopconf, 0x9_0135);
    set(Fault::Overtemperature, true);
    assert_eq!(tmc262(&board, 0xE_F050) & 0x06, 0x06);
    assert!(!board.borrow().tmc262(0).bridges_on());
    set(Fault::Overtemperature, false);
    assert_eq!(tmc262(&board, 0xE_F050) & 0x06, 0);
    for (fault, flag) in [(Fault::ShortA, 0x08), (Fault::ShortB, 0x10), (Fault::OpenA, 0x20), (Fault::OpenB, 0x40)] {
        set(fault, true);
        assert_eq!(tmc262(&board, 0xE_F050) & 0x78, flag);
        assert!(!board.borrow().world().axis(0).motor().is_following());
        set(fault, false);
        board.enable_pin().set_high().unwrap();
        board.enable_pin().set_low().unwrap();
        assert_eq!(tmc262(&board, 0xE_F050) & 0x78, 0);
        assert!(board.borrow().world().axis(0).motor().is_following());
    }
    set(Fault::Encoder, true);
    board.borrow_mut().change_world(|world| world.axis_mut(0).slip(100, SECOND));
    assert_eq!(board.borrow().axis_inputs(0).encoder, Some(0));
    set(Fault::Encoder, false);
    assert_eq!(board.borrow().axis_inputs(0).encoder, Some(100 * 256 / 50));
    set(Fault::Eeprom, true);
    let mut status = [0x05, 0];
    let mut spi = board.spi(Chip::At25, 1_000_000);
    spi.transfer_in_place(&mut status).unwrap();
    assert_eq!(status[1], 0xFF);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let world = "seed = 5\n[motor]\nstall_guard_noise = 50\nfriction = 0.3\n[stage]\nhard_right = 30000";
    let run_once = || {
        let board = start(world);
        board.borrow_mut().change_world(|world| world.axis_mut(0).start_trace(0, 0));
        tmc429(&board, V_TARGET, 2_000);
        let mut readings = Vec::new();
        for _ in 0..100 {
            run(&board, 10 * MILLISECOND + 7 * MICROSECOND);
            readings.push(board.borrow().tmc262(0).stall_guard());
        }
        let trace = board.borrow_mut().change_world(|world| world.axis_mut(0).take_trace()).unwrap();
        (readings, trace.samples().to_vec())
    };
    assert_eq!(run_once(), run_once());
}

#[test]
fn the_size_of_the_time_steps_does_not_matter() {
    let final_state = |piece: Nanos| {
        let board = start("[stage]\nright = 20000\n[motor]\nfriction = 0.1");
        tmc429(&board, V_TARGET, 1_500);
        let end = board.borrow().now() + 2 * SECOND;
        while board.borrow().now() < end {
            let to = end.min(board.borrow().now() + piece);
            board.borrow_mut().advance_to(to);
        }
        crate::control::State::of(&board.borrow())
    };
    let whole = final_state(2 * SECOND);
    assert_eq!(final_state(123 * MICROSECOND), whole);
    assert_eq!(final_state(30 * MILLISECOND + 1), whole);
}
