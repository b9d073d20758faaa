use super::*;
use crate::clock::SECOND;

/// Size of a page of the AT25128.
const PAGE: usize = 64;

fn transfer(part: &mut At25, now: Nanos, bytes: &[u8]) -> Vec<u8> {
    part.advance(now);
    part.select(now);
    let answer = bytes.iter().map(|&byte| part.byte(byte)).collect();
    part.deselect(now);
    answer
}

fn write(part: &mut At25, now: Nanos, address: u16, data: &[u8]) {
    transfer(part, now, &[WREN]);
    let mut bytes = vec![WRITE];
    bytes.extend(address.to_be_bytes());
    bytes.extend(data);
    transfer(part, now, &bytes);
}

#[test]
fn a_fresh_part_is_erased_and_write_disabled() {
    let mut part = At25::new(AT25128, 1);
    assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0);
    assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0, 0])[3..], [0xFF, 0xFF]);
    transfer(&mut part, 0, &[WRITE, 0, 0, 0x55]);
    assert!(!part.is_writing());
}

#[test]
fn a_write_takes_five_milliseconds_and_answers_only_rdsr_meanwhile() {
    let mut part = At25::new(AT25128, 1);
    transfer(&mut part, 0, &[WREN]);
    assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x02);
    transfer(&mut part, 0, &[WRITE, 0x01, 0x00, 0xAB]);
    assert_eq!(part.next_event(), Some(5_000_000));
    // Datasheet: bits 0-7 are 1s during an internal write cycle.
    assert_eq!(transfer(&mut part, 4_999_999, &[RDSR, 0, 0])[1..], [0xFF; 2]);
    assert_eq!(transfer(&mut part, 4_999_999, &[READ, 1, 0, 0])[3], 0xFF, "not answered");
    assert_eq!(transfer(&mut part, 5_000_000, &[RDSR, 0])[1], 0x00);
    assert_eq!(transfer(&mut part, 5_000_000, &[READ, 1, 0, 0])[3], 0xAB);
    assert_eq!(part.page_writes(4), 1);
    assert_eq!(part.most_page_writes(), 1);
}

#[test]
fn a_long_write_wraps_within_its_page() {
    let mut part = At25::new(AT25128, 1);
    // Starts at byte 62 of page 1: 62, 63, then 0 and 1 of the same page.
    write(&mut part, 0, 64 + 62, &[1, 2, 3, 4]);
    part.advance(WRITE_CYCLE);
    assert_eq!(part.contents()[64 + 62..64 + 64], [1, 2]);
    assert_eq!(part.contents()[64..67], [3, 4, 0xFF]);
    assert_eq!(part.contents()[128], 0xFF);
}

#[test]
fn the_larger_parts_have_their_own_sizes_and_pages() {
    for (kind, last, page) in [(AT25256, 0x7FFF, 64), (AT25512, 0xFFFF, 128)] {
        let mut part = At25::new(kind, 1);
        assert_eq!(part.contents().len(), usize::from(last) + 1);
        // Three bytes from the last one of the memory on: the other two go to the beginning of its page.
        write(&mut part, 0, last, &[1, 2, 3]);
        part.advance(WRITE_CYCLE);
        let end = &part.contents()[usize::from(last) + 1 - page..];
        assert_eq!((end[page - 1], &end[..3]), (1, [2, 3, 0xFF].as_slice()));
        assert_eq!(part.page_writes(usize::from(last) / page), 1);
        let [high, low] = last.to_be_bytes();
        assert_eq!(transfer(&mut part, WRITE_CYCLE, &[READ, high, low, 0, 0])[3..], [1, 0xFF], "it rolls over");
        // The upper quarter is protected.
        transfer(&mut part, WRITE_CYCLE, &[WREN]);
        transfer(&mut part, WRITE_CYCLE, &[WRSR, 0x04]);
        let first = (last / 4 + 1) * 3;
        write(&mut part, 2 * WRITE_CYCLE, first, &[1]);
        assert!(!part.is_writing());
        write(&mut part, 2 * WRITE_CYCLE, first - 1, &[1]);
        assert!(part.is_writing());
    }
}

