//! Random programs - valid, invalid, jumping onto themselves, calling without end, with interrupts on - for a billion
//! microseconds of virtual time. There is no panic, and every direct-mode request is answered in time, with values in
//! their range.

use common::random::Random;
use common::random_command::{LENGTH, command};
use common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use tmcm::module::Source;
use tmcm::product::TMCM_1140;
use tmcm::tmcl::{Command, Opcode, binary, text};
use tmcm_sim::VirtualModule;

/// Virtual time in all.
const TIME: Nanos = 1_000_000_000 * MICROSECOND;
/// How long each program runs.
const TURN: Nanos = 500 * MILLISECOND;
/// A reply comes at the latest this long after its request. A slice of the program takes at most one command that talks
/// to the chips, a millisecond at most eight. A request waits for no more than one of them.
const REPLY: Nanos = MILLISECOND;

/// Disturbs the module, as the world may do it meanwhile.
fn disturb(bench: &mut Bench, random: &mut Random) {
    let line = match random.below(6) {
        0 => format!("input {} {}", random.below(4), random.below(2)),
        1 => "press left".into(),
        2 => "release left".into(),
        3 => format!("load 0.{}", random.below(10)),
        4 => "press right".into(),
        _ => "release right".into(),
    };
    bench.control(&line);
}

/// Sends a command over RS485, which has no frames to wait for, and gives status and value of the reply, which must
/// be in time.
fn ask(bench: &mut Bench, command: Command, within: Nanos) -> (u8, i32) {
    bench.module.receive(Source::Rs485, binary::encode_command(1, command));
    let end = bench.module.now() + within;
    loop {
        if let Some(sent) = bench.module.sent() {
            let reply = binary::decode_reply(&sent.telegram().unwrap()).unwrap();
            return (reply.status, reply.value);
        }
        assert!(bench.module.now() < end, "{command}: no reply in time");
        bench.run(50 * MICROSECOND);
    }
}

/// Every parameter that can be read has a value that could be written.
fn check_ranges(bench: &mut Bench) {
    let axis = TMCM_1140.axis.rows.iter().map(|p| (&p.row, Opcode::Gap as u8));
    let global = TMCM_1140.global.rows.iter().map(|p| (&p.row, Opcode::Ggp as u8));
    for (row, opcode) in axis.chain(global) {
        let (status, value) = ask(bench, Command::new(opcode, row.number, 0, 0), REPLY);
        assert_eq!(status, OK, "{}", row.name);
        assert!(row.accepts(value) || !row.writable(), "{} is {value}", row.name);
    }
}

#[test]
fn for_a_billion_microseconds() {
    let mut random = Random(0x71C_E700);
    let mut bench = Bench::new();
    let (mut programs, mut requests, mut ran_on) = (0_u32, 0_u64, 0_u32);
    let end = bench.module.now() + TIME;
    while bench.module.now() < end {
        let control = |opcode: Opcode, value| Command::new(opcode as u8, 0, 0, value);
        // Replies to storing commands take two page writes at most; the end of a download one for each page.
        let slow = 100 * MILLISECOND;
        ask(&mut bench, control(Opcode::ResetApplication, 0), slow);
        assert_eq!(ask(&mut bench, control(Opcode::EnterDownload, 0), slow).0, OK);
        for _ in 0..LENGTH {
            let (status, _) = ask(&mut bench, command(&mut random), REPLY);
            assert_eq!(status, 101);
        }
        assert_eq!(ask(&mut bench, control(Opcode::ExitDownload, 0), slow).0, OK);
        assert_eq!(ask(&mut bench, control(Opcode::RunApplication, 0), REPLY).0, OK);
        let stop = bench.module.now() + TURN;
        while bench.module.now() < stop {
            bench.run(random.below(40) * MILLISECOND + random.below(1000) * MICROSECOND);
            let read = random.pick(&["GAP 1, 0", "GGP 130, 0", "GIO 0, 0", "135, 1, 0, 0", "GGP 0, 2"]);
            assert_eq!(ask(&mut bench, text::parse(read).unwrap(), REPLY).0, OK, "{read}");
            if random.one_in(4) {
                disturb(&mut bench, &mut random);
            }
            requests += 1;
        }
        ran_on += u32::from(ask(&mut bench, text::parse("GGP 128, 0").unwrap(), REPLY).1 == 1);
        programs += 1;
        if programs.is_multiple_of(50) {
            check_ranges(&mut bench);
        }
    }
    println!("{programs} programs, {ran_on} of which ran to the end of their time; {requests} requests answered");
    assert!(ran_on > programs / 4 && programs > 1000);
}
