//! Tests of the second interpreter by itself.

use super::*;

/// Answers every command with the same value and writes down what it was given.
struct Fake(Option<i32>, Vec<([u8; 7], i32)>);

impl World for Fake {
    fn command(&mut self, bytes: [u8; 7], accumulator: i32) -> Option<i32> {
        self.1.push((bytes, accumulator));
        self.0
    }
}

/// Commands as four numbers, separated by semicolons: number, type, motor or bank, value (0 if left out).
/// `@n` fills up to address n with the end of the program.
fn program(text: &str) -> Vec<[u8; 7]> {
    let mut commands = Vec::new();
    for command in text.split(';') {
        if let Some(address) = command.trim().strip_prefix('@') {
            commands.resize(address.parse().unwrap(), [0; 7]);
            continue;
        }
        let mut numbers: Vec<i32> = command.split_whitespace().map(|number| number.parse().unwrap()).collect();
        numbers.resize(4, 0);
        let [v3, v2, v1, v0] = numbers[3].to_be_bytes();
        commands.push([numbers[0] as u8, numbers[1] as u8, numbers[2] as u8, v3, v2, v1, v0]);
    }
    commands
}

fn machine(text: &str) -> Machine {
    Machine::new(&program(text))
}

fn steps(machine: &mut Machine, count: usize) {
    (0..count).for_each(|_| machine.step(&mut Fake(None, Vec::new())));
}

/// Runs a program to its end.
fn run(text: &str) -> Machine {
    let mut machine = machine(text);
    steps(&mut machine, 3000);
    assert!(!machine.running);
    machine
}

#[test]
fn the_manuals_bytes() {
    assert_eq!(program("19 2 0 -5000; 21 5 0 10"), [[0x13, 2, 0, 0xFF, 0xFF, 0xEC, 0x78], [21, 5, 0, 0, 0, 0, 10]]);
}

#[test]
fn calculations() {
    const MIN: i32 = i32::MIN;
    const MAX: i32 = i32::MAX;
    for (operation, a, b, result) in [
        (0, MAX, 1, MIN),
        (1, MIN, 1, MAX),
        (2, 65536, 65536, 0),
        (2, 3, -5000, -15000),
        (3, -7, 2, -3),
        (3, 7, 0, 0),
        (3, MIN, -1, MIN),
        (4, -7, 2, -1),
        (4, 7, -2, 1),
        (4, -7, 0, -7),
        (4, MIN, -1, 0),
        (5, 12, 10, 8),
        (6, 12, 10, 14),
        (7, 12, 10, 6),
        (8, 5, 99, -6),
        (9, 5, 99, 99),
        (10, 5, 99, 5),
    ] {
        let end = run(&format!("19 9 0 {a}; 19 {operation} 7 {b}"));
        assert_eq!((end.accumulator, end.zero), (result, result == 0), "CALC {operation}: {a}, {b}");
        if operation < 8 {
            let end = run(&format!("19 9 0 {b}; 33 9; 19 9 0 {a}; 33 {operation}"));
            assert_eq!((end.accumulator, end.x, end.zero), (result, b, result == 0), "CALCX {operation}: {a}, {b}");
        }
    }
    // CALCX NOT, SWAP, an unknown one
    for (text, accumulator, x, zero) in [
        ("19 9 0 5; 33 9; 33 8", 5, -6, false),
        ("19 9 0 5; 33 10", 0, 5, true),
        ("19 9 0 5; 33 9; 33 11", 5, 5, false),
        ("19 9 0 0; 33 8; 33 10; 33 9", -1, -1, false),
    ] {
        let end = run(text);
        assert_eq!((end.accumulator, end.x, end.zero), (accumulator, x, zero), "{text}");
    }
}

#[test]
fn conditions() {
    // Bit n of the result: JC n jumps. From the right: ZE NZ EQ NE, GT GE LT LE, ETO EAL EDV EPO, ESD, unknown.
    for (text, error, taken) in [
        ("", false, 0b00_0000_0000_1010),
        ("", true, 0b01_1001_0000_1010),
        ("19 9 0 5; 20 0 0 5;", false, 0b1010_0101),
        ("19 9 0 5; 20 0 0 6;", false, 0b1100_1010),
        ("19 9 0 5; 20 0 0 4;", false, 0b0011_1010),
        ("19 9 0 -2147483648; 20 0 0 2147483647;", false, 0b1100_1010),
        ("19 9 0 2147483647; 20 0 0 -1;", false, 0b0011_1010),
        // A value loaded after COMP: ZE and NZ only.
        ("19 9 0 5; 20 0 0 6; 19 9 0 0;", false, 0b1100_1001),
    ] {
        for kind in 0..14 {
            let mut machine = machine(&format!("{text} 21 {kind} 0 9"));
            machine.timeout = error;
            machine.position = error;
            machine.shutdown = error;
            steps(&mut machine, text.matches(';').count() + 1);
            assert_eq!(machine.program_counter == 9, taken >> kind & 1 == 1, "{text} JC {kind}");
        }
    }
}

