//! Sessions are done again: with the same numbers, here and in `tmcl test`.

use std::cell::Cell;
use std::path::Path;
use std::time::Duration;

use tmcm::tmcl::text;
use tmcm_sim::scenario::{self, Stand, Surroundings, run_case};
use tmcm_sim::{FirmwareKind, NativeModule, Product};

use super::*;
use crate::running::Running;
use crate::scope::Watched;
use crate::types::{Line, Outcome, Request, SampleRow, Ticket};
use crate::virtual_module::Virtual;

/// A page with a clock of its own: it goes on by so many nanoseconds with each look, which are no whole microseconds.
struct Desk {
    module: Virtual<NativeModule>,
    clock: Cell<u64>,
    tick: u64,
    rows: Vec<SampleRow>,
}

impl Desk {
    fn new(module: Virtual<NativeModule>, tick: u64, curves: &[String]) -> Self {
        let mut desk = Desk { module, clock: Cell::new(0), tick, rows: Vec::new() };
        desk.module.watch(&Watched { texts: curves.to_vec() });
        desk
    }

    fn turn(&mut self) -> crate::types::Turn {
        let (clock, tick) = (&self.clock, self.tick);
        let mut turn = self.module.turn(&|| {
            clock.set(clock.get() + tick);
            Duration::from_nanos(clock.get())
        });
        self.rows.append(&mut turn.rows);
        turn
    }

    fn send(&mut self, line: &str) -> Outcome {
        let Ticket { ticket } = self.module.ask(Request::new(1, text::parse(line).unwrap()));
        for _ in 0..100_000 {
            if let Some(finished) = self.turn().replies.pop() {
                assert_eq!(finished.ticket, ticket);
                return finished.outcome;
            }
        }
        panic!("no end of {line}");
    }

