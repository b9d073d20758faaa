//! The parameters of the TMCM-1110, typed from its firmware manual V1.03. What is not in the manual, or differs from
//! it, is explained in `docs/tmcm1110.md`. Defaults that the manual does not give are those of a module whose settings
//! are public.

use crate::row::{ANY, FLAG, Row, read_only, stored, volatile};

/// Chapter 5 of the manual. Of the chopper parameters it says nothing of storing; those of this family can be stored.
pub(super) const AXIS_ROWS: &[Row] = &[
    volatile(0, "target position", ANY, 0),
    volatile(1, "actual position", ANY, 0),
    volatile(2, "target speed", &[(-2047, 2047)], 0),
    read_only(3, "actual speed", &[(-2047, 2047)]),
    stored(4, "maximum positioning speed", &[(0, 2047)], 1000),
    stored(5, "maximum acceleration", &[(0, 2047)], 1000),
    stored(6, "maximum current", &[(0, 255)], 128),
    stored(7, "standby current", &[(0, 255)], 8),
    read_only(8, "position reached flag", FLAG),
    read_only(9, "reference switch state", FLAG),
    read_only(10, "right limit switch state", FLAG),
    read_only(11, "left limit switch state", FLAG),
    // Section 5.3.
    stored(12, "right limit switch disable", FLAG, 1),
    stored(13, "left limit switch disable", FLAG, 1),
    stored(130, "minimum speed", &[(0, 2047)], 1),
    read_only(135, "actual acceleration", &[(0, 2047)]),
    volatile(138, "ramp mode", &[(0, 2)], 0),
    stored(140, "microstep resolution", &[(0, 8)], 8),
    // Section 5.3.
    stored(141, "reference switch tolerance", &[(0, 4095)], 0),
    stored(149, "soft stop flag", FLAG, 0),
    stored(153, "ramp divisor", &[(0, 13)], 7),
    stored(154, "pulse divisor", &[(0, 13)], 3),
    stored(160, "step interpolation enable", FLAG, 0),
    stored(161, "double step enable", FLAG, 0),
    stored(162, "chopper blank time", &[(0, 3)], 2),
    stored(163, "chopper mode", FLAG, 0),
    stored(164, "chopper hysteresis decrement", &[(0, 3)], 0),
    // The manual has the hysteresis itself, -3..12.
    stored(165, "chopper hysteresis end", &[(0, 15)], 2),
    stored(166, "chopper hysteresis start", &[(0, 8)], 3),
    stored(167, "chopper off time", &[(0, 0), (2, 15)], 5),
    stored(168, "smartEnergy current minimum", FLAG, 0),
    stored(169, "smartEnergy current down step", &[(0, 3)], 0),
    stored(170, "smartEnergy hysteresis", &[(0, 15)], 0),
    // The manual's range is 1..3, its description has 0..3.
    stored(171, "smartEnergy current up step", &[(0, 3)], 0),
    stored(172, "smartEnergy hysteresis start", &[(0, 15)], 0),
    stored(173, "stallGuard2 filter enable", FLAG, 1),
    stored(174, "stallGuard2 threshold", &[(-64, 63)], 5),
    stored(175, "slope control high side", &[(0, 3)], 3),
    stored(176, "slope control low side", &[(0, 3)], 3),
    stored(177, "short protection disable", FLAG, 0),
    stored(178, "short detection timer", &[(0, 3)], 0),
    stored(179, "Vsense", FLAG, 1),
    read_only(180, "smartEnergy actual current", &[(0, 31)]),
    stored(181, "stop on stall", &[(0, 2047)], 0),
    stored(182, "smartEnergy threshold speed", &[(0, 2047)], 0),
    stored(183, "smartEnergy slow run current", &[(0, 255)], 0),
    // The note at the head of the chapter.
    stored(184, "random TOFF mode", FLAG, 0),
    // The manual has 1..8, and 128 more for an inverted home switch; host software sets 65..68.
    stored(193, "reference search mode", &[(1, 8), (65, 68), (133, 136)], 1),
    stored(194, "reference search speed", &[(0, 2047)], 500),
    stored(195, "reference switch speed", &[(0, 2047)], 100),
    read_only(196, "end switch distance", ANY),
    // Read by host software.
    read_only(197, "last reference position", ANY),
    stored(204, "freewheeling", &[(0, 65535)], 0),
    read_only(206, "actual load value", &[(0, 1023)]),
    read_only(208, "TMC262 error flags", &[(0, 255)]),
    volatile(209, "encoder position", ANY, 0),
    stored(210, "encoder prescaler", &[(0, i32::MAX)], 25600),
    stored(212, "maximum encoder deviation", &[(0, 65535)], 0),
    stored(214, "power down delay", &[(1, 65535)], 200),
    stored(254, "step/direction mode", FLAG, 0),
];

/// Section 6.1 of the manual.
pub(super) const GLOBAL_ROWS: &[Row] = &[
    stored(64, "EEPROM magic", &[(0, 255)], 0xE4),
    stored(65, "RS485 baud rate", &[(0, 11)], 0),
    stored(66, "serial address", &[(0, 255)], 1),
    stored(68, "serial heartbeat", &[(0, 65535)], 0),
    stored(69, "CAN bit rate", &[(2, 8)], 8),
    stored(70, "CAN reply ID", &[(0, 0x7FF)], 2),
    stored(71, "CAN ID", &[(0, 0x7FF)], 1),
    stored(73, "configuration EEPROM lock flag", &[(0, 1), (1234, 1234), (4321, 4321)], 0),
    stored(75, "telegram pause time", &[(0, 255)], 0),
    stored(76, "serial host address", &[(0, 255)], 2),
    stored(77, "auto start mode", FLAG, 0),
    // Read by host software.
    stored(79, "end switch polarity", FLAG, 0),
    stored(81, "TMCL code protection", &[(0, 3)], 0),
    stored(82, "CAN heartbeat", &[(0, 65535)], 0),
    stored(83, "CAN secondary address", &[(0, 0x7FF)], 0),
    stored(84, "coordinate storage", FLAG, 0),
    stored(85, "do not restore user variables", FLAG, 0),
    stored(86, "step pulse length", &[(0, 15)], 0),
    read_only(128, "TMCL application status", &[(0, 3)]),
    read_only(129, "download mode", FLAG),
    read_only(130, "TMCL program counter", ANY),
    volatile(132, "TMCL tick timer", &[(0, i32::MAX)], 0),
    read_only(133, "random number", &[(0, i32::MAX)]),
];
