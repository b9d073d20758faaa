//! The SDO server: transfers of all sizes, each abort code, and what stands in the middle of a transfer.

use crate::rig::{Rig, checked, expedited};

const TOGGLE: u32 = 0x0503_0000;
const COMMAND: u32 = 0x0504_0001;
pub(crate) const LENGTH: u32 = 0x0607_0010;
pub(crate) const TOO_LONG: u32 = 0x0607_0012;
pub(crate) const TOO_SHORT: u32 = 0x0607_0013;
pub(crate) const VALUE: u32 = 0x0609_0030;
pub(crate) const STATE: u32 = 0x0800_0022;

/// A request for an upload of 1008h, nine bytes in two segments.
const READ_NAME: [u8; 8] = [0x40, 0x08, 0x10, 0, 0, 0, 0, 0];

/// A download in segments: the length that is announced, and the segments.
type Download = (Option<u32>, &'static [&'static [u8]]);

/// The initiation of a download in segments, with the length if there is one.
fn announced(index: u16, sub: u8, length: Option<u32>) -> [u8; 8] {
    let [low, high] = index.to_le_bytes();
    let [a, b, c, d] = length.unwrap_or_default().to_le_bytes();
    [0x20 | u8::from(length.is_some()), low, high, sub, a, b, c, d]
}

/// A segment of a download.
fn segment(data: &[u8], toggle: bool, last: bool) -> [u8; 8] {
    let mut request = [u8::from(toggle) << 4 | (7 - data.len() as u8) << 1 | u8::from(last), 0, 0, 0, 0, 0, 0, 0];
    request[1..=data.len()].copy_from_slice(data);
    request
}

/// The code that a request is refused with.
fn refused(rig: &mut Rig, request: [u8; 8]) -> u32 {
    checked(rig.request(request)).expect_err("the request is refused")
}

/// Writes data in segments of the lengths given.
pub(crate) fn write_in_segments(
    rig: &mut Rig,
    place: (u16, u8),
    length: Option<u32>,
    segments: &[&[u8]],
) -> Result<(), u32> {
    let [low, high] = place.0.to_le_bytes();
    let reply = rig.request(announced(place.0, place.1, length));
    checked(reply)?;
    assert_eq!(reply, [0x60, low, high, place.1, 0, 0, 0, 0]);
    for (n, data) in segments.iter().enumerate() {
        let reply = rig.request(segment(data, n % 2 == 1, n + 1 == segments.len()));
        checked(reply)?;
        assert_eq!(reply, [0x20 | (n as u8 % 2) << 4, 0, 0, 0, 0, 0, 0, 0]);
    }
    Ok(())
}

