//! The memory that the image takes up: flash, statics, stack.

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use object::{Object, ObjectSection, SectionFlags, elf};
use tmcm::canopen::ROWS;
use tmcm::tmcl::{Opcode, binary};
use tmcm_sim::image;

use super::host::{Failure, Host, Link, SLOW, command};
use super::master::{GO_OPERATIONAL, HOMING, Master, PDOS, POSITION, VELOCITY, upload};
use super::report::Report;
use super::statistics::grouped;

/// Bytes.
#[derive(Debug, Default)]
pub(crate) struct Memory {
    pub(crate) flash: u64,
    pub(crate) statics: u64,
    /// Most of the stack that was in use, after the start and after a session.
    pub(crate) stack: [u64; 2],
}

/// Time for a character and its echo, and for a line's reply, at 9600 bit/s.
const CHARACTER: Nanos = 5 * MILLISECOND;
const LINE: Nanos = 50 * MILLISECOND;

/// Where RAM begins.
const RAM: u64 = 0x2000_0000;

/// Sets of PDOs in each mode.
const CYCLES: i32 = 50;
/// Method of homing: the left switch.
const LEFT_SWITCH: u8 = 17;
/// Bit of the statusword: the home position is found.
const ATTAINED: u32 = 1 << 12;
/// The value of 1023h.2 after a command that was executed.
const EXECUTED: u32 = 1;

/// A stage with both switches, for the search.
const STAGE: &str = "[stage]\nleft = -20000\nleft_width = 2049\nright = 20000\nright_width = 2049";

/// Takes the measure of an image that speaks TMCL.
pub(crate) fn measure(elf: &[u8], title: &str, report: &mut Report) -> Result<Memory, Failure> {
    let mut memory = sections(elf)?;
    let mut host = Host::in_world(elf, STAGE)?;
    memory.stack[0] = host.machine.stack_used().into();
    session(&mut host, image::model(elf)?.unwrap_or_default().product().spec().lacks)?;
    memory.stack[1] = host.machine.stack_used().into();
    memory.show(title, "a session on all links: program, storing, search, ASCII where there is that", report);
    Ok(memory)
}

/// Takes the measure of the image that is a node of CANopen.
pub(crate) fn measure_canopen(elf: &[u8], report: &mut Report) -> Result<Memory, Failure> {
    let mut memory = sections(elf)?;
    let mut master = Master::in_world(elf, STAGE)?;
    memory.stack[0] = master.machine.stack_used().into();
    canopen_session(&mut master)?;
    memory.stack[1] = master.machine.stack_used().into();
    memory.show("CANopen: memory", "a session: all objects, PDOs, modes, homing, storing, TMCL mode, USB", report);
    Ok(memory)
}

impl Memory {
    fn show(&self, title: &str, session: &str, report: &mut Report) {
        report.title(title);
        let row = |name: &str, bytes: u64| [name.to_owned(), grouped(bytes)];
        let rows = [
            row("flash", self.flash),
            row("static RAM", self.statics),
            row("stack, most in use after the start", self.stack[0]),
            row(&format!("stack, most in use after {session}"), self.stack[1]),
        ];
        report.table(["", "bytes"], &rows);
    }
}

/// Flash and statics. Initialised data count twice: in RAM, and in flash, where they are copied from.
fn sections(elf: &[u8]) -> Result<Memory, Failure> {
    let mut memory = Memory::default();
    for section in object::File::parse(elf)?.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else { continue };
        if sh_flags & u64::from(elf::SHF_ALLOC) == 0 {
            continue;
        }
        if section.address() < RAM {
            memory.flash += section.size();
        } else {
            memory.statics += section.size();
            if section.name() == Ok(".data") {
                memory.flash += section.size();
            }
        }
    }
    Ok(memory)
}

