//! Random telegrams and frames over all links of a virtual module; each reply is checked against its request.

use crate::random::Random;
use crate::row::Row;
use crate::table::{Table, tables};
use crate::{Bench, OK, telegram};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm::can::{CanFrame, Frame};
use tmcm::module::Source;
use tmcm::tmcl::binary::{self, Telegram};
use tmcm::tmcl::can;
use tmcm::tmcl::{Command, Status, text};
use tmcm_sim::VirtualModule;
use tmcm_sim::client::Sent;

/// Commands that are not sent, because they leave the binary protocol (download, ASCII mode, boot loader) or restart
/// the module. Other tests cover them.
const EXCLUDED: [u8; 6] = [132, 133, 137, 139, 242, 255];

impl Random {
    /// A value within the ranges of a parameter, or just outside them.
    fn value_for(&mut self, row: &Row) -> i32 {
        let (low, high) = self.pick(row.ranges);
        match self.below(4) {
            0 => self.pick(&[low, high]),
            1 => self.pick(&[low.wrapping_sub(1), high.wrapping_add(1)]),
            _ => (i64::from(low) + self.below((i64::from(high) - i64::from(low)) as u64 + 1) as i64) as i32,
        }
    }

    /// A valid command, or one that is nearly valid, for a product with these tables.
    fn sensible(&mut self, tables: &[Table]) -> Command {
        let [axes @ .., global, interrupt] = tables else { panic!("there are tables") };
        match self.below(4) {
            0 => {
                let row = self.pick(axes[0].rows);
                let axis = self.below(axes.len() as u64) as u8;
                Command::new(self.pick(&[5, 5, 5, 6, 7, 8, 34]), row.number, axis, self.value_for(&row))
            }
            1 => {
                let row = self.pick(global.rows);
                Command::new(self.pick(&[9, 9, 10, 35]), row.number, 0, self.value_for(&row))
            }
            2 => {
                let row = self.pick(interrupt.rows);
                let variable = self.below(60) as u8;
                let (kind, bank) = self.pick(&[(variable, 2), (row.number, 3)]);
                Command::new(self.pick(&[9, 10, 11, 12, 35]), kind, bank, self.value_for(&row))
            }
            _ => {
                let opcode = self.pick(&[1, 2, 3, 4, 4, 4, 13, 14, 15, 19, 30, 31, 32, 33, 36, 38, 39, 135, 136, 138]);
                let last = axes.len() as u8 - 1;
                let motor = self.pick(&[0, 0, 0, last, 1, 2, 6, 0x43, 0x47, 0x83, 0x87, 0xBF, 255]);
                let value = self.pick(&[0, 0, 1, 1, 3, 20, -1, 500, -900, 4000]);
                Command::new(opcode, self.pick(&[0, 0, 1, 1, 2, 3, 7, 20, 255]), motor, value)
            }
        }
    }

    /// Any command that is not excluded.
    fn command(&mut self, tables: &[Table]) -> Command {
        loop {
            let command = match self.below(4) {
                0 => {
                    let [a, b, c, d, ..] = self.next().to_be_bytes();
                    Command::new(a, b, c & d & 7, self.next() as i32)
                }
                _ => self.sensible(tables),
            };
            if !EXCLUDED.contains(&command.opcode) {
                return command;
            }
        }
    }

    /// The number `usual`, or once in twenty times any number below `limit`.
    fn or_any(&mut self, usual: i32, limit: u64) -> i32 {
        if self.below(20) == 0 { self.below(limit) as i32 } else { usual }
    }
}

/// A request over one of the links.
enum Request {
    Telegram(Source, Telegram),
    Frame(Frame),
}

/// A reply or event over one of the links.
#[derive(Debug)]
struct Answer {
    source: Source,
    /// The data of a frame; of a telegram the bytes that a frame would carry as its data.
    content: Vec<u8>,
}

impl Answer {
    fn is_event(&self) -> bool {
        self.content[1..3] == [Status::PositionReached as u8, 138]
    }
}

const CAN: Source = Source::Can;

