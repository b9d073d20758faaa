//! Commands that end what the module does: 137 and 255, and 242, which would enter a boot loader.

use common::{Bench, INVALID_VALUE, OK, telegram};
use hal_sim::clock::{MILLISECOND, SECOND};
use tmcm::module::Source;
use tmcm::tmcl::{Command, binary};
use tmcm_sim::VirtualModule;

/// 137 and 255 want 1234; anything else changes nothing.
#[test]
fn reset_commands_want_their_password() {
    let mut bench = Bench::new();
    bench.ok("SGP 68, 0, 4");
    bench.ok("SIO 1, 2, 1");
    for opcode in [137, 255] {
        for value in [0, 1, 1233, 1235, -1234, i32::MIN, i32::MAX] {
            bench.refused(&format!("{opcode}, 0, 0, {value}"), INVALID_VALUE);
        }
    }
    bench.run(SECOND);
    assert_eq!((bench.ok("GGP 68, 0"), bench.ok("GIO 1, 2")), (4, 1));
    assert!(bench.ok("GGP 132, 0") > 1000);
}

/// 255 restarts the module after its reply: the motor stops, RAM is gone, what is stored is back.
#[test]
fn software_reset() {
    let mut bench = Bench::new();
    for line in ["SAP 4, 0, 321", "STAP 4, 0", "SAP 5, 0, 322", "SGP 3, 2, 7", "ROR 0, 500", "SGP 132, 0, 1000000"] {
        bench.ok(line);
    }
    bench.run(SECOND);
    assert_eq!(bench.ok("255, 0, 0, 1234"), 1234);
    // The reply has 100 ms to get through, then the module starts anew, which takes less than 300 ms.
    bench.run(400 * MILLISECOND);
    assert!((1..300).contains(&bench.ok("GGP 132, 0")));
    let rotor = bench.rotor();
    bench.run(SECOND);
    assert_eq!((bench.ok("GAP 3, 0"), bench.rotor(), bench.ok("GAP 1, 0")), (0, rotor, 0));
    assert_eq!((bench.ok("GAP 4, 0"), bench.ok("GAP 5, 0"), bench.ok("GGP 3, 2")), (321, 1000, 0));
}

/// Power that is switched on while it is on changes nothing, neither in the firmware nor in the chips; and so it is
/// with off.
#[test]
fn power_that_is_as_it_is_wanted() {
    let mut bench = Bench::new();
    bench.ok("ROR 0, 500");
    bench.run(SECOND);
    for _ in 0..3 {
        bench.control("power on");
        bench.module.set_power(true);
        let (up, rotor) = (bench.ok("GGP 132, 0"), bench.rotor());
        assert!(up > 900, "{up} ms");
        bench.run(100 * MILLISECOND);
        assert_eq!(bench.ok("GAP 3, 0"), 500);
        assert!(bench.rotor() - rotor > 1_000, "{} and {rotor}", bench.rotor());
    }
    bench.module.set_power(false);
    for _ in 0..3 {
        bench.control("power off");
        bench.module.set_power(false);
        bench.run(100 * MILLISECOND);
    }
    bench.module.set_power(true);
    bench.run(100 * MILLISECOND);
    assert_eq!((bench.ok("GAP 3, 0"), bench.ok("GAP 1, 0")), (0, 0));
}

/// Update tools take the next nine bytes for the answer to something else. So a command that enters the vendor's boot
/// loader is never answered, also where 255 suppresses nothing. With other operands it is refused.
#[test]
fn boot_loader_entry() {
    let entry = Command::ENTER_BOOTLOADER;
    for source in [Source::Usb, Source::Rs485] {
        let mut bench = Bench::new();
        assert_eq!(bench.exchange(source, binary::encode_command(1, entry)), None);
        for other in [
            Command { kind: 0, ..entry },
            Command { motor: 0, ..entry },
            Command { value: 0, ..entry },
            Command { value: 1234, ..entry },
        ] {
            let reply = bench.exchange(source, binary::encode_command(1, other)).unwrap().telegram().unwrap();
            let reply = binary::decode_reply(&reply).unwrap();
            assert_eq!((reply.status, reply.opcode, reply.value), (INVALID_VALUE, 242, other.value), "{other}");
        }
        assert_eq!(bench.ok("GAP 4, 0"), 1000, "the module goes on");
    }
}

/// From 255 on, requests are neither executed nor answered, on any link, and the program stands; what was asked before
/// is finished and answered.
#[test]
fn what_comes_after_255_is_lost() {
    let mut bench = Bench::new();
    for line in ["132", "GGP 1, 2", "CALC ADD, 1", "AGP 1, 2", "JA 0", "133", "129"] {
        bench.ask(line);
    }
    // A store takes two page writes of 5 ms; the reply to it comes after the reply to 255.
    bench.post(Source::Rs485, "STGP 7, 2");
    bench.post(Source::Usb, "255, 0, 0, 1234");
    bench.post(Source::Usb, "ROR 0, 500");
    let mut wrong = telegram("GAP 1, 0");
    wrong[8] ^= 1;
    bench.module.receive(Source::Usb, wrong);
    bench.run(2 * MILLISECOND);
    let counted = bench.module.read(Command::new(10, 1, 2, 0));
    assert_eq!(counted, None, "not even asked past the links");
    let steps = bench.module.machine().unwrap().registers.accumulator;
    bench.run(50 * MILLISECOND);
    assert_eq!(bench.module.machine().unwrap().registers.accumulator, steps, "the program stands");
    for source in [Source::Usb, Source::Rs485] {
        bench.post(source, "GAP 1, 0");
    }
    bench.run(40 * MILLISECOND);
    let said = std::iter::from_fn(|| bench.module.sent()).map(|sent| (sent.source, sent.bytes[3]));
    let mut said: Vec<_> = said.collect();
    said.sort_by_key(|(_, opcode)| *opcode);
    assert_eq!(said, [(Source::Rs485, 11), (Source::Usb, 255)]);
    assert_eq!(bench.module.board().borrow().tmc429(0).velocity(0), 0, "ROR was not executed");
    // After the restart it hears again.
    bench.run(SECOND);
    assert_eq!(bench.ok("GAP 2, 0"), 0);
}

/// A supply that comes back between 255 and the restart starts nothing, or the program would go on storing while nobody
/// is heard.
#[test]
fn no_program_starts_before_a_restart() {
    let mut bench = Bench::new();
    for line in ["132", "ROR 0, 500", "CALC ADD, 1", "AGP 1, 2", "STGP 1, 2", "JA 1", "133", "SGP 77, 0, 1"] {
        assert!(bench.ask(line).0 >= OK, "{line}");
    }
    bench.control("supply 5");
    bench.run(20 * MILLISECOND);
    bench.ok("255, 0, 0, 1234");
    bench.control("supply 24");
    bench.run(80 * MILLISECOND);
    assert_eq!(bench.module.board().borrow().tmc429(0).velocity(0), 0);
    // After the restart it does start by itself, and the module answers.
    bench.run(400 * MILLISECOND);
    assert_eq!((bench.ok("GAP 2, 0"), bench.ok("GGP 128, 0")), (500, 1));
    assert!(bench.ok("GGP 132, 0") < 500);
}
