use super::*;
use core::marker::PhantomData;

/// A slot whose factory default is 1000.
const SPEED: usize = 76;
/// Two slots whose factory default is 0, in other pages than `SPEED`.
const COUNT: usize = 141;
const VARIABLE: usize = 75;

/// An EEPROM of 16 KiB with pages of 64 bytes: an AT25128.
#[derive(Debug)]
struct Small;

const fn defaults<const N: usize>() -> [i32; N] {
    let mut defaults = [0; N];
    defaults[SPEED] = 1000;
    defaults[N - 1] = 7;
    defaults
}

impl Memory for Small {
    const SIZE: usize = 16_384;
    const PAGE: usize = 64;
    const LAYOUT: Layout =
        Layout { tag: b"small", defaults: &defaults::<208>(), after_erasing: 13, other: 16, storing: Storing::Pages };
    type Program = [u8; 14_336];
    type Values = [i32; 224];
    type Pairs = [Pair; 16];
}

/// An EEPROM of 32 KiB with pages of 64 bytes: an AT25256.
#[derive(Debug)]
struct Middle;

impl Memory for Middle {
    const SIZE: usize = 32_768;
    const PAGE: usize = 64;
    const LAYOUT: Layout =
        Layout { tag: b"middle", defaults: &defaults::<500>(), after_erasing: 13, other: 36, storing: Storing::Pages };
    type Program = [u8; 14_336];
    type Values = [i32; 504];
    type Pairs = [Pair; 36];
}

/// An EEPROM of 64 KiB with pages of 128 bytes: an AT25512.
#[derive(Debug)]
struct Large;

impl Memory for Large {
    const SIZE: usize = 65_536;
    const PAGE: usize = 128;
    const LAYOUT: Layout =
        Layout { tag: b"large", defaults: &defaults::<1_000>(), after_erasing: 13, other: 34, storing: Storing::Pages };
    type Program = [u8; 43_008];
    type Values = [i32; 1_020];
    type Pairs = [Pair; 34];
}

/// The bytes of an EEPROM whose writes always succeed.
struct Part<M: Memory = Small>(Vec<u8>, PhantomData<M>);

impl<M: Memory> Part<M> {
    fn of(contents: Vec<u8>) -> Self {
        Part(contents, PhantomData)
    }

    fn fresh() -> Self {
        Part::of(vec![0xFF; M::SIZE])
    }

    fn load(&self) -> (Store<M>, LoadReport) {
        let read = |address: u16, page: &mut [u8]| {
            page.copy_from_slice(&self.0[address.into()..][..page.len()]);
            Ok::<(), ()>(())
        };
        let mut store = Store::new();
        let report = store.load(read).unwrap();
        (store, report)
    }

    /// Writes the next page; false if there is none.
    fn write(&mut self, store: &mut Store<M>) -> bool {
        let Some(job) = store.next_job() else { return false };
        assert_eq!((job.page.len(), usize::from(job.address) % M::PAGE), (M::PAGE, 0));
        self.0[job.address.into()..][..job.page.len()].copy_from_slice(&job.page);
        store.finish(true);
        true
    }

    fn settle(&mut self, store: &mut Store<M>) -> u32 {
        let mut writes = 0;
        while self.write(store) {
            writes += 1;
        }
        assert!(store.settled(Need::Program));
        writes
    }
}

#[test]
fn an_empty_part_reads_as_defaults_and_is_left_alone() {
    let (mut store, report) = Part::<Small>::fresh().load();
    assert_eq!(report, LoadReport::default());
    assert_eq!(store.get(SPEED), Some(1000));
    assert_eq!(store.next_job(), None);
}

#[test]
fn values_survive_and_unchanged_ones_are_not_written() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 2000));
    assert!(store.set(COUNT, -1));
    assert_eq!(part.settle(&mut store), 2);
    assert!(store.set(SPEED, 2000));
    assert!(store.settled(Need::Program));
    let (store, report) = part.load();
    assert_eq!(report.valid, 2);
    assert_eq!((store.get(SPEED), store.get(COUNT)), (Some(2000), Some(-1)));
}

/// The sequence number is a byte: 300 writes wrap it, and the newest copy still wins.
#[test]
fn the_newest_copy_wins_across_the_wrap() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    for value in 1..=300 {
        assert!(store.set(SPEED, value));
        part.settle(&mut store);
        assert_eq!(part.load().0.get(SPEED), Some(value));
    }
}