#[test]
fn addresses() {
    for command in ["22 0 0 2048", "22 0 0 -1", "21 1 0 65536", "23 0 0 2048", "37 0 0 2048", "28 0 0 5", "0"] {
        let end = run(&format!("19 9 0 1; {command}"));
        assert_eq!((end.running, end.program_counter, end.stack.len()), (false, 0, 0), "{command}");
    }
    // Not taken, unknown condition, unknown interrupt, unknown and control commands: all are passed.
    let mut machine = machine("21 0 0 2048; 21 13 0 2048; 37 255 0 2048; 29; 131");
    steps(&mut machine, 5);
    assert_eq!((machine.running, machine.program_counter), (true, 5));
    // Address 2047 is the last: the command there is executed, and the program ends.
    let last = run("22 0 0 2047; @2047; 19 9 0 7");
    assert_eq!((last.running, last.program_counter, last.accumulator), (false, 0, 7));
    // CSUB at 2047 would return to 2048, which ends the program.
    let returned = run("22 0 0 2047; 24; @2047; 23 0 0 1");
    assert_eq!((returned.running, returned.program_counter), (false, 0));
}

#[test]
fn the_end_forgets_calls_and_the_handler_but_nothing_else() {
    // A handler that has called a subroutine ends the program.
    let mut machine = machine("37 0 0 20; 25 0; 25 255; 19 9 0 5; 27 0 0 7; @20; 23 0 0 30; @30; 28");
    steps(&mut machine, 5);
    machine.timeout = true;
    machine.interrupt(0);
    steps(&mut machine, 2);
    assert_eq!((machine.running, machine.program_counter, machine.saved, machine.waiting), (false, 0, None, None));
    assert!(machine.stack.is_empty() && machine.globally_enabled && machine.timeout);
    assert_eq!((machine.accumulator, machine.vectors.get(&0)), (5, Some(&20)));
}

#[test]
fn subroutines() {
    // RSUB without a call; eight calls, each to the next address; the ninth is ignored.
    let calls: String = (2..=9).map(|target| format!("23 0 0 {target};")).collect();
    let mut machine = machine(&format!("24; {calls} 23 0 0 5000; 24"));
    steps(&mut machine, 10);
    assert_eq!((machine.program_counter, &machine.stack[..]), (10, &[2, 3, 4, 5, 6, 7, 8, 9][..]));
    steps(&mut machine, 1);
    assert_eq!((machine.program_counter, machine.stack.len(), machine.running), (9, 7, true));
}

#[test]
fn parameters() {
    // The example of 8.4 (with AGP to another variable), stored, changed and restored; 56 cannot be stored.
    let end = run("9 42 2 1234; 10 42 2; 19 2 0 2; 35 43 2; 11 43 2; 9 43 2 7; 12 43 2; 9 56 2 8; 11 56 2; 12 56 2");
    assert_eq!((end.accumulator, end.variables[43], end.variables[56]), (2468, 2468, 8));
    let end = run("19 9 0 4; 9 0 3 -1; 9 27 3 3; 9 27 3 4; 9 3 3 1; 35 39 3; 10 3 3; 10 0 1; 9 0 1 5");
    let setting = |number| end.interrupt_settings.get(&number).copied();
    assert_eq!([setting(0), setting(27), setting(39), setting(3)], [Some(-1), Some(3), Some(0), None]);
    assert_eq!((end.accumulator, end.variables[0]), (4, 0));
    assert_eq!(run("9 0 3 -1; 10 0 3").accumulator, -1);
}

#[test]
fn outputs() {
    let end = run("14 1 2 1; 14 1 2 -1; 14 2 2 1; 14 0 1 1; 14 255 2 256; 15 1 2");
    assert_eq!((end.outputs, end.accumulator, end.pull_ups), ([false, true], 1, true));
    let end = run("19 9 0 253; 14 255 2 -1; 15 1 2");
    assert_eq!((end.outputs, end.accumulator, end.zero), ([true, false], 0, true));
    let end = run("19 9 0 257; 14 255 2 2; 14 255 2 -1; 15 255 2; 14 0 0 0");
    assert_eq!((end.outputs, end.accumulator, end.pull_ups), ([true, false], 257, false));
}

#[test]
fn coordinates() {
    let end =
        run("30 0 0 10; 30 1 0 11; 30 20 0 12; 30 0 255; 30 0 0 20; 30 1 0 21; 30 20 0 22; 31 20 255; 31 1; 39 2");
    assert_eq!((end.accumulator, &end.coordinates[..3], end.coordinates[20]), (21, &[20, 21, 21][..], 12));
    assert_eq!(end.stored_coordinates[..3], [0, 11, 0]);
    let end = run("19 9 0 1; 30 5 0 9; 30 5 255; 30 5 0 8; 30 0 0 7; 31 0 255; 30 21 0 3; 30 6 1 3; 39 6 255; 31 21");
    assert_eq!((end.coordinates[0], end.coordinates[5], end.coordinates[6], end.accumulator), (7, 9, 0, 1));
}

