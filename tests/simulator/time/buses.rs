//! How much time requests on the buses take while nothing else lets time pass.

use hal_sim::clock::{MICROSECOND, MILLISECOND, Nanos, SECOND};
use tmcm::can::{CanFrame, Frame, StandardId};
use tmcm_sim::FirmwareKind;

use super::rig::{ADAPTER, HOST, Paused, id, replies, sdo_read, sdo_write, telegram, tmcl_frame};

/// Nine bytes of ten bits at 9600 bit/s.
const TELEGRAM: Nanos = 9 * (10 * SECOND / 9600);
/// A frame with eight bytes at 1 Mbit/s.
const FRAME: Nanos = 111 * MICROSECOND;
/// Longest time for which the firmware is busy with something else, or with the request.
const ATTENTION: Nanos = 200 * MICROSECOND;

#[test]
fn a_request_on_rs485_takes_the_time_of_its_reply_on_the_wire() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 3);
    for address in [1, 2, 3] {
        let (bytes, took) = paused.exchange_rs485(address, "GAP 4, 0");
        assert_eq!(
            replies(&bytes).iter().map(|reply| (reply.module, reply.value)).collect::<Vec<_>>(),
            [(address, 1000)]
        );
        assert!((TELEGRAM..TELEGRAM + ATTENTION).contains(&took), "{took}");
    }
    // The pause before the reply counts as well.
    paused.exchange_rs485(2, "SGP 75, 0, 40");
    let (bytes, took) = paused.exchange_rs485(2, "GAP 4, 0");
    assert_eq!(bytes.len(), 9);
    assert!((40 * MILLISECOND + TELEGRAM..40 * MILLISECOND + TELEGRAM + ATTENTION).contains(&took), "{took}");
    assert_eq!(paused.fleet.answered(), 5);
}

#[test]
fn what_nobody_answers_on_rs485_takes_next_to_no_time() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 3);
    assert!(paused.exchange_rs485(9, "GAP 4, 0").0.is_empty());
    let answered = paused.fleet.answered();
    let (bytes, took) = paused.exchange_rs485(3, "137, 0, 0, 1234");
    assert!(bytes.is_empty() && took < ATTENTION, "{took}");
    assert_eq!(paused.fleet.answered(), answered + 1);
    paused.fleet.send_rs485(&telegram(1, "GAP 4, 0")[..8]);
    assert_eq!(paused.serve(), 0);
}

#[test]
fn an_event_on_rs485_moves_no_time() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 2);
    paused.exchange_rs485(1, "138, 0, 0, 1");
    let (_, took) = paused.exchange_rs485(1, "MVP REL, 0, 1");
    let end = paused.fleet.now() + 100 * MILLISECOND;
    // While the event is on the wire.
    while paused.fleet.rs485().is_empty() {
        assert!(paused.fleet.now() < end);
        paused.fleet.run(100 * MICROSECOND);
    }
    assert_eq!(paused.serve(), 0);
    let answered = paused.fleet.answered();
    paused.fleet.run(20 * MILLISECOND);
    assert_eq!(paused.fleet.rs485().len(), 8);
    assert_eq!((paused.fleet.answered(), took < 2 * TELEGRAM), (answered, true));
}

#[test]
fn a_request_on_can_takes_the_time_of_two_frames() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 3);
    for number in [1, 3] {
        let (heard, took) = paused.exchange_can(tmcl_frame(number, "GAP 4, 0"));
        assert_eq!(heard.len(), 1);
        assert_eq!(heard[0].frame.data(), [number as u8, 100, 6, 0, 0, 3, 0xE8, 0]);
        assert!((2 * FRAME..2 * FRAME + ATTENTION).contains(&took), "{took}");
    }
    assert_eq!(paused.fleet.answered(), 2);
    // Nobody has this identifier: only the frame takes time.
    let (heard, took) = paused.exchange_can(tmcl_frame(77, "GAP 4, 0"));
    assert!(heard.is_empty() && (FRAME..FRAME + ATTENTION).contains(&took), "{took}");
    // This has no reply, and costs nothing: it goes out with the time that passes next.
    assert_eq!(paused.exchange_can(tmcl_frame(3, "137, 0, 0, 1234")).1, 0);
    assert_eq!(paused.fleet.answered(), 3);
}

#[test]
fn a_store_on_can_takes_as_long_as_the_eeprom() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 1);
    paused.exchange_can(tmcl_frame(1, "SAP 4, 0, 321"));
    let (heard, took) = paused.exchange_can(tmcl_frame(1, "STAP 4, 0"));
    assert_eq!(heard.len(), 1);
    assert!((5 * MILLISECOND..50 * MILLISECOND).contains(&took), "{took}");
}

