//! The examples for three axes. Each runs on the TMCM-3110, and as it is on the TMCM-6110.

use super::{Example, TURN};
use hal_sim::clock::{MILLISECOND, SECOND};
use hal_sim::control::State;
use tmcm_sim::Product;

const PRODUCTS: [Product; 2] = [Product::Tmcm3110, Product::Tmcm6110];

/// The stage on which the axes are homed, where their rotors begin, and where each has its zero.
const GANTRY: &str = include_str!("../../../../hal-sim/worlds/gantry.toml");
const BEGIN: [i64; 3] = [102_400, 51_200, 25_600];
const ZEROS: [i64; 3] = [0, 307_200, 0];

const AXES: [usize; 3] = [0, 1, 2];

fn rotors(state: &State) -> [i64; 3] {
    AXES.map(|axis| state.axes[axis].rotor)
}

fn turning(state: &State) -> [bool; 3] {
    AXES.map(|axis| state.axes[axis].velocity != 0)
}

impl Example {
    fn runs(&self) -> bool {
        self.bench.module.machine().is_some_and(|machine| machine.runs())
    }

    /// Lets time pass until something is so, and gives the state then.
    fn sees(&mut self, wanted: impl FnMut(&State) -> bool) -> State {
        self.when(20 * SECOND, wanted);
        self.state()
    }

    /// The axes beyond the first three have stayed where they were.
    fn others_rest(&self) -> bool {
        self.state().axes[3..].iter().all(|axis| axis.rotor == 0 && axis.velocity == 0)
    }
}

#[test]
fn homing_axes() {
    for product in PRODUCTS {
        // The axes of a TMCM-6110 that the gantry does not have begin at 0.
        let mut example = Example::load_into(product, "homing_axes.tmc", GANTRY);
        assert_eq!(rotors(&example.state()), BEGIN);
        example.begin("129");
        // The tool goes out of the way before anything else moves; then two axes search at the same time.
        assert_eq!(turning(&example.sees(|state| turning(state)[2])), [false, false, true]);
        let state = example.sees(|state| turning(state)[0] || turning(state)[1]);
        assert!((state.axes[2].rotor - ZEROS[2]).abs() <= 256 && !turning(&state)[2], "{state:?}");
        example.bench.run(100 * MILLISECOND);
        assert_eq!(turning(&example.state()), [true, true, false]);
        // X goes to its left end, Y to its home switch in the middle. Switches have a hysteresis, so a zero may be a
        // little beside the place where one closes.
        let state = example.sees(|state| state.outputs[0]);
        for (rotor, zero) in rotors(&state).into_iter().zip(ZEROS) {
            assert!((rotor - zero).abs() <= 256, "{state:?}");
        }
        let zeros = rotors(&state);
        example.bench.run(5 * MILLISECOND);
        assert_eq!(turning(&example.state()), [true; 3]);
        let state = example.sees(|state| turning(state) == [false; 3]);
        let turn = i64::from(TURN);
        assert_eq!(rotors(&state), [zeros[0] + turn, zeros[1] - turn, zeros[2] + turn]);
        example.bench.run(5 * MILLISECOND);
        assert!(!example.runs() && example.others_rest());
        assert_eq!(AXES.map(|axis| example.bench.ok(&format!("GAP 1, {axis}"))), [TURN, -TURN, TURN]);
        assert_eq!(example.executed(), 23);
    }
}

/// The distance of a point from the straight line between two others.
fn off_the_line(point: [i64; 3], from: [i64; 3], to: [i64; 3]) -> f64 {
    let between = |a: [i64; 3], b: [i64; 3]| AXES.map(|axis| (b[axis] - a[axis]) as f64);
    let (way, gone) = (between(from, to), between(from, point));
    let dot = |a: [f64; 3], b: [f64; 3]| AXES.iter().map(|axis| a[*axis] * b[*axis]).sum::<f64>();
    let part = dot(way, gone) / dot(way, way);
    let off = AXES.map(|axis| gone[axis] - part * way[axis]);
    dot(off, off).sqrt()
}

/// The course of a way from corner to corner.
struct Travel {
    /// The largest distance from the straight line, in parts of the longest way of an axis.
    off: f64,
    /// When each axis began to turn, and when it stopped, in milliseconds.
    begun: [u64; 3],
    arrived: [u64; 3],
}

