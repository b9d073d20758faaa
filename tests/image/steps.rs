//! The steps that the emulated microcontroller shows of the image: all of them, and the run is the same.

use common::image;
use hal_sim::board::{Board, Chip};
use hal_sim::clock::MILLISECOND;
use hal_sim::mcu::{Act, Machine, Step};
use hal_sim::world::config::WorldConfig;

/// Exception of TIM3, which comes each millisecond.
const TIM3: u16 = 16 + 29;

/// A machine that has started and stands.
fn machine() -> Machine {
    let board = Board::new(&WorldConfig::default(), 0);
    let mut machine = Machine::new(&std::fs::read(image::image()).unwrap(), board).unwrap();
    machine.run(100 * MILLISECOND).unwrap();
    machine
}

#[test]
fn who_is_watched_does_the_same_and_all_of_it_is_seen() {
    let (mut alone, mut watched) = (machine(), machine());
    let before = watched.counters();
    let datagrams = |machine: &mut Machine| machine.board().datagrams(Chip::Tmc429(0));
    let datagrams_before = datagrams(&mut watched);
    let mut steps: Vec<Step> = Vec::new();
    let end = watched.now() + 10 * MILLISECOND;
    watched.observe_until(end, &mut |step| steps.push(step)).unwrap();
    alone.run_until(end).unwrap();
    let after = watched.counters();
    assert_eq!(after, alone.counters());
    assert_eq!(watched.cpu().pc(), alone.cpu().pc());

    assert!(steps.is_sorted_by(|before, after| before.at + before.cycles == after.at), "no cycle is left out");
    let cycles = |wanted: &dyn Fn(&Step) -> bool| -> u64 {
        steps.iter().filter(|step| wanted(step)).map(|step| step.cycles).sum()
    };
    assert_eq!(cycles(&|_| true), after.cycles - before.cycles);
    let waited: u64 =
        steps.iter().map(|step| if let Act::Wait { instructions } = step.act { instructions } else { 0 }).sum();
    assert_eq!(waited, after.skipped - before.skipped);
    let entered = steps.iter().filter(|step| step.act == Act::Entry(TIM3)).count();
    assert_eq!(entered, 10);
    // Each datagram is 32 bits at 84 MHz / 64; the bus has a word on the wire a step more or less.
    let sent = datagrams(&mut watched) - datagrams_before;
    let clocked = cycles(&|step| step.chip == Some(Chip::Tmc429(0)) && step.clocked);
    // The motor stands: one datagram a millisecond, each fourth to the driver.
    assert!((7..=8).contains(&sent), "{sent}");
    assert!(clocked.abs_diff(sent * 32 * 128) < sent * 200, "{clocked} cycles for {sent} datagrams");
}
