use super::*;
use crate::chip::load::FULL_LOAD;
use crate::clock::MILLISECOND;

/// A motor with much resistance in its coils: its reading is zero where it stalls at SGT 13.
const RESPONSE: Response = Response { zero: 13, span: 512, speed: 0, noise: 0 };

/// Words of application note AN016, table 4.1.
const CHOPCONF: u32 = 0x9_0131;
const SGCSCONF: u32 = 0xD_0505;

fn send(chip: &mut Tmc262, now: Nanos, word: u32) -> u32 {
    chip.select(now);
    let read = word.to_be_bytes()[1..].iter().fold(0, |read, &byte| read << 8 | u32::from(chip.byte(byte)));
    chip.deselect(now);
    assert_eq!(read & 0xF, 0, "the host's four leading zeros come back last");
    read >> 4
}

fn running(sgcsconf: u32, drvconf: u32) -> Tmc262 {
    let mut chip = Tmc262::new(RESPONSE, 1);
    chip.set_disable_pin(false);
    for word in [drvconf, sgcsconf, CHOPCONF] {
        send(&mut chip, 0, word);
    }
    chip
}

/// Steps the chip, one pulse each `interval`, until `full_steps` readings have been taken. Returns the time of the last
/// pulse.
fn turn(chip: &mut Tmc262, from: Nanos, interval: Nanos, full_steps: u32, load: f64) -> Nanos {
    let ratio = (load * f64::from(FULL_LOAD)) as u32;
    let (mut now, mut passed) = (from, 0);
    while passed < full_steps {
        now += interval;
        if chip.step(now, true) {
            chip.take_reading(now, ratio);
            passed += 1;
        }
    }
    now
}

#[test]
fn the_registers_are_told_apart_by_their_highest_bits() {
    let mut chip = Tmc262::new(RESPONSE, 1);
    for word in [0x0_0304, CHOPCONF, 0xA_2345, SGCSCONF, 0xE_F040] {
        send(&mut chip, 0, word);
    }
    // No register has 01 in bits 19:18. Of 24 bits the last 20 are taken.
    send(&mut chip, 0, 0x4_FFFF);
    let expected =
        Registers { drvctrl: 0x0_0304, chopconf: CHOPCONF, smarten: 0xA_2345, sgcsconf: SGCSCONF, drvconf: 0xE_F040 };
    assert_eq!(chip.registers(), expected);
}

#[test]
fn a_short_datagram_writes_nothing() {
    let mut chip = Tmc262::new(RESPONSE, 1);
    chip.select(0);
    chip.byte(0x90);
    chip.byte(0x13);
    chip.deselect(0);
    assert_eq!(chip.registers(), Registers::default());
}

#[test]
fn the_response_has_the_format_of_the_drvconf_written_before() {
    let mut chip = running(0xC_0000 | 20 << 8 | 9, 0xE_F060);
    // SGT 20 without load: 512 + 64 x 7 = 960 = 0b11_1100_0000; SE = CS = 9.
    // At 10 us a microstep a full step takes 2.56 ms, fast enough.
    let now = turn(&mut chip, 0, 10_000, 3, 0.0);
    assert_eq!(chip.stall_guard(), 960);
    // RDSEL 2: SG9..5 in 19:15, SE in 14:10.
    assert_eq!(send(&mut chip, now, 0xE_F050), 0b11110 << 15 | 9 << 10);
    assert_eq!(send(&mut chip, now, 0xE_F040), 960 << 10);
    // RDSEL 0: three full steps are microstep 768.
    assert_eq!(send(&mut chip, now, 0xE_F070), 768 << 10);
    assert_eq!(send(&mut chip, now, 0xE_F040), 0);
}