    fn control(&mut self, line: &str) {
        let at = Duration::from_nanos(self.clock.get());
        let Ticket { ticket } = self.module.control(&Line { line: line.into() }, at);
        for _ in 0..1_000_000 {
            if let Some(told) = self.turn().lines.into_iter().find(|told| told.ticket == Some(ticket)) {
                assert!(told.line.starts_with(r#"{"ok":true"#), "{line}: {}", told.line);
                return;
            }
        }
        panic!("no answer to {line}");
    }

    /// Lets time go by the clock, for so many turns.
    fn pass(&mut self, turns: usize) {
        (0..turns).for_each(|_| drop(self.turn()));
    }
}

/// The rows of a session that is done to its end.
pub(super) fn played(session: &Session) -> Vec<SampleRow> {
    let Session { start, done, until, curves, .. } = session.clone();
    let mut desk = Desk::new(Virtual::play(&Play { start, done, until }, Duration::ZERO).unwrap(), 1_000_003, &curves);
    desk.control("resume");
    while desk.turn().left != Some(0.0) {}
    desk.rows
}

fn curves_of(last: u8) -> Vec<String> {
    ["GAP 1, 0", "GAP 3, 0", "rotor 0", "lost_steps 0", "switches.left 0", "supply", "GAP 8, 0"]
        .map(String::from)
        .into_iter()
        .chain([format!("GAP 1, {last}"), format!("GAP 3, {last}"), format!("load {last}")])
        .collect()
}

/// Somebody uses a module: by commands, by hand, with a program, and in time that goes and that is held.
fn recorded(product: Product, last: u8) -> (Session, Vec<SampleRow>) {
    let short = product::short(product);
    let world = Some(String::from("[stage]\nleft = -20000\n"));
    let start = Start { product: short.into(), world, eeprom: None };
    let curves = curves_of(last);
    let mut desk = Desk::new(Virtual::start(&start, Duration::ZERO).unwrap(), 37_123, &curves);
    desk.pass(50);
    let speed = if product == Product::Tmcm3212 { 50_000 } else { 400 };
    desk.send(&format!("ROR 0, {speed}"));
    desk.pass(333);
    desk.send("GAP 1, 0");
    desk.control(&format!("load 0.25 {last}"));
    desk.send("GAP 207, 0");
    for line in ["132, 0, 0, 0", "CALC LOAD, 7", "AGP 9, 2", "ROL 0, 300", "WAIT TICKS, 0, 3", "JA 1", "133, 0, 0, 0"] {
        desk.send(line);
    }
    desk.send(&format!("MVP REL, {last}, 30000"));
    desk.pass(100);
    desk.send("129, 1, 0, 0");
    desk.pass(400);
    desk.control("pause");
    desk.control("step 40 ms");
    desk.send("GGP 9, 2");
    desk.control("press left");
    desk.control("at 3 ms release left");
    desk.control("run-until time > 900 max 1 s");
    desk.control("supply 20.5");
    desk.control("resume");
    desk.send("128, 0, 0, 0");
    desk.send(&format!("SAP 4, 0, {}", speed / 2));
    desk.send("STAP 4, 0");
    desk.control("send ROR 0, 100");
    desk.pass(200);
    desk.control("power off");
    // Nobody hears this.
    let Outcome::NoReply(_) = desk.send("ROR 0, 5") else { panic!("it has no power") };
    desk.pass(20);
    desk.control("power on");
    desk.pass(300);
    desk.send(&format!("MVP ABS, {last}, -4000"));
    desk.pass(900);
    desk.control("fault reply-drop 1");
    let Outcome::NoReply(_) = desk.send("ROL 0, 55") else { panic!("the reply is lost") };
    desk.pass(123);
    let Play { start, done, until } = desk.module.done().unwrap();
    let title = format!("What is done to a {}", product.name());
    (Session { session: VERSION, title, made: None, start, texts: Vec::new(), curves, done, until }, desk.rows)
}

fn products() -> impl Iterator<Item = (Product, u8)> {
    Product::ALL.into_iter().map(|product| (product, product.spec().axes - 1))
}

#[test]
fn what_was_done_is_done_again_with_the_same_numbers() {
    for (product, last) in products() {
        let (session, rows) = recorded(product, last);
        assert!(rows.iter().any(|row| row.values[0] != rows[0].values[0]), "{product:?} has moved");
        let text = serde_json::to_string(&session).unwrap();
        let read = read(&SessionText { text }).unwrap();
        assert_eq!(read.session, session);
        let Session { start, done, until, curves, .. } = session;
        // Another computer, at another pace; and one whose clock stands still for a while.
        for tick in [11_037, 900_101] {
            let play = Play { start: start.clone(), done: done.clone(), until };
            let mut desk = Desk::new(Virtual::play(&play, Duration::ZERO).unwrap(), tick, &curves);
            desk.pass(5);
            assert!(desk.rows.is_empty() && desk.turn().paused, "it waits until it is let go");
            desk.control("resume");
            while !desk.turn().paused {}
            desk.pass(20);
            assert_eq!(desk.rows.len(), rows.len(), "{product:?}: {until} us");
            for (row, same) in rows.iter().zip(&desk.rows) {
                assert_eq!(row, same, "{product:?}");
            }
            assert_eq!(desk.turn().left, Some(0.0));
            // What has been done again is what is done.
            assert_eq!(desk.module.done().unwrap(), play);
            desk.send("GAP 1, 0");
            assert_eq!(desk.turn().left, None, "somebody has taken over");
        }
    }
}

/// How the scenario of a session ends.
fn tested(text: &str) -> Result<(), String> {
    let assemble = |_: &Path, _| Err("there is no program".to_string());
    let (folder, product, firmware) = (Path::new("."), Product::Tmcm1140, FirmwareKind::Tmcl);
    let surroundings = Surroundings { folder, product, firmware, world: "", assemble: &assemble };
    let scenarios = scenario::read(text, &surroundings);
    let [scenario] = scenarios.as_slice() else { panic!("{text}") };
    let cases = scenario.cases.as_ref().map_err(|mistake| format!("{mistake:?}"))?;
    run_case(&cases[0], Stand::native(&cases[0])).map_err(|mistake| format!("{mistake:?}"))
}

#[test]
fn a_session_is_a_scenario() {
    for (product, last) in products() {
        let (session, _) = recorded(product, last);
        let SessionText { text } = write(&session).unwrap();
        tested(&text).unwrap_or_else(|why| panic!("{why}\n{text}"));
        assert!(text.contains("\n== What is done to a TMCM-") && text.contains("expect position = "), "{text}");
        // It would fail if something were not so.
        let other = text.replacen("control load 0.25", "control load 0.75", 1);
        assert_ne!(other, text);
        tested(&other).unwrap_err();
    }
}

/// A motor that turns as long as its host says something stands still in a scenario without what the host has read.
#[test]
fn readings_that_make_a_difference_stay() {
    let reading = |at| format!("{at}00000 GAP 5, 0");
    let begin = ["100000 SGP 68, 0, 500", "200000 ROR 0, 300"].map(String::from).into_iter();
    let session = Session {
        session: 1,
        title: String::new(),
        made: None,
        start: Start { product: "1140".into(), world: None, eeprom: None },
        texts: Vec::new(),
        curves: Vec::new(),
        done: begin.chain((4..30).map(reading)).collect(),
        until: 3_000_000,
    };
    let SessionText { text } = write(&session).unwrap();
    assert!(text.contains("expect velocity = 300\n") && text.contains("GAP 5, 0 -> 100 "), "{text}");
    tested(&text).unwrap();
    let without = Session { done: session.done[2..].to_vec(), ..session };
    let SessionText { text } = write(&without).unwrap();
    assert!(
        !text.contains("GAP") && text.contains("and are left out: 26.") && text.contains("expect position = 0"),
        "{text}"
    );
}

#[test]
fn a_session_has_no_more_than_fits() {
    let mut journal = Journal::default();
    let what = || What::parse("MST 0", &hal_sim::board::TMCM_1140).unwrap();
    (0..MOST_DEEDS as u64).for_each(|at| journal.note(at, what()));
    assert_eq!(journal.texts().unwrap().len(), MOST_DEEDS);
    journal.note(u64::MAX, what());
    assert!(journal.texts().unwrap_err().contains("write 'restart'"));
}

#[test]
fn a_session_begins_with_what_its_eeprom_had() {
    let start = Start { product: "3110".into(), world: None, eeprom: None };
    let curves = vec![String::from("GAP 4, 2")];
    let mut desk = Desk::new(Virtual::start(&start, Duration::ZERO).unwrap(), 50_001, &curves);
    desk.send("SAP 4, 2, 321");
    let before = desk.turn().stored;
    desk.send("STAP 4, 2");
    assert!(desk.turn().stored > before);
    let kept = desk.module.eeprom().eeprom;
    desk.control("restart");
    desk.pass(30);
    let Play { start, done, until } = desk.module.done().unwrap();
    assert_eq!((start.eeprom.as_ref(), done.len()), (Some(&kept), 0), "a restart begins anew");
    let session =
        Session { session: 1, title: String::new(), made: None, start, texts: Vec::new(), curves, done, until };
    let SessionText { text } = write(&session).unwrap();
    assert!(text.contains("== A session of the studio\n"));
    tested(&(text + "GAP 4, 2 -> 100 321\n")).unwrap();
}

#[test]
fn what_is_wrong_is_told() {
    let (session, _) = recorded(Product::Tmcm1140, 0);
    let told = |text: String| read(&SessionText { text }).unwrap_err();
    let with = |change: &dyn Fn(&mut Session)| {
        let mut other = session.clone();
        change(&mut other);
        told(serde_json::to_string(&other).unwrap())
    };
    let whole = serde_json::to_string(&session).unwrap();
    assert!(told(whole[..whole.len() / 2].into()).contains("or was cut off"));
    assert!(told(whole.replacen("1", "2", 1)).contains("of a later version of this page (2)"));
    assert!(told(r#"{"session":3,"other":[]}"#.into()).contains("of a later version"));
    assert!(told(r#"{"session":0}"#.into()).contains("version"));
    assert!(told("{}".into()).contains("no session of this page"));
    assert!(told("[".repeat(100_000)).contains("no session"));
    assert!(told(" ".repeat(8_000_001)).contains("8000001 bytes"));
    let line = |text: &str| vec![text.to_string()];
    for (change, why) in [
        (&(|session: &mut Session| session.start.product = "9999".into()) as &dyn Fn(&mut Session), "9999"),
        (&|session| session.start.world = Some("[motor]\nfrictoin = 1".into()), "the world: "),
        (&|session| session.start.world = Some("[axis.5]".into()), "the world: "),
        (&|session| session.start.eeprom = Some("ff".into()), "there are 1 bytes, and that of a TMCM-1140 has "),
        (&|session| session.start.eeprom = Some("gg".repeat(16_384)), "the EEPROM: "),
        (&|session| session.title = "x".repeat(101), "its title has 101 characters"),
        (&|session| session.title = "a\u{1b}b".into(), "its title has a control character"),
        (&|session| session.texts = vec![NamedText { name: String::new(), text: String::new() }], "has no name"),
        (&|session| session.texts = vec![NamedText { name: "a".into(), text: "x".repeat(1_000_001) }], "1000001 bytes"),
        (&|session| session.texts = vec![NamedText { name: "a".into(), text: "x".into() }; 101], "101 texts"),
        (&|session| session.curves = line("GAP 1, 5"), "no axis 5"),
        (&|session| session.curves = vec!["rotor 0".into(); 13], "13 curves are too many"),
        (&|session| session.done = line("5 press left 3"), "number 1: no axis 3"),
        (&|session| session.done = vec!["5 MST 0".into(), "4 MST 0".into()], "number 2, '4 MST 0', is before"),
        (&|session| session.done = vec!["0 MST 0".into(); 100_001], "100001 things"),
        (&|session| session.until = 86_400_000_001, "longer than a day"),
        (&|session| session.until = 5, "after its end at 5 us"),
    ] {
        let told = with(change);
        assert!(told.contains(why), "{why}: {told}");
    }
}

/// Numbers that look like chance, the same each time.
struct Chance(u64);

impl Chance {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

/// A text of which some letters are others, missing, or there twice; where a number stands, there may be another one.
fn changed(text: &str, chance: &mut Chance) -> String {
    let mut letters: Vec<char> = text.chars().collect();
    for _ in 0..=chance.below(3) {
        let at = chance.below(letters.len());
        let number = letters[at].is_ascii_digit();
        match chance.below(if number { 3 } else { 12 }) {
            _ if number => letters[at] = char::from(b'0' + chance.below(10) as u8),
            0 => drop(letters.splice(at..(at + chance.below(20)).min(letters.len()), [])),
            1 => letters[at] = char::from(32 + chance.below(95) as u8),
            2 => letters.insert(at, ['-', '9', '"', ',', '\u{0}', '\u{1F600}', '[', '{'][chance.below(8)]),
            _ => letters[at] = letters[chance.below(letters.len())],
        }
    }
    letters.into_iter().collect()
}

/// A session that anybody may send ends with words, or is done: nothing of it can end the page.
#[test]
fn ten_thousand_changed_sessions_end_with_words_or_are_done() {
    let (mut long, _) = recorded(Product::Tmcm3110, 2);
    // A short one of them, so that changes meet all of it.
    long.done = long.done.into_iter().filter(|deed| !deed.contains("GAP")).take(24).collect();
    long.texts = vec![NamedText { name: "a.tmc".into(), text: "#include \"b.inc\"\nROR 0, 5".into() }];
    long.made = Some(SessionMaker { version: "0.1.0".into(), hash: "0123".into() });
    let text = serde_json::to_string(&long).unwrap();
    let (mut chance, mut done, mut scenarios) = (Chance(42), 0, 0);
    for _ in 0..10_000 {
        let text = changed(&text, &mut chance);
        let Ok(SessionRead { session, .. }) = read(&SessionText { text }) else { continue };
        done += 1;
        let Session { start, done: deeds, until, curves, .. } = &session;
        let play = Play { start: start.clone(), done: deeds.clone(), until: *until };
        let mut desk = Desk::new(Virtual::play(&play, Duration::ZERO).unwrap(), 500_003, curves);
        desk.control("resume");
        // Where it lasts long, as much of it as a page does at once.
        for _ in 0..300 {
            if desk.turn().left == Some(0.0) {
                break;
            }
        }
        if done % 100 == 0 && *until < 10_000_000 {
            scenarios += 1;
            tested(&write(&session).unwrap().text).unwrap();
        }
    }
    assert!((1000..9000).contains(&done) && scenarios > 5, "{done} are done, {scenarios} as scenarios");
}