fn answer_of(bench: &Bench, sent: &Sent) -> Answer {
    let telegram = sent.telegram().unwrap_or_else(|| panic!("{sent:?}"));
    let version = telegram[1..] == bench.product().spec().version_string();
    assert!(version || binary::decode_reply(&telegram).is_some(), "{sent:02X?}");
    Answer { source: sent.source, content: telegram[1..if version { 9 } else { 8 }].to_vec() }
}

/// Takes all replies and events up to the first that is `wanted`, or for 400 ms of virtual time. That is enough for a
/// telegram pause of 255 ms and the writing of a few EEPROM pages.
fn answers(bench: &mut Bench, wanted: impl Fn(&Answer) -> bool) -> Vec<Answer> {
    let mut answers = Vec::new();
    for _ in 0..400 {
        bench.run(MILLISECOND);
        while let Some(sent) = bench.module.sent() {
            answers.push(answer_of(bench, &sent));
        }
        let frames = std::iter::from_fn(|| bench.module.frame());
        answers.extend(frames.map(|frame| Answer { source: CAN, content: frame.data().to_vec() }));
        if answers.iter().any(&wanted) {
            break;
        }
    }
    answers
}

/// Sends a command over USB, where the module ignores the address, and gives the value of the reply if the command
/// succeeds. Events may come before the reply.
pub fn ask(bench: &mut Bench, line: &str) -> Option<i32> {
    bench.module.receive(Source::Usb, telegram(line));
    let asked = text::parse(line).unwrap().opcode;
    let success = |answer: &Answer| {
        let [_, status, opcode, value @ ..] = *answer.content.first_chunk::<7>()?;
        let good = answer.source == Source::Usb && (status, opcode) == (OK, asked);
        good.then_some(i32::from_be_bytes(value))
    };
    answers(bench, |answer| success(answer).is_some()).iter().find_map(success)
}

/// A host that sends random requests over all links and checks each reply.
struct Bombardment<'a> {
    bench: &'a mut Bench,
    random: &'a mut Random,
    tables: &'a [Table],
    /// Time until which the module may take a request for the reply of another module, and not answer.
    doubtful: Nanos,
}

/// Sends `count` random telegrams.
pub fn bombard(bench: &mut Bench, random: &mut Random, count: usize) {
    let tables = &tables(bench.product());
    let mut bombardment = Bombardment { bench, random, tables, doubtful: 0 };
    (0..count).for_each(|_| bombardment.send());
}

