//! The recording of a run for the plot: the lowest and the highest value of each quantity per slice of time. When
//! there are too many slices, each two are joined, so that memory stays bounded.

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::State;

use tmcm_sim::NativeModule;

/// Most slices: more than a plot has pixels.
const MOST: usize = 4096;
/// Most kinds of marks: a slice has one bit for each.
const KINDS: usize = 16;

/// A quantity of the module or its world that is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// Actual position in microsteps.
    Position,
    /// Target position in microsteps; no value outside of positioning moves.
    Target,
    /// Actual speed in internal velocity units.
    Velocity,
    /// stallGuard2 load value (axis parameter 206).
    Load,
    /// Motor current in 1/32 of full scale.
    Current,
    /// 1 while the program is in a WAIT. The channels that follow are 1 while an output or switch is on.
    Waiting,
    Out0,
    Out1,
    Left,
    Right,
    Home,
}

impl Channel {
    /// Number of channels.
    const COUNT: usize = Channel::Home as usize + 1;
}

/// An event in the course of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Mark {
    /// The handler of an interrupt, which is at this address, begins.
    Handler(u16),
    /// A command was refused.
    Refused,
    /// The program has ended.
    Stop,
}

/// A slice of time with the ranges of all channels and the marks within it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Slice {
    ranges: [Option<(i32, i32)>; Channel::COUNT],
    marks: u16,
}

impl Slice {
    /// The lowest and the highest value of a channel in this slice; `None` if there was no value.
    pub(super) fn range(&self, channel: Channel) -> Option<(i32, i32)> {
        self.ranges.get(channel as usize).copied().flatten()
    }

    fn join(&mut self, other: &Self) {
        for (range, other) in self.ranges.iter_mut().zip(other.ranges) {
            *range = joined(*range, other);
        }
        self.marks |= other.marks;
    }
}

/// The smallest range that contains both ranges.
pub(super) fn joined(a: Option<(i32, i32)>, b: Option<(i32, i32)>) -> Option<(i32, i32)> {
    match (a, b) {
        (Some((low, high)), Some((lower, higher))) => Some((low.min(lower), high.max(higher))),
        (a, b) => a.or(b),
    }
}

/// The recording of a run.
#[derive(Clone, Debug)]
pub(super) struct Recording {
    /// Length of a slice in nanoseconds.
    pub(super) interval: Nanos,
    /// The slices from the start of the program on.
    pub(super) slices: Vec<Slice>,
    /// Kinds of marks, in the order of their first appearance.
    pub(super) kinds: Vec<Mark>,
    /// Texts of the events of option `--at`, with their times.
    pub(super) notes: Vec<(Nanos, String)>,
}

impl Recording {
    pub(super) fn new() -> Self {
        Recording { interval: MILLISECOND, slices: Vec::new(), kinds: Vec::new(), notes: Vec::new() }
    }

    /// Records the values at a time since the start. They are read from the model, which takes no virtual time.
    pub(super) fn sample(&mut self, at: Nanos, module: &NativeModule) {
        let state = State::of(&module.board().borrow());
        let (position, target) = module.position(0).unzip();
        let waiting = module.machine().is_some_and(|machine| machine.wait().is_some());
        let on = |output: usize| state.outputs.get(output).copied().unwrap_or_default().into();
        let mut sample = Slice::default();
        let values = [
            (Channel::Position, position),
            (Channel::Target, target.flatten()),
            (Channel::Velocity, Some(state.first.velocity)),
            (Channel::Load, Some(state.first.stall_guard.into())),
            (Channel::Current, Some(state.first.current.cast_signed())),
            (Channel::Waiting, Some(waiting.into())),
            (Channel::Out0, Some(on(0))),
            (Channel::Out1, Some(on(1))),
            (Channel::Left, Some(state.first.switches.left.into())),
            (Channel::Right, Some(state.first.switches.right.into())),
            (Channel::Home, Some(state.first.switches.home.into())),
        ];
        for (channel, value) in values {
            if let Some(range) = sample.ranges.get_mut(channel as usize) {
                *range = value.map(|value| (value, value));
            }
        }
        self.slice(at).join(&sample);
    }

    /// Records an event at a time since the start.
    pub(super) fn mark(&mut self, at: Nanos, mark: Mark) {
        let known = self.kinds.iter().position(|kind| *kind == mark);
        // Further kinds than a slice has bits for are not recorded.
        if known.is_none() && self.kinds.len() < KINDS {
            self.kinds.push(mark);
        }
        if let Some(kind) = known.or_else(|| self.kinds.iter().position(|kind| *kind == mark)) {
            self.slice(at).marks |= 1 << kind;
        }
    }

    /// Indices of the slices that contain a mark.
    pub(super) fn marked(&self, mark: Mark) -> impl Iterator<Item = usize> {
        let bit = self.kinds.iter().position(|kind| *kind == mark).map_or(0, |kind| 1 << kind);
        self.slices.iter().enumerate().filter(move |(_, slice)| slice.marks & bit != 0).map(|(index, _)| index)
    }

    /// The slice that contains a time.
    fn slice(&mut self, at: Nanos) -> &mut Slice {
        while at / self.interval >= MOST as Nanos {
            self.interval *= 2;
            let pairs = self.slices.chunks(2).map(|pair| {
                let mut joined = Slice::default();
                pair.iter().for_each(|slice| joined.join(slice));
                joined
            });
            self.slices = pairs.collect();
        }
        let index = (at / self.interval) as usize;
        if index >= self.slices.len() {
            self.slices.resize(index + 1, Slice::default());
        }
        &mut self.slices[index]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use hal_sim::clock::SECOND;
    use hal_sim::world::config::WorldConfig;

    #[test]
    fn long_runs_stay_small_and_keep_their_extremes() {
        let mut recording = Recording::new();
        for millisecond in 0..20_000_u64 {
            let value = if millisecond == 12_345 { 99 } else { 1 };
            let at = millisecond * MILLISECOND;
            recording.slice(at).join(&Slice { ranges: [Some((value, value)); _], marks: 0 });
        }
        recording.mark(12_345 * MILLISECOND, Mark::Handler(7));
        recording.mark(0, Mark::Stop);
        assert_eq!(recording.interval, 8 * MILLISECOND);
        assert_eq!(recording.slices.len(), 2_500);
        assert_eq!(recording.slices[1543].range(Channel::Load), Some((1, 99)));
        assert_eq!(recording.slices[1544].range(Channel::Load), Some((1, 1)));
        assert_eq!(recording.marked(Mark::Handler(7)).collect::<Vec<_>>(), [1543]);
        assert_eq!(recording.marked(Mark::Stop).collect::<Vec<_>>(), [0]);
        assert_eq!(recording.marked(Mark::Refused).count(), 0);
    }

    #[test]
    fn a_module_is_looked_at_from_outside() {
        let mut recording = Recording::new();
        let module = NativeModule::new(&WorldConfig::default(), None, 1);
        recording.sample(2 * SECOND, &module);
        let slice = recording.slices[2000];
        assert_eq!([Channel::Position, Channel::Target].map(|channel| slice.range(channel)), [Some((0, 0)); 2]);
        assert_eq!(recording.slices[0], Slice::default());
    }
}
