//! Restarts of the very flash image: who brings them about, what is done before them, and what is known after them.

use std::ops::Range;

use common::image_host::{HANG, Host, LOADED, OK, START, UNDEFINED, code, decoded, image, symbol_in};
use common::telegram;
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos};
use object::read::elf::ElfFile32;
use object::{Endianness, Object, ObjectSymbol};

/// In this time a watchdog that is not fed any more has bitten.
const BITES: Nanos = 400 * MILLISECOND;
/// In this time the reset has come that was asked for, with its reply after the longest pause.
const ASKED: Nanos = 500 * MILLISECOND;

/// In this time the firmware has told why it has started.
const TOLD: Nanos = 10 * MILLISECOND;

/// Address of the code of the handler that is the owner's.
fn owner() -> u32 {
    code(symbol_in(image(), "TIM3"))
}

/// Puts other code in the place of the owner's; gives what was there.
fn patch(host: &mut Host, code: &[u8]) -> Vec<u8> {
    host.machine.cpu_mut().program(owner(), code).unwrap()
}

/// The watchdog bites because the owner runs into this code, which is taken back.
fn bitten(host: &mut Host, code: &[u8]) {
    let before = patch(host, code);
    host.reset_within(BITES);
    patch(host, &before);
}

/// Whether the log has a line with this text.
fn told(log: &[String], text: &str) -> bool {
    log.iter().any(|line| line.contains(text))
}

fn power_cycle(host: &mut Host) {
    host.machine.set_power(false);
    host.run(10 * MILLISECOND);
    host.machine.set_power(true);
    host.run(START);
}

// ---- The program ----

/// After a restart that nobody asked for no program starts by itself, whatever parameter 77 says; after one that was
/// asked for it does again.
#[test]
fn a_program_does_not_start_by_itself_after_the_watchdog_or_a_fault() {
    let mut host = Host::new("");
    host.ok("132, 0, 0, 0");
    for line in ["SIO 0, 2, 1", "JA 1"] {
        assert_eq!(host.ask(line).0, LOADED, "{line}");
    }
    host.ok("133");
    host.ok("SGP 77, 0, 1");
    let runs = |host: &mut Host| {
        let output = host.machine.board().world().outputs().is_on(0);
        (output, host.ok("GGP 128, 0"))
    };
    power_cycle(&mut host);
    assert_eq!(runs(&mut host), (true, 1));
    for code in [HANG, UNDEFINED] {
        bitten(&mut host, &code);
        host.run(START);
        assert_eq!(runs(&mut host), (false, 0), "{code:x?}");
        host.ok("255, 0, 0, 1234");
        host.run(ASKED);
        assert_eq!(runs(&mut host), (true, 1), "asked for");
    }
}

// ---- The watchdog ----

/// The owner's interrupt does not come any more, while thread mode lives: the watchdog is not fed, and the log says who
/// was missed.
#[test]
fn the_watchdog_restarts_a_module_whose_owner_is_not_called_any_more() {
    // Switches interrupt 29, that of TIM3, off in NVIC_ICER0 and returns: MOVW, MOVT to R0, MOV to R1, STR, BX LR.
    const OFF: [u16; 8] = [0xF24E, 0x1080, 0xF2CE, 0x0000, 0xF04F, 0x5100, 0x6001, 0x4770];
    let mut host = Host::new("");
    bitten(&mut host, &OFF.map(u16::to_le_bytes).concat());
    host.run(START);
    let log = host.log();
    assert!(told(&log, "error: no sign of life: module, EEPROM, USB [false, true, true]"), "{log:?}");
    assert!(told(&log, "error: restarted by the watchdog: something hung"), "{log:?}");
    assert_eq!(host.ok("GAP 4, 0"), 1_000);
}

// ---- The note of a fault ----

/// Where the note is that a fault leaves behind.
fn note() -> Range<u32> {
    let elf = ElfFile32::<Endianness>::parse(image()).unwrap();
    let is_note = |name: &str| ["board", "fault", "NOTE"].iter().all(|word| name.contains(word));
    let symbol = elf.symbols().find(|symbol| symbol.name().is_ok_and(is_note)).unwrap();
    symbol.address() as u32..(symbol.address() + symbol.size()) as u32
}

/// A module that has noted a hard fault and waits for the watchdog; next time it is sound.
fn faulty() -> Host {
    let mut host = Host::new("");
    let before = patch(&mut host, &UNDEFINED);
    host.run(2 * MILLISECOND);
    patch(&mut host, &before);
    assert!(told(&host.log(), "error: hard fault at"));
    assert_eq!(host.machine.counters().starts, 1);
    host
}

