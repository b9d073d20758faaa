use super::*;
use crate::param::{AxisParameter, GlobalParameter};

const SPEED: Slot = Slot::Axis(0, AxisParameter::MaximumSpeed);

/// The settings area of a part whose writes always succeed.
struct Part(Vec<u8>);

impl Part {
    fn fresh() -> Self {
        Part(vec![0xFF; 16_384])
    }

    fn load(&self) -> (Store, Report) {
        let read = |address: u16, page: &mut Image| {
            *page = *self.0[address.into()..].first_chunk().unwrap();
            Ok::<(), ()>(())
        };
        let mut store = Store::new();
        let report = store.load(read).unwrap();
        (store, report)
    }

    fn settle(&mut self, store: &mut Store) -> u32 {
        let mut writes = 0;
        while let Some(job) = store.next_job() {
            assert!(job.address >= 14_336, "the program area is not ours");
            self.0[job.address.into()..][..job.page.len()].copy_from_slice(&job.page);
            store.finish(true);
            writes += 1;
        }
        assert!(store.settled(Need::Program));
        writes
    }
}

#[test]
fn an_empty_part_reads_as_defaults_and_is_left_alone() {
    let (mut store, report) = Part::fresh().load();
    assert_eq!(report, Report::default());
    assert_eq!(store.get(SPEED), Some(1000));
    assert_eq!(store.get(Slot::Global(GlobalParameter::SerialAddress)), Some(1));
    assert_eq!(store.next_job(), None);
}

#[test]
fn values_survive_and_unchanged_ones_are_not_written() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    store.set(SPEED, 2000);
    store.set(Slot::Coordinate(0, 20), -1);
    assert_eq!(part.settle(&mut store), 2);
    store.set(SPEED, 2000);
    assert!(store.settled(Need::Program));
    let (store, report) = part.load();
    assert_eq!(report.valid, 2);
    assert_eq!((store.get(SPEED), store.get(Slot::Coordinate(0, 20))), (Some(2000), Some(-1)));
    assert_eq!(store.get(Slot::Coordinate(0, 0)), None);
}

/// The sequence number is a byte: 300 writes wrap it, and the newest copy still wins.
#[test]
fn the_newest_copy_wins_across_the_wrap() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    for value in 1..=300 {
        store.set(SPEED, value);
        part.settle(&mut store);
        assert_eq!(part.load().0.get(SPEED), Some(value));
    }
}

#[test]
fn a_torn_write_leaves_the_older_copy() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    store.set(SPEED, 100);
    part.settle(&mut store);
    store.set(SPEED, 200);
    let job = store.next_job().unwrap();
    for cut in 0..job.page.len() {
        let mut torn = Part(part.0.clone());
        torn.0[job.address.into()..][..cut].copy_from_slice(&job.page[..cut]);
        let expected = if torn.0[job.address.into()..][..64] == job.page { 200 } else { 100 };
        assert_eq!(torn.load().0.get(SPEED), Some(expected), "cut after {cut} bytes");
    }
}

#[test]
fn a_factory_reset_takes_everything_back_with_its_first_page() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    store.set(SPEED, 2000);
    store.set(Slot::Variable(55), 7);
    part.settle(&mut store);
    store.reset();
    let job = store.next_job().unwrap();
    part.0[job.address.into()..][..64].copy_from_slice(&job.page);
    let (after, _) = part.load();
    assert_eq!((after.get(SPEED), after.get(Slot::Variable(55))), (Some(1000), Some(0)));
    store.finish(true);
    assert_eq!(part.settle(&mut store), 1);
    store.set(SPEED, 3);
    part.settle(&mut store);
    assert_eq!(part.load().0.get(SPEED), Some(3));
}

#[test]
fn a_failed_write_gives_up_what_is_not_durable() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    store.set(SPEED, 100);
    part.settle(&mut store);
    store.set(SPEED, 200);
    assert!(store.next_job().is_some());
    store.finish(false);
    assert!(store.settled(Need::Program));
    assert_eq!(store.get(SPEED), Some(100));
}

#[test]
fn nothing_is_durable_in_a_part_that_does_not_answer() {
    let mut store = Store::new();
    store.unreachable();
    assert!(store.settled(Need::Program));
    // Even a value that is what the store reads already.
    store.set(SPEED, 1000);
    assert!(!store.settled(Need::Program) && store.next_job().is_some());
    store.finish(false);
    assert!(store.settled(Need::Program));
    assert_eq!(store.get(SPEED), Some(1000));
}

#[test]
fn foreign_contents_are_reported_and_count_as_defaults() {
    let part = Part((0..16_384_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect());
    let (store, report) = part.load();
    assert_eq!(report, Report { foreign: 32, ..Report::default() });
    assert_eq!(store.get(SPEED), Some(1000));
}

#[test]
fn a_reset_during_a_write_is_not_undone_by_it() {
    let mut part = Part::fresh();
    let (mut store, _) = part.load();
    store.set(SPEED, 2000);
    let job = store.next_job().unwrap();
    store.reset();
    part.0[job.address.into()..][..64].copy_from_slice(&job.page);
    store.finish(true);
    assert_eq!(part.settle(&mut store), 2);
    assert_eq!(store.get(SPEED), Some(1000));
    assert_eq!(part.load().0.get(SPEED), Some(1000));
}

#[test]
fn the_first_store_makes_foreign_pages_ours() {
    let mut part = Part((0..16_384_u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect());
    let (mut store, _) = part.load();
    assert_eq!(store.next_job(), None, "nothing is written before");
    store.set(SPEED, 2000);
    assert_eq!(part.settle(&mut store), 33, "both copies of 16 pages, and then what is stored");
    let (mut store, report) = part.load();
    assert_eq!(report, Report { valid: 32, ..Report::default() });
    assert_eq!(store.get(SPEED), Some(2000));
    store.set(SPEED, 1);
    store.set(SPEED, 2000);
    assert!(store.settled(Need::Settings), "what is the same again is not written");
}