#[test]
fn a_torn_write_leaves_the_older_copy() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 100));
    part.settle(&mut store);
    assert!(store.set(SPEED, 200));
    let job = store.next_job().unwrap();
    for cut in 0..job.page.len() {
        let mut torn = Part::<Small>::of(part.0.clone());
        torn.0[job.address.into()..][..cut].copy_from_slice(&job.page[..cut]);
        let expected = if torn.0[job.address.into()..][..64] == *job.page { 200 } else { 100 };
        assert_eq!(torn.load().0.get(SPEED), Some(expected), "cut after {cut} bytes");
    }
}

#[test]
fn a_factory_reset_takes_everything_back_with_its_first_page() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 2000));
    assert!(store.set(VARIABLE, 7));
    part.settle(&mut store);
    store.reset(false);
    let job = store.next_job().unwrap();
    part.0[job.address.into()..][..64].copy_from_slice(&job.page);
    let (after, _) = part.load();
    assert_eq!((after.get(SPEED), after.get(VARIABLE)), (Some(1000), Some(0)));
    store.finish(true);
    assert_eq!(part.settle(&mut store), 1);
    assert!(store.set(SPEED, 3));
    part.settle(&mut store);
    assert_eq!(part.load().0.get(SPEED), Some(3));
}

#[test]
fn after_a_failed_write_values_that_are_not_durable_are_given_up() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 100));
    part.settle(&mut store);
    assert!(store.set(SPEED, 200));
    assert!(store.next_job().is_some());
    store.finish(false);
    assert!(store.settled(Need::Program));
    assert_eq!(store.get(SPEED), Some(100));
}

#[test]
fn nothing_is_durable_in_a_part_that_does_not_answer() {
    let mut store = Store::<Small>::new();
    store.unreachable();
    assert!(store.settled(Need::Program));
    // The factory default is written, too, because the value in the EEPROM is unknown.
    assert!(store.set(SPEED, 1000));
    assert!(!store.settled(Need::Program) && store.next_job().is_some());
    store.finish(false);
    assert!(store.settled(Need::Program));
    assert_eq!(store.get(SPEED), Some(1000));
}

#[test]
fn foreign_contents_are_reported_and_count_as_defaults() {
    let part = Part::<Small>::of((0..16_384_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect());
    let (store, report) = part.load();
    assert_eq!(report, LoadReport { foreign: 32, ..LoadReport::default() });
    assert_eq!(store.get(SPEED), Some(1000));
}

#[test]
fn a_reset_during_a_write_is_not_undone_by_it() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 2000));
    let job = store.next_job().unwrap();
    store.reset(false);
    part.0[job.address.into()..][..64].copy_from_slice(&job.page);
    store.finish(true);
    assert_eq!(part.settle(&mut store), 2);
    assert_eq!(store.get(SPEED), Some(1000));
    assert_eq!(part.load().0.get(SPEED), Some(1000));
}

#[test]
fn the_first_store_formats_foreign_pages() {
    let mut part = Part::<Small>::of((0..16_384_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect());
    let (mut store, _) = part.load();
    assert_eq!(store.next_job(), None, "nothing is written before");
    assert!(store.set(SPEED, 2000));
    assert_eq!(part.settle(&mut store), 33, "both copies of 16 pages, and then what is stored");
    let (mut store, report) = part.load();
    assert_eq!(report, LoadReport { valid: 32, ..LoadReport::default() });
    assert_eq!(store.get(SPEED), Some(2000));
    assert!(store.set(SPEED, 1));
    assert!(store.set(SPEED, 2000));
    assert!(store.settled(Need::Settings), "what is the same again is not written");
}

/// Every slot keeps a value of its own across a power cycle, and a slot behind the last one is refused.
fn every_slot_survives<M: Memory>() {
    let mut part = Part::<M>::fresh();
    let (mut store, _) = part.load();
    let slots = M::LAYOUT.defaults.len();
    let value = |slot: usize| i32::try_from(slot).unwrap() * 1_000_003 + 1;
    assert!((FIRST_SLOT..slots).all(|slot| store.set(slot, value(slot))));
    assert!(!store.set(slots, 1) && !store.set(usize::MAX, 1));
    part.settle(&mut store);
    let (store, _) = part.load();
    assert!((FIRST_SLOT..slots).all(|slot| store.get(slot) == Some(value(slot))));
    assert_eq!(store.get(slots), None);
}

#[test]
fn every_slot_survives_whatever_the_size_of_part_and_page() {
    every_slot_survives::<Small>();
    every_slot_survives::<Middle>();
    every_slot_survives::<Large>();
}

/// A program that fills its memory is the same after a power cycle, and storing it does not change the settings.
fn a_whole_program_survives<M: Memory>() {
    let mut part = Part::<M>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 5));
    store.begin_download(0);
    let byte = |at: usize| (at * 31 + at / 251) as u8 | 1;
    let record = |first: usize| -> [u8; 7] { core::array::from_fn(|i| byte(first + i)) };
    assert!((0..M::Program::LENGTH).step_by(7).all(|first| store.download(&record(first))));
    assert_eq!(store.downloading(), Some(M::Program::LENGTH));
    assert!(!store.download(&[1]), "there is no room for more");
    store.end_download();
    part.settle(&mut store);
    let (store, report) = part.load();
    assert_eq!((report.program, report.foreign, store.get(SPEED)), (Integrity::Whole, 0, Some(5)));
    assert!(store.program().iter().enumerate().all(|(at, found)| *found == byte(at)));
}