/// Everything once, on all links, but the commands that the product lacks.
fn session(host: &mut Host, lacks: &[Opcode]) -> Result<(), Failure> {
    host.plug_usb()?;
    for link in [Link::Rs485, Link::Can, Link::Usb] {
        for line in ["GAP 1, 0", "GGP 66, 0", "SAP 4, 0, 1200", "STAP 4, 0", "RSAP 4, 0", "STGP 1, 2", "GIO 0, 1"] {
            if !lacks.iter().any(|lacked| command(line).is_ok_and(|command| command.opcode == *lacked as u8)) {
                host.tell(link, line)?;
            }
        }
        for line in ["ROR #, 500", "MVP ABS, #, 5000", "MVP REL, #, -100", "MST #", "SCO 1, #, 7", "MVP COORD, #, 1"] {
            host.tell_each(link, line)?;
        }
        let program = ["SGP 1, 2, 7", "CALC ADD, 1", "AGP 2, 2", "CSUB 5", "JA 1", "ROL 0, 100", "MST 0", "RSUB"];
        host.load(link, &program.map(str::to_owned))?;
        host.tell(link, "129, 0, 0, 0")?;
        host.run(100 * MILLISECOND)?;
        host.tell(link, "GAP 3, 0")?;
        host.tell(link, "128, 0, 0, 0")?;
        host.tell(link, "131, 0, 0, 0")?;
    }
    search(host)?;
    if lacks.contains(&Opcode::EnterAscii) { Ok(()) } else { ascii(host) }
}

fn search(host: &mut Host) -> Result<(), Failure> {
    host.tell_each(Link::Rs485, "SAP 193, #, 1")?;
    host.tell_each(Link::Rs485, "RFS START, #")?;
    let end = host.machine.now() + 20 * SECOND;
    while host.tell(Link::Rs485, "RFS STATUS, 0")? != 0 {
        if host.machine.now() > end {
            return Err("the reference search does not end".into());
        }
        host.run(100 * MILLISECOND)?;
    }
    Ok(())
}

fn ascii(host: &mut Host) -> Result<(), Failure> {
    host.tell(Link::Rs485, "139, 0, 0, 0")?;
    host.machine.rs485().take_sent();
    // Somebody types, and sees each character come back before the next: the bus is half duplex.
    for character in b"AGAP 4, 0\rABIN\r" {
        let now = host.machine.now();
        host.machine.rs485().send_at(now, &[*character], SLOW);
        host.run(if *character == b'\r' { LINE } else { CHARACTER })?;
    }
    let said: Vec<u8> = host.machine.rs485().take_sent().iter().map(|character| character.value).collect();
    let said = String::from_utf8_lossy(&said);
    if said.contains("BA 100 ") { Ok(()) } else { Err(format!("ASCII: {said:?}").into()) }
}

/// Everything once that a master can ask for.
fn canopen_session(master: &mut Master) -> Result<(), Failure> {
    for row in &ROWS {
        for index in row.first..=row.last {
            master.ask(upload(index, row.sub))?;
        }
    }
    master.machine.usb().plug(true);
    master.synchronise(PDOS as u16)?;
    master.command(GO_OPERATIONAL)?;
    for mode in [POSITION, VELOCITY, HOMING] {
        master.enable(mode)?;
        master.write(0x607A, 0, &5_000_i32.to_le_bytes())?;
        master.write(0x6098, 0, &[LEFT_SWITCH])?;
        master.write(0x6040, 0, &[0x1F, 0])?;
        for cycle in 0..CYCLES {
            master.send_all(if mode == HOMING { 0x1F } else { 0xF }, mode, 500 + cycle);
            master.run(2 * MILLISECOND)?;
        }
    }
    let end = master.machine.now() + 20 * SECOND;
    while master.read(0x6041, 0)? & ATTAINED == 0 {
        if master.machine.now() > end {
            return Err("homing does not end".into());
        }
        master.run(100 * MILLISECOND)?;
    }
    master.machine.usb().send(&binary::encode_command(1, command("136, 1, 0, 0")?));
    master.write(0x6040, 0, &[0, 0])?;
    master.write(0x1010, 1, b"save")?;
    master.run(SECOND)?;
    master.write(0x2700, 0, b"make")?;
    for line in ["GAP 1, 0", "SAP 4, 0, 1200", "ROR 0, 500", "MVP ABS, 0, 5000", "RFS START, 0", "RFS STOP, 0", "MST 0"]
    {
        let [a, b, c, d, e, f, g] = command(line)?.to_bytes();
        master.ask([0x21, 0x23, 0x10, 1, 7, 0, 0, 0])?;
        master.ask([0x01, a, b, c, d, e, f, g])?;
        master.run(20 * MILLISECOND)?;
        if master.read(0x1023, 2)? != EXECUTED {
            return Err(format!("TMCL mode: {line} is refused").into());
        }
    }
    Ok(())
}
