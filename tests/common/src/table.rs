//! The parameters of each product as its manual, or else what is published of it, has them. The tables are typed
//! independently of the firmware's own, and tests compare them.

use crate::row::{ANY, FLAG, Row, read_only, stored, volatile};
use crate::{Bench, tmcm1110, tmcm3212};
use tmcm::tmcl::Command;
use tmcm_sim::Product;

/// A table of parameters with the commands that read and write them.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// The parameters.
    pub rows: &'static [Row],
    /// Number of the command that reads: GAP or GGP.
    get: u8,
    /// Number of the command that writes: SAP or SGP.
    set: u8,
    /// Motor or bank field of both commands.
    motor_or_bank: u8,
}

impl Table {
    /// Reads a parameter, and gives status and value.
    pub fn read(&self, bench: &mut Bench, number: u8) -> (u8, i32) {
        let reply = bench.send(Command::new(self.get, number, self.motor_or_bank, 0));
        (reply.status, reply.value)
    }

    /// Reads a parameter that must be there, and gives the value.
    pub fn value(&self, bench: &mut Bench, row: &Row) -> i32 {
        let (status, value) = self.read(bench, row.number);
        assert_eq!(status, crate::OK, "{}", row.name);
        value
    }

    /// Writes a value and gives the status; the reply must repeat the value.
    pub fn write(&self, bench: &mut Bench, number: u8, value: i32) -> u8 {
        let reply = bench.send(Command::new(self.set, number, self.motor_or_bank, value));
        assert_eq!((reply.opcode, reply.value), (self.set, value));
        reply.status
    }

    /// Writes a value that must be accepted.
    pub fn set(&self, bench: &mut Bench, row: &Row, value: i32) {
        assert_eq!(self.write(bench, row.number, value), crate::OK, "{} = {value}", row.name);
    }

    /// The parameter with this number; `None` if the table has none.
    pub fn row(&self, number: u8) -> Option<&'static Row> {
        self.rows.iter().find(|row| row.number == number)
    }

    /// The rows of parameters that can be stored in the EEPROM.
    pub fn stored(&self) -> impl Iterator<Item = &'static Row> {
        self.rows.iter().filter(|row| row.is_stored())
    }

    /// The values of all settings.
    pub fn settings(&self, bench: &mut Bench) -> Vec<i32> {
        self.rows.iter().filter(|row| row.is_setting()).map(|row| self.value(bench, row)).collect()
    }

    /// True for the table of bank 0.
    pub fn is_global(&self) -> bool {
        (self.get, self.motor_or_bank) == (GLOBAL.get, GLOBAL.motor_or_bank)
    }
}

/// Parameters of axis 0 of the TMCM-1140: GAP and SAP.
pub const AXIS: Table = Table { rows: AXIS_ROWS, get: 6, set: 5, motor_or_bank: 0 };
/// Bank 0: GGP and SGP.
pub const GLOBAL: Table = Table { rows: GLOBAL_ROWS, get: 10, set: 9, motor_or_bank: 0 };
/// Bank 3, the configuration of interrupts.
pub const INTERRUPT: Table = Table { rows: INTERRUPT_ROWS, get: 10, set: 9, motor_or_bank: 3 };

/// All tables of a product: one for each axis, bank 0 and bank 3.
pub fn tables(product: Product) -> Vec<Table> {
    let (axes, inputs, axis, global) = match product {
        Product::Tmcm1140 => (1, 4, AXIS_ROWS.to_vec(), GLOBAL_ROWS.to_vec()),
        Product::Tmcm1110 => (1, 4, tmcm1110::AXIS_ROWS.to_vec(), tmcm1110::GLOBAL_ROWS.to_vec()),
        Product::Tmcm3110 => (3, 8, changed(&sisters_axis_rows(), ENCODERS_3110), GLOBAL_ROWS.to_vec()),
        Product::Tmcm3212 => (3, 4, tmcm3212::AXIS_ROWS.to_vec(), without(GLOBAL_ROWS, &[67, 79, 90])),
        Product::Tmcm6110 => (6, 8, sisters_axis_rows(), changed(GLOBAL_ROWS, BOTH_CONTROLLERS)),
    };
    let mut interrupts = INTERRUPT_ROWS.to_vec();
    if axes > 1 {
        interrupts = INTERRUPT_ROWS[..3].to_vec();
        for axis in 0..axes {
            for (number, name) in [(27 + 2 * axis, "stop left"), (28 + 2 * axis, "stop right")] {
                interrupts.push(volatile(number, format!("{name} {axis} transition").leak(), &[(0, 3)], 0));
            }
        }
        interrupts.extend((0..inputs).map(|n| volatile(39 + n, format!("input {n} transition").leak(), &[(0, 3)], 0)));
    }
    let (axis, global, interrupts): (&[Row], &[Row], &[Row]) = (axis.leak(), global.leak(), interrupts.leak());
    let of_axes = (0..axes).map(|number| Table { rows: axis, motor_or_bank: number, ..AXIS });
    of_axes.chain([Table { rows: global, ..GLOBAL }, Table { rows: interrupts, ..INTERRUPT }]).collect()
}