#[test]
fn a_program_survives_whatever_the_size_of_part_and_page() {
    a_whole_program_survives::<Small>();
    a_whole_program_survives::<Middle>();
    a_whole_program_survives::<Large>();
}

/// A factory reset erases the program only with `erase`; the slot `after_erasing` gets its value when the last page is
/// erased, and not before.
#[test]
fn a_reset_erases_the_program_only_if_asked_to_and_a_slot_tells_when() {
    for (erase, integrity) in [(false, Integrity::Whole), (true, Integrity::Empty)] {
        let mut part = Part::<Small>::fresh();
        let (mut store, _) = part.load();
        store.begin_download(0);
        assert!(store.download(&[1; 7]));
        store.end_download();
        assert!(store.set(13, 1));
        part.settle(&mut store);
        store.reset(erase);
        part.settle(&mut store);
        assert_eq!((store.integrity(), part.load().0.program()[0]), (integrity, if erase { 0 } else { 1 }));
    }
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(13, 1));
    part.settle(&mut store);
    assert_eq!(store.erase(2), None);
    let mut erased = Vec::new();
    while let Some(job) = store.next_job() {
        erased.push((store.get(13), job.address, store.finish(true).erased));
    }
    assert_eq!(erased.iter().filter_map(|(_, _, erased)| *erased).collect::<Vec<_>>(), [2]);
    assert_eq!((erased[0].0, store.get(13)), (Some(1), Some(2)));
}

/// A page that could not be written is as it was, and so are the others: the next store writes the page of its value
/// alone. Only a factory reset that has failed, with its first page write or its second one, is made up for: by both
/// copies of the first page.
#[test]
fn a_failed_write_orders_no_other_pages() {
    for (reset, written) in [(false, 0), (true, 0), (true, 1)] {
        let mut part = Part::<Small>::fresh();
        let (mut store, _) = part.load();
        assert!(store.set(SPEED, 2000));
        assert_eq!(part.settle(&mut store), 1);
        if reset {
            store.reset(false);
        } else {
            assert!(store.set(SPEED, 3000));
        }
        for _ in 0..written {
            part.write(&mut store);
        }
        assert!(store.next_job().is_some());
        assert_eq!(store.finish(false).failed, Some(Need::Settings));
        assert_eq!(store.next_job(), None);
        assert!(store.set(COUNT, 5));
        assert_eq!(part.settle(&mut store), if reset { 3 } else { 1 }, "reset: {reset}, {written} written");
        assert_eq!(part.load().0.get(COUNT), Some(5));
    }
}

/// A store is idle but while something is to be written, or is being written, and while a download is open.
#[test]
fn a_store_is_idle_while_it_has_nothing_to_do() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.is_idle());
    assert!(store.set(SPEED, 2000));
    assert!(!store.is_idle());
    assert!(store.next_job().is_some());
    assert!(!store.is_idle());
    store.finish(true);
    assert!(store.is_idle());
    store.begin_download(0);
    part.settle(&mut store);
    assert!(!store.is_idle());
    // The page is being written while the download goes on.
    assert!(store.download(&[1; 64]));
    assert!(store.next_job().is_some());
    store.end_download();
    assert!(!store.is_idle());
    store.finish(true);
    part.settle(&mut store);
    assert!(store.is_idle());
}

