//! Faults of the firmware itself, in the very flash image. Whatever hangs, faults or panics, the driver is off at the
//! latest with the reset, the motor stands, and the log says what has happened.

use common::image_host::{HANG, Host, PRODUCTS, Product, RECOVERY, START, UNDEFINED, assert_logged, code};
use common::telegram;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// `bx lr`: back to where it was called from.
const RETURN: [u8; 2] = 0x4770_u16.to_le_bytes();

/// How long after a reset, in microseconds, the driver is off and the motion controller has been stopped.
fn stopped_after(host: &mut Host, starts: u64) -> (u64, u64) {
    assert_eq!(host.machine.counters().starts, starts);
    let off = host.wait(MICROSECOND, SECOND, |host| !host.bridges_on());
    let stop = host.wait(MICROSECOND, SECOND, |host| host.speeds().iter().all(|speed| *speed == 0));
    (off / MICROSECOND, (off + stop) / MICROSECOND)
}

/// The motion controller keeps its registers through a reset of the microcontroller and would run on. The reset may
/// come by the watchdog, after a panic, by command, or by a dip of the microcontroller's supply. The first thing is
/// always to switch the driver off, here without a resistor that would do that by itself. Then the controller is
/// stopped.
#[test]
fn after_any_reset_the_driver_is_off_at_once_and_the_motion_controller_stops() {
    type Reset = fn(&mut Host);
    let resets: [(&str, Reset); 3] = [
        ("by command", |host| {
            host.machine.rs485().send(&telegram("255, 0, 0, 1234"), host.baud);
            host.reset_within(RECOVERY);
        }),
        ("by the watchdog", |host| {
            let place = code(host.symbol("TIM3"));
            let before = host.machine.cpu_mut().program(place, &HANG).unwrap();
            host.reset_within(BITES);
            host.machine.cpu_mut().program(place, &before).unwrap();
        }),
        ("by a dip", |host| host.machine.brown_out()),
    ];
    for (product, (name, reset)) in PRODUCTS.into_iter().flat_map(|product| resets.map(|reset| (product, reset))) {
        let mut host = Host::moving_of(product);
        host.machine.wiring().fit_enable_pull_up(false);
        reset(&mut host);
        assert!(host.bridges_on() || name == "by command", "{name}: nobody has switched it off before");
        let (off, stop) = stopped_after(&mut host, 2);
        println!(
            "{} reset {name}: driver off after {off} us, motion controller stopped after {stop} us",
            product.board.name
        );
        // Some instructions at 16 MHz; and what it takes to set up RAM and clocks.
        assert!(off <= 10 && stop <= 12_000, "{name}: {off} us, {stop} us");
        host.run(START);
        host.assert_rest();
        host.machine.rs485().take_sent();
        assert_eq!((host.ok("GAP 3, 0"), host.bridges_on()), (0, true), "{name}");
    }
}

/// The watchdog is fed for the last time at most 50 ms before, and bites 250 ms later.
const BITES: Nanos = 301 * MILLISECOND;

/// A fault in the firmware while all motors run, made by a patch that is taken back after the restart. If the
/// firmware notices it, the drivers are off at once; at the latest they are with the watchdog's reset. From then on the
/// motors stand, and run again when told to; LED2 is lit until the next good start. Gives the log.
fn assert_recovers(product: Product, noticed: bool, fault: impl FnOnce(&mut Host) -> (u32, Vec<u8>)) -> Vec<String> {
    let mut host = Host::moving_of(product);
    let undo = fault(&mut host);
    // TIM3, where the faults are, comes each millisecond.
    host.run(1_100 * MICROSECOND);
    assert_eq!((host.bridges_on(), host.machine.counters().starts), (!noticed, 1));
    let rotors = noticed.then(|| host.rotors());
    host.reset_within(BITES);
    let rotors = rotors.unwrap_or_else(|| host.rotors());
    host.machine.cpu_mut().program(undo.0, &undo.1).unwrap();
    host.run(START);
    let log = host.log();
    assert_eq!(host.machine.counters().starts, 2);
    for (now, then) in host.rotors().into_iter().zip(rotors) {
        assert!((now - then).abs() <= 512, "it has been drawn to a full step at most");
    }
    host.assert_rest();
    assert!(host.machine.board().world().outputs().leds[1]);
    host.each("ROR #, 500");
    host.run(200 * MILLISECOND);
    assert_eq!(host.speed(), product.turning);
    host.ok("255, 0, 0, 1234");
    host.run(RECOVERY);
    assert!(!host.machine.board().world().outputs().leds[1]);
    assert_logged(&host.log(), &["info: restarted by command"]);
    log
}

#[test]
fn the_watchdog_restarts_a_module_whose_owner_hangs() {
    let hang = |host: &mut Host| {
        let place = code(host.symbol("TIM3"));
        (place, host.machine.cpu_mut().program(place, &HANG).unwrap())
    };
    for product in PRODUCTS {
        let log = assert_recovers(product, false, hang);
        assert_logged(&log, &["error: restarted by the watchdog: something hung"]);
    }
}

/// Thread mode does for ever what it does next: interrupts are served, but no task is run.
#[test]
fn the_watchdog_restarts_a_module_whose_thread_mode_hangs() {
    let hang = |host: &mut Host| {
        host.wait(MICROSECOND, SECOND, |host| host.machine.cpu().is_asleep());
        let place = host.machine.cpu().pc();
        (place, host.machine.cpu_mut().program(place, &HANG).unwrap())
    };
    for product in PRODUCTS {
        let log = assert_recovers(product, false, hang);
        assert_logged(&log, &["error: restarted by the watchdog: something hung"]);
    }
}

