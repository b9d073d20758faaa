//! The recording of a run for the plot: the lowest and the highest value of each quantity per slice of time. When
//! there are too many slices, each two are joined, so that memory stays bounded.

use hal_sim::clock::{MILLISECOND, Nanos};
use hal_sim::control::State;
use tmcm_sim::NativeModule;

use super::rotor::elsewhere;
use crate::calc;
use crate::product::Product;

/// Most slices: more than a plot has pixels.
const MOST: usize = 4096;
/// Most kinds of marks: a slice has one bit for each.
const KINDS: usize = 16;

/// A quantity of an axis that is recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Quantity {
    /// Actual position in microsteps.
    Position,
    /// Target position in microsteps; no value outside of positioning moves.
    Target,
    /// Actual speed, in the unit that speeds of the product are in.
    Velocity,
    /// Position of the rotor in microsteps; no value while it is where the counter says.
    Rotor,
    /// stallGuard2 load value (axis parameter 206); no value while the motor stands, because it says nothing then.
    Load,
    /// Motor current in 1/32 of full scale.
    Current,
    /// 1 while a switch is on.
    Left,
    Right,
    Home,
}

impl Quantity {
    /// Number of quantities.
    const COUNT: usize = Quantity::Home as usize + 1;
}

/// A value that is recorded of the module and its world.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Channel {
    /// A quantity of the axis with this number.
    Of(usize, Quantity),
    /// 1 while the output with this number is on.
    Output(usize),
    /// 1 while the digital input with this number is high.
    Input(usize),
    /// 1 while the ENABLE input is high.
    Enable,
    /// 1 while the program is in a WAIT.
    Waiting,
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
    /// The motor of an axis has fallen out of step: its torque did not do.
    OutOfStep(usize),
}

/// The lowest and the highest value of a channel; `None` if there was no value.
pub(super) type Range = Option<(i32, i32)>;

/// A slice of time with the ranges of all channels and the marks within it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Slice {
    ranges: Vec<Range>,
    marks: u16,
}

impl Slice {
    fn empty(channels: usize) -> Self {
        Slice { ranges: vec![None; channels], marks: 0 }
    }

    fn join(&mut self, other: &Self) {
        for (range, other) in self.ranges.iter_mut().zip(&other.ranges) {
            *range = joined(*range, *other);
        }
        self.marks |= other.marks;
    }
}

/// The smallest range that contains both ranges.
pub(super) fn joined(a: Range, b: Range) -> Range {
    match (a, b) {
        (Some((low, high)), Some((lower, higher))) => Some((low.min(lower), high.max(higher))),
        (a, b) => a.or(b),
    }
}

/// The recording of a run.
#[derive(Clone, Debug)]
pub struct Recording {
    /// Length of a slice in nanoseconds.
    pub(super) interval: Nanos,
    /// The product that the module is.
    pub(super) product: Product,
    /// Number of axes of the module.
    pub(super) axes: usize,
    /// Number of outputs of the module.
    pub(super) outputs: usize,
    /// Number of digital inputs of the module, without ENABLE.
    pub(super) inputs: usize,
    /// The slices from the start of the program on.
    slices: Vec<Slice>,
    /// Kinds of marks, in the order of their first appearance.
    pub(super) kinds: Vec<Mark>,
    /// Texts of the events of option `--at`, with their times.
    pub(super) notes: Vec<(Nanos, String)>,
    /// The motors that followed their fields at the last sample, by axis.
    followed: Vec<bool>,
}

impl Recording {
    /// The recording of a module.
    pub fn new(product: Product) -> Self {
        let [axes, outputs] = [product.spec().axes, product.spec().outputs].map(usize::from);
        let (interval, inputs) = (MILLISECOND, product.kind().inputs.len());
        Recording {
            interval,
            product,
            axes,
            outputs,
            inputs,
            slices: Vec::new(),
            kinds: Vec::new(),
            notes: Vec::new(),
            followed: vec![false; axes],
        }
    }

    /// The number of slices.
    pub(super) fn len(&self) -> usize {
        self.slices.len()
    }

    /// The ranges of a channel, slice by slice.
    pub(super) fn ranges(&self, channel: Channel) -> impl Iterator<Item = Range> {
        let index = self.index(channel);
        self.slices.iter().map(move |slice| slice.ranges.get(index).copied().flatten())
    }

    /// The lowest and the highest value of a channel in the whole recording.
    pub(super) fn range(&self, channel: Channel) -> Range {
        self.ranges(channel).fold(None, joined)
    }

    /// The place of a channel in a slice.
    fn index(&self, channel: Channel) -> usize {
        match channel {
            Channel::Waiting => 0,
            Channel::Enable => 1,
            Channel::Output(number) => 2 + number,
            Channel::Input(number) => 2 + self.outputs + number,
            Channel::Of(axis, quantity) => 2 + self.outputs + self.inputs + axis * Quantity::COUNT + quantity as usize,
        }
    }

    /// Number of channels: one behind the last channel.
    fn channels(&self) -> usize {
        self.index(Channel::Of(self.axes, Quantity::Position))
    }

