//! A rotation ends at the stop switch that has stopped it. Parameter 2 is 0 once the motor stands there, and the motor
//! does not turn again by itself when the switch opens. Published host software waits for that 0. A positioning move
//! keeps its target.

use common::{Bench, OK};
use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm_sim::Product;

/// A motor of a module; the last one of each product, and both ways.
struct Motor {
    bench: Bench,
    axis: u8,
    /// ROR or ROL, the switch at its end, and the sign of its speed.
    turn: &'static str,
    back: &'static str,
    switch: &'static str,
    sign: i32,
    /// The speed, in the unit of the product, and the number of the parameter for a stop along the ramp.
    speed: i32,
    soft: u8,
}

impl Motor {
    /// The motors of all products, both ways, with their switches in force and slow ramps: at its speed a motor brakes
    /// for a second (TMC5160) or a third of one.
    fn each() -> impl Iterator<Item = Motor> {
        let products = [
            (Product::Tmcm1140, 0),
            (Product::Tmcm1110, 0),
            (Product::Tmcm3110, 2),
            (Product::Tmcm3212, 2),
            (Product::Tmcm6110, 5),
        ];
        let ways = [("ROR", "ROL", "right", 1), ("ROL", "ROR", "left", -1)];
        products.into_iter().flat_map(move |(product, axis)| {
            ways.into_iter().map(move |(turn, back, switch, sign)| {
                let (speed, soft) = if product == Product::Tmcm3212 { (20_000, 26) } else { (500, 149) };
                let bench = Bench::of(product);
                let mut motor = Motor { bench, axis, turn, back, switch, sign, speed, soft };
                for number in [12, 13] {
                    motor.set(number, 0);
                }
                if product == Product::Tmcm3212 {
                    motor.set(5, 100_000);
                    motor.set(17, 20_000);
                } else {
                    motor.set(5, 100);
                }
                motor
            })
        })
    }

    fn set(&mut self, number: u8, value: i32) {
        self.bench.ok(&format!("SAP {number}, {}, {value}", self.axis));
    }

    fn get(&mut self, number: u8) -> i32 {
        self.bench.ok(&format!("GAP {number}, {}", self.axis))
    }

    fn rotate(&mut self, command: &str) {
        self.bench.ok(&format!("{command} {}, {}", self.axis, self.speed));
    }

    fn hand(&mut self, act: &str) {
        self.bench.control(&format!("{act} {} {}", self.switch, self.axis));
    }

    fn rotor(&self) -> i64 {
        self.bench.module.board().borrow().world().axis(self.axis.into()).motor().rotor()
    }

    fn what(&self) -> String {
        format!("{:?}, axis {}, {}", self.bench.product(), self.axis, self.turn)
    }

    /// The motor stands, also parameter 2 says so, and it stays where it is for half a second.
    fn stands(&mut self, why: &str) {
        let what = self.what();
        let stood = self.rotor();
        assert_eq!((self.get(2), self.get(3)), (0, 0), "{what}: {why}");
        self.bench.run(SECOND / 2);
        assert_eq!((self.get(2), self.get(3), self.rotor()), (0, 0, stood), "{what}: {why}");
    }

    /// The motor turns at the speed that it was told.
    fn turns(&mut self, sign: i32) {
        let (what, told) = (self.what(), self.sign * sign * self.speed);
        self.bench.run(SECOND);
        assert_eq!((self.get(2), self.get(3)), (told, told), "{what}");
    }
}

#[test]
fn a_switch_ends_a_rotation_and_lets_it_begin_again_in_any_way() {
    for mut motor in Motor::each() {
        motor.rotate(motor.turn);
        motor.turns(1);
        motor.hand("press");
        // The chip stops it with the next step; the poll behind that may be a millisecond away, and sees a speed of 0
        // that is up to fifteen milliseconds old.
        motor.bench.run(20 * MILLISECOND);
        motor.stands("the switch is closed");
        motor.rotate(motor.turn);
        motor.bench.run(20 * MILLISECOND);
        motor.stands("it was told to turn onto the switch");
        motor.rotate(motor.back);
        motor.turns(-1);
        motor.hand("release");
        motor.rotate(motor.turn);
        motor.turns(1);
        motor.hand("press");
        motor.bench.run(20 * MILLISECOND);
        motor.hand("release");
        motor.stands("the switch is open");
        motor.rotate(motor.turn);
        motor.turns(1);
    }
}

/// SAP 2 in velocity mode is ROR.
#[test]
fn a_switch_that_is_put_in_force_ends_a_rotation_and_one_that_is_not_does_nothing() {
    for mut motor in Motor::each() {
        let number = if motor.sign > 0 { 12 } else { 13 };
        motor.set(number, 1);
        motor.hand("press");
        motor.rotate(motor.turn);
        motor.set(2, motor.sign * motor.speed);
        motor.turns(1);
        motor.set(number, 0);
        motor.bench.run(20 * MILLISECOND);
        motor.stands("the switch is in force");
        motor.set(number, 1);
        motor.stands("the switch is in force no more");
    }
}