impl Bombardment<'_> {
    /// The value of a global parameter; 0 if the product has no such one.
    fn global(&mut self, number: u8) -> i32 {
        let exists = self.bench.product().spec().global.find(number).is_some();
        let asked = exists.then(|| ask(self.bench, &format!("GGP {number}, 0")));
        asked.map_or(0, |value| value.unwrap_or_else(|| panic!("GGP {number} is always answered")))
    }

    fn send(&mut self) {
        let suppressed = self.global(255) != 0;
        if suppressed && self.random.below(4) == 0 {
            return assert_eq!(ask(self.bench, "SGP 255, 0, 0"), None);
        }
        let can = self.random.below(3) == 0;
        // Global parameters with the module's address, its second address, and the address of replies.
        let [own, second, host] = if can { [71, 83, 70] } else { [66, 87, 76] };
        if self.random.below(20) == 0 {
            let address = self.global(own);
            let towards = self.random.pick(&[address, address % 2 + 1]);
            ask(self.bench, &format!("SGP {host}, 0, {towards}"));
        }
        let [own, second, host] = [own, second, host].map(|number| self.global(number));

        let command = self.random.command(self.tables);
        let to = self.random.or_any(own, if can { 2048 } else { 256 });
        let (request, valid) = if can {
            let mut data = can::encode_command(command);
            data.truncate(self.random.or_any(8, 9) as usize);
            let valid = data.len() >= 7;
            (Request::Frame(Frame::standard(to as u16, &data).unwrap()), valid)
        } else {
            let mut telegram = binary::encode_command(to as u8, command);
            telegram[8] = telegram[8].wrapping_add(self.random.or_any(0, 256) as u8);
            let source = self.random.pick(&[Source::Usb, Source::Rs485]);
            (Request::Telegram(source, telegram), binary::decode_command(&telegram).is_some())
        };
        let source = if let Request::Telegram(source, _) = request { source } else { CAN };
        let for_others = source != Source::Usb && to != own && (to != second || second == 0);
        let known = Status::from_number(command.kind).is_some();
        let to_host = source != Source::Usb && to == host;
        let looks_like_a_reply = to_host && known && (4..255).contains(&command.motor);
        // With several axes there are motors, and sets of axes, with numbers of commands.
        let axes = self.bench.product().spec().axes;
        let a_motor = (4..axes).contains(&command.motor) || axes > 1 && command.opcode == 4 && command.motor >= 0x40;
        let doubtful = to_host && (a_motor || self.bench.module.now() < self.doubtful);
        if for_others && (!valid || [0, 1, 2, 3, 134, 136, 255].contains(&command.opcode)) {
            self.doubtful = self.bench.module.now() + SECOND;
        }
        let reads = [6, 10, 15].contains(&command.opcode);
        let silent = match valid {
            true => for_others || looks_like_a_reply || suppressed && !reads,
            false => can || for_others || looks_like_a_reply,
        };
        let shown = format!("{command} to {to}, valid: {valid}, over {source:?}");
        match request {
            Request::Telegram(source, telegram) => self.bench.module.receive(source, telegram),
            Request::Frame(frame) => self.bench.module.receive_frame(frame),
        }
        // An event may come before the answer.
        let mut answers = answers(self.bench, |answer| !answer.is_event());
        answers.retain(|answer| !answer.is_event());
        assert!(doubtful || answers.is_empty() == silent, "{answers:?} to {shown}");
        answers.iter().for_each(|answer| check(self.bench, answer, source, command, valid, &shown));
    }
}

/// Asserts that an answer is the reply to the request.
fn check(bench: &Bench, answer: &Answer, source: Source, command: Command, valid: bool, shown: &str) {
    assert_eq!(answer.source, source, "{shown}");
    if bench.product().spec().version_string().starts_with(&answer.content) {
        return assert!(valid && (command.opcode, command.kind) == (136, 0), "{shown}");
    }
    let [_, status, opcode, value @ ..] = *answer.content.first_chunk::<7>().unwrap();
    match Status::from_number(status) {
        None => panic!("{answer:?} to {shown}"),
        Some(Status::WrongChecksum) => assert!(!valid && opcode == 0 && value == [0; 4], "{shown}"),
        Some(_) => assert!(valid && opcode == command.opcode, "{answer:?} to {shown}"),
    }
}

/// Asserts that every parameter is within its ranges, also after a restart with the stored values.
pub fn assert_sane(bench: &mut Bench) {
    // Position-reached events are switched off, so that they do not mix with the replies.
    ask(bench, "138, 0, 0, 0");
    // Nothing else could be stored.
    ask(bench, "SGP 73, 0, 4321");
    // The module must not start in ASCII mode.
    ask(bench, "SGP 67, 0, 0");
    // A heartbeat could stop the motor between two requests of this host.
    ask(bench, "SGP 68, 0, 0");
    ask(bench, "SGP 82, 0, 0");
    let tables = tables(bench.product());
    for restarted in [false, true] {
        for table in &tables {
            for row in table.rows {
                let value = table.value(bench, row);
                assert!(row.accepts(value), "{} is {value}, restarted: {restarted}", row.name);
            }
        }
        bench.power_cycle();
    }
    // The module still carries out commands.
    for (axis, table) in tables[..tables.len() - 2].iter().enumerate() {
        for row in [4, 5, 130, 153, 154, 181, 212, 213, 218].into_iter().filter_map(|number| table.row(number)) {
            table.set(bench, row, row.default().unwrap());
        }
        // The motor may be beyond its stop switches.
        for switch in [12, 13] {
            bench.ok(&format!("SAP {switch}, {axis}, 1"));
        }
        bench.ok(&format!("MVP REL, {axis}, 1000"));
        bench.run_until(3 * SECOND, |b| b.ok(&format!("GAP 8, {axis}")) == 1);
    }
}
