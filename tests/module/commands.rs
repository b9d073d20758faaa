//! Every command of direct mode: what it does, and the status and value it is answered with.

use common::{Bench, INVALID_COMMAND, INVALID_VALUE, NOT_AVAILABLE, OK, WRONG_TYPE};
use hal_sim::clock::SECOND;
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};

/// Command numbers that mean something, from the manual.
const KNOWN: [(u8, u8); 6] = [(1, 15), (19, 28), (30, 39), (64, 71), (128, 139), (255, 255)];
/// Entry into a boot loader: known, although there is none.
const BOOT_LOADER: u8 = 242;

#[test]
fn unknown_command_numbers() {
    let mut bench = Bench::new();
    let known = |number: u8| KNOWN.iter().any(|range| (range.0..=range.1).contains(&number)) || number == BOOT_LOADER;
    for number in (0..=u8::MAX).filter(|number| !known(*number)) {
        // Whatever else stands in them.
        for (kind, motor, value) in [(0, 0, 0), (1, 0, 1234), (255, 255, -1)] {
            let reply = bench.send(Command::new(number, kind, motor, value));
            assert_eq!((reply.status, reply.opcode, reply.value), (INVALID_COMMAND, number, value));
        }
    }
}

#[test]
fn program_only_commands_are_not_available() {
    let mut bench = Bench::new();
    for line in [
        "COMP 5",
        "JC ZE, 0",
        "JA 0",
        "CSUB 0",
        "RSUB",
        "WAIT TICKS, 0, 10",
        "WAIT POS, 9, 0",
        "STOP",
        "RETI",
        "21, 99, 0, 0",
    ] {
        bench.refused(line, NOT_AVAILABLE);
    }
}

#[test]
fn user_functions_are_not_available_by_default() {
    let mut bench = Bench::new();
    for number in 0..8 {
        bench.refused(&format!("UF{number} 1, 2, 3"), NOT_AVAILABLE);
    }
}

/// Commands that return nothing of their own return the value they were sent, also where the field means
/// nothing to them.
#[test]
fn the_value_is_echoed() {
    let mut bench = Bench::new();
    let echoing = [
        (1, 0, 0, 500),
        (2, 0, 0, -500),
        (3, 0, 0, 77),
        (5, 4, 0, 900),
        (7, 4, 0, 78),
        (8, 4, 0, 79),
        (9, 68, 0, 100),
        (11, 3, 2, 80),
        (12, 3, 2, 81),
        (14, 1, 2, 1),
        (19, 0, 0, -5000),
        (30, 1, 0, 4711),
        (30, 1, 255, 82),
        (31, 1, 255, 83),
        (33, 2, 0, 84),
        (34, 6, 0, 85),
        (35, 3, 2, 86),
        (36, 0, 0, 87),
        (39, 5, 0, 88),
        (138, 0, 0, 1),
        (255, 0, 0, 1234),
    ];
    bench.ok("CALC LOAD, 5100");
    for (opcode, kind, motor, value) in echoing {
        let command = Command::new(opcode, kind, motor, value);
        let reply = bench.send(command);
        assert_eq!((reply.status, reply.opcode, reply.value), (OK, opcode, value), "{command}");
    }
}

/// A motor that does not exist is refused first of all.
#[test]
fn axis_commands_check_the_motor() {
    let mut bench = Bench::new();
    for opcode in [1, 2, 3, 4, 5, 6, 7, 8, 13, 30, 31, 32, 34, 39] {
        // The special forms of MVP COORD, SCO and GCO take 255.
        for motor in [1, 2, 254] {
            let reply = bench.send(Command::new(opcode, 99, motor, 50_000));
            assert_eq!((reply.status, reply.value), (INVALID_VALUE, 50_000), "command {opcode}, motor {motor}");
        }
    }
    for opcode in [1, 2, 3, 5, 6, 7, 8, 13, 32, 34, 39] {
        assert_eq!(bench.send(Command::new(opcode, 0, 255, 0)).status, INVALID_VALUE, "command {opcode}, motor 255");
    }
}

// ---- motion

