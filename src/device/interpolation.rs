//! Linear interpolation: several axes begin to move at once, each for itself or on a straight line.
//!
//! On a line the axis that takes longest at its own speed and acceleration leads. It moves as it would alone, or slower
//! where another axis of the line could not follow. The others, its followers, get its speed and acceleration in the
//! ratio of their ways. Ramp generators take whole numbers only, so a follower is held to the line on the way. Once in
//! each millisecond what it has left to go is compared with what its leader has left. The speed limit of one of the
//! followers is written anew if it has to be another.
//!
//! An axis belongs to its line until it arrives or is told something else; then the others go on by themselves. If it
//! is stopped before its target, by a switch, a stall or its driver, the others are stopped along their ramps: they
//! would leave the line.

use super::{Circuit, Device, ShapeOf};
use crate::motion::{Axis, Error, Events, Pace, Ratio, Shape, Slope, Slopes, root};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// The lag of a follower, in 1/256 microstep, that is left to itself: what is read are whole microsteps.
const SLACK: i32 = 192;
/// The largest lag, in 1/256 microstep, by which the correction of a follower's speed grows.
const LARGEST_LAG: i64 = 1 << 16;
/// How far ahead of an accelerating leader its speed is looked at, in microsteps and besides a quarter of its way:
/// until the next correction it gains speed.
const AHEAD: u32 = 64;
/// The last microsteps of a follower, in which it has its own acceleration in place of the leader's in the ratio. A
/// slow axis needs that to make each of them in time.
const TAIL: u32 = 4;

/// The straight lines that are under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interpolations<const AXES: usize> {
    /// The followers, by axis.
    followers: [Option<Follower>; AXES],
    /// The axis that is corrected first in the next millisecond: only one is in each.
    next: usize,
    /// The leaders and the followers as of the last millisecond, axis n in bit n; and those of a line that has begun
    /// since.
    pub(super) members: u8,
}

impl<const AXES: usize> Default for Interpolations<AXES> {
    fn default() -> Self {
        Interpolations { followers: [None; AXES], next: 0, members: 0 }
    }
}

impl<const AXES: usize> Interpolations<AXES> {
    /// Counts the members.
    fn count(&mut self) {
        let bit = |number: usize| 1_u8.unbounded_shl(number as u32);
        let bits = self
            .followers
            .iter()
            .enumerate()
            .filter_map(|(number, follower)| follower.map(|follower| bit(number) | bit(follower.leader)));
        self.members = bits.fold(0, |all, bits| all | bits);
    }
}

/// An axis that follows the leader of its line.
#[derive(Clone, Copy, Debug)]
struct Follower {
    /// The number of the leader.
    leader: usize,
    /// The way of the follower to that of the leader.
    ratio: Ratio,
    /// The way of the leader from rest to its target, in microsteps. One that moved when the line began counts as
    /// having come from rest.
    way: u32,
    /// How the leader's speed grows with its way from rest, and falls with its way to rest.
    up: Slope,
    down: Slope,
    /// The microsteps that the leader has left at most when the follower makes its last one.
    last: u32,
}

impl Follower {
    /// The speed at which a follower with ramps of the shape `S` is to go on that has `own` microsteps left, while its
    /// leader has `left`. `top` is the speed of the leader between its ramps, `most` the largest one of the follower,
    /// and `correction` that of [`Axis::correction`].
    fn speed<S: Shape>(&self, own: u32, left: u32, top: u32, most: i32, correction: impl Fn(i32) -> i32) -> i32 {
        if own <= 1 {
            return if left > self.last { 0 } else { most };
        }
        // The leader's speed follows from its way.
        let come = self.way.saturating_sub(left);
        let ahead = come.saturating_add(come / 4).saturating_add(AHEAD);
        let square = self.up.square(ahead).min(self.down.square(left)) >> 8;
        let square = square.min(u64::from(top).wrapping_mul(top.into()));
        let speed = self.ratio.times(root(square << 8)) >> 4;
        // A lag as large as this is as good as any larger one.
        let lag = (u64::from(own) << 8).wrapping_sub(self.ratio.times(left)) as i64;
        let lag = lag.clamp(-LARGEST_LAG, LARGEST_LAG) as i32;
        let slack = SLACK.max(self.ratio.times(1).min(LARGEST_LAG as u64) as i32);
        let slack = slack.saturating_add(S::skew((speed >> 8) as i32));
        let lag = lag.wrapping_sub(slack).max(0).wrapping_add(lag.wrapping_add(slack).min(0));
        let speed = (speed as i32).wrapping_add(correction(lag)).wrapping_add(128) >> 8;
        speed.max(0).min(most)
    }
}

