//! Axes on their hardware.

use core::hint::black_box as any;

use super::now;
use super::stand_ins::Chip;
use tmcm::chip::tmc429::Tmc429;
use tmcm::chip::tmc5160::Tmc5160;
use tmcm::motion::tmc429::{Tmc429Tmc262, ramp};
use tmcm::motion::tmc5160::Tmc5160Axis;
use tmcm::motion::{
    Axis, Foreseeable, Former, Known, Leg, Mark, MotionController, Pace, Plan, Ratio, Sensors, Slope, Sought, Until,
    root,
};
use tmcm::param::{AxisParameter, Table};
use tmcm::product::{tmcm1140, tmcm3212};

#[inline(never)]
pub(super) fn motion() {
    let known = any(Known::default());
    any((known.ahead(), known.steps_before(any(0)), known.mode.positions()));
    any(ramp::braking(any(0), any(0), any(0), any(0)));
    let ratio = any(Ratio::new(any(0), any(0)));
    any((ratio.times(any(0)), ratio.up(any(0), any(0)), ratio.limit(any(0), any(0))));
    let slopes = any([Slope::straight(any(0)), Slope::bent(any(0), any(0), any(0), any(0))]);
    any(slopes.map(|slope| (root(slope.square(any(0))), slope.way(any(0)), slope.foot(), slope.main())));
    let [hardware] = Tmc429Tmc262::axes([Chip]);
    axis(hardware, Tmc429::new(Chip), &tmcm1140::AXIS);
    let [hardware] = Tmc5160Axis::axes();
    axis(hardware, Tmc5160::new(Chip), &tmcm3212::AXIS);
}

/// An axis on its hardware. It is not made part of another function, so that what can panic has a name.
#[inline(never)]
fn axis<H: Foreseeable>(hardware: H, mut chip: H::Controller, table: &'static Table<AxisParameter>) {
    any(&mut chip);
    let _ = any(chip.start());
    let _ = any(chip.stop_all());
    any(chip.is_there());
    let _ = any(chip.invert(any(true), any(true)));
    let mut axis = Axis::new(hardware, table);
    any((&mut axis, &mut chip));
    let parameter = table.find(any(0));
    if let Some(parameter) = parameter {
        axis.preset(parameter, any(0));
        axis.preset_setting(parameter.function, any(0));
    }
    axis.set_reverse(any(true));
    axis.watch_right_switch(any(None));
    axis.set_turn(any(0));
    any((
        axis.search_status(),
        axis.searches(),
        axis.takes_speed(),
        axis.at_target(),
        axis.last_position(),
        axis.last_speed(),
        axis.target_position(),
    ));
    any((axis.home_switch(), axis.travelling(), axis.rests(), axis.stop_switches(&chip), axis.calm(&chip, now())));
    let mut axis = axis.on(&mut chip);
    let _ = any(axis.start(now(), any(0)));
    let _ = any(axis.rotate(now(), any(0)));
    let _ = any(axis.move_to(now(), any(0)));
    let _ = any(axis.rotate_at(now(), any(0), any(None)));
    let _ = any(axis.move_at(now(), any(0), any(Pace::<H::Shape>::default())));
    let _ = any(axis.hard_stop());
    let _ = any(axis.restart_driver());
    any(axis.readings());
    let _ = any(axis.start_search(now()));
    const LEGS: &[Leg] = &[Leg::FIND, Leg::to(Until::Index, Mark::First)];
    let plan = Plan { sought: Sought::Stop, positive: true, stops: [true; 2], legs: LEGS, turned: Some(LEGS) };
    let _ = any(axis.search_by(now(), any(plan), any(0), any(0), any(Pace::<H::Shape>::default())));
    let _ = any(axis.stop_search(now()));
    if let Some(parameter) = parameter {
        let _ = any(axis.write(now(), parameter, any(0)));
        let _ = any(axis.set(now(), parameter.function, any(0)));
        let _ = any(axis.read(parameter.function));
    }
    let _ = any(axis.set_divisors(any(0), any(0)));
    let _ = any(axis.actual_position());
    let _ = any(axis.set_positions(now(), any(0)));
    any(axis.poll(now(), any(Sensors::default()), any(None), any(false)));
    axis.refresh();
    let state = axis.state();
    any((state.limited(), state.pace(), state.left(), state.positioning_speed(), state.correction(any(0))));
    any(state.slopes(&state.shape(), any(0)));
    any(parameter.map(|parameter| state.setting(parameter.function)));
    let _ = any(axis.may_search());
    let _ = any(axis.prepare(now(), any(0), any(Pace::<H::Shape>::default())));
    let _ = any(axis.ease(any(Pace::<H::Shape>::default())));
    let _ = any(axis.repace(any(Pace::<H::Shape>::default())));
    let _ = any(axis.break_off(now()));
    let _ = any(axis.stay());
    axis.end_at_switch();
    any(axis.state_mut());
    let mut former = any(Former::default());
    axis.state().note(&mut former);
    axis.recall(&any(former));
}