#[test]
fn rotation() {
    let mut bench = Bench::new();
    for (line, speed) in
        [("ROR 0, 2047", 2047), ("ROL 0, 2047", -2047), ("ROR 0, -700", -700), ("ROL 0, -700", 700), ("MST 0", 0)]
    {
        bench.ok(line);
        assert_eq!(bench.ok("GAP 2, 0"), speed, "{line}");
        bench.run(SECOND);
        assert_eq!(bench.ok("GAP 3, 0"), speed, "{line}");
    }
    bench.ok("ROR 0, 300");
    for line in ["ROR 0, 2048", "ROR 0, -2048", "ROL 0, 2048", "ROL 0, -2147483648", "ROR 0, 2147483647"] {
        bench.refused(line, INVALID_VALUE);
        assert_eq!(bench.ok("GAP 2, 0"), 300, "{line}");
    }
    // The maximum positioning speed does not limit rotation.
    bench.ok("SAP 4, 0, 100");
    bench.ok("ROR 0, 1000");
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 3, 0"), 1000);
}

#[test]
fn mvp_returns_the_absolute_target() {
    let mut bench = Bench::new();
    bench.ok("SCO 20, 0, 1500");
    bench.ok("SCO 0, 0, 1400");
    for (line, target) in [
        ("MVP ABS, 0, 2000", 2000),
        ("MVP REL, 0, -500", 1500),
        ("MVP COORD, 0, 0", 1400),
        ("MVP COORD, 0, 20", 1500),
        ("MVP REL, 0, 0", 1500),
        ("MVP COORD, 255, 0", 1400),
    ] {
        assert_eq!(bench.ok(line), target, "{line}");
        bench.run_until(SECOND, |b| b.rotor() == i64::from(target));
    }
    // Relative to where the motor is, with wrapping.
    bench.ok("SAP 1, 0, 2147483600");
    assert_eq!(bench.ok("MVP REL, 0, 100"), -2_147_483_596);
    bench.run_until(SECOND, |b| b.rotor() == 1500);
    assert_eq!(bench.ok("GAP 1, 0"), -2_147_483_596);
}

#[test]
fn mvp_refusals() {
    let mut bench = Bench::new();
    for (line, status) in [
        ("MVP ABS, 255, 10", INVALID_VALUE),
        ("MVP REL, 255, 10", INVALID_VALUE),
        ("MVP COORD, 0, 21", INVALID_VALUE),
        ("MVP COORD, 0, -1", INVALID_VALUE),
        ("MVP COORD, 0, 256", INVALID_VALUE),
        ("MVP COORD, 255, 21", INVALID_VALUE),
        ("MVP 3, 0, 0", WRONG_TYPE),
        ("MVP 255, 0, 0", WRONG_TYPE),
    ] {
        bench.refused(line, status);
        assert_eq!((bench.ok("GAP 0, 0"), bench.ok("GAP 8, 0")), (0, 1), "{line}");
    }
}

// ---- coordinates

#[test]
fn coordinates_in_ram() {
    let mut bench = Bench::new();
    for n in 0..=20 {
        assert_eq!(bench.ok(&format!("GCO {n}, 0")), 0);
        bench.ok(&format!("SCO {n}, 0, {}", i32::MIN + n));
    }
    for n in 0..=20 {
        assert_eq!(bench.ok(&format!("GCO {n}, 0")), i32::MIN + n);
    }
    bench.ok("CALC LOAD, 4711");
    bench.ok("ACO 9, 0");
    assert_eq!((bench.ok("GCO 9, 0"), bench.ok("GCO 8, 0")), (4711, i32::MIN + 8));
    for line in ["SCO 21, 0, 1", "GCO 21, 0", "CCO 21, 0", "ACO 21, 0", "SCO 255, 0, 1", "GCO 255, 255"] {
        bench.refused(line, INVALID_VALUE);
    }
}

/// CCO returns the position it has captured, of a motor on its way.
#[test]
fn cco_returns_the_captured_position() {
    let mut bench = Bench::new();
    bench.ok("ROL 0, 1000");
    bench.run(SECOND);
    let before = bench.rotor();
    let captured = bench.ok("CCO 4, 0");
    assert!((bench.rotor()..=before).contains(&captured.into()));
    bench.run(SECOND);
    assert_eq!(bench.ok("GCO 4, 0"), captured);
}