#[test]
fn standstill_is_reported_after_two_to_the_twentieth_clocks() {
    // 2^20 clocks at 15 MHz are 69.905 066 ms.
    assert_eq!(STANDSTILL, 69_905_066);
    let mut chip = running(SGCSCONF, 0xE_F040);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x80, 0x80);
    chip.step(1_000, true);
    assert_eq!(send(&mut chip, 1_000 + 69_905_065, 0xE_F040) & 0x80, 0);
    assert_eq!(send(&mut chip, 1_000 + 69_905_066, 0xE_F040) & 0x80, 0x80);
}

#[test]
fn resolution_and_double_edges_scale_the_step() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    for (mres, size) in [(0, 1), (4, 16), (8, 256), (15, 256)] {
        send(&mut chip, 0, mres);
        let before = chip.field();
        chip.step(0, true);
        assert_eq!(chip.field() - before, size);
        send(&mut chip, 0, 0x100 | mres);
        chip.step(0, false);
        assert_eq!(chip.field() - before, -size);
        chip.step(0, true);
        chip.step(0, false);
        send(&mut chip, 0, mres);
        chip.step(0, true);
    }
    assert_eq!(chip.field(), 0);
    chip.step(0, false);
    assert_eq!(chip.field(), -256);
    assert_eq!(send(&mut chip, 0, 0) >> 10, 768, "MSTEP has ten bits");
}

#[test]
fn toff_enn_and_temperature_switch_the_bridges() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    assert!(chip.bridges_on());
    assert_eq!(chip.current(), 6, "CS 5 is 6/32");
    chip.set_disable_pin(true);
    assert_eq!(chip.current(), 0);
    chip.set_disable_pin(false);
    send(&mut chip, 0, CHOPCONF & !0xF);
    assert!(!chip.bridges_on());
    send(&mut chip, 0, CHOPCONF);
    chip.set_temperature(100);
    assert!(chip.bridges_on());
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x06, 0x04);
    chip.set_temperature(150);
    assert!(!chip.bridges_on());
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x06, 0x06);
    chip.set_temperature(99);
    assert!(chip.bridges_on());
}

#[test]
fn a_short_is_latched_until_the_bridges_are_switched_off() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    chip.set_short(Bridge::A, true);
    assert!(!chip.bridges_on());
    chip.set_short(Bridge::A, false);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x18, 0x08);
    assert!(!chip.bridges_on());
    send(&mut chip, 0, CHOPCONF & !0xF);
    send(&mut chip, 0, CHOPCONF);
    assert!(chip.bridges_on());
    assert_eq!(send(&mut chip, 0, 0xE_F440) & 0x18, 0);
    // DISS2G (bit 10) switches the protection off.
    chip.set_short(Bridge::B, true);
    assert!(chip.bridges_on());
    send(&mut chip, 0, 0xE_F040);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x18, 0x10);
}

#[test]
fn an_open_coil_is_reported_and_gives_no_torque() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    chip.set_open(Bridge::B, true);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x60, 0x40);
    assert_eq!((chip.current(), chip.torque_current()), (6, 0));
}

#[test]
fn an_open_coil_is_not_seen_while_the_bridges_are_off() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    chip.set_open(Bridge::A, true);
    chip.set_open(Bridge::B, true);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x60, 0x60);
    chip.set_disable_pin(true);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x60, 0, "by ENN");
    chip.set_disable_pin(false);
    send(&mut chip, 0, CHOPCONF & !0xF);
    assert_eq!(send(&mut chip, 0, CHOPCONF) & 0x60, 0, "by TOFF");
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x60, 0x60);
    chip.set_short(Bridge::A, true);
    assert_eq!(send(&mut chip, 0, 0xE_F040) & 0x78, 0x08, "by a short");
}

