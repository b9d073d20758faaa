//! Values of a module that are looked at past all links: what can be had is what a telegram would read, and costs
//! nothing.

use tmcm::param::AxisParameter;
use tmcm::tmcl::{Command, Opcode, Status};
use tmcm_sim::{FirmwareKind, Model, Product, VirtualModule};

use super::rig::{HOST, Paused, replies};

/// Status and value of the reply to a command over USB, and how many datagrams that took.
fn ask(paused: &mut Paused, command: Command) -> (u8, i32) {
    paused.fleet.hear_usb(HOST, &tmcm::tmcl::binary::encode_command(1, command));
    paused.serve();
    let bytes: Vec<u8> = paused.sent().into_iter().flat_map(|sent| sent.bytes).collect();
    let [reply] = replies(&bytes)[..] else { panic!("{command:?}: {bytes:?}") };
    (reply.status, reply.value)
}

/// How many datagrams there have been, and what time it is by the module's clock.
fn spent(paused: &mut Paused) -> (u64, u64) {
    let module = &paused.fleet.modules()[0];
    let board = module.board().borrow();
    (board.kind().motion_bus().map(|chip| board.datagrams(chip)).sum(), board.now())
}

#[test]
fn what_can_be_looked_at_is_what_a_telegram_reads() {
    let mut dear = Vec::new();
    for product in Product::ALL {
        let mut paused = Paused::of(Model::Tmcl(product), 1);
        let each = |kind| {
            [(Opcode::Gap, 0), (Opcode::Ggp, 0), (Opcode::Ggp, 2), (Opcode::Gio, 0), (Opcode::Gio, 1), (Opcode::Gio, 2)]
                .map(|(opcode, motor)| (opcode, kind, motor))
        };
        for (opcode, kind, motor) in (0..=255).flat_map(each).chain([(Opcode::Rfs, 2, 0)]) {
            let command = Command::new(opcode as u8, kind, motor, 0);
            let before = spent(&mut paused);
            let seen = paused.fleet.modules_mut()[0].peek(command);
            assert_eq!(spent(&mut paused), before, "{product:?}: {command:?} costs something");
            // The module is polled meanwhile, but not between this and its execution.
            let (status, value) = ask(&mut paused, command);
            match seen {
                Ok(seen) if (opcode, kind) == (Opcode::Ggp, 132) => assert!(value - seen <= 1, "the clock goes on"),
                Ok(seen) => assert_eq!((100, seen), (status, value), "{product:?}: {command:?}"),
                Err(why) if why.contains("does not read") => {
                    let meaning = Status::from_number(status).unwrap().meaning();
                    assert_eq!(why, format!("the module does not read this: {meaning}"));
                }
                Err(why) => {
                    assert_eq!(status, 100, "{product:?}: {command:?}: {why}");
                    dear.push((product, opcode as u8, kind, why));
                }
            }
        }
    }
    // What is refused would cost something, or change something, on at least one product.
    let is_dear = |product: Product, number| dear.iter().any(|(of, _, kind, _)| *of == product && *kind == number);
    for (number, function) in [(1, AxisParameter::ActualPosition), (3, AxisParameter::ActualSpeed)] {
        assert!(Product::ALL.iter().all(|product| is_dear(*product, number)), "{function:?}");
    }
    assert!(dear.iter().any(|(.., why)| why.contains("use 'position' of the world")));
    assert!(dear.iter().any(|(.., why)| why.contains("clears what it reads")));
    assert!(dear.iter().any(|(.., why)| why.contains("changes what it reads")));
}

#[test]
fn only_what_costs_a_datagram_or_changes_is_refused() {
    for product in Product::ALL {
        let mut paused = Paused::of(Model::Tmcl(product), 1);
        for number in 0..=255 {
            let command = Command::new(Opcode::Gap as u8, number, 0, 0);
            let Err(why) = paused.fleet.modules_mut()[0].peek(command) else { continue };
            if !why.contains("datagram") || number == 2 {
                // The target speed is in memory in one of the two modes.
                continue;
            }
            let module = &mut paused.fleet.modules_mut()[0];
            let datagrams = |module: &tmcm_sim::NativeModule| {
                let board = module.board().borrow();
                board.kind().motion_bus().map(|chip| board.datagrams(chip)).sum::<u64>()
            };
            let before = datagrams(module);
            module.read(command);
            assert!(datagrams(module) > before, "{product:?}: {number} is in memory");
        }
    }
}

#[test]
fn the_reason_for_which_nothing_is_seen_says_what_to_use() {
    let look = |paused: &mut Paused, line: &str| {
        paused.fleet.modules_mut()[0].peek(tmcm::tmcl::text::parse(line).unwrap()).unwrap_err()
    };
    let mut paused = Paused::of(Model::Tmcl(Product::Tmcm6110), 1);
    let position = "'GAP 1, 2' would cost the module a datagram to a chip: use 'position 2' of the world";
    assert_eq!(look(&mut paused, "GAP 1, 2"), position);
    assert!(look(&mut paused, "MVP REL, 0, 5").contains("only GAP, GGP, GIO"));
    assert!(look(&mut paused, "GAP 4, 6").contains("out of range"));
    paused.control("power off");
    assert!(look(&mut paused, "GAP 4, 0").contains("no power"));
    let mut paused = Paused::of(FirmwareKind::Canopen, 1);
    assert!(look(&mut paused, "GAP 4, 0").contains("use what the world shows"));
}