// ---- the registers of programs

/// The accumulator as CALC left it: AGP shows it through a user variable.
fn accumulator(bench: &mut Bench) -> i32 {
    bench.ok("AGP 255, 2");
    bench.ok("GGP 255, 2")
}

#[test]
fn calc_works_on_the_accumulator() {
    let mut bench = Bench::new();
    for (line, result) in [
        ("CALC LOAD, 10", 10),
        ("CALC ADD, 32", 42),
        ("CALC SUB, 50", -8),
        ("CALC MUL, -6", 48),
        ("CALC DIV, 5", 9),
        ("CALC MOD, 5", 4),
        ("CALC OR, 3", 7),
        ("CALC AND, 13", 5),
        ("CALC XOR, 255", 250),
        ("CALC NOT, 0", -251),
        ("CALC DIV, 0", 0),
        ("CALC LOAD, 2147483647", i32::MAX),
        ("CALC ADD, 1", i32::MIN),
        ("CALC DIV, -1", i32::MIN),
        ("CALC MOD, 0", i32::MIN),
    ] {
        bench.ok(line);
        assert_eq!(accumulator(&mut bench), result, "{line}");
    }
    for kind in 10..=u8::MAX {
        bench.refused(&format!("19, {kind}, 0, 1"), WRONG_TYPE);
    }
    assert_eq!(accumulator(&mut bench), i32::MIN);
}

#[test]
fn calcx_works_on_accumulator_and_x() {
    let mut bench = Bench::new();
    bench.ok("CALC LOAD, 6");
    bench.ok("CALCX LOAD");
    bench.ok("CALC LOAD, 20");
    for (line, result) in [
        ("CALCX ADD", 26),
        ("CALCX SUB", 20),
        ("CALCX MUL", 120),
        ("CALCX DIV", 20),
        ("CALCX MOD", 2),
        ("CALCX OR", 6),
        ("CALCX AND", 6),
        ("CALCX XOR", 0),
        // X becomes its own complement, the accumulator stays.
        ("CALCX NOT", 0),
        ("CALCX SWAP", !6),
        ("CALCX SWAP", 0),
    ] {
        bench.ok(line);
        assert_eq!(accumulator(&mut bench), result, "{line}");
    }
    for kind in 11..=u8::MAX {
        bench.refused(&format!("33, {kind}, 0, 0"), WRONG_TYPE);
    }
}

/// Reading over a link leaves the accumulator alone.
#[test]
fn gap_ggp_and_gio_leave_the_accumulator() {
    let mut bench = Bench::new();
    bench.ok("CALC LOAD, 99");
    for line in ["GAP 4, 0", "GGP 66, 0", "GIO 8, 1", "GCO 1, 0"] {
        bench.ok(line);
        assert_eq!(accumulator(&mut bench), 99, "{line}");
    }
}

#[test]
fn cle_takes_six_kinds() {
    let mut bench = Bench::new();
    for kind in 0..=u8::MAX {
        let expected = if kind <= 5 { OK } else { WRONG_TYPE };
        assert_eq!(bench.send(Command::new(36, kind, 0, 0)).status, expected, "CLE {kind}");
    }
}

// ---- control commands

#[test]
fn firmware_version_in_both_forms() {
    let mut bench = Bench::new();
    let mut exchange = |kind, host: u8| {
        let request = binary::encode_command(1, Command::new(136, kind, 0, 0));
        let telegram = bench.exchange(Source::Usb, request).unwrap().telegram().unwrap();
        bench.ok(&format!("SGP 76, 0, {}", host + 1));
        telegram
    };
    assert_eq!(exchange(0, 2), *b"\x021140V142");
    assert_eq!(exchange(0, 3), *b"\x031140V142");
    assert_eq!(exchange(1, 4), [4, 1, 100, 136, 0x04, 0x74, 0x01, 0x2A, 0x94]);
    for kind in 2..=u8::MAX {
        bench.refused(&format!("136, {kind}"), WRONG_TYPE);
    }
}
