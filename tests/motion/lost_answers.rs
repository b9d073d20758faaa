//! Lost answers on the motion bus, on all products. If one is lost, a command is none the worse, wherever that is. If
//! three in a row are lost, the command is refused, and the motors do what they did before it.

use common::{Bench, NOT_AVAILABLE, OK};
use hal_sim::clock::{MILLISECOND, Nanos, SECOND};
use tmcm_sim::{Product, VirtualModule};

/// The situation that a command finds, and commands for that. In a line `%` stands for a speed of the product, and `#`
/// for each of the axes.
struct Scene {
    prepare: &'static [&'static str],
    commands: &'static [&'static str],
}

/// Scenes with one axis, or with a group.
const SCENES: [Scene; 4] = [
    Scene {
        prepare: &[],
        commands: &[
            "MVP ABS, 0, 5000",
            "MVP REL, 0, -5000",
            "SAP 0, 0, 5000",
            "ROR 0, %",
            "SAP 138, 0, 2",
            "SAP 1, 0, 0",
        ],
    },
    Scene {
        prepare: &["ROR #, %"],
        commands: &["SAP 2, 0, -%", "MST 0", "ROL 0, %", "MVP ABS, 0, -5000", "SAP 5, 0, %", "SAP 138, 0, 0"],
    },
    Scene {
        prepare: &["MVP ABS, #, 100000"],
        commands: &["MVP ABS, 0, -5000", "SAP 0, 0, 5000", "MST 0", "ROR 0, %", "SAP 4, 0, %"],
    },
    Scene { prepare: &["ROR #, %", "wait", "MST #"], commands: &["MVP ABS, 0, 5000", "ROL 0, %", "SAP 2, 0, %"] },
];

/// The speed of `%`, in the unit of the product: some 15 000 or 20 000 microsteps per second.
fn speed(product: Product) -> i32 {
    if product == Product::Tmcm3212 { 20_000 } else { 500 }
}

/// Microsteps that a motor makes at that speed in some half a millisecond. A datagram more may delay a command by that
/// time: at worst it is then executed after the next poll.
const DELAY: u64 = 16;

/// State of one axis, as the test sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seen {
    rotor: i64,
    /// The answers to GAP of 0, 2, 3, 4, 5 and 138.
    parameters: [(u8, i32); 6],
}

/// The datagrams that lose their answers, counted from the command on.
#[derive(Clone, Copy, Debug)]
struct Lost {
    after: u64,
    count: u64,
    whole: bool,
}

struct Case<'a> {
    product: Product,
    /// The axes that the command is for.
    axes: &'a [u8],
    prepare: Vec<String>,
    command: String,
}

impl Case<'_> {
    fn lines(lines: &[&str], product: Product, axes: &[u8]) -> Vec<String> {
        let line = |line: &&str| line.replace('%', &speed(product).to_string());
        let each = |line: String| -> Vec<String> {
            let axes = if line.contains('#') { axes } else { &axes[..1] };
            axes.iter().map(|axis| line.replace('#', &axis.to_string())).collect()
        };
        lines.iter().map(line).flat_map(each).collect()
    }

    /// The module as the command finds it.
    fn bench(&self) -> Bench {
        let mut bench = Bench::of(self.product);
        if self.product == Product::Tmcm3212 {
            for axis in self.axes {
                for line in ["SAP 4, #, 50000", "SAP 5, #, 500000", "SAP 17, #, 500000"] {
                    bench.ok(&line.replace('#', &axis.to_string()));
                }
            }
        }
        for line in &self.prepare {
            if line == "wait" {
                bench.run(500 * MILLISECOND);
            } else {
                bench.ok(line);
            }
        }
        bench.run(500 * MILLISECOND);
        bench
    }

    fn datagrams(bench: &Bench) -> u64 {
        let board = bench.module.board().borrow();
        board.kind().motion_bus().map(|chip| board.datagrams(chip)).sum()
    }

    /// The answer to the command, its number of datagrams, and what is seen of the axes some time afterwards.
    fn run(&self, command: Option<&str>, lost: Option<Lost>, time: Nanos) -> (Option<(u8, i32)>, u64, Vec<Seen>) {
        let mut bench = self.bench();
        let end = bench.module.now() + time;
        let before = Self::datagrams(&bench);
        if let Some(Lost { after, count, whole }) = lost {
            bench.module.board().borrow_mut().lose_answers(after, count, whole);
        }
        let answer = command.map(|line| bench.ask(line));
        let datagrams = Self::datagrams(&bench) - before;
        bench.run(20 * MILLISECOND);
        // Answers that are lost later are none of the command's.
        bench.module.board().borrow_mut().lose_answers(0, 0, false);
        bench.run(end - bench.module.now());
        let seen = self.axes.iter().map(|axis| Self::seen(&mut bench, *axis)).collect();
        (answer, datagrams, seen)
    }

    fn seen(bench: &mut Bench, axis: u8) -> Seen {
        let rotor = bench.module.board().borrow().world().axis(axis.into()).motor().rotor();
        let parameters = [0, 2, 3, 4, 5, 138].map(|number| bench.ask(&format!("GAP {number}, {axis}")));
        Seen { rotor, parameters }
    }

    /// Asserts that the axes are where others are, but for [`DELAY`], and that their parameters show the same.
    fn same(&self, seen: &[Seen], expected: &[Seen], lost: Lost) {
        for (axis, (seen, expected)) in seen.iter().zip(expected).enumerate() {
            let Case { product, prepare, command, .. } = self;
            let what =
                format!("{product:?}, {prepare:?}, {command}, {lost:?}, axis {axis}: {seen:?}, not {expected:?}");
            assert_eq!(seen.parameters, expected.parameters, "{what}");
            assert!(seen.rotor.abs_diff(expected.rotor) <= DELAY, "{what}");
        }
    }

    /// Loses one answer at each datagram of the command, and then three in a row.
    fn check(&self) {
        let time = 1_500 * MILLISECOND;
        let (answer, datagrams, moved) = self.run(Some(&self.command), None, time);
        assert_eq!(answer.map(|(status, _)| status), Some(OK), "{}", self.command);
        let (_, _, stayed) = self.run(None, None, time);
        let mut refused = 0;
        for after in 0..datagrams {
            for whole in [false, true] {
                let lost = Lost { after, count: 1, whole };
                let (told, _, seen) = self.run(Some(&self.command), Some(lost), time);
                assert_eq!(told, answer, "{:?}: {:?}, {}, {lost:?}", self.product, self.prepare, self.command);
                self.same(&seen, &moved, lost);
                let lost = Lost { after, count: 3, whole };
                let (told, _, seen) = self.run(Some(&self.command), Some(lost), time);
                let expected = if told == answer { &moved } else { &stayed };
                assert!(told == answer || told.is_some_and(|(status, _)| status == NOT_AVAILABLE), "{told:?}");
                refused += u32::from(told != answer);
                self.same(&seen, expected, lost);
            }
        }
        assert!(refused > 0, "{:?}: {}: no three answers that matter", self.product, self.command);
    }
}

