//! What the image takes up: flash, statics, stack.

use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use object::{Object, ObjectSection, SectionFlags, elf};

use super::host::{Failure, Host, Link, SLOW};
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

/// A stage with both switches, for the search.
const STAGE: &str = "[stage]\nleft = -20000\nleft_width = 2049\nright = 20000\nright_width = 2049";

/// Takes the image's measure.
pub(crate) fn measure(elf: &[u8], report: &mut Report) -> Result<Memory, Failure> {
    let mut memory = sections(elf)?;
    let mut host = Host::in_world(elf, STAGE)?;
    memory.stack[0] = host.machine.stack_used().into();
    session(&mut host)?;
    memory.stack[1] = host.machine.stack_used().into();
    report.title("Memory");
    let row = |name: &str, bytes: u64| [name.to_owned(), grouped(bytes)];
    let rows = [
        row("flash", memory.flash),
        row("static RAM", memory.statics),
        row("stack, most in use after the start", memory.stack[0]),
        row("stack, most in use after a session on all links: program, storing, search, ASCII", memory.stack[1]),
    ];
    report.table(["", "bytes"], &rows);
    Ok(memory)
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

/// Everything once, on all links.
fn session(host: &mut Host) -> Result<(), Failure> {
    host.plug_usb()?;
    for link in [Link::Rs485, Link::Can, Link::Usb] {
        for line in ["GAP 1, 0", "GGP 66, 0", "SAP 4, 0, 1200", "STAP 4, 0", "RSAP 4, 0", "STGP 1, 2", "GIO 0, 1"] {
            host.tell(link, line)?;
        }
        for line in ["ROR 0, 500", "MVP ABS, 0, 5000", "MVP REL, 0, -100", "MST 0", "SCO 1, 0, 7", "MVP COORD, 0, 1"] {
            host.tell(link, line)?;
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
    ascii(host)
}

fn search(host: &mut Host) -> Result<(), Failure> {
    host.tell(Link::Rs485, "SAP 193, 0, 1")?;
    host.tell(Link::Rs485, "RFS START, 0")?;
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