fn way(example: &mut Example, from: [i64; 3], to: [i64; 3]) -> Travel {
    let longest = AXES.map(|axis| from[axis].abs_diff(to[axis])).into_iter().max().unwrap();
    let mut way = Travel { off: 0.0, begun: [0; 3], arrived: [0; 3] };
    for time in example.time() + 1..example.time() + 10_000 {
        let state = example.until(time);
        way.off = way.off.max(off_the_line(rotors(&state), from, to) / longest as f64);
        for (axis, turns) in turning(&state).into_iter().enumerate() {
            if turns && way.begun[axis] == 0 {
                way.begun[axis] = time;
            }
            if turns {
                way.arrived[axis] = time;
            }
        }
        if way.arrived.iter().all(|arrived| *arrived > 0) && turning(&state) == [false; 3] {
            assert_eq!(rotors(&state), to);
            return way;
        }
    }
    panic!("it does not get to {to:?}");
}

fn spread(times: [u64; 3]) -> u64 {
    times.into_iter().max().unwrap() - times.into_iter().min().unwrap()
}

#[test]
fn straight_line() {
    let corners = [[0; 3], [153_600, 51_200, 12_800], [51_200, 128_000, -25_600], [0; 3]];
    for product in PRODUCTS {
        let mut example = Example::load_into(product, "straight_line.tmc", "");
        example.begin("129");
        for edge in corners[..3].windows(2) {
            let seen = way(&mut example, edge[0], edge[1]);
            assert!(seen.off < 0.005, "{} to {:?}", seen.off, edge[1]);
            assert!(spread(seen.begun) <= 1 && spread(seen.arrived) <= 10, "{:?} {:?}", seen.begun, seen.arrived);
        }
        // The way back is no straight line: each axis is there when it is there.
        let back = way(&mut example, corners[2], corners[3]);
        assert!(back.off > 0.1 && spread(back.begun) <= 1 && spread(back.arrived) > 300, "{}", back.off);
        assert!(back.arrived[2] < back.arrived[0] && back.arrived[0] < back.arrived[1], "{:?}", back.arrived);
        example.bench.run(400 * MILLISECOND);
        assert!(!example.runs() && example.others_rest());
        assert_eq!(example.executed(), 34);
    }
}

/// A pulse at an input.
fn pulse(example: &mut Example, input: u8) {
    example.bench.control(&format!("input {input} 1"));
    example.bench.run(50 * MILLISECOND);
    example.bench.control(&format!("input {input} 0"));
}

#[test]
fn pick_and_place() {
    let (belt, low, pitch) = ([102_400, 0, 38_400], 38_400, 25_600);
    let tray = [[0, 51_200, low], [pitch, 51_200, low], [0, 51_200 + pitch, low]];
    for product in PRODUCTS {
        let mut example = Example::load_into(product, "pick_and_place.tmc", "");
        example.begin("129");
        example.bench.run(300 * MILLISECOND);
        assert_eq!(rotors(&example.state()), [0; 3], "no part is there");

        // Somebody opens the lid while the first part is fetched.
        pulse(&mut example, 1);
        example.bench.run(800 * MILLISECOND);
        assert_eq!(turning(&example.state()), [true, false, false]);
        example.bench.control("input 2 1");
        example.bench.run(300 * MILLISECOND);
        let stopped = example.state();
        assert!(stopped.outputs[7] && turning(&stopped) == [false; 3]);
        assert!(stopped.axes[0].rotor > 10_000 && stopped.axes[0].rotor < 100_000, "{stopped:?}");
        // The second part comes meanwhile: it is not forgotten.
        pulse(&mut example, 1);
        example.bench.run(SECOND);
        assert_eq!(rotors(&example.state()), rotors(&stopped));
        example.bench.control("input 2 0");
        example.bench.run(10 * MILLISECOND);
        assert!(!example.state().outputs[7]);

        for (number, place) in tray.into_iter().enumerate() {
            if number == 2 {
                // This one has not come yet.
                example.bench.run(3 * SECOND);
                assert_eq!(turning(&example.state()), [false; 3]);
                pulse(&mut example, 1);
            }
            let taken = example.sees(|state| state.outputs[0]);
            assert_eq!(rotors(&taken), belt);
            example.sees(|state| state.axes[2].rotor < low && state.outputs[0]);
            let travels = example.sees(|state| turning(state)[1]);
            assert_eq!(travels.axes[2].rotor, 0, "it is up");
            assert_eq!(rotors(&example.sees(|state| !state.outputs[0])), place);
            if number == 0 {
                // The lid again, on the way up: X and Y are where they are to be and stay there.
                example.sees(|state| state.axes[2].rotor < low / 2);
                example.bench.control("input 2 1");
                example.bench.run(300 * MILLISECOND);
                example.bench.control("input 2 0");
            }
            let up = example.sees(|state| state.axes[2].rotor == 0);
            assert_eq!(rotors(&up)[..2], place[..2]);
        }
        example.bench.run(SECOND);
        assert_eq!((example.bench.ok("GGP 0, 2"), example.bench.ok("GGP 1, 2")), (3, 3));
        assert!(example.runs() && example.others_rest() && turning(&example.state()) == [false; 3]);
        example.executed();
    }
}