/// Numbers wrap, and are later than those that they are less than half of the range ahead of: of two that are half of
/// it apart none is.
#[test]
fn numbers_that_wrap_are_later_by_less_than_half_their_range() {
    for from in [0, 1, 0x7FFF, 0x8000, 0xFFFF_u16] {
        for (ahead, later) in [(0, false), (1, true), (0x7FFF, true), (0x8000, false), (0x8001, false), (0xFFFF, false)]
        {
            assert_eq!(page::newer(from.wrapping_add(ahead), from), later, "{ahead} ahead of {from}");
        }
    }
    for from in [0, 1, 0x7F, 0x80, 0xFF_u8] {
        for (ahead, later) in [(0, false), (1, true), (0x7F, true), (0x80, false), (0x81, false), (0xFF, false)] {
            assert_eq!(page::follows(from.wrapping_add(ahead), from), later, "{ahead} ahead of {from}");
        }
    }
}

/// A store that is loaded again has what the EEPROM has, whatever was wanted, or being written, before.
#[test]
fn a_store_that_is_loaded_again_forgets_what_was_wanted() {
    let part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    assert!(store.set(SPEED, 2000) && store.next_job().is_some());
    assert!(store.set(COUNT, 5));
    let read = |address: u16, page: &mut [u8]| {
        page.copy_from_slice(&part.0[address.into()..][..page.len()]);
        Ok::<(), ()>(())
    };
    assert_eq!(store.load(read), Ok(LoadReport::default()));
    assert_eq!((store.get(SPEED), store.get(COUNT)), (Some(1000), Some(0)));
    assert!(store.is_idle() && store.next_job().is_none());
}

/// A store that forgets has defaults and no program, and does nothing: no download is open any more.
#[test]
fn a_store_that_forgets_is_as_with_a_fresh_part() {
    let (mut store, _) = Part::<Small>::fresh().load();
    assert!(store.set(SPEED, 2000));
    store.begin_download(0);
    assert!(store.download(&[1; 64]));
    store.forget();
    assert_eq!((store.get(SPEED), store.downloading(), store.integrity()), (Some(1000), None, Integrity::Empty));
    assert!(store.program().iter().all(|byte| *byte == 0xFF || *byte == 0));
    assert!(store.is_idle() && store.next_job().is_none());
}

/// An EEPROM as that of `Middle`, with four settings pages less: the eight copies that `Middle` has before these are
/// cleared.
#[derive(Debug)]
struct Narrow;

impl Memory for Narrow {
    const LAYOUT: Layout = Layout { tag: b"narrow", defaults: &defaults::<440>(), ..Middle::LAYOUT };
    const SIZE: usize = Middle::SIZE;
    const PAGE: usize = Middle::PAGE;
    type Program = [u8; 14_336];
    type Values = [i32; 448];
    type Pairs = [Pair; 32];
}

/// The contents of another layout in front of the settings are cleared before the first of the settings is written.
/// Where that has failed on the way, the next store clears what is left.
#[test]
fn clearing_that_has_failed_goes_on_with_the_next_store() {
    let mut part = Part::<Middle>::fresh();
    let (mut store, _) = part.load();
    for slot in [0, 20, 40, 50].map(|page| page * 7 + 13) {
        assert!(store.set(slot, 77));
    }
    part.settle(&mut store);
    for written in 0..8 {
        let mut part = Part::<Narrow>::of(part.0.clone());
        let (mut store, _) = part.load();
        assert!(store.set(SPEED, 2000));
        for _ in 0..written {
            assert!(part.write(&mut store));
        }
        assert!(store.next_job().is_some());
        store.finish(false);
        assert_eq!(store.get(SPEED), Some(1000));
        assert!(store.set(SPEED, 3000));
        part.settle(&mut store);
        let (first, end) = (Narrow::SIZE - 72 * 64, Narrow::SIZE - 64 * 64);
        assert_eq!(part.0[first..end], [0; 512], "after {written} pages");
        // What is cleared is left alone from then on.
        let (mut store, _) = part.load();
        assert_eq!(store.get(SPEED), Some(3000), "after {written} pages");
        assert!(store.set(SPEED, 4000));
        assert_eq!(part.settle(&mut store), 1, "after {written} pages");
    }
}

/// During a download a page is written when it is full, and one that is not when the download ends.
#[test]
fn a_page_of_a_download_is_written_when_it_is_full() {
    let mut part = Part::<Small>::fresh();
    let (mut store, _) = part.load();
    store.begin_download(0);
    part.settle(&mut store);
    for command in 1..=12 {
        assert!(store.download(&[command; 8]));
        assert_eq!(part.settle(&mut store), u32::from(command == 8), "{command} commands");
    }
    store.end_download();
    // The second page, and that of the integrity.
    assert_eq!(part.settle(&mut store), 2);
    assert_eq!((store.integrity(), part.load().1.program), (Integrity::Whole, Integrity::Whole));
}
