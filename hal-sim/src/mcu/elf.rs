//! The firmware's image: an ELF file for the microcontroller.

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Architecture, Object, ObjectSection, ObjectSymbol, SectionFlags, elf};

use super::cpu::FLASH_SIZE;
use super::stop::Stop;

/// Where flash and RAM are.
const FLASH: u32 = 0x0800_0000;
const FLASH_MEMORY: core::ops::Range<u32> = FLASH..FLASH + FLASH_SIZE as u32;
const RAM: core::ops::Range<u32> = 0x2000_0000..0x2002_0000;
const ERASED: u8 = 0xFF;

/// An image, as far as the machine needs to know it.
#[derive(Debug)]
pub(super) struct Image {
    /// Contents of the flash memory.
    pub(super) flash: Vec<u8>,
    /// Where the log's control block is, if there is one.
    pub(super) rtt: Option<u32>,
    /// The stack's memory: what lies between its start and the next statics below, or the RAM's end.
    pub(super) stack: core::ops::Range<u32>,
}

impl Image {
    /// Reads an ELF file.
    pub(super) fn parse(file: &[u8]) -> Result<Self, Stop> {
        let wrong = |what: &dyn std::fmt::Display| Stop::Image(what.to_string());
        let elf = read(file)?;
        if elf.architecture() != Architecture::Arm {
            return Err(wrong(&"not for an ARM core"));
        }
        let mut flash = vec![ERASED; FLASH_SIZE];
        let order = elf.endian();
        for header in elf.elf_program_headers() {
            if header.p_type(order) != elf::PT_LOAD || header.p_filesz(order) == 0 {
                continue;
            }
            let data = header.data(order, file).map_err(|()| wrong(&"a segment is not in the file"))?;
            let place = header.p_paddr(order).checked_sub(FLASH).map(|at| at as usize);
            let cells = place.and_then(|at| flash.get_mut(at..at + data.len()));
            cells.ok_or_else(|| wrong(&"a segment lies outside flash"))?.copy_from_slice(data);
        }
        let [top, reset] =
            [0, 4].map(|at| flash.get(at..).and_then(<[u8]>::first_chunk).copied().map(u32::from_le_bytes));
        let (top, reset) = (top.unwrap_or_default(), reset.unwrap_or_default());
        // Both vectors lie in the memory they are for; the lowest bit says that it is Thumb code.
        if !(RAM.start..=RAM.end).contains(&top) || reset & 1 == 0 || !FLASH_MEMORY.contains(&reset) {
            return Err(wrong(&"the flash memory does not begin with the vectors of a program"));
        }
        let rtt = elf.symbols().find(|symbol| symbol.name() == Ok("_SEGGER_RTT")).map(|symbol| symbol.address() as u32);
        let in_memory =
            |flags| matches!(flags, SectionFlags::Elf { sh_flags, .. } if sh_flags & u64::from(elf::SHF_ALLOC) != 0);
        let below = elf
            .sections()
            .filter(|section| in_memory(section.flags()))
            .map(|section| (section.address() + section.size()) as u32)
            .filter(|end| (RAM.start..=top).contains(end));
        Ok(Self { flash, rtt, stack: below.max().unwrap_or(RAM.start)..top })
    }
}

/// How the name of a symbol goes on that begins with `start`; `None` without such a symbol. A firmware can tell so what
/// it is.
///
/// # Errors
/// The file is no image for the microcontroller.
pub fn mark(file: &[u8], start: &str) -> Result<Option<String>, Stop> {
    Image::parse(file)?;
    let rest = |name: &str| name.strip_prefix(start).map(Into::into);
    Ok(read(file)?.symbols().find_map(|symbol| rest(symbol.name().ok()?)))
}

fn read(file: &[u8]) -> Result<ElfFile32<'_>, Stop> {
    ElfFile32::parse(file).map_err(|_| Stop::Image("not an ELF file of 32 bits".into()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_image_is_refused() {
        assert!(matches!(Image::parse(b"no ELF"), Err(Stop::Image(_))));
        let host = std::fs::read(std::env::current_exe().unwrap()).unwrap();
        assert!(matches!(Image::parse(&host), Err(Stop::Image(_))));
    }
}
