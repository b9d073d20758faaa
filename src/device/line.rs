//! Several axes that begin to move at once, each for itself or on a straight line.
//!
//! On a line the axis that takes longest at its own speed and acceleration leads: it moves as it would alone, or slower where
//! another axis of the line could not follow. The others, its followers, get its speed and acceleration in the ratio of
//! their ways. Ramp generators take whole numbers only, so a follower is held to the line on the way: once in each
//! millisecond what it has left to go is compared with what its leader has left, and the speed limit of one of the followers
//! is written anew if it has to be another.
//!
//! An axis belongs to its line until it arrives or is told something else; then the others go on by themselves. If it is
//! stopped before its target, by a switch, a stall or its driver, the others are stopped along their ramps: they would leave
//! the line.

use super::{Board, Device};
use crate::motion::{Axis, Error, Events, Pace, Slope};
use crate::param::AxisParameter as P;
use crate::units::Micros;

/// The lag of a follower, in 1/256 microstep, that is left to itself: what is read are whole microsteps.
const SLACK: u64 = 192;
/// The largest lag, in 1/256 microstep, by which the correction of a follower's speed grows.
const LARGEST_LAG: i64 = 1 << 16;
/// How far ahead of an accelerating leader its speed is looked at, in microsteps and besides a quarter of its way: until the
/// next correction it gains speed.
const AHEAD: u32 = 64;
/// The last microsteps of a follower, in which it has its own acceleration in place of the leader's in the ratio: a slow axis
/// needs that to make each of them in time.
const TAIL: u32 = 4;

/// The lines that are under way.
#[derive(Debug)]
pub(super) struct Lines<const AXES: usize> {
    /// The followers, by axis.
    followers: [Option<Follower>; AXES],
    /// The axis that is corrected first in the next millisecond: only one is in each.
    next: usize,
    /// The followers are still to be looked at in the turn under way.
    due: bool,
}

impl<const AXES: usize> Default for Lines<AXES> {
    fn default() -> Self {
        Lines { followers: [None; AXES], next: 0, due: false }
    }
}

/// An axis that follows the leader of its line.
#[derive(Clone, Copy, Debug)]
struct Follower {
    /// The number of the leader.
    leader: usize,
    /// The way of the follower to that of the leader.
    ratio: Ratio,
    /// The way of the leader from rest to its target, in microsteps. One that moved when the line began counts as having come
    /// from rest.
    way: u32,
    /// The square of the leader's speed for each microstep from rest, as in [`Slope::square`].
    square: u32,
    /// The microsteps that the leader has left at most when the follower makes its last one.
    last: u32,
}

impl Follower {
    /// The speed at which a follower is to go on that has `own` microsteps left, while its leader has `left`. `top` is the
    /// speed of the leader between its ramps, `most` the largest one of the follower, and `correction` that of
    /// [`Axis::correction`].
    fn speed(&self, own: u32, left: u32, top: u32, most: i32, correction: impl Fn(i32) -> i32) -> i32 {
        if own <= 1 {
            return if left > self.last { 0 } else { most };
        }
        // The leader's speed follows from its way.
        let come = self.way.saturating_sub(left);
        let ramp = come.saturating_add(come / 4).saturating_add(AHEAD).min(left);
        let square = u64::from(ramp).wrapping_mul(self.square.into()) >> 8;
        let square = square.min(u64::from(top).wrapping_mul(top.into())) as u32;
        let sixteenths = square.wrapping_shl(8).isqrt();
        let speed = self.ratio.times(sixteenths) >> 4;
        let lag = (u64::from(own) << 8).wrapping_sub(self.ratio.times(left)) as i64;
        let slack = SLACK.max(self.ratio.times(1)) as i64;
        let lag = lag.saturating_sub(slack).max(0).saturating_add(lag.saturating_add(slack).min(0));
        let lag = lag.clamp(-LARGEST_LAG, LARGEST_LAG);
        let speed = (speed as i64).saturating_add(correction(lag as i32).into()).saturating_add(128) >> 8;
        speed.max(0).min(most.into()) as i32
    }
}

/// A ratio of two ways.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Ratio {
    mantissa: u32,
    /// By how much a product with the mantissa is shifted right for a result in 1/256; at most 24.
    shift: u32,
}

