//! The supply fails at every byte that the EEPROM exchanges during a download, and while a program is erased
//! because the protection against reading it is switched off. A half-finished download never runs as if whole,
//! what has been hidden is never seen, and the settings stay as they were.

use common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::{Command, Opcode, text};
use tmcm_sim::{Product, VirtualModule};

/// Commands of each program: 224 bytes, so that they end within their fourth page.
const LENGTH: u16 = 32;

/// A program that leaves its mark in user variable 10; the rest is padding that differs, too.
fn program(mark: i32) -> Vec<Command> {
    let mut lines = vec![format!("SGP 10, 2, {mark}")];
    lines.extend((1..LENGTH - 1).map(|n| format!("SGP {}, 2, {mark}", 100 + n)));
    lines.push("STOP".into());
    lines.iter().map(|line| text::parse(line).unwrap()).collect()
}

fn control(opcode: Opcode, value: i32) -> Command {
    Command::new(opcode as u8, 0, 0, value)
}

/// Returns the commands that bring a program into the module.
fn download(mark: i32) -> Vec<Command> {
    let mut commands = vec![control(Opcode::EnterDownload, 0)];
    commands.extend(program(mark));
    commands.push(control(Opcode::ExitDownload, 0));
    commands
}

/// Sends a command over RS485 and waits for the reply; `None` if the power goes before it comes.
fn exchange(bench: &mut Bench, command: Command) -> Option<Telegram> {
    bench.module.receive(Source::Rs485, binary::encode_command(1, command));
    let end = bench.module.now() + 1000 * MILLISECOND;
    while bench.module.now() < end {
        bench.run(100 * MICROSECOND);
        if command.opcode == Opcode::FactorySettings as u8 && bench.module.now() + 500 * MILLISECOND > end {
            // It is never answered.
            return None;
        }
        if !bench.module.board().borrow().is_powered() {
            return None;
        }
        if let Some(sent) = bench.module.sent() {
            return sent.telegram();
        }
    }
    panic!("no answer to {command}");
}

fn send(bench: &mut Bench, line: &str) -> (u8, i32) {
    let reply = binary::decode_reply(&exchange(bench, text::parse(line).unwrap()).unwrap()).unwrap();
    (reply.status, reply.value)
}

/// An EEPROM of a TMCM-1140 with a program that starts by itself, after these lines.
fn prepared(lines: &[&str]) -> Vec<u8> {
    prepared_in(Product::Tmcm1140, lines)
}

/// The same of any product.
fn prepared_in(product: Product, lines: &[&str]) -> Vec<u8> {
    let mut bench = Bench::of(product);
    bench.run(MILLISECOND);
    for command in download(1) {
        assert!(exchange(&mut bench, command).is_some());
    }
    for line in ["SGP 77, 0, 1", "SGP 55, 2, 1234", "STGP 55, 2"].iter().chain(lines) {
        assert_eq!(send(&mut bench, line).0, OK, "{line}");
    }
    bench.eeprom()
}

/// Runs the script on a TMCM-1140 with a cut after each byte in turn, or after some. `check` sees the module after the
/// restart and how many commands have been answered.
fn cut_everywhere(
    eeprom: &[u8],
    script: &[Command],
    stride: usize,
    check: impl FnMut(&mut Bench, usize, &str),
) -> usize {
    cut_everywhere_in(Product::Tmcm1140, eeprom, script, stride, check)
}

/// The same on any product.
fn cut_everywhere_in(
    product: Product,
    eeprom: &[u8],
    script: &[Command],
    stride: usize,
    mut check: impl FnMut(&mut Bench, usize, &str),
) -> usize {
    let mut cuts = 0;
    let bytes = |bench: &Bench| bench.module.board().borrow().eeprom_bytes();
    let mut rehearsal = Bench::resumed_as(product, eeprom, 1);
    let first = bytes(&rehearsal);
    for command in script {
        exchange(&mut rehearsal, *command);
    }
    let last = bytes(&rehearsal);
    for byte in (first..=last).step_by(stride) {
        cuts += 1;
        let what = format!("cut after byte {} of {}", byte - first, last - first);
        // Each seed tears a page in another way.
        let mut bench = Bench::resumed_as(product, eeprom, byte as u32);
        bench.module.board().borrow_mut().cut_power_at_byte(byte + 1);
        let answered = script.iter().take_while(|command| exchange(&mut bench, **command).is_some()).count();
        bench.module.set_power(false);
        bench.module.board().borrow_mut().cut_power_at_byte(u64::MAX);
        bench.module.set_power(true);
        bench.run(10 * MILLISECOND);
        check(&mut bench, answered, &what);
    }
    cuts
}

fn settings_are_there(bench: &mut Bench, what: &str) {
    assert_eq!(send(bench, "GGP 55, 2"), (OK, 1234), "{what}");
    assert_eq!(send(bench, "GGP 77, 0"), (OK, 1), "{what}");
}