#[test]
fn the_reading_leaves_zero_when_sgt_is_raised_and_returns_under_load() {
    let reading = |sgt: u32, load| {
        let mut chip = running(0xC_0000 | (sgt & 0x7F) << 8 | 31, 0xE_F040);
        let now = turn(&mut chip, 0, 10_000, 3, load);
        (chip.stall_guard(), chip.stall_pin(now))
    };
    assert_eq!(reading(5, 0.0), (0, true));
    assert_eq!(reading(6, 0.0), (64, false));
    assert_eq!(reading(10, 0.0), (320, false));
    assert_eq!(reading(10, 0.5), (64, false));
    assert_eq!(reading(10, 0.8), (0, true));
    assert_eq!(reading(13, 0.5), (256, false));
    assert_eq!(reading(13, 1.0), (0, true));
    assert_eq!(reading(63, 1.0), (1023, false));
    assert_eq!(reading(0x7F, 0.0), (0, true), "SGT is signed: -1");
}

#[test]
fn slow_motion_cannot_be_measured_and_standstill_keeps_the_value() {
    let mut chip = running(0xC_0A1F, 0xE_F040);
    let now = turn(&mut chip, 0, 10_000, 2, 0.0);
    assert_eq!(chip.stall_guard(), 320);
    assert!(!chip.stall_pin(now + 2 * STANDSTILL));
    assert_eq!(chip.stall_guard(), 320);
    // A full step takes 256 x 130 us = 33.28 ms.
    let now = turn(&mut chip, now, 130_000, 2, 0.0);
    assert_eq!(chip.stall_guard(), 0);
    assert!(chip.stall_pin(now));
    assert!(!chip.stall_pin(now + STANDSTILL));
}

#[test]
fn the_filter_reads_once_in_four_full_steps() {
    let mut chip = running(0xD_0A1F, 0xE_F040);
    let now = turn(&mut chip, 0, 10_000, 3, 0.0);
    assert_eq!(chip.stall_guard(), 0);
    turn(&mut chip, now, 10_000, 1, 0.0);
    assert_eq!(chip.stall_guard(), 320);
}

#[test]
fn cool_step_moves_the_current_between_its_limits() {
    // SGT 10, CS 31. SEMIN 2 (below 64: up), SEMAX 1 (from (2 + 1 + 1) x 32 = 128: down). SEDN 2 (two readings), SEUP 1
    // (two up), SEIMIN 0: half of 31 is 15.
    let mut chip = running(0xC_0A1F, 0xE_F040);
    let smarten = 0xA_0000 | 2 << 13 | 1 << 8 | 1 << 5 | 2;
    send(&mut chip, 0, smarten);
    assert_eq!(chip.current(), 32);
    // Without load the reading is 320. The first full step began at time 0. Twenty readings lower the current ten
    // times.
    let now = turn(&mut chip, 0, 10_000, 20, 0.0);
    assert_eq!(chip.current(), 22);
    let now = turn(&mut chip, now, 10_000, 40, 0.0);
    assert_eq!(chip.current(), 16);
    // With a load of 0.45 the reading is 512 x 0.55 - 192 = 89 (truncated), between the thresholds.
    let now = turn(&mut chip, now, 10_000, 4, 0.45);
    assert_eq!((chip.stall_guard(), chip.current()), (89, 16));
    // With a load of 0.6 the reading is 12, below 64.
    let now = turn(&mut chip, now, 10_000, 3, 0.6);
    assert_eq!(chip.current(), 22);
    let now = turn(&mut chip, now, 10_000, 9, 0.6);
    assert_eq!(chip.current(), 32);
    // SEIMIN 1: a quarter of 31 is 7; SEDN 3: every reading.
    send(&mut chip, now, 0xA_0000 | 1 << 15 | 3 << 13 | 2);
    let now = turn(&mut chip, now, 10_000, 40, 0.0);
    assert_eq!(chip.current(), 8);
    send(&mut chip, now, 0xA_0000);
    assert_eq!(chip.current(), 32, "SEMIN 0 switches coolStep off");
}

/// SEMIN 2, SEMAX 1 and SGT 10: free, 320, is above the upper threshold, a load of 0.6, 12, below the lower one.
const BAND: u32 = 0xA_0000 | 1 << 8 | 2;

