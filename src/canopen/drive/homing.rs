//! Homing (manual chapter 9): what each method is as a list of legs of a reference search, and how a homing begins and
//! ends. The position at which it ends becomes less than zero by the home offset (607Ch): zero is the home position and the
//! offset.
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
//! The figures of CiA 402 for 3, 5, 19 and 21 show a home switch that is closed from its edge to the end of the axis, and
//! for the index of 3 and 5 the side on which the switch is open; 4 and 6 have the other side. Here the home switch may
//! also be a short one: then the drive may begin beyond it, turns round at a limit switch, and comes over it from there.

use super::Homing;
use crate::canopen::Node;
use crate::canopen::emcy::Emergency;
use crate::canopen::object::Object;
use crate::canopen::store::Tmcm1140;
use crate::canopen::switches::Switches;
use crate::device::Board;
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

impl<T: Board<Product = Tmcm1140>> Node<T> {
    /// Bit 4 of the controlword was set in homing mode; only method 35 needs no drive that is operating.
    pub(super) fn start_homing(&mut self, operates: bool) {
        let method = self.values.of_object(Object::HomingMethod) as i32;
        match method {
            HERE => {
                self.begin_homing(true, true);
                self.look_here();
            }
            _ if !operates => {}
            NO_HOMING => {
                self.begin_homing(false, false);
                self.end_homing(false);
            }
            _ => {
                let began = self.begin_search(method).is_some();
                self.begin_homing(began, false);
                if !began {
                    self.raise(Emergency::Refused);
                }
            }
        }
    }

    /// Takes note of a homing that has begun, or could not.
    fn begin_homing(&mut self, running: bool, here: bool) {
        let offset = self.values.of_object(Object::HomeOffset);
        self.drive.homing = Homing { running, here, attained: false, offset, used: self.drive.homing.used };
    }

    /// Begins the search of a method. `None` if that cannot be, because of a switch that is not in use, or a speed of 0.
    fn begin_search(&mut self, method: i32) -> Option<()> {
        let plan = plan(method, self.switch_settings())?;
        let speed = |object| self.scale().velocity(self.values.of_object(object).into());
        let (fast, slow) = (speed(Object::HomingFastSpeed), speed(Object::HomingSlowSpeed));
        let pace = Pace { speed: Some(slow), acceleration: Some(self.ramp()), ..Pace::default() };
        let home = (self.values.of_object(Object::HomeOffset) as i32).wrapping_neg();
        let now = self.now;
        self.device.axis(0)?.search_by(now, plan, home, fast, pace).ok()
    }

    /// Bit 4 of the controlword was cleared: a homing that is under way ends, and the motor stops along the ramp.
    pub(super) fn stop_homing(&mut self) {
        if self.drive.homing.running {
            self.slow_down(self.ramp());
            self.abort_homing();
        }
    }

    /// A homing that is under way has ended before its end. The motor has been, or will be, stopped.
    pub(super) fn abort_homing(&mut self) {
        self.drive.homing.running = false;
    }

    /// Makes the place where the motor is the home position, as soon as it stands.
    fn look_here(&mut self) {
        if self.stands() {
            self.take_position(0);
            self.end_homing(true);
        }
    }

    /// The homing has come to its end.
    fn end_homing(&mut self, attained: bool) {
        let used = self.drive.homing.offset;
        self.drive.homing = Homing { running: false, here: false, attained, offset: used, used };
    }

    /// Follows a homing, once in each turn.
    pub(super) fn follow_homing(&mut self, events: Events) {
        if !self.drive.homing.running || self.device.axes().iter().any(|axis| axis.searches()) {
            return;
        }
        if self.drive.homing.here {
            return self.look_here();
        }
        if self.finds_home(events) {
            return self.end_homing(true);
        }
        self.abort_homing();
        // At the limit switch that has ended the search the motor is as at one that has ended a move.
        if let Some(side) = events.limit {
            self.meet_limit_switch(usize::from(side == Side::Right));
        }
    }

    /// True if a homing that is under way has come to the home position.
    pub(in crate::canopen) const fn finds_home(&self, events: Events) -> bool {
        self.drive.homing.running && events.reached
    }

    /// The 607Ch that the last homing has used that came to its end (2100h).
    pub(in crate::canopen) const fn home_offset_display(&self) -> u32 {
        self.drive.homing.used
    }
}
