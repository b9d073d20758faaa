//! Datagrams to the chips in a millisecond, how often each chip is asked, and that the links are looked at in between.

use super::Bench;
use hal_sim::board::{Chip, Datagram};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};

/// First byte of a datagram that reads a register (TMC429 datasheet, section 6.2.2.1). Bits 6 and 5 have the motor, or
/// 3 for the common registers. Bits 4 to 1 have the register.
const fn reads(motor: u8, register: u8) -> u8 {
    motor << 5 | register << 1 | 1
}

const X_ACTUAL: u8 = 1;
const V_ACTUAL: u8 = 5;
const REFERENCE_SWITCHES: u8 = reads(3, 0xE);

/// The datagrams of each millisecond, from one turn to the next.
fn milliseconds(bench: &mut Bench, count: usize) -> Vec<Vec<Datagram>> {
    // Each turn begins in the middle of a window.
    let next = bench.firmware.deadline().0 * MICROSECOND;
    let wait = (next + MILLISECOND / 2).saturating_sub(bench.now());
    bench.run(wait);
    bench.board.borrow_mut().take_datagrams();
    let from = bench.now();
    (1..=count as Nanos)
        .map(|millisecond| {
            let rest = (from + millisecond * MILLISECOND).saturating_sub(bench.now());
            bench.run(rest);
            bench.board.borrow_mut().take_datagrams()
        })
        .collect()
}

/// Asserts that no millisecond has more datagrams than `most`, nor two to drivers; gives the largest number that was
/// seen.
fn within(what: &str, milliseconds: &[Vec<Datagram>], most: usize) -> usize {
    for datagrams in milliseconds {
        assert!(datagrams.len() <= most, "{what}: {} datagrams {datagrams:?}", datagrams.len());
        let drivers = datagrams.iter().filter(|datagram| matches!(datagram.chip, Chip::Tmc262(_))).count();
        assert!(drivers <= 1, "{what}: {datagrams:?}");
    }
    milliseconds.iter().map(Vec::len).max().unwrap()
}

/// The longest time, in milliseconds, between two datagrams of a kind.
fn longest(milliseconds: &[Vec<Datagram>], is_it: impl Fn(&Datagram) -> bool) -> usize {
    let at = milliseconds.iter().enumerate().filter(|(_, datagrams)| datagrams.iter().any(&is_it));
    let at: Vec<usize> = [0].into_iter().chain(at.map(|(n, _)| n + 1)).chain([milliseconds.len()]).collect();
    at.windows(2).map(|pair| pair[1] - pair[0]).max().unwrap()
}

/// Asserts how often each chip is asked, at most so many milliseconds apart. With three axes on a controller, each has
/// its turn every three milliseconds. The speed is asked for with each second turn, the driver with each fourth.
fn asked_often_enough(bench: &Bench, milliseconds: &[Vec<Datagram>]) {
    for axis in bench.axes() {
        let (controller, motor) = (Chip::Tmc429((axis / 3).into()), axis % 3);
        let speed = longest(milliseconds, |datagram| {
            datagram.chip == controller && datagram.bytes[0] == reads(motor, V_ACTUAL)
        });
        assert!(speed <= 6, "speed of axis {axis}: {speed} ms");
        let driver = longest(milliseconds, |datagram| datagram.chip == Chip::Tmc262(axis.into()));
        assert!(driver <= 12, "driver of axis {axis}: {driver} ms");
        let switches =
            longest(milliseconds, |datagram| datagram.chip == controller && datagram.bytes[0] == REFERENCE_SWITCHES);
        // Three readings in a row have all switches of the controller, and then nine others follow. Once in 192
        // milliseconds the version of the controller is read in their place.
        assert!(switches <= 22, "switches of the controller of axis {axis}: {switches} ms");
    }
}

/// The products, and how many datagrams a millisecond may have at rest and with all axes moving.
fn budgets() -> [(Bench, usize, usize); 2] {
    [(Bench::three(""), 2, 5), (Bench::six(""), 3, 9)]
}