/// The rows with others in place of those with the same numbers, in the order of the numbers.
fn changed(rows: &[Row], by: &[Row]) -> Vec<Row> {
    let kept = rows.iter().filter(|row| by.iter().all(|other| other.number != row.number));
    let mut rows: Vec<Row> = kept.chain(by).copied().collect();
    rows.sort_by_key(|row| row.number);
    rows
}

/// The rows without some numbers.
fn without(rows: &[Row], numbers: &[u8]) -> Vec<Row> {
    rows.iter().filter(|row| !numbers.contains(&row.number)).copied().collect()
}

/// The axis parameters that the TMCM-6110 has, and the TMCM-3110 as well: those of the TMCM-1140 without its two
/// encoders, and with a group index.
fn sisters_axis_rows() -> Vec<Row> {
    let rows = changed(
        AXIS_ROWS,
        &[
            stored(4, "maximum positioning speed", &[(0, 2047)], 1000),
            stored(5, "maximum acceleration", &[(0, 2047)], 1000),
            read_only(9, "reference (home) switch state", FLAG),
            read_only(208, "driver error flags", &[(0, 255)]),
            volatile(213, "group index", &[(0, 255)], 0),
        ],
    );
    without(&rows, &[209, 210, 212, 215, 216, 217, 218])
}

/// Axis parameters that the TMCM-3110 has and the TMCM-6110 has not.
const ENCODERS_3110: &[Row] = &[
    stored(201, "encoder mode", &[(0, 65535)], 0),
    volatile(209, "encoder position", ANY, 0),
    stored(210, "encoder prescaler", &[(0, i32::MAX)], 25600),
    stored(212, "maximum encoder deviation", &[(0, i32::MAX)], 0),
    stored(254, "step/direction mode", &[(0, 5)], 0),
];

/// Global parameters with a bit for each motion controller of the TMCM-6110.
const BOTH_CONTROLLERS: &[Row] =
    &[stored(79, "end switch polarity", &[(0, 3)], 0), stored(90, "reverse shaft", &[(0, 3)], 0)];

