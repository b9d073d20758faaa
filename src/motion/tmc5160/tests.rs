//! The meaning of the chip's answers, bit by bit: not all of them come from a simulated chip.

use super::*;
use crate::chip::tmc5160::Register;
use crate::motion::Error;
use crate::motion::hardware::{RampGenerator, Readings};
use embedded_hal::spi::{ErrorKind, ErrorType, Operation};

/// A chip that knows its version and its position, and counts datagrams.
struct Stub {
    version: u8,
    position: i32,
    asked: u8,
    datagrams: u32,
}

impl ErrorType for &mut Stub {
    type Error = ErrorKind;
}

impl SpiDevice for &mut Stub {
    fn transaction(&mut self, operations: &mut [Operation<'_, u8>]) -> Result<(), ErrorKind> {
        let [Operation::TransferInPlace(datagram)] = operations else { return Err(ErrorKind::Other) };
        self.datagrams += 1;
        let word = match self.asked {
            address if address == Register::Ioin as u8 => u32::from(self.version) << 24,
            address if address == Register::XActual as u8 => self.position as u32,
            _ => 0,
        };
        self.asked = datagram[0];
        datagram[0] = 0;
        datagram[1..].copy_from_slice(&word.to_be_bytes());
        Ok(())
    }
}

/// Has the chip's position read by an axis that was at 0, and gives what it has read and the number of datagrams.
fn read(version: u8, position: i32) -> (Result<i32, Error>, u32) {
    let mut stub = Stub { version, position, asked: 0, datagrams: 0 };
    let [mut axis] = Tmc5160Axis::axes::<1>();
    let mut chip = Tmc5160::new(&mut stub);
    let read = axis.bind(&mut chip).position();
    assert_eq!(axis.known.position, read.unwrap_or(0));
    (read, stub.datagrams)
}

/// At its top speed of 7 999 512 pps a motor makes 8000 microsteps in a millisecond. A position that is further away
/// than twice of that, 2^14 microsteps, counts only if the chip tells its version, which takes two datagrams more.
#[test]
fn a_leap_of_the_position_is_confirmed() {
    for sign in [1, -1] {
        assert_eq!(read(0x30, sign * 16_384), (Ok(sign * 16_384), 2));
        assert_eq!(read(0x30, sign * 16_385), (Ok(sign * 16_385), 4));
        assert_eq!(read(0, sign * 16_384), (Ok(sign * 16_384), 2));
        assert_eq!(read(0, sign * 16_385).0, Err(Error::Chip));
    }
}

/// DRV_STATUS (datasheet section 6.5.5). The flags from bit 24 on, StallGuard, ot, otpw, s2ga, s2gb, ola, olb and stst,
/// are bits 0 to 7 of parameter 208. In bits 12 and 13, s2vsa and s2vsb are its bits 8 and 9. Over-temperature and the
/// short circuits shut the driver down; those are not shown while what was read may be older than the driver's release.
#[test]
fn the_flags_of_the_driver_are_those_of_parameter_208() {
    let [mut axis] = Tmc5160Axis::axes::<1>();
    let mut stub = Stub { version: 0, position: 0, asked: 0, datagrams: 0 };
    let chip = Tmc5160::new(&mut stub);
    let places = [(12, 8), (13, 9), (24, 0), (25, 1), (26, 2), (27, 3), (28, 4), (29, 5), (30, 6), (31, 7)];
    let shut_downs = 1 << 1 | 1 << 3 | 1 << 4 | 1 << 8 | 1 << 9;
    for bit in 0..32 {
        axis.driver = 1 << bit;
        let flags = places.iter().find(|(place, _)| *place == bit).map_or(0, |(_, flag)| 1 << flag);
        axis.delays.releasing = 0;
        assert_eq!(axis.readings(&chip).flags, flags, "bit {bit}");
        axis.delays.releasing = 1;
        assert_eq!(axis.readings(&chip).flags, flags & !shut_downs, "bit {bit}");
    }
    (axis.driver, axis.delays.releasing) = (u32::MAX, 0);
    assert_eq!(axis.readings(&chip).shut_downs, shut_downs);
}

/// SG_RESULT has bits 0 to 9 of DRV_STATUS, and CS_ACTUAL bits 16 to 20.
#[test]
fn load_and_current_are_fields_of_the_driver_status() {
    let [mut axis] = Tmc5160Axis::axes::<1>();
    let mut stub = Stub { version: 0, position: 0, asked: 0, datagrams: 0 };
    let chip = Tmc5160::new(&mut stub);
    for (driver, load, current) in [
        (0, 0, 0),
        (0x3FF, 1023, 0),
        (0x1F_0000, 0, 31),
        (0x0A_0155, 0x155, 10),
        (!0x3FF, 0, 31),
        (!0x1F_0000, 1023, 0),
    ] {
        axis.driver = driver;
        let Readings { load: read, current: given, .. } = axis.readings(&chip);
        assert_eq!((read, given), (load, current), "{driver:08X}h");
    }
}