/// How long a motor takes, from rest to rest, in 1/65536 of the time in which it makes a microstep at speed 1.
fn duration(way: u32, speed: i32, square: u32) -> u64 {
    // The speed in the middle of the way, if the motor does not reach the other one before.
    let highest = root(u64::from(way).wrapping_mul(square.into()) >> 9);
    let speed = speed.unsigned_abs().min(highest);
    // Between the ramps the motor goes at its speed; the ramps take as long again as they would at that.
    let steady = (u64::from(way) << 16).checked_div(speed.into());
    let ramps = (u64::from(speed) << 25).checked_div(square.into());
    steady.zip(ramps).map_or(u64::MAX, |(steady, ramps)| steady.wrapping_add(ramps))
}

/// The paces of axes, by axis.
type Paces<T, const AXES: usize> = [Pace<ShapeOf<T>>; AXES];

/// True if an axis has a target.
fn is_sent<const AXES: usize>(targets: &[Option<i32>; AXES], number: usize) -> bool {
    targets.get(number).is_some_and(Option::is_some)
}

impl<T: Circuit, const AXES: usize> Device<T, AXES> {
    /// Sends axes to positions, `targets` by axis, so that they begin to move at once. To be called within a
    /// [`command`](Self::command), which makes up for what a chip does not take.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn start_together(&mut self, now: Micros, targets: &[Option<i32>; AXES]) -> Result<(), Error> {
        self.leave_interpolations(|number| is_sent(targets, number))?;
        self.set_going(now, targets, &[Pace::default(); AXES])
    }

    /// Sends axes to positions, `targets` by axis, on a straight line: they arrive at once. All of them have
    /// trapezoidal ramps there, and afterwards. To be called within a [`command`](Self::command), which makes up for
    /// what a chip does not take.
    ///
    /// # Errors
    /// [`Error::NotNow`] when they have different units of speed or acceleration; then nothing moves. [`Error::Chip`]
    /// when a chip did not take a datagram.
    pub fn start_interpolation(&mut self, now: Micros, targets: &[Option<i32>; AXES]) -> Result<(), Error> {
        let mut ways = [0; AXES];
        let (mut first, mut moving, mut travellers) = (None, false, 0_u8);
        // The axis that would take longest alone; of several the one with the longest way.
        let (mut leader, mut longest) = (0, (0, 0));
        for (number, (target, way)) in targets.iter().zip(&mut ways).enumerate() {
            let Some(target) = target else { continue };
            if !self.have_same_units(*first.get_or_insert(number), number) {
                return Err(Error::NotNow);
            }
            let Some(mut axis) = self.axis(number) else { continue };
            if !axis.state().rests() {
                axis.actual_position()?;
                moving |= axis.read(P::ActualSpeed)? != 0;
            }
            *way = target.wrapping_sub(axis.state().last_position()).unsigned_abs();
            if *way == 0 {
                continue;
            }
            travellers = travellers.saturating_add(1);
            let Slopes { up, .. } =
                axis.state().slopes(&axis.state().shape(), axis.state().setting(P::MaximumAcceleration));
            let rank = (duration(*way, axis.state().setting(P::MaximumSpeed), up.main()), *way);
            if rank > longest {
                (leader, longest) = (number, rank);
            }
        }
        self.leave_interpolations(|number| is_sent(targets, number))?;
        let mut paces = [Pace::default(); AXES];
        // One axis that has a way to go moves as it would alone.
        if travellers > 1 {
            let whole = longest.1;
            for (number, (follower, way)) in self.interpolations.followers.iter_mut().zip(ways).enumerate() {
                if way != 0 && number != leader {
                    let ratio = Ratio::new(way, whole);
                    let (up, down) = (Slope::default(), Slope::default());
                    *follower = Some(Follower { leader, ratio, way: whole, up, down, last: 0 });
                }
            }
            self.interpolations.count();
            self.pace(leader, &mut paces);
            if moving {
                self.join_moving(leader, &mut paces);
            }
        }
        self.set_going(now, targets, &paces)
    }

    /// True if the speeds and accelerations of two axes are in the same units.
    fn have_same_units(&self, one: usize, other: usize) -> bool {
        let (Some(one), Some(other)) = (self.axes.get(one), self.axes.get(other)) else { return false };
        ShapeOf::<T>::UNITS.iter().all(|parameter| one.setting(*parameter) == other.setting(*parameter))
    }

    /// Changes what was worked out for axes that stand. One that moves may be where it has to turn round, or to catch
    /// up, so the axes keep their own accelerations. A leader that moves has a way behind it as if it had come from
    /// rest.
    fn join_moving(&mut self, leader: usize, paces: &mut Paces<T, AXES>) {
        for pace in paces {
            (pace.acceleration, pace.shape) = (None, None);
        }
        let speed = self.axes.get(leader).map_or(0, Axis::last_speed).unsigned_abs();
        for follower in self.interpolations.followers.iter_mut().flatten().filter(|follower| follower.leader == leader)
        {
            follower.way = follower.way.saturating_add(follower.up.way(speed));
        }
    }

    /// Works out at what paces the axes of a line are to go, as their parameters are now.
    fn pace(&mut self, leader: usize, paces: &mut Paces<T, AXES>) {
        let Some(axis) = self.axes.get(leader) else { return };
        let mut speed = axis.setting(P::MaximumSpeed);
        let mut acceleration = axis.setting(P::MaximumAcceleration).max(1);
        let mut shape = axis.shape();
        let followers = &mut self.interpolations.followers;
        for (follower, axis) in followers.iter().zip(&self.axes) {
            let Some(Follower { ratio, .. }) = follower.filter(|follower| follower.leader == leader) else { continue };
            speed = ratio.limit(axis.setting(P::MaximumSpeed), speed);
            acceleration = ratio.limit(axis.setting(P::MaximumAcceleration).max(1), acceleration);
            shape.limit(ratio, &axis.shape());
        }
        let Slopes { acceleration, up, down } = axis.slopes(&shape, acceleration);
        for (number, ((follower, axis), pace)) in followers.iter_mut().zip(&self.axes).zip(paces).enumerate() {
            if number == leader {
                *pace = Pace { speed: Some(speed), acceleration: Some(acceleration), shape: Some(shape) };
            }
            let Some(follower) = follower.as_mut().filter(|follower| follower.leader == leader) else { continue };
            let (own, own_shape) = (axis.setting(P::MaximumAcceleration).max(1), axis.shape());
            let shape = shape.scaled(follower.ratio, &own_shape);
            let wanted = axis.slopes(&shape, follower.ratio.up(acceleration, own)).acceleration;
            let speed = follower.ratio.up(speed, axis.setting(P::MaximumSpeed));
            *pace = Pace { speed: Some(speed), acceleration: Some(wanted), shape: Some(shape) };
            // From rest it makes the microstep in the time in which the leader, which comes to rest, makes so many. Of
            // its last ones the leader makes two more while the follower's speed limit is written.
            (follower.up, follower.down) = (up, down);
            let own = axis.slopes(&own_shape, own).down.foot();
            follower.last = down.foot().checked_div(own).unwrap_or_default().saturating_add(2);
        }
    }

    /// Brings the line to which an axis belongs, or of which it is the last one, to parameters 4 and 5 as they are now.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn repace(&mut self, number: usize) -> Result<(), Error> {
        let Some(leader) = self.leader(number) else {
            let alone = self.axis(number).filter(|axis| axis.state().limited());
            return alone.map_or(Ok(()), |mut axis| axis.repace(Pace::default()));
        };
        let mut paces = [Pace::default(); AXES];
        self.pace(leader, &mut paces);
        for (number, pace) in paces.into_iter().enumerate() {
            if pace.speed.is_some()
                && let Some(mut axis) = self.axis(number).filter(|axis| axis.state().limited())
            {
                axis.repace(pace)?;
            }
        }
        Ok(())
    }

    /// True if an axis belongs to a line.
    pub(super) fn is_interpolated(&self, number: usize) -> bool {
        self.interpolations.members.unbounded_shr(number as u32) & 1 != 0
    }

    /// The leader of the line to which an axis belongs.
    fn leader(&self, number: usize) -> Option<usize> {
        match self.interpolations.followers.get(number)? {
            Some(follower) => Some(follower.leader),
            None => self
                .interpolations
                .followers
                .iter()
                .flatten()
                .any(|follower| follower.leader == number)
                .then_some(number),
        }
    }

    /// Sets axes going at once: all that has to be told their chips comes before, so that one datagram to each of them
    /// is left.
    fn set_going(&mut self, now: Micros, targets: &[Option<i32>; AXES], paces: &Paces<T, AXES>) -> Result<(), Error> {
        for is_ready in [false, true] {
            for (number, (target, pace)) in targets.iter().zip(paces).enumerate() {
                let (Some(target), Some(mut axis)) = (*target, self.axis(number)) else { continue };
                if is_ready {
                    axis.move_at(now, target, *pace)?;
                } else {
                    axis.prepare(now, target, *pace)?;
                }
            }
        }
        Ok(())
    }

    /// Takes an axis out of its line: it goes on to its target at its own pace. Where it was the leader, the others do
    /// so, too.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn leave_interpolation(&mut self, number: usize) -> Result<(), Error> {
        if self.leader(number).is_none() {
            return Ok(());
        }
        self.leave_interpolations(|leaving| leaving == number)?;
        match self.axis(number) {
            Some(mut axis) if axis.state().limited() => axis.repace(Pace::default()),
            _ => Ok(()),
        }
    }

    /// Takes axes out of their lines, those of which `leaves` says so. Where that was the leader, the others go on by
    /// themselves.
    fn leave_interpolations(&mut self, leaves: impl Fn(usize) -> bool) -> Result<(), Error> {
        for number in 0..AXES {
            let Some(leader) =
                self.interpolations.followers.get(number).copied().flatten().map(|follower| follower.leader)
            else {
                continue;
            };
            if leaves(number) || leaves(leader) {
                self.release(number)?;
            }
        }
        Ok(())
    }

    /// Lets a follower go on by itself, at its own pace.
    fn release(&mut self, number: usize) -> Result<(), Error> {
        let follows = self.interpolations.followers.get_mut(number).and_then(Option::take).is_some();
        match self.axis(number) {
            Some(mut axis) if follows && axis.state().limited() => axis.repace(Pace::default()),
            _ => Ok(()),
        }
    }

    /// Looks after the lines, when the positions of all axes have been read: one follower at most gets another speed
    /// limit. Never inlined, because most turns have no lines.
    #[inline(never)]
    pub(super) fn follow_interpolations(&mut self) {
        self.interpolations.count();
        let first = self.interpolations.next;
        for number in (first..AXES).chain(0..first.min(AXES)) {
            // A datagram that did not get through is sent again in the next turn.
            if self.follow(number).unwrap_or(true) {
                self.interpolations.next = number.saturating_add(1);
                return;
            }
        }
    }

    /// Gives a follower the pace that holds it to its line. True if that took a datagram.
    fn follow(&mut self, number: usize) -> Result<bool, Error> {
        let Some(follower) = self.interpolations.followers.get(number).copied().flatten() else { return Ok(false) };
        let (Some(leader), Some(axis)) = (self.axes.get(follower.leader), self.axes.get(number)) else {
            return Ok(false);
        };
        let coupled = leader.limited() && axis.limited();
        let pace = if coupled {
            let (own, left, most) = (axis.left(), leader.left(), axis.setting(P::MaximumSpeed));
            let top = leader.positioning_speed().unsigned_abs();
            let speed = follower.speed::<ShapeOf<T>>(own, left, top, most, |lag| axis.correction(lag));
            let pace = if own > TAIL { axis.pace() } else { Pace::default() };
            Pace { speed: Some(speed), ..pace }
        } else {
            Pace::default()
        };
        let told = match self.axis(number) {
            Some(mut axis) if axis.state().travelling() => axis.ease(pace)?,
            _ => false,
        };
        if let Some(follower) = self.interpolations.followers.get_mut(number)
            && !coupled
            && !told
        {
            *follower = None;
        }
        Ok(told)
    }

    /// Stops the line of an axis whose events tell that it was stopped before its target.
    pub(super) fn look_at_interpolation(&mut self, now: Micros, number: usize, events: Events) {
        let Events { stall, cut_short, deviation, alarm, .. } = events;
        if self.interpolations.members != 0 && (stall || cut_short || deviation || alarm) {
            self.break_interpolation(now, number);
        }
    }

    /// Stops the other axes of the line of an axis that was stopped before its target. This axis stays where it is,
    /// also when a switch that has stopped it opens.
    #[inline(never)]
    fn break_interpolation(&mut self, now: Micros, number: usize) {
        let Some(leader) = self.leader(number) else { return };
        for other in 0..AXES {
            if self.leader(other) != Some(leader) {
                continue;
            }
            let Some(mut axis) = self.axis(other) else { continue };
            let told = match other == number {
                true => axis.stay(),
                false if axis.state().limited() => axis.break_off(now),
                false => Ok(()),
            };
            if told.is_err() {
                // What its chip did not take is made up for by a stop without a ramp, as soon as it answers.
                let _ = axis.hard_stop();
            }
        }
        for follower in self.interpolations.followers.iter_mut().filter(|f| f.is_some_and(|f| f.leader == leader)) {
            *follower = None;
        }
    }
}