/// A task that is never run again, while all others are: the code that runs it does nothing.
#[test]
fn the_watchdog_restarts_a_module_of_which_one_task_stands_still() {
    let tasks = [("usb_link", "carry"), ("keeper", "keep")];
    for (product, (task, word)) in PRODUCTS.into_iter().flat_map(|product| tasks.map(|task| (product, task))) {
        let stop = |host: &mut Host| {
            let pool = host.symbols(&["board", task, word, "POOL"]);
            let [pool] = *pool else { panic!("{task}: {pool:x?}") };
            // The head of a task holds the address of the code that runs it.
            let polls = host.symbols(&["TaskStorage", "poll"]);
            let words = (0..16).filter_map(|n| host.machine.cpu().peek(pool + 4 * n));
            let place = code(words.into_iter().find(|word| polls.contains(word)).unwrap());
            (place, host.machine.cpu_mut().program(place, &RETURN).unwrap())
        };
        let log = assert_recovers(product, false, stop);
        assert_logged(&log, &["error: no sign of life: module, EEPROM, USB", "error: restarted by the watchdog"]);
    }
}

#[test]
fn a_hard_fault_switches_the_driver_off_and_is_told_after_the_restart() {
    for product in PRODUCTS {
        let mut at = 0;
        let fault = |host: &mut Host| {
            at = code(host.symbol("TIM3"));
            (at, host.machine.cpu_mut().program(at, &UNDEFINED).unwrap())
        };
        let log = assert_recovers(product, true, fault);
        let place = format!("hard fault at {at:#x}");
        assert_logged(&log, &[&format!("error: {place}"), &format!("error: restarted after a {place}")]);
    }
}

/// A stack that overflows leaves the RAM below it, in which the core stops for the watchdog; no static is overwritten.
#[test]
fn a_stack_overflow_ends_in_a_restart_and_overwrites_nothing() {
    // PUSH {R0-R7}, again and again.
    const PUSH: [u8; 4] = 0xE7FD_B4FF_u32.to_le_bytes();
    let overflow = |host: &mut Host| {
        let (place, stack) = (code(host.symbol("TIM3")), host.symbol("_stack_start"));
        let before = host.machine.cpu_mut().program(place, &PUSH).unwrap();
        // The program memory, where there is no program, and all else that does not change.
        let statics =
            |host: &Host| (stack..stack + 0x4000).step_by(4).map(|at| host.machine.cpu().peek(at)).collect::<Vec<_>>();
        let (then, bottom) = (statics(host), host.machine.cpu().peek(stack - 0x4000));
        host.run(1_010 * MICROSECOND);
        let changed = then.iter().zip(statics(host)).filter(|(then, now)| **then != *now).count();
        assert!(changed < 20, "{changed} words of the statics");
        assert_ne!(host.machine.cpu().peek(stack - 0x4000), bottom, "filled to the end");
        (place, before)
    };
    for product in PRODUCTS {
        let log = assert_recovers(product, false, overflow);
        assert_logged(&log, &["error: restarted by the watchdog: something hung"]);
    }
}

/// Code for this place that calls a function with a value and does not return: MOVW, MOVT to R0, then B.
fn call(place: u32, function: u32, value: u32) -> Vec<u8> {
    let wide = |opcode: u32, half: u32| [opcode | half >> 1 & 0x400 | half >> 12, half << 4 & 0x7000 | half & 0xFF];
    let offset = function.wrapping_sub(place + 12);
    let [sign, i1, i2] = [31, 23, 22].map(|bit| offset >> bit & 1);
    let branch = [
        0xF000 | sign << 10 | offset >> 12 & 0x3FF,
        0x9000 | (1 ^ i1 ^ sign) << 13 | (1 ^ i2 ^ sign) << 11 | offset >> 1 & 0x7FF,
    ];
    let halves = [wide(0xF240, value & 0xFFFF), wide(0xF2C0, value >> 16), branch];
    halves.concat().into_iter().flat_map(|half| (half as u16).to_le_bytes()).collect()
}

/// A place in the source that the image holds for a panic: its address, and its text.
fn some_location(host: &Host) -> (u32, String) {
    const FLASH: std::ops::Range<u32> = 0x0800_0000..0x0802_0000;
    let peek = |at| host.machine.cpu().peek(at).unwrap_or(0);
    let location = |at| {
        let [name, length, line, column] = [0, 4, 8, 12].map(|offset| peek(at + offset));
        let plausible = FLASH.contains(&name) && (5..100).contains(&length) && line < 10_000 && column < 200;
        let byte = |n| peek((name + n) & !3).to_le_bytes()[((name + n) & 3) as usize];
        let name = plausible.then(|| String::from_utf8((0..length).map(byte).collect()).ok()).flatten()?;
        name.ends_with(".rs").then(|| (at, format!("{name}:{line}")))
    };
    FLASH.step_by(4).find_map(location).unwrap()
}

#[test]
fn a_panic_switches_the_driver_off_and_is_told_with_its_place_after_the_restart() {
    for product in PRODUCTS {
        let mut text = String::new();
        let panic = |host: &mut Host| {
            let (location, name) = some_location(host);
            text = name;
            let function = host.symbols(&["core", "option", "unwrap_failed"]);
            let [function] = *function else { panic!("{function:x?}") };
            let place = code(host.symbol("TIM3"));
            let calls = call(place, code(function), location);
            (place, host.machine.cpu_mut().program(place, &calls).unwrap())
        };
        let log = assert_recovers(product, true, panic);
        let [now, after] = ["panicked", "restarted after a panic"].map(|what| format!("error: {what} at {text}"));
        assert_logged(&log, &[&now, &after]);
    }
}