/// Returns the commands that program memory shows.
fn memory(bench: &mut Bench) -> Vec<Command> {
    let show = |address: u16| {
        let reply = exchange(bench, control(Opcode::ReadMemory, address.into())).unwrap();
        Command::from_bytes(*reply[1..].first_chunk().unwrap())
    };
    (0..LENGTH).map(show).collect()
}

fn empty() -> Vec<Command> {
    vec![Command::default(); LENGTH.into()]
}

#[test]
fn a_download_is_the_old_program_the_new_one_or_none() {
    let script = download(2);
    for product in [Product::Tmcm1140, Product::Tmcm3212, Product::Tmcm6110] {
        let mut seen = [0; 3];
        let eeprom = prepared_in(product, &[]);
        let cuts = cut_everywhere_in(product, &eeprom, &script, 1, |bench, answered, what| {
            let (mark, memory, run) = (send(bench, "GGP 10, 2").1, memory(bench), send(bench, "129, 0, 0, 0").0);
            match mark {
                0 => {
                    assert_eq!(run, 6, "{what}: an incomplete program does not run");
                    assert_eq!(memory, empty(), "{what}");
                    assert!(answered < script.len(), "{what}: the end was acknowledged");
                }
                1 => {
                    assert_eq!(memory, program(1), "{what}");
                    assert_eq!((answered, run), (0, OK), "{what}: the start was acknowledged");
                }
                _ => {
                    assert_eq!(memory, program(2), "{what}");
                    assert!(answered >= script.len() - 1 && run == OK, "{what}: not all was sent");
                }
            }
            settings_are_there(bench, what);
            seen[mark as usize] += 1;
        });
        println!(
            "{}: {cuts} power cuts during a download: {seen:?} times none, the old and the new program",
            product.name()
        );
        assert!(seen.iter().all(|times| *times > 0), "{seen:?}");
    }
}

/// A download that was cut short can be repeated, and then all is well.
#[test]
fn a_download_after_a_download_cut_short() {
    let script = download(2);
    cut_everywhere(&prepared(&[]), &script, 1, |bench, answered, what| {
        if !(1..script.len()).contains(&answered) || answered % 5 != 0 {
            return;
        }
        for command in download(3) {
            exchange(bench, command).unwrap();
        }
        bench.power_cycle();
        bench.run(10 * MILLISECOND);
        assert_eq!((send(bench, "GGP 10, 2").1, memory(bench)), (3, program(3)), "{what}");
    });
}

/// Switching the protection off is done, or it has not begun.
#[test]
fn taking_the_protection_off_never_shows_the_program() {
    let script = [text::parse("SGP 81, 0, 0").unwrap()];
    let mut kept = 0;
    let cuts = cut_everywhere(&prepared(&["SGP 81, 0, 1"]), &script, 1, |bench, answered, what| {
        let ran = send(bench, "GGP 10, 2").1 == 1;
        let stays = hidden_or_gone(bench, what);
        assert!(ran == stays && !(stays && answered == 1), "{what}");
        settings_are_there(bench, what);
        kept += u64::from(stays);
    });
    println!("{cuts} power cuts while a protected program is erased, {kept} before it was decided");
    assert!(cuts > 500 && kept > 50, "{cuts} {kept}");
}

/// A factory reset takes the protection off, too: the program goes with it.
#[test]
fn a_factory_reset_never_shows_the_program() {
    let script = [text::parse("137, 0, 0, 1234").unwrap()];
    let mut kept = 0;
    // Most of the bytes are read, after the restart.
    let cuts = cut_everywhere(&prepared(&["SGP 81, 0, 1"]), &script, 11, |bench, _, what| {
        let stays = hidden_or_gone(bench, what);
        if stays {
            settings_are_there(bench, what);
        } else {
            assert_eq!(send(bench, "GGP 55, 2"), (OK, 0), "{what}");
            assert_eq!(send(bench, "GGP 77, 0"), (OK, 0), "{what}");
        }
        kept += u64::from(stays);
    });
    println!("{cuts} power cuts during the factory reset of a protected module, {kept} before it was decided");
    assert!(cuts > 500 && kept > 5, "{cuts} {kept}");
}

/// Checks that the program is not seen; then it is protected still (true), or gone for good.
fn hidden_or_gone(bench: &mut Bench, what: &str) -> bool {
    assert_eq!(memory(bench), empty(), "{what}: the program is seen");
    // Erasing goes on after the restart.
    bench.run(200 * MILLISECOND);
    assert_eq!(memory(bench), empty(), "{what}: the program is seen later");
    let stays = send(bench, "GGP 81, 0").1 != 0;
    let blank = bench.eeprom()[..usize::from(LENGTH) * 7].iter().all(|byte| *byte == 0xFF);
    assert_eq!(blank, !stays, "{what}: what is left in the EEPROM");
    stays
}
