//! Wait states between the core and its flash memory, and the accelerator that makes up for most of them (RM0090 3.5).
//!
//! A read of the flash memory gives a line of 128 bits after the wait states. The line with the last instruction is
//! kept; with prefetch on, the next one is read meanwhile. Instructions come without delay from these two and from a
//! cache of 64 lines, to which each line goes that had to be waited for. Data of the program, as literals, come from a
//! cache of 8 lines. When a cache is full, the line goes that has not been used for the longest time.
//!
//! Left out are the core's own prefetch of instructions, and that it reads a branch's target before the branch is
//! decided. Reads of instructions and data do not get in each other's way, nor in that of the DMA. Left out are also a
//! prefetch that cannot be given up, and vectors, which are read while registers are saved. Loops that wait for a
//! register and are passed over stall in their first round only.

use std::array;

use super::peripheral::{Cycles, NEVER};

/// Bytes of a line; lines of the caches.
const LINE: u32 = 16;
const INSTRUCTIONS: usize = 64;
const DATA: usize = 8;
/// Entries of an index of lines: as many as a flash memory of 1 MiB has.
const INDEX: usize = 1 << 16;
/// No line has this number.
const NONE: u32 = u32::MAX;

/// How the flash interface has been set up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Setup {
    pub(super) wait_states: u32,
    pub(super) prefetch: bool,
    pub(super) instruction_cache: bool,
    pub(super) data_cache: bool,
    /// How often the caches have been emptied: for instructions, for data.
    pub(super) emptied: [u32; 2],
}

/// A cache. Nothing in it is searched for: a program goes to another line every few instructions, and looking through
/// 64 places took a tenth of the emulator's time.
#[derive(Debug)]
struct Cache<const LINES: usize> {
    /// The number of the line in each place.
    lines: [u32; LINES],
    /// The place that was used next after each, and the one before it: a ring, in which the one used the longest time
    /// ago comes after the one used last.
    newer: [u8; LINES],
    older: [u8; LINES],
    last: u8,
    /// In which place a line is, if it is in any, by its number modulo `INDEX`.
    index: Vec<u8>,
}

impl<const LINES: usize> Cache<LINES> {
    fn new() -> Self {
        let next = |place: usize, by: usize| ((place + by) % LINES) as u8;
        Self {
            lines: [NONE; LINES],
            newer: array::from_fn(|place| next(place, 1)),
            older: array::from_fn(|place| next(place, LINES - 1)),
            last: 0,
            index: vec![0; INDEX],
        }
    }

    /// Whether the line is there; it is used now.
    fn has(&mut self, line: u32) -> bool {
        let place = self.index[line as usize % INDEX];
        if self.lines[usize::from(place)] != line {
            return false;
        }
        if place != self.last {
            let (older, newer) = (self.older[usize::from(place)], self.newer[usize::from(place)]);
            self.join(older, newer);
            let oldest = self.newer[usize::from(self.last)];
            self.join(self.last, place);
            self.join(place, oldest);
            self.last = place;
        }
        true
    }

    /// Puts a line in the place of the one that was used the longest time ago.
    fn put(&mut self, line: u32) {
        self.last = self.newer[usize::from(self.last)];
        self.lines[usize::from(self.last)] = line;
        self.index[line as usize % INDEX] = self.last;
    }

    /// Of two places one is used next after the other.
    fn join(&mut self, older: u8, newer: u8) {
        self.newer[usize::from(older)] = newer;
        self.older[usize::from(newer)] = older;
    }
}

/// The accelerator.
#[derive(Debug)]
pub(super) struct Accelerator {
    setup: Setup,
    /// The line with the last instruction.
    line: u32,
    /// The next one, and when it is there.
    ahead: (u32, Cycles),
    instructions: Cache<INSTRUCTIONS>,
    data: Cache<DATA>,
}

impl Accelerator {
    /// As after a reset: no wait states, all off.
    pub(super) fn new() -> Self {
        let (instructions, data) = (Cache::new(), Cache::new());
        Self { setup: Setup::default(), line: NONE, ahead: (NONE, NEVER), instructions, data }
    }

    /// Takes over what has been set up.
    #[inline]
    pub(super) fn set_up(&mut self, setup: Setup) {
        if setup == self.setup {
            return;
        }
        let [instructions, data] = setup.emptied;
        if self.setup.emptied[0] != instructions {
            self.instructions = Cache::new();
        }
        if self.setup.emptied[1] != data {
            self.data = Cache::new();
        }
        self.ahead = (NONE, NEVER);
        self.setup = setup;
    }

    /// An instruction at `address` is fetched at `now`. Gives the cycles that the core waits for it.
    #[inline]
    pub(super) fn fetch(&mut self, address: u32, bytes: u32, now: Cycles) -> Cycles {
        let (first, last) = (address / LINE, (address + bytes - 1) / LINE);
        if last == self.line {
            return 0;
        }
        self.fetch_lines(first, last, now)
    }

    #[inline(never)]
    fn fetch_lines(&mut self, first: u32, last: u32, now: Cycles) -> Cycles {
        let (before, mut stall) = (self.line, 0);
        if self.setup.wait_states != 0 {
            for line in (first..=last).filter(|line| *line != before) {
                stall += self.turn_to(line, now + stall);
            }
        }
        self.line = last;
        stall
    }

    /// The core goes on in another line. Gives the cycles that it waits for it.
    fn turn_to(&mut self, line: u32, now: Cycles) -> Cycles {
        let wait = Cycles::from(self.setup.wait_states);
        let stall = match self.ahead {
            (ahead, ready) if ahead == line => ready.saturating_sub(now).min(wait),
            _ => wait,
        };
        let stall = if stall == 0 || self.setup.instruction_cache && self.instructions.has(line) { 0 } else { stall };
        if stall != 0 && self.setup.instruction_cache {
            self.instructions.put(line);
        }
        if self.setup.prefetch {
            self.ahead = (line + 1, now + stall + wait + 1);
        }
        stall
    }