#[test]
fn cool_step_goes_up_by_seup_and_down_by_one_in_sedn_readings() {
    for (sedn, readings) in [(0, 32), (1, 8), (2, 2), (3, 1)] {
        let mut chip = running(0xC_0A1F, 0xE_F040);
        send(&mut chip, 0, BAND | sedn << 13);
        let mut now = 0;
        for expected in [31, 30, 29] {
            now = turn(&mut chip, now, 10_000, readings - 1, 0.0);
            assert_eq!(chip.current(), expected + 1, "SEDN {sedn}");
            now = turn(&mut chip, now, 10_000, 1, 0.0);
            assert_eq!(chip.current(), expected, "SEDN {sedn}");
        }
    }
    for (seup, size) in [(0, 1), (1, 2), (2, 4), (3, 8)] {
        let mut chip = running(0xC_0A1F, 0xE_F040);
        send(&mut chip, 0, BAND | 3 << 13 | seup << 5);
        let mut now = turn(&mut chip, 0, 10_000, 40, 0.0);
        for expected in [16, 16 + size, (16 + 2 * size).min(32)] {
            assert_eq!(chip.current(), expected, "SEUP {seup}");
            now = turn(&mut chip, now, 10_000, 1, 0.6);
        }
    }
}

#[test]
fn a_reading_below_the_band_and_a_reset_begin_the_count_of_cool_step_anew() {
    let mut chip = running(0xC_0A1F, 0xE_F040);
    send(&mut chip, 0, BAND);
    let now = turn(&mut chip, 0, 10_000, 31, 0.0);
    let now = turn(&mut chip, now, 10_000, 1, 0.6);
    let now = turn(&mut chip, now, 10_000, 31, 0.0);
    assert_eq!(chip.current(), 32);
    let now = turn(&mut chip, now, 10_000, 1, 0.0);
    assert_eq!(chip.current(), 31);
    let now = turn(&mut chip, now, 10_000, 31, 0.0);
    chip.set_supplied(false);
    chip.set_supplied(true);
    for word in [0xE_F040, 0xC_0A1F, CHOPCONF, BAND] {
        send(&mut chip, now, word);
    }
    let now = turn(&mut chip, now, 10_000, 31, 0.0);
    assert_eq!(chip.current(), 32);
    turn(&mut chip, now, 10_000, 1, 0.0);
    assert_eq!(chip.current(), 31);
}

#[test]
fn spi_mode_sets_the_field_by_the_coil_currents() {
    let mut chip = running(0xC_001F, 0xE_F0C0);
    // Coil A alone with a positive current is sine 1: a quarter of the period.
    send(&mut chip, 0, 248 << 9);
    assert_eq!((chip.field(), chip.current()), (256, 32));
    // Both currents negative, at 1/sqrt(2) of 248 = 175, are 225 degrees, or 640; the vector is 247.5 long.
    send(&mut chip, 0, 1 << 17 | 175 << 9 | 1 << 8 | 175);
    assert_eq!((chip.field(), chip.current()), (640, 31));
    assert!(!chip.step(0, true), "steps are ignored in SPI mode");
    assert_eq!(chip.field(), 640);
    // Back in step/direction mode the pointer, which is still 0, sets the field: 1024 is the nearest.
    send(&mut chip, 0, 0xE_F040);
    assert_eq!(chip.field(), 1024);
}

#[test]
fn without_supply_the_chip_forgets_and_reads_zero() {
    let mut chip = running(SGCSCONF, 0xE_F040);
    chip.set_supplied(false);
    assert_eq!(send(&mut chip, 0, CHOPCONF), 0);
    chip.set_supplied(true);
    assert_eq!(chip.registers(), Registers::default());
    assert!(!chip.bridges_on());
    let now = 2 * MILLISECOND;
    assert_eq!(send(&mut chip, now, 0), 0x80);
}
