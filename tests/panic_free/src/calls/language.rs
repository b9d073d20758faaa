//! The language and the parameters.

use core::fmt::Write;
use core::hint::black_box as any;

use super::stand_ins::Paper;
use super::{command, now, text};
use tmcm::can::{CanFrame, Frame, Id, StandardId};
use tmcm::module::{Request, Source};
use tmcm::param::{AxisParameter, GlobalParameter, Interrupt, Row};
use tmcm::product::tmcm1140::{AXIS, GLOBAL};
use tmcm::tmcl::ascii::{self, Echo, Editor, Line};
use tmcm::tmcl::binary::{self, Framer, Telegram};
use tmcm::tmcl::{AxisSet, Command, Instruction, Opcode, Reply, Status, can, text};

#[inline(never)]
pub(super) fn language() {
    any(command().to_bytes());
    any(Command::from_bytes(any([0; _])));
    any(Status::from_number(any(0)).map(Status::meaning));
    any(Reply::echo(any(Status::Ok), command()).is_event());
    any(Instruction::numbered(any(0)).map(|instruction| instruction.opcode));
    any(AxisSet::of(any(0), any(0)).map(|set| (set.contains(any(0)), set.first())));
    let instruction = Opcode::from_number(any(0)).map(Opcode::instruction);
    any(instruction.map(|instruction| (instruction.required(), instruction.operands().len())));
    if let Ok(line) = core::str::from_utf8(text()) {
        any(Instruction::by_mnemonic(line));
        if let Err(error) = text::parse(line) {
            let _ = any(write!(Paper, "{error}"));
            any(error.usage().map(|instruction| instruction.opcode));
        }
    }

    let _ = any(write!(Paper, "{}", command()));

    any(Line::parse(text()));
    let reply = any(Reply::WRONG_CHECKSUM);
    any(ascii::letter(any(0)));
    any(ascii::encode_reply(any(0), any(0), &reply));
    let mut editor = Editor::new();
    any(&mut editor);
    let echo = any(Echo::from_parameter(any(0))).among_others(any([0; 2]), any(0));
    any(editor.push(any(0), any([0; 2]), echo));

    let telegram: Telegram = any([0; _]);
    any(binary::checksum(&telegram));
    any(binary::encode_command(any(0), command()));
    any(binary::decode_command(&telegram));
    any(binary::decode(&telegram));
    any(binary::encode_plain(any(0), any(0), any(Status::Ok), any(0), any(0)));
    any(binary::encode_reply(any(0), any(0), &reply));
    any(binary::decode_reply(&telegram).and_then(|reply| reply.status()));
    let mut framer = Framer::new();
    any(&mut framer);
    any(framer.push(any(0), now()));
    any(framer.opcode());
    any(framer.decode());
    framer.drop_first();
    framer.reset();
    any(&framer);

    any(can::decode_command(text()));
    let Some(frame) = any(Frame::standard(any(0), text())) else { return };
    any(Frame::received(any(Id::Standard(StandardId::ZERO)), any(false), any(0), any([0; _])));
    any(Frame::new_remote(any(Id::Standard(StandardId::ZERO)), any(0)));
    any((frame.is_extended(), frame.is_remote_frame(), frame.id(), frame.dlc(), frame.data().len(), frame.bytes()));
    any(can::decode(&any(frame)).map(|request| Request::Frame(request).origin(any(Source::Can))));
    any(can::encode_command(command()));
    any(can::reply_frame(any(StandardId::ZERO), any(StandardId::ZERO), any(0), &reply));
    any(can::encode_reply(any(StandardId::ZERO), any(0), &reply));
}

#[inline(never)]
pub(super) fn parameters() {
    let row = |row: &Row| _ = any((row.stored(), row.unit.symbol()));
    AXIS.rows.iter().for_each(|parameter| row(&parameter.row));
    let found = |row: Option<&Row>| any(row.map(|row| (row.accepts(any(0)), row.writable(), row.slot())));
    any((found(AXIS.find(any(0)).map(|p| &p.row)), found(AXIS.row(any(AxisParameter::MaximumSpeed)))));
    any((found(GLOBAL.find(any(0)).map(|p| &p.row)), found(GLOBAL.row(any(GlobalParameter::CanId)))));
    any((any(AxisParameter::MaximumSpeed).index(), any(GlobalParameter::CanId).index()));
    any((AXIS.defaults(), GLOBAL.defaults()));
    if let Some((numbered, index)) = Interrupt::find(any(0), any(0), any(0)) {
        any((numbered.number(index), numbered.per.count(any(0), any(0)), any(Interrupt::Input).first()));
    }
}
