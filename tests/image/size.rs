//! The flash image: it builds without a warning, starts where the microcontroller looks, and keeps within its
//! budget of flash and RAM.

use common::image;
use std::ops::Range;
use std::path::Path;

use object::{Object, ObjectSection, SectionFlags, elf};

/// Budgets of the design, in bytes: flash, and RAM without the stack; those of the CANopen firmware, of the TMCM-6110,
/// and of the TMCM-3212.
const FLASH_MAX: u64 = 128 * 1024;
const RAM_MAX: u64 = 48 * 1024;
const CANOPEN_FLASH_MAX: u64 = 160 * 1024;
const CANOPEN_RAM_MAX: u64 = 28 * 1024;
const SIX_AXES_FLASH_MAX: u64 = 140 * 1024;
const SIX_AXES_RAM_MAX: u64 = 40 * 1024;
const THREE_AXES_FLASH_MAX: u64 = 148 * 1024;
const THREE_AXES_RAM_MAX: u64 = 64 * 1024;

/// Where they are in the STM32F405VG (RM0090 section 2.3); of the RAM, the first 16 KiB are the stack's.
const FLASH: Range<u64> = 0x0800_0000..0x0810_0000;
const STACK: Range<u64> = 0x2000_0000..0x2000_4000;
const RAM: Range<u64> = STACK.end..0x2002_0000;

/// Bytes of a memory section that the image takes up.
#[derive(Debug, Default, PartialEq)]
struct Size {
    flash: u64,
    ram: u64,
}

/// Adds up the sections that end up in memory. Initialised data count twice: in RAM, and in flash, where they
/// are copied from.
fn measure(file: &object::File) -> Size {
    let mut size = Size::default();
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else { continue };
        if sh_flags & u64::from(elf::SHF_ALLOC) == 0 || section.size() == 0 {
            continue;
        }
        let name = section.name().unwrap_or_default();
        println!("{name:16} {:#010x} {:6}", section.address(), section.size());
        if FLASH.contains(&section.address()) {
            size.flash += section.size();
        } else {
            assert!(RAM.contains(&section.address()), "{name} lies at {:#x}", section.address());
            size.ram += section.size();
            if name == ".data" {
                size.flash += section.size();
            }
        }
    }
    size
}

/// Sizes of an image, whose vectors are where the microcontroller looks for them.
fn size_of(path: &Path) -> Size {
    let contents = std::fs::read(path).unwrap();
    let file = object::File::parse(&*contents).unwrap();

    let vectors = file.section_by_name(".vector_table").unwrap();
    assert_eq!(vectors.address(), FLASH.start, "the vector table is where the microcontroller looks after reset");
    let [stack, reset] = [0, 4].map(|at| u32::from_le_bytes(*vectors.data().unwrap()[at..].first_chunk().unwrap()));
    assert_eq!(u64::from(stack), STACK.end, "the stack lies below the statics");
    assert_eq!(u64::from(reset), file.entry(), "the reset vector is the entry point");
    measure(&file)
}

#[test]
fn image_keeps_within_its_budget() {
    for (built, flash, ram) in [
        (image::try_built(xtask::TMCL), FLASH_MAX, RAM_MAX),
        (image::try_built(xtask::CANOPEN), CANOPEN_FLASH_MAX, CANOPEN_RAM_MAX),
        (image::try_built("tmcm6110"), SIX_AXES_FLASH_MAX, SIX_AXES_RAM_MAX),
        (image::try_built("tmcm3212"), THREE_AXES_FLASH_MAX, THREE_AXES_RAM_MAX),
    ] {
        let image::Built { path, messages } = built.unwrap_or_else(|error| panic!("{error}"));
        assert!(!messages.lines().any(|line| line.starts_with("warning")), "{messages}");
        let size = size_of(&path);
        println!("{}: flash {} of {flash}, static RAM {} of {ram}", path.display(), size.flash, size.ram);
        assert!(size.flash <= flash && size.ram <= ram, "{size:?}");
    }
}