impl Ratio {
    /// The ratio of `way` to `whole`, at most 2^24: an axis with so much longer a way would lead.
    fn new(way: u32, whole: u32) -> Self {
        let quotient = (u64::from(way) << 32).checked_div(whole.into()).unwrap_or(u64::MAX);
        let excess = 32_u32.saturating_sub(quotient.leading_zeros());
        match 24_u32.checked_sub(excess) {
            Some(shift) => Ratio { mantissa: quotient.unbounded_shr(excess) as u32, shift },
            None => Ratio { mantissa: u32::MAX, shift: 0 },
        }
    }

    /// The product with a number, in 1/256.
    fn times(self, number: u32) -> u64 {
        u64::from(self.mantissa).wrapping_mul(number.into()).unbounded_shr(self.shift)
    }

    /// The product with a number that is not negative, rounded up, and at most `most`.
    fn up(self, number: i32, most: i32) -> i32 {
        self.times(number.unsigned_abs()).div_ceil(256).min(u64::from(most.unsigned_abs())) as i32
    }

    /// The largest number whose product is not above `product`, in 1..=`most`; 0 if that or `product` is.
    fn limit(self, product: i32, most: i32) -> i32 {
        let number = u64::from(product.unsigned_abs()).unbounded_shl(self.shift.saturating_add(8));
        let number = number.checked_div(self.mantissa.into()).unwrap_or(u64::MAX);
        number.max(product.min(1) as u64).min(u64::from(most.unsigned_abs())) as i32
    }
}

/// An axis that is to go on a line.
#[derive(Clone, Copy, Debug)]
struct Traveller {
    number: usize,
    /// Its way in microsteps, to either side.
    way: u32,
    /// How long it would take alone.
    duration: u64,
    /// It moves already.
    moves: bool,
}

/// How long a motor would take, from rest to rest, in 1/65536 of the time in which it makes a microstep at speed 1.
fn duration(way: u32, speed: i32, square: u32) -> u64 {
    let (way, speed, square) = (u64::from(way), u64::from(speed.unsigned_abs()), u64::from(square));
    // The way on which the motor reaches its speed, together with that on which it comes to rest.
    let ramps = (speed.wrapping_mul(speed) << 9).checked_div(square).unwrap_or(u64::MAX);
    if ramps <= way {
        let cruise = (way << 16).checked_div(speed).unwrap_or(u64::MAX);
        cruise.saturating_add((speed << 25).checked_div(square).unwrap_or(u64::MAX))
    } else {
        // It does not reach its speed.
        ((way << 32).checked_div(square).unwrap_or(u64::MAX >> 9) << 9).isqrt().saturating_mul(2)
    }
}