#[test]
fn the_links_share_the_time() {
    let mut paused = Paused::of(FirmwareKind::Tmcl, 3);
    paused.fleet.hear_usb(HOST, &telegram(1, "GAP 4, 0"));
    paused.fleet.send_rs485(&telegram(2, "GAP 4, 0"));
    paused.fleet.send_can(ADAPTER, tmcl_frame(3, "GAP 4, 0"));
    let took = paused.serve();
    assert!((TELEGRAM..TELEGRAM + ATTENTION).contains(&took), "{took}");
    assert_eq!((paused.sent().len(), paused.fleet.rs485().len(), paused.heard().len()), (1, 9, 1));
    assert_eq!(paused.fleet.answered(), 3);
}

#[test]
fn of_a_canopen_node_only_requests_take_time() {
    let mut paused = Paused::of(FirmwareKind::Canopen, 2);
    // The frames that each node sends after its start.
    paused.fleet.run(10 * MILLISECOND);
    paused.heard();
    let (heard, took) = paused.exchange_can(sdo_read(1, 0x1018, 1));
    assert_eq!(heard.iter().filter_map(id).collect::<Vec<_>>(), [0x581]);
    assert!((2 * FRAME..2 * FRAME + ATTENTION).contains(&took), "{took}");
    for (id, data) in [(0, &[1, 0][..]), (0x80, &[]), (0x201, &[6, 0]), (0x601, &[0x80, 0, 0x10, 0, 0, 0, 0, 0])] {
        assert_eq!(paused.exchange_can(Frame::standard(id, data).unwrap()).1, 0, "{id:x}");
    }
    // They, and the PDOs of a node that is started, go out before the next request.
    let (heard, took) = paused.exchange_can(sdo_read(2, 0x1018, 1));
    assert!(heard.iter().filter_map(id).any(|id| id == 0x582));
    assert!((5 * FRAME..12 * FRAME).contains(&took), "{took}");
    let (heard, took) = paused.exchange_can(sdo_read(3, 0x1018, 1));
    assert!(heard.iter().filter_map(id).all(|id| id != 0x583) && took < 2 * FRAME + ATTENTION, "{took}");
    let answered = paused.fleet.answered();
    let guard = Frame::new_remote(StandardId::new(0x701).unwrap(), 1).unwrap();
    let (heard, took) = paused.exchange_can(guard);
    assert_eq!(heard.iter().filter_map(id).collect::<Vec<_>>(), [0x701]);
    // The first has no data, the second one byte.
    assert!((FRAME / 2..FRAME + ATTENTION).contains(&took), "{took}");
    assert_eq!(paused.fleet.answered(), answered + 1);
}

#[test]
fn heartbeats_move_no_time() {
    let mut paused = Paused::of(FirmwareKind::Canopen, 1);
    paused.exchange_can(sdo_write(1, 0x1017, 0, &[1, 0]));
    for _ in 0..20 {
        paused.fleet.run(300 * MICROSECOND);
        assert_eq!(paused.serve(), 0);
        let (heard, took) = paused.exchange_can(sdo_read(1, 0x1017, 0));
        assert!(heard.iter().filter_map(id).any(|id| id == 0x581));
        assert!(took < 3 * FRAME + ATTENTION, "{took}");
        // A node that is not there is not waited for.
        assert!(paused.exchange_can(sdo_read(9, 0x1017, 0)).1 < 3 * FRAME + ATTENTION);
    }
}

#[test]
fn saving_takes_as_long_as_the_eeprom() {
    let mut paused = Paused::of(FirmwareKind::Canopen, 1);
    paused.exchange_can(sdo_write(1, 0x6083, 0, &[1, 2, 0, 0]));
    let (heard, took) = paused.exchange_can(sdo_write(1, 0x1010, 1, b"save"));
    let reply = heard.iter().find(|heard| id(heard) == Some(0x581)).expect("no reply");
    assert_eq!(reply.frame.data()[0], 0x60);
    assert!((5 * MILLISECOND..SECOND).contains(&took), "{took}");
}

/// Number of the first request that is answered, of ten.
fn answered(mut ask: impl FnMut() -> bool) -> Option<usize> {
    (1..=10).find(|_| ask())
}

#[test]
fn who_asks_again_on_a_bus_until_the_module_is_back_gets_on() {
    let mut paused = Paused::new();
    paused.exchange_rs485(1, "255, 0, 0, 1234");
    assert_eq!(answered(|| !paused.exchange_rs485(1, "GAP 1, 0").0.is_empty()), Some(2));
    paused.exchange_can(tmcl_frame(1, "255, 0, 0, 1234"));
    assert_eq!(answered(|| !paused.exchange_can(tmcl_frame(1, "GAP 1, 0")).0.is_empty()), Some(2));
    let mut node = Paused::of(FirmwareKind::Canopen, 1);
    node.exchange_can(Frame::standard(0, &[0x81, 1]).unwrap());
    let mut read = || node.exchange_can(sdo_read(1, 0x1000, 0)).0.iter().any(|heard| id(heard) == Some(0x581));
    assert_eq!(answered(&mut read), Some(2));
}