#[test]
fn at_rest_few_datagrams_are_sent() {
    for (mut bench, rest, _) in budgets() {
        // After two seconds at rest the motors get their standby current.
        bench.run(4 * SECOND);
        let seen = milliseconds(&mut bench, 2_000);
        within("at rest", &seen, rest);
        asked_often_enough(&bench, &seen);
    }
}

#[test]
fn with_all_axes_moving_each_position_is_read_and_little_more() {
    for (mut bench, _, moving) in budgets() {
        let start = |bench: &mut Bench, line: &str| {
            bench.each(line);
            bench.run(2 * SECOND);
        };
        for line in ["ROR #, 1000", "ROL #, 2000", "MVP ABS, #, 300000"] {
            start(&mut bench, line);
            let seen = milliseconds(&mut bench, 1_000);
            within(line, &seen, moving);
            asked_often_enough(&bench, &seen);
            for axis in bench.axes() {
                let chip = Chip::Tmc429((axis / 3).into());
                let position =
                    |datagram: &Datagram| datagram.chip == chip && datagram.bytes[0] == reads(axis % 3, X_ACTUAL);
                assert_eq!(longest(&seen, position), 1, "position of axis {axis}");
            }
        }
    }
}

/// A search looks at position and speed of its axis in each millisecond, and at the switches, which the axes of a
/// controller have in one register. It has no use for other readings of these.
#[test]
fn with_all_axes_searching_the_switches_are_read_once_for_each_controller() {
    for mut bench in Bench::bare() {
        bench.each("RFS START, #");
        bench.run(SECOND);
        let seen = milliseconds(&mut bench, 500);
        let (axes, controllers) = (usize::from(bench.spec.axes), usize::from(bench.spec.axes / 3));
        // One of the controllers reads a driver, or its own version.
        within("searching", &seen, 2 * axes + controllers + 1);
        let is_of = |datagram: &Datagram, n: usize| datagram.chip == Chip::Tmc429(n);
        for n in 0..controllers {
            let switches = |datagram: &Datagram| is_of(datagram, n) && datagram.bytes[0] == REFERENCE_SWITCHES;
            let times = seen.iter().map(|datagrams| datagrams.iter().filter(|datagram| switches(datagram)).count());
            assert!(times.clone().all(|times| times == 1), "switches of controller {n}: {:?}", times.max());
        }
        for axis in bench.axes() {
            let driver = longest(&seen, |datagram| datagram.chip == Chip::Tmc262(axis.into()));
            assert!(driver <= 12, "driver of axis {axis}: {driver} ms");
        }
    }
}

/// Only a motor that moves is asked for its position: one of six that moves costs one datagram a millisecond more.
#[test]
fn an_axis_that_moves_alone_costs_one_datagram_more() {
    for (mut bench, rest, _) in budgets() {
        for axis in bench.axes() {
            bench.run(4 * SECOND);
            bench.ok(&format!("ROR {axis}, 700"));
            bench.run(SECOND);
            let seen = milliseconds(&mut bench, 300);
            within("one axis moves", &seen, rest + 1);
            bench.ok(&format!("MST {axis}"));
        }
    }
}

/// The chip's target goes ahead of a motor on a long way in steps. When all axes have to have theirs moved on in the
/// same millisecond, that millisecond has no more datagrams than any other.
#[test]
fn waypoints_of_all_axes_do_not_fill_a_millisecond() {
    for (mut bench, _, moving) in budgets() {
        for line in ["SAP 154, #, 0", "SAP 4, #, 2047", "MVP ABS, #, 20000000"] {
            bench.each(line);
        }
        // At 500 000 microsteps a second, 2^21 of them take four seconds.
        bench.run(2 * SECOND);
        let seen = milliseconds(&mut bench, 14_000);
        within("on a long way", &seen, moving);
        let waypoint = |datagram: &Datagram| datagram.chip == Chip::Tmc429(0) && datagram.bytes[0] == 0;
        let times = seen.iter().flatten().filter(|datagram| waypoint(datagram)).count();
        assert!((2..=8).contains(&times), "the target of axis 0 was moved on {times} times");
    }
}