/// While it brakes parameter 2 is what it was told; the ramp goes on to its end also if the switch opens.
#[test]
fn along_a_ramp_it_ends_when_the_ramp_does() {
    for opens in [false, true] {
        for mut motor in Motor::each() {
            let (what, told) = (motor.what(), motor.sign * motor.speed);
            motor.set(motor.soft, 1);
            motor.rotate(motor.turn);
            motor.turns(1);
            motor.hand("press");
            motor.bench.run(50 * MILLISECOND);
            if opens {
                motor.hand("release");
            }
            motor.bench.run(20 * MILLISECOND);
            let speed = motor.get(3);
            assert!((1..motor.speed).contains(&(speed * motor.sign)), "{what}: {speed}");
            assert_eq!(motor.get(2), told, "{what}: it brakes");
            motor.bench.run(3 * SECOND / 2);
            motor.stands("the ramp is over");
            motor.hand("release");
            motor.stands("the switch is open");
            motor.rotate(motor.turn);
            motor.turns(1);
        }
    }
}

/// A press of three milliseconds ends a rotation, whenever it comes; after it the motor stands within a time.
fn short_presses(motor: &mut Motor, within: Nanos) {
    for moment in 0..40 {
        motor.rotate(motor.turn);
        motor.turns(1);
        motor.bench.run(moment * 137 * MICROSECOND);
        motor.hand("press");
        motor.bench.run(3 * MILLISECOND);
        motor.hand("release");
        motor.bench.run(within);
        motor.stands("it was pressed for 3 ms");
    }
}

/// A motor that turns as fast as these is somewhere else in each millisecond, so that a short press is seen however
/// seldom the switch is read.
#[test]
fn a_short_press_ends_it() {
    for mut motor in Motor::each() {
        short_presses(&mut motor, 20 * MILLISECOND);
    }
}

/// Nor does it matter that the motor has just been told to turn as slowly as can be: it is still fast.
#[test]
fn a_short_press_ends_a_rotation_that_slows_down() {
    for mut motor in Motor::each() {
        motor.rotate(motor.turn);
        motor.turns(1);
        motor.bench.ok(&format!("{} {}, 1", motor.turn, motor.axis));
        motor.bench.run(20 * MILLISECOND);
        motor.hand("press");
        motor.bench.run(3 * MILLISECOND);
        motor.hand("release");
        motor.bench.run(20 * MILLISECOND);
        motor.stands("it was pressed for 3 ms");
    }
}

/// The slowest rotation ends as well.
#[test]
fn a_switch_ends_a_rotation_at_a_speed_of_one() {
    for mut motor in Motor::each() {
        motor.bench.ok(&format!("{} {}, 1", motor.turn, motor.axis));
        motor.bench.run(SECOND);
        motor.hand("press");
        motor.bench.run(20 * MILLISECOND);
        motor.hand("release");
        motor.stands("the switch was closed");
    }
}

/// With a stop along the ramp the motor is still turning when the press is over, and goes on braking.
#[test]
fn a_short_press_begins_a_ramp() {
    for mut motor in Motor::each() {
        motor.set(motor.soft, 1);
        short_presses(&mut motor, 3 * SECOND / 2);
    }
}

#[test]
fn a_positioning_keeps_its_target_and_goes_on() {
    for mut motor in Motor::each() {
        let (what, target) = (motor.what(), motor.sign * 40_000);
        motor.set(4, motor.speed);
        motor.bench.ok(&format!("MVP ABS, {}, {target}", motor.axis));
        motor.bench.run(SECOND);
        motor.hand("press");
        motor.bench.run(SECOND);
        let stood = motor.rotor();
        assert_eq!((motor.get(3), motor.get(8), motor.get(0)), (0, 0, target), "{what}");
        motor.hand("release");
        motor.bench.run(8 * SECOND);
        assert_ne!(motor.rotor(), stood, "{what}");
        assert_eq!((motor.get(8), motor.get(1)), (1, target), "{what}");
    }
}

/// A part of the end that the chip does not take, because datagrams or their answers are lost, is told to it by the
/// polls that follow.
#[test]
fn an_end_that_the_chip_does_not_take_is_told_again() {
    for (after, whole) in (0..12).flat_map(|after| [(after, false), (after, true)]) {
        for mut motor in Motor::each() {
            motor.rotate(motor.turn);
            motor.turns(1);
            motor.hand("press");
            motor.bench.module.board().borrow_mut().lose_answers(after, 3, whole);
            motor.bench.run(30 * MILLISECOND);
            motor.bench.module.board().borrow_mut().lose_answers(0, 0, false);
            motor.hand("release");
            motor.stands("three answers were lost");
            assert_eq!(motor.bench.ask(&format!("{} {}, {}", motor.back, motor.axis, motor.speed)).0, OK);
            motor.turns(-1);
        }
    }
}