/// Checks all scenes on a product; with several axes they are in a group, and the command is for the first of them.
fn scenes(product: Product, axes: &[u8]) {
    for Scene { prepare, commands } in SCENES {
        for command in commands {
            let command = Case::lines(&[command], product, &axes[..1]).remove(0);
            let alone = command.starts_with("SAP");
            let mut prepare = Case::lines(prepare, product, axes);
            if axes.len() > 1 && !alone {
                prepare.splice(0..0, axes.iter().map(|axis| format!("SAP 213, {axis}, 1")));
            }
            let known = product != Product::Tmcm3212 || !command.starts_with("SAP 138");
            if known && (axes.len() == 1 || !alone) {
                Case { product, axes, prepare, command }.check();
            }
        }
    }
}

#[test]
fn lost_answers_of_one_axis() {
    for product in Product::ALL {
        scenes(product, &[0]);
    }
}

#[test]
fn lost_answers_of_a_group() {
    for (product, axes) in [(Product::Tmcm3110, [0, 1]), (Product::Tmcm3212, [0, 2]), (Product::Tmcm6110, [1, 4])] {
        scenes(product, &axes);
    }
}

/// Axes that start at once, from rest and on their way; and axes on a straight line, which leave one for that.
#[test]
fn lost_answers_of_a_set_of_axes() {
    for (product, axes) in [(Product::Tmcm3110, [0, 1]), (Product::Tmcm3212, [0, 2]), (Product::Tmcm6110, [1, 4])] {
        let bits: u8 = axes.iter().map(|axis| 1 << axis).sum();
        let coordinates: Vec<String> = [(1, [5_000, -3_000]), (2, [60_000, 40_000])]
            .into_iter()
            .flat_map(|(number, places)| {
                axes.into_iter().zip(places).map(move |(axis, place)| format!("SCO {number}, {axis}, {place}"))
            })
            .collect();
        for before in [None, Some("ROR"), Some("40h")] {
            for kind in [0x80, 0x40] {
                let mut prepare = coordinates.clone();
                match before {
                    None => {}
                    Some("40h") => prepare.push(format!("MVP COORD, {}, 2", bits | 0x40)),
                    Some(_) => prepare.extend(axes.map(|axis| format!("ROR {axis}, {}", speed(product)))),
                }
                Case { product, axes: &axes, prepare, command: format!("MVP COORD, {}, 1", bits | kind) }.check();
            }
        }
    }
}

/// A command that reaches the motors while nothing is answered is taken back as soon as the chips answer again, if that
/// is before they are given up.
#[test]
fn a_command_into_a_silent_bus_is_taken_back() {
    for product in Product::ALL {
        for Scene { prepare, commands } in SCENES {
            for command in commands.iter().filter(|command| !command.starts_with("SAP 1")) {
                let command = Case::lines(&[command], product, &[0]).remove(0);
                let case = Case { product, axes: &[0], prepare: Case::lines(prepare, product, &[0]), command };
                let (mut told, mut stayed) = (case.bench(), case.bench());
                let end = told.module.now() + SECOND;
                told.control("fault spi on");
                assert_eq!(told.ask(&case.command).0, NOT_AVAILABLE, "{product:?}: {}", case.command);
                told.run(MILLISECOND);
                told.control("fault spi off");
                told.run(end - told.module.now());
                stayed.run(SECOND);
                let lost = Lost { after: 0, count: u64::MAX, whole: false };
                // The motor may have been on the way of the command for a millisecond.
                case.same(&[Case::seen(&mut told, 0)], &[Case::seen(&mut stayed, 0)], lost);
            }
        }
    }
}