/// Between two datagrams the links are looked at: one call of the module sends at most one. That is the position of an
/// axis at the beginning of a millisecond, or half a millisecond later another reading of a controller.
#[test]
fn the_links_are_looked_at_between_two_datagrams() {
    for mut bench in Bench::bare() {
        bench.each("ROR #, 1500");
        bench.run(SECOND);
        bench.board.borrow_mut().take_datagrams();
        let from = bench.now();
        let (mut turn, mut positions, mut readings) = (None, 0, 0);
        while bench.now() < from + 100 * MILLISECOND {
            let deadline = bench.firmware.deadline().0 * MICROSECOND;
            bench.board.borrow_mut().advance_to(deadline);
            let at = bench.now();
            bench.firmware.poll(&bench.board);
            let sent = bench.board.borrow_mut().take_datagrams();
            let [datagram] = &sent[..] else { panic!("{sent:?}") };
            if matches!(datagram.chip, Chip::Tmc429(_)) && datagram.bytes[0] >> 1 & 0xF == X_ACTUAL {
                positions += 1;
                if datagram.chip == Chip::Tmc429(0) && datagram.bytes[0] == reads(0, X_ACTUAL) {
                    turn = Some(at);
                }
            } else if let Some(turn) = turn {
                readings += 1;
                // With two controllers the second one waits for the datagram of the first.
                let after = (at - turn) / MICROSECOND;
                assert!((495..=545).contains(&after), "a reading comes {after} us after its turn has begun: {sent:?}");
            }
        }
        let (axes, controllers) = (usize::from(bench.spec.axes), usize::from(bench.spec.axes / 3));
        assert!((100 * axes - 6..=100 * axes + 6).contains(&positions), "{positions} positions");
        assert!((98 * controllers..=100 * controllers).contains(&readings), "{readings} readings");
    }
}

/// All axes are in a search, which looks at switches and speed with every turn, or are held by their switches. A turn
/// still leaves more than a third of the millisecond to the links and the program.
#[test]
fn a_turn_with_everything_to_do_fits_into_the_millisecond() {
    for (mut bench, ..) in budgets() {
        bench.each("RFS START, #");
        bench.run(SECOND);
        let seen = milliseconds(&mut bench, 300);
        // At 1.3125 MHz a datagram of 32 bits takes 25 microseconds: 24 are 0.6 ms.
        assert!(seen.iter().all(|datagrams| datagrams.len() <= 24));
        bench.each("RFS STOP, #");
        bench.each("SAP 12, #, 0");
        bench.each("ROR #, 1000");
        bench.run(SECOND);
        for axis in bench.axes() {
            bench.control(&format!("press right {axis}"));
        }
        bench.run(SECOND);
        let seen = milliseconds(&mut bench, 300);
        assert!(seen.iter().all(|datagrams| datagrams.len() <= 24));
        assert!(bench.speeds().iter().all(|speed| *speed == 0));
    }
}

/// A right stop switch is seen within 24 milliseconds whenever it is pressed. Each axis' own is read every 12, and left
/// out once in 192 for the version of the controller. A left one comes with every datagram.
#[test]
fn each_stop_switch_is_seen_in_time() {
    for mut bench in Bench::bare() {
        let numbers: Vec<u8> = bench.axes().flat_map(|axis| [27 + 2 * axis, 28 + 2 * axis]).collect();
        for number in &numbers {
            bench.ok(&format!("SGP {number}, 3, 1"));
        }
        bench.count_interrupts(&numbers);
        for number in numbers {
            let (axis, right) = ((number - 27) / 2, number % 2 == 0);
            let switch = if right { "right" } else { "left" };
            let mut worst = 0;
            for times in 1..=64 {
                bench.control(&format!("press {switch} {axis}"));
                let pressed = bench.now();
                bench.run_until(SECOND, |bench| bench.variable(number) == times);
                worst = worst.max(bench.now() - pressed);
                bench.control(&format!("release {switch} {axis}"));
                // So that all phases of the rotation of readings, which takes 192 ms, come.
                bench.run(41 * MILLISECOND);
            }
            let limit = if right { 25 } else { 4 };
            assert!(worst <= limit * MILLISECOND, "{switch} switch of axis {axis}: {} ms", worst / MILLISECOND);
        }
    }
}