#[test]
fn uploads_of_each_size() {
    let mut rig = Rig::new();
    // Expedited, with the length in the command: one, two, three and four bytes.
    assert_eq!(rig.request([0x40, 0x01, 0x10, 0, 9, 9, 9, 9]), [0x4F, 0x01, 0x10, 0, 0, 0, 0, 0]);
    assert_eq!(rig.request([0x40, 0x04, 0x27, 0, 0, 0, 0, 0]), [0x4B, 0x04, 0x27, 0, 0xE8, 3, 0, 0]);
    assert_eq!(rig.request([0x40, 0x09, 0x10, 0, 0, 0, 0, 0]), [0x47, 0x09, 0x10, 0, b'1', b'.', b'0', 0]);
    assert_eq!(rig.request([0x40, 0x0A, 0x10, 0, 0, 0, 0, 0]), [0x43, 0x0A, 0x10, 0, b'3', b'.', b'2', b'0']);
    // A negative number in its own length.
    assert_eq!(rig.request([0x40, 0x6A, 0x60, 0, 0, 0, 0, 0]), [0x4B, 0x6A, 0x60, 0, 0xFF, 0xFF, 0, 0]);
    // In segments: seven, eight and nine bytes.
    assert_eq!(rig.request([0x40, 0x23, 0x10, 3, 0, 0, 0, 0]), [0x41, 0x23, 0x10, 3, 7, 0, 0, 0]);
    assert_eq!(rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x01, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.request([0x40, 0x0B, 0x21, 3, 0, 0, 0, 0]), [0x41, 0x0B, 0x21, 3, 8, 0, 0, 0]);
    assert_eq!(rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), [0x00, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.request([0x70, 0, 0, 0, 0, 0, 0, 0]), [0x1D, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(rig.request(READ_NAME), [0x41, 0x08, 0x10, 0, 9, 0, 0, 0]);
    assert_eq!(&rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), b"\x00TMCM-11");
    assert_eq!(&rig.request([0x70, 0, 0, 0, 0, 0, 0, 0]), b"\x1B40\0\0\0\0\0");
    // It is over.
    assert_eq!(refused(&mut rig, [0x60, 0, 0, 0, 0, 0, 0, 0]), COMMAND);
}

#[test]
fn expedited_downloads_of_each_size() {
    let mut rig = Rig::new();
    for (place, data) in [((0x2003, 0), &[200][..]), ((0x2001, 0), &[0x34, 2]), ((0x607A, 0), &[1, 2, 3, 0xFF])] {
        assert_eq!(rig.download(place.0, place.1, data), Ok(()));
        assert_eq!(rig.upload(place.0, place.1).as_deref(), Ok(data));
        // The same without the length in the command: it is that of the object.
        let mut request = expedited(place.0, place.1, data);
        request[0] = 0x22;
        request[4] = 0x55;
        assert_eq!(checked(rig.request(request)), Ok(()));
        let mut expected = data.to_vec();
        expected[0] = 0x55;
        assert_eq!(rig.upload(place.0, place.1), Ok(expected));
    }
    for (place, size) in [((0x2003, 0), 1), ((0x2001, 0), 2), ((0x607A, 0), 4)] {
        let before = rig.upload(place.0, place.1);
        for length in (1..=4).filter(|length| *length != size) {
            let code = if length > size { TOO_LONG } else { TOO_SHORT };
            assert_eq!(rig.download(place.0, place.1, &[1; 4][..length]), Err(code), "{place:04X?}");
        }
        assert_eq!(rig.upload(place.0, place.1), before);
    }
}

#[test]
fn downloads_in_segments() {
    let mut rig = Rig::new();
    let target = (0x607A, 0);
    let cases: [Download; 6] = [
        (Some(4), &[&[1, 2, 3, 4]]),
        (None, &[&[2, 3, 4, 5]]),
        (Some(4), &[&[3], &[4], &[5], &[6]]),
        (None, &[&[4, 5, 6], &[7]]),
        (Some(4), &[&[], &[5, 6], &[7, 8], &[]]),
        (None, &[&[6, 7], &[], &[8, 9]]),
    ];
    for (n, (length, segments)) in cases.into_iter().enumerate() {
        assert_eq!(write_in_segments(&mut rig, target, length, segments), Ok(()), "case {n}");
        let n = n as u8 + 1;
        assert_eq!(rig.upload(target.0, 0), Ok(vec![n, n + 1, n + 2, n + 3]));
    }
    assert_eq!(write_in_segments(&mut rig, (0x2003, 0), Some(1), &[&[33]]), Ok(()));
    assert_eq!(write_in_segments(&mut rig, (0x2001, 0), None, &[&[44, 0]]), Ok(()));
    assert_eq!((rig.read(0x2003, 0), rig.read(0x2001, 0)), (33, 44));
    // Lengths that are wrong, at once or in the end.
    let cases: [(Download, u32); 8] = [
        ((Some(5), &[]), TOO_LONG),
        ((Some(u32::MAX), &[]), TOO_LONG),
        ((Some(3), &[]), TOO_SHORT),
        ((Some(0), &[]), TOO_SHORT),
        ((Some(4), &[&[1, 2, 3]]), LENGTH),
        ((None, &[&[1, 2, 3]]), TOO_SHORT),
        ((Some(4), &[&[1, 2, 3], &[4, 5]]), TOO_LONG),
        ((None, &[&[1, 2, 3, 4, 5, 6, 7]]), TOO_LONG),
    ];
    let before = rig.upload(target.0, 0);
    for ((length, segments), code) in cases {
        assert_eq!(write_in_segments(&mut rig, target, length, segments), Err(code), "{length:?} {segments:?}");
        assert_eq!(refused(&mut rig, segment(&[1], false, true)), COMMAND);
        assert_eq!(rig.upload(target.0, 0), before);
    }
    // The value is looked at in the end.
    assert_eq!(write_in_segments(&mut rig, (0x6060, 0), Some(1), &[&[4]]), Err(VALUE));
    assert_eq!(write_in_segments(&mut rig, (0x2001, 0), None, &[&[0], &[0]]), Err(0x0609_0032));
    // What is not there, or not written, is refused at once.
    assert_eq!(refused(&mut rig, announced(0x6041, 0, Some(2))), 0x0601_0002);
    assert_eq!(refused(&mut rig, announced(0x5FFF, 0, None)), 0x0602_0000);
    assert_eq!(refused(&mut rig, announced(0x1010, 3, None)), 0x0609_0011);
}

#[test]
fn wrong_toggle_bits_end_a_transfer() {
    let mut rig = Rig::new();
    let before = rig.upload(0x607A, 0);
    for place in 0..2 {
        // Up.
        rig.request(READ_NAME);
        if place == 1 {
            rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]);
        }
        let wrong = rig.request([if place == 0 { 0x70 } else { 0x60 }, 0, 0, 0, 0, 0, 0, 0]);
        assert_eq!(wrong, [0x80, 0x08, 0x10, 0, 0, 0, 3, 5]);
        assert_eq!(refused(&mut rig, [0x60, 0, 0, 0, 0, 0, 0, 0]), COMMAND);
        // Down.
        rig.request(announced(0x607A, 0, Some(4)));
        if place == 1 {
            rig.request(segment(&[1, 2], false, false));
        }
        let wrong = rig.request(segment(&[3, 4], place == 0, true));
        assert_eq!((checked(wrong), &wrong[1..4]), (Err(TOGGLE), &[0x7A, 0x60, 0][..]));
        assert_eq!(refused(&mut rig, segment(&[1], false, true)), COMMAND);
    }
    assert_eq!(rig.upload(0x607A, 0), before);
}