#[test]
fn error_flags() {
    for (kind, left) in [(0, 0), (1, 0b11110), (2, 0b11101), (3, 0b11011), (4, 0b10111), (5, 0b01111), (6, 0b11111)] {
        let mut m = machine(&format!("36 {kind}"));
        [m.timeout, m.alarm, m.deviation, m.position, m.shutdown] = [true; 5];
        steps(&mut m, 1);
        let flags = [m.timeout, m.alarm, m.deviation, m.position, m.shutdown];
        assert_eq!((0..5).map(|n| u8::from(flags[n]) << n).sum::<u8>(), left, "CLE {kind}");
    }
}

#[test]
fn waits() {
    // None of the first five waits; then POS with a time limit, TICKS.
    let mut machine = machine("27 0 9 0; 27 0 0 -1; 27 1 0 -2; 27 1 1 5; 27 5 0 5; 27 1 0 3; 27 0 0 4");
    steps(&mut machine, 8);
    assert_eq!((machine.program_counter, machine.waiting), (5, Some(Wait { condition: 1, ticks: 3 })));
    machine.finish_wait(true);
    assert_eq!((machine.program_counter, machine.waiting, machine.timeout), (6, None, true));
    machine.timeout = false;
    steps(&mut machine, 1);
    assert_eq!(machine.waiting, Some(Wait { condition: 0, ticks: 4 }));
    machine.finish_wait(true);
    assert_eq!((machine.program_counter, machine.timeout), (7, false));
}

#[test]
fn the_world() {
    // AAP; GAP and ROR of motor 1; MVP COORD, 255; CCO; RFS START; GAP. Motor 1 fails, RFS START does not load.
    let commands = program("34 0; 6 1 1; 1 0 1 5; 4 2 255 3; 32 3; 13 0; 6 1");
    let mut machine = Machine::new(&commands);
    machine.accumulator = 5;
    let mut world = Fake(Some(0), Vec::new());
    machine.coordinates[3] = 1;
    (0..6).for_each(|_| machine.step(&mut world));
    assert_eq!((machine.accumulator, machine.zero, machine.coordinates[3]), (5, false, 0));
    assert_eq!(world.1, [0, 3, 4, 5].map(|address| (commands[address], 5)));
    machine.step(&mut world);
    assert_eq!((machine.accumulator, machine.zero), (0, true));
}

#[test]
fn interrupts() {
    let main = "37 0 0 20; 37 1 0 30; 25 0; 25 1; 25 255; 38; 19 9 0 5; 20 0 0 6; 27 0 0 7";
    let mut machine = machine(&format!("{main}; @20; 19 9 0 0; 33 10; 20 0 0 0; 38; @30; 38"));
    machine.interrupt(0); // not enabled: dropped
    steps(&mut machine, 4);
    assert!(machine.pending.is_empty());
    machine.interrupt(1); // globally disabled: remembered, once
    machine.interrupt(1);
    machine.interrupt(0);
    steps(&mut machine, 2); // EI 255, the first command of handler 0
    assert_eq!((machine.program_counter, machine.saved.unwrap().program_counter), (21, 5));
    steps(&mut machine, 3);
    assert_eq!((machine.program_counter, machine.saved, machine.equal), (5, None, false));
    steps(&mut machine, 1); // RETI outside of a handler is ignored
    assert_eq!((machine.program_counter, machine.saved), (6, None));
    steps(&mut machine, 1); // handler 1 is its RETI
    assert_eq!((machine.program_counter, machine.saved), (6, None));
    steps(&mut machine, 3); // LOAD, COMP, WAIT
    machine.timeout = true;
    let before = machine.clone();
    machine.interrupt(0);
    steps(&mut machine, 1);
    assert_eq!((machine.program_counter, machine.waiting), (21, None));
    machine.timeout = false;
    machine.alarm = true;
    steps(&mut machine, 3);
    // All as before the handler, the WAIT too, but the error flags.
    assert_eq!(machine.waiting, Some(Wait { condition: 0, ticks: 7 }));
    assert_eq!(machine, Machine { timeout: false, alarm: true, returned: true, executed: Some(38), ..before });
    machine.interrupt(0);
    steps(&mut machine, 1);
    machine.interrupt(0); // its own handler runs: remembered
    steps(&mut machine, 4);
    assert_eq!((machine.program_counter, machine.pending.len()), (21, 0));
}

#[test]
fn disabling_and_vectors() {
    // No vector yet: remembered. DI 3 forgets it. EI 3, VECT 3: the handler ends the program.
    let mut machine = machine("25 3; 25 255; 26 3; 25 3; 37 3 0 9");
    steps(&mut machine, 2);
    machine.interrupt(3);
    steps(&mut machine, 1);
    assert!(machine.pending.is_empty());
    steps(&mut machine, 1);
    machine.interrupt(3);
    steps(&mut machine, 1);
    assert_eq!((machine.program_counter, machine.running), (5, true));
    steps(&mut machine, 1);
    assert_eq!((machine.program_counter, machine.running), (0, false));
    machine.interrupt(3); // stopped: dropped
    assert!(machine.pending.is_empty());
}