/// Returns the lines of the log on a start, and whether LED2 is lit.
fn started(host: &mut Host) -> (Vec<String>, bool) {
    host.run(TOLD);
    assert_eq!(host.machine.counters().starts, 2);
    (host.log(), host.machine.board().world().outputs().leds[1])
}

/// A note is that of the reset which follows it. What power-on finds in memory is older.
#[test]
fn a_note_is_not_believed_after_power_on() {
    let mut host = faulty();
    host.machine.brown_out();
    let (log, trouble) = started(&mut host);
    assert!(told(&log, "info: power on") && !told(&log, "restarted") && !trouble, "{log:?}");
}

/// A bit that has changed, wherever it is in the note, and there is no note.
#[test]
fn a_damaged_note_is_not_believed() {
    let after = |damaged: Option<u32>| {
        let mut host = faulty();
        if let Some(place) = damaged {
            let word = host.machine.cpu().peek(place).unwrap();
            host.machine.cpu_mut().disturb(place, word ^ 0x100).unwrap();
        }
        host.reset_within(BITES);
        let (log, trouble) = started(&mut host);
        assert!(trouble);
        (told(&log, "error: restarted after a hard fault"), told(&log, "error: restarted by the watchdog"))
    };
    assert_eq!(after(None), (true, false));
    for place in note().step_by(4) {
        assert_eq!(after(Some(place)), (false, true), "{place:x}");
    }
}

// ---- The motor driver ----

/// Some instructions after each reset ENN is driven high, and stays so until the module has been set up. A pin that is
/// only pulled up is at the mercy of what is around it. In a fault it is driven, too.
#[test]
fn enn_is_driven_high_from_the_first_moment_of_each_start_and_in_a_fault() {
    type Reset = fn(&mut Host);
    let resets: [Reset; 4] = [
        |host| host.machine.brown_out(),
        |host| bitten(host, &HANG),
        |host| {
            host.machine.rs485().send(&telegram("255, 0, 0, 1234"), host.baud);
            host.reset_within(ASKED);
        },
        |host| {
            host.machine.set_power(false);
            host.run(10 * MILLISECOND);
            assert_eq!(host.machine.wiring().enable_pin(), None);
            host.machine.set_power(true);
        },
    ];
    for (n, reset) in resets.into_iter().enumerate() {
        let mut host = Host::new("");
        assert_eq!(host.machine.wiring().enable_pin(), Some(false));
        reset(&mut host);
        assert_eq!(host.machine.wiring().enable_pin(), None, "{n}");
        assert_eq!(host.machine.counters().starts, 2, "{n}");
        let took = host.wait(MICROSECOND, MILLISECOND, |host| host.machine.wiring().enable_pin() == Some(true));
        assert!(took <= 10 * MICROSECOND, "{n}: {took}");
        let on = host.wait(20 * MICROSECOND, START, |host| host.machine.wiring().enable_pin() != Some(true));
        assert_eq!(host.machine.wiring().enable_pin(), Some(false), "{n}: from driven to driven");
        assert!(on >= 10 * MILLISECOND, "{n}: the EEPROM has been read: {on}");
    }
    assert_eq!(faulty().machine.wiring().enable_pin(), Some(true));
}

/// A reset by command finds the driver off already, here without a resistor that would keep it so.
#[test]
fn the_driver_is_off_before_a_reset_by_command() {
    let mut host = Host::new("");
    host.ok("ROR 0, 500");
    host.machine.wiring().fit_enable_pull_up(false);
    host.machine.rs485().send(&telegram("255, 0, 0, 1234"), host.baud);
    host.run(20 * MILLISECOND);
    assert!(host.bridges_on(), "not before the reply is through");
    host.reset_within(ASKED);
    assert!(!host.bridges_on());
}

// ---- The last words ----

/// A reset by command waits for its reply, however long parameter 75 keeps that back.
#[test]
fn a_reset_by_command_waits_for_its_reply() {
    for pause in [0, 120, 255] {
        let mut host = Host::new("");
        host.ok(&format!("SGP 75, 0, {pause}"));
        let line = "255, 0, 0, 1234";
        let end = host.machine.rs485().send(&telegram(line), host.baud);
        host.reset_within(ASKED);
        let reply = host.machine.rs485().take_sent();
        let bytes: Vec<u8> = reply.iter().map(|character| character.value).collect();
        assert_eq!(decoded(line, &bytes), (OK, 1_234), "{pause}");
        assert!(reply[0].start + MILLISECOND >= end + pause * MILLISECOND, "{pause}");
        assert!(host.machine.now() < end + (pause + 200) * MILLISECOND, "{pause}: and no longer");
    }
}