/// An abort is not answered, in no state; and a transfer begins anew with any initiation.
#[test]
fn aborts_and_new_transfers_in_the_middle() {
    let mut rig = Rig::new();
    rig.frames();
    let abort = [0x80, 0x08, 0x10, 0, 0, 0, 4, 5];
    let begin = [READ_NAME, announced(0x607A, 0, Some(4)), [0x40, 0, 0x10, 0, 0, 0, 0, 0]];
    for first in begin {
        rig.request(first);
        rig.send(0x601, &abort);
        rig.wait(5);
        assert!(rig.of(0x581).is_empty());
        assert_eq!(refused(&mut rig, [0x60, 0, 0, 0, 0, 0, 0, 0]), COMMAND);
        assert_eq!(refused(&mut rig, segment(&[1], false, true)), COMMAND);
        for second in begin {
            rig.request(first);
            assert!(checked(rig.request(second)).is_ok());
            if second == READ_NAME {
                assert_eq!(&rig.request([0x60, 0, 0, 0, 0, 0, 0, 0]), b"\x00TMCM-11");
            }
        }
    }
    // A segment of the other direction ends the transfer.
    rig.request(READ_NAME);
    assert_eq!(refused(&mut rig, segment(&[1], false, true)), COMMAND);
    assert_eq!(refused(&mut rig, [0x60, 0, 0, 0, 0, 0, 0, 0]), COMMAND);
}

/// Block transfers and the command that is none.
#[test]
fn unknown_commands() {
    let mut rig = Rig::new();
    for command in [0xA0, 0xA1, 0xC0, 0xC6, 0xE0, 0xFF] {
        assert_eq!(rig.request([command, 0x08, 0x10, 0, 0, 0, 0, 0]), [0x80, 0x08, 0x10, 0, 1, 0, 4, 5]);
    }
}

/// A request that is shorter than a frame is refused; an empty abort byte stays unanswered.
#[test]
fn short_requests() {
    let mut rig = Rig::new();
    rig.frames();
    for length in 0..8 {
        rig.request(READ_NAME);
        rig.send(0x601, &READ_NAME[..length]);
        let mut expected = [0x80, 0, 0, 0, 1, 0, 4, 5];
        let known = length.clamp(1, 4);
        expected[1..known].copy_from_slice(&READ_NAME[1..known]);
        assert_eq!(rig.of(0x581), [expected]);
        assert_eq!(refused(&mut rig, [0x60, 0, 0, 0, 0, 0, 0, 0]), COMMAND);
    }
    rig.send(0x601, &[0x80]);
    rig.send_remote(0x601, 8);
    assert!(rig.of(0x581).is_empty());
}

/// TMCL mode, and what is written in it alone.
#[test]
fn what_belongs_to_tmcl_mode_is_refused() {
    let mut rig = Rig::new();
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), Some(7), &[&[1; 7]]), Err(STATE));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), None, &[&[1; 7]]), Err(STATE));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), Some(8), &[]), Err(TOO_LONG));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), Some(6), &[]), Err(TOO_SHORT));
    assert_eq!(write_in_segments(&mut rig, (0x1023, 1), None, &[&[1; 6]]), Err(TOO_SHORT));
    assert_eq!(rig.download(0x1023, 1, &[1; 4]), Err(TOO_SHORT));
    assert_eq!(refused(&mut rig, [0x22, 0x23, 0x10, 1, 1, 1, 1, 1]), TOO_SHORT);
    assert_eq!(rig.download(0x2700, 0, &[0; 4]), Err(VALUE));
    assert_eq!(rig.read(0x2700, 0), 0);
}

/// Only the signatures switch the manufacturer specific mode.
#[test]
fn manufacturer_specific_mode() {
    let mut rig = Rig::new();
    for (signature, result, mode) in [
        (b"kill", Ok(()), 0),
        (b"make", Ok(()), 1),
        (b"save", Err(VALUE), 1),
        (b"make", Ok(()), 1),
        (b"kill", Ok(()), 0),
    ] {
        assert_eq!(rig.download(0x2701, 0, signature), result);
        assert_eq!(rig.read(0x2701, 0), mode);
    }
}

/// Other nodes' requests are not answered.
#[test]
fn requests_to_others() {
    let mut rig = Rig::new();
    rig.wait(2);
    rig.frames();
    for id in [0x600, 0x602, 0x67F, 0x580, 0x581, 0x581] {
        rig.send(id, &READ_NAME);
    }
    rig.wait(5);
    assert!(rig.frames().is_empty());
}
