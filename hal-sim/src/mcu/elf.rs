//! The firmware's image: an ELF file for the microcontroller.

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Architecture, Endianness, Object, ObjectSection, ObjectSymbol, SectionFlags, elf};

use super::cpu::FLASH_SIZE;
use super::stop::Stop;

/// Where flash and RAM are.
const FLASH: u32 = 0x0800_0000;
const RAM: core::ops::Range<u64> = 0x2000_0000..0x2002_0000;
const ERASED: u8 = 0xFF;

/// What the machine needs to know of an image.
#[derive(Debug)]
pub(super) struct Image {
    /// Contents of the flash memory.
    pub(super) flash: Vec<u8>,
    /// Where the log's control block is, if there is one.
    pub(super) rtt: Option<u32>,
    /// Where the statics in RAM end; from there on it is the stack's.
    pub(super) statics_end: u32,
}

impl Image {
    /// Reads an ELF file.
    pub(super) fn parse(file: &[u8]) -> Result<Self, Stop> {
        let wrong = |what: &dyn std::fmt::Display| Stop::Image(what.to_string());
        let elf = ElfFile32::<Endianness>::parse(file).map_err(|error| wrong(&error))?;
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
        let rtt = elf.symbols().find(|symbol| symbol.name() == Ok("_SEGGER_RTT")).map(|symbol| symbol.address() as u32);
        let in_memory =
            |flags| matches!(flags, SectionFlags::Elf { sh_flags, .. } if sh_flags & u64::from(elf::SHF_ALLOC) != 0);
        let statics_end = elf
            .sections()
            .filter(|section| in_memory(section.flags()) && RAM.contains(&section.address()))
            .map(|section| section.address() + section.size())
            .max();
        Ok(Self { flash, rtt, statics_end: statics_end.unwrap_or(RAM.start) as u32 })
    }
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
