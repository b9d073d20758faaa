//! How fast a program runs: 128 plain commands a millisecond, or 8 that talk to the chips. Seen from outside by how far
//! the program counter has got between two looks.

use common::Bench;
use common::program::MEMORY;
use hal_sim::clock::MILLISECOND;
use tmcm_sim::VirtualModule;

/// Plain commands in a millisecond.
const PLAIN: i32 = 128;
/// Commands in a millisecond that talk to the chips.
const CHIP: i32 = 8;

/// A module whose program memory is full of this command.
fn full_of(line: &str) -> Bench {
    let mut bench = Bench::new();
    bench.download(0, &vec![line; MEMORY as usize]);
    bench
}

/// How far a program of such commands gets in so many milliseconds; it is on its way already at the first look.
fn distance(bench: &mut Bench, milliseconds: u64, look: impl Fn(&mut Bench) -> i32) -> i32 {
    bench.ok("131");
    bench.start(0);
    let start = bench.module.now();
    let before = look(bench);
    bench.module.run_until(start + milliseconds * MILLISECOND);
    look(bench) - before
}

#[test]
fn plain_commands_run_128_to_the_millisecond() {
    for line in [
        "CALC ADD, 1",
        "CALCX ADD",
        "COMP 3",
        "JC EQ, 9",
        "SGP 1, 2, 1",
        "GGP 1, 2",
        "SIO 0, 2, 1",
        "GIO 0, 2",
        "AGP 2, 2",
        "SCO 1, 0, 5",
        "GCO 1, 0",
        "ACO 2, 0",
        "CLE ALL",
        "EI 255",
        "VECT 0, 5",
        "RSUB",
        // Fails as soon as it is looked at.
        "99, 0, 0, 0",
    ] {
        let mut bench = full_of(line);
        for milliseconds in 1..=10 {
            let got = distance(&mut bench, milliseconds, Bench::program_counter);
            assert_eq!(got, milliseconds as i32 * PLAIN, "{line}, {milliseconds} ms");
        }
    }
}

#[test]
fn chip_commands_run_8_to_the_millisecond() {
    for line in [
        "ROR 0, 100",
        "ROL 0, 100",
        "MST 0",
        "MVP REL, 0, 10",
        "SAP 4, 0, 1000",
        "GAP 1, 0",
        "STAP 4, 0",
        "RSAP 4, 0",
        "RFS STATUS, 0",
        "CCO 1, 0",
        "AAP 2, 0",
    ] {
        // Enough of them for the milliseconds below.
        let mut bench = Bench::new();
        bench.download(0, &[line; 300]);
        for milliseconds in [1, 2, 5, 20, 30] {
            let got = distance(&mut bench, milliseconds, Bench::program_counter);
            assert_eq!(got, milliseconds as i32 * CHIP, "{line}, {milliseconds} ms");
        }
    }
}

/// Over a minute nothing is lost: a loop of two commands counts 64 times a millisecond.
#[test]
fn a_loop_counts_evenly_for_a_minute() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "JA 0"]);
    assert_eq!(distance(&mut bench, 60_000, Bench::accumulator), 60_000 * PLAIN / 2);
}

/// A chip command costs sixteen plain ones: with 111 additions and a jump it fills a millisecond.
#[test]
fn mixtures_share_the_allowance() {
    let mut program = vec!["MST 0"];
    program.extend([&"CALC ADD, 1"; 111]);
    program.push("JA 0");
    let mut bench = Bench::with_program(&program);
    assert_eq!(distance(&mut bench, 1000, Bench::accumulator), 111_000);
}

/// The host's questions, a moving motor, and a page being written cost the program nothing.
#[test]
fn other_work_costs_the_program_nothing() {
    let mut bench = Bench::with_program(&["CALC ADD, 1", "JA 0"]);
    bench.ok("ROR 0, 2000");
    bench.start(0);
    let start = bench.module.now();
    let before = bench.accumulator();
    while bench.module.now() < start + 900 * MILLISECOND {
        for line in ["GAP 1, 0", "SAP 4, 0, 900", "SGP 77, 0, 1", "SGP 77, 0, 0", "MVP REL, 0, 1000"] {
            bench.ok(line);
        }
    }
    bench.module.run_until(start + 1000 * MILLISECOND);
    assert_eq!(bench.accumulator() - before, 1000 * PLAIN / 2);
}

/// Every mixture, not only those that fit: what does not fit the rest of a millisecond waits for the next one.
#[test]
fn what_does_not_fit_waits_for_the_next_millisecond() {
    let cost = |address: i32| if address % 61 == 0 { PLAIN / CHIP } else { 1 };
    let program: Vec<&str> = (0..MEMORY).map(|n| if cost(n) == 1 { "CALC ADD, 1" } else { "MST 0" }).collect();
    let mut bench = Bench::new();
    bench.download(0, &program);
    bench.start(0);
    let start = bench.module.now();
    let mut expected = bench.ok_beside("GGP 130, 0");
    for millisecond in 1..=15 {
        let mut left = PLAIN;
        while cost(expected) <= left {
            left -= cost(expected);
            expected += 1;
        }
        bench.module.run_until(start + millisecond * MILLISECOND);
        assert_eq!(bench.ok_beside("GGP 130, 0"), expected, "after {millisecond} ms");
    }
}