/// Chapter 4 of the manual. The manual gives no limits for the two prescalers, 210 and 217; the firmware refuses
/// negative ones, because they have no meaning.
const AXIS_ROWS: &[Row] = &[
    volatile(0, "target position", ANY, 0),
    volatile(1, "actual position", ANY, 0),
    volatile(2, "target speed", &[(-2047, 2047)], 0),
    read_only(3, "actual speed", &[(-2047, 2047)]),
    stored(4, "maximum positioning speed", &[(1, 2047)], 1000),
    stored(5, "maximum acceleration", &[(1, 2047)], 1000),
    stored(6, "maximum current", &[(0, 255)], 128),
    stored(7, "standby current", &[(0, 255)], 8),
    read_only(8, "position reached flag", FLAG),
    read_only(9, "home switch state", FLAG),
    read_only(10, "right limit switch state", FLAG),
    read_only(11, "left limit switch state", FLAG),
    stored(12, "right limit switch disable", FLAG, 1),
    stored(13, "left limit switch disable", FLAG, 1),
    stored(130, "minimum speed", &[(1, 2047)], 1),
    read_only(135, "actual acceleration", &[(0, 2047)]),
    volatile(138, "ramp mode", &[(0, 2)], 0),
    stored(140, "microstep resolution", &[(0, 8)], 8),
    stored(141, "reference switch tolerance", &[(0, 4095)], 0),
    stored(149, "soft stop flag", FLAG, 0),
    stored(150, "end switch power down mode", FLAG, 0),
    stored(153, "ramp divisor", &[(0, 13)], 7),
    stored(154, "pulse divisor", &[(0, 13)], 3),
    stored(160, "step interpolation enable", FLAG, 0),
    stored(161, "double step enable", FLAG, 0),
    stored(162, "chopper blank time", &[(0, 3)], 2),
    stored(163, "constant TOff mode", FLAG, 0),
    stored(164, "disable fast decay comparator", FLAG, 0),
    stored(165, "chopper hysteresis end / fast decay time", &[(0, 15)], 2),
    stored(166, "chopper hysteresis start / sine wave offset", &[(0, 8)], 3),
    stored(167, "chopper off time", &[(0, 15)], 5),
    stored(168, "smartEnergy current minimum", FLAG, 0),
    stored(169, "smartEnergy current down step", &[(0, 3)], 0),
    stored(170, "smartEnergy hysteresis", &[(0, 15)], 0),
    stored(171, "smartEnergy current up step", &[(0, 3)], 0),
    stored(172, "smartEnergy hysteresis start", &[(0, 15)], 0),
    stored(173, "stallGuard2 filter enable", FLAG, 1),
    stored(174, "stallGuard2 threshold", &[(-64, 63)], 5),
    stored(175, "slope control high side", &[(0, 3)], 3),
    stored(176, "slope control low side", &[(0, 3)], 3),
    stored(177, "short protection disable", FLAG, 0),
    stored(178, "short detection timer", &[(0, 3)], 0),
    read_only(179, "Vsense", FLAG),
    read_only(180, "smartEnergy actual current", &[(0, 31)]),
    stored(181, "stop on stall", &[(0, 2047)], 0),
    stored(182, "smartEnergy threshold speed", &[(0, 2047)], 0),
    stored(183, "smartEnergy slow run current", &[(0, 255)], 0),
    stored(184, "random TOFF mode", FLAG, 0),
    stored(193, "reference search mode", &[(1, 8), (65, 68), (133, 136)], 1),
    stored(194, "reference search speed", &[(0, 2047)], 500),
    stored(195, "reference switch speed", &[(0, 2047)], 100),
    read_only(196, "end switch distance", ANY),
    read_only(197, "last reference position", ANY),
    stored(200, "boost current", &[(0, 255)], 0),
    stored(204, "freewheeling", &[(0, 65535)], 0),
    read_only(206, "actual load value", &[(0, 1023)]),
    read_only(207, "extended error flags", &[(0, 3)]),
    read_only(208, "TMC262 error flags", &[(0, 255)]),
    volatile(209, "encoder position", ANY, 0),
    stored(210, "encoder prescaler", &[(0, i32::MAX)], 25600),
    stored(212, "maximum encoder deviation", &[(0, i32::MAX)], 0),
    stored(214, "power down delay", &[(1, 65535)], 200),
    read_only(215, "absolute resolver value", &[(0, 1023)]),
    volatile(216, "external encoder position", ANY, 0),
    stored(217, "external encoder prescaler", &[(0, i32::MAX)], 512),
    stored(218, "maximum external encoder deviation", &[(0, i32::MAX)], 0),
];

/// Section 5.1 of the manual.
const GLOBAL_ROWS: &[Row] = &[
    stored(65, "RS485 baud rate", &[(0, 8)], 0),
    stored(66, "serial address", &[(1, 255)], 1),
    stored(67, "ASCII mode", &[(0, 63)], 0),
    stored(68, "serial heartbeat", &[(0, 65535)], 0),
    stored(69, "CAN bit rate", &[(2, 8)], 8),
    stored(70, "CAN reply ID", &[(0, 2047)], 2),
    stored(71, "CAN ID", &[(0, 2047)], 1),
    stored(75, "telegram pause time", &[(0, 255)], 0),
    stored(76, "serial host address", &[(0, 255)], 2),
    stored(77, "auto start mode", FLAG, 0),
    stored(79, "end switch polarity", FLAG, 0),
    stored(81, "TMCL code protection", &[(0, 3)], 0),
    stored(82, "CAN heartbeat", &[(0, 65535)], 0),
    stored(83, "CAN secondary address", &[(0, 2047)], 0),
    stored(84, "coordinate storage", FLAG, 0),
    stored(85, "do not restore user variables", FLAG, 0),
    stored(87, "serial secondary address", &[(0, 255)], 0),
    stored(90, "reverse shaft", FLAG, 0),
    read_only(128, "TMCL application status", &[(0, 3)]),
    read_only(129, "download mode", FLAG),
    read_only(130, "TMCL program counter", ANY),
    volatile(132, "TMCL tick timer", &[(0, i32::MAX)], 0),
    volatile(133, "random number", &[(0, i32::MAX)], 0),
    volatile(255, "suppress reply", FLAG, 0),
];

/// Section 5.4 of the manual. Periods of timers are unsigned, so all 32-bit values are accepted.
const INTERRUPT_ROWS: &[Row] = &[
    volatile(0, "timer 0 period", ANY, 0),
    volatile(1, "timer 1 period", ANY, 0),
    volatile(2, "timer 2 period", ANY, 0),
    volatile(27, "stop left 0 transition", &[(0, 3)], 0),
    volatile(28, "stop right 0 transition", &[(0, 3)], 0),
    volatile(39, "input 0 transition", &[(0, 3)], 0),
    volatile(40, "input 1 transition", &[(0, 3)], 0),
    volatile(41, "input 2 transition", &[(0, 3)], 0),
    volatile(42, "input 3 transition", &[(0, 3)], 0),
];