    /// Records the values at a time since the start. They are read from the model, which takes no virtual time.
    pub(super) fn sample(&mut self, at: Nanos, module: &mut NativeModule) {
        let state = State::of(&module.board().borrow());
        let mut sample = Slice::empty(self.channels());
        let mut record = |channel: Channel, value: Option<i32>| {
            if let Some(range) = sample.ranges.get_mut(self.index(channel)) {
                *range = value.map(|value| (value, value));
            }
        };
        for (number, axis) in state.axes.iter().enumerate() {
            let (position, target) = module.position(number).unzip();
            let rotor = position.and_then(|position| elsewhere(module, self.product, number, position, axis));
            let turns = axis.velocity != 0;
            let values = [
                (Quantity::Rotor, rotor),
                (Quantity::Position, position),
                (Quantity::Target, target.flatten()),
                (Quantity::Velocity, Some(calc::in_usual_unit(self.product, axis.velocity))),
                (Quantity::Load, turns.then(|| axis.stall_guard.into())),
                (Quantity::Current, Some(axis.current.cast_signed())),
                (Quantity::Left, Some(axis.switches.left.into())),
                (Quantity::Right, Some(axis.switches.right.into())),
                (Quantity::Home, Some(axis.switches.home.into())),
            ];
            for (quantity, value) in values {
                record(Channel::Of(number, quantity), value);
            }
        }
        for (number, on) in state.outputs.iter().enumerate() {
            record(Channel::Output(number), Some((*on).into()));
        }
        for (number, high) in state.inputs.iter().enumerate() {
            record(Channel::Input(number), Some((*high).into()));
        }
        record(Channel::Enable, state.enable.map(i32::from));
        let waiting = module.machine().is_some_and(|machine| machine.wait().is_some());
        record(Channel::Waiting, Some(waiting.into()));
        self.slice(at).join(&sample);
        for axis in 0..self.axes {
            let (follows, is_driven) = {
                let board = module.board().borrow();
                let motor = board.world().axis(axis).motor();
                (motor.is_following(), motor.available() > 0)
            };
            let followed = self.followed.get_mut(axis).map(|before| std::mem::replace(before, follows));
            if followed == Some(true) && !follows && is_driven {
                self.mark(at, Mark::OutOfStep(axis));
            }
        }
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
        let channels = self.channels();
        while at / self.interval >= MOST as Nanos {
            self.interval *= 2;
            let pairs = self.slices.chunks(2).map(|pair| {
                let mut joined = Slice::empty(channels);
                pair.iter().for_each(|slice| joined.join(slice));
                joined
            });
            self.slices = pairs.collect();
        }
        let index = (at / self.interval) as usize;
        if index >= self.slices.len() {
            self.slices.resize(index + 1, Slice::empty(channels));
        }
        &mut self.slices[index]
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use hal_sim::clock::SECOND;
    use hal_sim::world::config::WorldConfig;

    use super::*;

    #[test]
    fn long_runs_stay_small_and_keep_their_extremes() {
        let mut recording = Recording::new(Product::Tmcm3110);
        let load = Channel::Of(1, Quantity::Load);
        for millisecond in 0..20_000_u64 {
            let value = if millisecond == 12_345 { 99 } else { 1 };
            let at = millisecond * MILLISECOND;
            let ranges = vec![Some((value, value)); recording.channels()];
            recording.slice(at).join(&Slice { ranges, marks: 0 });
        }
        recording.mark(12_345 * MILLISECOND, Mark::Handler(7));
        recording.mark(0, Mark::Stop);
        assert_eq!(recording.interval, 8 * MILLISECOND);
        assert_eq!(recording.len(), 2_500);
        let ranges: Vec<Range> = recording.ranges(load).collect();
        assert_eq!(ranges[1543..1545], [Some((1, 99)), Some((1, 1))]);
        assert_eq!(recording.range(load), Some((1, 99)));
        assert_eq!(recording.marked(Mark::Handler(7)).collect::<Vec<_>>(), [1543]);
        assert_eq!(recording.marked(Mark::Stop).collect::<Vec<_>>(), [0]);
        assert_eq!(recording.marked(Mark::Refused).count(), 0);
    }

    #[test]
    fn a_module_is_looked_at_from_outside() {
        let mut recording = Recording::new(Product::Tmcm1140);
        let mut module = NativeModule::new(&WorldConfig::default(), None, 1);
        recording.sample(2 * SECOND, &mut module);
        for quantity in [Quantity::Position, Quantity::Target] {
            let ranges: Vec<Range> = recording.ranges(Channel::Of(0, quantity)).collect();
            assert_eq!((ranges[2000], ranges[0]), (Some((0, 0)), None));
        }
    }

    /// No two channels share a place, and all have one.
    #[test]
    fn each_channel_has_a_place_of_its_own() {
        let recording = Recording::new(Product::Tmcm6110);
        let quantities = [Quantity::Position, Quantity::Target, Quantity::Home];
        let channels = (0..6).flat_map(|axis| quantities.map(|quantity| Channel::Of(axis, quantity)));
        let channels = channels.chain((0..8).flat_map(|number| [Channel::Output(number), Channel::Input(number)]));
        let channels = channels.chain([Channel::Waiting, Channel::Enable]);
        let places: BTreeSet<usize> = channels.map(|channel| recording.index(channel)).collect();
        assert_eq!((places.len(), recording.channels()), (6 * 3 + 2 * 8 + 2, 6 * 9 + 2 * 8 + 2));
        assert!(places.iter().all(|place| *place < recording.channels()));
    }
}