impl<T: Board, const AXES: usize> Device<T, AXES> {
    /// Sends axes to positions, `targets` by axis, so that they begin to move at once.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn start_together(&mut self, now: Micros, targets: &[Option<i32>; AXES]) -> Result<(), Error> {
        self.set_going(now, targets, &[Pace::default(); AXES])
    }

    /// Sends axes to positions, `targets` by axis, on a straight line: they arrive at once.
    ///
    /// # Errors
    /// [`Error::NotNow`] when they have different units of speed or acceleration; then nothing moves. [`Error::Chip`] when a
    /// chip did not take a datagram.
    pub fn start_line(&mut self, now: Micros, targets: &[Option<i32>; AXES]) -> Result<(), Error> {
        let members = || self.axes.iter().zip(targets).filter_map(|(axis, target)| target.and(Some(axis)));
        let units = |axis: &Axis<T::Hardware>| [P::RampDivisor, P::PulseDivisor].map(|divisor| axis.setting(divisor));
        let first = members().next().map(units);
        if members().any(|axis| Some(units(axis)) != first) {
            return Err(Error::NotNow);
        }
        let mut travellers = [None; AXES];
        for (number, (traveller, target)) in travellers.iter_mut().zip(targets).enumerate() {
            if let Some(target) = *target {
                *traveller = self.traveller(number, target)?;
            }
        }
        let longest = travellers.iter().flatten().max_by_key(|traveller| (traveller.duration, traveller.way));
        let mut followers = [None; AXES];
        let mut paces = [Pace::default(); AXES];
        // One axis that has a way to go moves as it would alone.
        if let Some(leader) = longest.filter(|_| travellers.iter().flatten().count() > 1) {
            for (follower, traveller) in followers.iter_mut().zip(&travellers) {
                let Some(traveller) = traveller.filter(|traveller| traveller.number != leader.number) else { continue };
                let ratio = Ratio::new(traveller.way, leader.way);
                *follower = Some(Follower { leader: leader.number, ratio, way: leader.way, square: 0, last: 0 });
            }
            self.pace(leader.number, &mut followers, &mut paces);
            // One that moves may be where it has to turn round, or to catch up: so the axes keep their own accelerations.
            if travellers.iter().flatten().any(|traveller| traveller.moves) {
                for pace in &mut paces {
                    pace.acceleration = None;
                }
            }
            // What a leader that moves has behind it, as if it had come from rest.
            let speed = u64::from(self.axes.get(leader.number).map_or(0, Axis::last_speed).unsigned_abs());
            for follower in followers.iter_mut().flatten() {
                let run_up = (speed.wrapping_mul(speed) << 8).checked_div(follower.square.into()).unwrap_or_default();
                follower.way = follower.way.saturating_add(run_up as u32);
            }
        }
        self.set_going(now, targets, &paces)?;
        for (place, follower) in self.lines.followers.iter_mut().zip(followers) {
            *place = follower.or(*place);
        }
        Ok(())
    }

    /// An axis that is to go to a position; `None` if it is there.
    fn traveller(&mut self, number: usize, target: i32) -> Result<Option<Traveller>, Error> {
        let Some(mut axis) = self.axis(number) else { return Ok(None) };
        // Of a motor that rests, both are known.
        let (here, moves) = match axis.rests() {
            true => (axis.last_position(), false),
            false => (axis.actual_position()?, axis.read(P::ActualSpeed)? != 0),
        };
        let way = target.wrapping_sub(here).unsigned_abs();
        let speed = axis.setting(P::MaximumSpeed);
        let duration = duration(way, speed, axis.slope(axis.setting(P::MaximumAcceleration)).square);
        Ok((way != 0).then_some(Traveller { number, way, duration, moves }))
    }

    /// Works out at what paces the axes of a line are to go, as their parameters are now.
    fn pace(&self, leader: usize, followers: &mut [Option<Follower>; AXES], paces: &mut [Pace; AXES]) {
        let Some(axis) = self.axes.get(leader) else { return };
        let mut speed = axis.setting(P::MaximumSpeed);
        let mut acceleration = axis.setting(P::MaximumAcceleration).max(1);
        for (follower, axis) in followers.iter().zip(&self.axes) {
            let Some(Follower { ratio, .. }) = follower.filter(|follower| follower.leader == leader) else { continue };
            speed = ratio.limit(axis.setting(P::MaximumSpeed), speed);
            acceleration = ratio.limit(axis.setting(P::MaximumAcceleration).max(1), acceleration);
        }
        let Slope { acceleration, square } = axis.slope(acceleration);
        for (number, ((follower, axis), pace)) in followers.iter_mut().zip(&self.axes).zip(paces).enumerate() {
            if number == leader {
                *pace = Pace { speed: Some(speed), acceleration: Some(acceleration) };
            }
            let Some(follower) = follower.as_mut().filter(|follower| follower.leader == leader) else { continue };
            let wanted = follower.ratio.up(acceleration, axis.setting(P::MaximumAcceleration).max(1));
            let speed = follower.ratio.up(speed, axis.setting(P::MaximumSpeed));
            *pace = Pace { speed: Some(speed), acceleration: Some(axis.slope(wanted).acceleration) };
            // From rest it makes the microstep in the time in which the leader, which comes to rest, makes so many; of its
            // last ones the leader makes two more while the follower's speed limit is written.
            let own = axis.slope(axis.setting(P::MaximumAcceleration).max(1)).square;
            follower.square = square;
            follower.last = square.checked_div(own).unwrap_or_default().saturating_add(2);
        }
    }

    /// Brings the line to which an axis belongs, or of which it is the last one, to parameters 4 and 5 as they are now.
    ///
    /// # Errors
    /// [`Error::Chip`] when a chip did not take a datagram.
    pub fn repace(&mut self, number: usize) -> Result<(), Error> {
        let Some(leader) = self.leader(number) else {
            let alone = self.axis(number).filter(|axis| axis.limited());
            return alone.map_or(Ok(()), |mut axis| axis.repace(Pace::default()));
        };
        let mut followers = self.lines.followers;
        let mut paces = [Pace::default(); AXES];
        self.pace(leader, &mut followers, &mut paces);
        self.lines.followers = followers;
        for (number, pace) in paces.into_iter().enumerate().filter(|(_, pace)| *pace != Pace::default()) {
            if let Some(mut axis) = self.axis(number).filter(|axis| axis.limited()) {
                axis.repace(pace)?;
            }
        }
        Ok(())
    }

    /// The leader of the line to which an axis belongs.
    fn leader(&self, number: usize) -> Option<usize> {
        match self.lines.followers.get(number)? {
            Some(follower) => Some(follower.leader),
            None => self.lines.followers.iter().flatten().any(|follower| follower.leader == number).then_some(number),
        }
    }

    /// Sets axes going at once: all that has to be told their chips comes before, so that one datagram to each of them is
    /// left.
    fn set_going(&mut self, now: Micros, targets: &[Option<i32>; AXES], paces: &[Pace; AXES]) -> Result<(), Error> {
        let moves =
            || targets.iter().zip(paces).enumerate().filter_map(|(n, (target, pace))| Some((n, (*target)?, *pace)));
        for (number, target, pace) in moves() {
            self.leave_line(number)?;
            if let Some(mut axis) = self.axis(number) {
                axis.ready(now, target, pace)?;
            }
        }
        let mut told = Ok(());
        for (number, target, pace) in moves() {
            if let Some(mut axis) = self.axis(number) {
                told = told.and(axis.move_at(now, target, pace));
            }
        }
        told
    }

    /// Takes an axis out of its line, of which the others go on by themselves if it was the leader.
    fn leave_line(&mut self, number: usize) -> Result<(), Error> {
        for follower in 0..AXES {
            if follower == number || self.leader(follower) == Some(number) {
                self.release(follower)?;
            }
        }
        Ok(())
    }

    /// Lets a follower go on by itself, at its own pace.
    fn release(&mut self, number: usize) -> Result<(), Error> {
        let follows = self.lines.followers.get_mut(number).and_then(Option::take).is_some();
        match self.axis(number) {
            Some(mut axis) if follows && axis.limited() => axis.repace(Pace::default()),
            _ => Ok(()),
        }
    }

    /// Notes that the turn under way has lines to look after.
    pub(super) fn begin_lines(&mut self) {
        self.lines.due = AXES > 1 && self.lines.followers.iter().any(Option::is_some);
    }

    /// True while the lines are still to be looked after in the turn under way.
    pub(super) const fn lines_due(&self) -> bool {
        AXES > 1 && self.lines.due
    }

    /// Looks after the lines, when the positions of all axes have been read: one follower at most gets another speed limit.
    pub(super) fn follow_lines(&mut self) {
        self.lines.due = false;
        let first = self.lines.next;
        for number in (first..AXES).chain(0..first.min(AXES)) {
            // A datagram that did not get through is sent again in the next turn.
            if self.follow(number).unwrap_or(true) {
                self.lines.next = number.saturating_add(1);
                return;
            }
        }
    }

    /// Gives a follower the pace that holds it to its line. True if that took a datagram.
    fn follow(&mut self, number: usize) -> Result<bool, Error> {
        let Some(follower) = self.lines.followers.get(number).copied().flatten() else { return Ok(false) };
        let (Some(leader), Some(axis)) = (self.axes.get(follower.leader), self.axes.get(number)) else {
            return Ok(false);
        };
        let coupled = leader.limited() && axis.limited();
        let pace = if coupled {
            let (own, left, most) = (axis.left(), leader.left(), axis.setting(P::MaximumSpeed));
            let top = leader.positioning_speed().unsigned_abs();
            let speed = follower.speed(own, left, top, most, |lag| axis.correction(lag));
            let acceleration = axis.pace().acceleration.filter(|_| own > TAIL);
            Pace { speed: Some(speed), acceleration }
        } else {
            Pace::default()
        };
        let told = match self.axis(number) {
            Some(mut axis) if axis.travelling() => axis.approach(pace)?,
            _ => false,
        };
        if let Some(follower) = self.lines.followers.get_mut(number)
            && !coupled
            && !told
        {
            *follower = None;
        }
        Ok(told)
    }

    /// Stops the others of the line of an axis whose events tell that it was stopped before its target.
    pub(super) fn break_line(&mut self, now: Micros, number: usize, events: Events) {
        let Events { stall, cut_short, deviation, alarm, .. } = events;
        if !(stall || cut_short || deviation || alarm) {
            return;
        }
        let Some(leader) = self.leader(number) else { return };
        for other in 0..AXES {
            if self.leader(other) != Some(leader) {
                continue;
            }
            if other != number
                && let Some(mut axis) = self.axis(other).filter(|axis| axis.limited())
                && axis.break_off(now).is_err()
            {
                // What its chip did not take is made up for by a stop without a ramp, as soon as it answers.
                let _ = axis.hard_stop();
            }
        }
        for follower in self.lines.followers.iter_mut().filter(|f| f.is_some_and(|f| f.leader == leader)) {
            *follower = None;
        }
    }
}