#[test]
fn reading_rolls_over_at_the_end_and_ignores_the_upper_address_bits() {
    let mut part = At25::new(AT25128, 1);
    let mut image = vec![0u8; AT25128.size];
    image[0] = 0x11;
    image[AT25128.size - 1] = 0x22;
    part.load(&image);
    assert_eq!(transfer(&mut part, 0, &[READ, 0xFF, 0xFF, 0, 0])[3..], [0x22, 0x11]);
}

#[test]
fn no_write_without_data_and_the_latch_survives_it() {
    let mut part = At25::new(AT25128, 1);
    transfer(&mut part, 0, &[WREN]);
    transfer(&mut part, 0, &[WRITE, 0, 0]);
    assert!(!part.is_writing());
    assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x02);
    transfer(&mut part, 0, &[WRDI]);
    assert_eq!(transfer(&mut part, 0, &[RDSR, 0])[1], 0x00);
}

#[test]
fn the_block_bits_protect_the_upper_quarter() {
    let mut part = At25::new(AT25128, 1);
    transfer(&mut part, 0, &[WREN]);
    transfer(&mut part, 0, &[WRSR, 0x04]);
    let now = WRITE_CYCLE;
    assert_eq!(transfer(&mut part, now, &[RDSR, 0])[1], 0x04);
    write(&mut part, now, 0x3000, &[1]);
    assert!(!part.is_writing(), "0x3000 is the first protected address");
    write(&mut part, now, 0x2FFF, &[1]);
    assert!(part.is_writing());
}

#[test]
fn a_power_cut_tears_the_page_reproducibly_and_spares_the_others() {
    let torn = |seed| {
        let mut part = At25::new(AT25128, seed);
        part.load(&[0x00; 192]);
        write(&mut part, 0, 64, &[0x77; PAGE]);
        part.advance(MILLISECOND);
        part.power_cut();
        part.advance(WRITE_CYCLE);
        assert!(part.contents()[..64].iter().all(|&b| b == 0));
        assert!(part.contents()[128..192].iter().all(|&b| b == 0));
        part.contents()[64..128].to_vec()
    };
    let page = torn(3);
    for kind in [0x00, 0x77, 0xFF] {
        assert!(page.contains(&kind));
    }
    assert_eq!(page, torn(3));
    assert_ne!(page, torn(4));
}

/// A backing that takes the contents only while page 1 begins with an even byte, and passes on what it was given.
#[derive(Debug)]
struct Choosy(std::sync::mpsc::Sender<Vec<u8>>);

impl Backing for Choosy {
    fn keep(&mut self, contents: &[u8]) -> bool {
        self.0.send(contents.to_vec()).unwrap();
        contents[PAGE].is_multiple_of(2)
    }
}

#[test]
fn a_page_that_cannot_be_kept_keeps_its_old_bytes() {
    let (sender, kept) = std::sync::mpsc::channel();
    let mut part = At25::new(AT25128, 1);
    part.keep_in(Box::new(Choosy(sender)));
    for (number, first, held) in [(1, 0x10, 0x10), (2, 0x11, 0x10), (3, 0x12, 0x12)] {
        write(&mut part, number * SECOND, PAGE as u16, &[first; PAGE]);
        part.advance(number * SECOND + WRITE_CYCLE - 1);
        assert!(kept.try_recv().is_err(), "asked when the write cycle ends, not before");
        part.advance(number * SECOND + WRITE_CYCLE);
        assert_eq!(kept.try_recv().unwrap()[PAGE..2 * PAGE], [first; PAGE]);
        assert_eq!(part.contents()[PAGE..2 * PAGE], [held; PAGE]);
        assert!(!part.is_writing(), "the write cycle is over either way");
    }
    // A page that a power cut has torn is kept as it is.
    write(&mut part, 4 * SECOND, 2 * PAGE as u16, &[0x77; PAGE]);
    part.power_cut();
    assert_eq!(kept.try_recv().unwrap(), part.contents());
    assert_ne!(part.contents()[2 * PAGE..3 * PAGE], [ERASED; PAGE]);
}

#[test]
fn a_part_that_does_not_answer_reads_as_ones_and_keeps_its_contents() {
    let mut part = At25::new(AT25128, 1);
    part.load(&[0x12]);
    part.set_answering(false);
    assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0]), [0xFF; 4]);
    write(&mut part, 0, 0, &[0x99]);
    assert!(!part.is_writing());
    part.set_answering(true);
    assert_eq!(transfer(&mut part, 0, &[READ, 0, 0, 0])[3], 0x12);
}
