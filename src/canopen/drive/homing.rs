//! Homing (manual chapter 9): what each method is as a list of legs of a reference search, and how a homing begins and
//! ends. The position at which it ends becomes less than zero by the home offset (607Ch): zero is the home position and
//! the offset.
//!
//! | methods | home position |
//! |---|---|
//! | 0 | none: the motor does not move, and the homing is over at once, without having found it |
//! | 17, 18 | where the left, the right limit switch opens when the motor leaves it |
//! | 1, 2 | the first index from there on, away from the switch |
//! | 19, 21 | the left, the right edge of the home switch |
//! | 3, 5 | the first index to the left, to the right of that edge, where the home switch is open |
//! | 33, 34 | the next index in negative, in positive direction |
//! | 35 | where the motor is |
//!
//! The figures of CiA 402 for 3, 5, 19 and 21 show a home switch that is closed from its edge to the end of the axis.
//! For the index of 3 and 5 they show the side on which the switch is open; 4 and 6 have the other side. Here the home
//! switch may also be a short one: then the drive may begin beyond it, turns round at a limit switch, and comes over it
//! from there.

use super::plant::Plant;
use crate::canopen::errors::Emergency;
use crate::canopen::object::Object;
use crate::canopen::switches::Switches;
use crate::device::Circuit;
use crate::motion::{Events, Leg, Pace, Plan, Side, Sought};

/// The method that moves nothing and leaves the position as it is.
const NO_HOMING: i32 = 0;
/// The method that makes the present position the home position.
const HERE: i32 = 35;

/// The legs to an edge of a switch, and to the index behind it.
const EDGE: &[Leg] = &[Leg::FIND, Leg::LEAVE];
const EDGE_INDEX: &[Leg] = &[Leg::FIND, Leg::LEAVE, Leg::BACK_TO_INDEX];
/// The same for a search that has turned round, and so runs over the home switch.
const FAR_EDGE: &[Leg] = &[Leg::FIND, Leg::ONTO, Leg::OFF];
const FAR_EDGE_INDEX: &[Leg] = &[Leg::FIND, Leg::ONTO, Leg::OFF, Leg::INDEX];

/// The search that a method is; `None` if the method moves nothing, or searches a switch that is not in use.
fn plan(method: i32, switches: Switches) -> Option<Plan> {
    let stops @ [left, right] = switches.limits();
    let at_limit = |positive, legs| Plan { sought: Sought::Stop, positive, stops, legs, turned: None };
    let at_home = |positive, legs, turned| {
        let sought = Sought::Home { inverted: switches.home_inverted() };
        Plan { sought, positive, stops, legs, turned: Some(turned) }
    };
    let (plan, has_switch) = match method {
        1 => (at_limit(false, EDGE_INDEX), left),
        2 => (at_limit(true, EDGE_INDEX), right),
        3 => (at_home(true, EDGE_INDEX, FAR_EDGE_INDEX), switches.home()),
        5 => (at_home(false, EDGE_INDEX, FAR_EDGE_INDEX), switches.home()),
        17 => (at_limit(false, EDGE), left),
        18 => (at_limit(true, EDGE), right),
        19 => (at_home(true, EDGE, FAR_EDGE), switches.home()),
        21 => (at_home(false, EDGE, FAR_EDGE), switches.home()),
        33 => (at_limit(false, &[Leg::INDEX]), true),
        34 => (at_limit(true, &[Leg::INDEX]), true),
        _ => return None,
    };
    has_switch.then_some(plan)
}

/// The state of homing.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Homing {
    /// A homing is under way.
    running: bool,
    /// The homing under way waits for the motor to stand, and is over then (method 35).
    here: bool,
    /// The last homing has found the home position.
    attained: bool,
    /// The home offset (607Ch) when this homing began.
    offset: u32,
    /// The home offset of the last homing that came to its end.
    used: u32,
}

impl Homing {
    /// True while a homing is under way.
    pub(super) const fn is_running(&self) -> bool {
        self.running
    }

    /// True if the last homing has found the home position.
    pub(super) const fn is_attained(&self) -> bool {
        self.attained
    }

    /// The 607Ch that the last homing has used that came to its end.
    pub(super) const fn offset_used(&self) -> u32 {
        self.used
    }

    /// True if a homing that is under way has come to the home position.
    pub(super) const fn finds_home(&self, events: Events) -> bool {
        self.running && events.reached
    }

    /// Bit 4 of the controlword was set in homing mode; only method 35 needs no drive that `operates`.
    pub(super) fn start<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, operates: bool) {
        let method = plant.settings.of(Object::HomingMethod) as i32;
        let offset = plant.settings.of(Object::HomeOffset);
        match method {
            HERE => {
                self.begin(offset, true, true);
                self.look_here(plant);
            }
            _ if !operates => {}
            NO_HOMING => {
                self.begin(offset, false, false);
                self.end(false);
            }
            _ => {
                let began = begin_search(plant, method).is_some();
                self.begin(offset, began, false);
                if !began {
                    plant.errors.raise(Emergency::Refused, None);
                }
            }
        }
    }

    /// Takes note of a homing that has begun, or could not.
    const fn begin(&mut self, offset: u32, running: bool, here: bool) {
        *self = Homing { running, here, attained: false, offset, used: self.used };
    }

    /// Bit 4 of the controlword was cleared: a homing that is under way ends, and the motor stops along the ramp.
    pub(super) fn stop<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if self.running {
            plant.slow_down(plant.settings.acceleration(Object::HomingAcceleration));
            self.abort();
        }
    }

    /// A homing that is under way has ended before its end. The motor has been, or will be, stopped.
    pub(super) const fn abort(&mut self) {
        self.running = false;
    }

    /// Makes the place where the motor is the home position, as soon as it stands.
    fn look_here<T: Circuit>(&mut self, plant: &mut Plant<'_, T>) {
        if plant.stands() {
            plant.take_position(0);
            self.end(true);
        }
    }

    /// The homing has come to its end.
    const fn end(&mut self, attained: bool) {
        let used = self.offset;
        *self = Homing { running: false, here: false, attained, offset: used, used };
    }

    /// Follows a homing, once in each turn. Returns the limit switch that has ended it: there the motor is as at one
    /// that has ended a move.
    pub(super) fn follow<T: Circuit>(&mut self, plant: &mut Plant<'_, T>, events: Events) -> Option<Side> {
        if !self.running || plant.device.axes().iter().any(|axis| axis.searches()) {
            return None;
        }
        if self.here {
            self.look_here(plant);
            return None;
        }
        if self.finds_home(events) {
            self.end(true);
            return None;
        }
        self.abort();
        events.limit
    }
}

/// Begins the search of a method. `None` if that cannot be, because of a switch that is not in use, or a speed of 0.
fn begin_search<T: Circuit>(plant: &mut Plant<'_, T>, method: i32) -> Option<()> {
    let Plant { now, settings, device, .. } = plant;
    let plan = plan(method, settings.switches())?;
    let (fast, slow) = (settings.velocity(Object::HomingFastSpeed), settings.velocity(Object::HomingSlowSpeed));
    let ramp = settings.acceleration(Object::HomingAcceleration);
    let pace = Pace { speed: Some(slow), acceleration: Some(ramp), ..Pace::default() };
    let home = (settings.of(Object::HomeOffset) as i32).wrapping_neg();
    device.axis(0)?.search_by(*now, plan, home, fast, pace).ok()
}