    /// Data at `address` are read. Gives the cycles that the core waits for them.
    #[inline]
    pub(super) fn load(&mut self, address: u32) -> Cycles {
        if self.setup.wait_states == 0 {
            return 0;
        }
        let line = address / LINE;
        if self.setup.data_cache {
            if self.data.has(line) {
                return 0;
            }
            self.data.put(line);
        }
        self.setup.wait_states.into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ALL: Setup =
        Setup { wait_states: 5, prefetch: true, instruction_cache: true, data_cache: true, emptied: [0; 2] };
    const NOTHING: Setup = Setup { prefetch: false, instruction_cache: false, data_cache: false, ..ALL };

    fn accelerator(setup: Setup) -> Accelerator {
        let mut accelerator = Accelerator::new();
        accelerator.set_up(setup);
        accelerator
    }

    /// Fetches instructions of one cycle each. Gives the stalls; time goes on with them.
    fn run(accelerator: &mut Accelerator, now: &mut Cycles, from: u32, lines: u32, bytes: u32) -> Cycles {
        let mut stalls = 0;
        for address in (from..from + lines * LINE).step_by(bytes as usize) {
            let stall = accelerator.fetch(address, bytes, *now);
            *now += stall + 1;
            stalls += stall;
        }
        stalls
    }

    #[test]
    fn without_the_accelerator_each_line_costs_its_wait_states() {
        let mut accelerator = accelerator(NOTHING);
        for _ in 0..2 {
            assert_eq!(run(&mut accelerator, &mut 0, 0, 10, 2), 10 * 5);
        }
        assert_eq!((accelerator.load(0x1000), accelerator.load(0x1000)), (5, 5));
        let mut fast = Accelerator::new();
        assert_eq!(run(&mut fast, &mut 0, 0, 10, 2), 0);
    }

    #[test]
    fn straight_code_waits_for_the_first_line_and_for_what_prefetch_does_not_manage() {
        let prefetch = Setup { prefetch: true, ..NOTHING };
        // Eight instructions of a cycle each, and a line takes six: there is time to spare.
        assert_eq!(run(&mut accelerator(prefetch), &mut 0, 0, 10, 2), 5);
        // Four instructions: two cycles are missing each time.
        assert_eq!(run(&mut accelerator(prefetch), &mut 0, 0, 10, 4), 5 + 9 * 2);
    }

    #[test]
    fn a_loop_in_the_cache_stalls_in_its_first_round_only() {
        let cached = Setup { instruction_cache: true, ..NOTHING };
        let (mut accelerator, mut now) = (accelerator(cached), 0);
        assert_eq!(run(&mut accelerator, &mut now, 0, 64, 2), 64 * 5);
        assert_eq!(run(&mut accelerator, &mut now, 0, 64, 2), 0);
        // A line more, and the line wanted next is always the one that has just gone.
        assert_eq!(run(&mut accelerator, &mut now, 64 * LINE, 1, 2), 5);
        assert_eq!(run(&mut accelerator, &mut now, 0, 65, 2), 65 * 5);
    }

    #[test]
    fn a_branch_to_a_line_that_is_nowhere_costs_the_wait_states() {
        let (mut accelerator, mut now) = (accelerator(ALL), 0);
        assert_eq!(accelerator.fetch(0x100, 2, now), 5);
        now += 20;
        assert_eq!(accelerator.fetch(0x800, 2, now), 5);
        // Back, and forth again: both are in the cache.
        assert_eq!((accelerator.fetch(0x100, 2, now), accelerator.fetch(0x800, 2, now)), (0, 0));
        // An instruction over the end of its line: the next line has been prefetched, or not yet.
        assert_eq!(accelerator.fetch(0x80E, 4, now + 20), 0);
        assert_eq!(accelerator.fetch(0x90E, 4, now), 5 + 5);
    }

    #[test]
    fn the_line_goes_that_has_not_been_used_for_the_longest_time() {
        let mut accelerator = accelerator(ALL);
        let mut load = |line: u32| accelerator.load(0x4000 + line * LINE);
        for line in 0..8 {
            assert_eq!(load(line), 5);
        }
        // The oldest, the latest, and one between them are used again: 1 is the oldest now, then 2, 4, 5, 6, 0, 7, 3.
        assert_eq!([0, 7, 3].map(&mut load), [0; 3]);
        assert_eq!([8, 9].map(&mut load), [5; 2]);
        assert_eq!([0, 3, 4, 5, 6, 7].map(&mut load), [0; 6]);
        assert_eq!([1, 2].map(&mut load), [5; 2]);
    }

    #[test]
    fn literals_come_from_eight_lines_and_emptied_caches_begin_anew() {
        let mut accelerator = accelerator(ALL);
        let round = |accelerator: &mut Accelerator, lines: u32| -> Cycles {
            (0..lines).map(|line| accelerator.load(0x4000 + line * LINE + 4)).sum()
        };
        assert_eq!((round(&mut accelerator, 8), round(&mut accelerator, 8)), (8 * 5, 0));
        assert_eq!((round(&mut accelerator, 9), round(&mut accelerator, 9)), (5, 9 * 5));
        assert_eq!(accelerator.fetch(0, 2, 0), 5);
        assert_eq!((accelerator.fetch(0x100, 2, 0), accelerator.fetch(0, 2, 0)), (5, 0));
        accelerator.set_up(Setup { emptied: [1, 1], ..ALL });
        assert_eq!((accelerator.fetch(0x100, 2, 0), accelerator.load(0x4084)), (5, 5));
    }
}
